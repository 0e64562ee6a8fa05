"""A replayed log gives the numbers of the log again: live and offline are one."""

from pathlib import Path
from threading import Thread

import numpy as np
import pytest
from rclpy.parameter import Parameter
from rclpy.qos import QoSProfile
from rosbags.highlevel import AnyReader
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64

from rotorsoil_ros.bags import reader as bag_reader
from rotorsoil_ros.bags.predict import predict
from rotorsoil_ros.bags.profile import write_speed_profile
from rotorsoil_ros.bags.synthetic import Truth, write_synthetic
from rotorsoil_ros.bags.writer import LogFile
from rotorsoil_ros.case.machine import Machine
from rotorsoil_ros.errors import InputError, RotorSoilError
from rotorsoil_ros.node.node import RotorsoilNode
from rotorsoil_ros.node.replay import replay
from rotorsoil_ros.testing.graph import DEADLINE_S
from rotorsoil_ros.wire.definitions import JOINT_STATE
from rotorsoil_ros.wire.messages import JointStateWriter, Records
from rotorsoil_ros.wire.sensors import JointStateReader
from rotorsoil_ros.wire.speeds import SpeedSource

from records import joint_records, topics_of

FAN = Path('config/plant_fan.yaml')
RPM = Path(__file__).parents[1] / 'cases' / 'speed_in_another_type' / 'rpm_int32.mcap'
START = 1_700_000_000_000_000_001
ANSWERS = ('/rotorsoil/fan/amplitude', '/rotorsoil/fan/phase')
MEASURED = '/fan/measured/amplitude'


@pytest.fixture
def profile(tmp_path):
    """Return 300 speeds in half a second, some without an answer, and two measurements."""
    path = tmp_path / 'profile.mcap'
    speeds = np.append(np.linspace(0.0, 1000.0, 298), [np.nan, -1.0])
    stamps = (START + np.linspace(0, 5e8, 300).astype(int)).tolist()
    values = np.full((300, 3, 1), np.nan)
    values[:, 1, 0] = speeds
    measured = np.full((2, 3, 1), 1e-6)
    with LogFile(path) as log:
        log.write(Records('/fan/joint_states', JOINT_STATE, stamps,
                          JointStateWriter(['rotor']).write(stamps, values)))
        log.write(Records(MEASURED, JOINT_STATE, stamps[-2:],
                          JointStateWriter(['disc_1_x']).write(stamps[-2:], measured)))
    return path


def payloads(path, topic):
    return [payload for _, _, payload in bag_reader.messages(path, lambda name, _: name == topic)]


class InThread:
    """A call that runs beside the test, and what became of it."""

    def __init__(self, function, *arguments, **options):
        self.result = self.error = None

        def run():
            try:
                self.result = function(*arguments, **options)
            except RotorSoilError as error:
                self.error = error

        self.thread = Thread(target=run)
        self.thread.start()

    def is_done(self):
        return not self.thread.is_alive()


def test_live_replayed_and_offline_are_the_same_to_the_bit(
        graph, cache, case_file, machine, profile, tmp_path):
    values = {'machines': ['fan'], 'fan.case': str(case_file), 'cache': str(cache),
              'log.directory': str(tmp_path / 'logs'), 'speed_depth': 1000,
              'speed_reliability': 'reliable', 'log.rerun': False}
    node = graph.add(RotorsoilNode(context=graph.context, parameter_overrides=[
        Parameter(name, value=value) for name, value in values.items()]))
    assert node.start()
    heard = []
    graph.probe.create_subscription(
        JointState, ANSWERS[1], lambda cdr: heard.append(cdr), QoSProfile(depth=1000), raw=True)
    played = InThread(replay, profile, context=graph.context)
    graph.until(lambda: played.is_done() and len(heard) == 300, 'every answer')
    assert played.result == 302
    node.release()

    live = tmp_path / 'logs' / 'run'
    predict(machine, profile, tmp_path / 'offline.mcap')
    predict(machine, live, tmp_path / 'again.mcap')
    assert payloads(live, ANSWERS[1]) == heard
    for topic in (*ANSWERS, '/fan/joint_states', MEASURED):
        recorded = payloads(live, topic)
        assert recorded == payloads(tmp_path / 'offline.mcap', topic)
        assert recorded == payloads(tmp_path / 'again.mcap', topic)

    with AnyReader([live]) as reader:
        stamps = {topic: [] for topic in (*ANSWERS, '/fan/joint_states')}
        for connection, time_ns, raw in reader.messages():
            message = reader.deserialize(raw, connection.msgtype)
            if connection.topic in stamps:
                stamp = message.header.stamp
                assert time_ns == stamp.sec * 10**9 + stamp.nanosec
                stamps[connection.topic].append(time_ns)
    assert len(set(map(tuple, stamps.values()))) == 1  # every stamp of the input, nothing else


def test_a_speed_that_is_told_in_another_way_reaches_a_node_that_knows_of_nothing(
        rotorsoil_twin, machine, case_file, cache, tmp_path):
    rpm = SpeedSource(topic='/paper_rotor/rpm', unit='rpm')
    twin = rotorsoil_twin(case_file, machine='fan', parameters={'cache': str(cache)})
    played = InThread(replay, RPM, rate=100.0, context=twin.context, speed=rpm, machine='fan')
    twin.until(played.is_done, 'the replay')
    assert (played.error, played.result) == (None, 200)
    predict(machine, RPM, tmp_path / 'offline.mcap', speed=rpm)
    states = JointStateReader()
    [(_, exact)] = states.runs(payloads(tmp_path / 'offline.mcap',
                                        '/rotorsoil/paper_rotor/amplitude'))
    answers = twin.amplitude.wait_for(200)
    assert [answer.stamp_ns for answer in answers] == exact.stamp_ns.tolist()
    np.testing.assert_array_equal([answer['disc_1_x'] for answer in answers],
                                  exact.position[:, exact.names.index('disc_1_x')])


