"""When is a run-up or run-down over? Then its peaks are judged, and every point in it counts."""

from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields, replace
import math
from typing import Any

import numpy as np
import numpy.typing as npt

from rotorsoil_ros.arrays import FloatArray, IntArray
from rotorsoil_ros.channel import Channel
from rotorsoil_ros.compared import Reason, Weighed
from rotorsoil_ros.events import Event, Level, NANOSECONDS, Remark
from rotorsoil_ros.monitor.inside import is_banded, is_mixed
from rotorsoil_ros.monitor.passage import (
    Allowed,
    is_decided,
    is_where,
    pair,
    Passage,
    passages,
    peak_fault,
    PeakPair,
    PROMINENCE,
    told_once,
    without_ringing,
)
from rotorsoil_ros.monitor.quasistatic import Lag, Resonance
from rotorsoil_ros.monitor.rules import Rules
from rotorsoil_ros.units import rad_s_to_rpm

# A sweep spans this share of its highest speed, and ends where the speed turns back by it.
SPAN = 0.1

# A speed that stays within this share of itself for so long is at rest [s].
AT_REST, RESTING_S = 0.005, 5.0

# Vectors out of samples come this much later than the speeds they belong to [s].
LATEST_VECTOR_S = 3.0

_MOST_ROWS = 8192  # of a channel in one sweep; a longer one keeps every second row
_MOST_HELD = 1 << 16  # points that wait for the end of their sweep


@dataclass(frozen=True, slots=True)
class Mark:
    """Where a sweep ends because the speed turned back, or pauses because it came to rest."""

    stamp_ns: int
    speed: float
    is_turn: bool


class SweepFinder:
    """Follows the speed sample by sample: the same marks however the samples come in."""

    def __init__(self) -> None:
        self._direction = 0
        self._first = self._top = math.nan
        self._extreme = 0, math.nan
        self._anchor = 0, math.nan
        self.rests_from_ns: int | None = None

    def follow(self, stamp_ns: IntArray, speed: FloatArray) -> Iterator[Mark]:
        """Yield the marks that samples in the order of time bring about."""
        for stamp, value in zip(stamp_ns.tolist(), speed.tolist(), strict=True):
            yield from self._rest(stamp, value)
            yield from self._turn(stamp, value)

    @property
    def is_rising(self) -> bool:
        """Whether the sweep goes to higher speeds."""
        return self._direction > 0

    @property
    def has_swept(self) -> bool:
        """Whether the speed has spanned enough to be a sweep."""
        return self._direction != 0

    def _rest(self, stamp: int, value: float) -> Iterator[Mark]:
        since, anchor = self._anchor
        if not abs(value - anchor) <= AT_REST * abs(anchor):
            self._anchor, self.rests_from_ns = (stamp, value), None
        elif self.rests_from_ns is None and stamp - since >= RESTING_S * NANOSECONDS:
            self.rests_from_ns = since
            yield Mark(stamp, value, is_turn=False)

    def _turn(self, stamp: int, value: float) -> Iterator[Mark]:
        if math.isnan(self._first):
            self._first = self._top = value
            self._extreme = stamp, value
        self._top = max(self._top, value)
        at, extreme = self._extreme
        if not self._direction:
            if abs(value - self._first) > SPAN * self._top:
                self._direction = 1 if value > self._first else -1
                self._extreme = stamp, value
        elif (value - extreme) * self._direction > 0.0:
            self._extreme = stamp, value
        elif (extreme - value) * self._direction > SPAN * self._top:
            yield Mark(at, extreme, is_turn=True)
            self._direction = -self._direction
            self._first, self._top = extreme, max(extreme, value)
            self._extreme = stamp, value


@dataclass(slots=True, eq=False)
class Trace:
    """What one channel measured in a sweep, beside its prediction; (n,) each."""

    stamp_ns: IntArray
    speed: FloatArray
    rate: FloatArray
    amplitude: FloatArray
    predicted: FloatArray
    low: FloatArray
    high: FloatArray

    def extended(self, other: 'Trace') -> 'Trace':
        """Return this and what came after it, in the order of time."""
        joined = Trace(*(np.concatenate([getattr(self, name), getattr(other, name)])
                         for name in _COLUMNS))
        if len(other.stamp_ns) and len(self.stamp_ns) and (
                other.stamp_ns.min() < self.stamp_ns[-1]):
            joined = joined.rows(np.argsort(joined.stamp_ns, kind='stable'))
        return joined

    def rows(self, which: Any) -> 'Trace':
        """Return some of it."""
        return Trace(*(getattr(self, name)[which] for name in _COLUMNS))

    def new_at_rest(self, resting: 'Trace') -> 'Trace':
        """Return what of a rest is news: speeds beyond those that the rest has had so far."""
        low, high = math.inf, -math.inf
        news = []
        for row, speed in enumerate(resting.speed.tolist()):
            if not low <= speed <= high:
                low, high = min(low, speed), max(high, speed)
                news.append(row)
        return resting.rows(np.array(news, dtype=np.int64))


