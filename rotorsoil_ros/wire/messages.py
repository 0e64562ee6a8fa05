"""How an event reads as ROS messages: the one mapping, used by publishers and logs alike."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
import json
import math
import struct
from typing import NamedTuple

import numpy as np

from rotorsoil_ros.arrays import FloatArray, IntArray
from rotorsoil_ros.channel import Channel
from rotorsoil_ros.compared import Compared
from rotorsoil_ros.events import (
    Band,
    Demodulated,
    Diagnostics,
    Event,
    Grounded,
    Level,
    Model,
    NANOSECONDS,
    Predicted,
    Remark,
)
from rotorsoil_ros.prediction import Prediction
from rotorsoil_ros.wire.cdr import ARRAYS, encode, Layout, STAMP
from rotorsoil_ros.wire.definitions import DIAGNOSTICS, JOINT_STATE, LOG, STRING

DIAGNOSTICS_TOPIC = '/diagnostics'
NODE_NAME = 'rotorsoil'
MOST_LAYOUTS = 64  # sets of channels that are measured together; more than that nobody means

# Topics of a machine below the node's name, and their types.
OWN_TOPICS = {
    'amplitude': JOINT_STATE, 'phase': JOINT_STATE, 'amplitude_low': JOINT_STATE,
    'amplitude_high': JOINT_STATE, 'velocity_rms': JOINT_STATE, 'steady/amplitude': JOINT_STATE,
    'steady/phase': JOINT_STATE, 'residual': JOINT_STATE,
    'demodulated/amplitude': JOINT_STATE, 'demodulated/phase': JOINT_STATE, 'events': LOG,
    'model': STRING}

# The same of a machine beside which sensors stand on the ground.
GROUND_TOPICS = {'ground/amplitude': JOINT_STATE, 'ground/phase': JOINT_STATE}

# Of a plant, below its name.
PLANT_TOPICS = {'total': JOINT_STATE, 'beats': DIAGNOSTICS}

ROOT_2 = math.sqrt(2.0)

# Of rcl_interfaces/msg/Log.
INFO, WARNING, FAILURE = 20, 30, 40
SEVERITY = {Level.OK: INFO, Level.WARN: WARNING, Level.ERROR: FAILURE, Level.STALE: WARNING}

pack_stamp = struct.Struct('=iI').pack  # in the order of this machine, as `encode` does


class Records(NamedTuple):
    """Messages of one topic as they travel and as they are logged: their times [ns] and CDR."""

    topic: str
    type: str
    log_time_ns: Sequence[int]
    payloads: Sequence[bytes]
    latched: bool = False


@dataclass(frozen=True, slots=True)
class Topics:
    """
    Full names of the topics on which one machine is answered, and of the node that answers.

    All nodes share one topic of diagnostics: what they say there begins with the node's name, or
    two halls that both have a fan would speak of the same one.
    """

    amplitude: str
    phase: str
    amplitude_low: str
    amplitude_high: str
    velocity_rms: str
    steady_amplitude: str
    steady_phase: str
    residual: str
    demodulated_amplitude: str
    demodulated_phase: str
    events: str
    model: str
    ground_amplitude: str = ''
    ground_phase: str = ''
    diagnostics: str = DIAGNOSTICS_TOPIC
    node: str = NODE_NAME

    @classmethod
    def of(cls, namespace: str, machine: str) -> 'Topics':
        """Name the topics as a node that nobody renamed does; namespace `` or `/plant`."""
        node = f'{namespace}/{NODE_NAME}'
        return cls.named({name: f'{node}/{machine}/{name}'
                          for name in OWN_TOPICS | GROUND_TOPICS}, node=node)

    @classmethod
    def named(
        cls, topics: Mapping[str, str], *, diagnostics: str = DIAGNOSTICS_TOPIC, node: str,
    ) -> 'Topics':
        """Take full names of such topics by what follows the machine's, and that of the node."""
        return cls(diagnostics=diagnostics, node=node.strip('/'), **{
            name.replace('/', '_'): topic for name, topic in topics.items()})


def own_name(topic: str) -> str:
    """Return what follows the machine's name in a topic of ours; empty of any other."""
    # Of `steady/amplitude` and `amplitude` the longer name is meant.
    return max((name for name in OWN_TOPICS | GROUND_TOPICS | PLANT_TOPICS
                if topic.endswith(f'/{name}')), key=len, default='')


def moduli(prediction: Prediction) -> tuple[FloatArray, FloatArray]:
    """Return zero-to-peak values: displacement and force (n, 2, c), and velocity (n, c)."""
    # Bitwise the same for one speed and for many, which `np.abs` of complex numbers is not: it
    # may take another path for the tail of an array than for its body.
    sizes = _moduli(prediction.parts)
    return sizes, prediction.with_own(
        lambda: sizes[:, 0] * prediction.speed[:, None], _moduli)


def _moduli(parts: FloatArray) -> FloatArray:
    """Return moduli of real and imaginary parts, (n, 2, ...)."""
    squares = parts * parts
    return np.asarray(np.sqrt(squares[:, 0] + squares[:, 1]))


