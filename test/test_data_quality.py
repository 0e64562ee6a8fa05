"""What verbs and log say of raw samples that may not become vectors."""

import json
from pathlib import Path

import numpy as np
import pytest

from rotorsoil_ros.bags import reader as bag_reader
from rotorsoil_ros.bags.comparison import compare
from rotorsoil_ros.bags.predict import predict
from rotorsoil_ros.bags.writer import LogFile
from rotorsoil_ros.case.machine import Machine
from rotorsoil_ros.cli import main
from rotorsoil_ros.errors import InputError
from rotorsoil_ros.monitor.rules import Judging
from rotorsoil_ros.monitor.verdict import Verdict
from rotorsoil_ros.wire.cdr import Layout
from rotorsoil_ros.wire.definitions import IMU
from rotorsoil_ros.wire.messages import Records

from records import read_all, STORE

FAN = Path('config/plant_fan.yaml')
BUNCHED = Path(__file__).parent / 'cases' / 'imu_bunched_stamps' / 'imu_bunched.mcap'
X = 'drive_end_housing_x'
WHY = 'stamps come in packets of about 16: when each sample was taken is not told'


@pytest.fixture(scope='module')
def fan(tmp_path_factory):
    return Machine.load(FAN, cache_directory=tmp_path_factory.mktemp('tables'))


def test_bunched_stamps_give_no_zone_and_no_verdict(fan, tmp_path, capsys):
    out = tmp_path / 'c'
    assert main(['compare', str(BUNCHED), str(FAN), '-o', str(out),
                 '--cache', str(fan.directory)]) == 1
    said = capsys.readouterr().out
    assert f'note: {X}: 14 of 14 stretches refused: {WHY}' in said
    assert said.splitlines()[-1].split() == ['verdict', 'undecided']
    content = json.loads((out / 'comparison.json').read_text())
    assert any(WHY in line for line in content['remarks'])
    assert not [entry for entry in content['zones'] if entry['source'] == 'measured']
    assert WHY in (out / 'report.html').read_text()
    assert not list(out.glob('*.png'))  # there is nothing to draw


def test_bunched_stamps_are_a_warning_that_says_why(fan, tmp_path):
    predict(fan, BUNCHED, tmp_path / 'o.mcap')
    told = [STORE.deserialize_cdr(payload, 'diagnostic_msgs/msg/DiagnosticArray').status
            for topic, _, payload in read_all(tmp_path / 'o.mcap') if topic == '/diagnostics']
    vibration = [status for each in told for status in each if 'vibration' in status.name]
    assert vibration
    for status in vibration:
        assert status.level == 1
        assert WHY in status.message
        assert 'measured_zone' not in ' '.join(value.key for value in status.values)
    values = {value.key: value.value for value in vibration[-1].values}
    assert values[f'{X}_refused'] == values[f'{X}_refused_packets'] == '14'
    assert values[f'{X}_refused_because'] == WHY
    topics = {topic for topic, _, _ in read_all(tmp_path / 'o.mcap')}
    assert not {topic for topic in topics if topic.endswith(('residual', 'demodulated/amplitude'))}


def test_bunched_stamps_that_the_case_states_are_amplitudes(fan):
    """The truth that was put in: 1.14 mm/s rms; nobody knows the phase."""
    found = compare(BUNCHED, fan.case.changed(['sensors.stamps=packets']),
                    cache_directory=fan.directory)
    [zone] = [entry for entry in found.zones if entry.source == 'measured']
    assert zone.zone == 'A'
    assert 1e3 * zone.velocity == pytest.approx(1.14, abs=0.02)
    [points] = found.points
    assert len(points.stamp_ns) >= 13
    np.testing.assert_allclose(points.amplitude, 10.37e-6, rtol=0.03)
    assert np.isnan(points.phase).all()


def messages(rows):
    """Return the bytes of every message, those between its numbers too."""
    return [bytes(row) for row in rows.view(np.uint8).reshape(len(rows), -1)]


