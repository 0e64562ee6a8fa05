"""Which coefficients the entries of a bearing describe: constants, or tables over two axes."""

from collections.abc import Sequence
from itertools import pairwise
from typing import TypeAlias

import numpy as np

from rotorsoil_ros.arrays import FloatArray
from rotorsoil_ros.case.case_errors import Faults
from rotorsoil_ros.case.document import shown
from rotorsoil_ros.case.entries.bearing import (
    Damping,
    DampingMap,
    DampingTable,
    Inertia,
    InertiaTable,
    Stiffness,
    StiffnessMap,
    StiffnessTable,
)
from rotorsoil_ros.case.entries.entry import Place
from rotorsoil_ros.rotor.coefficients import Coefficients, FrequencyTable, SpeedTable
from rotorsoil_ros.units import hz_to_rad_s, rad_s_to_hz, rpm_to_rad_s

Constant: TypeAlias = Stiffness | Damping | Inertia
OverSpeed: TypeAlias = StiffnessTable | DampingTable | InertiaTable
OverBoth: TypeAlias = StiffnessMap | DampingMap

# Of a speed as a frequency.
_ROUNDING = 1e-12

_PLACES = ((0, 0, 'xx'), (0, 1, 'xz'), (1, 0, 'zx'), (1, 1, 'zz'))


def constant(entry: Constant) -> FloatArray:
    """Return coefficients that are the same at every speed."""
    return np.array([[entry.xx, entry.xz], [entry.zx, entry.zz]])


def coefficients(
    faults: Faults, place: Place, entry: Constant | OverSpeed | OverBoth,
) -> Coefficients:
    """
    Return the coefficients that an entry describes.

    Raises
    ------
    InputError
        If a column has not one entry for each speed, or a row not one for each frequency, or an
        axis does not rise or leaves a part of the speed range unknown.

    """
    if isinstance(entry, (StiffnessMap, DampingMap)):
        return _over_both(faults, place, entry)
    if not isinstance(entry, (StiffnessTable, DampingTable, InertiaTable)):
        return constant(entry)
    count = len(entry.speed_rpm)
    values = np.zeros((count, 2, 2))
    for i, j, key in _PLACES:
        column = getattr(entry, key)
        if column is not None:
            _require_count(faults, (*place, key), column, count, 'entries as speed_rpm')
            values[:, i, j] = column
    require_speeds(faults, (*place, 'speed_rpm'), entry.speed_rpm)
    return SpeedTable(rpm_to_rad_s(np.array(entry.speed_rpm)), values)


def _over_both(faults: Faults, place: Place, entry: OverBoth) -> FrequencyTable:
    speeds, width = entry.speed_rpm, len(entry.frequency_hz)
    rows = 1 if speeds is None else len(speeds)
    values = np.zeros((rows, width, 2, 2))
    for i, j, key in _PLACES:
        block = getattr(entry, key)
        if block is None:
            continue
        if speeds is None and len(block) != 1:
            raise faults.error(*place, key, problem='must have one row, as there is no speed_rpm, '
                                                    f'got {len(block)}')
        _require_count(faults, (*place, key), block, rows, 'rows as speed_rpm')
        for index, row in enumerate(block):
            _require_count(faults, (*place, key, index), row, width, 'entries as frequency_hz')
        values[..., i, j] = block
    _require_rising(faults, (*place, 'frequency_hz'), entry.frequency_hz, 'frequencies', 'Hz')
    # Unbalance vibrates with the frequency of the speed.
    _require_covered(faults, (*place, 'frequency_hz'), entry.frequency_hz, 'Hz')
    at: tuple[FloatArray | SpeedTable, ...] = tuple(values[0])
    if speeds is not None:
        require_speeds(faults, (*place, 'speed_rpm'), speeds)
        speed = rpm_to_rad_s(np.array(speeds))
        at = tuple(SpeedTable(speed, values[:, column]) for column in range(width))
    return FrequencyTable(hz_to_rad_s(np.array(entry.frequency_hz)), at)


def _require_count(
    faults: Faults, place: Place, given: Sequence[object], count: int, what: str,
) -> None:
    if len(given) != count:
        raise faults.error(*place, problem=f'must have as many {what}, {count}, '
                                           f'got {len(given)}')


def require_speeds(faults: Faults, place: Place, speed_rpm: list[float]) -> None:
    """Refuse speeds that do not rise, or leave a part of the speed range unknown."""
    _require_rising(faults, place, speed_rpm, 'speeds', 'rpm')
    _require_covered(faults, place, speed_rpm, 'rpm')


def _require_rising(
    faults: Faults, place: Place, axis: list[float], what: str, unit: str,
) -> None:
    rises = all(left < right for left, right in pairwise(axis))
    if not (len(axis) >= 2 and rises and axis[0] >= 0.0):
        raise faults.error(*place, problem=f'must be two or more rising {what} >= 0 {unit}, '
                                           f'got {shown(axis)}')


def _require_covered(
    faults: Faults, place: Place, axis: list[float], unit: str,
) -> None:
    low, high = (end if unit == 'rpm' else rad_s_to_hz(rpm_to_rad_s(end))
                 for end in faults.entries.speed_range_rpm)
    if low < high and not (axis[0] <= (1.0 + _ROUNDING) * low
                           and high <= (1.0 + _ROUNDING) * axis[-1]):
        raise faults.error(
            *place, problem=f'must cover speed_range_rpm, {low:g} to {high:g} {unit}, '
                            f'got {axis[0]:g} to {axis[-1]:g}')
