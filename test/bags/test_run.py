"""What is read back from a log against what was written into it."""

import math

import numpy as np
import pytest
from rclpy.serialization import serialize_message
from sensor_msgs.msg import Imu
from std_msgs.msg import String

from rotorsoil_ros.bags.run import read_run, Reading
from rotorsoil_ros.bags.writer import LogFile
from rotorsoil_ros.errors import InputError
from rotorsoil_ros.wire.definitions import IMU, JOINT_STATE, STRING
from rotorsoil_ros.wire.messages import JointStateWriter, Records

SECOND = 1_000_000_000
STAMPS = SECOND * np.array([10, 11, 12])


def joint_states(topic, names, stamps, **arrays):
    """Return JointStates; every array is (n, names)."""
    values = np.full((len(stamps), 3, len(names)), np.nan)
    for name, given in arrays.items():
        values[:, ('position', 'velocity', 'effort').index(name)] = given
    return Records(topic, JOINT_STATE, list(map(int, stamps)),
                   JointStateWriter(names).write(list(map(int, stamps)), values))


def speeds(machine, speed=(50.0, 60.0, 70.0), stamps=STAMPS, angle=None):
    arrays = {} if angle is None else {'position': np.array(angle)[:, None]}
    return joint_states(f'/{machine}/joint_states', ['rotor'], stamps,
                        velocity=np.array(speed)[:, None], **arrays)


def write(path, *records):
    with LogFile(path) as log:
        for record in records:
            log.write(record)
    return path


def test_speeds_predictions_and_vectors_are_read(tmp_path):
    amplitude, phase = np.array([[1.0, 2.0], [3.0, 4.0]]), np.array([[0.1, 0.2], [0.3, 0.4]])
    names = ['a_x', 'a_z']
    log = write(
        tmp_path / 'log.mcap', speeds('plant/fan'),
        joint_states('/plant/rotorsoil/fan/amplitude', names, STAMPS[:2], position=amplitude),
        joint_states('/plant/rotorsoil/fan/phase', names, STAMPS[:2], position=phase),
        joint_states('/plant/fan/measured/amplitude', ['a_z'], STAMPS[1:], position=[[5.0]] * 2),
        joint_states('/plant/fan/measured/phase', ['a_z'], STAMPS[1:2], position=[[0.5]]))
    run = read_run(log, Reading())
    assert run.machine == 'fan'
    np.testing.assert_array_equal(run.stamp_ns, STAMPS)
    np.testing.assert_array_equal(run.speed, [50.0, 60.0, 70.0])
    assert run.channels == ('a_x', 'a_z')
    np.testing.assert_allclose(run.displacement[:2], amplitude * np.exp(1j * phase))
    assert np.isnan(run.displacement[2]).all()
    assert set(run.signals) == {'a_z'}
    np.testing.assert_array_equal(run.signals['a_z'].amplitude, [5.0, 5.0])
    np.testing.assert_array_equal(run.signals['a_z'].phase, [0.5, math.nan])


def test_measured_velocity_becomes_a_displacement(tmp_path):
    log = write(
        tmp_path / 'log.mcap', speeds('fan'),
        joint_states('/fan/measured/amplitude', ['a_x'], STAMPS, velocity=[[100.0]] * 3),
        joint_states('/fan/measured/phase', ['a_x'], STAMPS, velocity=[[math.pi / 2.0]] * 3))
    found = read_run(log, Reading()).signals['a_x']
    np.testing.assert_allclose(found.amplitude, [2.0, 100.0 / 60.0, 100.0 / 70.0])
    np.testing.assert_allclose(found.phase, 0.0, atol=1e-15)  # V = i Omega X


