"""What does an engineer see? Trends and the vibrating machine, as a recording for rerun."""

from collections import defaultdict
from collections.abc import Iterable, Mapping
from pathlib import Path
from types import TracebackType

import numpy as np
import rerun as rr

from rotorsoil_ros.live.blueprint import blueprint, MICRO, Trend, trends
from rotorsoil_ros.live.events import Diagnostics, Event, Level, Measured, NANOSECONDS, Predicted
from rotorsoil_ros.live.machine import Machine
from rotorsoil_ros.live.picture import FRAME_NS, Picture
from rotorsoil_ros.live.scene import Scene
from rotorsoil_ros.physics.arrays import ComplexArray, FloatArray, IntArray
from rotorsoil_ros.physics.units import rad_s_to_rpm

APPLICATION = 'rotorsoil'
TIMELINE = 'time'
TREND_NS = NANOSECONDS // 50  # the log holds everything; a screen cannot
LEVELS = {Level.OK: 'INFO', Level.WARN: 'WARN', Level.ERROR: 'ERROR', Level.STALE: 'WARN'}


class RerunSink:
    """
    Collects events and sends them to a recording in columns, whenever the caller flushes.

    A row sent alone costs a hundred times what it costs in a column of a thousand.
    """

    def __init__(
        self, path: Path | None, machines: Mapping[str, Machine], *, url: str = '',
    ) -> None:
        self._stream = rr.RecordingStream(APPLICATION)
        shown = {name: trends(name, machine.case, machine.table.channels)
                 for name, machine in machines.items()}
        scenes = {name: Scene(machine.case, machine.table.channels)
                  for name, machine in machines.items()}
        # A footer would keep two kilobytes in memory for every chunk until the end.
        file = [rr.FileSink(path, write_footer=False)] if path else []
        viewer = [rr.GrpcSink(url)] if url else []
        self._stream.set_sinks(
            *file, *viewer, default_blueprint=blueprint(shown, scenes, timeline=TIMELINE))
        self._views = {name: MachineView(self._stream, name, shown[name], scenes[name])
                       for name in machines}

    def __enter__(self) -> 'RerunSink':
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def __call__(self, event: Event) -> None:
        """Collect an event."""
        match event:
            case Predicted():
                self._views[event.machine].predicted.append(event)
            case Measured():
                self._views[event.machine].measured.append(event)
            case Diagnostics():
                self._views[event.machine].diagnostics.append(event)

    def show(self, events: Iterable[Event]) -> None:
        """Collect events and send them."""
        for event in events:
            self(event)
        self.flush()

    def flush(self) -> None:
        """Send what was collected."""
        for view in self._views.values():
            view.flush()

    def close(self) -> None:
        """Send the rest and finish the recording."""
        self.flush()
        self._stream.disconnect()


class MachineView:
    """What is shown of one machine."""

    def __init__(
        self, stream: rr.RecordingStream, name: str, shown: list[Trend], scene: Scene,
    ) -> None:
        self.predicted: list[Predicted] = []
        self.measured: list[Measured] = []
        self.diagnostics: list[Diagnostics] = []
        self._stream = stream
        self._name = name
        self._trends = shown
        self._by_channel = {trend.channel: trend for trend in shown}
        self._thinned: defaultdict[str, int] = defaultdict(lambda: -1)
        self._styled: set[str] = set()
        self._level: Level | None = None
        self._shown_ns: int | None = None
        self._picture = Picture(
            stream, rr.new_entity_path([name, 'picture']), rr.new_entity_path([name, 'caption']),
            scene)

    def flush(self) -> None:
        """Send what was collected."""
        if self.predicted:
            self._send_predicted(self.predicted)
        for measured in self.measured:
            self._send_measured(measured)
        for diagnostics in self.diagnostics:
            self._send_diagnostics(diagnostics)
        self.predicted, self.measured, self.diagnostics = [], [], []

    def _send_predicted(self, events: list[Predicted]) -> None:
        stamps = np.concatenate([event.stamp_ns for event in events])
        speed = np.concatenate([event.prediction.speed for event in events])
        displacement = np.concatenate([event.prediction.displacement for event in events])
        self._shown_ns = int(stamps[-1])
        rows = self._thin('predicted', stamps, TREND_NS)
        if len(rows):
            self._send_trends(stamps[rows], speed[rows], displacement[rows])
        rows = self._thin('picture', stamps, FRAME_NS)
        if len(rows):
            self._picture.draw(stamps[rows], speed[rows], displacement[rows],
                               times=_times(stamps[rows]))

    def _send_trends(
        self, stamps: IntArray, speed: FloatArray, displacement: ComplexArray,
    ) -> None:
        size, angle = MICRO * np.abs(displacement), np.degrees(np.angle(displacement))
        self._send(rr.new_entity_path([self._name, 'speed']), stamps, rad_s_to_rpm(speed),
                   style=rr.SeriesLines(names='speed'))
        for number, trend in enumerate(self._trends):
            label = f'{trend.channel} predicted'
            self._send(f'{trend.entity}/amplitude/predicted', stamps, size[:, number],
                       style=rr.SeriesLines(names=label, colors=trend.colour))
            self._send(f'{trend.entity}/phase/predicted', stamps, angle[:, number],
                       style=rr.SeriesPoints(names=label, colors=trend.colour, marker_sizes=1.5))

    def _send_measured(self, event: Measured) -> None:
        rows = self._thin(f'measured {event.quantity}', event.stamp_ns, TREND_NS)
        factor = MICRO if event.quantity == 'amplitude' else np.degrees(1.0)
        for number, channel in enumerate(event.channels):
            trend = self._by_channel.get(channel)
            if trend is not None and len(rows):
                self._send(
                    f'{trend.entity}/{event.quantity}/measured', event.stamp_ns[rows],
                    factor * event.displacement[rows, number], style=rr.SeriesPoints(
                        names=f'{channel} measured', colors=trend.colour, marker_sizes=3.0))

    def _send_diagnostics(self, event: Diagnostics) -> None:
        """Tell changes of the level, at the data that they follow; the rest is in the log."""
        if event.level is not self._level and self._shown_ns is not None:
            self._level = event.level
            self._stream.set_time(TIMELINE, timestamp=np.datetime64(self._shown_ns, 'ns'))
            self._stream.log(rr.new_entity_path([self._name, 'events']), rr.TextLog(
                f'{event.level.name}: {event.summary}', level=LEVELS[event.level]))

    def _send(
        self, entity: str, stamps: IntArray, values: FloatArray, *, style: rr.AsComponents,
    ) -> None:
        if entity not in self._styled:
            self._styled.add(entity)
            self._stream.log(entity, style, static=True)
        self._stream.send_columns(entity, [_times(stamps)], rr.Scalars.columns(scalars=values))

    def _thin(self, what: str, stamps: IntArray, period_ns: int) -> IntArray:
        """Return the rows that begin a new period of message time."""
        period = stamps // period_ns
        begins = np.diff(period, prepend=self._thinned[what]) != 0
        self._thinned[what] = int(period[-1])
        return np.flatnonzero(begins)


def _times(stamp_ns: IntArray) -> rr.TimeColumn:
    return rr.TimeColumn(TIMELINE, timestamp=stamp_ns.astype('datetime64[ns]'))
