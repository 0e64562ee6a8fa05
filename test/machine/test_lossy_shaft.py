"""Shafts that lose and are loaded, seals with mass, tables over frequency: against oracles."""

from dataclasses import replace
import math

import numpy as np
import pytest
from scipy.optimize import brentq

from rotorsoil_ros.machine.coupled import CoupledModel
from rotorsoil_ros.machine.damping import DampingSplitter, EXTERNAL, INTERNAL, TORQUE
from rotorsoil_ros.machine.modes.campbell import campbell
from rotorsoil_ros.machine.modes.critical import critical_speeds
from rotorsoil_ros.machine.modes.feeding import _torque_feeds
from rotorsoil_ros.machine.modes.stability import stability
from rotorsoil_ros.rotor.assembly import Rotor
from rotorsoil_ros.rotor.bearing import Bearing
from rotorsoil_ros.rotor.coefficients import FrequencyTable, SpeedTable
from rotorsoil_ros.rotor.disc import Disc
from rotorsoil_ros.rotor.shaft import Material, ShaftDamping, ShaftSection

from machines import elastic_machine, springy_soils, STEEL
from oracles.dense import dense_eigenvalues, dense_forced, dense_response

DAMPING = ShaftDamping(viscous=8e-6, loss_factor=0.02, fixed_mass=1.5, fixed_stiffness=4e-6)
WEIGHTLESS = Material(2.1e11, 0.3, 0.0)
MASS, LENGTH, DIAMETER = 30.0, 1.2, 0.05
# At the middle of a pinned rod, 48 E I / L^3, and shear (Cowper).
_BENT = LENGTH**3 / (48.0 * 2.1e11 * math.pi / 64.0 * DIAMETER**4)
_SHEARED = LENGTH / (4.0 * (6.0 * 1.3 / (7.0 + 6.0 * 0.3)) * 2.1e11 / 2.6
                     * math.pi / 4.0 * DIAMETER**2)
SPRING = 1.0 / (_BENT + _SHEARED)
NATURAL = math.sqrt(SPRING / MASS)


def loaded_machine(*, damping=DAMPING, torque=3e3, axial_force=-2e4, soils=None):
    """Return two blocks under a rotor that has everything a shaft and a seal may have."""
    plain = elastic_machine(soils)
    rotor = plain.rotor
    whole = rotor.shaft[0]
    half = replace(whole, length=1.0, elements=5, outer_diameter=(0.08, 0.09),
                   inner_diameter=(0.0, 0.01))
    shaft = (replace(half, damping=damping, torque=torque),
             replace(half, outer_diameter=(0.09, 0.10), inner_diameter=(0.01, 0.02),
                     axial_force=axial_force))
    seal = Bearing('seal', 0.9, 'left', np.array([[2e5, 6e5], [-6e5, 3e5]]), 3e3 * np.eye(2),
                   inertia=np.array([[9.0, 2.0], [-2.0, 7.0]]))
    return replace(plain, rotor=replace(rotor, shaft=shaft, drag=1.5,
                                        bearings=(*rotor.bearings, seal)))


def frequency_table():
    """Return stiffness that is neither the same at every speed nor at every frequency."""
    stiffness, speeds = np.array([[2e7, 5e6], [-5e6, 1e7]]), np.array([0.0, 400.0, 1000.0])
    growth = np.array([1.0, 1.4, 2.0])[:, None, None]
    return FrequencyTable(np.array([0.0, 200.0, 600.0, 2500.0]), tuple(
        SpeedTable(speeds, factor * stiffness * growth) for factor in (1.0, 1.3, 1.2, 2.0)))


def tabled_machine():
    """Return the same with a seal whose coefficients follow the frequency."""
    machine = loaded_machine()
    *bearings, seal = machine.rotor.bearings
    seal = replace(seal, stiffness=frequency_table(), damping=FrequencyTable(
        np.array([0.0, 900.0, 2500.0]), (3e3 * np.eye(2), 2e3 * np.eye(2), 1e3 * np.eye(2))))
    return replace(machine, rotor=replace(machine.rotor, bearings=(*bearings, seal)))


