"""What do machines look like while they vibrate? Their geometry, and how far they bend."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from rotorsoil_ros.arrays import ComplexArray, FloatArray
from rotorsoil_ros.case.config import Case
from rotorsoil_ros.case.plant.berth import mounts, placed
from rotorsoil_ros.channel import across, Channel, DOFS, JOURNAL
from rotorsoil_ros.ground.plan import Part
from rotorsoil_ros.ground.soil import Circle, extents, parts_of
from rotorsoil_ros.machine.flexible.lattice import Lattice
from rotorsoil_ros.machine.foundation import Foundation
from rotorsoil_ros.machine.placement import Placement
from rotorsoil_ros.rotor.assembly import Rotor

SHAFT_POINTS = 61
ORBIT_POINTS = 33
LARGEST_SHARE = 0.15  # of the longest shaft, that the largest drawn displacement may take
SMALLEST_SHARE = 0.05  # below it the scale is chosen anew
_HOLE = 1.08  # of a block, how wide the hole is drawn that it stands in
BLOCK_SHARE = 0.45  # of the shaft height, that a block takes whose height is not known
_TRESTLE = 0.3  # of the height of a shaft above its foot, that its legs stand apart


@dataclass(frozen=True, slots=True)
class Station:
    """
    A place on the shaft where the motion is known.

    Attributes
    ----------
    name : str
        Of the bearing, disc or probe.
    y, radius : float
        Position along the shaft, and of the disc that sits there or zero [m].
    x_channel, z_channel : int
        Which channels tell its motion.

    """

    name: str
    y: float
    radius: float
    x_channel: int
    z_channel: int


@dataclass(frozen=True, slots=True)
class Block:
    """
    A drawn foundation: half-sizes, height, centre, legs of its bearings [m], its six channels.

    It is schematic where its case does not tell its height. `embedment` is how deep its base lies
    below the surface, `elevation` how high it stands on others [m].
    """

    name: str
    half_width: float
    half_length: float
    height: float
    centre_x: float
    centre_y: float
    legs: tuple[FloatArray, ...]
    channels: tuple[int, ...]
    is_schematic: bool
    embedment: float = 0.0
    parts: tuple[Part, ...] = ()
    elevation: float = 0.0

    @property
    def hole(self) -> list[list[tuple[float, float, float]]]:
        """Lines of the hole that it stands in, about the centre of its contact: empty if none."""
        if not self.embedment:
            return []
        corners = [(x * self.half_width, y * self.half_length)
                   for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1), (-1, -1))]
        rim = [(_HOLE * x, _HOLE * y, self.embedment) for x, y in corners]
        # The edge of the ground, and from each corner of it down to the base.
        return [rim, *([edge, (x, y, 0.0)] for edge, (x, y) in zip(rim[:4], corners[:4],
                                                                 strict=True))]


class Line:
    """
    One shaft with its stations, in the axes of the ground.

    Between stations it is drawn as a cubic spline: what an elastic beam does that is loaded at
    its stations.
    """

    def __init__(
        self, name: str, rotor: Rotor, place: Placement, index: Mapping[Channel, int],
    ) -> None:
        self.name = name
        places = [(across(bearing.name, JOURNAL), bearing.position, 0.0)
                  for bearing in rotor.bearings]
        places += [(across(disc.name), disc.position, disc.radius) for disc in rotor.discs]
        # What moves with a housing, or is seen from one side, is no place of the shaft.
        places += [(across(probe.name), probe.position, 0.0) for probe in rotor.probes
                   if probe.angle is None and not probe.relative_to]
        self.stations = sorted(
            (Station(x.station, y, radius, index[x], index[z]) for (x, z), y, radius in places),
            key=lambda station: station.y)
        self.start = np.array([place.x, place.y, rotor.shaft_height])
        self.sideways, self.along, self.upwards = place.axes
        self.length = rotor.length
        self.y = np.linspace(0.0, self.length, SHAFT_POINTS)
        self._bending = _bending([station.y for station in self.stations], self.y)
        self._columns = ([station.x_channel for station in self.stations],
                         [station.z_channel for station in self.stations])
        self._at = np.array([station.y for station in self.stations])

    def offsets(self, motion: FloatArray) -> FloatArray:
        """Return where channels (n, c) move the stations across the shaft, (n, stations, 2)."""
        x, z = self._columns
        return np.stack([motion[:, x], motion[:, z]], axis=2)

    def points(self, y: FloatArray, offsets: FloatArray) -> FloatArray:
        """Return points along the shaft at y with offsets (..., 2) across it, (..., 3) [m]."""
        x, z = offsets[..., 0, None], offsets[..., 1, None]
        return np.asarray(self.start + np.asarray(y)[..., None] * self.along
                          + x * self.sideways + z * self.upwards)

    def shaft(self, offsets: FloatArray) -> FloatArray:
        """Return the shaft through station offsets (n, stations, 2): points (n, p, 3) [m]."""
        return self.points(self.y, np.einsum('ps,nsk->npk', self._bending, offsets))

    def orbits(self, displacement: ComplexArray, scale: FloatArray) -> FloatArray:
        """Return the scaled orbits of all stations, (n, stations, points, 3) [m]."""
        turn = np.linspace(0.0, 2.0 * np.pi, ORBIT_POINTS)
        around = np.stack([self.offsets(np.real(displacement * np.exp(1j * angle)))
                           for angle in turn], axis=2)
        return self.points(self._at[:, None], around * scale[:, None, None, None])

    def discs(self, offsets: FloatArray) -> FloatArray:
        """Return the rims of the discs at station offsets, (n, discs, points, 3) [m]."""
        turn = np.linspace(0.0, 2.0 * np.pi, ORBIT_POINTS)
        rims = [number for number, station in enumerate(self.stations) if station.radius > 0.0]
        radius = np.array([self.stations[number].radius for number in rims])[:, None, None]
        circle = np.stack([np.sin(turn), np.cos(turn)], axis=1)
        return self.points(self._at[rims][:, None], offsets[:, rims, None] + radius * circle)

    def stationed(self, offsets: FloatArray) -> FloatArray:
        """Return where the stations are at their offsets, (n, stations, 3) [m]."""
        return self.points(self._at, offsets)

    def named_at(self, station: Station, extent: float) -> FloatArray:
        """Return where the name of a station stands: a disc's beyond it, others at the foot."""
        beside = (station.radius + 0.08 * extent if station.radius > 0.0
                  else -0.2 * extent if self.is_upright else -0.4 * self.start[2])
        return self.points(np.array(station.y), np.array([0.0, beside]))

    def topped(self, above: float) -> FloatArray:
        """Return a place so far above all of it [m]."""
        highest = max(station.radius for station in self.stations)
        end, reach = (self.length, 0.0) if self.is_upright else (0.5 * self.length, highest)
        place: FloatArray = self.points(np.array(end), np.zeros(2))
        return np.asarray(place + (above + reach) * np.eye(3)[2])

    @property
    def is_upright(self) -> bool:
        """Whether it stands."""
        return bool(self.along[2] > 0.0)


