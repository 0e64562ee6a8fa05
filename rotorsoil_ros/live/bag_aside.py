"""How is a run logged while nobody waits for the disk? By a thread that takes what came."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from rotorsoil_ros.live.aside import Aside
from rotorsoil_ros.live.events import Diagnostics, Level
from rotorsoil_ros.live.messages import Records
from rotorsoil_ros.live.recorder import Recorder

BATCH = 4096  # records that are handed over before the second is over
BACKLOG = 32  # batches that wait for a disk that hangs: 100 MB, or half a minute at low rates
PATIENCE_S = 5.0  # at the end
BEHIND = 'the disk did not keep up'


@dataclass(frozen=True, slots=True)
class Missed:
    """How many messages found no room, and the time of the last of them [ns]."""

    count: int
    until_ns: int


class BagAside:
    """
    Hands what is to be logged to a recorder on a thread of its own.

    To write is to append to a list. What a disk that hangs does not take is counted, dropped,
    told once, and written down as a gap when the disk is back.
    """

    def __init__(self, recorder: Recorder, *, complain: Callable[[str], object]) -> None:
        self._recorder = recorder
        self._waiting: list[Records | Missed] = []
        self._missed: Missed | None = None
        self._said = recorder.report(0)
        self._aside = Aside(self._take, recorder.close, complain=complain, name='the log',
                            done='logged', backlog=BACKLOG, patience_s=PATIENCE_S)

    @property
    def file(self) -> Path:
        """The file that is being written."""
        return self._recorder.file

    def write(self, records: Records) -> None:
        """Log messages of one topic."""
        self._waiting.append(records)
        if len(self._waiting) >= BATCH:
            self.flush()

    def flush(self, *, wait_s: float = 0.0) -> None:
        """Hand over what has come, which goes onto the disk; call it every second."""
        waiting, self._waiting = self._waiting, []
        if self._missed is not None:
            waiting.insert(0, self._missed)
        # An empty batch lets the recorder try again what has failed.
        if (waiting or self._aside.is_idle) and not self._aside.put(waiting, wait_s=wait_s):
            self._drop(waiting)
        else:
            self._missed = None

    def close(self) -> None:
        """Finish the bag, if the disk lets it."""
        self.flush(wait_s=PATIENCE_S)
        self._aside.close()

    def report(self, now_ns: int) -> Diagnostics:
        """Tell how logging went when it was last handed over."""
        said = replace(self._said, stamp_ns=now_ns)
        if self._aside.has_failed:
            return replace(said, level=Level.ERROR, summary='not logging')
        if self._missed is not None:
            return replace(said, level=Level.ERROR, summary=(
                f'not logging: {BEHIND}, {self._missed.count} messages so far'))
        return said

    def _drop(self, batch: list[Records | Missed]) -> None:
        """Count what there is no room for, and keep what is latched for the next time."""
        count, until_ns, latched = 0, 0, dict[str, Records]()
        for item in batch:
            if isinstance(item, Missed):
                count, until_ns = item.count, item.until_ns
            elif item.latched:
                latched[item.topic] = item
            else:
                count += len(item.payloads)
                until_ns = item.log_time_ns[-1]
        self._missed = Missed(count, until_ns) if count else None
        self._waiting = list(latched.values())

    def _take(self, batch: list[Records | Missed]) -> None:
        for item in batch:
            if isinstance(item, Missed):
                self._recorder.interrupt(item.count, item.until_ns, BEHIND)
            else:
                self._recorder.write(item)
        self._recorder.flush()
        self._said = self._recorder.report(0)
