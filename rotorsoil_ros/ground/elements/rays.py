"""
What stands for the soil beyond the near field: elements on rays, with waves along them.

An element sits on one boundary edge of the near field and is swept outwards from the centre of
the contact, x(s, eta) = s x_edge(eta) with 1 <= s < oo, so that s = r / r_j along the ray of
node j. Along each ray P, S and Rayleigh waves are superposed, each in several algebraic orders.
"""

import math

import numpy as np

from rotorsoil_ros.arrays import ComplexArray, FloatArray, IntArray
from rotorsoil_ros.errors import NotSolvedError
from rotorsoil_ros.ground.elements.mesh import NearField

# Geometric Gauss-Legendre panels along the rotated ray: more of either changes the compliance
# by less than 1.5e-5 from a0 = 0.005 to 20 and nu = 0 to 0.49.
PANELS = 10
POINTS_PER_PANEL = 6
ROTATION = np.exp(-0.25j * math.pi)
# Farther out than this many 1/|k| every product of two waves is below 1e-8 on the rotated ray.
REACH = 13.0
DEPENDENT = 1e-14


def rayleigh_speed(poisson_ratio: float) -> float:
    """
    Return the speed of Rayleigh waves over that of shear waves [-].

    Notes
    -----
    The root in (0, 1) of x^3 - 8 x^2 + (24 - 16 g) x - 16 (1 - g) = 0 with x = (c_R / c_S)^2
    and g = (c_S / c_P)^2.

    References
    ----------
    Graff, Wave Motion in Elastic Solids (1975), sec. 6.1.

    """
    ratio = _speed_ratio_squared(poisson_ratio)
    roots = np.roots([1.0, -8.0, 24.0 - 16.0 * ratio, -16.0 * (1.0 - ratio)])
    real = roots[np.abs(roots.imag) < 1e-9].real
    return math.sqrt(real[(real > 0.0) & (real < 1.0)][0])


def wavenumbers(shear: complex, poisson_ratio: float) -> ComplexArray:
    """Return the wavenumbers of Rayleigh, S and P waves, in that order, from that of S waves."""
    return np.array([
        shear / rayleigh_speed(poisson_ratio),
        shear,
        shear * math.sqrt(_speed_ratio_squared(poisson_ratio)),
    ])


def _speed_ratio_squared(poisson_ratio: float) -> float:
    return (1.0 - 2.0 * poisson_ratio) / (2.0 - 2.0 * poisson_ratio)


