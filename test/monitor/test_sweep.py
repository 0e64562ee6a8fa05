"""When a run-up or run-down is over, and what is said of it then."""

from dataclasses import fields

import numpy as np
import pytest

from rotorsoil_ros.channel import Channel
from rotorsoil_ros.compared import Compared, Reason, Weighed
from rotorsoil_ros.events import Level, Remark
from rotorsoil_ros.monitor.quasistatic import Resonance
from rotorsoil_ros.monitor.rules import Rules
from rotorsoil_ros.monitor.sweep import SweepFinder, Sweeps

SECOND = 10**9
X = Channel('a', 'housing', 'x')


def stamps(time):
    return np.rint(np.asarray(time) * SECOND).astype(np.int64)


def marks(time, speed, size):
    finder = SweepFinder()
    return [mark for at in range(0, len(time), size)
            for mark in finder.follow(stamps(time)[at:at + size], speed[at:at + size])]


TIME = np.linspace(0.0, 100.0, 1001)
UP_AND_DOWN = np.interp(TIME, [0.0, 45.0, 60.0, 100.0], [50.0, 250.0, 250.0, 50.0])


@pytest.mark.parametrize('size', [1, 13, 1001])
def test_turn_is_where_the_speed_was_highest_and_rest_is_told_once(size):
    rest, turn = marks(TIME, UP_AND_DOWN, size)
    assert not rest.is_turn
    assert 45.0 < rest.stamp_ns / SECOND < 52.0
    assert turn.is_turn
    assert turn.speed == 250.0
    assert 44.9 <= turn.stamp_ns / SECOND <= 60.0


def test_speed_that_only_trembles_never_turns():
    trembling = 100.0 + np.random.default_rng(0).normal(scale=2.0, size=1001)
    assert [mark for mark in marks(TIME, trembling, 50) if mark.is_turn] == []


def test_slow_run_up_is_one_sweep():
    time = np.linspace(0.0, 7200.0, 7201)
    found = marks(time, 20.0 + time / 50.0, 100)
    assert [mark for mark in found if mark.is_turn] == []


def amplitude(speed, natural=150.0, zeta=0.05):
    return speed**2 / np.abs(natural**2 - speed**2 + 2j * zeta * natural * speed)


