"""How a compliance that is known at real frequencies continues to decaying vibration."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TypeAlias

import numpy as np
from scipy.sparse.csgraph import connected_components

from rotorsoil_ros.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from rotorsoil_ros.ground.rational import RationalMatrix, States

# Fits worse than this are corrected by what they miss at the real frequency of a vibration.
_EXACT = 1e-9

# Two fits that differ less, relative to the largest entry, say the same.
_AGREED = 1e-2

# Two poles nearer than this share of their frequency are one.
_BESIDE = 1e-4

# What a fit misses may change by so much within the bandwidth of a vibration: a measured table
# has a few percent of noise.
_STEADY = 0.1

# Two fits may differ by so many times what one of them misses.
_SPREAD = 4.0

# Vibrations that decay by more than this share of |w| lie as far from the samples as from zero:
# what is said of them must be said by the samples of another range too, by all but this share at
# an end, as well as this. Artefacts, which move with the range, differ by more than a quarter.
_FAR_ABOVE = 0.2
OTHER_RANGE = 0.25
_PERSISTS = 0.1

# Where in the half bandwidth of a vibration a rough fit is corrected.
_BANDWIDTH = (-1.0, -0.5, 0.0, 0.5, 1.0)

# Share of the function that guesses may neglect.
_ROUGH = 1e-4

# Entries that stay below this share of their diagonal are round-off.
_UNCOUPLED = 1e-10

# What couples, and its fit.
_Parts: TypeAlias = tuple[tuple[IntArray, RationalMatrix | States], ...]


@dataclass(frozen=True)
class Laws:
    """
    What a function is known to follow, so that it needs no fit.

    Attributes
    ----------
    whole, other : States
        By all that is known of it, and by other samples.
    lower, upper : States
        By all but the upper or lower `OTHER_RANGE` of the frequencies.

    """

    whole: States
    other: States
    lower: States
    upper: States

    def over(self, size: FloatArray) -> 'Laws':
        """Return the same over sizes (d,)."""
        return Laws(self.whole.over(size), self.other.over(size), self.lower.over(size),
                    self.upper.over(size))


@dataclass(frozen=True)
class Continuation:
    """
    Matrix function of frequency, continued part by part.

    Attributes
    ----------
    parts : tuple of (indices, RationalMatrix or States)
        What does not couple is fitted by itself, so that no part has poles of another.
    size : (d,) float array
        Typical square root of the diagonal, which makes the entries comparable.
    others : tuple of (indices, RationalMatrix or States)
        The same from every other sample.
    known : callable or None
        The function at real frequencies (n,), where the fit is too rough; else None.
    span : tuple of two floats
        Where it is known [rad/s].
    missed : float
        Most that the fit misses of a sample.
    samples : tuple of (n,) float array, (n, d, d) complex array
        What was fitted, over the size.
    within : tuple of two floats
        As in `of`.
    blur : float
        As in `of`.
    law : Laws or None
        As in `of`, over the size.

    """

    parts: _Parts
    others: _Parts
    size: FloatArray
    known: Callable[[FloatArray], ComplexArray] | None
    span: tuple[float, float]
    missed: float
    samples: tuple[FloatArray, ComplexArray]
    within: tuple[float, float]
    blur: float
    law: Laws | None

    @classmethod
    def of(
        cls, omega: FloatArray, known: Callable[[FloatArray], ComplexArray],
        size: FloatArray | None = None,
        other: Callable[[FloatArray], ComplexArray] | None = None,
        within: tuple[float, float] = (-np.inf, np.inf),
        span: tuple[float, float] | None = None, blur: float = 0.0,
        law: Laws | None = None,
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
        span : tuple of two floats, optional
            Where the function is known, if that is farther than its samples [rad/s].
        blur : float
            How far off the ends of the span may be [rad/s].
        law : Laws, optional
            Of the first of all motions.

        """
        values = known(omega)
        if size is None:
            size = typical_size(values)
        values = values / (size[:, None] * size)
        second = values[::2] if other is None else other(omega[::2]) / (size[:, None] * size)
        led = 0 if law is None else len(law.whole.constant)
        groups = [np.arange(led)] * (led > 0) + [
            led + group for group in _coupled(values[:, led:, led:])]
        own = None if law is None else law.over(size[:led])
        fit = cls(_fits(groups, omega, values, within, None if own is None else own.whole),
                  _fits(groups, omega[::2], second, within, None if own is None else own.other),
                  size, None, span or (float(omega[0]), float(omega[-1])), 0.0, (omega, values),
                  within, blur, own)
        missed = float(np.abs(fit(omega.astype(complex)) - values).max(initial=0.0))
        exact = law is not None or missed <= _EXACT
        return fit if exact else replace(fit, known=known, missed=missed)

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
            agreed = _largest(gap) <= _AGREED * _largest(one)
            if self.law is not None:
                # Beside a pole that both have, as a mode that hardly moves the contacts is, what
                # they differ by is where the pole is.
                aside = (1.0 + _BESIDE) * omega
                agreed |= _largest(gap) <= np.minimum(
                    _largest(self._fitted(self.parts, aside) - one),
                    _largest(self._fitted(self.others, aside) - other))
            return np.asarray(agreed & self.persists(omega))
        real = omega.real.astype(complex)
        gap -= self._fitted(self.parts, real) - self._fitted(self.others, real)
        centre: FloatArray = np.asarray(omega.real, dtype=float)
        here = self._missed(centre)
        size = _largest(one + here)
        agreed = _largest(gap) <= min(max(_AGREED, _SPREAD * self.missed), _STEADY) * size
        for side in (-1.0, 1.0):
            edge: FloatArray = omega.real + side * omega.imag
            agreed &= _largest(self._missed(edge) - here) <= _STEADY * size
        return np.asarray(agreed & self.persists(omega))

    def persists(self, omega: ComplexArray) -> BoolArray:
        """
        Return whether other fits say the same of what lies far above the real axis.

        There a fit may say what belongs to the range of its samples, or to its order, and not to
        the function: a fit to another range has to agree, and the `rough` one.
        """
        values = self._fitted(self.parts, omega)
        told: BoolArray = np.ones(omega.shape, dtype=bool)
        far = np.abs(omega.imag) > _FAR_ABOVE * np.abs(omega)
        middle = 0.5 * (self.span[0] + self.span[1])
        for side, parts in ((omega.real < middle, 0), (omega.real >= middle, 1)):
            here = far & side
            if not here.any():
                continue
            gap = values[here] - self._fitted(self._other_ranges[parts], omega[here])
            if self.rough is not self:
                fewer = self._fitted(self.rough.parts, omega[here]) - values[here]
                told[here] = _largest(fewer) <= _PERSISTS * _largest(values[here])
            if self.known is not None:
                real = omega[here].real.astype(complex)
                gap -= self._fitted(self.parts, real) - self._fitted(
                    self._other_ranges[parts], real)
            told[here] &= _largest(gap) <= _PERSISTS * _largest(values[here])
        return told

    @cached_property
    def _other_ranges(self) -> tuple[_Parts, _Parts]:
        """The same from the samples of the lower and of the upper part of the span."""
        (omega, values), (low, high) = self.samples, self.span
        cut, groups = OTHER_RANGE * (high - low), [index for index, _ in self.parts]
        laws = (None, None) if self.law is None else (self.law.lower, self.law.upper)
        lower, upper = (
            _fits(groups, omega[own], values[own], self.within, law)
            for own, law in zip((omega <= high - cut, omega >= low + cut), laws, strict=True))
        return lower, upper

    def _fitted(self, parts: _Parts, omega: ComplexArray) -> ComplexArray:
        count = len(self.size)
        values = np.zeros((*omega.shape, count, count), dtype=complex)
        for index, part in parts:
            values[..., index[:, None], index] = part(omega)
        return values

    @cached_property
    def rough(self) -> 'Continuation':
        """
        The same by as few poles as guesses need, if that fit is one to be continued.

        Near a branch point, which crowds poles, none are left out, nor of a law that is given.
        """
        if self.known is not None or self.law is not None or np.isfinite(self.within).any():
            return self
        omega, values = self.samples
        few = tuple((index, RationalMatrix.roughly(
            omega, values[:, index[:, None], index], _ROUGH)) for index, _ in self.parts)
        fewer = sum(len(part.nodes) for _, part in few) < sum(
            len(part.nodes) for _, part in self.parts if isinstance(part, RationalMatrix))
        return replace(self, parts=few) if fewer and all(
            part.continues(omega, self.within, is_exact=True) for _, part in few) else self

    @property
    def is_rough(self) -> bool:
        """Whether a guess by `rough` may be far off where a vibration decays fast."""
        return self.known is not None or self.rough is not self

    def states(self, tolerance: float) -> States:
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


