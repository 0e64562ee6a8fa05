"""The once-per-turn vector that is in a measured signal."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from rotorsoil_ros.arrays import ComplexArray, FloatArray
from rotorsoil_ros.errors import NotSolvedError, OutOfTableError, RotorSoilError
from rotorsoil_ros.units import RADIANS_PER_TURN

# Fewer turns do not part neighbouring orders from each other and from the offset.
_FEWEST_TURNS = 2.0

# Samples per unknown below which noise would be fitted instead of averaged.
_SAMPLES_PER_UNKNOWN = 2

# Above this condition number the orders cannot be told apart (aliasing, one-sided gaps).
_WORST_CONDITION = 1e6

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


@dataclass(frozen=True, slots=True)
class OrderVector:
    """
    Displacement vectors of some orders in one stretch of signal.

    Attributes
    ----------
    time, speed : float
        Of the middle of the stretch [s], [rad/s].
    displacement : (k,) complex array
        x(t) = Re(sum X_n exp(i n theta)), zero-to-peak [m].
    deviation : (k,) float array
        Standard error of |X_n| that the residual of the fit implies [m].
    has_phase : bool
        Whether theta is the true rotor angle; else only |X_n| has a meaning.

    """

    time: float
    speed: float
    displacement: ComplexArray
    deviation: FloatArray
    has_phase: bool


def demodulate(
    time: FloatArray, acceleration: FloatArray, track: SpeedTrack, *,
    orders: Sequence[int] = (1, 2, 3),
) -> OrderVector:
    """
    Fit displacement vectors of several orders to acceleration samples.

    Parameters
    ----------
    time : (n,) float array
        True sample times [s], in any order, with gaps or not.
    acceleration : (n,) float array
        Of a fixed direction [m/s^2]; a constant part, such as gravity, is fitted away.
    track : SpeedTrack
        Speed of the rotor, covering the samples.
    orders : sequence of int
        Multiples of the speed; harmonics that are present should be named, or they disturb.

    Returns
    -------
    OrderVector
        At the middle of the samples.

    Raises
    ------
    NotSolvedError
        If the stretch is shorter than two turns, has too few samples, or cannot part the
        orders.

    Notes
    -----
    With displacement Re(X(t) exp(i n theta)) and X linear over the stretch, acceleration is
    Re[(2 i n Omega X' + i n alpha X - n^2 Omega^2 X) exp(i n theta)]: exact under a constant
    rate of speed alpha, and linear in X and X'. Fitting by least squares at the true times
    needs no resampling, so that gaps and jitter bias nothing.

    """
    angle, speed, rate = track.at(time)
    middle = 0.5 * (float(time.min()) + float(time.max())) if len(time) else 0.0
    unknowns = 4 * len(orders) + 1
    turns = float(np.ptp(angle)) / RADIANS_PER_TURN if len(time) else 0.0
    if turns < _FEWEST_TURNS or len(time) < _SAMPLES_PER_UNKNOWN * unknowns:
        raise NotSolvedError(f'a vector needs {_FEWEST_TURNS:g} turns and '
                             f'{_SAMPLES_PER_UNKNOWN * unknowns} samples or more, got '
                             f'{turns:.2g} turns, {len(time)} samples')
    reach = max(float(np.ptp(time)) / 2.0, np.finfo(float).tiny)
    along = (time - middle) / reach
    columns = []
    for order in orders:
        turning = np.exp(1j * order * angle)
        value = (1j * order * rate - (order * speed) ** 2) * turning
        change = value * along + 2j * order * speed / reach * turning
        columns += [value.real, -value.imag, change.real, -change.imag]
    system = np.column_stack([*columns, np.ones_like(time)])
    scale = np.linalg.norm(system, axis=0)
    left, singular, right = np.linalg.svd(system / scale, full_matrices=False)
    if not singular[0] <= _WORST_CONDITION * singular[-1]:
        raise NotSolvedError('the samples cannot tell the orders apart')
    inverse = right.T / singular / scale[:, None]
    solution = inverse @ (left.T @ acceleration)
    residual = acceleration - system @ solution
    variance = residual @ residual / (len(time) - unknowns)
    vectors = solution[:-1].reshape(-1, 4)
    spread = np.sum(inverse**2, axis=1)[:-1].reshape(-1, 4)[:, :2].max(axis=1)
    return OrderVector(
        middle, float(track.at(np.array([middle]))[1][0]), vectors[:, 0] + 1j * vectors[:, 1],
        np.sqrt(variance * spread), track.has_phase)


def order_vectors(
    time: FloatArray, acceleration: FloatArray, track: SpeedTrack, *, turns: float,
    orders: Sequence[int] = (1, 2, 3),
) -> Iterator[OrderVector]:
    """
    Yield vectors of consecutive stretches of a signal.

    Parameters
    ----------
    time, acceleration, track, orders
        As `demodulate`.
    turns : float
        Length of a stretch. Stretches that cannot be solved are left out.

    """
    order = np.argsort(time, kind='stable')
    time, acceleration = time[order], acceleration[order]
    angle, _, _ = track.at(time)
    stretch = np.floor((angle - angle[0]) / (turns * RADIANS_PER_TURN))
    for ends in np.split(np.arange(len(time)), np.flatnonzero(np.diff(stretch)) + 1):
        try:
            yield demodulate(time[ends], acceleration[ends], track, orders=orders)
        except NotSolvedError:
            continue
