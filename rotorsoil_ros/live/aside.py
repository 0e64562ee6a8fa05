"""What is slow or may hang works aside, so that no answer waits for it."""

from collections.abc import Callable
import queue
import sys
import threading

from rotorsoil_ros.live.events import Event

BACKLOG = 10  # batches, one each second; what a stuck viewer does not take is dropped
PATIENCE_S = 2.0  # at the end

Show = Callable[[list[Event]], None]


class Aside:
    """
    Hands batches of events to a thread.

    Neither a viewer that hangs nor one that raises is ever noticed by who calls, except that
    it is told once.
    """

    def __init__(
        self, show: Show, finish: Callable[[], None], *, complain: Callable[[str], object],
    ) -> None:
        self._show, self._finish, self._complain = show, finish, complain
        self._events: list[Event] = []
        self._batches: queue.Queue[list[Event] | None] = queue.Queue(BACKLOG)
        self._is_behind = self._has_failed = False
        self._thread = threading.Thread(target=self._run, name='viewer', daemon=True)
        self._thread.start()

    def __call__(self, event: Event) -> None:
        """Collect an event."""
        if not self._has_failed:
            self._events.append(event)

    def flush(self) -> None:
        """Hand over what was collected, or drop it if the thread is far behind."""
        events, self._events = self._events, []
        self._put(events)

    def close(self) -> None:
        """Finish, if that takes no longer than anybody would wait."""
        self.flush()
        if self._batches.full():
            self._batches.get_nowait()  # the end has to fit in
        self._put(None)
        self._thread.join(PATIENCE_S)
        if self._thread.is_alive():
            if rerun := sys.modules.get('rerun'):
                rerun.unregister_shutdown()  # at its exit it would wait for the same viewer
            self._complain(f'the viewer did not finish within {PATIENCE_S:g} s and is left alone')

    def _put(self, batch: list[Event] | None) -> None:
        try:
            self._batches.put_nowait(batch)
        except queue.Full:
            if not self._is_behind and not self._has_failed:
                self._complain('the viewer does not keep up: not all of the run is shown')
            self._is_behind = True

    def _run(self) -> None:
        try:
            while (batch := self._batches.get()) is not None:
                self._show(batch)
            self._finish()
        except (OSError, RuntimeError, ValueError) as error:
            self._has_failed = True
            self._complain(f'the viewer failed and shows nothing more: {error}')
