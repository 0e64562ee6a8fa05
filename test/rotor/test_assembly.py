"""Shaft, disc and gyroscopic matrices against closed forms and published rotors."""

import math

import numpy as np
import pytest
from scipy.integrate import trapezoid
import scipy.linalg

from rotorsoil_ros.errors import RotorSoilError
from rotorsoil_ros.rotor.assembly import Rotor
from rotorsoil_ros.rotor.beam import shear_coefficient
from rotorsoil_ros.rotor.bearing import Bearing
from rotorsoil_ros.rotor.disc import Disc
from rotorsoil_ros.rotor.shaft import Material, Probe, ShaftSection

from machines import bearing, paper_rotor, STEEL, uniform_rotor
from oracles.dense import rotor_matrices
from oracles.published import (
    friswell,
    lalanne_ferraris,
    pinned_shaft,
    published,
    whirl_frequencies,
)


@pytest.mark.usefixtures('no_shear')
def test_euler_bernoulli_beam_has_its_closed_form_frequencies():
    given, expected, rtol = published('cf_ss_euler')
    stiffness, mass, polar = (matrix.copy() for matrix in pinned_shaft(given).plane_matrices)
    mass -= 0.5 * polar  # rotary inertia, which Euler and Bernoulli leave out
    for row in (0, -2):
        stiffness[row, row] += 1e13
    values = scipy.linalg.eigh(stiffness, mass, eigvals_only=True, subset_by_index=[0, 2])
    np.testing.assert_allclose(np.sqrt(values) / (2.0 * math.pi), expected, rtol=rtol)


def test_timoshenko_beam_has_its_closed_form_frequencies():
    given, expected, rtol = published('cf_ss_timoshenko')
    found = whirl_frequencies(pinned_shaft(given), 0.0, 6)[::2] / (2.0 * math.pi)
    np.testing.assert_allclose(found, expected, rtol=rtol)


def test_timoshenko_element_converges_with_the_second_order_of_its_mass():
    given, expected, _ = published('cf_ss_timoshenko')
    material = Material(given['E'], given['nu'], given['rho'])
    errors = []
    for elements in (8, 16, 32):
        rotor = uniform_rotor(
            length=given['L'], diameter=given['d'], elements=elements, material=material,
            bearings=[bearing('a', 0.0, stiffness=1e14),
                      bearing('b', given['L'], stiffness=1e14)])
        third = whirl_frequencies(rotor, 0.0, 6)[4] / (2.0 * math.pi)
        errors.append(abs(third / expected[2] - 1.0))
    rates = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all(rates > 1.8), rates


@pytest.mark.usefixtures('no_shear')
def test_element_without_shear_converges_with_fourth_order():
    given, expected, _ = published('cf_ss_euler')
    material = Material(given['E'], given['nu'], given['rho'])
    errors = []
    for elements in (4, 8, 16):
        rotor = uniform_rotor(
            length=given['L'], diameter=given['d'], elements=elements, material=material,
            bearings=[bearing('a', 0.0, stiffness=1.0), bearing('b', given['L'], stiffness=1.0)])
        stiffness, mass, polar = rotor.plane_matrices
        free = np.setdiff1d(np.arange(len(mass)), [0, len(mass) - 2])
        values = scipy.linalg.eigh(stiffness[np.ix_(free, free)],
                                   (mass - 0.5 * polar)[np.ix_(free, free)], eigvals_only=True)
        errors.append(np.sqrt(values[:3]) / (2.0 * math.pi) / expected - 1.0)
    rates = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all(rates > 3.7), rates


@pytest.mark.usefixtures('no_shear')
def test_solid_cone_that_is_held_at_its_base_has_its_published_frequency():
    # Its first eigenvalue is 8.719 (Conway, Becker & Dubil 1964, J. Applied Mechanics 31).
    base, found = 0.02, []
    for elements in (4, 8, 16):
        section = ShaftSection(1.0, (base, 1e-6 * base), (0.0, 0.0), elements, STEEL)
        rotor = Rotor(0.0, (section,), (), (bearing('a', 0.0, stiffness=1.0),
                                            bearing('b', 1.0, stiffness=1.0)))
        stiffness, mass, polar = rotor.plane_matrices
        values = scipy.linalg.eigh(stiffness[2:, 2:], (mass - 0.5 * polar)[2:, 2:],
                                   eigvals_only=True)
        unit = STEEL.young_modulus / STEEL.density * base**2 / 16.0
        found.append(np.sqrt(values[:3] / unit))
    assert found[2][0] == pytest.approx(8.719, abs=5e-4)  # printed digits
    coarse, middle, fine = found
    rates = np.log2((coarse - middle)[1:] / (middle - fine)[1:])
    assert np.all(rates > 3.4), rates


@pytest.mark.usefixtures('no_shear')
def test_spinning_rayleigh_shaft_splits_as_its_closed_form_says():
    given, expected, rtol = published('cf_ss_rayleigh_spin')
    speed = given['speed_rpm'] * 2.0 * math.pi / 60.0
    found = whirl_frequencies(pinned_shaft(given), speed, 4) / (2.0 * math.pi)
    np.testing.assert_allclose(found, expected, rtol=rtol)


