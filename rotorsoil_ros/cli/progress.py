"""How far long work has come, where somebody watches."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
import logging
import sys


@contextmanager
def progress(says: str) -> Iterator[Callable[[int, int], None]]:
    """
    Show a bar on standard error while the body works, if that is a terminal.

    Parameters
    ----------
    says : str
        What is being done.

    Yields
    ------
    callable
        To be called with what is done and the total.

    """
    if not sys.stderr.isatty() or logging.getLogger().level > logging.WARNING:
        yield lambda done, total: None
        return
    from rich.console import Console
    from rich.progress import Progress

    # Short work comes and goes without a trace.
    with Progress(console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(says, total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)
