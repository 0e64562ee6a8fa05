"""How a support answers forces at some frequencies: what moves, and what enters the ground."""

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol, TYPE_CHECKING

import numpy as np

from rotorsoil_ros.arrays import ComplexArray, FloatArray
from rotorsoil_ros.machine.foundation import BlockReceptance, carrying

if TYPE_CHECKING:
    from rotorsoil_ros.machine.support import Support


class Below(Protocol):
    """What the bearings stand on, housings and pedestals apart."""

    @property
    def seats(self) -> ComplexArray:
        """Motion of the seats per force on them, (n, 2 b, 2 b) [m/N]."""
        ...

    def pushed(
        self, loads: ComplexArray, ground: FloatArray,
    ) -> tuple[ComplexArray, ComplexArray]:
        """Return what loads (l, k) and ground (3, k) do to seats (n, 2 b, k) and to itself."""
        ...

    def answered(
        self, at_seats: ComplexArray, loads: ComplexArray, pushed: ComplexArray,
    ) -> tuple[ComplexArray, ComplexArray]:
        """Return motion of its places and force into the ground under these and at seats."""
        ...


@dataclass(frozen=True)
class OnBlocks:
    """
    Rigid blocks on the ground, or a table of what the bearings stand on, which has no places.

    Attributes
    ----------
    support : Support
        What they are part of.
    omega : (n,) float array
        Excitation frequency [rad/s].
    receptance : BlockReceptance
        Of all blocks on the ground.

    """

    support: 'Support'
    omega: FloatArray
    receptance: BlockReceptance

    @property
    def seats(self) -> ComplexArray:
        """Motion of the seats per force on them, (n, 2 b, 2 b) [m/N]."""
        count = len(self.support.block_rows)
        return self.receptance.between(self.support.seat_pairs).reshape(-1, count, count)

    def pushed(
        self, loads: ComplexArray, ground: FloatArray,
    ) -> tuple[ComplexArray, ComplexArray]:
        """
        Return the motion of seats and of blocks under loads (6 f, k) and moving ground.

        References
        ----------
        Seed paper, eqs. (4) and (5), for the motion of the ground: the block follows it as far
        as its own inertia lets it, (I - omega^2 N M)^-1 u_g, which needs no inverse of N.

        """
        support = self.support
        blocks = self.receptance.motion((support.place_rows.T @ loads)[None])
        if ground.any():
            follows = carrying(support.ground(self.omega), support.block_mass, self.omega)
            blocks = blocks + np.linalg.solve(follows, np.broadcast_to(
                support.follow_rows @ ground, (*follows.shape[:2], ground.shape[1])))
        return support.block_rows @ blocks, blocks

    def answered(
        self, at_seats: ComplexArray, loads: ComplexArray, pushed: ComplexArray,
    ) -> tuple[ComplexArray, ComplexArray]:
        """
        Return motion and soil force of the blocks, each (n, 6 f, k) [m, rad], [N, N m].

        What enters the soil is the force at the seats, the load and the block's inertia; the
        compliance, which may be zero, is not inverted for it.
        """
        support = self.support
        arriving = support.block_rows.T @ at_seats
        motion = pushed + self.receptance.motion(arriving)
        inertia = self.omega[:, None, None] ** 2 * (support.block_mass @ motion)
        force = arriving + support.place_rows.T @ loads + inertia
        return support.place_rows @ motion, support.force_rows @ force


