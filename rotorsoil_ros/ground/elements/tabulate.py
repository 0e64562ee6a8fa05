"""The compliance of a kind of soil by finite and infinite elements: exact, and as a table."""

import math

import numpy as np

from rotorsoil_ros.arrays import ComplexArray, FloatArray
from rotorsoil_ros.errors import require
from rotorsoil_ros.ground.elements.mesh import Discretisation, discretisation_for
from rotorsoil_ros.ground.elements.solver import HalfSpaceSolver
from rotorsoil_ros.ground.elements.table import (
    DimensionlessTable,
    effective_poisson_ratio,
    error_scale,
    require_kind,
    require_range,
    SMALLEST_A0,
)
from rotorsoil_ros.ground.joining import joined, laplace_point, Progress


def exact_compliance(
    a0: FloatArray, *, geometry: str, poisson_ratio: float, loss_factor: float,
    discretisation: Discretisation | None = None,
) -> ComplexArray:
    """
    Return dimensionless compliances by one finite and infinite element solve per frequency.

    Parameters
    ----------
    a0 : (n,) float array
        Dimensionless frequencies, each > 0 [-].
    geometry : str
        `disc`, `plane_strain` or `plane_stress`.
    poisson_ratio, loss_factor : float
        nu and eta of the soil [-].
    discretisation : Discretisation, optional
        Near field and waves in place of those chosen for the frequencies.

    Returns
    -------
    (n, q) complex array
        As `DimensionlessTable.compliance`.

    Raises
    ------
    RotorSoilError
        If the kind of soil or a frequency is out of range.
    NotSolvedError
        If a system is singular.

    """
    require_kind(geometry, poisson_ratio, loss_factor)
    lowest, highest = float(np.min(a0)), float(np.max(a0))
    require(lowest > 0.0 and math.isfinite(highest), 'a0', '> 0 and finite [-]', lowest)
    solver = HalfSpaceSolver(
        effective_poisson_ratio(geometry, poisson_ratio),
        discretisation or discretisation_for(lowest, highest), axisymmetric=geometry == 'disc')
    points = laplace_point(a0, loss_factor)
    solved = np.array([solver.compliance(complex(-1j * s)) for s in points])
    return solved / (1.0 + 1j * loss_factor)


def tabulate(
    geometry: str, *, poisson_ratio: float, loss_factor: float, a0_min: float = 0.05,
    a0_max: float = 6.0, tolerance: float = 1e-4, progress: Progress | None = None,
) -> DimensionlessTable:
    """
    Return the compliance of a kind of soil over a range of frequencies.

    Parameters
    ----------
    geometry : str
        `disc`, `plane_strain` or `plane_stress`.
    poisson_ratio, loss_factor : float
        nu and eta of the soil [-].
    a0_min, a0_max : float
        Range of dimensionless frequency; 0 is allowed for a disc [-].
    tolerance : float
        Largest error at frequencies that the table has not seen, relative to `error_scale`.
    progress : callable, optional
        Called with the number of solves and the last measured error.

    Returns
    -------
    DimensionlessTable
        Knows neither G nor rho nor the contact's size.

    Raises
    ------
    RotorSoilError
        If the kind of soil or the range is out of reach.
    NotSolvedError
        If a system is singular or the tolerance is not met.

    Notes
    -----
    Solves are joined as `joining.joined` says. A disc's compliance is smooth through a0 = 0 and
    known on both sides of it, because f(conj s) = conj f(s); so a range from 0 is interpolated,
    not extrapolated. A strip has no static limit.

    """
    require_kind(geometry, poisson_ratio, loss_factor)
    require_range(geometry, a0_min, a0_max)
    require(0.0 < tolerance < 1.0, 'tolerance', 'in (0, 1) [-]', tolerance)
    solver = HalfSpaceSolver(
        effective_poisson_ratio(geometry, poisson_ratio), discretisation_for(a0_min, a0_max),
        axisymmetric=geometry == 'disc')
    found = joined(
        f'{geometry}, poisson_ratio {poisson_ratio:g},',
        lambda point: solver.compliance(-1j * point), (max(a0_min, SMALLEST_A0), a0_max),
        loss_factor=loss_factor, scale=error_scale, tolerance=tolerance, progress=progress)
    return DimensionlessTable(
        geometry=geometry, poisson_ratio=poisson_ratio, loss_factor=loss_factor,
        a0_min=a0_min, a0_max=a0_max, function=found.function,
        measured_error=found.measured_error, solves=found.solves, unknowns=sum(solver.dofs))
