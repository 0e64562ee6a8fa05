"""How does a log become a table? One row for each channel and stamp, units in the columns."""

from collections import defaultdict
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
import json
import math
from pathlib import Path
from typing import Any

import numpy as np

from rotorsoil_ros.bags import reader as bag_reader
from rotorsoil_ros.bags.profile import answered, in_plants, is_called, place
from rotorsoil_ros.bags.tables.files import opened, require_suffix, Value
from rotorsoil_ros.channel import Channel
from rotorsoil_ros.errors import InputError
from rotorsoil_ros.events import NANOSECONDS
from rotorsoil_ros.units import in_plant_units, plant_column
from rotorsoil_ros.wire.cdr import Layout
from rotorsoil_ros.wire.definitions import DIAGNOSTICS, JOINT_STATE, STRING
from rotorsoil_ros.wire.handlers import SPEED_TOPICS
from rotorsoil_ros.wire.messages import Records
from rotorsoil_ros.wire.sensors import JointStateReader
from rotorsoil_ros.wire.speeds import SpeedReader, USUAL

Progress = Callable[[int, int], None]

# Columns of amplitudes: those of a displacement in m, those of a rotation in rad.
SIZED = ('predicted', 'predicted_low', 'predicted_high', 'steady', 'measured', 'residual',
         'ground')
# Phases beside them.
TURNED = ('predicted_phase', 'steady_phase', 'measured_phase', 'ground_phase')
COLUMNS: dict[str, type] = {
    'machine': str, 'stamp_ns': int, 'channel': str, 'speed_rad_s': float,
    **{f'{name}_{unit}': float for unit in ('m', 'rad') for name in SIZED},
    **{f'{name}_rad': float for name in TURNED},
    'predicted_velocity_m_s_rms': float, 'measured_velocity_m_s_rms': float,
    'predicted_zone': str, 'measured_zone': str, 'not_predicted': str}
UNSTABLE, UNSTABLE_RANGES = 'unstable', 'unstable_rad_s'  # why nothing is predicted
# From the topics of a node, and of a measuring system, to what they tell.
TOLD_BY = {'amplitude': 'predicted', 'phase': 'predicted_phase', 'amplitude_low': 'predicted_low',
        'amplitude_high': 'predicted_high', 'residual': 'residual',
        'steady/amplitude': 'steady', 'steady/phase': 'steady_phase',
        'demodulated/amplitude': 'measured', 'demodulated/phase': 'measured_phase',
        'measured/amplitude': 'measured', 'measured/phase': 'measured_phase',
        'ground/amplitude': 'ground', 'ground/phase': 'ground_phase'}
SETTLED_NS = 5 * NANOSECONDS  # after which nothing of a stamp comes any more
MESSAGES_AT_ONCE = 512
ROWS_AT_ONCE = 50_000


def export_log(
    log: Path | str, out: Path | str, *, machine: str = '', plant: bool = False,
    progress: Progress | None = None,
) -> int:
    """
    Write what a log tells as a long table.

    Parameters
    ----------
    log : Path or str
        Bag directory or MCAP file.
    out : Path or str
        Table to write: `.csv`, or `.parquet` if pyarrow is installed.
    machine : str
        Which machine; empty: all.
    plant : bool
        Whether in um peak-to-peak, mm/s rms, rpm and degrees of lag, instead of SI.
    progress : callable
        Called with the number of messages read and their total.

    Returns
    -------
    int
        Number of rows.

    Raises
    ------
    InputError
        If the log cannot be read or tells nothing of the machine, or the suffix is another.

    """
    log, out = Path(log), Path(out)
    require_suffix(out)
    sources = bag_reader.sources(log)
    plants = in_plants((source.topic for source in sources), machine)
    wanted = {source.topic: found for source in sources
              if source.encoding == bag_reader.CDR
              and (found := _told(source.topic, source.type, plants))
              and (not machine or is_called(found[0], machine))}
    if not any(kind for _, kind in wanted.values()):
        raise InputError(f'{log}: tells nothing of {machine or "any machine"} that was predicted '
                         'or measured')
    total = sum(number for source, number in sources.items() if source.topic in wanted)
    count = done = 0
    columns = {plant_column(name)[0]: kind for name, kind in COLUMNS.items()}
    with opened(out, columns if plant else COLUMNS) as write_rows:
        def write(rows: Sequence[Mapping[str, Value]]) -> None:
            write_rows([in_plant_units(row) for row in rows] if plant else rows)

        rows: list[Mapping[str, Value]] = []
        tables = _Tables(wanted)
        for batch in bag_reader.batches(
                log, lambda topic, kind: topic in wanted or kind == DIAGNOSTICS or (
                    kind == STRING and topic.endswith('/model')),
                at_most=MESSAGES_AT_ONCE, span_ns=NANOSECONDS):
            rows += tables.take(batch)
            done += len(batch.payloads)
            if progress:
                progress(min(done, total), total)
            if len(rows) >= ROWS_AT_ONCE:
                write(rows)
                count, rows = count + len(rows), []
        rows += tables.rest()
        write(rows)
        count += len(rows)
    return count


