"""What if the disk does not take the bag? The node goes on, and so does the bag when it can."""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
import os
from pathlib import Path
import shutil
from typing import TypeAlias

from rotorsoil_ros.background import Aside
from rotorsoil_ros.bags.retention import make_room, new_directory
from rotorsoil_ros.bags.writer import BagWriter, last_of, MEBIBYTE
from rotorsoil_ros.events import Diagnostics, Level
from rotorsoil_ros.wire.messages import Records

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
        self, directory: Path, name: str, *, split_mib: float, split_s: float,
        budget_mib: float, tell: Tell, complain: Tell,
    ) -> None:
        self._directory, self._name = directory, name
        self._budget = int(budget_mib * MEBIBYTE)
        largest = budget_mib / FILES_IN_BUDGET
        self._split_mib = min(split_mib or largest, largest) if budget_mib else split_mib
        self._split_s = split_s
        self._tell, self._complain = tell, complain
        self._told_of: set[str] = set()
        self._failure = ''
        self._has_resumed = False
        self._accepted = self._written_before = self._lost_before = 0
        self._lost_until_ns = 0
        self._looked_at = 0
        self._gaps: dict[str, str] = {}
        self._latched: dict[str, Records] = {}
        self._bag: BagWriter | None = None
        try:
            self._bag = self._new_bag(self._gaps)
        except OSError as error:
            self._fail(error)
        self._make_room()

    @property
    def path(self) -> Path | None:
        """Directory of the bag, as soon as the disk takes one."""
        return None if self._bag is None else self._bag.path

    @property
    def file(self) -> Path | None:
        """The file that is being written."""
        return None if self._bag is None else self._bag.file

    def write(self, records: Records) -> None:
        """Log messages of one topic."""
        if self._failure or self._bag is None:
            self._miss(records)
            return
        self._accepted += len(records.payloads)
        try:
            self._bag.write(records)
        except OSError as error:
            self._fail(error)

    def flush(self) -> None:
        """Put everything onto the disk, or try whether it works again; call it again and again."""
        try:
            if self._failure or self._bag is None:
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
            if self._bag is not None:
                self._bag.abandon()
        self._lost_until_ns = until_ns
        self.flush()

    def close(self) -> None:
        """Finish the bag."""
        try:
            if self._bag is not None:
                self._bag.close()
        except OSError as error:
            self._fail(error)

    def report(self, now_ns: int) -> Diagnostics:
        """Tell how logging goes."""
        lost = self._lost if self._failure else self._lost_before
        if self._failure:
            level, summary = Level.ERROR, f'not logging: {self._failure}'
        elif self._has_resumed:
            level, summary = Level.WARN, f'logging again to {self.file}, {lost} messages are lost'
        else:
            level, summary = Level.OK, f'logging to {self.file}'
        self._has_resumed = False
        values = {'written': self._written, 'lost': lost, 'gaps': len(self._gaps),
                  'size_bytes': 0 if self._bag is None else self._bag.size}
        with suppress(OSError):
            values['free_bytes'] = shutil.disk_usage(self.path or self._directory).free
        return Diagnostics('log', now_ns, level, summary, values)

    def _miss(self, records: Records) -> None:
        """Count what cannot be logged now; what is latched will be."""
        if records.latched:
            self._latched[records.topic] = last_of(records)
        else:
            self._accepted += len(records.payloads)
            self._lost_until_ns = records.log_time_ns[-1]

    @property
    def _written(self) -> int:
        return self._written_before + (0 if self._bag is None else self._bag.written)

    @property
    def _lost(self) -> int:
        return self._accepted - self._written

    def _fail(self, error: OSError) -> None:
        if self._failure:
            return
        self._failure = error.strerror or str(error)
        self._lost_until_ns = 0
        if self._bag is None:
            self._complain(f'log {self._directory / self._name} cannot be begun and is tried '
                           f'again: {self._failure}')
        else:
            self._bag.abandon()
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
            if self._bag is not None and self._bag.path.is_dir():
                self._bag.resume(gap)
            else:
                written = self._written
                gaps = {**self._gaps, f'gap_{len(self._gaps) + 1}': gap}
                self._bag, self._gaps = self._new_bag(gaps), gaps
                self._written_before = written
            self._lost_before = self._lost
            self._failure, self._has_resumed = '', True
            self._tell(f'log goes on in {self._bag.file}, without {gap}')

    def _new_bag(self, gaps: dict[str, str]) -> BagWriter:
        path = new_directory(self._directory, self._name)
        try:
            return BagWriter(path, split_mib=self._split_mib, split_s=self._split_s, gaps=gaps,
                             latched=self._latched)
        except OSError:
            shutil.rmtree(path, ignore_errors=True)  # it was made just now, and holds nothing
            raise

    def _make_room(self) -> None:
        if not self._budget:
            return
        removed = make_room(self._directory, self._name, budget=self._budget, current=self.path,
                            keep=self.file, complain=self._complain_once)
        if self._bag is not None:
            self._looked_at = self._bag.size
            for gone in removed:
                self._bag.forget(gone.name)

    def _complain_once(self, text: str) -> None:
        if text not in self._told_of:
            self._told_of.add(text)
            self._complain(text)


