"""Ground that moves by itself: what stands on it follows, as far as inertia lets it."""

from dataclasses import replace

import numpy as np
import pytest

from rotorsoil_ros.channel import Channel, DOFS
from rotorsoil_ros.ground.soil import RigidSoil
from rotorsoil_ros.machine.coupled import CoupledModel
from rotorsoil_ros.machine.placement import Placement
from rotorsoil_ros.machine.transmissibility import GroundTable, MovingGround

from machines import elastic_machine, paper_machine, paper_rotor, shared, Springs, two_blocks

AXES = ('x', 'y', 'z')


def followed(model, omega, *, speed=0.0):
    """Return the motion of all channels per unit motion of the ground, (n, c, 3)."""
    return model.ground_response(np.asarray(omega), speed=speed)[0]


@pytest.mark.parametrize('model', [paper_machine(), elastic_machine()], ids=['one', 'two blocks'])
def test_slow_ground_carries_everything_along(model):
    found = followed(model, [1e-3], speed=50.0)[0]
    for row, own in zip(found, model.channels, strict=True):
        expected = [1.0 if own.axis == axis else 0.0 for axis in AXES]
        np.testing.assert_allclose(row, expected, atol=1e-7)


def test_force_into_the_soil_is_the_inertia_of_all_that_moves():
    model = paper_machine()
    omega = 0.5
    _, force = model.ground_response(np.array([omega]), speed=0.0)
    own = model.channels.index('block_z')
    mass = model.rotor.mass + model.foundations[0].mass
    assert force[0, own, 2].real == pytest.approx(omega**2 * mass, rel=1e-5)


def test_block_on_rigid_ground_is_the_base_that_moves():
    """With no compliance the block is led, and the rotor is what it is on firm ground shaken."""
    omega = np.array([30.0, 220.0])
    led = followed(paper_machine(RigidSoil()), omega, speed=100.0)
    for row, own in enumerate(paper_machine().channels):
        if own.station == 'block':
            expected = [1.0 if own.axis == axis else 0.0 for axis in AXES]
            np.testing.assert_allclose(led[:, row], [expected] * 2, atol=1e-14)
    # Bearings on no block stand on the ground, and move as it does.
    firm = CoupledModel(paper_rotor(foundation=None))
    np.testing.assert_allclose(led[:, :len(firm.channels)], followed(firm, omega, speed=100.0),
                               rtol=1e-10, atol=1e-14)


def test_rigid_body_on_springs_multiplies_by_its_closed_form():
    """|1 / (1 - w^2 m / k)|: a stiff rotor heaves with its block as one mass."""
    block = replace(paper_machine().foundations[0], mass=3000.0)
    soil = Springs(1e9 * np.eye(6), 1e2 * np.eye(6))
    model = CoupledModel(paper_rotor(stiffness=1e12), (block,), (soil,))
    omega = np.array([60.0])
    gain = 1.0 / (1.0 - omega**2 * (3000.0 + model.rotor.mass) / 1e9)
    own = model.channels.index('block_z')
    np.testing.assert_allclose(followed(model, omega)[:, own, 2], gain, rtol=1e-4)


def test_heading_of_a_shaft_turns_what_it_sees_of_the_ground():
    model = replace(paper_machine(RigidSoil()), place=Placement(heading=0.5 * np.pi))
    found = followed(model, [1e-3])[0]
    # Its x points along the y of the ground.
    np.testing.assert_allclose(found[model.channels.index('disc_1_x')], [0.0, 1.0, 0.0],
                               atol=1e-9)


@pytest.fixture(scope='module')
def beside():
    """Return two blocks on one ground, whose points are sensors, and what is known of these."""
    model = shared()
    loads = np.array([model.channels.index(Channel(block.name, '', dof))
                      for block in model.foundations for dof in DOFS])
    table = GroundTable.build(model, (5.0, 140.0), rated=100.0)
    return model, MovingGround(table, loads, 2, (), model.soil_models[0])


def test_points_on_the_ground_move_with_it_and_with_the_blocks_beside_them(beside):
    model, _ = beside
    omega = np.array([40.0])
    moved, force = model.ground_response(omega, speed=0.0)
    blocks = [model.channels.index(Channel(block.name, '', 'x')) for block in model.foundations]
    into = np.concatenate([force[0, first:first + 6] for first in blocks])
    points = model.support.points(omega)[0] @ into + np.tile(np.eye(3), (2, 1))
    np.testing.assert_allclose(moved[0, -6:], points, rtol=1e-12)
    assert two_blocks().points == ()


def test_table_of_moving_ground_is_the_solution_at_speeds_between(beside):
    model, moving = beside
    speed = np.linspace(5.0, 140.0, 23)
    for found, exact in zip(moving.table.at(speed), model.ground_response(speed, speed=None),
                            strict=True):
        assert np.nanmax(np.abs(found - exact)) < 1e-5 * np.nanmax(np.abs(exact))
        np.testing.assert_array_equal(np.isnan(found), np.isnan(exact))


def test_sensors_feel_the_machine_as_probes_in_their_place_do(beside):
    model, moving = beside
    speed = np.array([20.0, 60.0, 130.0])
    answer = model.unbalance_response(speed, np.array([1e-3, 2e-4j]))
    probes = answer.displacement[:, -6:].reshape(3, 2, 3)
    np.testing.assert_allclose(moving.own(speed, answer.force), probes,
                               rtol=1e-9, atol=1e-9 * np.abs(probes).max())


def test_motion_without_the_machine_is_found_from_what_probes_feel_of_both(beside):
    model, moving = beside
    speed, motion = np.array([20.0, 60.0, 130.0]), np.array([2e-6, 1e-6j, 3e-6 - 1e-6j])
    answer = model.unbalance_response(speed, np.array([1e-3, 2e-4j]))
    followed, _ = model.ground_response(speed, speed=None)
    probes = (answer.displacement + followed @ motion)[:, -6:].reshape(3, 2, 3)
    free = moving.free(speed, probes, moving.own(speed, answer.force))
    np.testing.assert_allclose(free, np.broadcast_to(motion, (3, 2, 3)), rtol=1e-4,
                               atol=1e-4 * np.abs(motion).max())
    # Beside a machine that only follows, what it does to the sensors is no small part.
    assert np.abs(probes - motion).max() > 0.1 * np.abs(motion).max()
    np.testing.assert_allclose(moving.parts(speed, np.tile(motion, (3, 1))).displacement,
                               followed @ motion, rtol=1e-4, atol=1e-5 * np.abs(motion).max())


def test_what_nobody_can_tell_is_no_number(beside):
    model, moving = beside
    unknown = replace(moving, around=None, unknown='no soil')
    speed = np.array([60.0])
    own = unknown.own(speed, model.unbalance_response(speed, np.ones(2)).force)
    assert own.shape == (1, 2, 3)
    assert np.isnan(own).all()
    assert np.isnan(unknown.free(speed, np.ones((1, 2, 3), dtype=complex), own)).all()
    assert np.isnan(moving.parts(np.array([150.0]), np.ones((1, 3))).displacement).all()
