"""How the surface of a half-space gives way at rest under forces spread over rectangles."""

from typing import TypeAlias

import numpy as np

from rotorsoil_ros.arrays import FloatArray

StaticKernels: TypeAlias = dict[str, FloatArray]


def primitives(x: FloatArray, y: FloatArray) -> dict[str, FloatArray]:
    """
    Return the functions whose fourth derivative in x, x, y, y is a static kernel.

    Parameters
    ----------
    x, y : float arrays that broadcast
        From the force to the place that moves.

    Returns
    -------
    dict of arrays
        `r`: of 1 / r, `xx`: of x^2 / r^3, `xy`: of x y / r^3, `x`: of x / r^2, `y`: of y / r^2.

    Notes
    -----
    Two differences in each direction over the edges of two rectangles, over both areas, are the
    mean motion of one by a force that is spread evenly over the other. With G = 1 and z down a
    force moves the surface by 1 / (2 pi) times (1 - nu) / r for z from z, (1 - nu) / r +
    nu x^2 / r^3 for x from x, nu x y / r^3 for y from x, and -(1 - 2 nu) / 2 x / r^2 for x from
    z, the opposite for z from x.

    References
    ----------
    The kernels: Boussinesq and Cerruti, in Johnson (1985), Contact Mechanics, sec. 3.2; the
    primitive of 1 / r: Love (1929), Phil. Trans. R. Soc. A 228.

    """
    u, v = np.broadcast_arrays(np.abs(x), np.abs(y))
    r = np.hypot(u, v)
    # What multiplies each of these vanishes where its argument is not defined.
    with np.errstate(divide='ignore', invalid='ignore'):
        over_u = np.where(u > 0.0, np.arcsinh(v / u), 0.0)
        over_v = np.where(v > 0.0, np.arcsinh(u / v), 0.0)
        logarithm = np.where(r > 0.0, np.log(r), 0.0)
    angle = np.arctan2(u, v)
    rest = 0.5 * np.pi - angle
    return {
        'r': 0.5 * u * v * (u * over_u + v * over_v) - r**3 / 6.0,
        'xx': r**3 / 6.0 + 0.5 * v**2 * (u * over_v - r),
        'xy': -np.sign(x) * np.sign(y) * (2.0 * u * v * r + u**3 * over_u + v**3 * over_v) / 6.0,
        'x': np.sign(x) * (0.5 * u * (v**2 - u**2 / 3.0) * logarithm + v**3 * angle / 6.0
                           + 0.5 * u**2 * v * rest),
        'y': np.sign(y) * (0.5 * v * (u**2 - v**2 / 3.0) * logarithm + u**3 * rest / 6.0
                           + 0.5 * v**2 * u * angle),
    }


def static_kernels(poisson_ratio: float, shapes: dict[str, FloatArray]) -> StaticKernels:
    """
    Return 2 pi G times the motion at rest.

    Parameters
    ----------
    poisson_ratio : float
        nu [-].
    shapes : dict of arrays
        1 / r, x^2 / r^3, x y / r^3, x / r^2 and y / r^2 as `r`, `xx`, `xy`, `x`, `y`, or what
        integrals make of them (`primitives`).

    """
    nu = poisson_ratio
    return {'xx': (1.0 - nu) * shapes['r'] + nu * shapes['xx'],
            'yy': shapes['r'] - nu * shapes['xx'],
            'zz': (1.0 - nu) * shapes['r'], 'xy': nu * shapes['xy'],
            'xz': (nu - 0.5) * shapes['x'], 'yz': (nu - 0.5) * shapes['y']}
