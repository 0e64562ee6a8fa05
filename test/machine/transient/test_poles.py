"""The free vibrations that a response tells, and the run-ups of whole machines made of them."""

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest
import scipy.linalg

import rotorsoil_ros as rs
from rotorsoil_ros.ground.soil import RigidSoil
from rotorsoil_ros.ground.table import ComplianceTable
from rotorsoil_ros.machine.modes.critical import critical_speeds
from rotorsoil_ros.machine.response import ResponseTable
from rotorsoil_ros.machine.transient.poles import fit
from rotorsoil_ros.machine.transient.state import Struck, Transient

from machines import elastic_machine, paper_machine

REFERENCE = Path(__file__).parents[2] / 'reference' / 'run_up'
SECOND = 1_000_000_000
HOUSINGS = ('drive_end_housing_x', 'drive_end_housing_z', 'fan_end_housing_x',
            'fan_end_housing_z')


def ran(table, unbalance, time, speed):
    """Return steady and transient predictions of a run."""
    steady = table.predictor(unbalance).predict(speed)
    stamp_ns = np.rint(time * SECOND).astype(np.int64)
    deviations = Transient(table.poles).follow(stamp_ns, speed)
    return steady, table.predictor(unbalance).moved(steady, deviations)


@pytest.fixture(scope='module', params=[3e7, 1e8], ids=['30 MPa', '100 MPa'])
def fan(request):
    """Return the fan whose wheel has no polar inertia, on one of two soils."""
    machine = rs.load('plant_fan',
                      soil={'shear_modulus': request.param},
                      **{f'rotor.discs.{disc}.polar_inertia': 0.0 for disc in range(2)})
    table = ResponseTable.build(machine.model, machine.case.speed_range)
    return request.param, table, machine.case.unbalance


@pytest.mark.parametrize('rate', [24.0, 400.0])
def test_fan_runs_up_as_its_fourier_transform_does(fan, rate):
    modulus, table, unbalance = fan
    low, high = (rpm * math.pi / 30.0 for rpm in (200.0, 1750.0))
    time = np.arange(0.0, (high - low) / rate, 1e-3)
    steady, prediction = ran(table, unbalance, time, low + rate * time)
    turned = np.exp(1j * (low * time + 0.5 * rate * time**2))[:, None]
    signal, quasistatic = (np.real(each.displacement * turned) for each in (prediction, steady))
    reference = np.loadtxt(REFERENCE / 'plant_fan_runup_exact.csv', delimiter=',')
    for _, _, channel, peak, at, _ in reference[
            (reference[:, 0] == modulus) & (reference[:, 1] == rate)]:
        column = table.channels.index(HOUSINGS[int(channel)])
        size = np.abs(signal[:, column])
        assert 1e6 * size.max() == pytest.approx(peak, rel=0.003)
        period = 2.0 * math.pi / (low + rate * at)
        assert time[size.argmax()] == pytest.approx(at, abs=period)
    assert np.abs(signal - quasistatic).max() > 0.03 * np.abs(signal).max()


def test_velocity_is_the_derivative_of_the_motion(fan):
    _, table, unbalance = fan
    time = np.arange(0.0, 0.4, 2e-4)
    speed = 40.0 + 350.0 * time
    _, prediction = ran(table, unbalance, time, speed)
    turned = np.exp(1j * (40.0 * time + 175.0 * time**2))[:, None]
    motion, velocity = (np.real(each * turned)
                        for each in (prediction.displacement, prediction.velocity))
    slope = (motion[2:] - motion[:-2]) / 4e-4
    moves = np.abs(velocity).max(axis=0) > 1e-6 * np.abs(velocity).max()
    error = np.abs(slope - velocity[1:-1])[:, moves].max(axis=0)
    # What is left out is the derivative of what follows at once: the rate over squared speed.
    assert np.all(error < 0.08 * np.abs(velocity).max(axis=0)[moves])


def whirl_of(rotor, stiffness, damping, modes):
    """Return mass, damping, polar inertia and stiffness of forward whirl, and shapes at discs."""
    shaft, mass, polar = rotor.plane_matrices
    at = [2 * rotor.node_of(bearing.position) for bearing in rotor.bearings]
    held, damped = shaft.copy(), np.zeros_like(shaft)
    held[at, at] += stiffness
    damped[at, at] += damping
    _, shapes = scipy.linalg.eigh(held, mass, subset_by_index=(0, modes - 1))
    discs = shapes[[2 * rotor.node_of(disc.position) for disc in rotor.discs]]
    return [shapes.T @ each @ shapes for each in (mass, damped, polar, held)], discs


