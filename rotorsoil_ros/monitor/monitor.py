"""What should the machine do at the speed it has just reported? Look it up, never invent it."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
import math

import numpy as np

from rotorsoil_ros.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from rotorsoil_ros.case.summary import unstable
from rotorsoil_ros.errors import OutOfTableError
from rotorsoil_ros.events import (
    Diagnostics,
    Event,
    Level,
    Measured,
    Model,
    Predicted,
    Remark,
    Samples,
    Sink,
)
from rotorsoil_ros.machine.response import Predictor, ResponseTable
from rotorsoil_ros.machine.transient.state import Transient
from rotorsoil_ros.machine.transmissibility import MovingGround
from rotorsoil_ros.monitor.beside.companions import Companion
from rotorsoil_ros.monitor.ground.attribution import Attribution
from rotorsoil_ros.monitor.health import Health, STANDING, STANDSTILL
from rotorsoil_ros.monitor.judge import Judge
from rotorsoil_ros.monitor.oil import Oils, OilTables
from rotorsoil_ros.monitor.rules import Judging
from rotorsoil_ros.monitor.vectors.history import History
from rotorsoil_ros.prediction import Prediction
from rotorsoil_ros.units import rad_s_to_rpm, SPEED_UNITS

# In which a speed is a larger number than in rad/s.
LARGER_UNITS = {'rpm': 'rpm', 'deg_s': 'deg/s'}
FAR_ABOVE = 1.5
NO_ANSWER = complex(np.nan, np.nan)


class Monitor:
    """
    Answer every reported speed of one machine from its response table.

    A batch of one (live) and of thousands (offline) take the same path and give bitwise the
    same numbers. No clock is read: every time comes in with the caller.
    """

    def __init__(
        self, machine: str, table: ResponseTable, unbalance: ComplexArray, *,
        sinks: Sequence[Sink], judging: Judging | None = None,
        hindsight: Mapping[str, complex] | None = None, oils: Oils | None = None,
        ground: MovingGround | None = None,
    ) -> None:
        self.machine = machine
        self.table = table
        self.health = Health(machine, table.speed_range)
        self.health.standing = '; '.join(unstable(table.stability))
        self._sinks = tuple(sinks)
        self._unbalance, self._oils = unbalance, OilTables(oils or {})
        self._predictor, self._transient = table.predictor(unbalance), Transient(table.poles)
        self.judge = Judge(machine, self._predictor, judging or Judging(),
                           transient=self._transient, hindsight=hindsight)
        self._beside: Sequence[Companion] = ()
        self._listen(ground, judging)

    @property
    def predictor(self) -> Predictor:
        """What its predictions are looked up in now."""
        return self._predictor

    @property
    def history(self) -> History:
        """What is told of its speed."""
        return self.judge.history

    def stand_beside(self, others: Sequence[Companion]) -> None:
        """Take the parts of other machines out of what is measured of this one from now on."""
        self._beside = tuple(others)
        if others:
            self.judge.stand_beside(others)
        if others and self.ground is not None:
            self.ground.stand_beside(others)

    def _listen(self, ground: MovingGround | None, judging: Judging | None) -> None:
        """Hear sensors on the ground, where there are any."""
        self.ground = None if ground is None else Attribution(
            self.machine, ground, judging or Judging(), self.judge.history,
            self.judge.account.zones)

    def set_unbalance(self, unbalance: ComplexArray) -> None:
        """Use another unbalance, (planes,) [kg m], from the next speed on."""
        self._unbalance = unbalance
        self._predictor = self.table.predictor(unbalance)
        # What rings does so whatever the unbalance: it is followed as before.
        self.judge.take_predictor(self._predictor, self._transient)

    def on_speed(
        self, stamp_ns: IntArray, speed: FloatArray, angle: FloatArray | None = None,
    ) -> None:
        """Answer speeds [rad/s] at stamps [ns]; angles of the rotor [rad]; all (n,)."""
        if not len(speed):
            return
        self.health.receive(stamp_ns, speed)
        try:
            steady, answered = self._predictor.predict(speed), speed
            self.health.note('answered', len(speed))
        except OutOfTableError:
            steady, answered = self._predict_with_gaps(speed)
        prediction = self._predictor.moved(steady, self._transient.follow(stamp_ns, answered))
        predicted = Predicted(self.machine, stamp_ns, prediction,
                              steady if len(self.table.poles) else None)
        self._emit(predicted)
        if self.judge.on_speed(
                stamp_ns, speed, np.full(len(speed), np.nan) if angle is None else angle):
            self._emit_all(self.judge.follow(predicted))
        if self.health.has_news:
            self._emit(self.health.announce(int(stamp_ns[-1])))

    def take_table(
        self, table: ResponseTable, unbalance: ComplexArray, *, sinks: Sequence[Sink],
        judging: Judging | None = None, oils: Oils | None = None,
        ground: MovingGround | None = None,
    ) -> None:
        """Answer from another table and judge by other rules, from the next speed on."""
        self._unbalance, self._oils = unbalance, OilTables(oils or {})
        self._sinks = tuple(sinks)
        self._stand_on(table)
        self._predictor = table.predictor(unbalance)
        self.judge = Judge(self.machine, self._predictor, judging or Judging(),
                           transient=self._transient)
        self._listen(ground, judging)
        self.stand_beside(self._beside)

    def _stand_on(self, table: ResponseTable) -> None:
        self.table, self._transient = table, Transient(table.poles)
        self.health.speed_range = table.speed_range
        self.health.standing = '; '.join(unstable(table.stability))

    def on_oil_temperature(self, stamp_ns: IntArray, celsius: FloatArray) -> None:
        """Answer from the tables of the oil's temperatures (n,) [deg C], from now on."""
        for stamp, degrees in zip(stamp_ns.tolist(), celsius.tolist(), strict=True):
            if (table := self._oils.chosen(degrees)) is None:
                continue
            self._stand_on(table)
            self.set_unbalance(self._unbalance)
            self._emit(Remark(self.machine, stamp, Level.OK, self._oils.words(degrees)))
            for text in unstable(table.stability):
                self._emit(Remark(self.machine, stamp, Level.ERROR, text))

    def on_measured(self, measured: Measured) -> None:
        """Hand on what a measuring system says about this machine."""
        self.health.note('measured', len(measured.stamp_ns))
        self._emit(measured)
        of_machine = measured if self.ground is None else self.ground.take_measured(measured)
        if of_machine is not None:
            self._emit_all(self.judge.on_measured(of_machine))

    def on_samples(self, samples: Samples) -> None:
        """Hand on raw samples; the vectors that are in them are found at the next tick."""
        self.health.note('samples', len(samples.stamp_ns))
        samples = self.judge.in_si(samples)
        self._emit(samples)
        self.judge.on_samples(samples)
        if self.ground is not None:
            self.ground.take_housing(samples)

    def on_ground(self, sensor: str, samples: Samples) -> None:
        """Hand on raw samples of a sensor on the ground."""
        if self.ground is not None:
            self.health.note('samples', len(samples.stamp_ns))
            self.judge.is_synthetic |= samples.is_synthetic
            self.ground.take(sensor, samples)

    def begin(self, now_ns: int, description: Mapping[str, object]) -> None:
        """Begin to watch, and say what the predictions rest on."""
        self.health.begin(now_ns)
        self.describe(now_ns, description)

    def describe(self, now_ns: int, description: Mapping[str, object]) -> None:
        """Say what the predictions rest on from now on."""
        self._emit(Model(self.machine, now_ns, description))
        for text in unstable(self.table.stability):
            self._emit(Remark(self.machine, now_ns, Level.ERROR, text))

    def tick(self, now_ns: int, *, stale_after_s: float) -> None:
        """Report the health of the machine over the time since the last tick."""
        parts = self._told(self.judge.tick(now_ns, stale_after_s=stale_after_s))
        if self.ground is not None:
            parts += self._told(self.ground.tick(
                now_ns, self._predictor, stale_after_s=stale_after_s))
        self._emit_all(Remark(self.machine, now_ns, Level.WARN, text)
                       for text in self.health.news())
        health = self.health.tick(now_ns, stale_after_s=stale_after_s)
        self._emit(replace(health, parts=tuple(parts)) if parts else health)

    def finish(self, now_ns: int) -> None:
        """Say what can only be said at the end of a run."""
        self._told(self.judge.finish(now_ns))
        if self.ground is not None:
            self._told(self.ground.tick(now_ns, self._predictor, stale_after_s=math.inf,
                                        is_last=True))

    def _told(self, events: Iterable[Event]) -> list[Diagnostics]:
        """Hand events on; return the health of parts, which is told with that of the whole."""
        parts = []
        for event in events:
            if isinstance(event, Diagnostics):
                parts.append(event)
            else:
                self._emit_all([event])
        return parts

    def _emit(self, event: Event) -> None:
        for sink in self._sinks:
            sink(event)

    def _emit_all(self, events: Iterable[Event]) -> None:
        for event in events:
            if self.ground is not None:
                self.ground.see(event)
            self._emit(event)

    def _predict_with_gaps(self, speed: FloatArray) -> tuple[Prediction, FloatArray]:
        """Answer what is covered; count the reason and leave NaN where nothing is, (n,) too."""
        covered = self._predictor.covers(speed)
        for reason, holds in self._reasons(speed[~covered]).items():
            self.health.note(reason, int(np.count_nonzero(holds)))
        shape = (len(speed), len(self.table.channels))
        displacement, force = np.full(shape, NO_ANSWER), np.full(shape, NO_ANSWER)
        if covered.any():
            answer = self._predictor.predict(speed[covered])
            self.health.note('answered', len(answer.speed))
            displacement[covered], force[covered] = answer.displacement, answer.force
        self._suspect_unit(speed)
        return Prediction(speed, displacement, force), np.where(covered, speed, np.nan)

    def _suspect_unit(self, speed: FloatArray) -> None:
        """Ask back where speeds above the table lie in it in another unit."""
        lowest, highest = self.table.speed_range
        # Of a machine that was answered it may be an overspeed, unless it is far above.
        most = highest * (FAR_ABOVE if self.health.counts['answered'] else 1.0)
        above = speed[speed > most]
        if not len(above) or self.health.speed_unit != 'rad_s':
            return
        told = float(above[-1])
        for unit, name in LARGER_UNITS.items():
            if lowest <= told * SPEED_UNITS[unit] <= highest:
                self.health.explain('above_table', f'{told:.0f} rad/s is '
                                    f'{rad_s_to_rpm(told):.0f} rpm; did you send {name}?')
                return
        self.health.explanations.pop('above_table', None)

    def _reasons(self, speed: FloatArray) -> dict[str, BoolArray]:
        """Tell for each reason which of the speeds have no answer because of it."""
        lowest, highest = self.table.speed_range
        reasons = {'nan': np.isnan(speed), 'infinite': np.isinf(speed)}
        finite = np.isfinite(speed)
        stands = finite & (np.abs(speed) <= STANDSTILL * highest) & (speed < lowest)
        reasons[STANDING] = stands
        reasons['negative'] = finite & (speed < 0.0) & ~stands
        reasons['below_table'] = finite & (speed >= 0.0) & (speed < lowest) & ~stands
        reasons['above_table'] = finite & (speed > highest)
        inside = finite & (speed >= lowest) & (speed <= highest)
        reasons['unstable'] = inside & ~self.table.stability.holds(speed)
        known = np.logical_or.reduce(list(reasons.values()))
        reasons['unresolved'] = ~known
        return reasons
