"""What a case file may leave out or write its own way, and how all its faults are told."""

import math
from pathlib import Path

import numpy as np
import pytest

from rotorsoil_ros.case.authoring import library
from rotorsoil_ros.case.config import load
from rotorsoil_ros.errors import InputError

CONFIG = Path(__file__).parents[2] / 'config'
FAN = CONFIG / 'plant_fan.yaml'


def faults_of(*settings):
    with pytest.raises(InputError) as caught:
        load(FAN, settings)
    return [line.removeprefix(f'{FAN}: ') for line in str(caught.value).splitlines()]


@pytest.mark.parametrize('key, text, value', [
    ('soil.shear_modulus', '"100 MPa"', 100e6), ('soil.shear_modulus', '"48 MN/m^2"', 48e6),
    ('soil.density', '"1.95 t/m^3"', 1950.0), ('rotor.shaft.0.outer_diameter', '"140 mm"', 0.14),
    ('foundations.0.mass', '"19.58 t"', 19580.0), ('rotor.bearings.0.stiffness.xx',
                                                  '"250 N/um"', 2.5e8),
    ('unbalances.0.moment', '"28 kg mm"', 0.028), ('unbalances.0.phase', '"90 deg"', math.pi / 2),
    ('soil.loss_factor', '"5 %"', 0.05)])
def test_number_may_carry_its_unit(key, text, value):
    by_unit, by_number = load(FAN, [f'{key}={text}']), load(FAN, [f'{key}={value!r}'])
    assert by_unit.soil.shear_modulus == pytest.approx(by_number.soil.shear_modulus, rel=1e-14)
    assert by_unit.soil.density == pytest.approx(by_number.soil.density, rel=1e-14)
    assert by_unit.soil.loss_factor == pytest.approx(by_number.soil.loss_factor, rel=1e-14)
    assert by_unit.foundations[0].mass == pytest.approx(by_number.foundations[0].mass, rel=1e-14)
    np.testing.assert_allclose(by_unit.rotor.shaft[0].outer_diameter,
                               by_number.rotor.shaft[0].outer_diameter, rtol=1e-14)
    np.testing.assert_allclose(by_unit.rotor.bearings[0].stiffness,
                               by_number.rotor.bearings[0].stiffness, rtol=1e-14)
    np.testing.assert_allclose(by_unit.unbalance, by_number.unbalance, rtol=1e-14, atol=1e-18)


@pytest.mark.parametrize('text', ['["100 rpm", "1800 rpm"]', '["100 rpm", "30 Hz"]',
                                  '["600 deg/s", "188.49555921538757 rad/s"]'])
def test_speed_may_be_told_in_turns_or_angles(text):
    np.testing.assert_allclose(load(FAN, [f'speed_range_rpm={text}']).speed_range,
                               np.array([100.0, 1800.0]) * math.pi / 30.0, rtol=1e-12)


@pytest.mark.parametrize('text, said', [
    ('"1 m"', "got '1 m', which is none of that"),
    ('"5 bananas"', "got '5 bananas', a unit that is not known"),
    ('"12"', "got '12'"), ('"1,5 MPa"', "got '1,5 MPa'"), ('"9**9**9 Pa"', "got '9**9**9 Pa'"),
    ('"__import__(os)"', "got '__import__(os)'")])
def test_wrong_unit_is_told_with_the_right_one(text, said):
    assert faults_of(f'soil.shear_modulus={text}') == [
        f'soil.shear_modulus: must be a finite number in Pa, {said}']


def test_soil_by_its_wave_velocity_is_that_by_its_modulus():
    case = load(FAN, ['soil={shear_wave_velocity: 200.0, poisson_ratio: 0.3, density: 1900.0, '
                      'loss_factor: 0.05}'])
    assert case.soil.shear_modulus == pytest.approx(1900.0 * 200.0**2, rel=1e-15)
    assert case.soil.shear_wave_speed == pytest.approx(200.0, rel=1e-15)


def test_soil_says_its_stiffness_once():
    assert faults_of('soil.shear_wave_velocity=200') == [
        'soil: needs either shear_modulus in Pa or shear_wave_velocity in m/s, got both']
    assert faults_of('soil={poisson_ratio: 0.3, density: 1900, loss_factor: 0.05}') == [
        'soil: needs either shear_modulus in Pa or shear_wave_velocity in m/s, got neither']


BLOCK = ('foundations=[{name: block, half_width: 1.0, half_length: 1.5, height: 1.2, '
         'density: 2400.0%s}]')


