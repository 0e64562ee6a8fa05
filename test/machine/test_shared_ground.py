"""Two blocks on one ground, and points on it: against a dense solve, balances and limits."""

from dataclasses import replace

import numpy as np
import pytest

from rotorsoil_ros.errors import RotorSoilError
from rotorsoil_ros.ground.boundary.model import BoundaryElementModel
from rotorsoil_ros.ground.plan import Part, Plan
from rotorsoil_ros.ground.soil import Rectangle, Soil
from rotorsoil_ros.machine.band import on_soils
from rotorsoil_ros.machine.coupled import CoupledModel
from rotorsoil_ros.machine.foundation import Foundation, solid_inertia
from rotorsoil_ros.machine.modes.critical import critical_speeds
from rotorsoil_ros.machine.response import ResponseTable

from machines import channel, shared, SOIL, two_blocks
from oracles.dense import dense_response

SPEEDS = np.linspace(1.0, 300.0, 41)
UNBALANCE = np.array([1e-3, 4e-4 * np.exp(1.1j)])


@pytest.fixture(scope='module')
def model():
    return shared()


def test_coupled_blocks_move_as_the_dense_solve_says(model):
    fast = model.unbalance_response(SPEEDS, UNBALANCE)
    slow = dense_response(model, SPEEDS, UNBALANCE)
    known = slow.displacement.shape[1]
    assert len(model.channels) == known + 6
    for got, expected in ((fast.displacement[:, :known], slow.displacement),
                          (fast.force[:, :known], slow.force)):
        scale = np.nanmax(np.abs(expected), axis=1, keepdims=True)
        np.testing.assert_allclose(got / scale, expected / scale, rtol=1e-8, atol=1e-12)


def test_power_that_unbalance_feeds_in_is_lost_in_bearings_and_ground(model):
    found = model.unbalance_response(SPEEDS, UNBALANCE)

    def power(force, displacement):
        return 0.5 * (force * np.conj(1j * SPEEDS * displacement)).real

    fed, lost = np.zeros(len(SPEEDS)), np.zeros(len(SPEEDS))
    for disc, moment in zip(model.rotor.discs, UNBALANCE, strict=True):
        for axis, direction in (('x', -1j), ('z', 1.0)):
            fed += power(direction * moment * SPEEDS**2,
                         channel(model, found, f'{disc.name}_{axis}'))
    for index, name in enumerate(model.channels):
        if name.station in ('left', 'right'):
            lost += power(found.force[:, index], found.displacement[:, index])
        if name.part == 'journal':
            housing = model.channels.index(name.replace('journal', 'housing'))
            lost += power(found.force[:, index],
                          found.displacement[:, index] - found.displacement[:, housing])
    np.testing.assert_allclose(lost, fed, rtol=1e-8)


def test_points_move_by_what_enters_the_ground(model):
    found = model.unbalance_response(SPEEDS, UNBALANCE)
    own = [index for index, name in enumerate(model.channels) if name.station in (
        'left', 'right')]
    into = np.asarray(found.force[:, own])
    expected = np.einsum('npd,nd->np', model.soil_models[0].point_motion(SPEEDS), into)
    np.testing.assert_allclose(found.displacement[:, -6:], expected, rtol=1e-10)
    assert [str(name) for name in model.channels[-6:]] == [
        'yard_x', 'yard_y', 'yard_z', 'wall_x', 'wall_y', 'wall_z']
    assert np.isnan(found.force[:, -6:]).all()


def test_points_change_nothing_else(model):
    without = shared(points=()).unbalance_response(SPEEDS, UNBALANCE)
    found = model.unbalance_response(SPEEDS, UNBALANCE)
    # Points are joined over frequency with the blocks: other solves, the same functions.
    np.testing.assert_allclose(found.displacement[:, :-6], without.displacement, rtol=5e-3,
                               atol=1e-3 * np.abs(without.displacement).max())


def test_coupling_through_the_ground_is_not_small(model):
    """The neighbour's share of a block's motion, which separate grounds leave out."""
    alone = replace(model, points=(), soil_models=tuple(
        BoundaryElementModel.solved(SOIL, block.contact, omega_max=320.0)
        for block in model.foundations))
    force, omega = 'left_z', np.array([150.0])
    coupled, apart = (one.frequency_response(omega, speed=0.0, channel=force).displacement[
        0, one.channels.index('right_z')] for one in (model, alone))
    assert abs(coupled) > 3.0 * abs(apart)


