"""What somebody else computed or measured of the ground: a dynamic stiffness in a CSV file."""

from collections.abc import Collection, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from rotorsoil_ros.arrays import ComplexArray, FloatArray, IntArray
from rotorsoil_ros.case.document import shown
from rotorsoil_ros.case.entries.cells import lines_of, numbers_below
from rotorsoil_ros.channel import DOFS
from rotorsoil_ros.errors import InputError, RotorSoilError
from rotorsoil_ros.ground.branch_points import branch_points
from rotorsoil_ros.ground.table import ComplianceTable, PASSIVITY, RECIPROCITY
from rotorsoil_ros.units import hz_to_rad_s, rad_s_to_hz

_FREQUENCIES = ('omega_rad_s', 'hz')
# What the verb `seats` calls the second in plant units.
_PLANT_HERTZ = 'frequency_hz'
_ENTRIES = {f'{row}{column}': (i, j) for i, row in enumerate(DOFS)
            for j, column in enumerate(DOFS)}
_LARGEST_BYTES = 32 * 1024 * 1024


# Between two frequencies a smooth curve may swing so far below no loss, of its diagonal, and so
# many places are looked at: four printed digits make less, a jump makes more.
_SWING = 1e-3
_PLACES = 8

# Rows that make a piece of a curve between two cut-offs: a cubic of its own, and one to spare.
_ROWS_OF_A_PIECE = 4

# A branch point so near to a place where the curve is cut is the same.
_ONE_CUT = 0.05

# Of a frequency: 1 Hz and 60 rpm differ in the last digit.
_ROUND_OFF = 1e-12


def read(
    path: Path, covering: tuple[float, float], *, text: str | None = None,
    cut_offs_hz: Sequence[float] = (),
) -> ComplianceTable:
    """
    Read the dynamic stiffness of a massless contact and return what it gives way by.

    Parameters
    ----------
    path : Path
        CSV with a header: `omega_rad_s` or `hz`, then `<ij>_re,<ij>_im` [N/m, N, N m/rad] for
        each entry, `ij` in xx, zz, xry, ... A dof without a column, or with empty cells only,
        cannot move. Of two entries ij and ji one is enough.
    covering : tuple of two floats
        Frequencies that it has to know [rad/s].
    text : str or None
        What the file says, where that is known already; the path then only names it.
    cut_offs_hz : sequence of float
        Where waves of a layer begin to travel [Hz]; each is at the nearest row. They are looked
        for where none is given.

    Raises
    ------
    InputError
        One line with file and place, if it is not symmetric, not passive, not readable, or
        does not cover what it has to.

    """
    columns = columns_of(path, text_of(path) if text is None else text, _ENTRIES,
                         example='xx_re, xx_im, zz_re, ...')
    omega = frequencies_of(path, columns, covering)
    stiffness = _matrices(path, columns, len(omega))
    free = _free_dofs(path, stiffness)
    part = stiffness[np.ix_(np.arange(len(omega)), free, free)]
    _require_symmetry(path, part, omega, free)
    part = 0.5 * (part + part.swapaxes(1, 2))
    _require_passivity(path, part, omega)
    compliance = np.zeros_like(stiffness)
    try:
        unit = np.broadcast_to(np.eye(len(free)), part.shape)
        compliance[np.ix_(np.arange(len(omega)), free, free)] = np.linalg.solve(part, unit)
        # Solving leaves round-off between ij and ji.
        whole = ComplianceTable(omega, 0.5 * (compliance + compliance.swapaxes(1, 2)))
        found = _passive_curve(path, _cut(whole, cut_offs_hz), free)
        return found if cut_offs_hz else _with_branch_points(found)
    except InputError:
        raise
    except np.linalg.LinAlgError as error:
        raise InputError(f'{path}: the stiffness of a dof that has columns must not be zero') \
            from error
    except RotorSoilError as error:
        raise InputError(f'{path}: {error}') from error


def text_of(path: Path) -> str:
    """Return what a file says; an InputError tells why it cannot be read."""
    try:
        if path.stat().st_size > _LARGEST_BYTES:
            raise InputError(f'{path}: must be smaller than {_LARGEST_BYTES} bytes')
        return path.read_text(encoding='utf-8-sig')
    except OSError as error:
        raise InputError(f'{path}: cannot be read: {error.strerror}') from error
    except UnicodeDecodeError as error:
        raise InputError(f'{path}: is not a text file in UTF-8 (byte {error.start})') from error


