"""A log with sensors on the ground is compared as it was watched, and that is reported."""

import csv
import json

import numpy as np
import pytest

import rotorsoil_ros as rs
from rotorsoil_ros.bags.feed import feed, Inputs
from rotorsoil_ros.bags.predict import predict
from rotorsoil_ros.bags.synthetic import Truth, write_synthetic
from rotorsoil_ros.bags.writer import LogFile
from rotorsoil_ros.figures.comparison import document, HEADER, rows
from rotorsoil_ros.figures.ground import ground_figure
from rotorsoil_ros.figures.report import page
from rotorsoil_ros.monitor.criteria import criteria
from rotorsoil_ros.monitor.ground.findings import GroundCollector
from rotorsoil_ros.monitor.monitor import Monitor
from rotorsoil_ros.monitor.points import Collector
from rotorsoil_ros.monitor.rules import Judging
from rotorsoil_ros.wire.cdr import encode
from rotorsoil_ros.wire.definitions import IMU, JOINT_STATE
from rotorsoil_ros.wire.messages import Records

FAN = 'config/plant_fan.yaml'
SENSORS = {'sensors': [{'name': 'yard', 'place': {'x': 8.0, 'y': 0.0}}]}
START = 55_937_500 * 32 * 10**9  # where a stretch of spectra begins
TRUTH = Truth(shear_modulus_factor=1.0, growth=0.0, noise=0.02, slowest_rpm=1470.0,
              fastest_rpm=1480.0, ramp_s=3.0, dwell_s=28.0, rate_hz=300.0, ground_mm_s_rms=0.1,
              ground_hz=20.0)
HOUSING = 'fan_end_housing_x'


@pytest.fixture(scope='module')
def fan(cache):
    return rs.load(FAN, cache_directory=cache, ground=SENSORS)


@pytest.fixture(scope='module')
def log(fan, tmp_path_factory):
    """Return a log of the fan beside a road, integrated in time."""
    path = tmp_path_factory.mktemp('road') / 'road.mcap'
    write_synthetic(path, 'fan', fan.model, fan.case.unbalance, truth=TRUTH, start_ns=START,
                    beside=fan.ground, sensors=['yard'])
    return path


@pytest.fixture(scope='module')
def found(log, fan):
    return rs.compare(log, fan)


def test_signals_integrated_in_time_are_explained_by_the_ground(found):
    """Relative to ground that moves all feels -m a: a route without a transmissibility."""
    share = {one.channel: one for one in found.ground.shares}
    for channel in (HOUSING, 'fan_end_housing_z'):
        assert share[channel].vectors > 40
        # Steps of time make the vectors of the machine itself 2 % smaller.
        assert share[channel].scatter_less < 0.4 * share[channel].scatter
    broad = {one.channel: one for one in found.ground.broadband}
    for channel in share:
        assert broad[channel].ground == pytest.approx(broad[channel].measured, rel=0.05)
        assert broad[channel].coherence > 0.95


def test_compare_says_of_the_ground_what_was_said_live(found, log, fan):
    """Message by message with other ticks: the same parts, to the bit."""
    collector, heard = Collector(), GroundCollector()
    monitor = Monitor('fan', fan.table, fan.case.unbalance, sinks=[collector, heard],
                      judging=Judging.of(fan.case), ground=fan.ground)
    monitor.judge.take_criteria(criteria(fan.case, fan.model, fan.case.unbalance, fan.directory))
    for number, _ in enumerate(feed(Inputs.of(log), monitor, {})):
        if number % 7 == 0:
            monitor.tick(monitor.judge.history.last_ns, stale_after_s=3.0)
    live = heard.findings(monitor.ground, collector.points())
    for channel, part in found.ground.parts.items():
        np.testing.assert_array_equal(part, live.parts[channel])
    assert live.shares == found.ground.shares
    assert live.broadband == found.ground.broadband
    assert sorted(live.zones, key=str) == sorted(found.ground.zones, key=str)


