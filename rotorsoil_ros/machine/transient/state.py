"""How far a machine is from its steady response, now that its speed has changed: in steps."""

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
import math
from typing import NamedTuple, TypeAlias

import numpy as np
from scipy.special import wofz

from rotorsoil_ros.arrays import ComplexArray, FloatArray, IntArray
from rotorsoil_ros.machine.transient.poles import Poles

# After so long without a speed nobody knows how it has changed, and a machine is taken to be
# steady again [ns].
LONGEST_GAP_NS = 10_000_000_000

# Below this product of the change of speed and its duration both forms of the step agree to 1e-9,
# and without it the one with the Faddeeva function divides by the change.
_EVEN = 1e-8

# Share of its own steady response from which on what is left of a vibration is nothing: a tenth
# of what a table of responses promises.
_NOTHING = 1e-6

# Past states that are kept: what is measured may be asked for three seconds later.
_PAST = 1 << 14

_NANOSECOND = 1e-9
_ROOT_PI = math.sqrt(math.pi)

# Of all vibrations d = v + 1 / A [s] and A d [-], (k,) each; None where there is no deviation.
Deviation: TypeAlias = tuple[ComplexArray, ComplexArray] | None


def step(
    before: ComplexArray, after: ComplexArray, time: FloatArray | float,
) -> tuple[ComplexArray, ComplexArray]:
    """
    Return what the envelope v' = A v + 1 is multiplied by, and what is added to it.

    Parameters
    ----------
    before, after : (..., k) complex arrays
        A = (1 - g) (lambda - i Omega) at both ends of an interval, evenly in between [1/s].
    time : float or (..., 1) float array
        How long it lasts [s].

    Notes
    -----
    With B = (after - before) / time and r^2 = 2 B what is added is a difference of two Faddeeva
    functions w; after a resonance one of them is what rings down.

    References
    ----------
    Theory manual, passage; Abramowitz & Stegun 7.1.3 for w.

    """
    exponent: ComplexArray = (0.5 * time) * (before + after)
    turn: ComplexArray = time * (after - before)
    gone = np.exp(exponent)
    even = np.abs(turn) < _EVEN
    if even.all():
        return gone, time * _mean_of_exponential(gone, exponent)
    if not even.any():
        return gone, _swept(before, after, _root(turn, time), gone)
    root = _root(np.where(even, 1.0 + 0j, turn), time)
    return gone, np.where(even, time * _mean_of_exponential(gone, exponent),
                          _swept(before, after, root, gone))


def _root(turn: ComplexArray, time: FloatArray | float) -> ComplexArray:
    """Return a root of 2 B."""
    return np.asarray(np.sqrt(2.0 * turn) / time)


def _mean_of_exponential(gone: ComplexArray, exponent: ComplexArray) -> ComplexArray:
    """Return (exp(m) - 1) / m, which is 1 where nothing happens."""
    small = np.abs(exponent) < _EVEN
    return np.asarray((gone - 1.0 + small) / (exponent + small) if small.any() else
                      (gone - 1.0) / exponent)


def _swept(
    before: ComplexArray, after: ComplexArray, root: ComplexArray, gone: ComplexArray,
) -> ComplexArray:
    """Return what is added while A goes from one to another, with either root of 2 B."""
    begins = before / root
    side = np.copysign(1.0, begins.real)
    root, begins = side * root, side * begins
    ends = after / root
    past = ends.real < 0.0
    if past.any():  # w itself overflows there; the exponential is the ring-down
        behind = wofz(np.where(past, -1j, 1j) * ends)
        behind = np.where(past, 2.0 * np.exp(np.where(past, ends * ends, 0.0)) - behind, behind)
    else:
        behind = wofz(1j * ends)
    return np.asarray(_ROOT_PI / root * (gone * wofz(1j * begins) - behind))


@dataclass(frozen=True, slots=True)
class _Moment:
    """When the machine had which speed [rad/s] and envelopes; None where it was steady."""

    stamp_ns: int
    speed: float
    envelopes: ComplexArray | None


class _Way(NamedTuple):
    """From one speed to the next: A at both, and what `step` tells, (k,) each."""

    before: ComplexArray
    after: ComplexArray
    gone: ComplexArray
    driven: ComplexArray


