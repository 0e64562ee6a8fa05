"""Rational functions that keep reality: exact where they must be, and on what is rational."""

import numpy as np

from rotorsoil_ros.ground.infinite_rational import fit_rational, RationalFunction

POINTS = 1j * np.linspace(0.2, 6.0, 9) * np.exp(-0.05j)
UNSEEN = 1j * np.linspace(0.1, 6.5, 40) * np.exp(-0.05j)


def springs_dashpots_and_masses(s):
    """Return three receptances with five poles in common, (n, 3)."""
    oscillator = 1.0 / (4.0 + 0.5 * s + s**2)
    other = 1.0 / (16.0 + 2.0 * s + s**2)
    creep = 1.0 / (1.0 + s)
    return np.column_stack([oscillator + creep, other - creep, oscillator * other])


def fitted(size):
    values = springs_dashpots_and_masses(POINTS)
    return fit_rational(POINTS, values, scale=np.abs(values), size=size)


def test_functions_with_few_poles_are_found_exactly():
    # Five poles and conjugates of three support points: degree 5 is within reach.
    expected = springs_dashpots_and_masses(UNSEEN)
    # Round-off of data times the fit's condition, 1e4.
    np.testing.assert_allclose(fitted(3)(UNSEEN), expected, rtol=1e-9)


def test_a_fit_with_too_few_poles_is_seen_to_be_poor():
    error = np.abs(fitted(2)(UNSEEN) / springs_dashpots_and_masses(UNSEEN) - 1.0)
    assert error.max() > 1e-3


def test_the_first_support_point_is_the_one_that_differs_most():
    values = np.ones((9, 1), dtype=complex)
    values[5] = 3.0
    function = fit_rational(POINTS, values, scale=np.ones((9, 1)), size=1)
    assert function.support[0] == POINTS[5]


def test_no_point_supports_twice_when_nothing_is_left_to_improve():
    function = fit_rational(
        POINTS, np.ones((9, 2), dtype=complex), scale=np.ones((9, 2)), size=4)
    assert np.unique(function.support).size == 4
    np.testing.assert_allclose(function(UNSEEN), 1.0, rtol=1e-12)


def test_values_at_support_points_are_kept_exactly():
    function = fitted(6)
    np.testing.assert_array_equal(function(function.support), function.values)


def test_the_response_of_a_real_thing_is_real_on_the_real_axis():
    function = fitted(3)
    mirrored = function(UNSEEN.conj())
    # f(conj s) = conj f(s) to round-off, for whatever weights.
    np.testing.assert_allclose(mirrored, function(UNSEEN).conj(), rtol=1e-12)
    assert np.abs(function(np.array([1.5 + 0j])).imag).max() < 1e-12


def test_one_support_point_is_a_constant_between_a_value_and_its_conjugate():
    function = RationalFunction(
        np.array([1j]), np.array([[2.0 + 0j]]), np.array([1.0 + 0j]))
    np.testing.assert_allclose(function(np.array([0.3 + 0.2j])), 2.0)
