"""What an engineer calls a mode: which body moves, and what bends or gives way for it."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.linalg

from rotorsoil_ros.arrays import ComplexArray, FloatArray, IntArray
from rotorsoil_ros.channel import DOFS
from rotorsoil_ros.machine.coupled import CoupledModel
from rotorsoil_ros.machine.modes.critical import CriticalSpeed
from rotorsoil_ros.rotor.assembly import Rotor
from rotorsoil_ros.rotor.whirl import held

# Motion of a block over (x, y, z, rx, ry, rz): the shaft points along y.
_MOTIONS = dict(zip(DOFS, ('sliding across', 'sliding along', 'heave', 'rocking along',
                           'rocking across', 'turning about the vertical'), strict=True))

_ORDINALS = ('first', 'second', 'third', 'fourth', 'fifth', 'sixth', 'seventh', 'eighth')

# Modes at rest that a shape is held against, and what of 1 / omega^2 means no mass.
_MANY = 40
_MASSLESS = 1e-9


# Cosine from which two rotors move together, and share of the largest from which one takes part.
_TOGETHER, _TAKES_PART = 0.5, 0.5

# Foundation and ground where nothing tells them apart; step of frequency, of itself.
BELOW = 'foundation and ground'
_STEP = 1e-4


@dataclass(frozen=True)
class _Bending:
    """How one rotor bends."""

    rotor: Rotor

    @cached_property
    def _stiffness(self) -> FloatArray:
        """Stiffness of the shaft over the deflections of its nodes, no couples acting, (k, k)."""
        shaft, _, _ = self.rotor.plane_matrices
        deflections, slopes = shaft[::2, ::2], shaft[1::2, 1::2]
        couple = shaft[::2, 1::2]
        return np.asarray(deflections - couple @ scipy.linalg.solve(
            slopes, couple.T, assume_a='pos'))

    @cached_property
    def _at_rest(self) -> tuple[FloatArray, FloatArray]:
        """Mass times shapes of unit mass at rest, (k, m), and their share of bending, (m,)."""
        springs = self.rotor.nominal_springs
        stiffness, mass, _ = held(self.rotor, springs)
        values, shapes = scipy.linalg.eigh(mass, stiffness)
        order = np.argsort(-values)[:_MANY]
        order = order[values[order] > _MASSLESS * values[order[0]]]
        shapes = shapes[:, order]
        held_by = (springs[:, None] * shapes[2 * self.nodes] ** 2).sum(axis=0)
        # Scaled to unit strain energy, what the springs do not hold is bent.
        return (mass @ shapes)[::2] / np.sqrt(values[order]), 1.0 - held_by

    @property
    def nodes(self) -> IntArray:
        """Those of the bearings, (b,)."""
        return np.array([self.rotor.node_of(one.position) for one in self.rotor.bearings])

    def energy(self, deflection: ComplexArray) -> float:
        """Return what a deflection (k, 2) stores in the shaft."""
        return float(np.vdot(deflection, self._stiffness @ deflection).real)

    def order(self, deflection: ComplexArray) -> str:
        """Return the place among bending modes of the mode at rest that is most alike."""
        shapes, share = self._at_rest
        alike = (np.abs(shapes.T @ deflection) ** 2).sum(axis=1) * (share > 0.5)
        best = int(alike.argmax())
        order = int((share[:best] > 0.5).sum())
        return _ORDINALS[order] if order < len(_ORDINALS) else f'number {order + 1}'

    def as_rigid(self, deflection: ComplexArray) -> str:
        """Return whether a rotor that hardly bends moves its ends together or against."""
        across, up = (np.abs(deflection) ** 2).sum(axis=0)
        column = 0 if across >= up else 1
        way = 'across' if column == 0 else 'up and down'
        ends = deflection[[0, -1], column]
        together = float((ends[0] * ends[1].conj()).real) >= 0.0
        return f'rotor {"bouncing" if together else "tilting"} on its bearings, {way}'


@dataclass(frozen=True)
class ModeNames:
    """
    Names of the modes of one machine, or of a plant, by where their strain energy is.

    Attributes
    ----------
    model : CoupledModel
        The machine, alone or among its neighbours.

    """

    model: CoupledModel

    @cached_property
    def _rotors(self) -> list[_Bending]:
        return [_Bending(rotor) for rotor in self.model.rotors]

    def of(
        self, deflections: Sequence[ComplexArray], support: ComplexArray, *, frequency: float,
        speed: float, how: str = '',
    ) -> str:
        """
        Return the name of a mode, in a plant with the machine that it is of.

        Parameters
        ----------
        deflections : sequence of (k, 2) complex arrays
            Over (x, z) of the nodes of every rotor.
        support : (s,) complex array
            Over the columns of `Support.motion_rows`.
        frequency, speed : float
            Of the mode and of the rotor [rad/s].
        how : str
            What to say of it before what moves.

        """
        energies = (self._in_soil(support, frequency) | self._in_pedestals(support)
                    | self._in_foundations(support) | self._in_table(support, frequency))
        of_rotors = {
            'shaft': [own.energy(deflection) for own, deflection in zip(
                self._rotors, deflections, strict=True)],
            'bearings': self._in_bearings(deflections, support, speed, frequency)}
        energies |= {kind: sum(each) for kind, each in of_rotors.items()}
        # All springs of one block together, so that coupled sliding and rocking are one body.
        bodies: dict[str, float] = {}
        for place, energy in energies.items():
            body = place.partition(' ')[0] if place in self._dofs else place
            bodies[body] = bodies.get(body, 0.0) + energy
        body = max(bodies, key=lambda name: bodies[name])
        if body in of_rotors:
            most = int(np.argmax(of_rotors[body]))
            own, deflection = self._rotors[most], deflections[most]
            return self._owners(of_rotors[body], deflections) + how + (
                f'shaft bending, {own.order(deflection)}' if body == 'shaft'
                else own.as_rigid(deflection))
        motions = {place: energy for place, energy in energies.items()
                   if place in self._dofs and place.partition(' ')[0] == body}
        return how + (max(motions, key=lambda place: motions[place]) if motions else body)

    def of_critical(self, critical: CriticalSpeed) -> str:
        """Return the name of the mode at a critical speed."""
        deflections = self.model.in_order(
            critical.deflection, [deflection for deflection, _ in critical.beside])
        return self.of(deflections, critical.support, frequency=critical.speed,
                       speed=critical.speed)

    def _owners(self, energy: Sequence[float], deflections: Sequence[ComplexArray]) -> str:
        """Return whose mode it is, and how two of them go together; nothing of one alone."""
        if len(self.model.machines) == 1:
            return ''
        part = [index for index, own in enumerate(energy) if own >= _TAKES_PART * max(energy)]
        names = [self.model.machines[index] for index in part]
        if len(part) != 2:
            return f'{", ".join(names)}: '
        one, other = (self._largest_motion(index, deflections[index]) for index in part)
        alike = np.vdot(one, other).real / (np.linalg.norm(one) * np.linalg.norm(other))
        how = (f'{names[0]} and {names[1]}', f'{names[0]} and {names[1]} together',
               f'{names[0]} against {names[1]}')
        return f'{how[0 if abs(alike) < _TOGETHER else 1 if alike > 0.0 else 2]}: '

    def _largest_motion(self, index: int, deflection: ComplexArray) -> ComplexArray:
        """Return the motion of the node of a rotor that moves most, in the axes of the ground."""
        first = sum(len(rotor.bearings) for rotor in self.model.rotors[:index])
        largest = deflection[(np.abs(deflection) ** 2).sum(axis=1).argmax()]
        return np.asarray(largest @ self.model.support.mounts[first].axes)

    @cached_property
    def _dofs(self) -> frozenset[str]:
        return frozenset(f'{block.name} {motion}' for block in self.model.foundations
                         for motion in _MOTIONS.values())

    def _in_soil(self, support: ComplexArray, frequency: float) -> dict[str, float]:
        """Return the energy that the soil stores by each motion of each block."""
        found = {}
        ends = np.cumsum([0, *(len(part.contacts) for part in self.model.support.members)])
        gives = np.abs(np.diagonal(self.model.support.ground(np.array([frequency]))[0]))
        for block, part, first in zip(
                self.model.foundations, self.model.support.members, ends.tolist(), strict=False):
            own = slice(first, first + len(part.contacts))
            # Of patches: what their mean motion would store, and the rest is bending.
            stores = np.divide(1.0, gives[own], out=np.zeros(len(part.contacts)),
                               where=gives[own] > 0.0)
            mean = part.mean @ support[own]
            rigid = np.abs(part.rows[part.places[1]] * mean) ** 2
            for dof, energy in zip(DOFS, (stores @ rigid).tolist(), strict=True):
                if energy > 0.0:
                    found[f'{block.name} {_MOTIONS[dof]}'] = energy
        return found

    def _in_foundations(self, support: ComplexArray) -> dict[str, float]:
        """Return the energy that each foundation stores by bending."""
        found, below = {}, self.model.support
        for block, spring in zip(self.model.foundations, below.bent_springs, strict=False):
            if block.body is not None:
                found[f'{block.name} bending'] = float(
                    np.vdot(support, spring.real @ support).real)
        return found

    def _in_table(self, support: ComplexArray, frequency: float) -> dict[str, float]:
        """
        Return the energy that foundation and ground store where receptances tell of both.

        Of a dynamic stiffness S that masses and springs make up, x^H (S - w S' / 2) x is what the
        springs store.
        """
        table = self.model.support.table
        if table is None:
            return {}
        low, high = table.omega[[0, -1]]
        omega = np.clip(frequency, (1.0 + _STEP) * low, (1.0 - _STEP) * high) * np.array(
            [1.0 - _STEP, 1.0 + _STEP])
        moving = np.flatnonzero(table.values.any(axis=(0, 1)))
        motion, gives = support[moving], table.compliance(omega)[:, moving[:, None], moving]
        force = np.linalg.solve(gives, np.broadcast_to(motion[:, None], (2, len(moving), 1)))
        below, above = (motion.conj() @ force[..., 0].T).real.tolist()
        slope = (above - below) / (2.0 * _STEP)
        return {BELOW: abs(0.5 * (below + above) - 0.5 * slope)}

    def _in_pedestals(self, support: ComplexArray) -> dict[str, float]:
        found, place = {}, self.model.support.contacts
        for bearing in self.model.all_bearings.each:
            if bearing.pedestal is not None:
                pair = support[place:place + 2]
                sideways = abs(pair[0]) >= abs(pair[1])
                found[f'pedestal of {bearing.name} {"across" if sideways else "up and down"}'] = (
                    abs(float(np.vdot(pair, bearing.pedestal.stiffness @ pair).real)))
                place += 2
        return found

    def _in_bearings(
        self, deflections: Sequence[ComplexArray], support: ComplexArray, speed: float,
        frequency: float,
    ) -> list[float]:
        """Return the energy in the bearings of every rotor."""
        journals = [deflection[own.nodes].ravel() for own, deflection in zip(
            self._rotors, deflections, strict=True)]
        gap = np.concatenate(journals) - self.model.support.motion_rows @ support
        bearings = self.model.all_bearings
        stiffness, _, _ = bearings.coefficients(
            np.array([speed]), np.clip([frequency], *bearings.frequency_range))
        stored = (gap.conj() * (stiffness[0] @ gap)).real
        ends = np.cumsum([len(own) for own in journals])[:-1]
        return [abs(float(own.sum())) for own in np.split(stored, ends)]
