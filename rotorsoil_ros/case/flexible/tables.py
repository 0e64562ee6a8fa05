"""What the CSV files of a foundation that bends say: its motions, modes and flexibility."""

from collections.abc import Sequence
import csv
from dataclasses import dataclass
import math
from pathlib import Path
import re

import numpy as np

from rotorsoil_ros.arrays import FloatArray
from rotorsoil_ros.case.document import shown
from rotorsoil_ros.channel import Channel, DOFS
from rotorsoil_ros.errors import InputError
from rotorsoil_ros.machine.flexible.body import CONTACT, Dof, PROBE, SEAT

INTERNAL = 'internal'
_KINDS = (SEAT, CONTACT, PROBE, INTERNAL)
_NEEDED = ('name', 'kind', 'x', 'y', 'z', 'direction')
_KNOWN = (*_NEEDED, 'index', 'node', 'area')
# What stands for all translations of a node, of which several make up one place.
ALL = 'xyz'
_STATION = re.compile(r'[a-z][a-z0-9_]*')

# How places are called that stand on the ground where no table of motions says so.
_ON_GROUND = ('patch', 'contact', 'footing', 'base')


@dataclass(frozen=True, slots=True)
class Row:
    """
    One line of a table of motions.

    Attributes
    ----------
    line : int
        Of the file.
    dof : Dof
        What moves; its axis is that of the first of three for `xyz`.
    index : int or None
        Of the matrices, from 0; None of a place that several nodes make up.
    node : int or None
        Number of its node, where a program says which motions these are.
    is_node : bool
        Whether all translations of a node are meant.

    """

    line: int
    dof: Dof
    index: int | None
    node: int | None
    is_node: bool


def lines_of(path: Path, text: str) -> list[tuple[int, list[str]]]:
    """Return the lines of a CSV file that are neither empty nor comments, by their number."""
    found = [(number, [cell.strip() for cell in row])
             for number, row in enumerate(csv.reader(text.splitlines()), start=1)
             if any(cell.strip() for cell in row) and not row[0].lstrip().startswith('#')]
    if not found:
        raise InputError(f'{path}: is empty')
    return found


def number(path: Path, line: int, what: str, cell: str) -> float:
    """Return a cell as a finite number."""
    try:
        value = float(cell)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise InputError(f'{path}: line {line}: {what} must be a number, got {shown(cell)}')
    return value


def numbers_of(path: Path, text: str, *, columns: int | None = None) -> FloatArray:
    """Return a file of numbers only, (rows, columns)."""
    lines = lines_of(path, text)
    width = columns or len(lines[0][1])
    for line, row in lines:
        if len(row) != width:
            raise InputError(f'{path}: line {line}: must hold {width} numbers, got {len(row)}')
    return np.array([[number(path, line, f'column {place}', cell)
                      for place, cell in enumerate(row, start=1)] for line, row in lines])


def motions(path: Path, text: str) -> list[Row]:
    """
    Read a table of motions.

    Parameters
    ----------
    path : Path
        CSV with the columns name, kind, x, y, z, direction, and index or node; area may be there.
    text : str
        What it says.

    Raises
    ------
    InputError
        With the line that is wrong.

    """
    (first, header), *lines = lines_of(path, text)
    for name in header:
        if name not in _KNOWN:
            raise InputError(f'{path}: line {first}: column {shown(name)} is not known; known are '
                             f'{", ".join(_KNOWN)}')
    for name in _NEEDED:
        if name not in header:
            raise InputError(f'{path}: line {first}: column {name} is missing')
    rows = []
    for line, cells in lines:
        if len(cells) != len(header):
            raise InputError(f'{path}: line {line}: must have {len(header)} cells, '
                             f'got {len(cells)}')
        row = _row(path, line, dict(zip(header, cells, strict=True)))
        if row is not None:
            rows.append(row)
    return rows


