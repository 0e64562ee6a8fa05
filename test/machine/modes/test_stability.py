"""Growing vibration against closed forms, full eigenproblems and the exact support."""

import math

import numpy as np
import pytest
from scipy.optimize import brentq, minimize_scalar

from rotorsoil_ros.errors import OutOfTableError
from rotorsoil_ros.ground.cone import ConeModel
from rotorsoil_ros.ground.soil import Rectangle, Soil
from rotorsoil_ros.machine.coupled import CoupledModel
from rotorsoil_ros.machine.foundation import Foundation
from rotorsoil_ros.machine.modes.feeding import highest_fed
from rotorsoil_ros.machine.modes.pencil import Pencil
from rotorsoil_ros.machine.modes.stability import Stability, stability
from rotorsoil_ros.rotor.assembly import Rotor
from rotorsoil_ros.rotor.bearing import Bearing
from rotorsoil_ros.rotor.coefficients import SpeedTable
from rotorsoil_ros.rotor.disc import Disc
from rotorsoil_ros.rotor.shaft import Material, ShaftSection

from machines import elastic_machine, paper_machine, Springs, STEEL
from oracles.dense import _System, dense_eigenvalues

WEIGHTLESS = Material(2.1e11, 0.3, 0.0)
SKEW = np.array([[0.0, -1.0], [1.0, 0.0]])


def rotor_of(stiffness, damping, *, mass=40.0, diameter=0.05, foundation=None):
    """Return a disc amid a weightless shaft on two equal bearings."""
    section = ShaftSection(1.2, (diameter, diameter), (0.0, 0.0), 2, WEIGHTLESS)
    return Rotor(0.5, (section,), (Disc('disc', 0.6, mass, 0.0, 0.0),), tuple(
        Bearing(name, place, foundation, stiffness, damping)
        for name, place in (('a', 0.0), ('b', 1.2))))


def over_speed(constant, per_speed, speeds):
    """Return a table that is linear in the speed."""
    return SpeedTable(speeds, constant + np.asarray(speeds)[:, None, None] * per_speed)


def bent_stiffness(rotor):
    """Return the shaft's stiffness at its disc between rigid bearings [N/m]."""
    stiff = Rotor(0.5, rotor.shaft, rotor.discs, tuple(
        Bearing(one.name, one.position, None, 1e15 * np.eye(2), np.zeros((2, 2)))
        for one in rotor.bearings))
    model = CoupledModel(stiff)
    bent = model.frequency_response(np.zeros(1), speed=0.0, channel='disc_z')
    return 1.0 / bent.displacement[0, model.channels.index('disc_z')].real


@pytest.mark.parametrize('sign', [1.0, -1.0])
def test_jeffcott_rotor_is_unstable_above_the_speed_at_which_k_c_is_c_omega_n(sign):
    # Forward whirl sees k + i w c - i q: at the threshold w = q / c, and the disc resonates.
    spring, damper, slope, speeds = 2e7, 5e3, 2e3, np.linspace(0.0, 1000.0, 3)
    model = CoupledModel(rotor_of(over_speed(spring * np.eye(2), sign * slope * SKEW, speeds),
                                  damper * np.eye(2)))
    shaft = bent_stiffness(model.rotor)
    natural = math.sqrt(shaft * 2.0 * spring / (shaft + 2.0 * spring) / 40.0)
    (found,) = stability(model, (0.0, 1000.0)).instabilities
    assert found.low == pytest.approx(damper * natural / slope, rel=1e-6)  # 1e15 N/m is rigid
    assert found.high == 1000.0
    # F = K x with K_zx > 0 feeds the whirl that takes z into x (theory: forward).
    assert found.whirl == sign
    assert {feed.name: round(feed.share, 9) for feed in found.feeds} == {'a': 0.5, 'b': 0.5}
    assert {feed.cause for feed in found.feeds} == {'cross-coupled stiffness'}


def rigid_threshold(stiffness, damping):
    """Return frequency squared and the smallest unstable mass of a rigid rotor per bearing."""
    k, c = stiffness, damping
    spring = (k[0, 0] * c[1, 1] + k[1, 1] * c[0, 0] - k[0, 1] * c[1, 0] - k[1, 0] * c[0, 1]) / (
        c[0, 0] + c[1, 1])
    square = ((k[0, 0] - spring) * (k[1, 1] - spring) - k[0, 1] * k[1, 0]) / (
        c[0, 0] * c[1, 1] - c[0, 1] * c[1, 0])
    return square, spring / square


