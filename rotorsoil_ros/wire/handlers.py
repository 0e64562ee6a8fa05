"""How do messages that come in, from the graph or from a bag, reach the monitor of a machine."""

from collections.abc import Callable, Sequence
import math
import re
import struct
from typing import NamedTuple, TypeAlias

import numpy as np

from rotorsoil_ros.arrays import FloatArray, IntArray
from rotorsoil_ros.channel import Channel, named
from rotorsoil_ros.events import LAST_STAMP, Measured, Samples
from rotorsoil_ros.monitor.monitor import Monitor
from rotorsoil_ros.wire.cdr import AXES, BODY, ImuReader, JointStateReader, Layout, LITTLE_ENDIAN
from rotorsoil_ros.wire.definitions import FLOAT64, IMU, JOINT_STATE
from rotorsoil_ros.wire.messages import Records

SPEED_TOPICS = {'joint_states': JOINT_STATE, 'rotor/speed': FLOAT64}
MEASURED_TOPICS = {'measured/amplitude': JOINT_STATE, 'measured/phase': JOINT_STATE}
TOPICS = SPEED_TOPICS | MEASURED_TOPICS
ROTOR_JOINT = 'rotor'
UNREAD = ('malformed', 'joint_missing')  # of no use, not even for the log

RAW_NAME = re.compile(r'measured/(\w+)/imu')

Note: TypeAlias = Callable[[str, int], None]
Outlet: TypeAlias = Callable[[Records], None]
Inlet: TypeAlias = Callable[[Sequence[int], Sequence[bytes]], None]


class Speeds(NamedTuple):
    """
    Messages that told a speed, with their n stamps [ns], speeds [rad/s] and angles [rad].

    An angle that was not told is NaN.
    """

    messages: Sequence[bytes]
    stamps: Sequence[int]
    speed: FloatArray
    angle: FloatArray


class SpeedReader:
    """Reads the speeds of one topic; what it cannot read it counts by its reason."""

    def __init__(self, message_type: str, *, rotor_joint: str, note: Note) -> None:
        self._read = _read_float if message_type == FLOAT64 else JointSpeed(rotor_joint).read
        self._note = note

    def read(self, received_ns: Sequence[int], cdrs: Sequence[bytes]) -> Speeds:
        """Read messages that were received at the given times [ns]."""
        if len(cdrs) == 1:
            return self._read_one(received_ns[0], cdrs)
        messages, stamps, speeds, angles = [], [], [], []
        for received, cdr in zip(received_ns, cdrs, strict=True):
            stamp, speed, angle, fault = self._read(received, cdr)
            if fault:
                self._note(fault, 1)
            if fault not in UNREAD:
                messages.append(cdr)
                stamps.append(stamp)
                speeds.append(speed)
                angles.append(angle)
        return Speeds(messages, stamps, np.array(speeds, dtype=float),
                      np.array(angles, dtype=float))


    def _read_one(self, received_ns: int, cdrs: Sequence[bytes]) -> Speeds:
        """Read what a live node hears: the same as many, with less ado."""
        stamp, speed, angle, fault = self._read(received_ns, cdrs[0])
        if fault:
            self._note(fault, 1)
            if fault in UNREAD:
                return NOTHING
        return Speeds(cdrs, (stamp,), np.array((speed,)), np.array((angle,)))


NOTHING = Speeds((), (), np.array([]), np.array([]))


class JointSpeed:
    """Finds the velocity of one joint in JointStates, one by one."""

    def __init__(self, joint: str) -> None:
        self._joint = joint
        self._reader = JointStateReader()
        self._layout: Layout | None = None
        self._fault = ''
        self._unpack = struct.Struct('<d').unpack_from
        self._at = self._angle_at = 0

    def read(self, received_ns: int, cdr: bytes) -> tuple[int, float, float, str]:
        """Return stamp [ns], speed [rad/s], angle [rad] and fault; the stamp is its own."""
        del received_ns
        layout = self._reader.layout(cdr)
        if layout is not self._layout:
            self._learn(layout)
        if layout is None or self._fault == 'joint_missing':
            return 0, math.nan, math.nan, self._fault
        stamp = layout.stamp_ns(cdr)
        if not 0 <= stamp <= LAST_STAMP:
            return 0, math.nan, math.nan, 'malformed'
        angle = self._unpack(cdr, self._angle_at)[0] if self._angle_at else math.nan
        speed = math.nan if self._fault else self._unpack(cdr, self._at)[0]
        return stamp, speed, angle, self._fault

    def _learn(self, layout: Layout | None) -> None:
        """Find out where in such messages the velocity is, or why it is not there."""
        self._layout = layout
        if layout is None:
            self._fault = 'malformed'
        elif self._joint not in layout.texts['name']:
            self._fault = 'joint_missing'
        else:
            velocities, number = layout.span('velocity'), layout.texts['name'].index(self._joint)
            self._at = velocities.start + 8 * number
            self._fault = '' if self._at < velocities.stop else 'velocity_missing'
            angles = layout.span('position')
            at = angles.start + 8 * number
            self._angle_at = at if at < angles.stop else 0
            self._unpack = struct.Struct(layout.order + 'd').unpack_from


