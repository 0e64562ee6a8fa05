"""How do messages that come in, from the graph or from a bag, reach the monitor of a machine."""

from collections.abc import Callable, Sequence
from functools import partial
import math
import re
import struct
from typing import Generic, NamedTuple, overload, TypeAlias

import numpy as np

from rotorsoil_ros.arrays import FloatArray, IntArray
from rotorsoil_ros.channel import Channel, named
from rotorsoil_ros.events import LAST_STAMP, Measured, NANOSECONDS, Samples
from rotorsoil_ros.monitor.monitor import Monitor
from rotorsoil_ros.wire.cdr import (
    Accelerations,
    AXES,
    BODY,
    Decoded,
    ImuReader,
    JointStateReader,
    JointStates,
    Layout,
    LITTLE_ENDIAN,
    Reader,
)
from rotorsoil_ros.wire.definitions import FLOAT64, IMU, JOINT_STATE
from rotorsoil_ros.wire.messages import Records

SPEED_TOPICS = {'joint_states': JOINT_STATE, 'rotor/speed': FLOAT64}
MEASURED_TOPICS = {'measured/amplitude': JOINT_STATE, 'measured/phase': JOINT_STATE}
TOPICS = SPEED_TOPICS | MEASURED_TOPICS
ROTOR_JOINT = 'rotor'
YEAR_S = 31_556_952
LONGEST_NS = 10 * YEAR_S * NANOSECONDS  # that any log spans: what is further off is no time

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


class Arrival(Sequence[int]):
    """
    When a message has come to a running node [ns].

    Reading the clock takes 3 us, and most messages have their own stamp: it is read when asked.
    """

    def __init__(self, clock: Callable[[], int]) -> None:
        self._clock = clock

    def __len__(self) -> int:
        return 1

    @overload
    def __getitem__(self, index: int) -> int: ...

    @overload
    def __getitem__(self, index: slice) -> Sequence[int]: ...

    def __getitem__(self, index: int | slice) -> int | Sequence[int]:
        return self if isinstance(index, slice) else self._clock()


class Dating:
    """
    Decides at which time stamped messages count: at their own, or at that of their reception.

    A stamp of zero was never set, and one that is years from those before and from the time of
    reception is none: both are dated on reception, and counted. Where the reception has no time
    either, there is none. A running node may follow another clock than its own from the first
    message on, of a simulation or of a replay; in a log both times were written by one.
    """

    def __init__(self, note: Note) -> None:
        self._note = note
        self._last_ns: int | None = None

    def date(self, stamp_ns: int, received_ns: Sequence[int], row: int) -> int | None:
        """Return the time of a message [ns]; its reception is asked for only if it matters."""
        last = self._last_ns
        if stamp_ns and (isinstance(received_ns, Arrival) if last is None
                         else abs(stamp_ns - last) <= LONGEST_NS):
            self._last_ns = stamp_ns
            return stamp_ns
        received = received_ns[row]
        if stamp_ns and abs(stamp_ns - received) <= LONGEST_NS:
            self._last_ns = stamp_ns
            return stamp_ns
        if not received:
            self._note('stamp_missing', 1)
            return None
        self._note('stamp_far_off' if stamp_ns else 'stamp_not_set', 1)
        return received


class SpeedReader:
    """Reads the speeds of one topic; what it cannot read it counts by its reason."""

    def __init__(self, message_type: str, *, rotor_joint: str, note: Note) -> None:
        self._read = (_read_float if message_type == FLOAT64
                      else JointSpeed(rotor_joint, Dating(note)).read)
        self._note = note

    def read(self, received_ns: Sequence[int], cdrs: Sequence[bytes]) -> Speeds:
        """Read messages that were received at the given times [ns]."""
        if len(cdrs) == 1:
            return self._read_one(received_ns, cdrs)
        messages, stamps, speeds, angles = [], [], [], []
        for row, cdr in enumerate(cdrs):
            stamp, speed, angle, fault = self._read(received_ns, row, cdr)
            if fault:
                self._note(fault, 1)
            if stamp is not None:
                messages.append(cdr)
                stamps.append(stamp)
                speeds.append(speed)
                angles.append(angle)
        return Speeds(messages, stamps, np.array(speeds, dtype=float),
                      np.array(angles, dtype=float))

    def _read_one(self, received_ns: Sequence[int], cdrs: Sequence[bytes]) -> Speeds:
        """Read what a live node hears: the same as many, with less ado."""
        stamp, speed, angle, fault = self._read(received_ns, 0, cdrs[0])
        if fault:
            self._note(fault, 1)
        if stamp is None:
            return NOTHING
        return Speeds(cdrs, (stamp,), np.array((speed,)), np.array((angle,)))


NOTHING = Speeds((), (), np.array([]), np.array([]))

# Stamp [ns], or None where the message is of no use; speed [rad/s]; angle [rad]; fault.
Told: TypeAlias = tuple[int | None, float, float, str]


class JointSpeed:
    """Finds the velocity of one joint in JointStates, one by one."""

    def __init__(self, joint: str, dating: Dating) -> None:
        self._joint = joint
        self._dating = dating
        self._reader = JointStateReader()
        self._layout: Layout | None = None
        self._fault = 'malformed'  # of a message without a layout
        self._unpack = struct.Struct('<d').unpack_from
        self._at = self._angle_at = 0

    def read(self, received_ns: Sequence[int], row: int, cdr: bytes) -> Told:
        """Return what the message of a row tells, at its own stamp if that can be one."""
        layout = self._reader.layout(cdr)
        if layout is not self._layout:
            self._learn(layout)
        if layout is None or self._fault == 'joint_missing':
            return None, math.nan, math.nan, self._fault
        stamp = layout.stamp_ns(cdr)
        if not 0 <= stamp <= LAST_STAMP:
            return None, math.nan, math.nan, 'malformed'
        dated = self._dating.date(stamp, received_ns, row)
        angle = self._unpack(cdr, self._angle_at)[0] if self._angle_at else math.nan
        speed = math.nan if self._fault else self._unpack(cdr, self._at)[0]
        return dated, speed, angle, self._fault

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


def _read_float(received_ns: Sequence[int], row: int, cdr: bytes) -> Told:
    """Return what a Float64 tells, dated on receipt; it knows of no angle."""
    if len(cdr) < BODY + 8 or cdr[0] != 0 or cdr[1] > LITTLE_ENDIAN:
        return None, math.nan, math.nan, 'malformed'
    order = '<d' if cdr[1] == LITTLE_ENDIAN else '>d'
    return received_ns[row], struct.unpack_from(order, cdr, BODY)[0], math.nan, ''


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
        samples.turned[rows]))


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
        return StampedInlet(topic, IMU, ImuReader(), partial(_tell_samples, monitor, channel),
                            note=monitor.health.note, log=log)
    if name in SPEED_TOPICS:
        return SpeedInlet(topic, SPEED_TOPICS[name], monitor, rotor_joint=rotor_joint, log=log)
    quantity = name.removeprefix('measured/')
    return StampedInlet(topic, JOINT_STATE, JointStateReader(),
                        _Vectors(monitor, quantity),
                        note=monitor.health.note, log=log)
