"""Does a machine move as predicted? Measured and predicted vectors, point by point."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
import math
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from rotorsoil_ros.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from rotorsoil_ros.channel import Channel, named
from rotorsoil_ros.errors import require
from rotorsoil_ros.monitor.quasistatic import is_quasi_static, Resonance

NANOSECOND = 1e-9

# A slow-roll vector is the mean of what was measured within this share of its speed.
SLOW_ROLL_WINDOW = 0.05

# Multiples of its standard error below which a vector is noise.
ABOVE_NOISE = 3.0

_Reasons: TypeAlias = npt.NDArray[Any]


class Reason(StrEnum):
    """Why a measured point is not held against its prediction."""

    USED = ''
    NOT_FINITE = 'measured value is negative or not finite'
    NO_SPEED = 'no speed reported near its stamp'
    OUT_OF_TABLE = 'outside the speed range of the prediction'
    NO_PREDICTION = 'channel or speed has no prediction'
    SLOW_ROLL = 'slow roll, taken as runout'
    BELOW_NOISE = 'below noise'
    NOT_QUASI_STATIC = 'not quasi-static'


@dataclass(frozen=True, slots=True, eq=False)
class Signal:
    """
    Once-per-turn vectors that one channel measured.

    Attributes
    ----------
    stamp_ns : (n,) int array
        When [ns].
    amplitude : (n,) float array
        Displacement, zero-to-peak [m, rad].
    phase : (n,) float array
        [rad]; NaN where nothing told the angle of the rotor.
    deviation : (n,) float array
        Standard error of the amplitude [m, rad], 0 where it is not known.

    """

    stamp_ns: IntArray
    amplitude: FloatArray
    phase: FloatArray
    deviation: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Reference:
    """
    What was predicted over a run, in the order of its time.

    Attributes
    ----------
    stamp_ns : (m,) int array
        Of the reported speeds, ascending [ns].
    speed : (m,) float array
        [rad/s].
    channels : tuple of Channel
        What was predicted.
    displacement : (m, c) complex array
        NaN where there is no prediction [m, rad].
    low, high : (m, c) float array
        Amplitudes between which it lies as far as the soil is known, NaN where no band is.
    behind, ahead : (m, c) float array
        By how much its phase lies behind or ahead at most [rad], likewise.
    speed_range : tuple of two floats
        That the prediction covers [rad/s].

    """

    stamp_ns: IntArray
    speed: FloatArray
    channels: tuple[Channel, ...]
    displacement: ComplexArray
    low: FloatArray
    high: FloatArray
    behind: FloatArray
    ahead: FloatArray
    speed_range: tuple[float, float]

    @property
    def time(self) -> FloatArray:
        """Time since the first speed, (m,) [s]."""
        return np.asarray((self.stamp_ns - self.stamp_ns[:1]) * NANOSECOND)


@dataclass(frozen=True, slots=True)
class Matching:
    """
    How points are matched and cleaned.

    Attributes
    ----------
    tolerance : float
        Largest distance between the stamps of a measurement and of a speed [s].
    slow_roll_speed : float
        Speed whose mean vector is runout and is subtracted from the channel [rad/s]; NaN: none.
    noise : float
        Amplitude below which nothing is compared [m, rad].

    """

    tolerance: float = 0.05
    slow_roll_speed: float = math.nan
    noise: float = 0.0

    def __post_init__(self) -> None:
        require(0.0 <= self.tolerance < math.inf, 'tolerance', '>= 0 s and finite',
                self.tolerance)
        require(not self.slow_roll_speed <= 0.0, 'slow_roll_speed', '> 0 rad/s',
                self.slow_roll_speed)
        require(0.0 <= self.noise < math.inf, 'noise', '>= 0 m and finite', self.noise)


@dataclass(frozen=True, slots=True, eq=False)
class ChannelPoints:
    """
    One channel, measured beside predicted.

    Attributes
    ----------
    channel : str
        Its name.
    stamp_ns, speed : (n,) arrays
        Of the measurement [ns]; reported nearest to it, NaN where none is near [rad/s].
    amplitude : (n,) float array
        Measured, less runout where it is known [m, rad].
    phase : (n,) float array
        Measured [rad], NaN where it is not known.
    predicted : (n,) complex array
        NaN where there is no prediction.
    low, high : (n,) float array
        The band of its amplitude, NaN where there is none.
    behind, ahead : (n,) float array
        The band of its phase about that of the prediction [rad], likewise.
    reason : (n,) array of Reason
        Why a point is not used; USED where it is.
    runout : complex
        What was subtracted [m, rad]; NaN where no slow-roll vector is known.

    """

    channel: Channel
    stamp_ns: IntArray
    speed: FloatArray
    amplitude: FloatArray
    phase: FloatArray
    predicted: ComplexArray
    low: FloatArray
    high: FloatArray
    behind: FloatArray
    ahead: FloatArray
    reason: _Reasons
    runout: complex

    @property
    def used(self) -> BoolArray:
        """Which points are held against the machine."""
        return np.asarray(self.reason == Reason.USED)

    @property
    def measured(self) -> ComplexArray:
        """Measured vectors, NaN where there is no phase."""
        return np.asarray(self.amplitude * np.exp(1j * self.phase))

    @property
    def has_phase(self) -> bool:
        """Whether any point that is used has a phase."""
        chosen = self.used if self.used.any() else np.ones(len(self.phase), dtype=bool)
        return bool(np.isfinite(self.phase[chosen]).any())

    @property
    def excluded(self) -> dict[str, int]:
        """Number of points left out for each reason."""
        return dict(Counter(str(reason) for reason in self.reason if reason != Reason.USED))


def match(
    signals: Mapping[str, Signal], reference: Reference, resonances: Sequence[Resonance],
    matching: Matching,
) -> list[ChannelPoints]:
    """
    Hold measured vectors against the predictions nearest in time.

    Parameters
    ----------
    signals : mapping of str to Signal
        What was measured, by channel.
    reference : Reference
        What was predicted.
    resonances : sequence of Resonance
        While one of them is passed too fast, points are not used.
    matching : Matching
        Tolerances.

    """
    slow = is_quasi_static(reference.time, reference.speed, resonances)
    return [_channel(name, signal, reference, slow, matching)
            for name, signal in signals.items()]


def nearest(wanted: IntArray, given: IntArray, *, tolerance: float) -> IntArray:
    """Return the index of the nearest of given stamps [ns], -1 beyond a tolerance [s]."""
    if not len(given):
        return np.full(len(wanted), -1)
    after = np.clip(np.searchsorted(given, wanted), 0, len(given) - 1)
    before = np.maximum(after - 1, 0)
    index = np.where(wanted - given[before] <= given[after] - wanted, before, after)
    index = np.where(wanted > given[-1], len(given) - 1, index)
    return np.asarray(np.where(np.abs(given[index] - wanted) * NANOSECOND <= tolerance, index, -1))


def _channel(
    name: str, signal: Signal, reference: Reference, slow: BoolArray, matching: Matching,
) -> ChannelPoints:
    index = nearest(signal.stamp_ns, reference.stamp_ns, tolerance=matching.tolerance)

    def matched(values: npt.NDArray[Any]) -> npt.NDArray[Any]:
        return np.where(index >= 0, values[index], np.nan)

    nothing = np.full(len(reference.stamp_ns), np.nan)
    column = reference.channels.index(name) if name in reference.channels else -1
    predicted, low, high, behind, ahead = (
        matched(nothing if column < 0 else values[:, column])
        for values in (reference.displacement, reference.low, reference.high, reference.behind,
                       reference.ahead))
    speed = matched(reference.speed)
    amplitude, phase = signal.amplitude, signal.phase
    amplitude = np.where((amplitude >= 0.0) & np.isfinite(amplitude), amplitude, np.nan)
    rolling = (np.abs(speed - matching.slow_roll_speed)
               <= SLOW_ROLL_WINDOW * matching.slow_roll_speed)
    rolling &= np.isfinite(amplitude * phase)
    runout, floor = complex(np.nan, np.nan), matching.noise
    if rolling.any():
        vectors = amplitude * np.exp(1j * phase)
        runout = complex(vectors[rolling].mean())
        floor = max(floor, ABOVE_NOISE * float(np.std(vectors[rolling])))
        left = vectors - runout
        amplitude = np.where(np.isfinite(phase), np.abs(left), amplitude)
        phase = np.where(np.isfinite(phase), np.angle(left), phase)
    lowest, highest = reference.speed_range
    reason = np.full(len(index), Reason.USED, dtype=object)
    for why, holds in (  # the last that holds is told
            (Reason.NOT_QUASI_STATIC, (index >= 0) & ~slow[index]),
            (Reason.BELOW_NOISE, amplitude < np.maximum(floor, ABOVE_NOISE * signal.deviation)),
            (Reason.SLOW_ROLL, rolling),
            (Reason.NO_PREDICTION, ~np.isfinite(predicted)),
            (Reason.OUT_OF_TABLE, (speed < lowest) | (speed > highest)),
            (Reason.NO_SPEED, ~np.isfinite(speed)),
            (Reason.NOT_FINITE, ~np.isfinite(amplitude))):
        reason[holds] = why
    return ChannelPoints(named(name, reference.channels), signal.stamp_ns, speed, amplitude,
                         phase, predicted, low, high, behind, ahead, reason, runout)


@dataclass(frozen=True, slots=True)
class Statistics:
    """
    How far measured points that are used lie from their predictions; NaN where nothing tells.

    Attributes
    ----------
    bias, scatter : float
        Mean and standard deviation of measured less predicted amplitude [m, rad].
    ratio : float
        Median of measured over predicted amplitude [-].
    phase_bias, phase_scatter : float
        Mean and standard deviation of measured less predicted phase [rad].
    r_squared : float
        1 - |measured - predicted|^2 / |measured - its mean|^2: of the vectors where they have
        phases, else of the amplitudes.
    inside : float
        Share of the amplitudes inside the band, widened by a margin on either side.
    phase_inside : float
        Share of the phases inside the band, widened by the angle of which the margin is the
        sine.

    """

    bias: float
    scatter: float
    ratio: float
    phase_bias: float
    phase_scatter: float
    r_squared: float
    inside: float
    phase_inside: float


def statistics(points: ChannelPoints, *, margin: float) -> Statistics:
    """Return how the used points of a channel lie; the band is widened by a share `margin`."""
    used = points.used
    size, expected = points.amplitude[used], np.abs(points.predicted[used])
    if not len(size):
        return Statistics(*[math.nan] * 8)
    turn = np.exp(1j * (points.phase[used] - np.angle(points.predicted[used])))
    turn = turn[np.isfinite(turn)]
    mean_turn = turn.mean() if len(turn) else complex(np.nan, np.nan)
    measured, predicted = points.measured[used], points.predicted[used]
    if not np.isfinite(measured).all():
        measured, predicted = size.astype(complex), expected.astype(complex)
    spread = float(np.sum(np.abs(measured - measured.mean()) ** 2))
    left = float(np.sum(np.abs(measured - predicted) ** 2))
    low, high = points.low[used], points.high[used]
    banded = np.isfinite(low)
    inside = (size >= (1.0 - margin) * low) & (size <= (1.0 + margin) * high)
    moving = expected > 0.0
    return Statistics(
        bias=float(np.mean(size - expected)), scatter=float(np.std(size - expected)),
        ratio=float(np.median(size[moving] / expected[moving])) if moving.any() else math.nan,
        phase_bias=float(np.angle(mean_turn)) if len(turn) else math.nan,
        phase_scatter=(float(np.std(np.angle(turn * mean_turn.conjugate()))) if len(turn)
                       else math.nan),
        r_squared=1.0 - left / spread if spread > 0.0 else math.nan,
        inside=float(np.mean(inside[banded])) if banded.any() else math.nan,
        phase_inside=_phase_inside(points, margin))


def _phase_inside(points: ChannelPoints, margin: float) -> float:
    """Return the share of used phases inside their band, NaN where there is none."""
    told = points.used & np.isfinite(points.phase) & np.isfinite(points.behind)
    if not told.any():
        return math.nan
    turn = np.angle(np.exp(1j * (points.phase - np.angle(points.predicted))))[told]
    slack = math.asin(min(margin, 1.0))
    return float(np.mean((turn >= points.behind[told] - slack)
                         & (turn <= points.ahead[told] + slack)))
