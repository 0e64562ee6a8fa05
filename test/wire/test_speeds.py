"""Speeds as plants tell them: any number of any message, held against an independent writer."""

import math

import numpy as np
import pytest
from rosbags.typesys import get_types_from_msg, get_typestore, Stores

from rotorsoil_ros.cli.arguments.options import UNITS_OF_SPEED
from rotorsoil_ros.errors import InputError
from rotorsoil_ros.units import SPEED_UNITS
from rotorsoil_ros.wire.cdr import encode
from rotorsoil_ros.wire.definitions import JOINT_STATE
from rotorsoil_ros.wire.speeds import SpeedReader, SpeedSource, USUAL

STORE = get_typestore(Stores.ROS2_JAZZY)
START = 1_700_000_000_000_000_001
RECEIVED = START + 5
DRIVE = 'drive_msgs/msg/Drive'
PHASE = 'drive_msgs/msg/Phase'
DRIVE_TEXT = f"""# what a vendor of drives sends
builtin_interfaces/Time stamp
uint8 RUNNING=1
string name
bool is_running
int16 torque 5
drive_msgs/Phase[] phases
uint64[2] counts
{'=' * 80}
MSG: drive_msgs/Phase
float32 frequency
float64 current
"""
STORE.register(get_types_from_msg(DRIVE_TEXT.split('=' * 80)[0], DRIVE))
STORE.register(get_types_from_msg(DRIVE_TEXT.split('/Phase\n', 2)[-1], PHASE))
THIRD = 'geometry_msgs/msg/'


def sent(kind, *values):
    return bytes(STORE.serialize_cdr(STORE.types[kind](*values), kind))


def header(stamp=START):
    time = STORE.types['builtin_interfaces/msg/Time'](*divmod(stamp, 10**9))
    return STORE.types['std_msgs/msg/Header'](time, 'drive')


def vector(*values):
    return STORE.types[f'{THIRD}Vector3'](*values)


def twist(*angular):
    return STORE.types[f'{THIRD}Twist'](vector(7.0, 8.0, 9.0), vector(*angular))


def definition(kind):
    text, _ = STORE.generate_msgdef(kind, ros_version=2)
    return text


def drive():
    phase = STORE.types[PHASE]
    return sent(DRIVE, STORE.types['builtin_interfaces/msg/Time'](*divmod(START, 10**9)), 'm1',
                True, -3, [phase(16.5, 1.0), phase(16.75, 2.0)],
                np.array([1, 2**40], dtype=np.uint64))


def told(kind, cdrs, told_by='', **source):
    notes = []
    reader = SpeedReader(kind, SpeedSource(**source), note=lambda why, count: notes.append(why),
                         explain=lambda why, text: notes.append(text), told=told_by)
    found = reader.read([RECEIVED] * len(cdrs), cdrs)
    assert [*found.messages] == [*cdrs] or notes
    return found, notes


@pytest.mark.parametrize('kind, value, wanted', [
    ('std_msgs/msg/Float32', 314.25, 314.25), ('std_msgs/msg/Float64', 314.1, 314.1),
    ('std_msgs/msg/Int8', -3, -3.0), ('std_msgs/msg/UInt8', 200, 200.0),
    ('std_msgs/msg/Int16', -3000, -3000.0), ('std_msgs/msg/UInt16', 60000, 60000.0),
    ('std_msgs/msg/Int32', 1480, 1480.0), ('std_msgs/msg/UInt32', 4_000_000_000, 4e9),
    ('std_msgs/msg/Int64', 2**50, 2.0**50), ('std_msgs/msg/UInt64', 2**60, 2.0**60)])
def test_every_number_of_the_standard_is_read_and_dated_on_receipt(kind, value, wanted):
    found, notes = told(kind, [sent(kind, value)], definition(kind))
    assert (found.speed.tolist(), found.stamps, notes) == ([wanted], (RECEIVED,), [])
    assert math.isnan(found.angle[0])


@pytest.mark.parametrize('unit, value, turns_per_second', [
    ('rpm', 990.0, 16.5), ('hz', 16.5, 16.5), ('deg_s', 5940.0, 16.5),
    ('rad_s', 16.5 * 2.0 * math.pi, 16.5)])
def test_units_are_those_of_a_plant(unit, value, turns_per_second):
    kind = 'std_msgs/msg/Float64'
    found, _ = told(kind, [sent(kind, value)], unit=unit)
    assert found.speed[0] == pytest.approx(2.0 * math.pi * turns_per_second, rel=1e-15)


def test_the_command_line_offers_every_unit():
    assert tuple(SPEED_UNITS) == UNITS_OF_SPEED


@pytest.mark.parametrize('kind, values, field, wanted', [
    (f'{THIRD}Twist', (vector(1, 2, 3), vector(4, 5, 6)), 'angular.x', 4.0),
    (f'{THIRD}Twist', (vector(1, 2, 3), vector(4, 5, 6)), 'linear.z', 3.0),
    (f'{THIRD}TwistStamped', (header(), twist(4, 5, 6)), 'twist.angular.z', 6.0),
    (f'{THIRD}Vector3Stamped', (header(), vector(4, 5, 6)), 'vector.y', 5.0)])
def test_a_field_is_named_by_its_path(kind, values, field, wanted):
    found, _ = told(kind, [sent(kind, *values)], definition(kind), field=field)
    assert found.speed.tolist() == [wanted]
    assert [*found.stamps] == [START if kind.endswith('Stamped') else RECEIVED]