def integrated(equation, time, state):
    """Return the solution of a linear equation, (n, d): Gauss and Legendre, of fourth order."""
    size, span = len(state), time[1] - time[0]
    shift = math.sqrt(3.0) / 6.0
    weight = np.array([[0.25, 0.25 - shift], [0.25 + shift, 0.25]])
    stages = [equation(time[:-1] + (0.5 + side) * span) for side in (-shift, shift)]
    left = np.tile(np.eye(2 * size, dtype=complex), (len(time) - 1, 1, 1))
    right = np.empty((len(time) - 1, 2 * size, size + 1), dtype=complex)
    for row, (matrix, force) in enumerate(stages):
        here = slice(row * size, (row + 1) * size)
        for column in range(2):
            left[:, here, column * size:(column + 1) * size] -= span * weight[row, column] * matrix
        right[:, here, :size], right[:, here, size] = matrix, force
    solved = np.linalg.solve(left, right)
    change = 0.5 * span * (solved[:, :size] + solved[:, size:])
    found = [state]
    for each in change:
        found.append(found[-1] + each[:, :-1] @ found[-1] + each[:, -1])
    return np.array(found)


def test_gyroscopic_rotor_beats_as_its_equation_of_motion_does():
    # Soft damped bearings on firm ground: zeta + i x whirls in one complex coordinate,
    # M q'' + (C - i Omega J) q' + K q = F, with q = Y exp(i theta) integrated for Y itself.
    stiffness, damping, rate, first = 1e6, 200.0, 24.0, 180.0
    model = dataclasses.replace(
        paper_machine(RigidSoil(), stiffness=stiffness, damping=damping, foundation=None),
        foundations=(), soil_models=())
    (mass, damped, polar, held), discs = whirl_of(model.rotor, stiffness, damping, 10)
    unbalance = np.array([1e-5, 4e-6])
    push = discs.T @ unbalance

    def equation(at):
        """Return A and b of (Y, Y')' = A (Y, Y') + b."""
        speed = (first + rate * at)[:, None, None]
        whirling = damped - 1j * speed * polar
        below = -np.linalg.solve(mass, np.concatenate([
            mass * (1j * rate - speed**2) + 1j * speed * whirling + held,
            2j * speed * mass + whirling], axis=2))
        above = np.broadcast_to(np.eye(len(mass), 2 * len(mass), len(mass)), below.shape)
        force = (speed[:, :, 0]**2 - 1j * rate) * np.linalg.solve(mass, push)
        return (np.concatenate([above, below], axis=1),
                np.concatenate([np.zeros(force.shape), force], axis=1))

    begin = np.linalg.solve(held - first**2 * (mass + 0j) + 1j * first * (
        damped - 1j * first * polar), first**2 * push)
    time = np.linspace(0.0, 8.0, 2001)
    state = integrated(equation, time, np.concatenate([begin, np.zeros(len(mass))]))
    exact = state[:, :len(mass)] @ discs.T
    table = ResponseTable.build(model, (100.0, 500.0))
    columns = [table.channels.index(f'{disc.name}_z') for disc in model.rotor.discs]
    peak = np.abs(exact).max()

    def error(slope):
        poles = table.poles
        own = dataclasses.replace(poles, slope=slope, strength=poles.strength * (
            (1.0 - slope) / (1.0 - poles.slope))[:, None, None])
        _, prediction = ran(dataclasses.replace(table, poles=own), unbalance, time,
                            first + rate * time)
        return np.abs(prediction.displacement[:, columns] - exact).max() / peak

    assert error(table.poles.slope) < 0.01
    assert error(0.0 * table.poles.slope) > 0.05


def test_poles_are_the_critical_speeds():
    model = paper_machine()
    low, high = 2.0 * math.pi, 300.0 * math.pi
    poles = ResponseTable.build(model, (low, high)).poles
    for critical in critical_speeds(model, (low, high)):
        if critical.damping_ratio > 0.1:
            continue
        nearest = int(np.abs(poles.decay.imag - critical.speed).argmin())
        decay, slope = complex(poles.decay[nearest]), float(poles.slope[nearest])
        assert decay.imag == pytest.approx(critical.speed, rel=2e-4)
        # Turning with the rotor a mode decays faster by what its frequency follows the speed.
        assert -(1.0 - slope) * decay.real / decay.imag == pytest.approx(
            critical.damping_ratio, rel=0.02)


@pytest.fixture(scope='module')
def elastic():
    """Return the table of a machine with pedestals, couples, two blocks and tables of bearings."""
    return ResponseTable.build(elastic_machine(), (60.0, 900.0))


@pytest.fixture(scope='module')
def heavy():
    """Return the table of the paper's rotor on a heavy block."""
    return ResponseTable.build(paper_machine(mass=420.0), (60.0, 900.0))


@pytest.mark.parametrize('name', ['elastic', 'heavy'])
def test_all_channels_and_forces_share_the_poles(name, request):
    # What is left of the response without its poles is smooth: a low polynomial between them.
    table = request.getfixturevalue(name)
    assert not table.poles.doubt
    assert len(table.poles) > 3
    assert np.all(table.poles.decay.real < 0.0)
    sharp = table.poles.decay[-table.poles.decay.real < 0.1 * np.abs(table.poles.decay)]
    assert len(sharp)
    for plane in np.eye(len(table.planes), dtype=complex):
        predictor = table.predictor(plane)
        for decay in sharp.tolist():
            near = decay.imag + 2.0 * decay.real * np.linspace(-1.0, 1.0, 41)
            near = near[predictor.covers(near)]
            whole = predictor.predict(near)
            # Minus the steady response of every pole, -1 / A.
            rate = (1.0 - table.poles.slope) * (table.poles.decay - 1j * near[:, None])
            rest = predictor.moved(whole, Struck(
                np.arange(len(near)), 1.0 / rate, np.ones(rate.shape, dtype=complex)))
            for part in ('displacement', 'force'):
                smooth, size = getattr(rest, part), np.abs(getattr(whole, part))
                given = np.isfinite(smooth).all(axis=0)
                place = (near - decay.imag) / decay.real
                fitted = np.polynomial.polynomial.polyfit(place, smooth[:, given], 3)
                left = smooth[:, given] - np.polynomial.polynomial.polyval(place, fitted).T
                assert np.all(np.abs(left).max(axis=0) < 1e-4 * size[:, given].max())


