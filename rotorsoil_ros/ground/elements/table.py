"""What the infinite elements know of a kind of soil: compliance without G, rho and size."""

from collections.abc import Mapping
from dataclasses import dataclass
import math
from typing import Any

import numpy as np
import numpy.typing as npt

from rotorsoil_ros.arrays import ComplexArray, FloatArray, inside, ROUNDING
from rotorsoil_ros.errors import require, RotorSoilError
from rotorsoil_ros.ground.infinite_rational import RationalFunction
from rotorsoil_ros.ground.joining import laplace_point

GEOMETRIES = ('disc', 'plane_strain', 'plane_stress')
PLANE_ENTRIES = ('xx', 'zz', 'ryry', 'xry')
DISC_ENTRIES = (*PLANE_ENTRIES, 'rzrz')

# Above this Poisson's ratio the quadratic displacement elements have not been measured.
LARGEST_POISSON_RATIO = 0.49
LARGEST_A0 = 20.0
SMALLEST_A0 = 0.005


def require_kind(geometry: str, poisson_ratio: float, loss_factor: float) -> None:
    """Raise a RotorSoilError if the infinite elements cannot be built for this kind of soil."""
    if geometry not in GEOMETRIES:
        raise RotorSoilError(f'geometry must be one of {", ".join(GEOMETRIES)}, got {geometry!r}')
    require(0.0 <= poisson_ratio <= LARGEST_POISSON_RATIO, 'poisson_ratio',
            f'in [0, {LARGEST_POISSON_RATIO}] for infinite elements', poisson_ratio)
    require(0.0 <= loss_factor < 1.0, 'loss_factor', 'in [0, 1)', loss_factor)


def require_range(geometry: str, a0_min: float, a0_max: float) -> None:
    """Raise a RotorSoilError if the infinite elements cannot cover this range."""
    if not (geometry == 'disc' and a0_min == 0.0):
        require(a0_min >= SMALLEST_A0, 'a0_min',
                f'>= {SMALLEST_A0:g} [-] for infinite elements (or 0 for a disc)', a0_min)
    require(a0_min < a0_max <= LARGEST_A0, 'a0_max',
            f'> a0_min and <= {LARGEST_A0:g} [-] for infinite elements', a0_max)


def entries_of(geometry: str) -> tuple[str, ...]:
    """Return the names of the compliances of a geometry, in the order of every array here."""
    return DISC_ENTRIES if geometry == 'disc' else PLANE_ENTRIES


def error_scale(values: ComplexArray) -> FloatArray:
    """
    Return what an error of each entry is measured against, (n, q).

    Notes
    -----
    A diagonal entry is measured against its own modulus, the coupling against the geometric
    mean of its two diagonals.

    """
    scale: FloatArray = np.abs(values)
    scale[:, 3] = np.sqrt(scale[:, 0] * scale[:, 2])
    return scale


@dataclass(frozen=True, slots=True, eq=False)
class DimensionlessTable:
    """
    Compliance of a rigid massless contact of unit size, welded to a half-space with G = rho = 1.

    The compliance is a function of one complex variable, s = i a0 / sqrt(1 + i eta), divided by
    1 + i eta. The table is a rational function of s, real on the real axis.

    Attributes
    ----------
    geometry : str
        `disc`, `plane_strain` or `plane_stress`.
    poisson_ratio, loss_factor : float
        nu and eta of the soil [-].
    a0_min, a0_max : float
        Range of dimensionless frequency that was solved and checked [-].
    function : RationalFunction
        Elastic compliances at s, in the order of `entries_of`.
    measured_error : float
        Largest error at frequencies that a fit had not seen, or, where that is larger, the
        largest change anywhere when they were added to it; relative to `error_scale`.
    solves : int
        Number of exact solves.
    unknowns : int
        Unknowns of the finite and infinite elements per frequency, all symmetry classes.

    """

    geometry: str
    poisson_ratio: float
    loss_factor: float
    a0_min: float
    a0_max: float
    function: RationalFunction
    measured_error: float
    solves: int
    unknowns: int

    @property
    def entries(self) -> tuple[str, ...]:
        """Names of the compliances in the columns of `compliance`."""
        return entries_of(self.geometry)

    def compliance(self, a0: FloatArray) -> ComplexArray:
        """
        Return the dimensionless compliances.

        Parameters
        ----------
        a0 : (n,) float array
            Dimensionless frequency, omega length / c_s with the undamped c_s [-].

        Returns
        -------
        (n, q) complex array
            G r N_xx, G r N_zz, G r^3 N_ryry, G r^2 N_xry, and for the disc G r^3 N_rzrz; for a
            plane geometry G N_xx, G N_zz, G b^2 N_ryry, G b N_xry per unit length along y.

        Raises
        ------
        OutOfTableError
            If a frequency lies outside the range that was solved.

        """
        a0 = inside(a0, (self.a0_min, self.a0_max), name='a0', unit='[-]',
                    where='the range of the table')
        return (self.function(laplace_point(a0, self.loss_factor))
                / (1.0 + 1j * self.loss_factor))

    def to_arrays(self) -> dict[str, npt.NDArray[Any]]:
        """Return the table as plain arrays, for a file that needs no pickle."""
        return {
            'geometry': np.array(self.geometry),
            'poisson_ratio': np.array(self.poisson_ratio),
            'loss_factor': np.array(self.loss_factor),
            'a0_min': np.array(self.a0_min),
            'a0_max': np.array(self.a0_max),
            'support': self.function.support,
            'values': self.function.values,
            'weights': self.function.weights,
            'measured_error': np.array(self.measured_error),
            'solves': np.array(self.solves),
            'unknowns': np.array(self.unknowns),
        }

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, npt.NDArray[Any]]) -> 'DimensionlessTable':
        """Return the table that `to_arrays` took apart."""
        nu, eta, low, high = (float(arrays[name]) for name in (
            'poisson_ratio', 'loss_factor', 'a0_min', 'a0_max'))
        function = RationalFunction(*(arrays[name] for name in ('support', 'values', 'weights')))
        return cls(str(arrays['geometry']), nu, eta, low, high, function,
                   float(arrays['measured_error']), int(arrays['solves']),
                   int(arrays['unknowns']))


def effective_poisson_ratio(geometry: str, poisson_ratio: float) -> float:
    """Return the ratio with which plane strain stands for the geometry, nu / (1 + nu) or nu."""
    is_thin = geometry == 'plane_stress'
    return poisson_ratio / (1.0 + poisson_ratio) if is_thin else poisson_ratio


def standard_range(geometry: str, a0_min: float, a0_max: float) -> tuple[float, float]:
    """
    Return the narrowest of a few fixed ranges that holds the given one.

    Notes
    -----
    Soils of another G, rho or size need another range. Few fixed ranges let them share a table.

    Raises
    ------
    RotorSoilError
        If the range reaches beyond what the infinite elements can do.

    """
    lowest = (0.05, 0.02, SMALLEST_A0, *([0.0] if geometry == 'disc' else []))
    # A square's discs are 1.14 times as wide as the half-width with which users write a0 <= 6.
    highest = (7.0, 12.0, LARGEST_A0)
    lower = next((edge for edge in lowest if edge <= a0_min * (1.0 + ROUNDING)), math.nan)
    upper = next((edge for edge in highest if edge >= a0_max * (1.0 - ROUNDING)), math.nan)
    require(math.isfinite(lower), 'a0',
            f'>= {lowest[-1]:g} [-] for infinite elements in {geometry}', a0_min)
    require(math.isfinite(upper), 'a0', f'<= {LARGEST_A0:g} [-] for infinite elements', a0_max)
    return lower, upper
