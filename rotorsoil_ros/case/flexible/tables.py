"""What the CSV files of a foundation that bends say: its motions, modes and flexibility."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
import math
from pathlib import Path
import re

import numpy as np

from rotorsoil_ros.arrays import FloatArray
from rotorsoil_ros.case.document import shown
from rotorsoil_ros.case.entries.cells import (
    at_once,
    lines_of,
    number,
    numbers_below,
    of_length,
    whole,
)
from rotorsoil_ros.channel import Channel, DOFS
from rotorsoil_ros.errors import InputError
from rotorsoil_ros.machine.flexible.body import CONTACT, Dof, PROBE, SEAT

# What is symmetric is so by this share of its largest entry, and places agree, as printed digits
# do.
_SYMMETRIC, _PRINTED = 1e-4, 1e-4

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


def numbers_of(path: Path, text: str, *, columns: int | None = None) -> FloatArray:
    """Return a file of numbers only, (rows, columns)."""
    lines = lines_of(path, text)
    width = columns or len(lines[0][1])
    return numbers_below(path, [f'column {place}' for place in range(1, width + 1)], lines)


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
    faults = [f'column {shown(name)} is not known; known are {", ".join(_KNOWN)}'
              for name in header if name not in _KNOWN]
    faults += [f'column {name} is missing' for name in _NEEDED if name not in header]
    faults += [f'column {name} stands here twice' for name in dict.fromkeys(header)
               if header.count(name) > 1]
    if faults:
        raise InputError('\n'.join(f'{path}: line {first}: {fault}' for fault in faults))

    def row(line: int, cells: list[str]) -> Row | None:
        of_length(path, line, cells, len(header))
        return _row(path, line, dict(zip(header, cells, strict=True)))

    rows = at_once(partial(row, line, cells) for line, cells in lines)
    return _with_areas(path, [one for one in rows if one is not None])


def _with_areas(path: Path, rows: Sequence[Row]) -> list[Row]:
    """Return the motions of one contact with one area, which may stand at one of them only."""
    stated: dict[str, float] = {}
    # Nodes have areas of their own.
    for row in rows:
        if not row.is_node and row.dof.area:
            known = stated.setdefault(row.dof.station, row.dof.area)
            if row.dof.area != known:
                raise InputError(
                    f'{path}: line {row.line}: area of {row.dof.station} must be the same on '
                    f'every line, got {row.dof.area:g} and {known:g} m^2')
    found = [row if row.is_node else replace(row, dof=replace(
        row.dof, area=stated.get(row.dof.station, 0.0))) for row in rows]
    on_ground = [row for row in found if row.dof.kind == CONTACT
                 and not (row.is_node and row.index is None and row.node is None)]
    without = next((row for row in on_ground if not row.dof.area), None)
    if without is not None and any(row.dof.area for row in on_ground):
        raise InputError(f'{path}: line {without.line}: area [m^2] is missing, while other '
                         'contacts have theirs')
    return found


def _row(path: Path, line: int, cells: dict[str, str]) -> Row | None:
    kind, axis = cells['kind'], cells['direction']
    if kind == INTERNAL:
        return None
    station = cells['name'].removesuffix(f'_{axis}')

    at = f'{path}: line {line}:'

    def refuse() -> float:
        faults = [f'{at} {rule}, got {shown(got)}' for holds, rule, got in (
            (kind in _KINDS, f'kind must be one of {", ".join(_KINDS)}', kind),
            (axis in (*DOFS, ALL),
             f'direction must be one of {", ".join(DOFS)}, or {ALL} of a node', axis),
            (_STATION.fullmatch(station), 'name must be small letters, digits and _',
             cells['name'])) if not holds]
        if faults:
            raise InputError('\n'.join(faults))
        return 0.0

    reads: list[Callable[[], float]] = [
        refuse, *(partial(number, path, line, f'{name} [m]', cells[name]) for name in 'xyz')]
    given = [name for name in ('index', 'node') if cells.get(name)]
    reads += [partial(whole, path, line, name, cells[name]) for name in given]
    if cells.get('area'):
        reads.append(partial(_area, path, line, cells['area']))
    _, x, y, z, *more = at_once(reads)
    index, node = (int(more[given.index(name)]) if name in given else None
                   for name in ('index', 'node'))
    of_contact = more[-1] if cells.get('area') else 0.0
    dof = Dof(station, 'x' if axis == ALL else axis, kind, (x, y, z), of_contact)
    return Row(line, dof, None if index is None else index - 1, node, axis == ALL)


def _area(path: Path, line: int, cell: str) -> float:
    area = number(path, line, 'area [m^2]', cell)
    if not area >= 0.0:
        raise InputError(f'{path}: line {line}: area must be >= 0 m^2, got {area:g}')
    return area


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
    found = numbers_below(path, header, lines, labels=1)
    names = [row[0] for _, row in lines[1:]]
    faults = [f'motion {shown(name)} stands here twice' for name in dict.fromkeys(names)
              if names.count(name) > 1]
    faults += [f'frequency of {name} must be > 0 Hz, of elastic modes only, got {hertz:g}; rigid '
               'motion belongs into the file rigid'
               for name, hertz in zip(header[1:], found[0].tolist(), strict=True) if hertz <= 0.0]
    if faults:
        raise InputError('\n'.join(f'{path}: {fault}' for fault in faults))
    return names, found[0], found[1:]


def flexibility_of(path: Path, matrix: FloatArray, names: Sequence[str]) -> FloatArray:
    """Return a residual flexibility over named motions; an InputError says what is wrong."""
    if len(matrix) != len(names) or matrix.shape[1] != len(names):
        raise InputError(f'{path}: must have {len(names)} rows and columns, those of the modes, '
                         f'got {len(matrix)} and {matrix.shape[1]}')
    return _symmetric(path, 'flexibility', matrix)


def rigid_of(
    path: Path, table: FloatArray, names: Sequence[str],
) -> tuple[FloatArray, FloatArray]:
    """Return mass (6, 6) and rigid motion (p, 6) of named motions; an InputError as above."""
    if len(table) != len(DOFS) + len(names):
        raise InputError(f'{path}: must have six rows of mass and {len(names)} of rigid motion, '
                         f'those of the modes, got {len(table)}')
    mass = _symmetric(path, 'mass', table[:len(DOFS)])
    least = float(np.linalg.eigvalsh(mass)[0])
    if not least > 0.0:
        raise InputError(f'{path}: mass must be positive in every direction, got {least:.3g}')
    if np.abs(mass[:3, :3] - mass[0, 0] * np.eye(3)).max() > _PRINTED * mass[0, 0]:
        raise InputError(f'{path}: mass must be the same along x, y and z, got '
                         f'{", ".join(f"{one:g}" for one in mass.diagonal()[:3])} kg')
    return mass, table[len(DOFS):]


def _symmetric(path: Path, what: str, matrix: FloatArray) -> FloatArray:
    skew = float(np.abs(matrix - matrix.T).max() / (np.abs(matrix).max() or 1.0))
    if not skew <= _SYMMETRIC:
        raise InputError(f'{path}: {what} must be symmetric within {_SYMMETRIC:g} of its largest '
                         f'entry, got {skew:.3g}')
    return np.asarray(0.5 * (matrix + matrix.T))


def dofs_among(
    path: Path, rows: Sequence[Row], names: Sequence[str], rigid: FloatArray,
) -> list[Dof]:
    """Return named motions as a table describes them; their rigid motion (p, 6) has to fit."""
    known = {f'{row.dof.station}_{row.dof.axis}': row for row in rows}
    reach = 1.0 + np.abs(rigid).max(initial=0.0)

    def of(name: str, moves: FloatArray) -> Dof:
        if name not in known:
            raise InputError(f'{path}: has no {name}, which the modes have')
        row = known[name]
        off = float(np.abs(row.dof.rigid_row - moves).max())
        if off > _PRINTED * reach:
            raise InputError(f'{path}: line {row.line}: place of {name} must be that of the file '
                             f'rigid, from the same origin, got {off:.3g} m away')
        return row.dof

    return at_once(partial(of, name, moves)
                   for name, moves in zip(names, rigid, strict=True))


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
    split = at_once(partial(_split, path, name) for name in names)
    for (station, axis), row in zip(split, rows.tolist(), strict=True):
        place = places.setdefault(station, [math.nan] * 3)
        x, y, z = {'x': (None, -row[5], row[4]), 'y': (row[5], None, -row[3]),
                   'z': (-row[4], row[3], None)}.get(axis, (None, None, None))
        for along, value in enumerate((x, y, z)):
            if value is not None:
                place[along] = value

    def of(station: str, axis: str, moves: FloatArray) -> Dof:
        on_ground = re.sub(r'_?\d*$', '', station) in _ON_GROUND
        x, y, z = places[station]
        dof = Dof(station, axis, CONTACT if on_ground else SEAT, (x, y, z))
        # NaN: a place that no motion tells is free to be anywhere.
        if np.nanmax(np.abs(dof.rigid_row - moves)) > _PRINTED * (1.0 + np.abs(moves).max()):
            raise InputError(f'{path}: {station}_{axis} must move along {axis} of the file rigid '
                             'as its place does, whose rows are in this order, got '
                             f'{", ".join(f"{one:g}" for one in moves)}')
        return dof

    return at_once(partial(of, station, axis, moves)
                   for (station, axis), moves in zip(split, rows, strict=True))


def _split(path: Path, name: str) -> tuple[str, str]:
    """Return station and axis of a motion."""
    channel = Channel.parse(name)
    if channel.axis not in DOFS or not _STATION.fullmatch(channel.place):
        raise InputError(f'{path}: names of motions must be <station>_<x, y, z, rx, ry or rz>, '
                         f'got {shown(name)}')
    return channel.place, channel.axis
