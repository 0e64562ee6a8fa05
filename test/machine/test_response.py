"""The response table against the exact solution at speeds it has not seen."""

import dataclasses
import math

import numpy as np
import pytest

from rotorsoil_ros.errors import NotSolvedError, OutOfTableError, RotorSoilError, solved
from rotorsoil_ros.ground.soil import RigidSoil
from rotorsoil_ros.machine import pieces
from rotorsoil_ros.machine.coupled import CoupledModel
from rotorsoil_ros.machine.response import ResponseTable
from rotorsoil_ros.rotor.disc import Disc

from machines import bearing, paper_machine, STEEL, two_blocks, uniform_rotor

RANGE = (2.0 * math.pi, 300.0 * math.pi)
UNBALANCE = np.array([1e-5, 3e-6 * np.exp(2.0j)])
PROMISED = 1e-4


@pytest.fixture(scope='module')
def machine():
    """Return the paper's machine on cones."""
    return paper_machine()


@pytest.fixture(scope='module')
def table(machine):
    """Return its table."""
    return ResponseTable.build(machine, RANGE)


def deviation(table, model, speed, unbalance):
    """Return the largest deviation of a look-up relative to the local amplitude."""
    got = table.predictor(unbalance).predict(speed)
    exact = model.unbalance_response(speed, unbalance)
    moving = np.abs(exact.displacement).max(axis=0) > 1e-9 * np.abs(exact.displacement).max()
    pairs = [(got.displacement[:, moving], exact.displacement[:, moving]),
             (got.force[:, table.transmits_force], exact.force[:, table.transmits_force])]
    return max(np.nanmax(np.abs(one - other) / np.maximum(
        np.abs(other), 1e-9 * np.abs(other).max(axis=1, keepdims=True)))
        for one, other in pairs)


@pytest.mark.parametrize('model', [paper_machine(), paper_machine(mass=420.0), two_blocks(),
                                   two_blocks(cross=5e7)],
                         ids=['cone', 'heavy', 'two blocks', 'cross-coupled'])
def test_table_is_right_at_unseen_speeds(model):
    table = ResponseTable.build(model, RANGE)
    speed = np.random.default_rng(1).uniform(*RANGE, size=2000)
    stable = table.stability.holds(speed)
    np.testing.assert_array_equal(table.predictor(UNBALANCE).covers(speed), stable)
    assert stable.any()
    assert deviation(table, model, speed[stable], UNBALANCE) < PROMISED
    assert table.accuracy < PROMISED


def test_unstable_speeds_have_no_answer_and_are_no_gaps():
    # 5e7 N/m of cross-coupling: a mode of the cross-coupled blocks grows at high speeds.
    table = ResponseTable.build(two_blocks(cross=5e7), RANGE)
    (low, high), = table.stability.unstable.tolist()
    assert RANGE[0] < low < high == RANGE[1]
    assert len(table.gaps) == 0
    predictor = table.predictor(UNBALANCE)
    assert predictor.covers(np.array([0.999 * low, 1.001 * low, high])).tolist() == [
        True, False, False]
    with pytest.raises(OutOfTableError, match='a vibration grows there'):
        predictor.predict(np.array([1.001 * low]))
    again = ResponseTable.from_arrays(table.to_arrays(), table.channels)
    assert again.stability == table.stability


def resonances(model, count):
    """Return the rotor's own forward poles [rad/s], which on rigid ground are criticals."""
    forward = model._synchronous_modes.inverse[0]
    return np.sort(forward)[::-1][:count] ** -0.5


def test_table_is_right_across_resonances_a_millionth_wide():
    model = paper_machine(RigidSoil())
    table = ResponseTable.build(model, RANGE)
    offsets = np.concatenate([-np.logspace(-2, -9, 200), np.logspace(-9, -2, 200)])
    for critical in resonances(model, 2):
        assert deviation(table, model, critical * (1.0 + offsets), UNBALANCE) < PROMISED


