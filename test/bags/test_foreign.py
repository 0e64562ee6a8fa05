"""A run is the same run in every storage: held against an independent writer of all three."""

import sqlite3
import sys

import numpy as np
import pytest
from rosbags.rosbag1 import Writer as Ros1Writer
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import get_types_from_msg, get_typestore, Stores

from rotorsoil_ros.bags import reader as bag_reader
from rotorsoil_ros.bags.profile import read_profile
from rotorsoil_ros.cli import main
from rotorsoil_ros.errors import InputError
from rotorsoil_ros.wire.speeds import SpeedSource

START = 1_700_000_000 * 10**9
COUNT = 2500
JOINTS, RPM = '/paper_rotor/joint_states', '/plc/rpm'
DRIVE = 'plc_msgs/msg/Drive'
DRIVE_TEXT = 'std_msgs/Header header\nint32 rpm\n'


def store(version):
    found = get_typestore(version)
    found.register(get_types_from_msg(DRIVE_TEXT, DRIVE))
    return found


def messages(types, *, is_ros1):
    """Yield topic, type, time and message of a run-up, told twice."""
    def header(stamp):
        time = types['builtin_interfaces/msg/Time'](*divmod(stamp, 10**9))
        return types['std_msgs/msg/Header'](*((7,) if is_ros1 else ()), time, 'rotor')

    empty = np.array([])
    for row, speed in enumerate(np.linspace(100.0, 900.0, COUNT).tolist()):
        stamp = START + row * 10**7
        yield JOINTS, 'sensor_msgs/msg/JointState', stamp + 5, types['sensor_msgs/msg/JointState'](
            header(stamp), ['rotor'], empty, np.array([speed]), empty)
        yield RPM, DRIVE, stamp + 6, types[DRIVE](header(stamp), round(speed * 30.0 / np.pi))


def write_ros2(path, plugin):
    types = store(Stores.ROS2_JAZZY)
    with Writer(path, version=9, storage_plugin=plugin) as bag:
        known = {}
        for topic, kind, time, message in messages(types.types, is_ros1=False):
            if topic not in known:
                known[topic] = bag.add_connection(topic, kind, typestore=types)
            bag.write(known[topic], time, types.serialize_cdr(message, kind))
    return path


def write_ros1(path):
    types = store(Stores.ROS1_NOETIC)
    with Ros1Writer(path) as bag:
        known = {}
        for topic, kind, time, message in messages(types.types, is_ros1=True):
            if topic not in known:
                known[topic] = bag.add_connection(topic, kind, typestore=types)
            bag.write(known[topic], time, types.serialize_ros1(message, kind))
    return path


@pytest.fixture(scope='module')
def bags(tmp_path_factory):
    place = tmp_path_factory.mktemp('bags')
    return {'mcap': write_ros2(place / 'mcap', StoragePlugin.MCAP),
            'sqlite': write_ros2(place / 'sqlite', StoragePlugin.SQLITE3),
            'ros1': write_ros1(place / 'run.bag')}


@pytest.fixture(params=['sqlite', 'a file of it', 'without metadata', 'ros1'])
def other(request, bags, tmp_path):
    """Return the run in another storage."""
    if request.param in bags:
        return bags[request.param]
    [file] = bags['sqlite'].glob('*.db3')
    if request.param == 'a file of it':
        return file
    (tmp_path / 'bag').mkdir()
    (tmp_path / 'bag' / file.name).write_bytes(file.read_bytes())
    return tmp_path / 'bag'


def test_every_storage_tells_the_same_speeds(bags, other):
    mine, theirs = read_profile(bags['mcap']), read_profile(other)
    assert len(theirs.speed) == COUNT
    assert theirs.stamp_ns.tolist() == mine.stamp_ns.tolist()
    assert theirs.speed.tobytes() == mine.speed.tobytes()


def test_a_type_that_nobody_ships_is_read_in_every_storage(bags, other):
    rpm = SpeedSource(topic=RPM, unit='rpm')
    mine, theirs = (read_profile(bag, machine='fan', speed=rpm) for bag in (bags['mcap'], other))
    assert theirs.stamp_ns.tolist() == mine.stamp_ns.tolist() == [
        START + row * 10**7 for row in range(COUNT)]
    assert theirs.speed.tobytes() == mine.speed.tobytes()


def test_every_storage_is_answered_alike(bags, other, tmp_path, case_file, cache, machine, capsys):
    logs = []
    for number, bag in enumerate((bags['mcap'], other)):
        out = tmp_path / f'{number}.mcap'
        assert main(['predict', str(case_file), str(bag), '-o', str(out),
                     '--cache', str(cache)]) == 0
        logs.append([(source.topic, time, payload) for source, time, payload
                     in bag_reader.messages(out, lambda *_: True)
                     if source.topic.endswith(('amplitude', 'phase'))])
    assert f'{COUNT} answered' in capsys.readouterr().out
    assert logs[0] == logs[1]


def test_messages_are_counted_by_channel(other):
    assert {source.topic: (source.type, number)
            for source, number in bag_reader.sources(other).items()} == {
        JOINTS: ('sensor_msgs/msg/JointState', COUNT), RPM: (DRIVE, COUNT)}


def test_without_rosbags_a_bag_of_ros_1_says_what_reads_and_what_converts_it(bags, monkeypatch):
    for name in ('rosbags.rosbag1', 'rosbags.typesys'):
        monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises(InputError) as raised:
        read_profile(bags['ros1'])
    assert 'pip install "rotorsoil_ros[bags]"' in str(raised.value)
    assert f'rosbags-convert --src {bags["ros1"]} --dst run' in str(raised.value)
    assert len(str(raised.value).splitlines()) == 1


@pytest.mark.parametrize('name', ['broken.db3', 'broken.bag'])
@pytest.mark.parametrize('content', [b'', b'SQLite format 3\0 and no more', b'#ROSBAG V2.0\n no'])
def test_what_is_broken_is_refused_in_one_line(tmp_path, name, content):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(InputError) as raised:
        read_profile(tmp_path / name)
    assert str(raised.value).startswith(str(tmp_path / name))
    assert len(str(raised.value).splitlines()) == 1


def test_a_time_that_is_none_is_left_out_and_told(bags, tmp_path):
    [file] = bags['sqlite'].glob('*.db3')
    copy = tmp_path / 'run.db3'
    copy.write_bytes(file.read_bytes())
    with sqlite3.connect(copy) as base:
        base.execute('UPDATE messages SET timestamp = -5 WHERE id = 1')
    said = []
    found = list(bag_reader.messages(copy, lambda *_: True, tell=said.append))
    assert len(found) == 2 * COUNT - 1
    assert '1 messages with an impossible time are left out' in said[0]