def phases(prediction: Prediction) -> tuple[FloatArray, FloatArray]:
    """Return phases in [-pi, pi] [rad]: displacement and force, and velocity, as of i X."""
    real, imag = prediction.parts[:, 0], prediction.parts[:, 1]
    return np.arctan2(imag, real), prediction.with_own(
        lambda: np.asarray(np.arctan2(real[:, 0], -imag[:, 0])),
        lambda moving: np.asarray(np.arctan2(moving[:, 1], moving[:, 0])))


class JointStateWriter:
    """
    Fill JointStates of constant names, n at a time.

    The names never change, so one message is encoded, once, and only the numbers between its
    constant bytes are replaced: the same message at a tenth of the cost. Whose they are stands
    in `header.frame_id`.
    """

    def __init__(self, names: Sequence[str], machine: str = '') -> None:
        blank = [math.nan] * len(names)
        template = encode(JOINT_STATE, {
            'header': {'frame_id': machine}, 'name': names, **dict.fromkeys(ARRAYS, blank)})
        layout = Layout.of(JOINT_STATE, template)
        arrays = [layout.span(name) for name in ARRAYS]
        starts = [at.start for at in (STAMP, *arrays)] + [layout.size]
        stops = [0] + [at.stop for at in (STAMP, *arrays)]
        self._between = [template[stop:start]
                         for stop, start in zip(stops, starts, strict=True)]
        self._width = 8 * len(names)
        self._unknown = np.full(2 * len(names), np.nan).tobytes()

    def write(self, stamp_ns: Sequence[int], values: FloatArray) -> list[bytes]:
        """Return n messages; values are (n, 3, names): position, velocity, effort, or NaN."""
        return self.write_parts(stamp_ns, values[:, ::2], values[:, 1])

    def write_parts(
        self, stamp_ns: Sequence[int], outer: FloatArray | None, velocity: FloatArray,
    ) -> list[bytes]:
        """
        Return n messages of position and effort, (n, 2, names), and velocity, (n, names).

        Position and effort that are None are NaN.
        """
        middle, width = velocity.tobytes(), self._width
        ends = self._unknown * len(stamp_ns) if outer is None else outer.tobytes()
        front, names, to_velocity, to_effort, tail = self._between
        written, start = [], 0
        for stamp in stamp_ns:
            effort, stop = 2 * start + width, start + width
            written.append(b''.join((
                front, pack_stamp(*divmod(stamp, NANOSECONDS)), names, ends[2 * start:effort],
                to_velocity, middle[start:stop], to_effort, ends[effort:2 * stop], tail)))
            start = stop
        return written


