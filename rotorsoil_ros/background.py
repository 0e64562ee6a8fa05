"""What is slow or may hang works aside, so that no answer waits for it."""

from collections.abc import Callable, Sequence
import queue
import sys
import threading
from typing import Generic, TypeVar

Item = TypeVar('Item')

BACKLOG = 10  # batches, one each second; what a stuck viewer does not take is dropped
PATIENCE_S = 2.0  # at the end


class Aside(Generic[Item]):
    """
    Hands batches to a thread.

    Neither work that hangs nor work that raises is ever noticed by who calls, except that it
    is told once.
    """

    def __init__(
        self, take: Callable[[list[Item]], None], finish: Callable[[], None], *,
        complain: Callable[[str], object], name: str = 'the viewer', done: str = 'shown',
        backlog: int = BACKLOG, patience_s: float = PATIENCE_S,
    ) -> None:
        self.has_failed = False
        self._take, self._finish, self._complain = take, finish, complain
        self._name, self._done, self._patience_s = name, done, patience_s
        self._items: list[Item] = []
        self._batches: queue.Queue[list[Item] | None] = queue.Queue(backlog)
        self._is_behind = False
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)
        self._thread.start()

    def __call__(self, item: Item) -> None:
        """Collect one for the next batch."""
        if not self.has_failed:
            self._items.append(item)

    def flush(self) -> None:
        """Hand over what was collected, or drop it if the thread is far behind."""
        items, self._items = self._items, []
        self.put(items)

    @property
    def backlog(self) -> int:
        """Batches that wait for the thread."""
        return self._batches.qsize()

    def put(self, batch: list[Item], *, wait_s: float = 0.0) -> bool:
        """Hand over a batch; return whether there was room for it."""
        try:
            self._batches.put(batch, block=wait_s > 0.0, timeout=wait_s)
        except queue.Full:
            if not self._is_behind and not self.has_failed:
                self._complain(
                    f'{self._name} does not keep up: not all of the run is {self._done}')
            self._is_behind = True
            return False
        self._is_behind = self._is_behind and self._batches.qsize() > 1
        return True

    def close(self, last: Sequence[Item] = ()) -> None:
        """Finish with a last batch, if that takes no longer than anybody would wait."""
        patience_s = 0.0 if self.has_failed else self._patience_s
        taken = self.put([*self._items, *last], wait_s=patience_s)
        try:
            self._batches.put(None, block=taken, timeout=patience_s)
        except queue.Full:
            self._batches.get_nowait()  # the end has to fit in
            self._batches.put_nowait(None)
            taken = False
        self._thread.join(patience_s if taken else 0.0)
        if self._thread.is_alive():
            if rerun := sys.modules.get('rerun'):
                rerun.unregister_shutdown()  # at its exit it would wait for the same viewer
            self._complain(f'{self._name} did not finish within {patience_s:g} s and is left '
                           'alone')

    def _run(self) -> None:
        try:
            while (batch := self._batches.get()) is not None:
                self._take(batch)
            self._finish()
        except (OSError, RuntimeError, ValueError, OverflowError) as error:
            self.has_failed = True
            self._complain(f'{self._name} failed and nothing more is {self._done}: {error}')
