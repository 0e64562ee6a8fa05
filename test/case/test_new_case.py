"""A case of what a plant knows: it loads, says what it guessed, and is the machine it says."""

from pathlib import Path
import re

import numpy as np
import pytest

from rotorsoil_ros.case import document
from rotorsoil_ros.case.authoring import library, new_case, questions
from rotorsoil_ros.case.authoring.estimates import Estimates
from rotorsoil_ros.case.config import case_of
from rotorsoil_ros.case.models import coupled_model
from rotorsoil_ros.case.plausible import slips
from rotorsoil_ros.errors import InputError
from rotorsoil_ros.machine.modes.campbell import campbell
from rotorsoil_ros.units import rpm_to_rad_s

FAN = {'kind': 'fan', 'power_kw': 75, 'rpm': 990}
RATED = {'fan': (75, 990), 'pump': (55, 2980), 'motor_driven': (400, 1485),
         'turbine': (2000, 8000)}

# All that can be told of a fan, so that little is left to guess.
TOLD = {**FAN, 'name': 'id_fan', 'rotor_mass': 480, 'shaft_diameter': '140 mm',
        'bearing': 'rolling', 'bearing_span': 1.1, 'overhang': 0.45, 'pedestal': 'none',
        'machine_mass': 2100, 'block_width': 2.2, 'block_length': 3.1, 'block_height': 1.05,
        'shaft_height': 1.234567, 'soil': 'dense_sand', 'shear_wave_velocity': 231.5,
        'density': 1893, 'balance_grade': 'G2.5'}


def written(**answers):
    """Return a case, its text and what it was made of."""
    given = questions.checked(answers)
    text = new_case.text_of(given, command='rotorsoil new')
    content = document.parse(text, source='new')
    return case_of(Path('new.yaml'), content), text, content


@pytest.mark.parametrize('kind', library.names(library.MACHINES))
@pytest.mark.parametrize('bearing', library.names(library.BEARINGS))
@pytest.mark.parametrize('soil', ['soft_clay', 'weathered_rock', None])
def test_every_kind_on_every_bearing_loads_and_looks_like_a_machine(kind, bearing, soil):
    power, rpm = RATED[kind]
    answers = {'kind': kind, 'power_kw': power, 'rpm': rpm, 'bearing': bearing}
    case, text, _ = written(**answers, **({'soil': soil} if soil else {}))
    assert list(slips(case)) == []
    assert case.speed_range[0] < rpm_to_rad_s(rpm) < case.speed_range[1]
    assert max(map(len, text.splitlines())) < 260


def test_what_is_told_stands_there_as_it_was_told():
    case, text, content = written(**TOLD)
    assert case.name == 'id_fan'
    assert content['soil']['shear_wave_velocity'] == 231.5
    assert content['soil']['density'] == 1893
    block = case.foundations[0]
    assert (2.0 * block.contact.half_width, 2.0 * block.contact.half_length) == (2.2, 3.1)
    assert case.rotor.shaft_height == pytest.approx(1.05 + 1.234567, rel=1e-9)
    assert case.rotor.shaft[0].outer_diameter == (0.14, 0.14)
    # Four digits of the wheel, which is what is left of the rotor's mass.
    assert case.rotor.mass == pytest.approx(480.0, rel=1e-3)
    assert block.mass == pytest.approx(2400.0 * 2.2 * 3.1 * 1.05 + 2100.0, rel=1e-3)
    near, far = (bearing.position for bearing in case.rotor.bearings)
    assert far - near == pytest.approx(1.1, rel=1e-3)
    assert case.rotor.discs[1].position - far == pytest.approx(0.45, rel=1e-3)
    assert abs(case.unbalance[1]) == pytest.approx(2.5e-3 * 480.0 / rpm_to_rad_s(990), rel=1e-3)
    for key in ('shear_wave_velocity', 'density', 'half_width', 'height', 'grade'):
        [line] = re.findall(rf'.*\b{key}: .*', text)
        assert new_case.MARK not in line


GUESSED = {'rotor_mass': 'rotor_mass_factor', 'balance_grade': 'unbalance_factor',
           'shaft_diameter': 'shaft_stiffness_factor', 'overhang': 'shaft_stiffness_factor',
           'bearing_span': 'shaft_stiffness_factor', 'shaft_height': 'shaft_height_factor',
           'density': 'soil_density_factor'}


@pytest.mark.parametrize('key', GUESSED)
def test_a_guess_enters_the_uncertainty_and_what_is_told_does_not(key):
    told = written(**TOLD)[0].uncertainty
    guessed = written(**{name: value for name, value in TOLD.items()
                         if name != key})[0].uncertainty
    assert getattr(told, GUESSED[key]) == 1.0
    assert getattr(guessed, GUESSED[key]) > 1.0


