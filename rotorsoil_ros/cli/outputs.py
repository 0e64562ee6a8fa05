"""What does a verb that failed leave? Nothing of its own, and all that was there before."""

from argparse import Namespace
from collections.abc import Iterator
from contextlib import contextmanager, suppress
import os
from pathlib import Path
import shutil

from rotorsoil_ros.errors import InputError


def refuse_existing(arguments: Namespace) -> None:
    """Refuse to write over what somebody may want to keep, before anything is computed."""
    for path in () if arguments.replace else _outputs(arguments):
        if path.is_file() or (arguments.makes_directory and _holds_something(path)):
            raise InputError(f'{path}: exists; --force replaces it')


def fresh_directories(arguments: Namespace) -> list[Path]:
    """Return the directories in which nothing of anybody lies before the verb runs."""
    return [path for path in _outputs(arguments)
            if arguments.makes_directory and not _holds_something(path)]


def remove_outputs(directories: list[Path]) -> None:
    """Remove what a verb that failed has written into directories that held nothing."""
    for directory in directories:
        with suppress(OSError):
            for path in directory.iterdir():
                if path.is_dir() and not path.is_symlink():
                    shutil.rmtree(path, ignore_errors=True)
                else:
                    path.unlink()


@contextmanager
def replacing(out: Path) -> Iterator[Path]:
    """
    Yield where to write what takes its place only when it is whole.

    Until then, and for ever where writing fails or what was written is removed again, what is
    there stays. A pipe or a device is written itself.
    """
    out = out.resolve()  # a link stays one
    if out.exists() and not out.is_file():
        yield out
        return
    aside = out.with_name(f'.{out.stem}.{os.getpid()}{out.suffix}')
    try:
        yield aside
        if aside.exists():
            os.replace(aside, out)
    finally:
        aside.unlink(missing_ok=True)


def _outputs(arguments: Namespace) -> list[Path]:
    given = [getattr(arguments, name) for name in arguments.outputs]
    return [Path(each) for each in given if each not in (None, '-')]


def _holds_something(path: Path) -> bool:
    return path.is_dir() and any(path.iterdir())
