"""At which frequencies a wave of the layers begins to travel, so that nothing there is smooth."""

from collections.abc import Iterator
import itertools
import math

import numpy as np
import scipy.linalg

from rotorsoil_ros.arrays import FloatArray
from rotorsoil_ros.ground.layers.line import LineMatrices, LineMesh, VerticalLine
from rotorsoil_ros.ground.layers.profile import Embedment, LayeredSoil
from rotorsoil_ros.ground.soil import Soil

# What lies this much stiffer below acts as rock: impedance rho c_s over that above.
_LIKE_ROCK = 3.0

# Wavenumbers times the depth of the layers, where branches of waves may turn back.
_WAVENUMBERS = np.linspace(0.0, 8.0, 161)

# Frequencies closer than this share of themselves are one.
_SAME = 1e-2

# No grading: the waves are smooth, and so few elements give them to 1e-4.
_MESH = LineMesh(smallest=1.0, per_wave=0.5)


def singular_frequencies(ground: LayeredSoil, highest: float) -> FloatArray:
    """
    Return where the compliance of layered ground has a branch point beside the real axis.

    Parameters
    ----------
    ground : LayeredSoil
        Layers; on a half-space that is not much stiffer than all of them there are none.
    highest : float
        Up to which frequency.

    Returns
    -------
    (m,) float array
        Rising: cut-offs, which are the eigenfrequencies of columns of soil, and the frequencies
        at which a wave has a group velocity of zero but a wavenumber that is not.

    References
    ----------
    Prada, Clorennec & Royer (2008), Local vibration of an elastic plate and zero-group velocity
    Lamb modes, J. Acoust. Soc. Am. 124, 203-212, of waves of zero group velocity.

    """
    depth = _rock_depth(ground)
    if depth is None:
        return np.zeros(0)
    line = _elastic(ground.on_rock(depth), highest)
    found = np.sort([*_of_columns(line), *_of_turning_waves(line, depth)])
    found = found[(found > 0.0) & (found < highest)]
    fresh = np.diff(found, prepend=-math.inf) > _SAME * np.abs(found)
    return np.asarray(found[fresh])


def _rock_depth(ground: LayeredSoil) -> float | None:
    """Return the depth of rock, or of what acts as rock; None where nothing does."""
    if ground.below is None:
        return ground.depth

    def impedance(soil: Soil) -> float:
        return soil.density * soil.shear_wave_speed

    soils = ground.soils
    contrasts = [impedance(lower) / impedance(upper)
                 for upper, lower in itertools.pairwise(soils)]
    if max(contrasts, default=0.0) < _LIKE_ROCK:
        return None
    return ground.interfaces[int(np.argmax(contrasts))]


def _elastic(ground: LayeredSoil, highest: float) -> LineMatrices:
    """Return the real matrices of the layers without damping."""
    thinnest = min(layer.thickness for layer in ground.layers)
    line = VerticalLine.through(ground, Embedment(), radius=max(thinnest, 0.1 * ground.depth),
                                lowest=highest, highest=highest, mesh=_MESH).outside
    return LineMatrices(*(getattr(line, name).real for name in (
        'v_mu', 'v_lambda', 'v_rho', 'd_mu', 'd_lambda', 'e_mu', 'e_lambda')))


def _of_columns(line: LineMatrices) -> Iterator[float]:
    """Yield the eigenfrequencies of a column that shears, and of one that is compressed."""
    for stiffness in (line.d_mu, line.d_lambda + 2.0 * line.d_mu):
        square = scipy.linalg.eigh(stiffness, line.v_rho, eigvals_only=True)
        yield from np.sqrt(np.maximum(square, 0.0)).tolist()


def _of_turning_waves(line: LineMatrices, depth: float) -> Iterator[float]:
    """Yield minima of the branches omega(k) of waves in the plane of motion, at k > 0."""
    k = _WAVENUMBERS / depth
    size = len(line.v_mu)
    square = (k**2)[:, None, None]
    matrix = np.zeros((len(k), 2 * size, 2 * size))
    matrix[:, :size, :size] = square * (line.v_lambda + 2.0 * line.v_mu) + line.d_mu
    matrix[:, size:, size:] = square * line.v_mu + line.d_lambda + 2.0 * line.d_mu
    matrix[:, :size, size:] = k[:, None, None] * (line.e_mu.T - line.e_lambda)
    matrix[:, size:, :size] = matrix[:, :size, size:].swapaxes(1, 2)
    root = np.kron(np.eye(2), np.linalg.cholesky(line.v_rho))
    of_unit_mass = np.linalg.solve(root, np.linalg.solve(root, matrix).swapaxes(1, 2))
    branch = np.sqrt(np.maximum(np.linalg.eigvalsh(of_unit_mass), 0.0))
    left, middle, right = branch[:-2], branch[1:-1], branch[2:]
    for at, number in zip(*np.nonzero((middle < left) & (middle < right)), strict=True):
        before, here, after = (part[at, number] for part in (left, middle, right))
        # The vertex of the parabola through three neighbours.
        yield float(here - 0.125 * (after - before) ** 2 / (before - 2.0 * here + after))
