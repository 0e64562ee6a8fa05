"""What does an engineer see? Trends and the vibrating machine, as a recording for rerun."""

from collections import deque
from collections.abc import Iterable, Mapping
import logging
from pathlib import Path
from types import TracebackType

import numpy as np
import rerun as rr

from rotorsoil_ros.arrays import ComplexArray
from rotorsoil_ros.case.machine import Machine
from rotorsoil_ros.case.plant.together import plants_of
from rotorsoil_ros.compared import Compared
from rotorsoil_ros.events import (
    Band,
    Diagnostics,
    Event,
    Expected,
    Level,
    Model,
    NANOSECONDS,
    Predicted,
    Remark,
    Samples,
    Zoned,
)
from rotorsoil_ros.monitor.criteria import Criteria
from rotorsoil_ros.screen.blueprint import blueprint, Shown
from rotorsoil_ros.screen.bode import Bode
from rotorsoil_ros.screen.channels import trends
from rotorsoil_ros.screen.footer import Endings
from rotorsoil_ros.screen.orbits import Orbits
from rotorsoil_ros.screen.picture import FRAME_NS, Picture
from rotorsoil_ros.screen.plant import PlantView, ShownPlant
from rotorsoil_ros.screen.recording import Recording
from rotorsoil_ros.screen.scene import Scene
from rotorsoil_ros.screen.trends import TrendLines, ZoneLane
from rotorsoil_ros.screen.waterfall import ORDERS, Waterfall

APPLICATION = 'rotorsoil'
LAYOUT = 'layout.rrd'
HELD_NS = 5 * NANOSECONDS  # of a run that nobody looks at: a chunk costs a kilobyte
TEXT_LEVELS = {Level.OK: 'INFO', Level.WARN: 'WARN', Level.ERROR: 'ERROR', Level.STALE: 'WARN'}


class RerunSink:
    """Collects events and sends them to a recording in columns, whenever the caller flushes."""

    def __init__(
        self, path: Path | None, machines: Mapping[str, Machine], *, url: str = '',
        ends: bool = False,
    ) -> None:
        self._stream = rr.RecordingStream(APPLICATION)
        self._machines, self._url, self._ends = machines, url, ends
        self._shown = {name: Shown(name, machine.case,
                                   trends(name, machine.case, machine.table.channels),
                                   Scene(machine.case, machine.table.channels))
                       for name, machine in machines.items()}
        self._held_ns = 0 if url else HELD_NS
        self._basis: dict[tuple[str, type], Model | Expected] = {}
        self._plants = [
            ShownPlant(plant, tuple(among), Scene(first.case, first.table.channels, whole=True))
            for plant, among in plants_of(machines).items() for first in [*among.values()][:1]]
        self._views: dict[str, MachineView] = {}
        self._scenes: list[PlantView] = []
        self._layout = b''
        self.begin(path)

    def begin(self, path: Path | None) -> None:
        """Send what was collected, and go on in a new file that is whole in itself."""
        # The stream stays: rerun never frees one, nor its two threads.
        for view in self._all:
            view.flush()
        # `footer` tells why there is none yet.
        file = [rr.FileSink(path, write_footer=False)] if path else []
        self._path = path
        viewer = [rr.GrpcSink(self._url)] if self._url else []
        if not file and not viewer:  # the disk takes none yet: rerun would keep all in memory
            self._views, self._scenes = {}, []
            return
        self._attach([*file, *viewer])
        recording = Recording(self._stream)
        self._views = {name: MachineView(recording, self._shown[name], machine)
                       for name, machine in self._machines.items()}
        self._scenes = [PlantView(recording, plant, self._machines[plant.names[0]].table.channels)
                        for plant in self._plants]
        for basis in self._basis.values():  # on which what follows rests
            self(basis)

    @property
    def _all(self) -> 'list[MachineView | PlantView]':
        return [*self._views.values(), *self._scenes]

    def _attach(self, sinks: list[rr.FileSink | rr.GrpcSink]) -> None:
        """Stream to sinks from now on, which open with the layout of the views."""
        if self._layout:
            # Given as an object it would cost two threads and megabytes each time, for ever.
            self._stream.set_sinks(*sinks)
            self._stream.log_file_from_contents(LAYOUT, self._layout)
        else:  # the first may be so short that bytes, which a thread reads, would come too late
            layout = blueprint(self._shown, self._plants)
            self._stream.set_sinks(*sinks, default_blueprint=layout)
            self._layout = packed(self._stream, layout)

    def __enter__(self) -> 'RerunSink':
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def __call__(self, event: Event) -> None:
        """Collect an event."""
        if isinstance(event, (Model, Expected)):
            self._basis[event.machine, type(event)] = event
        if view := self._views.get(event.machine):
            view.take(event)
        if isinstance(event, Predicted):
            for scene in self._scenes:
                scene.take(event)

    def show(self, events: Iterable[Event]) -> None:
        """Collect events and send them."""
        for event in events:
            self(event)
        self.flush()

    def flush(self) -> None:
        """Send what was collected; into a file alone, some seconds at a time."""
        for view in self._all:
            if view.held_ns >= self._held_ns:
                view.flush()

    def close(self) -> None:
        """Send the rest and finish the recording."""
        for view in self._all:
            view.flush()
        self._stream.disconnect()
        if self._ends and self._path is not None:
            endings = Endings(logging.getLogger(__name__).warning)
            endings.end(self._path)
            endings.close()


def packed(stream: rr.RecordingStream, layout: rr.blueprint.Blueprint) -> bytes:
    """Return a layout as a part of a stream, to be sent as often as it begins a file."""
    aside = rr.RecordingStream(APPLICATION, recording_id=stream.get_recording_id())
    memory = aside.memory_recording()
    aside.send_blueprint(layout, make_active=False, make_default=True)
    said = memory.drain_as_bytes()
    return bytes(said) if said else b''


