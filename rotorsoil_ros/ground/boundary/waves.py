"""How the surface of a half-space moves under a point force that swings: the waves alone."""

from dataclasses import dataclass
from functools import lru_cache
import math

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.special import hankel2e

from rotorsoil_ros.arrays import BoolArray, ComplexArray, FloatArray

# Nodes of the spline over |k_s r|: geometric up to the first limit, then of even steps.
_SMALLEST = 0.0113
_EVEN_FROM = 0.3
_NEAR_NODES = 24
_STEP = 0.12
_SHORTEST = 8.0

# Quadrature along a branch cut: Gauss points in geometric panels of sqrt(s / s_max), up to where
# the waves have decayed by e^-40.
_DECAYED = 40.0
_PANELS = 15
_GAUSS = 14
_FIRST_PANEL = 1e-3

# Tilts of the cut of pressure waves from straight down [rad], and how well a root of the squared
# Rayleigh equation has to fulfil the equation itself.
_TILTS = (0.0, 0.15, 0.3, 0.45, 0.6, 0.75, 0.9)
_IS_ROOT = 1e-6


@dataclass(frozen=True, slots=True, eq=False)
class SurfaceWaves:
    """
    Surface motion by a force on a half-space with G = rho = 1, less the static one.

    Attributes
    ----------
    poisson_ratio, loss_factor : float
        nu and eta [-].
    reach : float
        Largest omega r / c_s that is known [-].
    spline : CubicSpline
        I_z, I_a, I_d, I_h less their static parts over omega r / c_s.

    Notes
    -----
    A force on the surface moves it at a distance r, along the direction (c, s) from the force,
    by k_s / (2 pi q) times I_z for z from z, I_a +- I_d (c^2 - s^2) for x from x and y from y,
    2 I_d s c for y from x, I_h (c, s) for x, y from z and the opposite for z from x, y (z points
    down; q = 1 + i eta, k_s = omega / sqrt(q)). Each I is a function of k_s r: a static part
    in closed form (`statics`) and what is held here.

    References
    ----------
    Lamb (1904), Phil. Trans. R. Soc. A 203; Johnson (1974), Geophys. J. R. Astr. Soc. 37;
    integrals along branch cuts: Achenbach (1973), Wave Propagation in Elastic Solids, sec. 7.5.

    """

    poisson_ratio: float
    loss_factor: float
    reach: float
    spline: CubicSpline

    @classmethod
    def of(cls, poisson_ratio: float, loss_factor: float, reach: float) -> 'SurfaceWaves':
        """Tabulate the waves, or take them from those that are known in this process."""
        # A few lengths of table are shared by all shapes.
        steps = math.ceil(2.0 * math.log2(max(reach, _SHORTEST)))
        return _tabulated(poisson_ratio, loss_factor, 2.0 ** (0.5 * steps))

    def at(self, a0: float) -> 'WavesAt':
        """Return the waves at a frequency, omega times the unit of length over c_s [-]."""
        return WavesAt(self, a0)


@dataclass(frozen=True, slots=True, eq=False)
class WavesAt:
    """Waves on a half-space at one frequency, a0 per unit of length."""

    surface: SurfaceWaves
    a0: float

    @property
    def poisson_ratio(self) -> float:
        """Of the half-space [-]."""
        return self.surface.poisson_ratio

    @property
    def loss_factor(self) -> float:
        """Of the half-space [-]."""
        return self.surface.loss_factor

    @property
    def wavenumber(self) -> complex:
        """Return k_s per unit of length, a0 / sqrt(1 + i eta)."""
        return complex(self.a0 / np.sqrt(1.0 + 1j * self.loss_factor))

    def __call__(self, distance: FloatArray) -> ComplexArray:
        """Return k_s times I_z, I_a, I_d, I_h less their static parts, (..., 4)."""
        values: ComplexArray = self.surface.spline(self.a0 * distance)
        return values * self.wavenumber


