"""What is to be said of a machine's vibration: a level and a sentence, and when they change."""

from collections.abc import Callable, Iterator, Mapping

from rotorsoil_ros.channel import Channel
from rotorsoil_ros.events import Diagnostics, Event, Level, NANOSECONDS, Remark, Zoned
from rotorsoil_ros.monitor.passing import Passing
from rotorsoil_ros.monitor.zones import HousingState, LEVELS, MM, values, Vibration, worst

VIBRATION = 'vibration'


class Verdict:
    """Tells at every tick how the machine vibrates, and remarks on what has changed."""

    def __init__(self, machine: str, vibration: Vibration, passing: Passing) -> None:
        self._machine = machine
        self._vibration, self._passing = vibration, passing
        self._heard_ns: int | None = None
        self._zones: dict[Channel, str] = {}
        self._is_stale = False

    def tell(
        self, now_ns: int, *, stale_after_s: float, has_data: bool, has_phase: bool,
        is_steady: Callable[[], bool], counts: Mapping[str, float],
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

        """
        if has_data or (self._heard_ns is not None and now_ns < self._heard_ns):
            self._heard_ns = now_ns
        stale = (self._heard_ns is None
                 or now_ns - self._heard_ns > stale_after_s * NANOSECONDS)
        yield from self._changes(now_ns, is_steady, is_stale=stale)
        zones = {channel: state.zone or '' for channel, state in
                 self._vibration.predicted.items()}
        yield Zoned(self._machine, now_ns, zones, {} if stale else dict(self._zones))
        if self._heard_ns is None:
            return  # a machine without sensors is not stale
        level, summary = self._level(is_steady)
        if stale:
            level, summary = Level.STALE, self._silence()
        elif not has_phase and has_data:
            summary += '; no phase reference: amplitudes only'
        yield Diagnostics(self._machine, now_ns, level, summary,
                          {**values(self._vibration), **counts}, VIBRATION)

    def _changes(
        self, now_ns: int, is_steady: Callable[[], bool], *, is_stale: bool,
    ) -> Iterator[Remark]:
        """Yield a remark for every zone and every band that was left or entered."""
        if is_stale != self._is_stale and self._heard_ns is not None:
            self._is_stale = is_stale
            yield Remark(self._machine, now_ns, Level.STALE if is_stale else Level.OK,
                         'nothing is measured any more' if is_stale else
                         'measurements are back')
        for channel, state in self._vibration.measured.items():
            before = self._zones.get(channel)
            if state.zone is not None and state.zone != before:
                self._zones[channel] = state.zone
                came = f' (was {before})' if before else ''
                yield Remark(self._machine, now_ns, _level(state, is_steady),
                             f'{channel}: zone {state.zone}{came}, '
                             f'{MM * state.velocity:.2f} mm/s rms')
        for channel, is_outside in self._vibration.settle():
            said = 'has left' if is_outside else 'is back in'
            share = 100.0 * self._vibration.share_inside(channel)
            yield Remark(self._machine, now_ns, Level.WARN if is_outside else Level.OK,
                         f'{channel}: {said} the band of the prediction, {share:.0f} % of the '
                         'amplitudes lie in it')

    def _level(self, is_steady: Callable[[], bool]) -> tuple[Level, str]:
        """Return level and sentence of what is measured."""
        level, said = Level.OK, []
        for source, states in (('measured', self._vibration.measured),
                               ('predicted', self._vibration.predicted)):
            if found := worst(states):
                said.append(_zone(source, *found))
        if found := worst(self._vibration.measured):
            level = _level(found[1], is_steady)
            if level is not LEVELS[found[1].zone or 'A']:
                said.append('speed changes')
        faults = list(self._passing.faults)
        if self._vibration.outside:
            faults.insert(0, f'outside the band: {", ".join(sorted(self._vibration.outside))}')
        if faults:
            level = max(level, Level.WARN)
        return level, '; '.join([*said, *faults]) or 'compared with the prediction'

    def _silence(self) -> str:
        said = 'nothing measured'
        if found := worst(self._vibration.predicted):
            said += f'; {_zone("predicted", *found)}'
        return said


def _level(state: HousingState, is_steady: Callable[[], bool]) -> Level:
    """Return what a zone means; while the speed changes its limits do not strictly hold."""
    level = LEVELS[state.zone or 'A']
    return Level.WARN if level is Level.ERROR and not is_steady() else level


def _zone(source: str, channel: str, state: HousingState) -> str:
    return (f'zone {state.zone} {source} ({channel}, {MM * state.velocity:.2f} mm/s rms, '
            f'{state.support} support)')
