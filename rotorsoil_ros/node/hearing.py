"""Who tells the speed of a machine, and does it fit? Subscribes, and says what does not."""

from collections.abc import Callable
from typing import Any, NamedTuple

from rclpy.lifecycle import LifecycleNode

from rotorsoil_ros.errors import InputError
from rotorsoil_ros.node.interfaces import definition_of
from rotorsoil_ros.wire.definitions import JOINT_STATE, ros_name
from rotorsoil_ros.wire.handlers import SPEED_TOPICS
from rotorsoil_ros.wire.speeds import SpeedSource

# Subscribes, given name below the machine's, full topic, type, its definition, and what tells it.
Subscribe = Callable[[str, str, str, str, SpeedSource], None]
MOST_PLACES = 12
UNITS_SAID = {'rad_s': 'rad/s', 'rpm': 'rpm', 'hz': 'Hz', 'deg_s': 'deg/s'}


class Told(NamedTuple):
    """What tells the speed of a machine: whose topics, how, and the one that tells many."""

    machine: str
    sources: tuple[SpeedSource, ...]
    shared: str = ''


class Hearing:
    """
    The speed topics of one machine.

    A topic whose type nobody has said is heard as soon as somebody publishes on it.

    Parameters
    ----------
    node : LifecycleNode
        On whose graph.
    told : Told
        Whose topics tell it, and how.
    subscribe : callable
        Takes what is to be heard.

    """

    def __init__(
        self, node: LifecycleNode, told: Told, subscribe: Subscribe,
    ) -> None:
        self._node, self._subscribe = node, subscribe
        self._shared = str(node.resolve_topic_name(told.shared)) if told.shared else ''
        self.types: dict[str, str] = {}  # by topic; empty where it is not known yet
        self._sources: dict[str, SpeedSource] = {}
        self.rivals: tuple[str, ...] = ()
        for source in told.sources:
            for name, kind in _wanted(source):
                topic = str(node.resolve_topic_name(source.topic or f'{told.machine}/{name}'))
                self.types[topic], self._sources[topic] = kind, source
                if kind:
                    self._hear(name, topic, kind)

    def _hear(self, name: str, topic: str, kind: str) -> None:
        source = self._sources[topic]
        told = '' if (name, kind) in SPEED_TOPICS.items() else definition_of(kind)
        if not source.is_usual and (fault := source.fits(kind, told)):
            raise InputError(fault)
        self.types[topic] = kind
        self._subscribe(name, topic, kind, told, source)

    def look(self) -> tuple[int, str]:
        """Return how many publishers tell the speed, and what of them does not fit."""
        count, misfits, names = 0, list[str](), list[str]()
        for topic, kind in list(self.types.items()):
            if not self._node.count_publishers(topic):
                continue
            infos = self._node.get_publishers_info_by_topic(topic)
            fitting = [info for info in infos if info.topic_type == (kind or self._learn(
                topic, {info.topic_type for info in infos}, misfits))]
            # Of several who tell joints of a plant each may tell others.
            count += min(1, len(fitting)) if topic == self._shared else len(fitting)
            names += [f'{info.node_namespace.rstrip("/")}/{info.node_name} on {topic}'
                      for info in fitting]
            misfits += sorted({f'{topic} is {info.topic_type}, needed is {kind}'
                               for info in infos if kind and info.topic_type != kind})
        self.rivals = tuple(sorted(names)) if count > 1 else ()
        return count, '; '.join(misfits)

    def _learn(self, topic: str, kinds: set[str], misfits: list[str]) -> str:
        """Hear a topic in the type that somebody publishes; return it, or nothing."""
        for kind in sorted(kinds):
            try:
                self._hear('rotor/speed', topic, kind)
            except InputError as error:
                misfits.append(f'{topic}: {error}')
            else:
                return kind
        return ''

    def __str__(self) -> str:
        """Say what is heard."""
        return ' and '.join(
            f'{topic} ({_what(kind, source)}, {UNITS_SAID[source.unit]}{_gear(source.ratio)})'
            for (topic, kind), source in zip(self.types.items(), self._sources.values(),
                                             strict=True))


def _wanted(speed: SpeedSource) -> list[tuple[str, str]]:
    """Return names below the machine's and types of what is to be heard."""
    kind = ros_name(speed.type) if speed.type else ''
    if speed.topic or kind:
        return [('joint_states' if kind == JOINT_STATE else 'rotor/speed', kind)]
    faults = {name: '' if speed.is_usual else speed.fits(kind)
              for name, kind in SPEED_TOPICS.items()}
    fitting = [(name, SPEED_TOPICS[name]) for name, fault in faults.items() if not fault]
    if not fitting:
        raise InputError('; '.join(faults.values()))
    return fitting


def _what(kind: str, speed: SpeedSource) -> str:
    if kind == JOINT_STATE and speed.field in ('', 'velocity'):
        return f'{kind}, velocity of joint {speed.joint}'
    return ', '.join(filter(None, (kind or 'whatever is published', speed.field)))


def _gear(ratio: float) -> str:
    return '' if ratio == 1.0 else f' times {ratio:g}'


def greeting(hearing: Hearing, channels: Any, speed_range_rpm: tuple[float, float]) -> str:
    """Say what a machine hears and what it answers."""
    places = list(dict.fromkeys(channel.place for channel in channels))
    if len(places) > MOST_PLACES:  # a plant has those of all its machines
        places[MOST_PLACES:] = [f'{len(places) - MOST_PLACES} more']
    lowest, highest = speed_range_rpm
    return (f'hears {hearing}; answers {len(channels)} channels of {", ".join(places)} '
            f'from {lowest:.0f} to {highest:.0f} rpm')
