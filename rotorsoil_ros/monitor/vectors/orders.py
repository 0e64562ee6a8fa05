"""The once-per-turn vector that is in a measured signal."""

from collections.abc import Sequence
from dataclasses import dataclass, field
import math
from typing import Any

import numpy as np
import numpy.typing as npt

from rotorsoil_ros.arrays import ComplexArray, FloatArray, IntArray
from rotorsoil_ros.errors import NotSolvedError, OutOfTableError, RotorSoilError
from rotorsoil_ros.units import RADIANS_PER_TURN

# Fewer turns do not part neighbouring orders from each other and from the offset.
_FEWEST_TURNS = 2.0

# Samples per unknown below which noise would be fitted instead of averaged.
_SAMPLES_PER_UNKNOWN = 2

# Above this condition number the orders cannot be told apart (aliasing, one-sided gaps).
_WORST_CONDITION = 1e6

# The residual is averaged over so many blocks; what repeats in each of them is no noise, and what
# differs is told by fewer degrees of freedom, because the fit has used some.
_BLOCKS, _FREE_BLOCKS = 10, 8

# Batch means of few blocks can be small by chance: never below this share of the white formula.
_LEAST_OF_WHITE = 0.3

LARGEST_ACCELERATION = 1e9  # [m/s^2]; no sensor tells more, and its square fits into a double


# An angle that strays further from what the speed says between two samples is not the rotor's
# [rad]; chance would give a quarter of a turn.
_ASTRAY = 0.5