def assert_same(found, expected):
    """Compare all channels, each by its largest; forces too."""
    for one, other in ((found.displacement, expected.displacement),
                       (found.force, expected.force)):
        known = np.isfinite(other).all(axis=0)
        scale = np.abs(other[:, known]).max(axis=0)
        # The dense system has dofs of 1e-12 beside ones of 1: it is the rougher one.
        np.testing.assert_allclose(one[:, known] / scale, other[:, known] / scale, atol=1e-9)


@pytest.mark.parametrize('make', [loaded_machine, tabled_machine])
def test_response_is_that_of_the_dense_system(make):
    machine, unbalance = make(), np.array([1e-3, 2e-3j, 3e-4])
    speed = np.linspace(20.0, 950.0, 60)
    assert_same(machine.unbalance_response(speed, unbalance),
                dense_response(machine, speed, unbalance))
    # On both sides of the speed, where a hysteretic shaft gives and takes.
    fixed = np.full(60, 400.0)
    assert_same(machine.frequency_response(speed, speed=400.0, channel='wheel_x'),
                dense_forced(machine, speed, fixed, 'wheel_x'))
    assert_same(machine.harmonic_response(speed, order=2.0, channel='wheel_z'),
                dense_forced(machine, 2.0 * speed, speed, 'wheel_z'))
    assert_same(machine.harmonic_response(speed, order=0.5, channel='wheel_z'),
                dense_forced(machine, 0.5 * speed, speed, 'wheel_z'))


def test_modes_are_those_of_the_full_eigenproblem():
    machine = loaded_machine(damping=replace(DAMPING, loss_factor=0.0), soils=springy_soils())
    # What the soils of springs are, over the motion of the blocks and the pedestals.
    ground = np.linalg.inv(machine.support.motion_compliance(np.array([0.0, 1.0])))
    stiffness, damping = ground[0].real, (ground[1] - ground[0]).imag
    found = campbell(machine, np.array([200.0, 700.0]), 12).eigenvalue
    for row, speed in enumerate((200.0, 700.0)):
        exact = dense_eigenvalues(machine, speed, stiffness=stiffness, damping=damping)
        swings = exact[exact.imag > 0.2 * np.abs(exact)]
        nearest = np.abs(found[row][:, None] - swings).min(axis=1)
        np.testing.assert_array_less(nearest, 1e-7 * np.abs(found[row]))


def test_work_of_the_unbalance_is_what_all_parts_take():
    # Couples act on slopes, which are no channels: none here.
    machine, unbalance = loaded_machine(), np.array([1e-3, 2e-3j, 0.0])
    speed = np.linspace(30.0, 900.0, 12)
    split = DampingSplitter(machine).forced(speed, unbalance)
    found = machine.unbalance_response(speed, unbalance)
    loads = speed[:, None] ** 2 * (machine.plane_forces @ unbalance)
    discs = [index for index, channel in enumerate(machine.channels)
             if channel.station in ('wheel', 'coupling')]
    first = 2 * len(machine.rotor.bearings)
    of_forces = (found.displacement[:, discs].conj() * loads[:, first:first + 4]).imag.sum(axis=1)
    np.testing.assert_allclose(split.total, math.pi * of_forces, rtol=1e-12)
    assert {kind for kind, _ in split.parts} >= {INTERNAL, EXTERNAL, TORQUE}
    assert np.all(split.share(EXTERNAL) > 0.0)


NONE = ShaftDamping()


def jeffcott(*, damping=NONE, drag=0.0, torque=0.0, seal=None):
    """Return a disc amid a weightless shaft on rigid bearings."""
    section = ShaftSection(LENGTH, (DIAMETER, DIAMETER), (0.0, 0.0), 4, WEIGHTLESS,
                           damping=damping, torque=torque)
    bearings = [Bearing(name, place, None, 1e13 * np.eye(2), np.zeros((2, 2)))
                for name, place in (('a', 0.0), ('b', LENGTH))]
    return CoupledModel(Rotor(0.5, (section,), (Disc('disc', 0.5 * LENGTH, MASS, 0.0, 0.0),),
                              (*bearings, *([] if seal is None else [seal])), drag=drag))


