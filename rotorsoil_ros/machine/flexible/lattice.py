"""How a foundation that bends is drawn: its places, the lines between them, and their motion."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations, product
import math

import numpy as np

from rotorsoil_ros.arrays import ComplexArray, FloatArray
from rotorsoil_ros.channel import across, Channel, DOFS, HOUSING
from rotorsoil_ros.ground.soil import extents
from rotorsoil_ros.machine.flexible.body import CONTACT, Dof, EACH, FlexibleBody, PROBE
from rotorsoil_ros.machine.flexible.part import Mount
from rotorsoil_ros.machine.foundation import Foundation

# Two places with a third within the ball between them are no neighbours.
_BALL = 1.0 + 1e-6
# Corners of a footing, in half of its sides.
_CORNERS = ((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0))


@dataclass(frozen=True, eq=False)
class Lattice:
    """
    Places of one foundation, as far as channels tell how they move.

    Attributes
    ----------
    name : str
        Of the foundation.
    places : (k, 3) float array
        At rest in the axes of the ground; corners of footings last [m].
    named : tuple of str
        Stations of the first of them.
    follow : (k, 3, c) float array
        Motion along x, y, z per motion of the channels.
    edges : (e, 2) int array
        Which places a line joins; a probe that tells one direction only is a point.

    """

    name: str
    places: FloatArray
    named: tuple[str, ...]
    follow: FloatArray
    edges: np.ndarray

    @classmethod
    def of(
        cls, block: Foundation, mounts: Sequence[Mount], channels: Sequence[Channel],
    ) -> 'Lattice':
        """
        Return what is drawn of a foundation that bends.

        Parameters
        ----------
        block : Foundation
            With its body.
        mounts : sequence of Mount
            Where the bearings of all machines are. A seat moves as the housing on it, and is left
            out where a pedestal lies between them.
        channels : sequence of Channel
            Of which the motion is known. A place is left out where nobody tells how it moves, or
            where it is.

        """
        body = block.body
        assert body is not None
        index = {channel: column for column, channel in enumerate(channels)}
        follow: dict[str, FloatArray] = {}
        seats: set[str] = set()
        where = _places(block, body)

        def moves(station: str, direction: Sequence[float], channel: Channel) -> None:
            if channel in index and np.isfinite(where[station]).all():
                rows = follow.setdefault(station, np.zeros((3, len(channels))))
                rows[:, index[channel]] += direction

        for mount in mounts:
            bearing = mount.bearing
            if bearing.foundation == block.name and bearing.pedestal is None:
                seats.add(bearing.seat or bearing.name)
                for direction, channel in zip(
                        mount.axes, across(bearing.name, HOUSING), strict=True):
                    moves(bearing.seat or bearing.name, direction, channel)
        for dof, channel in _points(body, block.name):
            if not channel.is_rotation:
                moves(dof.station, np.eye(3)[DOFS.index(dof.axis)], channel)
        places = [where[station] for station in follow]
        edges = _edges(body, np.array(places), follow, seats)
        rows = [*follow.values()]
        for corners, own in _footings(block, body, where, index):
            ring = len(places) + np.arange(len(corners))
            edges += list(zip(ring, np.roll(ring, -1), strict=True))
            places += corners
            rows += own
        return cls(block.name, np.array(places).reshape(-1, 3), tuple(follow),
                   np.array(rows).reshape(-1, 3, len(channels)),
                   np.array(edges, dtype=int).reshape(-1, 2))

    @classmethod
    def whole(cls, block: Foundation, mounts: Sequence[Mount]) -> 'Lattice':
        """Return all places, as if all channels were known."""
        assert block.body is not None
        housings = [channel for mount in mounts
                    for channel in across(mount.bearing.name, HOUSING)]
        contacts, probes = block.body.channels(block.name)
        return cls.of(block, mounts, (*housings, *contacts, *probes))

    def moved(self, motion: FloatArray | ComplexArray) -> np.ndarray:
        """Return how the places move, (..., k, 3), where channels move by (..., c)."""
        return np.asarray(motion @ self.follow.reshape(-1, self.follow.shape[-1]).T).reshape(
            *motion.shape[:-1], *self.places.shape)

    def lines(self, offsets: FloatArray) -> FloatArray:
        """Return both ends of every line while the places are off, (..., e, 2, 3) [m]."""
        return np.asarray((self.places + offsets)[..., self.edges, :])


def _points(body: FlexibleBody, name: str) -> Iterator[tuple[Dof, Channel]]:
    """Yield contacts and probes with their channels."""
    contacts, probes = body.channels(name)
    rows = [*body.contacts.tolist(), *body.of_kind(PROBE)]
    for row, channel in zip(rows, (*contacts, *probes), strict=True):
        yield body.dofs[row], channel


def _edges(
    body: FlexibleBody, places: FloatArray, follow: Mapping[str, FloatArray],
    seats: Collection[str],
) -> list[tuple[int, int]]:
    """
    Return which places a line joins.

    Contacts and probes make the body; seats stand on those of them that are around. Footings
    that stand apart are joined by what stands on them alone, by seats where no probe does.
    """
    footings = {dof.station for dof in body.dofs if dof.kind == CONTACT}
    borne = [at for at, station in enumerate(follow) if station in seats]
    # A probe that tells one direction says little of how the body lies there.
    firm = [at for at, (station, rows) in enumerate(follow.items()) if station not in seats and (
        station in footings or np.count_nonzero(rows.any(axis=1)) > 1)]
    apart = {at for at in firm if body.bed == EACH and [*follow][at] in footings}
    if len(apart) == len(firm):
        firm, borne = [*firm, *borne], []
    pairs = [(pair, firm) for pair in combinations(firm, 2) if not apart.issuperset(pair)]
    pairs += [(pair, [*firm, *borne]) for pair in product(borne, firm)]
    return [pair for pair, rivals in pairs if _are_neighbours(places, pair, rivals)]


def _places(block: Foundation, body: FlexibleBody) -> dict[str, list[float]]:
    """Return where its places are in the axes of the ground [m]."""
    # The middle of its contact stands where the foundation does.
    shift = np.array([block.centre_x, block.centre_y, block.elevation]) - body.centre
    return {dof.station: (np.array(dof.place) + shift).tolist() for dof in body.dofs}


def _footings(
    block: Foundation, body: FlexibleBody, where: dict[str, list[float]],
    index: dict[Channel, int],
) -> Iterator[tuple[list[list[float]], list[FloatArray]]]:
    """Yield corners of the contacts that turn, and how these move."""
    own: dict[str, dict[str, Channel]] = {}
    for dof, channel in _points(body, block.name):
        if dof.kind == CONTACT and channel in index:
            own.setdefault(dof.station, {})[dof.axis] = channel
    area = {dof.station: dof.area for dof in body.dofs}
    for station, motions in own.items():
        half = np.full(2, 0.5 * math.sqrt(area[station]))
        if body.has_one_contact:
            half = np.array([0.5 * (last - first) for first, last in extents(block.contact)])
        if len(motions) < len(DOFS) or not half.any():
            continue
        corners, rows = [], []
        for corner in np.array(_CORNERS) * half:
            row = np.zeros((3, len(index)))
            turned = np.array([Dof('', axis, CONTACT, (*corner.tolist(), 0.0)).rigid_row
                               for axis in DOFS[:3]])
            row[:, [index[motions[axis]] for axis in DOFS]] = turned
            corners.append((np.array(where[station]) + np.append(corner, 0.0)).tolist())
            rows.append(row)
        yield corners, rows


def _are_neighbours(places: FloatArray, pair: tuple[int, int], rivals: Sequence[int]) -> bool:
    """Return whether no rival lies between two places (Gabriel's graph)."""
    middle = places[list(pair)].mean(axis=0)
    ball = _BALL * np.linalg.norm(places[pair[0]] - middle)
    others = [at for at in rivals if at not in pair]
    return bool(np.all(np.linalg.norm(places[others] - middle, axis=1) >= ball))
