"""The pieces into which a sharp function is cut so that polynomials can stand for it."""

from bisect import bisect_right
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from rotorsoil_ros.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from rotorsoil_ros.errors import NotSolvedError

DEGREE = 7

# Relative to the highest speed: a piece this short around a pole is given up. A double resolves
# 1e-16, so that an interpolant still has seven digits there.
_SHORTEST = 1e-9

# Open pieces at one time: ten resonances of a case need some hundred.
_MOST_OPEN = 4096

# Complex values that are looked at together: bounds memory, to some 100 MB with all copies.
_MOST_VALUES = 1 << 20

# Probing columns need only betray a resonance, and only while a piece is long enough to hide it.
_PROBE_TOLERANCE = 1e-2
_PROBE_SHORTEST = 1e-4

# Channels this much smaller than the largest of their kind are round-off.
_ROUND_OFF = 1e-11

Solver = Callable[[FloatArray], tuple[ComplexArray, ComplexArray]]


@dataclass(frozen=True)
class Pieces:
    """
    Piecewise polynomials of degree `DEGREE`.

    Attributes
    ----------
    edges : (k + 1,) float array
        Ends of the pieces, ascending.
    resolved : (k,) bool array
        False where a pole is too close to the real axis.
    coefficients : (k, DEGREE + 1, p, w) complex array
        Lowest power first, of the variable that runs from -1 to 1 over a piece.

    """

    edges: FloatArray
    resolved: BoolArray
    coefficients: ComplexArray

    @classmethod
    def joined(cls, parts: Sequence['Pieces'], span: tuple[float, float]) -> 'Pieces':
        """Put pieces of rising ranges side by side; what of a span none of them has is open."""
        width = parts[0].coefficients.shape[1:]
        edges, resolved = [np.array(span[:1])], [np.zeros(0, dtype=bool)]
        coefficients = [np.zeros((0, *width), dtype=complex)]
        for part in parts:
            if not len(part.resolved):
                continue
            if part.edges[0] > edges[-1][-1]:
                edges.append(part.edges[:1])
                resolved.append(np.zeros(1, dtype=bool))
                coefficients.append(np.zeros((1, *width), dtype=complex))
            edges.append(part.edges[1:])
            resolved.append(part.resolved)
            coefficients.append(part.coefficients)
        if edges[-1][-1] < span[1]:
            edges.append(np.array(span[1:]))
            resolved.append(np.zeros(1, dtype=bool))
            coefficients.append(np.zeros((1, *width), dtype=complex))
        return cls(np.concatenate(edges), np.concatenate(resolved), np.concatenate(coefficients))

    @cached_property
    def _search(self) -> tuple[FloatArray, IntArray]:
        """Edges of half-open pieces, and what lies below, in, and above them."""
        # The last piece owns its right end, and a NaN sorts behind everything.
        edges = np.append(self.edges[:-1], np.nextafter(self.edges[-1], np.inf))
        pieces = np.where(self.resolved, np.arange(len(self.resolved)), -1)
        return edges, np.concatenate([[-1], pieces, [-1]])

    def find(self, place: FloatArray) -> IntArray:
        """Return the index of the resolved piece that holds each place, (n,), or -1."""
        edges, pieces = self._search
        return pieces[np.searchsorted(edges, place, side='right')]

    @cached_property
    def _plain(self) -> tuple[list[float], list[int], list[float]]:
        """Return what `_search` says and all edges, as plain numbers."""
        edges, pieces = self._search
        return edges.tolist(), pieces.tolist(), self.edges.tolist()

    def find_one(self, place: float) -> int:
        """Return what `find` says of a single place, at a tenth of the cost."""
        edges, pieces, _ = self._plain
        return pieces[bisect_right(edges, place)]

    def at(self, place: FloatArray) -> ComplexArray:
        """Return the polynomials themselves at places (n,), (n, p, w); NaN where none holds."""
        index = self.find(place)
        known = index >= 0
        values = np.full((len(place), *self.coefficients.shape[2:]), complex(np.nan, np.nan))
        left, right = self.edges[index[known]], self.edges[index[known] + 1]
        along = ((place[known] - left) - (right - place[known])) / (right - left)
        values[known] = np.einsum('nd,ndpw->npw', along[:, None] ** np.arange(DEGREE + 1),
                                  self.coefficients[index[known]])
        return values

    def powers_of_one(self, place: float, piece: int) -> list[float]:
        """Return the squared place times the powers of where it is in its piece."""
        edges = self._plain[2]
        left, right = edges[piece], edges[piece + 1]
        along = ((place - left) - (right - place)) / (right - left)
        powers = [place * place]
        for degree in range(DEGREE):
            powers.append(powers[degree] * along)
        return powers


def evaluate(
    pieces: Pieces, coefficients: FloatArray, place: FloatArray, index: IntArray, *,
    out: FloatArray,
) -> None:
    """
    Evaluate piecewise polynomials times the squared place.

    Parameters
    ----------
    pieces : Pieces
        Where the pieces lie.
    coefficients : (k, DEGREE + 1, w) float array
        Of each piece, lowest power first.
    place : (n,) float array
        Inside the edges.
    index : (n,) int array
        Piece that holds each place.
    out : (n, w) float array
        Takes the values: the same to the last bit however many places are evaluated together,
        because products and sums are taken element by element and in one order, unlike those
        of a matrix product.

    """
    # Sorted by piece, each is a slice that einsum fills in place.
    order = np.argsort(index, kind='stable')
    is_sorted = bool(np.all(order[1:] > order[:-1]))
    place, index = place[order], index[order]
    left, right = pieces.edges[index], pieces.edges[index + 1]
    powers = np.empty((DEGREE + 1, len(place)))
    np.multiply(place, place, out=powers[0])
    powers[1:] = ((place - left) - (right - place)) / (right - left)
    np.multiply.accumulate(powers, axis=0, out=powers)
    values = out if is_sorted else np.empty_like(out)
    ends = np.flatnonzero(np.diff(index, prepend=-1, append=-1))
    for start, stop in pairwise(ends):
        summed(powers[:, start:stop], coefficients[index[start]], out=values[start:stop])
    if not is_sorted:
        # `take` copies whole rows, several times as fast as an assignment to `out[order]`.
        np.take(values, np.argsort(order), axis=0, out=out, mode='clip')


