"""Ground that moves is taken off what is measured, and what is not known of it is said."""

from dataclasses import replace

from grounds import felt, RPM, RUNNING, RUNNING_HZ, shares, START, traffic, watched, YARD
import numpy as np
import pytest

import rotorsoil_ros as rs
from rotorsoil_ros.channel import Channel
from rotorsoil_ros.events import Diagnostics, Grounded, Level, Measured, Samples
from rotorsoil_ros.monitor.beside.companions import Companion
from rotorsoil_ros.monitor.ground.account import GroundShare
from rotorsoil_ros.monitor.monitor import Monitor
from rotorsoil_ros.monitor.rules import Judging
from rotorsoil_ros.monitor.vectors.history import History
from rotorsoil_ros.units import rpm_to_rad_s

HOUSING = 'fan_end_housing_x'
ROAD = {'name': 'road', 'place': {'x': -6.0, 'y': 3.0}}


@pytest.fixture(scope='session')
def fan(cache):
    return rs.load('config/plant_fan.yaml', cache_directory=cache,
                   ground={'sensors': [YARD], 'of': 'block'})


@pytest.fixture(scope='module')
def busy(fan):
    """Return what is felt for a minute and a half beside a road."""
    return felt(fan, traffic(90.0))


@pytest.fixture(scope='module')
def told(fan, busy):
    """Return monitor and events of these."""
    events = []
    return watched(fan, busy, events=events), events


def line(machine, size):
    """Return ground that moves along x at the speed of the rotor alone, by a size [m]."""
    time = np.arange(30 * 250) / 250.0
    return (1j * RUNNING * size * np.exp(1j * RUNNING * time)).real


def test_vectors_scatter_less_without_what_the_ground_did(told):
    """The note's check: own 1.13 mm/s rms at 24.7 Hz, ground 0.1 mm/s rms around 18 Hz."""
    found = shares(told[0])[HOUSING]
    assert found.vectors > 30
    # What leaks from beside the speed is multiplied by the ratio at the speed: a share stays.
    assert found.scatter_less < 0.25 * found.scatter
    assert found.residual_less < 0.25 * found.residual
    velocity = RUNNING * found.scatter / np.sqrt(2.0)
    assert 1.5e-5 < velocity < 6e-5  # 0.03 mm/s rms of 60 turns


def test_ground_that_moves_once_per_turn_is_found_to_the_last_digit(fan):
    """With no unbalance and with it: what is left is the prediction, and noise."""
    size = 2e-6 * np.exp(0.7j)
    found = shares(watched(fan, felt(fan, line(fan, size), noise=1e-6), turns=25.0))[HOUSING]
    column = fan.model.channels.index(HOUSING)
    ratio = fan.transmissibility(hz=RUNNING_HZ, rpm=RPM).ratio[0, column, 0]
    assert found.part == pytest.approx(RUNNING * abs(ratio * size) / np.sqrt(2.0), rel=1e-3)
    assert found.residual == pytest.approx(abs(ratio * size), rel=1e-3)
    assert found.residual_less < 2e-3 * found.residual
    assert not found.doubt


def test_sensor_that_feels_only_the_machine_tells_of_no_ground(fan):
    still = np.zeros(30 * 250)
    monitor = watched(fan, felt(fan, still, noise=1e-6), turns=25.0)
    assert shares(monitor)[HOUSING].share < 1e-4
    assert monitor.ground.own_share['yard'] == pytest.approx(1.0, abs=1e-3)
    [doubt] = monitor.ground.doubts()
    assert 'is the machine itself' in doubt


def test_unbalance_that_is_not_that_of_the_case_is_not_told_as_ground(fan):
    """It does more to the sensor than is taken off, but that is not what the housings show."""
    monitor = watched(fan, felt(fan, np.zeros(30 * 250), noise=1e-6, own=2.0), turns=25.0)
    found = shares(monitor)['fan_end_housing_z']
    assert found.share > 0.1
    assert found.residual_less > 0.7 * found.residual
    assert 'the machine is not as unbalanced as its case says' in found.doubt


@pytest.fixture(scope='module')
def house(cache):
    return rs.Plant.load('config/fan_house.yaml', cache_directory=cache, overrides=[
        'ground.sensors=[{name: yard, place: {x: 14.0, y: 0.0}}]'])


