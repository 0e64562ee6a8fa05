"""What one rectangle on a half-space gives way by: tractions as series that know the edges."""

from dataclasses import dataclass
from functools import cached_property, lru_cache
import math
from typing import TypeAlias, TypeVar

import numpy as np

from rotorsoil_ros.arrays import ComplexArray, FloatArray, IntArray
from rotorsoil_ros.ground.boundary.effort import COARSE, FINE, nodes_along
from rotorsoil_ros.ground.boundary.kernels import (
    GroundWaves,
    motion_by_forces,
    ODD,
    PAIRS,
    upwards,
    wave_kernels,
    WaveKernels,
)
from rotorsoil_ros.ground.boundary.lattice import lattice_errors, mended
from rotorsoil_ros.ground.boundary.statics import primitives, static_kernels, StaticKernels

# Functions along a half side, at least and at most, and how they grow with the ratio of the sides.
_LEAST_FUNCTIONS, _MOST_FUNCTIONS = 4, 6
_LONGER_FUNCTIONS = 0.7
# Half of the cells along a half side in two static meshes, whose errors fall with h^2.
_CELLS = 4

Parity: TypeAlias = tuple[int, int]
Values = TypeVar('Values', FloatArray, ComplexArray)

# Parity in x and y of the vertical motion of the four classes, and their degrees of freedom:
# each moves x, y or z (down) by a sign times powers of x and y.
_CLASSES: tuple[tuple[Parity, dict[int, tuple[tuple[str, float, int, int], ...]]], ...] = (
    ((1, 1), {2: (('z', -1.0, 0, 0),)}),
    ((-1, 1), {0: (('x', 1.0, 0, 0),), 4: (('z', 1.0, 1, 0),)}),
    ((1, -1), {1: (('y', 1.0, 0, 0),), 3: (('z', -1.0, 0, 1),)}),
    ((-1, -1), {5: (('x', -1.0, 0, 1), ('y', 1.0, 1, 0))}))


@dataclass(frozen=True, eq=False)
class _Axis:
    """
    Places along a half side of length 1 or more, and what each traction function has there.

    Attributes
    ----------
    place : (p,) float array
        Of nodes, or of the edges of cells.
    functions : dict of (p, f) float array
        By parity.
    near : int
        Sign of what acts from the same side; what acts from the other has that of its parity.

    """

    place: FloatArray
    functions: dict[int, FloatArray]
    near: int

    @classmethod
    def of_nodes(cls, half: float, count: int, functions: int) -> '_Axis':
        """Return Gauss-Chebyshev nodes; a function has forces there."""
        angle = 0.5 * math.pi / count * (np.arange(count) + 0.5)
        return cls(half * np.sin(angle), {
            parity: 0.5 * math.pi / count * np.cos(
                np.outer(0.5 * math.pi - angle, _orders(parity, functions)))
            for parity in (1, -1)}, 1)

    @classmethod
    def of_cells(cls, half: float, count: int, functions: int) -> '_Axis':
        """Return edges of graded cells; a function has steps of its mean traction there."""
        angle = 0.5 * math.pi / count * np.arange(count + 1)
        edges = half * np.sin(angle)
        found = {}
        for parity in (1, -1):
            order = _orders(parity, functions)
            phase = np.outer(0.5 * math.pi - angle, order)
            # The integral of cos(m phi); of order 0 the angle itself.
            primitive = np.where(order > 0, np.sin(phase) / np.maximum(order, 1),
                                 (0.5 * math.pi - angle)[:, None])
            mean = -np.diff(primitive, axis=0) / np.diff(edges)[:, None]
            none = np.zeros((1, len(order)))
            found[parity] = -np.diff(np.concatenate([none, mean, none]), axis=0)
        return cls(edges, found, -1)

    @cached_property
    def _pairs(self) -> tuple[IntArray, IntArray]:
        first, second = np.triu_indices(len(self.place))
        return first, second

    @cached_property
    def apart(self) -> FloatArray:
        """Distances of all pairs on one side, then of one with the mirror of the other."""
        first, second = self._pairs
        place = self.place
        return np.concatenate([place[second] - place[first], place[second] + place[first]])

    @cached_property
    def _index(self) -> IntArray:
        count = len(self.place)
        found = np.zeros((count, count), dtype=int)
        found[self._pairs] = np.arange(len(self._pairs[0]))
        return np.maximum(found, found.T)

    def folded(self, values: Values, *, odd: bool, parity: int) -> Values:
        """Return the motion of a half by both halves, (..., p, p), from that of pairs."""
        half = values.shape[-1] // 2
        near = self.near * values[..., self._index]
        if odd:
            near = near * np.sign(self.place[:, None] - self.place)
        both: Values = near + parity * values[..., half + self._index]
        return both

    @cached_property
    def reducing(self) -> dict[tuple[bool, int], FloatArray]:
        """What makes pairs (2 n,) into products of two functions, (f^2, 2 n)."""
        found = {}
        for odd in (False, True):
            for parity in (1, -1):
                unit = self.folded(np.eye(len(self.apart)), odd=odd, parity=parity)
                mine = np.tensordot(unit, self.functions[-parity if odd else parity], (1, 0))
                both = np.tensordot(mine, self.functions[parity], (1, 0))
                found[odd, parity] = both.reshape(len(unit), -1).T
        return found


