"""Whether the machine of a case behaves as its physics says, and if not, where."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
import math

import numpy as np

from rotorsoil_ros.arrays import ComplexArray, FloatArray, IntArray
from rotorsoil_ros.channel import Channel
from rotorsoil_ros.errors import InputError
from rotorsoil_ros.monitor.criteria import Expectation
from rotorsoil_ros.monitor.passage import PeakPair, told_once
from rotorsoil_ros.monitor.peak_pairs import peak_fault, peaks_of
from rotorsoil_ros.monitor.points import (
    ChannelPoints,
    match,
    Reference,
    Signal,
    Statistics,
    statistics,
)
from rotorsoil_ros.monitor.quasistatic import Resonance
from rotorsoil_ros.monitor.rules import Rules
from rotorsoil_ros.monitor.zones import housing_zones, HousingZone
from rotorsoil_ros.units import rad_s_to_rpm


@dataclass(frozen=True, slots=True, eq=False)
class Run:
    """
    What a log tells of one machine.

    Attributes
    ----------
    machine : str
        Its name in the log.
    stamp_ns, speed : (m,) arrays
        Reported speeds, ascending [ns], [rad/s].
    channels : tuple of Channel
        What a node predicted; empty if none did.
    displacement : (m, c) complex array
        Its answers [m, rad], NaN where there is none.
    signals : mapping of str to Signal
        What was measured.
    unbalances : sequence of (int, mapping)
        From which stamp on the node took which unbalance, by plane [kg m].
    description : mapping
        What the node said of its model; empty if it did not.
    notes : sequence of str
        What in the log could not be used.
    is_synthetic : bool
        Whether its signals say of themselves that they were computed, not measured.

    """

    machine: str
    stamp_ns: IntArray
    speed: FloatArray
    channels: tuple[Channel, ...]
    displacement: ComplexArray
    signals: Mapping[str, Signal]
    unbalances: Sequence[tuple[int, Mapping[str, complex]]]
    description: Mapping[str, object]
    notes: Sequence[str]
    is_synthetic: bool = False

    @property
    def title(self) -> str:
        """Name of the machine, and that its signals are synthetic where they are."""
        return f'{self.machine}, SYNTHETIC signals' if self.is_synthetic else self.machine


class Verdict(StrEnum):
    """What is to be said of the machine in one word."""

    PASSES = 'passes'
    FAILS = 'fails'
    UNDECIDED = 'undecided'


@dataclass(frozen=True)
class Comparison:
    """
    A measured run beside its prediction.

    Attributes
    ----------
    run : Run
        The log.
    expectation : Expectation or None
        The case, if it is known.
    rules : Rules
        By which it was judged.
    reference : Reference
        Predictions.
    points, statistics : list
        One for each measured channel.
    peaks : list of PeakPair
        Peaks of all channels.
    zones : list of HousingZone
        Of predicted and measured housings.
    failures, remarks : list of str
        What speaks against the machine, and what else a reader should know.

    """

    run: Run
    expectation: Expectation | None
    rules: Rules
    reference: Reference
    points: list[ChannelPoints]
    statistics: list[Statistics]
    peaks: list[PeakPair]
    zones: list[HousingZone]
    failures: list[str]
    remarks: list[str]

    @property
    def verdict(self) -> Verdict:
        """Failing for any reason; undecided where nothing could be held against anything."""
        if self.failures:
            return Verdict.FAILS
        judged = any(not math.isnan(entry.inside) for entry in self.statistics) or any(
            pair.predicted and pair.measured and pair.is_slow for pair in self.peaks)
        return Verdict.PASSES if judged else Verdict.UNDECIDED


def compare(run: Run, expectation: Expectation | None, rules: Rules) -> Comparison:
    """
    Hold a run against its prediction.

    Parameters
    ----------
    run : Run
        What was logged.
    expectation : Expectation or None
        The case; without it there is no band, no critical speed of the model, no damping and
        no class of the support.
    rules : Rules
        When the machine behaves as predicted.

    Raises
    ------
    InputError
        If the log holds nothing measured, or no prediction and no case is given.

    """
    if not run.signals:
        raise InputError(f'{run.machine}: nothing measured in the log (topics '
                         f'{run.machine}/measured/...)')
    reference, remarks = _reference(run, expectation)
    remarks = [*run.notes, *remarks]
    resonances = [] if expectation is None else expectation.resonances
    points = match(run.signals, reference, resonances, rules.matching)
    peaks: list[PeakPair] = []
    for channel in points:
        found, lobes = peaks_of(
            channel, reference, resonances, margin=rules.critical_margin)
        peaks += found
        if lobes:
            remarks.append(f'{channel.channel}: smaller peaks after a passage too fast, taken as '
                           'its free vibration: ' + ', '.join(
                               f'{rad_s_to_rpm(lobe.speed):.0f} rpm' for lobe in lobes))
    peaks = told_once(peaks)
    seen = _as_measured(peaks)
    if seen:
        # The machine rings where it really resonates, not where it should.
        points = match(run.signals, reference, [*resonances, *seen], rules.matching)
    figures = [statistics(channel, margin=rules.amplitude_margin) for channel in points]
    zones = [] if expectation is None else [
        found for channel in points
        if channel.channel.is_housing and channel.channel in reference.channels
        for found in housing_zones(channel, reference, expectation, limits=rules.zones,
                                   tolerance=rules.matching.tolerance)]
    comparison = Comparison(run, expectation, rules, reference, points, figures, peaks, zones,
                            [], remarks)
    remarks += _remarks(comparison)
    return replace(comparison, failures=list(_failures(comparison)), remarks=remarks)


def _reference(run: Run, expectation: Expectation | None) -> tuple[Reference, list[str]]:
    """Return the node's answers where they rest on the case, else those of the case."""
    if not len(run.stamp_ns):
        raise InputError(f'{run.machine}: no speed in the log (joint_states or rotor/speed)')
    answered = bool(run.channels) and bool(np.isfinite(run.displacement).any())
    if expectation is None:
        if not answered:
            raise InputError(f'{run.machine}: the log holds no prediction; give the CASE')
        nothing = np.full(run.displacement.shape, np.nan)
        found = np.array(_numbers(run.description.get('speed_range_rad_s')) or [0.0, np.inf])
        return Reference(
            run.stamp_ns, run.speed, run.channels, run.displacement, nothing, nothing,
            nothing, nothing, (float(found[0]), float(found[1]))), [
            'no case given: no band, no critical speeds and damping of the model (nothing is '
            'marked as not quasi-static but around measured peaks), no zones']
    tables = run.description.get('tables')
    key = tables.get('response') if isinstance(tables, Mapping) else None
    own = [(0, expectation.case.unbalance)]
    if answered and key == expectation.table.key and run.channels == expectation.table.channels:
        logged = [(stamp, expectation.vector(unbalances)) for stamp, unbalances in run.unbalances]
        return expectation.reference(run.stamp_ns, run.speed, logged or own,
                                     run.displacement), []
    remark = ('the predictions in the log rest on another table than the case: the case was '
              'asked anew, with its own unbalance' if answered else
              'the log holds no prediction: the case was asked, with its own unbalance')
    return expectation.reference(run.stamp_ns, run.speed, own), [remark]


