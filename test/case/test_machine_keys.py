"""Keys of bearings, pedestals, discs and unbalances: what they mean, how they are refused."""

import math
from pathlib import Path

import numpy as np
import pytest

from rotorsoil_ros.case import models
from rotorsoil_ros.case.config import load
from rotorsoil_ros.errors import InputError
from rotorsoil_ros.rotor.coefficients import SpeedTable
from rotorsoil_ros.units import rpm_to_rad_s

PAPER = Path(__file__).parents[2] / 'config' / 'paper_rotor.yaml'
NO_CACHE = Path('no cache is needed for cones')
TABLE = 'rotor.bearings.0.stiffness={speed_rpm: [60, 3000, 9000], xx: [1e8, 2e8, 3e8], ' \
        'zz: [4e8, 5e8, 6e8]'
PEDESTAL = 'rotor.bearings.0.pedestal={mass: 3, stiffness: {xx: 1e7, zz: 2e7}, ' \
           'damping: {xx: 10, zz: 20}}'
CYLINDER = 'rotor.discs.0={name: disc_1, position: 0.2, outer_diameter: 0.3, ' \
           'inner_diameter: 0.1, width: 0.05, density: 7800}'


def bearing_of(*settings):
    """Return the first bearing of the paper's machine with some settings."""
    return load(PAPER, settings).rotor.bearings[0]


def test_bearing_follows_its_table_over_speed():
    bearing = bearing_of(f'{TABLE}, xz: [1, 2, 3]}}')
    assert isinstance(bearing.stiffness, SpeedTable)
    speeds = rpm_to_rad_s(np.array([60.0, 3000.0, 9000.0]))
    stiffness, damping, _ = bearing.coefficients(speeds, speeds)
    np.testing.assert_array_equal(stiffness, [
        [[1e8, 1.0], [0.0, 4e8]], [[2e8, 2.0], [0.0, 5e8]], [[3e8, 3.0], [0.0, 6e8]]])
    np.testing.assert_array_equal(damping, np.broadcast_to([[500.0, 0.0], [0.0, 500.0]],
                                                           (3, 2, 2)))


def test_table_of_equal_values_answers_as_the_constant():
    speed = rpm_to_rad_s(np.linspace(100.0, 9000.0, 5))
    answers = []
    for stiffness in ('{xx: 1e9, zz: 1e9}',
                      '{speed_rpm: [0, 9000], xx: [1e9, 1e9], zz: [1e9, 1e9]}'):
        case = load(PAPER, [f'rotor.bearings.1.stiffness={stiffness}'])
        model = models.coupled_model(case, NO_CACHE)
        answers.append(model.unbalance_response(speed, case.unbalance).displacement)
    np.testing.assert_allclose(*answers, rtol=1e-9)  # round-off


def test_pedestal_stands_between_housing_and_block():
    pedestal = bearing_of(PEDESTAL).pedestal
    np.testing.assert_array_equal(pedestal.mass, [[3.0, 0.0], [0.0, 3.0]])
    np.testing.assert_array_equal(pedestal.stiffness, [[1e7, 0.0], [0.0, 2e7]])
    np.testing.assert_array_equal(pedestal.damping, [[10.0, 0.0], [0.0, 20.0]])
    assert bearing_of().pedestal is None


def test_pedestal_may_have_another_mass_in_each_direction():
    pedestal = bearing_of(PEDESTAL, 'rotor.bearings.0.pedestal.mass={xx: 3, zz: 4}').pedestal
    np.testing.assert_array_equal(pedestal.mass, [[3.0, 0.0], [0.0, 4.0]])


def test_disc_by_its_dimensions_is_a_hollow_cylinder():
    disc = load(PAPER, [CYLINDER]).rotor.discs[0]
    mass = 7800.0 * math.pi * (0.15**2 - 0.05**2) * 0.05
    assert disc.position == 0.2
    assert disc.mass == pytest.approx(mass, rel=1e-12)
    # r^2 of the ring: (a^2 + b^2) / 2 about the axis, half of it and h^2 / 12 across
    assert disc.polar_inertia == pytest.approx(mass * (0.15**2 + 0.05**2) / 2.0, rel=1e-12)
    assert disc.diametral_inertia == pytest.approx(
        mass * ((0.15**2 + 0.05**2) / 4.0 + 0.05**2 / 12.0), rel=1e-12)


