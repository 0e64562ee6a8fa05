"""What did the speed of a machine do? Profiles in bags: found, read, written, measured."""

from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
import csv
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from rotorsoil_ros.arrays import FloatArray, IntArray
from rotorsoil_ros.bags import reader as bag_reader
from rotorsoil_ros.bags.reader import CDR, Source
from rotorsoil_ros.bags.writer import LogFile
from rotorsoil_ros.errors import InputError
from rotorsoil_ros.events import NANOSECONDS, Profile
from rotorsoil_ros.units import rpm_to_rad_s, SECONDS_PER_MINUTE
from rotorsoil_ros.wire.cdr import ARRAYS, Layout
from rotorsoil_ros.wire.definitions import FLOAT64, IMU, JOINT_STATE
from rotorsoil_ros.wire.handlers import raw_channel, ROTOR_JOINT, SPEED_TOPICS, SpeedReader, TOPICS
from rotorsoil_ros.wire.messages import JointStateWriter, Records

SPEEDS_AT_ONCE = 1024
IMU_NAME = 'measured/<channel>/imu'
MICROMETRE = 1e-6


@dataclass(frozen=True, slots=True)
class Place:
    """Where an input stands in the graph: namespace (`` or `/plant`), machine, name below it."""

    namespace: str
    machine: str
    name: str


@dataclass(frozen=True, slots=True)
class SpeedBatch:
    """Successive speeds of one topic: stamps (n,) [ns] and speeds (n,) [rad/s]."""

    topic: str
    stamp_ns: IntArray
    speed: FloatArray


def place(topic: str, message_type: str) -> Place | None:
    """Return where an input of a machine stands; None for every other topic."""
    endings = [name for name, wanted in TOPICS.items() if message_type == wanted]
    if message_type == IMU:
        endings = ['/'.join(topic.split('/')[-3:])]
        endings = endings if raw_channel(endings[0]) else []
    for name in endings:
        if topic.endswith(f'/{name}'):
            namespace, _, machine = topic.removesuffix(f'/{name}').rpartition('/')
            return Place(namespace, machine, name)
    return None


def near_misses(sources: Iterable[Source]) -> list[str]:
    """Return a line for every topic that is named like an input but is none, and why."""
    told = []
    for source in sources:
        named = next((name for name in (*TOPICS, IMU_NAME) if _is_named(source.topic, name)), '')
        needed = TOPICS.get(named, IMU)
        if named and (source.encoding != CDR or source.type != needed):
            told.append(f'{source.topic} is {source.type or "of no type"} ({source.encoding}), '
                        f'needed is {needed} ({CDR})')
    return told


def _is_named(topic: str, name: str) -> bool:
    if name == IMU_NAME:
        return raw_channel('/'.join(topic.split('/')[-3:])) is not None
    return topic.endswith(f'/{name}')


def inputs(sources: Mapping[Source, int]) -> dict[str, tuple[Place, int]]:
    """Return place and number of messages of every topic that is an input of a machine."""
    return {source.topic: (found, number) for source, number in sources.items()
            if source.encoding == CDR and (found := place(source.topic, source.type))}


def joints(path: Path, topics: Container[str]) -> list[str]:
    """Return the joints that the first message of some topics tells of."""
    found = bag_reader.messages(
        path, lambda topic, kind: topic in topics and kind == JOINT_STATE)
    for _, _, cdr in found:
        with suppress(InputError):
            return list(Layout.of(JOINT_STATE, cdr).texts['name'])
    return []


def tells_speed(topic: str, message_type: str) -> bool:
    """Return whether a topic can tell the speed of a machine."""
    found = place(topic, message_type)
    return found is not None and found.name in SPEED_TOPICS


def is_input(topic: str, message_type: str) -> bool:
    """Return whether a topic is an input of a machine: its speed or a measurement."""
    return place(topic, message_type) is not None


def speed_profile(path: Path, *, rotor_joint: str = ROTOR_JOINT) -> Iterator[SpeedBatch]:
    """
    Read every speed in a bag or MCAP file; memory does not grow with its length.

    A JointState counts at its own stamp, a Float64 at its time of reception.
    """
    readers: dict[str, SpeedReader] = {}
    for batch in bag_reader.batches(path, tells_speed, at_most=SPEEDS_AT_ONCE):
        if batch.topic not in readers:
            readers[batch.topic] = SpeedReader(
                batch.type, rotor_joint=rotor_joint, note=lambda reason, count: None)
        speeds = readers[batch.topic].read(batch.log_time_ns, batch.payloads)
        yield SpeedBatch(batch.topic, np.array(speeds.stamps, dtype=np.int64), speeds.speed)