def _numbers(value: object) -> list[float]:
    if isinstance(value, list) and len(value) == 2 and all(
            isinstance(entry, (int, float)) for entry in value):
        return [float(entry) for entry in value]
    return []


def _as_measured(peaks: Sequence[PeakPair]) -> list[Resonance]:
    """Return resonances where peaks were measured, damped as the predicted ones beside them."""
    return [Resonance(end, peak.damping_ratio) for peak in peaks
            if peak.measured is not None and math.isfinite(peak.damping_ratio)
            for end in sorted(set(peak.measured.critical_range(peak.damping_ratio)))]


def _failures(comparison: Comparison) -> list[str]:
    """Return what speaks against the machine, each in one line."""
    rules, found = comparison.rules, []
    for channel, figures in zip(comparison.points, comparison.statistics, strict=True):
        if figures.inside < rules.inside_share:
            found.append(f'{channel.channel}: {100 * figures.inside:.0f} % of the amplitudes lie '
                         f'inside the band, {100 * rules.inside_share:.0f} % should')
    found += [line for peak in comparison.peaks if (
        line := peak_fault(peak, margin=rules.critical_margin))]
    found += [f'{entry.channel}: zone D, {1e3 * entry.velocity:.2f} mm/s rms measured at '
              f'{rad_s_to_rpm(entry.speed):.0f} rpm' for entry in comparison.zones
              if entry.source == 'measured' and entry.zone == 'D' and entry.is_steady]
    return found


def _remarks(comparison: Comparison) -> list[str]:
    found = []
    if comparison.expectation is not None and comparison.expectation.note:
        found.append(comparison.expectation.note)
    if comparison.expectation is not None and comparison.expectation.band is None:
        found.append('no band on this support: of the amplitudes only peaks are judged')
    for channel in comparison.points:
        if not np.isfinite(channel.phase).any():
            found.append(f'{channel.channel}: no phase measured: amplitudes only are compared')
        if not channel.used.any():
            found.append(f'{channel.channel}: none of {len(channel.speed)} points could be used')
        speed = comparison.rules.matching.slow_roll_speed
        if not math.isnan(speed) and math.isnan(channel.runout.real):
            found.append(f'{channel.channel}: no vector near the slow-roll speed of '
                         f'{rad_s_to_rpm(speed):.0f} rpm: no runout subtracted')
    for entry in comparison.zones:
        if entry.source == 'measured' and not entry.is_steady:
            found.append(f'{entry.channel}: no constant speed in the run; its zone is the worst '
                         'in passing')
    for peak in comparison.peaks:
        if (peak.measured is not None and not peak.is_slow
                and math.isfinite(peak.damping_ratio)):
            found.append(f'{peak.channel}: the peak at '
                         f'{rad_s_to_rpm(peak.measured.speed):.0f} rpm was passed too fast to '
                         'be as high and where it would be at constant speed')
    return found
