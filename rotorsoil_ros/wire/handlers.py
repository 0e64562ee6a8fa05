"""How do messages that come in, from the graph or from a bag, reach the monitor of a machine."""

from collections.abc import Callable, Sequence
from functools import partial
import re
from typing import Generic, TypeAlias

import numpy as np

from rotorsoil_ros.arrays import IntArray
from rotorsoil_ros.channel import Channel, named
from rotorsoil_ros.events import Measured, Samples
from rotorsoil_ros.monitor.monitor import Monitor
from rotorsoil_ros.wire.cdr import AXES
from rotorsoil_ros.wire.dating import are_stamps, Dating, Note
from rotorsoil_ros.wire.definitions import FLOAT64, IMU, JOINT_STATE, TEMPERATURE
from rotorsoil_ros.wire.messages import JointStateWriter, Records
from rotorsoil_ros.wire.sensors import (
    Accelerations,
    Decoded,
    ImuReader,
    JointStateReader,
    JointStates,
    Reader,
    Temperatures,
    temperatures,
)
from rotorsoil_ros.wire.speeds import ROTOR_JOINT, SpeedReader, Speeds, SpeedSource, USUAL

SPEED_TOPICS = {'joint_states': JOINT_STATE, 'rotor/speed': FLOAT64}
OIL_TOPIC = 'oil_temperature'
MEASURED_TOPICS = {'measured/amplitude': JOINT_STATE, 'measured/phase': JOINT_STATE}
TOPICS = SPEED_TOPICS | MEASURED_TOPICS | {OIL_TOPIC: TEMPERATURE}
RAW_NAME = re.compile(r'measured/(\w+)/imu')
GROUND_NAME = re.compile(r'ground/(\w+)/imu')

Outlet: TypeAlias = Callable[[Records], None]
Inlet: TypeAlias = Callable[[Sequence[int], Sequence[bytes]], None]


class SpeedInlet:
    """
    Asks the monitor at every speed of one topic, and logs the message.

    As it came, where the package itself would tell it so; else as it was understood, a
    JointState [rad/s]: a log says all that it takes to read it.
    """

    def __init__(
        self, topic: str, message_type: str, monitor: Monitor, *, source: SpeedSource,
        log: Outlet, told: str = '', spoken: str = '',
    ) -> None:
        self._topic, self._type = spoken or topic, message_type
        self._monitor = monitor
        self._log = log
        self._writer = JointStateWriter([ROTOR_JOINT]) if spoken else None
        monitor.health.speed_unit = source.unit
        self._reader = SpeedReader(message_type, source, note=monitor.health.note,
                                   explain=monitor.health.explain, told=told)

    def __call__(self, received_ns: Sequence[int], cdrs: Sequence[bytes]) -> None:
        """Take in messages that were received at the given times [ns]."""
        speeds = self._reader.read(received_ns, cdrs)
        if speeds.messages:
            self._log(self._records(speeds))
            self._monitor.on_speed(
                np.array(speeds.stamps, dtype=np.int64), speeds.speed, speeds.angle)

    def _records(self, speeds: Speeds) -> Records:
        if self._writer is None:
            return Records(self._topic, self._type, speeds.stamps, speeds.messages)
        return as_joint_states(self._topic, self._writer, speeds)


def as_joint_states(topic: str, writer: JointStateWriter, speeds: Speeds) -> Records:
    """Return speeds as this package tells them: JointStates of the joint `rotor` [rad/s]."""
    values = np.stack([speeds.angle, speeds.speed, np.full(len(speeds.speed), np.nan)], axis=1)
    return Records(topic, JOINT_STATE, speeds.stamps,
                   writer.write(speeds.stamps, values[:, :, None]))


class StampedInlet(Generic[Decoded]):
    """
    Dates stamped messages, logs them as they came, and tells what they say.

    Parameters
    ----------
    topic, message_type : str
        Under which they are logged.
    reader : Reader
        What decodes them.
    tell : callable
        Takes times (n,) [ns], what was decoded, and which n of its rows have these times.

    """

    def __init__(
        self, topic: str, message_type: str, reader: Reader[Decoded],
        tell: Callable[[IntArray, Decoded, Sequence[int]], None], *, note: Note, log: Outlet,
    ) -> None:
        self._topic, self._type = topic, message_type
        self._reader, self._tell = reader, tell
        self._note, self._log = note, log
        self._dating = Dating(note)

    def __call__(self, received_ns: Sequence[int], cdrs: Sequence[bytes]) -> None:
        """Take in messages; their own stamps count, where they are set."""
        at = 0
        for messages, decoded in self._reader.runs(cdrs):
            received, at = received_ns[at:at + len(messages)], at + len(messages)
            if decoded is None or not are_stamps(decoded.stamp_ns):
                self._note('malformed', len(messages))
                continue
            times = [(row, time) for row, stamp in enumerate(decoded.stamp_ns.tolist())
                     if (time := self._dating.date(stamp, received, row)) is not None]
            if times:
                rows, stamps = zip(*times, strict=True)
                self._log(Records(self._topic, self._type, stamps,
                                  [messages[row] for row in rows]))
                self._tell(np.array(stamps, dtype=np.int64), decoded, list(rows))


