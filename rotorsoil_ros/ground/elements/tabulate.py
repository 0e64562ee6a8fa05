"""Which frequencies to solve so that a rational function says the rest, and how well it does."""

from collections.abc import Callable
import math

import numpy as np

from rotorsoil_ros.arrays import ComplexArray, FloatArray
from rotorsoil_ros.errors import NotSolvedError, require
from rotorsoil_ros.ground.elements.mesh import Discretisation, discretisation_for
from rotorsoil_ros.ground.elements.solver import HalfSpaceSolver
from rotorsoil_ros.ground.elements.table import (
    DimensionlessTable,
    effective_poisson_ratio,
    error_scale,
    laplace_point,
    require_kind,
    require_range,
    SMALLEST_A0,
)
from rotorsoil_ros.ground.infinite_rational import fit_rational, RationalFunction

FIRST_SOLVES = 9
CHECKS = 3
COMPARED = 400
MOST_SOLVES = 90
# Share of the solved frequencies at which the fit is exact; the rest choose its poles. A
# poorer fit beside it shows where the two know least.
SUPPORT_SHARE = 0.8
POORER_SHARE = 0.65

Progress = Callable[[int, float], None]


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
    Exact solves at Chebyshev points of sqrt(a0) are joined by a rational function. Then rounds:
    in the gaps where it differs most from a poorer fit, the middle is solved and compared
    before it joins the data. The first round within tolerance is the last.

    A disc's compliance is smooth through a0 = 0 and known on both sides of it, because
    f(conj s) = conj f(s); so a range from 0 is interpolated, not extrapolated. A strip has no
    static limit.

    """
    require_kind(geometry, poisson_ratio, loss_factor)
    require_range(geometry, a0_min, a0_max)
    require(0.0 < tolerance < 1.0, 'tolerance', 'in (0, 1) [-]', tolerance)
    lowest = max(a0_min, SMALLEST_A0)
    solver = HalfSpaceSolver(
        effective_poisson_ratio(geometry, poisson_ratio), discretisation_for(a0_min, a0_max),
        axisymmetric=geometry == 'disc')

    def solve(wanted: FloatArray, before: int, error: float) -> ComplexArray:
        solved = []
        for point in laplace_point(wanted, loss_factor):
            solved.append(solver.compliance(complex(-1j * point)))
            if progress is not None:
                progress(before + len(solved), error)
        return np.array(solved)

    error = math.inf
    a0 = _chebyshev(lowest, a0_max, FIRST_SOLVES)
    values = solve(a0, 0, error)
    fit = _fit(a0, values, loss_factor, SUPPORT_SHARE)
    everywhere = laplace_point(_chebyshev(lowest, a0_max, COMPARED), loss_factor)
    while a0.size <= MOST_SOLVES:
        middles = _least_known_middles(a0, values, loss_factor)
        unseen = solve(middles, a0.size, error)
        error = _difference(fit(laplace_point(middles, loss_factor)), unseen)
        order = np.argsort(np.append(a0, middles))
        a0 = np.append(a0, middles)[order]
        values = np.concatenate([values, unseen])[order]
        checked, fit = fit, _fit(a0, values, loss_factor, SUPPORT_SHARE)
        # The better fit has met no unseen frequency: it must not stray from the one that has.
        error = max(error, _difference(fit(everywhere), checked(everywhere)))
        if error <= tolerance:
            return DimensionlessTable(
                geometry=geometry, poisson_ratio=poisson_ratio, loss_factor=loss_factor,
                a0_min=a0_min, a0_max=a0_max, function=fit, measured_error=error,
                solves=a0.size, unknowns=sum(solver.dofs))
    raise NotSolvedError(
        f'the compliance of {geometry}, poisson_ratio {poisson_ratio:g}, still has an error of '
        f'{error:.1e} after {a0.size} solves, allowed is {tolerance:g}')


def _difference(values: ComplexArray, reference: ComplexArray) -> float:
    return float((np.abs(values - reference) / error_scale(reference)).max())


def _chebyshev(lowest: float, highest: float, count: int) -> FloatArray:
    """Return Chebyshev points of sqrt(a0), ends included: finer where a strip's log lives."""
    position = (1.0 - np.cos(np.pi * np.arange(count) / (count - 1))) / 2.0
    ends = math.sqrt(lowest), math.sqrt(highest)
    points: FloatArray = (ends[0] + (ends[1] - ends[0]) * position) ** 2
    return points


def _fit(
    a0: FloatArray, values: ComplexArray, loss_factor: float, share: float,
) -> RationalFunction:
    return fit_rational(laplace_point(a0, loss_factor), values, scale=error_scale(values),
                        size=int(share * a0.size))


def _least_known_middles(
    a0: FloatArray, values: ComplexArray, loss_factor: float,
) -> FloatArray:
    """Return middles of gaps, one in each part of the range: where two fits differ most there."""
    root = np.sqrt(a0)
    middles: FloatArray = ((root[1:] + root[:-1]) / 2.0) ** 2
    points = laplace_point(middles, loss_factor)
    good, poorer = (
        _fit(a0, values, loss_factor, share)(points) for share in (SUPPORT_SHARE, POORER_SHARE))
    difference = (np.abs(good - poorer) / error_scale(good)).max(axis=1)
    # One in each part: a fit can be wrong where both fits agree, and then not everywhere.
    parts = np.array_split(np.arange(middles.size), max(CHECKS, a0.size // 4))
    return middles[[part[difference[part].argmax()] for part in parts]]