def test_solid_block_follows_from_its_size_and_density():
    [block] = load(FAN, [BLOCK % '']).foundations
    mass = 2400.0 * 2.0 * 3.0 * 1.2
    assert block.mass == pytest.approx(mass, rel=1e-14)
    assert block.centre_of_gravity_height == 0.6
    # m (a^2 + b^2) / 12 of a cuboid of 2 m x 3 m x 1.2 m
    np.testing.assert_allclose(block.inertia, [
        mass * (3.0**2 + 1.2**2) / 12.0, mass * (2.0**2 + 1.2**2) / 12.0,
        mass * (2.0**2 + 3.0**2) / 12.0], rtol=1e-14)


def test_solid_cylinder_follows_likewise():
    [block] = load(FAN, ['foundations=[{name: block, radius: 1.5, height: 1.0, density: 2400.0}]'
                         ]).foundations
    mass = 2400.0 * math.pi * 1.5**2
    np.testing.assert_allclose(block.inertia, [
        mass * (3.0 * 1.5**2 + 1.0) / 12.0] * 2 + [0.5 * mass * 1.5**2], rtol=1e-14)


def test_what_is_given_of_a_block_is_kept():
    [block] = load(FAN, [BLOCK % ', centre_of_gravity_height: 0.7']).foundations
    assert block.centre_of_gravity_height == 0.7


@pytest.mark.parametrize('block, fault', [
    ('{name: block, radius: 1.0, height: 1.0}',
     'foundations.0.mass: needs a value in kg, or density in kg/m^3 and height in m, and neither '
     'is there'),
    ('{name: block, radius: 1.0, height: 1.0, density: 2400, mass: 1}',
     'foundations.0.mass: needs a value in kg, or density in kg/m^3 and height in m, got both'),
    ('{name: block, radius: 1.0, density: 2400}',
     'foundations.0.mass: is missing, and so is height in m, of which it would follow'),
    ('{name: block, radius: 1.0, mass: 2400, inertia: [1, 1, 1]}',
     'foundations.0.centre_of_gravity_height: is missing, and so is height in m, of which it '
     'would follow')])
def test_block_that_does_not_follow_is_told(block, fault):
    assert faults_of(f'foundations=[{block}]') == [fault]


@pytest.mark.parametrize('name', ['steel', 'stainless_steel', 'cast_iron', 'aluminium'])
def test_material_may_be_called_by_its_name(name):
    case = load(FAN, [f'rotor.material={name}', 'rotor.shaft.1.material=steel'])
    assert case.rotor.shaft[1].material.young_modulus == 2.1e11
    assert case.rotor.shaft[0].material == library.material(name)


def test_unknown_material_is_told_with_those_that_are_known():
    [fault] = faults_of('rotor.material=stele')
    assert fault.startswith('rotor.material: must be ')
    assert "'steel'" in fault


def test_all_wrong_kinds_are_told_at_once():
    assert faults_of('soil.shear_modulos=1', 'soil.shear_modulus=', 'soil.density=heavy',
                     'rotor.shaft_height="2 kg"', 'foundations.0.massa=3') == [
        'soil.shear_modulos: is not a known key; did you mean shear_modulus?',
        "soil.density: must be a finite number in kg/m^3, got 'heavy'",
        'foundations.0.massa: is not a known key; did you mean mass?',
        "rotor.shaft_height: must be a finite number in m, got '2 kg', which is none of that"]


def test_all_wrong_values_are_told_at_once():
    assert faults_of('soil.density=-1', 'foundations.0.mass=-2', 'rotor.shaft.0.length=0',
                     'rotor.discs.1.mass=-3', 'rotor.bearings.0.foundation=other',
                     'unbalances.0.disc=wheell', 'speed_range_rpm=[5, 4]') == [
        'soil.density: must be > 0 kg/m^3 and finite, got -1',
        'speed_range_rpm: must be two rising speeds >= 0 rpm, got [5, 4]',
        'rotor.shaft.0.length: must be > 0 m and finite, got 0',
        'rotor.discs.1.mass: must be >= 0 kg and finite, got -3',
        'rotor.bearings.0.foundation: must be one of block, got other',
        'foundations.0.mass: must be >= 0 kg and finite, got -2',
        'unbalances.0.disc: must be one of coupling, wheel, got wheell']


def test_misspelled_key_is_not_missing_too():
    assert faults_of('soil={shear_modulus: 1e8, poison_ratio: 0.3, density: 1900, '
                     'loss_factor: 0.05}') == [
        'soil.poison_ratio: is not a known key; did you mean poisson_ratio?']
