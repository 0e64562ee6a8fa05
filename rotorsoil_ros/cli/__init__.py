"""The verbs of `rotorsoil`: what each needs is imported only when it is called."""

from argparse import Namespace
from collections.abc import Sequence
from importlib import import_module
import logging
import os
from pathlib import Path
import sys
import warnings

from rotorsoil_ros.cli.arguments.parser import parse
from rotorsoil_ros.errors import BAD_INPUT, InputError, RotorSoilError

INTERRUPTED = 130


def main(argv: Sequence[str] | None = None) -> int:
    """
    Run one verb.

    Parameters
    ----------
    argv : sequence of str
        Arguments; those of the process by default.

    Returns
    -------
    int
        Exit status: 0 done, 1 a verdict that fails, 2 bad input.

    """
    arguments = parse(argv)
    logging.basicConfig(format='%(message)s')
    logging.getLogger().setLevel(logging.ERROR if arguments.quiet else
                                 logging.INFO if arguments.verbose else logging.WARNING)
    module, function = arguments.run.split(':')
    try:
        _refuse_existing(arguments)
        with warnings.catch_warnings():
            # An overflow ends in an error of one line; numpy's remarks would bury it.
            warnings.simplefilter('ignore', RuntimeWarning)
            verb = getattr(import_module(f'rotorsoil_ros.cli.{module}'), function)
            status = int(verb(arguments))
        sys.stdout.flush()
    except BrokenPipeError:
        _forget_output()  # the reader has seen enough
        return 0
    except InputError as error:
        print(error, file=sys.stderr)
        return BAD_INPUT
    except RotorSoilError as error:
        # The physics does not know which file it came from.
        print(*filter(None, (getattr(arguments, 'case', None), error)), sep=': ', file=sys.stderr)
        return BAD_INPUT
    except OSError as error:
        if error.filename is None:
            _forget_output()
        print(f'{error.filename or "standard output"}: {error.strerror}', file=sys.stderr)
        return BAD_INPUT
    except KeyboardInterrupt:
        return INTERRUPTED
    return status


def _refuse_existing(arguments: Namespace) -> None:
    """Refuse to write over what somebody may want to keep, before anything is computed."""
    for name in () if arguments.replace else arguments.outputs:
        given = getattr(arguments, name)
        if given in (None, '-'):
            continue
        path = Path(given)
        holds = arguments.makes_directory and path.is_dir() and any(path.iterdir())
        if path.is_file() or holds:
            raise InputError(f'{path}: exists; --force replaces it')


def _forget_output() -> None:
    """Send what is left of the output nowhere: Python would complain again while closing it."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
