"""Does the machine behave as predicted? Measured vectors against the answers, while it runs."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, fields
from difflib import get_close_matches
import math

import numpy as np

from rotorsoil_ros.arrays import BoolArray, FloatArray, IntArray
from rotorsoil_ros.case.config import Case
from rotorsoil_ros.channel import ACROSS, Channel
from rotorsoil_ros.events import (
    Band,
    Compared,
    Event,
    Level,
    Measured,
    NANOSECONDS,
    Remark,
    Samples,
)
from rotorsoil_ros.machine.band import Envelope
from rotorsoil_ros.machine.response import Predictor
from rotorsoil_ros.monitor.criteria import answer, Criteria
from rotorsoil_ros.monitor.demodulation import Demodulator
from rotorsoil_ros.monitor.history import History
from rotorsoil_ros.monitor.pairing import Pairing, Runout, Vectors
from rotorsoil_ros.monitor.passing import Passing
from rotorsoil_ros.monitor.points import ABOVE_NOISE, Matching, nearest
from rotorsoil_ros.monitor.quasistatic import is_quasi_static, SLOPE_SAMPLES
from rotorsoil_ros.monitor.rules import Rules
from rotorsoil_ros.monitor.told import Verdict
from rotorsoil_ros.monitor.zones import Vibration

MOST_NAMES = 16
REPEAT_NS = NANOSECONDS  # after which a band is told again although the speed has not moved
MOVED = 1e-3  # share of a speed


@dataclass(frozen=True, slots=True)
class Judging:
    """
    How measurements are held against predictions.

    Attributes
    ----------
    rules : Rules
        When a machine behaves as predicted.
    turns : float
        Turns of the rotor that make one vector of raw samples.
    band_period_s : float
        Message time between two bands while the speed changes; 0: one with every speed [s].

    """

    rules: Rules = field(default_factory=Rules)
    turns: float = 10.0
    band_period_s: float = 0.1

    @classmethod
    def of(cls, case: Case, *, matching: Matching | None = None, **other: float) -> 'Judging':
        """Return how a case is judged."""
        return cls(Rules(matching=matching or Matching(), zones=case.zones), **other)


class Judge:
    """
    Holds what is measured of one machine against what is predicted.

    Between ticks it only dates, joins and subtracts; what takes longer waits for the tick. As
    in the monitor no clock is read, so that a replay is judged as the run was.
    """

    def __init__(self, machine: str, predictor: Predictor, judging: Judging) -> None:
        self.machine = machine
        self.history = History()
        self._judging = judging
        self._criteria: Criteria | None = None
        self._envelope: Envelope | None = None
        self._predictor = predictor
        rules = judging.rules
        self._pairing = Pairing(self.history, tolerance_s=rules.matching.tolerance)
        self._runout = Runout(rules.matching.slow_roll_speed)
        self._vibration = Vibration(rules)
        self._passing = Passing(machine, self.history, margin=rules.critical_margin)
        self._verdict = Verdict(machine, self._vibration, self._passing)
        self._demodulators: dict[str, Demodulator] = {}
        self._compared: list[Compared] = []
        self._unknown: set[str] = set()
        self._told: set[str] = set()
        self._band_ns = round(judging.band_period_s * NANOSECONDS)
        self._band_told = -REPEAT_NS, 0.0

    def take_predictor(self, predictor: Predictor) -> None:
        """Judge by another unbalance, for which the band is not known yet."""
        self._predictor, self._envelope = predictor, None

    def take_criteria(self, criteria: Criteria) -> None:
        """Judge by a band, resonances and natural speeds from now on."""
        self._criteria, self._envelope = criteria, criteria.envelope

    def on_speed(self, stamp_ns: IntArray, speed: FloatArray, angle: FloatArray) -> bool:
        """Note speeds [rad/s] and rotor angles [rad]; return whether `follow` has something."""
        self.history.add(stamp_ns, speed, angle)
        return (len(speed) > 1 or not self._pairing.is_idle
                or (self._envelope is not None
                    and self._is_band_due(int(stamp_ns[0]), float(speed[0]))))

    def follow(self, stamp_ns: IntArray, speed: FloatArray) -> Iterator[Event]:
        """Yield the band of these speeds, and the comparisons that waited for them."""
        if self._envelope is not None:
            rows = list(self._band_rows(stamp_ns, speed))
            if rows:
                band = self._envelope.at(speed[rows])
                yield Band(self.machine, stamp_ns[rows], speed[rows], band.low, band.high)
        yield from self._matched()

    def on_measured(self, measured: Measured) -> Iterator[Event]:
        """Yield the comparisons that a measurement completes."""
        self._pairing.take(measured)
        yield from self._matched()

    def on_samples(self, samples: Samples) -> None:
        """Keep raw samples until the tick."""
        known = self._demodulators.get(samples.channel)
        if known is None:
            known = self._demodulators[samples.channel] = Demodulator(
                self.machine, samples.channel, self.history, turns=self._judging.turns)
        known.take(samples)

    def tick(self, now_ns: int, *, stale_after_s: float) -> Iterator[Event]:
        """Close the period since the last tick, and judge it."""
        for demodulator in self._demodulators.values():
            for found in demodulator.vectors():
                yield found
                self._pairing.take_demodulated(found)
        self._pairing.tick()
        yield from self._matched(is_tick=True)
        criteria, compared = self._criteria, _joined(self._compared)
        self._compared = []
        if criteria is not None:
            self._weigh(criteria, compared)
            yield from self._passing.finished(now_ns, criteria.resonances)
        yield from self._strangers(now_ns)
        yield from self._verdict.tell(
            now_ns, stale_after_s=stale_after_s, has_data=bool(compared),
            has_phase=any(np.isfinite(each.phase).any() for each in compared),
            is_steady=self.history.is_steady, counts=self._counts())

    def finish(self, now_ns: int) -> Iterator[Event]:
        """Judge the passage that the end of the run has cut short."""
        if self._criteria is not None:
            yield from self._passing.cut_short(now_ns, self._criteria.resonances)

    def _band_rows(self, stamp_ns: IntArray, speed: FloatArray) -> Iterator[int]:
        """Yield the rows with which a band is due."""
        for row, (stamp, value) in enumerate(
                zip(stamp_ns.tolist(), speed.tolist(), strict=True)):
            if self._is_band_due(stamp, value):
                self._band_told = stamp, value
                yield row

    def _is_band_due(self, stamp: int, speed: float) -> bool:
        """Return whether time and speed have moved on since the last band; at rest each second."""
        told_ns, told_speed = self._band_told
        since = stamp - told_ns
        if 0 <= since < self._band_ns:
            return False
        return (not 0 <= since < REPEAT_NS or not self._band_ns
                or abs(speed - told_speed) > MOVED * told_speed)

    def _matched(self, *, is_tick: bool = False) -> Iterator[Compared]:
        """Yield what has found its speed."""
        by_channels: dict[tuple[str, ...], list[Vectors]] = {}
        for vectors in self._pairing.ready(is_tick=is_tick):
            by_channels.setdefault(vectors.channels, []).append(vectors)
        for channels, found in by_channels.items():
            compared = self._compare(channels, found)
            if compared is not None:
                self._compared.append(compared)
                yield compared

    def _compare(self, channels: Sequence[str], found: Sequence[Vectors]) -> Compared | None:
        """Return vectors of the same channels beside their prediction, if there is any."""
        known = [column for column, name in enumerate(channels)
                 if name in self._predictor.channels]
        self._unknown |= set(channels).difference(self._predictor.channels)
        if not known:
            return None
        columns = [self._predictor.channels.index(channels[column]) for column in known]
        speed = np.array([vectors.speed for vectors in found])
        halves = [vectors.displacement() for vectors in found]
        amplitude = np.array([half[0][known] for half in halves])
        phase = np.array([half[1][known] for half in halves])
        names = tuple(self._predictor.channels[column] for column in columns)
        amplitude, phase = self._runout.subtract(names, speed, amplitude, phase)
        low = high = np.full(amplitude.shape, np.nan)
        if self._envelope is not None:
            band = self._envelope.at(speed)
            low, high = band.low[:, columns], band.high[:, columns]
        return Compared(
            self.machine, np.array([vectors.stamp_ns for vectors in found]), speed, names,
            amplitude, phase, np.array([vectors.deviation for vectors in found])[:, known],
            answer(self._predictor, speed)[:, columns], low, high)

    def _weigh(self, criteria: Criteria, compared: Iterable[Compared]) -> None:
        """Zone what was measured and predicted, and count what is inside the band."""
        natural = {axis: criteria.lowest_natural_speed(axis) for axis in ACROSS}
        for each in compared:
            self._vibration.measure(each, natural)
            self._vibration.compare(each, self._counting(each, criteria))
            self._passing.take(each)
        speed = self.history.last_speed
        if math.isfinite(speed):
            row = answer(self._predictor, np.array([speed]))[0]
            self._vibration.predict(
                {channel: speed * abs(row[column]) / math.sqrt(2.0)
                 for column, channel in enumerate(self._predictor.channels)
                 if channel.is_housing and abs(row[column]) > 0.0}, speed, natural)

    def _counting(self, compared: Compared, criteria: Criteria) -> BoolArray:
        """Return which points may be held against the machine, (n, channels)."""
        stamps, speed, _ = self.history.track()
        first = int(np.searchsorted(stamps, compared.stamp_ns.min()))
        recent = slice(max(0, first - SLOPE_SAMPLES), None)
        stamps, speed = stamps[recent], speed[recent]
        slow = is_quasi_static((stamps - stamps[:1]) / NANOSECONDS, speed, criteria.resonances)
        index = nearest(compared.stamp_ns, stamps, tolerance=math.inf)
        counts = slow[index] if len(slow) else np.zeros(len(index), dtype=bool)
        counts = counts & ~self._runout.is_rolling(compared.speed)
        floor = np.maximum(self._judging.rules.matching.noise, ABOVE_NOISE * compared.deviation)
        return np.asarray(counts[:, None] & np.isfinite(compared.predicted)
                          & (compared.amplitude >= floor))

    def _strangers(self, now_ns: int) -> Iterator[Remark]:
        """Tell once which measured channels no prediction has: a slip in a name, mostly."""
        new = sorted(self._unknown - self._told)[:MOST_NAMES]
        self._unknown = set()
        if new and len(self._told) < MOST_NAMES:
            self._told |= set(new)
            near = [get_close_matches(name, self._predictor.channels, n=1) for name in new]
            yield Remark(self.machine, now_ns, Level.WARN, 'measured but not predicted: '
                         + ', '.join(name + (f' (did you mean {like[0]}?)' if like else '')
                                     for name, like in zip(new, near, strict=True)))

    def _counts(self) -> dict[str, float]:
        return {'without_speed': self._pairing.given_up,
                'samples_left_out': sum(each.left_out for each in self._demodulators.values()),
                'raw_channels': len(self._demodulators)}


def _joined(found: Sequence[Compared]) -> list[Compared]:
    """Return what was compared since the last tick, once for each set of channels."""
    by_channels: dict[tuple[Channel, ...], list[Compared]] = {}
    for each in found:
        by_channels.setdefault(each.channels, []).append(each)
    arrays = {entry.name for entry in fields(Compared)} - {'machine', 'channels'}
    return [Compared(machine=parts[0].machine, channels=channels, **{
        name: np.concatenate([getattr(part, name) for part in parts]) for name in arrays})
        for channels, parts in by_channels.items()]
