"""What successive vectors tell of their own accuracy."""

import numpy as np
import pytest

from rotorsoil_ros.case.entries.sensors import Pickup
from rotorsoil_ros.channel import Channel
from rotorsoil_ros.events import Samples
from rotorsoil_ros.monitor.vectors.demodulation import Demodulator, Scatter, WIDENED
from rotorsoil_ros.monitor.vectors.history import History
from rotorsoil_ros.monitor.vectors.orders import OrderVector

X = Channel('fan_end', 'housing', 'x')


def vector(value, *, speed=150.0, deviation=1.0, has_phase=True):
    return OrderVector(0.0, speed, np.array([value, 0.5 * value], dtype=complex),
                       np.array([deviation, np.nan]), has_phase)


def stated(vectors):
    scatter = Scatter()
    return [scatter.widened(each).deviation[0] for each in vectors]


def test_alternating_vectors_err_by_their_second_difference():
    """Each differs by 4 a from the mean of its neighbours, twice: 4 a / sqrt(12), or sqrt(6)."""
    values = [100.0 + (-1) ** row * 6.0 for row in range(8)]
    assert stated(map(vector, values)) == [1.0] * 5 + [
        pytest.approx(24.0 / np.sqrt(12.0), rel=1e-12)] * 3
    turning = [vector(value * np.exp(1j * row), has_phase=False)
               for row, value in enumerate(values)]
    assert stated(turning)[-1] == pytest.approx(24.0 / np.sqrt(6.0), rel=1e-12)


def test_what_changes_steadily_does_not_scatter():
    assert stated(vector(100.0 + 50.0 * row * np.exp(0.3j)) for row in range(12)) == [1.0] * 12


def test_white_noise_as_large_as_is_said_widens_nothing():
    random = np.random.default_rng(0)
    noise = random.normal(size=(2, 2000))
    assert stated(vector(100.0 + a + 1j * b) for a, b in noise.T) == [1.0] * 2000


def test_noise_that_is_eight_times_as_large_is_told_within_a_third():
    random = np.random.default_rng(1)
    noise = 8.0 * random.normal(size=(2, 500))
    found = stated(vector(100.0 + a + 1j * b) for a, b in noise.T)[10:]
    assert np.median(found) == pytest.approx(8.0, rel=0.1)
    assert np.mean(np.abs(np.array(found) / 8.0 - 1.0) < 1.0 / 3.0) > 0.8


def test_another_speed_begins_anew_and_other_orders_stay_unknown():
    values = [100.0 + (-1) ** row * 6.0 for row in range(8)]
    climbing = [vector(value, speed=150.0 + 2.0 * row) for row, value in enumerate(values)]
    assert stated(climbing) == [1.0] * 8
    scatter = Scatter()
    for value in values:
        last = scatter.widened(vector(value))
    assert np.isnan(last.deviation[1])


@pytest.mark.parametrize('tone', [0.0, 0.4])
def test_a_tone_beside_1x_is_not_seen_in_a_stretch_but_from_stretch_to_stretch(tone):
    """At 0.98X: within ten turns it is 1X, from one ten to the next it has turned by a fifth."""
    speed, swing, rate = 150.0, 20e-6, 1000.0
    time = np.arange(int(30.0 * rate)) / rate
    stamps = np.rint(time * 1e9).astype(np.int64) + 10**9
    noise = np.random.default_rng(2).normal(scale=0.02 * swing * speed**2, size=len(time))
    values = -swing * speed**2 * (
        np.cos(speed * time) + tone * np.cos(0.98 * speed * time)) + noise
    history = History()
    history.add(stamps, np.full(len(time), speed), np.mod(speed * time, 2.0 * np.pi))
    demodulator = Demodulator('fan', X, history, turns=10.0, pickup=Pickup())
    demodulator.take(Samples('fan', X, stamps, values, False))
    [found] = demodulator.vectors()
    assert len(found.stamp_ns) > 50
    away = np.abs(found.amplitude[:, 0] * np.exp(1j * found.phase[:, 0]) - swing)[10:]
    said = found.deviation[10:]
    assert bool(demodulator.refusals.left_out[WIDENED]) == bool(tone)
    assert np.mean(away < 3.0 * said) > 0.98