def _row(path: Path, line: int, cells: dict[str, str]) -> Row | None:
    kind = cells['kind']
    if kind not in _KINDS:
        raise InputError(f'{path}: line {line}: kind must be one of {", ".join(_KINDS)}, '
                         f'got {shown(kind)}')
    if kind == INTERNAL:
        return None
    axis = cells['direction']
    if axis not in (*DOFS, ALL):
        raise InputError(f'{path}: line {line}: direction must be one of {", ".join(DOFS)}, or '
                         f'{ALL} of a node, got {shown(axis)}')
    station = cells['name'].removesuffix(f'_{axis}')
    if not _STATION.fullmatch(station):
        raise InputError(f'{path}: line {line}: name must be small letters, digits and _, '
                         f'got {shown(cells["name"])}')
    x, y, z = (number(path, line, f'{name} [m]', cells[name]) for name in 'xyz')
    area = number(path, line, 'area [m^2]', cells['area']) if cells.get('area') else 0.0
    if not area >= 0.0:
        raise InputError(f'{path}: line {line}: area must be >= 0 m^2, got {area:g}')
    index, node = (None if not cells.get(name) else _whole(path, line, name, cells[name])
                   for name in ('index', 'node'))
    dof = Dof(station, 'x' if axis == ALL else axis, kind, (x, y, z), area)
    return Row(line, dof, None if index is None else index - 1, node, axis == ALL)


def _whole(path: Path, line: int, what: str, cell: str) -> int:
    if not (cell.isascii() and cell.isdigit() and 0 < len(cell) < 12 and int(cell) > 0):
        raise InputError(f'{path}: line {line}: {what} must be a whole number from 1 on, '
                         f'got {shown(cell)}')
    return int(cell)


def modes(path: Path, text: str) -> tuple[list[str], FloatArray, FloatArray]:
    """
    Read a table of modes.

    Parameters
    ----------
    path : Path
        CSV: a header `dof,<mode>,...`, a row `hz,...` of frequencies, then a row for each motion
        of mass-normalised shapes [1/sqrt(kg)].
    text : str
        What it says.

    Returns
    -------
    names, frequency (m,) [Hz], shapes (p, m)

    """
    (_, header), *lines = lines_of(path, text)
    if len(header) < 2 or header[0] != 'dof':
        raise InputError(f'{path}: must begin with the header dof,mode_1,..., got '
                         f'{shown(",".join(header[:3]))}')
    if not lines or lines[0][1][0] != 'hz':
        raise InputError(f'{path}: needs a row of frequencies that begins with hz, below the '
                         'header')
    table = []
    for line, row in lines:
        if len(row) != len(header):
            raise InputError(f'{path}: line {line}: must hold {len(header)} cells, got {len(row)}')
        table.append([number(path, line, name, cell)
                      for name, cell in zip(header[1:], row[1:], strict=True)])
    names = [row[0] for _, row in lines[1:]]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise InputError(f'{path}: motion {shown(twice)} stands here twice')
    found = np.array(table).reshape(len(lines), len(header) - 1)
    if not np.all(found[0] > 0.0):
        raise InputError(f'{path}: frequencies must be > 0 Hz, of elastic modes only, got '
                         f'{found[0].min():g}; rigid motion belongs into the file rigid')
    return names, found[0], found[1:]


def dofs_of(path: Path, names: Sequence[str], rows: FloatArray) -> list[Dof]:
    """
    Return the motions of named rows from what rigid motion does there.

    Parameters
    ----------
    path : Path
        That tells their names, `<station>_<axis>`.
    names : sequence of str
        A station called patch, contact, footing or base stands on the ground; any other is a
        seat.
    rows : (p, 6) float array
        Per rigid motion about the origin.

    """
    places: dict[str, list[float]] = {}
    split = []
    for name, row in zip(names, rows.tolist(), strict=True):
        channel = Channel.parse(name)
        station, axis = channel.place, channel.axis
        if axis not in DOFS or not _STATION.fullmatch(station):
            raise InputError(f'{path}: names of motions must be <station>_<x, y, z, rx, ry or '
                             f'rz>, got {shown(name)}')
        split.append((station, axis))
        place = places.setdefault(station, [math.nan] * 3)
        x, y, z = {'x': (None, -row[5], row[4]), 'y': (row[5], None, -row[3]),
                   'z': (-row[4], row[3], None)}.get(axis, (None, None, None))
        for along, value in enumerate((x, y, z)):
            if value is not None:
                place[along] = value
    found = []
    for station, axis in split:
        on_ground = re.sub(r'_?\d*$', '', station) in _ON_GROUND
        x, y, z = places[station]
        found.append(Dof(station, axis, CONTACT if on_ground else SEAT, (x, y, z)))
    return found
