"""The machines that a machine may be: each is the case with one number changed by hand."""

import math
from pathlib import Path

import numpy as np
import pytest

from rotorsoil_ros.case.config import load
from rotorsoil_ros.case.models import coupled_model
from rotorsoil_ros.errors import RotorSoilError
from rotorsoil_ros.machine.spread import SoilSpread, UNBALANCE

from machines import SOIL

FAN = Path(__file__).parents[2] / 'config' / 'plant_fan.yaml'
PEDESTAL = ('rotor.bearings.0.pedestal={mass: 80, stiffness: {xx: %g, zz: %g}, '
            'damping: {xx: %g, zz: %g}}')
SPEED = np.array([30.0, 104.0, 150.0])

# What a factor of two makes of the numbers of the fan's file.
CHANGED = {
    'bearing_stiffness_factor': [f'rotor.bearings.{i}.stiffness={{xx: 5.0e8, zz: 1.0e9}}'
                                 for i in (0, 1)],
    'bearing_damping_factor': [f'rotor.bearings.{i}.damping={{xx: 8.0e3, zz: 8.0e3}}'
                               for i in (0, 1)],
    # Its damping ratio is kept: damping grows with the root of the stiffness.
    'pedestal_stiffness_factor': [PEDESTAL % (4e8, 8e8, 2e3 * 2**0.5, 3e3 * 2**0.5)],
    'foundation_mass_factor': ['foundations.0.mass=39160',
                               'foundations.0.inertia=[38.6e3, 21.8e3, 40.4e3]'],
    'rotor_mass_factor': [
        'rotor.discs.0={name: coupling, position: 0.06, mass: 70, diametral_inertia: 0.6, '
        'polar_inertia: 1.0}',
        'rotor.discs.1={name: wheel, position: 1.6, mass: 640, diametral_inertia: 56, '
        'polar_inertia: 102}'],
    'shaft_height_factor': ['rotor.shaft_height=4.0'],
    'shaft_stiffness_factor': ['rotor.material.young_modulus=4.2e11'],
}


def fan(tmp_path, *settings):
    case = load(FAN, [PEDESTAL % (2e8, 4e8, 2e3, 3e3), *settings])
    return coupled_model(case, tmp_path), case.unbalance


@pytest.mark.parametrize('name', CHANGED)
def test_machine_at_the_end_of_an_input_is_the_case_with_that_number_changed(name, tmp_path):
    model, unbalance = fan(tmp_path)
    spread = SoilSpread(**{name: 2.0})
    found = spread.machine(model, {name: 1.0}).unbalance_response(SPEED, unbalance).displacement
    by_hand = fan(tmp_path, *CHANGED[name])[0].unbalance_response(SPEED, unbalance).displacement
    # The blocks' y, which nothing excites, is round-off.
    np.testing.assert_allclose(found, by_hand, rtol=1e-9, atol=1e-9 * np.abs(by_hand).max())
    given = model.unbalance_response(SPEED, unbalance).displacement
    assert np.abs(found - given).max() > 1e-3 * np.abs(given).max()


def test_soil_at_the_ends_of_its_inputs():
    spread = SoilSpread(shear_modulus_factor=3.0, soil_density_factor=1.1)
    stiff = spread.soil(SOIL, {'shear_modulus_factor': 1.0})
    assert stiff.shear_modulus == pytest.approx(3.0 * SOIL.shear_modulus, rel=1e-12)
    assert stiff.density == SOIL.density
    heavy = spread.soil(SOIL, {'soil_density_factor': 1.0, 'poisson_ratio': -1.0,
                               'loss_factor': 1.0})
    assert heavy.density == pytest.approx(1.1 * SOIL.density, rel=1e-12)
    assert heavy.poisson_ratio == pytest.approx(SOIL.poisson_ratio - 0.05)
    assert heavy.loss_factor == pytest.approx(SOIL.loss_factor + 0.03)


def test_places_hold_the_given_machine_and_both_ends_of_every_input_alone():
    spread = SoilSpread(bearing_stiffness_factor=3.0, unbalance_factor=2.5)
    places = spread.places(with_soil=True)
    names = spread.inputs(with_soil=True)
    assert names == ('shear_modulus_factor', 'poisson_ratio', 'loss_factor',
                     'bearing_stiffness_factor', 'unbalance_factor')
    assert len(places) == spread.samples
    assert places[:3] == [{}, {'shear_modulus_factor': -1.0}, {'shear_modulus_factor': 1.0}]
    for name in names[:-1]:
        assert {name: -1.0} in places
        assert {name: 1.0} in places
    assert not any(UNBALANCE in place for place in places)
    together = np.array([list(place.values()) for place in places if len(place) > 1])
    assert together.shape == (64 - 1 - 8, 4)
    # A Latin hypercube: each input is even by itself.
    assert np.all(np.diff(np.sort(together, axis=0), axis=0) < 2.0 * 2.0 / len(together))
    assert places == spread.places(with_soil=True)


def test_few_samples_keep_both_extremes_of_the_soil():
    for samples in (3, 5):
        places = SoilSpread(samples=samples).places(with_soil=True)
        assert len(places) == samples
        modulus = [SoilSpread().soil(SOIL, place).shear_modulus for place in places]
        assert (min(modulus), max(modulus)) == (0.5 * SOIL.shear_modulus,
                                                2.0 * SOIL.shear_modulus)


def test_without_a_soil_and_with_known_bearings_nothing_is_uncertain():
    assert SoilSpread().inputs(with_soil=False) == ()
    assert SoilSpread().places(with_soil=False) == [{}]


@pytest.mark.parametrize('change, rule', [
    ({'shear_modulus_factor': 0.5}, 'shear_modulus_factor must be >= 1 and finite, got 0.5'),
    ({'poisson_ratio': math.nan}, r'poisson_ratio must be in \[0, 0.5\)'),
    ({'loss_factor': -0.1}, r'loss_factor must be in \[0, 1\)'),
    ({'samples': 2}, 'samples must be at least 3, got 2'),
    ({'samples': 10**9}, 'samples must be at most 4096'),
    *(({name: 0.5}, f'{name} must be >= 1 and finite')
      for name in (*CHANGED, 'soil_density_factor', 'unbalance_factor'))])
def test_impossible_spread_is_refused(change, rule):
    with pytest.raises(RotorSoilError, match=rule):
        SoilSpread(**change)