def test_undamped_resonance_is_a_gap_and_nothing_else_is():
    model = paper_machine(RigidSoil(), damping=0.0)
    table = ResponseTable.build(model, RANGE)
    predictor = table.predictor(UNBALANCE)
    criticals = resonances(model, 2)
    assert not predictor.covers(criticals).any()
    with pytest.raises(OutOfTableError, match='off undamped resonances'):
        predictor.predict(criticals)
    assert np.diff(table.gaps).sum() < 1e-7 * RANGE[1]
    beside = np.concatenate([criticals * (1.0 - 1e-6), criticals * (1.0 + 1e-6)])
    assert deviation(table, model, beside, UNBALANCE) < PROMISED


def test_weakly_excited_backward_resonance_is_not_missed():
    # Bearings that differ by 1e-4 let unbalance excite backward whirl a little, very sharply.
    model = CoupledModel(uniform_rotor(
        length=1.0, diameter=0.03, elements=8, material=STEEL,
        discs=[Disc('d', 0.4, 8.0, 0.02, 0.04)],
        bearings=[bearing(name, place, stiffness=np.diag([1e7, 1.0001e7]), damping=20.0,
                          foundation=None) for name, place in (('a', 0.0), ('b', 1.0))]))
    backward = np.sort(model._synchronous_modes.inverse[1])[-1] ** -0.5
    table = ResponseTable.build(model, (10.0, 2.0 * backward))
    offsets = np.concatenate([-np.logspace(-2, -8, 300), np.logspace(-8, -2, 300)])
    assert deviation(table, model, backward * (1.0 + offsets), np.array([1e-4])) < PROMISED


def test_look_up_does_not_depend_on_how_speeds_are_divided(table):
    predictor = table.predictor(UNBALANCE)
    speed = np.random.default_rng(2).uniform(*RANGE, size=20000)
    together = predictor.predict(speed)
    for index in range(0, len(speed), 97):
        alone = predictor.predict(speed[index:index + 1])
        np.testing.assert_array_equal(alone.displacement[0], together.displacement[index])
        np.testing.assert_array_equal(alone.force[0], together.force[index])


def test_a_single_speed_is_found_where_many_are(table):
    low, high = table.speed_range
    edges = table.pieces.edges
    speed = np.concatenate([
        edges, np.nextafter(edges, low), np.nextafter(edges, high), [0.5 * (low + high)],
        [-1.0, -np.inf, np.inf, np.nan, np.nextafter(low, 0.0), np.nextafter(high, np.inf)]])
    assert [table.pieces.find_one(one) for one in speed.tolist()] == (
        table.pieces.find(speed).tolist())


def test_what_a_prediction_gives_out_is_a_copy_that_says_so(table):
    answer = table.predictor(np.ones(len(table.planes))).predict(np.array([300.0]))
    with pytest.raises(ValueError, match='read-only'):
        answer.displacement[0] = 0.0


def test_unbalance_of_two_planes_adds_up_as_vectors(table, machine):
    speed = np.array([300.0])
    whole = table.predictor(UNBALANCE).predict(speed).displacement
    parts = [table.predictor(np.where(mask, UNBALANCE, 0.0)).predict(speed).displacement
             for mask in ([True, False], [False, True])]
    np.testing.assert_allclose(whole, sum(parts), rtol=1e-12, atol=1e-25)
    exact = machine.unbalance_response(speed, UNBALANCE).displacement
    np.testing.assert_allclose(whole, exact, rtol=PROMISED, atol=1e-20)


def test_velocity_leads_displacement_by_a_quarter_turn(table):
    prediction = table.predictor(UNBALANCE).predict(np.array([100.0, 200.0]))
    np.testing.assert_allclose(prediction.velocity[1], 200j * prediction.displacement[1])


@pytest.mark.parametrize('speed', [RANGE[0] * (1 - 1e-12), RANGE[1] * (1 + 1e-12), -RANGE[0],
                                   math.nan, math.inf, -math.inf, 0.0])
