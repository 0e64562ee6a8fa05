"""How everything on some blocks moves while one of several machines excites it."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from rotorsoil_ros.arrays import ComplexArray, FloatArray
from rotorsoil_ros.errors import NotSolvedError, RotorSoilError
from rotorsoil_ros.machine.bearings import Bearings
from rotorsoil_ros.machine.coupled import CoupledModel
from rotorsoil_ros.machine.coupling import Answer, driven, gathered
from rotorsoil_ros.machine.flexible.part import Mount
from rotorsoil_ros.machine.plant.neighbour import Neighbour
from rotorsoil_ros.machine.support import Support
from rotorsoil_ros.rotor.assembly import Rotor
from rotorsoil_ros.rotor.whirl import WhirlModes


@dataclass(frozen=True)
class JointSupport(Support):
    """
    The same blocks below the bearings of several machines.

    Attributes
    ----------
    apart : sequence of Mount
        Where each bearing is.

    """

    apart: Sequence[Mount] = ()

    @property
    def mounts(self) -> list[Mount]:
        """Where every bearing of every machine is."""
        return list(self.apart)


@dataclass(frozen=True)
class SourceModel(CoupledModel):
    """
    One of several machines, which excites them all.

    Its channels are those of all machines, in their order. Its modes are those of the plant: the
    others turn, or stand, at speeds of their own.

    Attributes
    ----------
    neighbours : sequence of Neighbour
        The others, in the order of the machines.
    index : int
        How many of them come before the source.
    names : sequence of str
        What the machines are called, in their order; numbers where nobody says.

    """

    neighbours: Sequence[Neighbour] = ()
    index: int = 0
    names: Sequence[str] = ()

    def __post_init__(self) -> None:
        if not 0 <= self.index <= len(self.neighbours):
            raise RotorSoilError(f'index must be 0 to {len(self.neighbours)}, got {self.index}')
        super().__post_init__()

    @property
    def rotors(self) -> tuple[Rotor, ...]:
        """All that turn on these blocks, in the order of the channels."""
        return self.in_order(self.rotor, [one.rotor for one in self.neighbours])

    @property
    def own_speeds(self) -> tuple[float | None, ...]:
        """Speed at which each of them turns [rad/s]; None of the source."""
        speeds = [one.speed for one in self.neighbours]
        return (*speeds[:self.index], None, *speeds[self.index:])

    @property
    def machines(self) -> tuple[str, ...]:
        """What each of them is called."""
        return tuple(self.names) or tuple(
            f'machine {number}' for number, _ in enumerate(self.rotors, start=1))

    @cached_property
    def all_bearings(self) -> Bearings:
        """All that holds any shaft on these blocks."""
        held = self.in_order(None, [one.held_speed for one in self.neighbours])
        each = [(bearing, speed) for rotor, speed in zip(self.rotors, held, strict=True)
                for bearing in rotor.bearings]
        return Bearings(tuple(bearing for bearing, _ in each),
                        tuple(speed for _, speed in each))

    @cached_property
    def support(self) -> Support:
        """The blocks below the bearings of all machines."""
        places = self.in_order(self.place, [one.place for one in self.neighbours])
        mounts = [Mount(bearing, rotor.shaft_height, place)
                  for rotor, place in zip(self.rotors, places, strict=True)
                  for bearing in rotor.bearings]
        return JointSupport([mount.bearing for mount in mounts], self.rotor.shaft_height,
                            self.foundations, self.soil_models, apart=mounts)

    @cached_property
    def _rows(self) -> list[slice]:
        """Where the housings of each machine stand among those of all."""
        ends = np.cumsum([2 * len(rotor.bearings) for rotor in self.rotors]).tolist()
        return [slice(end - 2 * len(rotor.bearings), end)
                for end, rotor in zip(ends, self.rotors, strict=True)]

    def _answer(
        self, modes: WhirlModes, omega: FloatArray, speed: FloatArray, loads: ComplexArray,
        ground: FloatArray,
    ) -> Answer:
        """
        Solve at all these frequencies at once.

        All housings move by u = H f + u_0 under the forces f of all bearings; those of a
        neighbour are f = -Z u with its apparent stiffness Z. Only the source's are unknown, and
        what they meet is (I + H Z)^-1 H.
        """
        rotor, standing = modes.receptance(omega), self.support.standing(omega)
        reach, count = rotor.shapes.shape[1], 2 * len(self.rotor.bearings)
        own, below = self.own_seats, loads[reach:]
        moved, pushed = standing.pushed(below, ground)
        led = [one.led(omega) for one in self.neighbours]
        pull = np.zeros_like(standing.receptance)
        others = [*self._rows[:self.index], *self._rows[self.index + 1:]]
        for part, (_, through) in zip(others, led, strict=True):
            pull[:, part, part] = through
        met = _met(standing.receptance, pull, np.concatenate([
            standing.receptance[..., own],
            np.broadcast_to(moved, (len(omega), *moved.shape[1:]))], axis=2))
        ports, through = driven(
            rotor, met[:, own, :count], met[:, own, count:], loads[:reach],
            bearings=self.bearings.dynamic_stiffness(omega, speed),
            springs=np.repeat(self.rotor.nominal_springs, 2))
        housings = met[..., :count] @ through + met[..., count:]
        forces = pull @ housings
        forces[:, own] = through
        follow = [ports_of @ housings[:, part]
                  for (ports_of, _), part in zip(led, others, strict=True)]
        return gathered(standing, self.in_order(ports, follow), housings, forces, below, pushed,
                        ground)


def _met(receptance: ComplexArray, pull: ComplexArray, free: ComplexArray) -> ComplexArray:
    """Return what neighbours leave of a motion of all housings, (n, 2 b, k), by their pull."""
    try:
        return np.linalg.solve(np.eye(receptance.shape[-1]) - receptance @ pull, free)
    except np.linalg.LinAlgError as error:
        raise NotSolvedError('the coupled system is singular: a resonance without damping is '
                             'hit') from error
