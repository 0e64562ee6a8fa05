"""Which waves travel along the layers at a frequency, outward or standing below the base."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from rotorsoil_ros.arrays import ComplexArray
from rotorsoil_ros.ground.layers.line import LineMatrices

# Waves that decay by less than this share of their wavenumber are told by their energy: where a
# tail ends the ground, whose error may push them across the real axis, and above rock, where only
# round-off may. Close to a cut-off energy and decay disagree, and decay is right.
_TRAVELS, _TRAVELS_ABOVE_ROCK = 0.1, 1e-6

# A backward wave lies just below the cut of the Hankel function, by this share of itself.
_BELOW_CUT = 1e-13


@dataclass(frozen=True, slots=True, eq=False)
class Waves:
    """
    Waves exp(-i k x) of the layers.

    Attributes
    ----------
    k : (2 n,) complex array
        Wavenumbers of waves in the plane of motion.
    u, w : (n, 2 n) complex arrays
        Their shape over the depth: along the way, times -i, and downward.
    q : (n,) complex array
        Wavenumbers of waves across.
    v : (n, n) complex array
        Their shape.

    """

    k: ComplexArray
    u: ComplexArray
    w: ComplexArray
    q: ComplexArray
    v: ComplexArray


@dataclass(frozen=True, eq=False)
class WavePencil:
    """
    Eigenproblems of the waves, linear in the square of the wavenumber.

    Attributes
    ----------
    line : LineMatrices
        Layers between their ends; what is held is left out.
    above_rock : bool
        Whether they end on rock, not in a tail.

    References
    ----------
    Kausel (1981), An explicit solution for the Green functions for dynamic loads in layered
    media, MIT R81-13; Waas (1972), Linear two-dimensional analysis of soil dynamics problems in
    semi-infinite layer media, Berkeley.

    """

    line: LineMatrices
    above_rock: bool = False

    @cached_property
    def along(self) -> ComplexArray:
        """Weight A_x of k^2 on motion along the way, int (lambda + 2 mu) N N^T."""
        return self.line.v_lambda + 2.0 * self.line.v_mu

    @cached_property
    def coupling(self) -> ComplexArray:
        """What joins motion along the way and downward, of k, int mu N' N^T - lambda N N'^T."""
        return self.line.e_mu.T - self.line.e_lambda

    @cached_property
    def _in_plane(self) -> tuple[ComplexArray, ComplexArray]:
        """Return matrices whose sum, the second times omega^2, has eigenvalues k^2."""
        line, size = self.line, len(self.line.v_mu)
        weight = np.zeros((2 * size, 2 * size), dtype=complex)
        weight[:size, :size], weight[size:, size:] = self.along, line.v_mu
        weight[size:, :size] = self.coupling.T
        static, inertia = np.zeros_like(weight), np.zeros_like(weight)
        static[:size, :size], static[:size, size:] = -line.d_mu, -self.coupling
        static[size:, size:] = -(line.d_lambda + 2.0 * line.d_mu)
        inertia[:size, :size] = inertia[size:, size:] = line.v_rho
        both = np.linalg.solve(weight, np.concatenate([static, inertia], axis=1))
        return both[:, :2 * size], both[:, 2 * size:]

    @cached_property
    def _across(self) -> tuple[ComplexArray, ComplexArray]:
        size = len(self.line.v_mu)
        both = np.linalg.solve(self.line.v_mu, np.concatenate(
            [-self.line.d_mu, self.line.v_rho], axis=1))
        return both[:, :size], both[:, size:]

    def standing(self, omega: float) -> Waves:
        """Return the waves of a frequency; which way they go does not matter."""
        size = len(self.line.v_mu)
        static, inertia = self._in_plane
        square, shape = np.linalg.eig(static + omega**2 * inertia)
        k = np.sqrt(square)
        static, inertia = self._across
        square, v = np.linalg.eig(static + omega**2 * inertia)
        return Waves(k, shape[:size], shape[size:] / k, np.sqrt(square), v)

    def outgoing(self, omega: float) -> Waves:
        """
        Return the waves of a frequency that carry energy outward, or decay.

        Notes
        -----
        Below a cut-off the phase of some waves runs inward while their energy runs outward, and
        a half-space cut off far below pushes others a little across the real axis. So of waves
        that hardly decay the sign of dk / domega decides, by the complex symmetric pencil.

        """
        found = self.standing(omega)
        line, k = self.line, found.k
        mass = (found.u * (line.v_rho @ found.u) + found.w * (line.v_rho @ found.w)).sum(axis=0)
        change = 2.0 * omega * mass / (
            2.0 * k * (found.u * (self.along @ found.u)
                       + found.w * (line.v_mu @ found.w)).sum(axis=0)
            + 2.0 * (found.u * (self.coupling @ found.w)).sum(axis=0))
        travels = _TRAVELS_ABOVE_ROCK if self.above_rock else _TRAVELS
        inward = np.where(np.abs(k.imag) < travels * np.abs(k.real), change.real < 0.0,
                          k.imag > 0.0)
        sign = np.where(inward, -1.0, 1.0)
        q = found.q
        across = np.where(np.abs(q.imag) < travels * np.abs(q.real), q.real < 0.0, q.imag > 0.0)
        return Waves(_below_cut(k * sign), found.u, found.w * sign,
                     _below_cut(np.where(across, -q, q)), found.v)


def _below_cut(k: ComplexArray) -> ComplexArray:
    """Return wavenumbers moved off the cut of the Hankel function, if they lie on it."""
    moved = k.real + 1j * np.minimum(k.imag, -_BELOW_CUT * np.abs(k))
    return np.where(k.real < 0.0, moved, k)
