"""Slips of a unit that a case may hold: each is asked about with what was probably meant."""

from pathlib import Path

import pytest

from rotorsoil_ros.case.config import load
from rotorsoil_ros.case.plant.together import sources_of
from rotorsoil_ros.case.plausible import slips
from rotorsoil_ros.cli import main
from rotorsoil_ros.errors import InputError

CONFIG = Path(__file__).parents[2] / 'config'
FAN = CONFIG / 'plant_fan.yaml'


@pytest.mark.parametrize('path', sorted(CONFIG.glob('*.yaml')), ids=lambda path: path.stem)
def test_shipped_cases_raise_no_question(path):
    for name in sources_of(path) or [None]:
        case = load(path, [f'source={name}'] if name else [])
        assert list(slips(case)) == []


@pytest.mark.parametrize('setting, asked', [
    ('soil.density=1.95', 'soil.density: 1.95 kg/m^3 is outside 800 to 3500 kg/m^3: did you mean '
                          '1950?'),
    ('soil.shear_modulus=100', 'soil.shear_modulus: 100 Pa is outside 2e+05 to 5e+10 Pa: did you '
                               'mean 1e+08?'),
    ('foundations.0.mass=10.8', 'foundations.0.mass: 10.8 kg below a rotor of 691.9 kg: did you '
                                'mean 10800?'),
    ('foundations.0.mass=100', 'foundations.0.mass: 100 kg in its volume make 13.89 kg/m^3'),
    ('rotor.bearings.1.stiffness.zz=300', 'rotor.bearings.1.stiffness.zz: 300 N/m is outside '
                                          '10000 to 1e+13 N/m: did you mean 3e+08?'),
    ('foundations.0.inertia=[1, 1, 1]', 'foundations.0.inertia: [1, 1, 1] kg m^2 of 19580 kg'),
    ('rotor.shaft_height=0.8', 'rotor.shaft_height: 0.8 m is not above the top of block, 1.2 m; '
                               'it counts from the contact: did you mean 2?'),
    ('rotor.material={young_modulus: 210e9, poisson_ratio: 0.3, density: 7.85}',
     'density of its material: 7.85 kg/m^3 is outside 1000 to 20000 kg/m^3: did you mean 7850?'),
    ('rotor.material={young_modulus: 210e3, poisson_ratio: 0.3, density: 7850}',
     'young_modulus of its material: 2.1e+05 Pa is outside 1e+09 to 1e+12 Pa: did you mean '
     '2.1e+11?'),
    ('rotor.shaft.0.outer_diameter=5', 'rotor.shaft.0.outer_diameter: 5 m is outside 0.0005 to 3 '
                                       'm: did you mean 0.005?'),
    ('unbalances.0.moment=28', 'did you mean 0.028 (given in kg mm)')])
def test_slip_of_a_unit_is_asked_about(setting, asked):
    assert any(asked in line for line in slips(load(FAN, [setting])))


def test_shaft_in_millimetres_is_refused_with_what_was_meant():
    with pytest.raises(InputError, match=r'did you mean a diameter of 0\.14 m\?'):
        load(FAN, ['rotor.shaft.2.outer_diameter=140'])


def test_check_asks(capsys):
    main(['check', str(FAN), '--set', 'soil.density=1.95'])
    assert 'warning: soil.density: 1.95 kg/m^3' in capsys.readouterr().out
