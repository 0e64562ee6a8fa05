"""Which logs lie in the directory? Unfinished ones are recovered, the oldest make room."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
import fcntl
import os
from pathlib import Path
import re
import subprocess
import sys

from mcap.opcode import Opcode
from mcap.reader import SeekingReader
from mcap.writer import MCAP0_MAGIC

from rotorsoil_ros.bags import metadata as bag_metadata, reader as bag_reader
from rotorsoil_ros.bags.metadata import Contents, FileEntry, Topic
from rotorsoil_ros.errors import InputError

RECOVERED = '_recovered'
OPENING = 64  # bytes in which a file says who wrote it
PARTS = ('.mcap', '.rrd', '.tmp', '.partial')

Tell = Callable[[str], object]


def is_own(file: Path) -> bool:
    """Return whether an MCAP file was written by this package."""
    with suppress(OSError), file.open('rb') as stream:
        opening = stream.read(OPENING)
        return (opening.startswith(MCAP0_MAGIC) and opening[8:9] == bytes([Opcode.HEADER])
                and bag_metadata.WRITER.encode() in opening)
    return False


def is_unfinished(file: Path) -> bool:
    """Return whether the writer of an MCAP file has died before it could finish it."""
    with suppress(OSError), file.open('rb') as stream:
        fcntl.flock(stream, fcntl.LOCK_SH | fcntl.LOCK_NB)  # refused while the writer lives
        size = os.fstat(stream.fileno()).st_size
        stream.seek(max(0, size - len(MCAP0_MAGIC)))
        return stream.read() != MCAP0_MAGIC or size < 2 * len(MCAP0_MAGIC)
    return False


def unfinished(directory: Path) -> Iterator[Path]:
    """Yield files of dead writers in the bags of a directory, if nobody has saved them yet."""
    for file in sorted(directory.glob('*/*.mcap')):
        if not beside(file).exists() and is_own(file) and is_unfinished(file):
            yield file


def beside(file: Path) -> Path:
    """Return where a file is recovered to."""
    return file.with_name(f'{file.stem}{RECOVERED}.mcap')


class Recovery:
    """
    Recovers the logs that a dead process has left, one after the other.

    In processes of their own: neither the start nor an answer waits for gigabytes.
    """

    def __init__(self, directory: Path, *, tell: Tell, complain: Tell) -> None:
        self._tell, self._complain = tell, complain
        self._left = list(unfinished(directory))
        self._file: Path | None = None
        self._process: subprocess.Popen[str] | None = None
        self.step()

    @property
    def is_done(self) -> bool:
        """Whether nothing is left to do."""
        return self._process is None and not self._left

    def step(self) -> None:
        """Look after the process; start the next one."""
        if self._process is not None and self._process.poll() is not None:
            self._finish(self._process, self._file)
            self._process = None
        if self._process is None and self._left:
            self._file = self._left.pop(0)
            self._process = subprocess.Popen(
                [sys.executable, '-m', 'rotorsoil_ros.cli', 'recover', str(self._file), '-o',
                 str(beside(self._file))], stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                text=True)

    def close(self) -> None:
        """Leave the rest to the next start."""
        self._left = []
        if self._process is not None:
            self._process.terminate()
            self._process.communicate()
            self._process = None

    def _finish(self, process: 'subprocess.Popen[str]', file: Path | None) -> None:
        said, _ = process.communicate()
        if process.returncode or file is None:
            self._complain(f'{file} is unfinished and could not be recovered: {said.strip()}')
            return
        self._tell(f'{file} was never finished; recovered as {said.strip()}')
        try:
            describe(file.parent)
        except (OSError, InputError) as error:
            self._complain(f'{file.parent}: metadata could not be renewed: {error}')


def describe(bag: Path) -> None:
    """Write the metadata of a bag anew, naming recovered files instead of the broken ones."""
    files = [file for file in bag_reader.files_in(bag) if not beside(file).exists()]
    entries: list[FileEntry] = []
    topics: dict[str, Topic] = {}
    counts = []
    for file in files:
        if not is_unfinished(file):
            entry, own, count = _summary(file)
            entries.append(entry)
            topics |= own
            counts.append(count)
    bag_metadata.write(
        bag, Contents(entries, topics, bag_metadata.total(counts)),
        {'recovered': ', '.join(file.name for file in files if RECOVERED in file.stem)})


def _summary(file: Path) -> tuple[FileEntry, dict[str, Topic], dict[str, int]]:
    with bag_reader.opened(file) as stream:
        summary = SeekingReader(
            stream, record_size_limit=bag_reader.LARGEST_RECORD).get_summary()
    if summary is None or summary.statistics is None:
        raise InputError(f'{file}: has no summary of its topics')
    said = summary.statistics
    topics, counts = {}, {}
    for channel in summary.channels.values():
        schema = summary.schemas.get(channel.schema_id)
        latched = 'transient_local' in channel.metadata.get('offered_qos_profiles', '')
        topics[channel.topic] = Topic(channel.topic, schema.name if schema else '', latched)
        counts[channel.topic] = said.channel_message_counts.get(channel.id, 0)
    entry = FileEntry(file.name, said.message_start_time,
                      said.message_end_time - said.message_start_time, said.message_count)
    return entry, topics, counts


def make_room(
    directory: Path, name: str, *, budget: int, current: Path, keep: Sequence[Path],
) -> list[Path]:
    """
    Remove the oldest logs until what is left fits into a budget; return what was removed.

    Whole bags go first, then files and recordings of the current one. A directory counts as a
    log if it is named like one and holds an MCAP file that this package wrote; whatever else
    lies in it stays.

    Parameters
    ----------
    directory, name : Path, str
        Where logs lie, and how they are named.
    budget : int
        Bytes that they may take.
    current : Path
        The bag that is being written.
    keep : sequence of Path
        Files that are being written.

    """
    bags = [bag for bag in own_bags(directory, name) if bag != current]
    bags.sort(key=lambda bag: _age(bag / bag_metadata.FILE_NAME))
    sizes = {bag: sum(map(_size, _parts(bag))) for bag in (*bags, current)}
    excess = sum(sizes.values()) - budget
    removed: list[Path] = []
    for bag in bags:
        if excess <= 0:
            return removed
        _remove_bag(bag)
        excess -= sizes[bag]
        removed.append(bag)
    recordings = sorted(current.glob('*.rrd'), key=_age)
    # The newest recording is being written, whatever it is called.
    for file in sorted([*current.glob('*.mcap'), *recordings[:-1]], key=_age):
        if excess > 0 and file not in keep:
            excess -= _size(file)
            file.unlink(missing_ok=True)
            removed.append(file)
    return removed


def own_bags(directory: Path, name: str) -> list[Path]:
    """Return the bags of this name in a directory that this package wrote and nobody writes."""
    named = re.compile(re.escape(name) + r'(_\d+)?')
    return [bag for bag in directory.iterdir()
            if named.fullmatch(bag.name) and bag.is_dir() and not bag.is_symlink()
            and _is_finished_bag(bag)]


def _is_finished_bag(bag: Path) -> bool:
    files = list(bag.glob('*.mcap'))
    return bool(files) and all(is_own(file) and not _is_written(file) for file in files)


def _is_written(file: Path) -> bool:
    with suppress(FileNotFoundError), file.open('rb') as stream:
        try:
            fcntl.flock(stream, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except BlockingIOError:
            return True
    return False


def _remove_bag(bag: Path) -> None:
    for part in _parts(bag):
        part.unlink(missing_ok=True)
    with suppress(OSError):  # something else lies in it, and stays
        bag.rmdir()


def _parts(bag: Path) -> list[Path]:
    return [part for part in bag.iterdir()
            if part.suffix in PARTS or part.name == bag_metadata.FILE_NAME]


def _size(file: Path) -> int:
    with suppress(FileNotFoundError):
        return file.stat().st_size
    return 0


def _age(file: Path) -> int:
    with suppress(FileNotFoundError):
        return file.stat().st_mtime_ns
    return 0
