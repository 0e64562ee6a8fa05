"""One machine on the graph: its subscriptions, its monitor and its publishers."""

from collections.abc import Collection, Mapping
from dataclasses import replace
from functools import partial
from typing import Any

from rclpy.lifecycle import LifecycleNode, LifecyclePublisher
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

from rotorsoil_ros.case.machine import Machine
from rotorsoil_ros.errors import InputError
from rotorsoil_ros.events import Event, Level, Remark, Sink
from rotorsoil_ros.monitor.monitor import Monitor
from rotorsoil_ros.node.criteria_feed import Bench
from rotorsoil_ros.node.hearing import greeting, Hearing, Told
from rotorsoil_ros.node.interfaces import message_class
from rotorsoil_ros.node.numbered import Numbered
from rotorsoil_ros.node.run_log import RunLog
from rotorsoil_ros.node.settings import key, Settings
from rotorsoil_ros.node.together import Together
from rotorsoil_ros.units import rad_s_to_rpm
from rotorsoil_ros.wire.dating import Arrival
from rotorsoil_ros.wire.definitions import IMU, STRING, TEMPERATURE
from rotorsoil_ros.wire.handlers import (
    ground_sensor,
    Inlet,
    inlet,
    MEASURED_TOPICS,
    OIL_TOPIC,
    raw_channel,
)
from rotorsoil_ros.wire.messages import (
    Encoder,
    GROUND_TOPICS,
    Messenger,
    OWN_TOPICS,
    Records,
    Topics,
)
from rotorsoil_ros.wire.speeds import SpeedSource