def _told(topic: str, message_type: str, plants: Collection[str]) -> tuple[str, str] | None:
    """Return of which machine a topic tells, and what: nothing for its speed."""
    if (found := place(topic, message_type, plants)) is not None:
        if found.name in SPEED_TOPICS:
            return found.machine, ''
        return (found.machine, TOLD_BY[found.name]) if found.name in TOLD_BY else None
    if message_type != JOINT_STATE:
        return None
    machine, name = answered(topic, plants)
    return (machine, TOLD_BY[name]) if name in TOLD_BY else None


@dataclass
class _Moment:
    """What was told of one machine at one stamp: by quantity and channel."""

    told: dict[str, dict[str, tuple[float, float]]] = field(
        default_factory=lambda: defaultdict(dict))


class _Machine:
    """What was told of one machine and is not a row yet."""

    def __init__(self, name: str) -> None:
        self._name = name
        self._moments: dict[int, _Moment] = defaultdict(_Moment)
        self._speeds: dict[int, float] = {}
        self.zones: dict[str, str] = {}
        self.unstable: list[tuple[float, float]] = []

    def tell(
        self, quantity: str, stamps: Sequence[int], names: Sequence[str], position: Any,
        velocity: Any,
    ) -> None:
        """Keep one quantity of some stamps."""
        for stamp, at, rate in zip(stamps, position.tolist(), velocity.tolist(), strict=True):
            self._moments[stamp].told[quantity].update(
                zip(names, zip(at, rate, strict=True), strict=True))

    def turn(self, stamps: Sequence[int], speed: Any) -> None:
        """Keep speeds."""
        self._speeds.update(zip(stamps, speed.tolist(), strict=True))

    def settled(self, until_ns: float) -> Iterator[dict[str, Value]]:
        """Yield the rows of the stamps before a time, and forget them."""
        ready = sorted(stamp for stamp in self._moments if stamp < until_ns)
        if not ready:
            return
        known = sorted(self._speeds)
        speed = (np.interp(ready, known, [self._speeds[stamp] for stamp in known],
                           left=math.nan, right=math.nan) if known else [math.nan] * len(ready))
        for stamp, turning in zip(ready, speed, strict=True):
            yield from self._rows(stamp, float(turning), self._moments.pop(stamp))
        for stamp in [stamp for stamp in known if stamp < until_ns - SETTLED_NS][:-1]:
            del self._speeds[stamp]

    def _rows(self, stamp: int, speed: float, moment: _Moment) -> Iterator[dict[str, Value]]:
        told = moment.told
        for name in dict.fromkeys(name for names in told.values() for name in names):
            channel = Channel.parse(name)
            row: dict[str, Value] = {
                'machine': self._name, 'stamp_ns': stamp, 'channel': name, 'speed_rad_s': speed}
            for quantity in SIZED:
                at, rate = _said(told, quantity, name)
                size = at if math.isfinite(at) or not speed > 0.0 else rate / speed
                row[f'{quantity}_{channel.unit}'] = size
                if quantity in ('predicted', 'measured') and not channel.is_rotation:
                    rms = (rate if math.isfinite(rate) else speed * at) / math.sqrt(2.0)
                    row[f'{quantity}_velocity_m_s_rms'] = rms
            for quantity in TURNED:
                at, rate = _said(told, quantity, name)
                ahead = math.remainder(rate - 0.5 * math.pi, 2.0 * math.pi)
                row[f'{quantity}_rad'] = at if math.isfinite(at) else ahead
            for source in ('predicted', 'measured'):
                if source in told and name in told[source]:
                    row[f'{source}_zone'] = self.zones.get(f'{name}_{source}_zone', '')
            if any(low <= speed <= high for low, high in self.unstable):
                row['not_predicted'] = UNSTABLE
            yield row


