"""Every free vibration at a speed, growing and creeping ones too, and how it turns with speed."""

from dataclasses import dataclass, replace
from functools import cached_property
import math

import numpy as np

from rotorsoil_ros.arrays import ComplexArray, FloatArray
from rotorsoil_ros.ground.rational import Continuation, States
from rotorsoil_ros.machine.coupled import CoupledModel
from rotorsoil_ros.machine.modes.spectrum import SpectrumSolver
from rotorsoil_ros.rotor.whirl import ORBITS

# Poles of the soil that weigh less than this are noise of their fit: each would be a mode.
_NOISE = 1e-4

# Eigenvalues are found by their inverse distance from this share of the highest frequency, which
# is no mode's: one that grows so fast is none of a machine that runs.
_CENTRE = 0.0137 - 0.11j

# Share of a speed by which it is moved to see how the tables of bearings change.
_STEP = 1e-6

# Speeds solved together: bounds memory.
_CHUNK = 8


@dataclass(frozen=True)
class Vibrations:
    """
    Free vibrations at one speed.

    Attributes
    ----------
    speed : float
        Of the rotor [rad/s].
    frequency, slope : (m,) complex arrays
        w = lambda / i [rad/s], damped frequency + i decay, and its change with the speed [-].
    vector : (m, d) complex array
        Unknowns of `Pencil` but the states of the soil, a row for each.

    """

    speed: float
    frequency: ComplexArray
    slope: ComplexArray
    vector: ComplexArray


