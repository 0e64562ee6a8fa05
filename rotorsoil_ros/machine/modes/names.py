"""What an engineer calls a mode: which body moves, and what bends or gives way for it."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.linalg

from rotorsoil_ros.arrays import ComplexArray, FloatArray
from rotorsoil_ros.channel import DOFS
from rotorsoil_ros.machine.coupled import CoupledModel
from rotorsoil_ros.machine.modes.critical import CriticalSpeed
from rotorsoil_ros.rotor.whirl import held

# Motion of a block over (x, y, z, rx, ry, rz): the shaft points along y.
_MOTIONS = dict(zip(DOFS, ('sliding across', 'sliding along', 'heave', 'rocking along',
                           'rocking across', 'turning about the vertical'), strict=True))

_ORDINALS = ('first', 'second', 'third', 'fourth', 'fifth', 'sixth', 'seventh', 'eighth')

# Modes at rest that a shape is held against, and what of 1 / omega^2 means no mass.
_MANY = 40
_MASSLESS = 1e-9


@dataclass(frozen=True)
class ModeNames:
    """
    Names of the modes of one machine, by where their strain energy is.

    Attributes
    ----------
    model : CoupledModel
        The machine.

    """

    model: CoupledModel

    @cached_property
    def _bending(self) -> FloatArray:
        """Stiffness of the shaft over the deflections of its nodes, no couples acting, (k, k)."""
        shaft, _, _ = self.model.rotor.plane_matrices
        deflections, slopes = shaft[::2, ::2], shaft[1::2, 1::2]
        couple = shaft[::2, 1::2]
        return np.asarray(deflections - couple @ scipy.linalg.solve(
            slopes, couple.T, assume_a='pos'))

    @cached_property
    def _at_rest(self) -> tuple[FloatArray, FloatArray]:
        """Mass times shapes of unit mass at rest, (k, m), and their share of bending, (m,)."""
        stiffness, mass, _ = held(self.model.rotor, self.model.nominal_springs)
        values, shapes = scipy.linalg.eigh(mass, stiffness)
        order = np.argsort(-values)[:_MANY]
        order = order[values[order] > _MASSLESS * values[order[0]]]
        shapes = shapes[:, order]
        rows = [2 * self.model.rotor.node_of(one.position) for one in self.model.rotor.bearings]
        held_by = (self.model.nominal_springs[:, None] * shapes[rows] ** 2).sum(axis=0)
        # Scaled to unit strain energy, what the springs do not hold is bent.
        return (mass @ shapes)[::2] / np.sqrt(values[order]), 1.0 - held_by

    def of(
        self, deflection: ComplexArray, support: ComplexArray, *, frequency: float, speed: float,
    ) -> str:
        """
        Return the name of a mode.

        Parameters
        ----------
        deflection : (k, 2) complex array
            Over (x, z) of the rotor's nodes.
        support : (s,) complex array
            Over the columns of `Support.motion_rows`.
        frequency, speed : float
            Of the mode and of the rotor [rad/s].

        """
        energies = (self._in_soil(support, frequency) | self._in_pedestals(support)
                    | self._in_foundations(support))
        energies['shaft'] = float(np.vdot(deflection, self._bending @ deflection).real)
        energies['bearings'] = self._in_bearings(deflection, support, speed, frequency)
        # All springs of one block together, so that coupled sliding and rocking are one body.
        bodies: dict[str, float] = {}
        for place, energy in energies.items():
            body = place.partition(' ')[0] if place in self._dofs else place
            bodies[body] = bodies.get(body, 0.0) + energy
        body = max(bodies, key=lambda name: bodies[name])
        if body == 'shaft':
            return f'shaft bending, {self._order(deflection)}'
        if body == 'bearings':
            return self._on_bearings(deflection)
        motions = {place: energy for place, energy in energies.items()
                   if place in self._dofs and place.partition(' ')[0] == body}
        return max(motions, key=lambda place: motions[place]) if motions else body

    def of_critical(self, critical: CriticalSpeed) -> str:
        """Return the name of the mode at a critical speed."""
        return self.of(critical.deflection, critical.support, frequency=critical.speed,
                       speed=critical.speed)

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
        for block, own in zip(self.model.foundations, below.motions, strict=True):
            if block.body is not None:
                part = support[own]
                spring = below.motion_spring[np.ix_(own, own)].real
                elastic = part[own >= below.contacts]
                found[f'{block.name} bending'] = float(
                    np.vdot(part, spring @ part).real + np.vdot(elastic, elastic).real)
        return found

    def _in_pedestals(self, support: ComplexArray) -> dict[str, float]:
        found, place = {}, self.model.support.contacts
        for bearing in self.model.rotor.bearings:
            if bearing.pedestal is not None:
                pair = support[place:place + 2]
                sideways = abs(pair[0]) >= abs(pair[1])
                found[f'pedestal of {bearing.name} {"across" if sideways else "up and down"}'] = (
                    abs(float(np.vdot(pair, bearing.pedestal.stiffness @ pair).real)))
                place += 2
        return found

    def _in_bearings(
        self, deflection: ComplexArray, support: ComplexArray, speed: float, frequency: float,
    ) -> float:
        rotor = self.model.rotor
        nodes = [rotor.node_of(bearing.position) for bearing in rotor.bearings]
        gap = deflection[nodes].ravel() - self.model.support.motion_rows @ support
        stiffness, _, _ = self.model.bearings.coefficients(
            np.array([speed]), np.clip([frequency], *self.model.bearings.frequency_range))
        return abs(float(np.vdot(gap, stiffness[0] @ gap).real))

    def _order(self, deflection: ComplexArray) -> str:
        """Return the place among bending modes of the mode at rest that is most alike."""
        shapes, share = self._at_rest
        alike = (np.abs(shapes.T @ deflection) ** 2).sum(axis=1) * (share > 0.5)
        best = int(alike.argmax())
        order = int((share[:best] > 0.5).sum())
        return _ORDINALS[order] if order < len(_ORDINALS) else f'number {order + 1}'

    def _on_bearings(self, deflection: ComplexArray) -> str:
        """Return whether a rotor that hardly bends moves its ends together or against."""
        across, up = (np.abs(deflection) ** 2).sum(axis=0)
        column = 0 if across >= up else 1
        way = 'across' if column == 0 else 'up and down'
        ends = deflection[[0, -1], column]
        together = float((ends[0] * ends[1].conj()).real) >= 0.0
        return f'rotor {"bouncing" if together else "tilting"} on its bearings, {way}'
