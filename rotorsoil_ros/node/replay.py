"""A recorded profile comes alive again: published as it was received, at its pace or another."""

from collections.abc import Callable
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
from rotorsoil_ros.bags.profile import is_input, near_misses, tells_speed
from rotorsoil_ros.bags.reader import CDR
from rotorsoil_ros.errors import InputError, RotorSoilError
from rotorsoil_ros.events import NANOSECONDS
from rotorsoil_ros.wire.definitions import FLOAT64, IMU, JOINT_STATE

SENT_TYPES = {JOINT_STATE: JointState, FLOAT64: Float64, IMU: Imu}
DEPTH = 1000
NAP_S = 0.05  # how soon an interrupt or a new subscriber is noticed
DELIVERY_S = 5.0
SENSORS_S = 2.5

Progress = Callable[[int, int], None]


def replay(
    profile: Path, *, rate: float = 1.0, wait_s: float = 10.0, context: Context | None = None,
    progress: Progress | None = None,
) -> int:
    """
    Publish every speed and every measurement of a bag under its own name, stamps untouched.

    Parameters
    ----------
    profile : Path
        Bag directory or MCAP file.
    rate : float
        How many times faster than it was recorded.
    wait_s : float
        How long to wait until every speed topic has a subscriber [s].
    context : Context
        Of an initialised rclpy; without one, replay brings its own up and down.
    progress : callable
        Called with the number of messages published and their total.

    Returns
    -------
    int
        Number of messages published; less than all of them if the context was shut down.

    Raises
    ------
    InputError
        If the bag cannot be read, tells no speed, or the rate is not above zero.
    RotorSoilError
        If nobody listens.

    """
    if not 0.0 < rate < float('inf'):
        raise InputError(f'rate must be > 0 and finite, got {rate:g}')
    sources = {source: number for source, number in bag_reader.sources(profile).items()
               if number}
    found = {source.topic: source.type for source in sources
             if source.encoding == CDR and is_input(source.topic, source.type)}
    if not any(tells_speed(topic, kind) for topic, kind in found.items()):
        missed = ''.join(f'; {miss}' for miss in near_misses(sources))
        raise InputError(f'{profile}: tells no speed on joint_states or rotor/speed{missed}')
    total = sum(number for source, number in sources.items()
                if found.get(source.topic) == source.type)
    with ExitStack() as stack:
        if context is None:
            context = Context()
            rclpy.init(args=[], context=context)
            stack.callback(context.try_shutdown)
        node = Node('rotorsoil_replay', context=context, start_parameter_services=False)
        stack.callback(node.destroy_node)
        player = _Player(node, found)
        player.wait_for_listeners(wait_s)
        return player.play(profile, rate, lambda done: progress and progress(done, total))


class _Player:
    """Publishers of the topics of a bag."""

    def __init__(self, node: Node, found: dict[str, str]) -> None:
        self._context = node.context
        self._publishers: dict[str, Publisher] = {
            topic: node.create_publisher(SENT_TYPES[kind], topic, QoSProfile(depth=DEPTH))
            for topic, kind in found.items()}
        self._speeds = [topic for topic, kind in found.items() if tells_speed(topic, kind)]

    def wait_for_listeners(self, wait_s: float) -> None:
        """Wait until somebody hears every speed topic, and a little for the others."""
        until = time.monotonic() + wait_s
        while deaf := [topic for topic in self._speeds
                       if not self._publishers[topic].get_subscription_count()]:
            if not self._context.ok():
                return
            if time.monotonic() > until:
                raise RotorSoilError(f'nobody listens to {", ".join(deaf)} after {wait_s:g} s')
            time.sleep(NAP_S)
        # A node hears sensors a second after they have begun to publish.
        until = time.monotonic() + SENSORS_S
        while time.monotonic() < until and self._context.ok() and not all(
                publisher.get_subscription_count() for publisher in self._publishers.values()):
            time.sleep(NAP_S)

    def play(self, profile: Path, rate: float, progress: Callable[[int], Any]) -> int:
        """Publish in the order of reception; each message when its time has come."""
        done, began, first_ns = 0, time.monotonic(), None
        for source, log_time_ns, payload in bag_reader.messages(profile, is_input):
            first_ns = log_time_ns if first_ns is None else first_ns
            if not self._sleep_until(began + (log_time_ns - first_ns) / (rate * NANOSECONDS)):
                return done
            self._publishers[source.topic].publish(payload)
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
