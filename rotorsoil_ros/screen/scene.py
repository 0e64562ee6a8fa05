"""What does the machine look like while it vibrates? Its geometry, and how far it bends."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
import math

import numpy as np
from scipy.interpolate import CubicSpline

from rotorsoil_ros.arrays import ComplexArray, FloatArray
from rotorsoil_ros.case.config import Case
from rotorsoil_ros.channel import across, Channel, DOFS, JOURNAL
from rotorsoil_ros.ground.plan import Part
from rotorsoil_ros.ground.soil import Circle, extents, parts_of
from rotorsoil_ros.machine.foundation import Foundation
from rotorsoil_ros.rotor.disc import Disc

SHAFT_POINTS = 61
ORBIT_POINTS = 33
LARGEST_SHARE = 0.15  # of the shaft length, that the largest drawn displacement may take
SMALLEST_SHARE = 0.05  # below it the scale is chosen anew
_HOLE = 1.08  # of a block, how wide the hole is drawn that it stands in
BLOCK_SHARE = 0.45  # of the shaft height, that a block takes whose height is not known


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
    A drawn foundation: half-sizes, height, centre and bearing seats [m], its six channels.

    It is schematic where its case does not tell its height. `embedment` is how deep its base lies
    below the surface [m].
    """

    name: str
    half_width: float
    half_length: float
    height: float
    centre_y: float
    seats: tuple[float, ...]
    channels: tuple[int, ...]
    is_schematic: bool
    embedment: float = 0.0
    centre_x: float = 0.0
    parts: tuple[Part, ...] = ()

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


