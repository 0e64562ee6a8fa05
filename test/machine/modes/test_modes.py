"""Modes and critical speeds against closed forms, full eigenproblems and published rotors."""

from dataclasses import replace
import itertools
import math

import numpy as np
import pytest

from rotorsoil_ros.errors import NotSolvedError, OutOfTableError, RotorSoilError
from rotorsoil_ros.ground import continuation
from rotorsoil_ros.ground.cone import ConeModel
from rotorsoil_ros.ground.soil import RigidSoil, Soil
from rotorsoil_ros.ground.table import ComplianceTable
from rotorsoil_ros.machine.coupled import CoupledModel
from rotorsoil_ros.machine.foundation import Foundation
from rotorsoil_ros.machine.modes import eigen, shafts, spectrum
from rotorsoil_ros.machine.modes.campbell import campbell
from rotorsoil_ros.machine.modes.critical import critical_speeds
from rotorsoil_ros.machine.modes.guesses import Guesses
from rotorsoil_ros.machine.modes.natural import lowest_natural_frequency
from rotorsoil_ros.machine.modes.spectrum import SpectrumSolver
from rotorsoil_ros.machine.peaks import half_power_factors
from rotorsoil_ros.rotor.assembly import Rotor
from rotorsoil_ros.rotor.bearing import Bearing
from rotorsoil_ros.rotor.coefficients import SpeedTable
from rotorsoil_ros.rotor.disc import Disc
from rotorsoil_ros.rotor.shaft import Material, Probe, ShaftSection

from machines import (
    bearing,
    CONE,
    CONTACT,
    elastic_machine,
    LENGTH,
    paper_machine,
    Restrained,
    Springs,
    springy_soils,
    STEEL,
    two_blocks,
    uniform_rotor,
)
from oracles.dense import dense_eigenvalues, rotor_matrices
from oracles.published import friswell, lalanne_ferraris, pinned_shaft, published

SPEEDS = np.array([0.0, 310.0, 900.0])


def all_of(model, speed, soils=()):
    """Return the eigenvalues of the full matrices, those that vibrate, rising with frequency."""
    size = len(model.support.motion_mass)
    stiffness, damping = np.zeros((size, size)), np.zeros((size, size))
    blocks = 6 * len(soils)
    for index, soil in enumerate(soils):
        part = slice(6 * index, 6 * index + 6)
        stiffness[part, part], damping[part, part] = soil.stiffness, soil.damping
    pedestals = [one.pedestal for one in model.rotor.bearings if one.pedestal]
    for index, pedestal in enumerate(pedestals):
        part = slice(blocks + 2 * index, blocks + 2 * index + 2)
        stiffness[part, part], damping[part, part] = pedestal.stiffness, pedestal.damping
    values = dense_eigenvalues(model, speed, stiffness=stiffness, damping=damping)
    return values[values.imag > 0.2 * np.abs(values)]


def jeffcott_on_block(soil_model, *, mass=42.0, block=900.0):
    """Return a disc on a massless shaft on a block, and the stiffness from disc to block."""
    section = ShaftSection(1.2, (0.05, 0.05), (0.0, 0.0), 2, Material(2.1e11, 0.3, 0.0))
    bearings = tuple(bearing(name, place, stiffness=1e8, damping=2e3)
                     for name, place in (('a', 0.0), ('b', 1.2)))
    rotor = Rotor(0.0, (section,), (Disc('disc', 0.6, mass, 0.0, 0.0),), bearings)
    foundation = Foundation('block', CONTACT, 0.6, block, 0.0, (1.0, 1.0, 1.0))
    model = CoupledModel(rotor, (foundation,), (soil_model,))
    held = CoupledModel(Rotor(0.0, (section,), rotor.discs, tuple(
        bearing(one.name, one.position, stiffness=1e15, foundation=None) for one in bearings)))
    bent = held.frequency_response(np.zeros(1), speed=0.0, channel='disc_z')
    return model, 1.0 / bent.displacement[0, held.channels.index('disc_z')].real


@pytest.mark.parametrize('loss_factor', [0.0, 0.10])
def test_disc_on_a_block_on_a_cone_has_the_roots_of_its_polynomial(loss_factor):
    # S(lambda / i) = k + lambda c with complex k and c: the soil at the decaying frequency.
    soil = Soil(48e6, 0.25, 1900.0, loss_factor)
    cone = ConeModel(soil, CONTACT)
    model, shaft = jeffcott_on_block(Restrained(cone, 'z'))
    vertical = cone.cones[2]
    spring = complex(vertical.translational_stiffness(np.zeros(1))[0])
    dashpot = complex(vertical.translational_stiffness(np.ones(1))[0] - spring) / 1j
    lam = np.polynomial.Polynomial([0.0, 1.0])
    bearings = 2.0 * (1e8 + 2e3 * lam)
    below = spring + dashpot * lam + 900.0 * lam**2
    chain = shaft * bearings  # over (shaft + bearings): shaft and bearings in series
    roots = ((42.0 * lam**2) * ((shaft + bearings) * below + chain) + chain * below).roots()
    expected = roots[roots.imag > 0.2 * np.abs(roots)]
    found = campbell(model, np.zeros(1), 6)
    along_x = chain * np.polynomial.Polynomial([1.0]) + 42.0 * lam**2 * (shaft + bearings)
    expected = np.concatenate([expected, [root for root in along_x.roots() if root.imag > 10.0]])
    expected = expected[np.argsort(expected.imag)]
    got = found.eigenvalue[0][np.isfinite(found.eigenvalue[0])]
    np.testing.assert_allclose(got, expected, rtol=1e-7)  # 1e15 N/m of the held shaft
    assert 0.2 < found.damping_ratio[0, np.abs(got).argmax()] < 0.9


