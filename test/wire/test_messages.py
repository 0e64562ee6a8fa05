"""What is published and logged is what the plain mapping would say, message by message."""

from dataclasses import replace
import json
import math

from diagnostic_msgs.msg import DiagnosticArray
import numpy as np
import pytest
from rclpy.serialization import deserialize_message
from rosbags.typesys import get_typestore, Stores
from sensor_msgs.msg import JointState
from std_msgs.msg import String

from rotorsoil_ros.channel import Channel
from rotorsoil_ros.events import Diagnostics, Level, Measured, Model, Predicted
from rotorsoil_ros.prediction import Prediction
from rotorsoil_ros.wire.messages import (
    diagnostic_array,
    Encoder,
    JointStateWriter,
    moduli,
    phases,
    Topics,
)

NAMES = [Channel.parse(name) for name in ('a_x', 'bearing_1_housing_z', 'c')]
STAMP = 1_700_000_000_000_000_001  # a stamp in seconds as a double would lose the 1 ns


def random_prediction(count, channels):
    random = np.random.default_rng(count)

    def amplitude():
        return random.normal(size=(count, channels)) + 1j * random.normal(size=(count, channels))

    force = amplitude()
    force[:, -1] = complex(np.nan, np.nan)
    return Prediction(np.linspace(1.0, 900.0, count), 1e-6 * amplitude(), force)


def event(count):
    return Predicted('m', STAMP + np.arange(count), random_prediction(count, len(NAMES)))


def rows_of(prediction, rows):
    return Prediction(*(getattr(prediction, name)[rows]
                        for name in ('speed', 'displacement', 'force')))


def test_template_bytes_say_what_the_plain_message_says():
    values = np.random.default_rng(1).normal(size=(5, 3, len(NAMES)))
    values[2, 1, 0] = np.nan
    stamps = [STAMP + step for step in range(5)]
    store = get_typestore(Stores.ROS2_JAZZY)
    for stamp, row, cdr in zip(
            stamps, values, JointStateWriter(NAMES).write(stamps, values), strict=True):
        plain = JointState(name=NAMES, **{
            name: row[number].tolist() for number, name in enumerate(
                ('position', 'velocity', 'effort'))})
        plain.header.stamp.sec, plain.header.stamp.nanosec = divmod(stamp, 10**9)
        got = deserialize_message(cdr, JointState)
        assert got.header == plain.header
        assert got.name == plain.name
        foreign = store.deserialize_cdr(cdr, 'sensor_msgs/msg/JointState')
        assert foreign.header.stamp.nanosec == stamp % 10**9
        for name in ('position', 'velocity', 'effort'):
            np.testing.assert_array_equal(getattr(got, name), getattr(plain, name))
            np.testing.assert_array_equal(getattr(foreign, name), getattr(plain, name))


def test_the_same_message_has_the_same_bytes_in_every_process():
    blank = JointStateWriter(NAMES).write([0], np.zeros((1, 3, len(NAMES))))[0]
    used = b'\0\1' + b''.join(name.encode() for name in NAMES)
    # Counts and lengths are 1 to 20; whatever else stood in the padding would show.
    assert set(blank) <= set(used) | set(range(21))


def test_amplitude_and_phase_carry_displacement_velocity_and_force():
    told = event(4)
    amplitude, phase, velocity = Encoder('m', NAMES, Topics.of('', 'm')).encode(told)
    assert amplitude.topic == '/rotorsoil/m/amplitude'
    assert phase.topic == '/rotorsoil/m/phase'
    assert list(amplitude.log_time_ns) == told.stamp_ns.tolist()
    assert velocity.topic == '/rotorsoil/m/velocity_rms'
    vectors = {'position': told.prediction.displacement, 'velocity': told.prediction.velocity,
               'effort': told.prediction.force}
    for row in range(4):
        size = deserialize_message(amplitude.payloads[row], JointState)
        angle = deserialize_message(phase.payloads[row], JointState)
        assert size.header.stamp.nanosec == (STAMP + row) % 10**9
        assert angle.name == NAMES
        assert size.header.frame_id == angle.header.frame_id == 'm'
        housing = deserialize_message(velocity.payloads[row], JointState)
        assert (housing.name, housing.header) == (NAMES[1:2], size.header)
        assert housing.velocity[0] == pytest.approx(
            abs(told.prediction.velocity[row, 1]) / math.sqrt(2.0), rel=1e-15)
        assert np.isnan([*housing.position, *housing.effort]).all()
        for name, vector in vectors.items():  # 1e-15: |X| and arg X are rounded once more
            np.testing.assert_allclose(getattr(size, name), np.abs(vector[row]), rtol=1e-15)
            np.testing.assert_allclose(
                getattr(angle, name), np.angle(vector[row]), rtol=1e-15, atol=1e-15)


