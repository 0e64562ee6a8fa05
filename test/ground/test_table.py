"""Tables that a user brings: smooth between their frequencies, silent outside, never active."""

import math

import numpy as np
import pytest

from rotorsoil_ros.errors import OutOfTableError, RotorSoilError
from rotorsoil_ros.ground.table import ComplianceTable

OMEGA = np.linspace(0.0, 300.0, 31)
STIFFNESS, DAMPING = 1e8, 4e5


def spring_and_dashpot(omega):
    """Return a ground whose six motions are springs beside dashpots, coupled x with ry."""
    single = 1.0 / (STIFFNESS + 1j * np.asarray(omega) * DAMPING)
    pattern = np.diag([1.0, 2.0, 3.0, 5.0, 4.0, 6.0])
    pattern[0, 4] = pattern[4, 0] = 0.5
    return single[:, None, None] * pattern


def test_the_given_frequencies_come_back_and_between_them_the_curve_is_smooth():
    table = ComplianceTable(OMEGA, spring_and_dashpot(OMEGA))
    np.testing.assert_allclose(table.compliance(OMEGA), spring_and_dashpot(OMEGA), rtol=1e-12)
    between = np.linspace(0.0, 300.0, 97)
    # Closed form; a cubic spline of step h misses 1/(1 + i w/250) by (h/250)^4 / 16, 1e-6 here,
    # a few times that at the ends. Straight lines would miss it by 4e-4.
    np.testing.assert_allclose(
        table.compliance(between), spring_and_dashpot(between), rtol=1e-5)


def test_two_frequencies_are_a_straight_line():
    ends = spring_and_dashpot(np.array([10.0, 20.0]))
    table = ComplianceTable(np.array([10.0, 20.0]), ends)
    np.testing.assert_allclose(table.compliance(np.array([15.0]))[0], ends.mean(axis=0))


@pytest.mark.parametrize('omega', [-1.0, 300.1, math.nan])
def test_nothing_is_said_outside(omega):
    table = ComplianceTable(OMEGA, spring_and_dashpot(OMEGA))
    with pytest.raises(OutOfTableError, match=r'frequency must be in \[0, 300\] rad/s.*got'):
        table.compliance(np.array([10.0, omega]))


@pytest.mark.parametrize('omega, message', [
    (np.array([1.0]), 'at least 2'),
    (np.array([[1.0, 2.0]]), 'at least 2'),
    (np.array([-1.0, 2.0]), '>= 0 rad/s and finite, got -1'),
    (np.array([1.0, math.nan]), '>= 0 rad/s and finite'),
    (np.array([1.0, 1.0]), 'must increase, got 1 before 1 rad/s'),
    (np.array([3.0, 2.0]), 'must increase, got 3 before 2 rad/s'),
])
def test_bad_frequencies_are_refused(omega, message):
    with pytest.raises(RotorSoilError, match=message):
        ComplianceTable(omega, spring_and_dashpot(np.array([1.0, 2.0])))


def spoilt(entry, value):
    values = spring_and_dashpot(OMEGA)
    values[entry] = value
    return values


@pytest.mark.parametrize('values, message', [
    (spring_and_dashpot(OMEGA)[:-1], r'shape \(31, 6, 6\), got \(30, 6, 6\)'),
    (spoilt((3, 0, 0), math.nan), 'must be finite'),
    (spoilt((3, 0, 4), 2e-8), 'reciprocal, .* for x,ry and .* for ry,x at 30 rad/s'),
    (spoilt((3, 2, 2), 1e-8 + 1e-9j), 'not give energy .* at 30 rad/s'),
])
def test_what_no_ground_can_be_is_refused(values, message):
    with pytest.raises(RotorSoilError, match=message):
        ComplianceTable(OMEGA, values)


def test_the_sign_convention_of_the_other_half_of_the_world_is_refused():
    # exp(-i omega t) tables carry the conjugate: they would drive the machine.
    with pytest.raises(RotorSoilError, match='not give energy'):
        ComplianceTable(OMEGA, spring_and_dashpot(OMEGA).conj())


def test_a_plane_table_may_leave_rows_at_zero():
    values = spring_and_dashpot(OMEGA)
    values[:, [1, 3, 5], :] = 0.0
    got = ComplianceTable(OMEGA, values).compliance(np.array([42.0]))
    assert (got[0, [1, 3, 5]] == 0.0).all()