def test_heavily_damped_blocks_are_found_each_once():
    soils = springy_soils()
    model = elastic_machine(soils)
    found = campbell(model, SPEEDS, 20)
    for index, speed in enumerate(SPEEDS):
        expected = all_of(model, speed, soils)[:20]
        np.testing.assert_allclose(found.eigenvalue[index], expected, rtol=1e-7)  # of the dense
    damped = (found.damping_ratio > 0.2) & (found.damping_ratio < 0.6)
    assert damped.sum(axis=1).min() >= 5


@pytest.mark.parametrize('factor, heaviest', [(2.8, 0.9617), (4.2, 0.7869)])
def test_overdamped_modes_have_no_frequency_and_are_left_out(factor, heaviest):
    # With 4.2 there is one of 98.99 %, which hardly swings through once.
    soils = tuple(Springs(soil.stiffness, factor * soil.damping) for soil in springy_soils())
    model = elastic_machine(soils)
    found = campbell(model, SPEEDS[1:2], 14)
    expected = all_of(model, SPEEDS[1], soils)[:14]
    np.testing.assert_allclose(found.eigenvalue[0], expected, rtol=1e-7)
    assert found.damping_ratio.max() == pytest.approx(heaviest, abs=1e-4)


def test_modes_are_found_where_the_guesses_were_too_rough(monkeypatch):
    soils = springy_soils()
    model = elastic_machine(soils)
    # No rotor mode is solved for at first, so that guesses run to the same mode or nowhere.
    monkeypatch.setattr(spectrum, '_REACHES', (0.1, 1e6))
    found = campbell(model, SPEEDS, 20)
    for index, speed in enumerate(SPEEDS):
        np.testing.assert_allclose(found.eigenvalue[index], all_of(model, speed, soils)[:20],
                                   rtol=1e-7)


def test_modes_of_bearings_that_are_far_softer_one_way_are_found():
    """Below every mode on springs of their mean stiffness."""
    stiffness = np.diag([2e8, 2e6])
    rotor = uniform_rotor(length=1.0, diameter=0.2, elements=2, material=STEEL,
                          discs=[Disc('wheel', 0.5, 90.0, 1.0, 2.0)],
                          bearings=[bearing(name, place, stiffness=stiffness, damping=100.0,
                                            foundation=None)
                                    for name, place in (('a', 0.0), ('b', 1.0))])
    found = critical_speeds(CoupledModel(rotor), (50.0, 180.0))
    exact = dense_eigenvalues(CoupledModel(rotor), found[0].speed, stiffness=np.zeros((0, 0)),
                              damping=np.zeros((0, 0)))
    assert [one.speed for one in found] == pytest.approx([exact[0].imag], rel=1e-8)


def test_modes_that_cannot_be_told_apart_are_an_error(monkeypatch):
    monkeypatch.setattr(spectrum, '_REACHES', (0.1,))
    with pytest.raises(NotSolvedError, match='modes could not be told apart at 0 rpm'):
        campbell(elastic_machine(springy_soils()), SPEEDS, 20)


@pytest.mark.parametrize('softer', [1e-9, 1e-40])
def test_a_rotor_softer_than_any_is_refused_before_anything_is_solved(monkeypatch, softer):
    machine = elastic_machine()
    steel = replace(STEEL, young_modulus=STEEL.young_modulus * softer)
    rotor = replace(machine.rotor, shaft=tuple(
        replace(section, material=steel) for section in machine.rotor.shaft))
    monkeypatch.setattr(SpectrumSolver, 'refined', pytest.fail)
    with pytest.raises(NotSolvedError, match='bends in more than 24 ways below 9549'):
        critical_speeds(replace(machine, rotor=rotor), (10.0, 1000.0))


def test_one_mode_twice_is_a_repetition_but_two_of_one_frequency_are_not():
    frequency = np.array([[5.0 + 1.0j, 5.0 + 1.0j, 5.0 + 1.0j, 7.0]])
    vector = np.array([[[1.0, 0.0], [0.0, 1.0], [1j, 0.0], [1.0, 0.0]]], dtype=complex)
    np.testing.assert_array_equal(eigen._repeats(frequency, vector), [[False, False, True, False]])


def vibration_of(model, highest):
    """Return the equations of free vibration at one speed, and guesses, at the first reach."""
    solver = SpectrumSolver.up_to(model, highest)
    speed = np.array([400.0])
    [zone] = solver.zones
    vibration = solver._at(speed, solver.shafts.whirls(speed, 0.0, 0.0), zone, 1.5)
    return vibration, Guesses(vibration, solver._below[id(zone.compliance)])


@pytest.mark.parametrize('stiffness', [1e6, 1e9])
def test_guesses_are_close_at_any_stiffness_of_the_bearings(stiffness):
    vibration, guesses = vibration_of(paper_machine(mass=20.0, stiffness=stiffness), 1500.0)
    guess, vector = guesses.lowest(8)
    found, _, sound, _ = vibration.solve(guess, vector)
    assert sound.all()
    np.testing.assert_allclose(guess, found, rtol=2e-3)  # at the upper end


