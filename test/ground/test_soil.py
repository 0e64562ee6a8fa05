"""Soil and contact against closed forms."""

import math

import numpy as np
import pytest

from rotorsoil_ros.errors import RotorSoilError
from rotorsoil_ros.ground.soil import Circle, equivalent_radii, Rectangle, RigidSoil, Soil


def test_wave_speeds_of_the_paper_are_those_of_three_dimensions():
    soil = Soil(48e6, 0.25, 1900.0, 0.10)
    assert soil.shear_wave_speed == pytest.approx(158.944, abs=5e-4)  # sqrt(48e6 / 1900)
    # sqrt(3) at nu = 1/4; the paper's 259.2 m/s is the plane-stress speed
    assert soil.pressure_wave_speed == pytest.approx(math.sqrt(3.0) * soil.shear_wave_speed)


@pytest.mark.parametrize('name, value', [
    ('shear_modulus', 0.0), ('shear_modulus', math.inf), ('poisson_ratio', 0.5),
    ('poisson_ratio', -0.1), ('poisson_ratio', math.nan), ('density', -1.0),
    ('loss_factor', -0.01), ('loss_factor', 1.0)])
def test_soil_names_what_is_wrong(name, value):
    values = {'shear_modulus': 48e6, 'poisson_ratio': 0.25, 'density': 1900.0,
              'loss_factor': 0.1, name: value}
    with pytest.raises(RotorSoilError, match=rf'^{name} must be .*, got {value:g}$'):
        Soil(**values)


@pytest.mark.parametrize('contact', [lambda: Rectangle(0.0, 1.0), lambda: Rectangle(1.0, -1.0),
                                     lambda: Circle(math.nan)])
def test_contact_without_extent_is_refused(contact):
    with pytest.raises(RotorSoilError, match='must be > 0 m and finite'):
        contact()


def test_equivalent_disc_keeps_area_and_second_moments():
    contact = Rectangle(1.0, 1.5)
    radii = equivalent_radii(contact)
    about_x, about_y, about_z = contact.second_moments
    assert about_x == pytest.approx(2.0 * 3.0**3 / 12.0)  # width times length cubed over 12
    assert about_y == pytest.approx(3.0 * 2.0**3 / 12.0)
    np.testing.assert_allclose(math.pi * radii[:3] ** 2, 6.0, rtol=1e-14)
    np.testing.assert_allclose(math.pi * radii[3:] ** 4 / [4.0, 4.0, 2.0],
                               [about_x, about_y, about_z], rtol=1e-14)


def test_circle_is_its_own_equivalent_disc():
    np.testing.assert_allclose(equivalent_radii(Circle(0.7)), 0.7, rtol=1e-14)


def test_rigid_soil_does_not_move():
    np.testing.assert_array_equal(RigidSoil().compliance(np.ones(3)), np.zeros((3, 6, 6)))
