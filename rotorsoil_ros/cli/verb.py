"""One verb, from its arguments to its exit status; every fault is a line, never a traceback."""

from argparse import Namespace
from collections.abc import Sequence
from importlib import import_module
import logging
import os
from pathlib import Path
import sys
import warnings

from rotorsoil_ros.cli.arguments.parser import parse
from rotorsoil_ros.cli.outputs import fresh_directories, refuse_existing, remove_outputs
from rotorsoil_ros.errors import BAD_INPUT, InputError, RotorSoilError


def run(argv: Sequence[str] | None = None) -> int:
    """Run one verb; one that fails or is interrupted leaves no output."""
    arguments = parse(argv)
    logging.basicConfig(format='%(message)s')
    logging.getLogger().setLevel(logging.ERROR if arguments.quiet else
                                 logging.INFO if arguments.verbose else logging.WARNING)
    fresh: list[Path] = []
    try:
        status = _run(arguments, fresh)
    except KeyboardInterrupt:
        remove_outputs(fresh)
        raise
    if status == BAD_INPUT:
        remove_outputs(fresh)
    return status


def _run(arguments: Namespace, fresh: list[Path]) -> int:
    """Run a verb, and tell in which directories it is the first to write."""
    module, function = arguments.run.split(':')
    try:
        refuse_existing(arguments)
        fresh += fresh_directories(arguments)
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
    return status


def _forget_output() -> None:
    """Send what is left of the output nowhere: Python would complain again while closing it."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