def test_nothing_is_extrapolated(table, speed):
    predictor = table.predictor(UNBALANCE)
    assert not predictor.covers(np.array([speed]))[0]
    with pytest.raises(OutOfTableError, match='60 to 9000 rpm'):
        predictor.predict(np.array([100.0, speed]))


def test_both_ends_belong_to_the_table(table):
    predictor = table.predictor(UNBALANCE)
    assert predictor.covers(np.array(RANGE)).all()
    assert np.isfinite(predictor.predict(np.array(RANGE)).displacement).all()


def test_no_speeds_have_no_answers(table):
    assert table.predictor(UNBALANCE).predict(np.empty(0)).displacement.shape == (0, 18)


def test_table_survives_being_written_as_arrays(table):
    again = ResponseTable.from_arrays(table.to_arrays(), table.channels)
    speed = np.array([123.0, 456.0])
    np.testing.assert_array_equal(again.predictor(UNBALANCE).predict(speed).displacement,
                                  table.predictor(UNBALANCE).predict(speed).displacement)
    assert (again.channels, again.planes) == (table.channels, table.planes)
    assert again.accuracy == table.accuracy


@pytest.mark.parametrize('unbalance', [[1e-5], [1e-5, math.nan], [1.0, 2.0, 3.0]])
def test_unbalance_that_does_not_fit_is_refused(table, unbalance):
    with pytest.raises(RotorSoilError, match='2 finite complex moments in kg m'):
        table.predictor(np.array(unbalance))


@pytest.mark.parametrize('low, high', [(-1.0, 2.0), (2.0, 1.0), (1.0, math.nan), (0.0, math.inf)])
def test_impossible_speed_range_is_refused(machine, low, high):
    with pytest.raises(RotorSoilError, match='speed range must be 0 <= low < high in rad/s'):
        ResponseTable.build(machine, (low, high))


def test_rotor_without_discs_answers_nothing_to_no_unbalance():
    base = paper_machine()
    model = CoupledModel(dataclasses.replace(base.rotor, discs=()), base.foundations,
                         base.soil_models)
    found = ResponseTable.build(model, RANGE).predictor(np.zeros(0)).predict(np.array([100.0]))
    assert found.displacement.shape == (1, 14)
    assert not found.displacement.any()


def test_response_that_is_nothing_but_round_off_is_refused_in_finite_time():
    with pytest.raises(NotSolvedError, match='rough everywhere'):
        ResponseTable.build(paper_machine(stiffness=1e18), RANGE)


def test_pieces_are_the_same_however_many_are_looked_at_together(machine, table, monkeypatch):
    monkeypatch.setattr(pieces, '_MOST_VALUES', 20_000)
    again = ResponseTable.build(machine, RANGE)
    np.testing.assert_array_equal(again.pieces.edges, table.pieces.edges)
    np.testing.assert_array_equal(again.pieces.resolved, table.pieces.resolved)


@pytest.mark.parametrize('raised, says', [
    (np.linalg.LinAlgError('Singular matrix'), 'the modes cannot be computed: Singular matrix'),
    (ValueError('array must not contain infs or NaNs'), 'a number is too large or too small'),
    (MemoryError('Unable to allocate 43.2 GiB'), 'it needs too much memory, Unable to allocate'),
    (FloatingPointError('overflow'), 'the modes cannot be computed: overflow')])
def test_what_numpy_and_scipy_raise_becomes_an_error_of_this_package(raised, says):
    with pytest.raises(NotSolvedError, match=says), solved('the modes'):
        raise raised


def test_a_slip_of_this_package_stays_one():
    with pytest.raises(ValueError, match='no such thing'), solved('the modes'):
        raise ValueError('no such thing')
    with pytest.raises(OutOfTableError), solved('the modes'):
        raise OutOfTableError('beyond')
