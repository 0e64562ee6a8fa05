"""Every free vibration at a speed, growing and creeping ones too, and how it turns with speed."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from rotorsoil_ros.arrays import ComplexArray, FloatArray
from rotorsoil_ros.ground.continuation import Continuation
from rotorsoil_ros.ground.rational import States
from rotorsoil_ros.machine.coupled import CoupledModel
from rotorsoil_ros.machine.modes.below import sizes
from rotorsoil_ros.machine.modes.spectrum import SpectrumSolver
from rotorsoil_ros.machine.modes.zones import Zone
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

    The unknowns are the rotors' coordinates in forward and backward whirl and their rates, the
    motion z of the support and its rate, the forces p on its massless compliance, and the states
    of that, z = N(w) p; beside it what bends has a stiffness K, so that p = f + (w^2 M - K) z.
    Bearing springs are in units of their nominal ones. Nothing of the support is summed up as in
    `SupportModes`: no step of Newton follows that would make right what grows by very little.

    Attributes
    ----------
    model : CoupledModel
        The machine.
    solver : SpectrumSolver
        Its rotor in few coordinates, and the zones of frequency.
    place : int
        Which of these this pencil is made of; `at` asks the others for what lies in theirs.

    """

    model: CoupledModel
    solver: SpectrumSolver
    place: int = 0

    @classmethod
    def up_to(cls, model: CoupledModel, highest: float) -> 'Pencil':
        """Prepare for vibrations up to a frequency [rad/s], as far as the soil is known."""
        return cls(model, SpectrumSolver.up_to(model, highest))

    @property
    def zone(self) -> Zone:
        """Frequencies in which this pencil holds."""
        return self.solver.zones[self.place]

    @property
    def compliance(self) -> Continuation:
        """Compliance of the support without its mass, where this pencil holds."""
        return self.zone.compliance

    @cached_property
    def _all(self) -> tuple['Pencil', ...]:
        """Pencils of all zones."""
        return tuple(replace(self, place=place) for place in range(len(self.solver.zones)))

    def where(self, speed: float, w: complex) -> 'Pencil':
        """Return the pencil in whose zone a vibration lies, at a rotor speed [rad/s]."""
        def beyond(pencil: 'Pencil') -> float:
            (low,), (high,) = pencil.zone.ends(pencil.zone.owned, np.array([speed]))
            return max(float(low) - w.real, w.real - float(high), 0.0)

        return min(self._all, key=beyond)

    @cached_property
    def _soil(self) -> States:
        return self.compliance.states(_NOISE).beside(
            np.ones(self.model.support.elastic) + 0j)

    @cached_property
    def size(self) -> FloatArray:
        """Typical size of the motions of the support, (s,)."""
        return sizes(self.model.support, self.compliance)

    @cached_property
    def unit(self) -> float:
        """Frequency that makes motions and their rates alike [rad/s]."""
        return 0.25 * self.solver.span[1]

    @cached_property
    def journals(self) -> ComplexArray:
        """Motion of the journals per coordinate of the rotor, (2 b, 2 r)."""
        own = self.solver.shafts.journals
        turned = own[:, None, None, :] * ORBITS.T[None, :, :, None]
        return np.asarray(turned.reshape(2 * own.shape[0], 2 * own.shape[1]))

    @cached_property
    def rows(self) -> FloatArray:
        """Motion of the housings per motion of the support, (2 b, s)."""
        return np.asarray(self._unit_spring[:, None] * self.model.support.motion_rows
                          * self.size)

    @cached_property
    def _unit_spring(self) -> FloatArray:
        """Root of the nominal stiffness along x and z of every bearing, (2 b,)."""
        return np.repeat(np.sqrt(self.solver.shafts.springs), 2)

    @cached_property
    def mass(self) -> FloatArray:
        """Mass of the support, (s, s)."""
        size = self.size
        return np.asarray(size[:, None] * self.model.support.motion_mass * size)

    @cached_property
    def _spring(self) -> ComplexArray:
        """Stiffness of the support beside its compliance, (s, s)."""
        size = self.size
        return np.asarray(size[:, None] * self.model.support.motion_spring * size)

    @cached_property
    def places(self) -> dict[str, slice]:
        """Where in a vector the unknowns lie."""
        rotor, own = self.journals.shape[1], len(self.mass)
        sizes = {'rotor': rotor, 'rotor_rate': rotor, 'support': own, 'support_rate': own,
                 'load': own, 'soil': len(self._soil.poles)}
        ends = np.cumsum(list(sizes.values())).tolist()
        return {name: slice(end - size, end)
                for (name, size), end in zip(sizes.items(), ends, strict=True)}

    def springs(self, speed: FloatArray) -> ComplexArray:
        """Return the terms a, b and c of `Bearings.series` in `unit`, (3, n, 2 b, 2 b)."""
        unit = self._unit_spring
        series = np.array(self.model.all_bearings.series(speed, self.zone.between))
        powers = self.unit ** np.arange(3.0)[:, None, None, None]
        return np.asarray(powers * series / (unit[:, None] * unit))

    @cached_property
    def _memory(self) -> ComplexArray:
        """What of B the inertia of bearings does not make."""
        at, size = self.places, self.places['soil'].stop
        b = np.zeros((size, size), dtype=complex)
        rotor, rate = at['rotor'], at['rotor_rate']
        b[rotor, rate] = self.unit * np.diag(np.tile(self.solver.shafts.mass, 2))
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
        held, rate, _ = self._losses
        polar, _ = self.solver.shafts.gyroscopic()
        a[at['rotor'], at['rotor']] += held
        a[at['rotor'], at['rotor_rate']] += self.unit * (rate + _opposite(polar))
        a[at['rotor_rate'], at['rotor_rate']] = self.unit * np.eye(self.journals.shape[1])
        a[at['load'], at['load']] = np.eye(len(self.mass))
        a[at['load'], at['support']] = self._spring
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
        at, a = self.places, np.zeros_like(self._fixed)
        _, polar = self.solver.shafts.gyroscopic()
        _, _, a[at['rotor'], at['rotor']] = self._losses
        a[at['rotor'], at['rotor_rate']] = self.unit * _opposite(polar)
        return a

    @cached_property
    def _losses(self) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
        return self.solver.shafts.losses(self.zone.middle, self.zone.lag)

    def _bearings(self, series: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
        """Return what bearings of these terms, (3, n, 2 b, 2 b), make of A and of B."""
        a, b = (np.zeros((series.shape[1], *self._fixed.shape), dtype=complex) for _ in range(2))
        self._push(a, series[0], 'rotor', 'support')
        self._push(a, series[1], 'rotor_rate', 'support_rate')
        # w^2 times a motion is w times its rate.
        self._push(b, series[2] / self.unit, 'rotor_rate', 'support_rate')
        return a, b

    def _push(self, matrix: ComplexArray, force: ComplexArray, *moves: str) -> None:
        """Add forces between journals and housings, (n, 2 b, 2 b), that some motions exert."""
        at, gap = self.places, np.concatenate([self.journals, -self.rows], axis=1)
        columns = np.split(force @ gap, [self.journals.shape[1]], axis=2)
        for place, own in zip(moves, columns, strict=True):
            matrix[:, at['rotor'], at[place]] += self.journals.conj().T @ own
            matrix[:, at['load'], at[place]] -= self.rows.T @ own

    def _matrices(self, speed: FloatArray) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
        """Return A, B, and their derivatives by the speed as (A', B'), (n, d, d) each."""
        bearings = self.model.all_bearings.following
        low = max([0.0, *(bearing.speed_range[0] for bearing in bearings)])
        high = min(bearing.speed_range[1] for bearing in bearings)
        step = _STEP * max(float(speed.max()), self.unit)
        left, right = np.maximum(speed - step, low), np.minimum(speed + step, high)
        change = (self.springs(right) - self.springs(left)) / (right - left)[:, None, None]
        a, b = self._bearings(self.springs(speed))
        a_change, b_change = self._bearings(change)
        return (self._fixed + speed[:, None, None] * self._turning + a, self._memory + b,
                np.array([self._turning + a_change, b_change]))

    def at(self, speed: FloatArray) -> list[Vibrations]:
        """Return all vibrations at each of the speeds (n,) [rad/s]."""
        found: list[Vibrations] = []
        for start in range(0, len(speed), _CHUNK):
            parts = [one._at(speed[start:start + _CHUNK]) for one in self._all]
            found += [_joined(same) for same in zip(*parts, strict=True)]
        return found

    def _at(self, speed: FloatArray) -> list[Vibrations]:
        a, b, (a_change, b_change) = self._matrices(speed)
        memory = np.flatnonzero(b.any(axis=(0, 1)))
        low, high = self.zone.ends(self.zone.owned, speed)
        centre = _CENTRE * self.solver.span[1]
        size = len(memory)
        heavier = [b_change] if b_change.any() else []
        both = np.linalg.solve(a - centre * b, np.concatenate(
            [b[..., memory], a_change, *heavier], axis=2))
        spread, moved, *heavier = np.split(both, range(size, both.shape[2], a.shape[1]), axis=2)
        values, vectors = np.linalg.eig(spread[:, memory])
        full = spread @ vectors
        # A y = w B y: w' = left (A' - w B') y / left B y, and 1 / (w - centre) are the values.
        pushed = moved[:, memory] @ full
        for one in heavier:
            w = centre + 1.0 / np.where(values == 0.0, np.inf, values)
            pushed -= one[:, memory] @ (full * w[:, None])
        drift = -np.linalg.solve(vectors, pushed).diagonal(axis1=1, axis2=2)
        found = []
        for row, place in enumerate(speed.tolist()):
            own = np.abs(values[row]) * self.solver.span[1] > 1e-9
            inverse = values[row, own]
            frequency = centre + 1.0 / inverse
            kept = (frequency.real >= low[row]) & (frequency.real < high[row])
            # States of the soil differ from piece to piece, and nobody asks for them.
            shapes = full[row][:self.places['soil'].start, own]
            found.append(Vibrations(place, frequency[kept],
                                    (-drift[row, own] / inverse**2)[kept], shapes[:, kept].T))
        return found

    def part(self, found: Vibrations, index: int, name: str) -> ComplexArray:
        """Return the named unknowns of one vibration."""
        return np.asarray(found.vector[index, self.places[name]])


def _opposite(polar: FloatArray) -> FloatArray:
    """Return gyroscopic couples over forward and backward motions, which they tell apart."""
    return np.asarray(np.kron(np.diag([1.0, -1.0]), polar))


def _joined(parts: tuple[Vibrations, ...]) -> Vibrations:
    """Return the vibrations of all pieces at one speed."""
    return Vibrations(parts[0].speed, *(
        np.concatenate([getattr(part, name) for part in parts])
        for name in ('frequency', 'slope', 'vector')))
