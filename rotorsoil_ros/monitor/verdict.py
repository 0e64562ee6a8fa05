"""What is to be said of a machine: of a run in one word, and while it runs in sentences."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from enum import StrEnum
import math

from rotorsoil_ros.channel import Channel
from rotorsoil_ros.events import Diagnostics, Event, Level, NANOSECONDS, Remark, Zoned
from rotorsoil_ros.monitor.beside.heard import HeardBeside
from rotorsoil_ros.monitor.inside import BandShare
from rotorsoil_ros.monitor.passage import peak_fault, PeakPair
from rotorsoil_ros.monitor.rules import Rules
from rotorsoil_ros.monitor.suspicion import Suspicion
from rotorsoil_ros.monitor.sweep import Sweeps
from rotorsoil_ros.monitor.zones import HousingState, HousingZone, worst_state, Zones
from rotorsoil_ros.units import rad_s_to_rpm

VIBRATION = 'vibration'
LEVELS = {'A': Level.OK, 'B': Level.OK, 'C': Level.WARN, 'D': Level.ERROR}
MM = 1e3


class Verdict(StrEnum):
    """What is to be said of the machine in one word."""

    PASSES = 'passes'
    FAILS = 'fails'
    UNDECIDED = 'undecided'


class Account:
    """What a judge has found out about a run so far: shares, peaks, zones, and what they say."""

    def __init__(
        self, rules: Rules, band: BandShare, zones: Zones, sweeps: Sweeps,
        suspicion: Suspicion, *, of_case: Sequence[str] = (),
    ) -> None:
        self.rules, self.band, self.zones, self.sweeps = rules, band, zones, sweeps
        self.suspicion = suspicion
        self._of_case = of_case
        self.beside: HeardBeside | None = None

    @property
    def inside(self) -> dict[Channel, float]:
        """Share of the points of a channel that lie inside the band, of all that count."""
        return self.band.of_run()

    @property
    def peaks(self) -> list[PeakPair]:
        """Peaks that were passed, predicted beside measured."""
        return self.sweeps.peaks

    @property
    def worst_zones(self) -> list[HousingZone]:
        """Worst zone of every housing, predicted and measured."""
        return self.zones.worst()

    def failures(self) -> list[str]:
        """Return what speaks against the machine, each in one line; first what its case says."""
        return [*self._of_case, *(text for _, text in self._faults())]

    def _faults(self) -> Iterator[tuple[str, str]]:
        """Yield what was measured against the machine, and where."""
        rules = self.rules
        if self.suspicion.is_of_unit:
            return  # amplitudes of another unit speak neither for the machine nor against
        for channel, share in self.inside.items():
            if share < rules.inside_share:
                mixed = [] if self.beside is None else self.beside.mixed_at(channel)
                yield channel, (
                    f'{channel}: {100 * share:.0f} % of the amplitudes lie inside the band, '
                    f'{100 * rules.inside_share:.0f} % should'
                    + (f'; {", ".join(mixed)} may be why, not told apart' if mixed else ''))
        for peak in self.peaks:
            if fault := peak_fault(peak, margin=rules.critical_margin):
                yield peak.channel, fault
        for entry in self.worst_zones:
            if entry.source == 'measured' and entry.zone == 'D' and entry.is_steady:
                yield entry.channel, (
                    f'{entry.channel}: zone D, {MM * entry.velocity:.2f} mm/s rms measured at '
                    f'{rad_s_to_rpm(entry.speed):.0f} rpm{shared(entry.shares)}')

    def verdict(self) -> Verdict:
        """Failing for any reason; undecided where nothing could be held against anything."""
        return self._word(bool(self.failures()), bool(self.inside) or any(
            peak.is_complete and peak.is_slow for peak in self.peaks))

    def verdicts(self) -> dict[str, Verdict]:
        """Say the same of every channel that was measured."""
        failing, inside = {channel for channel, _ in self._faults()}, self.inside
        passed = {peak.channel for peak in self.peaks if peak.is_complete and peak.is_slow}
        return {channel: self._word(channel in failing, channel in inside or channel in passed)
                for channel in dict.fromkeys([*self.band.channels, *self.zones.measured])}

    def _word(self, fails: bool, is_judged: bool) -> Verdict:
        if fails:
            return Verdict.FAILS
        return Verdict.PASSES if is_judged and not self.suspicion.said else Verdict.UNDECIDED


class Teller:
    """Tells at every tick how the machine vibrates, and remarks on what has changed."""

    def __init__(self, machine: str, account: Account) -> None:
        self._machine = machine
        self._account = account
        self._heard_ns: int | None = None
        self._zones: dict[Channel, str] = {}
        self._is_stale = False
        self._suspected = ''

    def tell(
        self, now_ns: int, *, stale_after_s: float, has_data: bool, has_phase: bool,
        is_steady: Callable[[], bool], counts: Mapping[str, float | str],
        refused: Sequence[str] = (),
    ) -> Iterator[Event]:
        """
        Yield zones, remarks and the diagnostics of a period.

        Parameters
        ----------
        now_ns, stale_after_s : int, float
            Time of the tick [ns], and how long silence is no news [s].
        has_data, has_phase : bool
            Whether something was compared since the last tick, and whether with its phase.
        is_steady : callable
            Tells whether the speed is constant; limits of zones are made for that.
        counts : mapping
            What else belongs to the values.
        refused : sequence of str
            Which raw samples cannot be used at present, and why.

        """
        if has_data or (self._heard_ns is not None and now_ns < self._heard_ns):
            self._heard_ns = now_ns
        stale = (self._heard_ns is None
                 or now_ns - self._heard_ns > stale_after_s * NANOSECONDS)
        yield from self._changes(now_ns, is_steady, is_stale=stale)
        zones = {channel: state.zone or '' for channel, state in
                 self._account.zones.predicted.items()}
        yield Zoned(self._machine, now_ns, zones, {} if stale else dict(self._zones))
        if self._heard_ns is None and not refused:
            return  # a machine without sensors is not stale
        level, summary = self._level(is_steady)
        if stale:
            level, summary = Level.STALE, self._silence()
        elif not has_phase and has_data:
            summary += '; no phase reference: amplitudes only'
        if refused:  # a sensor without use is no silence, and no fault of the machine
            level = Level.WARN if stale else max(level, Level.WARN)
            summary = '; '.join([*refused, summary])
        yield Diagnostics(self._machine, now_ns, level, summary,
                          {**self._values(), **counts}, VIBRATION)

    def _changes(
        self, now_ns: int, is_steady: Callable[[], bool], *, is_stale: bool,
    ) -> Iterator[Remark]:
        """Yield a remark for every zone and every band that was left or entered."""
        if is_stale != self._is_stale and self._heard_ns is not None:
            self._is_stale = is_stale
            yield Remark(self._machine, now_ns, Level.STALE if is_stale else Level.OK,
                         'nothing is measured any more' if is_stale else
                         'measurements are back')
        if (suspected := self._account.suspicion.said) != self._suspected:
            self._suspected = suspected
            yield Remark(self._machine, now_ns, Level.WARN if suspected else Level.OK,
                         suspected or 'what is measured looks like what it is')
        for channel, state in self._account.zones.measured.items():
            before = self._zones.get(channel)
            if state.zone is None and before is not None:
                del self._zones[channel]
                yield Remark(self._machine, now_ns, Level.WARN,
                             f'{channel}: no zone (was {before}), {MM * state.velocity:.2f} mm/s '
                             f'rms{shared(state.shares)}')
            if state.zone is not None and state.zone != before:
                self._zones[channel] = state.zone
                came = f' (was {before})' if before else ''
                yield Remark(self._machine, now_ns, _level(state, is_steady),
                             f'{channel}: zone {state.zone}{came}, '
                             f'{MM * state.velocity:.2f} mm/s rms{shared(state.shares)}')
        for channel, is_outside in self._account.band.settle():
            said = 'has left' if is_outside else 'is back in'
            share = 100.0 * self._account.band.recent(channel)
            yield Remark(self._machine, now_ns, Level.WARN if is_outside else Level.OK,
                         f'{channel}: {said} the band of the prediction, {share:.0f} % of the '
                         'amplitudes lie in it')

    def _level(self, is_steady: Callable[[], bool]) -> tuple[Level, str]:
        """Return level and sentence of what is measured."""
        zones, level, said = self._account.zones, Level.OK, []
        for source, states in (('measured', zones.measured), ('predicted', zones.predicted)):
            if found := worst_state(states):
                said.append(_zone(source, *found))
            elif missing := {name for state in states.values()
                             for name, share in state.shares.items() if math.isnan(share)}:
                said.append(f'{source} no zone: nothing is known of {", ".join(sorted(missing))}')
                level = Level.WARN
        if found := worst_state(zones.measured):
            level = _level(found[1], is_steady)
            if level is not LEVELS[found[1].zone or 'A']:
                said.append('speed changes')
        faults = list(self._account.sweeps.faults)
        for channel, state in zones.measured.items():
            # An alarm without a baseline is where zone C begins, which is told already.
            if (limit := state.exceeds) and (limit == 'trip' or state.zone in ('A', 'B')):
                faults.insert(0, f'{channel} is above its {limit} limit of '
                                 f'{MM * getattr(state, limit):.2f} mm/s rms')
        if outside := self._account.band.outside:
            faults.insert(0, f'outside the band: {", ".join(sorted(outside))}')
        if suspected := self._account.suspicion.said:
            faults.insert(0, suspected)
            if self._account.suspicion.is_of_unit:  # then its zone is no news of the machine
                level = min(level, Level.WARN)
        if faults:
            level = max(level, Level.WARN)
        return level, '; '.join([*said, *faults]) or 'compared with the prediction'

    def _silence(self) -> str:
        said = 'nothing measured'
        if found := worst_state(self._account.zones.predicted):
            said += f'; {_zone("predicted", *found)}'
        return said

    def _values(self) -> dict[str, float | str]:
        """Return what is known of every channel, by keys that say their unit."""
        found: dict[str, float | str] = {}
        zones, band = self._account.zones, self._account.band
        for source, states in (('measured', zones.measured), ('predicted', zones.predicted)):
            for channel, state in states.items():
                found[f'{channel}_{source}_mm_s_rms'] = MM * state.velocity
                found[f'{channel}_{source}_zone'] = state.zone or ''
                found[f'{channel}_{source}_support'] = state.support or ''
                if state.shares:
                    found[f'{channel}_{source}_shares'] = percent(state.shares)
                if source == 'measured':
                    found[f'{channel}_alarm_mm_s_rms'] = MM * state.alarm
                    found[f'{channel}_trip_mm_s_rms'] = MM * state.trip
        for channel in band.channels:
            found[f'{channel}_inside_band'] = band.recent(channel)
        for channel, share in band.of_run().items():
            found[f'{channel}_inside_band_of_run'] = share
        found['verdict'] = self._account.verdict()
        found |= {f'{name}_verdict': verdict
                  for name, verdict in self._account.verdicts().items()}
        return found


def _level(state: HousingState, is_steady: Callable[[], bool]) -> Level:
    """Return what a zone means; while the speed changes its limits do not strictly hold."""
    level = LEVELS[state.zone or 'A']
    return Level.WARN if level is Level.ERROR and not is_steady() else level


def _zone(source: str, channel: str, state: HousingState) -> str:
    return (f'zone {state.zone} {source} ({channel}, {MM * state.velocity:.2f} mm/s rms, '
            f'{state.support} support{shared(state.shares)})')


def percent(shares: Mapping[str, float]) -> str:
    """Return what each of several machines has in a velocity; nothing where that is not known."""
    return ', '.join(f'{name} not known' if math.isnan(share) else f'{name} {share:.0%}'
                     for name, share in shares.items())


def shared(shares: Mapping[str, float]) -> str:
    """Return what each of several machines has in a velocity, in words; nothing of one."""
    missing = any(map(math.isnan, shares.values()))
    return f', {"at least, " if missing else ""}of its square {percent(shares)}' if shares else ''
