"""The one vertical line that is cut into elements, from the surface to rock or to no return."""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache
import itertools
import math

import numpy as np

from rotorsoil_ros.arrays import ComplexArray, FloatArray
from rotorsoil_ros.ground.layers.profile import Embedment, LayeredSoil
from rotorsoil_ros.ground.soil import Soil

# Perfectly matched discrete layers: lengths grow by this factor along this direction of the
# complex plane, from this share of the shortest wave over 2 pi, to so many of the longest.
_GROWTH = 1.6
_DIRECTION = np.exp(-0.25j * math.pi)
_FIRST = 0.9
_TOTAL = 7.5
# Some waves graze the layers, whatever the frequency: it is deep enough for one this much lower.
_SPAN = 40.0
# What does not travel dies within the distance from the base: the first is this share of it.
_NEAR = 0.12

# The half-space keeps real elements down to so many radii below the edge of the base.
_REAL = 0.6

# A wall that is welded over less than this share of its depth is that of a trench, and the element
# at the edge of the base there [-], of a radius.
_HARDLY_WELDED, _OF_TRENCH = 0.05, 0.0005

# Points of a graded mesh closer to an interface than this share of their spacing are dropped.
_TOO_CLOSE = 0.35


@dataclass(frozen=True, slots=True)
class LineMesh:
    """
    How finely the line is cut.

    Attributes
    ----------
    order : int
        Of the polynomials of an element.
    smallest : float
        Element at the edge of the base and where the welded part of a wall begins, of a radius.
    ratio : float
        Each element over the next one farther from there.
    per_wave, per_radius : float
        Largest element over the shear wavelength at the highest frequency, and over the radius
        and the distance below the base together.

    """

    order: int = 4
    smallest: float = 0.004
    ratio: float = 0.2
    per_wave: float = 0.4
    per_radius: float = 0.3

    @classmethod
    def beside(cls, embedment: Embedment) -> 'LineMesh':
        """Return the usual mesh; beside an open trench stresses rise faster to the edge."""
        is_open = embedment.depth > 0.0 and embedment.side_contact < _HARDLY_WELDED
        return cls(smallest=_OF_TRENCH) if is_open else cls()


@dataclass(frozen=True, slots=True, eq=False)
class LineMatrices:
    """
    Integrals over the depth of shape functions N, (n, n), and of their derivatives.

    Attributes
    ----------
    v_mu, v_lambda, v_rho : complex arrays
        Int w N N^T with the moduli mu and lambda and the density as w.
    d_mu, d_lambda : complex arrays
        Int w N' N'^T.
    e_mu, e_lambda : complex arrays
        Int w N N'^T: row value, column derivative.

    """

    v_mu: ComplexArray
    v_lambda: ComplexArray
    v_rho: ComplexArray
    d_mu: ComplexArray
    d_lambda: ComplexArray
    e_mu: ComplexArray
    e_lambda: ComplexArray

    @classmethod
    def assembled(cls, pieces: Iterable['LinePiece'], *, keeps_last: bool) -> 'LineMatrices':
        """Put elements side by side; the last node may be held."""
        pieces = list(pieces)
        size = 1 + sum(piece.order for piece in pieces)
        total = np.zeros((7, size, size), dtype=complex)
        first = 0
        for piece in pieces:
            own = slice(first, first + piece.order + 1)
            total[:, own, own] += piece.matrices()
            first += piece.order
        return cls(*(total if keeps_last else total[:, :-1, :-1]))

    def without_first(self) -> 'LineMatrices':
        """Return the matrices with the first node held."""
        return LineMatrices(*(matrix[1:, 1:] for matrix in (
            self.v_mu, self.v_lambda, self.v_rho, self.d_mu, self.d_lambda, self.e_mu,
            self.e_lambda)))


@dataclass(frozen=True, slots=True)
class LinePiece:
    """
    Element of the line.

    Attributes
    ----------
    length : complex
        Real, or along the direction in which waves die.
    order : int
        Of its polynomials.
    soil : Soil
        What it is made of.
    is_tail : bool
        Whether it is integrated at its midpoint, which matches its neighbours exactly.

    """

    length: complex
    order: int
    soil: Soil
    is_tail: bool = False

    def matrices(self) -> ComplexArray:
        """Return its seven integrals in the order of `LineMatrices`, (7, p + 1, p + 1)."""
        value, slope, mixed = _midpoint() if self.is_tail else _full(self.order)
        soil = self.soil
        shear = soil.shear_modulus * (1.0 + 1j * soil.loss_factor)
        dilatation = shear * 2.0 * soil.poisson_ratio / (1.0 - 2.0 * soil.poisson_ratio)
        return np.stack([
            shear * self.length * value, dilatation * self.length * value,
            soil.density * self.length * value, shear / self.length * slope,
            dilatation / self.length * slope, shear * mixed, dilatation * mixed])


