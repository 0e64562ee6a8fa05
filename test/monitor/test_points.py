"""Matching, exclusion and figures of a comparison against hand-made runs."""

import math

import numpy as np
import pytest

from rotorsoil_ros.errors import RotorSoilError
from rotorsoil_ros.monitor.points import (
    match,
    Matching,
    nearest,
    Reason,
    Reference,
    Signal,
    statistics,
)
from rotorsoil_ros.monitor.quasistatic import Resonance

SECOND = 1_000_000_000
TOLERANT = Matching(tolerance=0.02)


def reference(speed, displacement, *, low=None, high=None, turn=None, every=SECOND):
    """Return predictions of one channel at evenly spaced stamps."""
    speed = np.asarray(speed, dtype=float)
    nothing = np.full((len(speed), 1), np.nan)
    return Reference(
        np.arange(len(speed)) * every, speed, ('a_x',),
        np.asarray(displacement, dtype=complex)[:, None],
        nothing if low is None else np.asarray(low)[:, None],
        nothing if high is None else np.asarray(high)[:, None],
        nothing if turn is None else -np.asarray(turn)[:, None],
        nothing if turn is None else np.asarray(turn)[:, None], (10.0, 100.0))


def signal(stamp_ns, vector, *, phase=True, deviation=0.0):
    vector = np.asarray(vector, dtype=complex)
    return Signal(np.asarray(stamp_ns), np.abs(vector),
                  np.angle(vector) if phase else np.full(len(vector), np.nan),
                  np.full(len(vector), deviation))


def points_of(given, measured, resonances=(), matching=TOLERANT):
    [points] = match({'a_x': measured}, given, resonances, matching)
    return points


def test_nearest_stamp_within_the_tolerance_is_taken():
    given = np.array([0, 10, 20]) * SECOND
    wanted = np.array([-2 * SECOND, 4 * SECOND, 6 * SECOND, 20 * SECOND, 21 * SECOND])
    np.testing.assert_array_equal(nearest(wanted, given, tolerance=1.0), [-1, -1, -1, 2, 2])
    np.testing.assert_array_equal(nearest(wanted, given, tolerance=4.0), [0, 0, 1, 2, 2])
    np.testing.assert_array_equal(nearest(wanted, given[:0], tolerance=1.0), [-1] * 5)


def test_measurement_meets_the_prediction_of_its_stamp():
    given = reference([20.0, 30.0, 40.0], [1.0, 2j, 3.0])
    points = points_of(given, signal([SECOND + 1_000_000, 2 * SECOND], [2j, 3.3]))
    np.testing.assert_array_equal(points.speed, [30.0, 40.0])
    np.testing.assert_array_equal(points.predicted, [2j, 3.0])
    assert points.used.all()


