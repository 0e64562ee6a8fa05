"""What did the speed of a machine do? Profiles in bags: found, read, written, measured."""

from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path

import numpy as np

from rotorsoil_ros.arrays import FloatArray, IntArray
from rotorsoil_ros.bags import reader as bag_reader
from rotorsoil_ros.bags.reader import CDR, Source
from rotorsoil_ros.bags.writer import LogFile
from rotorsoil_ros.errors import InputError
from rotorsoil_ros.profile import Profile
from rotorsoil_ros.wire.cdr import ARRAYS
from rotorsoil_ros.wire.definitions import DIAGNOSTICS, IMU, JOINT_STATE
from rotorsoil_ros.wire.handlers import ground_sensor, OIL_TOPIC, raw_channel, SPEED_TOPICS, TOPICS
from rotorsoil_ros.wire.messages import (
    JointStateWriter,
    NODE_NAME,
    own_name,
    OWN_TOPICS,
    Records,
)
from rotorsoil_ros.wire.speeds import ROTOR_JOINT, SpeedReader, SpeedSource, USUAL

SPEEDS_AT_ONCE = 1024
MOST_TOLD = 8
ADVICE = '; another number is read if its topic, field and unit are named (--speed-topic)'
# What to do about messages that are not encoded as those of ROS 2.
CONVERT = {'ros1': ': give the .bag of ROS 1 that it was made of, or convert that: '
                   '`rosbags-convert --src RUN.bag --dst RUN --dst-storage mcap`'}


@dataclass(frozen=True, slots=True)
class Place:
    """Where an input stands in the graph: namespace (`` or `/hall`), machine, name below it."""

    namespace: str
    machine: str
    name: str

    @property
    def below(self) -> str:
        """Below which topic it stands: the machine's, or the plant's."""
        return f'{self.namespace}/{self.machine}'


@dataclass(frozen=True, slots=True)
class Input:
    """An input of a machine in a bag: where it stands, its channel, and its messages' number."""

    place: Place
    source: Source
    number: int

    @property
    def tells_speed(self) -> bool:
        """Whether it tells a speed, not a measurement."""
        return self.place.name in SPEED_TOPICS

    @property
    def tells_vibration(self) -> bool:
        """Whether it tells how something vibrates."""
        return not (self.tells_speed or self.tells_ground or self.place.name == OIL_TOPIC)

    @property
    def tells_ground(self) -> bool:
        """Whether it tells how the ground beside a machine moves."""
        return bool(ground_sensor(self.place.name))


@dataclass(frozen=True, slots=True)
class SpeedBatch:
    """Successive speeds of one topic: stamps (n,) [ns] and speeds (n,) [rad/s]."""

    topic: str
    stamp_ns: IntArray
    speed: FloatArray


def place(topic: str, message_type: str, plants: Collection[str] = ()) -> Place | None:
    """Return where an input of a machine stands; None for every other topic."""
    for name in _names(topic):
        if message_type == TOPICS.get(name, IMU):
            return _below(topic, name, plants)
    return None


def in_plants(topics: Iterable[str], machine: str = '') -> frozenset[str]:
    """
    Return which machines are called `<plant>/<machine>`, as one is asked for or a node tells.

    What is heard of such a machine may as well be of one called `<machine>` in the namespace of
    a hall. What a node answers stands below its own name, which is between the two.
    """
    topics = frozenset(topics)
    heard = {tuple(topic.removesuffix(f'/{name}').split('/'))
             for topic in topics for name in _names(topic)}
    found = {machine}
    for path in [topic.split('/')[:-1] for topic in topics if topic.endswith('/model')]:
        between = range(1, len(path) - 1)
        ours = [at for at in between if path[at] == NODE_NAME] or [
            at for at in between if (*path[:at], *path[at + 1:]) in heard]
        found.add('/'.join(path[ours[0] + 1:]) if ours else '')
    return frozenset(name for name in found if '/' in name)


def is_called(machine: str, name: str) -> bool:
    """Return whether a name means a machine; of one in a plant its own is enough."""
    return name in (machine, machine.rpartition('/')[2])


def answered(topic: str, plants: Collection[str]) -> tuple[str, str]:
    """Return which machine a topic answers for, and which of OWN_TOPICS it is, or nothing."""
    name = own_name(topic)
    return (_below(topic, name, plants).machine, name) if name else ('', '')


def _names(topic: str) -> Iterator[str]:
    """Yield the names of inputs that a topic ends with."""
    yield from (name for name in TOPICS if topic.endswith(f'/{name}'))
    last = '/'.join(topic.split('/')[-3:])
    if raw_channel(last) or ground_sensor(last):
        yield last


def _below(topic: str, name: str, plants: Collection[str] = ()) -> Place:
    path = topic.removesuffix(f'/{name}')
    machine = next((one for one in plants if path.endswith(f'/{one}')), path.rpartition('/')[2])
    return Place(path.removesuffix(machine).removesuffix('/'), machine, name)


def near_misses(sources: Iterable[Source], speed: SpeedSource = USUAL) -> list[str]:
    """Return a line for every topic that is named like an input but is none, and why."""
    told = []
    for source in sources:
        named = next(_names(source.topic), '')
        if not named or (named in SPEED_TOPICS and speed.topic):
            continue
        needed = TOPICS.get(named, IMU)
        why = f'needed is {needed} ({CDR})' + CONVERT.get(source.encoding, '')
        if source.encoding == CDR and named in SPEED_TOPICS and not speed.is_usual:
            why = speed.fits(source.type, source.definition)
        elif source.encoding == CDR and source.type == needed:
            why = ''
        if why:
            told.append(f'{source.topic} is {source.type or "of no type"} ({source.encoding}), '
                        f'{why}')
    return told