def _orders(parity: int, count: int) -> IntArray:
    return np.arange(count) * 2 + (parity < 0)


def _reduced(
    x: _Axis, y: _Axis, values: Values, *, odd: tuple[bool, bool], source: Parity,
) -> Values:
    """Return a kernel between functions, (f, f), from that between pairs of places, (2 n, 2 m)."""
    across = x.reducing[odd[0], source[0]] @ values
    along = y.folded(across, odd=odd[1], parity=source[1])
    mine = y.functions[-source[1] if odd[1] else source[1]]
    found: Values = mine.T @ along @ y.functions[source[1]]
    one, other = math.isqrt(len(found)), mine.shape[1]
    return found.reshape(one, one, other, other).transpose(0, 2, 1, 3).reshape(
        one * other, one * other)


def _parity(of_vertical: Parity, component: str) -> Parity:
    ex, ey = of_vertical
    return {'x': (-ex, ey), 'y': (ex, -ey), 'z': (ex, ey)}[component]


@dataclass(frozen=True, eq=False)
class RectangleSolver:
    """
    Rigid rectangle of half sides 1 along x and `ratio` along y, welded to the ground.

    Attributes
    ----------
    waves : GroundWaves
        Of the ground, as far as the diagonal of the rectangle.
    ratio : float
        At least 1 [-].
    highest : float
        a0 up to which nodes are close enough [-].
    points : (p, 2) float array
        Where on the ground motion is wanted too, outside the rectangle.

    Notes
    -----
    Each component of the traction is a series of T_m(x) T_n(y / ratio) over the square roots
    that a rigid edge asks for. Galerkin's equations are solved for each of four symmetry classes
    on a quarter of the rectangle. The static kernels are integrated in closed form over graded
    cells, in which the functions are constant, and extrapolated from two meshes; the waves,
    smooth but for a kink, are summed over Gauss-Chebyshev nodes and mended there (`lattice`).

    References
    ----------
    Wong & Luco (1978), J. Geotech. Eng. Div. 104, p. 1501 (rectangles by elements of constant
    traction); Triantafyllidis (1986), Earthquake Eng. Struct. Dyn. 14, p. 391 (Chebyshev
    polynomials over square roots).

    """

    waves: GroundWaves
    ratio: float
    highest: float
    points: FloatArray

    @cached_property
    def _sizes(self) -> tuple[int, int, int, int]:
        """Functions along x and y, nodes along x and y."""
        nodes, longer = nodes_along(self.ratio, self.highest)
        functions = min(max(nodes - 2, _LEAST_FUNCTIONS), _MOST_FUNCTIONS)
        return functions, math.ceil(functions * self.ratio**_LONGER_FUNCTIONS), nodes, longer

    @property
    def unknowns(self) -> int:
        """Unknowns of each of the four symmetry classes."""
        return 3 * self._sizes[0] * self._sizes[1]

    @cached_property
    def _nodes(self) -> tuple[_Axis, _Axis]:
        across, along, nodes, longer = self._sizes
        return _Axis.of_nodes(1.0, nodes, across), _Axis.of_nodes(self.ratio, longer, along)

    @cached_property
    def _at_rest(self) -> tuple[StaticKernels, ...]:
        """Kernels at rest between functions, by class."""
        return _kernels_at_rest(self.ratio, self._sizes[:2], self.waves.poisson_ratio)

    @cached_property
    def _lattice(self) -> tuple[FloatArray, FloatArray]:
        """What the sums over nodes make of a kink at each node, (n, m)."""
        first, second = (0.5 * math.pi / len(axis.place) * np.sqrt(half**2 - axis.place**2)
                         for axis, half in zip(self._nodes, (1.0, self.ratio), strict=True))
        return lattice_errors(first[:, None], second)

    def compliance(self, a0: float) -> tuple[ComplexArray, ComplexArray]:
        """
        Solve at one frequency, G = rho = 1 at the surface.

        Returns
        -------
        compliance : (6, 6) complex array
            Over (x, y, z, rx, ry, rz), z up.
        motion : (p, 3, 6) complex array
            Of the points along x, y, z (up) per force and moment on the rectangle.

        """
        x, y = self._nodes
        swinging = self.waves.at(a0)
        waves = wave_kernels(swinging, x.apart[:, None], y.apart)
        kinks = mended(swinging, *self._lattice)
        compliance = np.zeros((6, 6), dtype=complex)
        forces = np.zeros((3, 2 * len(x.place), 2 * len(y.place), 6), dtype=complex)
        for number, (parity, motions) in enumerate(_CLASSES):
            flexibility = self._flexibility(number, waves, kinks)
            rigid = np.stack([self._rigid(parity, motion) for motion in motions.values()], axis=1)
            traction = np.linalg.solve(flexibility, rigid)
            found = np.linalg.inv(4.0 * rigid.T @ traction)
            dofs = list(motions)
            compliance[np.ix_(dofs, dofs)] = found
            forces[..., dofs] = self._spread(parity, traction @ found)
        motion = motion_by_forces(swinging, self.points, self._grid) @ forces.reshape(-1, 6)
        return compliance, upwards(motion, len(self.points))

    def _flexibility(self, number: int, waves: WaveKernels, kinks: ComplexArray) -> ComplexArray:
        """Return the matrix of Galerkin's equations of a class over x, y, z."""
        (x, y), vertical = self._nodes, _CLASSES[number][0]
        blocks = {}
        for pair in PAIRS:
            source = _parity(vertical, pair[1])
            blocks[pair] = self._at_rest[number][pair] + _reduced(
                x, y, waves[pair], odd=ODD[pair], source=source)
            if pair[0] == pair[1]:
                blocks[pair] = blocks[pair] + _weighted(
                    x.functions[source[0]], y.functions[source[1]], kinks['xyz'.index(pair[0])])
        full = np.block([[blocks['xx'], blocks['xy'], blocks['xz']],
                         [blocks['xy'].T, blocks['yy'], blocks['yz']],
                         [blocks['xz'].T, blocks['yz'].T, blocks['zz']]])
        return np.asarray(full / (2.0 * math.pi * (1.0 + 1j * self.waves.loss_factor)))

    def _rigid(
        self, vertical: Parity, motion: tuple[tuple[str, float, int, int], ...],
    ) -> FloatArray:
        """Return what a rigid motion does to the functions of a class, (3 f,)."""
        x, y = self._nodes
        count = x.functions[1].shape[1] * y.functions[1].shape[1]
        found = np.zeros((3, count))
        for component, sign, in_x, in_y in motion:
            ex, ey = _parity(vertical, component)
            found['xyz'.index(component)] = sign * np.kron(
                x.functions[ex].T @ x.place**in_x, y.functions[ey].T @ y.place**in_y)
        return found.ravel()

    @cached_property
    def _grid(self) -> FloatArray:
        """Nodes of the whole rectangle, (4 n m, 2)."""
        x, y = (np.concatenate([-axis.place[::-1], axis.place]) for axis in self._nodes)
        return np.stack(np.meshgrid(x, y, indexing='ij'), axis=-1).reshape(-1, 2)

    def _spread(self, vertical: Parity, traction: ComplexArray) -> ComplexArray:
        """Return the forces at all nodes, (3, 2 n, 2 m, d), from those of functions (3 f, d)."""
        parts = []
        for component, own in zip('xyz', np.split(traction, 3), strict=True):
            x, y = (np.concatenate([parity * axis.functions[parity][::-1],
                                    axis.functions[parity]])
                    for axis, parity in zip(self._nodes, _parity(vertical, component),
                                            strict=True))
            parts.append(np.einsum('im,kn,mnd->ikd', x, y, own.reshape(
                x.shape[1], y.shape[1], -1)))
        return np.stack(parts)