RAW_DEPTH = 1000  # samples kept while the node is busy
OUTPUT = QoSProfile(depth=10)
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class Watch:
    """
    Watches one machine while the node is active.

    Messages stay bytes from the middleware to the monitor and back: what is published is what
    is logged, and what a foreign publisher sends cannot break the node.

    Parameters
    ----------
    node : LifecycleNode
        Of whose graph it takes part in.
    name : str
        Of the machine, first part of its topics; `<plant>/<machine>` in a plant.
    machine : Machine
        What is watched.
    told : Told
        What tells its speed.
    plant : Together or None
        What it does with those beside it.

    """

    def __init__(
        self, node: LifecycleNode, name: str, machine: Machine, *, settings: Settings,
        told: Told, log: RunLog, diagnostics: LifecyclePublisher, bench: Bench,
        plant: Together | None = None,
    ) -> None:
        self.name = name
        self.is_active = False
        self._node = node
        self._machine = machine
        self._settings = settings
        self._subscriptions: list[Any] = []
        self._numbered: dict[str, Numbered] = {}
        self._log, self._bench, self.plant = log, bench, plant
        self._arrival = Arrival(lambda: int(node.get_clock().now().nanoseconds))
        self._topics = self._publish(diagnostics)
        if machine.ground is not None:
            self._topics = replace(self._topics, **self._publish_ground())
        self._shown_channels = machine.table.channels
        self._said: set[str] = set()
        self.monitor = Monitor(name, machine.table, self._unbalance(), sinks=self._sinks(),
                               judging=settings.judging(name, machine.case),
                               oils=machine.oils, ground=machine.ground)
        if plant is not None:
            plant.join(self.monitor)
        self._raw_topics: dict[str, str] = {}
        try:
            self._hearing = Hearing(node, told, self._hear_speed)
        except InputError as error:
            raise InputError(f'parameter {key(name)}.speed: {error}') from error
        self._subscribe()

    def begin(self, now_ns: int) -> None:
        """Greet, and answer from now on."""
        self.is_active = True
        lowest, highest = self.monitor.table.speed_range
        self._node.get_logger().info(f'{self.name}: ' + greeting(
            self._hearing, self.monitor.table.channels,
            (rad_s_to_rpm(lowest), rad_s_to_rpm(highest))))
        if beside := list(self._ground_topics()):
            self._node.get_logger().info(
                f'{self.name}: hears sensors on the ground on {" and ".join(beside)} '
                '(sensor_msgs/msg/Imu)')
        self.monitor.begin(now_ns, self._description())
        self._ask()

    def tick(self, now_ns: int, *, stale_after_s: float, topics: Collection[str]) -> None:
        """Report the health of the machine; hear sensors among the topics of the graph."""
        if self.is_active:
            self._hear_sensors(topics)
            self._look_who_speaks()
            for topic, numbered in self._numbered.items():
                numbered.hear_of(self._node.count_publishers(topic))
            self.monitor.tick(now_ns, stale_after_s=stale_after_s)

    def take_unbalance(self, now_ns: int) -> None:
        """Use the unbalance that the parameters now have, from the next speed on."""
        self.monitor.set_unbalance(self._unbalance())
        if self.is_active:
            self.monitor.describe(now_ns, self._description())
            self._ask()

    def take_machine(self, machine: Machine) -> str:
        """Answer from another case, from the next speed on; return what to add of it."""
        self._machine = machine
        if machine.ground is not None and not self._topics.ground_amplitude:
            self._topics = replace(self._topics, **self._publish_ground())
        self._look_for_ground()
        self._settings.renew_unbalance(self.name, machine)
        self.monitor.take_table(
            machine.table, self._unbalance(), sinks=self._sinks(),
            judging=self._settings.judging(self.name, machine.case), oils=machine.oils,
            ground=machine.ground)
        if self.is_active:
            self.monitor.describe(
                self._node.get_clock().now().nanoseconds, self._description())
            self._ask()
        return '' if self._is_shown else '; its channels are others: no longer shown by rerun'

    def destroy(self) -> None:
        """Leave the graph."""
        self.is_active = False
        for subscription in self._subscriptions:
            self._node.destroy_subscription(subscription)
        for publisher in self._own_publishers:
            self._node.destroy_lifecycle_publisher(publisher)

    @property
    def machine(self) -> Machine:
        """What is watched."""
        return self._machine

    @property
    def _is_shown(self) -> bool:
        """Whether the viewer, which was opened with the first case, knows the channels."""
        return self._machine.table.channels == self._shown_channels

    def _sinks(self) -> list[Sink]:
        is_written = self._log.is_written
        steady = [publisher for name, publisher in zip(
            OWN_TOPICS, self._own_publishers, strict=False) if name.startswith('steady/')]
        encoder = Encoder(
            self.name, self._machine.table.channels, self._topics, wants_steady=lambda: (
                is_written or any(publisher.get_subscription_count() for publisher in steady)))
        outlets = [self._send, self._log.write] if is_written else [self._send]
        sinks: list[Sink] = [Messenger(encoder, outlets), self._tell]
        if self.plant is not None:
            sinks.append(self.plant)
        return [*sinks, self._log.show] if self._is_shown and self._log.is_shown else sinks

    def _tell(self, event: Event) -> None:
        """Say in the node's own log what somebody should act on."""
        if isinstance(event, Remark) and event.level is not Level.OK:
            self._node.get_logger().warning(f'{self.name}: {event.text}')

    def _ask(self) -> None:
        """Have the band of what is predicted computed, and what else it is judged by."""
        self._bench.ask(self.name, self._machine, self._unbalance(),
                        self.monitor.judge.take_criteria)

    def _look_who_speaks(self) -> None:
        """Count who tells the speed; name them when they are several."""
        health = self.monitor.health
        health.publishers, health.misfit = self._hearing.look()
        if rivals := ', '.join(self._hearing.rivals):
            self._say_once(f'more than one publisher tells its speed: {rivals}')

    def _say_once(self, text: str) -> None:
        """Say something on the terminal, and nothing if it was said before."""
        if text not in self._said:
            self._said.add(text)
            self._node.get_logger().warning(f'{self.name}: {text}')

    def _publish(self, diagnostics: LifecyclePublisher) -> Topics:
        """Create the publishers; return the names that their topics have after remapping."""
        self._own_publishers = self._create(OWN_TOPICS)
        # Past the lifecycle's own gate, which takes a microsecond: nothing is sent unless active.
        self._publish_on = {publisher.topic_name: partial(Publisher.publish, publisher)
                            for publisher in (*self._own_publishers, diagnostics)}
        return Topics.named(
            {name: publisher.topic_name for name, publisher in zip(
                OWN_TOPICS, self._own_publishers, strict=True)},
            diagnostics=diagnostics.topic_name, node=self._node.get_fully_qualified_name())

    def _create(self, topics: Mapping[str, str]) -> list[LifecyclePublisher]:
        return [self._node.create_lifecycle_publisher(
            message_class(kind), f'~/{self.name}/{name}', LATCHED if kind == STRING else OUTPUT)
            for name, kind in topics.items()]

    def _publish_ground(self) -> dict[str, str]:
        """Create the publishers of what ground that moves does; return their topics' names."""
        created = self._create(GROUND_TOPICS)
        self._own_publishers += created
        self._publish_on |= {publisher.topic_name: partial(Publisher.publish, publisher)
                             for publisher in created}
        return {name.replace('/', '_'): publisher.topic_name
                for name, publisher in zip(GROUND_TOPICS, created, strict=True)}

    def _subscribe(self) -> None:
        for name, kind in MEASURED_TOPICS.items():
            self._hear(name, kind, depth=self._settings.value('speed_depth'))
        if self._machine.oils:
            self._hear(OIL_TOPIC, TEMPERATURE, depth=self._settings.value('speed_depth'))
        for channel in self._machine.table.channels:
            name = f'measured/{channel}/imu'
            if raw_channel(name):
                self._raw_topics[self._node.resolve_topic_name(f'{self.name}/{name}')] = name
        self._look_for_ground()

    def _look_for_ground(self) -> None:
        """Hear sensors on the ground, which all machines of a plant share."""
        self._raw_topics |= {topic: name for topic, name in self._ground_topics().items()
                             if topic not in self._numbered}

    def _ground_topics(self) -> dict[str, str]:
        """Return the topics of these sensors, and their names below the machine or its plant."""
        place = self.name if self.plant is None else self.plant.name
        names = [f'ground/{sensor.name}/imu' for sensor in self._machine.case.sensors.ground]
        return {self._node.resolve_topic_name(f'{place}/{name}'): name for name in names}

    def _hear_sensors(self, topics: Collection[str]) -> None:
        """Subscribe to raw samples that somebody publishes; of most channels nobody does."""
        for topic in self._raw_topics.keys() & topics:
            self._hear(self._raw_topics.pop(topic), IMU, depth=RAW_DEPTH, topic=topic)

    def _hear(self, name: str, kind: str, *, depth: int, topic: str = '') -> None:
        """Subscribe to what is measured."""
        topic = topic or str(self._node.resolve_topic_name(f'{self.name}/{name}'))
        # What several machines hear is logged once.
        is_logged = not ground_sensor(name) or self.plant is None or (
            next(iter(self.plant.monitors)) == self.name)
        log = self._log.write if is_logged else _nowhere
        self._take(inlet(name, topic, self.monitor, log=log), topic, kind, depth,
                   lost_as='measurements_dropped')

    def _hear_speed(
        self, name: str, topic: str, kind: str, told: str, source: SpeedSource,
    ) -> None:
        """Subscribe to what tells the speed; it is logged as a plain node would hear it."""
        own, plain = (str(self._node.resolve_topic_name(f'{self.name}/{each}'))
                      for each in (name, 'joint_states'))
        self._take(inlet(name, topic, self.monitor, log=self._log.write, speed=source,
                         message_type=kind, told=told,
                         spoken='' if source.is_usual and topic == own else plain),
                   topic, kind, self._settings.value('speed_depth'), lost_as='dropped')

    def _take(self, taken_in: Inlet, topic: str, kind: str, depth: int, *, lost_as: str) -> None:
        reliability = ReliabilityPolicy[self._settings.value('speed_reliability').upper()]
        self._numbered[topic] = numbered = Numbered(
            partial(self._receive, taken_in), partial(self._miss, lost_as))
        self._subscriptions.append(self._node.create_subscription(
            message_class(kind), topic, numbered,
            QoSProfile(depth=depth, reliability=reliability), raw=True))

    def _receive(self, taken_in: Inlet, cdr: bytes) -> None:
        if self.is_active:
            taken_in(self._arrival, (cdr,))

    def _miss(self, reason: str, count: int) -> None:
        if self.is_active:
            self.monitor.health.note(reason, count)

    def _send(self, records: Records) -> None:
        if self.is_active:
            publish = self._publish_on[records.topic]
            for payload in records.payloads:
                publish(payload)

    def _unbalance(self) -> Any:
        return self._settings.unbalance(self.name, self._machine)

    def _description(self) -> Any:
        return self._machine.description(self.name, self._unbalance())


def _nowhere(records: Records) -> None:
    """Log nothing."""
