"""How a place on the surface answers a force at another, for all directions."""

from typing import Protocol, TypeAlias

import numpy as np

from rotorsoil_ros.arrays import ComplexArray, FloatArray
from rotorsoil_ros.ground.boundary.statics import static_kernels

# Motion and force that a kernel joins, axes x, y, z (down); the others follow from reciprocity.
PAIRS = ('xx', 'yy', 'zz', 'xy', 'xz', 'yz')
# Which of them change their sign with x, and with y.
ODD = {'xx': (False, False), 'yy': (False, False), 'zz': (False, False), 'xy': (True, True),
       'xz': (True, False), 'yz': (False, True)}

WaveKernels: TypeAlias = dict[str, ComplexArray]


class SwingingWaves(Protocol):
    """What a ground does at one frequency beyond what its top material does at rest."""

    @property
    def poisson_ratio(self) -> float:
        """Of the material at the surface [-]."""
        ...

    @property
    def loss_factor(self) -> float:
        """Of the material at the surface [-]."""
        ...

    @property
    def wavenumber(self) -> complex:
        """Of its shear waves, k_s, per unit of length."""
        ...

    def __call__(self, distance: FloatArray) -> ComplexArray:
        """Return k_s times what is in `SurfaceWaves`, up, alike, turned, pulled, (..., 4)."""
        ...


class GroundWaves(Protocol):
    """A ground at any frequency."""

    @property
    def poisson_ratio(self) -> float:
        """Of the material at the surface [-]."""
        ...

    @property
    def loss_factor(self) -> float:
        """Of the material at the surface [-]."""
        ...

    def at(self, a0: float) -> SwingingWaves:
        """Return its waves at a frequency, omega times the unit of length over c_s."""
        ...


def wave_kernels(waves: SwingingWaves, x: FloatArray, y: FloatArray) -> WaveKernels:
    """
    Return 2 pi q times the motion by waves, G = rho = 1 at the surface.

    Parameters
    ----------
    waves : SwingingWaves
        Of the ground at one frequency.
    x, y : float arrays that broadcast
        From the force to the place that moves; nothing is returned for no distance.

    """
    r = np.hypot(x, y)
    apart = r > 0.0
    safe = np.where(apart, r, 1.0)
    c, s = x / safe, y / safe
    up, alike, apart_turned, pulled = np.moveaxis(waves(r) * apart[..., None], -1, 0)
    turned = apart_turned * (c**2 - s**2)
    return {'xx': alike + turned, 'yy': alike - turned, 'zz': up,
            'xy': 2.0 * apart_turned * c * s, 'xz': pulled * c, 'yz': pulled * s}


def assembled(kernels: WaveKernels) -> ComplexArray:
    """Return motion by force over (x, y, z) of all places, (3 p, 3 n), from kernels (p, n)."""
    return np.block([
        [kernels['xx'], kernels['xy'], kernels['xz']],
        [kernels['xy'], kernels['yy'], kernels['yz']],
        [-kernels['xz'], -kernels['yz'], kernels['zz']]])


def motion_by_forces(
    waves: SwingingWaves, places: FloatArray, nodes: FloatArray,
) -> ComplexArray:
    """
    Return how places move under forces on the surface, G = rho = 1 there.

    Parameters
    ----------
    waves : SwingingWaves
        Of the ground at one frequency.
    places, nodes : (p, 2), (n, 2) float arrays
        x and y of what moves and of the forces; no place on a node.

    Returns
    -------
    (3 p, 3 n) complex array
        Over x of all, y of all, z (down) of all.

    """
    x, y = np.moveaxis(places[:, None] - nodes, -1, 0)
    r = np.hypot(x, y)
    at_rest = static_kernels(waves.poisson_ratio, {
        'r': 1.0 / r, 'xx': x**2 / r**3, 'xy': x * y / r**3, 'x': x / r**2, 'y': y / r**2})
    swinging = wave_kernels(waves, x, y)
    return assembled({pair: at_rest[pair] + swinging[pair] for pair in PAIRS}) / (
        2.0 * np.pi * (1.0 + 1j * waves.loss_factor))


def upwards(motion: ComplexArray, points: int) -> ComplexArray:
    """Return motion of points along x, y, z up, (p, 3, d), from x, y of all, z down, (3 p, d)."""
    found: ComplexArray = motion.reshape(3, points, motion.shape[1]) * np.array(
        [1.0, 1.0, -1.0])[:, None, None]
    return found.transpose(1, 0, 2)
