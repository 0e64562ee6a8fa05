"""What holds the shaft: bearings and seals, their tables, and their pedestals."""

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
import math

import numpy as np

from rotorsoil_ros.arrays import ComplexArray, FloatArray, inside
from rotorsoil_ros.errors import RotorSoilError
from rotorsoil_ros.rotor.coefficients import (
    at,
    Coefficients,
    FrequencyTable,
    SpeedTable,
    tables,
    times,
    values,
)
from rotorsoil_ros.units import rad_s_to_hz, rad_s_to_rpm

_UNITS = {'stiffness': 'N/m', 'damping': 'N s/m', 'inertia': 'kg'}


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
    stiffness, damping, inertia : (2, 2) float array, SpeedTable or FrequencyTable
        Over (x, z), cross terms included [N/m], [N s/m], [kg]; an inertia over the speed at most.
    pedestal : Pedestal or None
        What carries the housing; None is rigid.
    seat : str or None
        Name of the place on a foundation that bends; None is that of the bearing.

    """

    name: str
    position: float
    foundation: str | None
    stiffness: Coefficients
    damping: Coefficients
    pedestal: Pedestal | None = None
    inertia: FloatArray | SpeedTable = field(default_factory=lambda: np.zeros((2, 2)))
    seat: str | None = None

    def __post_init__(self) -> None:
        for (name, unit), matrix in zip(_UNITS.items(), self.matrices, strict=True):
            if not isinstance(matrix, (SpeedTable, FrequencyTable)):
                _require_matrix(name, unit, matrix)
        if not any(np.any(values(matrix)) for matrix in self.matrices):
            raise RotorSoilError('stiffness, damping and inertia must not all be zero')

    @property
    def matrices(self) -> tuple[Coefficients, Coefficients, FloatArray | SpeedTable]:
        """Stiffness, damping and inertia."""
        return self.stiffness, self.damping, self.inertia

    @property
    def speed_range(self) -> tuple[float, float]:
        """Speeds at which its coefficients are known [rad/s]."""
        return _common(table.speed for matrix in self.matrices for table in tables(matrix))

    @property
    def frequency_range(self) -> tuple[float, float]:
        """Frequencies of vibration at which its coefficients are known [rad/s]."""
        return _common(matrix.frequency for matrix in self.matrices
                       if isinstance(matrix, FrequencyTable))

    @property
    def frequencies(self) -> FloatArray:
        """Frequencies at which a table bends [rad/s]."""
        own = [matrix.frequency for matrix in self.matrices if isinstance(matrix, FrequencyTable)]
        return np.unique(np.concatenate([np.zeros(0), *own]))

    @property
    def nominal_stiffness(self) -> float:
        """Mean direct stiffness over its directions and speeds [N/m]."""
        return float(np.abs(np.diagonal(values(self.stiffness), axis1=-2, axis2=-1)).mean())

    @property
    def is_film(self) -> bool:
        """Whether it pushes across as fluid films do: cross terms that differ, over the speed."""
        own = values(self.stiffness)
        return bool(tables(self.stiffness)) and bool(np.any(own[..., 0, 1] != own[..., 1, 0]))

    def scaled(self, *, stiffness: float = 1.0, damping: float = 1.0) -> 'Bearing':
        """Return the same bearing with its stiffness and its damping times a factor each."""
        return replace(self, stiffness=times(stiffness, self.stiffness),
                       damping=times(damping, self.damping))

    def coefficients(
        self, speed: FloatArray, omega: FloatArray,
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """
        Return stiffness, damping and inertia.

        Parameters
        ----------
        speed, omega : (n,) float arrays
            Rotor speed and frequency of the vibration [rad/s].

        Returns
        -------
        three (n, 2, 2) float arrays
            [N/m], [N s/m], [kg].

        Raises
        ------
        OutOfTableError
            If a table does not cover a speed or a frequency: nothing is extrapolated.

        """
        where = f'the table of {self.name}'
        held = inside(speed, self.speed_range, name='speed', unit='rpm', shown=rad_s_to_rpm,
                      where=where)
        swung = inside(omega, self.frequency_range, name='frequency', unit='Hz',
                       shown=rad_s_to_hz, where=where)
        stiffness, damping, inertia = (at(matrix, held, swung) for matrix in self.matrices)
        return stiffness, damping, inertia

    def dynamic_stiffness(self, omega: FloatArray, speed: FloatArray) -> ComplexArray:
        """Return K + i omega C - omega^2 M, (n, 2, 2) over (x, z) [N/m]."""
        stiffness, damping, inertia = self.coefficients(speed, omega)
        w = omega[:, None, None]
        return np.asarray(stiffness + 1j * w * damping - w**2 * inertia)


def _common(axes: Iterable[FloatArray]) -> tuple[float, float]:
    """Return what all axes of tables cover; everything where there is none."""
    ends = [(float(axis[0]), float(axis[-1])) for axis in axes]
    return (max((low for low, _ in ends), default=-math.inf),
            min((high for _, high in ends), default=math.inf))


def _require_matrix(name: str, unit: str, matrix: FloatArray) -> None:
    if matrix.shape != (2, 2) or not np.all(np.isfinite(matrix)):
        raise RotorSoilError(f'{name} must be a finite 2 x 2 matrix in {unit}, '
                             f'got {matrix.tolist()}')
