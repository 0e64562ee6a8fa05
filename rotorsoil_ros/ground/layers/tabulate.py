"""Which frequencies of layered ground are solved so that rational functions say the rest."""

from dataclasses import dataclass
from itertools import pairwise
import math

import numpy as np

from rotorsoil_ros.arrays import ComplexArray, FloatArray
from rotorsoil_ros.errors import NotSolvedError
from rotorsoil_ros.ground.layers.cutoffs import singular_frequencies
from rotorsoil_ros.ground.layers.cylinder import HEAVE, RigidCylinder, SWAY, TWIST
from rotorsoil_ros.ground.layers.line import LineMesh, VerticalLine
from rotorsoil_ros.ground.layers.profile import Embedment, LayeredSoil
from rotorsoil_ros.ground.layers.table import entry_scale, LayeredTable
from rotorsoil_ros.ground.rational import interpolant, RationalMatrix

# Frequencies of a piece that are solved first, fewer if it is so narrow relative to its end, that
# check it in a round at least, and at most.
_FIRST_SOLVES = 8
_FIRST_IF_NARROW = 6
_NARROW = 0.1
_CHECKS = 2
_MOST_SOLVES = 80
_COMPARED = 200

# A fit follows no sample closer than this, or it would follow round-off. Where so many samples do
# not settle it there is more of that, as of slow waves in stiff, nearly incompressible layers:
# then samples are met this well, and the error is what is found, up to so many times that wanted.
_EXACT = 3e-6
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


@dataclass(frozen=True, slots=True)
class Radii:
    """Radii of the discs that stand for a contact: sliding, heave, rx, ry, rz."""

    sliding: float
    heaving: float
    pitching: float
    rocking: float
    turning: float


def exact_compliance(
    ground: LayeredSoil, embedment: Embedment, radii: Radii, a0: FloatArray, *,
    mesh: LineMesh | None = None, span: tuple[float, float] | None = None,
) -> ComplexArray:
    """
    Return compliances by one solve per frequency, in the units of the ground.

    Parameters
    ----------
    ground, embedment, radii
        What stands where.
    a0 : (n,) float array
        Frequencies, each > 0.
    mesh : LineMesh, optional
        In place of the usual one.
    span : tuple of two floats, optional
        Frequencies for which the line is cut; those asked for if there is none.

    Returns
    -------
    (n, 7) complex array
        As `LayeredTable.compliance`.

    """
    span = span or (float(a0.min()), float(a0.max()))
    cylinder = _cylinder(ground, embedment, radii, span, mesh or LineMesh())
    return np.array([_compliance(cylinder, radii, omega) for omega in a0.tolist()])


def _cylinder(
    ground: LayeredSoil, embedment: Embedment, radii: Radii, span: tuple[float, float],
    mesh: LineMesh,
) -> RigidCylinder:
    smallest = min(radii.sliding, radii.heaving, radii.pitching, radii.rocking, radii.turning)
    return RigidCylinder(VerticalLine.through(
        ground, embedment, radius=smallest, lowest=span[0], highest=span[1], mesh=mesh))


def _compliance(cylinder: RigidCylinder, radii: Radii, omega: float) -> ComplexArray:
    """Return one row over `ENTRIES`; couplings are those of the mean of two radii."""
    at = cylinder.at(omega)
    swaying: dict[float, ComplexArray] = {}

    def sway(radius: float) -> ComplexArray:
        if radius not in swaying:
            swaying[radius] = np.linalg.inv(at.stiffness(SWAY, radius))
        return swaying[radius]

    heave = 1.0 / at.stiffness(HEAVE, radii.heaving)[0, 0]
    twist = 1.0 / at.stiffness(TWIST, radii.turning)[0, 0]
    # A rotation about x tilts towards -y where one about y tilts towards +x.
    return np.array([
        sway(radii.sliding)[0, 0], heave, sway(radii.pitching)[1, 1],
        sway(radii.rocking)[1, 1], twist,
        sway(math.sqrt(radii.sliding * radii.rocking))[0, 1],
        -sway(math.sqrt(radii.sliding * radii.pitching))[0, 1]])