_COLUMNS = tuple(entry.name for entry in fields(Trace))


class Sweeps:
    """
    Collects what is measured in a run-up or run-down, and judges it when that is over.

    At rest a first judgement is told of what nothing can change any more; the last one comes
    when the speed turns back, or at the end of the run. Then it is known where the machine
    really resonates, and the points that it led astray in passing do not count.
    """

    def __init__(self, machine: str, rules: Rules) -> None:
        self._machine, self._rules = machine, rules
        self.resonances: Sequence[Resonance] = ()
        self.are_followed = False  # by what is predicted, with all that a sweep strikes
        self._finder = SweepFinder()
        self._marks: deque[Mark] = deque()
        self._traces: dict[Channel, Trace] = {}
        self._held: list[Weighed] = []
        self._seen: Lag | None = None
        self._told: set[tuple[Any, ...]] = set()
        self._number = 0
        self._over: list[PeakPair] = []
        self._current: list[PeakPair] = []
        self.lobes: dict[Channel, list[float]] = {}
        self.faults: list[str] = []

    @property
    def peaks(self) -> list[PeakPair]:
        """Peaks of all sweeps so far."""
        return [*self._over, *self._current]

    def take(self, weighed: Weighed) -> None:
        """Take points whose pace is settled."""
        self._held.append(weighed)
        compared = weighed.compared
        for column, channel in enumerate(compared.channels):
            # Where another machine comes and goes in the vectors, no peak is this one's.
            moves = np.isfinite(compared.speed) & ~is_mixed(weighed.reason[:, column])
            new = Trace(compared.stamp_ns, compared.speed, weighed.rate,
                        compared.amplitude[:, column], np.abs(compared.predicted[:, column]),
                        compared.low[:, column], compared.high[:, column]).rows(moves)
            before = self._traces.get(channel)
            self._traces[channel] = self._thinned(new if before is None
                                                  else before.extended(new))

    def follow(
        self, stamp_ns: IntArray, speed: FloatArray, settled_ns: int,
    ) -> Iterator[Event]:
        """Yield what is to be said of sweeps that speeds bring to an end, and their points."""
        self._marks.extend(self._finder.follow(stamp_ns, speed))
        while self._marks and (
                self._marks[0].stamp_ns + LATEST_VECTOR_S * NANOSECONDS <= settled_ns):
            yield from self._judge(self._marks.popleft())
        if self._finder.rests_from_ns is not None and not self._marks:
            yield from self._release(settled_ns)  # at rest nothing waits
        elif sum(len(each.rate) for each in self._held) > _MOST_HELD:
            yield from self._release(
                int(np.median([each.compared.stamp_ns[-1] for each in self._held])))

    def finish(self, now_ns: int) -> Iterator[Event]:
        """Yield what is to be said at the end of the run."""
        while self._marks:
            yield from self._judge(self._marks.popleft())
        last = max((int(trace.stamp_ns[-1]) for trace in self._traces.values()
                    if len(trace.stamp_ns)), default=now_ns)
        yield from self._judge(Mark(last, math.nan, is_turn=True))
        yield from self._release(math.inf)

    def _thinned(self, trace: Trace) -> Trace:
        """Drop what a rest repeats, and every second row of what is too long."""
        rest_ns = self._finder.rests_from_ns
        if rest_ns is not None:
            at = int(np.searchsorted(trace.stamp_ns, rest_ns))
            resting = trace.new_at_rest(trace.rows(slice(at, None)))
            trace = trace.rows(slice(0, at)).extended(resting)
        while len(trace.stamp_ns) > _MOST_ROWS:
            trace = trace.rows(slice(None, None, 2))
        return trace

    def _judge(self, mark: Mark) -> Iterator[Event]:
        peaks: list[PeakPair] = []
        self.lobes = {}
        for channel, trace in self._traces.items():
            peaks += self._peaks(channel, trace.rows(
                slice(0, int(np.searchsorted(trace.stamp_ns, mark.stamp_ns, 'right')))))
        peaks = told_once(peaks)
        if not mark.is_turn:
            peaks = [each for each in peaks if each.is_complete or is_decided(
                each, mark.speed, is_rising=self._finder.is_rising)]
        self._current = peaks
        if peaks or mark.is_turn:
            self.faults = [fault for each in peaks if (
                fault := peak_fault(each, margin=self._rules.critical_margin))]
        if peaks:
            self._seen = Lag(resonances_of([each for each in peaks if not self._is_met(each)]))
        yield from self._tell(mark.stamp_ns)
        yield from self._release(mark.stamp_ns)
        if mark.is_turn:
            self._begin(mark.stamp_ns)

    def _begin(self, from_ns: int) -> None:
        """Begin a new sweep at the point from which it sets out."""
        self._over += self._current
        self._current, self._told = [], set()
        self._number += 1
        for channel, trace in list(self._traces.items()):
            first = max(0, int(np.searchsorted(trace.stamp_ns, from_ns, 'right')) - 1)
            self._traces[channel] = trace.rows(slice(first, None))

    def _peaks(self, channel: Channel, trace: Trace) -> list[PeakPair]:
        """Pair the peaks of one channel, found alike on both sides."""
        if not self._finder.has_swept or not np.isfinite(trace.predicted).any():
            return []
        margin, number = self._rules.critical_margin, self._number
        predicted = passages(trace.speed, trace.predicted, trace.rate, sweep=number)
        if self.are_followed:
            predicted, _ = without_ringing(predicted, self.resonances)
        allowed = [_allowed(trace, peak, margin) for peak in predicted]
        measured, lobes = without_ringing(
            passages(trace.speed, trace.amplitude, trace.rate, sweep=number), self.resonances)
        if lobes:
            self.lobes[channel] = [lobe.speed for lobe in lobes]
        return pair(channel, predicted, measured, allowed=allowed,
                    resonances=self.resonances, are_followed=self.are_followed)

    def _is_met(self, peak: PeakPair) -> bool:
        """Return whether the prediction went through a measured peak as the machine did."""
        return (self.are_followed and peak.is_complete
                and abs(peak.deviation) <= self._rules.critical_margin)

    def _tell(self, now_ns: int) -> Iterator[Remark]:
        for each in self._current:
            passed = each.measured or each.predicted
            assert passed is not None
            fault = peak_fault(each, margin=self._rules.critical_margin)
            key = each.channel, round(passed.speed), fault
            if key in self._told:
                continue
            self._told.add(key)
            at = f'{each.channel}: the peak at {rad_s_to_rpm(passed.speed):.0f} rpm'
            said = 'is as predicted' if each.is_held else (
                'was passed too fast to be held against the prediction')
            yield Remark(self._machine, now_ns, Level.WARN if fault else Level.OK,
                         fault or f'{at} {said}')

    def _release(self, until_ns: float) -> Iterator[Weighed]:
        """Let points go that nothing holds any more, marked by where the machine resonates."""
        ready, self._held = self._held, []
        block = []
        for each in ready:
            goes = each.compared.stamp_ns <= until_ns
            if not goes.all():
                self._held.append(each if not goes.any() else _part(each, ~goes))
            if goes.any():
                block.append(each if goes.all() else _part(each, goes))
        if block and self._seen is not None:
            block = list(_led_astray(block, self._seen, self._rules.largest_lag))
        yield from block


