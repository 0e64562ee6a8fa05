"""A recorded profile comes alive again: published as it was received, at its pace or another."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack
from pathlib import Path
import time
from typing import Any

import rclpy
from rclpy.context import Context
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import Float64

from rotorsoil_ros.bags import reader as bag_reader
from rotorsoil_ros.bags.profile import ADVICE, candidates, Input, inputs, near_misses
from rotorsoil_ros.errors import InputError, RotorSoilError
from rotorsoil_ros.events import NANOSECONDS
from rotorsoil_ros.wire.definitions import FLOAT64, IMU, JOINT_STATE
from rotorsoil_ros.wire.handlers import as_joint_states
from rotorsoil_ros.wire.messages import JointStateWriter
from rotorsoil_ros.wire.speeds import ROTOR_JOINT, SpeedReader, SpeedSource, USUAL

SENT_TYPES = {JOINT_STATE: JointState, FLOAT64: Float64, IMU: Imu}
DEPTH = 1000
NAP_S = 0.05  # how soon an interrupt or a new subscriber is noticed
DELIVERY_S = 5.0
SENSORS_SHARE = 0.25  # of the patience: of most sensors nobody wants to hear

Progress = Callable[[int, int], None]


def replay(
    profile: Path, *, rate: float = 1.0, wait_s: float = 10.0, context: Context | None = None,
    progress: Progress | None = None, speed: SpeedSource = USUAL, machine: str = '',
) -> int:
    """
    Publish every speed and every measurement of a bag under its own name, stamps untouched.

    A speed that is told in another way is published as the node understands it without being
    told: JointStates [rad/s] on `<machine>/joint_states`.

    Parameters
    ----------
    profile : Path
        Bag directory or MCAP file.
    rate : float
        How many times faster than it was recorded.
    wait_s : float
        How long to wait until every speed topic has a subscriber, one of them at least, and a
        quarter of it for those of sensors, which nobody may want to hear [s].
    context : Context
        Of an initialised rclpy; without one, replay brings its own up and down.
    progress : callable
        Called with the number of messages published and their total.
    speed : SpeedSource
        What tells the speed.
    machine : str
        Whose speed it is, where no topic says.

    Returns
    -------
    int
        Number of messages published; less than all of them if the context was shut down.

    Raises
    ------
    InputError
        If the bag cannot be read, tells no speed, or the rate is not above zero.
    RotorSoilError
        If nobody listens to any speed.

    """
    if not 0.0 < rate < float('inf'):
        raise InputError(f'rate must be > 0 and finite, got {rate:g}')
    sent = _Sent.of(profile, speed, machine)
    with ExitStack() as stack:
        if context is None:
            context = Context()
            rclpy.init(args=[], context=context)
            stack.callback(context.try_shutdown)
        node = Node('rotorsoil_replay', context=context, start_parameter_services=False)
        stack.callback(node.destroy_node)
        player = _Player(node, sent)
        player.wait_for_listeners(wait_s)
        return player.play(profile, rate, lambda done: progress and progress(done, sent.total))


class _Sent:
    """What of a bag is sent, and under which topics and types."""

    def __init__(self, found: Mapping[str, Input], speed: SpeedSource, machine: str) -> None:
        self.found = found
        self.total = sum(each.number for each in found.values())
        self.names = {topic: topic for topic in found}
        self._readers: dict[str, SpeedReader] = {}
        self._writer = JointStateWriter([ROTOR_JOINT])
        for topic, each in found.items() if not speed.is_usual else ():
            if each.tells_speed:
                self.names[topic] = (f'{each.place.namespace}/{each.place.machine or machine}'
                                     '/joint_states')
                self._readers[topic] = SpeedReader(
                    each.source.type, speed, note=lambda reason, count: None,
                    told=each.source.definition)

    @classmethod
    def of(cls, profile: Path, speed: SpeedSource, machine: str) -> '_Sent':
        """Find what a bag tells; raise InputError where it tells no speed."""
        sources = {source: number for source, number in bag_reader.sources(profile).items()
                   if number}
        try:
            found = inputs(sources, speed)
        except InputError as error:
            raise InputError(f'{profile}: {error}') from error
        speeds = [each for each in found.values() if each.tells_speed]
        if not speeds:
            missed = ''.join(f'; {miss}' for miss in near_misses(sources, speed))
            raise InputError(f'{profile}: tells no speed on joint_states or rotor/speed{missed}'
                             f'{candidates(sources)}{ADVICE}')
        machines = {each.place.machine for each in found.values()
                    if not each.tells_ground} - {''}
        nobodys = not speed.is_usual and not all(each.place.machine for each in speeds)
        if nobodys and not machine and len(machines) != 1:
            raise InputError(f'{profile}: no topic says whose speed it is; name the machine '
                             '(--machine)')
        return cls(found, speed, machine or next(iter(machines), ''))

    @property
    def types(self) -> dict[str, str]:
        """Type of every topic that is sent."""
        return {name: JOINT_STATE if topic in self._readers else self.found[topic].source.type
                for topic, name in self.names.items()}

    @property
    def speeds(self) -> list[str]:
        """Topics on which speeds are sent."""
        return [self.names[topic] for topic, each in self.found.items() if each.tells_speed]

    def messages(self, profile: Path) -> Iterator[tuple[str, int, bytes]]:
        """Yield topic, time of reception and message, in the order of reception."""
        for source, time_ns, cdr in bag_reader.messages(
                profile, lambda topic, kind: topic in self.found
                and self.found[topic].source.type == kind):
            if reader := self._readers.get(source.topic):
                speeds = reader.read([time_ns], [cdr])
                if not speeds.messages:
                    continue
                cdr = as_joint_states('', self._writer, speeds).payloads[0]
            yield self.names[source.topic], time_ns, cdr


class _Player:
    """Publishers of the topics of a bag."""

    def __init__(self, node: Node, sent: _Sent) -> None:
        self._context, self._complain = node.context, node.get_logger().warning
        self._sent = sent
        self._publishers: dict[str, Publisher] = {
            topic: node.create_publisher(SENT_TYPES[kind], topic, QoSProfile(depth=DEPTH))
            for topic, kind in sent.types.items()}

    def wait_for_listeners(self, wait_s: float) -> None:
        """Wait until somebody hears the speed topics, and a little for the others."""
        until = time.monotonic() + wait_s
        while deaf := [topic for topic in self._sent.speeds
                       if not self._publishers[topic].get_subscription_count()]:
            if not self._context.ok():
                return
            if time.monotonic() > until:
                told = f'nobody listens to {", ".join(deaf)} after {wait_s:g} s'
                if len(deaf) == len(self._sent.speeds):
                    raise RotorSoilError(told)
                # A geared machine, whose speed is logged as its own, hears that of its master.
                self._complain(told)
                break
            time.sleep(NAP_S)
        # A node hears sensors a second after they have begun to publish.
        until = time.monotonic() + SENSORS_SHARE * wait_s
        while time.monotonic() < until and self._context.ok() and not all(
                publisher.get_subscription_count() for publisher in self._publishers.values()):
            time.sleep(NAP_S)

    def play(self, profile: Path, rate: float, progress: Callable[[int], Any]) -> int:
        """Publish in the order of reception; each message when its time has come."""
        done, began, first_ns = 0, time.monotonic(), None
        for topic, log_time_ns, payload in self._sent.messages(profile):
            first_ns = log_time_ns if first_ns is None else first_ns
            if not self._sleep_until(began + (log_time_ns - first_ns) / (rate * NANOSECONDS)):
                return done
            self._publishers[topic].publish(payload)
            done += 1
            progress(done)
        for publisher in self._publishers.values():
            publisher.wait_for_all_acked(Duration(seconds=DELIVERY_S))
        return done

    def _sleep_until(self, due: float) -> bool:
        """Sleep; return whether the context is still up."""
        while (left := due - time.monotonic()) > 0.0 and self._context.ok():
            time.sleep(min(left, NAP_S))
        return bool(self._context.ok())
