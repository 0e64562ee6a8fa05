"""Compliances continued to complex frequencies against their closed forms."""

import numpy as np
import pytest

from rotorsoil_ros.ground.cone import ConeModel
from rotorsoil_ros.ground.continuation import Continuation
from rotorsoil_ros.ground.soil import Rectangle, RigidSoil, Soil
from rotorsoil_ros.ground.table import ComplianceTable

from machines import CONE, springy_soils

OMEGA = np.linspace(0.0, 3000.0, 101)
# Damping ratios up to 0.8, and a little growth.
COMPLEX = np.linspace(100.0, 2500.0, 25)[:, None] * (1.0 + 1j * np.array([-0.05, 0.0, 0.3, 1.3]))


def over_size(continuation, values):
    """Return a compliance in the units of a continuation."""
    return values / (continuation.size[:, None] * continuation.size)


@pytest.mark.parametrize('model', [
    CONE, ConeModel(Soil(48e6, 0.45, 1900.0, 0.05), Rectangle(0.5, 1.2))],
    ids=['square', 'nearly incompressible'])
def test_cones_continue_to_their_closed_form(model):
    continuation = Continuation.of(OMEGA, model.compliance)
    got = continuation(COMPLEX)
    second = [None, None, None, *model.contact.second_moments]
    for dof, cone in enumerate(model.cones):
        stiffness = (cone.translational_stiffness(COMPLEX) if dof < 3 else
                     cone.rotational_stiffness(COMPLEX, second_moment=second[dof]))
        expected = 1.0 / stiffness / continuation.size[dof] ** 2
        np.testing.assert_allclose(got[..., dof, dof], expected, rtol=1e-9)  # few nodes
    assert continuation.known is None
    assert np.all(continuation.agrees(COMPLEX))


def test_coupled_springs_and_dashpots_continue_to_their_closed_form():
    soil, _ = springy_soils()
    continuation = Continuation.of(OMEGA, soil.compliance)
    w = COMPLEX[..., None, None]
    expected = over_size(continuation, np.linalg.inv(soil.stiffness + 1j * w * soil.damping))
    np.testing.assert_allclose(continuation(COMPLEX), expected, rtol=1e-9, atol=1e-12)
    assert [len(index) for index, _ in continuation.parts] == [2, 1, 1, 1, 1]


def test_states_are_the_function_without_a_pole_that_another_part_has():
    continuation = Continuation.of(OMEGA, CONE.compliance)
    states = continuation.states(1e-6)
    # Translations have one pole each, rotations two.
    assert len(states.poles) == 9
    got = states.constant + (
        states.left / (COMPLEX[..., None, None] - states.poles)) @ states.right
    np.testing.assert_allclose(got, continuation(COMPLEX), rtol=0.0, atol=1e-5)
    assert np.all(states.poles.imag > 0.0)


def test_ground_that_does_not_move_continues_as_such():
    continuation = Continuation.of(OMEGA, RigidSoil().compliance)
    assert not continuation(COMPLEX).any()
    assert len(continuation.states(1e-6).poles) == 0
    assert np.all(continuation.agrees(COMPLEX))


def test_nothing_at_all_continues_as_such():
    continuation = Continuation.of(
        OMEGA, lambda omega: np.zeros((len(omega), 0, 0), dtype=complex))
    assert continuation(COMPLEX).shape == (*COMPLEX.shape, 0, 0)
    assert continuation.states(1e-6).left.shape == (0, 0)
    assert np.all(continuation.agrees(COMPLEX))


@pytest.fixture(scope='module')
def printed():
    """Return the cone as a table of 80 rows and four digits."""
    omega = np.linspace(10.0, 3000.0, 80)
    values = CONE.compliance(omega)
    digits = np.vectorize(lambda number: float(f'{number:.3e}'))
    return ComplianceTable(omega, digits(values.real) + 1j * digits(values.imag))


def test_printed_table_is_met_at_real_frequencies(printed):
    omega = np.linspace(10.0, 3000.0, 101)
    continuation = Continuation.of(omega, printed.compliance)
    between = omega[:-1] + 7.0
    np.testing.assert_allclose(continuation(between.astype(complex)),
                               over_size(continuation, printed.compliance(between)), rtol=1e-10)


def test_rounding_of_a_printed_table_gives_it_no_poles(printed):
    omega = np.linspace(10.0, 3000.0, 101)
    continuation = Continuation.of(omega, printed.compliance)
    exact = Continuation.of(OMEGA, CONE.compliance)
    decaying = COMPLEX[:, :3]
    np.testing.assert_allclose(continuation(decaying) * continuation.size**2,
                               exact(decaying) * exact.size**2, rtol=3e-3, atol=1e-12)
    # Translations have one pole, rotations two; one node more than poles.
    assert [len(part.nodes) for _, part in continuation.parts] == [2, 2, 2, 3, 3, 3]


def test_samples_do_not_tell_what_lies_on_a_cut():
    # The logarithm of a strip: it has a cut from the origin along the decaying frequencies.
    def strip(omega):
        return (1.0 / (1.0 + np.log(1.0 + 1e-2j * omega)))[:, None, None] + 0j

    continuation = Continuation.of(OMEGA, strip)
    assert np.all(continuation.agrees(np.linspace(10.0, 2900.0, 50) * (1.0 + 0.3j)))
    on_cut = 1.0 + 1j * np.linspace(150.0, 3000.0, 200)
    assert not np.all(continuation.agrees(on_cut))


@pytest.mark.parametrize('noise', [0.0, 1e-3, 1e-2])
@pytest.mark.parametrize('count', [3, 6, 20, 60])
def test_coarse_and_noisy_tables_are_met_and_have_no_poles_of_growth(count, noise):
    omega = np.linspace(10.0, 3000.0, count)
    scatter = 1.0 + noise * np.random.default_rng(count).standard_normal((2, count, 6))
    values = CONE.compliance(omega)
    diagonal = np.einsum('kii->ki', values)
    np.einsum('kii->ki', values)[:] = scatter[0] * diagonal.real + 1j * scatter[1] * diagonal.imag
    table = ComplianceTable(omega, values)
    continuation = Continuation.of(np.linspace(10.0, 3000.0, 120), table.compliance)
    at = np.linspace(20.0, 2900.0, 57)
    np.testing.assert_allclose(continuation(at.astype(complex)),
                               over_size(continuation, table.compliance(at)),
                               rtol=0.0, atol=1e-9)  # where it need not be corrected
    states = continuation.states(1e-4)
    # Of a decaying ground, in w = lambda / i; the guesses of the modes start from these.
    growing = (states.poles.imag < 0.0) & (np.abs(states.poles) < 3000.0)
    assert not growing.any()
    assert np.abs(states.constant).max() < 1e3
    # Light vibration is as determined as the table; without decay, entirely.
    assert np.all(continuation.agrees(at * (1.0 + 0.005j)))