def test_guesses_know_the_mass_of_rotor_modes_that_are_not_solved_for():
    # A rotor so stiff that all of it just moves with its block.
    rotor = uniform_rotor(
        length=0.5, diameter=0.2, elements=2, material=STEEL,
        discs=[Disc('a', 0.0, 200.0, 2.0, 4.0), Disc('b', 0.5, 300.0, 3.0, 6.0)],
        bearings=[bearing('left', 0.0, stiffness=1e11), bearing('right', 0.5, stiffness=1e11)])
    block = Foundation('block', CONTACT, 0.25, 400.0, 0.0, (30.0, 30.0, 60.0))
    vibration, guesses = vibration_of(CoupledModel(rotor, (block,), (CONE,)), 900.0)
    assert vibration.resonant.shape[1] == 0
    guess, vector = guesses.lowest(6)
    found, _, _, _ = vibration.solve(guess, vector)
    np.testing.assert_allclose(guess, found, rtol=1e-3)


def test_guess_that_runs_to_a_far_mode_is_not_trusted(monkeypatch):
    # At first the guess of the lowest mode is missing, and that of the second is 8 % off.
    lowest = Guesses.lowest

    def spoilt(self, count):
        frequency, vector = lowest(self, count)
        if self.of.reach > 2.0:
            return frequency, vector
        frequency, vector = frequency[:, 1:].copy(), vector[:, 1:]
        frequency[:, 0] *= 1.08
        return frequency, vector

    expected = campbell(paper_machine(), SPEEDS, 6).eigenvalue
    monkeypatch.setattr(Guesses, 'lowest', spoilt)
    np.testing.assert_allclose(campbell(paper_machine(), SPEEDS, 6).eigenvalue, expected,
                               rtol=1e-8)


def determinant(model, frequency):
    """Return the determinant of the assembled machine on cones at w = lambda / i, scaled."""
    rotor, support = model.rotor, model.support
    stiffness, mass, gyroscopic = rotor_matrices(rotor)
    size, speed = len(stiffness), 500.0
    journals = np.zeros((2 * len(rotor.bearings), size))
    for index, one in enumerate(rotor.bearings):
        for axis in range(2):
            journals[2 * index + axis, 4 * rotor.node_of(one.position) + axis] = 1.0
    relative = np.concatenate([journals, -support.motion_rows], axis=1)
    w = frequency[:, None, None]
    springs, dampers, _ = model.bearings.coefficients(*2 * (np.array([speed]),))
    total = np.zeros((len(frequency), relative.shape[1], relative.shape[1]), dtype=complex)
    total[:, :size, :size] = stiffness - w**2 * mass + 1j * w * speed * gyroscopic
    total += relative.T @ (springs + 1j * w * dampers) @ relative
    total[:, size:, size:] -= w**2 * support.motion_mass
    for index, soil in enumerate(model.soil_models):
        for dof, cone in enumerate(soil.cones):
            row = size + 6 * index + dof
            total[:, row, row] += (
                cone.translational_stiffness(frequency) if dof < 3 else
                cone.rotational_stiffness(frequency,
                                          second_moment=soil.contact.second_moments[dof - 3]))
    scale = np.sqrt(np.abs(np.diagonal(total[0])))
    return np.linalg.slogdet(total / (scale[:, None] * scale))


def test_modes_on_cones_are_all_zeros_of_the_determinant_and_there_are_no_others():
    # Argument principle: along a closed path the phase turns once for every zero inside it.
    model = paper_machine(mass=420.0, elements=4)
    left, right, low, high = 60.0, 1000.0, -20.0, 1500.0
    corners = np.array([left + 1j * low, right + 1j * low, right + 1j * high, left + 1j * high,
                        left + 1j * low])
    share = np.linspace(0.0, 1.0, 1500)[:-1]
    path = np.concatenate([a + (b - a) * share for a, b in itertools.pairwise(corners)])
    sign, _ = determinant(model, np.append(path, path[0]))
    turns = np.angle(sign[1:] / sign[:-1])
    assert np.abs(turns).max() < 1.0
    count = round(turns.sum() / (2.0 * math.pi))

    w = campbell(model, np.array([500.0]), 14).eigenvalue[0] / 1j
    inside = (w.real > left) & (w.real < right) & (w.imag < high)
    # Cones have poles there: one of each rotation. A pole turns the phase the other way.
    poles = sum(left < pole.real < right for cone in model.soil_models[0].cones[3:]
                for pole in [1j * cone.wave_speed / cone.apex_height])
    assert inside.sum() == count + poles
    for mode in w[inside]:
        ring = mode * (1.0 + 1e-6 * np.exp(2j * math.pi * np.arange(9) / 8.0))
        sign, _ = determinant(model, ring)
        turns = np.angle(sign[1:] / sign[:-1]).sum() / (2.0 * math.pi)
        assert turns == pytest.approx(1.0, abs=1e-6)


@pytest.mark.parametrize('name, stiffness, rpm', [
    ('FR_5.9.1_4000rpm', 1e6, 4000.0),
    ('FR_5.9.2_0rads', [[1e6, 0.0], [0.0, 0.8e6]], 0.0),
    ('FR_5.9.2_4000rpm', [[1e6, 0.0], [0.0, 0.8e6]], 4000.0),
    ('FR_5.9.4_like_4000rpm', [[1e6, 0.5e6], [0.0, 1e6]], 4000.0)])
