"""The quasi-static verdict against time integration of a swept oscillator."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from rotorsoil_ros.monitor.quasistatic import (
    is_quasi_static,
    passage_number,
    Resonance,
    speed_rate,
)


def swept_amplitude(resonance, rate, time, start):
    """Return the envelope of an unbalanced oscillator on a linear sweep, and the steady one."""
    omega_n, zeta = resonance.speed, resonance.damping_ratio

    def slope(t, state):
        angle = start * t + 0.5 * rate * t**2
        force = (start + rate * t) ** 2 * math.cos(angle) + rate * math.sin(angle)
        return [state[1], force - 2.0 * zeta * omega_n * state[1] - omega_n**2 * state[0]]

    found = solve_ivp(slope, (0.0, time[-1]), [0.0, 0.0], t_eval=time, rtol=1e-7, atol=1e-9)
    envelope = np.hypot(found.y[0], found.y[1] / (start + rate * time))
    omega = start + rate * time
    steady = omega**2 / np.abs(omega_n**2 - omega**2 + 2j * zeta * omega_n * omega)
    return envelope, steady


@pytest.mark.parametrize('rate, ratio', [(2.0, 0.903), (20.0, 0.58)])
def test_peak_of_a_sweep_depends_on_the_passage_number(rate, ratio):
    # By integration over time: 25 Hz, zeta = 0.02: 2 Hz/s 0.903, 20 Hz/s 0.58 of the steady peak.
    resonance = Resonance(2.0 * math.pi * 25.0, 0.02)
    alpha = 2.0 * math.pi * rate
    assert passage_number(resonance, alpha) == pytest.approx({2.0: 0.886, 20.0: 0.280}[rate],
                                                             abs=1e-3)
    time = np.linspace(0.0, 20.0 / rate, 4000)
    envelope, steady = swept_amplitude(resonance, alpha, time, 2.0 * math.pi * 15.0)
    assert envelope.max() / steady.max() == pytest.approx(ratio, abs=0.03)


@pytest.mark.parametrize('rate_hz', [0.5, 5.0, 20.0])
def test_what_is_called_quasi_static_is_near_the_steady_curve(rate_hz):
    resonance = Resonance(2.0 * math.pi * 25.0, 0.03)
    alpha = 2.0 * math.pi * rate_hz
    time = np.linspace(0.0, 30.0 / rate_hz, 6000)
    start = 2.0 * math.pi * 10.0
    envelope, steady = swept_amplitude(resonance, alpha, time, start)
    speed = start + alpha * time
    holds = is_quasi_static(time, speed, [resonance])
    settled = time > 0.2 * time[-1]  # the integration starts from rest
    error = np.abs(envelope / steady - 1.0)[settled & holds]
    assert error.max() < 0.12  # 4 % at p = 1.5 plus what is left of the beat
    if rate_hz > 1.0:  # p = 0.84 and less
        passing = np.abs(speed / resonance.speed - 1.0) < 0.02
        assert not holds[passing].any()
        assert np.abs(envelope / steady - 1.0)[passing].max() > 0.12
    else:  # p = 2.7
        assert holds.all()


def test_run_down_rings_below_the_resonance():
    resonance = Resonance(160.0, 0.01)
    time = np.linspace(0.0, 10.0, 500)
    down = is_quasi_static(time, 260.0 - 20.0 * time, [resonance])
    up = is_quasi_static(time, 60.0 + 20.0 * time, [resonance])
    speed = 60.0 + 20.0 * time
    assert speed[~up].max() - 160.0 > 2.0 * (160.0 - speed[~up].min())
    speed = 260.0 - 20.0 * time
    assert 160.0 - speed[~down].min() > 2.0 * (speed[~down].max() - 160.0)


def test_constant_speed_is_quasi_static_even_on_a_resonance():
    time = np.linspace(0.0, 10.0, 50)
    assert is_quasi_static(time, np.full(50, 160.0), [Resonance(160.0, 0.001)]).all()


def test_rate_of_scattered_speeds_is_that_of_their_line():
    time = np.linspace(0.0, 2.0, 200)
    speed = 100.0 + 24.0 * time + np.random.default_rng(0).normal(scale=0.05, size=200)
    np.testing.assert_allclose(speed_rate(time, speed)[10:-10], 24.0, rtol=0.15)
