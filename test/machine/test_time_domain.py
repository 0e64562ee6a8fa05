"""Integration in time against the response over frequency: two routes to one machine."""

from dataclasses import replace

import numpy as np
import pytest

from rotorsoil_ros.errors import RotorSoilError
from rotorsoil_ros.ground.cone import ConeModel
from rotorsoil_ros.machine.time_domain import shake, unbalance_force
from rotorsoil_ros.monitor.vectors.orders import demodulate, SpeedTrack

from machines import CONTACT, paper_machine, Restrained, SOIL

MACHINE = paper_machine(ConeModel(SOIL, CONTACT), mass=420.0)
MOMENT, PHASE = np.array([1e-5, 4e-6]), np.array([0.3, -1.1])


def steady(speed, *, seconds, step, machine=MACHINE):
    time = np.arange(0.0, seconds, step)
    turning = np.full(len(time), speed)
    shaken = shake(machine, time, turning, moment=np.tile(MOMENT, (len(time), 1)), phase=PHASE)
    late = time > 0.7 * seconds
    track = SpeedTrack(time, turning, angle=shaken.angle)
    return shaken.channels, np.array([
        demodulate(time[late], column[late], track).displacement[0]
        for column in shaken.acceleration.T])


@pytest.mark.parametrize('speed', [90.0, 200.0])
def test_steady_vibration_is_the_response_to_unbalance(speed):
    channels, got = steady(speed, seconds=8.0, step=1e-3)
    expected = MACHINE.unbalance_response(np.array([speed]), MOMENT * np.exp(1j * PHASE))
    expected = expected.displacement[0, [MACHINE.channels.index(name) for name in channels]]
    # Newmark lets a vibration at 1/4 of the lowest natural frequency (280 rad/s) lag little:
    # (280 step)^2 / 12 = 0.7 % of its frequency; shaft modes without damping still ring a bit.
    np.testing.assert_allclose(got, expected, rtol=0.02)


class Coupled:
    """Cones whose sway and rocking are coupled."""

    def compliance(self, omega):
        values = ConeModel(SOIL, CONTACT).compliance(omega)
        values[:, 0, 4] = values[:, 4, 0] = 0.5 * np.sqrt(values[:, 0, 0] * values[:, 4, 4])
        return values


@pytest.mark.parametrize('soil', [Restrained(ConeModel(SOIL, CONTACT), 'z', 'ry'), Coupled()],
                         ids=['held in four directions', 'coupled'])
def test_contact_moves_by_its_compliance_where_it_may(soil):
    machine = paper_machine(soil, mass=420.0)
    channels, got = steady(200.0, seconds=8.0, step=1e-3, machine=machine)
    expected = machine.unbalance_response(np.array([200.0]), MOMENT * np.exp(1j * PHASE))
    expected = expected.displacement[0, [machine.channels.index(name) for name in channels]]
    np.testing.assert_allclose(got, expected, rtol=0.02)  # as above


@pytest.mark.parametrize('axis', range(3))
def test_ground_that_moves_carries_and_shakes_as_over_frequency(axis):
    """Relative to the ground all that has mass feels -m a: no transmissibility is in it."""
    speed, step = 200.0, 1e-3
    time = np.arange(0.0, 6.0, step)
    ground = np.zeros((len(time), 3))
    ground[:, axis] = np.cos(speed * time) * np.minimum(time, 1.0)
    turning = np.full(len(time), speed)
    shaken = shake(MACHINE, time, turning, moment=np.zeros((len(time), 2)), phase=np.zeros(2),
                   ground=ground)
    late = time > 4.0
    track = SpeedTrack(time, turning, angle=shaken.angle)
    got = -speed**2 * np.array([demodulate(time[late], column[late], track).displacement[0]
                                for column in shaken.acceleration.T])
    ratio, _ = MACHINE.ground_response(np.array([speed]), speed=speed)
    expected = ratio[0, [MACHINE.channels.index(name) for name in shaken.channels], axis]
    np.testing.assert_allclose(got, expected, rtol=0.02, atol=0.02 * np.abs(ratio).max())


def test_run_up_shows_the_force_of_the_speeding_rotor():
    # Slow enough for the steady response to hold within the tolerance.
    time = np.arange(0.0, 20.0, 1e-3)
    speed = 60.0 + 6.0 * time
    shaken = shake(MACHINE, time, speed, moment=np.tile(MOMENT, (len(time), 1)), phase=PHASE)
    near = (time > 17.0) & (time < 18.0)
    track = SpeedTrack(time, speed, angle=shaken.angle)
    found = demodulate(time[near], shaken.acceleration[near, 1], track)
    expected = MACHINE.unbalance_response(np.array([found.speed]), MOMENT * np.exp(1j * PHASE))
    expected = expected.displacement[0, MACHINE.channels.index(shaken.channels[1])]
    assert found.displacement[0] == pytest.approx(expected, rel=0.03)


def test_force_is_that_of_a_mass_on_a_circle():
    # F = -m r'' of the path m e (sin, cos), differentiated numerically.
    time = np.linspace(0.0, 1.0, 20001)
    angle, speed, rate = 3.0 * time + 4.0 * time**2, 3.0 + 8.0 * time, np.full(20001, 8.0)
    force = unbalance_force(angle, speed, rate, moment=np.array(0.2))
    for got, path in zip(force, (np.sin(angle), np.cos(angle)), strict=True):
        second = np.diff(path, 2) / (time[1] - time[0]) ** 2
        np.testing.assert_allclose(got[1:-1], -0.2 * second, atol=1e-4)  # round-off / step^2


def test_couples_are_refused():
    machine = replace(MACHINE, couples=(MACHINE.rotor.discs[0].name,))
    with pytest.raises(RotorSoilError, match='knows no pedestals and no couples'):
        shake(machine, np.array([0.0, 1e-3]), np.ones(2), moment=np.ones((2, 2)), phase=PHASE)