def _weighted(x: FloatArray, y: FloatArray, values: ComplexArray) -> ComplexArray:
    """Return products of functions over nodes (n, f), (m, g) with values (n, m), (f g, f g)."""
    across = np.einsum('im,ip,ik->mpk', x, x, values)
    found: ComplexArray = np.einsum('mpk,kn,kq->mnpq', across, y, y)
    return found.reshape(x.shape[1] * y.shape[1], -1)


@lru_cache(maxsize=16)
def _kernels_at_rest(
    ratio: float, functions: tuple[int, int], poisson_ratio: float,
) -> tuple[StaticKernels, ...]:
    cells = max(1, round(_CELLS * math.sqrt(ratio)))
    meshes = []
    for refined in (COARSE, FINE):
        x = _Axis.of_cells(1.0, _CELLS * refined, functions[0])
        y = _Axis.of_cells(ratio, cells * refined, functions[1])
        kernels = static_kernels(poisson_ratio, primitives(x.apart[:, None], y.apart))
        meshes.append([{pair: _reduced(
            x, y, kernels[pair], odd=ODD[pair], source=_parity(vertical, pair[1]))
            for pair in PAIRS} for vertical, _ in _CLASSES])
    coarse, fine = meshes
    share = COARSE**2 / (FINE**2 - COARSE**2)
    return tuple({pair: (1.0 + share) * better[pair] - share * rough[pair] for pair in PAIRS}
                 for rough, better in zip(coarse, fine, strict=True))
