"""The verbs of `rotorsoil`: what each needs is imported only when it is called."""

from collections.abc import Sequence
import os

INTERRUPTED = 130


def main(argv: Sequence[str] | None = None) -> int:
    """
    Run one verb; a Ctrl-C ends it quietly, also while the libraries are being loaded.

    Parameters
    ----------
    argv : sequence of str
        Arguments; those of the process by default.

    Returns
    -------
    int
        Exit status: 0 done, 1 a verdict that fails, 2 bad input.

    """
    # Several threads make small solutions slower, on a busy machine many times; numpy reads this
    # when it is loaded, which has not happened yet. Who has set it knows better.
    for library in ('OMP', 'OPENBLAS', 'MKL'):
        os.environ.setdefault(f'{library}_NUM_THREADS', '1')
    try:
        from rotorsoil_ros.cli.verb import run
        return run(argv)
    except KeyboardInterrupt:
        return INTERRUPTED