def test_grade_is_the_moment_that_it_permits_the_whole_rotor():
    case = load(PAPER, ['unbalances=[{disc: disc_2, grade: G6.3, rated_speed_rpm: 3000, '
                        'phase: 0.5}]'])
    # ISO 21940-11: e Omega = 6.3 mm/s; 4.2 kg of rotor (seed paper, table 1), to its digits
    expected = 6.3e-3 * 4.2 / (100.0 * math.pi)
    assert abs(case.unbalance[1]) == pytest.approx(expected, rel=1e-3)
    assert np.angle(case.unbalance[1]) == pytest.approx(0.5)
    assert case.unbalance[0] == 0.0


def test_share_of_a_grade_leaves_the_rest_to_other_discs():
    one = '{disc: disc_1, grade: G 2.5, rated_speed_rpm: 3000'
    whole, half = (load(PAPER, [f'unbalances=[{one}{rest}}}]']).unbalance[0]
                   for rest in ('', ', share: 0.5'))
    assert half == pytest.approx(0.5 * whole, rel=1e-14)


def test_couple_is_a_plane_of_its_own_after_the_discs():
    case = load(PAPER, ['unbalances=[{disc: disc_2, couple: 2e-6, couple_phase: 0.3}, '
                        '{disc: disc_1, moment: 1e-5}]'])
    np.testing.assert_allclose(case.unbalance, [1e-5, 0.0, 2e-6 * np.exp(0.3j)], rtol=1e-14)
    model = models.coupled_model(case, NO_CACHE)
    assert model.planes == ('disc_1', 'disc_2', 'disc_2_couple')
    speed = np.array([100.0])
    both = model.unbalance_response(speed, case.unbalance).displacement
    alone = model.unbalance_response(speed, case.unbalance * [1.0, 1.0, 0.0]).displacement
    assert np.abs(both - alone).max() > 0.01 * np.abs(alone).max()


def test_response_key_knows_couples_tables_and_pedestals():
    keys = {models.response_key(case, models.coupled_model(case, NO_CACHE))
            for case in (load(PAPER, [*settings]) for settings in (
                [], [PEDESTAL], [f'{TABLE}}}'], [f'{TABLE}, zx: [0, 0, 1]}}'],
                ['unbalances.0.couple=1e-6']))}
    assert len(keys) == 5


