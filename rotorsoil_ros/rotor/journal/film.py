"""How an oil film carries: Reynolds' equation with cavitation, and its exact derivative."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg.lapack import dpbtrf, dpbtrs

from rotorsoil_ros.arrays import BoolArray, FloatArray
from rotorsoil_ros.errors import NotSolvedError

# Points of the film between the middle of the bearing and its end.
AXIAL = 10

# Exchanges of wet and dry points, for each point over the angle, before the film is given up:
# eight are usual from nothing, but a film that has to grow does so by one point each time.
_PASSES = 2

# Of the largest pressure or source: less is neither a film nor none.
_TIE = 1e-12


@dataclass(frozen=True, slots=True)
class Pad:
    """
    A piece of the bore between two grooves, in radians and assembled clearances.

    Attributes
    ----------
    start, end : float
        Where it begins and ends in the sense of spin, from z (up) towards x [rad].
    centre : float
        Direction in which its own centre is displaced, or of its pivot [rad].
    preload : float
        Share of the machined clearance that assembly takes, 0 <= m < 1 [-].

    """

    start: float
    end: float
    centre: float
    preload: float


@dataclass(frozen=True, slots=True)
class FilmForces:
    """
    What a film does to the journal, without dimension.

    Attributes
    ----------
    force : (d,) float array
        On the journal in each direction, in mu Omega R^3 L / c^2.
    stiffness, damping : (d, d) float arrays
        -d force / d displacement and -d force / d velocity, force first, in that over c and
        that over c Omega.
    least : float
        Smallest film thickness over the assembled clearance [-].

    """

    force: FloatArray
    stiffness: FloatArray
    damping: FloatArray
    least: float


@dataclass(frozen=True)
class Film:
    """
    Pads on a mesh, finite volumes over angle and half the length.

    Attributes
    ----------
    pads : sequence of Pad
        They share no pressure: every end is a groove.
    slenderness : float
        D / L [-].
    directions : (d, 2) float array
        Ways in which the journal moves, over (sin, cos) of the angle on the bearing.
    cells : int
        Of each pad, over its angle.

    Notes
    -----
    With H = h / c and p = 6 mu Omega (R / c)^2 P,

        d/dphi (H^3 dP/dphi) + (D/L)^2 d/deta (H^3 dP/deta) = dH/dphi + 2 dH/dtau,

    eta = 2 y / L, tau = Omega t. Where the film would pull it is torn (Reynolds): P >= 0 and
    A P >= b, one of them as an equation at every point. The wet points are found by exchange,
    each time with one Cholesky factor of the band; the same factor gives the derivatives.

    References
    ----------
    Lund & Thomsen (1978), ASME Topics in Fluid Film Bearing and Rotor Bearing System Design;
    Hintermueller, Ito & Kunisch (2002), SIAM J. Optim. 13: primal-dual active sets.

    """

    pads: Sequence[Pad]
    slenderness: float
    directions: FloatArray
    cells: int

    @cached_property
    def _step(self) -> FloatArray:
        """Angle between two points, (p,) [rad]."""
        return np.array([(pad.end - pad.start) / self.cells for pad in self.pads])

    def _angles(self, offset: float, count: int) -> FloatArray:
        starts = np.array([pad.start for pad in self.pads])
        return np.asarray(starts[:, None] + self._step[:, None] * (offset + np.arange(count)))

    @cached_property
    def _nodes(self) -> FloatArray:
        """Over (sin, cos) at the points inside the pads, (2, p, n - 1)."""
        angle = self._angles(1.0, self.cells - 1)
        return np.stack([np.sin(angle), np.cos(angle)])

    @cached_property
    def _faces(self) -> FloatArray:
        """Over (sin, cos) half way between two points, (2, p, n)."""
        angle = self._angles(0.5, self.cells)
        return np.stack([np.sin(angle), np.cos(angle)])

    @cached_property
    def _pulls(self) -> tuple[FloatArray, FloatArray]:
        """Share of each direction in the normal, (d, p, n - 1) and (d, p, n)."""
        return (np.tensordot(self.directions, self._nodes, axes=1),
                np.tensordot(self.directions, self._faces, axes=1))

    @cached_property
    def _bores(self) -> tuple[FloatArray, FloatArray]:
        """Thickness about a centred journal at points and faces."""
        preload = np.array([pad.preload for pad in self.pads])[:, None]
        centre = np.array([pad.centre for pad in self.pads])[:, None]
        axes = np.stack([np.sin(centre), np.cos(centre)])
        inside, between = ((1.0 - preload * (axes * place).sum(axis=0)) / (1.0 - preload)
                           for place in (self._nodes, self._faces))
        return np.asarray(inside), np.asarray(between)

    @cached_property
    def _weights(self) -> FloatArray:
        """Share of the half length that belongs to each row of points, (z,)."""
        weights = np.full(AXIAL, 1.0 / AXIAL)
        weights[0] *= 0.5  # half of its volume lies beyond the middle
        return weights

    def thickness(self, place: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return H at points (p, n - 1) and faces (p, n) for a displacement (d,)."""
        inside, between = (bore - np.tensordot(place, pull, axes=1)
                           for bore, pull in zip(self._bores, self._pulls, strict=True))
        return inside, between

    def least(self, place: FloatArray) -> float:
        """Return the smallest film thickness over the clearance [-]."""
        inside, between = self.thickness(place)
        return float(min(inside.min(), between.min()))

    def forces(
        self, place: FloatArray, wet: BoolArray | None = None,
    ) -> tuple[FilmForces, BoolArray]:
        """
        Solve for pressure and its derivatives.

        Parameters
        ----------
        place : (d,) float array
            Displacement of the journal in clearances, such that the film is open everywhere.
        wet : (p, n - 1, z) bool array or None
            Where to begin to look for the film: that of a place nearby.

        Returns
        -------
        FilmForces
            What acts on the journal.
        wet : bool array
            Where there is film.

        Raises
        ------
        NotSolvedError
            If wet and dry points do not settle.

        """
        inside, between = self.thickness(place)
        around = between**3 / self._step[:, None]
        along = inside**3 * (self.slenderness**2 * self._step[:, None] * AXIAL)
        right = -np.diff(between, axis=1)[..., None] * self._weights
        pressure, wet, factor = self._pressure(around, along, right, wet)
        pulls, changes = self._pulls, []
        for inner, face in zip(*pulls, strict=True):
            moved = self._applied(pressure, -3.0 * between**2 * face / self._step[:, None],
                                  -3.0 * inside**2 * inner * (
                                      self.slenderness**2 * self._step[:, None] * AXIAL))
            changes.append(np.diff(face, axis=1)[..., None] * self._weights - moved)
        changes += [(2.0 * inner * self._step[:, None])[..., None] * self._weights
                    for inner in pulls[0]]
        columns = np.stack(changes)
        columns[:, ~wet] = 0.0
        found, _ = dpbtrs(factor, columns.reshape(len(columns), -1).T, lower=1)
        parts = np.concatenate([pressure.reshape(1, -1), found.T]).reshape(-1, *pressure.shape)
        area = self._step[:, None, None] * self._weights
        sums = 6.0 * np.einsum('dpn,kpn->dk', pulls[0], (parts * area).sum(axis=-1))
        size = len(self.directions)
        return FilmForces(-sums[:, 0], sums[:, 1:size + 1], sums[:, size + 1:],
                          float(min(inside.min(), between.min()))), wet

    def _pressure(
        self, around: FloatArray, along: FloatArray, right: FloatArray, wet: BoolArray | None,
    ) -> tuple[FloatArray, BoolArray, FloatArray]:
        """Return pressure, wet points and the factor of the operator among them."""
        if wet is None:
            wet = np.ones(right.shape, dtype=bool)
        for _ in range(_PASSES * self.cells):
            factor, info = dpbtrf(self._band(around, along, wet), lower=1)
            if info:
                break
            solved, _ = dpbtrs(factor, np.where(wet, right, 0.0).reshape(-1, 1), lower=1)
            pressure = solved.reshape(right.shape)
            # What is zero but for round-off would change sides with every pass.
            lifted = self._applied(pressure, around, along) < right - _TIE * np.abs(right).max()
            now = np.where(wet, pressure > -_TIE * pressure.max(), lifted)
            if np.array_equal(now, wet):
                return pressure, wet, factor
            wet = now
        raise NotSolvedError('the oil film has no edge that satisfies Reynolds')

    def _band(self, around: FloatArray, along: FloatArray, wet: BoolArray) -> FloatArray:
        """Return the lower band of the operator; dry points are rows of the identity."""
        pads, count = around.shape[0], around.shape[1] - 1
        band = np.zeros((AXIAL + 1, pads, count, AXIAL))
        band[0] = (around[:, 1:] + around[:, :-1])[..., None] * self._weights
        band[0] += along[..., None] * np.where(np.arange(AXIAL) == 0, 1.0, 2.0)
        band[0][~wet] = 1.0
        both = wet[..., 1:] & wet[..., :-1]
        band[1, ..., :-1] = -along[..., None] * both
        both = wet[:, 1:] & wet[:, :-1]
        band[AXIAL, :, :-1] = -(around[:, 1:-1, None] * self._weights) * both
        return band.reshape(AXIAL + 1, -1)

    def _applied(self, pressure: FloatArray, around: FloatArray, along: FloatArray) -> FloatArray:
        """Return the operator of some conductances times a pressure."""
        flow = np.diff(pressure, axis=1, prepend=0.0, append=0.0) * around[..., None]
        total = -np.diff(flow, axis=1) * self._weights
        leak = np.diff(pressure, axis=2, append=0.0) * along[..., None]
        total -= leak
        total[..., 1:] += leak[..., :-1]
        return np.asarray(total)