@pytest.mark.parametrize('is_known', [True, False])
def test_what_a_machine_beside_it_does_to_the_sensor_is_not_told_as_ground(house, is_known):
    """Still ground, and two fans of 1480 and 1440 rpm that 25 turns tell apart."""
    time, events, felt_there = np.arange(20 * 250) / 250.0, [], 0.0
    speeds, told = rpm_to_rad_s(np.array([1480.0, 1440.0])), (History(), History())
    for machine, speed in zip(house.machines.values(), speeds, strict=True):
        answer = machine.model.unbalance_response(np.array([speed]), machine.case.unbalance)
        own = machine.ground.own(np.array([speed]), answer.force)[0, 0]
        felt_there = felt_there + (-speed**2 * own * np.exp(1j * speed * time)[:, None]).real
    first, second = house.machines.values()
    monitor = Monitor('fan_1', first.table, first.case.unbalance, sinks=[events.append],
                      judging=Judging.of(first.case, turns=25.0), ground=first.ground)
    if is_known:
        monitor.stand_beside([Companion('fan_2', float(speeds[1]), lambda: second.table.predictor(
            second.case.unbalance), lambda: told[1])])
    stamps = START + np.rint(1e9 * time).astype(np.int64)
    for start in range(0, len(time), 250):
        part, few = slice(start, start + 250), slice(start, start + 250, 5)
        for speed, tell in ((speeds[0], monitor.on_speed), (speeds[1], told[1].add)):
            tell(stamps[few], np.full(50, speed), np.remainder(speed * time[few], 2.0 * np.pi))
        monitor.on_ground('yard', Samples('fan_1', Channel('yard', '', 'z'), stamps[part],
                                          felt_there[part, 2], False, felt_there[part]))
        monitor.tick(int(stamps[part][-1]), stale_after_s=3.0)
    motion = np.concatenate([event.motion for event in events if isinstance(event, Grounded)])
    assert len(motion) > 10
    own = first.ground.own(speeds[:1], first.table.predictor(first.case.unbalance).predict(
        speeds[:1]).force)[0, 0]
    share = np.median(np.linalg.norm(motion, axis=1)) / np.linalg.norm(own)
    assert share < 1e-3 if is_known else share > 0.1


def test_zone_without_the_ground_is_that_of_the_machine(fan):
    """A ground that shakes the housings at 12 mm/s rms: zone D, not of the machine."""
    column = fan.model.channels.index(HOUSING)
    ratio = abs(fan.transmissibility(hz=RUNNING_HZ, rpm=RPM).ratio[0, column, 0])
    size = np.sqrt(2.0) * 12e-3 / RUNNING / ratio
    monitor = watched(fan, felt(fan, line(fan, size), noise=1e-6), turns=25.0)
    measured = monitor.judge.account.zones.measured[HOUSING]
    without = monitor.ground.account.zones.measured[HOUSING]
    assert (measured.zone, without.zone) == ('D', 'A')
    own = fan.response(rpm=RPM)[HOUSING].velocity_mm_s_rms()[0, 0]
    assert 1e3 * without.velocity == pytest.approx(own, rel=0.01)


def test_every_channel_gets_its_part_at_the_stamp_of_its_vector(told, fan):
    monitor, events = told
    parts = [event for event in events if isinstance(event, Grounded)]
    stamps = np.concatenate([event.stamp_ns for event in parts])
    assert len(np.unique(stamps)) == len(stamps) == shares(monitor)[HOUSING].vectors
    first = parts[0]
    ratio, force = fan.model.ground_response(np.array([RUNNING]), speed=RUNNING)
    np.testing.assert_allclose(first.prediction.displacement[0], ratio[0] @ first.motion[0],
                               rtol=1e-5, atol=1e-5 * abs(first.motion[0]).max())
    np.testing.assert_allclose(first.prediction.force[0], force[0] @ first.motion[0], rtol=1e-4,
                               atol=1e-6 * np.nanmax(abs(force)) * abs(first.motion[0]).max())


def test_share_and_residuals_are_in_the_diagnostics(told):
    [part] = [part for part in [event for event in told[1] if isinstance(event, Diagnostics)][
        -1].parts if part.name == 'ground']
    share = shares(told[0])[HOUSING]
    assert part.values[f'{HOUSING}_ground_mm_s_rms'] == pytest.approx(1e3 * share.part, rel=0.1)
    assert part.values[f'{HOUSING}_residual_um'] > (
        2.0 * part.values[f'{HOUSING}_residual_without_ground_um'])
    assert part.values[f'{HOUSING}_zone_without_ground'] == 'A'
    assert part.values[f'{HOUSING}_yard_broadband_ground_mm_s_rms'] == pytest.approx(
        part.values[f'{HOUSING}_yard_broadband_coherent_mm_s_rms'], rel=0.05)
    assert part.values[f'{HOUSING}_yard_broadband_coherence'] > 0.95


def test_two_sensors_are_averaged_and_their_disagreement_is_told(cache):
    fan = rs.load('config/plant_fan.yaml', cache_directory=cache, ground={'sensors': [YARD, ROAD]})
    found = felt(fan, line(fan, 2e-6), noise=1e-6)
    alike = watched(fan, found, turns=25.0, sensors=('yard', 'road'))
    assert alike.ground.disagreement < 1e-3
    assert not list(alike.ground.doubts())
    opposite = replace(found, sensors=np.stack([found.sensors[0], -found.sensors[1]]))
    opposite.sensors[1, 2] += 2.0 * 9.80665
    apart = watched(fan, opposite, turns=25.0, sensors=('yard', 'road'))
    assert any('differ by' in doubt for doubt in apart.ground.doubts())


def test_sensor_that_is_clipped_is_told_and_gives_nothing(cache, busy):
    fan = rs.load('config/plant_fan.yaml', cache_directory=cache, ground={'sensors': [
        {**YARD, 'range': '9.9 m/s^2'}]})
    events = []
    monitor = watched(fan, replace(busy, time=busy.time[:2000]), events=events, turns=25.0)
    assert not shares(monitor)
    assert not [event for event in events if isinstance(event, Grounded)]
    [doubt] = monitor.ground.doubts()
    assert 'z: clipped at' in doubt


