"""Which points of foundations move: seats, contacts, probes, and what stands on them."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
import math
from typing import TypeVar

import numpy as np
import scipy.linalg

from rotorsoil_ros.arrays import ComplexArray, FloatArray, IntArray
from rotorsoil_ros.channel import Channel, DOFS
from rotorsoil_ros.errors import RotorSoilError
from rotorsoil_ros.ground.soil import SoilModel
from rotorsoil_ros.machine.flexible.part import FoundationPart, Mount
from rotorsoil_ros.machine.flexible.receptance import SeatReceptance
from rotorsoil_ros.machine.foundation import Foundation
from rotorsoil_ros.machine.placement import AT_ORIGIN, Placement
from rotorsoil_ros.rotor.bearing import Bearing

_Motion = TypeVar('_Motion', FloatArray, ComplexArray)


@dataclass(frozen=True)
class SupportPoints:
    """
    Bearings and the foundations below them, by the points at which they meet.

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

    @cached_property
    def table(self) -> SeatReceptance | None:
        """What stands for foundations and ground together, if anything does."""
        first = self.soil_models[0] if len(self.soil_models) == 1 else None
        return first if isinstance(first, SeatReceptance) else None

    @cached_property
    def members(self) -> tuple[FoundationPart, ...]:
        """Every foundation by its points, or what stands for all of them."""
        if self.table is not None:
            return (FoundationPart.tabulated(self.table, self.mounts),)
        return tuple(FoundationPart.of(foundation, self.mounts, self.foundations)
                     for foundation in self.foundations)

    @property
    def is_stacked(self) -> bool:
        """Whether some foundation stands on another."""
        return any(foundation.on is not None for foundation in self.foundations)

    @cached_property
    def above(self) -> tuple[tuple[int, ...], ...]:
        """Which foundations stand on each."""
        return tuple(tuple(index for index, other in enumerate(self.foundations)
                           if other.on is not None and other.on.foundation == foundation.name)
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
        found = np.array([[float(axis == along) for along in DOFS[:3]]
                          for axis in axes]).reshape(-1, 3)
        found[self.stacked[0]] = 0.0
        return found

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

    @property
    def told_points(self) -> slice:
        """Where among the points contacts and probes are."""
        contacts = self.contact_points
        return slice(contacts.start, contacts.stop + sum(
            len(part.probes) for part in self.members))

    @cached_property
    def point_indices(self) -> tuple[IntArray, ...]:
        """Which points of all are those of each part: seats, contacts, probes, carriers."""
        contact, probe = self.contact_points.start, self.contact_points.stop
        carrier, found = self.told_points.stop, []
        for part in self.members:
            ends = contact + len(part.contacts), probe + len(part.probes), carrier + part.carried
            found.append(np.array([*part.seats, *range(contact, ends[0]), *range(probe, ends[1]),
                                   *range(carrier, ends[2])], dtype=int))
            contact, probe, carrier = ends
        return tuple(found)

    @cached_property
    def stacked(self) -> tuple[IntArray, IntArray]:
        """Which of the contacts stand on foundations, and which points of these they are on."""
        ends = np.cumsum([0, *(len(part.contacts) for part in self.members)])
        contacts = [one for above in self.above for index in above
                    for one in range(ends[index], ends[index + 1])]
        return np.array(contacts, dtype=int), self.told_points.stop + np.arange(len(contacts))

    def parted(self, motion: _Motion) -> _Motion:
        """Return the motion of contacts against what they stand on, (..., c, k), of points."""
        found = motion[..., self.contact_points, :]
        contacts, carriers = self.stacked
        if len(contacts):
            found = found.copy()
            found[..., contacts, :] -= motion[..., carriers, :]
        return found

    @cached_property
    def point_rows(self) -> FloatArray:
        """Motion of seats, contacts and probes per rigid motion of all foundations, (p, 6 f)."""
        count = self.told_points.stop + len(self.stacked[0])
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
