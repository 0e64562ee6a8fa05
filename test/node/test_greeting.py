"""What the node says of what it hears: at its start, and once of each thing that does not fit."""

import subprocess
import sys

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import TwistStamped, Vector3
import numpy as np
import pytest
from rcl_interfaces.msg import Log
import rclpy
from rclpy.context import Context
from rclpy.node import Node
from sensor_msgs.msg import JointState
from std_msgs.msg import Float32, Int32

from rotorsoil_ros.errors import InputError
from rotorsoil_ros.testing.graph import DEADLINE_S
from rotorsoil_ros.units import rad_s_to_rpm, rpm_to_rad_s

from graphs import assert_answers, exact, joint_state, STAMP, stamp_ns


@pytest.fixture
def stranger(graph):
    """Return a node of another process, which may have other types on the same topics."""
    context = Context()
    rclpy.init(args=[], context=context, domain_id=graph.context.get_domain_id())
    node = Node('stranger', context=context)
    yield node
    node.destroy_node()
    context.try_shutdown()


def spoken(bench, topic, kind, *, of='fan'):
    """Return what publishes on a topic once the node hears it."""
    publish = bench.probe.create_publisher(kind, topic, 1000)
    bench.graph.until(publish.get_subscription_count, 'a subscription')
    bench.settle()
    return publish.publish


def summary(diagnostics):
    return diagnostics[-1].status[0].message if diagnostics else ''


def warned(bench, words):
    """Wait for a remark and for the diagnostics; return how often the remark came."""
    events = bench.hear('/rotorsoil/fan/events', Log)
    diagnostics = bench.hear('/diagnostics', DiagnosticArray)
    bench.settle()
    bench.graph.until(lambda: words in summary(diagnostics)
                      and any(words in event.msg for event in events), words)
    return events, diagnostics


def test_the_node_says_what_it_hears_and_what_it_answers(bench, capfd, machine):
    bench.active('fan')
    said = capfd.readouterr().err
    assert '/fan/joint_states (sensor_msgs/msg/JointState, velocity of joint rotor, rad/s)' in said
    assert '/fan/rotor/speed (std_msgs/msg/Float64, rad/s)' in said
    lowest, highest = machine.table.speed_range
    assert (f'{len(machine.table.channels)} channels of bearing_1_journal, ' in said)
    assert f'from {rad_s_to_rpm(lowest):.0f} to {rad_s_to_rpm(highest):.0f} rpm' in said


@pytest.mark.parametrize('parameters, kind, sent', [
    ({'type': 'std_msgs/msg/Int32', 'unit': 'rpm'}, Int32, Int32(data=2865)),
    ({'topic': '/plc/drive', 'unit': 'rpm'}, Int32, Int32(data=2865)),
    ({'topic': 'drive', 'unit': 'rpm', 'ratio': 0.25, 'type': 'std_msgs/msg/Float32'}, Float32,
     Float32(data=11460.0)),
    ({'topic': '/imu/turn', 'field': 'twist.angular.y', 'unit': 'rpm', 'ratio': -1.0},
     TwistStamped, None),
    ({'field': 'velocity[1]'}, JointState, None)])
def test_a_speed_is_heard_where_and_as_the_plant_tells_it(bench, machine, parameters, kind, sent):
    bench.active('fan', **{f'fan__speed__{name}': value for name, value in parameters.items()})
    amplitude, phase = bench.answers()
    topic = parameters.get('topic') or (
        '/fan/joint_states' if kind is JointState else '/fan/rotor/speed')
    publish = spoken(bench, topic, kind)
    speed = rpm_to_rad_s(2865.0)
    if sent is None:
        sent = kind()
        sent.header.stamp.sec, sent.header.stamp.nanosec = divmod(STAMP, 10**9)
        if kind is JointState:
            sent.velocity = [1.0, speed]
        else:
            sent.twist.angular = Vector3(y=-2865.0)
    publish(sent)
    bench.graph.until(lambda: amplitude and phase, 'the answer')
    if hasattr(sent, 'header'):
        assert stamp_ns(amplitude[0]) == STAMP
    assert_answers(amplitude[0], phase[0], exact(machine, speed))


def test_a_type_that_does_not_fit_is_named_with_the_one_that_does(bench, stranger):
    bench.active('fan')
    stranger.create_publisher(Float32, '/fan/rotor/speed', 10)
    warned(bench, '/fan/rotor/speed is std_msgs/msg/Float32, needed is std_msgs/msg/Float64')


