"""How is a CSV file of numbers read? Line by line, with all that is wrong told at once."""

from collections.abc import Callable, Container, Iterable, Sequence
import csv
from functools import partial
import math
from pathlib import Path
from typing import TypeAlias, TypeVar

import numpy as np

from rotorsoil_ros.arrays import FloatArray
from rotorsoil_ros.case.document import shown
from rotorsoil_ros.errors import InputError

Read = TypeVar('Read')
# A line by its number in the file, and its cells.
NumberedLine: TypeAlias = tuple[int, list[str]]

# More of one kind tell nothing new.
_MOST_FAULTS = 20


def at_once(builds: Iterable[Callable[[], Read]]) -> list[Read]:
    """
    Return what all of these read.

    Raises
    ------
    InputError
        With what is wrong with any of them, a line each.

    """
    found, faults = list[Read](), list[str]()
    for build in builds:
        try:
            found.append(build())
        except InputError as error:
            faults += str(error).splitlines()
    if len(faults) > _MOST_FAULTS:
        path = faults[0].partition(': ')[0]
        faults[_MOST_FAULTS:] = [f'{path}: and {len(faults) - _MOST_FAULTS} more like these']
    if faults:
        raise InputError('\n'.join(faults))
    return found


def lines_of(path: Path, text: str) -> list[NumberedLine]:
    """Return the lines of a CSV file that are neither empty nor comments, by their number."""
    found = [(number, [cell.strip() for cell in row])
             for number, row in enumerate(csv.reader(text.splitlines()), start=1)
             if any(cell.strip() for cell in row) and not row[0].lstrip().startswith('#')]
    if not found:
        raise InputError(f'{path}: is empty')
    line, first = found[0]
    if len(first) == 1 and ';' in first[0]:
        raise InputError(f'{path}: line {line}: cells must be separated by commas, and decimals '
                         f'by points, got {shown(first[0])}')
    return found


def number(path: Path, line: int, what: str, cell: str) -> float:
    """Return a cell as a finite number."""
    try:
        value = float(cell)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise InputError(f'{path}: line {line}: {what} must be a finite number, got {shown(cell)}')
    return value


def whole(path: Path, line: int, what: str, cell: str) -> int:
    """Return a cell as a whole number from 1 on."""
    if not (cell.isascii() and cell.isdigit() and len(cell) < 12 and int(cell) > 0):
        raise InputError(f'{path}: line {line}: {what} must be a whole number from 1 on, '
                         f'got {shown(cell)}')
    return int(cell)


def of_length(path: Path, line: int, cells: Sequence[str], count: int) -> None:
    """Raise an InputError at a line that has more or fewer cells than others."""
    if len(cells) != count:
        raise InputError(f'{path}: line {line}: must have {count} cells, got {len(cells)}')


def numbers_below(
    path: Path, columns: Sequence[str], lines: Iterable[NumberedLine], *,
    may_be_empty: Container[str] = (), labels: int = 0,
) -> FloatArray:
    """
    Return rows of numbers.

    Parameters
    ----------
    path : Path
        Of the file.
    columns : sequence of str
        What stands above them, labels included.
    lines : iterable of (int, list of str)
        As `lines_of` returns them.
    may_be_empty : container of str
        Columns of which empty cells are NaN.
    labels : int
        How many columns, the first, are no numbers.

    """
    def cell_of(line: int, name: str, cell: str) -> float:
        return math.nan if not cell and name in may_be_empty else number(path, line, name, cell)

    def row(line: int, cells: list[str]) -> list[float]:
        of_length(path, line, cells, len(columns))
        return at_once(partial(cell_of, line, name, cell) for name, cell in zip(
            columns[labels:], cells[labels:], strict=True))

    found = at_once(partial(row, line, cells) for line, cells in lines)
    return np.array(found, dtype=float).reshape(-1, len(columns) - labels)
