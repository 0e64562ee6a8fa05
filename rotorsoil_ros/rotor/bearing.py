"""What holds the shaft: bearings and seals, their tables over speed, and their pedestals."""

from dataclasses import dataclass, replace
from functools import cached_property
import math
from typing import TYPE_CHECKING

import numpy as np

from rotorsoil_ros.arrays import ComplexArray, FloatArray
from rotorsoil_ros.errors import OutOfTableError, RotorSoilError
from rotorsoil_ros.units import rad_s_to_rpm

if TYPE_CHECKING:
    from scipy.interpolate import PchipInterpolator

# Share of a speed by which round-off may put it beyond a table.
_ROUNDING = 1e-12


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


@dataclass(frozen=True, slots=True)
class Pedestal:
    """
    Elastic structure between a bearing's housing and the block, over (x, z).

    Attributes
    ----------
    mass : (2, 2) float array
        Of the housing and what moves with it [kg].
    stiffness, damping : (2, 2) float array
        Between housing and block [N/m], [N s/m].

    """

    mass: FloatArray
    stiffness: FloatArray
    damping: FloatArray

    def __post_init__(self) -> None:
        for name, unit in (('mass', 'kg'), ('stiffness', 'N/m'), ('damping', 'N s/m')):
            _require_matrix(name, unit, getattr(self, name))
        if not abs(np.linalg.det(self.stiffness)) > 0.0:
            raise RotorSoilError('stiffness must have an inverse, in N/m, '
                                 f'got {self.stiffness.tolist()}')

    def compliance(self, omega: FloatArray) -> ComplexArray:
        """Return the deflection per force without the mass, (n, 2, 2) [m/N]."""
        dynamic: ComplexArray = self.stiffness + 1j * omega[:, None, None] * self.damping
        return np.asarray(np.linalg.inv(dynamic))


@dataclass(frozen=True, slots=True)
class Bearing:
    """
    Spring and damper between the shaft and its housing.

    A seal is a bearing too; it needs no foundation of its own and little stiffness.

    Attributes
    ----------
    name : str
        First part of its channels.
    position : float
        Along the shaft [m].
    foundation : str or None
        Name of the block on which its housing stands; None is ground that does not move.
    stiffness, damping : (2, 2) float array or SpeedTable
        Over (x, z), cross terms included [N/m], [N s/m].
    pedestal : Pedestal or None
        What carries the housing; None is rigid.

    """

    name: str
    position: float
    foundation: str | None
    stiffness: FloatArray | SpeedTable
    damping: FloatArray | SpeedTable
    pedestal: Pedestal | None = None

    def __post_init__(self) -> None:
        for name, unit in (('stiffness', 'N/m'), ('damping', 'N s/m')):
            matrix = getattr(self, name)
            if not isinstance(matrix, SpeedTable):
                _require_matrix(name, unit, matrix)
        if not np.any(_values(self.stiffness)) and not np.any(_values(self.damping)):
            raise RotorSoilError('stiffness and damping must not both be zero')

    @property
    def speed_range(self) -> tuple[float, float]:
        """Speeds at which its coefficients are known [rad/s]."""
        tables = [matrix.speed for matrix in (self.stiffness, self.damping)
                  if isinstance(matrix, SpeedTable)]
        return (max((float(speed[0]) for speed in tables), default=-math.inf),
                min((float(speed[-1]) for speed in tables), default=math.inf))

    @property
    def nominal_stiffness(self) -> float:
        """Mean direct stiffness over its directions and speeds [N/m]."""
        return float(np.abs(np.diagonal(_values(self.stiffness), axis1=-2, axis2=-1)).mean())

    @property
    def is_film(self) -> bool:
        """Whether it pushes across as fluid films do: cross terms that differ, over the speed."""
        own = self.stiffness
        return isinstance(own, SpeedTable) and bool(
            np.any(own.values[:, 0, 1] != own.values[:, 1, 0]))

    def scaled(self, *, stiffness: float = 1.0, damping: float = 1.0) -> 'Bearing':
        """Return the same bearing with its stiffness and its damping times a factor each."""
        return replace(self, stiffness=_times(stiffness, self.stiffness),
                       damping=_times(damping, self.damping))

    def coefficients(self, speed: FloatArray) -> tuple[FloatArray, FloatArray]:
        """
        Return stiffness and damping at each speed.

        Parameters
        ----------
        speed : (n,) float array
            Rotor speed [rad/s].

        Returns
        -------
        two (n, 2, 2) float arrays
            [N/m], [N s/m].

        Raises
        ------
        OutOfTableError
            If a table does not cover a speed: nothing is extrapolated.

        """
        low, high = self.speed_range
        # A speed at the end of a table may come back from a sweep by a rounding beyond it.
        held = np.clip(speed, low, high)
        outside = ~(np.abs(speed - held) <= _ROUNDING * np.abs(speed))
        if np.any(outside):
            raise OutOfTableError(
                f'speed must be within {rad_s_to_rpm(low):g} to {rad_s_to_rpm(high):g} rpm, the '
                f'table of {self.name}, got {rad_s_to_rpm(float(speed[outside][0])):g} rpm')
        stiffness, damping = (
            matrix(held) if isinstance(matrix, SpeedTable)
            else np.broadcast_to(matrix, (len(speed), 2, 2))
            for matrix in (self.stiffness, self.damping))
        return stiffness, damping

    def dynamic_stiffness(self, omega: FloatArray, speed: FloatArray) -> ComplexArray:
        """Return K(speed) + i omega C(speed), (n, 2, 2) over (x, z) [N/m]."""
        stiffness, damping = self.coefficients(speed)
        return np.asarray(stiffness + 1j * omega[:, None, None] * damping)


def _times(factor: float, matrix: FloatArray | SpeedTable) -> FloatArray | SpeedTable:
    if isinstance(matrix, SpeedTable):
        return SpeedTable(matrix.speed, factor * matrix.values)
    return factor * matrix


def _values(matrix: FloatArray | SpeedTable) -> FloatArray:
    return matrix.values if isinstance(matrix, SpeedTable) else matrix


def _require_matrix(name: str, unit: str, matrix: FloatArray) -> None:
    if matrix.shape != (2, 2) or not np.all(np.isfinite(matrix)):
        raise RotorSoilError(f'{name} must be a finite 2 x 2 matrix in {unit}, '
                             f'got {matrix.tolist()}')
