"""Offline predictions are logged as the node would log them, and are those of the table."""

import math
from pathlib import Path

import numpy as np
import pytest
from rcl_interfaces.msg import Log
from rclpy.serialization import deserialize_message
from rosbags.highlevel import AnyReader
from sensor_msgs.msg import JointState

from rotorsoil_ros.bags import reader as bag_reader
from rotorsoil_ros.bags.predict import predict
from rotorsoil_ros.bags.profile import write_speed_profile
from rotorsoil_ros.bags.synthetic import Truth, write_synthetic
from rotorsoil_ros.bags.writer import LogFile
from rotorsoil_ros.case.machine import Machine
from rotorsoil_ros.errors import InputError
from rotorsoil_ros.machine.transient.state import Transient
from rotorsoil_ros.wire.cdr import Layout
from rotorsoil_ros.wire.definitions import JOINT_STATE
from rotorsoil_ros.wire.messages import JointStateWriter, Records
from rotorsoil_ros.wire.sensors import joint_states

from records import topics_of

FAN = Path('config/plant_fan.yaml')
START = 1_700_000_000_000_000_001


def profile_of(path, machine, speeds, *, start=START):
    stamps = start + 10**7 * np.arange(len(speeds))
    write_speed_profile(path, machine, stamps, np.asarray(speeds, dtype=float))
    return stamps


def logged(path, topic):
    payloads = [payload for source, _, payload in bag_reader.messages(path, lambda *_: True)
                if source.topic == topic]
    return joint_states(Layout.of(JOINT_STATE, payloads[0]), payloads)


def payloads(path, topic):
    return [bytes(payload) for _, _, payload in bag_reader.messages(
        path, lambda name, _: name == topic)]


@pytest.fixture
def run_up(tmp_path):
    path = tmp_path / 'profile.mcap'
    speeds = np.append(np.linspace(0.0, 1000.0, 2500), math.nan)
    return path, profile_of(path, 'fan', speeds), speeds


@pytest.mark.parametrize('topic', ['', 'steady/'])
def test_every_speed_is_answered_at_its_stamp_with_what_the_table_says(
        tmp_path, machine, run_up, topic):
    path, stamps, speeds = run_up
    answered = predict(machine, path, tmp_path / 'out.mcap')
    amplitude = logged(tmp_path / 'out.mcap', f'/rotorsoil/fan/{topic}amplitude')
    phase = logged(tmp_path / 'out.mcap', f'/rotorsoil/fan/{topic}phase')
    predictor = machine.table.predictor(machine.case.unbalance)
    known = predictor.covers(speeds)
    struck = Transient(machine.table.poles).follow(stamps[known], speeds[known])
    if topic:  # where the answer itself is not that
        assert 1000 < len(struck.rows) < np.count_nonzero(known)
        stamps, speeds = stamps[known][struck.rows], speeds[known][struck.rows]
        known = predictor.covers(speeds)
    assert amplitude.names == machine.table.channels
    assert amplitude.stamp_ns.tolist() == phase.stamp_ns.tolist() == stamps.tolist()
    exact = predictor.predict(speeds[known])
    if not topic:
        exact = predictor.moved(exact, struck)
    for name, vector in (('position', exact.displacement), ('velocity', exact.velocity),
                         ('effort', exact.force)):
        size, angle = getattr(amplitude, name), getattr(phase, name)
        assert np.isnan(size[~known]).all()
        assert np.isnan(angle[~known]).all()
        # Amplitude times the cosine and sine of the phase: each rounded to 1e-16 of |X|.
        np.testing.assert_allclose((size * np.exp(1j * angle))[known], vector, rtol=1e-14)
    assert answered.machine == 'fan'
    if topic:
        return
    assert answered.counts['answered'] == np.count_nonzero(known)
    assert answered.counts['nan'] == 1
    # What it found: the largest of what was logged.
    moved = [not channel.is_rotation for channel in machine.table.channels]
    sizes = np.where(moved, np.abs(exact.displacement), 0.0)
    most = answered.largest.displacement
    assert most.amplitude == pytest.approx(sizes.max(), rel=1e-12)
    row, column = np.unravel_index(sizes.argmax(), sizes.shape)
    assert (most.channel, most.speed) == (machine.table.channels[column], speeds[known][row])
    assert answered.largest.speeds == (speeds[known].min(), speeds[known].max())
    for channel, own in answered.largest.housings.items():
        velocity = np.abs(exact.velocity)[:, machine.table.channels.index(channel)]
        assert own.velocity == pytest.approx(velocity.max() / 2.0**0.5, rel=1e-12)


def test_the_log_holds_profile_answers_model_and_diagnostics(tmp_path, machine, run_up):
    path, stamps, speeds = run_up
    predict(machine, path, tmp_path / 'out.mcap')
    covered = machine.table.predictor(machine.case.unbalance).covers(speeds)
    ringing = len(Transient(machine.table.poles).follow(
        stamps, np.where(covered, speeds, np.nan)).rows)
    with AnyReader([tmp_path / 'out.mcap']) as reader:
        counts = {connection.topic: connection.msgcount for connection in reader.connections}
        times = [time for connection, time, _ in reader.messages()
                 if connection.topic == '/rotorsoil/fan/amplitude']
    assert counts.pop('/diagnostics') >= 2
    assert counts == {'/fan/joint_states': 2501, '/rotorsoil/fan/amplitude': 2501,
                      '/rotorsoil/fan/phase': 2501, '/rotorsoil/fan/velocity_rms': 2501,
                      '/rotorsoil/fan/steady/amplitude': ringing,
                      '/rotorsoil/fan/steady/phase': ringing,
                      '/rotorsoil/fan/model': 1,
                      '/rotorsoil/fan/amplitude_low': 250, '/rotorsoil/fan/amplitude_high': 250}
    assert times == stamps.tolist()