class MachineView:
    """What is shown of one machine."""

    def __init__(self, recording: Recording, shown: Shown, machine: Machine) -> None:
        self._recording = recording
        self._machine = machine
        self._shown = shown
        self._unbalance: ComplexArray | None = machine.case.unbalance
        self._criteria: Criteria | None = None
        self._predicted: list[Predicted] = []
        self._compared: list[Compared] = []
        self._bands: list[Band] = []
        self._moments: deque[tuple[Event, int]] = deque()
        self._level: Level | None = None
        self._last_ns: int | None = None
        self._speed = np.nan
        self._trends = TrendLines(recording, shown.name, shown.trends)
        self._bode = Bode(recording, shown.entity('bode'), shown.trends,
                          machine.table.predictor(machine.case.unbalance))
        self._orbits = Orbits(recording, shown.entity('orbits'), shown.case,
                              machine.table.channels)
        self._zones = ZoneLane(recording, shown.entity('zones'))
        fastest = machine.table.speed_range[1] / (2.0 * np.pi)
        self._waterfalls = {trend.channel: Waterfall(
            recording, shown.entity('waterfall', trend.channel),
            f'{shown.name}/measured/{trend.channel}/imu', top_hz=ORDERS * fastest)
            for trend in shown.housings}
        self._picture = Picture(
            recording, shown.entity('picture'), shown.entity('caption'), shown.scene)

    def take(self, event: Event) -> None:
        """Collect an event."""
        match event:
            case Predicted():
                self._predicted.append(event)
                self._last_ns = int(event.stamp_ns[-1])
                self._speed = float(event.prediction.speed[-1])
            case Compared():
                self._compared.append(event)
            case Samples():
                if waterfall := self._waterfalls.get(event.channel):
                    waterfall.take(event, self._speed)
            case Band():
                self._bands.append(event)
            case Zoned() | Remark() | Diagnostics() | Model() | Expected():
                # Clocks differ: what is told without data stands at the data that it follows.
                if self._last_ns is not None or isinstance(event, (Model, Expected)):
                    self._moments.append((event, self._last_ns or event.stamp_ns))

    @property
    def held_ns(self) -> int:
        """How much message time waits to be sent [ns]."""
        if self._last_ns is None or not self._predicted:
            return HELD_NS
        return abs(self._last_ns - int(self._predicted[0].stamp_ns[0]))

    def flush(self) -> None:
        """Send what was collected; first on what it rests."""
        while self._moments:
            self._send_moment(*self._moments.popleft())
        self._orbits.expect(self._compared)
        if self._predicted:
            self._send_predicted(self._predicted)
        if self._compared:
            self._orbits.compare(self._compared)
            for joined in Compared.joined(self._compared):
                self._trends.compared(joined)
                self._bode.compare(joined)
        if self._bands:
            self._trends.band(self._bands)
        self._predicted, self._compared, self._bands = [], [], []

    def _send_predicted(self, events: list[Predicted]) -> None:
        stamps = np.concatenate([event.stamp_ns for event in events])
        speed = np.concatenate([event.prediction.speed for event in events])
        displacement = np.concatenate([event.prediction.displacement for event in events])
        steady = [event.steady or event.prediction for event in events]
        self._trends.predicted(stamps, speed, displacement, np.concatenate(
            [lasting.displacement for lasting in steady]))
        self._bode.now(stamps, speed)
        self._orbits.predicted(stamps, displacement)
        if self._criteria is not None:
            self._trends.limits(stamps, speed, self._criteria.natural_speeds,
                                self._machine.case.zones)
        rows = self._recording.begins(self._shown.entity('picture'), stamps, FRAME_NS)
        if len(rows):
            self._picture.draw(stamps[rows], speed[rows, None], displacement[rows, None])

    def _send_moment(self, event: Event, stamp_ns: int) -> None:
        match event:
            case Zoned():
                self._zones.draw(event, stamp_ns)
            case Remark():
                self._write(event.level, event.text, stamp_ns)
            case Diagnostics() if event.level is not self._level:
                self._level = event.level
                self._write(event.level, event.summary, stamp_ns)
            case Model():
                self._take_model(event)
            case Expected():
                self._criteria = Criteria.from_arrays(event.criteria)
                self._bode.band(self._criteria.envelope)

    def _write(self, level: Level, text: str, stamp_ns: int) -> None:
        self._recording.send(self._shown.entity('events'), np.array([stamp_ns]),
                             rr.TextLog.columns(
                                 text=[f'{_clock(stamp_ns)}  {text}'], level=[TEXT_LEVELS[level]]))

    def _take_model(self, event: Model) -> None:
        """Draw what is predicted over speed anew if it rests on something else now."""
        table, told = self._machine.table, event.description.get('unbalance')
        tables = event.description.get('tables')
        if not isinstance(told, dict) or not isinstance(tables, dict):
            return
        unbalance: ComplexArray | None = None
        if tables.get('response') == table.key:  # of another case nothing is known here
            unbalance = np.array([
                told[plane]['moment_kg_m'] * np.exp(1j * told[plane]['phase_rad'])
                for plane in table.planes])
        if unbalance is None or self._unbalance is None or not np.allclose(
                unbalance, self._unbalance, rtol=1e-9, atol=0.0):
            self._unbalance, self._criteria = unbalance, None
            self._bode.predict(None if unbalance is None else table.predictor(unbalance))
            self._bode.band(None)


def _clock(stamp_ns: int) -> str:
    """Return the time of day (UTC): the viewer's own column is too narrow for it."""
    return str(np.datetime64(stamp_ns, 'ns')).partition('T')[2][:8]
