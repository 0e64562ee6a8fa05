"""How much may the logs of a name take? The oldest make room, and nothing else ever does."""

from collections.abc import Callable
from contextlib import suppress
import fcntl
from itertools import chain
import json
import os
from pathlib import Path
import re
from typing import BinaryIO

from mcap.opcode import Opcode
from mcap.writer import MCAP0_MAGIC

from rotorsoil_ros.bags import metadata as bag_metadata
from rotorsoil_ros.bags.metadata import RECOVERED

MARKER = '.rotorsoil_log'
MARKER_BYTES = 4096  # and more is none of ours
OPENING_BYTES = 64  # bytes in which a file says who wrote it

Tell = Callable[[str], object]


def new_directory(directory: Path, name: str) -> Path:
    """
    Make and return the first of `name`, `name_2`, `name_3`... that does not exist.

    What exists is never touched. A marker in it says whose log it is: `run_2` may be the second
    log called `run` or the first one called `run_2`.
    """
    directory.mkdir(parents=True, exist_ok=True)
    path, number = directory / name, 1
    while True:
        try:
            path.mkdir()
        except FileExistsError:
            number += 1
            path = directory / f'{name}_{number}'
        else:
            break
    said = {'writer': bag_metadata.WRITER, 'log': name, 'directory': path.name}
    (path / MARKER).write_text(json.dumps(said), encoding='utf-8')
    return path


def make_room(
    directory: Path, name: str, *, budget: int, current: Path | None, keep: Path | None,
    complain: Tell,
) -> list[Path]:
    """
    Remove the oldest logs until what is left fits into a budget; return what was removed.

    Whole bags go first, then files and recordings of the current one. What else lies in them
    stays, and so does a bag that somebody has renamed. What cannot be removed is complained of
    and left.

    Parameters
    ----------
    directory, name : Path, str
        Where logs lie, and how they are named.
    budget : int
        Bytes that they may take.
    current, keep : Path or None
        The bag that is being written, and the file of it that is.
    complain : callable
        Hears what could not be removed.

    """
    bags = [bag for bag in own_bags(directory, name) if bag != current]
    bags.sort(key=lambda bag: _age(bag / bag_metadata.FILE_NAME))
    own = [] if current is None else _parts(current)
    excess = sum(_size(part) for part in [*own, *chain.from_iterable(map(_parts, bags))]) - budget
    removed: list[Path] = []
    for bag in bags:
        if excess <= 0:
            return removed
        freed = _remove_bag(bag, complain)
        excess -= freed
        removed += [bag] if freed else []
    # The newest recording is being written, whatever it is called.
    recordings = sorted([part for part in own if part.suffix == '.rrd'], key=_age)
    held = {keep, *recordings[-1:]}
    for file in sorted([part for part in own if part.suffix in ('.mcap', '.rrd')], key=_age):
        if excess > 0 and file not in held and (freed := _remove(file, complain)):
            excess -= freed
            removed.append(file)
    return removed


def own_bags(directory: Path, name: str) -> list[Path]:
    """Return the bags of the log of this name in a directory, save those that are written."""
    with suppress(OSError):
        return [bag for bag in directory.iterdir()
                if _log_of(bag) == name and _is_at_rest(bag)]
    return []


def at_once(file: Path) -> BinaryIO:
    """Open what may be anything to read: a pipe to which nobody writes must hold nobody up."""
    return open(file, 'rb', opener=lambda path, flags: os.open(path, flags | os.O_NONBLOCK))


def is_own(file: Path) -> bool:
    """Return whether an MCAP file was written by this package."""
    with suppress(OSError), at_once(file) as stream:
        opening = stream.read(OPENING_BYTES)
        return (opening.startswith(MCAP0_MAGIC) and opening[8:9] == bytes([Opcode.HEADER])
                and bag_metadata.WRITER.encode() in opening)
    return False


def _log_of(bag: Path) -> str:
    """Return of which log a directory is a bag; nothing of what is none, or was renamed."""
    with suppress(OSError, ValueError, TypeError, KeyError):
        with at_once(bag / MARKER) as stream:
            said = json.loads(stream.read(MARKER_BYTES))
        if not bag.is_symlink() and said['directory'] == bag.name:
            return str(said['log'])
    return ''


def _is_at_rest(bag: Path) -> bool:
    files = [part for part in _parts(bag) if part.suffix == '.mcap']
    return bool(files) and not any(_is_written(file) for file in files)


def _is_written(file: Path) -> bool:
    with suppress(OSError), at_once(file) as stream:
        try:
            fcntl.flock(stream, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except BlockingIOError:
            return True
    return False


def _parts(bag: Path) -> list[Path]:
    """Return the files of a bag that this package wrote: by their names, and logs by content."""
    named = re.compile(rf'{re.escape(bag.name)}(_\d+)?({RECOVERED})?\.(mcap|rrd)(\.partial)?'
                       rf'|{re.escape(bag_metadata.FILE_NAME)}(\.tmp)?')
    with suppress(OSError):
        return [part for part in bag.iterdir()
                if named.fullmatch(part.name) and part.is_file() and not part.is_symlink()
                and (part.suffix != '.mcap' or is_own(part) or not _size(part))]
    return []


def _remove_bag(bag: Path, complain: Tell) -> int:
    """Remove what this package wrote; return how many bytes that freed."""
    # A log last: while there is one, the bag is known as one.
    parts = sorted(_parts(bag), key=lambda part: part.suffix == '.mcap')
    freed = sum([_remove(part, complain) for part in parts])
    if not _parts(bag):
        _remove(bag / MARKER, complain)
        with suppress(OSError):  # something else lies in it, and stays
            bag.rmdir()
    return freed


def _remove(file: Path, complain: Tell) -> int:
    """Remove a file; return how many bytes that freed."""
    size = _size(file)
    try:
        file.unlink(missing_ok=True)
    except OSError as error:
        complain(f'{file}: cannot be removed to make room: {error.strerror}')
        return 0
    return size


def _size(file: Path) -> int:
    with suppress(OSError):
        return file.stat().st_size
    return 0


def _age(file: Path) -> int:
    with suppress(OSError):
        return file.stat().st_mtime_ns
    return 0