class Encoder:
    """
    Say the events of one machine in ROS messages.

    Parameters
    ----------
    machine : str
        Its name.
    channels : sequence of Channel
        What is predicted of it.
    topics : Topics
        Where.
    wants_steady : callable
        Whether anybody hears what a machine would do at constant speed, where it does not.

    """

    def __init__(
        self, machine: str, channels: Sequence[Channel], topics: Topics, *,
        wants_steady: Callable[[], bool] = lambda: True,
    ) -> None:
        self._machine, self._topics, self._wants_steady = machine, topics, wants_steady
        self._joint_states = JointStateWriter(channels, machine)
        self._housings = np.array([column for column, channel in enumerate(channels)
                                   if channel.is_housing], dtype=np.intp)
        self._velocities = JointStateWriter(
            [channel for channel in channels if channel.is_housing], machine)
        self._writers: dict[tuple[str, ...], JointStateWriter] = {}

    def encode(self, event: Event) -> Iterator[Records]:
        """Yield the messages of an event; measurements came as messages already."""
        match event:
            case Predicted():
                yield from self._predicted(event)
            case Band():
                yield from self._band(event)
            case Compared(stamp_ns=stamps, speed=speed, channels=channels):
                residual = event.residual
                yield self._states(self._topics.residual, channels, stamps, residual,
                                   speed[:, None] * residual)
            case Grounded(stamp_ns=stamp_ns, prediction=part):
                stamps = stamp_ns.tolist()
                for topic, parts in ((self._topics.ground_amplitude, moduli(part)),
                                     (self._topics.ground_phase, phases(part))):
                    yield Records(topic, JOINT_STATE, stamps,
                                  self._joint_states.write_parts(stamps, *parts))
            case Demodulated():
                yield from self._demodulated(event)
            case Remark():
                yield Records(self._topics.events, LOG, [event.stamp_ns],
                              [log_message(event, node=self._topics.node)])
            case Diagnostics():
                yield Records(self._topics.diagnostics, DIAGNOSTICS, [event.stamp_ns],
                              [diagnostic_array(event, node=self._topics.node)])
            case Model(stamp_ns=stamp_ns):
                payload = encode(STRING, {'data': json.dumps(event.description)})
                yield Records(self._topics.model, STRING, [stamp_ns], [payload], latched=True)

    def _predicted(self, event: Predicted) -> Iterator[Records]:
        stamps, topics = event.stamp_ns.tolist(), self._topics
        write = self._joint_states.write_parts
        # The amplitude is under way before the phase is even computed.
        sizes, velocity = moduli(event.prediction)
        amplitude = write(stamps, sizes, velocity)
        yield Records(topics.amplitude, JOINT_STATE, stamps, amplitude)
        phase = write(stamps, *phases(event.prediction))
        yield Records(topics.phase, JOINT_STATE, stamps, phase)
        if len(self._housings):
            rms = velocity.take(self._housings, axis=1)
            rms /= ROOT_2
            yield Records(topics.velocity_rms, JOINT_STATE, stamps,
                          self._velocities.write_parts(stamps, None, rms))
        # What rings nowhere is the steady answer: the same is not said twice.
        if (event.steady is not None and event.prediction.ringing is not None
                and self._wants_steady()):
            rows = event.prediction.ringing[0]
            steady = event.steady.at(rows)
            stamps = event.stamp_ns[rows].tolist()
            yield Records(topics.steady_amplitude, JOINT_STATE, stamps,
                          write(stamps, *moduli(steady)))
            yield Records(topics.steady_phase, JOINT_STATE, stamps,
                          write(stamps, *phases(steady)))

    def _band(self, event: Band) -> Iterator[Records]:
        stamps, speed = event.stamp_ns.tolist(), event.speed[:, None]
        for topic, values in ((self._topics.amplitude_low, event.low),
                              (self._topics.amplitude_high, event.high)):
            outer = np.stack([values, np.full(values.shape, np.nan)], axis=1)
            yield Records(topic, JOINT_STATE, stamps,
                          self._joint_states.write_parts(stamps, outer, speed * values))

    def _demodulated(self, event: Demodulated) -> Iterator[Records]:
        names = (event.channel, *(f'{event.channel}_{order}x' for order in event.orders[1:]))
        turning = event.speed[:, None] * event.orders
        yield self._states(self._topics.demodulated_amplitude, names, event.stamp_ns,
                           event.amplitude, turning * event.amplitude)
        ahead = np.arctan2(np.cos(event.phase), -np.sin(event.phase))  # of i X, in [-pi, pi]
        yield self._states(self._topics.demodulated_phase, names, event.stamp_ns, event.phase,
                           ahead)

    def _states(
        self, topic: str, names: tuple[str, ...], stamp_ns: IntArray, position: FloatArray,
        velocity: FloatArray,
    ) -> Records:
        """Return JointStates of some channels, (n, names); no force is measured."""
        writer = self._writers.get(names)
        if writer is None:
            if len(self._writers) >= MOST_LAYOUTS:
                self._writers.clear()
            writer = self._writers[names] = JointStateWriter(names, self._machine)
        stamps = stamp_ns.tolist()
        outer = np.stack([position, np.full(position.shape, np.nan)], axis=1)
        return Records(topic, JOINT_STATE, stamps, writer.write_parts(stamps, outer, velocity))


def log_message(event: Remark, *, node: str = NODE_NAME) -> bytes:
    """Return a remark as the message of every ROS log."""
    return encode(LOG, {
        'stamp': _time(event.stamp_ns), 'level': SEVERITY[event.level],
        'name': f'{node}/{event.machine}'.replace('/', '.'), 'msg': event.text})


def diagnostic_array(event: Diagnostics, *, node: str = NODE_NAME) -> bytes:
    """Return the health of a machine as the message that every ROS monitor reads."""
    return statuses((event, *event.parts), event.stamp_ns, node=node)


def statuses(events: Iterable[Diagnostics], stamp_ns: int, *, node: str) -> bytes:
    """Return any number of such, also none, as one message."""
    return encode(DIAGNOSTICS, {'header': {'stamp': _time(stamp_ns)},
                                'status': [_status(each, node) for each in events]})


def _time(stamp_ns: int) -> dict[str, int]:
    sec, nanosec = divmod(stamp_ns, NANOSECONDS)
    return {'sec': sec, 'nanosec': nanosec}


def _status(event: Diagnostics, node: str) -> dict[str, object]:
    return {
        'level': event.level, 'name': f'{node}: {event.machine} {event.name}'.rstrip(),
        'message': event.summary, 'hardware_id': event.machine,
        'values': [{'key': key, 'value': decimal(value)} for key, value in event.values.items()]}


def decimal(value: float | str) -> str:
    """Write a number without an exponent: counts as integers, quantities to the millionth."""
    return f'{value:.6f}' if isinstance(value, float) else str(value)


class Messenger:
    """A sink that says events in messages and hands them to its outlets: publishers, logs."""

    def __init__(self, encoder: Encoder, outlets: Sequence[Callable[[Records], None]]) -> None:
        self._encoder = encoder
        self._outlets = tuple(outlets)

    def __call__(self, event: Event) -> None:
        """Encode once, hand out to all."""
        for records in self._encoder.encode(event):
            for outlet in self._outlets:
                outlet(records)