def restamped(target, *, change=None, say=None):
    """Write the case with evenly spaced stamps, and the samples changed."""
    first, number = None, 0
    with LogFile(target) as log:
        for batch in bag_reader.batches(BUNCHED, lambda *_: True, at_most=500):
            if not batch.topic.endswith('imu'):
                log.write(batch)
                continue
            layout = Layout.of(IMU, batch.payloads[0])
            rows = np.frombuffer(bytearray(b''.join(batch.payloads)), dtype=layout.dtype)
            stamps = rows['header.stamp.sec'].astype(np.int64) * 10**9 + rows[
                'header.stamp.nanosec']
            first = stamps[0] if first is None else first
            stamps = first + np.arange(number, number + len(rows)) * 1_250_000
            number += len(rows)
            rows['header.stamp.sec'], rows['header.stamp.nanosec'] = np.divmod(stamps, 10**9)
            if change is not None:
                change(rows['linear_acceleration'])
            if say is not None:
                say(rows)
            log.write(Records(batch.topic, IMU, stamps.tolist(), messages(rows)))
    return target


def test_the_same_samples_evenly_stamped_are_in_zone_a(fan, tmp_path):
    """The truth that was put in: 10.37 um, 1.14 mm/s rms."""
    found = compare(restamped(tmp_path / 'even.mcap'), FAN, cache_directory=fan.directory)
    [zone] = [entry for entry in found.zones if entry.source == 'measured']
    assert zone.zone == 'A'
    assert 1e3 * zone.velocity == pytest.approx(1.14, abs=0.01)
    assert found.verdict == Verdict.PASSES
    assert not [line for line in found.remarks if 'refused' in line]


def clip(felt):
    felt[:, 0] = felt[:, 0].clip(-0.06, 0.06)  # of 0.11 m/s^2


def freeze(felt):
    felt[:, 0] = 0.1


