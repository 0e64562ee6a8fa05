"""How discs on one half-space move each other, evenly pressed: the patches of a raft."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
import math

import numpy as np
from scipy.special import jv

from rotorsoil_ros.arrays import ComplexArray, FloatArray, inside, IntArray
from rotorsoil_ros.errors import NotSolvedError, RotorSoilError
from rotorsoil_ros.ground.soil import Soil

# To be raised whenever other numbers come out of the same grid.
GREEN_ALGORITHM = 1

# Gauss points of a panel; wavenumbers from zero to this many over the smallest radius.
_POINTS = 12
_FARTHEST = 200.0
# Longest panel, of a radius, of a wave length over the largest distance, and of the width of the
# pole of the surface wave.
_PANEL, _TURNS, _SHARP = 1.0, 1.0, 1.0
# Of a0: beyond, no wave of the half-space has its pole.
_BEYOND = 1.3

# Without loss the surface wave is a pole on the path of integration.
LEAST_LOSS = 0.005

# Frequencies at first, at most, and how well what lies between has to be met.
_FIRST, _MOST, _TOLERANCE = 17, 257, 1e-5

# Speed of what arrives, over that of shear waves.
_SURFACE = 0.93


@dataclass(frozen=True, eq=False)
class GreenTable:
    """
    Motion of discs by discs, without dimension, over a0 of the unit radius.

    Attributes
    ----------
    poisson_ratio, loss_factor : float
        Of the half-space.
    pairs : (u, 3) float array
        Radius of both discs and distance of their centres, over the unit.
    highest : float
        a0 up to which it is known.
    nodes : (m,) float array
        Chebyshev points of a0.
    values : (m, u, 3) complex array
        At these: vertical, horizontal mean and difference along and across the line, G times the
        unit times the compliance, ahead of the delay of a surface wave.

    """

    poisson_ratio: float
    loss_factor: float
    pairs: FloatArray
    highest: float
    nodes: FloatArray
    values: ComplexArray

    @classmethod
    def solved(
        cls, poisson_ratio: float, loss_factor: float, pairs: FloatArray, highest: float,
    ) -> 'GreenTable':
        """
        Solve until a polynomial through the frequencies says the rest.

        Raises
        ------
        NotSolvedError
            If no number of frequencies is enough.

        """
        waves = _Waves(poisson_ratio, loss_factor, pairs, highest)
        count = _FIRST
        nodes = _chebyshev(count, highest)
        values = np.stack([waves.at(a0) for a0 in nodes])
        while count <= _MOST:
            between = 0.5 * (nodes[1:] + nodes[:-1])[::max(1, count // 16)]
            table = cls(poisson_ratio, loss_factor, pairs, highest, nodes, values)
            exact = np.stack([waves.at(a0) for a0 in between])
            size = np.abs(exact).max(axis=(0, 1))
            if np.abs(table._smooth(between) - exact).max() <= _TOLERANCE * size.max():
                return table
            count = 2 * count - 1
            fine = _chebyshev(count, highest)
            finer = np.empty((count, *values.shape[1:]), dtype=complex)
            finer[::2] = values
            finer[1::2] = [waves.at(a0) for a0 in fine[1::2]]
            nodes, values = fine, finer
        raise NotSolvedError(f'the coupling of patches through the ground is still rough with '
                             f'{count} frequencies up to a0 = {highest:g}')

    def to_arrays(self) -> dict[str, FloatArray | ComplexArray]:
        """Return everything as plain arrays."""
        return {'soil': np.array([self.poisson_ratio, self.loss_factor, self.highest]),
                'pairs': self.pairs, 'nodes': self.nodes, 'values': self.values}

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, np.ndarray]) -> 'GreenTable':
        """Rebuild a table from `to_arrays`."""
        poisson, loss, highest = arrays['soil'].tolist()
        return cls(poisson, loss, arrays['pairs'], highest, arrays['nodes'], arrays['values'])

    def _smooth(self, a0: FloatArray) -> ComplexArray:
        """Return the polynomial through the nodes, (n, u, 3)."""
        weights = np.ones(len(self.nodes))
        weights[1::2], weights[[0, -1]] = -1.0, 0.5
        weights[-1] *= (-1.0) ** (len(self.nodes) - 1)
        gap = a0[:, None] - self.nodes
        cauchy = weights / np.where(gap == 0.0, 1e-300, gap)
        flat = cauchy @ self.values.reshape(len(self.nodes), -1)
        return np.asarray((flat / cauchy.sum(axis=1)[:, None]).reshape(
            len(a0), *self.values.shape[1:]))

    def at(self, a0: FloatArray) -> ComplexArray:
        """Return the motions at frequencies (n,), (n, u, 3)."""
        delay = np.exp(-1j * a0[:, None] * self.pairs[:, 2] / _SURFACE)
        return np.asarray(self._smooth(a0) * delay[..., None])


def _chebyshev(count: int, highest: float) -> FloatArray:
    return np.asarray(0.5 * highest * (1.0 - np.cos(np.pi * np.arange(count) / (count - 1))))


class _Waves:
    """Wavenumber integrals of some pairs of discs."""

    def __init__(
        self, poisson_ratio: float, loss_factor: float, pairs: FloatArray, highest: float,
    ) -> None:
        self._nu, self._loss, self._pairs = poisson_ratio, loss_factor, pairs
        self._panel = min(_PANEL / pairs[:, :2].max(), _TURNS * 2.0 * math.pi / max(
            float(pairs[:, 2].max()), 1e-3))
        self._beyond = _BEYOND * highest
        # Where no frequency has a pole what discs do is the same for all.
        self._far = self._folded(np.arange(
            self._beyond, _FARTHEST / pairs[:, :2].min(), self._panel))

    def _folded(self, edges: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return wavenumbers, and weights of both kinds of integral over discs, (u, k) each."""
        points, weights = np.polynomial.legendre.leggauss(_POINTS)
        half = 0.5 * np.diff(edges)[:, None]
        k = (edges[:-1, None] + half * (1.0 + points)).ravel()

        def even(radius: FloatArray) -> FloatArray:
            return np.asarray(2.0 * jv(1, k * radius[:, None]) / (k * radius[:, None]))

        one, other, distance = self._pairs.T
        discs = even(one) * (even(one) if np.array_equal(one, other) else even(other))
        discs *= (half * weights).ravel() * k / (2.0 * math.pi)
        return (k, discs * jv(0, k * distance[:, None]), discs * jv(2, k * distance[:, None]))

    def at(self, a0: float) -> ComplexArray:
        """Return vertical, horizontal mean and difference, (u, 3), ahead of the delay."""
        # Poles and branch points lie below _BEYOND a0, as wide as the loss.
        near = _BEYOND * a0
        steps = max(math.ceil(_BEYOND / (_SHARP * self._loss)), math.ceil(near / self._panel))
        middle = np.geomspace(near, self._beyond, 2 + math.ceil(
            2.0 * math.log(self._beyond / near))) if a0 > 0.0 else np.array([0.0, self._beyond])
        fine = [np.linspace(left, right, 1 + math.ceil((right - left) / self._panel))[:-1]
                for left, right in pairwise(middle.tolist())]
        edges = np.concatenate([np.linspace(0.0, near, 1 + steps)[:-1] if a0 > 0.0
                                else np.zeros(0), *fine, [self._beyond]])
        parts = [self._integral(a0, *self._far), self._integral(a0, *self._folded(edges))]
        delay = np.exp(1j * a0 * self._pairs[:, 2] / _SURFACE)
        return np.asarray(sum(parts) * delay[:, None])

    def _integral(
        self, a0: float, k: FloatArray, zeroth: FloatArray, second: FloatArray,
    ) -> ComplexArray:
        rigidity, nu = 1.0 + 1j * self._loss, self._nu
        shear = a0**2 / rigidity
        pressure = shear * (1.0 - 2.0 * nu) / (2.0 * (1.0 - nu))
        alpha, beta = np.sqrt(k**2 - pressure + 0j), np.sqrt(k**2 - shear + 0j)
        if a0 > 0.0:
            # (2 k^2 - s)^2 - 4 k^2 alpha beta, without cancelling at high wavenumbers.
            excess = (pressure * shear - k**2 * (pressure + shear)) / (alpha * beta + k**2)
            rayleigh = shear**2 - 4.0 * k**2 * (shear + excess)
            vertical, radial = (-shear * one / (rigidity * rayleigh) for one in (alpha, beta))
        else:
            vertical = radial = (1.0 - nu) / (rigidity * k)
        across = 1.0 / (rigidity * beta)
        return np.stack([zeroth @ vertical, 0.5 * zeroth @ (radial + across),
                         0.5 * second @ (radial - across)], axis=1)


