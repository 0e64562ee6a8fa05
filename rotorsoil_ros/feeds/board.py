"""The state of every machine as a feed tells it: the one translation of topics into values."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
import math

from rotorsoil_ros.arrays import FloatArray
from rotorsoil_ros.events import Level, NANOSECONDS
from rotorsoil_ros.feeds.hearsay import (
    channels_of,
    Inbox,
    MODEL,
    Report,
    reports_of,
    Speaker,
    TOLD,
    TOTAL,
    VectorReader,
)
from rotorsoil_ros.feeds.points import (
    Point,
    Quality,
    quantities_of,
    quantities_of_plant,
    Quantity,
    unit_of,
)
from rotorsoil_ros.monitor.health import GAPS, STANDING
from rotorsoil_ros.monitor.verdict import MM, VIBRATION

SILENCE_S = 5.0  # of a node that reports once a second
MOST_MACHINES, MOST_CHANNELS = 1000, 2000
REASON = 'Reason'

# Why a number has no answer, by what the node counts.
WITHOUT_ANSWER = {
    'below_table': Quality.OUT_OF_TABLE, 'above_table': Quality.OUT_OF_TABLE,
    'unstable': Quality.UNSTABLE, STANDING: Quality.STANDING}
# What the diagnostics say of a channel, in numbers and in words.
MEASURED = {
    'inside_band': 'InsideBand', 'measured_mm_s_rms': 'MeasuredVelocityRms',
    'alarm_mm_s_rms': 'AlarmVelocityRms', 'trip_mm_s_rms': 'TripVelocityRms'}
SI_IN_TOLD = {key: 1.0 / MM for key in MEASURED if key.endswith('_mm_s_rms')}
WORDS = {'predicted_zone': 'PredictedZone', 'measured_zone': 'MeasuredZone', 'verdict': 'Verdict'}


class MachineBoard:
    """
    What is known of one machine, or of those of a plant together.

    Attributes
    ----------
    name : str
        As in feeds.
    channels : tuple of str
        Of which something is told; the values of each are there from the first moment on, as
        not known yet.
    is_silent : bool
        Nothing has come for longer than a node is ever silent.
    points : mapping
        By channel and quantity; the channel is empty for what is told of the machine itself.

    """

    def __init__(
        self, name: str, *, plant: bool,
        quantities: Callable[[str], Mapping[str, Quantity]] = quantities_of,
    ) -> None:
        self.name = name
        self.channels: tuple[str, ...] = ()
        self.is_silent = False
        self.points: dict[tuple[str, str], Point] = {}
        self.changed: dict[tuple[str, str], Point] = {}
        self._plant, self._quantities = plant, quantities
        self._heard_ns = 0
        self._counts: dict[str, float] = {}
        self._why = Quality.UNANSWERED  # if a number has no answer
        self._add('')

    def hear(self, now_ns: int) -> None:
        """Note that something has come; of a node that is back nothing is known yet."""
        if self.is_silent:
            self._begin_anew()
        self._heard_ns, self.is_silent = now_ns, False

    def tick(self, now_ns: int) -> None:
        """Withdraw every value of a node that says nothing any more."""
        if not self.is_silent and now_ns - self._heard_ns > SILENCE_S * NANOSECONDS:
            self.is_silent = True
            for point in list(self.points.values()):
                self._put(_doubted(replace(point, value=None), Quality.SILENT))

    def take_shape(self, channels: Sequence[str]) -> None:
        """Tell of other channels from now on."""
        channels = tuple(channels)[:MOST_CHANNELS]
        for key in [key for key in self.points if key[0] and key[0] not in channels]:
            del self.points[key]
            self.changed.pop(key, None)
        for channel in channels:
            if (channel, REASON) not in self.points:
                self._add(channel)
        self.channels = channels

    def take_vector(
        self, name: str, stamp_ns: int, channels: Sequence[str], fields: Mapping[str, FloatArray],
    ) -> None:
        """Take a JointState of one topic of the machine."""
        if fresh := [channel for channel in channels if (channel, REASON) not in self.points]:
            self.take_shape([*self.channels, *fresh])
        for quantity, field in TOLD[name].items():
            for channel, value in zip(channels, fields[field].tolist(), strict=True):
                self._tell(channel, quantity, value, stamp_ns, self._why)

    def take_report(self, report: Report) -> None:
        """Take the machine's own status."""
        if self._grown(report, 'received') < 0.0:
            self._begin_anew()  # by the time it was noticed the node had started again
        self._why = self._cause(report)
        stamp = report.stamp_ns
        self._tell('', 'Speed', report.number('speed_rad_s'), stamp, Quality.WAITING)
        self._tell('', 'State', _level(report.level), stamp)
        self._tell('', 'Summary', report.summary, stamp)
        for point in list(self.points.values()):
            if self._quantities(point.channel)[point.quantity].is_measured or not point.unit:
                continue
            if report.level == Level.STALE and point.quality is Quality.GOOD:
                self._put(_doubted(point, Quality.STALE))
            elif point.quality is Quality.UNANSWERED:
                self._put(_doubted(point, self._why))

    def take_vibration(self, report: Report) -> None:
        """Take the status of what is measured on the machine."""
        stamp, values = report.stamp_ns, report.values
        self._tell('', 'VibrationState', _level(report.level), stamp)
        self._tell('', 'VibrationSummary', report.summary, stamp)
        self._tell('', 'Verdict', values.get('verdict', ''), stamp, Quality.NOT_MEASURED)
        for channel in self.channels:
            for key, quantity in (*MEASURED.items(), *WORDS.items()):
                if f'{channel}_{key}' in values:
                    told = values[f'{channel}_{key}'] if key in WORDS else (
                        report.number(f'{channel}_{key}') * SI_IN_TOLD.get(key, 1.0))
                    self._tell(channel, quantity, told, stamp, Quality.NOT_MEASURED)
            self._distrust(channel, report)

    def explain(self) -> None:
        """Say of every channel why something of it cannot be trusted; nothing if all can."""
        touched: dict[str, int] = {}
        for (channel, _), point in self.changed.items():
            touched[channel] = max(point.stamp_ns, touched.get(channel, 0))
        touched.pop('', None)
        for channel, stamp_ns in touched.items():
            said: dict[str, list[str]] = {}
            for name in self._quantities(channel):
                point = self.points[channel, name]
                if name != REASON and point.quality not in (Quality.GOOD, Quality.NOT_MEASURED):
                    said.setdefault(point.reason, []).append(name)
            text = '; '.join(f'{", ".join(names)}: {why}' for why, names in said.items())
            if text != self.points[channel, REASON].value:
                self._put(Point(self.name, channel, REASON, text, None, Quality.GOOD, '',
                                stamp_ns))

    def _begin_anew(self) -> None:
        self._counts = {}
        for channel in ('', *self.channels):
            self._add(channel)

    def _add(self, channel: str) -> None:
        """Begin to tell of a channel, or of the machine."""
        for quantity, known in self._quantities(channel).items():
            quality = Quality.NOT_MEASURED if known.is_measured else Quality.WAITING
            self._put(Point(self.name, channel, quantity, None,
                            unit_of(channel, quantity, plant=self._plant), quality,
                            quality.value, 0))

    def _tell(
        self, channel: str, quantity: str, value: float | str, stamp_ns: int,
        otherwise: Quality = Quality.UNANSWERED,
    ) -> None:
        """Put a value, or what it is otherwise where there is none; nothing where none is told."""
        if (channel, quantity) not in self.points:
            return
        unit = self.points[channel, quantity].unit
        told: float | str | None = None
        if isinstance(value, str):
            told = value or None
        elif math.isfinite(value) and unit is not None:
            told = unit.convert(value)
        quality = otherwise if told is None else Quality.GOOD
        self._put(Point(
            self.name, channel, quantity, told, unit, quality, quality.value, stamp_ns))

    def _put(self, point: Point) -> None:
        if self.points.get(point.key) != point:
            self.points[point.key] = self.changed[point.key] = point

    def _grown(self, report: Report, key: str) -> float:
        """Return by how much a count has grown."""
        count = report.number(key)
        before, self._counts[key] = self._counts.get(key, 0.0), count
        return count - before

    def _cause(self, report: Report) -> Quality:
        """Return why numbers have no answer at present."""
        grown = {key: self._grown(report, key) for key in (*GAPS, STANDING)}
        worst = max(grown, key=lambda key: grown[key])
        return WITHOUT_ANSWER.get(worst, Quality.UNANSWERED) if grown[worst] > 0.0 else self._why

    def _distrust(self, channel: str, report: Report) -> None:
        """Mark what was measured of a channel as rejected or as old."""
        stretches = self._grown(report, f'{channel}_stretches')
        refused = self._grown(report, f'{channel}_refused')
        if stretches > 0.0:
            self._counts[f'{channel}_is_rejected'] = float(refused >= stretches)
        is_rejected = self._counts.get(f'{channel}_is_rejected', 0.0) > 0.0
        if not is_rejected and report.level != Level.STALE:
            return
        because = report.values.get(f'{channel}_refused_because', Quality.REJECTED.value)
        for quantity, known in self._quantities(channel).items():
            point = self.points[channel, quantity]
            if not known.is_measured or quantity == 'PredictedZone':
                continue
            if is_rejected:
                self._put(_doubted(replace(point, value=None), Quality.REJECTED, because))
            elif point.quality is Quality.GOOD:
                self._put(_doubted(point, Quality.STALE))