def hold(felt):
    felt[:] = felt[np.arange(len(felt)) // 5 * 5]


@pytest.mark.parametrize('change, why', [(clip, 'clipped at'), (freeze, 'sensor stands still'),
                                         (hold, 'values are held')])
def test_values_of_no_motion_are_no_verdict(fan, tmp_path, change, why):
    log = restamped(tmp_path / 'log.mcap', change=change)
    found = compare(log, FAN, cache_directory=fan.directory)
    assert found.verdict == Verdict.UNDECIDED
    assert not [entry for entry in found.zones if entry.source == 'measured']
    assert any(f'stretches refused: {why}' in line for line in found.remarks)


def turn(quaternion, covariance=0.0):
    """Return what makes a sensor say that it is turned."""
    def say(rows):
        rows['orientation'] = quaternion
        rows['orientation_covariance'][:, 0] = covariance
    return say


@pytest.mark.parametrize('quaternion, covariance, is_kept', [
    ((0.0, 0.0, 0.0, 0.0), 0.0, True), ((0.0, 0.0, 0.0, 1.0), 0.0, True),
    ((0.0, 0.0, 0.0, -1.0), 0.0, True), ((0.0, 0.0, 0.0393, 0.9992), 0.0, True),  # 4.5 degrees
    ((0.0, 0.0, 0.7071, 0.7071), -1.0, True), ((0.0, 0.0, 0.7071, 0.7071), 0.0, False),
    ((0.0523, 0.0, 0.0, 0.9986), 0.01, False)])  # 6 degrees
def test_sensor_that_says_it_is_turned_is_refused(fan, tmp_path, quaternion, covariance, is_kept):
    log = restamped(tmp_path / 'log.mcap', say=turn(quaternion, covariance))
    found = compare(log, FAN, cache_directory=fan.directory)
    refused = [line for line in found.remarks if 'the orientation of the sensor turns' in line]
    assert bool(refused) != is_kept
    assert (found.verdict == Verdict.PASSES) == is_kept
    if not is_kept:
        assert ('by 90 deg' if quaternion[3] < 0.8 else 'by 6 deg') in refused[0]


def in_g(felt):
    felt[:] = (felt + np.array([0.0, 0.0, 9.80665]) * (np.abs(felt[:, 2:]) < 5.0)) / 9.80665


def test_samples_in_g_are_refused_until_the_case_says_so(fan, tmp_path):
    log = restamped(tmp_path / 'log.mcap', change=in_g)
    found = compare(log, FAN, cache_directory=fan.directory)
    assert found.verdict == Verdict.UNDECIDED
    assert not [entry for entry in found.zones if entry.source == 'measured']
    assert any('stretches refused: looks like g, not m/s^2' in line for line in found.remarks)
    found = compare(log, fan.case.changed(['sensors.units=g']), cache_directory=fan.directory)
    [zone] = [entry for entry in found.zones if entry.source == 'measured']
    assert 1e3 * zone.velocity == pytest.approx(1.14, abs=0.01)
    assert found.verdict == Verdict.PASSES


def test_range_of_one_sensor_refuses_what_reaches_it(fan, tmp_path):
    log = restamped(tmp_path / 'log.mcap')
    for channel, verdict in ((X, Verdict.UNDECIDED), ('fan_end_housing_x', Verdict.PASSES)):
        case = fan.case.changed([f'sensors.channels.{channel}.range=0.08 m/s^2'])
        found = compare(log, case, cache_directory=fan.directory)
        assert found.verdict == verdict
        assert any('refused: clipped at' in line for line in found.remarks) == (channel == X)


def lie(felt):
    felt[:, 0], felt[:, 2] = felt[:, 2].copy(), -felt[:, 0]


def test_orientation_that_the_case_uses_gives_the_truth(fan, tmp_path):
    """A quarter turn about y brings z to x and x to -z: the truth is that of the log as it was."""
    log = restamped(tmp_path / 'log.mcap', change=lie, say=turn((0.0, -0.5**0.5, 0.0, 0.5**0.5)))
    found = compare(log, FAN, cache_directory=fan.directory)
    assert found.verdict == Verdict.UNDECIDED
    found = compare(log, fan.case.changed(['sensors.orientation=use']),
                    cache_directory=fan.directory)
    [zone] = [entry for entry in found.zones if entry.source == 'measured']
    assert 1e3 * zone.velocity == pytest.approx(1.14, abs=0.01)
    assert found.verdict == Verdict.PASSES


@pytest.mark.parametrize('setting, said', [
    ('sensors.range=-5', 'sensors.range: must be > 0 m/s^2, got -5'),
    ('sensors.range=5 kg', "sensors.range: must be a finite number in m/s^2, got '5 kg', which is "
                           'none of that'),
    ('sensors.units=mm', "sensors.units: must be 'm/s^2' or 'g', got 'mm'"),
    ('sensors.orientation=true', "sensors.orientation: must be 'use', got True"),
    ('sensors.stamps=late', "sensors.stamps: must be 'packets', got 'late'"),
    ('sensors.channels=[1]', 'sensors.channels: must hold keys and values, got [1]'),
    ('sensors.channels={X: {}}', 'sensors.channels.X: must be a name of at most 64 small letters, '
     "digits and _, first a letter, got 'X'"),
    ('sensors.rnge=5', 'sensors.rnge: is not a known key; did you mean range?'),
    ('sensors.channels.drive_end_hosing_x.range=5', 'sensors.channels.drive_end_hosing_x: is '
     'not a channel of this machine; did you mean drive_end_housing_x?'),
    (f'sensors.channels.{X}.range=0', f'sensors.channels.{X}.range: must be > 0 m/s^2, got 0')])
def test_wrong_words_of_sensors_are_one_line(fan, setting, said):
    with pytest.raises(InputError) as refused:
        fan.case.changed([setting])
    assert str(refused.value) == f'{FAN}: {said}'


def test_what_one_sensor_does_not_say_the_others_do(fan):
    case = fan.case.changed(['sensors={units: g, range: 16 g}',
                             f'sensors.channels.{X}.range=50 m/s^2'])
    one, other = case.sensors.of(X), case.sensors.of('fan_end_housing_x')
    assert (one.units, other.units) == ('g', 'g')
    assert one.range == 50.0
    assert other.range == pytest.approx(16.0 * 9.80665, rel=1e-12)


def test_filter_that_the_case_states_reaches_the_judge(fan):
    assert not Judging.of(fan.case).sensors.of(X).has_filter
    for key in ('anti_alias', 'sensors.anti_alias', f'sensors.channels.{X}.anti_alias'):
        assert Judging.of(fan.case.changed([f'{key}=true'])).sensors.of(X).has_filter
