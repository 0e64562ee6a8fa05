"""Where a machine stands among others, as a model and in words."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
import math
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from rotorsoil_ros.arrays import ComplexArray, FloatArray
from rotorsoil_ros.case.case_errors import Faults
from rotorsoil_ros.case.flexible.entries import require_on_shaft
from rotorsoil_ros.ground.soil import extents, SoilModel
from rotorsoil_ros.machine.flexible.part import Mount
from rotorsoil_ros.machine.foundation import Foundation
from rotorsoil_ros.machine.placement import Placement
from rotorsoil_ros.machine.plant.neighbour import Neighbour
from rotorsoil_ros.machine.plant.source import SourceModel
from rotorsoil_ros.rotor.assembly import Rotor
from rotorsoil_ros.rotor.bearing import Bearing
from rotorsoil_ros.rotor.disc import Disc
from rotorsoil_ros.rotor.shaft import Probe
from rotorsoil_ros.units import rad_s_to_rpm

if TYPE_CHECKING:
    from rotorsoil_ros.case.config import Case

# A shaft whose heading is off by less is along the blocks [rad].
_STRAIGHT = 1e-6

_Station = TypeVar('_Station', Bearing, Disc, Probe)


@dataclass(frozen=True)
class Berth:
    """
    Where a machine stands among those of a plant.

    Attributes
    ----------
    plant : str
        Name of the plant.
    place : Placement
        Where its shaft lies.
    neighbours : tuple of Neighbour
        The other machines, in the order of the file.
    names : tuple of str
        Those of all machines, in that order.
    index : int
        Which of them it is.
    rated_speed : float
        At which its neighbours take it to run [rad/s].
    fastest : tuple of float
        Highest speed of each neighbour [rad/s].
    remarks : tuple of str
        What looks odd about where and how it stands.
    geared : tuple of str and float, or None
        Which machine's speed is its own, times what [-]; None where it turns by itself.

    """

    plant: str
    place: Placement
    neighbours: tuple[Neighbour, ...]
    names: tuple[str, ...]
    index: int
    rated_speed: float
    fastest: tuple[float, ...]
    remarks: tuple[str, ...] = ()
    geared: tuple[str, float] | None = None

    def model(
        self, rotor: Rotor, foundations: Sequence[Foundation], soil_models: Sequence[SoilModel],
        *, couples: Sequence[str] = (), points: Sequence[str] = (),
    ) -> SourceModel:
        """Return the machine among its neighbours as one system of equations."""
        return SourceModel(rotor, foundations, soil_models, couples, points, self.place,
                           self.neighbours, self.index, self.names)

    def seen(self, foundations: Sequence[Foundation]) -> tuple[Foundation, ...]:
        """Return where blocks lie in the axes of the shaft, as pictures show them; not turned."""
        cosine, sine = math.cos(self.place.heading), math.sin(self.place.heading)
        ahead = [(block.centre_x - self.place.x, block.centre_y - self.place.y)
                 for block in foundations]
        return tuple(
            replace(block, centre_x=cosine * x + sine * y, centre_y=cosine * y - sine * x)
            for block, (x, y) in zip(foundations, ahead, strict=True))

    @property
    def is_turned(self) -> bool:
        """Whether its shaft lies along neither way of the y of the blocks."""
        return abs(math.sin(self.place.heading)) > _STRAIGHT

    @property
    def running_beside(self) -> tuple[str, ...]:
        """Names of the other machines, those that stand left out."""
        return tuple(name for name, one in zip(self.others, self.neighbours, strict=True)
                     if one.speed)

    @property
    def others(self) -> tuple[str, ...]:
        """Names of the other machines."""
        return (*self.names[:self.index], *self.names[self.index + 1:])

    @property
    def told(self) -> str:
        """Where it stands and beside whom, in words."""
        beside = ', '.join(
            f'{name} ' + (f'at {rad_s_to_rpm(one.speed):g} rpm' if one.speed else 'standing')
            for name, one in zip(self.others, self.neighbours, strict=True))
        return (f'stands in {self.plant} at x {self.place.x:g} m, y {self.place.y:g} m, heading '
                f'{math.degrees(self.place.heading):g} deg; beside it {beside or "nobody"}')

    def otherwise(self, model: SourceModel) -> tuple[SourceModel, ...]:
        """Return the machine while all its neighbours stand, and while all run their fastest."""
        if not any(self.fastest):  # one that stands has no other speed
            return ()
        return tuple(replace(model, neighbours=tuple(
            replace(one, speed=speed) for one, speed in zip(
                model.neighbours, speeds, strict=True)))
            for speeds in ((0.0,) * len(self.neighbours), self.fastest))

    def spread(
        self, model: SourceModel, speed: FloatArray, unbalance: ComplexArray,
    ) -> FloatArray:
        """
        Return by how much the speeds of its neighbours change what a machine does, (n,) [-].

        Parameters
        ----------
        model : SourceModel
            The machine, its neighbours at their rated speeds.
        speed : (n,) float array
            Of the machine [rad/s].
        unbalance : (p,) complex array
            Of the machine [kg m].

        Returns
        -------
        (n,) float array
            Largest change of any housing's motion, its neighbours standing or at their fastest,
            over the largest motion of any housing.

        """
        housings = [index for index, channel in enumerate(model.channels) if channel.is_housing]
        own, *others = (
            one.unbalance_response(speed, unbalance).displacement[:, housings]
            for one in (model, *self.otherwise(model)))
        change = np.max([np.zeros(own.shape), *(np.abs(other - own) for other in others)], axis=0)
        largest = np.abs(own).max(axis=1, initial=np.finfo(float).tiny)
        return np.asarray(change.max(axis=1) / largest)


def renamed(rotor: Rotor, machine: str) -> Rotor:
    """Return a rotor whose stations carry the name of their machine before their own."""
    def of(stations: tuple[_Station, ...]) -> tuple[_Station, ...]:
        return tuple(replace(one, name=f'{machine}_{one.name}') for one in stations)

    probes = tuple(
        replace(probe, relative_to=f'{machine}_{probe.relative_to}') if probe.relative_to
        else probe for probe in of(rotor.probes))
    return replace(rotor, discs=of(rotor.discs), bearings=of(rotor.bearings), probes=probes)


def placed(case: 'Case') -> tuple[tuple[str, Rotor, Placement], ...]:
    """Return name, rotor and place of all that turns on the blocks of a case, its own first."""
    berth = case.berth
    if berth is None:
        return ((case.name, case.rotor, Placement(is_upright=case.rotor.is_upright)),)
    return ((case.name, case.rotor, berth.place), *(
        (name, one.rotor, one.place)
        for name, one in zip(berth.others, berth.neighbours, strict=True)))


def mounts(case: 'Case') -> list[Mount]:
    """Return where the bearings of all its rotors are."""
    return [Mount(bearing, rotor.shaft_height, place)
            for _, rotor, place in placed(case) for bearing in rotor.bearings]


def beside(block: Foundation, point: tuple[float, float]) -> float:
    """Return how far a point in plan lies outside a block [m]; below 0 inside."""
    (left, right), (front, back) = extents(block.contact)
    x, y = point[0] - block.centre_x, point[1] - block.centre_y
    return max(left - x, x - right, front - y, y - back)


def refuse_seats_elsewhere(
    faults: Faults, rotor: Rotor, place: Placement, foundations: Sequence[Foundation],
) -> None:
    """Raise an InputError at a bearing whose seat on what bends is not below it."""
    blocks = {block.name: block for block in foundations}
    for number, bearing in enumerate(rotor.bearings):
        block = blocks.get(bearing.foundation or '')
        if block is None or block.body is None:
            continue
        mount, body = Mount(bearing, rotor.shaft_height, place), block.body
        with faults.at('rotor', 'bearings', number, entry=faults.entries.rotor.bearings[number]):
            seat = body.dofs[int(np.flatnonzero(mount.on(body)[1])[0])]
            below = np.array(seat.place) - body.centre + [
                block.centre_x, block.centre_y, block.elevation]
            require_on_shaft(seat.station, np.array(mount.point) - below)