class Transient:
    """
    Follows the vibrations that a changing speed strikes.

    Every speed that is answered is one step, taken alone and in the order of time: the same
    numbers to the last bit live, offline, and however the speeds are divided into calls. A
    speed that is not answered is as one that was lost.

    Attributes
    ----------
    poles : Poles
        The vibrations.
    turns : (k,) float array
        1 - g: by how much the frequency of each comes nearer per speed.
    began_ns : tuple of int
        When the machine was taken to be steady for want of anything better [ns]: at the first
        speed, after a gap, where stamps go back.

    """

    def __init__(self, poles: Poles) -> None:
        self.poles = poles
        self.turns = 1.0 - poles.slope
        self._decay = self.turns * poles.decay
        self._now: _Moment | None = None
        self._past, self._began = deque[_Moment](maxlen=_PAST), deque[int](maxlen=_PAST)

    @property
    def began_ns(self) -> tuple[int, ...]:
        """When it was taken to be steady."""
        return tuple(self._began)

    def follow(self, stamp_ns: IntArray, speed: FloatArray) -> list[Deviation]:
        """
        Return how far all vibrations are from their steady responses at each speed.

        Parameters
        ----------
        stamp_ns, speed : (n,) arrays
            When [ns], and which [rad/s]; NaN where none is answered.

        """
        if len(speed) == 1:  # message by message
            return [self._take(int(stamp_ns[0]), float(speed[0]))]
        answered = np.flatnonzero(np.isfinite(speed))
        ways = dict(zip(answered[1:].tolist(), self._ways(stamp_ns[answered], speed[answered]),
                        strict=True)) if len(answered) > 1 else {}
        return [self._take(stamp, value, ways.get(row)) for row, (stamp, value) in enumerate(zip(
            stamp_ns.tolist(), speed.tolist(), strict=True))]

    def _ways(self, stamp_ns: IntArray, speed: FloatArray) -> Iterator[_Way]:
        """Yield the ways from each speed to the next, found element by element at once."""
        rate = self._decay - 1j * (speed[:, None] * self.turns)
        time = np.diff(stamp_ns) * _NANOSECOND
        with np.errstate(all='ignore'):  # what goes back or nowhere is not taken
            gone, driven = step(rate[:-1], rate[1:], np.where(time > 0.0, time, 1.0)[:, None])
        return map(_Way, rate[:-1], rate[1:], gone, driven)

    def at(self, stamp_ns: int, speed: float) -> Deviation:
        """
        Return the deviations at a time that is past, from the steady response to a speed [rad/s].

        None too where nothing is known of that time.
        """
        before = after = None
        for moment in reversed(self._past):
            if moment.stamp_ns <= stamp_ns:
                before = moment
                break
            after = moment
        if before is None or stamp_ns - before.stamp_ns > LONGEST_GAP_NS:
            return None
        between, since = before.speed, stamp_ns - before.stamp_ns
        if after is not None:
            share = since / (after.stamp_ns - before.stamp_ns)
            between += share * (after.speed - before.speed)
        envelopes = self._stepped(before, between, since * _NANOSECOND)
        return None if envelopes is None else _deviation(envelopes, self.rate(speed))

    def _take(self, stamp: int, speed: float, way: _Way | None = None) -> Deviation:
        if not math.isfinite(speed):
            return None
        now, envelopes, deviation = self._now, None, None
        if now is None or not 0 <= stamp - now.stamp_ns <= LONGEST_GAP_NS:
            if now is None or stamp < now.stamp_ns:
                self._past.clear()
                self._began.clear()
            self._began.append(stamp)
        else:
            envelopes = self._stepped(now, speed, (stamp - now.stamp_ns) * _NANOSECOND, way)
        if envelopes is not None:
            deviation = _deviation(envelopes, self.rate(speed) if way is None else way.after)
            if (np.abs(deviation[1]) < _NOTHING).all():
                envelopes = deviation = None
        self._now = _Moment(stamp, speed, envelopes)
        self._past.append(self._now)
        return deviation

    def rate(self, speed: float) -> ComplexArray:
        """Return A = (1 - g) (lambda - i Omega) of all vibrations, (k,) [1/s]."""
        return np.asarray(self._decay - 1j * (speed * self.turns))

    def _stepped(
        self, moment: _Moment, speed: float, time: float, way: _Way | None = None,
    ) -> ComplexArray | None:
        """Return the envelopes when the speed has gone evenly to another; None if still steady."""
        envelopes = moment.envelopes
        if envelopes is None:
            if speed == moment.speed or not len(self.turns):
                return None
            envelopes = -1.0 / (self.rate(moment.speed) if way is None else way.before)
        if time <= 0.0:  # the same moment told twice: the newer speed is taken, nothing has moved
            return envelopes
        if way is not None:
            return way.gone * envelopes + way.driven
        gone, driven = step(self.rate(moment.speed), self.rate(speed), time)
        return gone * envelopes + driven


def _deviation(envelopes: ComplexArray, rate: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
    share = 1.0 + envelopes * rate
    return share / rate, share
