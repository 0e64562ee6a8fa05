"""How is a run logged while nobody waits for the disk? By a thread that takes what came."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeAlias

from rotorsoil_ros.live.aside import Aside
from rotorsoil_ros.live.events import Diagnostics, Level
from rotorsoil_ros.live.messages import Records
from rotorsoil_ros.live.recorder import Recorder

BATCH = 64  # records: more would keep the thread, and so the interpreter, busy for too long
BACKLOG = 2048  # batches that wait for a disk that hangs: 100 MB, or half an hour at 10 Hz
PATIENCE_S = 5.0  # at the end
BEHIND = 'the disk did not keep up'


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

    def __init__(self, recorder: Recorder, *, complain: Callable[[str], object]) -> None:
        self._recorder = recorder
        self._waiting: list[Item] = []
        self._missed: Missed | None = None
        self._said = recorder.report(0)
        self._aside = Aside(self._take, recorder.close, complain=complain, name='the log',
                            done='logged', backlog=BACKLOG, patience_s=PATIENCE_S)

    @property
    def file(self) -> Path:
        """The file that is being written."""
        return self._recorder.file

    @property
    def backlog(self) -> int:
        """Batches that wait for the disk, of 64 records at most."""
        return self._aside.backlog

    def write(self, records: Records) -> None:
        """Log messages of one topic."""
        self._waiting.append(records)
        if len(self._waiting) >= BATCH:
            self._hand_over()

    def flush(self, *, wait_s: float = 0.0) -> None:
        """Have everything put onto the disk, or tried again; call it every second."""
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
        self._missed = Missed(count, until_ns) if count else None
        self._waiting = list(latched.values())

    def _take(self, batch: list[Item]) -> None:
        recorder = self._recorder
        for item in batch:
            if item is None:
                recorder.flush()
                self._said = recorder.report(0)
            elif isinstance(item, Missed):
                recorder.interrupt(item.count, item.until_ns, BEHIND)
            else:
                recorder.write(item)
