"""The node compares over real DDS: residual, band, zones and events reach graph and log."""

import math
from pathlib import Path

from diagnostic_msgs.msg import DiagnosticArray
import numpy as np
import pytest
from rcl_interfaces.msg import Log
from rclpy.parameter import Parameter
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rosbags.highlevel import AnyReader
from sensor_msgs.msg import Imu, JointState

from rotorsoil_ros.case.machine import Machine
from rotorsoil_ros.monitor.criteria import criteria
from rotorsoil_ros.node.node import RotorsoilNode

FAN = Path('config/plant_fan.yaml')
CHANNEL = 'drive_end_housing_x'
SPEED = 120.0


@pytest.fixture(scope='module')
def fan(tmp_path_factory):
    cache = tmp_path_factory.mktemp('tables')
    machine = Machine.load(FAN, cache_directory=cache)
    criteria(machine.case, machine.model, machine.case.unbalance, cache)
    return machine


class Plant:
    """A node that watches a fan, and what measures the fan."""

    def __init__(self, graph, fan, **parameters):
        self.graph, self.fan, self.heard = graph, fan, {}
        values = {'cache': str(fan.directory), 'machines': ['fan'], 'fan.case': str(FAN),
                  'speed_depth': 1000, 'speed_reliability': 'reliable', 'log.rerun': False}
        values |= {name.replace('__', '.'): value for name, value in parameters.items()}
        self.node = graph.add(RotorsoilNode(
            context=graph.context,
            parameter_overrides=[Parameter(name, value=value) for name, value in values.items()]))
        assert self.node.start()
        self.stamp = 0.0
        self.publishers = {}

    def hear(self, topic, kind=JointState):
        heard = self.heard[topic] = []
        self.graph.probe.create_subscription(kind, topic, heard.append, 1000)
        self.graph.until(lambda: self.graph.probe.count_publishers(topic), topic)
        for publisher in self.node.publishers:
            if publisher.topic_name == topic:
                self.graph.until(publisher.get_subscription_count, topic)
        return heard

    def send(self, name, message):
        topic, kind = f'/fan/{name}', type(message)
        if topic not in self.publishers:
            self.publishers[topic] = self.graph.probe.create_publisher(
                kind, topic, QoSProfile(depth=1000, reliability=ReliabilityPolicy.RELIABLE))
            self.graph.until(self.publishers[topic].get_subscription_count, topic)
        message.header.stamp.sec, rest = divmod(round(self.stamp * 1e9), 10**9)
        message.header.stamp.nanosec = rest
        self.publishers[topic].publish(message)

    def turns(self, speed=SPEED, angle=0.0):
        self.send('joint_states', JointState(name=['rotor'], position=[angle], velocity=[speed]))

    def measures(self, vector, channel=CHANNEL):
        self.send('measured/amplitude', JointState(name=[channel], position=[abs(vector)]))
        self.send('measured/phase', JointState(name=[channel],
                                               position=[float(np.angle(vector))]))

    def catch_up(self):
        """Take as many events as one round of messages makes, or more are queued than taken."""
        for _ in range(40):
            self.graph.executor.spin_once(timeout_sec=0.002)

    def expected(self, speed=SPEED):
        row = self.fan.table.predictor(self.fan.case.unbalance).predict(np.array([speed]))
        return row.displacement[0, self.fan.table.channels.index(CHANNEL)]


@pytest.fixture
def plant(graph, fan):
    plant = Plant(graph, fan)
    yield plant
    plant.node.release()


def test_residual_is_published_at_the_stamp_of_the_measurement(plant):
    heard = plant.hear('/rotorsoil/fan/residual')
    for number in range(5):
        plant.stamp = 10.0 + 0.1 * number
        plant.measures(50e-6j)
        plant.turns()
    plant.graph.until(lambda: len(heard) == 5, 'residuals')
    for number, message in enumerate(heard):
        stamp = message.header.stamp
        assert stamp.sec * 10**9 + stamp.nanosec == round((10.0 + 0.1 * number) * 1e9)
        assert list(message.name) == [CHANNEL]
        wanted = abs(50e-6j - plant.expected())
        assert message.position[0] == pytest.approx(wanted, rel=1e-12)
        assert message.velocity[0] == pytest.approx(SPEED * wanted, rel=1e-12)
        assert math.isnan(message.effort[0])


def test_band_holds_the_amplitude_of_every_channel(plant):
    heard = {name: plant.hear(f'/rotorsoil/fan/{name}')
             for name in ('amplitude_low', 'amplitude', 'amplitude_high')}
    for number in range(10):
        plant.stamp = 10.0 + 0.1 * number
        plant.turns(100.0 + number)
    plant.graph.until(lambda: all(len(found) == 10 for found in heard.values()), 'the band')
    for low, middle, high in zip(*heard.values(), strict=True):
        assert low.header.stamp == middle.header.stamp == high.header.stamp
        assert list(low.name) == list(high.name) == list(plant.fan.table.channels)
        assert np.all(np.array(low.position) <= 1.001 * np.array(middle.position))
        assert np.all(np.array(high.position) >= 0.999 * np.array(middle.position))
        assert np.any(np.array(low.position) < 0.9 * np.array(high.position))
        np.testing.assert_array_less(0.0, high.velocity)


