"""Did a machine behave as predicted? A log is fed to the judge, with the whole run known."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from rotorsoil_ros.arrays import ComplexArray
from rotorsoil_ros.bags.feed import described_unbalance, feed, Inputs, stand_beside
from rotorsoil_ros.case import cache, config
from rotorsoil_ros.case.config import Case
from rotorsoil_ros.case.machine import Machine
from rotorsoil_ros.case.zone_limits import ZoneLimits
from rotorsoil_ros.errors import InputError
from rotorsoil_ros.monitor.comparison import Comparison, Run
from rotorsoil_ros.monitor.criteria import Expectation
from rotorsoil_ros.monitor.ground.findings import GroundCollector
from rotorsoil_ros.monitor.health import REDATED
from rotorsoil_ros.monitor.monitor import Monitor
from rotorsoil_ros.monitor.points import Collector
from rotorsoil_ros.monitor.rules import Judging, Matching, Rules
from rotorsoil_ros.wire.speeds import SpeedSource, USUAL

Progress = Callable[[int, int], None]
Descriptions = Sequence[tuple[int, Mapping[str, Any]]]


@dataclass(frozen=True)
class Wish:
    """
    How a log is to be compared, where that differs from what the case says.

    Attributes
    ----------
    machine : str
        Which machine of the log (empty: the only one).
    speed : SpeedSource
        What tells its speed.
    matching : Matching
        How points are matched and cleaned.
    amplitude_margin : float
        Share by which an amplitude may lie outside the band and still count as inside.
    zones : ZoneLimits or None
        Of housing velocity; None: those of the case.
    soil_factor : float or None
        By which G may be higher or lower; None: what the case says.
    turns : float
        Turns of the rotor that make one vector of raw samples.

    """

    machine: str = ''
    speed: SpeedSource = USUAL
    matching: Matching = field(default_factory=Matching)
    amplitude_margin: float = Rules().amplitude_margin
    zones: ZoneLimits | None = None
    soil_factor: float | None = None
    turns: float = Judging().turns


def compare(
    log: Path | str, case: Machine | Case | Path | str | None = None,
    wish: Wish | None = None, *,
    cache_directory: str | Path | None = None, progress: Progress | None = None,
) -> Comparison:
    """
    Hold what a log tells of a machine against its prediction.

    Parameters
    ----------
    log : Path or str
        Bag directory or MCAP file with the topics of a machine, under any namespace.
    case : Machine, Case, Path, str or None
        The machine, or its case file; None: the case that the log carries.
    wish : Wish
        How to compare.
    cache_directory : str, Path or None
        Of tables; the user's by default.
    progress : callable
        Called with the number of messages read and their total.

    Raises
    ------
    InputError
        If the log cannot be read, holds several machines or none, nothing measured, or no case.

    """
    wish, log = wish or Wish(), Path(log)
    if isinstance(case, Machine):
        cache_directory, case = cache_directory or case.directory, case.case
    elif isinstance(case, (Path, str)):
        case = config.load(Path(case), cache_directory=cache_directory)
    inputs = Inputs.of(log, machine=wish.machine, of=case, speed=wish.speed)
    if not inputs.is_measured:
        raise InputError(f'{log}: {inputs.machine}: nothing measured in the log (topics '
                         f'{inputs.machine}/measured/...)')
    descriptions = inputs.descriptions()
    case = case or _logged_case(log, descriptions, cache_directory)
    if wish.soil_factor is not None:
        case = replace(case, uncertainty=replace(
            case.uncertainty, shear_modulus_factor=wish.soil_factor))
    expectation = Expectation.of(case, cache.directory(cache_directory))
    machine = Machine(case, cache.directory(cache_directory))
    reading = _Reading(inputs, expectation, machine, wish, descriptions, progress)
    found, hindsight = reading.read({})
    if hindsight:  # a slow roll that comes late is the runout of what was before it, too
        found, _ = reading.read(hindsight)
    return found


@dataclass(frozen=True)
class _Reading:
    """One log, to be read once or twice."""

    inputs: Inputs
    expectation: Expectation
    machine: Machine
    wish: Wish
    descriptions: Descriptions
    progress: Progress | None

    def read(self, hindsight: Mapping[str, complex]) -> tuple[Comparison, Mapping[str, complex]]:
        """Return the comparison, and the runouts that a second reading would know earlier."""
        expectation, machine = self.expectation, self.inputs.machine
        rules = Rules(matching=self.wish.matching, amplitude_margin=self.wish.amplitude_margin,
                      zones=self.wish.zones or expectation.case.zones)
        collector, unbalances = Collector(), [(0, expectation.case.unbalance)]
        heard = GroundCollector()
        monitor = Monitor(
            machine, expectation.table, expectation.case.unbalance,
            sinks=[collector, heard],
            judging=Judging(rules, self.wish.turns, sensors=expectation.case.sensors),
            hindsight=hindsight, oils=self.machine.oils, ground=self.machine.ground)
        monitor.judge.take_criteria(expectation.criteria(expectation.case.unbalance))

        def take(stamp_ns: int, description: Mapping[str, Any]) -> None:
            unbalance = described_unbalance(description, self.expectation.table)
            if unbalance is not None and not np.array_equal(unbalance, unbalances[-1][1]):
                unbalances.append((stamp_ns, unbalance))
                monitor.set_unbalance(unbalance)
                monitor.judge.take_criteria(expectation.criteria(unbalance))

        done, beside = 0, stand_beside(self.machine, monitor, self.inputs)
        for number in feed(self.inputs, monitor, {}, on_description=take, beside=beside):
            done += number
            if self.progress:
                self.progress(done, self.inputs.number)
        judge, run = monitor.judge, self._run(monitor, collector, unbalances)
        late = judge.runout.first if judge.runout.was_missed else {}
        points = collector.points()
        return Comparison(
            run, expectation, judge.account, judge.runout, points,
            None if monitor.ground is None else heard.findings(monitor.ground, points)), late

    def _run(
        self, monitor: Monitor, collector: Collector, unbalances: list[tuple[int, ComplexArray]],
    ) -> Run:
        stamp_ns, speed = collector.speeds()
        if not len(stamp_ns):
            raise InputError(f'{self.inputs.bag}: {monitor.machine}: no speed in the log '
                             '(joint_states or rotor/speed)')
        return Run(monitor.machine, stamp_ns, speed, unbalances, self._notes(monitor),
                   monitor.judge.is_synthetic)

    def _notes(self, monitor: Monitor) -> list[str]:
        """Return what in the log could not be used, and on what the prediction rests."""
        notes = []
        if monitor.judge.is_synthetic:
            notes.append('SYNTHETIC signals: computed, not measured (so says their frame)')
        notes += [f'{channel}: measured as 1X vectors and as raw samples; from the first vector '
                  'on these are used'
                  for channel in sorted(monitor.judge.told_twice)]
        notes += [f'{channel}: {line}' for channel, refusals in monitor.judge.refusals.items()
                  for line in refusals.lines()]
        if number := monitor.health.counts['malformed']:
            notes.append(f'{number} messages are malformed and were left out')
        if not self.descriptions:
            notes.append('the log holds no prediction: the case was asked, with its own unbalance')
        elif any(described_unbalance(description, self.expectation.table) is None
                 for _, description in self.descriptions):
            notes.append('the predictions in the log rest on another table than the case: the '
                         'case was asked anew, with its own unbalance')
        notes += [f'{number} {reason.replace("_", " ")}: dated on reception'
                  for reason in REDATED if (number := monitor.health.counts[reason])]
        return notes + list(self.inputs.remarks)


def _logged_case(
    log: Path, descriptions: Descriptions, cache_directory: str | Path | None,
) -> Case:
    """Return the case that a log carries: the last, where it was reloaded."""
    for _, description in reversed(descriptions):
        content, files = description.get('document'), description.get('files', {})
        if isinstance(content, dict) and isinstance(files, dict):
            return config.case_of(log, content, cache_directory=cache_directory, files={
                str(name): str(text) for name, text in files.items()})
    raise InputError(f'{log}: does not carry the case it was answered with; give the CASE')