def test_rotor_of_friswell_has_its_published_modes(name, stiffness, rpm):
    given, expected, rtol = published(name)
    model = CoupledModel(friswell(given, stiffness))
    found = np.abs(campbell(model, np.array([rpm * math.pi / 30.0]), 8).eigenvalue[0])
    nearest = found[np.abs(found[:, None] - expected).argmin(axis=0)]
    np.testing.assert_allclose(nearest, expected, rtol=rtol)


def test_three_disc_rotor_of_lalanne_and_ferraris_has_its_published_modes():
    given, expected, rtol = published('LF_3disc_25000rpm')
    model = CoupledModel(lalanne_ferraris(given, given['cxx'], given['czz']))
    found = campbell(model, np.array([25000.0 * math.pi / 30.0]), 12).omega[0] / (2.0 * math.pi)
    nearest = found[np.abs(found[:, None] - expected).argmin(axis=0)]
    np.testing.assert_allclose(nearest, expected, rtol=rtol)


def test_timoshenko_beam_has_its_closed_form_modes():
    given, expected, rtol = published('cf_ss_timoshenko')
    found = campbell(CoupledModel(pinned_shaft(given)), np.zeros(1), 6)
    np.testing.assert_allclose(found.omega[0, ::2] / (2.0 * math.pi), expected, rtol=rtol)


@pytest.mark.usefixtures('no_shear')
def test_spinning_rayleigh_shaft_whirls_as_its_closed_form_says():
    given, expected, rtol = published('cf_ss_rayleigh_spin')
    found = campbell(CoupledModel(pinned_shaft(given)),
                     np.array([given['speed_rpm'] * math.pi / 30.0]), 4)
    np.testing.assert_allclose(found.omega[0] / (2.0 * math.pi), expected, rtol=rtol)
    np.testing.assert_array_equal(found.whirl[0], [-1, 1, -1, 1])


@pytest.mark.usefixtures('no_shear')
def test_overhung_disc_on_a_massless_shaft_whirls_as_its_closed_form_says():
    given, expected, rtol = published('cf_cantilever_disc')
    massless = Material(given['E'], 0.3, 0.0)
    # A stub ten times as thick, 1e4 times as stiff, between two hard bearings is the wall.
    shaft = (ShaftSection(1.0, (3.0, 3.0), (0.0, 0.0), 1, massless),
             ShaftSection(given['L'], (given['d'],) * 2, (0.0, 0.0), 1, massless))
    rotor = Rotor(0.0, shaft, (Disc('disc', 1.0 + given['L'], given['m'], given['Id'],
                                    given['Ip']),),
                  (bearing('a', 0.0, stiffness=1e14, foundation=None),
                   bearing('b', 1.0, stiffness=1e14, foundation=None)))
    found = campbell(CoupledModel(rotor), np.array([given['speed_rpm'] * math.pi / 30.0]), 6)
    np.testing.assert_allclose(found.omega[0] / (2.0 * math.pi), expected, rtol=rtol)
    np.testing.assert_array_equal(found.whirl[0], [-1, 1, -1, 1])
    assert found.eigenvalue.shape == (1, 4)  # there are no more


def test_subspace_that_is_too_small_is_enlarged(monkeypatch):
    speeds = np.array([0.0, 3000.0])
    expected = campbell(paper_machine(), speeds, 8).eigenvalue
    for room in (spectrum, shafts):
        monkeypatch.setattr(room, 'MORE_SHAPES', 0)
    monkeypatch.setattr(shafts.ReducedRotor, 'of', _of_few(shafts.ReducedRotor.of))
    np.testing.assert_allclose(campbell(paper_machine(), speeds, 8).eigenvalue, expected,
                               rtol=1e-8)


