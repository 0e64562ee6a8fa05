"""What is slow or may hang works aside, so that no answer waits for it."""

from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass
import logging
import os
import queue
import subprocess
import sys
import threading
from typing import Generic, Protocol, TypeVar

from rotorsoil_ros.errors import BAD_INPUT, RotorSoilError

Item = TypeVar('Item')
Result = TypeVar('Result')

BACKLOG = 10  # batches, some seconds; what a stuck viewer does not take is dropped
PATIENCE_S = 2.0  # at the end
OPENING_S = 5.0  # that a start waits for what hangs
GLANCE_S = 0.002  # at a child whose pipe has to be emptied
NICE = 10  # how far a child stands back behind answers


class Mapper(Protocol[Item, Result]):
    """What calls a function on each of some jobs: `map` itself, or that of any executor."""

    def __call__(
        self, function: Callable[[Item], Result], jobs: Iterable[Item], /,
    ) -> Iterable[Result]:
        """Return what it gave, in the order of the jobs."""


class Aside(Generic[Item]):
    """
    Hands batches to a thread.

    Neither work that hangs nor work that raises is ever noticed by who calls, except that it
    is told once. What has to be opened before is opened by the thread: who calls waits for it
    only as long as it takes where nothing hangs.
    """

    def __init__(
        self, take: Callable[[list[Item]], None], finish: Callable[[], None], *,
        complain: Callable[[str], object], name: str = 'the viewer', done: str = 'shown',
        backlog: int = BACKLOG, patience_s: float = PATIENCE_S,
        begin: Callable[[], object] = lambda: None,
    ) -> None:
        self.has_failed = False
        self._begin, self._begun = begin, threading.Event()
        self._take, self._finish, self._complain = take, finish, complain
        self._name, self._done, self._patience_s = name, done, patience_s
        self._items: list[Item] = []
        self._batches: queue.Queue[list[Item] | None] = queue.Queue(backlog)
        self._is_behind = False
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)
        try:
            self._thread.start()
        except RuntimeError as error:  # the limit of threads
            self._fail(error)
        if not self.has_failed and not self._begun.wait(OPENING_S):
            complain(f'{name} hangs while it is opened: what comes waits for it')

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
        if self._thread.ident is not None:
            self._thread.join(patience_s if taken else 0.0)
        if self._thread.is_alive():
            if rerun := sys.modules.get('rerun'):
                rerun.unregister_shutdown()  # at its exit it would wait for the same viewer
            self._complain(f'{self._name} did not finish within {patience_s:g} s and is left '
                           'alone')

    def _run(self) -> None:
        try:
            self._begin()
            self._begun.set()
            while (batch := self._batches.get()) is not None:
                self._take(batch)
            self._finish()
        except (RotorSoilError, OSError, RuntimeError, ValueError, OverflowError) as error:
            self._fail(error)

    def _fail(self, error: Exception) -> None:
        self.has_failed = True
        self._begun.set()
        self._complain(f'{self._name} failed and nothing more is {self._done}: {error}')


class Child:
    """
    A process that runs a module of this package, with little priority and one thread for BLAS.

    It never raises: a child that could not be started has ended, and says why.
    """

    def __init__(self, module: str, arguments: Sequence[str]) -> None:
        self.failure = ''
        self.lines: list[str] = []
        self._process: subprocess.Popen[bytes] | None = None
        try:
            self._process = subprocess.Popen(
                [sys.executable, '-m', module, *arguments], stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
                env={**os.environ, 'OMP_NUM_THREADS': '1'})
        except OSError as error:
            self.failure = f'no process can be started: {error.strerror}'
            return
        with suppress(OSError):
            os.setpriority(os.PRIO_PROCESS, self._process.pid, NICE)

    @property
    def said(self) -> str:
        """The last line that the child has told."""
        return self.lines[-1] if self.lines else ''

    def has_ended(self, *, wait_s: float = GLANCE_S) -> bool:
        """Read what the child says; return whether it has ended, and wait for it so long."""
        if self._process is None:
            return True
        try:
            _, heard = self._process.communicate(timeout=wait_s)
        except subprocess.TimeoutExpired:
            return False
        status, self._process = self._process.returncode, None
        self.lines = heard.decode(errors='replace').strip().splitlines()
        if status == BAD_INPUT and self.said:
            self.failure = self.said
        elif status:
            self.failure = f'status {status}: {self.said or "nothing was said"}'
        return True

    def kill(self) -> None:
        """End the child now."""
        if self._process is not None:
            self._process.kill()
            with suppress(subprocess.TimeoutExpired):  # a disk that hangs holds even the dead
                self._process.communicate(timeout=PATIENCE_S)
            self._process = None
            self.failure = 'was stopped'