def _allowed(trace: Trace, peak: Passage, margin: float) -> Allowed:
    """Return what a predicted peak allows, by the band beside it where there is one."""
    near = np.abs(trace.speed / peak.speed - 1.0) <= margin
    banded = np.isfinite(trace.high)
    high = np.where(banded, trace.high, trace.predicted)[near]
    low = np.where(banded, trace.low, trace.predicted / PROMINENCE)[near]
    shown = trace.amplitude[is_where(trace.speed, peak)]
    return Allowed((1.0 - margin) * float(np.nanmax(low)), (1.0 + margin) * float(np.nanmax(high)),
                   float(np.nanmax(shown, initial=0.0)))


def resonances_of(peaks: Sequence[PeakPair]) -> list[Resonance]:
    """Return resonances where peaks were measured, damped as the predicted ones beside them."""
    return [Resonance(end, peak.damping_ratio) for peak in peaks
            if peak.measured is not None and math.isfinite(peak.damping_ratio)
            for end in sorted(set(peak.measured.critical_range(peak.damping_ratio)))]


def _part(weighed: Weighed, rows: npt.NDArray[Any]) -> Weighed:
    return Weighed(weighed.compared.rows(rows), weighed.rate[rows], weighed.reason[rows])


def _led_astray(block: Sequence[Weighed], lag: Lag, largest: float) -> Iterator[Weighed]:
    """Yield the points, those marked that a measured resonance leads away from the steady."""
    stamps, speed, rate = (np.concatenate(parts) for parts in zip(*(
        (each.compared.stamp_ns, each.compared.speed, each.rate) for each in block),
        strict=True))
    order = np.argsort(stamps, kind='stable')
    order = order[np.isfinite(speed[order])]
    share = np.zeros(len(stamps))
    share[order] = lag.follow(stamps[order], speed[order], rate[order])
    begin = 0
    for each in block:
        astray = share[begin:begin + len(each.rate)] > largest
        begin += len(each.rate)
        reason = each.reason.copy()
        reason[astray[:, None] & is_banded(reason)] = Reason.NOT_QUASI_STATIC
        yield replace(each, reason=reason)
