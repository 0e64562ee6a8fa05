"""A ROS graph that nobody else sees, and nodes in it."""

import pytest

from rotorsoil_ros.testing.graph import Graph

from graphs import Bench, Processes


@pytest.fixture
def graph():
    graph = Graph()
    yield graph
    graph.close()


@pytest.fixture
def bench(graph, cache, case_file, machine):
    bench = Bench(graph, cache, case_file)
    yield bench
    for node in graph.nodes[1:]:
        node.release()


@pytest.fixture
def start(case_file, cache, machine):
    """Return what starts a node and waits until it is active."""
    processes = Processes(case_file, cache)
    yield processes.start
    processes.close()