def test_poles_come_out_of_the_cache_as_they_were(elastic):
    table = elastic
    again = ResponseTable.from_arrays(table.to_arrays(), table.channels)
    np.testing.assert_array_equal(again.poles.strength, table.poles.strength)
    np.testing.assert_array_equal(again.poles.slope, table.poles.slope)


def test_parts_of_a_run_are_answered_with_the_same_bits(elastic):
    table = elastic
    predictor = table.predictor(np.exp(1j * np.arange(3)) * 1e-4)
    stamp_ns, speed = np.arange(40) * (SECOND // 10), np.linspace(100.0, 400.0, 40)
    speed[20:30] = speed[20]
    whole = predictor.moved(predictor.predict(speed),
                            Transient(table.poles).follow(stamp_ns, speed))
    parts = Transient(table.poles)
    for row in range(40):
        here = slice(row, row + 1)
        one = predictor.moved(predictor.predict(speed[here]),
                              parts.follow(stamp_ns[here], speed[here]))
        assert one.parts.tobytes() == whole.parts[here].tobytes()
        assert one.velocity.tobytes() == whole.velocity[here].tobytes()


def test_an_unbalance_is_no_part_of_what_is_followed(heavy):
    # Linear: two unbalances together are answered as the sum of both, whenever they came.
    table = heavy
    time = np.arange(0.0, 2.0, 0.01)
    speed = 150.0 + 100.0 * time
    one, other = np.array([1e-5, 0.0]), np.array([0.0, 3e-6j])
    (_, first), (_, second), (_, both) = (ran(table, each, time, speed)
                                          for each in (one, other, one + other))
    np.testing.assert_allclose(first.displacement + second.displacement, both.displacement,
                               rtol=0.0, atol=1e-12 * np.abs(both.displacement).max())


def test_a_table_of_noise_has_no_poles_and_says_so():
    random = np.random.default_rng(3)
    speed = np.linspace(10.0, 100.0, 300)
    noise = random.normal(size=(300, 4)) + 1j * random.normal(size=(300, 4))
    found = fit(speed, noise, np.zeros(4, dtype=int), (10.0, 100.0))
    assert isinstance(found, str)
    assert 'noise' in found


def test_noise_on_a_table_leaves_the_poles_where_they_are():
    random = np.random.default_rng(3)
    speed = np.linspace(10.0, 200.0, 400)
    decay = np.array([-2.0 + 60j, -8.0 + 130j])
    clean = sum(1.0 / (speed[:, None] + 1j * each) * weight for each, weight in zip(
        decay, (np.array([1.0, 0.5]), np.array([-0.7, 0.4])), strict=True))
    noisy = clean * (1.0 + 1e-3 * (random.normal(size=clean.shape)
                                   + 1j * random.normal(size=clean.shape)))
    found, strength, missed = fit(speed, noisy, np.zeros(2, dtype=int), (10.0, 200.0))
    assert 1e-4 < missed < 1e-2
    np.testing.assert_allclose(found, decay, rtol=0.01)
    np.testing.assert_allclose(strength, -1j * decay[:, None]**2 * np.array(
        [[1.0, 0.5], [-0.7, 0.4]]), rtol=0.05)


def test_a_machine_without_damping_is_struck_for_good():
    model = dataclasses.replace(paper_machine(RigidSoil(), foundation=None, damping=0.0),
                                foundations=(), soil_models=())
    table = ResponseTable.build(model, (100.0, 500.0))
    assert not table.poles.doubt
    time = np.arange(0.0, 8.0, 0.01)
    _, prediction = ran(table, np.array([1e-5, 0.0]), time, 200.0 + 25.0 * time)
    size = np.abs(prediction.displacement).max(axis=1)
    assert np.all(np.isfinite(size))
    assert size[-100:].max() > 0.3 * size.max()


def test_a_table_of_compliance_by_the_user_has_poles(heavy):
    omega = np.linspace(1.0, 1000.0, 200)
    model = paper_machine(mass=420.0)
    known = model.soil_models[0].compliance(omega)
    table = ComplianceTable(omega, known)
    poles = ResponseTable.build(dataclasses.replace(model, soil_models=(table,)),
                                (60.0, 900.0)).poles
    exact = heavy.poles.decay
    for light in exact[-exact.real < 0.1 * np.abs(exact)].tolist():
        assert np.abs(poles.decay - light).min() < 1e-3 * abs(light)
