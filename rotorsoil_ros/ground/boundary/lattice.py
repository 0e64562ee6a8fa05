"""What a sum over nodes makes of a kernel with a kink at its origin, and how it is mended."""

import math

import numpy as np
from scipy.special import k0, k1

from rotorsoil_ros.arrays import ComplexArray, FloatArray
from rotorsoil_ros.ground.boundary.kernels import SwingingWaves

_ZETA_3 = 1.2020569031595942
# Terms e^(-2 pi n) of the lattice sums below this are nothing.
_TERMS = 6


def lattice_errors(first: FloatArray, second: FloatArray) -> tuple[FloatArray, FloatArray]:
    """
    Return by how much a sum over the nodes of a grid exceeds the integral of a kinked kernel.

    Parameters
    ----------
    first, second : float arrays that broadcast
        Spacings of the nodes along x and y.

    Returns
    -------
    of_r, of_difference : float arrays
        For the kernels r and (x^2 - y^2) / r, for a force 1 at each node.

    Notes
    -----
    With t >= 1 the ratio of the spacings, the shorter being 1, the first is the Epstein zeta
    function of the form m^2 + t^2 n^2 at -1/2, by Chowla and Selberg's formula
        Z(t) = -1/6 - zeta(3) t^2 / (2 pi^2) - (4 / pi) sum_{n, k} (t n / k) K_1(2 pi k t n);
    the other is Z - 2 t dZ/dt. Both are multiplied by the shorter spacing.

    References
    ----------
    Selberg & Chowla (1967), J. reine angew. Math. 227, p. 86; corrections of the trapezoidal
    rule by zeta functions: Marin, Runborg & Tornberg (2014), IMA J. Numer. Anal. 34.

    """
    shorter, longer = np.minimum(first, second), np.maximum(first, second)
    t = longer / shorter
    n, k = (part.ravel().astype(float) for part in np.meshgrid(
        np.arange(1, _TERMS), np.arange(1, _TERMS)))
    argument = 2.0 * math.pi * t[..., None] * (n * k)
    zeta = (-1.0 / 6.0 - _ZETA_3 * t**2 / (2.0 * math.pi**2)
            - 4.0 / math.pi * (t[..., None] * n / k * k1(argument)).sum(axis=-1))
    slope = (-_ZETA_3 * t / math.pi**2
             + 8.0 * t * (n**2 * k0(argument)).sum(axis=-1))
    difference = zeta - 2.0 * t * slope
    return shorter * zeta, shorter * np.where(first <= second, difference, -difference)


def kink_coefficients(poisson_ratio: float) -> tuple[float, float, float]:
    """
    Return what multiplies k_s^2 times the kinks of the waves at no distance.

    Returns
    -------
    of_z, of_x, of_difference : floats
        -r's share of z from z and of x from x, y from y; share of +-(x^2 - y^2) / r in these.

    Notes
    -----
    From the next terms of the integrands at large wavenumbers: with m = (1 - a^2) / 2,
    a = c_s / c_p, these are d_z = (e - a^2 / 2) / (4 m), d_x = (e - 1/2) / (4 m) for e =
    (1 + 2 m^2) / (4 m), and 1/2 for the waves that move across the direction of travel.

    """
    a2 = (1.0 - 2.0 * poisson_ratio) / (2.0 * (1.0 - poisson_ratio))
    m = 0.5 * (1.0 - a2)
    e = (1.0 + 2.0 * m**2) / (4.0 * m)
    of_z, of_x = (e - 0.5 * a2) / (4.0 * m), (e - 0.5) / (4.0 * m)
    return of_z, 0.5 * (of_x + 0.5), (0.5 - of_x) / 6.0


def mended(
    waves: SwingingWaves, of_r: FloatArray, of_difference: FloatArray,
) -> ComplexArray:
    """
    Return what each node adds to its own motion, for x, y and z, (3, ...).

    Parameters
    ----------
    waves : SwingingWaves
        Of the ground: their kinks are those of the material at its surface.
    of_r, of_difference : float arrays
        As `lattice_errors`.

    """
    of_z, of_x, of_both = kink_coefficients(waves.poisson_ratio)
    origin, square = waves(np.zeros(1))[0], waves.wavenumber**2
    along = origin[1] + square * of_x * of_r
    across = square * of_both * of_difference
    return np.stack([along - across, along + across, origin[0] + square * of_z * of_r])
