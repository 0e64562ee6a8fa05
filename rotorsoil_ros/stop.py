"""A signal that asks a process to stop, taken where it tears nothing."""

from collections.abc import Iterator
from contextlib import contextmanager
import signal
from types import FrameType


class Stop:
    """
    A signal that asks the process to stop.

    It is noted whenever it comes and interrupts only what may be interrupted, so that it can
    tear nothing: neither an executor that is being built nor a log that is being finished.
    """

    def __init__(self) -> None:
        self.requested = False
        self._interrupts = False
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            signal.signal(number, self._take)

    @contextmanager
    def interrupting(self) -> Iterator[None]:
        """Raise KeyboardInterrupt in this block if the signal comes, or has come before it."""
        self._interrupts = True
        try:
            if self.requested:
                raise KeyboardInterrupt
            yield
        finally:
            self._interrupts = False

    def _take(self, number: int, frame: FrameType | None) -> None:
        del number, frame
        self.requested = True
        if self._interrupts:
            raise KeyboardInterrupt
