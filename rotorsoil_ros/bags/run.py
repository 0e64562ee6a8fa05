"""What did a machine do, and what was it expected to do? Read back from a log."""

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
import json
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from rotorsoil_ros.arrays import FloatArray, IntArray
from rotorsoil_ros.bags import reader as bag_reader
from rotorsoil_ros.channel import Channel
from rotorsoil_ros.errors import InputError, RotorSoilError
from rotorsoil_ros.events import NANOSECONDS
from rotorsoil_ros.monitor.orders import order_vectors, OrderVector, SpeedTrack, turns_with
from rotorsoil_ros.monitor.points import nearest, Signal
from rotorsoil_ros.monitor.verdict import Run
from rotorsoil_ros.wire.cdr import AXES, Cursor, ImuReader, JointStateReader, JointStates
from rotorsoil_ros.wire.definitions import FLOAT64, IMU, JOINT_STATE, STRING
from rotorsoil_ros.wire.handlers import are_stamps, ROTOR_JOINT, SPEED_TOPICS, SpeedReader
from rotorsoil_ros.wire.messages import Records

AT_MOST = 4096

# A velocity without a speed this near in time does not become a displacement [s].
_TOLERANCE_S = 0.5


@dataclass(frozen=True, slots=True)
class Reading:
    """Which machine and joint to read, and how many turns make one vector of raw samples."""

    machine: str = ''
    rotor_joint: str = ROTOR_JOINT
    turns: float = 10.0


@dataclass
class _Contents:
    """What has been read so far, topic by topic."""

    states: dict[str, list[JointStates]] = field(default_factory=lambda: defaultdict(list))
    floats: list[tuple[Sequence[int], FloatArray]] = field(default_factory=list)
    samples: dict[str, list[tuple[IntArray, FloatArray]]] = field(
        default_factory=lambda: defaultdict(list))
    models: list[tuple[int, Mapping[str, Any]]] = field(default_factory=list)
    malformed: int = 0
    is_synthetic: bool = False


def read_run(log: Path, reading: Reading) -> Run:
    """
    Read speeds, predictions and measurements of one machine.

    Parameters
    ----------
    log : Path
        MCAP file or bag directory with the topics of the contract, under any namespace.
    reading : Reading
        Which machine; none named: the only one.

    Raises
    ------
    InputError
        If the log cannot be read, or holds several machines or none.

    """
    topics = bag_reader.topics(log)
    machine = _machine(log, topics, reading.machine)
    wanted = {topic: kind for topic, (known, _) in topics.items()
              if (kind := _kind(topic, known, machine))}
    contents, joint_states = _Contents(), JointStateReader()
    notes: list[str] = []
    for batch in bag_reader.batches(log, lambda topic, _: topic in wanted, at_most=AT_MOST):
        _take(contents, batch, wanted[batch.topic], joint_states)
    stamp_ns, speed, angle = _speeds(contents, reading.rotor_joint)
    channels, displacement = _predictions(contents, stamp_ns)
    signals = _vectors(contents, stamp_ns, speed)
    for channel, parts in contents.samples.items():
        if channel in signals:
            notes.append(f'{channel}: measured as 1X vectors and as raw samples; the vectors '
                        'are used')
            continue
        found = list(_demodulated(parts, channel, stamp_ns, speed, angle, reading.turns))
        if found:
            signals[channel] = _signal(found)
        else:
            notes.append(f'{channel}: no vector could be found in its raw samples')
    if contents.is_synthetic:
        notes.insert(0, 'SYNTHETIC signals: computed, not measured (so says their frame)')
    if contents.malformed:
        notes.append(f'{contents.malformed} messages are malformed and were left out')
    return Run(machine, stamp_ns, speed, channels, displacement, signals,
               list(_unbalances(contents)), contents.models[-1][1] if contents.models else {},
               notes, contents.is_synthetic)


def _machine(log: Path, topics: Mapping[str, tuple[str, int]], name: str) -> str:
    """Return the machine whose speed or measurements are in the log, if it is one."""
    found = set()
    for topic, (kind, number) in topics.items():
        for ending, wanted in SPEED_TOPICS.items():
            if number and kind == wanted and topic.endswith(f'/{ending}'):
                found.add(topic.removesuffix(f'/{ending}').rpartition('/')[2])
    if name and name in found:
        return name
    if name or len(found) != 1:
        raise InputError(f'{log}: must tell the speed of {name or "one machine"} on joint_states '
                         f'or rotor/speed, got {", ".join(sorted(found)) or "none"}')
    return found.pop()


