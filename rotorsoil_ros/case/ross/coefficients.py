"""The coefficients of a bearing or seal that ROSS has saved, over our axes."""

from collections.abc import Sequence
import re
from typing import Any, TypeAlias

import numpy as np

from rotorsoil_ros.arrays import FloatArray
from rotorsoil_ros.case.document import shown
from rotorsoil_ros.case.ross.file import RossReader, Table
from rotorsoil_ros.units import rad_s_to_hz, rad_s_to_rpm

# Our keys, the letter of ROSS and the unit.
_KINDS = {'stiffness': ('k', 'N/m'), 'damping': ('c', 'N s/m'), 'inertia': ('m', 'kg')}
# The spin of ROSS takes x into y, which is up; ours takes z, which is up, into x.
_DIRECTIONS = (('xx', 'xx', 1.0), ('xz', 'xy', -1.0), ('zx', 'yx', -1.0), ('zz', 'yy', 1.0))
# Coefficients along the shaft, which its bending does not feel.
_AXIAL = ('kzz', 'czz', 'mzz')

# Points that stand for one step of a table over the frequency, which is straight with us.
_FINER = 4

Matrix: TypeAlias = dict[str, Any]


class CoefficientReader(RossReader):
    """Turns coefficients into what a case holds of them, noting what does not fit."""

    def read(self, title: str, table: Table) -> dict[str, Matrix]:
        """Return stiffness and damping, and inertia where there is some."""
        parts = {ours: self._columns(title, table, letter, unit)
                 for ours, (letter, unit) in _KINDS.items()}
        self._note(title, table)
        if not any(column.any() for column in parts['inertia'].values()):
            del parts['inertia']
        if any(_follows_frequency(part) for part in parts.values()):
            return self._over_both(title, table, parts)
        return {name: self._over_speed(title, table, part) for name, part in parts.items()}

    def _columns(
        self, title: str, table: Table, letter: str, unit: str,
    ) -> dict[str, FloatArray]:
        return {ours: sign * self._column(title, table, f'{letter}{theirs}', unit) + 0.0
                for ours, theirs, sign in _DIRECTIONS}

    def _column(self, title: str, table: Table, key: str, unit: str) -> FloatArray:
        """Return numbers, (s,), or a row of them for each speed, (s, f)."""
        given = table.get(key)
        if given is None and (key[0] == 'm' or key[1:] in ('xy', 'yx')):
            return np.zeros(1)
        if not (isinstance(given, list) and any(isinstance(row, list) for row in given)):
            return np.array(self.file.numbers(title, table, key, unit))
        axes = [self.file.numbers(title, table, axis, 'rad/s') for axis in ('speed', 'frequency')
                if self._has(title, table, axis, f'{key} is a table over speed and frequency')]
        rows = [self.file.numbers(f'{title}.{key}', {'row': row}, 'row', unit) for row in given]
        shape = [len(rows), *{len(row) for row in rows}]
        if shape != [len(axis) for axis in axes]:
            raise self.file.error(f'{title}.{key}', f'must have a row for each of {len(axes[0])} '
                                  f'speeds with {len(axes[1])} frequencies, got {shown(given)}')
        values = np.array(rows)
        # One that only has the shape of a table over the frequency is one over the speed.
        return values[:, 0] if np.all(values == values[:, :1]) else values

    def _has(self, title: str, table: Table, axis: str, why: str) -> bool:
        if table.get(axis) is None:
            raise self.file.error(f'{title}.{axis}', f'is missing, in rad/s; {why}')
        return True

    def _over_speed(self, title: str, table: Table, columns: dict[str, FloatArray]) -> Matrix:
        """Return constants, or a table over the speed."""
        if all(len(set(column.tolist())) == 1 for column in columns.values()):
            return {key: float(column[0]) for key, column in columns.items()
                    if key in ('xx', 'zz') or column[0] != 0.0}
        newer = self.file.major >= 3 and table.get('frequency') is None
        axis = 'speed' if newer or table.get('speed') is not None else 'frequency'
        self._has(title, table, axis, 'the coefficients are a table')
        self._note_axis(title, axis)
        speeds = self.file.numbers(title, table, axis, 'rad/s')
        full = {key: self._as_long(title, column, len(speeds), axis)
                for key, column in columns.items()}
        return {'speed_rpm': [rad_s_to_rpm(value) for value in speeds],
                **{key: column.tolist() for key, column in full.items()
                   if key in ('xx', 'zz') or column.any()}}

    def _as_long(
        self, title: str, column: FloatArray, count: int, axis: str,
    ) -> FloatArray:
        if len(column) not in (1, count):
            raise self.file.error(title, f'must have as many coefficients as {axis}, {count}, '
                                         f'got {len(column)}')
        return np.broadcast_to(column, (count,)) if len(column) == 1 else column

    def _over_both(
        self, title: str, table: Table, parts: dict[str, dict[str, FloatArray]],
    ) -> dict[str, Matrix]:
        """Return tables over speed and frequency; an inertia over both goes into the stiffness."""
        speed, omega = (np.array(self.file.numbers(title, table, axis, 'rad/s'))
                        for axis in ('speed', 'frequency'))
        finer, curve = omega, str(table.get('interpolation', 'pchip'))
        if curve == 'pchip' and len(omega) > 2:
            steps = np.linspace(0.0, 1.0, _FINER, endpoint=False)
            finer = np.append((omega[:-1, None] + np.diff(omega)[:, None] * steps).ravel(),
                              omega[-1])
            self.assumed.append(f'{title}: between two frequencies of its table {_FINER - 1} more '
                                'points of the curve of ROSS; ours is straight between points')
        full = {name: {key: self._spread(title, column, speed, omega, finer)
                       for key, column in part.items()} for name, part in parts.items()}
        found: dict[str, Matrix] = {}
        if 'inertia' in parts:
            if _follows_frequency(parts['inertia']):
                for key, inertia in full.pop('inertia').items():
                    full['stiffness'][key] = full['stiffness'][key] - finer**2 * inertia
                self.assumed.append(f'{title}: its inertia, which follows the frequency, is in '
                                    'the stiffness')
            else:
                found['inertia'] = self._over_speed(title, table, parts['inertia'])
                del full['inertia']
        axes = {'speed_rpm': [rad_s_to_rpm(value) for value in speed.tolist()],
                'frequency_hz': [rad_s_to_hz(value) for value in finer.tolist()]}
        return {**{name: {**axes, **{key: block.tolist() for key, block in part.items()
                                     if key in ('xx', 'zz') or block.any()}}
                   for name, part in full.items()}, **found}

    def _spread(
        self, title: str, column: FloatArray, speed: FloatArray, omega: FloatArray,
        finer: FloatArray,
    ) -> FloatArray:
        """Return a row for each speed over the finer frequencies, as ROSS interpolates."""
        if column.ndim == 1:
            full = self._as_long(title, column, len(speed), 'speed')
            return np.repeat(full[:, None], len(finer), axis=1)
        if len(finer) == len(omega):
            return column
        from scipy.interpolate import PchipInterpolator

        return np.asarray(PchipInterpolator(omega, column, axis=1)(finer))

    def _note_axis(self, title: str, axis: str) -> None:
        """Say that a file which knows both axes means another one than the speed."""
        if axis == 'frequency' and self.file.major >= 3:
            note = (f'{title}: its table is over the frequency of the vibration; it is taken over '
                    'the speed, which is the same for unbalance only (frequency_hz in place of '
                    'speed_rpm, a row of them, is the other)')
            if note not in self.lost:
                self.lost.append(note)

    def _note(self, title: str, table: Table) -> None:
        for key in _AXIAL:
            if key in table and np.any(_flat(table[key])):
                self.lost.append(f'{title}: {key} = {shown(table[key])}')
        if table.get('interpolation', 'pchip') != 'pchip':
            self.lost.append(f'{title}: interpolation = {shown(table["interpolation"])}; ours is '
                             'pchip')
        if not re.match(r'(Bearing|Seal)Element', title):
            self.lost.append(f'{title}: its geometry; its coefficients are kept')


def _follows_frequency(columns: dict[str, FloatArray]) -> bool:
    return any(column.ndim == 2 for column in columns.values())


def _flat(given: object) -> Sequence[float]:
    """Return all numbers of nested lists."""
    if isinstance(given, list):
        return [number for entry in given for number in _flat(entry)]
    return [given] if isinstance(given, (int, float)) else []
