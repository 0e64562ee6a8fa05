"""Identification against synthetic truth, and its refusal where a run cannot tell."""

import numpy as np
import pytest

from rotorsoil_ros.errors import NotSolvedError, RotorSoilError
from rotorsoil_ros.ground.cone import ConeModel
from rotorsoil_ros.ground.soil import Rectangle, Soil
from rotorsoil_ros.machine.coupled import CoupledModel
from rotorsoil_ros.machine.foundation import Foundation
from rotorsoil_ros.monitor.identify import identify, identify_unbalance
from rotorsoil_ros.rotor.assembly import Rotor
from rotorsoil_ros.rotor.disc import Disc
from rotorsoil_ros.rotor.shaft import Material, ShaftSection

from machines import bearing

STEEL = Material(2.1e11, 0.3, 7850.0)
SENSORS = ('left_housing_x', 'left_housing_z', 'right_housing_x', 'right_housing_z')
TRUTH = np.array([0.030 * np.exp(0.8j), 0.012 * np.exp(-1.9j)])


def fan(modulus):
    """Return a fan of 3 t on a block 2 m x 3 m x 1.2 m, 2 m up, on soil of a shear modulus."""
    rotor = Rotor(
        2.0, (ShaftSection(2.0, (0.16, 0.16), (0.0, 0.0), 12, STEEL),),
        (Disc('one', 0.6, 400.0, 30.0, 55.0), Disc('two', 2.0, 150.0, 8.0, 14.0)),
        (bearing('left', 0.1, stiffness=np.diag([2.5e8, 5e8]), damping=4e3),
         bearing('right', 1.5, stiffness=np.diag([2.5e8, 5e8]), damping=4e3)))
    block = Foundation('block', Rectangle(1.0, 1.5), 0.9, 19580.0, 0.74, (19.3e3, 10.9e3, 20.2e3))
    soil = Soil(modulus, 0.3, 1900.0, 0.05)
    return CoupledModel(rotor, (block,), (ConeModel(soil, block.contact),))


def unit_response(model, speed):
    """Return the sensors' displacement per unit unbalance, (n, c, p)."""
    rows = [model.channels.index(name) for name in SENSORS]
    return np.stack([model.unbalance_response(speed, plane).displacement[:, rows]
                     for plane in np.eye(2, dtype=complex)], axis=-1)


def noisy(values, share, seed):
    """Return vectors with complex noise of a share of each channel's size."""
    random = np.random.default_rng(seed)
    noise = random.normal(size=values.shape) + 1j * random.normal(size=values.shape)
    return values + share / np.sqrt(2.0) * np.sqrt(np.mean(np.abs(values) ** 2, axis=0)) * noise


RUN_DOWN = np.linspace(40.0 * 2.0 * np.pi, 6.0 * 2.0 * np.pi, 60)
SPAN = 2.0  # factor on G that one standard deviation of the prior stands for


def identify_modulus(speed, measured):
    """Identify G and the unbalance from a run, starting at twice the true G."""
    return identify(lambda factor: unit_response(fan(160e6 * factor[0]), speed), measured,
                    names=['soil.shear_modulus'], prior_deviation=np.log(SPAN))


def test_unbalance_is_found_exactly_without_noise():
    response = unit_response(fan(80e6), RUN_DOWN)
    found = identify_unbalance(response, response @ TRUTH)
    np.testing.assert_allclose(found.moment, TRUTH, rtol=1e-9)
    assert found.explained == pytest.approx(1.0)


@pytest.mark.parametrize('seed', range(3))
def test_run_down_through_resonance_tells_unbalance_and_soil(seed):
    # The promise: unbalance within 3 %, G within 5 %, at 5 % noise.
    measured = noisy(unit_response(fan(80e6), RUN_DOWN) @ TRUTH, 0.05, seed)
    measured[7, 2] = np.nan
    found = identify_modulus(RUN_DOWN, measured)
    assert abs(160e6 * found.factor[0] / 80e6 - 1.0) < 0.05
    assert np.all(np.abs(found.unbalance.moment - TRUTH) < 0.03 * np.abs(TRUTH).max())
    # Stated uncertainties cover the error (four of them: one in 16 000) and are not empty words.
    assert abs(np.log(2.0 * found.factor[0])) < 4.0 * found.log_deviation[0]
    assert np.all(np.abs(found.unbalance.moment - TRUTH)
                  < 4.0 * np.sqrt(2.0) * found.unbalance.deviation + 0.02 * np.abs(TRUTH))
    assert found.log_deviation[0] < 0.03
    assert found.correlation.shape == (5, 5)
    np.testing.assert_allclose(np.diagonal(found.correlation), 1.0)


def test_run_far_above_the_block_resonance_cannot_tell_the_soil():
    speed = np.full(4, 300.0 * 2.0 * np.pi) + np.arange(4.0)
    measured = noisy(unit_response(fan(80e6), speed) @ TRUTH, 0.3, 1)
    with pytest.raises(NotSolvedError, match='the run cannot tell'):
        identify_modulus(speed, measured)


def test_one_speed_with_one_sensor_cannot_tell_two_planes():
    response = unit_response(fan(80e6), np.array([150.0, 150.001, 150.002]))
    measured = response @ TRUTH
    measured[:, 1:] = np.nan
    with pytest.raises(NotSolvedError, match='cannot tell the 2 planes apart: condition'):
        identify_unbalance(response, measured)


def test_too_few_vectors_are_refused():
    response = unit_response(fan(80e6), np.array([150.0]))
    measured = np.full((1, 4), np.nan, dtype=complex)
    measured[0, 0] = 1e-6
    with pytest.raises(NotSolvedError, match='2 unbalance planes need more than as many vectors'):
        identify_unbalance(response, measured)


def test_prior_without_spread_is_refused():
    with pytest.raises(RotorSoilError, match='prior_deviation must be > 0, got 0'):
        identify(lambda factor: np.ones((3, 1, 1)), np.ones((3, 1)), names=['a'],
                 prior_deviation=0.0)


def test_truth_far_from_the_start_is_found():
    # A shaft resonance moved by a factor 6: the peaks do not overlap, no slope leads there.
    speed = np.linspace(20.0, 120.0, 80)

    def respond(factor):
        natural = 90.0 * np.sqrt(factor[0])
        return (speed**2 / (natural**2 - speed**2 + 0.02j * natural * speed))[:, None, None]

    measured = respond(np.array([1.0 / 6.0]))[:, :, 0] * 3e-6
    found = identify(respond, measured, names=['k'], prior_deviation=np.log(2.0))
    assert found.factor[0] == pytest.approx(1.0 / 6.0, rel=1e-3)


def test_model_that_explains_nothing_is_refused():
    speed = np.linspace(20.0, 120.0, 80)
    measured = np.exp(1j * np.random.default_rng(0).uniform(0.0, 6.3, size=(80, 1)))

    def respond(factor):
        natural = 90.0 * np.sqrt(factor[0])
        return (speed**2 / (natural**2 - speed**2 + 0.02j * natural * speed))[:, None, None]

    with pytest.raises(NotSolvedError, match='no value of k explains the run: the best leaves'):
        identify(respond, measured, names=['k'], prior_deviation=np.log(2.0))
