"""The rigid block against rigid-body kinematics and the seed paper's corrected equations."""

import math

import numpy as np
import pytest

from rotorsoil_ros.errors import NotSolvedError, RotorSoilError
from rotorsoil_ros.ground.soil import Rectangle, RigidSoil
from rotorsoil_ros.machine.foundation import add_mass, BlockReceptance, Foundation

from machines import CONE, CONTACT

BLOCK = Foundation('block', CONTACT, 0.2, 400.0, 0.3, (30.0, 40.0, 50.0))


def test_block_has_the_kinetic_energy_of_its_centre_of_gravity():
    motion = np.array([0.3, -0.2, 0.5, 0.7, -0.4, 0.9])
    velocity = motion[:3] + np.cross(motion[3:], [0.0, 0.0, 0.3])
    energy = 400.0 * velocity @ velocity + motion[3:] ** 2 @ [30.0, 40.0, 50.0]
    assert motion @ BLOCK.mass_matrix @ motion == pytest.approx(energy, rel=1e-14)


def test_seat_moves_as_part_of_a_rigid_body():
    motion = np.array([0.3, -0.2, 0.5, 0.7, -0.4, 0.9])
    point = np.array([0.0, 1.1 - 0.2, 0.6])
    moved = motion[:3] + np.cross(motion[3:], point)
    np.testing.assert_allclose(BLOCK.seat_rows(position=1.1, height=0.6) @ motion, moved[[0, 2]],
                               rtol=1e-14)


def test_receptance_is_the_inverse_of_stiffness_minus_inertia():
    omega = np.array([10.0, 300.0, 900.0])
    compliance = CONE.compliance(omega)
    stiffness = np.linalg.inv(compliance) - omega[:, None, None] ** 2 * BLOCK.mass_matrix
    got = add_mass(compliance, BLOCK.mass_matrix, omega)
    np.testing.assert_allclose(got @ stiffness, np.broadcast_to(np.eye(6), (3, 6, 6)),
                               atol=1e-12)  # round-off of a product of order one


def of_soil(*pairs):
    """Return a compliance at three frequencies that couples pairs of dofs, and frequencies."""
    omega = np.array([10.0, 300.0, 900.0])
    compliance = CONE.compliance(omega)
    for i, j in pairs:
        product = compliance[:, i, i] * compliance[:, j, j]
        compliance[:, i, j] = compliance[:, j, i] = 0.3 * np.sqrt(product)
    return compliance, omega


@pytest.mark.parametrize('pairs, sizes', [
    ([], {1: 2, 2: 2}),  # the centre of gravity couples x with ry and y with rx
    ([(0, 4), (1, 3)], {1: 2, 2: 2}),
    ([(0, 2)], {1: 1, 2: 1, 3: 1}),
    ([(0, 2), (2, 3), (4, 5)], {6: 1})])
def test_receptance_by_coupled_sets_is_that_of_the_whole_block(pairs, sizes):
    compliance, omega = of_soil(*pairs)
    mass = BLOCK.mass_matrix
    held_back = np.eye(6) - omega[:, None, None] ** 2 * (compliance @ mass)
    whole = np.linalg.solve(held_back, compliance)
    found = BlockReceptance.of(compliance, mass, omega)
    assert {sets.shape[1]: len(sets) for sets, _ in found.parts} == sizes
    np.testing.assert_allclose(found.motion(np.eye(6)[None]), whole, rtol=1e-12, atol=1e-24)
    rows = np.random.default_rng(0).standard_normal((4, 6))
    pairs = np.einsum('pi,qj->ijpq', rows, rows).reshape(6, 6, 16)
    np.testing.assert_allclose(found.between(pairs).reshape(-1, 4, 4), rows @ whole @ rows.T,
                               rtol=1e-12)


def test_dofs_that_are_held_take_no_part():
    compliance, omega = of_soil()
    compliance[:, :2] = compliance[:, :, :2] = 0.0
    found = BlockReceptance.of(compliance, BLOCK.mass_matrix, omega)
    assert sorted(dof for sets, _ in found.parts for dof in sets.ravel().tolist()) == [2, 3, 4, 5]
    motion = found.motion(np.ones((1, 6, 1)))
    assert not motion[:, :2].any()
    np.testing.assert_allclose(
        motion[:, 2, 0], 1.0 / (1.0 / compliance[:, 2, 2] - omega**2 * 400.0), rtol=1e-12)


@pytest.mark.parametrize('size', [1, 2, 3])
def test_resonance_without_damping_is_an_error_and_not_a_number(size):
    # k = 4 N/m and m = 1 kg in one direction: resonance at 2 rad/s, to the last bit.
    compliance = np.broadcast_to(0.25 * np.eye(size) + 0j, (2, size, size))
    with pytest.raises(NotSolvedError, match='resonates without damping'):
        add_mass(compliance, np.eye(size), np.array([1.0, 2.0]))


def test_rigid_soil_holds_the_block():
    omega = np.array([0.0, 100.0])
    assert not add_mass(RigidSoil().compliance(omega), BLOCK.mass_matrix, omega).any()


def test_stiffness_at_the_shaft_is_the_papers_equation_10_and_11():
    # One bearing above the centre, soil coupling sliding and rocking, h from contact to shaft.
    omega, height = np.array([250.0]), 0.6
    compliance = CONE.compliance(omega)
    compliance[0, 0, 4] = compliance[0, 4, 0] = 3e-9 - 1e-9j
    block = Foundation('block', CONTACT, 0.0, 400.0, 0.3, (30.0, 40.0, 50.0))
    rows = block.seat_rows(position=0.0, height=height)
    receptance = add_mass(compliance, block.mass_matrix, omega)[0]
    seat = rows @ receptance @ rows.T

    s = np.linalg.inv(compliance[0]) - omega[0] ** 2 * block.mass_matrix
    (s_uu, s_up), (s_pu, s_pp) = s[0, [0, 4]], s[4, [0, 4]]
    k_xx = (s_uu * s_pp - s_up * s_pu) / (s_pp + s_uu * height**2 - (s_up + s_pu) * height)
    assert 1.0 / seat[0, 0] == pytest.approx(k_xx, rel=1e-12)
    assert 1.0 / seat[1, 1] == pytest.approx(s[2, 2], rel=1e-12)

    motion = receptance @ rows.T @ [1.0, 0.0]
    tilt = (s_pu - height * s_uu) / (height * s_up - s_pp)
    assert motion[4] / motion[0] == pytest.approx(tilt, rel=1e-12)


@pytest.mark.parametrize('change, rule', [
    ({'mass': -1.0}, r'mass must be >= 0 kg and finite, got -1'),
    ({'mass': math.nan}, r'mass must be >= 0 kg and finite, got nan'),
    ({'inertia': (1.0, -2.0, 1.0)}, r'inertia about y must be >= 0 kg m\^2 and finite, got -2'),
    ({'centre_y': math.inf}, r'centre_y must be finite, in m, got inf')])
def test_impossible_block_is_refused(change, rule):
    values = {'name': 'block', 'contact': Rectangle(1.0, 1.0), 'centre_y': 0.0, 'mass': 1.0,
              'centre_of_gravity_height': 0.0, 'inertia': (1.0, 1.0, 1.0), **change}
    with pytest.raises(RotorSoilError, match=rule):
        Foundation(**values)
