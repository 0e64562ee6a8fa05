"""How does a recorded run reach a monitor? Message by message, ticking at its own full seconds."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
import json
import math
from pathlib import Path
from typing import Any

from rotorsoil_ros.bags import reader as bag_reader
from rotorsoil_ros.bags.profile import (
    ADVICE,
    candidates,
    in_plants,
    Input,
    inputs as inputs_among,
    is_called,
    near_misses,
    place,
    SPEEDS_AT_ONCE,
)
from rotorsoil_ros.bags.reader import Source
from rotorsoil_ros.case.config import Case
from rotorsoil_ros.errors import InputError
from rotorsoil_ros.events import LAST_STAMP, NANOSECONDS
from rotorsoil_ros.monitor.monitor import Monitor
from rotorsoil_ros.wire.cdr import Cursor
from rotorsoil_ros.wire.definitions import JOINT_STATE, STRING
from rotorsoil_ros.wire.handlers import Inlet, inlet, Outlet
from rotorsoil_ros.wire.messages import Records
from rotorsoil_ros.wire.speeds import ROTOR_JOINT, SpeedSource, USUAL

AT_ONCE = 128  # speeds that may be told before measurements of the same time find them

Described = Callable[[int, Mapping[str, Any]], None]


@dataclass(frozen=True)
class Inputs:
    """
    What a bag tells of one machine.

    Attributes
    ----------
    bag : Path
        Bag directory or MCAP file.
    namespace, machine : str
        Of its topics.
    topics : mapping of str to Input
        What is told of it.
    speed : SpeedSource
        What in its speed topics is the speed.
    models : tuple of str
        Topics on which a node told what its predictions rest on.
    remarks : dict of str
        What of the bag cannot be read, and why: each once, in their order.

    """

    bag: Path
    namespace: str
    machine: str
    topics: Mapping[str, Input]
    speed: SpeedSource
    models: tuple[str, ...]
    remarks: dict[str, None]

    @classmethod
    def of(
        cls, bag: Path, *, machine: str = '', of: Case | None = None,
        speed: SpeedSource = USUAL,
    ) -> 'Inputs':
        """
        Return the inputs of a machine.

        Parameters
        ----------
        bag : Path
            Bag directory or MCAP file.
        machine : str
            Its name, `<plant>/<machine>` or <machine> of one in a plant; empty: the only one.
        of : Case or None
            Whose name to choose where the bag tells of several machines and none is named.
        speed : SpeedSource
            What tells its speed.

        Raises
        ------
        InputError
            If the bag cannot be read, or does not tell the speed of just one such machine.

        """
        remarks = dict[str, None]()
        sources = bag_reader.sources(bag, tell=remarks.setdefault)
        found: Mapping[str, Input]
        plants = in_plants((source.topic for source in sources), machine) or (
            _as_in_plant(sources, of))
        like = '' if of is None else of.name
        try:
            found, missed = inputs_among(sources, speed, plants), near_misses(sources, speed)
        except InputError as error:
            raise InputError(f'{bag}: {error}') from error
        found, speed = _of_joint(found, machine or like, of, speed)
        namespace, name = _chosen(bag, found, machine, like, missed, candidates(sources))
        beside = _ground_of(found.values(), namespace, name)
        return cls(bag, namespace, name, {
            topic: each for topic, each in found.items()
            if each.place.below in (f'{namespace}/{name}', beside if each.tells_ground else None)
            or _is_nobodys(each)}, speed,
            tuple(source.topic for source in sources
                  if is_model(source.topic, source.type)
                  and source.topic.endswith(f'/{name}/model')),
            remarks | dict.fromkeys(missed))

    @property
    def number(self) -> int:
        """Number of messages."""
        return sum(each.number for each in self.topics.values())

    @property
    def is_measured(self) -> bool:
        """Whether vibration is told."""
        return any(each.number and each.tells_vibration for each in self.topics.values())

    @property
    def tells_more(self) -> bool:
        """Whether anything but speeds is told."""
        return any(each.number and not each.tells_speed for each in self.topics.values())

    def is_wanted(self, topic: str, message_type: str) -> bool:
        """Return whether messages of a type on a topic are an input of the machine."""
        return topic in self.topics and self.topics[topic].source.type == message_type

    @property
    def spoken(self) -> str:
        """Topic under which speeds that are told in another way are told again."""
        return f'{self.namespace}/{self.machine}/joint_states'

    def inlets(self, monitor: Monitor, log: Outlet) -> dict[str, Inlet]:
        """Return what takes in the messages of each topic."""
        spoken = '' if self.speed.is_usual else self.spoken
        return {topic: inlet(
            each.place.name, topic, monitor, log=log, speed=self.speed, spoken=spoken,
            message_type=each.source.type, told=each.source.definition)
            for topic, each in self.topics.items()}

    def descriptions(self) -> list[tuple[int, Mapping[str, Any]]]:
        """Return what a node told of its model, with the time when; what is malformed is not."""
        found: list[tuple[int, Mapping[str, Any]]] = []
        for batch in bag_reader.batches(
                self.bag, lambda topic, kind: topic in self.models and is_model(topic, kind),
                at_most=1):
            if (description := _description(batch.payloads[0])) is not None:
                found.append((batch.log_time_ns[0], description))
        return found


def _chosen(
    bag: Path, found: Mapping[str, Input], machine: str, like: str, missed: Sequence[str],
    others: str,
) -> tuple[str, str]:
    """Return namespace and name of the machine that is meant."""
    told = [each for each in found.values() if each.tells_speed and each.number]
    speaking = {(each.place.namespace, each.place.machine) for each in told}
    if any(map(_is_nobodys, told)):  # such a speed is of whom the measurements are, or is asked
        speaking = {(each.place.namespace, each.place.machine) for each in found.values()
                    if not (each.tells_speed or each.tells_ground) and each.number} or {
                        ('', machine or like)}
    wanted = machine or (like if len(speaking) > 1 else '')
    chosen = {each for each in speaking if not wanted or is_called(each[1], wanted)}
    if len(chosen) == 1:
        return chosen.pop()
    speeds = ', '.join([*(topic for topic, each in found.items() if each.tells_speed),
                        *missed]) or 'none'
    needed = machine or (f'one machine, or one called {like}' if like else 'one machine')
    raise InputError(f'{bag}: must tell the speed of {needed} on joint_states or '
                     f'rotor/speed; speed topics: {speeds}{others}'
                     + (ADVICE if missed or others else ''))


def _as_in_plant(sources: Iterable[Source], case: Case | None) -> frozenset[str]:
    """Return how a machine of a plant is called, where nobody has answered it yet."""
    if case is None or case.berth is None:
        return frozenset()
    paths = [source.topic.split('/')[1:] for source in sources if place(source.topic, source.type)]
    return frozenset(f'{path[at]}/{case.name}' for path in paths
                     for at in range(len(path) - 1) if path[at + 1] == case.name)


def _of_joint(
    found: Mapping[str, Input], wanted: str, of: Case | None, speed: SpeedSource,
) -> tuple[Mapping[str, Input], SpeedSource]:
    """
    Return the inputs and what tells the speed, where a message tells it for a whole plant.

    That holds where nothing else tells it: the joint is called as the machine, unless it is said.
    """
    plant, _, name = wanted.rpartition('/')
    speaking = {topic: each for topic, each in found.items() if each.tells_speed and each.number}
    shared = [(topic, each) for topic, each in speaking.items()
              if each.source.type == JOINT_STATE and plant in ('', each.place.machine)]
    is_one_of_many = plant or (of is not None and of.berth is not None)
    if not is_one_of_many or len(shared) != 1 or any(
            is_called(each.place.machine, wanted) for each in speaking.values()):
        return found, speed
    [(topic, told)] = shared
    own = replace(told.place, machine=f'{told.place.machine}/{name}')
    return {**found, topic: replace(told, place=own)}, (
        speed if speed.joint != ROTOR_JOINT else replace(speed, joint=name))


def _ground_of(found: Iterable[Input], namespace: str, name: str) -> str:
    """Return below which name sensors on the ground of a machine are: its own or its plant's."""
    places = {each.place.below for each in found if each.tells_ground}
    own = f'{namespace}/{name}'
    for below in (own, own.rpartition('/')[0]):
        if below in places:
            return below
    # A plant whose machines have no name in common: the only one that is told of.
    speaking = {each.place.below for each in found if not each.tells_ground}
    others = places - speaking
    return others.pop() if len(others) == 1 else ''