def test_nothing_heard_is_told(fan, busy):
    events = []
    quiet = replace(busy, sensors=busy.sensors[:0], time=busy.time[:2000])
    watched(fan, quiet, sensors=(), events=events)
    part = [event for event in events if isinstance(event, Diagnostics)][-1].parts[-1]
    assert (part.name, part.level) == ('ground', Level.WARN)
    assert part.summary.startswith('yard: nothing heard')


def test_sensor_that_falls_silent_is_told(fan, busy):
    monitor = watched(fan, replace(busy, time=busy.time[:1000]), turns=25.0)
    last_ns = monitor.ground.sensors['yard'].last_ns
    for since_s, level in ((2, Level.OK), (5, Level.WARN)):
        [said] = [event for event in monitor.ground.tick(
            last_ns + since_s * 10**9, monitor._predictor, stale_after_s=3.0)
            if isinstance(event, Diagnostics)]
        assert said.level >= level
        assert said.summary.startswith('yard: silent') is (since_s > 3)


def test_full_seconds_stand_in_where_housings_fall_silent(fan, busy):
    """And give way again: a part of the ground is told all the time, once for each stretch."""
    events, half = [], 10.0
    gone = {channel: np.where(busy.time < half, values, np.nan)
            for channel, values in busy.housings.items()}
    watched(fan, replace(busy, time=busy.time[:5000], housings=gone), turns=25.0, events=events)
    stamps = np.concatenate([event.stamp_ns for event in events if isinstance(event, Grounded)])
    since = (stamps - START) / 1e9
    assert len(since[since < half - 2.0]) > 5
    late = since[since > half + 1.0]
    assert len(late) > 5
    np.testing.assert_allclose(late, np.round(late), atol=1e-9)


def test_without_a_phase_reference_nothing_is_subtracted(fan, busy):
    monitor = watched(fan, replace(busy, time=busy.time[:5000]), angle=False)
    assert not shares(monitor)
    [doubt] = monitor.ground.doubts()
    assert 'no phase reference' in doubt


def test_what_the_machine_does_to_the_ground_is_not_taken_as_none(cache, busy):
    fan = rs.load('config/plant_fan.yaml', cache_directory=cache, ground={'sensors': [YARD]},
                  foundations=[{'name': 'block', 'half_width': 1.0, 'half_length': 1.5,
                                'centre_y': 0.2, 'height': 1.2, 'density': 2400.0,
                                'embedment': 0.5}])
    assert fan.ground.around is None
    monitor = watched(fan, replace(busy, time=busy.time[:5000]))
    assert not shares(monitor)
    [doubt] = monitor.ground.doubts()
    assert doubt.endswith('blocks stand below the surface')


def test_vectors_of_another_system_are_taken_for_the_sensor(fan):
    """Its channels are heard beside those of the machine, and are not judged as such."""
    monitor = watched(fan, replace(felt(fan, np.zeros(20 * 250), noise=1e-6), sensors=np.zeros(
        (0, 3, 1)), housings={}), sensors=())
    size, at = 3e-6 * np.exp(1.1j), START + 10 * 10**9
    column = fan.model.channels.index(HOUSING)
    ratio, force = fan.model.ground_response(np.array([RUNNING]), speed=RUNNING)
    steady = fan.model.unbalance_response(np.array([RUNNING]), fan.case.unbalance)
    sensor = fan.ground.own(np.array([RUNNING]), steady.force)[0, 0] + (
        np.eye(3) + fan.ground.around.point_motion(np.array([RUNNING]))[0]
        @ force[0, fan.ground.loads])[:, 0] * size
    vectors = np.append(sensor, steady.displacement[0, column] + ratio[0, column, 0] * size)
    channels = (*(Channel('yard', '', axis) for axis in 'xyz'), fan.model.channels[column])
    for quantity, values in (('amplitude', np.abs(vectors)), ('phase', np.angle(vectors))):
        monitor.on_measured(Measured('fan', quantity, np.array([at]), channels, values[None],
                                     np.full((1, 4), np.nan)))
    monitor.tick(START + 21 * 10**9, stale_after_s=3.0)
    monitor.finish(START + 22 * 10**9)
    found = shares(monitor)[HOUSING]
    assert found.residual == pytest.approx(abs(ratio[0, column, 0] * size), rel=1e-3)
    assert found.residual_less < 1e-3 * found.residual
    assert not monitor.judge.account.band.channels or set(
        monitor.judge.account.band.channels) == {HOUSING}


def test_share_of_no_vector_is_not_known():
    nothing = np.array([complex(np.nan, np.nan)])
    found = GroundShare.of(Channel('block', '', 'x'), rpm_to_rad_s(np.array([1480.0])),
                           np.array([1e-6 + 0j]), np.array([1e-6 + 0j]), nothing)
    assert found.vectors == 0
    assert np.isnan([found.part, found.share, found.residual, found.residual_less]).all()
