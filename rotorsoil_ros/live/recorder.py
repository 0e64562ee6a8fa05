"""What if the disk does not take the bag? The node goes on, and so does the bag when it can."""

from collections.abc import Callable
from contextlib import suppress
import os
from pathlib import Path
import shutil

from rotorsoil_ros.live.bag_writer import BagWriter, MEBIBYTE, new_directory
from rotorsoil_ros.live.events import Diagnostics, Level
from rotorsoil_ros.live.messages import Records
from rotorsoil_ros.live.shelf import make_room

RESERVE = MEBIBYTE  # free space that it takes to begin again
FILES_IN_BUDGET = 8
LOOKS_IN_BUDGET = 64

Tell = Callable[[str], object]


class Recorder:
    """
    Writes a bag in spite of the disk.

    A failure is told once. Until the disk takes files again messages are counted and dropped;
    then a new file begins, and `metadata.yaml` says what is missing before it.
    """

    def __init__(
        self, path: Path, *, split_mib: float, split_s: float, budget_mib: float, tell: Tell,
        complain: Tell,
    ) -> None:
        self._directory, self._name = path.parent, path.name
        self._budget = int(budget_mib * MEBIBYTE)
        largest = budget_mib / FILES_IN_BUDGET
        self._split_mib = min(split_mib or largest, largest) if budget_mib else split_mib
        self._split_s = split_s
        self._tell, self._complain = tell, complain
        self._failure = ''
        self._has_resumed = False
        self._accepted = self._written_before = self._lost_before = 0
        self._lost_until_ns = 0
        self._looked_at = 0
        self._bag = self._new_bag(path)
        self._make_room()

    @property
    def path(self) -> Path:
        """Directory of the bag."""
        return self._bag.path

    @property
    def file(self) -> Path:
        """The file that is being written."""
        return self._bag.file

    def write(self, records: Records) -> None:
        """Log messages of one topic."""
        if self._failure:
            self._miss(records)
            return
        self._accepted += len(records.payloads)
        try:
            self._bag.write(records)
        except OSError as error:
            self._fail(error)

    def flush(self) -> None:
        """Put everything onto the disk, or try whether it works again; call it every second."""
        try:
            if self._failure:
                self._resume()
            else:
                self._bag.flush()
                if self._bag.size - self._looked_at > self._budget / LOOKS_IN_BUDGET:
                    self._make_room()
        except OSError as error:
            self._fail(error)

    def interrupt(self, count: int, until_ns: int, reason: str) -> None:
        """Write down a gap: messages that never came here, until a time [ns], and why."""
        self._accepted += count
        if not self._failure:
            self._failure = reason
            self._bag.abandon()
        self._lost_until_ns = until_ns
        self.flush()

    def close(self) -> None:
        """Finish the bag."""
        try:
            self._bag.close()
        except OSError as error:
            self._fail(error)

    def report(self, now_ns: int) -> Diagnostics:
        """Tell how logging goes."""
        bag, lost = self._bag, self._lost if self._failure else self._lost_before
        if self._failure:
            level, summary = Level.ERROR, f'not logging: {self._failure}'
        elif self._has_resumed:
            level, summary = Level.WARN, f'logging again to {bag.file}, {lost} messages are lost'
        else:
            level, summary = Level.OK, f'logging to {bag.file}'
        self._has_resumed = False
        values = {'written': self._written, 'lost': lost, 'gaps': len(bag.gaps),
                  'size_bytes': bag.size}
        with suppress(OSError):
            values['free_bytes'] = shutil.disk_usage(bag.path).free
        return Diagnostics('log', now_ns, level, summary, values)

    def _miss(self, records: Records) -> None:
        """Count what cannot be logged now; what is latched will be."""
        if records.latched:
            self._bag.remember(records)
        else:
            self._accepted += len(records.payloads)
            self._lost_until_ns = records.log_time_ns[-1]

    @property
    def _written(self) -> int:
        return self._written_before + self._bag.written

    @property
    def _lost(self) -> int:
        return self._accepted - self._written

    def _fail(self, error: OSError) -> None:
        if not self._failure:
            self._failure = error.strerror or str(error)
            self._bag.abandon()
            self._lost_until_ns = 0
            self._complain(
                f'log {self._bag.path} failed and has a gap from here on: {self._failure}')

    def _resume(self) -> None:
        """Begin again where the disk takes it; told only when it works."""
        with suppress(OSError):
            self._make_room()
            self._directory.mkdir(parents=True, exist_ok=True)
            reserve(self._directory)
            gap = f'{self._lost - self._lost_before} messages until {self._lost_until_ns} ns: ' \
                  f'{self._failure}'
            if self._bag.path.is_dir():
                self._bag.resume(gap)
            else:
                gaps = {**self._bag.gaps, f'gap_{len(self._bag.gaps) + 1}': gap}
                written = self._written
                self._bag = self._new_bag(
                    new_directory(self._directory, self._name), gaps, self._bag.latched)
                self._written_before = written
            self._lost_before = self._lost
            self._failure, self._has_resumed = '', True
            self._tell(f'log goes on in {self._bag.file}, without {gap}')

    def _new_bag(
        self, path: Path, gaps: dict[str, str] | None = None,
        latched: dict[str, Records] | None = None,
    ) -> BagWriter:
        return BagWriter(path, split_mib=self._split_mib, split_s=self._split_s, gaps=gaps,
                         latched=latched)

    def _make_room(self) -> None:
        if self._budget:
            self._looked_at = self._bag.size
            for gone in make_room(self._directory, self._name, budget=self._budget,
                                  current=self._bag.path, keep=[self.file]):
                self._bag.forget(gone.name)


def reserve(directory: Path) -> None:
    """Raise OSError unless a directory takes a file of a mebibyte."""
    probe = directory / f'.probe_{os.getpid()}'
    try:
        with probe.open('wb', buffering=0) as stream:
            os.posix_fallocate(stream.fileno(), 0, RESERVE)
    finally:
        probe.unlink(missing_ok=True)
