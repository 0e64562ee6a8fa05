"""The coupled response against ROSS, closed forms, the dense solve and balances of energy."""

import math

import numpy as np
import pytest

from rotorsoil_ros.errors import NotSolvedError, RotorSoilError
from rotorsoil_ros.ground.cone import ConeModel
from rotorsoil_ros.ground.soil import Rectangle, RigidSoil
from rotorsoil_ros.machine.coupled import CoupledModel
from rotorsoil_ros.machine.foundation import Foundation
from rotorsoil_ros.rotor.assembly import Rotor
from rotorsoil_ros.rotor.disc import Disc
from rotorsoil_ros.rotor.shaft import Material, ShaftSection

from machines import (
    bearing,
    channel,
    CONE,
    CONTACT,
    LENGTH,
    paper_machine,
    Restrained,
    SOIL,
    STEEL,
    two_blocks,
    uniform_rotor,
)
from oracles.dense import dense_response
from oracles.published import (
    friswell,
    jeffcott,
    lalanne_ferraris,
    published,
    response,
    ROSS_STATIONS,
    ROSS_UNBALANCE,
)

UNBALANCE = np.array([1e-5, 4e-6 * np.exp(1.1j)])
SPEEDS = np.linspace(1.0, 950.0, 61)


@pytest.mark.parametrize('name, soil, base', [
    ('rigid', RigidSoil(), None),
    ('shared_mf42', Restrained(CONE, 'x', 'z'), 'block'),
    ('sharedrock_mf42', Restrained(CONE, 'x', 'z', 'ry'), 'bearing_1_housing')])
def test_response_is_that_of_ross(name, soil, base):
    omega, columns = response(f'ross_Q1_{name}_0-150Hz.csv')
    model = paper_machine(soil)
    prediction = model.unbalance_response(omega, ROSS_UNBALANCE)
    keep = np.ones(len(omega), dtype=bool)
    if name == 'rigid':  # undamped but for 1e-8: the peaks have no figures to compare
        for critical in (44.01, 48.86, 123.12, 129.48):
            keep &= np.abs(omega / (2.0 * np.pi * critical) - 1.0) > 1.1e-3
    stations = {**ROSS_STATIONS, **({'fnd': base} if base else {})}
    for theirs, expected in columns.items():
        station, axis = theirs.split('_')
        if station not in stations:
            continue
        ours = channel(model, prediction, f'{stations[station]}_{"x" if axis == "x" else "z"}')
        sign = -1.0 if axis == 'x' else 1.0
        np.testing.assert_allclose(sign * ours[keep], expected[keep], rtol=1e-6, err_msg=theirs)


def test_rocking_block_is_that_of_an_independent_dense_solve():
    omega, columns = response('ref_Q1_sharedrock_mf42_block.csv')
    model = paper_machine(Restrained(CONE, 'x', 'z', 'ry'))
    prediction = model.unbalance_response(omega, ROSS_UNBALANCE)
    for theirs, ours, sign in (('u', 'x', -1.0), ('w', 'z', 1.0), ('phi', 'ry', -1.0)):
        np.testing.assert_allclose(sign * channel(model, prediction, f'block_{ours}'),
                                   columns[theirs], rtol=1e-6)


@pytest.mark.usefixtures('no_shear')
def test_jeffcott_rotor_has_its_closed_form_amplitude_and_phase():
    given, expected, rtol = published('cf_jeffcott_unbalance')
    model = CoupledModel(jeffcott(given, damping_at_disc=given['c']))
    stiffness = 48.0 * given['E'] * math.pi * given['d'] ** 4 / 64.0 / given['L'] ** 3
    natural = math.sqrt(stiffness / given['m'])
    prediction = model.unbalance_response(natural * np.array([0.5, 0.9, 1.0, 1.1, 2.0]),
                                          np.array([given['me']]))
    vertical = channel(model, prediction, 'disc_z')
    np.testing.assert_allclose(np.abs(vertical), expected, rtol=rtol)
    # 1e14 N/m of bearing moves the natural frequency by 1e-8: 1e-6 of phase at this damping.
    assert np.angle(vertical[2]) == pytest.approx(-np.pi / 2.0, abs=1e-5)