def test_rigid_rotor_on_journal_bearings_has_the_threshold_of_the_textbook():
    # Critical mass of a rigid rotor, Lund's equations, here with bearings that grow with speed.
    constant = np.array([[1.3e7, 0.0], [0.0, 0.9e7]])
    slope = np.array([[0.0, -2.2e4], [3.1e4, 0.0]])
    damping = np.array([[2.3e4, -3e3], [-3e3, 2.9e4]])
    speeds = np.linspace(50.0, 1500.0, 4)
    model = CoupledModel(rotor_of(over_speed(constant, slope, speeds), damping, mass=46.0,
                                  diameter=3.0))
    threshold = brentq(lambda speed: rigid_threshold(constant + speed * slope, damping)[1] - 23.0,
                       400.0, 1400.0, xtol=1e-9)
    (found,) = stability(model, (0.0, 1500.0)).instabilities
    assert found.low == pytest.approx(threshold, rel=1e-4)  # a shaft of 3 m is rigid
    assert found.whirl == 1


@pytest.mark.parametrize('skew, grows', [(0.99, False), (1.01, True)])
def test_unequal_springs_hold_cross_coupling_without_any_damping(skew, grows):
    # x'' + a x - q z = 0, z'' + b z + q x = 0 is a flutter if q > |a - b| / 2.
    stiffness = np.diag([3e6, 2e6]) + skew * 0.5e6 * SKEW
    model = CoupledModel(rotor_of(stiffness, np.zeros((2, 2)), diameter=3.0))
    assert highest_fed(model, (0.0, 100.0)) == math.inf
    assert bool(stability(model, (0.0, 100.0)).instabilities) is grows


def test_negative_stiffness_creeps_away_without_whirl():
    model = CoupledModel(rotor_of(np.diag([1e6, -1e6]), 100.0 * np.eye(2), diameter=3.0))
    found = stability(model, (0.0, 100.0))
    assert len(found.instabilities) == 1
    one = found.instabilities[0]
    assert (one.whirl, one.damping_ratio, one.low, one.high) == (0, -1.0, 0.0, 100.0)
    assert {feed.cause for feed in one.feeds} == {'negative stiffness'}
    assert found.unstable.tolist() == [[0.0, 100.0]]


def test_a_table_may_be_unstable_at_one_of_its_points_only():
    speeds = np.array([0.0, 400.0, 410.0, 412.0, 414.0, 424.0, 1000.0])
    skew = np.array([0.0, 0.0, 0.0, 2e6, 0.0, 0.0, 0.0])[:, None, None] * SKEW
    model = CoupledModel(rotor_of(SpeedTable(speeds, 2e7 * np.eye(2) + skew), 5e3 * np.eye(2)))
    (found,) = stability(model, (0.0, 1000.0)).instabilities
    assert 410.0 < found.low < 412.0 < found.high < 414.0
    for threshold in (found.low, found.high):
        grows = [growing(model, threshold * share) for share in (1.0 - 1e-5, 1.0 + 1e-5)]
        assert sorted(grows) == [0, 1]


def growing(model, speed, stiffness=None, damping=None):
    """Return how many modes grow by the full matrices."""
    none = np.zeros((len(model.support.motion_mass),) * 2)
    values = dense_eigenvalues(model, speed, stiffness=none if stiffness is None else stiffness,
                               damping=none if damping is None else damping)
    return int(np.count_nonzero(values.real > 1e-8 * np.abs(values)))


def random_machine(seed):
    """Return a machine on two springy blocks with skew bearings, and its support's matrices."""
    random = np.random.default_rng(seed)
    speeds = np.linspace(0.0, 900.0, 5)

    def bearing(name, place, block):
        spring, damper = 10.0 ** random.uniform(6.5, 8.0), 10.0 ** random.uniform(3.0, 4.7)
        skew = spring * random.uniform(-0.2, 0.2) * np.linspace(*random.uniform(0.0, 1.0, 2), 5)
        stiffness = spring * np.diag(random.uniform(0.5, 1.5, 2)) + skew[:, None, None] * SKEW
        return Bearing(name, place, block, SpeedTable(speeds, stiffness),
                       damper * np.diag(random.uniform(0.5, 1.5, 2)))

    rotor = Rotor(0.6, (ShaftSection(1.6, (0.07, 0.09), (0.0, 0.0), 6, STEEL),),
                  (Disc('wheel', random.uniform(0.2, 1.4), 60.0, 1.5, 2.9),),
                  (bearing('one', 0.1, 'left'), bearing('two', 1.4, 'right')))
    blocks, soils = [], []
    for name, place in (('left', 0.1), ('right', 1.4)):
        blocks.append(Foundation(name, Rectangle(0.4, 0.4), place, 900.0, 0.3, (60.0, 60.0, 80.0)))
        springs = 10.0 ** random.uniform(7.5, 8.5, 6)
        soils.append(Springs(np.diag(springs), np.diag(springs * random.uniform(1e-4, 1e-3))))
    model = CoupledModel(rotor, tuple(blocks), tuple(soils))
    whole = [np.zeros((12, 12)) for _ in range(2)]
    for index, soil in enumerate(soils):
        part = slice(6 * index, 6 * index + 6)
        whole[0][part, part], whole[1][part, part] = soil.stiffness, soil.damping
    return model, whole


