"""How does a recorded run reach a monitor? Message by message, ticking at its own full seconds."""

from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
import json
import math
from pathlib import Path
from typing import Any

import numpy as np

from rotorsoil_ros.arrays import ComplexArray
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
from rotorsoil_ros.case.machine import Machine
from rotorsoil_ros.errors import InputError
from rotorsoil_ros.events import LAST_STAMP, NANOSECONDS
from rotorsoil_ros.machine.response import ResponseTable
from rotorsoil_ros.machine.transient.poles import Poles
from rotorsoil_ros.monitor.beside.companions import companions_of
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
            or _is_nobodys(each)}, speed, _models_of(name, sources),
            remarks | dict.fromkeys(missed))

    def beside(self, other: Case) -> 'Inputs | None':
        """
        Return what tells the speed of another machine of the same plant, and nothing else.

        None where no topic tells it and no node has answered that machine: where one has, it was
        listened to in vain.
        """
        plant = self.machine.rpartition('/')[0]
        name = f'{plant}/{other.name}' if plant else other.name
        try:
            found = Inputs.of(self.bag, machine=name, of=other)
        except InputError:
            found = self
        if (found.namespace, found.machine) == (self.namespace, name):
            return replace(found, topics={
                topic: each for topic, each in found.topics.items() if each.tells_speed})
        models = _models_of(name, bag_reader.sources(self.bag))
        return replace(self, machine=name, topics={}, models=models) if models else None

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


def _models_of(machine: str, sources: Iterable[Source]) -> tuple[str, ...]:
    return tuple(source.topic for source in sources if is_model(source.topic, source.type)
                 and source.topic.endswith(f'/{machine}/model'))


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


@dataclass(frozen=True)
class OtherMachine:
    """A machine that runs beside another in a bag: what is told of it, and to whom."""

    inputs: Inputs
    monitor: Monitor

    def on_description(self, stamp_ns: int, description: Mapping[str, Any]) -> None:
        """Take the unbalance that a node took."""
        unbalance = described_unbalance(description, self.monitor.table)
        if unbalance is not None:
            self.monitor.set_unbalance(unbalance)


def stand_beside(machine: Machine, monitor: Monitor, inputs: Inputs) -> list[OtherMachine]:
    """
    Have a monitor take out what machines of the same plant do, as a bag tells their speeds.

    Parameters
    ----------
    machine, monitor : Machine, Monitor
        Who is watched.
    inputs : Inputs
        What is told of it.

    Returns
    -------
    list of OtherMachine
        Whom `feed` should hand what is told of them.

    """
    beside, others = [], list(machine.others())
    for other in others:
        if (told := inputs.beside(other.case)) is not None:
            # Its part is asked for at its speed: what its own run-ups strike is not followed.
            table = replace(other.table, poles=Poles.none('it is a machine beside another'))
            beside.append(OtherMachine(told, Monitor(
                other.case.name, table, other.case.unbalance, sinks=[])))
    monitor.stand_beside(companions_of(machine, others, {
        machine.case.name: monitor, **{each.monitor.machine: each.monitor for each in beside}}))
    return beside


def feed(
    inputs: Inputs, monitor: Monitor, description: Mapping[str, object], *,
    log: Outlet = lambda records: None, on_description: Described | None = None,
    beside: Sequence[OtherMachine] = (),
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
    beside : sequence of OtherMachine
        Other machines whose speeds matter; their descriptions are followed where those are.

    """
    inlets: dict[str, list[Inlet]] = defaultdict(list)
    models: dict[str, Described] = {}
    for told, watched, follow in ((inputs, monitor, on_description), *(
            (one.inputs, one.monitor, on_description and one.on_description) for one in beside)):
        for topic, taken_in in told.inlets(watched, log).items():
            inlets[topic].append(taken_in)
        if follow is not None:
            models |= dict.fromkeys(told.models, follow)
    # Where more is told than speeds, what belongs together has to come together.
    at_most, span_ns = (
        (AT_ONCE, NANOSECONDS) if inputs.tells_more else (SPEEDS_AT_ONCE, LAST_STAMP))
    second = now_ns = None
    wanted = [inputs, *(one.inputs for one in beside)]
    for batch in bag_reader.batches(
            inputs.bag, lambda topic, kind: (
                any(each.is_wanted(topic, kind) for each in wanted)
                or (topic in models and is_model(topic, kind))),
            at_most=at_most, span_ns=span_ns, tell=inputs.remarks.setdefault):
        if batch.topic in models:
            _tell(batch, models[batch.topic])
            continue
        if now_ns is None:
            monitor.begin(batch.log_time_ns[0], description)
        elif batch.log_time_ns[0] // NANOSECONDS != second:
            monitor.tick(batch.log_time_ns[0] // NANOSECONDS * NANOSECONDS,
                         stale_after_s=math.inf)
        second = batch.log_time_ns[0] // NANOSECONDS
        for take_in in inlets[batch.topic]:
            take_in(batch.log_time_ns, batch.payloads)
        now_ns = batch.log_time_ns[-1]
        yield len(batch.payloads) if batch.topic in inputs.topics else 0
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


def described_unbalance(
    description: Mapping[str, Any], table: ResponseTable,
) -> ComplexArray | None:
    """Return the unbalance that a node took, (p,) [kg m], if it answered from a table."""
    tables = description.get('tables')
    if not isinstance(tables, Mapping) or tables.get('response') != table.key:
        return None
    try:
        planes = {str(plane): float(value['moment_kg_m']) * complex(
            np.exp(1j * float(value['phase_rad'])))
            for plane, value in description['unbalance'].items()}
    except (AttributeError, KeyError, TypeError, ValueError):
        return None
    return np.array([planes.get(plane, 0.0) for plane in table.planes], dtype=complex)


def _description(payload: bytes) -> dict[str, Any] | None:
    try:
        found = json.loads(Cursor(payload).text())
    except (InputError, json.JSONDecodeError, RecursionError):
        return None
    return found if isinstance(found, dict) else None
