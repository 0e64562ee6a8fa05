"""Whether a prediction holds: the speed changed slowly, or it is known since when it changed."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
import math

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from rotorsoil_ros.arrays import ComplexArray, FloatArray, IntArray
from rotorsoil_ros.events import NANOSECONDS
from rotorsoil_ros.machine.transient.state import LONGEST_GAP_NS, Transient
from rotorsoil_ros.monitor.vectors.history import History, nearest

# From p = 1.5 on the peak of a passage is within 4 % of the steady one, and a vibration that
# was struck in passing is gone before the lag of the forced one is.
SLOW_ENOUGH = 1.5

# Behind a passage the free vibration is 2.5 tau exp(-p tau) of the forced one, which falls as
# 1 / tau, where tau is the distance from the resonance in units of sqrt(rate).
RINGING = 2.5

# Up to where behind the resonance a passage moves the peak, without damping, in units of the
# square root of the rate: Lewis' limit.
LARGEST_SHIFT = 2.16

# Samples over which a slope is fitted: speeds out of single turns scatter.
SLOPE_SAMPLES = 15
_HALF = SLOPE_SAMPLES // 2

_MOST_SAMPLES = 1 << 15  # of which rate and error are remembered


@dataclass(frozen=True, slots=True)
class Resonance:
    """A critical speed [rad/s] and the damping ratio of its mode."""

    speed: float
    damping_ratio: float


def passage_number(resonance: Resonance, rate: float) -> float:
    """
    Return p = zeta omega_n / sqrt(rate): the bandwidth against the rate of speed [rad/s^2].

    References
    ----------
    Lewis (1932), Trans. ASME 54, for p = 0; the envelope A' = -p A + exp(i tau^2 / 2) / 2.

    """
    if rate == 0.0:
        return math.inf
    return resonance.damping_ratio * resonance.speed / math.sqrt(abs(rate))


def speed_rate(stamp_ns: IntArray, speed: FloatArray) -> FloatArray:
    """
    Return the rate of speed [rad/s^2] at each sample, a slope fitted over its neighbours.

    None is a neighbour across a gap in which nobody knows what the speed did.
    """
    ends = 1 + np.flatnonzero(np.diff(stamp_ns) > LONGEST_GAP_NS)
    if len(ends):
        return np.concatenate([speed_rate(*part) for part in zip(
            np.split(stamp_ns, ends), np.split(speed, ends), strict=True)])
    rates = np.zeros(len(speed))
    inner = np.arange(_HALF, max(_HALF, len(speed) - _HALF))
    if len(inner):
        stamps = sliding_window_view(stamp_ns, SLOPE_SAMPLES)
        # Counted from the middle of each window: the same bits wherever a run is cut.
        since = (stamps - stamps[:, _HALF:_HALF + 1]) / NANOSECONDS
        since = since - since.mean(axis=1, keepdims=True)
        spread = np.sum(since**2, axis=1)
        slope = np.sum(since * sliding_window_view(speed, SLOPE_SAMPLES), axis=1)
        np.divide(slope, spread, out=rates[inner[0]:inner[-1] + 1], where=spread > 0.0)
    for index in np.setdiff1d(np.arange(len(speed)), inner):
        near = slice(max(0, index - _HALF), index + _HALF + 1)
        since = (stamp_ns[near] - stamp_ns[index]) / NANOSECONDS
        since = since - since.mean()
        spread = since @ since
        if spread > 0.0:
            rates[index] = since @ speed[near] / spread
    return rates


class Lag:
    """
    Tells by which share of itself the response lies off the steady one, mode by mode.

    Parameters
    ----------
    resonances : sequence of Resonance
        Modes that are struck in passing; those whose damping is not known tell nothing.

    Notes
    -----
    With A = -zeta omega_n + i (omega_n - Omega), the deviation of one mode from its steady
    response 1 / A is rate / A^3 to first order: a share rate / |A|^2, which is 1 / p^2 at the
    resonance. A passage with p < 1.5 also strikes a free vibration, of which RINGING is what is
    left behind it. Samples are taken in the order of time, in parts of any size.

    """

    def __init__(self, resonances: Sequence[Resonance]) -> None:
        known = [each for each in resonances if math.isfinite(each.damping_ratio)]
        self._passages = [_Passed(each) for each in known]

    def follow(self, stamp_ns: IntArray, speed: FloatArray, rate: FloatArray) -> FloatArray:
        """Return the largest share of all modes at the next samples, (n,) [-]."""
        share = np.zeros(len(speed))
        for passed in self._passages:
            np.maximum(share, passed.follow(stamp_ns, speed, rate), out=share)
        return share


class _Passed:
    """One mode, and when and how fast it was passed last."""

    def __init__(self, resonance: Resonance) -> None:
        self._speed = resonance.speed
        self._bandwidth = resonance.damping_ratio * resonance.speed
        self._side = 0.0
        self._at_ns, self._rate = 0, 0.0

    def follow(self, stamp_ns: IntArray, speed: FloatArray, rate: FloatArray) -> FloatArray:
        """Return the share of this mode."""
        if not len(speed):
            return np.zeros(0)
        beyond = speed - self._speed
        side = np.sign(beyond)
        crosses = side != np.concatenate([[self._side or side[0]], side[:-1]])
        last = np.maximum.accumulate(np.where(crosses, np.arange(len(speed)), -1))
        before = last < 0
        at_ns = np.where(before, self._at_ns, stamp_ns[last])
        struck = np.where(before, self._rate, np.abs(rate[last]))
        self._side = float(side[-1])
        self._at_ns, self._rate = int(at_ns[-1]), float(struck[-1])
        distance = self._bandwidth**2 + beyond**2
        share = np.full(len(speed), math.inf)
        np.divide(np.abs(rate), distance, out=share, where=distance > 0.0)
        rings = self._bandwidth < SLOW_ENOUGH * np.sqrt(struck)
        if rings.any():
            since = (stamp_ns[rings] - at_ns[rings]) / NANOSECONDS
            share[rings] = np.maximum(
                share[rings], RINGING * np.abs(beyond[rings]) / np.sqrt(struck[rings])
                * np.exp(-self._bandwidth * since))
        return share


class Unsettled:
    """
    Tells by which share of itself the response may still ring from before it was followed.

    Parameters
    ----------
    transient : callable
        Who follows the machine now, and takes it to be steady where it begins.

    Notes
    -----
    Of a machine that came along at the rate of its beginning alpha / |A|^3 was missing then, and
    if a resonance lies behind it, RINGING exp(-p tau) / sqrt(alpha): both decay with the mode.
    Samples are taken in the order of time, in parts of any size.

    """

    def __init__(self, transient: Callable[[], Transient]) -> None:
        self._transient = transient
        self._began_ns = -1
        self._missing = np.zeros(0)

    def follow(self, stamp_ns: IntArray, speed: FloatArray, rate: FloatArray) -> FloatArray:
        """Return the largest share of all modes at the next samples, (n,) [-]."""
        transient = self._transient()
        began_ns = np.array(transient.began_ns, dtype=np.int64)
        last = np.searchsorted(began_ns, stamp_ns, side='right') - 1
        share = np.full(len(speed), math.inf)  # before it began nothing is known
        for index in np.unique(last[last >= 0]).tolist():
            rows = np.flatnonzero(last == index)
            pace = transient.rate(speed[rows])
            if (began := int(began_ns[index])) != self._began_ns:
                self._began_ns = began
                self._missing = _missed(transient, pace[0], float(rate[rows[0]]))
            since = (stamp_ns[rows, None] - began) / NANOSECONDS
            left = np.exp(pace.real * since) * self._missing
            share[rows] = (left * np.hypot(pace.real, pace.imag)).max(axis=1, initial=0.0)
        return share


def _missed(transient: Transient, pace: ComplexArray, rate: float) -> FloatArray:
    """Return by how much each envelope may have been off at a beginning with A, (k,) [s]."""
    turning = np.abs(transient.turns * rate)
    missed = turning / np.abs(pace) ** 3
    # A = Re A + i (1 - g) (omega - Omega): behind the resonance in the sense of the rate.
    behind = (pace.imag * rate < 0.0) & (turning > 0.0)
    damped, beyond = -pace.real[behind], np.abs(pace.imag[behind])
    struck = np.minimum(RINGING / np.sqrt(turning[behind]), 1.0 / damped)
    missed[behind] += struck * np.exp(-damped * beyond / turning[behind])
    return np.asarray(missed)


class Pace:
    """
    Decides once for every speed of a run how fast it changes and what that does to the answer.

    A rate needs speeds on both sides of a sample: it is settled some samples later. Live and
    offline settle the same rates, however the speeds come in. Of an answer that follows the
    changes of the speed `unsettled` makes who tells what it leaves out.
    """

    def __init__(
        self, history: History, resonances: Sequence[Resonance],
        unsettled: Callable[[], Unsettled | None] = lambda: None,
    ) -> None:
        self._history = history
        self.resonances = tuple(resonances)
        self._unsettled = unsettled
        self._begin()

    def _begin(self) -> None:
        self._epoch = self._history.epoch
        self._lag = self._unsettled() or Lag(self.resonances)
        self._stamps = np.array([], dtype=np.int64)
        self._rates, self._shares = np.array([]), np.array([])

    @property
    def settled_ns(self) -> int:
        """Stamp of the last sample that is decided [ns], -1 of none."""
        return int(self._stamps[-1]) if len(self._stamps) else -1

    def follow(self, *, is_last: bool = False) -> tuple[IntArray, FloatArray]:
        """Settle what can be settled, or all if nothing more comes; return stamps and speeds."""
        if self._epoch != self._history.epoch:
            self._begin()
        stamps, speed, _ = self._history.track()
        first = int(np.searchsorted(stamps, self.settled_ns, side='right'))
        end = len(stamps) if is_last else len(stamps) - _HALF
        if end <= first:
            return stamps[:0], speed[:0]
        near = slice(max(0, first - _HALF), end + _HALF)
        rate = speed_rate(stamps[near], speed[near])[first - near.start:end - near.start]
        new = slice(first, end)
        share = self._lag.follow(stamps[new], speed[new], rate)
        self._stamps = np.concatenate([self._stamps, stamps[new]])[-_MOST_SAMPLES:]
        self._rates = np.concatenate([self._rates, rate])[-_MOST_SAMPLES:]
        self._shares = np.concatenate([self._shares, share])[-_MOST_SAMPLES:]
        return stamps[new], speed[new]

    def at(self, stamp_ns: IntArray) -> tuple[FloatArray, FloatArray]:
        """Return rate [rad/s^2] and share of the lag beside stamps, (n,); NaN where unknown."""
        index = nearest(stamp_ns, self._stamps)
        if not len(self._stamps):
            return np.full(len(stamp_ns), np.nan), np.full(len(stamp_ns), np.nan)
        return self._rates[index], self._shares[index]
