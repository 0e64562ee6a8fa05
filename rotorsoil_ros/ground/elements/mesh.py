"""
Where do the quadratic elements lie, and what are their matrices before any soil is known.

Lengths are in units of the contact's radius or half-width: the contact is x <= 1 on z = 0.
"""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
import math
from typing import Any

import numpy as np
from skfem import (  # type: ignore[import-untyped]
    Basis,
    BilinearForm,
    ElementQuad2,
    MeshQuad,
)

from rotorsoil_ros.arrays import FloatArray, IntArray
from rotorsoil_ros.errors import require

# Measured in docs/convergence.md: with these, over 0.05 <= a0 <= 6 and nu <= 0.45, every term
# of strip and disc stays within 0.2 % of a converged mesh; beyond, up to a0 = 20, within 0.3 %.
LARGEST_CELL = 0.2
CELL_TIMES_A0 = 1.3
# Below a0 = 0.05 the radiation of a rocking or twisting disc is less than 1e-4 of its compliance;
# only a wider near field separates it from the error of the static far field.
WIDTHS = ((0.05, 1.4), (0.02, 1.6), (0.0, 2.0))

# The first two rings around the edge shrink slowly because a wave still has to be resolved there,
# the others fast because only the singularity r^(1/2 +- i eps) is left.
WAVE_RINGS = (1.0, 0.75, 0.5)


@dataclass(frozen=True, slots=True)
class Discretisation:
    """
    How fine the near field is and how many waves leave each of its boundary nodes.

    Attributes
    ----------
    cell : float
        Edge of an element beside the contact edge, before refinement.
    width, depth : float
        Extent of the near field along the surface and into the soil.
    rings : int
        Rings of elements that shrink towards the contact edge.
    ring_ratio : float
        Size of each ring over that of the one around it.
    cells_beside_edge : int
        Cells to either side of the edge that the rings replace; a quarter of the elements that
        surround the edge in each ring.
    orders : int
        Radial functions per wave (P, S and Rayleigh): leading order and its successors.

    """

    cell: float
    width: float
    depth: float
    rings: int = 5
    ring_ratio: float = 0.4
    cells_beside_edge: int = 2
    orders: int = 3

    def __post_init__(self) -> None:
        require(0.0 < self.box < 1.0, 'half-width of the refined box', 'in (0, 1) [-]', self.box)
        require(self.width >= 1.0 + self.box - 1e-9, 'width of the near field',
                f'>= {1.0 + self.box:g} [-], the end of the refined box', self.width)
        require(self.depth >= self.box - 1e-9, 'depth of the near field',
                f'>= {self.box:g} [-], that of the refined box', self.depth)

    @property
    def box(self) -> float:
        """Half-width and depth of the box around the edge that the rings fill."""
        return self.cells_beside_edge * self.cell


def discretisation_for(a0_min: float, a0_max: float) -> Discretisation:
    """Return mesh and functions for a range of dimensionless frequencies."""
    cell = min(LARGEST_CELL, CELL_TIMES_A0 / a0_max)
    width = next(width for lowest, width in WIDTHS if a0_min >= lowest)
    return Discretisation(cell=cell, width=width, depth=width - 0.4)


def near_field_mesh(discretisation: Discretisation) -> MeshQuad:
    """Return the quadrilaterals of the box [0, width] x [0, depth], graded to the edge (1, 0)."""
    scales = [discretisation.box * scale for scale in WAVE_RINGS]
    for _ in range(discretisation.rings):
        scales.append(scales[-1] * discretisation.ring_ratio)
    cells = discretisation.cells_beside_edge
    corners = np.concatenate([
        _grid_outside_box(discretisation),
        *(_ring(outer, inner, cells) for outer, inner in pairwise(scales)),
        _core(scales[-1], cells),
    ])
    # Twelve digits join what rounding separated; the smallest element edge is about 1e-4.
    points, index = np.unique(np.round(corners.reshape(-1, 2), 12), axis=0, return_inverse=True)
    quads = index.reshape(-1, 4).T
    along = points[quads[1]] - points[quads[0]]
    across = points[quads[3]] - points[quads[0]]
    clockwise = along[:, 0] * across[:, 1] < along[:, 1] * across[:, 0]
    quads[:, clockwise] = quads[::-1, clockwise]
    return MeshQuad(np.ascontiguousarray(points.T), np.ascontiguousarray(quads))


def _divided(start: float, stop: float, largest: float) -> FloatArray:
    count = math.ceil((stop - start) / largest - 1e-9)
    return np.linspace(start, stop, count + 1) if count > 0 else np.array([start])


def _cells(x: FloatArray, z: FloatArray) -> FloatArray:
    """Return the corners of a tensor grid's cells, (cells, 4, 2)."""
    left, top = np.meshgrid(x[:-1], z[:-1], indexing='ij')
    right, bottom = np.meshgrid(x[1:], z[1:], indexing='ij')
    corners = [(left, top), (right, top), (right, bottom), (left, bottom)]
    return np.array([[a.ravel(), b.ravel()] for a, b in corners]).transpose(2, 0, 1)