@dataclass(frozen=True, slots=True)
class SpeedTrack:
    """
    Rotor speed over time, linear between its samples.

    Attributes
    ----------
    time : (m,) float array
        Ascending [s].
    speed : (m,) float array
        [rad/s].
    angle_at_start : float or None
        Rotor angle at the first sample [rad]; None if nothing tells where the mark on the
        shaft is: phases then have no meaning.
    angle : (m,) float array or None
        Rotor angle at every sample [rad], whole turns left out or not: the errors of the
        speed then do not add up over a long run.

    """

    time: FloatArray
    speed: FloatArray
    angle_at_start: float | None = None
    angle: FloatArray | None = None

    def __post_init__(self) -> None:
        if len(self.time) < 2 or len(self.time) != len(self.speed):
            raise RotorSoilError(f'a speed track needs two samples or more of time and speed, '
                                 f'got {len(self.time)} and {len(self.speed)}')
        if not (np.all(np.diff(self.time) > 0.0) and np.all(np.isfinite(self.speed))):
            raise RotorSoilError('a speed track needs ascending times in s and finite speeds')
        if self.angle is not None and not (
                len(self.angle) == len(self.time) and np.all(np.isfinite(self.angle))):
            raise RotorSoilError('a speed track needs a finite angle in rad at every sample, or '
                                 'none')

    @property
    def has_phase(self) -> bool:
        """Whether the angle is counted from a mark on the shaft."""
        return self.angle_at_start is not None or self.angle is not None

    def at(self, time: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """
        Return rotor angle [rad], speed [rad/s] and its rate [rad/s^2] at given times.

        Raises
        ------
        OutOfTableError
            If a time lies outside the track.

        """
        if len(time) and not (self.time[0] <= np.min(time) and np.max(time) <= self.time[-1]):
            raise OutOfTableError(f'time must be within {self.time[0]:g} to {self.time[-1]:g} s '
                                  f'of the speed track, got {np.min(time):g} to '
                                  f'{np.max(time):g}')
        step = np.diff(self.time)
        rate = np.diff(self.speed) / step
        turned = np.cumsum(0.5 * (self.speed[:-1] + self.speed[1:]) * step)
        start = np.concatenate([[0.0], turned]) + (self.angle_at_start or 0.0)
        if self.angle is not None:
            start += np.angle(np.exp(1j * (self.angle - start)))
        index = np.clip(np.searchsorted(self.time, time, side='right') - 1, 0, len(step) - 1)
        since = time - self.time[index]
        angle = start[index] + (self.speed[index] + 0.5 * rate[index] * since) * since
        return angle, self.speed[index] + rate[index] * since, rate[index]


def turns_with(time: FloatArray, speed: FloatArray, angle: FloatArray) -> bool:
    """
    Return whether angles are those of a rotor at these speeds.

    Many publishers fill in a zero, or a position that nobody measures, where the angle of the
    rotor should be: its phases would look true.

    Parameters
    ----------
    time, speed, angle : (n,) float arrays
        Ascending [s], [rad/s], and [rad] with or without whole turns.

    """
    if len(time) < 2 or not np.all(np.isfinite(angle)):
        return False
    turned = 0.5 * (speed[:-1] + speed[1:]) * np.diff(time)
    astray = np.abs(np.angle(np.exp(1j * (np.diff(angle) - turned))))
    return float(np.median(astray)) < _ASTRAY


@dataclass(frozen=True, slots=True, eq=False)
class Turning:
    """Where the rotor was when samples were taken: times [s] and what a track tells, (n,) each."""

    time: FloatArray
    angle: FloatArray
    speed: FloatArray
    rate: FloatArray

    @classmethod
    def of(cls, time: FloatArray, track: SpeedTrack) -> 'Turning':
        """Ask a track."""
        return cls(time, *track.at(time))

    def rows(self, which: Any) -> 'Turning':
        """Return some of it."""
        return Turning(*(getattr(self, name)[which] for name in self.__slots__))

    @property
    def turns(self) -> float:
        """How many turns the samples span."""
        return float(np.ptp(self.angle)) / RADIANS_PER_TURN if len(self.time) else 0.0

    @property
    def middle(self) -> float:
        """Middle of the samples [s]."""
        return 0.5 * (float(self.time.min()) + float(self.time.max()))


@dataclass(frozen=True, slots=True, eq=False)
class OrderFit:
    """
    What samples are made of, by least squares.

    Attributes
    ----------
    vectors, change : (k,) complex array
        Displacement at the middle, and how it changes over half the stretch [m].
    white : (k,) float array
        Standard error of a vector, were the residual white noise [m].
    residual : (n,) float array
        What is left [m/s^2].
    turning : (n,) complex array
        exp(i theta).
    beside : (m,) complex array
        Displacement of other machines, at their own angles [m].
    inflation : float
        By how much an error of the first order is larger for their being fitted too [-].

    """

    vectors: ComplexArray
    change: ComplexArray
    white: FloatArray
    residual: FloatArray
    turning: ComplexArray
    beside: ComplexArray
    inflation: float = 1.0

    @property
    def power(self) -> float:
        """Square sum of what is left."""
        return float(self.residual @ self.residual)


@dataclass(frozen=True, slots=True)
class OrderVector:
    """
    Displacement vectors of some orders in one stretch of signal.

    Attributes
    ----------
    time, speed : float
        Of the middle of the stretch [s], [rad/s].
    displacement : (k,) complex array
        x(t) = Re(sum X_n exp(i n theta)), zero-to-peak [m]; NaN where an order is not told.
    deviation : (k,) float array
        Standard error of |X_n| by batch means of the residual [m].
    has_phase : bool
        Whether theta is the true rotor angle; else only |X_n| has a meaning.
    beside : (m,) float array
        Amplitude of what each of m other machines does [m], NaN where it is not told apart.

    """

    time: float
    speed: float
    displacement: ComplexArray
    deviation: FloatArray
    has_phase: bool
    beside: FloatArray = field(default_factory=lambda: np.zeros(0))


def demodulate(
    time: FloatArray, acceleration: FloatArray, track: SpeedTrack, *,
    orders: Sequence[int] = (1, 2, 3),
) -> OrderVector:
    """
    Return displacement vectors of several orders in acceleration samples.

    Parameters
    ----------
    time : (n,) float array
        True sample times [s], ascending, with gaps or not.
    acceleration : (n,) float array
        Of a fixed direction [m/s^2]; a constant part, such as gravity, and a drift are fitted
        away.
    track : SpeedTrack
        Speed of the rotor, covering the samples.
    orders : sequence of int
        Multiples of the speed; harmonics that are present should be named, or they disturb.

    Raises
    ------
    NotSolvedError
        If the stretch is shorter than two turns, has too few samples, or cannot part the
        orders.

    """
    turning = Turning.of(time, track)
    found = fit(turning, acceleration, orders)
    middle = turning.middle
    speed = float(track.at(np.array([middle]))[1][0])
    return OrderVector(middle, speed, found.vectors,
                       deviations(found, orders, speed=speed), track.has_phase)


def fit(
    turning: Turning, acceleration: FloatArray, orders: Sequence[int],
    beside: Sequence[Turning] = (),
) -> OrderFit:
    """
    OrderFit displacement vectors of several orders, an offset and a drift to acceleration samples.

    And one of each machine beside it, at the angle that it has turned.

    Raises
    ------
    NotSolvedError
        As `demodulate`.

    Notes
    -----
    With displacement Re(X(t) exp(i n theta)) and X linear over the stretch, acceleration is
    Re[(2 i n Omega X' + i n alpha X - n^2 Omega^2 X) exp(i n theta)]: exact under a constant
    rate of speed alpha, and linear in X and X'. Fitting by least squares at the true times
    needs no resampling, so that gaps and jitter bias nothing.

    """
    number, unknowns = len(turning.time), 4 * len(orders) + 2 * len(beside) + 2
    if turning.turns < _FEWEST_TURNS or number < _SAMPLES_PER_UNKNOWN * unknowns:
        raise NotSolvedError(f'a vector needs {_FEWEST_TURNS:g} turns and '
                             f'{_SAMPLES_PER_UNKNOWN * unknowns} samples or more, got '
                             f'{turning.turns:.2g} turns, {number} samples')
    once, system = _system(turning, orders, beside)
    # Normal equations: columns of one length are nearly orthogonal, so that little is lost, and
    # they cost a fraction of a decomposition of all rows.
    gram = system @ system.T
    scale = np.sqrt(np.diag(gram))
    gram /= scale * scale[:, None]
    try:
        inverse = np.linalg.inv(gram)
    except np.linalg.LinAlgError:
        raise NotSolvedError('the samples cannot tell the orders apart') from None
    # What the smallest eigenvalue adds to the trace: no decomposition is needed to see it.
    if not 0.0 < np.trace(inverse) * len(gram) <= _WORST_CONDITION**2:
        raise NotSolvedError('the samples cannot tell the orders apart')
    # Of orders alone, which whole turns part, it is one.
    inflation = math.sqrt(max(inverse[0, 0], inverse[1, 1])) if beside else 1.0
    inverse /= scale * scale[:, None]
    solution = inverse @ (system @ acceleration)
    residual = acceleration - solution @ system
    variance = float(residual @ residual) / (number - unknowns)
    own = 4 * len(orders)
    parts, others = solution[:own].reshape(-1, 4), solution[own:-2].reshape(-1, 2)
    spread = np.diag(inverse)[:own].reshape(-1, 4)[:, :2].max(axis=1)
    return OrderFit(parts[:, 0] + 1j * parts[:, 1], parts[:, 2] + 1j * parts[:, 3],
                    np.sqrt(variance * spread), residual, once, others[:, 0] + 1j * others[:, 1],
                    inflation)


def deviations(found: OrderFit, orders: Sequence[int], *, speed: float) -> FloatArray:
    """
    Return the standard errors of the first k fitted orders at a speed [rad/s], (k,) [m].

    Notes
    -----
    By batch means: harmonics that were not fitted are locked to the turn and average out, which
    the white formula does not see; a tone beside the order beats from block to block, which it
    does not see either. What the linear X(t) neglects is added.

    """
    order = np.asarray(orders)
    edges = block_edges(len(found.residual))
    back = np.conj(found.turning)
    against = np.stack([found.residual * (back if each == 1 else back**each) for each in orders])
    blocks = np.add.reduceat(against, edges[:-1], axis=1) * (2.0 / np.diff(edges))
    batch = np.sqrt(np.sum(np.abs(blocks) ** 2, axis=1) / (2.0 * _FREE_BLOCKS * _BLOCKS))
    batch = np.maximum(found.inflation * batch / (order * speed) ** 2,
                       _LEAST_OF_WHITE * found.white[:len(order)])
    size = np.maximum(np.abs(found.vectors[:len(order)]), np.finfo(float).tiny)
    return np.asarray(np.hypot(batch, np.abs(found.change[:len(order)]) ** 2 / (4.0 * size)))


def block_edges(number: int) -> IntArray:
    """Return where the blocks of a residual begin and end, (11,)."""
    return np.arange(_BLOCKS + 1) * number // _BLOCKS


def _system(
    turning: Turning, orders: Sequence[int], beside: Sequence[Turning],
) -> tuple[ComplexArray, npt.NDArray[np.float64]]:
    """Return exp(i theta), (n,), and the columns that a fit needs, as rows: (unknowns, n)."""
    time, number = turning.time, len(turning.time)
    reach = max(float(np.ptp(time)) / 2.0, np.finfo(float).tiny)
    along = (time - turning.middle) / reach
    once, square = np.exp(1j * turning.angle), turning.speed**2
    system = np.empty((4 * len(orders) + 2 * len(beside) + 2, number))
    for row, order in enumerate(orders):
        turned = once if order == 1 else once**order
        value = (1j * order * turning.rate - order**2 * square) * turned
        change = value * along + (2j * order / reach) * turning.speed * turned
        system[4 * row], system[4 * row + 1] = value.real, -value.imag
        system[4 * row + 2], system[4 * row + 3] = change.real, -change.imag
    for row, other in enumerate(beside, start=2 * len(orders)):
        value = (1j * other.rate - other.speed**2) * np.exp(1j * other.angle)
        system[2 * row], system[2 * row + 1] = value.real, -value.imag
    system[-2], system[-1] = along, 1.0
    return once, system
