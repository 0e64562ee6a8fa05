"""A measured run-up of a real rotor, answered offline and live."""

from pathlib import Path

import numpy as np
import pytest
from rclpy.qos import QoSProfile
from sensor_msgs.msg import JointState

from rotorsoil_ros.bags import reader as bag_reader
from rotorsoil_ros.bags.predict import predict
from rotorsoil_ros.bags.profile import speed_profile
from rotorsoil_ros.case.machine import Machine

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
        rotorsoil_twin, cache, run_up, tmp_path):
    machine = Machine.load(CASE, cache_directory=cache)
    offline = tmp_path / 'offline.mcap'
    counts = predict(machine, run_up, offline).counts
    assert counts['answered'] == ROWS

    twin = rotorsoil_twin(CASE, parameters={
        'cache': str(cache), 'log.directory': str(tmp_path / 'logs')})
    heard = {topic: [] for topic in ANSWERS}
    for topic, messages in heard.items():
        twin.graph.probe.create_subscription(
            JointState, topic, messages.append, QoSProfile(depth=1000), raw=True)
    assert twin.replay(run_up, rate=20.0) == 3 * ROWS  # speeds, amplitudes, phases
    twin.until(lambda: all(len(messages) == ROWS for messages in heard.values()), 'every answer')
    twin.release()
    for topic, messages in heard.items():
        assert [bytes(message) for message in messages] == payloads(offline, topic)