def _coupled(values: ComplexArray) -> list[IntArray]:
    """Return the indices of what couples in matrices (n, d, d), group by group."""
    couples = np.abs(values).max(axis=0, initial=0.0) > _UNCOUPLED
    _, labels = connected_components(couples, directed=False)
    return [np.flatnonzero(labels == label) for label in np.unique(labels)]


def _fits(
    groups: Sequence[IntArray], omega: FloatArray, values: ComplexArray,
    within: tuple[float, float], law: States | None,
) -> _Parts:
    """Return a fit for every group of motions, for the first of them its law if it has one."""
    known = [] if law is None else [(groups[0], law)]
    return (*known, *((index, RationalMatrix.of(omega, values[:, index[:, None], index], within))
                      for index in groups[len(known):]))


def typical_size(values: ComplexArray) -> FloatArray:
    """Return the root of the largest diagonal entries of matrices (n, d, d), or one, (d,)."""
    largest = np.abs(values.diagonal(axis1=1, axis2=2)).max(axis=0, initial=0.0)
    return np.asarray(np.sqrt(np.where(largest > 0.0, largest, 1.0)))


def _largest(values: ComplexArray) -> FloatArray:
    """Return the size of the largest entry of matrices (..., d, d)."""
    return np.asarray(np.abs(values).max(axis=(-2, -1), initial=0.0))
