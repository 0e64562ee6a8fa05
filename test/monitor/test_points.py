"""What is kept of a run, and figures of known errors."""

import math

import numpy as np
import pytest

from rotorsoil_ros.channel import Channel
from rotorsoil_ros.compared import Compared, Reason, Weighed
from rotorsoil_ros.errors import RotorSoilError
from rotorsoil_ros.events import Predicted
from rotorsoil_ros.monitor.inside import BandShare
from rotorsoil_ros.monitor.points import ChannelPoints, Collector, statistics
from rotorsoil_ros.monitor.rules import Matching, Rules
from rotorsoil_ros.prediction import Prediction

SECOND = 1_000_000_000
X, Z = (Channel('a', 'housing', axis) for axis in 'xz')


def points(measured, predicted, *, low=None, high=None, turn=None, phase=True):
    """Return points of one channel, all of which are used."""
    measured, predicted = np.asarray(measured, dtype=complex), np.asarray(predicted, dtype=complex)
    nothing = np.full(len(measured), np.nan)
    return ChannelPoints(
        X, np.arange(len(measured)) * SECOND, np.full(len(measured), 50.0), np.abs(measured),
        np.angle(measured) if phase else nothing, predicted,
        nothing if low is None else np.asarray(low),
        nothing if high is None else np.asarray(high),
        nothing if turn is None else -np.asarray(turn),
        nothing if turn is None else np.asarray(turn),
        np.full(len(measured), Reason.USED, dtype=object))


def weighed(stamps, amplitude, *, low, high, reason=Reason.USED, channels=(X,)):
    """Return weighed points, the same in all channels."""
    shape = len(stamps), len(channels)
    column = np.ones(shape)
    compared = Compared(
        'fan', np.asarray(stamps), np.full(len(stamps), 50.0), channels,
        np.asarray(amplitude)[:, None] * column, 0.0 * column, 0.0 * column,
        column.astype(complex), low * column, high * column, -column, column)
    return Weighed(compared, np.zeros(len(stamps)), np.full(shape, reason, dtype=object))


def test_figures_of_known_errors():
    predicted = np.array([1.0, 2.0, 3.0, 4.0])
    measured = (predicted + np.array([0.1, 0.3, 0.1, 0.3])) * np.exp(0.2j)
    found = statistics(points(measured, predicted), margin=0.0, inside={X: 0.25})
    assert found.bias == pytest.approx(0.2)
    assert found.scatter == pytest.approx(0.1)
    assert found.ratio == pytest.approx(np.median(np.abs(measured) / predicted))
    assert found.phase_bias == pytest.approx(0.2)
    assert found.phase_scatter == pytest.approx(0.0, abs=1e-7)
    left, spread = np.abs(measured - predicted) ** 2, np.abs(measured - measured.mean()) ** 2
    assert found.r_squared == pytest.approx(1.0 - left.sum() / spread.sum())
    assert found.inside == 0.25


def test_amplitude_only_channel_has_figures_of_its_amplitudes():
    given = points([1.0, 2.0], [1j, -2.0], phase=False)
    found = statistics(given, margin=0.1, inside={})
    assert not given.has_phase
    assert found.r_squared == 1.0
    assert math.isnan(found.phase_bias)
    assert math.isnan(found.inside)


def test_channel_without_a_used_point_has_no_figures():
    given = points([1.0], [1.0])
    given.reason[:] = Reason.NO_SPEED
    assert math.isnan(statistics(given, margin=0.1, inside={}).bias)
    assert given.excluded == {'no speed reported near its stamp': 1}


def test_phases_count_inside_their_band_and_a_little_beside_it():
    vector = np.full(6, 1e-5) * np.exp(3.0j)
    off = np.array([0.0, 0.19, -0.29, 0.31, -0.31, 2.0 * np.pi - 0.1])
    given = points(vector * np.exp(1j * off), vector, turn=np.full(6, 0.2))
    assert statistics(given, margin=0.1, inside={}).phase_inside == pytest.approx(4 / 6)
    blind = points(vector, vector, turn=np.full(6, 0.2), phase=False)
    assert np.isnan(statistics(blind, margin=0.1, inside={}).phase_inside)


def test_share_counts_points_inside_the_band_and_its_margin():
    share = BandShare(Rules(amplitude_margin=0.1))
    share.count(weighed([1, 2, 3, 4], [0.95, 0.85, 2.15, 2.3], low=1.0, high=2.0))
    assert share.of_run() == {X: 0.5}  # 0.95 > 0.9, 2.15 < 2.2
    share.count(weighed([5, 6], [9.0, 9.0], low=1.0, high=2.0, reason=Reason.NOT_QUASI_STATIC))
    share.count(weighed([7, 8], [9.0, 9.0], low=np.nan, high=np.nan))
    assert share.of_run() == {X: 0.5}


def test_share_of_the_last_seconds_forgets():
    share = BandShare(Rules())
    share.see(weighed(np.arange(10) * SECOND, np.full(10, 9.0), low=1.0, high=2.0))
    assert list(share.settle()) == [(X, True)]
    share.see(weighed(np.arange(10, 30) * SECOND, np.full(20, 1.5), low=1.0, high=2.0))
    assert list(share.settle()) == [(X, False)]
    assert share.recent(X) == 1.0


def test_run_is_kept_in_the_order_of_time():
    kept = Collector()
    for stamps, speed in (([5, 7], [50.0, 51.0]), ([6, 7], [52.0, 53.0])):
        nothing = np.zeros((2, 1), dtype=complex)
        kept(Predicted('fan', np.array(stamps), Prediction(np.array(speed), nothing, nothing)))
    stamps, speed = kept.speeds()
    assert stamps.tolist() == [5, 6, 7]
    assert speed.tolist() == [50.0, 52.0, 51.0]
    for stamps, channels in (([30, 40], (X, Z)), ([10], (X,))):
        kept(weighed(stamps, np.ones(len(stamps)), low=1.0, high=2.0, channels=channels))
    assert {each.channel: each.stamp_ns.tolist() for each in kept.points()} == {
        X: [10, 30, 40], Z: [30, 40]}


@pytest.mark.parametrize('change, rule', [
    ({'tolerance': -1.0}, 'tolerance must be >= 0 s'),
    ({'slow_roll_speed': 0.0}, 'slow_roll_speed must be > 0 rad/s'),
    ({'noise': math.nan}, 'noise must be >= 0 m')])
def test_impossible_matching_is_refused(change, rule):
    with pytest.raises(RotorSoilError, match=rule):
        Matching(**change)