def _is_nobodys(each: Input) -> bool:
    """Return whether a speed was named by its topic, which tells no machine."""
    return each.tells_speed and not each.place.machine


def feed(
    inputs: Inputs, monitor: Monitor, description: Mapping[str, object], *,
    log: Outlet = lambda records: None, on_description: Described | None = None,
) -> Iterator[int]:
    """
    Hand a run to a monitor, from its first message to its end; yield how many are done.

    Parameters
    ----------
    inputs : Inputs
        What is told of the machine.
    monitor : Monitor
        Who listens.
    description : mapping
        What its predictions rest on.
    log : callable
        Where accepted messages are written.
    on_description : callable
        Takes what a node told of its model when the run was recorded, at its place in time.

    """
    inlets = inputs.inlets(monitor, log)
    models = inputs.models if on_description is not None else ()
    # Where more is told than speeds, what belongs together has to come together.
    at_most, span_ns = (
        (AT_ONCE, NANOSECONDS) if inputs.tells_more else (SPEEDS_AT_ONCE, LAST_STAMP))
    second = now_ns = None
    for batch in bag_reader.batches(
            inputs.bag, lambda topic, kind: (
                inputs.is_wanted(topic, kind)
                or (topic in models and is_model(topic, kind))),
            at_most=at_most, span_ns=span_ns, tell=inputs.remarks.setdefault):
        if batch.topic in models:
            assert on_description is not None
            _tell(batch, on_description)
            continue
        if now_ns is None:
            monitor.begin(batch.log_time_ns[0], description)
        elif batch.log_time_ns[0] // NANOSECONDS != second:
            monitor.tick(batch.log_time_ns[0] // NANOSECONDS * NANOSECONDS,
                         stale_after_s=math.inf)
        second = batch.log_time_ns[0] // NANOSECONDS
        inlets[batch.topic](batch.log_time_ns, batch.payloads)
        now_ns = batch.log_time_ns[-1]
        yield len(batch.payloads)
    if now_ns is not None:
        monitor.tick(now_ns, stale_after_s=math.inf)
        monitor.finish(now_ns)


def is_model(topic: str, message_type: str) -> bool:
    """Return whether a topic is one on which a node tells what its predictions rest on."""
    return message_type == STRING and topic.endswith('/model')


def _tell(batch: Records, on_description: Described) -> None:
    for stamp, payload in zip(batch.log_time_ns, batch.payloads, strict=True):
        if (description := _description(payload)) is not None:
            on_description(stamp, description)


def _description(payload: bytes) -> dict[str, Any] | None:
    try:
        found = json.loads(Cursor(payload).text())
    except (InputError, json.JSONDecodeError, RecursionError):
        return None
    return found if isinstance(found, dict) else None
