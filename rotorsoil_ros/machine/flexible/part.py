"""What one foundation adds to a support: its motion over seats, contacts and probes."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.linalg

from rotorsoil_ros.arrays import ComplexArray, FloatArray
from rotorsoil_ros.channel import Channel, DOFS
from rotorsoil_ros.errors import RotorSoilError
from rotorsoil_ros.machine.flexible.body import FlexibleBody, massless, PROBE
from rotorsoil_ros.machine.flexible.receptance import SeatReceptance
from rotorsoil_ros.machine.foundation import Foundation
from rotorsoil_ros.machine.placement import Placement
from rotorsoil_ros.rotor.bearing import Bearing

# Elastic flexibility of contacts below this share of the largest would let no force tell them
# apart.
_TOLD_APART = 1e-12

# Cosine below which a direction is across.
_TURNED = 1e-12


@dataclass(frozen=True, slots=True)
class Mount:
    """
    Where a bearing is.

    Attributes
    ----------
    bearing : Bearing
        Of some rotor.
    height : float
        Of its shaft above the contact [m].
    place : Placement
        Where that shaft lies.

    """

    bearing: Bearing
    height: float
    place: Placement

    @property
    def axes(self) -> FloatArray:
        """Directions x and z of the machine in the axes of the ground, (2, 3)."""
        return self.place.axes[[0, 2]]

    @property
    def point(self) -> tuple[float, float, float]:
        """Where it is in the axes of the ground, above the contact [m]."""
        rises = self.bearing.position if self.place.is_upright else 0.0
        return *self.place.point(self.bearing.position), self.height + rises

    def on(self, body: FlexibleBody) -> FloatArray:
        """
        Return its x and z per motion of the interface of what it stands on, (2, p).

        Raises
        ------
        RotorSoilError
            If there is no such seat.

        """
        directions = self.axes
        found = np.zeros((2, len(body.dofs)))
        for along, axis in enumerate(DOFS[:3]):
            share = np.where(np.abs(directions[:, along]) < _TURNED, 0.0, directions[:, along])
            if share.any():
                found[:, body.seat(self.bearing.seat or self.bearing.name, axis)] = share
        return found


@dataclass(frozen=True)
class FoundationPart:
    """
    One foundation by its points: seats, contacts, probes, then what stands on it.

    Attributes
    ----------
    seats : tuple of int
        Rows of the support's housings that its seats are.
    contacts : tuple of Channel
        Its contacts, six of a block.
    probes : tuple of Channel
        Other motions that are asked for.
    carried : int
        How many motions of contacts of other foundations stand on it.
    mass : (6, 6) float array
        Of the rigid body about the middle of its contact; of a table none, over its motions.
    rows : (p, 6) float array
        Motion of the points per rigid motion about there, or per motion of a table.
    shapes : (p, m) float array
        Of its elastic modes.
    stiffness : (m,) complex array
        Of these, w^2 (1 + i eta), at unit mass.
    residual, massless : (p, p) complex and (p, g) float arrays
        Flexibility of the rest with its loss, and shapes that make it up without.
    residual_loss : float
        Loss factor of the rest.
    mean : (6, c) float array
        Mean motion of the contact per motion of the contacts; nothing of a table.

    """

    seats: tuple[int, ...]
    contacts: tuple[Channel, ...]
    probes: tuple[Channel, ...]
    carried: int
    mass: FloatArray
    rows: FloatArray
    shapes: FloatArray
    stiffness: ComplexArray
    residual: ComplexArray
    massless: FloatArray
    residual_loss: float
    mean: FloatArray

    @classmethod
    def of(
        cls, foundation: Foundation, mounts: Sequence['Mount'], others: Sequence[Foundation],
    ) -> 'FoundationPart':
        """Return what one is to bearings and foundations, those that stand on it among them."""
        own = [index for index, mount in enumerate(mounts)
               if mount.bearing.foundation == foundation.name]
        seats = tuple(2 * index + axis for index in own for axis in range(2))
        on_it = [mounts[index] for index in own]
        above = [foundation.under(other) for other in others
                 if other.on is not None and other.on.foundation == foundation.name]
        if foundation.body is not None:
            return cls._flexible(foundation.name, foundation.body, seats, on_it, above)
        rows = [foundation.seat_rows(
            position=mount.bearing.position, height=mount.height - foundation.elevation,
            place=mount.place) for mount in on_it]
        six = tuple(Channel(foundation.name, '', dof) for dof in DOFS)
        points = np.concatenate([*rows, np.eye(6), *above])
        count, carried = len(points), sum(map(len, above))
        return cls(seats, six, (), carried, foundation.mass_matrix, points, np.zeros((count, 0)),
                   np.zeros(0, dtype=complex), np.zeros((count, count), dtype=complex),
                   np.zeros((count, 0)), 0.0, np.eye(6))

    @classmethod
    def _flexible(
        cls, name: str, body: FlexibleBody, seats: tuple[int, ...], mounts: Sequence['Mount'],
        above: Sequence[FloatArray],
    ) -> 'FoundationPart':
        contacts, probes = body.channels(name)
        rows = [*body.contacts.tolist(), *body.of_kind(PROBE)]
        picked = np.concatenate([*(mount.on(body) for mount in mounts),
                                 np.eye(len(body.dofs))[rows], *above])
        carried = sum(map(len, above))
        residual = picked @ body.residual @ picked.T
        # What no force acts on needs no shape of its own: it follows those of the others.
        silent = len(picked) - carried - len(probes) + np.arange(len(probes))
        loaded = np.setdiff1d(np.arange(len(picked)), silent)
        springs = massless(residual[loaded[:, None], loaded], picked[loaded] @ body.static_size)
        return cls(seats, contacts, probes, carried, body.mass_about_centre,
                   picked @ body.about_centre, picked @ body.shapes,
                   np.asarray(body.stiffness * (1.0 + 1j * body.loss)),
                   np.asarray(residual / (1.0 + 1j * body.residual_loss)),
                   residual[:, loaded] @ np.linalg.pinv(springs).T,
                   body.residual_loss, body.mean_rows)

    @classmethod
    def tabulated(cls, table: SeatReceptance, mounts: Sequence['Mount']) -> 'FoundationPart':
        """
        Return what a table of receptances is to bearings: contacts without mass, one per motion.

        Raises
        ------
        RotorSoilError
            If the table does not know a bearing.

        """
        own = [row for mount in mounts
               for row in table.rows_of(mount.bearing.seat or mount.bearing.name)]
        count = len(table.seats)
        points = np.concatenate([np.eye(count)[own], np.eye(count)])
        return cls(tuple(range(len(own))), table.seats, (), 0, np.zeros((count, count)), points,
                   np.zeros((len(points), 0)), np.zeros(0, dtype=complex),
                   np.zeros((len(points),) * 2, dtype=complex), np.zeros((len(points), 0)), 0.0,
                   np.zeros((0, count)))

    @property
    def places(self) -> tuple[slice, slice, slice, slice]:
        """Where among the points seats, contacts, probes and what stands on it are."""
        first, second = len(self.seats), len(self.seats) + len(self.contacts)
        third = second + len(self.probes)
        return (slice(0, first), slice(first, second), slice(second, third), slice(third, None))

    @property
    def is_patched(self) -> bool:
        """Whether it stands on several contacts."""
        return len(self.mean) > 0 and (len(self.contacts) != len(DOFS) or (
            self.contacts[0].station != self.contacts[-1].station))

    def flexibility(self, omega: FloatArray) -> ComplexArray:
        """Return the elastic motion of the points per force on them, (n, p, p) [m/N]."""
        if not self.shapes.size:
            return np.broadcast_to(self.residual, (len(omega), *self.residual.shape))
        count = len(self.rows)
        upper = np.triu_indices(count)
        pairs = self.shapes[upper[0]] * self.shapes[upper[1]]
        gain = 1.0 / (self.stiffness - omega[:, None] ** 2)
        found = gain.real @ pairs.T + 1j * (gain.imag @ pairs.T)
        total = np.empty((len(omega), count, count), dtype=complex)
        total[:, upper[0], upper[1]] = found
        total[:, upper[1], upper[0]] = found
        return np.asarray(total + self.residual)

    @cached_property
    def on_contacts(self) -> 'ContactForm':
        """
        The same by the motion of its contacts and elastic coordinates of unit stiffness.

        Raises
        ------
        RotorSoilError
            If forces at its contacts could not be told apart.

        """
        _, contact, _, _ = self.places
        elastic = np.concatenate([self.shapes / np.sqrt(self.stiffness.real), self.massless],
                                 axis=1)
        loss = np.concatenate([self.stiffness.imag / self.stiffness.real,
                               np.full(self.massless.shape[1], self.residual_loss)])
        inertia = np.concatenate([1.0 / self.stiffness.real, np.zeros(self.massless.shape[1])])
        motion = np.concatenate([self.rows, elastic], axis=1)
        turn = (_free_on_patches(self.rows[contact], elastic[contact], self.mass, inertia)
                if self.is_patched else _free_on_one(self.rows[contact], elastic[contact]))
        mass = turn.T @ scipy.linalg.block_diag(self.mass, np.diag(inertia)) @ turn
        part = turn[len(self.mass):]
        spring = part.T @ ((1.0 + 1j * loss)[:, None] * part)
        return ContactForm(mass, spring, motion @ turn)


@dataclass(frozen=True, slots=True)
class ContactForm:
    """
    A foundation over its c contacts and e elastic coordinates, each on a spring of one.

    Attributes
    ----------
    mass : (c + e, c + e) float array
        Mass matrix.
    spring : (c + e, c + e) complex array
        Stiffness, the unit springs among it, with what it loses.
    rows : (p, c + e) float array
        Motion of the points.

    """

    mass: FloatArray
    spring: ComplexArray
    rows: FloatArray


def _free_on_one(rows: FloatArray, elastic: FloatArray) -> FloatArray:
    """Return rigid and elastic motion per motion of one contact and elastic motion."""
    own, count = rows.shape[1], elastic.shape[1]
    rigid = np.linalg.solve(rows, np.concatenate([np.eye(own), -elastic], axis=1))
    return np.concatenate([rigid, np.eye(count, own + count, own)])


def _free_on_patches(
    rows: FloatArray, elastic: FloatArray, mass: FloatArray, inertia: FloatArray,
) -> FloatArray:
    """
    Return rigid and elastic motion per motion of the contacts and of modes with these held.

    References
    ----------
    Craig & Bampton (1968), Coupling of substructures for dynamic analyses, AIAA J. 6.

    """
    flexibility = elastic @ elastic.T
    if np.linalg.cond(flexibility) > 1.0 / _TOLD_APART:
        raise RotorSoilError(
            f'residual must tell the forces of the {len(rows)} contacts apart, together with the '
            f'modes, got a rank of {np.linalg.matrix_rank(flexibility, hermitian=True)}')
    per_force = np.linalg.solve(flexibility, rows)
    rigid = np.linalg.solve(rows.T @ per_force, per_force.T)
    force = np.linalg.solve(flexibility, np.eye(len(rows)) - rows @ rigid)
    imposed = np.concatenate([rigid, elastic.T @ force])
    # Rigid motion in units in which it counts as much as the elastic one.
    unit = np.linalg.norm(elastic) / np.linalg.norm(rows)
    held = scipy.linalg.null_space(np.concatenate([unit * rows, elastic], axis=1))
    held[:6] *= unit
    weight = scipy.linalg.block_diag(mass, np.diag(inertia))
    _, modes = scipy.linalg.eigh(held.T @ weight @ held, held[6:].T @ held[6:])
    return np.concatenate([imposed, held @ modes], axis=1)