@pytest.mark.parametrize('wanted', [True, False])
def test_what_is_done_at_constant_speed_is_said_where_it_differs_and_somebody_hears_it(wanted):
    encoder = Encoder('m', NAMES, Topics.of('', 'm'), wants_steady=lambda: wanted)
    steady, rows = event(3), np.array([0, 2])
    rings = Prediction.of_parts(steady.prediction.speed, 2.0 * steady.prediction.parts,
                                (rows, np.ones((2, 2, len(NAMES)))))
    said = {records.topic: records for records in encoder.encode(
        replace(steady, prediction=rings, steady=steady.prediction))}
    assert list(said) == [
        f'/rotorsoil/m/{name}' for name in ('amplitude', 'phase', 'velocity_rms', *(
            ('steady/amplitude', 'steady/phase') if wanted else ()))]
    amplitude, phase, _ = encoder.encode(steady)
    for plain in (amplitude, phase) if wanted else ():
        found = said[plain.topic.replace('/m/', '/m/steady/')]
        assert found.log_time_ns == [plain.log_time_ns[row] for row in rows]
        assert found.payloads == [plain.payloads[row] for row in rows]
    assert len(list(encoder.encode(replace(steady, steady=steady.prediction)))) == 3


@pytest.mark.parametrize('count', [2, 7, 64, 1000])
def test_one_speed_gives_the_bits_that_many_give(count):
    encoder = Encoder('m', NAMES, Topics.of('', 'm'))
    many = [records.payloads for records in encoder.encode(event(count))]
    prediction = random_prediction(count, len(NAMES))
    for row in range(count):
        one = encoder.encode(Predicted(
            'm', np.array([STAMP + row]), rows_of(prediction, slice(row, row + 1))))
        assert [records.payloads for records in one] == [[found[row]] for found in many]


@pytest.mark.parametrize('width', [1, 5, 8, 18, 31])
def test_moduli_and_phases_do_not_depend_on_the_neighbours(width):
    many = random_prediction(100, width)
    for fill in (moduli, phases):
        together = fill(many)
        for row in range(100):
            for one, all_of_them in zip(
                    fill(rows_of(many, slice(row, row + 1))), together, strict=True):
                assert one.tobytes() == all_of_them[row].tobytes()


def test_a_machine_without_housings_tells_no_velocity_of_them():
    encoder = Encoder('m', NAMES[:1], Topics.of('', 'm'))
    told = Predicted('m', np.array([STAMP]), random_prediction(1, 1))
    assert [records.topic for records in encoder.encode(told)] == [
        '/rotorsoil/m/amplitude', '/rotorsoil/m/phase']


def test_a_measurement_needs_no_message_because_it_came_as_one():
    told = Measured('m', 'phase', np.array([STAMP]), ('a_x',), *np.zeros((2, 1, 1)))
    assert list(Encoder('m', NAMES, Topics.of('', 'm')).encode(told)) == []


def test_diagnostics_are_plain_decimals_with_a_level_of_one_byte():
    told = Diagnostics('fan', STAMP, Level.STALE, 'no speed', {
        'received': 12_000_000, 'rate_hz': 1e-7, 'speed_rad_s': 1e17, 'silent_s': math.nan})
    message = deserialize_message(diagnostic_array(told), DiagnosticArray)
    status = message.status[0]
    assert status.level == b'\x03'
    assert (status.hardware_id, status.message) == ('fan', 'no speed')
    assert message.header.stamp.nanosec == 1
    assert {entry.key: entry.value for entry in status.values} == {
        'received': '12000000', 'rate_hz': '0.000000', 'speed_rad_s': '100000000000000000.000000',
        'silent_s': 'nan'}


def test_model_is_json_and_latched():
    told = Model('m', STAMP, {'case': 'paper_rotor', 'channels': NAMES})
    records, = Encoder('m', NAMES, Topics.of('/plant', 'm')).encode(told)
    assert records.topic == '/plant/rotorsoil/m/model'
    assert records.latched
    assert json.loads(deserialize_message(records.payloads[0], String).data) == told.description