@pytest.mark.parametrize('stamp, size, speed, predicted, reason', [
    (0, math.nan, 50.0, 1.0, Reason.NOT_FINITE), (SECOND // 2, 1.0, 50.0, 1.0, Reason.NO_SPEED),
    (0, 1.0, 5.0, math.nan, Reason.OUT_OF_TABLE), (0, 1.0, 101.0, 1.0, Reason.OUT_OF_TABLE),
    (0, 1.0, 50.0, math.nan, Reason.NO_PREDICTION), (0, 1e-9, 50.0, 1.0, Reason.BELOW_NOISE),
    (0, 1.0, 50.0, 1.0, Reason.USED)])
def test_point_that_cannot_be_used_says_why(stamp, size, speed, predicted, reason):
    matching = Matching(tolerance=0.02, noise=1e-6)
    points = points_of(reference([speed, speed], [predicted] * 2),
                       signal([stamp], [size]), matching=matching)
    assert points.reason.tolist() == [reason]


def test_channel_that_was_not_predicted_is_told():
    [points] = match({'b_x': signal([0], [1.0])}, reference([50.0], [1.0]), (), TOLERANT)
    assert points.reason.tolist() == [Reason.NO_PREDICTION]


def test_vector_within_its_own_error_is_noise():
    points = points_of(reference([50.0], [1.0]), signal([0], [1.0], deviation=0.4))
    assert points.reason.tolist() == [Reason.BELOW_NOISE]


def test_fast_passage_is_marked_and_a_slow_one_is_not():
    speed = np.linspace(20.0, 90.0, 71)
    resonance = [Resonance(50.0, 0.01)]
    quick = points_of(reference(speed, np.ones(71), every=SECOND // 10),
                      signal(np.arange(71) * (SECOND // 10), np.ones(71)), resonance)
    assert set(quick.reason[31:34]) == {Reason.NOT_QUASI_STATIC}
    assert quick.used[:5].all()
    assert quick.excluded == {'not quasi-static': int((~quick.used).sum())}
    slow = points_of(reference(speed, np.ones(71), every=100 * SECOND),
                     signal(np.arange(71) * 100 * SECOND, np.ones(71)), resonance)
    assert slow.used.all()


def test_slow_roll_vector_is_subtracted_from_all_vectors():
    runout = 0.5 - 0.2j
    speed = np.array([20.0, 20.5, 60.0, 80.0])
    truth = np.array([0.0, 0.0, 1j, 2.0])
    matching = Matching(tolerance=0.02, slow_roll_speed=20.0)
    points = points_of(reference(speed, truth),
                       signal(np.arange(4) * SECOND, truth + runout), matching=matching)
    assert points.runout == pytest.approx(runout)
    np.testing.assert_allclose(points.measured[2:], truth[2:], atol=1e-12)
    assert points.reason.tolist() == [Reason.SLOW_ROLL, Reason.SLOW_ROLL, Reason.USED,
                                      Reason.USED]


def test_amplitude_without_phase_keeps_its_runout():
    matching = Matching(tolerance=0.02, slow_roll_speed=20.0)
    points = points_of(reference([20.0, 60.0], [0.0, 1.0]),
                       signal([0, SECOND], [0.5, 1.5], phase=False), matching=matching)
    np.testing.assert_array_equal(points.amplitude, [0.5, 1.5])
    assert math.isnan(points.runout.real)
    assert not points.has_phase


def test_figures_of_known_errors():
    predicted = np.array([1.0, 2.0, 3.0, 4.0])
    measured = (predicted + np.array([0.1, 0.3, 0.1, 0.3])) * np.exp(0.2j)
    points = points_of(
        reference([20.0, 30.0, 40.0, 50.0], predicted, low=0.9 * predicted,
                  high=np.array([1.05, 2.05, 3.2, 4.1])),
        signal(np.arange(4) * SECOND, measured))
    found = statistics(points, margin=0.0)
    assert found.bias == pytest.approx(0.2)
    assert found.scatter == pytest.approx(0.1)
    assert found.ratio == pytest.approx(np.median(np.abs(measured) / predicted))
    assert found.phase_bias == pytest.approx(0.2)
    assert found.phase_scatter == pytest.approx(0.0, abs=1e-7)
    left, spread = np.abs(measured - predicted) ** 2, np.abs(measured - measured.mean()) ** 2
    assert found.r_squared == pytest.approx(1.0 - left.sum() / spread.sum())
    assert found.inside == 0.25
    assert statistics(points, margin=0.08).inside == 0.75  # 2.3 > 1.08 * 2.05


def test_amplitude_only_channel_has_figures_of_its_amplitudes():
    points = points_of(reference([20.0, 30.0], [1j, -2.0]),
                       signal([0, SECOND], [1.0, 2.0], phase=False))
    found = statistics(points, margin=0.1)
    assert found.r_squared == 1.0
    assert math.isnan(found.phase_bias)
    assert math.isnan(found.inside)


def test_channel_without_a_used_point_has_no_figures():
    points = points_of(reference([5.0], [1.0]), signal([0], [1.0]))
    assert math.isnan(statistics(points, margin=0.1).bias)


@pytest.mark.parametrize('change, rule', [
    ({'tolerance': -1.0}, 'tolerance must be >= 0 s'),
    ({'slow_roll_speed': 0.0}, 'slow_roll_speed must be > 0 rad/s'),
    ({'noise': math.nan}, 'noise must be >= 0 m')])
def test_impossible_matching_is_refused(change, rule):
    with pytest.raises(RotorSoilError, match=rule):
        Matching(**change)


def test_phases_count_inside_their_band_and_a_little_beside_it():
    vector = np.full(6, 1e-5) * np.exp(3.0j)
    turn = np.full(6, 0.2)
    given = reference(np.full(6, 50.0), vector, low=np.full(6, 0.0), high=np.full(6, 1.0),
                      turn=turn)
    off = np.array([0.0, 0.19, -0.29, 0.31, -0.31, 2.0 * np.pi - 0.1])
    points = points_of(given, signal(given.stamp_ns, vector * np.exp(1j * off)))
    assert statistics(points, margin=0.1).phase_inside == pytest.approx(4 / 6)
    blind = points_of(given, signal(given.stamp_ns, vector, phase=False))
    assert np.isnan(statistics(blind, margin=0.1).phase_inside)