@lru_cache(maxsize=64)
def _tabulated(poisson_ratio: float, loss_factor: float, reach: float) -> SurfaceWaves:
    nodes = np.concatenate([
        np.geomspace(_SMALLEST, _EVEN_FROM, _NEAR_NODES, endpoint=False),
        np.arange(_EVEN_FROM, reach + 1.01 * _STEP, _STEP)])
    ray = 1.0 / np.sqrt(1.0 + 1j * loss_factor)
    values = wave_integrals(poisson_ratio, nodes * (ray / abs(ray)))
    values -= static_integrals(poisson_ratio, nodes * (ray / abs(ray)))
    # At no distance: a cubic through the nearest nodes; the others vanish there.
    powers = np.vander(nodes[:4], 4, increasing=True)
    origin = np.linalg.solve(powers, values[:4])[0]
    origin[2:] = 0.0
    spline = CubicSpline(np.append(0.0, nodes) * math.sqrt(abs(1.0 + 1j * loss_factor)),
                         np.concatenate([origin[None], values]))
    return SurfaceWaves(poisson_ratio, loss_factor, reach, spline)


def static_integrals(poisson_ratio: float, rho: ComplexArray) -> ComplexArray:
    """Return what `wave_integrals` are at rest, (n, 4)."""
    nu = poisson_ratio
    return np.array([1.0 - nu, 0.5 * (2.0 - nu), 0.5 * nu, nu - 0.5]) / rho[:, None]


def wave_integrals(poisson_ratio: float, rho: ComplexArray) -> ComplexArray:
    """
    Return I_z, I_a, I_d, I_h: Lamb's integrals over all wavenumbers.

    Parameters
    ----------
    poisson_ratio : float
        nu [-].
    rho : (n,) complex array
        k_s r, on one ray from the origin at or below the real axis, rising.

    Returns
    -------
    (n, 4) complex array

    Notes
    -----
    The Bessel functions become Hankel functions that decay downwards; the path of integration
    is closed around the lower half-plane. There remain the branch cuts from k = a = c_s / c_p
    and k = 1, along which the integrand decays exponentially, and the poles that lie beside
    them: the Rayleigh wave and, for nu > 0.263, a leaky wave. The cut from a is tilted away from
    the latter, on which it would lie for nu about 0.3.

    """
    surface = _Surface.of(poisson_ratio)
    found = np.zeros((rho.size, 4), dtype=complex)
    for pole in surface.poles():
        found += -1j * math.pi * _hankel(pole * rho)[:, [0, 0, 2, 1]] * surface.residues(pole)
    octave = np.floor(np.log2(np.abs(rho))).astype(int)
    share, weight = _panels()
    for number in np.unique(octave):
        inside = octave == number
        reach = _DECAYED / 2.0**number
        for branch, way in ((surface.a, surface.tilted), (1.0, -1j)):
            along = reach * share
            jump = surface.jump(branch, way * along)
            jump *= (0.5 * reach * way * weight)[:, None]
            hankel = _hankel(np.outer(rho[inside], branch + way * along))
            for column, order in enumerate((0, 0, 2, 1)):
                found[inside, column] += hankel[..., order] @ jump[:, column]
    return found


def _panels() -> tuple[FloatArray, FloatArray]:
    """Return s / s_max and weights of a quadrature that is dense at s = 0."""
    edges = np.append(0.0, np.geomspace(_FIRST_PANEL, 1.0, _PANELS))
    point, weight = np.polynomial.legendre.leggauss(_GAUSS)
    half = 0.5 * np.diff(edges)[:, None]
    t = (edges[:-1, None] + half * (1.0 + point)).ravel()
    return t**2, 2.0 * t * (half * weight).ravel()


def _hankel(argument: ComplexArray) -> ComplexArray:
    """Return the Hankel functions of the second kind of orders 0, 1, 2, (..., 3)."""
    decay = np.exp(-1j * argument)
    zero, one = hankel2e(0, argument) * decay, hankel2e(1, argument) * decay
    return np.stack([zero, one, 2.0 * one / argument - zero], axis=-1)