@dataclass(frozen=True)
class OnBodies:
    """
    Foundations of which some bend, on the ground.

    Attributes
    ----------
    support : Support
        What they are part of.
    omega : (n,) float array
        Excitation frequency [rad/s].

    Notes
    -----
    Of bodies on contacts the forces r into the ground and the rigid motions a obey

        (N + H_cc) r - R_c a = H_c f,    R_c^T r - w^2 M a = R^T f,

    H being the elastic motion per force; what moves is x = H f - H_c^T r + R a. A contact on
    another body moves against the place below it, with no N between: rows c are its own less
    those of that place. Nothing is
    inverted that may be zero: rigid ground has N = 0, a rigid body H = 0.

    References
    ----------
    Theory manual, foundations that bend.

    """

    support: 'Support'
    omega: FloatArray

    @cached_property
    def _flexibility(self) -> ComplexArray:
        return self.support.flexibility(self.omega)

    @cached_property
    def _parted(self) -> ComplexArray:
        """Elastic motion of contacts against what is below, per force on the points."""
        return self.support.parted(self._flexibility)

    @cached_property
    def _system(self) -> tuple[ComplexArray, FloatArray]:
        """The matrix over r in units of its second value and a, (n, c + 6 f, c + 6 f)."""
        support = self.support
        gives = support.ground(self.omega) + support.parted(self._parted.swapaxes(1, 2))
        rows, own = support.parted(support.point_rows), gives.shape[1]
        size = np.abs(gives).mean(axis=(1, 2))
        # Where nothing gives any size will do.
        unit = 1.0 / np.where(size > 0.0, size, 1.0)
        total = np.zeros((len(gives), own + rows.shape[1], own + rows.shape[1]), dtype=complex)
        total[:, :own, :own] = gives * unit[:, None, None]
        total[:, :own, own:], total[:, own:, :own] = -rows, rows.T
        total[:, own:, own:] = -(self.omega**2 / unit)[:, None, None] * support.block_mass
        return total, unit

    def _on_one_contact_each(
        self, elastic: ComplexArray, arriving: ComplexArray,
    ) -> tuple[ComplexArray, ComplexArray]:
        """
        Return r and a of bodies on one contact each, where R_c = 1: half as many unknowns.

        (1 - w^2 (N + H_cc) M) a = (N + H_cc) R^T f - H_c f,  r = R^T f + w^2 M a.
        """
        contacts, mass = self.support.contact_points, self.support.block_mass
        gives = self.support.ground(self.omega) + self._flexibility[:, contacts, contacts]
        try:
            moved = np.linalg.solve(carrying(gives, mass, self.omega), gives @ arriving - elastic)
        except np.linalg.LinAlgError:
            moved = np.full(elastic.shape, complex(np.nan, np.nan))
        return arriving + self.omega[:, None, None] ** 2 * (mass @ moved), moved

    def _on_patches(
        self, elastic: ComplexArray, arriving: ComplexArray,
    ) -> tuple[ComplexArray, ComplexArray]:
        """Return r and a of bodies on any contacts."""
        system, unit = self._system
        own = elastic.shape[1]
        pushing = np.broadcast_to(arriving, (len(unit), *arriving.shape[-2:]))
        right = np.concatenate([elastic, pushing / unit[:, None, None]], axis=1)
        try:
            found = np.linalg.solve(system, right)
        except np.linalg.LinAlgError:
            found = np.full(right.shape, complex(np.nan, np.nan))
        return unit[:, None, None] * found[:, :own], found[:, own:]

    def _answer(self, loads: ComplexArray, ground: FloatArray) -> ComplexArray:
        """Return what loads (p, k) and moving ground do to the points, and r, (n, p + c, k)."""
        support, rows = self.support, self.support.point_rows
        elastic = self._flexibility @ loads
        solve = (self._on_patches if support.is_stacked or any(
            part.is_patched for part in support.members) else self._on_one_contact_each)
        follows = support.follow_rows @ ground if ground.any() else 0.0
        force, rigid = solve(support.parted(elastic) - follows, rows.T @ loads)
        moved = elastic - self._parted.swapaxes(1, 2) @ force + rows @ rigid
        return np.concatenate([moved, force], axis=1)

    @cached_property
    def _by_seats(self) -> ComplexArray:
        """What unit forces at the seats do, (n, p + c, 2 b)."""
        points, seats = len(self.support.point_rows), 2 * len(self.support.bearings)
        return self._answer(np.eye(points, seats, dtype=complex), np.zeros((3, seats)))

    @property
    def seats(self) -> ComplexArray:
        """Motion of the seats per force on them, (n, 2 b, 2 b) [m/N]."""
        return self._by_seats[:, :2 * len(self.support.bearings)]

    def pushed(
        self, loads: ComplexArray, ground: FloatArray,
    ) -> tuple[ComplexArray, ComplexArray]:
        """Return the motion of the seats, and of points and r, under loads and moving ground."""
        support, seats = self.support, 2 * len(self.support.bearings)
        points = np.zeros((len(support.point_rows), loads.shape[1]), dtype=complex)
        points[support.told_points] = support.place_rows.T @ loads
        found = self._answer(points, ground)
        return found[:, :seats], found

    def answered(
        self, at_seats: ComplexArray, loads: ComplexArray, pushed: ComplexArray,
    ) -> tuple[ComplexArray, ComplexArray]:
        """Return motion of the places and force into the ground, (n, l, k), (n, g, k)."""
        support = self.support
        total = self._by_seats @ at_seats + pushed
        return (support.place_rows @ total[:, support.told_points],
                support.force_rows @ total[:, len(support.point_rows):])


