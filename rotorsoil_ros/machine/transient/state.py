"""How far a machine is from its steady response, now that its speed has changed: in steps."""

from collections import deque
from collections.abc import Iterator, Sequence
import math
from typing import NamedTuple, TypeAlias

import numpy as np
from scipy.special import wofz

from rotorsoil_ros.arrays import BoolArray, ComplexArray, FloatArray, IntArray
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

# Past states that are kept, for what is measured and told late: so many, and so old [ns].
_PAST, _PAST_NS = 1 << 14, 100_000_000_000

_NANOSECOND = 1e-9
_FIRST = np.zeros(1, dtype=np.int64)
_ROOT_PI = math.sqrt(math.pi)


class Struck(NamedTuple):
    """
    What rings at m of n speeds beside the steady response.

    Attributes
    ----------
    rows : (m,) int array
        Which of them.
    away, share : (m, k) complex arrays
        Of all vibrations d = v + 1 / A [s] and A d [-].

    """

    rows: IntArray
    away: ComplexArray
    share: ComplexArray


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
    count = np.count_nonzero(even)
    if count == even.size:
        return gone, time * _mean_of_exponential(gone, exponent)
    if not count:
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
    if np.count_nonzero(past):  # w itself overflows there; the exponential is the ring-down
        behind = wofz(np.where(past, -1j, 1j) * ends)
        behind = np.where(past, 2.0 * np.exp(np.where(past, ends * ends, 0.0)) - behind, behind)
    else:
        behind = wofz(1j * ends)
    return np.asarray(_ROOT_PI / root * (gone * wofz(1j * begins) - behind))


# When [ns] the machine had which speed [rad/s] and envelopes (k,); None where it was steady. Plain
# tuples: thousands are kept, and among such nobody looks for garbage.
_Moment: TypeAlias = tuple[int, float, ComplexArray | None]