def read_profile(
    path: str | Path, *, machine: str | None = None, rotor_joint: str = ROTOR_JOINT,
) -> Profile:
    """
    Read at which speeds a machine ran.

    Parameters
    ----------
    path : str or Path
        MCAP file or bag.
    machine : str or None
        Which machine; None for the only one.
    rotor_joint : str
        Joint whose velocity is the rotor speed.

    Returns
    -------
    Profile
        Stamps [ns] and speeds [rad/s] in the order in which they were recorded.

    Raises
    ------
    InputError
        If the file cannot be read, tells of no machine or no such one, or of several.

    """
    found: dict[str, list[SpeedBatch]] = {}
    for batch in speed_profile(Path(path), rotor_joint=rotor_joint):
        told = place(batch.topic, JOINT_STATE) or place(batch.topic, FLOAT64)
        found.setdefault(told.machine if told else '', []).append(batch)
    wanted = next(iter(found), '') if machine is None and len(found) == 1 else machine
    if wanted is None or wanted not in found:
        raise InputError(f'{path}: machine must be one of {", ".join(found) or "none: no speed"}'
                         + (f', got {machine}' if machine else ''))
    return Profile(wanted, np.concatenate([batch.stamp_ns for batch in found[wanted]]),
                   np.concatenate([batch.speed for batch in found[wanted]]))


def write_speed_profile(
    path: Path, machine: str, stamp_ns: IntArray, speed: FloatArray,
) -> None:
    """Write speeds (n,) [rad/s] at stamps (n,) [ns] as an MCAP file for replay or predict."""
    with LogFile(path) as log:
        for start in range(0, len(speed), SPEEDS_AT_ONCE):
            part = slice(start, start + SPEEDS_AT_ONCE)
            log.write(_joint_states(f'/{machine}/joint_states', ROTOR_JOINT, stamp_ns[part],
                                    velocity=speed[part]))


def import_run_up(
    source: Path, target: Path, *, machine: str, channel: str, start_ns: int,
) -> None:
    """
    Turn a table of a measured run-up into a profile with measured amplitude and phase.

    Parameters
    ----------
    source : Path
        CSV with the columns rpm, amp_1x_um (zero-to-peak) and phase_1x_deg, one row per
        revolution, in any order; lines that begin with # are comments.
    target : Path
        MCAP file to write.
    machine, channel : str
        Whose topics, and where it was measured.
    start_ns : int
        When the run-up began [ns].

    Notes
    -----
    The speed rises, so the real order is that of the speed, and a row comes one revolution
    after the row before it.

    """
    table = _columns(source, ('rpm', 'amp_1x_um', 'phase_1x_deg'))
    speed_rpm, amplitude_um, phase_deg = table[np.argsort(table[:, 0], kind='stable')].T
    if not speed_rpm[0] > 0.0:
        raise InputError(f'{source}: rpm must be > 0, got {speed_rpm[0]:g}')
    turns_s = np.concatenate([[0.0], SECONDS_PER_MINUTE / speed_rpm[:-1]]).cumsum()
    stamp_ns = start_ns + np.rint(turns_s * NANOSECONDS).astype(np.int64)
    with LogFile(target) as log:
        log.write(_joint_states(f'/{machine}/joint_states', ROTOR_JOINT, stamp_ns,
                                velocity=rpm_to_rad_s(speed_rpm)))
        log.write(_joint_states(f'/{machine}/measured/amplitude', channel, stamp_ns,
                                position=MICROMETRE * amplitude_um))
        log.write(_joint_states(f'/{machine}/measured/phase', channel, stamp_ns,
                                position=np.deg2rad(phase_deg)))


def _joint_states(topic: str, name: str, stamp_ns: IntArray, **given: FloatArray) -> Records:
    """Return JointStates of one joint, of whose arrays some are given and the others NaN."""
    values = np.full((len(stamp_ns), len(ARRAYS), 1), np.nan)
    for array, value in given.items():
        values[:, ARRAYS.index(array), 0] = value
    stamps = stamp_ns.tolist()
    return Records(topic, JOINT_STATE, stamps, JointStateWriter([name]).write(stamps, values))


def _columns(source: Path, names: Sequence[str]) -> FloatArray:
    """Read named columns of a CSV with comments, (rows, names)."""
    try:
        lines = source.read_text(encoding='utf-8').splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f'{source}: cannot be read ({error})') from error
    rows = list(csv.DictReader(line for line in lines if not line.startswith('#')))
    try:
        table = np.array([[float(row[name]) for name in names] for row in rows])
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(f'{source}: needs numbers in the columns {", ".join(names)}') from error
    if not len(table) or not np.all(np.isfinite(table)):
        raise InputError(f'{source}: needs at least one row, all of it finite')
    return table
