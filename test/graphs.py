"""A ROS graph of the tests' own, a node in it, and who talks to it."""

import os
import subprocess
import sys
import time

from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetState
import numpy as np
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import JointState

from rotorsoil_ros.domain import own_domain
from rotorsoil_ros.node.node import RotorsoilNode
from rotorsoil_ros.wire.messages import moduli, phases

STAMP = 1_700_000_000_000_000_001
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


def joint_state(velocity, *, stamp=STAMP, names=('rotor',)):
    message = JointState(name=list(names), velocity=list(velocity))
    message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp, 10**9)
    return message


def stamp_ns(message):
    return message.header.stamp.sec * 10**9 + message.header.stamp.nanosec


class Bench:
    """A node under test, and a probe that talks and listens to it."""

    def __init__(self, graph, cache, case_file):
        self.graph = graph
        self.case_file = str(case_file)
        self.probe = graph.probe
        self.cache = str(cache)

    def node(self, *machines, **parameters):
        """Create a node; a keyword a__b sets the parameter a.b."""
        values = {'cache': self.cache, 'speed_depth': 1000, 'log.rerun': False}
        values |= {'machines': list(machines)} if machines else {}
        values |= {f'{machine}.case': self.case_file for machine in machines}
        cli = parameters.pop('cli', [])
        values |= {name.replace('__', '.'): value for name, value in parameters.items()}
        overrides = [Parameter(name, value=value) for name, value in values.items()]
        return self.graph.add(RotorsoilNode(
            context=self.graph.context, parameter_overrides=overrides, cli_args=cli))

    def active(self, *machines, **parameters):
        node = self.node(*machines, **parameters)
        assert node.start()
        return node

    def hear(self, topic, kind=JointState, profile=1000):
        """Collect the messages of a topic."""
        return self.graph.hear(topic, kind, profile)

    def answers(self, machine='fan'):
        """Collect amplitudes and phases of a machine."""
        return tuple(self.hear(f'/rotorsoil/{machine}/{name}') for name in ('amplitude', 'phase'))

    def speaker(self, topic='/fan/joint_states', kind=JointState, listeners=('amplitude', 'phase'),
                reliability=ReliabilityPolicy.RELIABLE):
        """Return what publishes, once everybody who matters has found each other."""
        machine = topic.removeprefix('/').rpartition('/')[0].removesuffix('/rotor')
        publisher = self.graph.speaker(topic, kind, reliability)
        self.graph.until(lambda: all(
            self.probe.count_publishers(f'/rotorsoil/{machine}/{name}') for name in listeners),
            'discovery')
        self.settle()
        return publisher.publish

    def settle(self):
        self.graph.settle()

    def ask(self, kind, name, request):
        return self.graph.ask(kind, name, request)

    def call(self, kind, name, request):
        return self.graph.call(kind, name, request)

    def change(self, transition):
        return self.call(ChangeState, '/rotorsoil/change_state', ChangeState.Request(
            transition=Transition(id=transition))).success

    def state(self):
        return self.call(GetState, '/rotorsoil/get_state', GetState.Request()).current_state.label


class Processes:
    """Nodes in processes of their own."""

    def __init__(self, case_file, cache):
        self.parameters = ['machines:=[fan]', f'fan.case:={case_file}', f'cache:={cache}']
        self.running = []

    def start(self, *parameters, until='active'):
        """Start a node; return it and what it told until a line held something, or it ended."""
        command = [sys.executable, '-m', 'rotorsoil_ros.node.node', '--ros-args']
        for argument in (*self.parameters, *parameters):
            command += ['-p', argument]
        process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True,
                                   env={**os.environ, 'ROS_DOMAIN_ID': str(own_domain())})
        self.running.append(process)
        told = []
        for line in process.stderr:
            told.append(line)
            if until in line:
                break
        return process, told

    def close(self):
        for process in self.running:
            process.kill()
            process.communicate()


def speak(graph, until):
    """Publish speeds of the fan at 100 Hz until something holds; return their stamps [ns]."""
    publish = graph.probe.create_publisher(JointState, '/fan/joint_states', 1000).publish
    said = []

    def tell():
        message = JointState(name=['rotor'], velocity=[300.0])
        said.append(time.time_ns())
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(said[-1], 10**9)
        publish(message)

    graph.until(lambda: graph.probe.count_subscribers('/fan/joint_states'), 'discovery')
    timer = graph.probe.create_timer(0.01, tell)
    graph.until(lambda: until(said), 'enough speeds')
    graph.probe.destroy_timer(timer)
    return said


def exact(machine, speed, unbalance=None):
    unbalance = machine.case.unbalance if unbalance is None else unbalance
    return machine.table.predictor(unbalance).predict(np.array([speed]))


def assert_answers(amplitude, phase, prediction):
    for message, (outer, velocity) in (
            (amplitude, moduli(prediction)), (phase, phases(prediction))):
        np.testing.assert_array_equal(message.position, outer[0, 0])
        np.testing.assert_array_equal(message.velocity, velocity[0])
        np.testing.assert_array_equal(message.effort, outer[0, 1])
