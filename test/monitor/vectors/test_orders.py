"""Vectors out of raw samples against signals whose truth is known."""

import numpy as np
import pytest

from rotorsoil_ros.errors import NotSolvedError, OutOfTableError, RotorSoilError
from rotorsoil_ros.monitor.vectors.orders import demodulate, SpeedTrack

X1, X2 = 40e-6 * np.exp(0.7j), 6e-6 * np.exp(-2.0j)
RATE_HZ = 2000.0


def ramp(speed, rate, seconds):
    """Return a track whose angle is known in closed form, sampled at 50 Hz."""
    time = np.arange(0.0, seconds + 0.02, 0.02)
    return SpeedTrack(time, speed + rate * time, angle_at_start=0.3)


def signal(time, speed, rate, *, first=X1, slope=0.0, second=X2, third=0.0):
    """Return the exact second derivative of harmonics on a ramp, plus gravity."""
    angle = 0.3 + speed * time + 0.5 * rate * time**2
    omega = speed + rate * time
    total = np.full_like(time, 9.81)
    for order, start, change in ((1, first, slope), (2, second, 0.0), (3, third, 0.0)):
        vector = start + change * time
        total += ((2j * order * omega * change + 1j * order * rate * vector
                   - (order * omega) ** 2 * vector) * np.exp(1j * order * angle)).real
    return total


def assert_within_promise(found, truth):
    assert abs(abs(found) / abs(truth) - 1.0) < 0.01
    assert abs(np.degrees(np.angle(found / truth))) < 1.0


def test_steady_signal_gives_its_vectors_exactly():
    time = np.arange(0.0, 0.5, 1.0 / RATE_HZ)
    found = demodulate(time, signal(time, 157.0, 0.0), ramp(157.0, 0.0, 1.0))
    np.testing.assert_allclose(found.displacement, [X1, X2, 0.0], atol=1e-15)  # round-off of 1e-5
    assert found.has_phase


def test_ramp_with_growing_amplitude_is_exact_too():
    # 60 rad/s^2 and an amplitude that doubles within the stretch, as when nearing a resonance.
    time = np.arange(0.0, 0.4, 1.0 / RATE_HZ)
    slope = X1 / 0.4
    samples = signal(time, 120.0, 60.0, slope=slope)
    found = demodulate(time, samples, ramp(120.0, 60.0, 1.0))
    np.testing.assert_allclose(found.displacement[:2], [X1 + slope * found.time, X2],
                               rtol=1e-9)
    assert found.speed == pytest.approx(120.0 + 60.0 * found.time)


def test_noise_gaps_late_samples_and_jitter_stay_within_the_promise():
    random = np.random.default_rng(3)
    time = np.arange(0.0, 1.0, 1.0 / RATE_HZ) + random.uniform(-1e-4, 1e-4, size=2000)
    samples = signal(time, 157.0, 20.0, third=2e-6)
    samples += random.normal(scale=0.2 * np.std(samples), size=len(time))
    keep = np.flatnonzero((random.uniform(size=len(time)) > 0.2)
                          & ((time < 0.30) | (time > 0.36)))
    random.shuffle(keep[:200])  # arrive late, in any order
    track = ramp(157.0, 20.0, 1.5)
    inside = keep[time[keep] > 0.0]
    found = demodulate(time[inside], samples[inside], track)
    assert_within_promise(found.displacement[0], X1)
    error = abs(found.displacement[0] - X1)
    assert error < 3.0 * found.deviation[0]  # three standard errors
    assert found.deviation[0] < 0.01 * abs(X1)


def test_stamps_instead_of_a_regular_grid_are_what_is_believed():
    # Treating the jittered samples as regular would cost 5 % at 2X; the fit loses nothing.
    random = np.random.default_rng(4)
    time = np.sort(random.uniform(0.0, 0.5, size=900))
    found = demodulate(time, signal(time, 157.0, 0.0), ramp(157.0, 0.0, 1.0))
    np.testing.assert_allclose(found.displacement[:2], [X1, X2], rtol=1e-9)


