"""Logs of machines that shake each other: what is held against one of them is its own."""

from functools import partial

from halls import drifting, Hall, HOUSE, NARROW, SECOND
import numpy as np
import pytest

from rotorsoil_ros.bags import reader as bag_reader
from rotorsoil_ros.bags.comparison import compare, Wish
from rotorsoil_ros.bags.feed import Inputs, stand_beside
from rotorsoil_ros.bags.predict import predict
from rotorsoil_ros.case.plant.together import Plant
from rotorsoil_ros.channel import Channel
from rotorsoil_ros.compared import Reason
from rotorsoil_ros.events import Diagnostics, Level, Remark, Zoned
from rotorsoil_ros.monitor.criteria import criteria
from rotorsoil_ros.monitor.identification.case import identify_case, Wanted
from rotorsoil_ros.monitor.monitor import Monitor
from rotorsoil_ros.monitor.points import Collector
from rotorsoil_ros.monitor.rules import Judging
from rotorsoil_ros.monitor.verdict import Verdict

X, Z = (Channel('fan_1_fan_end', 'housing', axis) for axis in 'xz')
X2 = Channel('fan_2_fan_end', 'housing', 'x')
TIME = np.arange(0.0, 24.0, 1.0 / 300.0)
NEARLY_ALIKE = {'fan_1': drifting(TIME, 1480.0), 'fan_2': drifting(TIME, 1475.0, period_s=31.0)}
compare_quickly = partial(compare, wish=Wish(machine='fan_1'))


@pytest.fixture(scope='module')
def plant(cache):
    return Plant.load(HOUSE, cache_directory=cache, overrides=NARROW)


@pytest.fixture(scope='module')
def house(plant, tmp_path_factory):
    """Return the log of two fans that beat with 12 s, each with sensors of its own."""
    hall = Hall(plant, TIME, NEARLY_ALIKE, factor={'fan_2': 1.5})
    place = tmp_path_factory.mktemp('house')
    return hall.write(place / 'log.mcap', {'fan_1': [X, Z], 'fan_2': [X2]})


@pytest.fixture(scope='module')
def offline(plant, house):
    return compare_quickly(house, plant.machines['fan_1'])


def ratios(comparison, channel):
    [points] = [one for one in comparison.points if one.channel == channel]
    return points, points.measured / points.predicted


