"""What a running machine is judged by: from the case, and the same out of the cache."""

from pathlib import Path

import numpy as np
import pytest

from rotorsoil_ros.case import config, models
from rotorsoil_ros.errors import InputError
from rotorsoil_ros.monitor.criteria import compute_aside, criteria, Expectation, stored_criteria

FAN = Path('config/plant_fan.yaml')
KIT = Path('config/rk4_rotor_kit.yaml')
FEW = ['uncertainty.samples=4', 'speed_range_rpm=[600, 1800]']


def loaded(file, overrides=()):
    case = config.load(file, overrides)
    return case, models.coupled_model(case, Path('not needed'))


def test_criteria_are_those_of_the_expectation(tmp_path):
    case, model = loaded(FAN, FEW)
    found = criteria(case, model, 2.0 * case.unbalance, tmp_path)
    expectation = Expectation.of(case, tmp_path)
    band = expectation.band.envelope(2.0 * case.unbalance)
    np.testing.assert_array_equal(found.envelope.high, band.high)
    assert list(found.resonances) == expectation.resonances
    assert found.lowest_natural_speed('z') == expectation.lowest_natural_speed('z')


def test_another_process_leaves_them_for_exactly_this_unbalance(tmp_path):
    case, model = loaded(KIT)
    unbalance = case.unbalance * np.exp(0.1j)
    assert stored_criteria(case, model, unbalance, tmp_path) is None
    child = compute_aside(KIT, unbalance, tmp_path)
    assert child.has_ended(wait_s=600.0)
    assert (child.failure, child.said) == ('', '')
    found = stored_criteria(case, model, unbalance, tmp_path)
    assert found.envelope is None  # a bench knows of no soil
    assert found.resonances[0].speed == pytest.approx(2024 * np.pi / 30, rel=0.05)
    assert stored_criteria(case, model, 1.01 * unbalance, tmp_path) is None


def test_case_that_is_wrong_is_told_in_one_line(tmp_path):
    wrong = tmp_path / 'wrong.yaml'
    wrong.write_text(FAN.read_text().replace('model: cone', 'model: sponge'))
    child = compute_aside(wrong, np.array([1.0 + 0j]), tmp_path)
    assert child.has_ended(wait_s=600.0)
    assert child.failure.startswith(f'{wrong}: support.model: ')


@pytest.mark.parametrize('setting, problem', [
    ('uncertainty.samples=2', 'uncertainty.samples: must be at least 3, got 2'),
    ('uncertainty.shear_modulus_factor=0.5',
     'uncertainty.shear_modulus_factor: must be >= 1 and finite, got 0.5'),
    ('uncertainty.loss_factor=x', 'uncertainty.loss_factor: must be a finite number'),
    ('zones.group=3', 'zones.group: must be 1 or 2, got 3'),
    ('zones={label: own}', 'zones: needs label, rigid and flexible together'),
    ('zones={group: 1, label: own}', 'zones: needs either group, or label, rigid and flexible'),
    ('zones={label: own, rigid: [1e-3, 2e-3, 3e-3], flexible: [3e-3, 2e-3, 1e-3]}',
     'zones.flexible: must be three rising velocities > 0 m/s'),
    ('zones={label: own, rigid: [1e-3, 2e-3], flexible: [1e-3, 2e-3, 3e-3]}', 'zones.rigid')])
def test_rules_of_the_case_are_checked(setting, problem):
    with pytest.raises(InputError) as error:
        config.load(FAN, [setting])
    assert f'{FAN}: {problem}' in str(error.value)


def test_the_case_says_how_it_is_judged():
    own = 'zones={label: own, rigid: [1e-3, 2e-3, 3e-3], flexible: [2e-3, 3e-3, 4e-3]}'
    case = config.load(FAN, [own, 'uncertainty={loss_factor: 0.01, samples: 5}'])
    assert (case.zones.label, case.zones.of('rigid')) == ('own', (1e-3, 2e-3, 3e-3))
    assert (case.uncertainty.loss_factor, case.uncertainty.samples) == (0.01, 5)
    assert case.uncertainty.shear_modulus_factor == 2.0
    assert config.load(FAN, ['zones.group=1']).zones.label.endswith('group 1')