def test_unbalance_of_the_model_and_its_description_are_read(tmp_path):
    said = '{"case": "fan", "unbalance": {"wheel": {"moment_kg_m": 2.0, "phase_rad": 1.0}}}'
    broken = serialize_message(String(data='no JSON'))
    log = write(tmp_path / 'log.mcap', speeds('fan'),
                Records('/rotorsoil/fan/model', STRING, [7, 9],
                        [serialize_message(String(data=said)), broken]))
    run = read_run(log, Reading())
    assert run.description['case'] == 'fan'
    [(stamp, planes)] = run.unbalances
    assert stamp == 7
    assert planes == {'wheel': pytest.approx(2.0 * np.exp(1j))}
    assert run.notes == ['1 messages are malformed and were left out']


def accelerations(channel, stamps, values, *, frame=''):
    messages = []
    for stamp, (x, y, z) in zip(stamps.tolist(), values.tolist(), strict=True):
        message = Imu()
        message.header.frame_id = frame
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp, SECOND)
        message.linear_acceleration.x, message.linear_acceleration.y = x, y
        message.linear_acceleration.z = z
        messages.append(serialize_message(message))
    return Records(f'/fan/measured/{channel}/imu', IMU, stamps.tolist(), messages)


@pytest.mark.parametrize('told', [True, False])
def test_raw_acceleration_becomes_vectors(tmp_path, told):
    omega, vector = 100.0, 3e-6 * np.exp(0.7j)
    time = np.arange(0.0, 4.0, 1e-3)
    stamps = SECOND + np.rint(time * SECOND).astype(np.int64)
    clean = np.real(-omega**2 * vector * np.exp(1j * omega * time))
    values = np.stack([0.0 * time, 0.0 * time, 9.81 + clean], axis=1)
    turning = np.full(len(time), omega)
    log = write(tmp_path / 'log.mcap',
                speeds('fan', turning[::100], stamps[::100],
                       np.angle(np.exp(1j * omega * time[::100])) if told else None),
                accelerations('a_z', stamps, values, frame='synthetic_a_z'))
    run = read_run(log, Reading(turns=5.0))
    found = run.signals['a_z']
    assert len(found.amplitude) > 10
    np.testing.assert_allclose(found.amplitude, 3e-6, rtol=1e-6)
    assert np.isfinite(found.phase).all() == told
    if told:
        np.testing.assert_allclose(found.phase, 0.7, atol=1e-6)
    assert run.is_synthetic
    assert run.notes[0].startswith('SYNTHETIC signals')


def test_channel_without_an_axis_of_translation_is_told(tmp_path):
    stamps = STAMPS[:2]
    log = write(tmp_path / 'log.mcap', speeds('fan'),
                accelerations('block_rx', stamps, np.ones((2, 3))))
    run = read_run(log, Reading())
    assert run.signals == {}
    assert run.notes == ['block_rx: no vector could be found in its raw samples']


def test_malformed_samples_are_counted(tmp_path):
    log = write(tmp_path / 'log.mcap', speeds('fan'),
                Records('/fan/measured/a_x/imu', IMU, [SECOND], [b'\x00\x01\x00\x00\x00']),
                Records('/fan/measured/amplitude', JOINT_STATE, [SECOND], [b'\x00\x01']))
    assert '2 messages are malformed and were left out' in read_run(log, Reading()).notes


def test_one_of_several_machines_has_to_be_named(tmp_path):
    log = write(tmp_path / 'log.mcap', speeds('fan'), speeds('pump', (1.0, 2.0, 3.0)))
    with pytest.raises(InputError, match=r'must tell the speed of one machine .* got fan, pump'):
        read_run(log, Reading())
    with pytest.raises(InputError, match=r'must tell the speed of mill .* got fan, pump'):
        read_run(log, Reading(machine='mill'))
    np.testing.assert_array_equal(
        read_run(log, Reading(machine='pump')).speed, [1.0, 2.0, 3.0])


def test_topics_of_a_namesake_are_not_taken(tmp_path):
    log = write(
        tmp_path / 'log.mcap', speeds('fan'),
        joint_states('/big_fan/measured/amplitude', ['a_x'], STAMPS, position=[[1.0]] * 3))
    assert read_run(log, Reading()).signals == {}
