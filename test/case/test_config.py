"""Case files: what they mean, and how they are refused."""

import math
from pathlib import Path

import numpy as np
import pytest

from rotorsoil_ros.case.cache import Cache
from rotorsoil_ros.case.config import load
from rotorsoil_ros.case.design.below import soil_models
from rotorsoil_ros.case.models import coupled_model
from rotorsoil_ros.case.summary import warnings
from rotorsoil_ros.errors import InputError
from rotorsoil_ros.ground.cone import ConeModel
from rotorsoil_ros.ground.soil import Circle, Rectangle, RigidSoil

PAPER = Path(__file__).parents[2] / 'config' / 'paper_rotor.yaml'
NO_CACHE = Path('no cache is needed for cones')


def test_speeds_are_rad_per_second():
    assert load(PAPER).speed_range == pytest.approx((2.0 * math.pi, 300.0 * math.pi))


def test_unbalances_on_one_disc_add_up_in_the_order_of_the_discs():
    case = load(PAPER, [
        'unbalances=[{disc: disc_2, moment: 3e-5, phase: 0.5}, {disc: disc_1, moment: 1e-5},'
        '{disc: disc_2, moment: 4e-5, phase: 2.070796326794897}]'])
    # 3 and 4 at a right angle are 5
    expected = [1e-5, 5e-5 * np.exp(1j * (0.5 + math.atan2(4.0, 3.0)))]
    np.testing.assert_allclose(case.unbalance, expected, rtol=1e-12)  # round-off


def test_each_foundation_has_the_soil_of_its_own_contact():
    second = ('{name: other, radius: 0.3, mass: 1, centre_of_gravity_height: 0, '
              'inertia: [1, 1, 1]}')
    case = load(PAPER, [
        'rotor.bearings.1.foundation=other',
        f'foundations=[{{name: block, half_width: 0.5, half_length: 0.2, mass: 42, '
        f'centre_of_gravity_height: 0.1, inertia: [1, 2, 3]}}, {second}]'])
    assert case.soil is not None
    assert soil_models(case, Cache(NO_CACHE)) == (ConeModel(case.soil, Rectangle(0.5, 0.2)),
                                           ConeModel(case.soil, Circle(0.3)))


def test_block_stands_under_the_middle_of_its_bearings_by_default():
    case = load(PAPER, ['foundations.0.centre_y=', 'rotor.bearings.0.position=0.1'])
    assert case.foundations[0].centre_y == pytest.approx(0.5 * (0.1 + 0.571515))
    assert load(PAPER, ['foundations.0.centre_y=0.2']).foundations[0].centre_y == 0.2


def test_bearing_without_foundation_stands_on_the_only_one():
    case = load(PAPER, ['rotor.bearings.0.foundation='])
    assert [bearing.foundation for bearing in case.rotor.bearings] == ['block', 'block']


def test_rigid_support_needs_neither_soil_nor_foundations():
    case = load(PAPER, [
        'support.model=rigid', 'soil=', 'foundations=[]',
        'rotor.bearings.0.foundation=', 'rotor.bearings.1.foundation='])
    assert case.soil is None
    assert soil_models(case, Cache(NO_CACHE)) == ()
    assert case.rotor.bearings[0].foundation is None


def test_rigid_support_takes_a_case_with_blocks_as_it_is():
    assert soil_models(load(PAPER, ['support.model=rigid']), Cache(NO_CACHE)) == (RigidSoil(),)


def test_section_may_be_conical_of_its_own_material_and_carry_mass():
    section = load(PAPER, [
        'rotor.shaft.0.outer_diameter_end=0.03', 'rotor.shaft.0.inner_diameter=0.01',
        'rotor.shaft.0.inner_diameter_end=0.02', 'rotor.shaft.0.added_mass=0.3',
        'rotor.shaft.0.material={young_modulus: 1e11, poisson_ratio: 0.2, density: 2e3}',
    ]).rotor.shaft[0]
    assert section.outer_diameter == (0.020021, 0.03)
    assert section.inner_diameter == (0.01, 0.02)
    assert section.added_mass == 0.3
    assert section.material.young_modulus == 1e11


def test_section_without_material_has_that_of_the_rotor():
    assert load(PAPER).rotor.shaft[0].material.young_modulus == 2.09e11


def test_cross_terms_of_a_bearing_are_force_first():
    bearing = load(PAPER, ['rotor.bearings.0.stiffness={xx: 1, xz: 2, zx: 3, zz: 4}']
                   ).rotor.bearings[0]
    np.testing.assert_array_equal(bearing.stiffness, [[1.0, 2.0], [3.0, 4.0]])