def test_a_named_topic_of_a_type_without_such_a_field_is_named(bench):
    bench.active('fan', fan__speed__topic='/turn', fan__speed__field='twist.angular.q')
    bench.probe.create_publisher(TwistStamped, '/turn', 10)
    warned(bench, 'has no number twist.angular.q')


def test_a_joint_of_another_name_is_told_once_with_the_near_one(bench):
    bench.active('fan')
    publish = spoken(bench, '/fan/joint_states', JointState)
    publish(joint_state([300.0], names=['rotor_1']))
    words = 'needed is rotor, there are rotor_1; did you mean rotor_1?'
    events, diagnostics = warned(bench, words)
    count = len(diagnostics)
    publish(joint_state([300.0], names=['rotor_1'], stamp=STAMP + 1))
    bench.graph.until(lambda: len(diagnostics) > count + 1, 'two more ticks')
    assert sum(words in event.msg for event in events) == 1


def test_rpm_sent_as_radians_per_second_is_asked_back(bench):
    bench.active('fan')
    spoken(bench, '/fan/joint_states', JointState)(joint_state([990.0]))
    warned(bench, '990 rad/s is 9454 rpm; did you send rpm?')


def test_a_stamp_that_is_not_set_is_told(bench):
    bench.active('fan')
    spoken(bench, '/fan/joint_states', JointState)(joint_state([300.0], stamp=0))
    warned(bench, 'header.stamp is zero')


def test_a_parameter_that_nobody_knows_is_told_with_the_near_one(bench):
    bench.active('fan', fan__rotor_jont='shaft')
    warned(bench, 'parameter fan.rotor_jont is not known; did you mean fan.rotor_joint?')


def test_standing_still_is_no_warning(bench):
    node = bench.active('fan')
    diagnostics = bench.hear('/diagnostics', DiagnosticArray)
    amplitude, _ = bench.answers()
    publish = bench.speaker()
    publish(joint_state([0.0]))
    bench.graph.until(lambda: amplitude and summary(diagnostics) == 'the machine stands still',
                      'the machine at rest')
    assert {status.level for each in diagnostics for status in each.status
            if 'stands' in status.message} == {b'\0'}
    assert np.isnan(amplitude[0].position).all()
    assert node._watches['fan'].monitor.health.counts['standing'] == 1


@pytest.mark.parametrize('parameters, words', [
    ({'speed__unit': 'krpm'}, 'fan.speed.unit: must be one of'),
    ({'speed__ratio': 0.0}, 'fan.speed: speed ratio must be'),
    ({'speed__type': 'nobodys_msgs/msg/Speed'}, 'package nobodys_msgs is not installed'),
    ({'speed__type': 'std_msgs/msg/Speed'}, 'package std_msgs has no such message'),
    ({'speed__field': 'spin'}, 'no number spin'),
    ({'speed__topic': '/t', 'speed__type': 'geometry_msgs/msg/Twist'}, 'must be named')])
def test_a_speed_that_cannot_be_told_so_keeps_the_node_from_starting(
        bench, capfd, parameters, words):
    node = bench.node('fan', **{f'fan__{name}': value for name, value in parameters.items()})
    assert not node.start()
    assert words in capfd.readouterr().err


def test_help_is_help():
    done = subprocess.run([sys.executable, '-m', 'rotorsoil_ros.node.node', '--help'],
                          capture_output=True, text=True, timeout=DEADLINE_S)
    assert (done.returncode, done.stderr) == (0, '')
    assert "<machine>.speed.unit ('rad_s')" in done.stdout
    assert 'usage: rotorsoil_node' in done.stdout


@pytest.mark.parametrize('namespace', [[], ['-r', '__ns:=/hall_2']])
def test_the_shipped_parameters_run_as_shipped(namespace, tmp_path):
    code = ('import sys, rclpy\nfrom rotorsoil_ros.node.node import RotorsoilNode\n'
            'rclpy.init(args=sys.argv)\nnode = RotorsoilNode()\nassert node.start()\n'
            'print(node.settings.machines, node.get_namespace())\nnode.release()\n')
    done = subprocess.run(
        [sys.executable, '-c', code, '--ros-args', '--params-file', 'launch/rotorsoil.yaml',
         '-p', f'cache:={tmp_path}', *namespace],
        capture_output=True, text=True, timeout=DEADLINE_S)
    assert done.returncode == 0, done.stderr
    assert "['fan', 'pump', 'fan_house'] /" in done.stdout


def test_a_node_that_cannot_start_says_so_by_an_input_error(bench):
    node = bench.node('fan', fan__speed__unit='krpm')
    with pytest.raises(InputError, match='must be one of rad_s, rpm, hz, deg_s'):
        node.settings.check()
