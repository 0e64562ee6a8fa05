"""The monitor answers what the table covers, and says what it does not."""

import math
from pathlib import Path
import subprocess
import sys

from hypothesis import given, strategies as some
import numpy as np
import pytest

from rotorsoil_ros.events import Diagnostics, Level, Model, Predicted
from rotorsoil_ros.monitor.monitor import Monitor

SECOND = 10**9
COVERED = 300.0


@pytest.fixture
def watched(machine):
    events = []
    return Monitor('m', machine.table, machine.case.unbalance, sinks=[events.append]), events


def tell(monitor, *speeds, at=SECOND):
    monitor.on_speed(at + np.arange(len(speeds)), np.array(speeds))


def of_type(events, kind):
    return [event for event in events if isinstance(event, kind)]


def test_answer_is_that_of_the_table_at_the_stamp_of_the_speed(watched, machine):
    monitor, events = watched
    tell(monitor, COVERED, 400.0)
    predicted = events[0]
    exact = machine.table.predictor(machine.case.unbalance).predict(np.array([COVERED, 400.0]))
    assert predicted.stamp_ns.tolist() == [SECOND, SECOND + 1]
    np.testing.assert_array_equal(predicted.steady.displacement, exact.displacement)
    np.testing.assert_array_equal(predicted.steady.force, exact.force)
    # It has jumped within a nanosecond: what it did at the first speed it still does.
    np.testing.assert_array_equal(predicted.prediction.displacement[0], exact.displacement[0])
    assert np.abs(predicted.prediction.displacement - exact.displacement)[1].max() > 0.0


@pytest.mark.parametrize('speed, reason', [
    (math.nan, 'nan'), (math.inf, 'infinite'), (-math.inf, 'infinite'), (-1.0, 'negative'),
    (-1e-9, 'standing'), (0.0, 'standing'), (6.28, 'below_table'), (942.48, 'above_table'),
    (1e300, 'above_table')])
def test_a_gap_is_counted_by_its_reason_and_answered_with_nan(watched, speed, reason):
    monitor, events = watched
    tell(monitor, COVERED, speed, COVERED)
    prediction = of_type(events, Predicted)[0].prediction
    assert np.isnan(prediction.displacement[1]).all()
    assert np.isnan(prediction.force[1]).all()
    assert np.isfinite(prediction.displacement[[0, 2]]).all()
    counts = monitor.health.counts
    assert (counts['received'], counts['answered'], counts[reason]) == (3, 2, 1)
    assert sum(counts.values()) == 6  # nothing else was counted


def test_the_ends_of_the_table_are_part_of_it(watched, machine):
    monitor, _ = watched
    tell(monitor, *machine.table.speed_range)
    assert monitor.health.counts['answered'] == 2


@given(speeds=some.lists(some.floats(), min_size=1, max_size=8))
def test_no_speed_raises_and_every_speed_has_one_row(machine, speeds):
    events = []
    monitor = Monitor('m', machine.table, machine.case.unbalance, sinks=[events.append])
    tell(monitor, *speeds)
    known = np.isfinite(of_type(events, Predicted)[0].prediction.displacement).all(axis=1)
    low, high = machine.table.speed_range
    assert known.tolist() == [low <= speed <= high for speed in speeds]


def test_one_by_one_gives_the_bits_of_a_batch(machine):
    speeds = np.append(np.random.default_rng(3).uniform(0.0, 1000.0, 300), math.nan)
    together, apart = [], []
    Monitor('m', machine.table, machine.case.unbalance, sinks=[together.append]).on_speed(
        np.arange(len(speeds)), speeds)
    monitor = Monitor('m', machine.table, machine.case.unbalance, sinks=[apart.append])
    for row in range(len(speeds)):
        monitor.on_speed(np.array([row]), speeds[row:row + 1])
    batch = of_type(together, Predicted)[0].prediction.displacement
    rows = [event.prediction.displacement for event in of_type(apart, Predicted)]
    assert np.concatenate(rows).tobytes() == batch.tobytes()


def test_unbalance_acts_on_the_next_speed(watched, machine):
    monitor, events = watched
    tell(monitor, COVERED)
    monitor.set_unbalance(2.0 * machine.case.unbalance)
    tell(monitor, COVERED)
    before, after = (event.prediction.displacement for event in of_type(events, Predicted))
    np.testing.assert_allclose(after, 2.0 * before, rtol=1e-15)  # one more rounding