def columns_of(
    path: Path, text: str, entries: Collection[str], *, example: str,
) -> dict[str, FloatArray]:
    """
    Return the numbers below each heading; NaN where a cell is empty.

    Parameters
    ----------
    path : Path
        Of the file.
    text : str
        What it says.
    entries : collection of str
        Names of what may be in it, each as `<name>_re,<name>_im`, beside the frequency.
    example : str
        How such columns are called.

    """
    (_, names), *lines = lines_of(path, text)
    header = [name.replace(_PLANT_HERTZ, 'hz') for name in names]
    _require_header(path, header, entries, example)
    numbers = numbers_below(path, header, lines, may_be_empty={*header} - {*_FREQUENCIES})
    return dict(zip(header, numbers.T, strict=True))


def _require_header(
    path: Path, header: list[str], entries: Collection[str], example: str,
) -> None:
    known = {f'{name}_{part}' for name in entries for part in ('re', 'im')}
    for name in header:
        if name not in known and name not in _FREQUENCIES:
            raise InputError(f'{path}: column {shown(name)} is not known; needed are '
                             f'{" or ".join(_FREQUENCIES)}, and {example}')
        if header.count(name) > 1:
            raise InputError(f'{path}: column {name} stands here twice')
        other = f'{name[:-2]}{"im" if name.endswith("_re") else "re"}'
        if name in known and other not in header:
            raise InputError(f'{path}: column {other} is missing; {name} is there')
    if sum(name in header for name in _FREQUENCIES) != 1:
        raise InputError(f'{path}: needs one column {" or ".join(_FREQUENCIES)}')


def frequencies_of(
    path: Path, columns: dict[str, FloatArray], covering: tuple[float, float],
) -> FloatArray:
    """Return the rising frequencies of a file, which have to cover some [rad/s]."""
    name = next(name for name in _FREQUENCIES if name in columns)
    values = columns[name]
    if not (len(values) >= 2 and values[0] >= 0.0 and np.all(np.diff(values) > 0.0)):
        raise InputError(f'{path}: {name} must be two or more rising frequencies >= 0, '
                         f'got {shown(values.tolist())}')
    omega = values.copy() if name == 'omega_rad_s' else hz_to_rad_s(values)
    for end, needed in zip((0, -1), covering, strict=True):
        if abs(omega[end] - needed) <= _ROUND_OFF * needed:
            omega[end] = needed
    if not (omega[0] <= covering[0] and covering[1] <= omega[-1]):
        low, high, first, last = (rad_s_to_hz(one) for one in (*covering, omega[0], omega[-1]))
        raise InputError(f'{path}: must cover speed_range_rpm, {low:g} to {high:g} Hz, '
                         f'got {first:g} to {last:g} Hz')
    return omega


def _matrices(path: Path, columns: dict[str, FloatArray], count: int) -> ComplexArray:
    """Return the stiffness, (n, 6, 6); NaN in dofs that are not there."""
    stiffness = np.zeros((count, len(DOFS), len(DOFS)), dtype=complex)
    known = {}
    for name, place in _ENTRIES.items():
        values = entry_of(path, columns, name)
        if values is not None:
            known[place] = values
    for (i, j), values in known.items():
        stiffness[:, i, j] = values
        if (j, i) not in known:
            stiffness[:, j, i] = values
    for i, j in known:
        for dof in (i, j):
            if (dof, dof) not in known:
                raise InputError(f'{path}: {DOFS[i]}{DOFS[j]} needs {DOFS[dof]}{DOFS[dof]}, '
                                 'which is missing')
    return stiffness


def entry_of(path: Path, columns: dict[str, FloatArray], name: str) -> ComplexArray | None:
    """Return one entry over all frequencies, (n,); None of one that is not there."""
    if f'{name}_re' not in columns:
        return None
    values = columns[f'{name}_re'] + 1j * columns[f'{name}_im']
    empty = np.isnan(values)
    if np.any(empty) and not np.all(empty):
        raise InputError(f'{path}: {name} must be given at all frequencies or at none')
    return None if np.any(empty) else values


def _free_dofs(path: Path, stiffness: ComplexArray) -> IntArray:
    free = np.flatnonzero(np.any(np.einsum('kii->ki', stiffness) != 0.0, axis=0))
    if not len(free):
        raise InputError(f'{path}: needs the stiffness of one dof or more, as in zz_re and zz_im')
    return free