def _of_few(of):
    """Return a way to build a subspace from fewer modes than asked for, if these are few."""
    return lambda rotor, springs, *, count: of(
        rotor, springs, count=count if count > 12 else max(count // 3, 1))


def test_elements_converge_to_the_same_modes_with_second_order():
    coarse, middle, fine = (campbell(paper_machine(elements=elements), np.array([300.0]), 8)
                            .eigenvalue[0, 3:7] for elements in (12, 24, 48))
    rate = np.log2(np.abs(coarse - middle) / np.abs(middle - fine))
    assert np.all(rate > 1.8), rate


def test_rotor_at_rest_on_isotropic_springs_has_each_mode_in_both_directions():
    found = campbell(paper_machine(RigidSoil()), np.zeros(1), 6)
    np.testing.assert_array_equal(found.whirl[0], [-1, 1, -1, 1, -1, 1])
    np.testing.assert_allclose(found.omega[0, ::2], found.omega[0, 1::2], rtol=2e-9)


def test_forward_whirl_stiffens_and_backward_softens():
    found = campbell(paper_machine(RigidSoil()), np.array([100.0, 500.0]), 6)
    change = found.omega[1] - found.omega[0]
    np.testing.assert_array_equal(np.sign(change), found.whirl[1])


def test_cross_coupled_bearing_makes_forward_whirl_unstable():
    cross = 2e6
    rotor = uniform_rotor(
        length=1.0, diameter=0.04, elements=8, material=STEEL,
        discs=[Disc('d', 0.5, 20.0, 0.1, 0.2)],
        bearings=[bearing('a', 0.0, stiffness=[[2e7, -cross], [cross, 2e7]], damping=50.0,
                          foundation=None),
                  bearing('b', 1.0, stiffness=2e7, damping=50.0, foundation=None)])
    model = CoupledModel(rotor)
    found = campbell(model, np.array([200.0]), 4)
    np.testing.assert_allclose(found.eigenvalue[0], all_of(model, 200.0)[:4], rtol=1e-8)
    unstable = found.damping_ratio[0] < 0.0
    # f_x = -k_xz z pushes a shaft that moves from z into x along: k_xz < 0 drives forward.
    np.testing.assert_array_equal(unstable[:2], found.whirl[0, :2] > 0)


@pytest.mark.parametrize('count', [7, 60])
def test_curves_are_followed_through_their_crossings(count):
    found = campbell(paper_machine(mass=4200.0), np.linspace(0.0, 942.0, count), 10)
    crossed = 0
    for name in range(10):
        row, mode = np.nonzero(found.branch == name)
        assert len(row) == count
        omega = found.omega[row, mode]
        crossed += len(np.unique(mode)) > 1
        # What crosses is damped differently by far: a curve that had been mixed up would jump.
        damping = np.log(found.damping_ratio[row, mode])
        assert np.abs(np.diff(damping)).max() < 3.0
        assert np.abs(np.diff(omega, 2)).max() < 40.0 / count**2 * (np.ptp(omega) + 10.0)
    assert crossed >= 3


def test_curves_without_damping_are_told_apart_by_their_shapes():
    # Forward tilting of an overhung disc rises through backward bending of the shaft.
    rotor = uniform_rotor(
        length=1.0, diameter=0.04, elements=6, material=STEEL,
        discs=[Disc('d', 1.0, 10.0, 0.2, 0.4)],
        bearings=[bearing('a', 0.0, stiffness=1e9, foundation=None),
                  bearing('b', 0.5, stiffness=1e9, foundation=None)])
    found = campbell(CoupledModel(rotor), np.linspace(0.0, 6000.0, 13), 6)
    assert np.ptp(found.whirl[:, 3]) == 2  # they do cross
    for name in range(6):
        row, mode = np.nonzero(found.branch == name)
        assert len(row) == 13
        assert np.ptp(found.whirl[row, mode]) == 0


class Known:
    """A soil that is known between two frequencies only."""

    def __init__(self, model, low, high):
        self.model, self.low, self.high = model, low, high

    def compliance(self, omega):
        """Return what the soil answers, or refuse."""
        if np.any((omega < self.low) | (omega > self.high)):
            raise OutOfTableError('not known there')
        return self.model.compliance(omega)


def test_modes_beyond_what_is_known_of_the_soil_are_left_out():
    whole = campbell(paper_machine(mass=4200.0), np.array([300.0]), 10)
    soil = Known(CONE, 168.0, 500.0)
    part = campbell(paper_machine(soil, mass=4200.0), np.array([300.0]), 10)
    known = (whole.omega[0] > 168.0) & (whole.omega[0] < 500.0)
    assert known.sum() == 6
    np.testing.assert_allclose(part.eigenvalue[0], whole.eigenvalue[0, known], rtol=1e-7)


def test_modes_that_the_samples_do_not_determine_are_left_out(monkeypatch):
    monkeypatch.setattr(continuation, '_AGREED', -1.0)
    assert campbell(paper_machine(mass=4200.0), np.array([300.0]), 10).eigenvalue.size == 0


def test_errors_of_interpolation_in_a_table_make_no_modes():
    # A spline through 60 exact points: good to 1e-4, and what it lacks is no soil.
    omega = np.linspace(10.0, 3000.0, 60)
    table = ComplianceTable(omega, CONE.compliance(omega))
    found, expected = (campbell(paper_machine(soil, mass=4200.0), np.array([300.0]), 8)
                       .eigenvalue for soil in (table, CONE))
    np.testing.assert_allclose(found, expected, rtol=1e-4)


def scattered(count, noise, *, high):
    """Return the cones as a table of so many rows with random errors of that size."""
    omega = np.linspace(6.0, high, count)
    scatter = 1.0 + noise * np.random.default_rng(7).standard_normal((2, count, 6))
    values = CONE.compliance(omega)
    diagonal = np.einsum('kii->ki', values)
    np.einsum('kii->ki', values)[:] = scatter[0] * diagonal.real + 1j * scatter[1] * diagonal.imag
    return ComplianceTable(omega, values)


@pytest.mark.parametrize('noise', [0.0, 1e-3, 1e-2, 5e-2])
@pytest.mark.parametrize('count', [4, 6, 10, 60])
def test_coarse_and_noisy_tables_keep_the_light_criticals_of_the_cones(count, noise):
    # Oracle: the cones themselves. The rotor has 1 % and less of its energy in the soil, which
    # 5 % of noise and the splines through 4 points then move by less than this.
    high = 300.0 * math.pi
    found, expected = (
        [one for one in critical_speeds(paper_machine(soil), (10.0, high))
         if one.damping_ratio < 0.1]
        for soil in (scattered(count, noise, high=1.2 * high), CONE))
    assert [one.whirl for one in found] == [one.whirl for one in expected] == [-1, 1, -1, 1]
    np.testing.assert_allclose([one.speed for one in found], [one.speed for one in expected],
                               rtol=1e-3)
    # All of the soil: splines through 4 points miss 12 % of it, those through 60 with 5 % of
    # noise 7 %.
    np.testing.assert_allclose([one.damping_ratio for one in found],
                               [one.damping_ratio for one in expected], rtol=0.13)


def test_mode_that_a_jumping_table_does_not_determine_is_an_error_and_not_left_out():
    # 30 % up and down from row to row: the block's modes, with 8 % of damping, could be anything.
    omega = np.linspace(6.0, 1000.0, 30)
    jumps = 1.0 + 0.3 * (-1.0) ** np.arange(30)
    stiffness = np.array([1.2e8, 1.2e8, 1.4e8, 3e7, 3e7, 5e7])
    values = np.zeros((30, 6, 6), dtype=complex)
    values[:, range(6), range(6)] = 1.0 / (jumps[:, None] * stiffness * (1.0 + 0.15j))
    model = paper_machine(ComplianceTable(omega, values), mass=4200.0)
    with pytest.raises(NotSolvedError, match=r'could not be told apart|changes too abruptly'):
        critical_speeds(model, (10.0, 900.0))
    # Its response needs no modes.
    assert np.all(np.isfinite(model.unbalance_response(
        np.linspace(10.0, 900.0, 50), np.array([1e-5, 0.0])).displacement))


def test_diagram_tells_where_a_light_mode_is_missing(monkeypatch):
    monkeypatch.setattr(continuation, '_AGREED', -1.0)
    model = paper_machine(mass=4200.0)
    with pytest.raises(NotSolvedError, match='changes too abruptly about'):
        critical_speeds(model, (10.0, 900.0))
    # Guesses are within a few per mille of the modes that are there otherwise.
    untold = campbell(model, np.array([300.0]), 10).untold
    monkeypatch.undo()
    whole = campbell(model, np.array([300.0]), 10)
    light = whole.omega[0][whole.damping_ratio[0] < 0.2].min()
    np.testing.assert_allclose(untold, light, rtol=0.02)
    assert np.all(np.isinf(whole.untold))


def rk4():
    """Return the rotor kit of the measured run-up."""
    return CoupledModel(uniform_rotor(
        length=0.56, diameter=0.01, elements=28, material=Material(2.06e11, 0.3, 7850.0),
        discs=[Disc('disc_1', 0.16, 0.8, 3.305e-4, 5.776e-4),
               Disc('disc_2', 0.40, 0.8, 3.305e-4, 5.776e-4)],
        bearings=[bearing(name, place, stiffness=1e6, damping=50.0, foundation=None)
                  for name, place in (('a', 0.04), ('b', 0.52))]))


def test_first_forward_critical_of_the_rotor_kit_is_that_of_the_note():
    first = next(one for one in critical_speeds(rk4(), (50.0, 420.0)) if one.whirl > 0)
    assert first.speed * 30.0 / math.pi == pytest.approx(2024.0, abs=0.5)  # printed digits


def test_criticals_of_the_papers_machine_are_those_of_the_note():
    criticals = critical_speeds(paper_machine(RigidSoil()), (10.0, 942.0))
    np.testing.assert_allclose([one.speed / (2.0 * math.pi) for one in criticals],
                               [44.01, 48.86, 123.12, 129.48], atol=0.005)  # printed digits
    assert [one.whirl for one in criticals] == [-1, 1, -1, 1]


def test_critical_speeds_without_damping_are_poles_of_the_synchronous_rotor():
    model = paper_machine(RigidSoil(), damping=0.0)
    criticals = critical_speeds(model, (10.0, 942.0))
    for whirl, direction in ((1, 0), (-1, 1)):
        inverse = np.sort(model._synchronous_modes.inverse[direction])[::-1]
        got = [one.speed for one in criticals if one.whirl == whirl]
        np.testing.assert_allclose(got, inverse[:len(got)] ** -0.5, rtol=1e-9)
    assert all(math.isinf(one.amplification_factor) or one.amplification_factor > 1e9
               for one in criticals)


@pytest.mark.parametrize('model', [paper_machine(), paper_machine(mass=4200.0), two_blocks()],
                         ids=['light', 'heavy', 'two blocks'])
def test_critical_speed_is_the_frequency_of_a_mode_at_that_speed(model):
    for one in critical_speeds(model, (20.0, 620.0)):
        found = campbell(model, np.array([one.speed]), 24)
        nearest = np.nanargmin(np.abs(found.omega[0] - one.speed))
        assert found.omega[0, nearest] == pytest.approx(one.speed, rel=1e-9)
        assert found.damping_ratio[0, nearest] == pytest.approx(one.damping_ratio, rel=1e-6)


def test_critical_speeds_do_not_depend_on_the_grid():
    model = paper_machine(mass=4200.0)
    whole = [one.speed for one in critical_speeds(model, (10.0, 942.0))]
    part = [one.speed for one in critical_speeds(model, (171.0, 800.0))]
    np.testing.assert_allclose(part, [one for one in whole if 171.0 < one < 800.0], rtol=1e-9)


def test_crossings_where_a_curve_was_torn_are_not_missed(monkeypatch):
    model = paper_machine(RigidSoil())
    expected = [one.speed for one in critical_speeds(model, (10.0, 942.0))]
    # Shapes of neighbouring speeds count as those of other curves until these are very close.
    monkeypatch.setattr('rotorsoil_ros.machine.modes.campbell._ALIKE', 0.999)
    got = [one.speed for one in critical_speeds(model, (10.0, 942.0))]
    np.testing.assert_allclose(got, expected, rtol=1e-9)


def test_two_crossings_between_neighbouring_speeds_are_not_missed():
    # A stiff rotor of 40 kg on bearings that stiffen with speed, so that its frequency dips
    # below the speed for 2 rad/s only.
    speed = np.linspace(100.0, 500.0, 4001)
    omega = speed + 2e-3 * ((speed - 304.7) ** 2 - 1.0)
    table = SpeedTable(speed, 20.0 * omega[:, None, None] ** 2 * np.eye(2))
    rotor = uniform_rotor(
        length=0.2, diameter=0.5, elements=2, material=Material(2e14, 0.3, 0.0),
        discs=[Disc('d', 0.1, 40.0, 0.0, 0.0)],
        bearings=[Bearing(name, place, None, table, np.zeros((2, 2)))
                  for name, place in (('a', 0.0), ('b', 0.2))])
    found = critical_speeds(CoupledModel(rotor), (110.0, 490.0))
    # 4e6 N/m of bearing below 3e14 N/m of shaft; both planes alike.
    np.testing.assert_allclose([one.speed for one in found], [303.7, 303.7, 305.7, 305.7],
                               rtol=1e-4)


def test_thin_disc_that_stiffens_forward_whirl_has_the_criticals_of_its_synchronous_poles():
    rotor = uniform_rotor(
        length=1.0, diameter=0.04, elements=4, material=STEEL,
        discs=[Disc('d', 1.0, 15.0, 0.35, 0.345)],
        bearings=[bearing('a', 0.0, stiffness=1e8, foundation=None),
                  bearing('b', 0.7, stiffness=1e8, foundation=None)])
    model = CoupledModel(rotor)
    expected = np.sort(model._synchronous_modes.inverse[0])[::-1]
    expected = expected[expected > 0.0] ** -0.5
    top = 1.3 * expected[1]
    got = [one.speed for one in critical_speeds(model, (1.0, top)) if one.whirl > 0]
    np.testing.assert_allclose(got, expected[expected < top], rtol=1e-8)


def test_shape_of_a_critical_is_the_deflection_that_unbalance_excites():
    nodes = [Probe(f'n{i}', place) for i, place in enumerate(np.linspace(0.0, LENGTH, 8))]
    model = paper_machine()
    rotor = Rotor(0.6, model.rotor.shaft, model.rotor.discs, model.rotor.bearings, tuple(nodes))
    model = CoupledModel(rotor, model.foundations, model.soil_models)
    critical = next(one for one in critical_speeds(model, (280.0, 320.0)) if one.whirl > 0)
    assert critical.damping_ratio < 1e-3
    found = model.unbalance_response(np.array([critical.speed]), np.array([1e-5, 0.0]))
    names = [f'{node.name}_{axis}' for node in nodes for axis in 'xz']
    forced = found.displacement[0, [model.channels.index(name) for name in names]]
    free = critical.deflection[[rotor.node_of(node.position) for node in nodes]].ravel()
    free = free * (forced @ free.conj()) / (free @ free.conj())
    # What other modes add: as much as the damping ratio.
    np.testing.assert_allclose(free, forced, atol=2e-3 * np.abs(forced).max())
    block = found.displacement[0, -6:]
    scale = (forced @ critical.deflection[[rotor.node_of(node.position) for node in nodes]]
             .ravel().conj()) / np.sum(np.abs(critical.deflection[
                 [rotor.node_of(node.position) for node in nodes]]) ** 2)
    np.testing.assert_allclose(scale * critical.support, block, atol=5e-3 * np.abs(block).max())
    assert np.abs(critical.deflection).max() == pytest.approx(1.0)


def test_block_that_moves_alone_along_the_shaft_has_a_shape_too():
    heavy = next(one for one in critical_speeds(paper_machine(mass=4200.0), (160.0, 168.0))
                 if np.abs(one.support[1]) > 0.5)
    assert np.abs(heavy.support).max() == pytest.approx(1.0)
    assert np.abs(heavy.deflection).max() < 1e-9


def test_amplification_factor_is_that_of_the_half_power_points():
    model = paper_machine()
    critical = next(one for one in critical_speeds(model, (280.0, 320.0)) if one.whirl > 0)
    width = critical.speed * critical.damping_ratio
    speeds = critical.speed + width * np.linspace(-3.0, 3.0, 2001)
    found = model.unbalance_response(speeds, np.array([1e-5, 0.0]))
    x, z = (found.displacement[:, model.channels.index(f'disc_2_{axis}')] for axis in 'xz')
    forward = np.abs(z + 1j * x)
    wide = speeds[forward > forward.max() / math.sqrt(2.0)]
    assert speeds[forward.argmax()] == pytest.approx(critical.speed, rel=1e-6)
    # The speed runs along with the mode, whose frequency grows with it: Omega (1 - d omega / d
    # Omega) is what the half-power width sees.
    slope = np.diff(campbell(model, critical.speed + np.array([-1.0, 1.0]), 5).omega[:, 4])[0] / 2
    factor = critical.speed / np.ptp(wide) / (1.0 - slope)
    assert factor == pytest.approx(critical.amplification_factor, rel=5e-3)  # 2001 points


def test_half_power_factor_is_that_of_the_response_to_unbalance():
    # A massless shaft: the mode does not change with speed, so that the peak of m e omega^2 has
    # the closed form of one degree of freedom with damping ratio zeta.
    light = ShaftSection(1.2, (0.05, 0.05), (0.0, 0.0), 2, Material(2.1e11, 0.3, 0.0))
    rotor = Rotor(0.0, (light,), (Disc('disc', 0.6, 40.0, 0.0, 0.0),), tuple(
        bearing(name, place, stiffness=2e7, damping=1e5, foundation=None)
        for name, place in (('a', 0.0), ('b', 1.2))))
    model = CoupledModel(rotor)
    forward = next(one for one in critical_speeds(model, (50.0, 1000.0)) if one.whirl > 0)
    zeta, ratio = forward.damping_ratio, np.linspace(0.5, 2.0, 2_000_001)
    size = ratio**2 / np.hypot(1.0 - ratio**2, 2.0 * zeta * ratio)
    wide = ratio[size > size.max() / math.sqrt(2.0)]
    (found,) = half_power_factors(model, [forward])
    # The damper sits behind the shaft: not quite one degree of freedom.
    assert found == pytest.approx(ratio[size.argmax()] / np.ptp(wide), rel=1e-2)


def test_a_peak_belongs_to_the_nearest_mode_and_a_damped_mode_may_have_none():
    model = paper_machine()
    criticals = critical_speeds(model, (150.0, 320.0))
    factors = half_power_factors(model, criticals)
    for found, factor in zip(criticals, factors, strict=True):
        assert math.isfinite(factor) or found.amplification_factor < 1.0 or found.whirl < 0
    assert sum(map(math.isfinite, factors)) >= 1


def test_required_margin_goes_by_the_sharper_of_both_factors():
    critical = critical_speeds(paper_machine(), (280.0, 320.0))[0]
    damped = replace(critical, speed=300.0, damping_ratio=0.5 / 2.4)
    assert damped.required_margin(400.0, half_power=11.5) == pytest.approx(0.17 * 0.9)
    assert damped.required_margin(400.0, half_power=math.nan) == 0.0


def test_margins_are_those_of_the_standard():
    critical = critical_speeds(paper_machine(), (280.0, 320.0))[0]
    assert critical.separation_margin(critical.speed / 1.25) == pytest.approx(0.25)
    damped = replace(critical, speed=300.0, whirl=1, damping_ratio=0.5 / 2.4)
    sharp = replace(critical, speed=300.0, whirl=1, damping_ratio=0.5 / 11.5)
    assert damped.required_margin(250.0) == 0.0
    assert sharp.required_margin(400.0) == pytest.approx(0.17 * 0.9)
    assert sharp.required_margin(250.0) == pytest.approx(0.17 * 0.9 + 0.10)
    # From AF = 18.5 on the margins stay at 16 and 26 percent.
    sharpest = replace(critical, speed=300.0, whirl=1, damping_ratio=1e-4)
    assert sharpest.required_margin(400.0) == 0.16
    assert sharpest.required_margin(250.0) == pytest.approx(0.26)


@pytest.mark.parametrize('call, rule', [
    (lambda model: campbell(model, np.array([-1.0]), 3), 'speeds must be >= 0 rad/s and finite'),
    (lambda model: campbell(model, np.array([math.nan]), 3), 'speeds must be >= 0 rad/s'),
    (lambda model: campbell(model, np.empty(0), 3), 'speeds must be >= 0 rad/s'),
    (lambda model: campbell(model, np.ones(1), 0), 'count must be at least 1 mode, got 0'),
    (lambda model: critical_speeds(model, (5.0, 5.0)), 'speed range must be 0 <= low < high')])
def test_impossible_request_is_refused(call, rule):
    with pytest.raises(RotorSoilError, match=rule):
        call(paper_machine())


def test_damper_alone_holds_no_shaft_but_damps_it():
    rotor = uniform_rotor(
        length=1.0, diameter=0.04, elements=8, material=STEEL,
        discs=[Disc('d', 0.5, 20.0, 0.1, 0.2)],
        bearings=[bearing('a', 0.0, stiffness=2e7, foundation=None),
                  bearing('b', 1.0, stiffness=2e7, foundation=None),
                  Bearing('damper', 0.5, None, np.zeros((2, 2)), 900.0 * np.eye(2))])
    model = CoupledModel(rotor)
    found = campbell(model, np.array([200.0]), 6)
    np.testing.assert_allclose(found.eigenvalue[0], all_of(model, 200.0)[:6], rtol=1e-8)


def test_support_with_a_rigid_rotor_has_the_frequencies_of_its_mass_on_its_springs():
    # Symmetric: rotor and block heave as one mass; a soft shaft and soft bearings change nothing.
    soil = Springs(np.diag([2e8, 2e8, 3e8, 9e9, 9e9, 9e9]), 1e3 * np.eye(6))
    rotor = uniform_rotor(
        length=1.2, diameter=0.01, elements=4, material=STEEL, height=0.0,
        discs=[Disc('wheel', 0.6, 300.0, 1.0, 2.0)],
        bearings=[bearing(name, place, stiffness=1e5) for name, place in (('a', 0.1), ('b', 1.1))])
    block = Foundation('block', CONTACT, 0.6, 900.0, 0.0, (50.0, 50.0, 50.0))
    model = CoupledModel(rotor, (block,), (soil,))
    heave = math.sqrt(3e8 / (900.0 + rotor.mass))
    sliding = math.sqrt(2e8 / (900.0 + rotor.mass))
    assert lowest_natural_frequency(
        model, axis='z', highest=1000.0) == pytest.approx(heave, rel=1e-9)
    assert lowest_natural_frequency(
        model, axis='x', highest=1000.0) == pytest.approx(sliding, rel=1e-9)
    assert lowest_natural_frequency(model, axis='z', highest=0.9 * heave) == math.inf
    firm = CoupledModel(rotor, (block,), (RigidSoil(),))
    assert lowest_natural_frequency(firm, axis='z', highest=1000.0) == math.inf
