"""What the machine answers at any speed, without solving again."""

from dataclasses import dataclass, field, replace
from functools import partial
import math

import numpy as np

from rotorsoil_ros.arrays import BoolArray, ComplexArray, FloatArray
from rotorsoil_ros.channel import Channel
from rotorsoil_ros.errors import NotSolvedError, OutOfTableError, RotorSoilError
from rotorsoil_ros.machine.coupled import CoupledModel
from rotorsoil_ros.machine.modes.stability import Stability, stability
from rotorsoil_ros.machine.pieces import DEGREE, evaluate, evaluate_one, Pieces, refine, summed
from rotorsoil_ros.machine.transient.poles import Poles, poles_of
from rotorsoil_ros.machine.transient.state import Struck
from rotorsoil_ros.prediction import Prediction
from rotorsoil_ros.units import rad_s_to_rpm

__all__ = ['TOLERANCE', 'Prediction', 'Predictor', 'ResponseTable']

# Relative to the local amplitude, at the points checked while refining; ten times sharper than
# what is promised at any speed.
TOLERANCE = 1e-5

# Pieces before the first refinement.
_FIRST_PIECES = 32

# Samples evaluated together: many share a piece, and they stay in the processor's cache.
_BLOCK = 16384

# Unseen speeds at which a finished table is compared with the exact solution.
_CHECKS = 200


# Pieces that a machine with some resonances ends with.
_USUAL_PIECES = 100


def bytes_needed(model: CoupledModel) -> int:
    """Return what the response table of a machine takes, roughly [bytes]."""
    return 16 * _USUAL_PIECES * (DEGREE + 1) * len(model.planes) * len(model.groups)