def test_ground_answers_a_force_either_way(model):
    """Reciprocity of the coupled machine at rest."""
    omega = np.array([40.0, 200.0])
    there, back = (
        model.frequency_response(omega, speed=0.0, channel=one).displacement[
            :, model.channels.index(other)]
        for one, other in (('left_rx', 'three_housing_z'), ('three_housing_z', 'left_rx')))
    np.testing.assert_allclose(there, back, rtol=1e-7)


def test_the_table_of_a_running_machine_holds_points_and_coupling(model):
    table = ResponseTable.build(model, (20.0, 150.0))
    speed = np.linspace(21.0, 149.0, 37)
    exact = model.unbalance_response(speed, UNBALANCE).displacement
    found = table.predictor(UNBALANCE).answer(speed).displacement
    np.testing.assert_allclose(found, exact, rtol=1e-3, atol=1e-4 * np.abs(exact).max())


def test_modes_are_found_on_a_shared_ground(model):
    found = critical_speeds(model, (20.0, 260.0))
    assert found
    assert all(0.0 < one.damping_ratio < 1.0 for one in found)


def test_heavy_modes_do_not_depend_on_how_far_one_looks(model):
    """A root of the ground stays where it is; one of a fit moves with the range of its samples."""
    ends = (240.0, 260.0, 310.0)
    found = [[(one.speed, one.damping_ratio) for one in critical_speeds(model, (20.0, end))]
             for end in ends]
    common = [np.array([own for own in one if own[0] < 0.95 * ends[0]]) for one in found]
    assert [len(one) for one in common] == [len(common[-1])] * len(ends)
    assert common[-1][:, 1].max() > 0.2
    for one in common:
        np.testing.assert_allclose(one, common[-1], rtol=0.01)


def test_another_soil_goes_below_all_blocks(model):
    stiff = Soil(4.0 * SOIL.shear_modulus, SOIL.poisson_ratio, SOIL.density, SOIL.loss_factor)
    [other] = on_soils(model, [stiff])
    own, changed = (one.soil_models[0].compliance(np.zeros(1)) for one in (model, other))
    np.testing.assert_allclose(changed, own / 4.0, rtol=1e-12)


def test_a_force_on_the_ground_is_refused(model):
    with pytest.raises(RotorSoilError, match=r'force must act at one of .*right_rz, got yard_z'):
        model.frequency_response(np.array([10.0]), speed=0.0, channel='yard_z')


def test_points_and_blocks_need_a_ground_that_knows_them(model):
    with pytest.raises(RotorSoilError, match='1 points on the ground need a ground'):
        replace(model, points=('yard',))
    with pytest.raises(RotorSoilError, match='2 foundations need as many soil models, or one'):
        replace(model, points=(), soil_models=(BoundaryElementModel.solved(
            SOIL, Rectangle(0.5, 0.5), omega_max=50.0),))


def test_an_l_under_a_bearing_moves_as_a_rigid_body_about_its_centroid():
    """Kinetic energy of an L-shaped slab, from its cells, is that of its mass matrix."""
    parts = (Part(0.5, 1.0, -0.2, 0.3), Part(0.5, 0.3, 0.8, -0.4))
    plan = Plan(parts)
    x0, y0 = plan.centroid
    height, density = 0.6, 2400.0
    mass = density * plan.area * height
    block = Foundation('ell', plan, y0, mass, 0.5 * height,
                       solid_inertia(plan, mass=mass, height=height), height, x0,
                       mass * plan.product_moment / plan.area)
    point, weight = np.polynomial.legendre.leggauss(3)
    motion = np.array([0.3, -0.2, 0.5, 0.7, -0.4, 0.9])
    twice = 0.0
    for part in parts:
        x, y, z = np.meshgrid(part.x - x0 + part.half_width * point,
                              part.y - y0 + part.half_length * point,
                              0.5 * height * (1.0 + point), indexing='ij')
        share = np.einsum('i,j,k->ijk', weight, weight, weight) / 8.0
        place = np.stack([x, y, z], axis=-1)
        velocity = motion[:3] + np.cross(motion[3:], place)
        twice += density * part.area * height * (share * (velocity**2).sum(axis=-1)).sum()
    assert motion @ block.mass_matrix @ motion == pytest.approx(twice, rel=1e-12)
    # The shaft's plane x = 0 is left of the centroid: a seat there goes down as the block rolls.
    seat = block.seat_rows(position=y0 + 0.2, height=1.1)
    moved = motion[:3] + np.cross(motion[3:], np.array([-x0, 0.2, 1.1]))
    np.testing.assert_allclose(seat @ motion, moved[[0, 2]], rtol=1e-12)


def test_a_machine_needs_no_ground_for_no_points():
    assert CoupledModel(two_blocks().rotor, two_blocks().foundations,
                        two_blocks().soil_models).points == ()