@pytest.mark.usefixtures('no_shear')
def test_jeffcott_rotor_on_soil_is_a_chain_of_springs():
    given, expected, rtol = published('cf_jeffcott_on_soil')
    model = CoupledModel(
        jeffcott(given, foundation='block', stiffness=given['kb'], damping=given['cb']),
        (Foundation('block', CONTACT, given['L'] / 2.0, given['mf'], 0.0, (1.0, 1.0, 1.0)),),
        (Restrained(CONE, 'x', 'z'),))
    omega = 2.0 * np.pi * np.array([10.0, 30.0, 45.0, 60.0, 100.0, 150.0])
    prediction = model.unbalance_response(omega, np.array([given['me']]))
    found = [np.abs(channel(model, prediction, name)) for name in ('disc_z', 'block_z')]
    np.testing.assert_allclose(np.concatenate(found), expected, rtol=rtol)


def test_published_unbalance_response_of_the_three_disc_rotor():
    given, expected, rtol = published('aster_sdll126c_unbalance')
    base, _, _ = published('LF_3disc_25000rpm')
    # Their spin takes y into z, ours z into x: their y is our z, their z our x.
    turned = {**base, 'kxx': given['kzz'], 'kzz': given['kyy']}
    model = CoupledModel(lalanne_ferraris(turned, given['czz'], given['cyy']))
    prediction = model.unbalance_response(
        np.array([given['speed_rpm'] * 2.0 * math.pi / 60.0]), np.array([0.0, given['me'], 0.0]))
    y, z = (channel(model, prediction, f'disc_2_{axis}')[0] for axis in 'zx')
    # The figures of code_aster itself lie as far below those of the book.
    np.testing.assert_allclose([abs(y), abs(z)], expected[:2], rtol=rtol)
    np.testing.assert_allclose(np.degrees(np.angle([y, z])), expected[2:], atol=0.02)


def test_friswell_rotor_moves_as_ross_says():
    given, expected, rtol = published('ROSS_unbalance_45deg')
    rotor = friswell(given, np.diag([given['kxx'], given['kyy']]))
    rotor = Rotor(0.0, rotor.shaft, (*rotor.discs, Disc('end', 0.0, 0.0, 0.0, 0.0)),
                  rotor.bearings)
    model = CoupledModel(rotor)
    prediction = model.unbalance_response(np.array([50.0, 100.0]), np.array([0.0, 0.0, -1j]))
    x, z = -channel(model, prediction, 'end_x'), channel(model, prediction, 'end_z')
    major = np.abs((z + 1j * x) / 2.0) + np.abs((z - 1j * x) / 2.0)
    probe = (x + z) / math.sqrt(2.0)
    np.testing.assert_allclose(np.abs(probe), expected[:2], rtol=rtol)
    np.testing.assert_allclose(major, expected[2:], rtol=rtol)


@pytest.mark.parametrize('model', [
    paper_machine(), paper_machine(RigidSoil()), paper_machine(mass=420.0),
    two_blocks(), two_blocks(cross=5e7)],
    ids=['cone', 'rigid', 'heavy', 'two blocks', 'cross-coupled'])
def test_fast_solve_is_the_dense_one(model):
    unbalance = UNBALANCE
    fast = model.unbalance_response(SPEEDS, unbalance)
    slow = dense_response(model, SPEEDS, unbalance)
    # 1e9 N/m beside a slender shaft costs the dense solve 7 of its 16 digits.
    for got, expected in ((fast.displacement, slow.displacement), (fast.force, slow.force)):
        scale = np.nanmax(np.abs(expected), axis=1, keepdims=True)
        np.testing.assert_allclose(got / scale, expected / scale, rtol=1e-8, atol=1e-13)