def test_what_nobody_can_tell_is_always_uncertain():
    spread = written(**TOLD)[0].uncertainty
    assert spread.bearing_stiffness_factor == 2.0
    assert spread.bearing_damping_factor == 3.2
    assert 1.0 < spread.foundation_mass_factor < 1.1
    assert spread.shear_modulus_factor == 1.5  # of a measured velocity
    assert spread.pedestal_stiffness_factor == 1.0  # there is none
    assert written(**FAN)[0].uncertainty.pedestal_stiffness_factor == 2.5


def test_range_of_a_class_of_soil_is_the_range_of_its_velocity():
    case, _, _ = written(**FAN, soil='gravel', block_width=2, block_length=3, block_height=1)
    spread, soil = case.uncertainty, case.soil
    for end, velocity in ((-1.0, 250.0), (1.0, 500.0)):
        other = spread.soil(soil, {'shear_modulus_factor': end})
        # The middle is rounded to two digits.
        assert other.shear_wave_speed == pytest.approx(velocity, rel=0.02)


def test_mark_stands_at_every_number_that_is_guessed():
    _, text, content = written(**FAN)
    numbers = [line for line in text.split('uncertainty:')[0].splitlines()[4:]
               if re.search(r'\d', line) and not line.strip().startswith(('name', '#'))]
    told = [line for line in numbers if new_case.MARK not in line]
    assert told == []
    assert set(content['uncertainty']) == {
        key for key, _, _ in Estimates(questions.checked(FAN)).spreads()}


@pytest.mark.parametrize('answers', [
    {**FAN}, {**FAN, 'rotor_mass': 500},
    {'kind': 'motor_driven', 'power_kw': 400, 'rpm': 1485, 'bearing_span': 1.6},
    {'kind': 'motor_driven', 'power_kw': 400, 'rpm': 1485, 'bearing_span': 1.6,
     'rotor_mass': 900}])
def test_shaft_bends_where_the_rule_puts_it(answers, tmp_path):
    _, _, content = written(**answers, pedestal='none', bearing='rolling')
    content |= {'support': {'model': 'rigid'}, 'foundations': []}
    for bearing in content['rotor']['bearings']:
        bearing['stiffness'] = {'xx': 1e12, 'zz': 1e12}
    case = case_of(Path('new.yaml'), content)
    found = campbell(coupled_model(case, tmp_path), np.array([0.0]), 1)
    first = found.omega[0, 0] / rpm_to_rad_s(answers['rpm'])
    # The rule has no shear, no coupling, no mass of an overhung shaft, and rounds the diameter.
    assert first == pytest.approx(2.0, rel=0.15)


def test_ground_is_solved_as_well_as_it_can_be_at_the_speeds(tmp_path):
    fast = written(kind='turbine', power_kw=5000, rpm=30000, soil='soft_clay', block_width=6,
                   block_length=9, block_height=2, bearing='rolling')[0]
    assert fast.support.model == 'cone'
    assert written(**FAN)[0].support.model == 'boundary_elements'


def test_everything_that_is_wrong_is_told_at_once():
    with pytest.raises(InputError) as error:
        questions.checked({
            'kind': 'fann', 'power_kw': -75, 'rpm': 'abc', 'shaft_diameter': 140,
            'blok_width': 2, 'density': 1.95, 'bearing_span': 4, 'block_length': 3,
            'balance_grade': 6.3, 'block_height': float('nan')})
    lines = str(error.value).splitlines()
    assert len(lines) == 9
    for part in ('blok_width: is not a known key; did you mean block_width?',
                 "kind: must be 'fan', 'pump', 'motor_driven' or 'turbine', got 'fann'",
                 "rpm: must be a finite number in rpm, got 'abc'", 'power_kw: -75 kW',
                 'shaft_diameter: 140 m is outside 0.005 to 3 m: did you mean 0.14?',
                 'density: 1.95 kg/m^3 is outside 800 to 3500 kg/m^3: did you mean 1950?',
                 'bearing_span: must be at most the length of the block, 3 m',
                 'balance_grade: must be a balance grade', 'block_height: must be a finite'):
        assert any(part in line for line in lines), part


@pytest.mark.parametrize('missing', ['kind', 'power_kw', 'rpm'])
def test_what_has_to_be_told_is_asked_for(missing):
    with pytest.raises(InputError, match=f'--answer: {missing}: is missing'):
        questions.checked({key: value for key, value in FAN.items() if key != missing})


def test_rotor_that_weighs_less_than_its_shaft_is_refused():
    with pytest.raises(InputError, match=r'rotor_mass: must be more than .* got 20 kg'):
        written(**FAN, rotor_mass=20, shaft_diameter=0.14)


def test_settings_are_read_as_yaml_and_each_once():
    assert questions.parsed(['rpm=990', 'shaft_diameter=140 mm']) == {
        'rpm': 990, 'shaft_diameter': '140 mm'}
    with pytest.raises(InputError, match=r'rpm: must be KEY=VALUE\n.*rpm is answered twice'):
        questions.parsed(['rpm', 'rpm=1', 'rpm=2'])