class Scene:
    """
    The machines of a case as lines and boxes; z up, contacts at zero.

    The first shaft moves, or the `whole` plant: ten machines that each drew ten would be a
    hundred.
    """

    def __init__(
        self, case: Case, channels: Sequence[Channel], *, whole: bool = False,
    ) -> None:
        index = {name: number for number, name in enumerate(channels)}
        self.lines = [Line(name, rotor, place, index) for name, rotor, place in placed(case)]
        self.moving = self.lines if whole else self.lines[:1]
        blocks = [(block, embedment.depth) for block, embedment in zip(
            case.foundations, case.embedments, strict=True)]
        self.blocks = [_block(block, case, index, depth) for block, depth in blocks
                       if block.body is None]
        self.lattices = [Lattice.of(block, mounts(case), channels) for block, _ in blocks
                         if block.body is not None]
        names = {block.name for block, _ in blocks}
        self.legs = [_leg(rotor, place, bearing.position, 0.0) for _, rotor, place in placed(case)
                     for bearing in rotor.bearings if bearing.foundation not in names]
        self.longest = max(line.length for line in self.lines)
        corners = np.concatenate([
            *(line.points(line.y[[0, -1]], np.zeros((2, 2))) for line in self.lines),
            *([[block.centre_x + x * block.half_width, block.centre_y + x * block.half_length, 0.0]
               for x in (-1.0, 1.0)] for block in self.blocks),
            *(lattice.places for lattice in self.lattices)])
        self.low, self.high = corners.min(axis=0), corners.max(axis=0)

    @property
    def extent(self) -> float:
        """How large the whole is [m]."""
        return float(max(self.high[2], *(self.high - self.low)))

    @property
    def reach(self) -> float:
        """From one end of everything to the other [m]."""
        return float(np.linalg.norm(np.maximum(self.high, 0.0) - self.low))

    @property
    def names(self) -> list[tuple[str, FloatArray]]:
        """Words and where they stand: of one machine its stations, else the machines."""
        if len(self.lines) == 1:
            [line] = self.lines
            # Every second one farther out: those of close discs would cover each other.
            return [(station.name, line.named_at(
                station, (1.0 + 0.8 * (number % 2)) * self.extent))
                for number, station in enumerate(line.stations)]
        return [(line.name, line.topped(0.08 * self.extent)) for line in self.lines]

    def largest(self, size: FloatArray) -> FloatArray:
        """Return how far anything drawn moves at amplitudes (n, c), (n,) [m]; NaN: not known."""
        moves: list[FloatArray] = [
            size[:, [station.x_channel, station.z_channel]].max(axis=1)
            for line in self.moving for station in line.stations]
        for block in self.blocks:
            arm = max(block.half_length, block.half_width, block.height)
            moves += [size[:, list(block.channels[:3])].max(axis=1),
                      arm * size[:, list(block.channels[3:])].max(axis=1)]
        moves += [(size @ np.abs(lattice.follow).max(axis=1).T).max(axis=1)
                  for lattice in self.lattices]
        largest: FloatArray = np.maximum.reduce(moves)
        return largest

    def scales(self, largest: FloatArray, last: float) -> FloatArray:
        """
        Return by how much displacements are magnified, (n,): 1, 2, 5, 10...

        A scale is kept until what it draws becomes too large or too small to see.
        """
        scales = np.empty(len(largest))
        for number, size in enumerate(largest):
            share = size * last / self.longest
            if size > 0.0 and not SMALLEST_SHARE <= share <= LARGEST_SHARE:
                last = round_scale(LARGEST_SHARE * self.longest / size)
            scales[number] = last
        return scales


