"""A measured run beside its prediction: what the judge found, and what a reader should know."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
import math

import numpy as np

from rotorsoil_ros.arrays import ComplexArray, FloatArray, IntArray
from rotorsoil_ros.monitor.criteria import Expectation
from rotorsoil_ros.monitor.ground.findings import GroundFindings
from rotorsoil_ros.monitor.passage import PeakPair
from rotorsoil_ros.monitor.points import ChannelPoints, Statistics, statistics
from rotorsoil_ros.monitor.rules import Rules
from rotorsoil_ros.monitor.vectors.pairing import Runout
from rotorsoil_ros.monitor.verdict import Account, Verdict
from rotorsoil_ros.monitor.zones import HousingZone
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
    unbalances : sequence of (int, (p,) complex array)
        From which stamp on which unbalance was predicted with [kg m].
    notes : sequence of str
        What in the log could not be used.
    is_synthetic : bool
        Whether its signals say of themselves that they were computed, not measured.

    """

    machine: str
    stamp_ns: IntArray
    speed: FloatArray
    unbalances: Sequence[tuple[int, ComplexArray]]
    notes: Sequence[str]
    is_synthetic: bool = False

    @property
    def time(self) -> FloatArray:
        """Time since the first speed, (m,) [s]."""
        return np.asarray((self.stamp_ns - self.stamp_ns[:1]) * 1e-9)

    @property
    def title(self) -> str:
        """Name of the machine, and that its signals are synthetic where they are."""
        return f'{self.machine}, SYNTHETIC signals' if self.is_synthetic else self.machine


@dataclass(frozen=True, eq=False)
class Comparison:
    """
    A measured run beside its prediction.

    Attributes
    ----------
    run : Run
        The log.
    expectation : Expectation
        The case.
    account : Account
        What the judge has found out.
    runout : Runout
        What was subtracted.
    points : list of ChannelPoints
        One for each measured channel.
    ground : GroundFindings or None
        What sensors on the ground say; None of a case without any.

    """

    run: Run
    expectation: Expectation
    account: Account
    runout: Runout
    points: list[ChannelPoints]
    ground: GroundFindings | None = None

    @property
    def rules(self) -> Rules:
        """By which it was judged."""
        return self.account.rules

    @property
    def verdict(self) -> Verdict:
        """What is to be said in one word."""
        return self.account.verdict()

    @property
    def failures(self) -> list[str]:
        """What speaks against the machine."""
        return self.account.failures()

    @property
    def peaks(self) -> list[PeakPair]:
        """Peaks of all channels."""
        return self.account.peaks

    @property
    def zones(self) -> list[HousingZone]:
        """Worst zone of every housing, predicted and measured."""
        return self.account.worst_zones

    @cached_property
    def statistics(self) -> list[Statistics]:
        """Figures of each channel, in the order of the points."""
        return [statistics(channel, margin=self.rules.amplitude_margin,
                           inside=self.account.inside) for channel in self.points]

    @cached_property
    def remarks(self) -> list[str]:
        """What else a reader should know."""
        ground = [] if self.ground is None else self.ground.remarks
        return [*self.run.notes, *self._of_the_case(), *ground, *self._of_channels(),
                *self._of_peaks()]

    def _of_the_case(self) -> Iterator[str]:
        yield from () if self.account.beside is None else self.account.beside.lines()
        if said := self.account.suspicion.said:
            yield said
        if self.expectation.note:
            yield self.expectation.note
        if self.expectation.band is None:
            yield 'no band on this support: of the amplitudes only peaks are judged'

    def _of_channels(self) -> Iterator[str]:
        slow_roll = self.rules.matching.slow_roll_speed
        for channel in self.points:
            if not np.isfinite(channel.phase).any():
                yield f'{channel.channel}: no phase measured: amplitudes only are compared'
            if not channel.used.any():
                yield f'{channel.channel}: none of {len(channel.speed)} points could be used'
            if not math.isnan(slow_roll) and math.isnan(self.runout.of(channel.channel).real):
                yield (f'{channel.channel}: no vector near the slow-roll speed of '
                       f'{rad_s_to_rpm(slow_roll):.0f} rpm: no runout subtracted')
        for entry in self.zones:
            if not entry.zone:
                yield (f'{entry.channel}: no zone {entry.source}: at least '
                       f'{1e3 * entry.velocity:.3g} mm/s rms, as not every machine that shakes '
                       'it is known')
            if entry.source == 'measured' and not entry.is_steady:
                yield (f'{entry.channel}: no constant speed in the run; its zone is the worst in '
                       'passing')

    def _of_peaks(self) -> Iterator[str]:
        for channel, lobes in self.account.sweeps.lobes.items():
            yield (f'{channel}: smaller peaks after a passage too fast, taken as its free '
                   'vibration: ' + ', '.join(f'{rad_s_to_rpm(speed):.0f} rpm' for speed in lobes))
        for peak in self.peaks:
            if (peak.measured is not None and not peak.is_slow
                    and math.isfinite(peak.damping_ratio)):
                yield (f'{peak.channel}: the peak at '
                       f'{rad_s_to_rpm(peak.measured.speed):.0f} rpm was passed too fast to be '
                       'as high and where it would be at constant speed')
