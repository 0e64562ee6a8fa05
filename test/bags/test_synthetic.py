"""Synthetic signals are what a recorder would have written, and say that nothing was measured."""

from mcap.reader import NonSeekingReader
import numpy as np
import pytest
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import Imu, JointState

from rotorsoil_ros.bags import reader as bag_reader
from rotorsoil_ros.bags.synthetic import profile, Truth, write_synthetic
from rotorsoil_ros.units import GRAVITY

START = 1_790_000_000_000_000_000
TRUTH = Truth(shear_modulus_factor=1.0, growth=0.0, noise=0.0, slowest_rpm=900.0,
              fastest_rpm=900.0, ramp_s=0.5, dwell_s=0.25, rate_hz=800.0)


@pytest.fixture(scope='module')
def path(machine, tmp_path_factory):
    path = tmp_path_factory.mktemp('synthetic') / 'run.mcap'
    write_synthetic(path, 'rotor', machine.model, machine.case.unbalance, truth=TRUTH,
                    start_ns=START)
    return path


@pytest.fixture(scope='module')
def messages(path):
    return [(source.topic, time, bytes(payload))
            for source, time, payload in bag_reader.messages(path, lambda *_: True)]


def samples(messages, channel):
    return [deserialize_message(payload, Imu) for topic, _, payload in messages
            if topic == f'/rotor/measured/{channel}/imu']


def test_the_file_is_in_the_order_of_time_but_for_a_tenth_of_a_second(path):
    with path.open('rb') as stream:
        stamps = np.array([message.log_time for _, _, message in NonSeekingReader(
            stream).iter_messages(log_time_order=False)])
    late = np.maximum.accumulate(stamps) - stamps
    assert len(stamps) == 4 * 1000 + 63  # four sensors, and the speed
    assert 0 < late.max() < 10**8


def test_every_sample_is_there_once_and_labelled(messages):
    time, _ = profile(TRUTH)
    found = samples(messages, 'bearing_1_housing_x')
    stamps = [1_000_000_000 * each.header.stamp.sec + each.header.stamp.nanosec for each in found]
    np.testing.assert_array_equal(stamps, START + np.rint(1e9 * time).astype(np.int64))
    assert {each.header.frame_id for each in found} == {'synthetic_bearing_1_housing_x'}
    assert {each.orientation_covariance[0] for each in found} == {-1.0}


def test_speed_and_angle_are_told_fifty_times_a_second(messages):
    told = [(time, deserialize_message(payload, JointState)) for topic, time, payload in messages
            if topic.endswith('joint_states')]
    assert np.unique(np.diff([time for time, _ in told])).tolist() == [20_000_000]
    angles = np.array([each.position[0] for _, each in told])
    np.testing.assert_allclose(np.diff(angles), 900.0 * np.pi / 30.0 * 0.02, rtol=1e-6)


def test_at_constant_speed_a_sensor_feels_gravity_and_the_predicted_vibration(messages, machine):
    found = samples(messages, 'bearing_2_housing_z')
    felt = np.array([each.linear_acceleration.z for each in found])
    omega = 900.0 * np.pi / 30.0
    prediction = machine.table.predictor(machine.case.unbalance).predict(np.array([omega]))
    column = machine.table.channels.index('bearing_2_housing_z')
    expected = omega**2 * abs(prediction.displacement[0, column])
    turns = np.exp(1j * omega * np.arange(len(felt)) / TRUTH.rate_hz)
    whole = slice(-800, None)  # 15 turns
    # A step too many or too few leaves a part of a turn in the mean.
    assert felt[whole].mean() == pytest.approx(GRAVITY, abs=0.1 * expected)
    size = abs(2.0 * np.mean((felt[whole] - GRAVITY) * turns[whole].conj()))
    assert size == pytest.approx(expected, rel=0.01)  # the steps of time and of the table