def run_as_child(work: Callable[[Sequence[str]], object]) -> None:
    """Be a Child: do the work with the arguments of the command line; say a fault in one line."""
    try:
        work(sys.argv[1:])
    except (RotorSoilError, OSError) as error:
        logging.getLogger(__name__).error('%s', error)  # to stderr: nobody has set logging up
        raise SystemExit(BAD_INPUT) from error


@dataclass(slots=True)
class _Job:
    """What a child is to do, and who looks at what it has done."""

    start: Callable[[], Child | None]
    finish: Callable[[Child], None]
    is_wanted: bool = True


class Children:
    """
    Children one after the other, or a few at once, looked after by whoever calls `step`.

    A new job replaces the one of the same name that waits, and nobody is told any more of one
    that runs: it does what is no longer asked for.
    """

    def __init__(self, *, at_once: int = 1) -> None:
        self._at_once = at_once
        self._waiting: dict[str, _Job] = {}
        self._running: list[tuple[str, _Job, Child]] = []

    @property
    def are_done(self) -> bool:
        """Whether nothing is left to do."""
        return not self._waiting and not self._running

    def ask(
        self, name: str, start: Callable[[], Child | None], finish: Callable[[Child], None],
    ) -> None:
        """Queue a job; where `start` gives no child, it is done."""
        self.forget(name)
        self._waiting[name] = _Job(start, finish)

    def forget(self, name: str) -> None:
        """Take back what was asked under a name."""
        self._waiting.pop(name, None)
        for running, job, _ in self._running:
            job.is_wanted = job.is_wanted and running != name

    def step(self, *, wait_s: float = GLANCE_S) -> None:
        """Look at those that run, waiting for each so long; start the next ones."""
        for entry in list(self._running):
            _, job, child = entry
            if child.has_ended(wait_s=wait_s):
                self._running.remove(entry)
                if job.is_wanted:
                    job.finish(child)
        while self._waiting and len(self._running) < self._at_once:
            name = next(iter(self._waiting))
            job = self._waiting.pop(name)
            if (started := job.start()) is not None:
                self._running.append((name, job, started))

    def close(self) -> None:
        """Forget every job and end what runs."""
        self._waiting = {}
        for _, _, child in self._running:
            child.kill()
        self._running = []


class Errand(Generic[Result]):
    """
    One piece of work on a thread of its own; what came of it is there when it is done.

    Attributes
    ----------
    result : anything, or None
        What the work returned.
    failure : str
        Why it returned nothing.

    """

    def __init__(self, work: Callable[[], Result], *, name: str) -> None:
        self.result: Result | None = None
        self.failure = 'it ended without a word'
        self.has_begun = True
        self._work = work
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)
        try:
            self._thread.start()
        except RuntimeError as error:  # the limit of threads
            self.has_begun, self.failure = False, str(error)

    @property
    def is_done(self) -> bool:
        """Whether there is a result or a failure."""
        return not self._thread.is_alive()

    def wait(self, longest_s: float) -> None:
        """Wait until it is done, or has taken too long."""
        if self.has_begun:
            self._thread.join(longest_s)

    def _run(self) -> None:
        try:
            self.result, self.failure = self._work(), ''
        except (RotorSoilError, OSError, RuntimeError, MemoryError) as error:
            self.failure = str(error) or type(error).__name__