@pytest.mark.parametrize('ratio', [0.25, 1.0])
def test_viscous_shaft_whirls_from_one_plus_external_over_internal_times_its_critical(ratio):
    # Ehrich; Genta, sec. 3.3: Omega = omega (1 + c_e / c_i).
    internal = 2e-5 * SPRING
    model = jeffcott(damping=ShaftDamping(viscous=2e-5), drag=ratio * internal / MASS)
    (found,) = stability(model, (10.0, 3.0 * NATURAL)).instabilities
    assert found.low == pytest.approx(NATURAL * (1.0 + ratio), rel=1e-5)
    assert found.frequency == pytest.approx(NATURAL, rel=1e-3)
    assert (found.whirl, found.high) == (1, 3.0 * NATURAL)
    [(name, share, cause)] = [(one.name, one.share, one.cause) for one in found.feeds]
    assert (name, share, cause) == ('the shaft', 1.0, 'internal damping')


@pytest.mark.parametrize('external, grows', [(0.9, True), (1.1, False)])
def test_hysteretic_shaft_whirls_above_its_critical_or_never(external, grows):
    # Genta, sec. 3.4: above it k (1 - i eta) + i w c - m w^2 = 0, unstable if eta k > c omega.
    loss = 0.02
    drag = external * loss * NATURAL
    model = jeffcott(damping=ShaftDamping(loss_factor=loss), drag=drag)
    found = stability(model, (10.0, 3.0 * NATURAL)).instabilities
    assert bool(found) is grows
    if grows:
        w = np.roots([-MASS, 1j * drag * MASS, SPRING * (1.0 - 1j * loss)])
        w = w[w.real > 0.0][0]
        assert found[0].low == pytest.approx(NATURAL, rel=1e-4)
        assert found[0].damping_ratio == pytest.approx(w.imag / abs(w), rel=1e-4)
    slow, fast = campbell(model, np.array([0.5, 2.0]) * NATURAL, 2).damping_ratio
    mean = 0.5 * external * loss
    np.testing.assert_allclose(np.sort(slow), mean + 0.5 * loss, rtol=1e-3)
    np.testing.assert_allclose(np.sort(fast), [mean - 0.5 * loss, mean + 0.5 * loss], rtol=2e-3)


def test_hysteretic_shaft_has_no_loss_at_its_own_forward_critical():
    model = jeffcott(damping=ShaftDamping(loss_factor=0.02), drag=1.0)
    backward, forward = sorted(critical_speeds(model, (10.0, 2.0 * NATURAL)),
                               key=lambda one: one.whirl)
    assert forward.damping_ratio == pytest.approx(0.5 / NATURAL, rel=1e-4)
    assert backward.damping_ratio == pytest.approx(0.5 / NATURAL + 0.01, rel=1e-3)


def test_seal_lowers_the_frequency_by_its_mass_and_whirls_at_twice_it():
    # Black: F = -(M w^2 .. ) with k = c Omega / 2 whirls at half the speed: from Omega = 2 w on.
    damper, stiff, mass, speeds = 4e3, 3e5, 12.0, np.array([0.0, 4.0 * NATURAL])
    skew = np.array([[0.0, -1.0], [1.0, 0.0]])
    cross = SpeedTable(speeds, stiff * np.eye(2) + 0.5 * damper * speeds[:, None, None] * skew)
    seal = Bearing('seal', 0.5 * LENGTH, None, cross, damper * np.eye(2),
                   inertia=mass * np.eye(2))
    natural = math.sqrt((SPRING + stiff) / (MASS + mass))
    (found,) = stability(jeffcott(seal=seal), (10.0, 4.0 * NATURAL)).instabilities
    assert found.low == pytest.approx(2.0 * natural, rel=1e-4)
    assert [feed.name for feed in found.feeds] == ['seal']