@dataclass(frozen=True)
class ResponseTable:
    """
    Response per unit unbalance of each plane, as complex polynomials between speeds.

    Between two neighbouring edges every channel is a polynomial of the speed, complex as the
    response itself; the edges crowd where the machine resonates.

    Attributes
    ----------
    channels : tuple of Channel
        The motions.
    planes : tuple of str
        Names of the unbalance planes.
    transmits_force : (c,) bool array
        Which channels have a force.
    pieces : Pieces
        Edges [rad/s] and coefficients over (planes, channels then forces), per kg m and per
        squared speed.
    accuracy : float
        Largest deviation from the exact solution at speeds that the refinement has not seen,
        relative to the local amplitude; NaN where nothing is answered.
    stability : Stability
        Where a mode grows on its own: no piece is resolved there, as there is no steady response.
    key : str
        What identifies the computation in the cache; empty if it was not cached.
    poles : Poles
        Free vibrations that a changing speed strikes.

    """

    channels: tuple[Channel, ...]
    planes: tuple[str, ...]
    transmits_force: BoolArray
    pieces: Pieces
    accuracy: float
    stability: Stability
    key: str = ''
    poles: Poles = field(default_factory=partial(Poles.none, 'nobody has looked for them'))

    @classmethod
    def build(
        cls, model: CoupledModel, speed_range: tuple[float, float], *,
        tolerance: float = TOLERANCE,
    ) -> 'ResponseTable':
        """
        Solve the coupled system over a range of speeds until it can be interpolated.

        Parameters
        ----------
        model : CoupledModel
            The machine.
        speed_range : tuple of two floats
            Lowest and highest speed [rad/s].
        tolerance : float
            Relative to the local amplitude of each channel.

        Raises
        ------
        NotSolvedError
            If nothing can be resolved of speeds at which the machine is stable.

        """
        low, high = speed_range
        if not 0.0 <= low < high < np.inf:
            raise RotorSoilError(f'speed range must be 0 <= low < high in rad/s, got '
                                 f'{low:g} to {high:g}')
        planes = len(model.planes)
        forces = model.plane_forces
        # Unbalance turns forward only. Forces along x and along z alone also see the backward
        # resonances, of which unbalance may show a narrow trace.
        acts = np.abs(forces.reshape(len(forces) // 2, 2, planes)) > 0.0
        single = [(acts * axis[:, None]).reshape(forces.shape) for axis in np.eye(2)]
        loads = np.concatenate([forces, *single], axis=1)

        def solve(speed: FloatArray) -> tuple[ComplexArray, ComplexArray]:
            displacement, force = model.synchronous_response(speed, loads)
            rows = np.concatenate([displacement, force[:, model.transmits_force]], axis=1)
            columns = rows.transpose(0, 2, 1)
            return columns[:, :planes], columns[:, planes:]

        # Before the response: where a mode grows on its own there is none to be refined.
        growth = growth_of(model, high)
        nothing = np.zeros((0, DEGREE + 1, planes, len(model.groups)), dtype=complex)
        parts = [Pieces(np.zeros(0), np.zeros(0, dtype=bool), nothing)]
        for left, right in _stable_ranges(growth, low, high):
            first = np.unique(np.append(np.linspace(low, high, _FIRST_PIECES + 1), [left, right]))
            edges = first[(first >= left) & (first <= right)]
            parts.append(refine(solve, edges, groups=model.groups, tolerance=tolerance,
                                columns=3 * planes))
        pieces = Pieces.joined(parts, (low, high))
        if len(parts) > 1 and not np.any(pieces.resolved):
            raise NotSolvedError('no part of the speed range could be interpolated')
        table = cls(model.channels, model.planes, model.transmits_force, pieces, np.nan, growth)
        return replace(table, accuracy=table.measure(model),
                       poles=poles_of(model, speed_range, growth, dense=pieces.edges))

    @property
    def speed_range(self) -> tuple[float, float]:
        """Lowest and highest speed [rad/s]."""
        return float(self.pieces.edges[0]), float(self.pieces.edges[-1])

    @property
    def gaps(self) -> FloatArray:
        """Intervals too close to an undamped resonance to be resolved, (g, 2) [rad/s]."""
        edges = np.stack([self.pieces.edges[:-1], self.pieces.edges[1:]], axis=1)
        return edges[~self.pieces.resolved & self.stability.holds(edges.mean(axis=1))]

    def predictor(self, unbalance: ComplexArray) -> 'Predictor':
        """
        Weight the planes with their unbalance.

        Parameters
        ----------
        unbalance : (p,) complex array
            moment * exp(i phase) of every plane [kg m].

        """
        unbalance = np.asarray(unbalance, dtype=complex)
        if unbalance.shape != (len(self.planes),) or not np.all(np.isfinite(unbalance)):
            raise RotorSoilError(f'unbalance must be {len(self.planes)} finite complex moments '
                                 f'in kg m, got {unbalance}')
        weighted = np.einsum('kdpc,p->kdc', self.pieces.coefficients, unbalance)
        moving = len(self.channels)
        # NaN where no force is transmitted: it stays NaN in every sum, at no further cost.
        vectors = np.full((*weighted.shape[:2], 2 * moving), complex(np.nan, np.nan))
        vectors[..., :moving] = weighted[..., :moving]
        vectors[..., moving:][..., self.transmits_force] = weighted[..., moving:]
        return Predictor(self, np.concatenate([vectors.real, vectors.imag], axis=-1),
                         self._strength(unbalance))

    def _strength(self, unbalance: ComplexArray) -> FloatArray:
        """Return what the real and the imaginary part of each deviation does, (2 k, 4 c)."""
        if not len(self.poles):
            return np.zeros((0, 4 * len(self.channels)))
        weighted = np.einsum('kpw,p->kw', self.poles.strength, unbalance)
        moving = len(self.channels)
        vectors = np.zeros((len(weighted), 2 * moving), dtype=complex)
        vectors[:, :moving] = weighted[:, :moving]
        vectors[:, moving:][:, self.transmits_force] = weighted[:, moving:]
        # Of a weight its real part and then its imaginary one, as they lie in memory.
        both = np.stack([vectors, 1j * vectors], axis=1).reshape(-1, 2 * moving)
        return np.concatenate([both.real, both.imag], axis=1)

    def measure(self, model: CoupledModel) -> float:
        """Return the largest deviation from the exact solution at speeds not yet seen."""
        low, high = self.speed_range
        random = np.random.default_rng(len(self.pieces.resolved))
        inner = random.integers(len(self.pieces.resolved), size=_CHECKS)
        edges, share = self.pieces.edges, random.uniform(size=2 * _CHECKS)
        speed = np.concatenate([
            low + (high - low) * share[:_CHECKS],
            edges[inner] + (edges[inner + 1] - edges[inner]) * share[_CHECKS:]])
        worst = 0.0 if np.any(self.pieces.resolved) else math.nan
        speed = speed[self.pieces.find(speed) >= 0]
        for plane in np.eye(len(self.planes), dtype=complex):
            predictor = self.predictor(plane)
            exact = model.unbalance_response(speed, plane)
            deviation = predictor.predict(speed).displacement - exact.displacement
            size = np.abs(exact.displacement)
            # Channels that do not move at all carry nothing but round-off.
            floor = 1e-9 * size.max(axis=1, keepdims=True, initial=0.0) + np.finfo(float).tiny
            worst = max(worst, float((np.abs(deviation) / np.maximum(size, floor)).max(
                initial=0.0)))
        return worst

    def to_arrays(self) -> dict[str, np.ndarray]:
        """Return everything but the key and the channels as plain arrays."""
        return {
            'planes': np.array(self.planes),
            'transmits_force': self.transmits_force, 'edges': self.pieces.edges,
            'resolved': self.pieces.resolved, 'coefficients': self.pieces.coefficients,
            'accuracy': np.array(self.accuracy),
            'stability': np.array(self.stability.to_json()),
            **self.poles.to_arrays(),
        }

    @classmethod
    def from_arrays(
        cls, arrays: dict[str, np.ndarray], channels: tuple[Channel, ...],
    ) -> 'ResponseTable':
        """Rebuild a table from `to_arrays` and the channels of its model."""
        return cls(
            channels,
            tuple(str(name) for name in arrays['planes']),
            arrays['transmits_force'],
            Pieces(arrays['edges'], arrays['resolved'], arrays['coefficients']),
            float(arrays['accuracy']), Stability.from_json(str(arrays['stability'])),
            poles=Poles.from_arrays(arrays))


def growth_of(model: CoupledModel, high: float) -> Stability:
    """Return where a mode grows, from rest to a speed; what cannot be told is a doubt."""
    try:
        return stability(model, (0.0, high))
    except NotSolvedError as error:
        return Stability((0.0, high), (), math.nan, doubt=str(error))


def _stable_ranges(
    growth: Stability, low: float, high: float,
) -> list[tuple[float, float]]:
    """Return the parts of a range of speeds [rad/s] in which no mode grows."""
    ends = np.clip(np.concatenate([[low], growth.unstable.ravel(), [high]]), low, high)
    return [(left, right) for left, right in ends.reshape(-1, 2).tolist() if left < right]


@dataclass(frozen=True)
class Predictor:
    """
    Response table under one state of unbalance.

    Attributes
    ----------
    table : ResponseTable
        What is looked up.
    coefficients : (k, degree + 1, 4 c) float array
        Real parts of all channels and of all forces, then their imaginary parts.
    strength : (2 m, 4 c) float array
        What the real and the imaginary part of each of m deviations does to the same.

    """

    table: ResponseTable
    coefficients: FloatArray
    strength: FloatArray

    @property
    def channels(self) -> tuple[Channel, ...]:
        """The motions."""
        return self.table.channels

    def covers(self, speed: FloatArray) -> BoolArray:
        """Return whether each speed, (n,) [rad/s], can be answered; NaN cannot."""
        return self.table.pieces.find(speed) >= 0

    def predict(self, speed: FloatArray) -> Prediction:
        """
        Look up the response.

        Parameters
        ----------
        speed : (n,) float array
            Rotor speed [rad/s].

        Returns
        -------
        Prediction
            The same numbers, to the last bit, however the speeds are divided into calls.

        Raises
        ------
        OutOfTableError
            If a speed is not covered.

        """
        speed = np.asarray(speed, dtype=float)
        # A single one is what the live node asks, message by message.
        rows = self._row(float(speed[0])) if len(speed) == 1 else self._rows(speed)
        return Prediction.of_parts(speed, rows.reshape(len(speed), 2, 2, len(self.channels)))

    def answer(self, speed: FloatArray) -> Prediction:
        """Look up the response, NaN where a speed, (n,) [rad/s], is not covered."""
        speed = np.asarray(speed, dtype=float)
        parts = np.full((len(speed), 2, 2, len(self.channels)), np.nan)
        covered = self.covers(speed)
        if covered.any():
            parts[covered] = self.predict(speed[covered]).parts
        return Prediction.of_parts(speed, parts)

    def moved(self, steady: Prediction, struck: Struck | None) -> Prediction:
        """
        Return a steady response with what a changing speed adds to it.

        Parameters
        ----------
        steady : Prediction
            Of n speeds.
        struck : Struck or None
            What rings at some of them, as `Transient` tells it.

        Returns
        -------
        Prediction
            The same numbers, to the last bit, however the speeds are divided into calls.

        """
        if struck is None:
            return steady
        rows, count = struck.rows, len(self.channels)
        # Real and imaginary parts in the order of `strength`, (2 k, 2 m): of all d, then of A d.
        numbers = np.concatenate([struck.away, struck.share]).view(float).T
        away, changing = summed(np.ascontiguousarray(numbers), self.strength).reshape(
            2, -1, 2, 2, count)
        if len(rows) == len(steady.speed):
            parts = moved = steady.parts + away
            turning = steady.speed[:, None]
        else:
            parts, turning = steady.parts.copy(), steady.speed[rows, None]
            parts[rows] = moved = parts[rows] + away
        velocity = changing[:, :, 0]
        velocity[:, 0] -= turning * moved[:, 1, 0]
        velocity[:, 1] += turning * moved[:, 0, 0]
        return Prediction.of_parts(steady.speed, parts, (rows, velocity))

    def _row(self, speed: float) -> FloatArray:
        pieces = self.table.pieces
        index = pieces.find_one(speed)
        if index < 0:
            raise self._not_covered(speed)
        return evaluate_one(pieces, self.coefficients, speed, index)

    def _rows(self, speed: FloatArray) -> FloatArray:
        pieces, rows = self.table.pieces, np.empty((len(speed), self.coefficients.shape[2]))
        index = pieces.find(speed)
        if index.min(initial=0) < 0:
            raise self._not_covered(float(speed[index < 0][0]))
        for start in range(0, len(speed), _BLOCK):
            block = slice(start, start + _BLOCK)
            evaluate(pieces, self.coefficients, speed[block], index[block], out=rows[block])
        return rows

    def _not_covered(self, speed: float) -> OutOfTableError:
        low, high = self.table.speed_range
        if low <= speed <= high and not self.table.stability.holds(np.array([speed]))[0]:
            return OutOfTableError(
                f'speed must be one at which the machine is stable, got {rad_s_to_rpm(speed):g} '
                'rpm: a vibration grows there, no steady response exists')
        return OutOfTableError(
            f'speed must be within {rad_s_to_rpm(low):g} to {rad_s_to_rpm(high):g} rpm and off '
            f'undamped resonances, got {rad_s_to_rpm(speed):g} rpm')
