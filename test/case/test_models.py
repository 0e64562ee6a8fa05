"""Models of a case and their tables: computed once, found again, never mixed up."""

from pathlib import Path

import numpy as np
import pytest

from rotorsoil_ros.case import models
from rotorsoil_ros.case.config import load
from rotorsoil_ros.case.models import coupled_model, response_key, response_table
from rotorsoil_ros.errors import InputError
from rotorsoil_ros.ground.half_space import InfiniteElementModel

PAPER = Path(__file__).resolve().parents[2] / 'config' / 'paper_rotor.yaml'
ELEMENTS = 'support.model=infinite_elements'


@pytest.fixture(scope='module')
def cache(tmp_path_factory):
    """Return a cache directory that the tests of this file share."""
    return tmp_path_factory.mktemp('cache')


def key(cache, *settings):
    """Return the response key of the paper's machine with some settings."""
    case = load(PAPER, settings)
    return response_key(case, coupled_model(case, cache))


def test_table_from_the_cache_is_the_computed_one(cache, monkeypatch):
    case = load(PAPER, ['speed_range_rpm=[600, 1200]'])
    model = coupled_model(case, cache)
    computed = response_table(case, model, cache)

    def fail(*_):
        raise AssertionError('computed again')

    monkeypatch.setattr(models.ResponseTable, 'build', fail)
    loaded = response_table(case, model, cache)
    assert loaded.key == computed.key == response_key(case, model)
    speed = np.linspace(*case.speed_range, 7)
    np.testing.assert_array_equal(
        loaded.predictor(case.unbalance).predict(speed).displacement,
        computed.predictor(case.unbalance).predict(speed).displacement)


@pytest.mark.parametrize('setting, same', [
    ('name=other', True), ('unbalances.0.moment=3e-5', True),
    ('soil.shear_modulus=47e6', False), ('support.model=rigid', False),
    ('foundations.0.mass=43', False), ('rotor.bearings.0.damping.xx=501', False),
    ('speed_range_rpm=[60, 9001]', False)])
def test_response_key_knows_everything_but_the_unbalance(cache, setting, same):
    assert (key(cache, setting) == key(cache)) is same


def test_response_key_knows_the_kind_and_the_stiffness_of_infinite_elements(cache):
    keys = {key(cache), key(cache, ELEMENTS), key(cache, ELEMENTS, 'soil.shear_modulus=50e6')}
    assert len(keys) == 3


def test_infinite_elements_are_solved_once_for_all_stiffnesses(cache, monkeypatch):
    coupled_model(load(PAPER, [ELEMENTS]), cache)

    def fail(*_, **__):
        raise AssertionError('solved again')

    monkeypatch.setattr(models.InfiniteElementModel, 'solved', fail)
    again = coupled_model(load(PAPER, [ELEMENTS]), cache)
    stiffer = coupled_model(load(PAPER, [ELEMENTS, 'soil.shear_modulus=53e6',
                                         'soil.density=2000']), cache)
    omega = np.array([100.0, 400.0])
    assert isinstance(again.soil_models[0], InfiniteElementModel)
    # Equal a0: compliance goes with 1 / G.
    ratio = np.sqrt(53e6 / 2000.0 / (48e6 / 1900.0))
    np.testing.assert_allclose(53e6 * stiffer.soil_models[0].compliance(ratio * omega),
                               48e6 * again.soil_models[0].compliance(omega), rtol=1e-9)


def test_cone_and_infinite_elements_answer_alike(cache):
    # Within what cones are off by (theory manual, cones): 25 % of stiffness.
    case = load(PAPER)
    omega = np.array([50.0, 300.0])
    cone, elements = (coupled_model(load(PAPER, settings), cache).soil_models[0].compliance(omega)
                      for settings in ([], [ELEMENTS]))
    for dof in range(6):
        np.testing.assert_allclose(np.abs(cone[:, dof, dof]), np.abs(elements[:, dof, dof]),
                                   rtol=0.25)
    assert case.support.model == 'cone'


@pytest.mark.parametrize('settings, fault', [
    (['soil.poisson_ratio=0.495'], r'soil\.poisson_ratio: must be in \[0, 0\.49\]'),
    (['speed_range_rpm=[60, 90000]'], r'foundations\.0: a0 must be <= 20'),
    (['support.geometry=plane_strain', 'speed_range_rpm=[0, 9000]'],
     r'foundations\.0: a0 must be >= 0\.005'),
    (['support.geometry=plane_strain', 'foundations.0.radius=0.5', 'foundations.0.half_width=',
      'foundations.0.half_length='], r'foundations\.0: geometry plane_strain must have a rect')])
def test_what_infinite_elements_cannot_do_is_refused_in_one_line(settings, fault):
    with pytest.raises(InputError, match=fault):
        load(PAPER, [ELEMENTS, *settings])
