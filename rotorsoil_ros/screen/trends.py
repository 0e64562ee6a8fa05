"""How do amplitude, phase and housing velocity go with time? Predicted, band and measured."""

from collections.abc import Sequence
import math

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from rotorsoil_ros.arrays import ComplexArray, FloatArray, IntArray
from rotorsoil_ros.case.zone_limits import support_class, ZoneLimits
from rotorsoil_ros.channel import Channel
from rotorsoil_ros.compared import Compared
from rotorsoil_ros.events import Band, NANOSECONDS, Zoned
from rotorsoil_ros.screen.channels import entity_of, HOUSINGS, MICRO, Trend
from rotorsoil_ros.screen.recording import Recording, TREND_NS
from rotorsoil_ros.units import rad_s_to_rpm

MM_RMS = 1e3 / math.sqrt(2.0)  # [mm/s rms] per [m/s zero-to-peak]
LIMITS = {'A/B': (70, 190, 90), 'B/C': (240, 180, 40), 'C/D': (230, 70, 60)}
LIMITS_NS = NANOSECONDS
BAND_NS = NANOSECONDS // 10
# By which share an answer that lasts is another one than that of a speed that changes.
STEADY, OTHER = 'steady', 0.02


class TrendLines:
    """The trends of one machine."""

    def __init__(self, recording: Recording, machine: str, shown: Sequence[Trend]) -> None:
        self._recording = recording
        self._machine = machine
        self._trends = shown
        self._by_channel = {trend.channel: trend for trend in shown}

    def predicted(
        self, stamp_ns: IntArray, speed: FloatArray, displacement: ComplexArray,
        steady: ComplexArray | None = None,
    ) -> None:
        """
        Draw predictions.

        Parameters
        ----------
        stamp_ns, speed : (n,) arrays
            When [ns], [rad/s].
        displacement : (n, channels) complex array
            [m, rad].
        steady : (n, channels) complex array or None
            As if each speed had been there for ever; drawn where it is something else.

        """
        rows = self._recording.begins(f'{self._machine} predicted', stamp_ns, TREND_NS)
        if not len(rows):
            return
        stamps, speed, displacement = stamp_ns[rows], speed[rows], displacement[rows]
        self._recording.series(
            entity_of(self._machine, 'speed'), stamps, rad_s_to_rpm(speed),
            style=rr.SeriesLines(names=self._machine, colors=(210, 210, 210)))
        for trend in self._trends:
            found = displacement[:, trend.column]
            self._answer(trend, 'predicted', stamps, speed, found, colour=trend.colour, width=1.5)
            lasting = found if steady is None else steady[rows, trend.column]
            if np.any(np.abs(lasting - found) > OTHER * np.abs(lasting)):
                self._answer(trend, STEADY, stamps, speed, lasting, colour=trend.pale, width=0.8)

    def _answer(
        self, trend: Trend, source: str, stamps: IntArray, speed: FloatArray,
        found: ComplexArray, *, colour: tuple[int, int, int], width: float,
    ) -> None:
        """Draw amplitude, phase and, of a housing, velocity of one channel (n,) [m, rad]."""
        name = f'{trend.channel} {STEADY}' if source == STEADY else trend.channel
        line = rr.SeriesLines(names=name, colors=colour, widths=width)
        self._recording.series(f'{trend.entity}/amplitude/{source}', stamps,
                               MICRO * np.abs(found), style=line)
        self._recording.series(
            f'{trend.entity}/phase/{source}', stamps, np.degrees(np.angle(found)),
            style=rr.SeriesPoints(names=name, colors=colour, marker_sizes=width))
        if trend.kind == HOUSINGS:
            self._recording.series(f'{trend.entity}/velocity/{source}', stamps,
                                   MM_RMS * speed * np.abs(found), style=line)

    def band(self, events: Sequence[Band]) -> None:
        """Draw between which amplitudes the predictions lie."""
        stamps, speed, low, high = (
            np.concatenate([getattr(event, name) for event in events])
            for name in ('stamp_ns', 'speed', 'low', 'high'))
        rows = self._recording.begins(f'{self._machine} band', stamps, BAND_NS)
        for trend in self._trends if len(rows) else ():
            # The name of the prediction, which comes first: they share a line of the legend.
            style = rr.SeriesLines(names=trend.channel, colors=trend.faint, widths=0.8)
            for side, values in (('soil_low', low), ('soil_high', high)):
                self._recording.series(
                    f'{trend.entity}/amplitude/{side}', stamps[rows],
                    MICRO * values[rows, trend.column], style=style)
                if trend.kind == HOUSINGS:
                    self._recording.series(
                        f'{trend.entity}/velocity/{side}', stamps[rows],
                        MM_RMS * speed[rows] * values[rows, trend.column], style=style)

    def compared(self, event: Compared) -> None:
        """Draw what was measured."""
        rows = self._recording.begins(
            f'{self._machine} {event.channels}', event.stamp_ns, TREND_NS)
        stamps, speed = event.stamp_ns[rows], event.speed[rows]
        for number, channel in enumerate(event.channels if len(rows) else ()):
            trend = self._by_channel.get(channel)
            if trend is None:
                continue
            size = event.amplitude[rows, number]
            style = rr.SeriesPoints(names=f'{channel} measured', colors=trend.colour,
                                    marker_sizes=4.0, markers='diamond')
            self._recording.series(f'{trend.entity}/amplitude/measured', stamps, MICRO * size,
                                   style=style)
            if np.isfinite(event.phase[rows, number]).any():
                turned = np.angle(np.exp(1j * event.phase[rows, number]), deg=True)
                self._recording.series(
                    f'{trend.entity}/phase/measured', stamps, turned, style=rr.SeriesPoints(
                        names=channel, colors=trend.colour, marker_sizes=4.0,
                        markers='diamond'))
            if trend.kind == HOUSINGS:
                self._recording.series(f'{trend.entity}/velocity/measured', stamps,
                                       MM_RMS * speed * size, style=style)

    def limits(
        self, stamp_ns: IntArray, speed: FloatArray, natural: tuple[float, float],
        zones: ZoneLimits,
    ) -> None:
        """
        Draw the limits of the zones, which change with the class of the support.

        Parameters
        ----------
        stamp_ns, speed : (n,) arrays
            Of the speeds [ns], [rad/s].
        natural : tuple of two floats
            Lowest frequency of machine and support along x and along z [rad/s].
        zones : ZoneLimits
            Boundaries [m/s rms].

        """
        rows = self._recording.begins(f'{self._machine} limits', stamp_ns, LIMITS_NS)
        for axis, lowest in zip('xz', natural if len(rows) else (), strict=False):
            bounds = 1e3 * np.array(
                [zones.of(support_class(lowest, each), abs(each))
                 for each in speed[rows].tolist()])
            for number, (name, colour) in enumerate(LIMITS.items()):
                entity = entity_of(self._machine, 'limits', axis, name.replace('/', '_'))
                self._recording.series(
                    entity, stamp_ns[rows], bounds[:, number], style=rr.SeriesLines(
                        names=f'limit {name}', colors=colour, widths=1.0,
                        interpolation_mode='StepAfter'))