def _require_symmetry(
    path: Path, stiffness: ComplexArray, omega: FloatArray, free: IntArray,
) -> None:
    skew = np.abs(stiffness - stiffness.swapaxes(1, 2)) / _units(stiffness)
    k, i, j = np.unravel_index(skew.argmax(), skew.shape)
    if not skew[k, i, j] <= RECIPROCITY:
        row, column = DOFS[free[i]], DOFS[free[j]]
        raise InputError(f'{path}: must be symmetric, got {stiffness[k, i, j]:g} for '
                         f'{row}{column} and {stiffness[k, j, i]:g} for {column}{row} '
                         f'at {omega[k]:g} rad/s')


def _require_passivity(path: Path, stiffness: ComplexArray, omega: FloatArray) -> None:
    loss = np.linalg.eigvalsh(stiffness.imag / _units(stiffness))[:, 0]
    worst = int(loss.argmin())
    if not loss[worst] >= -PASSIVITY:
        raise InputError(f'{path}: must not give energy (imaginary part positive semidefinite), '
                         f'got an eigenvalue of {loss[worst]:g} of the diagonal at '
                         f'{omega[worst]:g} rad/s')


def _passive_curve(path: Path, table: ComplianceTable, free: IntArray) -> ComplianceTable:
    """
    Return a table whose curve loses energy between its frequencies too, or refuse it.

    Where waves of a layer begin to travel the loss rises from that of the soil alone as a root
    does, and a smooth curve over that place swings below it: there the curve is cut.
    """
    while True:
        loss, below = _least_loss(table, free)
        if loss >= -_SWING:
            return table
        cut = [replace(table, cut_offs=tuple(sorted({*table.cut_offs, row})))
               for row in (below, below + 1) if _may_be_cut(table, row)]
        best = max(cut, key=lambda one: _least_loss(one, free)[0], default=table)
        if not _least_loss(best, free)[0] > loss:
            first, last = (rad_s_to_hz(one) for one in table.omega[below:below + 2])
            raise InputError(
                f'{path}: changes too abruptly for a smooth curve through its '
                f'{len(table.omega)} frequencies: between {first:.6g} and {last:.6g} Hz the '
                'ground would give energy; add frequencies there, or mend the jump')
        table = best


def _with_branch_points(table: ComplianceTable) -> ComplianceTable:
    """Return a table that knows where waves of a layer begin to travel, as its rows show it."""
    cuts = table.omega[list(table.cut_offs)]
    found = branch_points(table.omega, table.values)
    apart = np.abs(found[:, None] / cuts - 1.0).min(axis=1, initial=np.inf) > _ONE_CUT
    return replace(table, branch_points=tuple(found[apart].tolist()))


def _cut(table: ComplianceTable, cut_offs_hz: Sequence[float]) -> ComplianceTable:
    """Return a table whose curve ends at given frequencies."""
    for place in sorted(set(cut_offs_hz)):
        row = int(np.abs(table.omega - hz_to_rad_s(place)).argmin())
        if not _may_be_cut(table, row):
            raise RotorSoilError(
                f'cut_offs_hz must leave {_ROWS_OF_A_PIECE} rows to the ends of the table and to '
                f'the next, got {place:g} Hz')
        table = replace(table, cut_offs=(*table.cut_offs, row))
    return table


def _may_be_cut(table: ComplianceTable, row: int) -> bool:
    """Return whether a curve may end at a row: what is left must still be one on either side."""
    ends = (0, *table.cut_offs, len(table.omega) - 1)
    return all(abs(row - end) >= _ROWS_OF_A_PIECE for end in ends)


def _least_loss(table: ComplianceTable, free: IntArray) -> tuple[float, int]:
    """Return the least loss between rows, of the diagonal, and the row below it."""
    share = np.arange(1, _PLACES) / _PLACES
    between = (table.omega[:-1, None] + np.diff(table.omega)[:, None] * share).ravel()
    values = table.compliance(between)[:, free[:, None], free]
    loss = np.linalg.eigvalsh(-values.imag / _units(table.values[:, free[:, None], free]))[:, 0]
    worst = int(loss.argmin())
    return float(loss[worst]), int(np.searchsorted(table.omega, between[worst])) - 1


def _units(stiffness: ComplexArray) -> FloatArray:
    """Return what makes entries of different units comparable, (d, d)."""
    size = np.sqrt(np.abs(np.einsum('kii->ki', stiffness)).max(axis=0))
    return np.asarray(size[:, None] * size)
