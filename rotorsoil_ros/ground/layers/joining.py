"""Which frequencies of layered ground are solved so that rational functions say the rest."""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import TypeAlias

import numpy as np

from rotorsoil_ros.arrays import ComplexArray, FloatArray
from rotorsoil_ros.errors import NotSolvedError
from rotorsoil_ros.ground.layers.table import LayeredTable
from rotorsoil_ros.ground.rational import interpolant, RationalMatrix

# Frequencies of a piece that are solved first, fewer if it is so narrow relative to its end, that
# check it in a round at least, and at most.
_FIRST_SOLVES = 8
_FIRST_IF_NARROW = 6
_NARROW = 0.1
_CHECKS = 2
_MOST_SOLVES = 80
_COMPARED = 200

# Where so many samples do not settle a fit there is more round-off than it is told, as of slow
# waves in stiff, nearly incompressible layers: then samples are met this well, and the error is
# what is found, up to so many times that wanted.
_MANY = 40
_ROUGH = 1e-4
_LESS = 10.0
# The second opinion follows them this many times less.
_POORER = 4.0
# Share of the samples at which a fit is exact at most, and that of a poorer one beside it.
_SUPPORT_SHARE = 0.8
_POORER_SHARE = 0.65

# Below this dimensionless frequency the eigenvalues of the waves coalesce: there a function that
# is known above it, and has no singularity nearby, says the rest.
_LOWEST_A0 = 0.02

SolveMany: TypeAlias = Callable[[FloatArray], ComplexArray]
ScaleOfMany: TypeAlias = Callable[[ComplexArray], FloatArray]


def joined_pieces(
    solver: Callable[[tuple[float, float]], tuple[SolveMany, int]], singular: FloatArray,
    highest: float, *, scale: ScaleOfMany, tolerance: float, noise: float,
) -> LayeredTable:
    """
    Return functions of frequency from rest to a highest one, piece by piece.

    Parameters
    ----------
    solver : callable
        From the ends of a piece to what solves frequencies (n,) in it, giving values (n, q), and
        its number of nodes: lower pieces have longer waves and need fewer.
    singular : (m,) float array
        Branch points between the pieces, rising.
    highest : float
        Highest frequency.
    scale : callable
        From values (n, q) to what their errors are measured against.
    tolerance : float
        Largest error at frequencies that a piece has not seen.
    noise : float
        Round-off of solves: a fit follows no sample closer.

    Raises
    ------
    NotSolvedError
        If the tolerance is not met.

    Notes
    -----
    Between two singular frequencies the compliance is smooth; at them a cut begins on which the
    functions of both sides differ as soon as the vibration decays. So each piece has a rational
    function of its own, from solves inside it only.

    """
    edges = np.concatenate([[0.0], singular, [highest]])
    lowest = min(_LOWEST_A0, 0.05 * float(edges[1]))
    worst, solves, most = 0.0, 0, 0
    pieces, poorer = [], []
    for left, right in pairwise(edges.tolist()):
        exact, nodes = solver((max(left, lowest), right))
        counted = _CountedSolve(exact)
        piece, other, error = _piece(counted, (max(left, lowest), right), _Fits(scale, noise),
                                     tolerance, from_rest=left == 0.0)
        pieces.append(piece)
        poorer.append(other)
        worst, most = max(worst, error), max(most, nodes)
        solves += counted.solves
    return LayeredTable(edges, tuple(pieces), tuple(poorer), worst, solves, most)


@dataclass(slots=True)
class _CountedSolve:
    """Exact solves of a piece, and how many there were."""

    solve: SolveMany
    solves: int = 0

    def __call__(self, omega: FloatArray) -> ComplexArray:
        self.solves += len(omega)
        return self.solve(omega)


@dataclass(frozen=True, slots=True)
class _Fits:
    """How functions are laid through samples, and compared."""

    scale: ScaleOfMany
    noise: float

    def through(self, omega: FloatArray, values: ComplexArray, share: float) -> RationalMatrix:
        """Return a function with nodes at a share of the samples at most."""
        return interpolant(omega, values, scale=self.scale(values), most=int(share * len(omega)),
                           tolerance=self.noise if len(omega) < _MANY else _ROUGH)

    def poorer(self, omega: FloatArray, values: ComplexArray, nodes: int) -> RationalMatrix:
        """Return a second opinion with so many nodes at most, chosen from the other end."""
        return interpolant(omega[::-1], values[::-1], scale=self.scale(values[::-1]),
                           most=max(2, nodes), tolerance=_POORER * self.noise)

    def apart(self, values: ComplexArray, reference: ComplexArray) -> float:
        """Return the largest difference of two functions."""
        return float((np.abs(values - reference) / self.scale(reference)).max())

    def least_known(self, omega: FloatArray, values: ComplexArray) -> FloatArray:
        """Return middles of gaps, one in each part of the piece: where two fits differ most."""
        middles: FloatArray = 0.5 * (omega[1:] + omega[:-1])
        good, poorer = (self.through(omega, values, share)(middles.astype(complex))
                        for share in (_SUPPORT_SHARE, _POORER_SHARE))
        difference = (np.abs(good - poorer) / self.scale(good)).max(axis=1)
        # One in each part: a fit can be wrong where both fits agree, and then not everywhere.
        parts = np.array_split(np.arange(middles.size), max(_CHECKS, len(omega) // 6))
        return np.asarray(middles[[part[difference[part].argmax()] for part in parts]])


def _piece(
    solve: _CountedSolve, span: tuple[float, float], fits: _Fits, tolerance: float, *,
    from_rest: bool,
) -> tuple[RationalMatrix, RationalMatrix, float]:
    """Return a function between two frequencies, a poorer one, and the error of the former."""
    left, right = span
    is_narrow = right - left < _NARROW * right
    omega = _towards_ends(left, right, _FIRST_IF_NARROW if is_narrow else _FIRST_SOLVES)
    values = solve(omega)
    everywhere = _towards_ends(0.0 if from_rest else left, right, _COMPARED).astype(complex)
    fit = fits.through(omega, values, _SUPPORT_SHARE)
    while True:
        middles = fits.least_known(omega, values)
        unseen = solve(middles)
        error = fits.apart(fit(middles.astype(complex)), unseen)
        order = np.argsort(np.append(omega, middles))
        omega = np.append(omega, middles)[order]
        values = np.concatenate([values, unseen])[order]
        checked, fit = fit, fits.through(omega, values, _SUPPORT_SHARE)
        # The better fit has met no unseen frequency: it must not stray from the one that has.
        error = max(error, fits.apart(fit(everywhere), checked(everywhere)))
        if error <= tolerance * (1.0 if len(omega) < _MANY else _LESS):
            return fit, fits.poorer(omega, values, len(fit.nodes) - 1), error
        if len(omega) > _MOST_SOLVES:
            raise NotSolvedError(
                f'the compliance of layered ground between a0 = {left:.4g} and {right:.4g} still '
                f'has an error of {error:.1e} after {len(omega)} solves, allowed is '
                f'{tolerance:g}')


def _towards_ends(lowest: float, highest: float, count: int) -> FloatArray:
    """
    Return points that crowd towards both ends, which are among them.

    Twice as Chebyshev points do: a singularity lies just beside each end, and light vibrations
    just below a cut-off, where radiation begins.
    """
    position = np.arange(count) / (count - 1)
    for _ in range(2):
        position = 0.5 * (1.0 - np.cos(np.pi * position))
    points: FloatArray = lowest + (highest - lowest) * position
    points[-1] = highest
    return points
