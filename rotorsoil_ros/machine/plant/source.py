"""How everything on some blocks moves while one of several machines excites it."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TypeVar

import numpy as np

from rotorsoil_ros.arrays import ComplexArray, FloatArray
from rotorsoil_ros.errors import NotSolvedError, RotorSoilError
from rotorsoil_ros.machine.coupled import CoupledModel
from rotorsoil_ros.machine.coupling import Answer, driven, gathered
from rotorsoil_ros.machine.flexible.part import Mount
from rotorsoil_ros.machine.modes.natural import riding_mass
from rotorsoil_ros.machine.placement import Placement
from rotorsoil_ros.machine.plant.neighbour import Neighbour
from rotorsoil_ros.machine.support import Support
from rotorsoil_ros.rotor.assembly import Rotor
from rotorsoil_ros.rotor.whirl import WhirlModes

_T = TypeVar('_T')


@dataclass(frozen=True)
class JointSupport(Support):
    """
    The same blocks below the bearings of several machines.

    Attributes
    ----------
    parts : sequence of Support
        That of each machine, in the order of the bearings.

    """

    parts: Sequence[Support] = ()

    @property
    def mounts(self) -> list[Mount]:
        """Where every bearing of every machine is."""
        return [mount for part in self.parts for mount in part.mounts]


@dataclass(frozen=True)
class SourceModel(CoupledModel):
    """
    One of several machines, which excites them all.

    Its channels are those of all machines, in their order. Modes and stability are those of the
    source with its neighbours as rigid bodies; the response knows their rotors.

    Attributes
    ----------
    neighbours : sequence of Neighbour
        The others, in the order of the machines.
    index : int
        How many of them come before the source.

    """

    neighbours: Sequence[Neighbour] = ()
    index: int = 0

    def __post_init__(self) -> None:
        if not 0 <= self.index <= len(self.neighbours):
            raise RotorSoilError(f'index must be 0 to {len(self.neighbours)}, got {self.index}')
        super().__post_init__()

    @property
    def rotors(self) -> tuple[Rotor, ...]:
        """All that turn on these blocks, in the order of the channels."""
        return self._in_order(self.rotor, [one.rotor for one in self.neighbours])

    @cached_property
    def support(self) -> Support:
        """The blocks below the bearings of the source, its neighbours riding on them."""
        burden = np.zeros_like(self._alone.block_mass)
        for support, neighbour in zip(self._beside, self.neighbours, strict=True):
            mass = riding_mass(neighbour.rotor) + support.housing_mass
            burden += support.block_rows.T @ mass @ support.block_rows
        return self._on_blocks(self.rotor, self.place, burden)

    @cached_property
    def _alone(self) -> Support:
        return self._on_blocks(self.rotor, self.place)

    @cached_property
    def _beside(self) -> list[Support]:
        return [self._on_blocks(one.rotor, one.place) for one in self.neighbours]

    @cached_property
    def _joint(self) -> JointSupport:
        """The blocks below the bearings of all machines."""
        parts = self._in_order(self._alone, self._beside)
        bearings = [bearing for part in parts for bearing in part.bearings]
        return JointSupport(bearings, self.rotor.shaft_height, self.foundations,
                            self.soil_models, parts=parts)

    def _on_blocks(
        self, rotor: Rotor, place: Placement, burden: FloatArray | None = None,
    ) -> Support:
        return Support(rotor.bearings, rotor.shaft_height, self.foundations, self.soil_models,
                       place, burden)

    def _in_order(self, own: _T, others: Sequence[_T]) -> tuple[_T, ...]:
        """Put what is the source's between what is its neighbours'."""
        return (*others[:self.index], own, *others[self.index:])

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
        rotor, standing = modes.receptance(omega), self._joint.standing(omega)
        reach, count = rotor.shapes.shape[1], 2 * len(self.rotor.bearings)
        own, below = self._rows[self.index], loads[reach:]
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
            springs=np.repeat(self.nominal_springs, 2))
        housings = met[..., :count] @ through + met[..., count:]
        forces = pull @ housings
        forces[:, own] = through
        follow = [ports_of @ housings[:, part]
                  for (ports_of, _), part in zip(led, others, strict=True)]
        return gathered(standing, self._in_order(ports, follow), housings, forces, below, pushed,
                        ground)


def _met(receptance: ComplexArray, pull: ComplexArray, free: ComplexArray) -> ComplexArray:
    """Return what neighbours leave of a motion of all housings, (n, 2 b, k), by their pull."""
    try:
        return np.linalg.solve(np.eye(receptance.shape[-1]) - receptance @ pull, free)
    except np.linalg.LinAlgError as error:
        raise NotSolvedError('the coupled system is singular: a resonance without damping is '
                             'hit') from error
