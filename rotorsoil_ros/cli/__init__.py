"""The verbs of `rotorsoil`: what each needs is imported only when it is called."""

from collections.abc import Sequence

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
    try:
        from rotorsoil_ros.cli.verb import run
        return run(argv)
    except KeyboardInterrupt:
        return INTERRUPTED