# From one speed to the next, what `step` tells of every vibration, (k,) each.
_Way: TypeAlias = tuple[ComplexArray, ComplexArray]


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
        self._decay, self._turning = self.turns * poles.decay, 1j * self.turns
        self._now: _Moment = -LONGEST_GAP_NS - 1, math.nan, None
        self._last_rate = math.nan, self._decay
        self._past, self._began = deque[_Moment](maxlen=_PAST), deque[int](maxlen=_PAST)
        self._rests = False  # the last two of the past are the ends of a rest

    @property
    def began_ns(self) -> tuple[int, ...]:
        """When it was taken to be steady."""
        return tuple(self._began)

    def rate(self, speed: FloatArray) -> ComplexArray:
        """Return A = (1 - g) (lambda - i Omega) of all vibrations, (n, k) [1/s]."""
        return np.asarray(self._decay - speed[:, None] * self._turning)

    def follow(self, stamp_ns: IntArray, speed: FloatArray) -> Struck | None:
        """
        Return how far all vibrations are from their steady responses; None if nothing rings.

        Parameters
        ----------
        stamp_ns, speed : (n,) arrays
            When [ns], and which [rad/s]; NaN where none is answered.

        """
        if not len(self.turns):
            return None
        if len(speed) == 1:
            return self._follow_one(stamp_ns.item(), speed.item())
        answered = np.flatnonzero(np.isfinite(speed))
        stamps, told = stamp_ns[answered], speed[answered]
        return self._struck(answered.tolist(), told, list(map(
            self._take, stamps.tolist(), told.tolist(), self._ways(stamps, told))))

    def _follow_one(self, stamp: int, speed: float) -> Struck | None:
        """Follow message by message: the same as many, with less ado."""
        if not math.isfinite(speed) or (envelope := self._take(stamp, speed)) is None:
            return None
        away, share, left = _deviations(envelope[None], self._rate_of(speed)[None])
        return Struck(_FIRST, away, share) if left[0] else None

    def at(self, stamp_ns: IntArray, speed: FloatArray) -> Struck | None:
        """
        Return the deviations at times that are past, from the steady responses to speeds (n,).

        Nothing too where nothing is known of such a time, or the speed [rad/s] is NaN.
        """
        answered = np.flatnonzero(np.isfinite(speed))
        return self._struck(answered.tolist(), speed[answered],
                            list(map(self._then, stamp_ns[answered].tolist())))

    def _ways(self, stamp_ns: IntArray, speed: FloatArray) -> Iterator[_Way | None]:
        """Yield the way to each speed, all found at once, element by element; not to the first."""
        yield from [None] * len(speed[:1])
        if len(speed) < 2:
            return
        rate, time = self.rate(speed), np.diff(stamp_ns) * _NANOSECOND
        with np.errstate(all='ignore'):  # what goes back or nowhere is not taken
            gone, driven = step(rate[:-1], rate[1:], np.where(time > 0.0, time, 1.0)[:, None])
        yield from zip(gone, driven, strict=True)

    def _then(self, stamp: int) -> ComplexArray | None:
        """Return the envelopes at a time that is past; None if it was steady or is not known."""
        before = after = None
        for moment in reversed(self._past):
            if moment[0] <= stamp:
                before = moment
                break
            after = moment
        if before is None or stamp - before[0] > LONGEST_GAP_NS:
            return None
        between = before[1]
        if after is not None:
            between += (stamp - before[0]) / (after[0] - before[0]) * (after[1] - between)
        if before[2] is None and between == before[1]:
            return None
        return self._stepped(before, stamp, between)

    def _take(
        self, stamp: int, speed: float, way: _Way | None = None,
    ) -> ComplexArray | None:
        """Return the envelopes at the next speed; None where the machine is steady."""
        envelopes, rests = None, False
        last_ns, last_speed, last = self._now
        if not 0 <= stamp - last_ns <= LONGEST_GAP_NS:
            if stamp < last_ns:
                self._past.clear()
                self._began.clear()
            self._began.append(stamp)
        elif last is None and speed == last_speed:
            rests = True
        else:
            envelopes = self._stepped(self._now, stamp, speed, way)
            if speed == last_speed and (
                    _largest(1.0 + envelopes * self._rate_of(speed)) < _NOTHING):
                envelopes = None
        self._now = stamp, speed, envelopes
        if rests and self._rests:
            self._past[-1] = self._now
        else:
            self._past.append(self._now)
            if stamp - self._past[0][0] > _PAST_NS:
                self._past.popleft()
        self._rests = rests
        return envelopes

    def _stepped(
        self, moment: _Moment, stamp: int, speed: float, way: _Way | None = None,
    ) -> ComplexArray:
        """Return the envelopes when the speed has gone evenly from that of a moment to another."""
        since, told, envelopes = moment
        if envelopes is None:
            envelopes = -1.0 / self._rate_of(told)
        if stamp == since:  # the same moment told twice: the newer speed is taken, nothing moves
            return envelopes
        gone, driven = way or step(
            self._rate_of(told), self._rate_of(speed), (stamp - since) * _NANOSECOND)
        return np.asarray(gone * envelopes + driven)

    def _rate_of(self, speed: float) -> ComplexArray:
        """Return `rate` at one speed, (k,); the last one is known."""
        if speed != self._last_rate[0]:
            self._last_rate = speed, self.rate(np.array([speed]))[0]
        return self._last_rate[1]

    def _struck(
        self, rows: Sequence[int], speed: FloatArray, envelopes: Sequence[ComplexArray | None],
    ) -> Struck | None:
        """Return the deviations of those rows in which anything is left of one."""
        known = [row for row, each in enumerate(envelopes) if each is not None]
        if not known:
            return None
        rate = self.rate(speed[known])
        envelope = np.concatenate([envelopes[row] for row in known]).reshape(rate.shape)
        away, share, left = _deviations(envelope, rate)
        at = np.array(rows)[known]
        if left.all():
            return Struck(at, away, share)
        return Struck(at[left], away[left], share[left]) if left.any() else None


def _deviations(
    envelope: ComplexArray, rate: ComplexArray,
) -> tuple[ComplexArray, ComplexArray, BoolArray]:
    """Return d and A d = 1 + A v (m, k) each, and whether anything is left of them, (m,)."""
    # Of the same shape: of what is broadcast numpy rounds a product in another way.
    share = envelope * rate
    share += 1.0
    return share / rate, share, _largest(share) >= _NOTHING


def _largest(share: ComplexArray) -> FloatArray:
    """Return the largest part of a share, (...) of (..., k)."""
    return np.asarray(np.abs(share.view(float)).max(axis=-1))
