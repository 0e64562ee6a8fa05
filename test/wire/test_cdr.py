"""The layout that is read from bytes is the one that ROS writes."""

import math

from hypothesis import given, strategies as some
import numpy as np
import pytest
from rclpy.serialization import serialize_message
from rosbags.typesys import get_typestore, Stores
from sensor_msgs.msg import JointState

from rotorsoil_ros.errors import InputError
from rotorsoil_ros.wire.cdr import Layout
from rotorsoil_ros.wire.definitions import JOINT_STATE
from rotorsoil_ros.wire.sensors import _orientation, joint_states as decode, JointStateReader

NUMBERS = some.floats(allow_nan=False)
WORDS = some.text(some.characters(codec='ascii', exclude_characters='\0'), max_size=9)


@some.composite
def joint_states(draw):
    """Return a JointState of which any array may be empty, as the message allows."""
    names = draw(some.lists(WORDS, max_size=4))
    arrays = {name: draw(some.sampled_from([[], draw(some.lists(
        NUMBERS, min_size=len(names), max_size=len(names)))]))
        for name in ('position', 'velocity', 'effort')}
    message = JointState(name=names, **arrays)
    message.header.frame_id = draw(WORDS)
    message.header.stamp.sec = draw(some.integers(-2**31, 2**31 - 1))
    message.header.stamp.nanosec = draw(some.integers(0, 2**32 - 1))
    return message


def assert_says(states, message):
    width = len(message.name)
    assert list(states.names) == message.name
    stamp = message.header.stamp
    assert states.stamp_ns[0] == stamp.sec * 1_000_000_000 + stamp.nanosec
    for name in ('position', 'velocity', 'effort'):
        sent = list(getattr(message, name)) or [np.nan] * width
        np.testing.assert_array_equal(getattr(states, name)[0], sent)


@given(joint_states())
def test_every_joint_state_that_rclpy_writes_is_read(message):
    cdr = serialize_message(message)
    assert_says(decode(Layout.of(JOINT_STATE, cdr), [cdr]), message)


@given(joint_states())
def test_big_endian_messages_of_another_implementation_are_read(message):
    store = get_typestore(Stores.ROS2_JAZZY)
    types, header = store.types, message.header
    foreign = types['sensor_msgs/msg/JointState'](
        types['std_msgs/msg/Header'](
            types['builtin_interfaces/msg/Time'](header.stamp.sec, header.stamp.nanosec),
            header.frame_id),
        message.name, np.array(message.position), np.array(message.velocity),
        np.array(message.effort))
    cdr = bytes(store.serialize_cdr(foreign, 'sensor_msgs/msg/JointState', little_endian=False))
    layout = Layout.of(JOINT_STATE, cdr)
    assert layout.order == '>'
    assert_says(decode(layout, [cdr]), message)
    assert layout.stamp_ns(cdr) == header.stamp.sec * 1_000_000_000 + header.stamp.nanosec


def message_of(names, velocity, **others):
    return serialize_message(JointState(name=names, velocity=velocity, **others))


def test_padding_does_not_make_a_layout_different():
    cdr = bytearray(message_of(['rotor'], [1.0]))
    layout = Layout.of(JOINT_STATE, bytes(cdr))
    padding = set(range(len(cdr))) - {index for at, _ in layout.fixed
                                      for index in range(at.start, at.stop)}
    padding -= {*range(4, 12), *range(layout.span('velocity').start, layout.span('velocity').stop)}
    assert padding  # behind `rotor` and before the velocity there is some
    for index in padding:
        cdr[index] ^= 0xff
    assert layout.fits(bytes(cdr))


@pytest.mark.parametrize('other', [
    message_of(['motor'], [1.0]), message_of(['rotor', 'b'], [1.0, 2.0]),
    message_of(['rotor'], [1.0], position=[2.0]), message_of(['rotor'], []),
    message_of(['rotor'], [], position=[1.0]), message_of(['rotor'], [1.0]) + bytes(8)],
    ids=['another name', 'two joints', 'a position', 'no velocity', 'a position only', 'longer'])
def test_other_names_and_other_counts_are_another_layout(other):
    assert not Layout.of(JOINT_STATE, message_of(['rotor'], [1.0])).fits(other)


@given(some.binary(max_size=80))
def test_bytes_of_a_stranger_are_read_or_refused(noise):
    try:
        Layout.of(JOINT_STATE, b'\0\1\0\0' + noise)
    except InputError:
        return


@pytest.mark.parametrize('length', range(0, 60, 3))
def test_a_message_that_was_cut_off_is_refused(length):
    cdr = message_of(['rotor', 'b'], [1.0, 2.0], position=[1.0, 2.0], effort=[1.0, 2.0])
    with pytest.raises(InputError, match='message'):
        Layout.of(JOINT_STATE, cdr[:length])


def test_runs_keep_the_order_and_set_the_malformed_apart():
    one, two = message_of(['rotor'], [1.0]), message_of(['a', 'rotor'], [2.0, 3.0])
    runs = list(JointStateReader().runs([one, one, two, b'', one]))
    assert [len(messages) for messages, _ in runs] == [2, 1, 1, 1]
    assert runs[2][1] is None
    np.testing.assert_array_equal(runs[0][1].velocity, [[1.0], [1.0]])
    np.testing.assert_array_equal(runs[1][1].velocity, [[2.0, 3.0]])


@pytest.mark.parametrize('size', [1.0, 1e300, 5e-324, np.nan, np.inf, 0.0])
def test_size_of_an_orientation_does_not_matter(size):
    """A quarter turn about x: any multiple of (1, 0, 0, 1) / sqrt(2)."""
    kind = np.dtype([('orientation', '<f8', (4,)), ('orientation_covariance', '<f8', (9,))])
    rows = np.zeros(1, dtype=kind)
    rows['orientation'] = [size, 0.0, 0.0, size]
    told = np.isfinite(size) and size > 0.0
    np.testing.assert_allclose(_orientation(rows), [4 * [np.nan] if not told else [
        math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5)]])