@dataclass(frozen=True)
class GreenModel:
    """
    Patches on one half-space, each a disc of its area under even traction.

    Attributes
    ----------
    soil : Soil
        Half-space.
    places : tuple of (x, y)
        Middle of each patch [m].
    radii : tuple of float
        Of the disc that stands for each [m].
    table : GreenTable
        Of these, over the first radius.

    """

    soil: Soil
    places: tuple[tuple[float, float], ...]
    radii: tuple[float, ...]
    table: GreenTable

    @classmethod
    def solved(
        cls, soil: Soil, places: tuple[tuple[float, float], ...], radii: tuple[float, ...], *,
        omega_max: float,
    ) -> 'GreenModel':
        """Return the model, solved now for frequencies up to one [rad/s]."""
        if soil.loss_factor < LEAST_LOSS:
            raise RotorSoilError(f'loss_factor must be >= {LEAST_LOSS:g} where patches are '
                                 f'coupled through the ground, got {soil.loss_factor:g}')
        pairs, _ = pairs_of(places, radii)
        return cls(soil, places, radii, GreenTable.solved(
            soil.poisson_ratio, soil.loss_factor, pairs,
            omega_max * radii[0] / soil.shear_wave_speed))

    @property
    def omega_range(self) -> tuple[float, float]:
        """Frequencies that the table covers [rad/s]."""
        return 0.0, self.table.highest * self.soil.shear_wave_speed / self.radii[0]

    def on(self, soil: Soil) -> 'GreenModel':
        """
        Return the same patches on another soil.

        Its G and density are a rescaling; nu and eta stay those of the table.
        """
        return replace(self, soil=replace(
            soil, poisson_ratio=self.soil.poisson_ratio, loss_factor=self.soil.loss_factor))

    @cached_property
    def _pairs(self) -> tuple[FloatArray, IntArray]:
        return pairs_of(self.places, self.radii)

    def compliance(self, omega: FloatArray) -> ComplexArray:
        """
        Return the compliance over x, y, z of every patch, (n, 3 k, 3 k).

        Raises
        ------
        OutOfTableError
            If a frequency is beyond `omega_range`.

        """
        omega = inside(omega, self.omega_range, name='frequency', unit='rad/s',
                       where='where the coupling of patches was solved')
        a0 = omega * self.radii[0] / self.soil.shear_wave_speed
        count = len(self.places)
        _, which = self._pairs
        vertical, mean, difference = np.moveaxis(self.table.at(a0)[:, which], -1, 0) / (
            self.soil.shear_modulus * self.radii[0])
        apart = np.array(self.places)[:, None] - np.array(self.places)
        angle = 2.0 * np.arctan2(apart[..., 1], apart[..., 0])
        total = np.zeros((len(omega), count, 3, count, 3), dtype=complex)
        total[:, :, 0, :, 0] = mean - difference * np.cos(angle)
        total[:, :, 1, :, 1] = mean + difference * np.cos(angle)
        total[:, :, 0, :, 1] = total[:, :, 1, :, 0] = -difference * np.sin(angle)
        total[:, :, 2, :, 2] = vertical
        return total.reshape(len(omega), 3 * count, 3 * count)


def pairs_of(
    places: tuple[tuple[float, float], ...], radii: tuple[float, ...],
) -> tuple[FloatArray, IntArray]:
    """Return the pairs of discs that differ, (u, 3) over the first radius, and which is which."""
    count = len(radii)
    here = np.array(places)
    own = np.array(radii) / radii[0]
    distance = np.hypot(*np.moveaxis(here[:, None] - here, -1, 0)) / radii[0]
    both = np.sort(np.stack(np.broadcast_arrays(own[:, None], own), axis=-1), axis=-1)
    every = np.concatenate([both, distance[..., None]], axis=-1).reshape(-1, 3)
    found, which = np.unique(np.round(every, 9), axis=0, return_inverse=True)
    return found, which.reshape(count, count)