MEASURED, PREDICTED = 'measured', 'predicted'
UNKNOWN = '-'
ZONE_FILLS = {'A': (40, 150, 75), 'B': (140, 190, 70), 'C': (225, 160, 30), 'D': (205, 55, 50),
           UNKNOWN: (70, 70, 70)}


class ZoneLane:
    """The zones of one machine; only changes are sent."""

    def __init__(self, recording: Recording, entity: str) -> None:
        self._recording = recording
        self._entity = entity
        self._told: dict[tuple[Channel, str], str] = {}

    @staticmethod
    def views(entity: str, label: str) -> rrb.Horizontal:
        """Return the view of all lanes."""
        return rrb.Horizontal(*(rrb.StateTimelineView(
            name=f'Zones {source}, {label}', origin=f'{entity}/{source}',
            time_view=rrb.TimeAxis(link='LinkToGlobal'))
            for source in (MEASURED, PREDICTED)))

    def draw(self, event: Zoned, stamp_ns: int) -> None:
        """Draw what has changed."""
        # A lane that says that nothing is measured is more than an empty view.
        channels = {*event.predicted, *event.measured, *(channel for channel, _ in self._told)}
        for channel in sorted(channels):
            for source, zones in ((PREDICTED, event.predicted), (MEASURED, event.measured)):
                self._tell(channel, source, zones.get(channel) or UNKNOWN, stamp_ns)

    def _tell(self, channel: Channel, source: str, zone: str, stamp_ns: int) -> None:
        before = self._told.get((channel, source))
        if zone == before:
            return
        self._told[channel, source] = zone
        lane = f'{self._entity}/{source}/{channel}'
        if before is None:
            self._recording.still(lane, rr.StateConfiguration(
                values=list(ZONE_FILLS), labels=[*list(ZONE_FILLS)[:-1], f'not {source}'],
                colors=list(ZONE_FILLS.values())))
        self._recording.send(lane, np.array([stamp_ns]), rr.StateChange.columns(state=[zone]))
