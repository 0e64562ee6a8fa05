"""A ROS graph of the tests' own, a node in it, and who talks to it."""

import os
import subprocess
import sys
import time
import warnings

from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetState
import numpy as np
import rclpy
from rclpy.context import Context
from rclpy.experimental import EventsExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import JointState

from rotorsoil_ros.node.node import RotorsoilNode
from rotorsoil_ros.wire.messages import moduli, phases

with warnings.catch_warnings():
    warnings.simplefilter('ignore', DeprecationWarning)  # lark still imports sre_parse
    import rosidl_generator_py  # noqa: F401 - rclpy imports it with the first message

# For what hangs: nothing here is about how fast something is, benchmarks are.
DEADLINE_S = 600.0
# Its ports stay below those that the system hands out.
DOMAIN = 1 + os.getpid() % 100
STAMP = 1_700_000_000_000_000_001
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


def joint_state(velocity, *, stamp=STAMP, names=('rotor',)):
    message = JointState(name=list(names), velocity=list(velocity))
    message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp, 10**9)
    return message


def stamp_ns(message):
    return message.header.stamp.sec * 10**9 + message.header.stamp.nanosec


class Graph:
    """A ROS context on a domain of this process, a probe node in it, and who spins them."""

    def __init__(self):
        self.context = Context()
        rclpy.init(args=[], context=self.context, domain_id=DOMAIN)
        self.executor = EventsExecutor(context=self.context)
        self.nodes = []
        self.probe = self.add(Node('probe', context=self.context))

    def add(self, node):
        self.nodes.append(node)
        self.executor.add_node(node)
        return node

    def use(self, executor):
        """Have everybody spun by another executor."""
        self.executor.shutdown()
        self.executor = executor(context=self.context)
        for node in self.nodes:
            self.executor.add_node(node)

    def until(self, holds, what='what was awaited'):
        """Spin until something holds; fail at the deadline."""
        deadline = time.monotonic() + DEADLINE_S
        while not holds():
            assert time.monotonic() < deadline, f'{what} did not happen in {DEADLINE_S} s'
            self.executor.spin_once(timeout_sec=0.05)

    def close(self):
        for node in reversed(self.nodes):
            node.destroy_node()
        self.executor.shutdown()
        self.context.try_shutdown()


class Bench:
    """A node under test, and a probe that talks and listens to it."""

    def __init__(self, graph, cache, case_file):
        self.graph = graph
        self.case_file = str(case_file)
        self.probe = graph.probe
        self.cache = str(cache)
        self.heard = {}

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
        heard = self.heard.setdefault(topic, [])
        self.probe.create_subscription(kind, topic, heard.append, profile)
        return heard

    def answers(self, machine='fan'):
        """Collect amplitudes and phases of a machine."""
        return tuple(self.hear(f'/rotorsoil/{machine}/{name}') for name in ('amplitude', 'phase'))

    def speaker(self, topic='/fan/joint_states', kind=JointState, listeners=('amplitude', 'phase'),
                reliability=ReliabilityPolicy.RELIABLE):
        """Return what publishes, once everybody who matters has found each other."""
        publisher = self.probe.create_publisher(
            kind, topic, QoSProfile(depth=1000, reliability=reliability))
        machine = topic.split('/')[1]
        self.graph.until(lambda: publisher.get_subscription_count() and all(
            self.probe.count_publishers(f'/rotorsoil/{machine}/{name}') for name in listeners),
            'discovery')
        self.settle()
        return publisher.publish

    def settle(self):
        """Wait until the probe's subscriptions are matched on both sides."""
        for node in self.graph.nodes[1:]:
            for publisher in node.publishers:
                if publisher.topic_name in self.heard:
                    self.graph.until(publisher.get_subscription_count, 'matching')

    def ask(self, kind, name, request):
        """Call a service; return the future of its answer."""
        client = self.probe.create_client(kind, name)
        self.graph.until(client.service_is_ready, name)
        return client.call_async(request)

    def call(self, kind, name, request):
        future = self.ask(kind, name, request)
        self.graph.until(future.done, name)
        return future.result()

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
                                   env={**os.environ, 'ROS_DOMAIN_ID': str(DOMAIN)})
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