class _Vectors:
    """Tells a monitor amplitudes or phases that were measured."""

    def __init__(self, monitor: Monitor, quantity: str) -> None:
        self._monitor, self._quantity = monitor, quantity
        self._named: tuple[object, ...] = ()
        self._channels: tuple[Channel, ...] = ()

    def __call__(self, stamp_ns: IntArray, states: JointStates, rows: Sequence[int]) -> None:
        """Tell some rows of what was decoded."""
        self._monitor.on_measured(Measured(
            self._monitor.machine, self._quantity, stamp_ns, self._known(states.names),
            states.position[rows], states.velocity[rows]))

    def _known(self, names: tuple[str, ...]) -> tuple[Channel, ...]:
        """Return the channels of names; a sensor repeats them with every message."""
        table = self._monitor.table
        if self._named != (names, table.key):
            self._named = names, table.key
            self._channels = tuple(named(name, table.channels) for name in names)
        return self._channels


def _tell_samples(
    monitor: Monitor, channel: Channel, stamp_ns: IntArray, samples: Accelerations,
    rows: Sequence[int],
) -> None:
    """Tell raw samples of one channel."""
    monitor.on_samples(Samples(
        monitor.machine, channel, stamp_ns,
        samples.acceleration[rows, AXES.index(channel.axis)], samples.is_synthetic,
        samples.acceleration[rows], samples.orientation[rows]))


def _tell_ground(
    monitor: Monitor, sensor: str, stamp_ns: IntArray, samples: Accelerations,
    rows: Sequence[int],
) -> None:
    """Tell raw samples of a sensor on the ground."""
    felt = samples.acceleration[rows]
    monitor.on_ground(sensor, Samples(
        monitor.machine, Channel(sensor, '', 'z'), stamp_ns, felt[:, AXES.index('z')],
        samples.is_synthetic, felt, samples.orientation[rows]))


def _tell_oil(
    monitor: Monitor, stamp_ns: IntArray, found: Temperatures, rows: Sequence[int],
) -> None:
    """Tell temperatures of the oil."""
    monitor.on_oil_temperature(stamp_ns, found.celsius[rows])


def raw_channel(name: str) -> Channel | None:
    """Return the channel of a name such as `measured/<channel>/imu`; None of other names."""
    found = RAW_NAME.fullmatch(name)
    channel = Channel.parse(found[1]) if found else None
    # A sensor feels along an axis: a rotation cannot be measured so.
    return channel if channel and channel.axis in AXES else None


def ground_sensor(name: str) -> str:
    """Return the sensor of a name such as `ground/<sensor>/imu`; empty of other names."""
    found = GROUND_NAME.fullmatch(name)
    return found[1] if found else ''


def inlet(
    name: str, topic: str, monitor: Monitor, *, log: Outlet,
    speed: SpeedSource = USUAL, message_type: str = '', told: str = '', spoken: str = '',
) -> Inlet:
    """
    Return what takes in the messages of one of TOPICS, or of raw samples.

    Parameters
    ----------
    name, topic : str
        Name below the machine's, and in full: under this one the messages are logged.
    monitor : Monitor
        Of the machine.
    log : callable
        Where accepted messages are written, at their own stamps.
    speed : SpeedSource
        What in its messages is the speed.
    message_type, told : str
        Type of a speed topic, and its definition, where they are not the usual ones.
    spoken : str
        Topic under which speeds are logged as they were understood; empty: as they came.

    """
    if channel := raw_channel(name):
        return StampedInlet(topic, IMU, ImuReader(), partial(_tell_samples, monitor, channel),
                            note=monitor.health.note, log=log)
    if sensor := ground_sensor(name):
        return StampedInlet(topic, IMU, ImuReader(), partial(_tell_ground, monitor, sensor),
                            note=monitor.health.note, log=log)
    if name == OIL_TOPIC:
        return StampedInlet(topic, TEMPERATURE, Reader(TEMPERATURE, temperatures),
                            partial(_tell_oil, monitor), note=monitor.health.note, log=log)
    if name in SPEED_TOPICS:
        return SpeedInlet(topic, message_type or SPEED_TOPICS[name], monitor, source=speed,
                          log=log, told=told, spoken=spoken)
    quantity = name.removeprefix('measured/')
    return StampedInlet(topic, JOINT_STATE, JointStateReader(),
                        _Vectors(monitor, quantity),
                        note=monitor.health.note, log=log)
