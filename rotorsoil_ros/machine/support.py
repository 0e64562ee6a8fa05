"""How the bearing housings move under the forces that the bearings put into them."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
import math

import numpy as np
import scipy.linalg

from rotorsoil_ros.arrays import ComplexArray, FloatArray, IntArray, side_by_side
from rotorsoil_ros.channel import Channel, DOFS
from rotorsoil_ros.errors import OutOfTableError, RotorSoilError
from rotorsoil_ros.ground.bed import as_one, below_patches
from rotorsoil_ros.ground.soil import (
    below_each,
    SharedGround,
    SoilModel,
)
from rotorsoil_ros.ground.table import ComplianceTable
from rotorsoil_ros.machine.flexible.part import FoundationPart, Mount
from rotorsoil_ros.machine.flexible.receptance import SeatReceptance
from rotorsoil_ros.machine.foundation import BlockReceptance, Foundation
from rotorsoil_ros.machine.placement import AT_ORIGIN, Placement
from rotorsoil_ros.machine.standing import Below, OnBlocks, OnBodies, Standing
from rotorsoil_ros.rotor.bearing import Bearing
from rotorsoil_ros.units import rad_s_to_hz


@dataclass(frozen=True)
class Support:
    """
    Blocks on soil, and pedestals on them, below the bearings.

    Attributes
    ----------
    bearings : sequence of Bearing
        What stands on the blocks.
    shaft_height : float
        Of the bearings above the contact plane [m].
    foundations : sequence of Foundation
        The blocks.
    soil_models : sequence of SoilModel
        The soil under each, or one `SharedGround` under all of them; or one `SeatReceptance` of
        the foundations and the ground below them, of which there are none then.
    place : Placement
        Where the shaft of the bearings lies.

    """

    bearings: Sequence[Bearing]
    shaft_height: float
    foundations: Sequence[Foundation]
    soil_models: Sequence[SoilModel]
    place: Placement = AT_ORIGIN

    def __post_init__(self) -> None:
        _ = self.soils
        if self.foundations and self.table is not None:
            raise RotorSoilError('foundations must be none on receptances of seats, which hold '
                                 f'them, got {len(self.foundations)}')
        names = {foundation.name for foundation in self.foundations}
        for bearing in self.bearings:
            if bearing.foundation is not None and bearing.foundation not in names:
                raise RotorSoilError(f'foundation of {bearing.name} must be one of '
                                     f'{sorted(names)}, got {bearing.foundation}')

    @cached_property
    def soils(self) -> tuple[SoilModel, ...]:
        """What each block stands on, as if the others were not loaded."""
        return tuple(map(as_one, below_each(self.soil_models, len(self.foundations))))

    @cached_property
    def table(self) -> SeatReceptance | None:
        """What stands for foundations and ground together, if anything does."""
        first = self.soil_models[0] if len(self.soil_models) == 1 else None
        return first if isinstance(first, SeatReceptance) else None

    @property
    def _shared(self) -> SharedGround | None:
        """The ground below all blocks, if it is one."""
        first = self.soil_models[0] if len(self.soil_models) == 1 else None
        return first if isinstance(first, SharedGround) else None

    def ground(self, omega: FloatArray) -> ComplexArray:
        """Return the compliance of the ground under all contacts, (n, c, c), six of a block."""
        if self._shared is not None:
            return self._shared.compliance(omega)
        found = [model.compliance(omega) for model in self.soil_models]
        return side_by_side(found, len(omega))

    def points(self, omega: FloatArray) -> ComplexArray:
        """Return the motion of points on the ground per load of the blocks, (n, 3 p, 6 f)."""
        if self._shared is not None:
            return self._shared.point_motion(omega)
        return np.zeros((len(omega), 0, self.transmitting), dtype=complex)

    @cached_property
    def members(self) -> tuple[FoundationPart, ...]:
        """Every foundation by its points, or what stands for all of them."""
        if self.table is not None:
            return (FoundationPart.tabulated(self.table, self.mounts),)
        return tuple(FoundationPart.of(foundation, self.mounts)
                     for foundation in self.foundations)

    @property
    def mounts(self) -> list[Mount]:
        """Where every bearing is."""
        return [Mount(bearing, self.shaft_height, self.place) for bearing in self.bearings]

    @cached_property
    def firm_rows(self) -> FloatArray:
        """Motion per unit motion (x, y, z) of the ground, (2 b, 3), of what stands on no block."""
        firm = self.table is None
        return np.concatenate([np.zeros((0, 3)), *(
            mount.axes * (firm and mount.bearing.foundation is None) for mount in self.mounts)])

    @cached_property
    def follow_rows(self) -> FloatArray:
        """Motion of the contacts per unit motion (x, y, z) of the ground, (c, 3)."""
        if self.table is not None:
            raise RotorSoilError('receptances of seats do not tell how these follow ground that '
                                 'moves: give foundation and ground')
        axes = [channel.axis for part in self.members for channel in part.contacts]
        return np.array([[float(axis == along) for along in DOFS[:3]]
                         for axis in axes]).reshape(-1, 3)

    @property
    def bends(self) -> bool:
        """Whether some foundation does."""
        return any(foundation.body is not None for foundation in self.foundations)

    @cached_property
    def places(self) -> tuple[Channel, ...]:
        """Motions of the foundations: six of each, then its patches and probes if it bends."""
        bodies = [(block.name, block.body) for block in self.foundations
                  if block.body is not None]
        patches = [channel for name, body in bodies if not body.has_one_contact
                   for channel in body.channels(name)[0]]
        return (*(Channel(block.name, '', dof) for block in self.foundations for dof in DOFS),
                *patches, *self._probes)

    @property
    def _probes(self) -> list[Channel]:
        return [channel for block in self.foundations if block.body is not None
                for channel in block.body.channels(block.name)[1]]

    @property
    def transmitting(self) -> int:
        """How many of the places, the first, stand on the ground."""
        return len(self.places) - len(self._probes)

    @cached_property
    def contacts(self) -> int:
        """Number of motions that the ground resists, c."""
        return sum(len(part.contacts) for part in self.members)

    @property
    def contact_points(self) -> slice:
        """Where among the points the contacts are: behind all seats."""
        return slice(2 * len(self.bearings), 2 * len(self.bearings) + self.contacts)

    @cached_property
    def point_indices(self) -> tuple[IntArray, ...]:
        """Which points of all are those of each part: seats, contacts, probes."""
        contact = 2 * len(self.bearings)
        probe = contact + self.contacts
        found = []
        for part in self.members:
            ends = contact + len(part.contacts), probe + len(part.probes)
            found.append(np.array([*part.seats, *range(contact, ends[0]), *range(probe, ends[1])],
                                  dtype=int))
            contact, probe = ends
        return tuple(found)

    @cached_property
    def point_rows(self) -> FloatArray:
        """Motion of seats, contacts and probes per rigid motion of all foundations, (p, 6 f)."""
        count = 2 * len(self.bearings) + sum(
            len(part.contacts) + len(part.probes) for part in self.members)
        rows, first = np.zeros((count, len(self.block_mass))), 0
        for part, own in zip(self.members, self.point_indices, strict=True):
            rows[own, first:first + len(part.mass)] = part.rows
            first += len(part.mass)
        return rows

    def flexibility(self, omega: FloatArray) -> ComplexArray:
        """Return the elastic motion of the points per force on them, (n, p, p)."""
        count = len(self.point_rows)
        total = np.zeros((len(omega), count, count), dtype=complex)
        for part, own in zip(self.members, self.point_indices, strict=True):
            total[:, own[:, None], own] = part.flexibility(omega)
        return total

    @cached_property
    def force_rows(self) -> FloatArray:
        """Force of the places that stand on the ground per force of the contacts."""
        _, contacts = self._own_rows(
            lambda part: part.rows[part.places[1]].T[:len(part.mean)])
        return contacts

    @cached_property
    def place_rows(self) -> FloatArray:
        """Motion of the places per motion of contacts and probes."""
        probes, contacts = self._own_rows(lambda part: part.mean)
        return np.asarray(scipy.linalg.block_diag(contacts, np.eye(probes)))

    def _own_rows(
        self, whole: Callable[[FoundationPart], FloatArray],
    ) -> tuple[int, FloatArray]:
        """Return how many probes there are, and what of each whole contact and patch is told."""
        wholes = scipy.linalg.block_diag(
            np.zeros((0, 0)), *(whole(part) for part in self.members))
        patched = np.concatenate([np.zeros(0, dtype=bool), *(
            np.full(len(part.contacts), part.is_patched) for part in self.members)])
        probes = sum(len(part.probes) for part in self.members)
        return probes, np.concatenate([wholes, np.eye(self.contacts)[patched]])

    @cached_property
    def block_mass(self) -> FloatArray:
        """Mass matrix of the rigid motion of all foundations, (6 f, 6 f)."""
        return np.asarray(scipy.linalg.block_diag(
            np.zeros((0, 0)), *(part.mass for part in self.members)))

    @property
    def block_rows(self) -> FloatArray:
        """
        Seat motion per unit rigid motion of all foundations, (2 b, 6 f).

        References
        ----------
        The matrix T of the congruence X_B = T q, which needs no inverse of the flexibility
        of the seed paper's eq. (7): with three collinear bearings that one is singular.

        """
        return self.point_rows[:2 * len(self.bearings)]

    @cached_property
    def seat_pairs(self) -> FloatArray:
        """Products of the motion of two seats per unit motion of the blocks, (6 f, 6 f, 4 b^2)."""
        pairs = np.einsum('pi,qj->ijpq', self.block_rows, self.block_rows)
        return np.asarray(pairs.reshape(*pairs.shape[:2], math.prod(pairs.shape[2:])))

    @cached_property
    def pedestal_axes(self) -> list[int]:
        """Those of the housings' (x, z) that have a pedestal of their own below them."""
        return [2 * index + axis for index, bearing in enumerate(self.bearings)
                if bearing.pedestal is not None for axis in range(2)]

    @cached_property
    def housing_mass(self) -> FloatArray:
        """Mass of the housings over (x, z) of each, (2 b, 2 b) [kg]."""
        own = [bearing.pedestal.mass for bearing in self.bearings if bearing.pedestal is not None]
        total = np.zeros((2 * len(self.bearings), 2 * len(self.bearings)))
        total[np.ix_(self.pedestal_axes, self.pedestal_axes)] = scipy.linalg.block_diag(*own)
        return total

    def pedestals(self, omega: FloatArray) -> ComplexArray:
        """Return the compliance of all pedestals, (n, 2 b, 2 b); zero where one is rigid."""
        total = np.zeros((len(omega), *self.housing_mass.shape), dtype=complex)
        for index, bearing in enumerate(self.bearings):
            if bearing.pedestal is not None:
                pair = slice(2 * index, 2 * index + 2)
                total[:, pair, pair] = bearing.pedestal.compliance(omega)
        return total

    def standing(self, omega: FloatArray) -> Standing:
        """Return how the support answers forces at frequencies (n,) [rad/s]."""
        below: Below = OnBodies(self, omega) if self.bends else OnBlocks(
            self, omega, BlockReceptance.of(self.ground(omega), self.block_mass, omega))
        return Standing(self, omega, below, self.pedestals(omega) + below.seats)

    @cached_property
    def motions(self) -> tuple[IntArray, ...]:
        """Which motions of the support are those of each part: contacts, elastic coordinates."""
        contact, elastic = 0, self.contacts + len(self.pedestal_axes)
        found = []
        for part in self.members:
            more = len(part.on_contacts.mass) - len(part.contacts)
            found.append(np.array([*range(contact, contact + len(part.contacts)),
                                   *range(elastic, elastic + more)], dtype=int))
            contact, elastic = contact + len(part.contacts), elastic + more
        return tuple(found)

    @property
    def _size(self) -> int:
        return len(self.pedestal_axes) + sum(map(len, self.motions))

    @property
    def elastic(self) -> int:
        """How many of the motions of the support, the last, are on unit springs of their own."""
        return self._size - self.contacts - len(self.pedestal_axes)

    @cached_property
    def point_motion(self) -> FloatArray:
        """Motion of seats, contacts and probes per motion of the support, (p, s)."""
        rows = np.zeros((len(self.point_rows), self._size))
        for part, points, own in zip(
                self.members, self.point_indices, self.motions, strict=True):
            rows[points[:, None], own] = part.on_contacts.rows
        return rows

    @cached_property
    def motion_rows(self) -> FloatArray:
        """
        Housing motion per motion of the support, (2 b, s).

        The motion of the support is that of its contacts, then the deflection of its pedestals,
        then the elastic coordinates of its foundations.
        """
        rows = self.point_motion[:2 * len(self.bearings)].copy()
        pedestals = slice(self.contacts, self.contacts + len(self.pedestal_axes))
        rows[self.pedestal_axes, pedestals] = np.eye(len(self.pedestal_axes))
        return rows

    @cached_property
    def motion_mass(self) -> FloatArray:
        """Mass matrix of the motion of the support, (s, s)."""
        rows = self.motion_rows
        total = np.asarray(rows.T @ self.housing_mass @ rows)
        for part, own in zip(self.members, self.motions, strict=True):
            total[own[:, None], own] += part.on_contacts.mass
        return total

    @cached_property
    def motion_spring(self) -> ComplexArray:
        """Stiffness of the motion of the support beside its compliance, (s, s): of what bends."""
        total = np.zeros((self._size, self._size), dtype=complex)
        for part, own in zip(self.members, self.motions, strict=True):
            total[own[:, None], own] += part.on_contacts.spring
        return total

    def motion_compliance(self, omega: FloatArray) -> ComplexArray:
        """Return the compliance of soils and pedestals without mass, (n, c, c)."""
        axes = np.array(self.pedestal_axes, dtype=int)
        return side_by_side([self.ground(omega), self.pedestals(omega)[:, axes[:, None], axes]],
                            len(omega))

    def answers(self, omega: float) -> bool:
        """Return whether every soil knows its compliance at a frequency [rad/s]."""
        try:
            return bool(np.all(np.isfinite(self.motion_compliance(np.array([omega])))))
        except OutOfTableError:
            return False

    @property
    def reach(self) -> tuple[float, float]:
        """Between which frequencies files say what stands below [rad/s]; endless without one."""
        rows = [one.omega for own in self.soil_models for one in below_patches(own)
                if isinstance(one, (ComplianceTable, SeatReceptance))]
        return (max((float(omega[0]) for omega in rows), default=0.0),
                min((float(omega[-1]) for omega in rows), default=math.inf))

    def within(self, span: tuple[float, float]) -> tuple[float, float]:
        """
        Return the part of a span of frequencies [rad/s] that files below hold.

        Raises
        ------
        OutOfTableError
            If they hold none of it.

        """
        low, high = max(span[0], self.reach[0]), min(span[1], self.reach[1])
        if not low <= high:
            raise OutOfTableError(
                f'the file of the support must hold some of {rad_s_to_hz(span[0]):g} to '
                f'{rad_s_to_hz(span[1]):g} Hz, got {rad_s_to_hz(self.reach[0]):g} to '
                f'{rad_s_to_hz(self.reach[1]):g} Hz')
        return low, high

    def known(self, highest: float) -> tuple[float, float]:
        """Return the part of 0 to `highest` [rad/s] for which every soil gives an answer."""
        def edge(inside: float, outside: float) -> float:
            if self.answers(outside):
                return outside
            while abs(outside - inside) > 1e-4 * highest:
                middle = 0.5 * (inside + outside)
                known = self.answers(middle)
                inside, outside = (middle, outside) if known else (inside, middle)
            return inside

        within = min(highest, self.reach[1])
        while not self.answers(within) and within > 1e-6 * highest:
            within *= 0.5
        return edge(within, 0.0), edge(within, highest)