@pytest.mark.parametrize('seed', range(12))
def test_no_growing_mode_of_a_random_machine_is_missed_and_none_invented(seed):
    # Twelve seeds: stable ones, unstable everywhere, with one threshold and with several.
    model, support = random_machine(seed)
    found = stability(model, (0.0, 900.0))
    for speed in np.linspace(0.0, 900.0, 31):
        told = sum(one.low <= speed <= one.high for one in found.instabilities)
        assert told == growing(model, speed, *support)
    for one in found.instabilities:
        for threshold in {one.low, one.high} - {0.0, 900.0}:
            counts = [growing(model, threshold * (1.0 + side), *support)
                      for side in (-1e-4, 1e-4)]
            assert abs(counts[1] - counts[0]) == 1


def test_the_threshold_on_soil_is_an_undamped_vibration_on_the_exact_support():
    # Compliances at real frequencies, not continued ones: the full system is singular there.
    soil = Soil(60e6, 0.3, 1900.0, 0.06)
    contact, speeds = Rectangle(0.6, 0.6), np.linspace(0.0, 900.0, 3)
    rotor = rotor_of(over_speed(2e7 * np.eye(2), 2e4 * SKEW, speeds), 5e3 * np.eye(2),
                     foundation='block')
    block = Foundation('block', contact, 0.6, 1500.0, 0.4, (200.0, 200.0, 300.0))
    model = CoupledModel(rotor, (block,), (ConeModel(soil, contact),))
    found = stability(model, (0.0, 900.0)).instabilities[0]
    assert 0.0 < found.low < 900.0

    def smallest(omega, speed=found.low):
        matrix = _System.of(model, np.array([omega]), np.array([speed])).matrix[0]
        matrix /= np.abs(matrix).max(axis=1, keepdims=True)
        return np.linalg.svd(matrix / np.abs(matrix).max(axis=0), compute_uv=False)[-1]

    best = minimize_scalar(smallest, bounds=(0.9 * found.frequency, 1.1 * found.frequency),
                           method='bounded', options={'xatol': 1e-9 * found.frequency})
    beside = min(smallest(best.x, found.low * share) for share in (0.999, 1.001))
    assert best.fun < 1e-3 * beside  # the least singular value has an absolute error


def test_a_machine_that_takes_energy_everywhere_is_not_solved(monkeypatch):
    def refuse(*arguments):
        raise AssertionError('modes were solved')

    monkeypatch.setattr(Pencil, 'up_to', refuse)
    assert stability(paper_machine(), (0.0, 900.0)) == Stability((0.0, 900.0), (), 0.0)


def test_pedestal_with_unequal_cross_terms_is_named():
    model = elastic_machine()
    found = stability(model, (0.0, 900.0))
    names = {feed.name for one in found.instabilities for feed in one.feeds}
    assert names <= {'one', 'two', 'three', 'the pedestal of one'}


def test_only_speeds_in_all_tables_are_looked_at():
    table = over_speed(2e7 * np.eye(2), np.zeros((2, 2)), np.array([100.0, 800.0]))
    model = CoupledModel(rotor_of(table, 5e3 * np.eye(2)))
    assert stability(model, (0.0, 900.0)).span == (100.0, 800.0)
    with pytest.raises(OutOfTableError, match=r'some speed of 0 to 477\.465 rpm'):
        stability(model, (0.0, 50.0))


def test_ranges_are_joined_and_speeds_told():
    found = stability(CoupledModel(rotor_of(
        over_speed(2e7 * np.eye(2), 2e3 * SKEW, np.array([0.0, 1000.0])), 5e3 * np.eye(2))),
        (0.0, 1000.0))
    low = found.unstable[0, 0]
    assert found.holds(np.array([0.0, 0.999 * low, 1.001 * low, 1000.0])).tolist() == [
        True, True, False, False]
    assert Stability.from_json(found.to_json()) == found
