"""The augmented fit against closed forms, and what its residuals are worth."""

import math

import numpy as np
import pytest

from rotorsoil_ros.monitor.identification.fit import Problem, solve
from rotorsoil_ros.monitor.identification.noise import worth

ROWS, CHANNELS = 120, 3
SPEED = np.linspace(20.0, 120.0, ROWS)
NATURAL, TRUTH = 70.0, 2e-5 * np.exp(0.4j)
SENSORS = np.array([1.0, 0.6j, -0.3])
SOFTER, TWO_DEGREES = math.log(0.7), math.radians(2.0)


def respond(logs):
    """Return an oscillator seen by three sensors, its stiffness off by a factor."""
    natural = NATURAL * math.exp(0.5 * (logs[0] if len(logs) else 0.0))
    size = SPEED**2 / (natural**2 - SPEED**2 + 0.1j * natural * SPEED)
    return (size[:, None] * SENSORS)[:, :, None]


def problem(measured, *, scalars=1, gain=0.03, angle=TWO_DEGREES, respond=respond):
    return Problem(respond, measured, np.zeros(ROWS, dtype=int),
                   np.full(scalars, math.log(2.0)), scalars, np.zeros(0), gain, angle)


def white(random, shape=(ROWS, CHANNELS)):
    return (random.normal(size=shape) + 1j * random.normal(size=shape)) / math.sqrt(2.0)


def exact(log=SOFTER):
    return respond(np.array([log]))[:, :, 0] * TRUTH


def size(values):
    return np.sqrt(np.mean(np.abs(values) ** 2, axis=0))


def test_what_was_put_in_is_found():
    found = solve(problem(exact()), np.zeros(1))
    assert math.exp(found.state.logs[0]) == pytest.approx(0.7, rel=1e-3)
    assert found.state.columns[0] == pytest.approx(TRUTH, rel=1e-2)
    assert found.explained > 0.9999


def test_covariance_of_white_noise_is_that_of_least_squares():
    """With gains held the covariance of U, G known, is sigma^2 / |T|^2: a closed form."""
    noise = 0.05 * size(exact()) * white(np.random.default_rng(0))
    given = problem(exact(0.0) + noise, scalars=0, gain=1e-9, angle=1e-9)
    found = solve(given, np.zeros(0))
    system = respond(np.zeros(0))[:, :, 0] * given.weight
    wanted = math.sqrt(found.worth.variance * found.worth.inflation
                       / np.sum(np.abs(system) ** 2))
    np.testing.assert_allclose(found.deviation[:2], wanted, rtol=1e-6)
    assert found.worth.inflation < 1.5


def test_gains_alone_leave_their_share_of_the_unbalance():
    """No noise, stiffness known: along U 3 %, across 2 degrees, over the root of three sensors."""
    found = solve(problem(exact(0.0), scalars=0), np.zeros(0))
    turn = TRUTH / abs(TRUTH)
    along = np.array([turn.real, turn.imag])
    across = np.array([-turn.imag, turn.real])
    part = found.covariance[:2, :2]
    for direction, share in ((along, 0.03), (across, math.radians(2.0))):
        assert math.sqrt(direction @ part @ direction) == pytest.approx(
            share * abs(TRUTH) / math.sqrt(3.0), rel=0.02)


def test_units_and_the_zero_of_phase_do_not_matter():
    measured = exact() + 0.03 * size(exact()) * white(np.random.default_rng(2))
    plain, scaled = (solve(problem(values), np.zeros(1))
                     for values in (measured, 1e3 * np.exp(0.7j) * measured))
    assert scaled.state.logs[0] == pytest.approx(plain.state.logs[0], abs=1e-4)
    assert scaled.log_width[0] == pytest.approx(plain.log_width[0], rel=1e-2)
    assert scaled.state.columns[0] == pytest.approx(
        1e3 * np.exp(0.7j) * plain.state.columns[0], rel=1e-3)


def judged(residual, stretch=None):
    rows = len(residual)
    return worth(residual, np.ones_like(residual),
                 np.zeros(rows, dtype=int) if stretch is None else stretch,
                 fitted=2.0, sensitivity=np.zeros((2 * residual.size, 0)))


def drifting(random, rows, correlation=0.9):
    noise = white(random, (rows, 1))
    for row in range(1, rows):
        noise[row] = (correlation * noise[row - 1]
                      + math.sqrt(1.0 - correlation**2) * noise[row])
    return noise


def test_white_noise_is_worth_its_number():
    found = judged(white(np.random.default_rng(3), (4000, 1)))
    assert found.inflation == pytest.approx(1.0, abs=0.1)
    assert found.variance == pytest.approx(0.5, rel=0.05)


def test_drift_is_worth_what_its_correlation_leaves():
    """Of AR(1) with 0.9 a mean has (1 + 0.9) / (1 - 0.9) = 19 times the variance."""
    found = judged(drifting(np.random.default_rng(4), 20000))
    assert found.inflation == pytest.approx(19.0, rel=0.2)


def test_drift_under_white_noise_of_its_power_is_worth_half_of_that():
    random = np.random.default_rng(5)
    found = judged(drifting(random, 20000) + white(random, (20000, 1)))
    assert found.inflation == pytest.approx(10.0, rel=0.25)


def test_noise_that_all_channels_share_is_worth_one_channel():
    common = np.repeat(white(np.random.default_rng(6), (3000, 1)), 4, axis=1)
    assert judged(common).inflation == pytest.approx(4.0, rel=0.2)


def test_gap_is_not_bridged():
    noise = drifting(np.random.default_rng(7), 4000)
    assert judged(noise, np.arange(4000)).in_time == 0.0