def test_beat_of_another_machine_is_no_residual(offline):
    """Ten turns hold 0 to 2.5 times what the machine itself does: it was said to fail."""
    assert offline.failures == []
    assert offline.verdict == Verdict.PASSES
    for channel in (X, Z):
        points, ratio = ratios(offline, channel)
        assert abs(ratio[0]) > 1.3  # of which nothing can be told yet
        assert points.reason[0] == Reason.NOT_APART
        assert points.used.mean() > 0.8
        np.testing.assert_allclose(ratio[points.used], 1.0, atol=0.06)
        np.testing.assert_allclose(ratio[len(ratio) // 2:], 1.0, atol=0.02)
    assert any('fan_2 ran as near as 0.0' in remark for remark in offline.remarks)


def test_zones_are_of_the_total_and_tell_whose_it_is(offline, plant):
    shaken = plant.shaken(rpm={'fan_1': 1480.0, 'fan_2': 1475.0})
    own, other = (shaken[X].share[:, 0] * shaken[X].velocity_rms[0]**2).tolist()
    found = {entry.source: entry for entry in offline.zones if entry.channel == X}
    assert found['predicted'].velocity == pytest.approx(np.sqrt(own + other), rel=0.01)
    assert found['measured'].velocity == pytest.approx(np.sqrt(own + 1.5**2 * other), rel=0.03)
    assert found['measured'].shares['fan_2'] == pytest.approx(
        1.5**2 * other / (own + 1.5**2 * other), abs=0.02)


@pytest.mark.parametrize('tick_ns', [1, 370_000_000])
def test_live_and_compare_find_the_same(offline, plant, house, tick_ns):
    monitor, collector, _ = live(house, plant.machines['fan_1'], tick_ns=tick_ns)
    assert monitor.judge.account.inside == offline.account.inside
    assert monitor.judge.account.failures() == offline.failures
    assert sorted(monitor.judge.account.worst_zones, key=str) == sorted(offline.zones, key=str)
    found = {points.channel: points for points in collector.points()}
    for points in offline.points:
        for name in ('stamp_ns', 'speed', 'amplitude', 'phase', 'predicted', 'low', 'high',
                     'reason'):
            np.testing.assert_array_equal(
                getattr(found[points.channel], name), getattr(points, name), err_msg=name)


def live(log, machine, *, tick_ns):
    """Hand a log to two monitors message by message, as a graph does; tick at any phase."""
    inputs, collector, events = Inputs.of(log, machine='fan_1'), Collector(), []
    monitor = Monitor('fan_1', machine.table, machine.case.unbalance,
                      sinks=[collector, events.append],
                      judging=Judging.of(machine.case))
    monitor.judge.take_criteria(criteria(
        machine.case, machine.model, machine.case.unbalance, machine.directory))
    [other] = stand_beside(machine, monitor, inputs)
    inlets = (inputs.inlets(monitor, lambda records: None)
              | other.inputs.inlets(other.monitor, lambda records: None))
    due_ns = None
    for source, at_ns, payload in bag_reader.messages(log, lambda topic, _: topic in inlets):
        due_ns = at_ns + tick_ns if due_ns is None else due_ns
        while at_ns >= due_ns:
            monitor.tick(due_ns, stale_after_s=3.0)
            due_ns += SECOND
        inlets[source.topic]([at_ns], [bytes(payload)])
    monitor.tick(due_ns, stale_after_s=3.0)
    monitor.finish(due_ns)
    return monitor, collector, events


@pytest.mark.parametrize('namespace', ['', '/hall_2', '/fan_house'])
def test_the_others_are_found_beside_it(plant, tmp_path, namespace):
    """In a hall or a plant; not what is told of a machine of the same name elsewhere."""
    hall = Hall(plant, TIME[:600], {name: speed[:600] for name, speed in NEARLY_ALIKE.items()})
    log = hall.write(tmp_path / 'log.mcap', {'fan_1': [X]}, namespace=namespace)
    fan, other = (plant.machines[name].case for name in ('fan_1', 'fan_2'))
    found = Inputs.of(log, machine='fan_1', of=fan).beside(other)
    assert list(found.topics) == [f'{namespace}/fan_2/joint_states']
    assert Inputs.of(hall.write(tmp_path / 'one.mcap', {'fan_1': [X]}, telling=['fan_1']),
                     of=fan).beside(other) is None


def test_a_predicted_log_is_compared_as_the_run_was(offline, plant, house, tmp_path):
    fan = plant.machines['fan_1']
    predict(fan, house, tmp_path / 'log.mcap')
    again = compare_quickly(tmp_path / 'log.mcap', fan)
    for before, points in zip(offline.points, again.points, strict=True):
        np.testing.assert_array_equal(before.amplitude, points.amplitude)


def test_the_unbalance_of_each_is_found_in_one_log(offline, plant, house):
    other = compare(house, plant.machines['fan_2'], Wish(machine='fan_2'))
    for comparison, moment in ((offline, 0.028), (other, 1.5 * 0.028)):
        found = identify_case(comparison, Wanted(planes=[f'{comparison.run.machine}_wheel']))
        assert abs(found.moment[0]) == pytest.approx(moment, rel=0.02)


def test_machine_in_zone_a_is_in_c_with_the_others(plant, tmp_path):
    """Its own velocity is in zone A; what a sensor feels is not, and whose it is is said."""
    hall = Hall(plant, TIME[:3000], {name: speed[:3000] for name, speed in NEARLY_ALIKE.items()},
                factor={'fan_1': 4.0, 'fan_2': 25.0})
    log = hall.write(tmp_path / 'log.mcap', {'fan_1': [X]})
    found = compare_quickly(log, plant.machines['fan_1'])
    [measured] = [entry for entry in found.zones if entry.source == 'measured']
    own, other = (factor * plant.shaken(rpm={name: 0.0})[X].velocity_rms[0]
                  for factor, name in ((4.0, 'fan_2'), (25.0, 'fan_1')))
    assert own < measured.limits[0]
    assert measured.zone == 'C'
    assert measured.velocity == pytest.approx(np.hypot(own, other), rel=0.05)
    assert measured.shares['fan_1'] == pytest.approx(own**2 / (own**2 + other**2), abs=0.01)


def test_machine_of_which_nobody_tells_the_speed_is_taken_at_its_rated_one(
        plant, house, tmp_path):
    hall = Hall(plant, TIME, NEARLY_ALIKE)
    log = hall.write(tmp_path / 'log.mcap', {'fan_1': [X]}, telling=['fan_1'])
    found = compare_quickly(log, plant.machines['fan_1'])
    assert 'fan_2: nobody tells its speed: taken to run at 1475 rpm' in found.remarks
    assert found.failures == []
    [points] = found.points
    assert set(points.reason) == {Reason.NOT_APART, Reason.BESIDE}
    part = np.abs(hall.vectors('fan_2', X)).mean()
    own = np.abs(points.predicted[0])
    assert points.high[0] > own + 0.99 * part
    assert points.low[0] == 0.0


def test_machines_at_one_speed_are_held_against_what_both_may_do(plant, tmp_path):
    speed = dict.fromkeys(('fan_1', 'fan_2'), NEARLY_ALIKE['fan_1'])
    verdicts = {}
    for factor in (1.0, 8.0):
        log = Hall(plant, TIME, speed, factor={'fan_2': factor}).write(
            tmp_path / f'{factor:g}.mcap', {'fan_1': [X]})
        found = compare_quickly(log, plant.machines['fan_1'])
        verdicts[factor] = found.verdict
        assert any('fan_2 ran at the same speed' in remark for remark in found.remarks)
        assert all('fan_2 may be why' in failure for failure in found.failures)
    assert verdicts == {1.0: Verdict.PASSES, 8.0: Verdict.FAILS}


def test_of_a_machine_that_falls_silent_the_total_is_a_lower_bound(plant, tmp_path):
    speed = {name: speed[:4500] for name, speed in NEARLY_ALIKE.items()}
    speed['fan_2'] = np.where(TIME[:4500] < 8.0, speed['fan_2'], 0.0)  # and comes to rest
    log = Hall(plant, TIME[:4500], speed, factor={'fan_2': 3.0}).write(
        tmp_path / 'log.mcap', {'fan_1': [X]}, until_s={'fan_2': 6.0})
    found = compare_quickly(log, plant.machines['fan_1'])
    assert any('its speed is not known beside' in remark for remark in found.remarks)
    [measured] = [entry for entry in found.zones if entry.source == 'measured']
    assert (measured.zone, measured.limits[0] > measured.velocity) == ('', True)
    assert any('no zone measured: at least' in remark for remark in found.remarks)
    _, _, events = live(log, plant.machines['fan_1'], tick_ns=1)
    zoned = [event.measured for event in events if isinstance(event, Zoned)]
    assert {X: 'A'} in zoned
    assert zoned[-1] == {}
    assert any('no zone (was A)' in event.text for event in events if isinstance(event, Remark))
    told = [part for event in events if isinstance(event, Diagnostics) for part in event.parts]
    assert told[-1].level is Level.WARN
    assert 'nothing is known of fan_2' in told[-1].summary
