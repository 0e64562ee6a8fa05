"""Tables over speed and pedestals: what they promise between points, and what they refuse."""

import math

import numpy as np
import pytest

from rotorsoil_ros.errors import OutOfTableError, RotorSoilError
from rotorsoil_ros.machine.coupled import CoupledModel
from rotorsoil_ros.machine.modes.campbell import campbell
from rotorsoil_ros.rotor.bearing import Bearing, Pedestal
from rotorsoil_ros.rotor.coefficients import SpeedTable
from rotorsoil_ros.rotor.disc import Disc, permissible_unbalance

from machines import bearing, elastic_machine, STEEL, uniform_rotor

SPEED = np.array([100.0, 200.0, 250.0, 400.0])
VALUES = np.array([[[1.0, -5.0], [2.0, 8.0]], [[4.0, -4.0], [2.0, 2.0]],
                   [[5.0, 0.0], [2.0, 1.0]], [[9.0, 3.0], [2.0, 0.5]]]) * 1e7
TABLE = SpeedTable(SPEED, VALUES)


def tabulated(stiffness, damping):
    """Return a machine with one bearing of the given coefficients."""
    return CoupledModel(uniform_rotor(
        length=1.0, diameter=0.05, elements=6, material=STEEL,
        discs=[Disc('wheel', 0.4, 30.0, 0.3, 0.6)],
        bearings=[Bearing('journal', 0.0, None, stiffness, damping),
                  bearing('other', 1.0, stiffness=5e7, foundation=None)]))


def test_table_passes_through_its_points():
    np.testing.assert_allclose(TABLE(SPEED), VALUES, rtol=1e-14)


def test_table_overshoots_no_point():
    between = TABLE(np.linspace(100.0, 400.0, 301))
    assert np.all(np.diff(between[:, 0, 0]) > 0.0)
    assert np.all(np.diff(between[:, 1, 1]) < 0.0)
    np.testing.assert_array_equal(between[:, 1, 0], 2e7)


def test_table_is_a_cubic_with_the_slopes_of_fritsch_and_butland():
    # Inner slope: weighted harmonic mean of the slopes on both sides (1984, eq. 2).
    left, right = 3e7 / 100.0, 1e7 / 50.0
    heavy, light = 2.0 * 50.0 + 100.0, 50.0 + 2.0 * 100.0
    slope = (heavy + light) / (heavy / left + light / right)
    step = 1e-3
    got = (TABLE(np.array([200.0 + step]))[0, 0, 0] - 4e7) / step
    assert got == pytest.approx(slope, rel=1e-4)  # of the step


def test_response_uses_the_table_at_the_speed_and_not_at_the_frequency():
    damping = SpeedTable(SPEED, 1e-4 * np.abs(VALUES))
    model = tabulated(TABLE, damping)
    speed = np.array([230.0])
    frozen = tabulated(TABLE(speed)[0], damping(speed)[0])
    for call in (lambda one: one.unbalance_response(speed, np.array([1e-4])),
                 lambda one: one.frequency_response(np.array([700.0]), speed=230.0,
                                                    channel='wheel_x'),
                 lambda one: one.harmonic_response(speed, order=3.0, channel='wheel_x')):
        np.testing.assert_allclose(call(model).displacement, call(frozen).displacement,
                                   rtol=1e-9)
    np.testing.assert_allclose(campbell(model, speed, 4).eigenvalue,
                               campbell(frozen, speed, 4).eigenvalue, rtol=1e-9)


@pytest.mark.parametrize('call', [
    lambda model, speed: model.unbalance_response(speed, np.array([1e-4])),
    lambda model, speed: model.frequency_response(np.array([300.0]), speed=float(speed[-1]),
                                                  channel='wheel_x'),
    lambda model, speed: campbell(model, speed, 2)])
@pytest.mark.parametrize('speed', [50.0, 401.0])
def test_nothing_outside_a_table_is_answered(call, speed):
    rule = (r'speed must be in \[954\.93, 3819\.72\] rpm, the table of journal, got '
            rf'{speed * 30.0 / math.pi:g}')
    with pytest.raises(OutOfTableError, match=rule):
        call(tabulated(TABLE, 1e3 * np.eye(2)), np.array([200.0, speed]))


def test_both_ends_of_a_table_belong_to_it():
    model = tabulated(TABLE, 1e3 * np.eye(2))
    found = model.unbalance_response(SPEED[[0, -1]], np.array([1e-4]))
    assert np.all(np.isfinite(found.displacement))


