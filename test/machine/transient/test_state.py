"""The step between two speeds against quadrature, published passages and its own symmetries."""

import math
from pathlib import Path

import numpy as np
import pytest

from rotorsoil_ros.machine.transient.poles import Poles
from rotorsoil_ros.machine.transient.state import step, Transient

REFERENCE = Path(__file__).parents[2] / 'reference' / 'run_up'
SECOND = 1_000_000_000


def of_one(decay, strength=1.0, slope=0.0):
    """Return the free vibration of one oscillator."""
    return Poles(np.array([decay]), np.array([slope]), np.full((1, 1, 1), strength, dtype=complex))


FIVE = Poles(np.array([-380.0 + 186j, -0.07 + 98j, -0.1 + 106j, -4.4 + 77j, -5.7 + 81j]),
             np.array([0.0, -0.05, 0.05, -0.03, 0.02]), np.ones((5, 1, 1), dtype=complex))


def followed(poles, time, speed):
    """Return deviations d, (n, k), 0 where there is none."""
    stamp_ns = np.rint(np.asarray(time) * SECOND).astype(np.int64)
    return told(Transient(poles), stamp_ns, np.asarray(speed, dtype=float))[:, 0]


def told(transient, stamp_ns, speed):
    """Return d and A d at every speed, (n, 2, k), 0 where nothing rings."""
    return all_rows(transient.follow(stamp_ns, speed), len(speed), len(transient.poles))


def all_rows(struck, count, poles):
    found = np.zeros((count, 2, poles), dtype=complex)
    if struck is not None:
        found[struck.rows, 0], found[struck.rows, 1] = struck.away, struck.share
    return found


def test_step_is_the_integral_of_the_envelope():
    # Composite quadrature of v' = A v + 1 with A going evenly from one value to another.
    random = np.random.default_rng(0)
    nodes, weights = np.polynomial.legendre.leggauss(20)
    for _ in range(300):
        before = complex(-10.0 ** random.uniform(-2.0, 2.0), random.uniform(-300.0, 300.0))
        time = 10.0 ** random.uniform(-3.0, 0.0)
        after = before + 1j * random.choice([-1.0, 1.0]) * 10.0 ** random.uniform(-9.0, 2.5)
        parts = 4 * int(max(20.0, abs(before) * time, abs(after) * time))
        place = ((np.arange(parts)[:, None] + 0.5 + 0.5 * nodes) / parts).ravel()
        exponent = time * (before * (1.0 - place)
                           + 0.5 * (after - before) * (1.0 - place**2))
        exact = time * np.sum(np.exp(exponent).reshape(parts, -1) @ weights) * 0.5 / parts
        gone, driven = step(np.array([before]), np.array([after]), time)
        assert gone[0] == pytest.approx(np.exp(0.5 * (before + after) * time), rel=1e-12)
        assert abs(driven[0] - exact) < 1e-8 * max(abs(exact), 1e-2 * time)


@pytest.mark.parametrize('rate', [0.0, 24.0, -400.0, 1e-9])
def test_a_ramp_may_be_told_in_any_number_of_speeds(rate):
    poles = of_one(-0.7 + 100j)
    ends = np.linspace(0.0, 1.0, 6)
    fine = np.linspace(0.0, 1.0, 36)
    once = followed(poles, ends, 95.0 + rate * ends)
    np.testing.assert_allclose(followed(poles, fine, 95.0 + rate * fine)[::7], once,
                               rtol=0.0, atol=1e-9)


def test_passage_without_a_base_is_that_of_lewis():
    for p, shift, peak, _ in np.loadtxt(REFERENCE / 'lewis_envelope.csv', delimiter=','):
        # The rate is one; the step is exact, so that only the peak needs many samples.
        time = np.concatenate([np.arange(-100.0, 0.0, 1.0), np.arange(0.0, 4.0, 0.005)])
        p = max(p, 1e-9)  # without any damping the steady response is infinite
        poles = of_one(-p + 1000j)
        away = followed(poles, time, 1000.0 + time)
        size = np.abs(away[:, 0] - 1.0 / (-p - 1j * time))
        # At p = 0 what the beginning has struck beats with the peak and never decays.
        tolerance = 1e-4 if p >= 0.1 else 5e-4
        assert size.max() == pytest.approx(peak, rel=tolerance)
        if p < 3.0:
            assert time[size.argmax()] == pytest.approx(shift, abs=0.01 if p >= 0.1 else 0.03)


