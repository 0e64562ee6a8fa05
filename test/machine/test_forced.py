"""Fixed-speed and harmonic responses, pedestals and couples against ROSS and dense solves."""

import math

import numpy as np
import pytest

from rotorsoil_ros.errors import RotorSoilError
from rotorsoil_ros.ground.soil import RigidSoil
from rotorsoil_ros.machine.coupled import CoupledModel
from rotorsoil_ros.machine.foundation import Foundation
from rotorsoil_ros.rotor.assembly import Rotor
from rotorsoil_ros.rotor.bearing import Bearing, Pedestal
from rotorsoil_ros.rotor.disc import Disc
from rotorsoil_ros.rotor.shaft import Material, ShaftSection

from machines import (
    bearing,
    channel,
    CONE,
    CONTACT,
    elastic_machine,
    LENGTH,
    paper_machine,
    Restrained,
    STEEL,
    uniform_rotor,
)
from oracles.dense import dense_forced, dense_response
from oracles.published import jeffcott, response, ROSS_STATIONS

SPEEDS = np.linspace(1.0, 950.0, 41)
OMEGAS = np.linspace(0.0, 1500.0, 31)
# Random orders of additions in two ways of solving systems of 60 unknowns.
ROUND_OFF = 1e-11


def assert_same(got, expected):
    """Compare displacements and forces, each with the largest of its kind at a frequency."""
    for one, other in ((got.displacement, expected.displacement), (got.force, expected.force)):
        scale = np.nanmax(np.abs(other), axis=1, keepdims=True)
        np.testing.assert_allclose(one / scale, other / scale, rtol=0.0, atol=ROUND_OFF)


@pytest.mark.parametrize('axis, theirs', [('x', 'x'), ('z', 'y')])
def test_impact_test_at_rest_is_that_of_ross(axis, theirs):
    omega, columns = response('ross_Q1_shared_mf42_n0rpm_0-150Hz.csv')
    model = paper_machine(Restrained(CONE, 'x', 'z'))
    found = model.frequency_response(omega, speed=0.0, channel=f'disc_1_{axis}')
    for name, station in {**ROSS_STATIONS, 'fnd': 'block'}.items():
        # They shake with the amplitude 0.01 omega^2 in both directions at once; at rest a force
        # along one moves nothing along the other.
        ours = 0.01 * omega**2 * channel(model, found, f'{station}_{axis}')
        np.testing.assert_allclose(ours, columns[f'{name}_{theirs}'], rtol=1e-6)


@pytest.mark.parametrize('speed', [0.0, 700.0])
@pytest.mark.parametrize('where', ['wheel_x', 'probe_z', 'one_journal_z', 'one_housing_x',
                                   'two_housing_z', 'left_ry', 'right_z', 'left_y'])
def test_response_to_a_force_anywhere_is_the_dense_one(where, speed):
    model = elastic_machine()
    got = model.frequency_response(OMEGAS, speed=speed, channel=where)
    assert_same(got, dense_forced(model, OMEGAS, np.full(len(OMEGAS), speed), where))


@pytest.mark.parametrize('order', [0.5, 2.0, 3.0])
def test_harmonic_runs_inertia_at_its_order_and_gyroscopics_at_the_speed(order):
    model = elastic_machine()
    got = model.harmonic_response(SPEEDS, order=order, channel='coupling_x')
    assert_same(got, dense_forced(model, order * SPEEDS, SPEEDS, 'coupling_x'))
    np.testing.assert_array_equal(got.omega, order * SPEEDS)
    np.testing.assert_array_equal(got.speed, SPEEDS)


def test_first_harmonic_of_a_turning_force_is_unbalance():
    model = elastic_machine()
    x, z = (model.harmonic_response(SPEEDS, order=1.0, channel=f'wheel_{axis}').displacement
            for axis in 'xz')
    unbalance = model.unbalance_response(SPEEDS, np.array([1e-4, 0.0, 0.0])).displacement
    turning = 1e-4 * SPEEDS[:, None] ** 2 * (z - 1j * x)
    scale = np.abs(unbalance).max(axis=1, keepdims=True)
    np.testing.assert_allclose(turning / scale, unbalance / scale, rtol=0.0, atol=ROUND_OFF)