def test_stretches_follow_a_run_up():
    track = ramp(60.0, 20.0, 10.2)
    time = np.arange(0.0, 10.0, 1.0 / RATE_HZ)
    acceleration = signal(time, 60.0, 20.0)
    stretch = np.floor((track.at(time)[0] - 0.3) / (8.0 * 2.0 * np.pi))
    vectors = [demodulate(time[rows], acceleration[rows], track)
               for rows in (stretch == number for number in range(int(stretch[-1])))]
    assert len(vectors) > 20
    for vector in vectors:
        assert_within_promise(vector.displacement[0], X1)
        assert vector.speed == pytest.approx(60.0 + 20.0 * vector.time)


def test_without_a_mark_on_the_shaft_there_is_no_phase():
    time = np.arange(0.0, 0.5, 1.0 / RATE_HZ)
    known = ramp(157.0, 0.0, 1.0)
    blind = SpeedTrack(known.time, known.speed)
    found = demodulate(time, signal(time, 157.0, 0.0), blind)
    assert not found.has_phase
    assert abs(found.displacement[0]) == pytest.approx(abs(X1), rel=1e-9)
    # The vector is off by the unknown start angle, which is why it must not be used.
    assert np.angle(found.displacement[0] / X1) == pytest.approx(0.3, abs=1e-9)


def test_too_short_a_stretch_is_refused():
    time = np.arange(0.0, 0.06, 1.0 / RATE_HZ)  # 1.5 turns
    with pytest.raises(NotSolvedError, match=r'2 turns and 28 samples or more, got 1\.5 turns'):
        demodulate(time, signal(time, 157.0, 0.0), ramp(157.0, 0.0, 1.0))


def test_too_few_samples_are_refused():
    time = np.linspace(0.0, 0.5, 25)
    with pytest.raises(NotSolvedError, match='got 12 turns, 25 samples'):
        demodulate(time, signal(time, 157.0, 0.0), ramp(157.0, 0.0, 1.0))


def test_samples_locked_to_the_turn_cannot_tell_orders_apart():
    period = 2.0 * np.pi / 157.0
    time = np.arange(40) * period
    with pytest.raises(NotSolvedError, match='cannot tell the orders apart'):
        demodulate(time, np.ones(40), ramp(157.0, 0.0, 3.0))


def test_samples_before_the_first_speed_are_refused():
    with pytest.raises(OutOfTableError, match='of the speed track'):
        ramp(157.0, 0.0, 1.0).at(np.array([-0.1]))


@pytest.mark.parametrize('time, speed', [([0.0], [1.0]), ([0.0, 0.0], [1.0, 1.0]),
                                         ([0.0, 1.0], [1.0, np.nan]), ([0.0, 1.0], [1.0])])
def test_broken_track_is_refused(time, speed):
    with pytest.raises(RotorSoilError, match='a speed track needs'):
        SpeedTrack(np.array(time), np.array(speed))


def test_measured_angle_keeps_the_phase_where_speeds_are_off():
    time = np.linspace(0.0, 60.0, 30001)
    true = 100.0 * time
    signal = -100.0**2 * np.cos(true + 0.4)
    marks = np.linspace(0.0, 60.0, 601)
    speed = np.full(601, 100.05)  # half a per mille: 3 rad in a minute
    drifting = SpeedTrack(marks, speed, angle_at_start=0.0)
    held = SpeedTrack(marks, speed, angle=np.angle(np.exp(100j * marks)))
    late = time > 59.0
    assert held.has_phase
    assert np.angle(demodulate(time[late], signal[late], held).displacement[0]) == pytest.approx(
        0.4, abs=0.01)
    assert abs(np.angle(demodulate(time[late], signal[late], drifting).displacement[0])
               - 0.4) > 1.0


@pytest.mark.parametrize('angle', [np.zeros(2), np.full(3, np.nan)])
def test_angle_that_is_not_told_everywhere_is_refused(angle):
    with pytest.raises(RotorSoilError, match='a finite angle in rad at every sample'):
        SpeedTrack(np.arange(3.0), np.ones(3), angle=angle)