@dataclass(frozen=True)
class Standing:
    """
    Support at some frequencies.

    Attributes
    ----------
    support : Support
        What it is.
    omega : (n,) float array
        Excitation frequency [rad/s].
    below : Below
        What the pedestals, or the bearings themselves, stand on.
    deflection : (n, 2 b, 2 b) complex array
        Motion of the housings per force into their pedestals [m/N].

    """

    support: 'Support'
    omega: FloatArray
    below: Below
    deflection: ComplexArray

    @cached_property
    def receptance(self) -> ComplexArray:
        """
        Motion of the housings over (x, z) of each per force on them, (n, 2 b, 2 b) [m/N].

        A pedestal is a compliance in series with that of its seat, and carries the housing.
        """
        return self._carried(self.deflection)

    def _carried(self, motion: ComplexArray) -> ComplexArray:
        """Return what the mass of the housings makes of their motion, (n, 2 b, k)."""
        mass = self.support.housing_mass
        if not mass.any():  # the usual case, at no cost
            return motion
        return np.linalg.solve(carrying(self.deflection, mass, self.omega), motion)

    def pushed(
        self, loads: ComplexArray, ground: FloatArray,
    ) -> tuple[ComplexArray, ComplexArray]:
        """
        Return what moves while the bearings exert nothing.

        Parameters
        ----------
        loads : (2 b + l, k) complex array
            Forces on the housings, then on each place of the foundations [N, N m].
        ground : (3, k) float array
            Motion of the ground along x, y, z where nothing stands on it, everywhere alike [m].

        Returns
        -------
        housings (n, 2 b, k), below (n, ..., k) : complex arrays
            Motion of the housings; what `blocks` needs of what lies below [m, rad].

        """
        count = self.receptance.shape[1]
        if not loads.any() and not ground.any():  # the usual case, at no cost
            return (np.zeros((1, count, loads.shape[1]), dtype=complex),
                    np.zeros((1, 1, loads.shape[1]), dtype=complex))
        seats, below = self.below.pushed(loads[count:], ground)
        return self._carried(seats + self.support.firm_rows @ ground
                             + self.deflection @ loads[:count]), below

    def blocks(
        self, through: ComplexArray, housings: ComplexArray, loads: ComplexArray,
        pushed: ComplexArray,
    ) -> tuple[ComplexArray, ComplexArray]:
        """
        Return motion of the foundations' places and force into the ground.

        Parameters
        ----------
        through, housings : (n, 2 b, k) complex arrays
            Force through the bearings [N] and motion of the housings [m].
        loads, pushed : (2 b + l, k), (n, ..., k) complex arrays
            As in `pushed`, and its second result.

        Returns
        -------
        motion (n, l, k), force (n, g, k) : complex arrays
            Over `Support.places` [m, rad], and over those that stand on the ground [N, N m].

        """
        count = through.shape[1]
        at_seats = through + loads[:count]
        if self.support.housing_mass.any():
            inertia = self.omega[:, None, None] ** 2 * (self.support.housing_mass @ housings)
            at_seats = at_seats + inertia
        return self.below.answered(at_seats, loads[count:], pushed)