def _grid_outside_box(discretisation: Discretisation) -> FloatArray:
    """Return the cells of the near field that are not beside the edge."""
    cell, box, count = discretisation.cell, discretisation.box, discretisation.cells_beside_edge
    x = np.concatenate([
        # Under the contact the field varies with depth more than along x.
        _divided(0.0, 1.0 - box, 1.5 * cell)[:-1],
        np.linspace(1.0 - box, 1.0 + box, 2 * count + 1)[:-1],
        _divided(1.0 + box, discretisation.width, cell),
    ])
    z = np.concatenate([
        np.linspace(0.0, box, count + 1)[:-1],
        _divided(box, discretisation.depth, 0.75 * cell),
    ])
    cells = _cells(x, z)
    centre = cells.mean(axis=1)
    beside_edge = (np.abs(centre[:, 0] - 1.0) < box) & (centre[:, 1] < box)
    outside: FloatArray = cells[~beside_edge]
    return outside


def _perimeter(count: int) -> FloatArray:
    """Return the outline of [-1, 1] x [0, 1] from left over bottom to right, in 4 count parts."""
    up = np.linspace(0.0, 1.0, count + 1)
    across = np.linspace(-1.0, 1.0, 2 * count + 1)
    left = np.column_stack([np.full(up.size, -1.0), up])
    bottom = np.column_stack([across, np.ones(across.size)])[1:]
    right = np.column_stack([np.ones(up.size), up[::-1]])[1:]
    return np.concatenate([left, bottom, right])


def _ring(outer: float, inner: float, count: int) -> FloatArray:
    outline = _perimeter(count)
    edge = np.array([1.0, 0.0])
    outside, inside = edge + outer * outline, edge + inner * outline
    return np.stack([outside[:-1], outside[1:], inside[1:], inside[:-1]], axis=1)


def _core(size: float, count: int) -> FloatArray:
    across = np.linspace(1.0 - size, 1.0 + size, 2 * count + 1)
    return _cells(across, np.linspace(0.0, size, count + 1))


# A gradient or value of a shape function u at the quadrature points w.
Operator = Callable[[Any, Any], FloatArray]


class NearField:
    """
    Quadratic elements of the near field and their scalar matrices.

    Every symmetry class of strip and disc is a combination of the same few scalar matrices,
    int g_i h_j r dr dz with g, h in {d/dx, d/dz, 1/r}, and of the mass int N_i N_j r dr dz
    (a strip has neither 1/r nor the weight r). They know neither soil nor frequency.

    Attributes
    ----------
    coordinates : (2, n) float array
        Position (x, z) of every scalar degree of freedom.
    rows, columns : (m,) int arrays
        Degrees of freedom that each entry of the element matrices joins.
    gradients : (g, g, m) float array
        Entries of int g_i h_j; g = 3 for the disc, 2 for the strip.
    mass : (m,) float array
        Entries of int N_i N_j.
    boundary : (e, 3) int array
        Degrees of freedom of each boundary edge, in order from the surface to the axis.

    """

    def __init__(self, discretisation: Discretisation, *, axisymmetric: bool) -> None:
        mesh = near_field_mesh(discretisation)
        basis = Basis(mesh, ElementQuad2(), intorder=5)
        self.coordinates: FloatArray = basis.doflocs
        operators = _OPERATORS[:3 if axisymmetric else 2]

        def entries(test: Operator, trial: Operator) -> Any:
            form = BilinearForm(
                lambda u, v, w: test(v, w) * trial(u, w) * (w.x[0] if axisymmetric else 1.0))
            return form.coo_data(basis)

        mass = entries(_value, _value)
        self.rows, self.columns = mass.indices
        self.mass: FloatArray = mass.data
        self.gradients: FloatArray = np.array([
            [entries(test, trial).data for trial in operators] for test in operators])
        self.boundary = _far_edges(basis, discretisation)

    @property
    def size(self) -> int:
        """Number of scalar degrees of freedom."""
        return int(self.coordinates.shape[1])


def _value(u: Any, w: Any) -> Any:
    return u


_OPERATORS: tuple[Operator, ...] = (
    lambda u, w: u.grad[0],
    lambda u, w: u.grad[1],
    lambda u, w: u / w.x[0],
)


def _far_edges(basis: Basis, discretisation: Discretisation) -> IntArray:
    mesh = basis.mesh
    on_side = mesh.facets_satisfying(lambda x: np.isclose(x[0], discretisation.width))
    on_bottom = mesh.facets_satisfying(lambda x: np.isclose(x[1], discretisation.depth))
    facets = np.concatenate([on_side, on_bottom])
    ends = mesh.facets[:, facets]
    edges: IntArray = np.array([basis.nodal_dofs[0, ends[0]], basis.facet_dofs[0, facets],
                      basis.nodal_dofs[0, ends[1]]]).T
    x, z = basis.doflocs
    turned = np.arctan2(z, x)[edges[:, 0]] > np.arctan2(z, x)[edges[:, 2]]
    edges[turned] = edges[turned, ::-1]
    return edges