def test_probe_is_a_channel():
    case = load(PAPER, ['rotor.probes=[{name: probe_1, position: 0.1}]'])
    assert 'probe_1_z' in coupled_model(case, NO_CACHE).channels


@pytest.mark.parametrize('setting, problem', [
    # type and finiteness, with the unit
    ('foundations.0.mass=abc', "foundations.0.mass: must be a finite number in kg, got 'abc'"),
    ('foundations.0.mass="3"', "foundations.0.mass: must be a finite number in kg, got '3'"),
    ('foundations.0.mass=true', 'foundations.0.mass: must be a finite number in kg, got True'),
    ('foundations.0.mass=.nan', 'foundations.0.mass: must be a finite number in kg, got nan'),
    ('rotor.shaft_height=1e999', 'rotor.shaft_height: must be a finite number in m, got inf'),
    ('rotor.shaft_height=1e300',
     'rotor.shaft_height: must be a finite number in m of at most 1e+18, got 1e+300'),
    ('unbalances.0.phase=x', "unbalances.0.phase: must be a finite number in rad, got 'x'"),
    ('rotor.shaft.0.elements=2.5',
     'rotor.shaft.0.elements: must be a whole number up to 1000, got 2.5'),
    ('rotor.shaft.0.elements=1000000',
     'rotor.shaft.0.elements: must be a whole number up to 1000, got 1000000'),
    ('soil=3', 'soil: must hold keys and values, got 3'),
    ('rotor.discs=3', 'rotor.discs: must be a list, got 3'),
    ('support.model=cones',
     "support.model: must be 'rigid', 'cone', 'infinite_elements', 'boundary_elements', "
     "'thin_layers', 'table' or 'receptance', got 'cones'; did you mean cone?"),
    ('foundations.0.inertia=[1, 2]', 'foundations.0.inertia.2: is missing'),
    ('foundations.0.inertia=[1, 2, 3, 4]',
     'foundations.0.inertia: has more entries than it should: [1, 2, 3, 4]'),
    # keys
    ('foundations.0.masss=1', 'foundations.0.masss: is not a known key; did you mean mass?'),
    ('foundation.0.mass=1', 'foundation: is not a known key; did you mean foundations?'),
    ('rotor.bearings.0.damping.qq=1',
     'rotor.bearings.0.damping.qq: is not a known key; known here: xx, xz, zx, zz'),
    ('rotor.discs.0={}', 'rotor.discs.0.name: is missing'),
    # rules of the physics, at their keys
    ('foundations.0.mass=-1', 'foundations.0.mass: must be >= 0 kg and finite, got -1'),
    ('foundations.0.half_width=0', 'foundations.0.half_width: must be > 0 m and finite, got 0'),
    ('foundations.0.inertia=[1, -2, 3]',
     'foundations.0.inertia: about y must be >= 0 kg m^2 and finite, got -2'),
    ('soil.poisson_ratio=0.5',
     'soil.poisson_ratio: must be in [0, 0.5), of undrained (saturated) soil 0.49, got 0.5'),
    ('rotor.material.density=-1',
     'rotor.material.density: must be >= 0 kg/m^3 and finite, got -1'),
    ('rotor.shaft.0.elements=0', 'rotor.shaft.0.elements: must be at least 1, got 0'),
    ('rotor.discs.1.mass=-1', 'rotor.discs.1.mass: must be >= 0 kg and finite, got -1'),
    ('rotor.discs.1.position=5', 'rotor.discs.1.position: position of disc_2 must be on the '
                                 'shaft, 0 to 0.76202 m, got 5'),
    # what belongs together
    ('rotor.bearings.1.foundation=blok',
     'rotor.bearings.1.foundation: must be one of block, got blok'),
    ('rotor.material=', 'rotor.material: is missing, and so is that of rotor.shaft.0'),
    ('foundations.0.radius=0.5',
     'foundations.0: needs either half_width and half_length, or parts, or radius, in m'),
    ('foundations.0.half_length=',
     'foundations.0: needs either half_width and half_length, or parts, or radius, in m'),
    ('foundations.0.name=other', 'rotor.bearings.0.foundation: must be one of other, got block'),
    ('foundations=[]', 'foundations: is missing; the support model cone needs a block'),
    ('soil=', 'soil: is missing; the support model cone needs it'),
    ('support.geometry=plane_strain',
     'support.geometry: must be disc for the model cone, got plane_strain'),
    ('unbalances.0.disc=disc_3', 'unbalances.0.disc: must be one of disc_1, disc_2, got disc_3'),
    # names
    ('name=Paper', 'name: must be a name of at most 64 small letters, digits and _, first a '
                   "letter, got 'Paper'"),
    ('rotor.discs.0.name=block',
     'rotor.discs.0.name: must differ from that of foundations.0, got block twice'),
    # speeds
    ('speed_range_rpm=[5, 1]', 'speed_range_rpm: must be two rising speeds >= 0 rpm, got [5, 1]'),
    ('speed_range_rpm=[-5, 1]',
     'speed_range_rpm: must be two rising speeds >= 0 rpm, got [-5, 1]'),
    ('speed_range_rpm=[5, x]', "speed_range_rpm.1: must be a finite number in rpm, got 'x'"),
])
def test_fault_is_told_in_one_line_with_file_and_key(setting, problem):
    with pytest.raises(InputError) as caught:
        load(PAPER, [setting])
    assert str(caught.value).splitlines()[0] == f'{PAPER}: {problem}'


