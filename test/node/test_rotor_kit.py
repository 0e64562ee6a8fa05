"""A measured run-up of a real rotor, answered offline and live."""

from pathlib import Path
from threading import Thread

import numpy as np
import pytest
from rclpy.parameter import Parameter
from rclpy.qos import QoSProfile
from sensor_msgs.msg import JointState

from rotorsoil_ros.bags import reader as bag_reader
from rotorsoil_ros.bags.predict import predict
from rotorsoil_ros.bags.profile import speed_profile
from rotorsoil_ros.case.machine import Machine
from rotorsoil_ros.node.node import RotorsoilNode
from rotorsoil_ros.node.replay import replay

from records import import_run_up

ROOT = Path(__file__).resolve().parents[2]
CASE = ROOT / 'config' / 'rk4_rotor_kit.yaml'
START = 1_700_000_000_000_000_007
ANSWERS = ('/rotorsoil/rk4_rotor_kit/amplitude', '/rotorsoil/rk4_rotor_kit/phase')
ROWS = 210


@pytest.fixture
def run_up(tmp_path):
    """Return the measured run-up as an MCAP."""
    path = tmp_path / 'run_up.mcap'
    import_run_up(path, start_ns=START)
    return path


def payloads(path, topic):
    return [bytes(payload) for _, _, payload in bag_reader.messages(
        path, lambda name, _: name == topic)]


def test_run_up_takes_as_long_as_its_turns(run_up):
    [batch] = list(speed_profile(run_up))
    rate = np.polyfit(1e-9 * (batch.stamp_ns - START), batch.speed * 30.0 / np.pi, 1)[0]
    assert len(batch.speed) == ROWS
    assert rate == pytest.approx(228.0, rel=0.02)  # rpm/s, as the rows say: one is one turn


def test_live_answers_to_the_measured_run_up_are_those_of_offline(
        graph, cache, run_up, tmp_path):
    machine = Machine.load(CASE, cache_directory=cache)
    offline = tmp_path / 'offline.mcap'
    counts = predict(machine, run_up, offline).counts
    assert counts['answered'] == ROWS

    values = {'machines': ['rk4_rotor_kit'], 'rk4_rotor_kit.case': str(CASE),
              'cache': str(cache), 'log.directory': str(tmp_path / 'logs'), 'log.rerun': False,
              'speed_depth': 1000, 'speed_reliability': 'reliable'}
    node = graph.add(RotorsoilNode(context=graph.context, parameter_overrides=[
        Parameter(name, value=value) for name, value in values.items()]))
    assert node.start()
    heard = {topic: [] for topic in ANSWERS}
    for topic, messages in heard.items():
        graph.probe.create_subscription(
            JointState, topic, messages.append, QoSProfile(depth=1000), raw=True)
    player = Thread(target=replay, args=(run_up,), kwargs={'rate': 20.0,
                                                           'context': graph.context})
    player.start()
    graph.until(lambda: not player.is_alive()
                and all(len(messages) == ROWS for messages in heard.values()), 'every answer')
    node.release()
    for topic, messages in heard.items():
        assert [bytes(message) for message in messages] == payloads(offline, topic)