class RayElements:
    """
    Infinite elements around a near field.

    Each boundary node carries the node's own value and `3 orders - 1` amplitudes, shared by the
    two elements that meet there; so the field is continuous everywhere.

    Attributes
    ----------
    dofs : (e, 3 f) int array
        Scalar degrees of freedom of each element, f radial functions for each of its 3 nodes.
    origin : (a,) int array
        Near-field degree of freedom on whose ray each additional amplitude lives.

    """

    def __init__(self, near: NearField, *, orders: int, axisymmetric: bool) -> None:
        nodes, local = np.unique(near.boundary, return_inverse=True)
        self._edges: IntArray = local.reshape(near.boundary.shape)
        self._radii: FloatArray = np.hypot(*near.coordinates[:, nodes])
        self._dimension = 2 if axisymmetric else 1
        # A surface wave spreads one dimension less than a body wave: r^-(d-1)/2 against r^-d/2.
        leading = np.array([self._dimension - 1, self._dimension, self._dimension]) / 2.0
        self._powers: FloatArray = (leading + np.arange(orders)[:, None]).ravel()
        self._waves: IntArray = np.tile(np.arange(3), orders)
        functions = self._powers.size
        first = near.size + np.arange(functions - 1) * nodes.size
        self.origin: IntArray = np.tile(nodes, functions - 1)
        extra = (first[:, None] + np.arange(nodes.size)).T[self._edges]
        self.dofs: IntArray = np.concatenate(
            [near.boundary[:, :, None], extra], axis=2).reshape(len(near.boundary), -1)
        self._integrate_edges(near.coordinates[:, near.boundary])

    def _integrate_edges(self, corners: FloatArray) -> None:
        """Integrate along the edges: operators g = U_g d/ds + V_g / s for d/dx, d/dz and 1/r."""
        eta, weight = np.polynomial.legendre.leggauss(5)
        shape = np.array([eta * (eta - 1.0), 2.0 - 2.0 * eta**2, eta * (eta + 1.0)]) / 2.0
        slope = np.array([eta - 0.5, -2.0 * eta, eta + 0.5])
        x, z = np.einsum('ceq,qh->ceh', corners, shape)
        x_eta, z_eta = np.einsum('ceq,qh->ceh', corners, slope)
        area = x * z_eta - z * x_eta
        zero = np.zeros_like(area)
        along, across, ring = [z_eta, -x_eta, zero], [-z, x, zero], [zero, zero, area / x]
        count = self._dimension + 1
        along, across, ring = (
            np.array(part[:count])[:, :, None, :] / area[:, None, :]
            for part in (along, across, ring))
        d_s = along * shape
        over_s = across * slope + ring * shape
        measure = area * weight * (x if count == 3 else 1.0)

        def pair(test: FloatArray, trial: FloatArray) -> FloatArray:
            product: FloatArray = np.einsum('geqh,felh,eh->gfeql', test, trial, measure)
            # Room for the radial functions that belong to each node.
            return product[:, :, :, :, None, :, None]

        self._ss, self._s0 = pair(d_s, d_s), pair(d_s, over_s)
        self._0s, self._00 = pair(over_s, d_s), pair(over_s, over_s)
        mass = np.einsum('qh,lh,eh->eql', shape, shape, measure)
        self._mass = mass[:, :, None, :, None]

    def matrices(self, waves: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
        """
        Return the element matrices for the given wavenumbers.

        Parameters
        ----------
        waves : (3,) complex array
            Wavenumbers of Rayleigh, S and P waves times the contact's length.

        Returns
        -------
        gradients : (g, g, e, 3 f, 3 f) complex array
            int g_i h_j over each element, g and h in d/dx, d/dz and, for the disc, 1/r.
        mass : (e, 3 f, 3 f) complex array
            int N_i N_j.

        Notes
        -----
        The integrand is analytic in s. On the real axis it oscillates without decay; along
        s = 1 + tau exp(-i pi / 4) every factor decays without oscillating.

        """
        distance, weight = self._contour(waves)
        s = 1.0 + distance
        value, slope = self._radial_functions(waves, distance, weight)
        elements, functions = len(self._edges), self._powers.size
        value = value[self._edges].reshape(elements, 3 * functions, -1)
        slope = slope[self._edges].reshape(elements, 3 * functions, -1)
        d = self._dimension

        def radial(test: ComplexArray, trial: ComplexArray, power: int) -> ComplexArray:
            product = (test * (weight * s**power)) @ trial.swapaxes(1, 2)
            return product.reshape(elements, 3, functions, 3, functions)

        mixed = radial(slope, value, d - 1)
        gradients = (self._ss * radial(slope, slope, d)
                     + self._s0 * mixed + self._0s * mixed.transpose(0, 3, 4, 1, 2)
                     + self._00 * radial(value, value, d - 2))
        mass = self._mass * radial(value, value, d)
        local = (elements, 3 * functions, 3 * functions)
        return gradients.reshape(*gradients.shape[:2], *local), mass.reshape(local)

    def _contour(self, waves: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
        fastest = np.abs(waves).max() * self._radii.max()
        slowest = np.abs(waves).min() * self._radii.min()
        panels = np.concatenate([[0.0], np.geomspace(
            min(0.5, 0.5 / fastest), max(3.0, REACH / slowest), PANELS)])
        point, weight = np.polynomial.legendre.leggauss(POINTS_PER_PANEL)
        length = np.diff(panels)[:, None]
        distance = (panels[:-1, None] + length * (point + 1.0) / 2.0).ravel() * ROTATION
        return distance, (length * weight / 2.0).ravel() * ROTATION

    def _radial_functions(
        self, waves: ComplexArray, distance: ComplexArray, weight: ComplexArray,
    ) -> tuple[ComplexArray, ComplexArray]:
        """Return values and s-derivatives of the functions on every ray, (rays, f, points)."""
        s = 1.0 + distance
        phase = -1j * waves[:, None] * self._radii[:, None, None]
        wave = np.exp(phase * distance)[:, self._waves]
        power = self._powers[:, None]
        value = wave * s**-power
        slope = value * (phase[:, self._waves] - power / s)
        # The first keeps the value 1 at the boundary, the others vanish there: the first
        # amplitude is the near field's own node.
        value[:, 1:] -= value[:, :1]
        slope[:, 1:] -= slope[:, :1]
        # Within a box much smaller than a wavelength all waves look alike and the functions are
        # nearly dependent (condition 1e10 at a0 = 0.005). An orthonormal basis of the same
        # space costs 1 ms and leaves a system whose residual means something.
        measure = np.abs(weight * s**self._dimension)
        inner = 1.0 / np.abs(s) ** 2 + np.abs(phase[:, 1:2]) ** 2
        samples = np.concatenate(
            [slope[:, 1:] * np.sqrt(measure), value[:, 1:] * np.sqrt(measure * inner)], axis=2)
        triangle = np.swapaxes(np.linalg.qr(samples.swapaxes(1, 2), mode='r'), 1, 2)
        size = np.abs(np.diagonal(triangle, axis1=1, axis2=2))
        if not size.min() > DEPENDENT * size.max():
            raise NotSolvedError(
                f'the waves cannot be told apart at |k| = {np.abs(waves[1]):g} per contact length')
        value[:, 1:], slope[:, 1:] = (
            np.linalg.solve(triangle, part[:, 1:]) for part in (value, slope))
        return value, slope
