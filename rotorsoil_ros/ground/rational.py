"""Rational functions through samples at real frequencies, with common poles."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy.linalg

from rotorsoil_ros.arrays import BoolArray, ComplexArray, FloatArray

# A fit ends when every sample is met this well, relative to the diagonal of its matrix ...
_TOLERANCE = 1e-12
_MOST_NODES = 40

# ... or when so many more nodes make a fair fit less than ten times better: what is left is the
# rounding of a printed table, and following it would put poles where there are none.
_MORE_NODES = 4
_FAIR = 1e-2
_ROUGH = 1e-4

# Poles closer to a node than this share of the highest lie on it.
_ON_A_NODE = 1e-14

# Stands for the distance to a node that is hit: small, yet its inverse is finite.
_ON_NODE = 1e-150

# A fit is continued unless it has poles below the real axis by this share of the highest sample,
# or low ones of less damping than this, nearer to zero than so many times that sample; or unless
# it grows beyond so many times its samples. Low are peaks of less than the last, a few percent of
# noise.
_ON_AXIS = 1e-3
_NARROW = 0.3
_NEAR = 3.0
_BOUND = 1e3
_LOW_PEAK = 0.1

# A pole of less real part, as a share of itself, is at a negative frequency: what creeps is not.
_CREEPING = 0.2

# Poles this many times higher than all samples are constants.
_FAR = 1e6


@dataclass(frozen=True, slots=True)
class States:
    """
    Matrix function constant + left (omega - poles)^-1 right.

    Attributes
    ----------
    constant, poles, left, right : (d, d), (s,), (d, s), (s, d) complex arrays
        Of s first-order states.

    """

    constant: ComplexArray
    poles: ComplexArray
    left: ComplexArray
    right: ComplexArray

    def __call__(self, omega: ComplexArray) -> ComplexArray:
        """Return the function at real or complex frequencies, (..., d, d)."""
        gains = 1.0 / (omega[..., None] - self.poles)
        return np.asarray(self.constant + (self.left * gains[..., None, :]) @ self.right)

    def over(self, size: FloatArray) -> 'States':
        """Return the function over sizes (d,) of its rows and of its columns."""
        return States(self.constant / (size[:, None] * size), self.poles,
                      self.left / size[:, None], self.right / size)

    @property
    def height(self) -> FloatArray:
        """Size of the largest entry of each term, times the distance to its pole, (s,)."""
        return np.asarray(np.abs(self.left).max(axis=0, initial=0.0)
                          * np.abs(self.right).max(axis=1, initial=0.0))

    def states(self, tolerance: float) -> 'States':
        """Return the same, terms below the tolerance at real frequencies left out."""
        return self.of(self.height > tolerance * np.abs(self.poles.imag))

    def of(self, kept: BoolArray) -> 'States':
        """Return the same with some of the terms only."""
        return States(self.constant, self.poles[kept], self.left[:, kept], self.right[kept])

    def beside(self, constant: ComplexArray) -> 'States':
        """Return the same with motions behind it that give way by constants, (k,)."""
        count = len(constant)
        return States(
            scipy.linalg.block_diag(self.constant, np.diag(constant)), self.poles,
            np.concatenate([self.left, np.zeros((count, len(self.poles)))]),
            np.concatenate([self.right, np.zeros((len(self.poles), count))], axis=1))


@dataclass(frozen=True)
class RationalMatrix:
    """
    Matrix function in barycentric form, the same denominator under every entry.

    Attributes
    ----------
    nodes : (m,) float array
        Frequencies at which it is exact [rad/s].
    values : (m, d, d) complex array
        Function at the nodes.
    weights : (m,) complex array
        Of the barycentric form.

    References
    ----------
    Nakatsukasa, Sete & Trefethen (2018), The AAA algorithm for rational approximation, SIAM
    J. Sci. Comput. 40; Lietaert et al. (2022), Automatic rational approximation and
    linearization of nonlinear eigenvalue problems, IMA J. Numer. Anal. 42, for functions with
    a common denominator.

    """

    nodes: FloatArray
    values: ComplexArray
    weights: ComplexArray

    @classmethod
    def of(
        cls, omega: FloatArray, values: ComplexArray, within: tuple[float, float],
    ) -> 'RationalMatrix':
        """Fit samples (n, d, d) at ascending frequencies (n,), as `continues` has them."""
        entries = values.reshape(len(omega), -1)
        chosen, fits = _greedy(omega, entries, np.ones(entries.shape),
                               min(_MOST_NODES, len(omega) // 2), _is_enough)
        errors = [worst for worst, _ in fits]
        enough = _TOLERANCE if min(errors) <= _TOLERANCE else max(_ROUGH, 10.0 * min(errors))
        most = next(count for count, worst in enumerate(errors, 1) if worst <= enough)
        tried = [cls(omega[chosen[:count]], values[chosen[:count]], fits[count - 1][1])
                 for count in range(1, most + 1)]
        is_exact = errors[most - 1] <= _TOLERANCE
        if tried[-1].continues(omega, within, is_exact=is_exact):
            return tried[-1]
        # The table follows no law that could be continued: noise, or too few points. The best
        # one that may, if only a constant, leaves the rest to what is known at real frequencies.
        sound = [(worst, fit) for worst, fit in zip(errors, tried, strict=False)
                 if fit.continues(omega, within)]
        return min(sound, key=lambda pair: pair[0])[1]

    @classmethod
    def roughly(
        cls, omega: FloatArray, values: ComplexArray, tolerance: float,
    ) -> 'RationalMatrix':
        """Fit samples (n, d, d) by as few nodes as an error of all of them allows."""
        entries = values.reshape(len(omega), -1)
        chosen, fits = _greedy(omega, entries, np.ones(entries.shape),
                               min(_MOST_NODES, len(omega) // 2),
                               lambda errors: bool(errors) and errors[-1] <= tolerance)
        return cls(omega[chosen], values[chosen], fits[-1][1])

    def continues(
        self, omega: FloatArray, within: tuple[float, float], *, is_exact: bool = False,
    ) -> bool:
        """
        Return whether the fit may stand for a passive support at complex frequencies.

        Samples (n,) [rad/s] that are noisy put poles among growing vibrations, which no cause
        has, or low and narrow peaks anywhere; those of a polynomial, as a spline through few
        points is one, leave no bound at infinity. Each is a fit to the samples alone. Only what
        vibrates within two frequencies counts: hysteretic damping, which turns its sign with the
        frequency, has a growing mirror image of every sharp pole at negative ones. A fit that
        `is_exact` follows no noise: it may have such images too, and peaks beyond its samples,
        as ground with delays between its patches has.
        """
        if not np.all(np.isfinite(self.weights)) or not self.weights.sum():
            return False
        found = self.states(_ROUGH)
        decay = found.poles.imag / omega[-1]
        narrow = np.abs(found.poles.imag) < _NARROW * np.abs(found.poles)
        low = narrow & (found.height < _LOW_PEAK * np.abs(found.poles.imag))
        if is_exact:
            low &= found.poles.real < omega[-1]
        noise = (decay < -_ON_AXIS) | low
        noise &= (found.poles.real > within[0]) & (found.poles.real < within[1])
        noise &= np.abs(found.poles) < _NEAR * omega[-1]
        if is_exact:
            noise &= found.poles.real > -_CREEPING * np.abs(found.poles)
        return not noise.any() and bool(np.abs(found.constant).max(initial=0.0) < _BOUND)

    def __call__(self, omega: ComplexArray) -> ComplexArray:
        """Return the function at real or complex frequencies, (..., d, d)."""
        gap = omega[..., None] - self.nodes
        cauchy = self.weights / np.where(gap == 0.0, _ON_NODE, gap)
        values = cauchy @ self.values.reshape(len(self.nodes), -1)
        values /= cauchy.sum(axis=-1)[..., None]
        return np.asarray(values.reshape(*omega.shape, *self.values.shape[1:]))

    def over(self, size: FloatArray) -> 'RationalMatrix':
        """Return the function over sizes (d,) of its rows and of its columns."""
        return replace(self, values=self.values / (size[:, None] * size))

    def partial_fractions(self) -> tuple[ComplexArray, ComplexArray]:
        """Return poles (s,) and the residues of all entries, (s, d d)."""
        count = len(self.nodes)
        arrow = np.zeros((count + 1, count + 1), dtype=complex)
        arrow[0, 1:], arrow[1:, 0] = self.weights, 1.0
        arrow[1:, 1:] = np.diag(self.nodes)
        poles = scipy.linalg.eigvals(arrow, np.diag([0.0] + [1.0] * count))
        poles = poles[np.isfinite(poles) & (np.abs(poles) < _FAR * self.nodes.max())]
        # A node without weight is a pole without height.
        apart = np.abs(poles[:, None] - self.nodes).min(axis=1, initial=np.inf)
        poles = poles[apart > _ON_A_NODE * self.nodes.max()]
        cauchy = 1.0 / (poles[:, None] - self.nodes)
        flat = self.values.reshape(count, -1)
        return poles, (cauchy * self.weights) @ flat / -(cauchy**2 @ self.weights)[:, None]

    def states(self, tolerance: float) -> States:
        """Return the function by its poles, terms below the tolerance left out."""
        count, size, _ = self.values.shape
        poles, residues = self.partial_fractions()
        flat = self.values.reshape(count, -1)
        left, terms, right = np.linalg.svd(residues.reshape(-1, size, size))
        reach = np.abs(poles[:, None] - self.nodes).min(axis=1, initial=np.inf)
        pole, term = np.nonzero(terms > tolerance * reach[:, None])
        constant = (self.weights @ flat / self.weights.sum()).reshape(size, size)
        return States(constant, poles[pole], left[pole, :, term].T * terms[pole, term],
                      right[pole, term])


def interpolant(omega: FloatArray, values: ComplexArray, **limits: Any) -> RationalMatrix:
    """Return the last of `interpolants`."""
    return interpolants(omega, values, **limits)[-1][1]


def interpolants(
    omega: FloatArray, values: ComplexArray, *, scale: FloatArray, most: int, tolerance: float,
) -> list[tuple[float, RationalMatrix]]:
    """
    Return rational functions with common poles through 1, 2, ... samples, close to all others.

    Parameters
    ----------
    omega : (n,) float array
        Frequencies, ascending.
    values : (n, q) complex array
        Samples of q functions.
    scale : (n, q) float array
        What an error is measured against.
    most : int
        Number of nodes at most, less than n.
    tolerance : float
        Error of all samples that needs no further node: one more would follow round-off.

    Returns
    -------
    list of (float, RationalMatrix)
        Each with its error.

    """
    chosen, fits = _greedy(omega, values, scale, most,
                           lambda errors: bool(errors) and errors[-1] <= tolerance)
    return [(worst, RationalMatrix(omega[chosen[:count]], values[chosen[:count]], weights))
            for count, (worst, weights) in enumerate(fits, 1)]


def _greedy(
    omega: FloatArray, entries: ComplexArray, scale: FloatArray, most: int,
    is_enough: Callable[[list[float]], bool],
) -> tuple[list[int], list[tuple[float, ComplexArray]]]:
    """Return nodes in the order of their choice, and error and weights of 1, 2, ... of them."""
    error = (np.abs(entries - entries.mean(axis=0)) / scale).max(axis=1)
    chosen: list[int] = []
    fits: list[tuple[float, ComplexArray]] = []
    while len(fits) < most and not is_enough([worst for worst, _ in fits]):
        chosen.append(int(error.argmax()))
        rest = np.delete(np.arange(len(omega)), chosen)
        cauchy = 1.0 / (omega[rest, None] - omega[chosen])
        loewner = (entries[rest, None, :] - entries[chosen]) * cauchy[..., None]
        loewner /= scale[rest][:, None, :]
        weights = _smallest(loewner.transpose(0, 2, 1).reshape(-1, len(chosen)))
        error = np.zeros(len(omega))
        error[rest] = (np.abs(
            (cauchy * weights) @ entries[chosen] / (cauchy @ weights)[:, None]
            - entries[rest]) / scale[rest]).max(axis=1)
        fits.append((float(error.max()), weights))
    return chosen, fits


def _is_enough(errors: list[float]) -> bool:
    """Return whether a fit that had these errors with 1, 2, 3 ... nodes should end."""
    if not errors:
        return False
    stuck = len(errors) > _MORE_NODES and errors[-1] > 0.1 * errors[-1 - _MORE_NODES]
    return errors[-1] <= _TOLERANCE or (stuck and errors[-1] < _FAIR)


def _smallest(matrix: ComplexArray) -> ComplexArray:
    """Return the right singular vector of the smallest singular value."""
    reduced = np.linalg.qr(matrix, mode='r')
    _, _, right = np.linalg.svd(reduced)
    return np.asarray(right[-1].conj())
