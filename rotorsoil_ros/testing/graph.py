"""A ROS graph that nobody else sees: its context, who spins it, and a probe that talks in it."""

from collections.abc import Callable
import time
from typing import Any, TypeVar
import warnings

import rclpy
from rclpy.context import Context
from rclpy.experimental import EventsExecutor
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile, ReliabilityPolicy

from rotorsoil_ros.domain import own_domain

with warnings.catch_warnings():
    warnings.simplefilter('ignore', DeprecationWarning)  # lark still imports sre_parse
    import rosidl_generator_py  # noqa: F401 - rclpy imports it with the first message

AnyNode = TypeVar('AnyNode', bound=Node)

# For what hangs: a test is not about how fast something is.
DEADLINE_S = 600.0
RELIABLE = QoSProfile(depth=1000, reliability=ReliabilityPolicy.RELIABLE)
SPIN_ONCE_S = 0.05


class Graph:
    """
    A ROS context on a domain of this process, a probe node in it, and who spins them.

    Whatever is awaited is a condition: `until` spins until it holds, or fails at a deadline that
    only a hang reaches.
    """

    def __init__(self, *, domain: int | None = None) -> None:
        self.context = Context()
        rclpy.init(args=[], context=self.context, domain_id=domain or own_domain())
        self.executor: Any = EventsExecutor(context=self.context)
        self.nodes: list[Node] = []
        self.heard: dict[str, list[Any]] = {}
        self.probe = self.add(Node('probe', context=self.context))

    def add(self, node: AnyNode) -> AnyNode:
        """Let a node of this context take part; it is destroyed with the graph."""
        self.nodes.append(node)
        self.executor.add_node(node)
        return node

    def use(self, executor: Callable[..., Any]) -> None:
        """Have everybody spun by another executor."""
        self.executor.shutdown()
        self.executor = executor(context=self.context)
        for node in self.nodes:
            self.executor.add_node(node)

    def until(self, holds: Callable[[], object], what: str = 'what was awaited') -> None:
        """Spin until something holds; fail at the deadline."""
        deadline = time.monotonic() + DEADLINE_S
        while not holds():
            assert time.monotonic() < deadline, f'{what} did not happen in {DEADLINE_S:g} s'
            self.executor.spin_once(timeout_sec=SPIN_ONCE_S)

    def hear(self, topic: str, kind: Any, profile: QoSProfile | int = RELIABLE) -> list[Any]:
        """Collect the messages of a topic from now on."""
        if topic not in self.heard:
            self.heard[topic] = []
            self.probe.create_subscription(kind, topic, self.heard[topic].append, profile)
        return self.heard[topic]

    def speaker(
        self, topic: str, kind: Any, reliability: ReliabilityPolicy = ReliabilityPolicy.RELIABLE,
    ) -> Publisher:
        """Return a publisher that somebody hears, once whoever matters has found each other."""
        publisher = self.probe.create_publisher(
            kind, topic, QoSProfile(depth=1000, reliability=reliability))
        self.until(publisher.get_subscription_count, f'somebody who hears {topic}')
        self.settle()
        return publisher

    def settle(self) -> None:
        """Wait until the probe's subscriptions are matched on both sides."""
        for node in self.nodes[1:]:
            for publisher in node.publishers:
                if publisher.topic_name in self.heard:
                    self.until(publisher.get_subscription_count,
                               f'a match on {publisher.topic_name}')

    def ask(self, kind: Any, name: str, request: Any) -> Any:
        """Call a service; return the future of its answer."""
        client = self.probe.create_client(kind, name)
        self.until(client.service_is_ready, name)
        return client.call_async(request)

    def call(self, kind: Any, name: str, request: Any) -> Any:
        """Call a service and return its answer."""
        future = self.ask(kind, name, request)
        self.until(future.done, name)
        return future.result()

    def close(self) -> None:
        """Destroy what took part, and leave the domain."""
        for node in reversed(self.nodes):
            node.destroy_node()
        self.executor.shutdown()
        self.context.try_shutdown()