@pytest.mark.parametrize('field, unit, wanted', [
    ('torque', 'rad_s', -3.0), ('phases[1].frequency', 'hz', 33.5 * math.pi),
    ('phases[0].current', 'rad_s', 1.0), ('counts[1]', 'rad_s', 2.0**40)])
def test_a_type_that_nobody_ships_is_read_by_what_its_bag_says(field, unit, wanted):
    found, notes = told(DRIVE, [drive()], DRIVE_TEXT, field=field, unit=unit)
    assert found.speed.tolist() == pytest.approx([wanted], rel=1e-15)
    assert ([*found.stamps], notes) == ([START], [])  # a bare stamp in front counts as well


def test_what_the_message_is_too_short_for_is_counted_and_explained():
    found, notes = told(DRIVE, [drive()], DRIVE_TEXT, field='phases[2].frequency')
    assert math.isnan(found.speed[0])
    assert notes == ['the message is too short for phases[2].frequency', 'velocity_missing']


@pytest.mark.parametrize('kind, definition_of, field, words', [
    (f'{THIRD}Twist', f'{THIRD}Twist', '', 'must be named; its numbers are linear.x, linear.y'),
    (f'{THIRD}Twist', f'{THIRD}Twist', 'angular.w', 'no number angular.w.*did you mean angular'),
    (f'{THIRD}Twist', f'{THIRD}Twist', 'angular', 'no number angular'),
    ('std_msgs/msg/Float64', 'std_msgs/msg/Float64', 'value', 'its numbers are data'),
    ('std_msgs/msg/String', 'std_msgs/msg/String', '', 'its numbers are none'),
    ('std_msgs/msg/Bool', 'std_msgs/msg/Bool', '', 'its numbers are none'),
    (DRIVE, None, 'torque', 'nothing tells of what it is made')])
def test_a_field_that_is_not_there_is_refused_with_those_that_are(
        kind, definition_of, field, words):
    text = definition(definition_of) if definition_of else ''
    with pytest.raises(InputError, match=words):
        told(kind, [], text, field=field)
    assert SpeedSource(field=field).fits(kind, text)


def states(names=('motor', 'rotor'), velocity=(148.0, 37.0), position=(1.0, 2.0)):
    return encode(JOINT_STATE, {
        'header': {'stamp': {'sec': START // 10**9, 'nanosec': START % 10**9}},
        'name': names, 'velocity': velocity, 'position': position})


def test_a_drive_before_a_gear_tells_the_speed_but_not_the_angle_of_the_rotor():
    found, _ = told(JOINT_STATE, [states()], joint='motor', ratio=0.25)
    assert found.speed.tolist() == [37.0]
    assert math.isnan(found.angle[0])


def test_a_drive_that_counts_backwards_tells_both():
    found, _ = told(JOINT_STATE, [states(velocity=(-148.0, 1.0))], joint='motor', ratio=-1.0)
    assert (found.speed.tolist(), found.angle.tolist()) == ([148.0], [-1.0])


@pytest.mark.parametrize('kind, values, field', [
    *((f'std_msgs/msg/{name}', (99,), '') for name in (
        'Int8', 'Int16', 'Int32', 'Int64', 'UInt8', 'UInt16', 'UInt32', 'UInt64', 'Float32')),
    (f'{THIRD}Twist', (vector(7.0, 8.0, 9.0), vector(0.0, 0.0, 99.0)), 'angular.z'),
    (f'{THIRD}TwistStamped', (header(), twist(0.0, 0.0, 99.0)), 'twist.angular.z'),
    (f'{THIRD}Vector3Stamped', (header(), vector(99.0, 0.0, 0.0)), 'vector.x')])
def test_usual_types_are_known_where_a_bag_does_not_tell_of_what_they_are_made(
        kind, values, field):
    """As one of SQLite before Iron does not."""
    source = SpeedSource(field=field, unit='rpm', ratio=-2.0)
    assert not source.fits(kind, '')
    found, _ = told(kind, [sent(kind, *values)], field=field, unit='rpm', ratio=-2.0)
    np.testing.assert_allclose(found.speed, [-2.0 * 99.0 * SPEED_UNITS['rpm']])


def test_a_velocity_is_found_by_its_number_where_joints_have_no_names():
    found, _ = told(JOINT_STATE, [states(names=())], field='velocity[1]')
    assert found.speed.tolist() == [37.0]


def test_a_joint_that_is_not_there_is_explained_with_the_near_one():
    _, notes = told(JOINT_STATE, [states(names=['rotor_1', 'gear'])] * 3)
    assert notes.count('joint_missing') == 3
    assert 'needed is rotor, there are rotor_1, gear; did you mean rotor_1?' in notes


@pytest.mark.parametrize('cdr', [b'', b'\0\1\0\0', b'\0\1\0\0\1\2\3', b'\0\3\0\0' + 8 * b'\1'])
def test_what_is_not_such_a_message_is_malformed(cdr):
    found, notes = told('std_msgs/msg/Float32', [cdr], definition('std_msgs/msg/Float32'))
    assert (len(found.stamps), notes) == (0, ['malformed'])


@pytest.mark.parametrize('wrong', [
    {'unit': 'krpm'}, {'ratio': 0.0}, {'ratio': math.nan}, {'ratio': math.inf},
    {'field': 'a..b'}, {'field': '[1]'}, {'type': 'Float32'}])
def test_what_no_speed_can_be_told_by_is_refused(wrong):
    with pytest.raises(InputError, match=f'speed {next(iter(wrong))} must be'):
        SpeedSource(**wrong)


def test_nothing_said_is_as_usual():
    assert USUAL.is_usual
    assert not SpeedSource(unit='rpm').is_usual