class Board:
    """All machines, read out of an inbox whenever somebody wants to know."""

    def __init__(self, inbox: Inbox, *, plant: bool = True) -> None:
        self.machines: dict[str, MachineBoard] = {}
        self._inbox, self._plant = inbox, plant
        self._by_path: dict[str, MachineBoard] = {}
        self._vectors = VectorReader()

    def refresh(self, now_ns: int) -> list[MachineBoard]:
        """Read what has come by a time of a steady clock [ns]; return who has changed."""
        last, reports = self._inbox.read()
        for topic, cdr in last.items():
            self._take(topic, cdr, now_ns)
        for cdr in reports:
            for report in reports_of(cdr):
                self._take_report(report, now_ns)
        for machine in self.machines.values():
            machine.tick(now_ns)
            machine.explain()
        return [machine for machine in self.machines.values() if machine.changed]

    def settle(self) -> Iterator[Point]:
        """Yield every value that has changed since this was asked, once."""
        for machine in self.machines.values():
            changed, machine.changed = machine.changed, {}
            yield from changed.values()

    def _take(self, topic: str, cdr: bytes, now_ns: int) -> None:
        found = Speaker.of(topic)
        if found is None:
            return
        place, name = found
        if name == MODEL:
            if channels := channels_of(cdr):
                self._machine(place, now_ns).take_shape(channels)
            return
        stamp_ns, channels, fields = self._vectors.read(topic, cdr)
        if channels and len(channels) <= MOST_CHANNELS:
            self._machine(place, now_ns, is_plant=name == TOTAL).take_vector(
                name, stamp_ns, channels, fields)

    def _take_report(self, report: Report, now_ns: int) -> None:
        if (machine := self._by_path.get(report.of)) is not None:
            machine.hear(now_ns)
            if report.name.endswith(f' {VIBRATION}'):
                machine.take_vibration(report)
            else:
                machine.take_report(report)

    def _machine(
        self, place: Speaker, now_ns: int, *, is_plant: bool = False,
    ) -> MachineBoard:
        machine = self._by_path.get(place.path)
        if machine is None:
            machine = MachineBoard(place.name, plant=self._plant,
                                   quantities=quantities_of_plant if is_plant else quantities_of)
            if len(self.machines) < MOST_MACHINES:
                self.machines[place.name] = self._by_path[place.path] = machine
        machine.hear(now_ns)
        return machine


def _doubted(point: Point, quality: Quality, reason: str = '') -> Point:
    return replace(point, quality=quality, reason=reason or quality.value)


def _level(level: int) -> str:
    return Level(level).name if level in tuple(Level) else f'{level}'