def round_scale(wanted: float) -> float:
    """Return the largest of 1, 2, 5, 10, 20... and 0.5, 0.2, 0.1... that is not above wanted."""
    decade = 10.0 ** np.floor(np.log10(wanted))
    return float(decade * max(step for step in (1.0, 2.0, 5.0) if step <= wanted / decade * 1.001))


def _leg(rotor: Rotor, place: Placement, position: float, foot: float) -> FloatArray:
    """Return the trestle of a bearing, from its foot up to the shaft, (3, 3) [m]."""
    x, y = place.point(position)
    top = rotor.shaft_height + position * place.axes[1, 2]
    apart = _TRESTLE * max(top - foot, 0.0)
    return np.array([[x, y, foot], [x, y, top], [x, y, foot]]) + np.outer(
        [-apart, 0.0, apart], place.axes[0])


def _block(
    foundation: Foundation, case: Case, index: Mapping[Channel, int], depth: float,
) -> Block:
    width, length = (0.5 * (last - first) for first, last in extents(foundation.contact))
    foot = foundation.elevation
    centre = np.array([foundation.centre_x, foundation.centre_y, foot])
    height = foundation.height or BLOCK_SHARE * (case.rotor.shaft_height - foot)
    legs = tuple(_leg(rotor, place, bearing.position, foot + height) - centre
                 for _, rotor, place in placed(case) for bearing in rotor.bearings
                 if bearing.foundation == foundation.name)
    parts = () if isinstance(foundation.contact, Circle) else parts_of(foundation.contact)
    return Block(foundation.name, width, length, height, foundation.centre_x, foundation.centre_y,
                 legs, tuple(index[Channel(foundation.name, '', dof)] for dof in DOFS),
                 foundation.height is None, depth, parts, foot)


def _bending(stations: Sequence[float], y: FloatArray) -> FloatArray:
    """Return the shape at y for a unit offset of each station, (points, stations)."""
    knots, first = np.unique(stations, return_index=True)
    shape = np.zeros((len(y), len(stations)))
    if len(knots) == 1:
        shape[:, first] = 1.0
        return shape
    spline = CubicSpline(knots, np.eye(len(knots)), bc_type='natural')
    inside = np.clip(y, knots[0], knots[-1])
    # Beyond the outer stations nothing bends the shaft: it goes on straight.
    shape[:, first] = spline(inside) + (y - inside)[:, None] * spline(inside, 1)
    return shape