def inputs(
    sources: Mapping[Source, int], speed: SpeedSource = USUAL, plants: Collection[str] = (),
) -> dict[str, Input]:
    """
    Return every topic that is an input of a machine.

    Parameters
    ----------
    sources : mapping of Source to int
        Channels of a bag, and how many messages each has.
    speed : SpeedSource
        What tells speeds.
    plants : collection of str
        Machines that are called `<plant>/<machine>`.

    Raises
    ------
    InputError
        If `speed` names a topic that tells none.

    """
    found = {source.topic: Input(where, source, number) for source, number in sources.items()
             if source.encoding == CDR and (where := place(source.topic, source.type, plants))}
    measured = {topic: each for topic, each in found.items() if not each.tells_speed}
    if speed.topic:
        chosen = _named(sources, speed)
        name = next((name for name in _names(chosen.topic) if name in SPEED_TOPICS), '')
        where = _below(chosen.topic, name, plants) if name else Place('', '', 'rotor/speed')
        return {**measured, chosen.topic: Input(where, chosen, sources[chosen])}
    if speed.is_usual:
        return found
    usual = {topic: each for topic, each in found.items() if each.tells_speed
             and not speed.fits(each.source.type, each.source.definition)}
    return {**measured, **(usual or {
        source.topic: Input(_below(source.topic, name, plants), source, number)
        for source, number in sources.items() for name in _names(source.topic)
        if name in SPEED_TOPICS and source.encoding == CDR
        and not speed.fits(source.type, source.definition)})}


def _named(sources: Iterable[Source], speed: SpeedSource) -> Source:
    """Return the channel that a speed is said to come from."""
    topic = f'/{speed.topic.strip("/")}'
    there = [source for source in sources if source.topic == topic]
    if not there:
        names = sorted({source.topic for source in sources})
        near = get_close_matches(topic, names, n=1)
        raise InputError(f'{topic}: no such topic; ' + (
            f'did you mean {near[0]}?' if near else f'there are {", ".join(names) or "none"}'))
    faults = {source: f'is encoded as {source.encoding}, needed is {CDR}'
              + CONVERT.get(source.encoding, '')
              if source.encoding != CDR else speed.fits(source.type, source.definition)
              for source in there}
    fitting = [source for source, fault in faults.items() if not fault]
    if not fitting:
        raise InputError(f'{topic}: ' + '; '.join(faults.values()))
    usual = [source for source in fitting if source.type == JOINT_STATE] or fitting
    if len(usual) > 1:
        raise InputError(f'{topic}: has messages of several types that can tell a speed: '
                         f'{", ".join(source.type for source in usual)}; name one of them')
    return usual[0]


def candidates(sources: Iterable[Source]) -> str:
    """Say which topics hold a number that could be a speed, if one were told which."""
    found = [f'{source.topic} ({source.type})' for source in sources
             if source.encoding == CDR and not next(_names(source.topic), '')
             and source.type not in (*OWN_TOPICS.values(), DIAGNOSTICS)
             and source.definition and not USUAL.fits(source.type, source.definition)]
    return f'; numbers are on {", ".join(found[:MOST_TOLD])}' if found else ''


def speed_profile(path: Path, speed: SpeedSource = USUAL) -> Iterator[SpeedBatch]:
    """
    Read every speed in a bag or MCAP file; memory does not grow with its length.

    A stamped message counts at its own stamp, any other at its time of reception.
    """
    told = {topic: each for topic, each in inputs(bag_reader.sources(path), speed).items()
            if each.tells_speed}
    readers = {topic: SpeedReader(
        each.source.type, speed, note=lambda reason, count: None, told=each.source.definition)
        for topic, each in told.items()}
    for batch in bag_reader.batches(
            path, lambda topic, kind: topic in told and told[topic].source.type == kind,
            at_most=SPEEDS_AT_ONCE):
        speeds = readers[batch.topic].read(batch.log_time_ns, batch.payloads)
        yield SpeedBatch(batch.topic, np.array(speeds.stamps, dtype=np.int64), speeds.speed)


def read_profile(
    path: str | Path, *, machine: str | None = None, speed: SpeedSource = USUAL,
) -> Profile:
    """
    Read at which speeds a machine ran.

    Parameters
    ----------
    path : str or Path
        MCAP file or bag.
    machine : str or None
        Which machine; None for the only one.
    speed : SpeedSource
        What tells its speed.

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
    plants = in_plants((source.topic for source in bag_reader.sources(Path(path))), machine or '')
    for batch in speed_profile(Path(path), speed):
        name = next(_names(batch.topic), '')
        found.setdefault(_below(batch.topic, name, plants).machine if name else machine or '',
                         []).append(batch)
    chosen = [each for each in found if machine is None or is_called(each, machine)]
    if len(chosen) != 1:
        raise InputError(f'{path}: machine must be one of {", ".join(found) or "none: no speed"}'
                         + (f', got {machine}' if machine else ''))
    [wanted] = chosen
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


def _joint_states(topic: str, name: str, stamp_ns: IntArray, **given: FloatArray) -> Records:
    """Return JointStates of one joint, of whose arrays some are given and the others NaN."""
    values = np.full((len(stamp_ns), len(ARRAYS), 1), np.nan)
    for array, value in given.items():
        values[:, ARRAYS.index(array), 0] = value
    stamps = stamp_ns.tolist()
    return Records(topic, JOINT_STATE, stamps, JointStateWriter([name]).write(stamps, values))