@dataclass(frozen=True)
class Pencil:
    """
    Linear eigenproblem A(speed) y = w B y, in coordinates that do not turn with the speed.

    The unknowns are the rotor's coordinates in forward and backward whirl and their rates, the
    motion z of the support and its rate, the forces p on the massless support, and the states of
    its compliance, z = N(w) p. Bearing springs are in units of their nominal ones.

    Attributes
    ----------
    model : CoupledModel
        The machine.
    solver : SpectrumSolver
        Its rotor in few coordinates, and the compliance of its support, continued by pieces.
    piece : int
        Which of these this pencil is made of; `at` asks the others for what lies in theirs.

    """

    model: CoupledModel
    solver: SpectrumSolver
    piece: int = 0

    @classmethod
    def up_to(cls, model: CoupledModel, highest: float) -> 'Pencil':
        """Prepare for vibrations up to a frequency [rad/s], as far as the soil is known."""
        return cls(model, SpectrumSolver.up_to(model, highest))

    @property
    def compliance(self) -> Continuation:
        """Compliance of the support without its mass, where this pencil holds."""
        return self.solver.pieces[self.piece]

    @cached_property
    def _all(self) -> tuple['Pencil', ...]:
        """Pencils between all branch points of the soil."""
        return tuple(replace(self, piece=piece) for piece in range(len(self.solver.pieces)))

    @cached_property
    def _within(self) -> tuple[float, float]:
        """Frequencies up to the next pencil's [rad/s]; what creeps belongs to the first."""
        pieces = self.solver.pieces
        return (-math.inf if self.piece == 0 else self.compliance.span[0],
                math.inf if self.piece + 1 == len(pieces) else pieces[self.piece + 1].span[0])

    @cached_property
    def _soil(self) -> States:
        return self.compliance.states(_NOISE)

    @cached_property
    def unit(self) -> float:
        """Frequency that makes motions and their rates alike [rad/s]."""
        return 0.25 * self.solver.span[1]

    @cached_property
    def journals(self) -> ComplexArray:
        """Motion of the journals per coordinate of the rotor, (2 b, 2 r)."""
        model, basis = self.model, self.solver.basis
        rows = [2 * model.rotor.node_of(bearing.position) for bearing in model.rotor.bearings]
        own = np.sqrt(model.nominal_springs)[:, None] * basis.shapes[rows]
        turned = own[:, None, None, :] * ORBITS.T[None, :, :, None]
        return np.asarray(turned.reshape(2 * len(rows), 2 * len(basis.mass)))

    @cached_property
    def rows(self) -> FloatArray:
        """Motion of the housings per motion of the support, (2 b, s)."""
        unit = np.repeat(np.sqrt(self.model.nominal_springs), 2)
        return np.asarray(unit[:, None] * self.model.support.motion_rows
                          * self.compliance.size)

    @cached_property
    def mass(self) -> FloatArray:
        """Mass of the support, (s, s)."""
        size = self.compliance.size
        return np.asarray(size[:, None] * self.model.support.motion_mass * size)

    @cached_property
    def places(self) -> dict[str, slice]:
        """Where in a vector the unknowns lie."""
        rotor, own = self.journals.shape[1], len(self.mass)
        sizes = {'rotor': rotor, 'rotor_rate': rotor, 'support': own, 'support_rate': own,
                 'load': own, 'soil': len(self._soil.poles)}
        ends = np.cumsum(list(sizes.values())).tolist()
        return {name: slice(end - size, end)
                for (name, size), end in zip(sizes.items(), ends, strict=True)}

    def springs(self, speed: FloatArray) -> tuple[ComplexArray, ComplexArray]:
        """Return stiffness and i times damping per `unit` of the bearings, (n, 2 b, 2 b)."""
        unit = np.repeat(np.sqrt(self.model.nominal_springs), 2)
        stiffness, damping = self.model.bearing_coefficients(speed)
        scale = unit[:, None] * unit
        return stiffness / scale + 0j, 1j * self.unit * damping / scale

    @cached_property
    def _memory(self) -> ComplexArray:
        """B, the same at every speed."""
        at, size = self.places, self.places['soil'].stop
        b = np.zeros((size, size), dtype=complex)
        rotor, rate = at['rotor'], at['rotor_rate']
        b[rotor, rate] = self.unit * np.diag(np.tile(self.solver.basis.mass, 2))
        b[rate, rotor] = np.eye(rate.stop - rate.start)
        b[at['load'], at['support_rate']] = self.unit * self.mass
        b[at['support_rate'], at['support']] = np.eye(len(self.mass))
        b[at['soil'], at['soil']] = np.eye(len(self._soil.poles))
        return b

    @cached_property
    def _fixed(self) -> ComplexArray:
        """What of A neither bearings nor gyroscopic couples make."""
        at, size, soil = self.places, self.places['soil'].stop, self._soil
        a = np.zeros((size, size), dtype=complex)
        a[at['rotor'], at['rotor']] = (np.eye(self.journals.shape[1])
                                       - self.journals.conj().T @ self.journals)
        a[at['rotor_rate'], at['rotor_rate']] = self.unit * np.eye(self.journals.shape[1])
        a[at['load'], at['load']] = np.eye(len(self.mass))
        a[at['support_rate'], at['support_rate']] = self.unit * np.eye(len(self.mass))
        # The rows of the motion stand behind those of its rate: z - N p = 0.
        a[at['support'], at['support']] = np.eye(len(self.mass))
        a[at['support'], at['load']] = -soil.constant
        a[at['support'], at['soil']] = -soil.left
        a[at['soil'], at['load']] = soil.right
        a[at['soil'], at['soil']] = np.diag(soil.poles)
        return a

    @cached_property
    def _turning(self) -> ComplexArray:
        """Gyroscopic part of A per speed."""
        at, polar = self.places, self.solver.basis.polar
        a = np.zeros_like(self._fixed)
        a[at['rotor'], at['rotor_rate']] = self.unit * np.kron(np.diag([1.0, -1.0]), polar)
        return a

    def _bearings(self, stiffness: ComplexArray, rates: ComplexArray) -> ComplexArray:
        """Return what bearings of these coefficients, (n, 2 b, 2 b) each, make of A."""
        at, gap = self.places, np.concatenate([self.journals, -self.rows], axis=1)
        a = np.zeros((len(stiffness), *self._fixed.shape), dtype=complex)
        for matrix, moves in ((stiffness, ('rotor', 'support')),
                              (rates, ('rotor_rate', 'support_rate'))):
            through = matrix @ gap
            for place, columns in zip(moves, np.split(through, [self.journals.shape[1]], axis=2),
                                      strict=True):
                a[:, at['rotor'], at[place]] += self.journals.conj().T @ columns
                a[:, at['load'], at[place]] -= self.rows.T @ columns
        return a

    def _matrices(self, speed: FloatArray) -> tuple[ComplexArray, ComplexArray]:
        """Return A and its derivative by the speed, (n, d, d) each."""
        bearings = self.model.rotor.bearings
        low = max([0.0, *(bearing.speed_range[0] for bearing in bearings)])
        high = min(bearing.speed_range[1] for bearing in bearings)
        step = _STEP * max(float(speed.max()), self.unit)
        left, right = np.maximum(speed - step, low), np.minimum(speed + step, high)
        before, after = self.springs(left), self.springs(right)
        wide = (right - left)[:, None, None]
        a = (self._fixed + speed[:, None, None] * self._turning
             + self._bearings(*self.springs(speed)))
        changes = [(late - early) / wide for early, late in zip(before, after, strict=True)]
        return a, self._turning + self._bearings(changes[0], changes[1])

    def at(self, speed: FloatArray) -> list[Vibrations]:
        """Return all vibrations at each of the speeds (n,) [rad/s]."""
        found: list[Vibrations] = []
        for start in range(0, len(speed), _CHUNK):
            parts = [one._at(speed[start:start + _CHUNK]) for one in self._all]
            found += [_joined(same) for same in zip(*parts, strict=True)]
        return found

    def _at(self, speed: FloatArray) -> list[Vibrations]:
        a, change = self._matrices(speed)
        b = self._memory
        memory = np.flatnonzero(b.any(axis=0))
        centre = _CENTRE * self.solver.span[1]
        right = np.concatenate([np.broadcast_to(b[:, memory], (*a.shape[:2], len(memory))),
                                change], axis=2)
        both = np.linalg.solve(a - centre * b, right)
        spread, moved = both[..., :len(memory)], both[..., len(memory):]
        values, vectors = np.linalg.eig(spread[:, memory])
        full = spread @ vectors
        along = -np.linalg.solve(vectors, moved[:, memory] @ full)
        drift = along.diagonal(axis1=1, axis2=2)
        found = []
        for row, place in enumerate(speed.tolist()):
            own = np.abs(values[row]) * self.solver.span[1] > 1e-9
            inverse = values[row, own]
            frequency = centre + 1.0 / inverse
            kept = (frequency.real >= self._within[0]) & (frequency.real < self._within[1])
            # States of the soil differ from piece to piece, and nobody asks for them.
            shapes = full[row][:self.places['soil'].start, own]
            found.append(Vibrations(place, frequency[kept],
                                    (-drift[row, own] / inverse**2)[kept], shapes[:, kept].T))
        return found

    def part(self, found: Vibrations, index: int, name: str) -> ComplexArray:
        """Return the named unknowns of one vibration."""
        return np.asarray(found.vector[index, self.places[name]])


def _joined(parts: tuple[Vibrations, ...]) -> Vibrations:
    """Return the vibrations of all pieces at one speed."""
    return Vibrations(parts[0].speed, *(
        np.concatenate([getattr(part, name) for part in parts])
        for name in ('frequency', 'slope', 'vector')))
