"""Which logs did a dead writer leave? They are recovered beside themselves, aside."""

from collections.abc import Callable, Iterator
from contextlib import suppress
import fcntl
import os
from pathlib import Path
import threading

from mcap.writer import MCAP0_MAGIC

from rotorsoil_ros.background import Child, Errand
from rotorsoil_ros.bags import metadata as bag_metadata
from rotorsoil_ros.bags.metadata import beside, files_in, RECOVERED, without_recovered
from rotorsoil_ros.bags.recover import describe
from rotorsoil_ros.bags.retention import at_once, is_own
from rotorsoil_ros.errors import InputError

FILES_AT_ONCE = 64  # recovered by one process: its start takes longer than most of them
RECOVERY_GLANCE_S = 0.1  # how soon a process that was to end is ended
RECOVERY_PATIENCE_S = 2.0  # at the end

Tell = Callable[[str], object]


def is_unfinished(file: Path) -> bool:
    """Return whether the writer of an MCAP file has died before it could finish it."""
    with suppress(OSError), at_once(file) as stream:
        fcntl.flock(stream, fcntl.LOCK_SH | fcntl.LOCK_NB)  # refused while the writer lives
        size = os.fstat(stream.fileno()).st_size
        stream.seek(max(0, size - len(MCAP0_MAGIC)))
        return stream.read(len(MCAP0_MAGIC)) != MCAP0_MAGIC or size < 2 * len(MCAP0_MAGIC)
    return False


def unfinished(directory: Path) -> Iterator[Path]:
    """Yield files of dead writers in the bags of a directory, if nobody has saved them yet."""
    for file in sorted(directory.glob('*/*.mcap')):
        if not beside(file).exists() and is_own(file) and is_unfinished(file):
            yield file


def undescribed(directory: Path) -> Iterator[Path]:
    """Yield bags in which a file was recovered of which their metadata does not know."""
    for bag in sorted({file.parent for file in directory.glob(f'*/*{RECOVERED}.mcap')}):
        recovered = {file.name for file in files_in(bag)
                     if RECOVERED in file.stem and is_own(file) and not is_unfinished(file)}
        try:
            listed = bag_metadata.read(bag).get('relative_file_paths', ())
        except InputError:
            listed = ()
        if not recovered <= set(listed):
            yield bag


class Recovery:
    """
    Recovers the logs that a dead process has left, one after the other.

    On a thread and in processes of their own: neither the start nor an answer waits for gigabytes,
    or for a disk that hangs. A bag is described as often as it takes: a process that dies between
    its file and the description leaves the latter to the next start.
    """

    def __init__(self, directory: Path, *, tell: Tell, complain: Tell) -> None:
        self._directory = directory
        self._tell, self._complain = tell, complain
        self._is_over = threading.Event()
        self._errand = Errand(self._recover, name='recovery')
        if not self._errand.has_begun:
            complain(f'{directory}: is not searched for unfinished logs: {self._errand.failure}')

    @property
    def is_done(self) -> bool:
        """Whether nothing is left to do."""
        return self._errand.is_done

    def wait(self, longest_s: float) -> None:
        """Wait until nothing is left to do, or that takes too long."""
        self._errand.wait(longest_s)

    def close(self) -> None:
        """Leave the rest to the next start."""
        self._is_over.set()
        self._errand.wait(RECOVERY_PATIENCE_S)

    def _recover(self) -> None:
        try:
            for bag in undescribed(self._directory):
                self._describe(bag)
            files = list(unfinished(self._directory))
            for at in range(0, len(files), FILES_AT_ONCE):
                self._save(files[at:at + FILES_AT_ONCE])
        except OSError as error:
            self._complain(f'{self._directory}: cannot be searched for unfinished logs: '
                           f'{error.strerror}')

    def _save(self, files: list[Path]) -> None:
        """Let a process recover files, and describe their bags."""
        if self._is_over.is_set():
            return
        child = Child('rotorsoil_ros.bags.recover', [str(file) for file in files])
        while not child.has_ended(wait_s=RECOVERY_GLANCE_S):
            if self._is_over.is_set():
                child.kill()
        for file in files:
            if beside(file).exists():
                said = _said_of(beside(file), child) or f'{beside(file)}'
                self._tell(f'{file} was never finished; recovered as {said}')
                self._describe(file.parent)
            elif not self._is_over.is_set():
                self._complain(f'{file} is unfinished and could not be recovered: '
                               f'{_said_of(file, child) or child.failure}')

    def _describe(self, bag: Path) -> None:
        """Write the metadata anew, naming recovered files instead of the broken ones."""
        try:
            files = [file for file in without_recovered(files_in(bag))
                     if not is_unfinished(file)]
            recovered = ', '.join(file.name for file in files if RECOVERED in file.stem)
            describe(bag, files, {**_gaps(bag), 'recovered': recovered})
        except (OSError, InputError) as error:
            self._complain(f'{bag}: metadata could not be renewed: {error}')


def _said_of(file: Path, child: Child) -> str:
    """Return the line in which a process tells of a file."""
    return next((line for line in child.lines if line.startswith(f'{file}: ')), '')


def _gaps(bag: Path) -> dict[str, str]:
    """Return the gaps that a bag knows of; none if nobody can read its metadata any more."""
    try:
        return bag_metadata.gaps(bag)
    except InputError:
        return {}