def _kind(topic: str, message_type: str, machine: str) -> str:
    """Return what a topic tells of a machine; nothing for every other topic."""
    place, _, name = topic.partition(f'{machine}/')
    if not topic.startswith('/') or (place and not place.endswith('/')):
        return ''
    wanted = {**SPEED_TOPICS, 'measured/amplitude': JOINT_STATE, 'measured/phase': JOINT_STATE,
              'amplitude': JOINT_STATE, 'phase': JOINT_STATE, 'model': STRING}
    if wanted.get(name) == message_type:
        return name
    if name.startswith('measured/') and name.endswith('/imu') and message_type == IMU:
        return name
    return ''


def _take(contents: _Contents, batch: Records, kind: str, reader: JointStateReader) -> None:
    """Decode a batch of one topic."""
    if batch.type == JOINT_STATE:
        for messages, states in reader.runs(batch.payloads):
            if states is None or not are_stamps(states.stamp_ns):
                contents.malformed += len(messages)
            else:
                contents.states[kind].append(states)
    elif batch.type == FLOAT64:
        def count(reason: str, number: int) -> None:
            contents.malformed += number

        speeds = SpeedReader(FLOAT64, rotor_joint='', note=count).read(
            batch.log_time_ns, batch.payloads)
        contents.floats.append((speeds.stamps, speeds.speed))
    elif batch.type == IMU:
        channel = kind.removeprefix('measured/').removesuffix('/imu')
        contents.samples[channel] += _accelerations(contents, batch.payloads)
    elif batch.type == STRING:
        for received, payload in zip(batch.log_time_ns, batch.payloads, strict=True):
            try:
                description = json.loads(Cursor(payload).text())
            except (InputError, json.JSONDecodeError):
                description = None
            if isinstance(description, dict):
                contents.models.append((received, description))
            else:
                contents.malformed += 1


def _accelerations(
    contents: _Contents, cdrs: Sequence[bytes],
) -> Iterator[tuple[IntArray, FloatArray]]:
    """Yield stamps [ns] and accelerations (n, 3) [m/s^2]."""
    for messages, samples in ImuReader().runs(cdrs):
        if samples is None or not are_stamps(samples.stamp_ns):
            contents.malformed += len(messages)
            continue
        contents.is_synthetic |= samples.is_synthetic
        yield samples.stamp_ns, samples.acceleration


def _speeds(contents: _Contents, joint: str) -> tuple[IntArray, FloatArray, FloatArray]:
    """Return stamps, speeds and angles (NaN where not told), ascending, each stamp once."""
    parts: list[tuple[IntArray, FloatArray, FloatArray]] = []
    for states in contents.states['joint_states']:
        if joint in states.names:
            column = states.names.index(joint)
            parts.append((states.stamp_ns, states.velocity[:, column],
                          states.position[:, column]))
    parts += [(np.array(stamps, dtype=np.int64), speed, np.full(len(speed), np.nan))
              for stamps, speed in contents.floats]
    if not parts:
        nothing = np.array([])
        return np.array([], dtype=np.int64), nothing, nothing
    stamp_ns, speed, angle = (np.concatenate(column) for column in zip(*parts, strict=True))
    given = np.isfinite(speed)
    stamp_ns, first = np.unique(stamp_ns[given], return_index=True)
    return stamp_ns, speed[given][first], angle[given][first]


def _joined(parts: Sequence[JointStates], array: str) -> dict[str, tuple[IntArray, FloatArray]]:
    """Return stamps, ascending and each once, and values of one array by channel."""
    found: dict[str, list[tuple[IntArray, FloatArray]]] = defaultdict(list)
    for states in parts:
        for column, name in enumerate(states.names):
            values = getattr(states, array)[:, column]
            given = np.isfinite(values)
            if given.any():
                found[name].append((states.stamp_ns[given], values[given]))
    joined = {}
    for name, entries in found.items():
        stamps, first = np.unique(
            np.concatenate([stamps for stamps, _ in entries]), return_index=True)
        joined[name] = stamps, np.concatenate([values for _, values in entries])[first]
    return joined


