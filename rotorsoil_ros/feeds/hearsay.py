"""What has come of the node's topics, from whatever network, until somebody reads it."""

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
import json
import math
from threading import Lock
from typing import Protocol

from rotorsoil_ros.arrays import FloatArray
from rotorsoil_ros.errors import InputError
from rotorsoil_ros.monitor.verdict import VIBRATION
from rotorsoil_ros.wire.cdr import Layout
from rotorsoil_ros.wire.definitions import DIAGNOSTICS, JOINT_STATE, STRING
from rotorsoil_ros.wire.messages import (
    DIAGNOSTICS_TOPIC,
    NODE_NAME,
    own_name,
    OWN_TOPICS,
    PLANT_TOPICS,
)
from rotorsoil_ros.wire.sensors import JointStateReader

# Topics of machines and plants that a feed hears: which quantities each tells, in which fields.
MODEL, TOTAL = 'model', 'total'
TOLD: Mapping[str, Mapping[str, str]] = {
    'amplitude': {'Amplitude': 'position'}, 'phase': {'Phase': 'position'},
    'amplitude_low': {'AmplitudeLow': 'position'}, 'amplitude_high': {'AmplitudeHigh': 'position'},
    'velocity_rms': {'VelocityRms': 'velocity'}, 'residual': {'Residual': 'position'},
    TOTAL: {'Amplitude': 'position', 'VelocityRms': 'velocity'}}
HEARD = (*TOLD, MODEL)
MOST_REPORTS = 10_000  # that wait to be read: a minute of fifty machines
MOST_TOPICS = 10_000


@dataclass(frozen=True, slots=True)
class Speaker:
    """
    Who speaks: a machine or a plant, and the node that answers for it.

    Of `watcher/house/fan` nobody can tell whether `house` is a plant or the node is called
    `watcher/house`; where it matters the node has its usual name.
    """

    node: str
    machine: str

    @classmethod
    def of(cls, topic: str) -> tuple['Speaker', str] | None:
        """Return who speaks on a topic of ours, and which topic it is; None of any other."""
        name = own_name(topic)
        path = topic.removesuffix(f'/{name}').strip('/').split('/')
        node = path.index(NODE_NAME) + 1 if NODE_NAME in path[:-1] else len(path) - 1
        is_heard = name in HEARD and node > 0 and path[-1]
        return (cls('/'.join(path[:node]), '/'.join(path[node:])), name) if is_heard else None

    @property
    def name(self) -> str:
        """How feeds call it: `fan`, `hall_2.fan`, `house/fan` in a plant, or `watcher.fan`."""
        parts = [part for part in self.node.split('/') if part and part != NODE_NAME]
        return '.'.join([*parts, self.machine])

    @property
    def path(self) -> str:
        """Where its topics are."""
        return f'{self.node}/{self.machine}'


def places_in(topics: Mapping[str, str]) -> list[Speaker]:
    """Return who answers in a graph, by its topics and their types: whoever has all of ours."""
    return [known[0] for sign, ours in (('amplitude_low', OWN_TOPICS), (TOTAL, PLANT_TOPICS))
            for topic in topics
            if topic.endswith(f'/{sign}') and (known := Speaker.of(topic)) is not None
            and all(topics.get(f'/{known[0].path}/{name}') == kind
                    for name, kind in ours.items())]


class Taker(Protocol):
    """Whoever takes messages as they come."""

    def take(self, topic: str, cdr: bytes) -> None:
        """Take one message of a topic."""


class Inbox:
    """
    Takes messages from one thread and gives them to another; neither waits for work of the other.

    Of what is a value only the last counts, and is decoded only when somebody reads it: a
    thousand speeds a second cost no more than one.
    """

    def __init__(self) -> None:
        self._lock = Lock()
        self._last: dict[str, bytes] = {}
        self._reports: deque[bytes] = deque(maxlen=MOST_REPORTS)

    def take(self, topic: str, cdr: bytes) -> None:
        """Keep a message for whoever reads."""
        with self._lock:
            if topic == DIAGNOSTICS_TOPIC:
                self._reports.append(cdr)
            elif topic in self._last or len(self._last) < MOST_TOPICS:
                self._last[topic] = cdr

    def read(self) -> tuple[dict[str, bytes], list[bytes]]:
        """Return the last message of each topic that has spoken, and all diagnostics."""
        with self._lock:
            last, self._last = self._last, {}
            reports = list(self._reports)
            self._reports.clear()
        return last, reports


@dataclass(frozen=True, slots=True)
class Report:
    """One status of the diagnostics."""

    stamp_ns: int
    name: str
    level: int
    summary: str
    values: Mapping[str, str]

    @property
    def of(self) -> str:
        """Where the topics are of whom it tells, whichever part of that is the node's name."""
        return self.name.removesuffix(f' {VIBRATION}').replace(': ', '/', 1)

    def number(self, key: str) -> float:
        """Return a value as a number; NaN where it is none."""
        try:
            return float(self.values.get(key, 'nan'))
        except ValueError:
            return math.nan


def reports_of(cdr: bytes) -> list[Report]:
    """Return the statuses of a message of diagnostics; none of one that cannot be read."""
    try:
        layout = Layout.of(DIAGNOSTICS, cdr)
    except InputError:
        return []
    row, texts, found = layout.rows([cdr])[0], layout.texts, list[Report]()
    while f'status[{len(found)}].name' in texts:
        at = f'status[{len(found)}]'
        values, number = {}, 0
        while (key := texts.get(f'{at}.values[{number}].key')) is not None:
            values[key[0]] = texts[f'{at}.values[{number}].value'][0]
            number += 1
        found.append(Report(layout.stamp_ns(cdr), texts[f'{at}.name'][0],
                            int(row[f'{at}.level']), texts[f'{at}.message'][0], values))
    return found


class VectorReader:
    """Reads JointStates, one after the other of one publisher."""

    def __init__(self) -> None:
        self._readers: dict[str, JointStateReader] = {}

    def read(self, topic: str, cdr: bytes) -> tuple[int, tuple[str, ...], dict[str, FloatArray]]:
        """Return stamp [ns], names and fields; no names of what cannot be read."""
        reader = self._readers.setdefault(topic, JointStateReader())
        for _, states in reader.runs([cdr]):
            if states is not None:
                return int(states.stamp_ns[0]), states.names, {
                    'position': states.position[0], 'velocity': states.velocity[0]}
        return 0, (), {}


def channels_of(cdr: bytes) -> tuple[str, ...]:
    """Return the channels that a model describes; none of what is no model."""
    try:
        described = json.loads(Layout.of(STRING, cdr).texts['data'][0])
        return tuple(str(channel) for channel in described['channels'])
    except (InputError, ValueError, KeyError, TypeError):
        return ()


def type_of(name: str) -> str:
    """Return the type of a topic of a machine."""
    return OWN_TOPICS.get(name, JOINT_STATE)
