"""A feed from its first message to a signal: who hears in one thread, who tells in another."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
import logging
from threading import Event, Thread
from typing import NamedTuple, Protocol

from rotorsoil_ros.errors import RotorSoilError
from rotorsoil_ros.feeds.board import Board
from rotorsoil_ros.feeds.hearsay import Inbox

NOTICE_S = 0.1  # how soon a signal, or an outlet that has failed, is noticed
LEAVE_S = 10.0  # that an outlet may take to say goodbye


class Clocks(NamedTuple):
    """What time it is, for those who may not look: one that never jumps, and the date [ns]."""

    steady_ns: Callable[[], int]
    date_ns: Callable[[], int]


class Outlet(Protocol):
    """Who tells a board to others; it runs in a thread of its own."""

    def run(
        self, board: Board, *, clock: Clocks, stop: Event, ready: Callable[[str], object],
    ) -> None:
        """Tell until `stop` is set; say `ready` once it can be reached."""


class Telling:
    """
    An outlet at work in its thread.

    Attributes
    ----------
    failure : str
        Why it has ended, if nobody asked it to.

    """

    def __init__(self, outlet: Outlet, board: Board, clock: Clocks) -> None:
        self.failure = ''
        self.is_ready = Event()
        self._stop = Event()
        self._outlet, self._board, self._clock = outlet, board, clock
        self._thread = Thread(target=self._run, name='feed', daemon=True)
        self._thread.start()

    @property
    def is_alive(self) -> bool:
        """Whether it still tells."""
        return self._thread.is_alive()

    def end(self) -> None:
        """Ask it to say goodbye, and wait for that."""
        self._stop.set()
        self._thread.join(LEAVE_S)

    def _run(self) -> None:
        try:
            self._outlet.run(self._board, clock=self._clock, stop=self._stop, ready=self._ready)
        except (RotorSoilError, OSError) as error:
            name = getattr(error, 'filename', None)
            self.failure = f'{name}: {error.strerror}' if isinstance(
                error, OSError) and name else str(error)

    def _ready(self, said: str) -> None:
        if said:
            logging.getLogger(__name__).warning('%s', said)
        self.is_ready.set()


@contextmanager
def telling(
    outlet: Outlet, inbox: Inbox, *, plant: bool, clock: Clocks,
) -> Iterator[Telling]:
    """Let an outlet tell what comes into an inbox, until the block is left."""
    told = Telling(outlet, Board(inbox, plant=plant), clock)
    try:
        yield told
    finally:
        told.end()


def feed(
    hear: Callable[[float], object], told: Telling, *, until: Callable[[], bool],
) -> bool:
    """Hear, some seconds each time, until something holds; return whether all was told."""
    while not until():
        hear(NOTICE_S)
        if not told.is_alive:
            return False
    return True