def test_bearing_between_several_foundations_has_to_choose():
    text = ('[{name: a, radius: 1, mass: 1, centre_of_gravity_height: 0, inertia: [1, 1, 1]},'
            ' {name: b, radius: 1, mass: 1, centre_of_gravity_height: 0, inertia: [1, 1, 1]}]')
    with pytest.raises(InputError, match=r'rotor.bearings.0.foundation: is missing; there are '
                                         r'several: a, b\n'):
        load(PAPER, [f'foundations={text}', 'rotor.bearings.0.foundation='])


def test_channels_of_two_stations_must_not_be_the_same():
    # bearing_1_journal_x: the shaft in bearing_1, and a disc of a foolish name
    with pytest.raises(InputError, match=r'rotor: names must differ between stations'):
        load(PAPER, ['rotor.discs.0.name=bearing_1_journal',
                     'unbalances.0.disc=bearing_1_journal'])


def test_hostile_key_stays_one_line():
    with pytest.raises(InputError) as caught:
        load(PAPER, ['a\nb=3'])
    assert '\n' not in str(caught.value)


OVERLAP = Path(__file__).parents[1] / 'cases' / 'overlap' / 'case.yaml'


def test_blocks_that_overlap_are_refused_by_name_and_length():
    with pytest.raises(InputError) as refused:
        load(OVERLAP)
    assert str(refused.value) == (
        f'{OVERLAP}: foundations.1: kb must not overlap ka (foundations.0), got 0.85 m of overlap '
        'along y: centres are 0.65 m apart')
    round_block = ['foundations.0.half_width=', 'foundations.0.half_length=',
                   'foundations.0.radius=1.0', 'foundations.1.centre_y=1.9']
    with pytest.raises(InputError, match=r'got 0\.1 m of overlap'):
        load(OVERLAP, round_block)
    with pytest.raises(InputError, match='must not overlap'):
        load(OVERLAP, ['support.model=rigid'])


def test_blocks_that_touch_stand_and_are_remarked_with_their_coupling():
    touching = load(OVERLAP, ['foundations.1.centre_y=1.75'])
    told = [text for text in warnings(touching) if 'beside' in text]
    assert len(told) == 1
    # Two squares 0.25 half-widths apart at a0 = 2 rock each other: 0.434 (two_blocks.csv).
    assert told[0].startswith('kb: stands 0 m beside ka; each is taken as alone on the ground')
    assert 'by up to 43%' in told[0]


@pytest.mark.parametrize('setting, told', [
    ('speed_range_rpm.1=1e7', r'speed_range_rpm\.1: must turn the shaft, 0\.02002 m wide, slower '
                              r'than 1500 m/s .* got 1e\+07 rpm'),
    ('rotor.shaft.0.length=1e-310', r'rotor\.shaft\.0\.length: must be a finite number in m, 0 or '
                                    r'at least 1e-300, got 1e-310'),
    ('soil.shear_modulus=5e-324', r'soil\.shear_modulus: must be a finite number in Pa, 0 or'),
    ('rotor.shaft=[' + ', '.join(['{length: 0.2, outer_diameter: 0.02, elements: 900}'] * 3) + ']',
     r'rotor\.shaft: must have at most 2000 nodes with all stations, got 2705'),
    ('rotor.discs=[' + ', '.join(f'{{name: d{i}, position: {i / 1400}, mass: 1, '
                                 'diametral_inertia: 1, polar_inertia: 1}'
                                 for i in range(1000)) + ']',
     r'rotor\.discs: must be fewer: 1000 unbalance planes and 2\d\d\d motions need a table of '
     r'24\.2 GiB, more than 2 GiB, got 1000 discs')])
def test_what_would_fill_the_memory_is_refused_before_it_starts(setting, told):
    with pytest.raises(InputError, match=told):
        load(PAPER, ['unbalances=[]', setting])