def test_one_oscillator_runs_up_as_its_equation_of_motion_does():
    # H = 1 / (w^2 - Omega^2 + 2 i zeta w Omega) has the poles +-w sqrt(1 - zeta^2) + i zeta w.
    for (zeta, _, root, peak, at, quasistatic, _, one_pole, _) in np.loadtxt(
            REFERENCE / 'runup_one_dof.csv', delimiter=','):
        damped = math.sqrt(1.0 - zeta**2)
        # The step is exact along a ramp: samples need only lie where something peaks, which the
        # mirrored pole does at the beginning.
        speed = np.unique(np.clip(np.concatenate([
            np.linspace(0.3, 1.35, 200), 0.3 + root**2 * np.linspace(0.0, 20.0, 200),
            1.0 + root * np.linspace(-5.0, 30.0, 700)]), 0.3, 1.35))
        unit = 1.0 / root**2  # [rad/s], so that the run takes a second
        time = (speed - 0.3)
        steady = speed**2 / (1.0 - speed**2 + 2j * zeta * speed)
        decay = np.array([-zeta + 1j * damped, -zeta - 1j * damped])
        residue = np.array([-0.5 / damped, 0.5 / damped])
        strength = (-1j * decay**2 * residue)
        both = Poles(unit * decay, np.zeros(2), strength.reshape(2, 1, 1))
        parts = followed(both, time, unit * speed) * unit * strength
        exact = steady + parts.sum(axis=1)
        largest = np.abs(exact).max()
        height = 1.0 / (2.0 * zeta * math.sqrt(1.0 - zeta**2))
        assert largest / height == pytest.approx(peak, rel=2e-3)  # as densely sampled
        assert speed[np.abs(exact).argmax()] == pytest.approx(at, abs=2e-3)
        assert np.abs(steady - exact).max() / largest == pytest.approx(quasistatic, rel=0.01)
        # The mirrored pole is the whole error of one alone.
        assert np.abs(parts[:, 1]).max() / largest == pytest.approx(
            one_pole, rel=0.1, abs=1e-6)  # less is taken for nothing


def test_at_constant_speed_nothing_is_left():
    decay = -2.0 + 100j
    time = np.concatenate([np.linspace(0.0, 1.0, 100), [1.0 + 20.0 / 2.0]])
    speed = np.minimum(90.0 + 20.0 * time, 110.0)
    away = followed(of_one(decay), time, speed)
    assert abs(away[-2, 0]) > 1e-2
    assert away[-1, 0] == 0.0


def test_slow_ramps_lag_by_the_rate_over_the_cube():
    decay, rate = -2.0 + 100j, 0.1  # p = 6.3
    time = np.linspace(0.0, 200.0, 2001)
    speed = 90.0 + rate * time
    away = followed(of_one(decay), time, speed)[200:, 0]
    first = -1j * rate / (decay - 1j * speed[200:]) ** 3
    np.testing.assert_allclose(away, first, atol=0.1 * np.abs(first).max())


def test_a_run_down_is_the_mirror_of_a_run_up():
    time = np.linspace(-5.0, 5.0, 1001)
    up, down = (followed(of_one(-0.5 + 100j), time + 10.0, 100.0 + side * 3.0 * time)
                for side in (1.0, -1.0))
    np.testing.assert_allclose(down, up.conj(), rtol=0.0, atol=1e-10)


def test_frequency_that_follows_the_speed_is_detuned_less():
    # (1 - g) (lambda - i Omega): an oscillator of its own, whose time runs slower.
    time, slope = np.linspace(0.0, 4.0, 400), 0.2
    own = followed(of_one(-0.5 + 100j, slope=slope), time, 95.0 + 3.0 * time)
    still = followed(of_one((1.0 - slope) * (-0.5 + 100j)), time,
                     (1.0 - slope) * (95.0 + 3.0 * time))
    np.testing.assert_allclose(own, still, rtol=1e-9, atol=1e-12)