def _at(stamp_ns: IntArray, series: tuple[IntArray, FloatArray] | None) -> FloatArray:
    """Return the values of a series at exactly these stamps, NaN where it has none."""
    if series is None:
        return np.full(len(stamp_ns), np.nan)
    index = nearest(stamp_ns, series[0], tolerance=0.0)
    return np.where(index >= 0, series[1][index], np.nan)


def _predictions(
    contents: _Contents, stamp_ns: IntArray,
) -> tuple[tuple[Channel, ...], npt.NDArray[Any]]:
    """Return the displacements that a node answered at the stamps of the speeds."""
    amplitudes = _joined(contents.states['amplitude'], 'position')
    phases = _joined(contents.states['phase'], 'position')
    channels = tuple(Channel.parse(name) for name in dict.fromkeys(
        name for states in contents.states['amplitude'] for name in states.names))
    displacement = np.full((len(stamp_ns), len(channels)), complex(np.nan, np.nan))
    for column, name in enumerate(channels):
        displacement[:, column] = _at(stamp_ns, amplitudes.get(name)) * np.exp(
            1j * _at(stamp_ns, phases.get(name)))
    return channels, displacement


def _vectors(contents: _Contents, stamp_ns: IntArray, speed: FloatArray) -> dict[str, Signal]:
    """Return measured displacements; a velocity becomes one where nothing else was measured."""
    measured = {
        (quantity, array): _joined(contents.states[f'measured/{quantity}'], array)
        for quantity in ('amplitude', 'phase') for array in ('position', 'velocity')}
    signals = {}
    for name, (stamps, values) in measured['amplitude', 'velocity'].items():
        index = nearest(stamps, stamp_ns, tolerance=_TOLERANCE_S)
        turning = np.where(index >= 0, np.abs(speed[index]), np.nan) if len(speed) else np.nan
        with np.errstate(divide='ignore', invalid='ignore'):
            amplitude = values / turning
        phase = _at(stamps, measured['phase', 'velocity'].get(name)) - 0.5 * np.pi
        signals[name] = Signal(stamps, amplitude, phase, np.zeros(len(stamps)))
    for name, (stamps, values) in measured['amplitude', 'position'].items():
        phase = _at(stamps, measured['phase', 'position'].get(name))
        signals[name] = Signal(stamps, values, phase, np.zeros(len(stamps)))
    return signals


def _demodulated(
    parts: Sequence[tuple[IntArray, FloatArray]], channel: str, stamp_ns: IntArray,
    speed: FloatArray, angle: FloatArray, turns: float,
) -> Iterator[tuple[int, OrderVector]]:
    """Yield stamp and vectors of raw samples, as far as the speed is known."""
    axis = Channel.parse(channel).axis
    if axis not in AXES or not parts or len(stamp_ns) < 2:
        return
    samples_ns = np.concatenate([stamps for stamps, _ in parts])
    values = np.concatenate([rows for _, rows in parts])[:, AXES.index(axis)]
    inside = (samples_ns >= stamp_ns[0]) & (samples_ns <= stamp_ns[-1]) & np.isfinite(values)
    told = turns_with((stamp_ns - stamp_ns[0]) / NANOSECONDS, speed, angle)
    track = SpeedTrack((stamp_ns - stamp_ns[0]) / NANOSECONDS, speed,
                       angle=angle if told else None)
    if not inside.any():
        return
    try:
        for vector in order_vectors((samples_ns[inside] - stamp_ns[0]) / NANOSECONDS,
                                    values[inside], track, turns=turns):
            yield int(stamp_ns[0]) + round(vector.time * NANOSECONDS), vector
    except RotorSoilError:
        return


def _signal(found: Sequence[tuple[int, OrderVector]]) -> Signal:
    first = np.array([vector.displacement[0] for _, vector in found])
    known = np.array([vector.has_phase for _, vector in found])
    return Signal(np.array([stamp for stamp, _ in found], dtype=np.int64), np.abs(first),
                  np.where(known, np.angle(first), np.nan),
                  np.array([vector.deviation[0] for _, vector in found]))


def _unbalances(contents: _Contents) -> Iterator[tuple[int, Mapping[str, complex]]]:
    """Yield from which stamp on a node took which unbalance."""
    for stamp, description in contents.models:
        planes = description.get('unbalance')
        if isinstance(planes, Mapping):
            try:
                yield stamp, {
                    str(plane): float(value['moment_kg_m']) * complex(
                        np.exp(1j * float(value['phase_rad'])))
                    for plane, value in planes.items()}
            except (KeyError, TypeError, ValueError):
                continue
