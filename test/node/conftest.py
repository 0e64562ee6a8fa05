"""A ROS graph that nobody else sees."""

import os
import time
import warnings

import pytest
import rclpy
from rclpy.context import Context
from rclpy.experimental import EventsExecutor
from rclpy.node import Node

with warnings.catch_warnings():
    warnings.simplefilter('ignore', DeprecationWarning)  # lark still imports sre_parse
    import rosidl_generator_py  # noqa: F401 - rclpy imports it with the first message

DEADLINE_S = 10.0



class Graph:
    """A ROS context on a domain of this process, a probe node in it, and who spins them."""

    def __init__(self):
        self.context = Context()
        rclpy.init(args=[], context=self.context, domain_id=40 + os.getpid() % 20)
        self.executor = EventsExecutor(context=self.context)
        self.nodes = []
        self.probe = self.add(Node('probe', context=self.context))

    def add(self, node):
        self.nodes.append(node)
        self.executor.add_node(node)
        return node

    def until(self, holds, what='what was awaited', deadline_s=DEADLINE_S):
        """Spin until something holds; fail at the deadline."""
        deadline = time.monotonic() + deadline_s
        while not holds():
            assert time.monotonic() < deadline, f'{what} did not happen in {deadline_s} s'
            self.executor.spin_once(timeout_sec=0.05)

    def close(self):
        for node in reversed(self.nodes):
            node.destroy_node()
        self.executor.shutdown()
        self.context.try_shutdown()


@pytest.fixture
def graph():
    graph = Graph()
    yield graph
    graph.close()