def test_modes_of_a_table_over_frequency_are_where_its_own_frequency_says():
    # k(w) is straight: k_s + k_0 + k_1 w - m w^2 = 0 has a root of its own in the right interval.
    low, high, steps = 2e5, 2e6, np.array([0.0, NATURAL, 4.0 * NATURAL])
    table = FrequencyTable(steps, (low * np.eye(2), low * np.eye(2), high * np.eye(2)))
    seal = Bearing('seal', 0.5 * LENGTH, None, table, np.zeros((2, 2)))
    slope = (high - low) / (3.0 * NATURAL)
    exact = brentq(lambda w: SPRING + low + slope * (w - NATURAL) - MASS * w**2, NATURAL,
                   4.0 * NATURAL)
    found = campbell(jeffcott(seal=seal), np.array([100.0]), 2)
    np.testing.assert_allclose(found.omega, [[exact, exact]], rtol=1e-5)


def test_what_is_not_looked_at_is_told():
    # A torque feeds without bound, and a table over frequency says nothing beyond its ends.
    light = jeffcott(torque=3e3, drag=2.0)
    assert stability(light, (10.0, 2.0 * NATURAL)).untold_above == math.inf  # has one mode
    [section] = light.rotor.shaft
    heavy = replace(light.rotor, shaft=(replace(section, material=STEEL),))
    twisted = stability(CoupledModel(heavy), (10.0, 2.0 * NATURAL))
    assert twisted.untold_above == twisted.highest == pytest.approx(4.8 * 2.0 * NATURAL)
    assert twisted.untold_why == 'the torque could feed one, and none was looked for'
    # So little that nobody misses it: 4e-4 of damping ratio for 300 N m.
    [section] = heavy.shaft
    little = replace(heavy, shaft=(replace(section, torque=300.0),))
    assert stability(CoupledModel(little), (10.0, 2.0 * NATURAL)).untold_above == math.inf
    skew = np.array([[0.0, -1e5], [1e5, 0.0]])
    seal = Bearing('seal', 0.5 * LENGTH, None, FrequencyTable(
        NATURAL * np.array([0.5, 1.5]), (skew, skew)), 10.0 * np.eye(2))
    found = stability(jeffcott(seal=seal), (10.0, 2.0 * NATURAL))
    assert (found.untold_below, found.untold_above) == (0.5 * NATURAL, 1.5 * NATURAL)
    assert found.untold_why == 'tables of bearings end there'
    assert found.instabilities[0].frequency == pytest.approx(NATURAL, rel=1e-3)


def test_torque_that_nothing_damps_feeds_a_whirl_as_the_full_eigenproblem_says():
    # Held at one end only, so that what both ends do does not cancel.
    machine = loaded_machine(damping=NONE, torque=2e4, soils=springy_soils())
    rotor = replace(machine.rotor, drag=0.0, bearings=tuple(
        replace(one, damping=1e-3 * np.eye(2), stiffness=1e8 * np.eye(2),
                inertia=np.zeros((2, 2)), pedestal=None, foundation=None)
        for one in machine.rotor.bearings))
    model = CoupledModel(rotor)
    exact = dense_eigenvalues(model, 300.0, stiffness=np.zeros((0, 0)), damping=np.zeros((0, 0)))
    grows = exact[(exact.real > 1e-6 * np.abs(exact)) & (exact.imag < 1000.0)]
    found = stability(model, (300.0, 300.0 * (1.0 + 1e-9)))
    assert len(grows)
    worst = grows[np.argmax(grows.real / np.abs(grows))]
    nearest = min(found.instabilities, key=lambda one: abs(one.frequency - worst.imag))
    assert nearest.frequency == pytest.approx(worst.imag, rel=1e-6)
    assert nearest.damping_ratio == pytest.approx(-worst.real / abs(worst), rel=1e-4)
    assert nearest.feeds[0].cause == 'torque'
    # What a torque takes at most bounds every one of them.
    assert np.max(exact.real / np.abs(exact)) < _torque_feeds(model.rotor) < 0.5
