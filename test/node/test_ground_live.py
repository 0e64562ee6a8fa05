"""Sensors on the ground, live: the ground's part of every channel, beside the machine's own."""

from pathlib import Path

from diagnostic_msgs.msg import DiagnosticArray
import numpy as np
import pytest
from sensor_msgs.msg import Imu, JointState
from std_srvs.srv import Trigger
import yaml

import rotorsoil_ros as rs
from rotorsoil_ros.case import document

from graphs import Bench, joint_state, STAMP, stamp_ns

CONFIG = Path(__file__).parents[2] / 'config'
SENSORS = {'sensors': [{'name': 'yard', 'place': {'x': 9.0, 'y': 0.0}}]}
SPEED, RATE_HZ = 150.0, 250
FIRST = (STAMP // 10**9) * 10**9


@pytest.fixture
def on_ground(tmp_path):
    """Return what writes a shipped case with sensors on its ground, or with none."""
    def write(name, sensors=SENSORS):
        case = tmp_path / f'{name}.yaml'
        # No band is asked for: few soils for it.
        case.write_text(yaml.safe_dump({
            **document.read(CONFIG / f'{name}.yaml'), 'uncertainty': {'samples': 3},
            **({'ground': sensors} if sensors else {})}))
        (tmp_path / 'plant_fan.yaml').exists() or (tmp_path / 'plant_fan.yaml').write_text(
            (CONFIG / 'plant_fan.yaml').read_text())
        return case
    return write


@pytest.fixture
def benches(graph, cache):
    """Return what makes a bench for a case, and releases its nodes in the end."""
    yield lambda path: Bench(graph, cache, path)
    for node in graph.nodes[1:]:
        node.release()


def felt(monitor, size, count):
    """Return what the sensor feels while the ground moves by a size along x, (n, 3) [m/s^2]."""
    speed, ground = np.array([SPEED]), monitor.ground.moving
    own = ground.own(speed, monitor._predictor.predict(speed).force)[0, 0]
    _, force = ground.table.at(speed)
    moved = own + size * (np.eye(3) + ground.beside(speed)[0] @ force[0, ground.loads])[:3, 0]
    time = np.arange(count) / RATE_HZ
    gravity = np.array([0.0, 0.0, 9.80665])
    return (-SPEED**2 * moved * np.exp(1j * SPEED * time)[:, None]).real + gravity


def speak(bench, monitor, size, *, topic, speeds, count=500):
    """Send speeds with their angle, and samples of the sensor, as they would come."""
    sensor = bench.graph.speaker(topic, Imu)
    tell = bench.speaker(speeds)
    bench.graph.until(lambda: bench.probe.count_subscribers(topic), 'who hears the sensor')
    bench.settle()
    for number, row in enumerate(felt(monitor, size, count).tolist()):
        stamp = FIRST + round(number * 1e9 / RATE_HZ)
        if number % 5 == 0:
            told = joint_state([SPEED], stamp=stamp)
            told.position = [float(np.mod(SPEED * number / RATE_HZ, 2.0 * np.pi))]
            tell(told)
        sample = Imu()
        sample.header.stamp.sec, sample.header.stamp.nanosec = divmod(stamp, 10**9)
        sample.linear_acceleration.x, sample.linear_acceleration.y = row[:2]
        sample.linear_acceleration.z = row[2]
        sensor.publish(sample)
        if number % 10 == 0:
            bench.graph.executor.spin_once(timeout_sec=0.0)


def test_part_of_the_ground_is_told_for_every_channel(benches, cache, on_ground, capfd):
    """Without a sensor on the machine: over the turns about each full second."""
    path = on_ground('plant_fan')
    machine, bench = rs.load(path, cache_directory=cache), benches(path)
    monitor = bench.active('fan')._watches['fan'].monitor
    amplitude, phase = (bench.hear(f'/rotorsoil/fan/ground/{name}') for name in (
        'amplitude', 'phase'))
    said = bench.hear('/diagnostics', DiagnosticArray)
    assert ('fan: hears sensors on the ground on /fan/ground/yard/imu (sensor_msgs/msg/Imu)'
            in capfd.readouterr().err)
    size = 2e-6 * np.exp(0.4j)
    speak(bench, monitor, size, topic='/fan/ground/yard/imu', speeds='/fan/joint_states')
    bench.graph.until(lambda: amplitude and phase, 'the part of the ground')
    ratio, force = machine.model.ground_response(np.array([SPEED]), speed=SPEED)
    part = size * ratio[0, :, 0]
    assert list(amplitude[0].name) == list(machine.table.channels)
    assert stamp_ns(amplitude[0]) == stamp_ns(phase[0]) == FIRST + 10**9
    largest = np.abs(part).max()
    got = np.array(amplitude[0].position) * np.exp(1j * np.array(phase[0].position))
    np.testing.assert_allclose(got, part, atol=2e-3 * largest)
    np.testing.assert_allclose(amplitude[0].velocity, SPEED * np.abs(got), rtol=1e-9)
    np.testing.assert_allclose(amplitude[0].effort, np.abs(size * force[0, :, 0]),
                               atol=2e-3 * np.nanmax(np.abs(size * force)))

    def told():
        return [status for array in said for status in array.status
                if status.name == 'rotorsoil: fan ground'
                and any(value.key == 'yard_own_share' for value in status.values)]

    bench.graph.until(told, 'what is said of the ground')


def test_machine_without_sensors_there_neither_tells_nor_hears_them(bench):
    bench.active('fan')
    bench.speaker()  # by then the graph knows the node
    assert bench.probe.count_publishers('/rotorsoil/fan/amplitude')
    assert not bench.probe.count_publishers('/rotorsoil/fan/ground/amplitude')


def test_sensors_come_with_another_case(benches, on_ground):
    """Reloaded with sensors where it had none: their topics are heard and told from then on."""
    path = on_ground('plant_fan', None)
    bench = benches(path)
    monitor = bench.active('fan')._watches['fan'].monitor
    on_ground('plant_fan')
    answer = bench.call(Trigger, '/rotorsoil/fan/reload', Trigger.Request())
    assert answer.success, answer.message
    bench.graph.until(lambda: monitor.ground, 'the other case')
    amplitude = bench.hear('/rotorsoil/fan/ground/amplitude')
    speak(bench, monitor, 2e-6, topic='/fan/ground/yard/imu', speeds='/fan/joint_states')
    bench.graph.until(lambda: amplitude, 'the part of the ground')


def test_machines_of_a_plant_hear_one_sensor_each_at_its_own_frequency(benches, on_ground):
    path = on_ground('fan_house')
    bench = benches(path)
    node = bench.active('fan_house')
    monitor = node._watches['fan_house/fan_1'].monitor
    parts = [bench.hear(f'/rotorsoil/fan_house/{name}/ground/amplitude') for name in (
        'fan_1', 'fan_2')]
    speak(bench, monitor, 2e-6, topic='/fan_house/ground/yard/imu',
          speeds='/fan_house/fan_1/joint_states')
    bench.graph.until(lambda: parts[0], 'the part of the ground at the frequency of fan_1')
    ratio, _ = monitor.ground.moving.table.at(np.array([SPEED]))
    got = np.array(parts[0][0].position)
    np.testing.assert_allclose(got, np.abs(2e-6 * ratio[0, :, 0]), atol=2e-3 * got.max())
    assert not parts[1]  # nothing is known of its speed
    assert isinstance(parts[0][0], JointState)
    heard = [name for name, _ in node.get_subscriber_names_and_types_by_node(
        node.get_name(), '/')]
    assert '/fan_house/fan_1/ground/yard/imu' not in heard