@pytest.mark.parametrize('setting, problem', [
    # tables
    ('rotor.bearings.0.stiffness={speed_rpm: [60, 9000], xx: [1, 2], zz: [1, 2, 3]}',
     'rotor.bearings.0.stiffness.zz: must have as many entries as speed_rpm, 2, got 3'),
    ('rotor.bearings.0.damping={speed_rpm: [60], xx: [1], zz: [1]}',
     'rotor.bearings.0.damping.speed_rpm: must be two or more rising speeds >= 0 rpm, '
     'got [60.0]'),
    ('rotor.bearings.0.damping={speed_rpm: [60, 60, 9000], xx: [1, 2, 3], zz: [1, 2, 3]}',
     'rotor.bearings.0.damping.speed_rpm: must be two or more rising speeds >= 0 rpm, '
     'got [60.0, 60.0, 9000.0]'),
    ('rotor.bearings.0.damping={speed_rpm: [-1, 9000], xx: [1, 2], zz: [1, 2]}',
     'rotor.bearings.0.damping.speed_rpm: must be two or more rising speeds >= 0 rpm, '
     'got [-1.0, 9000.0]'),
    ('rotor.bearings.0.damping={speed_rpm: [61, 9000], xx: [1, 2], zz: [1, 2]}',
     'rotor.bearings.0.damping.speed_rpm: must cover speed_range_rpm, 60 to 9000 rpm, '
     'got 61 to 9000'),
    ('rotor.bearings.0.damping={speed_rpm: [60, 8999], xx: [1, 2], zz: [1, 2]}',
     'rotor.bearings.0.damping.speed_rpm: must cover speed_range_rpm, 60 to 9000 rpm, '
     'got 60 to 8999'),
    ('rotor.bearings.0.stiffness={speed_rpm: [60, 9000], xx: [1, .nan], zz: [1, 2]}',
     'rotor.bearings.0.stiffness.xx.1: must be a finite number in N/m, got nan'),
    ('rotor.bearings.0.stiffness={speed_rpm: 60, xx: [1, 2], zz: [1, 2]}',
     'rotor.bearings.0.stiffness.speed_rpm: must be a list, got 60'),
    ('rotor.bearings.0.stiffness={speed_rpm: [60, 9000], xx: 1, zz: [1, 2]}',
     'rotor.bearings.0.stiffness.xx: must be a list, got 1'),
    ('rotor.bearings.0.stiffness={speed_rpm: [60, 9000], xx: [1, 2]}',
     'rotor.bearings.0.stiffness.zz: is missing'),
    ('rotor.bearings.0.stiffness={xx: [1, 2], zz: [1, 2]}',
     'rotor.bearings.0.stiffness.xx: must be a finite number in N/m, got [1, 2]'),
    ('rotor.bearings.0.stiffness={speeds_rpm: [60, 9000], xx: 1, zz: 1}',
     'rotor.bearings.0.stiffness.speeds_rpm: is not a known key; known here: xx, xz, zx, zz'),
    ('rotor.bearings.0.stiffness=3',
     'rotor.bearings.0.stiffness: must hold keys and values, got 3'),
    # pedestals
    ('rotor.bearings.0.pedestal={mass: 3, stiffness: {xx: 1, zz: 1}}',
     'rotor.bearings.0.pedestal.damping: is missing'),
    (PEDESTAL.replace('mass: 3', 'mass: -3'),
     'rotor.bearings.0.pedestal.mass: must be >= 0 kg and finite, got -3'),
    (PEDESTAL.replace('mass: 3', 'mass: x'),
     "rotor.bearings.0.pedestal.mass: must be a finite number in kg, got 'x'"),
    (PEDESTAL.replace('mass: 3', 'mass: {xx: 3}'),
     'rotor.bearings.0.pedestal.mass.zz: is missing'),
    (PEDESTAL.replace('1e7', '0'),
     'rotor.bearings.0.pedestal.stiffness: must have an inverse, in N/m, got '
     '[[0.0, 0.0], [0.0, 20000000.0]]'),
    # discs
    (CYLINDER.replace('width', 'mass: 3, width'),
     'rotor.discs.0: needs either mass, diametral_inertia and polar_inertia or outer_diameter, '
     'width and density, got density, inner_diameter, mass, outer_diameter, width'),
    (CYLINDER.replace('width: 0.05, ', ''), 'rotor.discs.0.width: is missing'),
    (CYLINDER.replace('width: 0.05', 'width: 0'),
     'rotor.discs.0.width: must be > 0 m and finite, got 0'),
    (CYLINDER.replace('inner_diameter: 0.1', 'inner_diameter: 0.3'),
     'rotor.discs.0.inner_diameter: must be >= 0 m and less than the outer diameter 0.3 m, '
     'got 0.3'),
    ('rotor.discs.0={name: disc_1, position: 0.1, mass: 1, polar_inertia: 1}',
     'rotor.discs.0.diametral_inertia: is missing'),
    # unbalances
    ('unbalances.0={disc: disc_1}',
     'unbalances.0.moment: is missing, and so are grade and couple'),
    ('unbalances.0.grade=G6.3', 'unbalances.0: needs either moment or grade, got both'),
    ('unbalances.0={disc: disc_1, grade: G6.3}',
     'unbalances.0.rated_speed_rpm: is missing; a grade needs it'),
    ('unbalances.0={disc: disc_1, grade: 6.3, rated_speed_rpm: 3000}',
     'unbalances.0.grade: must be a balance grade in mm/s with its G, as in G6.3, got 6.3'),
    ('unbalances.0={disc: disc_1, grade: G0, rated_speed_rpm: 3000}',
     "unbalances.0.grade: must be a balance grade in mm/s with its G, as in G6.3, got 'G0'"),
    ('unbalances.0={disc: disc_1, grade: G6.3, rated_speed_rpm: 0}',
     'unbalances.0.rated_speed_rpm: must be > 0 rpm, got 0'),
    ('unbalances.0={disc: disc_1, grade: G6.3, rated_speed_rpm: 3000, share: 2}',
     'unbalances.0.share: must be in (0, 1], got 2'),
    ('unbalances.0.share=0.5', 'unbalances.0.share: belongs to a grade, which is missing'),
    ('unbalances.0.rated_speed_rpm=50',
     'unbalances.0.rated_speed_rpm: belongs to a grade, which is missing'),
])
def test_fault_is_told_in_one_line_with_file_and_key(setting, problem):
    with pytest.raises(InputError) as caught:
        load(PAPER, [setting])
    assert str(caught.value).splitlines()[0] == f'{PAPER}: {problem}'
