"""Speed profiles are found and read in anybody's bags, written in ours, made from measurements."""

import math
from pathlib import Path
import tracemalloc

import numpy as np
import pytest
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import get_typestore, Stores

from rotorsoil_ros.bags.profile import (
    Place,
    place,
    speed_profile,
    write_speed_profile,
)
from rotorsoil_ros.wire.definitions import FLOAT64, JOINT_STATE, STRING
from rotorsoil_ros.wire.speeds import SpeedSource

from records import topics_of

STORE = get_typestore(Stores.ROS2_JAZZY)
START = 1_700_000_000_000_000_001
REFERENCE = Path(__file__).parents[1] / 'reference'


@pytest.mark.parametrize('topic, kind, found', [
    ('/fan/joint_states', JOINT_STATE, Place('', 'fan', 'joint_states')),
    ('/plant/fan/rotor/speed', FLOAT64, Place('/plant', 'fan', 'rotor/speed')),
    ('/fan/measured/phase', JOINT_STATE, Place('', 'fan', 'measured/phase')),
    ('/joint_states', JOINT_STATE, Place('', '', 'joint_states')),
    ('/fan/joint_states', FLOAT64, None), ('/fan/rotor/speed', JOINT_STATE, None),
    ('/fan/my_joint_states', JOINT_STATE, None), ('/chatter', STRING, None)])
def test_place_of_a_topic(topic, kind, found):
    assert place(topic, kind) == found


def read(path, **options):
    batches = list(speed_profile(path, **options))
    return (np.concatenate([batch.stamp_ns for batch in batches]),
            np.concatenate([batch.speed for batch in batches]))


def test_a_written_profile_is_read_back_to_the_bit_and_the_nanosecond(tmp_path):
    stamps = START + 10**6 * np.arange(5000)
    speeds = np.random.default_rng(0).uniform(0.0, 900.0, 5000)
    write_speed_profile(tmp_path / 'p.mcap', 'fan', stamps, speeds)
    assert topics_of(tmp_path / 'p.mcap') == {'/fan/joint_states': (JOINT_STATE, 5000)}
    found_stamps, found_speeds = read(tmp_path / 'p.mcap')
    assert found_stamps.tolist() == stamps.tolist()
    assert found_speeds.tobytes() == speeds.tobytes()


def foreign_bag(path, messages):
    """Write (topic, type, time, message) with an independent writer."""
    writer = Writer(path, version=9, storage_plugin=StoragePlugin.MCAP)
    connections = {}
    with writer:
        for topic, kind, time, message in messages:
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=STORE)
            writer.write(connections[topic], time, STORE.serialize_cdr(message, kind))


def joint_state(stamp, names, velocity):
    types = STORE.types
    header = types['std_msgs/msg/Header'](
        types['builtin_interfaces/msg/Time'](*divmod(stamp, 10**9)), 'frame')
    empty = np.array([])
    return types[JOINT_STATE](header, names, empty, np.array(velocity, dtype=float), empty)


def test_the_rotor_is_found_by_its_name_and_stamps_count_not_reception(tmp_path):
    names = ['fan', 'rotor', 'gear']
    told = [(START, names, [1.0, 2.0, 3.0]), (START + 9, names[:1], [1.0]),
            (START + 1, names[::-1], [7, 8, 9]), (START + 2, names, []),
            (-5 * 10**9, names, [1, 2, 3])]
    foreign_bag(tmp_path / 'bag', [
        ('/m/joint_states', JOINT_STATE, START + 500 + number, joint_state(*one))
        for number, one in enumerate(told)])
    stamps, speeds = read(tmp_path / 'bag')
    assert stamps.tolist() == [START, START + 1, START + 2]
    np.testing.assert_array_equal(speeds, [2.0, 8.0, math.nan])
    _, gear = read(tmp_path / 'bag', speed=SpeedSource(joint='gear'))
    np.testing.assert_array_equal(gear, [3.0, 7.0, math.nan])


def test_a_bare_speed_counts_at_its_reception(tmp_path):
    message = STORE.types[FLOAT64](314.0)
    foreign_bag(tmp_path / 'bag', [('/m/rotor/speed', FLOAT64, START + 7, message),
                                   ('/chatter', STRING, START, STORE.types[STRING]('speed'))])
    stamps, speeds = read(tmp_path / 'bag')
    assert (stamps.tolist(), speeds.tolist()) == ([START + 7], [314.0])


def peak_memory(path):
    tracemalloc.start()
    count = sum(len(batch.speed) for batch in speed_profile(path))
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    return count, peak


def test_memory_does_not_grow_with_the_length_of_the_profile(tmp_path):
    peaks = {}
    for count in (24_000, 72_000):
        path = tmp_path / f'{count}.mcap'
        write_speed_profile(path, 'fan', START + np.arange(count), np.full(count, 300.0))
        found, peaks[count] = peak_memory(path)
        assert found == count
    assert peaks[72_000] < 1.2 * peaks[24_000]
