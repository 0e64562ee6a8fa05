"""How the surface of layered ground moves under a point force that swings."""

from dataclasses import dataclass
import math

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.special import hankel2e

from rotorsoil_ros.arrays import ComplexArray, FloatArray
from rotorsoil_ros.ground.boundary.waves import static_integrals, SurfaceWaves, WavesAt
from rotorsoil_ros.ground.layers.line import LineMesh, VerticalLine
from rotorsoil_ros.ground.layers.profile import LayeredSoil, SURFACE
from rotorsoil_ros.ground.layers.waves import WavePencil, Waves

# Elements along the depth: the surface is where forces act.
_MESH = LineMesh(smallest=0.03, ratio=0.5)

# What layers add to a half-space of the uppermost of them is smooth: steps of a spline over the
# distance, of the thickness of the uppermost and of the slowest wave over 2 pi; that thickness
# matters up to so many times itself; at least so many steps.
_OF_THICKNESS, _OF_WAVE = 0.3, 0.3
_NEAR = 8.0
_LEAST_STEPS = 16


@dataclass(frozen=True, slots=True, eq=False)
class LayeredWaves:
    """
    Surface motion by a force on layers of which the uppermost has G = rho = 1.

    Attributes
    ----------
    ground : LayeredSoil
        Layers, in units of length of the site.
    distances : (n,) float array
        Where what layers add is computed, rising from the first beside the force: the same at all
        frequencies, so that the motion is as smooth a function of them as the waves are.
    pencil : WavePencil
        Of their waves.
    top : SurfaceWaves
        Of a half-space of the uppermost layer.

    Notes
    -----
    A force on the surface excites all waves of the layers, each by what it moves there, as
    Hankel functions of the distance. Of that the motion of a half-space of the uppermost layer is
    taken, which is known in closed form at rest and better than any elements beyond: what is left
    are reflections, without any singularity at the force.

    References
    ----------
    Kausel (1981), An explicit solution for the Green functions for dynamic loads in layered
    media, MIT R81-13.

    """

    ground: LayeredSoil
    distances: FloatArray
    pencil: WavePencil
    top: SurfaceWaves

    @classmethod
    def of(
        cls, ground: LayeredSoil, reach: float, *, lowest: float, highest: float,
    ) -> 'LayeredWaves':
        """Prepare for distances up to a reach and frequencies between two, each > 0."""
        line = VerticalLine.through(ground, SURFACE, radius=1.0, lowest=lowest, highest=highest,
                                    mesh=_MESH)
        soil = ground.soils[0]
        even = SurfaceWaves.of(soil.poisson_ratio, soil.loss_factor, 1.01 * highest * reach)
        return cls(ground, _distances(ground, reach, highest),
                   WavePencil(line.outside, line.above_rock), even)

    @property
    def poisson_ratio(self) -> float:
        """Of the uppermost layer [-]."""
        return self.top.poisson_ratio

    @property
    def loss_factor(self) -> float:
        """Of the uppermost layer [-]."""
        return self.top.loss_factor

    @property
    def nodes(self) -> int:
        """Nodes over the depth."""
        return len(self.pencil.line.v_mu)

    def at(self, a0: float) -> 'LayeredWavesAt':
        """Return the waves at a frequency, omega times the unit of length over c_s at the top."""
        even, r = self.top.at(a0), self.distances
        added = (1.0 + 1j * self.loss_factor) * _motion(
            self.pencil, self.pencil.outgoing(a0), r)
        added -= even(r)
        added -= static_integrals(self.poisson_ratio, r.astype(complex))
        # At the force, where what layers add is even in the distance, or vanishes.
        origin = np.linalg.solve(np.vander(r[:3] ** 2, increasing=True), added[:3])[0]
        origin[2:] = 0.0
        return LayeredWavesAt(even, CubicSpline(
            np.append(0.0, r), np.concatenate([origin[None], added])))


@dataclass(frozen=True, slots=True, eq=False)
class LayeredWavesAt:
    """Waves of layered ground at one frequency: those of a half-space, and what layers add."""

    even: WavesAt
    added: CubicSpline

    @property
    def poisson_ratio(self) -> float:
        """Of the uppermost layer [-]."""
        return self.even.poisson_ratio

    @property
    def loss_factor(self) -> float:
        """Of the uppermost layer [-]."""
        return self.even.loss_factor

    @property
    def wavenumber(self) -> complex:
        """Of shear waves in the uppermost layer, per unit of length."""
        return self.even.wavenumber

    def __call__(self, distance: FloatArray) -> ComplexArray:
        """Return 2 pi q times the motion beyond that at rest, as `WavesAt`, (..., 4)."""
        found: ComplexArray = self.even(distance) + self.added(distance)
        return found


def _distances(ground: LayeredSoil, reach: float, highest: float) -> FloatArray:
    slowest = min(soil.shear_wave_speed for soil in ground.soils)
    coarse = min(_OF_WAVE * slowest / highest, reach / _LEAST_STEPS)
    thickness = ground.layers[0].thickness if ground.layers else math.inf
    fine = min(_OF_THICKNESS * thickness, coarse)
    near = np.arange(1, math.ceil(min(_NEAR * thickness, reach) / fine) + 1) * fine
    count = max(math.ceil((reach - near[-1]) / coarse), 0)
    return np.concatenate([near, near[-1] + coarse * np.arange(1, count + 1)])


def _motion(pencil: WavePencil, waves: Waves, r: FloatArray) -> ComplexArray:
    """
    Return 2 pi times the motion of the surface, up, alike, turned and pulled, (n, 4).

    Over all poles k_j of the motion by a load exp(-i k x): the integral of k J_0(k r) /
    (k^2 - k_j^2) over k is K_0(i k_j r), with J_1 and k^2 it is i k_j K_1, and what with J_2 is
    more than -K_2 cancels between both kinds of waves, which are one at k = 0.
    """
    line, k = pencil.line, waves.k
    # Left eigenvectors are (k u, w) to right ones (u, k w).
    own = (k * (waves.u * (pencil.along @ waves.u) + waves.w * (line.v_mu @ waves.w)).sum(axis=0)
           + (waves.u * (pencil.coupling @ waves.w)).sum(axis=0))
    u, w = waves.u[0], waves.w[0]
    across = waves.v[0] ** 2 / (waves.v * (line.v_mu @ waves.v)).sum(axis=0)
    zero, one, two = _modified(np.outer(r, k))
    zero_across, _, two_across = _modified(np.outer(r, waves.q))
    along = k * u**2 / own
    return np.stack([
        zero @ (k * w**2 / own), 0.5 * (zero @ along + zero_across @ across),
        0.5 * (two @ along - two_across @ across), -one @ (1j * k * u * w / own)], axis=-1)


def _modified(argument: ComplexArray) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
    """Return K_0, K_1 and K_2 of i times an argument."""
    decay = 0.5 * math.pi * np.exp(-1j * argument)
    zero, one = hankel2e(0, argument) * decay, hankel2e(1, argument) * decay
    return -1j * zero, -one, 1j * (2.0 * one / argument - zero)