@lru_cache
def _full(order: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return int N N^T, int N' N'^T and int N N'^T over an element of length one."""
    polynomial = np.polynomial.legendre.Legendre.basis(order)
    inner = np.sort(polynomial.deriv().roots().real) if order > 1 else np.zeros(0)
    nodes = 0.5 * (1.0 + np.concatenate([[-1.0], inner, [1.0]]))
    place, weight = np.polynomial.legendre.leggauss(order + 1)
    place, weight = 0.5 * (1.0 + place), 0.5 * weight
    powers = np.linalg.inv(np.vander(nodes, increasing=True))
    values = np.vander(place, order + 1, increasing=True) @ powers
    degree = np.arange(1, order + 1)
    slopes = (np.vander(place, order, increasing=True) * degree) @ powers[1:]
    return ((values.T * weight) @ values, (slopes.T * weight) @ slopes,
            (values.T * weight) @ slopes)


@lru_cache
def _midpoint() -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the integrals of a linear element by the value in its middle."""
    value, slope = np.array([0.5, 0.5]), np.array([-1.0, 1.0])
    return np.outer(value, value), np.outer(slope, slope), np.outer(value, slope)


@dataclass(frozen=True, slots=True, eq=False)
class VerticalLine:
    """
    The line at the edge of a cylinder that stands in the ground.

    Attributes
    ----------
    outside : LineMatrices
        Of the whole line.
    below : LineMatrices
        Of what lies below the base, the node at the base first.
    depth : (n,) complex array
        Of the free nodes of the line.
    wall : slice
        Nodes that follow the body; the last of them is the edge of the base.
    base : float
        Depth of the base.
    above_rock : bool
        Whether the line ends on rock.

    """

    outside: LineMatrices
    below: LineMatrices
    depth: ComplexArray
    wall: slice
    base: float
    above_rock: bool

    @classmethod
    def through(
        cls, ground: LayeredSoil, embedment: Embedment, *, radius: float, lowest: float,
        highest: float, mesh: LineMesh,
    ) -> 'VerticalLine':
        """
        Cut the ground.

        Parameters
        ----------
        ground, embedment
            In the same units as everything here.
        radius : float
            Smallest of the contacts that share the line.
        lowest, highest : float
            Frequencies for which the line is made.
        mesh : LineMesh
            How finely.

        """
        pieces = list(_real(ground, embedment, radius=radius, highest=highest, mesh=mesh))
        ends = np.cumsum([piece.length.real for piece in pieces])
        above = int((ends < embedment.depth * (1.0 + 1e-9)).sum()) if embedment.depth else 0
        free = int((ends < embedment.free_depth * (1.0 + 1e-9)).sum()) if (
            embedment.free_depth) else 0
        away = radius + ends[-1] - embedment.depth
        pieces += _tail(ground, away=float(away), lowest=lowest, highest=highest)
        order = mesh.order
        return cls(LineMatrices.assembled(pieces, keeps_last=False),
                   LineMatrices.assembled(pieces[above:], keeps_last=False), _depths(pieces),
                   slice(order * free, order * above + 1), embedment.depth, ground.below is None)


def _real(
    ground: LayeredSoil, embedment: Embedment, *, radius: float, highest: float, mesh: LineMesh,
) -> Iterable[LinePiece]:
    """Yield elements of real length, graded towards the places where conditions change."""
    end = ground.depth
    if ground.below is not None:
        end = max(end, embedment.depth + _REAL * radius)
    fixed = sorted({0.0, end, embedment.depth, embedment.free_depth,
                    *(depth for depth in ground.interfaces if depth < end)})
    fixed = [depth for index, depth in enumerate(fixed)
             if index == 0 or depth - fixed[index - 1] > 1e-9 * end]
    foci = {embedment.depth, embedment.free_depth} if embedment.free_depth else {embedment.depth}
    for top, bottom in itertools.pairwise(fixed):
        soil = ground.at(0.5 * (top + bottom))
        wave = 2.0 * math.pi * soil.shear_wave_speed / highest
        edges = _graded(top, bottom, foci, radius=radius, mesh=mesh)
        for upper, lower in itertools.pairwise(edges):
            away = max(0.0, 0.5 * (upper + lower) - embedment.depth)
            largest = min(mesh.per_wave * wave, mesh.per_radius * (radius + away))
            count = math.ceil((lower - upper) / largest - 1e-9)
            yield from [LinePiece((lower - upper) / count, mesh.order, soil)] * count


def _graded(
    top: float, bottom: float, foci: Iterable[float], *, radius: float, mesh: LineMesh,
) -> list[float]:
    """Return edges of elements between two depths that shrink towards the foci."""
    edges = [top, bottom]
    steps = mesh.smallest * radius * mesh.ratio ** -np.arange(
        1.0 + math.ceil(math.log(mesh.smallest) / math.log(mesh.ratio)))
    for focus in sorted(foci):
        for side in (-1.0, 1.0):
            last = focus
            for place in (focus + side * steps).tolist():
                spacing, last = abs(place - last), place
                if top < place < bottom and min(
                        abs(place - edge) for edge in edges) > _TOO_CLOSE * spacing:
                    edges.append(place)
    return sorted(edges)


def _tail(
    ground: LayeredSoil, *, away: float, lowest: float, highest: float,
) -> list[LinePiece]:
    """Return the half-space below all real elements, as layers that let nothing return."""
    if ground.below is None:
        return []
    speed = ground.below.shear_wave_speed
    length, pieces, total = min(_FIRST * speed / highest, _NEAR * away), [], 0.0
    while total < _TOTAL * speed / min(lowest, highest / _SPAN):
        pieces.append(LinePiece(complex(length * _DIRECTION), 1, ground.below, is_tail=True))
        total += length
        length *= _GROWTH
    return pieces


def _depths(pieces: list[LinePiece]) -> ComplexArray:
    """Return the depth of all nodes but the last, which is held."""
    depths, depth = [], 0.0 + 0.0j
    for piece in pieces:
        polynomial = np.polynomial.legendre.Legendre.basis(piece.order)
        inner = np.sort(polynomial.deriv().roots().real) if piece.order > 1 else np.zeros(0)
        along = 0.5 * (1.0 + np.concatenate([[-1.0], inner]))
        depths.append(depth + piece.length * along)
        depth += piece.length
    return np.concatenate(depths)