def evaluate_one(pieces: Pieces, coefficients: FloatArray, place: float, piece: int) -> FloatArray:
    """Evaluate at a single place, (1, w): the bits of `evaluate`, but few calls of numpy."""
    powers = np.array(pieces.powers_of_one(place, piece))
    return summed(powers[:, None], coefficients[piece])


def summed(weights: FloatArray, rows: FloatArray, out: FloatArray | None = None) -> FloatArray:
    """Return the sum of weights (d, n) times rows (d, w), (n, w)."""
    # Not a matrix product: einsum adds term after term for each element, whatever n is.
    return np.asarray(np.einsum('dn,dw->nw', weights, rows, out=out))


def refine(
    solve: Solver, edges: FloatArray, *, groups: IntArray, tolerance: float, columns: int,
    floor: float = _ROUND_OFF,
) -> Pieces:
    """
    Halve pieces until polynomials through their nodes are right between the nodes.

    Parameters
    ----------
    solve : callable
        From places (n,) to wanted values (n, p, w) and probing values (n, q, w); the latter
        are not kept but betray resonances that hardly show in the former.
    edges : (k + 1,) float array
        Ends of the pieces before the first look, ascending: a resonance shows by its skirt,
        which must reach into each.
    groups : (w,) int array
        Columns of one kind and unit have the same number: the largest of them tells what is
        round-off in the others.
    tolerance : float
        Relative to the local magnitude of each value.
    columns : int
        p + q, which bounds how many pieces are looked at together.
    floor : float
        Share of the largest value of its kind that is as good as nothing.

    Returns
    -------
    Pieces
        Of the wanted values.

    Raises
    ------
    NotSolvedError
        If round-off or noise would be refined without end.

    """
    # Every other point of a finer Chebyshev-Lobatto grid carries the polynomial, the rest tests.
    along = -np.cos(np.pi * np.arange(2 * DEGREE + 1) / (2 * DEGREE))
    powers = np.linalg.inv(np.vander(along[::2], DEGREE + 1, increasing=True))
    between = np.vander(along[1::2], DEGREE + 1, increasing=True) @ powers
    left, right, high = edges[:-1], edges[1:], edges[-1]
    done: list[tuple[FloatArray, FloatArray, BoolArray, ComplexArray]] = []
    most = max(1, _MOST_VALUES // (len(along) * columns * len(groups) or 1))
    while len(left):
        if len(left) > _MOST_OPEN:
            raise NotSolvedError(f'the response is rough everywhere: {len(left)} pieces between '
                                 f'{left.min():g} and {right.max():g} rad/s still miss their '
                                 'tolerance')
        halved = []
        for start in range(0, len(left), most):
            part = slice(start, start + most)
            closed, good, values = _look(solve, left[part], right[part], along, between,
                                         groups=groups, tolerance=tolerance, high=high,
                                         floor=floor)
            coefficients = np.einsum('ij,kj...->ki...', powers, values[closed, ::2])
            done.append((left[part][closed], right[part][closed], good[closed], coefficients))
            halved.append((left[part][~closed], right[part][~closed]))
        lefts, rights = (np.concatenate(ends) for ends in zip(*halved, strict=True))
        middle = 0.5 * (lefts + rights)
        left, right = np.concatenate([lefts, middle]), np.concatenate([middle, rights])
    lefts, rights, resolved, coefficients = (
        np.concatenate(parts) for parts in zip(*done, strict=True))
    order = np.argsort(lefts)
    return Pieces(np.append(lefts[order], rights.max()), resolved[order], coefficients[order])


def _look(
    solve: Solver, left: FloatArray, right: FloatArray, along: FloatArray, between: FloatArray, *,
    groups: IntArray, tolerance: float, high: float, floor: float,
) -> tuple[BoolArray, BoolArray, ComplexArray]:
    """Return which pieces need no halving, which of them are right, and their values."""
    middle, half = 0.5 * (left + right), 0.5 * (right - left)
    # A table of a bearing may end where the first piece begins, to the last bit.
    speed = np.clip(middle[:, None] + half[:, None] * along, left[:, None], right[:, None])
    wanted, probing = (values.reshape(len(left), len(along), *values.shape[1:])
                       for values in solve(speed.ravel()))
    good = _matches(wanted, between, groups, tolerance, floor)
    short = right - left <= _SHORTEST * high
    clear = (_matches(probing, between, groups, _PROBE_TOLERANCE, _ROUND_OFF)
             | (right - left <= _PROBE_SHORTEST * high))
    return np.asarray((good & clear) | short), good, wanted


def _matches(
    values: ComplexArray, between: FloatArray, groups: IntArray, tolerance: float, floor: float,
) -> BoolArray:
    """Return for each piece whether the polynomial meets all values between its nodes."""
    exact = values[:, 1::2]
    size = np.abs(exact)
    largest = np.empty_like(size)
    for group in np.unique(groups):
        same = groups == group
        largest[..., same] = size[..., same].max(axis=-1, keepdims=True)
    deviation = np.abs(np.einsum('ij,kj...->ki...', between, values[:, ::2]) - exact)
    return np.asarray(np.all(deviation <= tolerance * size + floor * largest,
                             axis=(1, 2, 3)))