@pytest.mark.parametrize('gap', [0.0, 1e-14, -4e-13, 1e-11])
def test_fast_solve_holds_at_the_poles_of_the_rotor_itself_and_beside_them(gap):
    model = paper_machine()
    modes = model._synchronous_modes
    poles = np.sort(modes.inverse[modes.inverse > 0.0])[::-1][:4] ** -0.5
    poles = poles * (1.0 + gap)
    fast, slow = (solve(poles, UNBALANCE) for solve in (
        model.unbalance_response, lambda *given: dense_response(model, *given)))
    moving = [i for i, name in enumerate(model.channels) if name != 'block_y']
    np.testing.assert_allclose(fast.displacement[:, moving], slow.displacement[:, moving],
                               rtol=1e-7)


def three_collinear():
    """Return a machine with three bearings on one block: N_BB of the paper is singular."""
    base = two_blocks()
    block = Foundation('raft', Rectangle(0.6, 1.2), 1.0, 4000.0, 0.4, (900.0, 500.0, 1200.0))
    rotor = base.rotor
    bearings = tuple(bearing(one.name, one.position, stiffness=one.stiffness,
                             damping=one.damping, foundation='raft') for one in rotor.bearings)
    return CoupledModel(Rotor(rotor.shaft_height, rotor.shaft, rotor.discs, bearings,
                              rotor.probes), (block,), (ConeModel(SOIL, block.contact),))


def test_three_collinear_bearings_stand_on_one_block():
    model = three_collinear()
    seats = model.support.standing(np.array([100.0])).receptance[0]
    rank = np.linalg.matrix_rank(seats, tol=1e-12 * np.abs(seats).max())
    assert rank == 4  # of six: not invertible
    fast = model.unbalance_response(SPEEDS, UNBALANCE)
    slow = dense_response(model, SPEEDS, UNBALANCE)
    scale = np.abs(slow.displacement).max(axis=1, keepdims=True)
    np.testing.assert_allclose(fast.displacement / scale, slow.displacement / scale, rtol=1e-9,
                               atol=1e-13)


@pytest.mark.parametrize('model', [two_blocks(), three_collinear()], ids=['two', 'one'])
def test_power_that_unbalance_feeds_in_is_lost_in_bearings_and_soil(model):
    prediction = model.unbalance_response(SPEEDS, UNBALANCE)
    fed = np.zeros(len(SPEEDS))
    for disc, moment in zip(model.rotor.discs, UNBALANCE, strict=True):
        for axis, direction in (('x', -1j), ('z', 1.0)):
            force = direction * moment * SPEEDS**2
            fed += _power(force, SPEEDS * channel(model, prediction, f'{disc.name}_{axis}'))
    lost = np.zeros(len(SPEEDS))
    for index, name in enumerate(model.channels):
        if name.rsplit('_', 1)[0] in ('left', 'right', 'raft'):
            lost += _power(prediction.force[:, index],
                           SPEEDS * prediction.displacement[:, index])
        if '_journal_' in name:
            housing = model.channels.index(name.replace('journal', 'housing'))
            gap = prediction.displacement[:, index] - prediction.displacement[:, housing]
            lost += _power(prediction.force[:, index], SPEEDS * gap)
    np.testing.assert_allclose(lost, fed, rtol=1e-8)
    assert np.all(fed > 0.0)


def _power(force, velocity):
    """Return the mean power of a force on a motion whose velocity is i times the given one."""
    return 0.5 * (force * np.conj(1j * velocity)).real


def test_residual_of_the_equations_of_motion_of_the_block_is_round_off():
    # Newton on the block: forces through bearings = soil reaction + inertia, soil = N^-1 u.
    model = three_collinear()
    prediction = model.unbalance_response(SPEEDS, UNBALANCE)
    motion = prediction.displacement[:, -6:]
    into_soil = prediction.force[:, -6:]
    compliance = model.soil_models[0].compliance(SPEEDS)
    np.testing.assert_allclose((compliance @ into_soil[..., None])[..., 0], motion, rtol=1e-9,
                               atol=1e-12 * np.abs(motion).max())


