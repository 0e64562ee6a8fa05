"""Lamb's integrals against published ones, a direct contour and the static limit."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import jv

from rotorsoil_ros.ground.boundary.waves import static_integrals, SurfaceWaves, wave_integrals

# G r u_z / P of a vertical force at omega r / c_s, nu = 0.33: Wong (1975) and Apsel (1979).
PUBLISHED = {0.5: 0.087 - 0.062j, 1.0: 0.037 - 0.102j, 2.0: -0.087 - 0.077j,
             3.0: -0.114 + 0.053j, 5.0: 0.127 + 0.064j}


def test_a_vertical_force_moves_the_surface_as_published():
    rho = np.array(list(PUBLISHED)) + 0j
    found = wave_integrals(0.33, rho)[:, 0] * rho / (2.0 * np.pi)
    np.testing.assert_allclose(found, list(PUBLISHED.values()), atol=1.5e-3)  # printed to 0.001


def direct(poisson, rho):
    """Integrate over real and, up to beyond the Rayleigh pole, over lifted wavenumbers."""
    a = np.sqrt((1.0 - 2.0 * poisson) / (2.0 * (1.0 - poisson)))
    rest = static_integrals(poisson, np.ones(1))[0]

    def integrands(k):
        k = complex(k)
        alpha, beta = (np.sqrt(k - edge) * np.sqrt(k + edge) for edge in (a, 1.0))
        rayleigh = (2.0 * k**2 - 1.0) ** 2 - 4.0 * k**2 * alpha * beta
        across, turning = -beta / rayleigh, 1.0 / beta
        return np.array([
            -k * alpha / rayleigh, 0.5 * k * (across + turning), 0.5 * k * (turning - across),
            k**2 * (2.0 * k**2 - 1.0 - 2.0 * alpha * beta) / rayleigh]) - rest

    point, weight = np.polynomial.legendre.leggauss(800)
    share, weight = 1.5 * (1.0 + point), 1.5 * weight
    path = share + 0.5j * np.sin(np.pi * share / 3.0)
    slope = 1.0 + 0.5j * np.pi / 3.0 * np.cos(np.pi * share / 3.0)
    found = []
    for column, order in enumerate((0, 0, 2, 1)):
        lifted = sum(integrands(k)[column] * jv(order, k * rho) * w * d
                     for k, w, d in zip(path, weight, slope, strict=True))
        tail, _ = quad(lambda k, c=column, n=order: (integrands(k)[c] * jv(n, k * rho)).real,
                       3.0, 400.0, limit=2000)
        found.append(lifted + tail)
    return np.array(found)


@pytest.mark.parametrize('poisson', [0.0, 0.25, 0.3, 1.0 / 3.0, 0.45, 0.49])
@pytest.mark.parametrize('rho', [0.3, 2.0, 8.0])
def test_branch_cuts_and_poles_are_the_direct_integral(poisson, rho):
    """At 0.3 and 1/3 a leaky pole lies where an upright cut would be."""
    at = np.array([rho + 0j])
    found = (wave_integrals(poisson, at) - static_integrals(poisson, at))[0]
    # The tail beyond k = 400, which is left out of the direct integral, is below this.
    np.testing.assert_allclose(found, direct(poisson, rho), atol=3e-5)


def test_the_table_is_the_integral_between_its_nodes():
    waves = SurfaceWaves.of(0.3, 0.05, 20.0)
    r = np.array([0.05, 0.2, 0.77, 3.33, 11.11, 19.5])
    rho = r / np.sqrt(1.0 + 0.05j)
    exact = wave_integrals(0.3, rho) - static_integrals(0.3, rho)
    np.testing.assert_allclose(waves.spline(r), exact, atol=2e-5)


def test_far_away_only_rayleigh_waves_are_left():
    """Surface motion decays as r^-1/2, body waves along the surface as r^-2."""
    near, far = np.abs(wave_integrals(0.25, np.array([40.0 + 0j, 160.0 + 0j])))
    assert far[0] / near[0] == pytest.approx(0.5, rel=0.03)
