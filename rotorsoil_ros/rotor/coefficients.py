"""Coefficients of bearings: constants, or tables over speed and frequency of vibration."""

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from rotorsoil_ros.arrays import FloatArray
from rotorsoil_ros.errors import RotorSoilError
from rotorsoil_ros.units import rad_s_to_hz, rad_s_to_rpm

if TYPE_CHECKING:
    from scipy.interpolate import PchipInterpolator


@dataclass(frozen=True)
class SpeedTable:
    """
    2 x 2 coefficients over rotor speed, a monotone cubic between the points.

    Attributes
    ----------
    speed : (s,) float array
        Rising rotor speeds, two or more [rad/s].
    values : (s, 2, 2) float array
        Over (x, z) at each of them.

    References
    ----------
    Fritsch & Butland (1984), SIAM J. Sci. Stat. Comput. 5: between two points it overshoots
    neither of them.

    """

    speed: FloatArray
    values: FloatArray

    def __post_init__(self) -> None:
        count = len(self.speed)
        if not (self.speed.shape == (count,) and count >= 2 and np.all(np.isfinite(self.speed))
                and self.speed[0] >= 0.0 and np.all(np.diff(self.speed) > 0.0)):
            raise RotorSoilError('speeds of a table must be two or more, >= 0 rpm and rising, '
                                 f'got {rad_s_to_rpm(self.speed).tolist()}')
        if self.values.shape != (count, 2, 2) or not np.all(np.isfinite(self.values)):
            raise RotorSoilError(f'values of a table must be {count} finite 2 x 2 matrices, '
                                 f'got {self.values.tolist()}')

    @cached_property
    def _curve(self) -> 'PchipInterpolator':
        from scipy.interpolate import PchipInterpolator  # as slow to import as half of a start

        return PchipInterpolator(self.speed, self.values, axis=0, extrapolate=False)

    def __call__(self, speed: FloatArray) -> FloatArray:
        """Return the coefficients at speeds (n,) [rad/s], (n, 2, 2); NaN outside the table."""
        return np.asarray(self._curve(speed))


@dataclass(frozen=True)
class FrequencyTable:
    """
    2 x 2 coefficients over the frequency of the vibration, straight between the points.

    Attributes
    ----------
    frequency : (f,) float array
        Rising excitation frequencies, two or more [rad/s].
    at : tuple of f (2, 2) float arrays or SpeedTables
        What they are at each of them, at every rotor speed or over it.

    """

    frequency: FloatArray
    at: tuple[FloatArray | SpeedTable, ...]

    def __post_init__(self) -> None:
        count = len(self.frequency)
        if not (count >= 2 and np.all(np.isfinite(self.frequency)) and self.frequency[0] >= 0.0
                and np.all(np.diff(self.frequency) > 0.0) and len(self.at) == count):
            raise RotorSoilError('frequencies of a table must be two or more, >= 0 Hz and rising, '
                                 f'got {rad_s_to_hz(self.frequency).tolist()}')

    def __call__(self, speed: FloatArray, omega: FloatArray) -> FloatArray:
        """Return the coefficients at speeds and frequencies (n,) [rad/s], (n, 2, 2)."""
        left = np.clip(np.searchsorted(self.frequency, omega) - 1, 0, len(self.frequency) - 2)
        step = self.frequency[left + 1] - self.frequency[left]
        share = ((omega - self.frequency[left]) / step)[:, None, None]
        every = np.stack([at(one, speed, omega) for one in self.at])
        rows = np.arange(len(speed))
        return np.asarray((1.0 - share) * every[left, rows] + share * every[left + 1, rows])


Coefficients: TypeAlias = FloatArray | SpeedTable | FrequencyTable


def at(matrix: Coefficients, speed: FloatArray, omega: FloatArray) -> FloatArray:
    """Return coefficients at speeds and frequencies (n,) [rad/s], (n, 2, 2)."""
    if isinstance(matrix, FrequencyTable):
        return matrix(speed, omega)
    if isinstance(matrix, SpeedTable):
        return matrix(speed)
    return np.broadcast_to(matrix, (len(speed), 2, 2))


def tables(matrix: Coefficients) -> tuple[SpeedTable, ...]:
    """Return the tables over speed that coefficients consist of."""
    parts = matrix.at if isinstance(matrix, FrequencyTable) else (matrix,)
    return tuple(part for part in parts if isinstance(part, SpeedTable))


def values(matrix: Coefficients) -> FloatArray:
    """Return all that coefficients are at any point, (..., 2, 2)."""
    if isinstance(matrix, FrequencyTable):
        return np.concatenate([values(part).reshape(-1, 2, 2) for part in matrix.at])
    return matrix.values if isinstance(matrix, SpeedTable) else matrix


def times(factor: float, matrix: Coefficients) -> Coefficients:
    """Return all coefficients times a factor."""
    if isinstance(matrix, FrequencyTable):
        return FrequencyTable(matrix.frequency, tuple(
            _over_speed(factor, part) for part in matrix.at))
    return _over_speed(factor, matrix)


def _over_speed(factor: float, matrix: FloatArray | SpeedTable) -> FloatArray | SpeedTable:
    if isinstance(matrix, SpeedTable):
        return SpeedTable(matrix.speed, factor * matrix.values)
    return factor * matrix