class Scene:
    """
    The machine as lines and boxes; y along the shaft, z up, ground at zero.

    Between stations the shaft is drawn as a cubic spline: what an elastic beam does that is
    loaded at its stations.
    """

    def __init__(self, case: Case, channels: Sequence[str]) -> None:
        index = {name: number for number, name in enumerate(channels)}
        rotor = case.rotor
        places = [(across(bearing.name, JOURNAL), bearing.position, 0.0)
                  for bearing in rotor.bearings]
        places += [(across(disc.name), disc.position, disc_radius(disc)) for disc in rotor.discs]
        # What moves with a housing, or is seen from one side, is no place of the shaft.
        places += [(across(probe.name), probe.position, 0.0) for probe in rotor.probes
                   if probe.angle is None and not probe.relative_to]
        self.stations = sorted(
            (Station(x.station, y, radius, index[x], index[z]) for (x, z), y, radius in places),
            key=lambda station: station.y)
        self.shaft_height = rotor.shaft_height
        self.length = sum(section.length for section in rotor.shaft)
        blocks = {foundation.name for foundation in case.foundations}
        self.blocks = [
            replace(_block(foundation, case, index), embedment=embedment.depth)
            for foundation, embedment in zip(
                case.foundations if case.berth is None else case.berth.seen(case.foundations),
                case.embedments, strict=True)]
        self.ground_seats = tuple(bearing.position for bearing in rotor.bearings
                                  if bearing.foundation not in blocks)
        self.y = np.linspace(0.0, self.length, SHAFT_POINTS)
        self._bending = _bending([station.y for station in self.stations], self.y)

    @property
    def extent(self) -> float:
        """How large the whole is [m]."""
        blocks = [2.0 * max(block.half_width, block.half_length) for block in self.blocks]
        return max(self.length, self.shaft_height, *blocks)

    def name_place(self, station: Station) -> tuple[float, float, float]:
        """Return where the name of a station stands: a disc's above it, others at the foot."""
        if station.radius > 0.0:
            return 0.0, station.y, self.shaft_height + station.radius + 0.08 * self.extent
        return 0.0, station.y, 0.6 * self.shaft_height

    def stations_at(self, displacement: ComplexArray, turn: FloatArray) -> FloatArray:
        """Return where the stations are at angles of turn (n,): offsets (n, stations, 2)."""
        x = displacement[:, [station.x_channel for station in self.stations]]
        z = displacement[:, [station.z_channel for station in self.stations]]
        return np.real(np.stack([x, z], axis=2) * np.exp(1j * turn)[:, None, None])

    def shaft(self, offsets: FloatArray) -> FloatArray:
        """Return the shaft through station offsets (n, stations, 2): points (n, p, 3) [m]."""
        return self.points(self.y, np.einsum('ps,nsk->npk', self._bending, offsets))

    def orbits(self, displacement: ComplexArray, scale: FloatArray) -> FloatArray:
        """Return the scaled orbits of all stations, (n, stations, points, 3) [m]."""
        turn = np.linspace(0.0, 2.0 * np.pi, ORBIT_POINTS)
        around = np.stack([self.stations_at(displacement, np.full(len(displacement), angle))
                           for angle in turn], axis=2)
        y = np.array([station.y for station in self.stations])[:, None]
        return self.points(y, around * scale[:, None, None, None])

    def discs(self, offsets: FloatArray) -> FloatArray:
        """Return the rims of the discs at station offsets, (n, discs, points, 3) [m]."""
        turn = np.linspace(0.0, 2.0 * np.pi, ORBIT_POINTS)
        rims = [number for number, station in enumerate(self.stations) if station.radius > 0.0]
        radius = np.array([self.stations[number].radius for number in rims])[:, None, None]
        y = np.array([self.stations[number].y for number in rims])[:, None]
        circle = np.stack([np.sin(turn), np.cos(turn)], axis=1)
        return self.points(y, offsets[:, rims, None] + radius * circle)

    def points(self, y: FloatArray, offsets: FloatArray) -> FloatArray:
        """Return points along the shaft at y with offsets (..., 2) across it, (..., 3) [m]."""
        x, z = offsets[..., 0], offsets[..., 1]
        return np.stack([x, np.broadcast_to(y, x.shape), self.shaft_height + z], axis=-1)

    def largest(self, displacement: ComplexArray) -> FloatArray:
        """Return how far anything that is drawn moves, (n,) [m]; NaN where it is not known."""
        size = np.abs(displacement)
        moves: list[FloatArray] = [
            size[:, [station.x_channel, station.z_channel]].max(axis=1)
            for station in self.stations]
        for block in self.blocks:
            arm = max(block.half_length, block.half_width, block.height)
            moves += [size[:, list(block.channels[:3])].max(axis=1),
                      arm * size[:, list(block.channels[3:])].max(axis=1)]
        largest: FloatArray = np.maximum.reduce(moves)
        return largest

    def scales(self, largest: FloatArray, last: float) -> FloatArray:
        """
        Return by how much displacements are magnified, (n,): 1, 2, 5, 10...

        A scale is kept until what it draws becomes too large or too small to see.
        """
        scales = np.empty(len(largest))
        for number, size in enumerate(largest):
            share = size * last / self.length
            if size > 0.0 and not SMALLEST_SHARE <= share <= LARGEST_SHARE:
                last = round_scale(LARGEST_SHARE * self.length / size)
            scales[number] = last
        return scales


def disc_radius(disc: Disc) -> float:
    """Return the radius of the uniform disc with this mass and polar inertia [m]."""
    return math.sqrt(2.0 * disc.polar_inertia / disc.mass) if disc.mass > 0.0 else 0.0


def round_scale(wanted: float) -> float:
    """Return the largest of 1, 2, 5, 10, 20... and 0.5, 0.2, 0.1... that is not above wanted."""
    decade = 10.0 ** np.floor(np.log10(wanted))
    return float(decade * max(step for step in (1.0, 2.0, 5.0) if step <= wanted / decade * 1.001))


def _block(foundation: Foundation, case: Case, index: Mapping[str, int]) -> Block:
    width, length = (0.5 * (last - first) for first, last in extents(foundation.contact))
    seats = tuple(bearing.position for bearing in case.rotor.bearings
                  if bearing.foundation == foundation.name)
    channels = tuple(index[Channel(foundation.name, '', dof)] for dof in DOFS)
    parts = () if isinstance(foundation.contact, Circle) else parts_of(foundation.contact)
    height = foundation.height or BLOCK_SHARE * case.rotor.shaft_height
    return Block(foundation.name, width, length, height,
                 foundation.centre_y, seats, channels, foundation.height is None,
                 centre_x=foundation.centre_x, parts=parts)


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
