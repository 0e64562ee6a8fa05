"""Which frequencies to solve so that a rational function says the rest, and how well it does."""

from collections.abc import Callable
from dataclasses import dataclass
import math
from typing import TypeAlias

import numpy as np

from rotorsoil_ros.arrays import ComplexArray, FloatArray
from rotorsoil_ros.errors import NotSolvedError
from rotorsoil_ros.ground.infinite_rational import fit_rational, RationalFunction

FIRST_SOLVES = 9
CHECKS = 3
COMPARED = 400
MOST_SOLVES = 90
# Share of the solved frequencies at which the fit is exact; the rest choose its poles. A
# poorer fit beside it shows where the two know least.
SUPPORT_SHARE = 0.8
POORER_SHARE = 0.65

Progress: TypeAlias = Callable[[int, float], None]
Solve: TypeAlias = Callable[[complex], ComplexArray]
Scale: TypeAlias = Callable[[ComplexArray], FloatArray]


@dataclass(frozen=True, slots=True)
class Joined:
    """
    Rational functions through exact solves.

    Attributes
    ----------
    function : RationalFunction
        Of the dimensionless Laplace variable.
    measured_error : float
        Largest error at frequencies that a fit had not seen, or, where that is larger, the
        largest change anywhere when they were added to it.
    solves : int
        Number of exact solves.

    """

    function: RationalFunction
    measured_error: float
    solves: int


def laplace_point(a0: FloatArray, loss_factor: float) -> ComplexArray:
    """
    Return the dimensionless Laplace variable, i a0 / sqrt(1 + i eta).

    Notes
    -----
    Hysteretic damping multiplies every modulus by 1 + i eta. Divided by it, the equations of
    motion are those of the undamped soil at this complex frequency.

    """
    points: ComplexArray = 1j * np.asarray(a0, dtype=float) / np.sqrt(1.0 + 1j * loss_factor)
    return points


def joined(
    what: str, solve: Solve, span: tuple[float, float], *, loss_factor: float, scale: Scale,
    tolerance: float, accepted: float | None = None, progress: Progress | None = None,
) -> Joined:
    """
    Return rational functions that are as good between the solved frequencies as at them.

    Parameters
    ----------
    what : str
        What is solved, for the error.
    solve : callable
        From the Laplace variable to the values (q,) of the undamped soil there.
    span : tuple of two floats
        Lowest and highest a0 to be solved [-].
    loss_factor : float
        eta of the soil, which sets the Laplace variable of an a0 [-].
    scale : callable
        From values (n, q) to what their errors are measured against.
    tolerance : float
        Largest error at frequencies that the functions have not seen.
    accepted : float, optional
        Error that will do where solves with noise of their own never meet the tolerance.
    progress : callable, optional
        Called with the number of solves and the last measured error.

    Raises
    ------
    NotSolvedError
        If the tolerance is not met.

    Notes
    -----
    Exact solves at Chebyshev points of sqrt(a0) are joined by a rational function. Then rounds:
    in the gaps where it differs most from a poorer fit, the middle is solved and compared
    before it joins the data. The first round within tolerance is the last.

    """
    def solved(wanted: FloatArray, before: int, error: float) -> ComplexArray:
        found = []
        for point in laplace_point(wanted, loss_factor):
            found.append(solve(complex(point)))
            if progress is not None:
                progress(before + len(found), error)
        return np.array(found)

    def fitted(share: float) -> RationalFunction:
        return fit_rational(laplace_point(a0, loss_factor), values, scale=scale(values),
                            size=int(share * a0.size))

    def difference(found: ComplexArray, reference: ComplexArray) -> float:
        return float((np.abs(found - reference) / scale(reference)).max())

    error = math.inf
    a0 = _chebyshev(*span, FIRST_SOLVES)
    values = solved(a0, 0, error)
    fit = fitted(SUPPORT_SHARE)
    everywhere = laplace_point(_chebyshev(*span, COMPARED), loss_factor)
    while a0.size <= MOST_SOLVES:
        middles = _least_known(a0, fit, fitted(POORER_SHARE), loss_factor, scale)
        unseen = solved(middles, a0.size, error)
        error = difference(fit(laplace_point(middles, loss_factor)), unseen)
        order = np.argsort(np.append(a0, middles))
        a0 = np.append(a0, middles)[order]
        values = np.concatenate([values, unseen])[order]
        checked, fit = fit, fitted(SUPPORT_SHARE)
        # The better fit has met no unseen frequency: it must not stray from the one that has.
        error = max(error, difference(fit(everywhere), checked(everywhere)))
        if error <= tolerance:
            return Joined(fit, error, a0.size)
    if accepted is not None and error <= accepted:
        return Joined(fit, error, a0.size)
    raise NotSolvedError(
        f'the compliance of {what} still has an error of {error:.1e} after {a0.size} solves, '
        f'allowed is {tolerance:g}')


def _chebyshev(lowest: float, highest: float, count: int) -> FloatArray:
    """Return Chebyshev points of sqrt(a0), ends included: finer where a strip's log lives."""
    position = (1.0 - np.cos(np.pi * np.arange(count) / (count - 1))) / 2.0
    ends = math.sqrt(lowest), math.sqrt(highest)
    points: FloatArray = (ends[0] + (ends[1] - ends[0]) * position) ** 2
    return points


def _least_known(
    a0: FloatArray, good: RationalFunction, poorer: RationalFunction, loss_factor: float,
    scale: Scale,
) -> FloatArray:
    """Return middles of gaps, one in each part of the range: where two fits differ most there."""
    root = np.sqrt(a0)
    middles: FloatArray = ((root[1:] + root[:-1]) / 2.0) ** 2
    points = laplace_point(middles, loss_factor)
    better = good(points)
    difference = (np.abs(better - poorer(points)) / scale(better)).max(axis=1)
    # One in each part: a fit can be wrong where both fits agree, and then not everywhere.
    parts = np.array_split(np.arange(middles.size), max(CHECKS, a0.size // 4))
    return middles[[part[difference[part].argmax()] for part in parts]]
