"""How a compliance that is known at real frequencies continues to decaying vibration."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy.linalg
from scipy.sparse.csgraph import connected_components

from rotorsoil_ros.arrays import BoolArray, ComplexArray, FloatArray, IntArray

# A fit ends when every sample is met this well, relative to the diagonal of its matrix ...
_TOLERANCE = 1e-12
_MOST_NODES = 40

# ... or when so many more nodes make a fair fit less than ten times better: what is left is the
# rounding of a printed table, and following it would put poles where there are none.
_MORE_NODES = 4
_FAIR = 1e-2
_ROUGH = 1e-4

# Fits worse than this are corrected by what they miss at the real frequency of a vibration.
_EXACT = 1e-9

# Two fits that differ less, relative to the largest entry, say the same.
_AGREED = 1e-2

# What a fit misses may change by so much within the bandwidth of a vibration: a measured table
# has a few percent of noise.
_STEADY = 0.1

# Two fits may differ by so many times what one of them misses.
_SPREAD = 4.0

# Where in the half bandwidth of a vibration a rough fit is corrected.
_BANDWIDTH = (-1.0, -0.5, 0.0, 0.5, 1.0)

# Entries that stay below this share of their diagonal are round-off.
_UNCOUPLED = 1e-10

# Poles closer to a node than this share of the highest lie on it.
_ON_A_NODE = 1e-14

# Stands for the distance to a node that is hit: small, yet its inverse is finite.
_ON_NODE = 1e-150

# A fit is continued unless it has poles below the real axis by this share of the highest sample,
# or low ones of less damping than this, nearer to zero than so many times that sample; or unless
# it grows beyond so many times its samples.
_ON_AXIS = 1e-3
_NARROW = 0.3
_NEAR = 3.0
_BOUND = 1e3

# Poles this many times higher than all samples are constants.
_FAR = 1e6


@dataclass(frozen=True)
class Continuation:
    """
    Matrix function of frequency, continued part by part.

    Attributes
    ----------
    parts : tuple of (indices, RationalMatrix)
        What does not couple is fitted by itself, so that no part has poles of another.
    size : (d,) float array
        Typical square root of the diagonal, which makes the entries comparable.
    others : tuple of (indices, RationalMatrix)
        The same from every other sample.
    known : callable or None
        The function at real frequencies (n,), where the fit is too rough; else None.
    span : tuple of two floats
        Where it is known [rad/s].
    missed : float
        Most that the fit misses of a sample.

    """

    parts: tuple[tuple[IntArray, 'RationalMatrix'], ...]
    others: tuple[tuple[IntArray, 'RationalMatrix'], ...]
    size: FloatArray
    known: Callable[[FloatArray], ComplexArray] | None
    span: tuple[float, float]
    missed: float

    @classmethod
    def of(
        cls, omega: FloatArray, known: Callable[[FloatArray], ComplexArray],
        size: FloatArray | None = None,
        other: Callable[[FloatArray], ComplexArray] | None = None,
        within: tuple[float, float] = (-np.inf, np.inf),
    ) -> 'Continuation':
        """
        Fit a function.

        Parameters
        ----------
        omega : (n,) float array
            Frequencies at which it is sampled, ascending [rad/s].
        known : callable
            From real frequencies (n,) to matrices (n, d, d).
        size : (d,) float array, optional
            As the attribute, where several continuations have to share it.
        other : callable, optional
            A second opinion on the function, in place of its own every other sample.
        within : tuple of two floats
            Frequencies between which it has to stand for something passive [rad/s].

        """
        values = known(omega)
        if size is None:
            size = typical_size(values)
        values = values / (size[:, None] * size)
        couples = np.abs(values).max(axis=0, initial=0.0) > _UNCOUPLED
        _, labels = connected_components(couples, directed=False)
        groups = [np.flatnonzero(labels == label) for label in np.unique(labels)]
        second = values[::2] if other is None else other(omega[::2]) / (size[:, None] * size)
        parts, others = (
            tuple((index, RationalMatrix.of(places, samples[:, index[:, None], index], within))
                  for index in groups)
            for places, samples in ((omega, values), (omega[::2], second)))
        fit = cls(parts, others, size, None, (float(omega[0]), float(omega[-1])), 0.0)
        missed = float(np.abs(fit(omega.astype(complex)) - values).max(initial=0.0))
        return replace(fit, known=known, missed=missed) if missed > _EXACT else fit

    def __call__(self, omega: ComplexArray) -> ComplexArray:
        """Return the function over its size at complex frequencies, (..., d, d)."""
        values = self._fitted(self.parts, omega)
        if self.known is not None:
            # Over the bandwidth of the vibration: a noisy table has no sharper meaning, and
            # without decay it is met exactly.
            for share in _BANDWIDTH:
                real: FloatArray = omega.real + share * omega.imag
                values += self._missed(real) / len(_BANDWIDTH)
        return values

    def _missed(self, omega: FloatArray) -> ComplexArray:
        """Return what the fit misses at real frequencies, those outside taken to the edge."""
        assert self.known is not None
        real: FloatArray = np.clip(omega, *self.span)
        exact = self.known(real.ravel()) / (self.size[:, None] * self.size)
        return exact.reshape(*real.shape, *exact.shape[1:]) - self._fitted(
            self.parts, real.astype(complex))

    def agrees(self, omega: ComplexArray) -> BoolArray:
        """
        Return whether the samples determine the function at complex frequencies.

        Far from the real axis, and near the cut of a function that is not rational, fits to
        different samples differ: what only one of them says is not known. Where a fit has to
        be corrected, what it misses must not change within the bandwidth of the vibration.
        """
        one, other = (self._fitted(parts, omega) for parts in (self.parts, self.others))
        gap = one - other
        if self.known is None:
            return np.asarray(_largest(gap) <= _AGREED * _largest(one))
        real = omega.real.astype(complex)
        gap -= self._fitted(self.parts, real) - self._fitted(self.others, real)
        centre: FloatArray = np.asarray(omega.real, dtype=float)
        here = self._missed(centre)
        size = _largest(one + here)
        agreed = _largest(gap) <= min(max(_AGREED, _SPREAD * self.missed), _STEADY) * size
        for side in (-1.0, 1.0):
            edge: FloatArray = omega.real + side * omega.imag
            agreed &= _largest(self._missed(edge) - here) <= _STEADY * size
        return np.asarray(agreed)

    def _fitted(
        self, parts: tuple[tuple[IntArray, 'RationalMatrix'], ...], omega: ComplexArray,
    ) -> ComplexArray:
        count = len(self.size)
        values = np.zeros((*omega.shape, count, count), dtype=complex)
        for index, part in parts:
            values[..., index[:, None], index] = part(omega)
        return values

    def states(self, tolerance: float) -> 'States':
        """Return the function over its size by its poles, small terms left out."""
        count = len(self.size)
        total = States(np.zeros((count, count), dtype=complex), np.zeros(0, dtype=complex),
                       np.zeros((count, 0), dtype=complex), np.zeros((0, count), dtype=complex))
        for index, part in self.parts:
            own, place = part.states(tolerance), np.eye(count)[:, index]
            total = States(total.constant + place @ own.constant @ place.T,
                           np.concatenate([total.poles, own.poles]),
                           np.concatenate([total.left, place @ own.left], axis=1),
                           np.concatenate([total.right, own.right @ place.T]))
        return total


def typical_size(values: ComplexArray) -> FloatArray:
    """Return the root of the largest diagonal entries of matrices (n, d, d), or one, (d,)."""
    largest = np.abs(values.diagonal(axis1=1, axis2=2)).max(axis=0, initial=0.0)
    return np.asarray(np.sqrt(np.where(largest > 0.0, largest, 1.0)))


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
        if tried[-1].continues(omega, within):
            return tried[-1]
        # The table follows no law that could be continued: noise, or too few points. The best
        # one that may, if only a constant, leaves the rest to what is known at real frequencies.
        sound = [(worst, fit) for worst, fit in zip(errors, tried, strict=False)
                 if fit.continues(omega, within)]
        return min(sound, key=lambda pair: pair[0])[1]

    def continues(self, omega: FloatArray, within: tuple[float, float]) -> bool:
        """
        Return whether the fit may stand for a passive support at complex frequencies.

        Samples (n,) [rad/s] that are noisy put poles among growing vibrations, which no cause
        has, or low and narrow peaks anywhere; those of a polynomial, as a spline through few
        points is one, leave no bound at infinity. Each is a fit to the samples alone. Only what
        vibrates within two frequencies counts: hysteretic damping, which turns its sign with the
        frequency, has a growing mirror image of every sharp pole at negative ones.
        """
        if not np.all(np.isfinite(self.weights)) or not self.weights.sum():
            return False
        found = self.states(_ROUGH)
        decay = found.poles.imag / omega[-1]
        narrow = np.abs(found.poles.imag) < _NARROW * np.abs(found.poles)
        height = (np.abs(found.left).max(axis=0, initial=0.0)
                  * np.abs(found.right).max(axis=1, initial=0.0))
        noise = (decay < -_ON_AXIS) | (narrow & (height < _STEADY * np.abs(found.poles.imag)))
        noise &= (found.poles.real > within[0]) & (found.poles.real < within[1])
        noise &= np.abs(found.poles) < _NEAR * omega[-1]
        return not noise.any() and bool(np.abs(found.constant).max(initial=0.0) < _BOUND)

    def __call__(self, omega: ComplexArray) -> ComplexArray:
        """Return the function at real or complex frequencies, (..., d, d)."""
        gap = omega[..., None] - self.nodes
        cauchy = self.weights / np.where(gap == 0.0, _ON_NODE, gap)
        values = cauchy @ self.values.reshape(len(self.nodes), -1)
        values /= cauchy.sum(axis=-1)[..., None]
        return np.asarray(values.reshape(*omega.shape, *self.values.shape[1:]))

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


def _largest(values: ComplexArray) -> FloatArray:
    """Return the size of the largest entry of matrices (..., d, d)."""
    return np.asarray(np.abs(values).max(axis=(-2, -1), initial=0.0))


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