@dataclass(frozen=True, slots=True)
class _Surface:
    """
    Rayleigh's equation and its branch cuts, wavenumbers in those of shear waves.

    Attributes
    ----------
    a : float
        c_s / c_p, where the cut of pressure waves begins.
    tilted : complex
        Direction of that cut.

    """

    a: float
    tilted: complex

    @classmethod
    def of(cls, poisson_ratio: float) -> '_Surface':
        a = math.sqrt((1.0 - 2.0 * poisson_ratio) / (2.0 * (1.0 - poisson_ratio)))
        roots = _squared_roots(a)
        seen = np.angle(roots[roots.imag < 0.0] - a)
        ways = [-(0.5 * math.pi + tilt) for tilt in _TILTS]
        farthest = max(ways, key=lambda way: np.abs(seen - way).min(initial=math.inf))
        return cls(a, complex(np.exp(1j * farthest)))

    def root(self, k: ComplexArray, branch: float) -> ComplexArray:
        """Return sqrt(k^2 - branch^2), cut along the direction that belongs to the branch."""
        way = self.tilted if branch == self.a else -1j
        root: ComplexArray = (np.sqrt(-(k - branch) / way) / np.sqrt(-1.0 / way + 0j)
                              * np.sqrt(k + branch))
        return root

    def jump(self, branch: float, along: ComplexArray) -> ComplexArray:
        """Return the integrands right less left of a cut, (n, 4)."""
        k = branch + along
        own = np.sqrt(along) * np.sqrt(k + branch)
        if branch == self.a:
            beta = self.root(k, 1.0)
            return _integrands(k, own, beta) - _integrands(k, -own, beta)
        alpha = self.root(k, self.a)
        return _integrands(k, alpha, own) - _integrands(k, alpha, -own)

    def poles(self) -> ComplexArray:
        """Return the wavenumbers of the Rayleigh wave and of a leaky one, if there is one."""
        roots = _squared_roots(self.a)
        alpha, beta = self.root(roots, self.a), self.root(roots, 1.0)
        size = np.abs(2.0 * roots**2 - 1.0) ** 2 + np.abs(4.0 * roots**2 * alpha * beta)
        is_root: BoolArray = np.abs(_rayleigh(roots, alpha, beta)) < _IS_ROOT * size
        leaks = (roots.imag < 0.0) & (roots.real > 0.0) & (roots.real < 1.0)
        surface = (roots.imag == 0.0) & (roots.real > 1.0)
        return np.asarray(roots[is_root & (leaks | surface)])

    def residues(self, k: complex) -> ComplexArray:
        """Return the residues of the integrands at a pole, (4,)."""
        at = np.array([k])
        alpha, beta = self.root(at, self.a), self.root(at, 1.0)
        slope = (8.0 * at * (2.0 * at**2 - 1.0) - 8.0 * at * alpha * beta
                 - 4.0 * at**3 * (beta / alpha + alpha / beta))
        over = np.array([-at * alpha, -0.5 * at * beta, 0.5 * at * beta,
                         at**2 * (2.0 * at**2 - 1.0 - 2.0 * alpha * beta)])
        return np.asarray((over / slope)[:, 0])


def _squared_roots(a: float) -> ComplexArray:
    """Return what solves Rayleigh's equation squared, right of the imaginary axis."""
    square = np.roots([16.0 * (1.0 + a**2) - 32.0, 24.0 - 16.0 * a**2, -8.0, 1.0]).astype(complex)
    roots: ComplexArray = np.sqrt(square)
    return np.where(roots.real < 0.0, -roots, roots)


def _rayleigh(k: ComplexArray, alpha: ComplexArray, beta: ComplexArray) -> ComplexArray:
    return np.asarray((2.0 * k**2 - 1.0) ** 2 - 4.0 * k**2 * alpha * beta)


def _integrands(k: ComplexArray, alpha: ComplexArray, beta: ComplexArray) -> ComplexArray:
    """Return k F_z, k (F_x + F_s) / 2, k (F_s - F_x) / 2, k H, (n, 4)."""
    rayleigh = _rayleigh(k, alpha, beta)
    across, turning = -beta / rayleigh, 1.0 / beta
    return np.stack([-k * alpha / rayleigh, 0.5 * k * (across + turning),
                     0.5 * k * (turning - across),
                     k**2 * (2.0 * k**2 - 1.0 - 2.0 * alpha * beta) / rayleigh], axis=-1)
