"""What would the node have answered to a recorded profile? The same numbers, without a graph."""

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import AbstractContextManager, ExitStack
from dataclasses import dataclass
import math
from pathlib import Path
from typing import Protocol

from rotorsoil_ros.bags import reader as bag_reader
from rotorsoil_ros.bags.profile import BATCH, Place, place
from rotorsoil_ros.bags.writer import LogFile
from rotorsoil_ros.case.machine import Machine
from rotorsoil_ros.errors import InputError
from rotorsoil_ros.events import Event, LAST_STAMP, NANOSECONDS
from rotorsoil_ros.monitor.criteria import criteria
from rotorsoil_ros.monitor.judge import Judging
from rotorsoil_ros.monitor.monitor import Monitor
from rotorsoil_ros.wire.handlers import Inlet, inlet, ROTOR_JOINT, SPEED_TOPICS
from rotorsoil_ros.wire.messages import Encoder, Messenger, Records, Topics

AT_ONCE = 128  # speeds that may be told before measurements of the same time find them


@dataclass(frozen=True, slots=True)
class Answered:
    """What became of a profile: under which name, and how many speeds for which reason."""

    machine: str
    counts: Counter[str]


class Screen(Protocol):
    """Who shows events, those since the last flush at once."""

    def __call__(self, event: Event) -> None:
        """Take an event."""

    def flush(self) -> None:
        """Show what was taken."""


Opens = Callable[[str], AbstractContextManager[Screen]]


def predict(
    machine: Machine, profile: Path, out: Path, *, screen: Opens | None = None,
    rotor_joint: str = ROTOR_JOINT, progress: Callable[[int, int], None] | None = None,
) -> Answered:
    """
    Answer every speed of a profile and log it as the node would.

    Parameters
    ----------
    machine : Machine
        Case and table.
    profile : Path
        Bag directory or MCAP file; where it tells of several machines, the one that is named
        like the case is answered.
    out : Path
        Log to write: profile, measurements and answers.
    screen : callable
        Opens who shows the events of a machine, given its name.
    rotor_joint : str
        Joint whose velocity is the rotor speed.
    progress : callable
        Called with the number of messages read and their total.

    Raises
    ------
    InputError
        If a file cannot be read or tells no speed, or if `out` is the profile itself.

    """
    inputs = _inputs(profile, machine.case.name)
    if out.exists() and any(out.samefile(file) for file in bag_reader.files(profile)):
        raise InputError(f'{out}: is the profile itself')
    first = next(iter(inputs.values()))[0]
    name = first.machine or machine.case.name
    with ExitStack() as stack:
        log = stack.enter_context(LogFile(out))
        encoder = Encoder(machine.table.channels, Topics.of(first.namespace, name))
        viewer = [stack.enter_context(screen(name))] if screen else []
        monitor = Monitor(name, machine.table, machine.case.unbalance,
                          sinks=[Messenger(encoder, [log.write]), *viewer],
                          judging=Judging.of(machine.case))
        monitor.judge.take_criteria(criteria(
            machine.case, machine.model, machine.case.unbalance, machine.directory))
        inlets = {topic: inlet(found.name, topic, monitor, rotor_joint=rotor_joint, log=log.write)
                  for topic, (found, _) in inputs.items()}
        at_most, span_ns = BATCH, LAST_STAMP
        if any(found.name not in SPEED_TOPICS for found, _ in inputs.values()):
            at_most, span_ns = AT_ONCE, NANOSECONDS
        batches = bag_reader.batches(profile, lambda topic, _: topic in inputs,
                                     at_most=at_most, span_ns=span_ns)
        total, done = sum(number for _, number in inputs.values()), 0
        description = machine.description(name, machine.case.unbalance)
        for number in _feed(batches, inlets, monitor, description):
            done += number
            for sink in viewer:
                sink.flush()
            if progress:
                progress(done, total)
    return Answered(name, monitor.health.counts)


def _feed(
    batches: Iterable[Records], inlets: Mapping[str, Inlet],
    monitor: Monitor, description: Mapping[str, object],
) -> Iterator[int]:
    """Hand batches to their inlets, ticking at every full second of their time; yield sizes."""
    second = now_ns = None
    for batch in batches:
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


def _inputs(profile: Path, name: str) -> dict[str, tuple[Place, int]]:
    """Return place and number of messages of every input of the machine to answer."""
    found = {topic: (where, number)
             for topic, (kind, number) in bag_reader.topics(profile).items()
             if (where := place(topic, kind))}
    machines = {(where.namespace, where.machine) for where, number in found.values()
                if where.name in SPEED_TOPICS and number}
    if len(machines) > 1:
        machines = {machine for machine in machines if machine[1] == name}
    if len(machines) != 1:
        speeds = ', '.join(topic for topic, (where, _) in found.items()
                           if where.name in SPEED_TOPICS) or 'none'
        raise InputError(f'{profile}: needs one machine, or one called {name}, that tells its '
                         f'speed on joint_states or rotor/speed; speed topics: {speeds}')
    return {topic: (where, number) for topic, (where, number) in found.items()
            if (where.namespace, where.machine) in machines}