def test_force_at_rest_bends_a_simply_supported_shaft_as_a_spring():
    given = {'E': 2.1e11, 'd': 0.05, 'L': 1.2, 'm': 12.0}
    model = CoupledModel(jeffcott(given))
    found = model.frequency_response(np.zeros(1), speed=100.0, channel='disc_z')
    moment = math.pi * given['d'] ** 4 / 64.0
    shear = given['E'] / 2.6 * (6.0 * 1.3 / 8.8) * math.pi * given['d'] ** 2 / 4.0
    bending = given['L'] ** 3 / (48.0 * given['E'] * moment) + given['L'] / (4.0 * shear)
    # 1e14 N/m of bearing below a shaft of 1e7 N/m.
    assert channel(model, found, 'disc_z')[0] == pytest.approx(bending, rel=1e-6)


def test_response_at_rest_is_reciprocal_between_shaft_housing_and_block():
    base = elastic_machine()
    rotor = base.rotor
    # Symmetric coefficients: only a bearing that stores no energy of its own is reciprocal.
    bearings = tuple(Bearing(one.name, one.position, one.foundation, np.diag([2e8, 1e8]),
                             np.diag([2e4, 1e4]), Pedestal(30.0 * np.eye(2), 4e8 * np.eye(2),
                                                           1e4 * np.eye(2)))
                     for one in rotor.bearings)
    model = CoupledModel(Rotor(0.9, rotor.shaft, rotor.discs, bearings, rotor.probes),
                         base.foundations, base.soil_models)
    names = ['wheel_z', 'one_housing_x', 'three_housing_z', 'left_ry', 'right_rx', 'probe_x']
    rows = [model.channels.index(name) for name in names]
    matrix = np.array([model.frequency_response(np.array([250.0]), speed=0.0, channel=name)
                       .displacement[0, rows] for name in names])
    np.testing.assert_allclose(matrix, matrix.T, rtol=0.0, atol=1e-12 * np.abs(matrix).max())


def test_unbalance_and_couple_on_pedestals_and_tables_are_the_dense_ones():
    model = elastic_machine()
    unbalance = np.array([1e-5, 4e-6 * np.exp(1.1j), 3e-6j])
    assert_same(model.unbalance_response(SPEEDS, unbalance),
                dense_response(model, SPEEDS, unbalance))


@pytest.mark.usefixtures('no_shear')
def test_couple_is_two_opposite_unbalances():
    # Half of the arm toward +y the unbalance, half of it toward -y its opposite. On a shaft, but
    # not on a rigid disc, two such forces also shear what is between them.
    arm, moment = 1e-3, 2e-5 * np.exp(0.4j)

    model = CoupledModel(uniform_rotor(
        length=1.0, diameter=0.03, elements=8, material=STEEL,
        discs=[Disc('wheel', 0.4, 8.0, 0.02, 0.04), *(
            Disc(name, 0.4 + half, 0.0, 0.0, 0.0)
            for name, half in (('left', -arm / 2.0), ('right', arm / 2.0)))],
        bearings=[bearing(name, place, stiffness=1e7, damping=20.0, foundation=None)
                  for name, place in (('a', 0.0), ('b', 1.0))]), couples=('wheel',))
    assert model.planes == ('wheel', 'left', 'right', 'wheel_couple')
    expected = model.unbalance_response(SPEEDS, np.array([0.0, -moment, moment, 0.0]))
    got = model.unbalance_response(SPEEDS, np.array([0.0, 0.0, 0.0, moment * arm]))
    for name in ('wheel_x', 'wheel_z', 'a_journal_x', 'b_journal_z'):
        # The shaft between the two bends a little, which moves resonances.
        np.testing.assert_allclose(channel(model, got, name), channel(model, expected, name),
                                   rtol=1e-3)