def test_speed_range_is_what_all_tables_share():
    narrow = SpeedTable(np.array([0.0, 300.0]), VALUES[:2])
    assert Bearing('b', 0.0, None, TABLE, narrow).speed_range == (100.0, 300.0)
    assert bearing('b', 0.0, stiffness=1.0).speed_range == (-math.inf, math.inf)


def test_nominal_stiffness_is_the_mean_of_the_direct_ones():
    assert Bearing('b', 0.0, None, TABLE, np.eye(2)).nominal_stiffness == pytest.approx(
        (1 + 8 + 4 + 2 + 5 + 1 + 9 + 0.5) / 8 * 1e7)


def test_pedestal_is_a_spring_beside_a_damper():
    skew = np.array([[3e8, 2e7], [1e7, 5e8]])
    pedestal = Pedestal(np.eye(2), skew, 1e-4 * skew)
    got = pedestal.compliance(np.array([200.0]))[0]
    np.testing.assert_allclose(got @ skew, np.eye(2) / (1.0 + 0.02j), atol=1e-15)


def test_motion_of_the_support_is_that_of_blocks_and_pedestals():
    support = elastic_machine().support
    omega = np.array([300.0])
    rows, mass = support.motion_rows, support.motion_mass
    compliance = support.motion_compliance(omega)[0]
    receptance = np.linalg.solve(np.eye(len(mass)) - omega[0] ** 2 * compliance @ mass,
                                 compliance)
    np.testing.assert_allclose(rows @ receptance @ rows.T, support.standing(omega).receptance[0],
                               rtol=1e-10, atol=1e-20)


def test_grade_permits_its_eccentricity_times_the_mass():
    # ISO 21940-11: G 6.3 at 3000 rpm is an eccentricity of 20.05 um.
    moment = permissible_unbalance(grade=6.3e-3, mass=500.0, speed=100.0 * math.pi)
    assert moment / 500.0 == pytest.approx(20.05e-6, rel=1e-3)  # printed digits


def test_cylindrical_disc_has_the_inertia_of_its_volume():
    disc = Disc.cylinder('d', 0.1, outer_diameter=0.4, inner_diameter=0.1, width=0.05,
                         density=7800.0)
    mass = 7800.0 * math.pi * (0.2**2 - 0.05**2) * 0.05
    assert disc.mass == pytest.approx(mass)
    assert disc.polar_inertia == pytest.approx(0.5 * mass * (0.2**2 + 0.05**2))
    assert disc.diametral_inertia == pytest.approx(
        mass * (3.0 * (0.2**2 + 0.05**2) + 0.05**2) / 12.0)


@pytest.mark.parametrize('make, rule', [
    (lambda: SpeedTable(SPEED[:1], VALUES[:1]), 'speeds of a table must be two or more'),
    (lambda: SpeedTable(SPEED[::-1], VALUES), 'two or more, >= 0 rpm and rising, got'),
    (lambda: SpeedTable(SPEED - 200.0, VALUES), '>= 0 rpm and rising'),
    (lambda: SpeedTable(SPEED, VALUES[:3]), 'values of a table must be 4 finite 2 x 2 matrices'),
    (lambda: SpeedTable(SPEED, VALUES * math.nan), 'values of a table must be 4 finite'),
    (lambda: Pedestal(np.eye(2), np.zeros((2, 2)), np.eye(2)),
     'stiffness must have an inverse, in N/m'),
    (lambda: Pedestal(np.eye(3), np.eye(2), np.eye(2)),
     'mass must be a finite 2 x 2 matrix in kg'),
    (lambda: permissible_unbalance(grade=6.3e-3, mass=0.0, speed=1.0), 'mass must be > 0 kg'),
    (lambda: permissible_unbalance(grade=math.nan, mass=1.0, speed=1.0),
     'grade must be > 0 m/s and finite'),
    (lambda: permissible_unbalance(grade=1.0, mass=1.0, speed=0.0),
     'speed must be > 0 rad/s and finite'),
    (lambda: Disc.cylinder('d', 0.0, outer_diameter=0.1, inner_diameter=0.1, width=1.0,
                           density=1.0), 'inner_diameter must be >= 0 m and less than')])
def test_impossible_coefficients_are_refused(make, rule):
    with pytest.raises(RotorSoilError, match=rule):
        make()