class Passage:
    """A run of one channel whose peak is measured elsewhere than predicted, second by second."""

    def __init__(self, *, natural, zeta=0.05):
        self.sweeps = Sweeps('fan', Rules())
        self.sweeps.resonances = (Resonance(150.0, zeta),)
        self.natural, self.zeta = natural, zeta
        self.events = []

    def run(self, time, speed, *, every_s=1):
        rate = np.gradient(speed, time)
        for part in np.unique(time // every_s).tolist():
            rows = time // every_s == part
            column = 1.0 + time[rows, None]
            measured = amplitude(speed[rows], self.natural, self.zeta)[:, None]
            predicted = amplitude(speed[rows], 150.0, self.zeta)[:, None]
            compared = Compared('fan', stamps(time[rows]), speed[rows], (X,), measured, column,
                                0 * column, predicted.astype(complex), 0.9 * predicted,
                                1.1 * predicted, -column, column)
            self.sweeps.take(Weighed(compared, rate[rows], np.full(
                column.shape, Reason.USED, dtype=object)))
            self.events += self.sweeps.follow(
                stamps(time[rows]), speed[rows], int(stamps(time[rows])[-1]))
        return self

    def told(self):
        return [event.text for event in self.events if isinstance(event, Remark)]

    def finish(self):
        self.events += self.sweeps.finish(0)
        return self


def test_peak_that_is_still_to_come_is_not_missed_at_a_rest_before_it():
    """The phantom: at rest between the predicted peak and the measured one nothing is missing."""
    time = np.linspace(0.0, 200.0, 4001)
    speed = np.interp(time, [0.0, 60.0, 90.0, 150.0], [60.0, 175.0, 175.0, 260.0])
    passage = Passage(natural=190.0).run(time, speed)
    assert not any('was not measured' in text for text in passage.told())
    passage.finish()
    [peak] = passage.sweeps.peaks
    assert peak.predicted.speed == pytest.approx(150.0, rel=0.01)
    assert peak.measured.speed == pytest.approx(190.0, rel=0.01)
    assert any('+26' in text or '+27' in text for text in passage.told())


def test_peak_that_never_came_is_told_when_it_can_come_no_more():
    time = np.linspace(0.0, 100.0, 2001)
    speed = np.interp(time, [0.0, 80.0, 90.0, 100.0], [60.0, 260.0, 260.0, 260.0])
    passage = Passage(natural=1e4).run(time, speed)
    assert [text for text in passage.told() if 'was not measured' in text]
    passage.finish()
    assert sum('was not measured' in text for text in passage.told()) == 1


@pytest.mark.parametrize('rests_s', [0.0, 3600.0])
def test_rest_of_any_length_costs_no_peak(rests_s):
    time = np.arange(0.0, 160.0 + rests_s, 0.1)
    speed = np.interp(time, [0.0, 80.0, 80.0 + rests_s, 160.0 + rests_s],
                      [60.0, 260.0, 260.0, 60.0])
    passage = Passage(natural=140.0).run(time, speed).finish()
    assert [(peak.predicted.sweep, round(peak.deviation, 2)) for peak in passage.sweeps.peaks] == [
        (0, -0.07), (1, -0.07)]
    assert max(len(trace.speed) for trace in passage.sweeps._traces.values()) <= 8192


def test_every_point_is_let_go_once_and_marked_where_the_machine_really_resonates():
    time = np.linspace(0.0, 20.0, 2001)
    speed = np.interp(time, [0.0, 20.0], [60.0, 260.0])
    passage = Passage(natural=190.0, zeta=0.01).run(time, speed).finish()
    found = [event for event in passage.events if isinstance(event, Weighed)]
    at = np.concatenate([event.compared.stamp_ns for event in found])
    assert sorted(at.tolist()) == stamps(time).tolist()
    reason = np.concatenate([event.reason[:, 0] for event in found])
    turning = np.concatenate([event.compared.speed for event in found])
    near = np.abs(turning - 190.0) < 3.0
    assert set(reason[near]) == {Reason.NOT_QUASI_STATIC}  # p = 0.6 where it was measured
    assert Reason.USED in reason[np.abs(turning - 100.0) < 3.0]


def test_slow_passage_where_it_should_be_is_confirmed():
    time = np.linspace(0.0, 400.0, 4001)
    speed = np.interp(time, [0.0, 380.0, 400.0], [60.0, 260.0, 260.0])
    passage = Passage(natural=150.0).run(time, speed).finish()
    assert [event.level for event in passage.events if isinstance(event, Remark)] == [Level.OK]
    assert passage.sweeps.faults == []


def test_points_are_the_same_however_many_came_at_once():
    time = np.linspace(0.0, 100.0, 2001)
    speed = np.interp(time, [0.0, 52.0, 100.0], [60.0, 260.0, 60.0])  # it turns within a part
    columns = [entry.name for entry in fields(Compared)
               if entry.name not in ('machine', 'channels', 'beside')]

    def points(every_s):
        found = [event for event in Passage(natural=150.0).run(
            time, speed, every_s=every_s).finish().events if isinstance(event, Weighed)]
        order = np.argsort(np.concatenate([each.compared.stamp_ns for each in found]))
        return {name: np.concatenate([getattr(each.compared, name) for each in found])[order]
                for name in columns} | {
            'rate': np.concatenate([each.rate for each in found])[order],
            'reason': np.concatenate([each.reason for each in found])[order]}

    singly, parts = points(1), points(9)
    for name, column in singly.items():
        assert len(np.unique(column)) > 1 or name in ('deviation', 'reason')
        np.testing.assert_array_equal(column, parts[name], err_msg=name)