def test_disc_on_pedestals_on_soil_is_a_chain_of_springs():
    given = {'E': 2.1e11, 'd': 0.05, 'L': 1.2, 'm': 12.0}
    shaft = Material(given['E'], 0.3, 0.0)
    pedestal = Pedestal(15.0 * np.eye(2), 3e7 * np.eye(2), 2e3 * np.eye(2))
    bearings = tuple(Bearing(name, place, 'block', 1e8 * np.eye(2), 500.0 * np.eye(2), pedestal)
                     for name, place in (('a', 0.0), ('b', given['L'])))
    section = ShaftSection(given['L'], (given['d'],) * 2, (0.0, 0.0), 2, shaft)
    rotor = Rotor(0.0, (section,), (Disc('disc', given['L'] / 2.0, given['m'], 0.0, 0.0),),
                  bearings)
    block = Foundation('block', CONTACT, given['L'] / 2.0, 42.0, 0.0, (1.0, 1.0, 1.0))
    model = CoupledModel(rotor, (block,), (Restrained(CONE, 'x', 'z'),))
    omega = np.array([60.0, 250.0, 500.0, 1100.0])
    found = model.unbalance_response(omega, np.array([1e-4]))

    rigid = CoupledModel(Rotor(0.0, (section,), rotor.discs, tuple(
        bearing(one.name, one.position, stiffness=1e15, foundation=None) for one in bearings)))
    flexible = channel(rigid, rigid.frequency_response(np.zeros(1), speed=0.0,
                                                       channel='disc_z'), 'disc_z')[0]
    soil = 1.0 / CONE.compliance(omega)[:, 2, 2] - 42.0 * omega**2
    seat = 1.0 / (1.0 / soil + 1.0 / (2.0 * (3e7 + 2e3j * omega)))
    housing = seat - 2.0 * 15.0 * omega**2
    below = 1.0 / (1.0 / (2.0 * (1e8 + 500j * omega)) + 1.0 / housing)
    chain = 1.0 / (flexible + 1.0 / below)
    disc = 1e-4 * omega**2 / (chain - 12.0 * omega**2)
    np.testing.assert_allclose(channel(model, found, 'disc_z'), disc, rtol=1e-6)  # 1e15 N/m
    np.testing.assert_allclose(channel(model, found, 'a_housing_z'), disc * chain / housing,
                               rtol=1e-6)
    np.testing.assert_allclose(channel(model, found, 'block_z'),
                               disc * chain / housing * seat / soil, rtol=1e-6)


def test_block_forces_are_those_that_move_the_soil():
    model = elastic_machine()
    found = model.frequency_response(OMEGAS, speed=300.0, channel='three_housing_x')
    for index in (-12, -6):
        rows = slice(index, index + 6 or None)
        soil = model.soil_models[index // 6]
        motion = (soil.compliance(OMEGAS) @ found.force[:, rows, None])[..., 0]
        np.testing.assert_allclose(motion, found.displacement[:, rows], rtol=1e-9,
                                   atol=1e-12 * np.abs(found.displacement).max())


def test_velocity_follows_the_excitation_not_the_speed():
    found = paper_machine().frequency_response(np.array([50.0]), speed=300.0, channel='disc_1_z')
    np.testing.assert_allclose(found.velocity, 50j * found.displacement)


def test_force_on_ground_that_does_not_move_moves_nothing():
    model = paper_machine(RigidSoil())
    found = model.frequency_response(np.array([50.0]), speed=300.0, channel='bearing_1_housing_z')
    assert not found.displacement.any()
    into_soil = found.force[0, [model.channels.index(f'block_{axis}') for axis in ('z', 'rx')]]
    np.testing.assert_allclose(into_soil, [1.0, -0.375 * LENGTH])


@pytest.mark.parametrize('call, rule', [
    (lambda model: model.frequency_response(OMEGAS, speed=0.0, channel='disc_9_z'),
     'force must act at one of one_journal_x, .* got disc_9_z'),
    (lambda model: model.harmonic_response(SPEEDS, order=0.0, channel='wheel_x'),
     'order must be > 0 and finite, got 0'),
    (lambda model: CoupledModel(model.rotor, model.foundations, model.soil_models,
                                couples=('tail',)),
     'couples must be on discs, wheel, coupling, got tail')])
def test_impossible_excitation_is_refused(call, rule):
    with pytest.raises(RotorSoilError, match=rule):
        call(elastic_machine())