def test_whose_speed_a_topic_tells_has_to_be_known(tmp_path):
    with pytest.raises(InputError, match='no topic says whose speed it is; name the machine'):
        replay(RPM, speed=SpeedSource(topic='/paper_rotor/rpm', unit='rpm'))


class Clock:
    """A clock that stands still but for who sleeps."""

    def __init__(self):
        self.now = 1000.0

    def monotonic(self):
        return self.now

    def sleep(self, seconds):
        self.now += seconds


def test_replay_keeps_the_pace_or_scales_it(graph, tmp_path, monkeypatch):
    path, count = tmp_path / 'p.mcap', 41
    write_speed_profile(path, 'fan', START + 5 * 10**7 * np.arange(count), np.full(count, 300.0))
    graph.probe.create_subscription(JointState, '/fan/joint_states', lambda _: None, 1000)
    clock, times = Clock(), []
    monkeypatch.setattr('rotorsoil_ros.node.replay.time', clock)
    assert replay(path, rate=4.0, wait_s=1e9, context=graph.context,
                  progress=lambda done, total: times.append(clock.now)) == count
    # 50 ms at four times the pace, on a clock that only sleep moves.
    np.testing.assert_allclose(np.diff(times), 0.0125, rtol=1e-9)


def test_bare_speeds_are_replayed_as_such(graph, tmp_path):
    path = tmp_path / 'p.mcap'
    with LogFile(path) as log:
        log.write(Records('/fan/rotor/speed', 'std_msgs/msg/Float64', [START],
                          [b'\0\1\0\0' + np.float64(314.0).tobytes()]))
    heard = []
    graph.probe.create_subscription(Float64, '/fan/rotor/speed', heard.append, 10)
    played = InThread(replay, path, context=graph.context)
    graph.until(lambda: played.is_done() and heard, 'the speed')
    assert heard[0].data == 314.0


def test_replay_brings_its_own_context_and_gives_up_when_nobody_listens(
        profile, monkeypatch):
    monkeypatch.setenv('ROS_DOMAIN_ID', '59')
    with pytest.raises(RotorSoilError, match=r'nobody listens to /fan/joint_states after 0\.1 s'):
        replay(profile, wait_s=0.1)


def test_who_is_not_heard_is_told_and_the_others_are_replayed(graph, tmp_path, capfd):
    profile = tmp_path / 'profile.mcap'
    with LogFile(profile) as log:
        for topic in ('/fan/joint_states', '/geared/joint_states'):
            log.write(joint_records(3, topic=topic))
    heard = graph.hear('/fan/joint_states', JointState)
    assert replay(profile, rate=1e6, wait_s=2.0, context=graph.context) == 6
    graph.until(lambda: len(heard) == 3, 'all speeds of the fan')
    assert 'nobody listens to /geared/joint_states after 2 s' in capfd.readouterr().err


def test_replay_ends_with_its_context(graph, profile):
    heard = []
    graph.probe.create_subscription(JointState, '/fan/joint_states', heard.append, 10)
    played = InThread(replay, profile, rate=1e-4, context=graph.context)
    graph.until(lambda: heard, 'the first speed')
    graph.context.try_shutdown()
    played.thread.join(DEADLINE_S)
    assert played.is_done()
    assert 1 <= played.result < 302


@pytest.mark.parametrize('rate', [0.0, -1.0, np.nan, np.inf])
def test_a_rate_that_is_none_is_refused(profile, rate):
    with pytest.raises(InputError, match='rate must be > 0 and finite'):
        replay(profile, rate=rate)


def test_a_bag_without_speed_is_refused(tmp_path):
    with LogFile(tmp_path / 'p.mcap') as log:
        log.write(Records('/fan/measured/phase', JOINT_STATE, [START], JointStateWriter(
            ['a']).write([START], np.zeros((1, 3, 1)))))
    with pytest.raises(InputError, match='tells no speed'):
        replay(tmp_path / 'p.mcap')


def test_sensors_are_heard_from_their_first_sample_on(graph, tmp_path, cache, monkeypatch):
    # On a busy machine all of them may wait, for a long time: none may be lost for want of room.
    monkeypatch.setattr('rotorsoil_ros.node.endpoint.RAW_DEPTH', 20_000)
    monkeypatch.setattr('rotorsoil_ros.node.replay.DEPTH', 20_000)
    fan = Machine.load(FAN, cache_directory=cache)
    source = tmp_path / 'run.mcap'
    truth = Truth(ramp_s=2.0, dwell_s=1.0, slowest_rpm=900.0, rate_hz=400.0)
    write_synthetic(source, 'fan', fan.model, fan.case.unbalance, truth=truth, start_ns=START)
    parameters = {'cache': str(cache), 'machines': ['fan'], 'fan.case': str(FAN),
                  'speed_reliability': 'reliable', 'speed_depth': 20_000, 'log.rerun': False,
                  'log.directory': str(tmp_path)}
    node = graph.add(RotorsoilNode(
        context=graph.context, parameter_overrides=[
            Parameter(name, value=value) for name, value in parameters.items()]))
    assert node.start()
    replaying = InThread(replay, source, rate=4.0, wait_s=DEADLINE_S, context=graph.context)
    counts = node._watches['fan'].monitor.health.counts
    graph.until(lambda: replaying.is_done() and counts['samples'] == 8000, 'every sample')
    node.release()
    wanted, found = topics_of(source), topics_of(tmp_path / 'run')
    assert {topic: found[topic] for topic in wanted} == wanted
