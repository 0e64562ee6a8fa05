"""Few shapes in place of many elements: what a rotor does at its ports up to some frequency."""

import math

import numpy as np
import scipy.linalg

from rotorsoil_ros.arrays import FloatArray

# Modes at rest up to so many times the highest frequency are shapes of their own ...
_REACH = 6.0

# ... and so many terms of the series in frequency stand for the others. What both leave is
# _REACH^(-2 _TERMS), 3e-13: below the round-off of solving.
_TERMS = 8

# Shapes that are this close to a combination of others add nothing but round-off.
_DEPENDENT = 1e-8


def shapes_at_ports(
    stiffness: FloatArray, mass: FloatArray, polar: FloatArray, ports: list[int], *,
    highest: float, speed: float,
) -> FloatArray:
    """
    Return shapes that carry all motion under port forces up to a frequency.

    Parameters
    ----------
    stiffness, mass, polar : (n, n) float arrays
        Of one plane, the rotor on its springs; polar inertia couples the planes.
    ports : list of int
        Rows at which forces act or motion is wanted.
    highest : float
        Frequency up to which the shapes serve [rad/s].
    speed : float
        Fixed rotor speed [rad/s].

    Returns
    -------
    (n, r) float array
        The identity where half as many shapes would not do.

    Notes
    -----
    K - omega^2 M +- omega speed J is inverted as a series in omega once the slow modes at rest
    are taken apart: forces at the ports, and what gyroscopic couples of the slow modes exert,
    move the rest by x_0 = K^-1 f, x_j = K^-1 (M x_(j-2) -+ speed J x_(j-1)). Both signs span the
    same. A Galerkin solution in these shapes has twice as many terms right.

    References
    ----------
    Bai & Su (2005), SOAR: a second-order Arnoldi method, SIAM J. Matrix Anal. Appl. 26, p. 640,
    for the series; Bai (2002), Krylov subspace techniques for reduced-order modeling, Appl.
    Numer. Math. 43, p. 9, for the terms that are right.

    """
    size = len(stiffness)
    # Gyroscopic couples are of the order of omega speed 2 M: no body has more polar inertia.
    top = math.sqrt(highest * max(highest, 2.0 * speed))
    if not top > 0.0:
        return np.eye(size)
    _, slow = scipy.linalg.eigh(mass, stiffness,
                                subset_by_value=((_REACH * top) ** -2.0, math.inf))
    loads = np.concatenate([np.eye(size)[:, sorted(set(ports))], polar @ slow], axis=1)
    factor = scipy.linalg.cho_factor(stiffness)
    upper = np.triu(factor[0])
    before, now = np.zeros_like(loads), scipy.linalg.cho_solve(factor, loads)
    basis = upper @ slow
    for _ in range(_TERMS):
        basis = _extended(basis, upper @ now)
        if basis.shape[1] > size // 2:
            return np.eye(size)
        before, now = now, scipy.linalg.cho_solve(factor, mass @ before + speed * (polar @ now))
        # In units in which the next terms are neither tiny nor huge; every other one is zero
        # where nothing turns.
        scale = max(np.abs(before).max(), np.abs(now).max())
        before, now = before / scale, now / scale
    return np.asarray(scipy.linalg.solve_triangular(upper, basis))


def _extended(basis: FloatArray, more: FloatArray) -> FloatArray:
    """Add directions to an orthonormal basis, (n, r); those that it has are left out."""
    length = np.linalg.norm(more, axis=0)
    more = more[:, length > 0.0] / length[length > 0.0]
    # Twice is enough (Kahan and Parlett).
    for _ in range(2):
        more = more - basis @ (basis.T @ more)
    directions, sizes, _ = np.linalg.svd(more, full_matrices=False)
    return np.concatenate([basis, directions[:, sizes > _DEPENDENT]], axis=1)