def test_report_numbers_and_picture_tell_it(found):
    told = json.loads(json.dumps(document(found)))['ground']
    once = told['once_per_turn'][HOUSING]
    assert once['residual_rms_without_ground'] < once['residual_rms']
    assert {entry['channel'] for entry in told['zones_without_ground']} >= {HOUSING}
    assert told['broadband'][0]['says'].startswith('coherence')
    table = [dict(zip(HEADER, row, strict=True)) for row in rows(found)]
    part = [float(row['ground_amplitude']) for row in table if row['ground_amplitude']]
    assert len(part) > 40
    top, bottom = ground_figure(found, found.ground).axes
    assert f'{HOUSING} from the ground' in [line.get_label() for line in top.get_lines()]
    assert f'{HOUSING} without it' in [line.get_label() for line in bottom.get_lines()]
    text = page(found, [], source='road.mcap')
    assert 'Ground that moves by itself' in text
    assert 'zone without the ground' in text


def test_answers_to_a_log_tell_the_part_of_the_ground_and_tables_have_it(
        log, fan, found, tmp_path):
    predict(fan, log, tmp_path / 'log.mcap')
    assert rs.export_log(tmp_path / 'log.mcap', tmp_path / 'log.csv')
    with (tmp_path / 'log.csv').open() as stream:
        told = {int(row['stamp_ns']): row for row in csv.DictReader(stream)
                if row['channel'] == HOUSING and row['ground_m']}
    [points] = [points for points in found.points if points.channel == HOUSING]
    part = dict(zip(points.stamp_ns.tolist(), found.ground.parts[points.channel], strict=True))
    known = [stamp for stamp, value in part.items() if np.isfinite(value) and stamp in told]
    assert len(known) > 40
    for quantity, values in (('m', np.abs), ('phase_rad', np.angle)):
        np.testing.assert_allclose(
            [float(told[stamp][f'ground_{quantity}']) for stamp in known],
            [values(part[stamp]) for stamp in known], rtol=1e-9)


def heard(log, machine):
    """Return a monitor that has heard a log, and judges nothing."""
    monitor = Monitor('fan', machine.table, machine.case.unbalance, sinks=[],
                      judging=Judging.of(machine.case), ground=machine.ground)
    for _ in feed(Inputs.of(log), monitor, {}):
        pass
    return monitor


def test_case_without_sensors_hears_none(log, cache):
    monitor = heard(log, rs.load(FAN, cache_directory=cache))
    assert monitor.ground is None
    assert not [channel for channel in monitor.judge.refusals if channel.startswith('yard')]


def test_sensor_of_another_name_is_told(log, cache):
    monitor = heard(log, rs.load(FAN, cache_directory=cache, ground={'sensors': [
        {**SENSORS['sensors'][0], 'name': 'road'}]}))
    assert list(monitor.ground.doubts()) == [
        'road: nothing heard; heard was yard, which is none of the case']


@pytest.mark.parametrize('speeds, grounds, heard', [
    # Of a plant below the plant, of a machine below itself.
    (['/house/fan_1', '/house/fan_2'], ['/house', '/mill'], '/house'),
    (['/fan_1', '/fan_2'], ['/fan_1', '/fan_2'], '/fan_1'),
    # Machines of a plant that are entries of their own have no name in common.
    (['/fan_1', '/fan_2'], ['/house'], '/house'),
    (['/fan_1', '/fan_2'], ['/house', '/mill'], None),
    (['/fan_1', '/fan_2'], ['/fan_2'], None)])
def test_sensors_are_heard_below_the_machine_or_its_plant(tmp_path, speeds, grounds, heard):
    path = tmp_path / 'house.mcap'
    with LogFile(path) as log:
        for topic, kind in (*((f'{one}/joint_states', JOINT_STATE) for one in speeds),
                            *((f'{one}/ground/yard/imu', IMU) for one in grounds)):
            log.write(Records(topic, kind, [START], [encode(kind, {})]))
    inputs = Inputs.of(path, machine='fan_1')
    assert set(inputs.topics) == {f'{speeds[0]}/joint_states'} | (
        {f'{heard}/ground/yard/imu'} if heard else set())
    assert not inputs.is_measured  # the ground alone is no vibration of the machine
