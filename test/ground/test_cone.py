"""Cones against the half-space's statics, plane waves and passivity."""

import math

import numpy as np
import pytest

from rotorsoil_ros.ground.cone import ConeModel
from rotorsoil_ros.ground.soil import Circle, Rectangle, Soil

G, RHO, R = 48e6, 1900.0, 0.5


def stiffness(nu, a0, eta=0.0):
    """Return the six diagonal dynamic stiffnesses of a disc at one a0."""
    soil = Soil(G, nu, RHO, eta)
    omega = np.array([a0 * soil.shear_wave_speed / R])
    return 1.0 / np.diagonal(ConeModel(soil, Circle(R)).compliance(omega)[0])


@pytest.mark.parametrize('nu', [0.0, 0.25, 1.0 / 3.0, 0.45])
def test_cone_at_rest_is_the_half_space(nu):
    # Closed forms of the smooth rigid disc, e.g. Gazetas (1983).
    sliding = 8.0 * G * R / (2.0 - nu)
    rocking = 8.0 * G * R**3 / (3.0 * (1.0 - nu))
    expected = [sliding, sliding, 4.0 * G * R / (1.0 - nu), rocking, rocking,
                16.0 * G * R**3 / 3.0]
    np.testing.assert_allclose(stiffness(nu, 0.0), expected, rtol=1e-13)


def test_square_contact_has_the_statics_of_the_published_case():
    # benchmarks.json, cf_cone_static (Wolf 1994 / Gazetas 1983).
    static = 1.0 / np.diagonal(ConeModel(Soil(G, 0.25, RHO), Rectangle(0.5, 0.5)).compliance(
        np.zeros(1))[0])
    np.testing.assert_allclose(static[[2, 0]].real, [144432533.38822562, 123799314.33276482],
                               rtol=1e-12)


def test_fast_cone_radiates_plane_waves():
    nu, a0 = 0.25, 1e4
    soil = Soil(G, nu, RHO)
    omega = a0 * soil.shear_wave_speed / R
    area, moment = math.pi * R**2, math.pi * R**4 / 4.0
    shear, pressure = soil.shear_wave_speed, soil.pressure_wave_speed
    dashpots = np.array([RHO * shear * area, RHO * shear * area, RHO * pressure * area,
                         RHO * pressure * moment, RHO * pressure * moment,
                         RHO * shear * 2.0 * moment])
    # What is left of the spring is of order 1 / a0.
    np.testing.assert_allclose(stiffness(nu, a0).imag / omega, dashpots, rtol=1e-3)


def test_rotational_cone_is_a_spring_beside_a_dashpot_in_series_with_an_inertia():
    # Exact mechanical form ("monkey-tail") of the rotational cone, Wolf (1994), sec. 2.3.
    soil = Soil(G, 0.25, RHO)
    cone = ConeModel(soil, Circle(R)).cones[4]
    moment = math.pi * R**4 / 4.0
    omega = np.linspace(1.0, 3000.0, 7)
    spring = 3.0 * RHO * soil.pressure_wave_speed**2 * moment / cone.apex_height
    dashpot = 1j * omega * RHO * soil.pressure_wave_speed * moment
    inertia = -omega**2 * RHO * moment * cone.apex_height
    np.testing.assert_allclose(cone.rotational_stiffness(omega, second_moment=moment),
                               spring + dashpot * inertia / (dashpot + inertia), rtol=1e-12)


def test_slow_rocking_radiates_as_the_cone_must():
    # b0^3 / 3 of K: 0.545 a0^3 at nu = 1/3.
    rocking = stiffness(1.0 / 3.0, 0.01)[4]
    assert rocking.imag / rocking.real == pytest.approx(0.545 * 0.01**3, rel=2e-3)


@pytest.mark.parametrize('dof, coefficient, power', [(2, 2.4 * math.pi, 3), (4, 0.3 * math.pi, 5)])
def test_nearly_incompressible_soil_moves_a_trapped_mass(dof, coefficient, power):
    nu, a0 = 0.45, 3.0
    soil = Soil(G, nu, RHO)
    omega = a0 * soil.shear_wave_speed / R
    slow = 2.0 * soil.shear_wave_speed
    height = ConeModel(soil, Circle(R)).cones[dof].apex_height
    area = math.pi * R**2 if dof == 2 else math.pi * R**4 / 4.0
    b0 = omega * height / slow
    massless = RHO * slow**2 * area / height * (
        1.0 + 1j * b0 if dof == 2 else (3.0 + 3j * b0 - b0**2) / (1.0 + 1j * b0))
    trapped = coefficient * (nu - 1.0 / 3.0) * RHO * R**power
    assert stiffness(nu, a0)[dof] == pytest.approx(massless - omega**2 * trapped, rel=1e-12)


def test_hysteretic_damping_is_the_loss_factor_at_rest():
    static = stiffness(0.25, 0.0, eta=0.1)
    np.testing.assert_allclose(static.imag / static.real, 0.1, rtol=1e-12)


def test_hysteretic_damping_follows_the_correspondence_principle():
    # S*(a0) = (1 + i eta) S(a0 / sqrt(1 + i eta)) for a massless cone, vertical: c = c_p.
    a0, eta, nu = 1.3, 0.1, 0.25
    height_ratio = math.pi / 4.0 * (1.0 - nu) * 3.0
    static = 4.0 * G * R / (1.0 - nu)
    loss = 1.0 + 1j * eta
    expected = static * loss * (1.0 + 1j * a0 / np.sqrt(loss) * height_ratio / math.sqrt(3.0))
    assert stiffness(nu, a0, eta)[2] == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize('nu', [0.0, 0.3, 0.34, 0.49])
@pytest.mark.parametrize('eta', [0.0, 0.2])
def test_cone_never_gives_energy_back(nu, eta):
    soil = Soil(G, nu, RHO, eta)
    omega = np.linspace(0.0, 20.0, 200) * soil.shear_wave_speed / R
    compliance = ConeModel(soil, Rectangle(0.4, 0.9)).compliance(omega)
    loss = 0.5j * (compliance - compliance.conj().transpose(0, 2, 1))
    assert np.linalg.eigvalsh(loss).min() >= 0.0
