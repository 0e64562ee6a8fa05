"""Does the machine behave as predicted? Measured vectors against the answers, while it runs."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
import math
from typing import Any

import numpy as np
import numpy.typing as npt

from rotorsoil_ros.arrays import FloatArray, IntArray
from rotorsoil_ros.case.summary import unstable
from rotorsoil_ros.channel import ACROSS, Channel
from rotorsoil_ros.compared import Compared, Reason, Weighed
from rotorsoil_ros.events import (
    Band,
    Event,
    Expected,
    Level,
    Measured,
    NANOSECONDS,
    Predicted,
    Remark,
    Samples,
)
from rotorsoil_ros.machine.response import Predictor
from rotorsoil_ros.machine.transient.state import Transient
from rotorsoil_ros.monitor.beside.apart import Apart
from rotorsoil_ros.monitor.beside.companions import Companion, Companions
from rotorsoil_ros.monitor.beside.parting import MEMORY_S
from rotorsoil_ros.monitor.criteria import Criteria
from rotorsoil_ros.monitor.inside import BandShare
from rotorsoil_ros.monitor.quasistatic import Pace, Unsettled
from rotorsoil_ros.monitor.rules import Judging
from rotorsoil_ros.monitor.suspicion import Suspicion
from rotorsoil_ros.monitor.sweep import Sweeps
from rotorsoil_ros.monitor.vectors.axes import in_si
from rotorsoil_ros.monitor.vectors.comparing import Comparer
from rotorsoil_ros.monitor.vectors.demodulation import Demodulator
from rotorsoil_ros.monitor.vectors.history import History
from rotorsoil_ros.monitor.vectors.refusal import Refusals
from rotorsoil_ros.monitor.vectors.stretch import ABOVE_NOISE
from rotorsoil_ros.monitor.verdict import Account, Teller
from rotorsoil_ros.monitor.zones import Zones

REPEAT_NS = NANOSECONDS  # after which a band is told again although the speed has not moved
MOVED = 1e-3  # share of a speed
SILENT_TICKS = 2  # without a new speed, after which nothing more is waited for


class Judge:
    """
    Holds what is measured of one machine against what is predicted.

    Between ticks it only dates, joins and subtracts; what takes longer waits for the tick. As
    in the monitor no clock is read, and every decision hangs on stamps alone: a log is judged
    as the run was.
    """

    def __init__(
        self, machine: str, predictor: Predictor, judging: Judging, *, transient: Transient,
        hindsight: Mapping[str, complex] | None = None,
    ) -> None:
        self.machine = machine
        self.history = History()
        self._judging = judging
        self._comparer = Comparer(machine, self.history, predictor, transient,
                                  matching=judging.rules.matching, hindsight=hindsight)
        self.runout = self._comparer.runout
        self._demodulators: dict[Channel, Demodulator] = {}
        self._fresh: list[Compared] = []
        self._heard: list[Compared] = []
        self._silent_ticks = 0
        self._pace: Pace | None = None
        self._news: list[Criteria] = []
        self._band = BandShare(judging.rules)
        self._zones = Zones(judging.rules.zones, predictor.channels)
        self._sweeps = Sweeps(machine, judging.rules)
        self._suspicion = Suspicion()
        self.account = Account(judging.rules, self._band, self._zones, self._sweeps,
                               self._suspicion, of_case=list(unstable(predictor.table.stability)))
        self._teller = Teller(machine, self.account)
        self._band_ns = round(judging.band_period_s * NANOSECONDS)
        self._band_told = -REPEAT_NS, 0.0
        self.is_synthetic = False

    def take_predictor(self, predictor: Predictor, transient: Transient) -> None:
        """Judge by another unbalance or table, for which the band is not known yet."""
        comparer = self._comparer
        comparer.predictor, comparer.transient, comparer.envelope = predictor, transient, None

    def stand_beside(self, others: Sequence[Companion]) -> None:
        """Take what other machines do out of what is measured from now on."""
        apart = Apart(Companions(self.history, others, turns=self._judging.turns))
        self._comparer.stand_beside(apart)
        self._zones.machines = [self.machine.rpartition('/')[2], *(one.name for one in others)]
        self.account.beside = apart.heard

    def take_criteria(self, criteria: Criteria) -> None:
        """Judge by a band, resonances and natural speeds from now on."""
        self._comparer.envelope = criteria.envelope
        self._zones.natural = {axis: criteria.lowest_natural_speed(axis) for axis in ACROSS}
        self._sweeps.resonances = criteria.resonances
        self._sweeps.are_followed = self._is_followed
        if self._pace is None or self._pace.resonances != criteria.resonances:
            self._pace = Pace(self.history, criteria.resonances, self._unsettled)
        self._news.append(criteria)

    def on_speed(self, stamp_ns: IntArray, speed: FloatArray, angle: FloatArray) -> bool:
        """Note speeds [rad/s] and rotor angles [rad]; return whether `follow` has something."""
        self.history.add(stamp_ns, speed, angle)
        return (len(speed) > 1 or not self._comparer.pairing.is_idle
                or (self._comparer.envelope is not None
                    and self._is_band_due(int(stamp_ns[0]), float(speed[0]))))

    def follow(self, predicted: Predicted) -> Iterator[Event]:
        """Yield the band of these speeds, and the comparisons that waited for them."""
        stamp_ns, moved = predicted.stamp_ns, predicted.prediction
        speed, steady = moved.speed, predicted.steady or moved
        if self._comparer.envelope is not None:
            rows = list(self._band_rows(stamp_ns, speed))
            if rows:
                band = self._comparer.band(
                    speed[rows], steady.displacement[rows], moved.displacement[rows])
                assert band is not None
                yield Band(self.machine, stamp_ns[rows], speed[rows], band.low, band.high)
        yield from self._matched()

    def on_measured(self, measured: Measured) -> Iterator[Event]:
        """Yield the comparisons that a measurement completes."""
        self._comparer.take(measured)
        yield from self._matched()

    def in_si(self, samples: Samples) -> Samples:
        """Return raw samples in m/s^2, as the case says in which unit they are told."""
        return in_si(samples, self._judging.sensors.of(samples.channel))

    def on_samples(self, samples: Samples) -> None:
        """Keep raw samples until the tick."""
        self.is_synthetic |= samples.is_synthetic
        known = self._demodulators.get(samples.channel)
        if known is None:
            known = self._demodulators[samples.channel] = Demodulator(
                self.machine, samples.channel, self.history, turns=self._judging.turns,
                pickup=self._judging.sensors.of(samples.channel))
            known.apart = self._comparer.apart
        known.take(samples)

    def tick(self, now_ns: int, *, stale_after_s: float) -> Iterator[Event]:
        """Close the period since the last tick, and judge it."""
        while self._news:
            criteria = self._news.pop(0)
            yield Expected(self.machine, now_ns, criteria.to_arrays())
            if criteria.note:
                yield Remark(self.machine, now_ns, Level.WARN, criteria.note)
        for demodulator in self._demodulators.values():
            for found in demodulator.vectors():
                yield found
                self._comparer.take_demodulated(found)
        yield from self._refused(now_ns)
        self._comparer.pairing.tick()
        yield from self._matched(is_tick=True)
        heard, self._heard = self._heard, []
        yield from self._settle(now_ns)
        yield from self._comparer.strangers(now_ns)
        if self.account.beside is not None:
            yield from self.account.beside.news(self.machine, now_ns)
        yield from self._teller.tell(
            now_ns, stale_after_s=stale_after_s, has_data=bool(heard),
            has_phase=any(np.isfinite(each.phase).any() for each in heard),
            is_steady=self.history.is_steady, counts=self._counts(),
            refused=[f'{channel}: {why}' for channel, refusals in self.refusals.items()
                     if (why := refusals.prevailing())])

    def finish(self, now_ns: int) -> Iterator[Event]:
        """Judge what the end of the run has cut short."""
        yield from self._settle(now_ns, is_last=True)
        if self._pace is not None:
            yield from self._counted(self._sweeps.finish(now_ns))
            self._zones.close(math.inf)

    def _settle(self, now_ns: int, *, is_last: bool = False) -> Iterator[Event]:
        """Judge every point around which the speeds are known."""
        if self._pace is None:
            self._fresh = []  # without criteria nothing is judged
            return
        before = self._pace.settled_ns
        stamps, speed = self._pace.follow(is_last=is_last)
        self._silent_ticks = 0 if self._pace.settled_ns != before else self._silent_ticks + 1
        if self._silent_ticks > SILENT_TICKS:
            stamps, speed = self._pace.follow(is_last=True)
        settled_ns = math.inf if is_last or self._silent_ticks > SILENT_TICKS else (
            self._pace.settled_ns)
        for weighed in self._dated(self._pace, settled_ns):
            self._zones.take(weighed)
            self._band.see(weighed)
            self._suspicion.see(weighed)
            self._sweeps.take(weighed)
        yield from self._counted(self._sweeps.follow(
            stamps, speed, now_ns if settled_ns == math.inf else int(settled_ns)))
        self._zones.close(now_ns)
        now = self.history.last_speed
        if math.isfinite(now):
            self._zones.predict(self._comparer.velocities(self.history.last_ns, now), now)

    def _counted(self, events: Iterable[Event]) -> Iterator[Event]:
        """Count the points that are weighed for good, and hand everything on."""
        for event in events:
            if isinstance(event, Weighed):
                self._band.count(event)
            yield event

    def _dated(self, pace: Pace, settled_ns: float) -> Iterator[Weighed]:
        """Yield the points up to a stamp with their rate of speed and why they do not count."""
        waiting, self._fresh = Compared.joined(self._fresh), []
        for compared in waiting:
            known = compared.stamp_ns <= settled_ns
            if not known.all():
                self._fresh.append(compared.rows(~known))
            if known.any():
                dated = compared.rows(known)
                rate, lag = pace.at(dated.stamp_ns)
                yield Weighed(dated, rate, self._reasons(dated, lag))

    def _reasons(self, compared: Compared, lag: FloatArray) -> npt.NDArray[Any]:
        """Return why points may not be held against the machine, (n, channels)."""
        rules = self._judging.rules
        lowest, highest = self._comparer.predictor.table.speed_range
        speed = compared.speed[:, None]
        floor = np.maximum(rules.matching.noise, ABOVE_NOISE * np.maximum(
            compared.deviation, [self.runout.scatter(name) for name in compared.channels]))
        mixed_s = math.nan if compared.beside is None else compared.beside.mixed_s
        reason = np.full(compared.amplitude.shape, Reason.USED, dtype=object)
        for why, holds in (  # the last that holds is told
                (Reason.BESIDE, mixed_s >= MEMORY_S), (Reason.NOT_APART, mixed_s < MEMORY_S),
                (Reason.STILL_RINGS if self._is_followed else Reason.NOT_QUASI_STATIC,
                 ~(lag[:, None] <= rules.largest_lag)),
                (Reason.NO_PREDICTION, ~np.isfinite(compared.predicted)),
                (Reason.OUT_OF_TABLE, (speed < lowest) | (speed > highest)),
                # Noise and runout are no motion of a housing either, predicted or not.
                (Reason.BELOW_NOISE, compared.amplitude < floor),
                (Reason.SLOW_ROLL, self.runout.is_rolling(speed)),
                (Reason.NOT_FINITE, ~np.isfinite(compared.amplitude)),
                (Reason.NO_SPEED, ~np.isfinite(speed))):
            reason[np.broadcast_to(holds, reason.shape)] = why
        return reason

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
        """Yield what has found its speed and has a prediction."""
        for compared in self._comparer.compared(is_tick=is_tick):
            self._fresh.append(compared)
            matched = self._comparer.predicted(compared)
            if matched is not None:
                self._heard.append(matched)
                yield matched

    def _unsettled(self) -> Unsettled | None:
        """Return who tells what the answer leaves out; None of an answer that is steady."""
        return Unsettled(lambda: self._comparer.transient) if self._is_followed else None

    @property
    def _is_followed(self) -> bool:
        """Whether the answers follow changes of the speed."""
        return len(self._comparer.transient.poles) > 0

    def _refused(self, now_ns: int) -> Iterator[Remark]:
        """Tell when raw samples of a channel begin or cease to be refused, and why."""
        for channel, refusals in self.refusals.items():
            if (why := refusals.news()) is not None:
                yield Remark(self.machine, now_ns, Level.WARN if why else Level.OK,
                             f'{channel}: {why or "raw samples are good again"}')

    @property
    def refusals(self) -> dict[Channel, Refusals]:
        """Why stretches of raw samples gave no vector, by channel."""
        return {channel: each.refusals for channel, each in self._demodulators.items()}

    @property
    def told_twice(self) -> set[Channel]:
        """Channels of which both vectors and raw samples came; the vectors count."""
        return self._comparer.paired & set(self._demodulators)

    def _counts(self) -> dict[str, float | str]:
        found: dict[str, float | str] = {
            'without_speed': self._comparer.pairing.given_up,
            'samples_left_out': sum(each.left_out for each in self._demodulators.values()),
            'raw_channels': len(self._demodulators)}
        if self.account.beside is not None:
            found |= self.account.beside.values()
        for channel, refusals in self.refusals.items():
            found |= {f'{channel}_{key}': value for key, value in refusals.values().items()}
        return found