def test_zone_d_is_an_error_on_diagnostics_and_an_event(plant):
    diagnostics = plant.hear('/diagnostics', DiagnosticArray)
    events = plant.hear('/rotorsoil/fan/events', Log)
    vector = np.sqrt(2.0) * 20e-3 / SPEED  # 20 mm/s rms

    def is_told():
        plant.stamp += 0.1
        plant.turns()
        plant.measures(vector)
        plant.catch_up()
        return any(status.level == b'\x02' for message in diagnostics
                   for status in message.status)

    plant.graph.until(is_told, 'the error')
    status = next(status for message in diagnostics for status in message.status
                  if status.level == b'\x02')
    assert status.name == 'rotorsoil: fan vibration'
    values = {pair.key: pair.value for pair in status.values}
    assert float(values[f'{CHANNEL}_measured_mm_s_rms']) == pytest.approx(20.0)
    assert values[f'{CHANNEL}_measured_zone'] == 'D'
    assert [message.status[0].name for message in diagnostics][-1] == 'rotorsoil: fan'
    plant.graph.until(lambda: events, 'the event')
    assert f'{CHANNEL}: zone D' in events[0].msg
    assert events[0].name == 'rotorsoil.fan'


def test_raw_samples_are_heard_as_soon_as_a_sensor_publishes_them(plant):
    heard = {name: plant.hear(f'/rotorsoil/fan/demodulated/{name}')
             for name in ('amplitude', 'phase')}
    residuals = plant.hear('/rotorsoil/fan/residual')
    truth = 30e-6 * np.exp(1.1j)
    plant.stamp = 10.0
    for number in range(2500):
        time = 1e-3 * number
        plant.stamp = 10.0 + time
        if number % 20 == 0:
            plant.turns(angle=float(np.mod(SPEED * time, 2.0 * np.pi)))
        sample = Imu()
        sample.linear_acceleration.x = float(
            (-SPEED**2 * truth * np.exp(1j * SPEED * time)).real)
        sample.linear_acceleration.z = 9.81
        plant.send(f'measured/{CHANNEL}/imu', sample)
        if number % 10 == 0:
            plant.graph.executor.spin_once(timeout_sec=0.0)
    plant.graph.until(lambda: len(residuals) >= 3, 'vectors out of samples')
    for amplitude, phase in zip(heard['amplitude'], heard['phase'], strict=True):
        assert list(amplitude.name) == [CHANNEL, f'{CHANNEL}_2x']
        assert amplitude.position[0] == pytest.approx(abs(truth), rel=1e-6)
        assert amplitude.position[1] < 1e-9
        assert phase.position[0] == pytest.approx(1.1, abs=1e-6)
    assert residuals[0].position[0] == pytest.approx(abs(truth - plant.expected()), rel=1e-6)


def test_everything_that_is_compared_is_in_the_log(graph, fan, tmp_path):
    plant = Plant(graph, fan, log__directory=str(tmp_path))
    heard = plant.hear('/rotorsoil/fan/residual')
    plant.stamp = 10.0
    plant.turns()
    plant.measures(50e-6)
    graph.until(lambda: heard, 'the residual')
    plant.node.release()
    with AnyReader([tmp_path / 'run']) as reader:
        counts = {connection.topic: connection.msgcount for connection in reader.connections}
        [logged] = [reader.deserialize(data, connection.msgtype)
                    for connection, _, data in reader.messages()
                    if connection.topic == '/rotorsoil/fan/residual']
    assert logged.position[0] == heard[0].position[0]
    assert counts['/fan/measured/amplitude'] == counts['/fan/measured/phase'] == 1
    assert counts['/rotorsoil/fan/amplitude_low'] == counts['/rotorsoil/fan/amplitude_high'] == 1


def test_band_of_a_new_unbalance_is_computed_aside_and_then_used(plant):
    heard = plant.hear('/rotorsoil/fan/amplitude_high')
    moment = 10.0 * abs(plant.fan.case.unbalance[1])
    disc = plant.fan.table.planes[1]
    plant.node.set_parameters([Parameter(f'fan.unbalance.{disc}.moment', value=moment)])

    def has_band():
        plant.stamp += 0.2
        plant.turns()
        plant.catch_up()
        return heard

    plant.graph.until(has_band, 'the band of the new unbalance')
    row = plant.fan.table.channels.index('wheel_x')
    assert heard[0].position[row] > 5.0 * abs(plant.fan.table.predictor(
        plant.fan.case.unbalance).predict(np.array([SPEED])).displacement[0, row])
