"""Fifty machines in one node process: every speed of each is answered, by its own name."""

from itertools import count

import pytest
from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import JointState

from graphs import joint_state, stamp_ns

MACHINES = 50
ROUNDS = 10
BETWEEN_TELLINGS = 40
RELIABLE = QoSProfile(depth=1000, reliability=ReliabilityPolicy.RELIABLE)


@pytest.mark.slow
def test_fifty_machines_lose_nothing(start, graph, case_file):
    names = [f'machine_{number}' for number in range(MACHINES)]
    start(f'machines:=[{",".join(names)}]', 'speed_reliability:=reliable', 'speed_depth:=1000',
          *(f'{name}.case:={case_file}' for name in names))
    answers = {name: [] for name in names}
    publishers = {}
    for name in names:
        publishers[name] = graph.probe.create_publisher(
            JointState, f'/{name}/joint_states', RELIABLE)
        graph.probe.create_subscription(
            JointState, f'/rotorsoil/{name}/amplitude',
            lambda message, name=name: answers[name].append(stamp_ns(message)), RELIABLE)
    graph.until(lambda: all(publisher.get_subscription_count() == 1
                            and graph.probe.count_publishers(f'/rotorsoil/{name}/amplitude')
                            for name, publisher in publishers.items()), 'discovery')
    # A reader is known before its writer knows it: the first answer tells of both.
    said = {name: [] for name in names}

    def tell(name):
        said[name].append(10**18 + 10**9 * len(said[name]) + names.index(name))
        publishers[name].publish(joint_state([300.0], stamp=said[name][-1]))

    looks = count()

    def all_heard():
        if next(looks) % BETWEEN_TELLINGS == 0:  # oftener than a busy node reads would bury it
            for name in names:
                if not answers[name]:
                    tell(name)
        return all(answers.values())

    graph.until(all_heard, 'the first answers')
    first = {name: answers[name][0] for name in names}
    for _ in range(ROUNDS):
        for name in names:
            tell(name)
        graph.executor.spin_once(timeout_sec=0.1)
    graph.until(lambda: all(answers[name][-1] == said[name][-1] for name in names),
                'the last answers')
    for name in names:
        assert answers[name] == [stamp for stamp in said[name] if stamp >= first[name]]
