"""Which logs did a dead writer leave? They are recovered beside themselves, aside."""

from collections.abc import Callable, Iterator
from contextlib import suppress
import fcntl
from functools import partial
import os
from pathlib import Path

from mcap.writer import MCAP0_MAGIC

from rotorsoil_ros.background import Child, Children
from rotorsoil_ros.bags import metadata as bag_metadata
from rotorsoil_ros.bags.metadata import beside, files_in, RECOVERED, without_recovered
from rotorsoil_ros.bags.recover import describe
from rotorsoil_ros.bags.retention import is_own
from rotorsoil_ros.errors import InputError

Tell = Callable[[str], object]


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

    In processes of their own: neither the start nor an answer waits for gigabytes. A bag is
    described as often as it takes: a process that dies between its file and the description
    leaves the latter to the next start.
    """

    def __init__(self, directory: Path, *, tell: Tell, complain: Tell) -> None:
        self._tell, self._complain = tell, complain
        self._children = Children()
        try:
            for bag in undescribed(directory):
                self._describe(bag)
            for file in unfinished(directory):
                self._children.ask(
                    str(file), partial(Child, 'rotorsoil_ros.bags.recover', [str(file)]),
                    partial(self._finish, file))
        except OSError as error:
            complain(f'{directory}: cannot be searched for unfinished logs: {error.strerror}')
        self.step()

    @property
    def is_done(self) -> bool:
        """Whether nothing is left to do."""
        return self._children.are_done

    def step(self) -> None:
        """Look after the process; start the next one."""
        self._children.step()

    def close(self) -> None:
        """Leave the rest to the next start."""
        self._children.close()

    def _finish(self, file: Path, child: Child) -> None:
        if child.failure:
            self._complain(f'{file} is unfinished and could not be recovered: {child.failure}')
            return
        self._tell(f'{file} was never finished; recovered as {child.said}')
        self._describe(file.parent)

    def _describe(self, bag: Path) -> None:
        """Write the metadata anew, naming recovered files instead of the broken ones."""
        try:
            files = [file for file in without_recovered(files_in(bag))
                     if not is_unfinished(file)]
            recovered = ', '.join(file.name for file in files if RECOVERED in file.stem)
            describe(bag, files, {**_gaps(bag), 'recovered': recovered})
        except (OSError, InputError) as error:
            self._complain(f'{bag}: metadata could not be renewed: {error}')


def _gaps(bag: Path) -> dict[str, str]:
    """Return the gaps that a bag knows of; none if nobody can read its metadata any more."""
    try:
        return bag_metadata.gaps(bag)
    except InputError:
        return {}