def reserve(directory: Path) -> None:
    """Raise OSError unless a directory takes a file of a mebibyte."""
    probe = directory / f'.probe_{os.getpid()}'
    try:
        with probe.open('xb', buffering=0) as stream:
            os.posix_fallocate(stream.fileno(), 0, RESERVE)
    finally:
        probe.unlink(missing_ok=True)


ITEMS_AT_ONCE = 64  # records: more would keep the thread, and the interpreter, busy too long
LOG_BACKLOG = 2048  # batches that wait for a disk that hangs: 100 MB, or half an hour at 10 Hz
LOG_PATIENCE_S = 5.0  # at the end
BEHIND = 'the disk did not keep up'
LATE = 4  # flushes that the disk has not answered, a few seconds
HANGS = 'the disk does not answer'


@dataclass(frozen=True, slots=True)
class Missed:
    """How many messages found no room, and the time of the last of them [ns]."""

    count: int
    until_ns: int


Item: TypeAlias = Records | Missed | None  # None: it is time to put everything onto the disk


class BagAside:
    """
    Hands what is to be logged to a recorder on a thread of its own.

    To write is to append to a list. What a disk that hangs does not take is counted, dropped,
    told once, and written down as a gap when the disk is back.
    """

    def __init__(
        self, begin: Callable[[], Recorder], *, complain: Callable[[str], object],
    ) -> None:
        self._make = begin
        self._recorder: Recorder | None = None
        self._waiting: list[Item] = []
        self._missed: Missed | None = None
        self._asked = self._answered = 0  # flushes
        self._said = Diagnostics('log', 0, Level.ERROR, f'not logging: {HANGS}', {})
        self._aside = Aside(self._take, self._finish, begin=self._begin, complain=complain,
                            name='the log', done='logged', backlog=LOG_BACKLOG,
                            patience_s=LOG_PATIENCE_S)

    @property
    def path(self) -> Path | None:
        """Directory of the bag, as soon as the disk takes one."""
        return None if self._recorder is None else self._recorder.path

    @property
    def file(self) -> Path | None:
        """The file that is being written."""
        return None if self._recorder is None else self._recorder.file

    @property
    def backlog(self) -> int:
        """Batches that wait for the disk, of 64 records at most."""
        return self._aside.backlog

    def write(self, records: Records) -> None:
        """Log messages of one topic."""
        self._waiting.append(records)
        if len(self._waiting) >= ITEMS_AT_ONCE:
            self._hand_over()

    def flush(self, *, wait_s: float = 0.0) -> None:
        """Have everything put onto the disk, or tried again; call it again and again."""
        self._asked += 1
        self._waiting.append(None)
        self._hand_over(wait_s)

    def close(self) -> None:
        """Finish the bag, if the disk lets it."""
        self._aside.close([self._missed, *self._waiting] if self._missed else self._waiting)

    def report(self, now_ns: int) -> Diagnostics:
        """Tell how logging went when it was last handed over."""
        said = replace(self._said, stamp_ns=now_ns)
        if self._aside.has_failed:
            return replace(said, level=Level.ERROR, summary='not logging')
        if self._missed is not None:
            return replace(said, level=Level.ERROR, summary=(
                f'not logging: {BEHIND}, {self._missed.count} messages so far'))
        if said.level is Level.OK and self._asked - self._answered > LATE:
            return replace(said, level=Level.WARN, summary=(
                f'{HANGS}: {self.backlog} batches of messages wait in memory'))
        return said

    def _hand_over(self, wait_s: float = 0.0) -> None:
        batch, self._waiting = self._waiting, []
        if self._missed is not None:
            batch.insert(0, self._missed)
        if self._aside.put(batch, wait_s=wait_s):
            self._missed = None
        else:
            self._drop(batch)

    def _drop(self, batch: list[Item]) -> None:
        """Count what there is no room for, and keep what is latched for the next time."""
        count, until_ns, latched = 0, 0, dict[str, Records]()
        for item in batch:
            if isinstance(item, Missed):
                count, until_ns = item.count, item.until_ns
            elif item is not None and item.latched:
                latched[item.topic] = item
            elif item is not None:
                count += len(item.payloads)
                until_ns = item.log_time_ns[-1]
            else:
                self._asked -= 1
        self._missed = Missed(count, until_ns) if count else None
        self._waiting = list(latched.values())

    def _begin(self) -> None:
        recorder = self._make()
        self._said, self._recorder = recorder.report(0), recorder

    def _finish(self) -> None:
        if self._recorder is not None:
            self._recorder.close()

    def _take(self, batch: list[Item]) -> None:
        recorder = self._recorder
        assert recorder is not None  # it has begun
        for item in batch:
            if item is None:
                recorder.flush()
                self._said = recorder.report(0)
                self._answered += 1
            elif isinstance(item, Missed):
                recorder.interrupt(item.count, item.until_ns, BEHIND)
            else:
                recorder.write(item)