def tabulate(
    ground: LayeredSoil, embedment: Embedment, radii: Radii, *, a0_max: float,
    tolerance: float = 1e-4,
) -> LayeredTable:
    """
    Return the compliance of a contact on layered ground from rest to a frequency.

    Parameters
    ----------
    ground, embedment, radii
        In units in which the soil below the base has G = rho = 1.
    a0_max : float
        Highest frequency.
    tolerance : float
        Largest error at frequencies that a piece has not seen.

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
    edges = np.concatenate([[0.0], singular_frequencies(ground, a0_max), [a0_max]])
    lowest = min(_LOWEST_A0, 0.05 * float(edges[1]))
    worst, solves, nodes = 0.0, 0, 0
    pieces, poorer = [], []
    for left, right in pairwise(edges.tolist()):
        # Lower pieces have longer waves and need fewer elements.
        cylinder = _cylinder(ground, embedment, radii, (max(left, lowest), right), LineMesh())
        exact = _ExactPiece(cylinder, radii)
        piece, other, error = _piece(exact, max(left, lowest), right, tolerance,
                                     from_rest=left == 0.0)
        pieces.append(piece)
        poorer.append(other)
        worst, nodes = max(worst, error), max(nodes, len(cylinder.line.depth))
        solves += exact.solves
    return LayeredTable(edges, tuple(pieces), tuple(poorer), worst, solves, nodes)


@dataclass(slots=True)
class _ExactPiece:
    """Exact solves of a piece, and how many there were."""

    cylinder: RigidCylinder
    radii: Radii
    solves: int = 0

    def __call__(self, omega: FloatArray) -> ComplexArray:
        self.solves += len(omega)
        return np.array([_compliance(self.cylinder, self.radii, one) for one in omega.tolist()])


def _piece(
    solve: _ExactPiece, left: float, right: float, tolerance: float, *, from_rest: bool,
) -> tuple[RationalMatrix, RationalMatrix, float]:
    """Return a function between two frequencies, a poorer one, and the error of the former."""
    is_narrow = right - left < _NARROW * right
    omega = _towards_ends(left, right, _FIRST_IF_NARROW if is_narrow else _FIRST_SOLVES)
    values = solve(omega)
    everywhere = _towards_ends(0.0 if from_rest else left, right, _COMPARED).astype(complex)
    fit = _fit(omega, values, _SUPPORT_SHARE)
    while True:
        middles = _least_known(omega, values)
        unseen = solve(middles)
        error = _difference(fit(middles.astype(complex)), unseen)
        order = np.argsort(np.append(omega, middles))
        omega = np.append(omega, middles)[order]
        values = np.concatenate([values, unseen])[order]
        checked, fit = fit, _fit(omega, values, _SUPPORT_SHARE)
        # The better fit has met no unseen frequency: it must not stray from the one that has.
        error = max(error, _difference(fit(everywhere), checked(everywhere)))
        if error <= tolerance * (1.0 if len(omega) < _MANY else _LESS):
            other = interpolant(
                omega[::-1], values[::-1], scale=entry_scale(values[::-1]),
                most=max(2, len(fit.nodes) - 1), tolerance=_POORER * _EXACT)
            return fit, other, error
        if len(omega) > _MOST_SOLVES:
            raise NotSolvedError(
                f'the compliance of layered ground between a0 = {left:.4g} and {right:.4g} still '
                f'has an error of {error:.1e} after {len(omega)} solves, allowed is '
                f'{tolerance:g}')


def _fit(omega: FloatArray, values: ComplexArray, share: float) -> RationalMatrix:
    tolerance = _EXACT if len(omega) < _MANY else _ROUGH
    return interpolant(omega, values, scale=entry_scale(values), most=int(share * len(omega)),
                       tolerance=tolerance)


def _least_known(omega: FloatArray, values: ComplexArray) -> FloatArray:
    """Return middles of gaps, one in each part of the piece: where two fits differ most there."""
    middles: FloatArray = 0.5 * (omega[1:] + omega[:-1])
    good, poorer = (_fit(omega, values, share)(middles.astype(complex))
                    for share in (_SUPPORT_SHARE, _POORER_SHARE))
    difference = (np.abs(good - poorer) / entry_scale(good)).max(axis=1)
    # One in each part: a fit can be wrong where both fits agree, and then not everywhere.
    parts = np.array_split(np.arange(middles.size), max(_CHECKS, len(omega) // 6))
    return np.asarray(middles[[part[difference[part].argmax()] for part in parts]])


def _difference(values: ComplexArray, reference: ComplexArray) -> float:
    return float((np.abs(values - reference) / entry_scale(reference)).max())


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