def _read_float(received_ns: int, cdr: bytes) -> tuple[int, float, float, str]:
    """Return stamp [ns], speed [rad/s], no angle and fault of a Float64, dated on receipt."""
    if len(cdr) < BODY + 8 or cdr[0] != 0 or cdr[1] > LITTLE_ENDIAN:
        return 0, math.nan, math.nan, 'malformed'
    order = '<d' if cdr[1] == LITTLE_ENDIAN else '>d'
    return received_ns, struct.unpack_from(order, cdr, BODY)[0], math.nan, ''


class SpeedInlet:
    """Asks the monitor at every speed of one topic, and logs the message as it came."""

    def __init__(
        self, topic: str, message_type: str, monitor: Monitor, *, rotor_joint: str, log: Outlet,
    ) -> None:
        self._topic = topic
        self._type = message_type
        self._monitor = monitor
        self._log = log
        self._reader = SpeedReader(
            message_type, rotor_joint=rotor_joint, note=monitor.health.note)

    def __call__(self, received_ns: Sequence[int], cdrs: Sequence[bytes]) -> None:
        """Take in messages that were received at the given times [ns]."""
        speeds = self._reader.read(received_ns, cdrs)
        if speeds.messages:
            self._log(Records(self._topic, self._type, speeds.stamps, speeds.messages))
            self._monitor.on_speed(
                np.array(speeds.stamps, dtype=np.int64), speeds.speed, speeds.angle)


class MeasuredInlet:
    """Tells the monitor amplitudes or phases that were measured, and logs them as they came."""

    def __init__(self, topic: str, quantity: str, monitor: Monitor, *, log: Outlet) -> None:
        self._topic = topic
        self._quantity = quantity
        self._monitor = monitor
        self._log = log
        self._reader = JointStateReader()
        self._named: tuple[object, ...] = ()
        self._channels: tuple[Channel, ...] = ()

    def _known(self, names: tuple[str, ...]) -> tuple[Channel, ...]:
        """Return the channels of names; a sensor repeats them with every message."""
        table = self._monitor.table
        if self._named != (names, table.key):
            self._named = names, table.key
            self._channels = tuple(named(name, table.channels) for name in names)
        return self._channels

    def __call__(self, received_ns: Sequence[int], cdrs: Sequence[bytes]) -> None:
        """Take in messages; their own stamps count, not when they were received."""
        for messages, states in self._reader.runs(cdrs):
            if states is None or not are_stamps(states.stamp_ns):
                self._monitor.health.note('malformed', len(messages))
                continue
            self._log(Records(self._topic, JOINT_STATE, states.stamp_ns.tolist(), messages))
            self._monitor.on_measured(Measured(
                self._monitor.machine, self._quantity, states.stamp_ns,
                self._known(states.names),
                states.position, states.velocity))


class SampleInlet:
    """Tells the monitor raw samples of one channel, and logs them as they came."""

    def __init__(self, topic: str, channel: Channel, monitor: Monitor, *, log: Outlet) -> None:
        self._topic, self._channel = topic, channel
        self._monitor = monitor
        self._log = log
        self._reader = ImuReader()
        self._axis = AXES.index(channel.axis)

    def __call__(self, received_ns: Sequence[int], cdrs: Sequence[bytes]) -> None:
        """Take in messages; their own stamps count, not when they were received."""
        for messages, samples in self._reader.runs(cdrs):
            if samples is None or not are_stamps(samples.stamp_ns):
                self._monitor.health.note('malformed', len(messages))
                continue
            self._log(Records(self._topic, IMU, samples.stamp_ns.tolist(), messages))
            self._monitor.on_samples(Samples(
                self._monitor.machine, self._channel, samples.stamp_ns,
                samples.acceleration[:, self._axis], samples.is_synthetic))


def are_stamps(stamp_ns: IntArray) -> bool:
    """Return whether all of these, (n,), can be stamps [ns]."""
    return bool(stamp_ns.min() >= 0 and stamp_ns.max() <= LAST_STAMP)


def raw_channel(name: str) -> Channel | None:
    """Return the channel of a name such as `measured/<channel>/imu`; None of other names."""
    found = RAW_NAME.fullmatch(name)
    channel = Channel.parse(found[1]) if found else None
    # A sensor feels along an axis: a rotation cannot be measured so.
    return channel if channel and channel.axis in AXES else None


def inlet(name: str, topic: str, monitor: Monitor, *, rotor_joint: str, log: Outlet) -> Inlet:
    """
    Return what takes in the messages of one of TOPICS, or of raw samples.

    Parameters
    ----------
    name, topic : str
        Name below the machine's, and in full: under this one the messages are logged.
    monitor : Monitor
        Of the machine.
    rotor_joint : str
        Joint whose velocity is the rotor speed.
    log : callable
        Where accepted messages are written, byte for byte, at their own stamps.

    """
    if channel := raw_channel(name):
        return SampleInlet(topic, channel, monitor, log=log)
    if name in SPEED_TOPICS:
        return SpeedInlet(topic, SPEED_TOPICS[name], monitor, rotor_joint=rotor_joint, log=log)
    return MeasuredInlet(topic, name.removeprefix('measured/'), monitor, log=log)