def _said(
    told: Mapping[str, Mapping[str, tuple[float, float]]], quantity: str, name: str,
) -> tuple[float, float]:
    """Return displacement and velocity of a quantity of a channel, NaN where nothing is told."""
    if quantity.startswith('steady') and quantity not in told:  # then the answer is the steady one
        quantity = quantity.replace('steady', 'predicted')
    return told.get(quantity, {}).get(name, (math.nan, math.nan))


class _Tables:
    """Makes rows of the messages of a log, machine by machine."""

    def __init__(self, wanted: Mapping[str, tuple[str, str]]) -> None:
        self._wanted = wanted
        self._machines = {name: _Machine(name) for name, _ in wanted.values()}
        self._states = {topic: JointStateReader() for topic in wanted}
        self._speeds: dict[str, SpeedReader] = {}

    def take(self, batch: Records) -> Iterator[dict[str, Value]]:
        """Take messages of one topic; yield the rows that are complete."""
        if batch.type == DIAGNOSTICS:
            for payload in batch.payloads:
                self._take_zones(payload)
        elif batch.type == STRING:
            for payload in batch.payloads:
                self._take_model(payload)
        else:
            name, quantity = self._wanted[batch.topic]
            if quantity:
                self._take_states(batch, self._machines[name], quantity)
            else:
                self._take_speeds(batch, self._machines[name])
        for machine in self._machines.values():
            yield from machine.settled(batch.log_time_ns[-1] - SETTLED_NS)

    def rest(self) -> Iterator[dict[str, Value]]:
        """Yield the last rows."""
        for machine in self._machines.values():
            yield from machine.settled(math.inf)

    def _take_states(self, batch: Records, machine: _Machine, quantity: str) -> None:
        for _, states in self._states[batch.topic].runs(batch.payloads):
            if states is not None:
                machine.tell(quantity, states.stamp_ns.tolist(), states.names, states.position,
                             states.velocity)

    def _take_speeds(self, batch: Records, machine: _Machine) -> None:
        reader = self._speeds.setdefault(batch.topic, SpeedReader(
            batch.type, USUAL, note=lambda reason, count: None))
        found = reader.read(batch.log_time_ns, batch.payloads)
        machine.turn(found.stamps, found.speed)

    def _take_model(self, payload: bytes) -> None:
        """Keep at which speeds a machine is unstable, as the node tells of it."""
        try:
            told = json.loads(Layout.of(STRING, payload).texts['data'][0])
            ranges = [(float(low), float(high)) for low, high in told[UNSTABLE_RANGES]]
            name = str(told['machine'])
        except (InputError, ValueError, KeyError, TypeError):
            return
        if name in self._machines:
            self._machines[name].unstable = ranges

    def _take_zones(self, payload: bytes) -> None:
        """Keep the zones that the diagnostics of a node tell."""
        try:
            texts = Layout.of(DIAGNOSTICS, payload).texts
        except InputError:
            return
        for path, (text,) in texts.items():
            if path.endswith('.key') and text.endswith('_zone'):
                status = path.split('.')[0]
                name = texts[f'{status}.hardware_id'][0]
                if name in self._machines:
                    self._machines[name].zones[text] = texts[
                        f'{path.removesuffix(".key")}.value'][0]