def test_unbalance_excites_forward_whirl():
    model = paper_machine(RigidSoil())
    prediction = model.unbalance_response(np.array([200.0, 500.0]), UNBALANCE)
    x, z = (channel(model, prediction, f'disc_2_{axis}') for axis in 'xz')
    np.testing.assert_allclose(np.abs(z - 1j * x), 0.0, atol=1e-12 * np.abs(z).max())


def test_response_is_reciprocal_without_gyroscopics():
    base = two_blocks()
    discs = tuple(Disc(disc.name, disc.position, disc.mass, disc.diametral_inertia, 0.0)
                  for disc in base.rotor.discs)
    bearings = tuple(bearing(one.name, one.position, stiffness=np.diag([2e8, 1e8]),
                             damping=2e4, foundation=one.foundation)
                     for one in base.rotor.bearings)
    massless = ShaftSection(2.0, (0.08, 0.10), (0.0, 0.02), 10, Material(2.09e11, 0.3, 0.0))
    model = CoupledModel(Rotor(0.9, (massless,), discs, bearings), base.foundations,
                         base.soil_models)
    ports, first = 2 * len(model.rotor.stations), 2 * len(bearings)
    loads = np.eye(ports, dtype=complex)[:, first:first + 4]
    displacement, _ = model.synchronous_response(np.array([90.0]), loads)
    receptance = displacement[0, [model.channels.index(name) for name in (
        'wheel_x', 'wheel_z', 'coupling_x', 'coupling_z')]]
    np.testing.assert_allclose(receptance, receptance.T, rtol=1e-8,
                               atol=1e-12 * np.abs(receptance).max())


def test_undamped_resonance_is_an_error_not_a_number():
    model = CoupledModel(jeffcott({'E': 2.1e11, 'd': 0.05, 'L': 1.0, 'm': 10.0}, stiffness=1e8))
    modes = model._synchronous_modes.inverse
    pole = np.array([modes.max() ** -0.5])
    try:
        prediction = model.unbalance_response(pole, np.array([1e-4]))
    except NotSolvedError:
        return
    assert np.abs(prediction.displacement).max() > 1.0  # a metre from 1e-4 kg m: visibly infinite


def test_machine_at_rest_does_not_vibrate():
    prediction = paper_machine().unbalance_response(np.zeros(1), UNBALANCE)
    assert not prediction.displacement.any()
    assert not prediction.velocity.any()


def test_channels_are_those_of_the_contract():
    assert paper_machine().channels == (
        'bearing_1_journal_x', 'bearing_1_journal_z', 'bearing_1_housing_x',
        'bearing_1_housing_z', 'bearing_2_journal_x', 'bearing_2_journal_z',
        'bearing_2_housing_x', 'bearing_2_housing_z', 'disc_1_x', 'disc_1_z', 'disc_2_x',
        'disc_2_z', 'block_x', 'block_y', 'block_z', 'block_rx', 'block_ry', 'block_rz')


def test_two_stations_of_one_name_are_refused():
    rotor = uniform_rotor(length=LENGTH, diameter=0.02, elements=2, material=STEEL,
                          discs=[Disc('a', 0.1, 1.0, 0.0, 0.0), Disc('a', 0.2, 1.0, 0.0, 0.0)],
                          bearings=[bearing('b', 0.0, stiffness=1e6, foundation=None),
                                    bearing('c', LENGTH, stiffness=1e6, foundation=None)])
    with pytest.raises(RotorSoilError, match='names must differ between stations, got a_'):
        CoupledModel(rotor)


def test_shaft_on_one_bearing_falls():
    with pytest.raises(RotorSoilError, match='bearings must be at two places or more, got 1'):
        uniform_rotor(length=LENGTH, diameter=0.02, elements=2, material=STEEL,
                      bearings=[bearing('b', 0.0, stiffness=1e6, foundation=None),
                                bearing('c', 0.0, stiffness=1e6, foundation=None)])