def test_description_says_what_the_predictions_rest_on(watched, machine):
    monitor, events = watched
    monitor.begin(SECOND, machine.description('m', machine.case.unbalance))
    model = of_type(events, Model)[0]
    assert model.stamp_ns == SECOND
    assert model.description['case'] == 'paper_rotor'
    assert model.description['channels'] == list(machine.table.channels)
    assert model.description['unbalance']['disc_1'] == {'moment_kg_m': 1e-5, 'phase_rad': 0.0}
    assert model.description['tables']['response'] == machine.table.key


def levels(events):
    return [event.level for event in of_type(events, Diagnostics)]


def test_a_machine_is_stale_until_it_speaks_and_again_when_it_falls_silent(watched, machine):
    monitor, events = watched
    monitor.begin(0, {})
    monitor.tick(SECOND, stale_after_s=3.0)
    tell(monitor, COVERED)                        # news: it speaks
    monitor.tick(2 * SECOND, stale_after_s=3.0)
    monitor.tick(5 * SECOND, stale_after_s=3.0)   # silent for 3 s: not longer than allowed
    monitor.tick(6 * SECOND, stale_after_s=3.0)
    tell(monitor, COVERED)
    assert levels(events) == [Level.STALE, Level.OK, Level.OK, Level.OK, Level.STALE, Level.OK]
    silent = of_type(events, Diagnostics)[-2]
    assert silent.values['silent_s'] == 4.0
    assert silent.summary == 'no speed for 4.0 s'


def test_a_gap_warns_at_once_and_only_once_until_a_tick_without_one(watched):
    monitor, events = watched
    tell(monitor, COVERED, at=0)
    for step in range(5):
        tell(monitor, 2000.0, COVERED, at=step)
    assert levels(events) == [Level.OK, Level.WARN]
    monitor.tick(SECOND, stale_after_s=3.0)
    assert of_type(events, Diagnostics)[-1].summary == (
        'without an answer: 5 above table; 2000 rad/s is 19099 rpm; did you send rpm?')
    tell(monitor, COVERED)
    monitor.tick(2 * SECOND, stale_after_s=3.0)
    assert levels(events) == [Level.OK, Level.WARN, Level.WARN, Level.OK]


def test_an_overspeed_is_not_taken_for_another_unit(watched):
    monitor, events = watched
    tell(monitor, COVERED, 1000.0)
    monitor.tick(SECOND, stale_after_s=3.0)
    assert of_type(events, Diagnostics)[-1].summary == 'without an answer: 1 above table'


def test_degrees_per_second_are_asked_back_and_what_fits_no_unit_is_not(watched):
    monitor, _ = watched
    tell(monitor, 17_188.0)  # 300 rad/s
    assert monitor.health.complaints() == ['17188 rad/s is 164133 rpm; did you send deg/s?']
    tell(monitor, 1e9)
    assert monitor.health.complaints() == []


def test_rate_counts_the_speeds_of_the_last_period(watched):
    monitor, events = watched
    monitor.begin(0, {})
    tell(monitor, *[COVERED] * 50)
    monitor.tick(2 * SECOND, stale_after_s=3.0)
    values = of_type(events, Diagnostics)[-1].values
    assert values['rate_hz'] == 25.0
    assert values['speed_rad_s'] == COVERED
    assert values['speed_rpm'] == pytest.approx(2864.788976)  # 300 * 60 / (2 pi)


def test_a_clock_that_jumps_back_does_not_break_the_health(watched):
    monitor, events = watched
    monitor.begin(10 * SECOND, {})
    tell(monitor, COVERED)
    for now in (11, 5, 6):
        monitor.tick(now * SECOND, stale_after_s=3.0)
    assert of_type(events, Diagnostics)[-1].values['silent_s'] == 1.0


def test_the_monitor_needs_neither_ros_nor_mcap_nor_rerun():
    blocked = "import sys; sys.modules.update(dict.fromkeys(('rclpy', 'mcap', 'rerun')))"
    subprocess.run(
        [sys.executable, '-c', f'{blocked}; import rotorsoil_ros.monitor.monitor'],
        check=True, cwd=Path(__file__).parents[2])