def stepping(**changed):
    """Return stamps [ns] and speeds through a resonance, five seconds at 50 Hz."""
    stamp_ns = np.arange(250) * (SECOND // 50)
    return stamp_ns, 95.0 + 2.0 * stamp_ns / SECOND


def test_parts_of_a_run_give_the_same_bits():
    stamp_ns, speed = stepping()
    speed[100:120] = speed[100]  # and at a constant speed
    for poles in (of_one(-0.2 + 100j), FIVE):
        whole = told(Transient(poles), stamp_ns, speed)
        parts = Transient(poles)
        found = [told(parts, stamp_ns[part], speed[part])
                 for part in np.split(np.arange(250), [1, 2, 70, 71, 110, 200])]
        assert np.concatenate(found).tobytes() == whole.tobytes()
        assert np.abs(whole[1:, 1]).min() > 0.0


@pytest.mark.parametrize('jump_ns, begins', [
    (9 * SECOND, False), (11 * SECOND, True), (-SECOND, True)])
def test_a_long_gap_and_stamps_that_go_back_begin_anew(jump_ns, begins):
    stamp_ns, speed = stepping()
    stamp_ns = np.where(np.arange(250) < 200, stamp_ns, stamp_ns + jump_ns)
    transient = Transient(of_one(-0.05 + 100j))
    found = told(transient, stamp_ns, speed)
    assert (not found[200].any()) == begins
    assert (int(stamp_ns[200]) in transient.began_ns) == begins
    if begins:
        fresh = told(Transient(of_one(-0.05 + 100j)), stamp_ns[200:], speed[200:])
        assert found[200:].tobytes() == fresh.tobytes()


def test_a_speed_without_an_answer_is_as_one_that_was_lost():
    stamp_ns, speed = stepping()
    gaps = np.arange(250) % 7 == 3
    holed = told(Transient(of_one(-0.2 + 100j)), stamp_ns, np.where(gaps, np.nan, speed))
    lost = told(Transient(of_one(-0.2 + 100j)), stamp_ns[~gaps], speed[~gaps])
    assert holed[~gaps].tobytes() == lost.tobytes()
    assert not holed[gaps].any()


def test_the_same_moment_told_twice_moves_nothing():
    decay = -0.2 + 100j
    transient = Transient(of_one(decay))
    first, second = told(transient, np.array([0, SECOND]), np.array([95.0, 99.0]))
    assert not first.any()
    [again] = told(transient, np.array([SECOND]), np.array([99.5]))
    envelope = second[0, 0] - 1.0 / (decay - 99j)
    assert again[0, 0] - 1.0 / (decay - 99.5j) == pytest.approx(envelope, rel=1e-12)


def test_past_times_are_told_between_the_speeds():
    # A ramp: what lies between two speeds is what a third one there would have been told.
    stamp_ns, speed = stepping()
    transient = Transient(of_one(-0.2 + 100j))
    transient.follow(stamp_ns, speed)
    fine_ns = np.arange(1250) * (SECOND // 250)
    fine = told(Transient(of_one(-0.2 + 100j)), fine_ns, 95.0 + 2.0 * fine_ns / SECOND)
    rows = np.array([3, 77, 901])
    found = transient.at(fine_ns[rows], 95.0 + 2.0 * fine_ns[rows] / SECOND)
    np.testing.assert_array_equal(found.rows, np.arange(3))
    np.testing.assert_allclose(found.away, fine[rows, 0], rtol=1e-7)
    unknown = np.array([-1, stamp_ns[-1] + 11 * SECOND, fine_ns[3]])
    assert transient.at(unknown, np.array([95.0, 99.0, math.nan])) is None


def test_a_rest_is_kept_by_its_ends():
    # Whoever asks what was before, within or after a rest is told the same, however long it was.
    stamp_ns, speed = stepping()
    speed = np.where(np.arange(250) < 100, speed, speed[100])
    decay = of_one(-50.0 + 100j)
    transient = Transient(decay)
    away = told(transient, stamp_ns, speed)
    assert away[99].any()
    assert not away[150:].any()
    assert len(transient._past) < 150
    late = np.arange(250) * (SECOND // 50) + SECOND // 100
    found = all_rows(transient.at(late, speed), 250, 1)
    assert not found[150:].any()
    moved = told(transient, stamp_ns[-1:] + SECOND // 50, speed[-1:] + 1.0)
    begun = Transient(decay)
    begun.follow(stamp_ns[-1:], speed[-1:])
    assert moved.tobytes() == told(begun, stamp_ns[-1:] + SECOND // 50, speed[-1:] + 1.0).tobytes()