def test_three_disc_rotor_of_lalanne_and_ferraris():
    # Shaft and disc gyroscopics together: a flipped sign in one of them shows only here.
    given, expected, rtol = published('LF_3disc_25000rpm')
    speed = 25000.0 * 2.0 * math.pi / 60.0
    rotor = lalanne_ferraris(given, given['cxx'], given['czz'])
    found = whirl_frequencies(rotor, speed, 12) / (2.0 * math.pi)
    nearest = found[np.abs(found[:, None] - expected).argmin(axis=0)]
    np.testing.assert_allclose(nearest, expected, rtol=rtol)


@pytest.mark.parametrize('name, stiffness, rpm', [
    ('FR_5.9.1_4000rpm', 1e6, 4000.0),
    ('FR_5.9.2_0rads', [[1e6, 0.0], [0.0, 0.8e6]], 0.0),
    ('FR_5.9.2_4000rpm', [[1e6, 0.0], [0.0, 0.8e6]], 4000.0),
    ('FR_5.9.4_like_4000rpm', [[1e6, 0.5e6], [0.0, 1e6]], 4000.0)])
def test_rotor_of_friswell_whirls_as_published(name, stiffness, rpm):
    given, expected, rtol = published(name)
    found = whirl_frequencies(friswell(given, stiffness), rpm * 2.0 * math.pi / 60.0, 8)
    nearest = found[np.abs(found[:, None] - expected).argmin(axis=0)]
    np.testing.assert_allclose(nearest, expected, rtol=rtol)


def test_hollow_shear_coefficient_has_cowpers_limits():
    # Solid circle 6 (1 + nu) / (7 + 6 nu); thin tube 2 (1 + nu) / (4 + 3 nu).
    nu = np.array([0.3])
    assert shear_coefficient(nu, np.zeros(1)) == pytest.approx(6.0 * 1.3 / 8.8)
    assert shear_coefficient(nu, np.ones(1)) == pytest.approx(2.0 * 1.3 / 4.9)


def test_rigid_motion_of_a_conical_shaft_has_the_inertia_of_its_volume():
    section = ShaftSection(2.0, (0.2, 0.4), (0.0, 0.1), 3, STEEL, added_mass=5.0)
    rotor = Rotor(0.0, (section,), (), (bearing('a', 0.0, stiffness=1.0),
                                        bearing('b', 2.0, stiffness=1.0)))
    stiffness, mass, polar = rotor.plane_matrices
    y = rotor.node_positions
    tilt = np.stack([y, np.ones_like(y)], axis=1).ravel()
    np.testing.assert_allclose(stiffness @ tilt, 0.0, atol=1e-6 * np.abs(stiffness).max())
    fine = np.linspace(0.0, 2.0, 20001)
    outer, inner = 0.2 + 0.1 * fine, 0.05 * fine
    area = math.pi / 4.0 * (outer**2 - inner**2)
    moment = math.pi / 64.0 * (outer**4 - inner**4)
    per_length = STEEL.density * area + 5.0
    total = trapezoid(per_length, fine)
    assert rotor.mass == pytest.approx(total, rel=1e-8)  # trapezoidal rule
    assert tilt @ mass @ tilt == pytest.approx(
        trapezoid(per_length * fine**2 + STEEL.density * moment, fine), rel=1e-8)
    assert tilt @ polar @ tilt == pytest.approx(
        trapezoid(2.0 * STEEL.density * moment, fine), rel=1e-8)


def test_stations_become_nodes_and_even_divisions_stay():
    section = ShaftSection(1.0, (0.1, 0.1), (0.0, 0.0), 4, STEEL)
    rotor = Rotor(0.0, (section,), (Disc('d', 0.3, 1.0, 0.0, 0.0),),
                  (bearing('a', 0.25 + 1e-13, stiffness=1.0), bearing('b', 1.0, stiffness=1.0)),
                  (Probe('p', 0.9),))
    np.testing.assert_array_equal(rotor.node_positions, [0.0, 0.25, 0.3, 0.5, 0.75, 0.9, 1.0])


def test_gyroscopic_matrix_is_skew_and_turns_z_into_x():
    _, mass, gyroscopic = rotor_matrices(paper_rotor())
    np.testing.assert_allclose(gyroscopic, -gyroscopic.T, atol=1e-18)  # round-off of 1e-3
    np.testing.assert_allclose(mass, mass.T, atol=1e-18)
    # Lalanne: C(rx, rz) = -Omega I_p; disc 2 sits on the last node.
    assert gyroscopic[-2, -1] < -6.4e-3
    assert gyroscopic[-1, -2] > 6.4e-3


@pytest.mark.parametrize('make, rule', [
    (lambda: Material(0.0, 0.3, 1.0), 'young_modulus must be > 0 Pa'),
    (lambda: ShaftSection(1.0, (0.1, 0.1), (0.1, 0.0), 2, STEEL), 'inner_diameter must be >= 0'),
    (lambda: ShaftSection(1.0, (0.1, 0.1), (0.0, 0.0), 0, STEEL), 'elements must be at least 1'),
    (lambda: Disc('d', 0.0, math.nan, 0.0, 0.0), 'mass must be >= 0 kg and finite, got nan'),
    (lambda: Bearing('b', 0.0, None, np.zeros((2, 2)), np.zeros((2, 2))), 'must not all be zero'),
    (lambda: uniform_rotor(length=1.0, diameter=0.1, elements=2, material=STEEL,
                           bearings=[bearing('a', 0.0, stiffness=1.0),
                                     bearing('b', 1.5, stiffness=1.0)]),
     'position of b must be on the shaft, 0 to 1 m, got 1.5')])
def test_impossible_rotor_is_refused(make, rule):
    with pytest.raises(RotorSoilError, match=rule):
        make()
