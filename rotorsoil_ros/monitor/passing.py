"""Was a resonance passed where, and as high as, predicted? Told when the passage is over."""

from dataclasses import dataclass, fields

import numpy as np

from rotorsoil_ros.arrays import ComplexArray, FloatArray, IntArray
from rotorsoil_ros.channel import Channel
from rotorsoil_ros.events import Compared, Level, Remark
from rotorsoil_ros.monitor.history import History
from rotorsoil_ros.monitor.passage import PeakPair, sweeps, told_once
from rotorsoil_ros.monitor.peak_pairs import peak_fault, peaks_of
from rotorsoil_ros.monitor.points import ChannelPoints, Reason, Reference
from rotorsoil_ros.monitor.quasistatic import Resonance
from rotorsoil_ros.monitor.zones import STEADY
from rotorsoil_ros.units import rad_s_to_rpm

MOST = 4096  # points of a channel; a longer passage keeps every second one
SETTLED_S = 5.0
SILENT_TICKS = 5


@dataclass(slots=True, eq=False)
class Trace:
    """What one channel measured since the last passage, beside its prediction; (n,) each."""

    stamp_ns: IntArray
    speed: FloatArray
    amplitude: FloatArray
    phase: FloatArray
    predicted: ComplexArray
    low: FloatArray
    high: FloatArray

    @classmethod
    def of(cls, compared: Compared, column: int) -> 'Trace':
        """Return what was measured of one channel."""
        return cls(compared.stamp_ns, compared.speed, *(
            getattr(compared, name)[:, column] for name in _COLUMNS))

    def extended(self, other: 'Trace') -> 'Trace':
        """Return this and what came after it, thinned where that is too much."""
        joined = Trace(*(np.concatenate([getattr(self, name), getattr(other, name)])
                         for name in _NAMES))
        return joined if len(joined.speed) <= MOST else joined.part(slice(None, None, 2))

    def part(self, rows: slice) -> 'Trace':
        """Return some of it."""
        return Trace(*(getattr(self, name)[rows] for name in _NAMES))

    def points(self, channel: Channel) -> ChannelPoints:
        """Return it as what the comparison of a whole run looks at."""
        nothing = np.full(len(self.speed), np.nan)
        used = np.full(len(self.speed), Reason.USED, dtype=object)
        return ChannelPoints(
            channel, self.stamp_ns, self.speed, self.amplitude, self.phase, self.predicted,
            self.low, self.high, nothing, nothing, used, complex(np.nan, np.nan))

    def reference(self, channel: Channel) -> Reference:
        """Return its prediction."""
        nothing = np.full((len(self.speed), 1), np.nan)
        return Reference(self.stamp_ns, self.speed, (channel,), self.predicted[:, None],
                         self.low[:, None], self.high[:, None], nothing, nothing, (0.0, np.inf))


_NAMES = tuple(entry.name for entry in fields(Trace))
_COLUMNS = _NAMES[2:]


class Passing:
    """Collects what was measured in a run-up or run-down, and judges its peaks at the end."""

    def __init__(self, machine: str, history: History, *, margin: float) -> None:
        self._machine, self._history, self._margin = machine, history, margin
        self._traces: dict[Channel, Trace] = {}
        self._silent_ticks = 0
        self.faults: list[str] = []

    def take(self, compared: Compared) -> None:
        """Collect measured points."""
        self._silent_ticks = 0
        for column, channel in enumerate(compared.channels):
            new = Trace.of(compared, column)
            before = self._traces.get(channel)
            self._traces[channel] = new if before is None else before.extended(new)

    def finished(self, now_ns: int, resonances: tuple[Resonance, ...]) -> list[Remark]:
        """Return what is to be said of a passage that has just ended; nothing before."""
        if not self._traces:
            return []
        longest = max(self._traces.values(), key=lambda trace: len(trace.speed))
        found = sweeps(longest.speed)
        if len(found) > 1:
            return self._judge(now_ns, resonances, int(longest.stamp_ns[found[0].stop - 1]))
        self._silent_ticks += 1
        if found and self._silent_ticks > SILENT_TICKS:
            return self.cut_short(now_ns, resonances)
        speed = self._history.last_speed
        if abs(self._history.rate(SETTLED_S)) <= STEADY * speed and (
                longest.stamp_ns[-1] - longest.stamp_ns[0] > SETTLED_S * 1e9):
            last_ns = int(longest.stamp_ns[-1])
            if found:
                return self._judge(now_ns, resonances, last_ns)
            self._cut(last_ns)
        return []

    def cut_short(self, now_ns: int, resonances: tuple[Resonance, ...]) -> list[Remark]:
        """Return what is to be said of a passage after which nothing more is measured."""
        last_ns = max((int(trace.stamp_ns[-1]) for trace in self._traces.values()), default=0)
        return self._judge(now_ns, resonances, last_ns) if self._traces else []

    def _judge(
        self, now_ns: int, resonances: tuple[Resonance, ...], until_ns: int,
    ) -> list[Remark]:
        peaks: list[PeakPair] = []
        for channel, trace in self._traces.items():
            sweep = trace.part(slice(0, int(np.searchsorted(trace.stamp_ns, until_ns, 'right'))))
            if len(sweep.speed) and np.isfinite(sweep.predicted).any():
                peaks += peaks_of(sweep.points(channel), sweep.reference(channel), resonances,
                                  margin=self._margin)[0]
        self._cut(until_ns)
        peaks = told_once(peaks)
        self.faults = [fault for peak in peaks
                       if (fault := peak_fault(peak, margin=self._margin))]
        return [self._remark(now_ns, peak) for peak in peaks]

    def _cut(self, until_ns: int) -> None:
        """Drop what has been judged, but for the point from which the next sweep sets out."""
        for channel, trace in list(self._traces.items()):
            begin = max(0, int(np.searchsorted(trace.stamp_ns, until_ns, 'right')) - 1)
            self._traces[channel] = trace.part(slice(begin, None))

    def _remark(self, now_ns: int, peak: PeakPair) -> Remark:
        fault = peak_fault(peak, margin=self._margin)
        if fault:
            return Remark(self._machine, now_ns, Level.WARN, fault)
        passed = peak.measured or peak.predicted
        assert passed is not None
        at = f'{peak.channel}: the peak at {rad_s_to_rpm(passed.speed):.0f} rpm'
        said = 'is as predicted' if peak.is_slow else 'was passed too fast to be held against ' \
                                                      'the prediction'
        return Remark(self._machine, now_ns, Level.OK, f'{at} {said}')