def test_predicting_a_log_again_gives_the_same_answers_to_the_bit(tmp_path, machine, run_up):
    first, second = tmp_path / 'first.mcap', tmp_path / 'second.mcap'
    predict(machine, run_up[0], first)
    predict(machine, first, second)
    for topic in ('/fan/joint_states', '/rotorsoil/fan/amplitude', '/rotorsoil/fan/phase'):
        assert payloads(first, topic) == payloads(second, topic)


def test_measurements_pass_through(tmp_path, machine):
    path, out = tmp_path / 'profile.mcap', tmp_path / 'out.mcap'
    stamps = [START, START + 5]
    values = np.full((2, 3, 1), 1e-6)
    with LogFile(path) as log:
        log.write(Records('/fan/joint_states', JOINT_STATE, stamps,
                          JointStateWriter(['rotor']).write(stamps, 3e8 * values)))
        log.write(Records('/fan/measured/amplitude', JOINT_STATE, stamps,
                          JointStateWriter(['disc_1_x']).write(stamps, values)))
        log.write(Records('/other/measured/amplitude', JOINT_STATE, stamps,
                          JointStateWriter(['disc_1_x']).write(stamps, values)))
    answered = predict(machine, path, out)
    assert answered.counts['measured'] == 2
    assert logged(out, '/fan/measured/amplitude').position.tolist() == [[1e-6], [1e-6]]
    assert '/other/measured/amplitude' not in topics_of(out)


def test_of_several_machines_the_one_of_the_case_is_answered(tmp_path, machine):
    path, stamps = tmp_path / 'profile.mcap', [START]
    with LogFile(path) as log:
        for name, speed in (('/plant/fan', 100.0), ('/plant/paper_rotor', 200.0)):
            log.write(Records(f'{name}/joint_states', JOINT_STATE, stamps,
                              JointStateWriter(['rotor']).write(
                                  stamps, np.full((1, 3, 1), speed))))
    predict(machine, path, tmp_path / 'out.mcap')
    told = logged(tmp_path / 'out.mcap', '/plant/rotorsoil/paper_rotor/amplitude')
    exact = machine.table.predictor(machine.case.unbalance).predict(np.array([200.0]))
    np.testing.assert_allclose(told.position, np.abs(exact.displacement), rtol=1e-15)


def test_a_profile_without_a_machine_name_takes_that_of_the_case(tmp_path, machine):
    with LogFile(tmp_path / 'profile.mcap') as log:
        log.write(Records('/joint_states', JOINT_STATE, [START], JointStateWriter(
            ['rotor']).write([START], np.full((1, 3, 1), 300.0))))
    assert predict(machine, tmp_path / 'profile.mcap',
                   tmp_path / 'out.mcap').machine == 'paper_rotor'


def test_progress_ends_at_the_total(tmp_path, machine, run_up):
    told = []
    predict(machine, run_up[0], tmp_path / 'out.mcap',
            progress=lambda done, total: told.append((done, total)))
    assert told[-1] == (2501, 2501)
    assert len(told) > 1


def test_the_profile_is_not_overwritten_by_its_answer(machine, run_up):
    before = run_up[0].read_bytes()
    with pytest.raises(InputError, match='is the profile itself'):
        predict(machine, run_up[0], run_up[0])
    assert run_up[0].read_bytes() == before


def test_a_profile_without_speed_is_refused_by_name(tmp_path, machine):
    with LogFile(tmp_path / 'profile.mcap') as log:
        log.write(Records('/fan/measured/phase', JOINT_STATE, [START], JointStateWriter(
            ['a']).write([START], np.zeros((1, 3, 1)))))
    with pytest.raises(
            InputError, match=r'profile\.mcap: must tell the speed of.*speed topics: none'):
        predict(machine, tmp_path / 'profile.mcap', tmp_path / 'out.mcap')


def test_rclpy_reads_what_was_logged(tmp_path, machine, run_up):
    predict(machine, run_up[0], tmp_path / 'out.mcap')
    _, _, payload = next(bag_reader.messages(
        tmp_path / 'out.mcap', lambda topic, _: topic.endswith('/amplitude')))
    assert deserialize_message(payload, JointState).name == list(machine.table.channels)


def test_a_run_is_judged_offline_as_it_was_when_it_was_recorded(tmp_path):
    """Raw samples in, vectors, residuals, zones and remarks out: again, to the bit."""
    fan = Machine.load(FAN, cache_directory=tmp_path, overrides=['uncertainty.samples=4'])
    source, first, second = (tmp_path / f'{name}.mcap' for name in ('run', 'first', 'second'))
    truth = Truth(ramp_s=6.0, dwell_s=2.0, slowest_rpm=900.0, rate_hz=500.0)
    write_synthetic(source, 'plant_fan', fan.model, fan.case.unbalance, truth=truth,
                    start_ns=START)
    predict(fan, source, first)
    predict(fan, first, second)
    own = '/rotorsoil/plant_fan'
    for topic in ('residual', 'demodulated/amplitude', 'demodulated/phase', 'amplitude_low'):
        assert payloads(first, f'{own}/{topic}') == payloads(second, f'{own}/{topic}')
    said = [[deserialize_message(payload, Log) for payload in payloads(path, f'{own}/events')]
            for path in (first, second)]  # rclpy leaves chance bytes in the padding of strings
    assert said[0] == said[1]
    assert said[0]
    assert len(logged(first, f'{own}/residual').stamp_ns) > 20
