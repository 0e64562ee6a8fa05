"""What contacts of any plan on the ground give way by, alone or several: patches of traction."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
import math

import numpy as np

from rotorsoil_ros.arrays import ComplexArray, FloatArray, IntArray
from rotorsoil_ros.ground.boundary.effort import COARSE, FINE, halves, patch_unknowns
from rotorsoil_ros.ground.boundary.kernels import (
    assembled,
    GroundWaves,
    motion_by_forces,
    ODD,
    PAIRS,
    SwingingWaves,
    upwards,
    wave_kernels,
    WaveKernels,
)
from rotorsoil_ros.ground.boundary.lattice import lattice_errors, mended
from rotorsoil_ros.ground.boundary.statics import primitives, static_kernels, StaticKernels
from rotorsoil_ros.ground.plan import Part

# Edges this near to each other, over the side that they lie on, are one.
_TOUCH = 1e-9


@dataclass(frozen=True, eq=False)
class _Patches:
    """
    Graded patches of one rectangle.

    Attributes
    ----------
    edges : two float arrays
        Lines along x and y.
    nodes : two float arrays
        What stands for the patches between the lines, for waves.
    spacing : two float arrays
        Of the nodes.

    """

    edges: tuple[FloatArray, FloatArray]
    nodes: tuple[FloatArray, FloatArray]
    spacing: tuple[FloatArray, FloatArray]

    @classmethod
    def of(cls, part: Part, counts: tuple[int, int], seams: tuple[bool, ...]) -> '_Patches':
        """Divide a rectangle; seams tell which of its sides -x, +x, -y, +y go on beyond."""
        lines = [_graded(middle, half, count, free) for middle, half, count, free in zip(
            (part.x, part.y), (part.half_width, part.half_length), counts,
            ((not seams[0], not seams[1]), (not seams[2], not seams[3])), strict=True)]
        edges, nodes, spacing = zip(*lines, strict=True)
        return cls(edges, nodes, spacing)

    @cached_property
    def areas(self) -> FloatArray:
        """Area of each patch, (n, m)."""
        return np.outer(*(np.diff(edges) for edges in self.edges))

    @cached_property
    def places(self) -> FloatArray:
        """Node of each patch, (n m, 2)."""
        return _grid(*self.nodes)

    @cached_property
    def centroids(self) -> FloatArray:
        """Middle of each patch, (n m, 2)."""
        return _grid(*(0.5 * (edges[1:] + edges[:-1]) for edges in self.edges))


def _grid(x: FloatArray, y: FloatArray) -> FloatArray:
    return np.stack(np.meshgrid(x, y, indexing='ij'), axis=-1).reshape(-1, 2)


def _graded(
    middle: float, half: float, count: int, free: tuple[bool, bool],
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return edges, nodes and their spacing along a side, fine towards free ends."""
    share = np.arange(2 * count + 1) / (2 * count)
    if free == (True, True):
        position, slope = -np.cos(math.pi * share), math.pi * np.sin(math.pi * share)
    elif free == (False, False):
        position, slope = 2.0 * share - 1.0, np.full_like(share, 2.0)
    else:
        position = 1.0 - 2.0 * np.cos(0.5 * math.pi * share)
        slope = math.pi * np.sin(0.5 * math.pi * share)
        if free[1]:
            position, slope = -position[::-1], slope[::-1]
    line = middle + half * position
    return line[::2], line[1::2], half * slope[1::2] / count


def _static_between(receiver: _Patches, source: _Patches) -> dict[str, FloatArray]:
    """Return mean static shapes over patches by unit forces spread over others, (p, n)."""
    x, y = (mine[:, None] - other for mine, other in zip(
        receiver.edges, source.edges, strict=True))
    area = receiver.areas.reshape(-1, 1) * source.areas.ravel()
    found = {}
    for name, values in primitives(x[:, :, None, None], y).items():
        for axis in range(4):
            values = np.diff(values, axis=axis)
        count = receiver.areas.size
        found[name] = values.transpose(0, 2, 1, 3).reshape(count, -1) / area
    return found


@dataclass(frozen=True, eq=False)
class _Mesh:
    """
    Patches of all blocks, one mesh.

    Attributes
    ----------
    patches : sequence of _Patches
        Of all parts of all blocks.
    block : (n,) int array
        To which block each patch belongs.
    centres : (k, 2) float array
        Of the blocks.
    poisson_ratio : float
        nu [-].

    """

    patches: Sequence[_Patches]
    block: IntArray
    centres: FloatArray
    poisson_ratio: float

    @cached_property
    def places(self) -> FloatArray:
        """Nodes of all patches, (n, 2)."""
        return np.concatenate([one.places for one in self.patches])

    @cached_property
    def _at_rest(self) -> StaticKernels:
        rows = [[_static_between(one, other) for other in self.patches] for one in self.patches]
        shapes = {name: np.block([[entry[name] for entry in row] for row in rows])
                  for name in rows[0][0]}
        return static_kernels(self.poisson_ratio, shapes)

    @cached_property
    def _lattice(self) -> tuple[FloatArray, FloatArray]:
        found = [lattice_errors(one.spacing[0][:, None], one.spacing[1]) for one in self.patches]
        of_r, of_difference = (np.concatenate([part.ravel() for part in parts])
                               for parts in zip(*found, strict=True))
        return of_r, of_difference

    @cached_property
    def _rigid(self) -> FloatArray:
        """Motion (x, y, z down) of all patches with their blocks, z up, (3 n, 6 k)."""
        middle = np.concatenate([one.centroids for one in self.patches])
        x, y = (middle - self.centres[self.block]).T
        one, none = np.ones_like(x), np.zeros_like(x)
        motion = np.array([[one, none, none, none, none, -y],
                           [none, one, none, none, none, x],
                           [none, none, -one, -y, x, none]])
        found = np.zeros((3, len(x), len(self.centres), 6))
        found[:, np.arange(len(x)), self.block] = motion.transpose(0, 2, 1)
        return found.reshape(3 * len(x), -1)

    def compliance(
        self, waves: SwingingWaves, points: FloatArray,
    ) -> tuple[ComplexArray, ComplexArray]:
        """Return compliance (6 k, 6 k) and motion of points (p, 3, 6 k), as the solver."""
        swinging = self._waves(waves)
        flexibility = assembled({
            pair: self._at_rest[pair] + swinging[pair] for pair in PAIRS}) / (
                2.0 * math.pi * (1.0 + 1j * waves.loss_factor))
        traction = np.linalg.solve(flexibility, self._rigid)
        stiffness = self._rigid.T @ traction
        compliance = np.linalg.inv(0.5 * (stiffness + stiffness.T))
        motion = motion_by_forces(waves, points, self.places) @ (traction @ compliance)
        return np.asarray(compliance), upwards(motion, len(points))

    def _waves(self, waves: SwingingWaves) -> WaveKernels:
        """Return the waves between all nodes, (n, n); each pair is computed once."""
        places = self.places
        first, second = np.triu_indices(len(places), 1)
        x, y = (places[first] - places[second]).T
        own = mended(waves, *self._lattice)
        found = {}
        for pair, values in wave_kernels(waves, x, y).items():
            full = np.zeros((len(places), len(places)), dtype=complex)
            full[first, second] = values
            full[second, first] = values if ODD[pair][0] is ODD[pair][1] else -values
            if pair[0] == pair[1]:
                np.fill_diagonal(full, own['xyz'.index(pair[0])])
            found[pair] = full
        return found


@dataclass(frozen=True, eq=False)
class PatchSolver:
    """
    Rigid contacts of any plan, welded to one ground.

    Attributes
    ----------
    waves : GroundWaves
        Of the ground, as far as the farthest two patches or points are apart.
    blocks : tuple of tuples of Part
        The rectangles of each block, in one frame.
    centres : (k, 2) float array
        About which each block turns.
    highest : float
        omega / c_s up to which patches are small enough.
    points : (p, 2) float array
        Where on the ground motion is wanted too, outside the blocks.

    Notes
    -----
    The unknowns are the forces on patches: spread evenly for the static kernels, which are
    averaged over the patch that moves, and on a node for the waves. Patches shrink towards free
    edges as the cosine of an even division, and the compliances of two meshes are extrapolated.

    References
    ----------
    Wong & Luco (1978), J. Geotech. Eng. Div. 104, p. 1501; several blocks: Wong & Luco (1986),
    Soil Dyn. Earthquake Eng. 5, p. 149.

    """

    waves: GroundWaves
    blocks: tuple[tuple[Part, ...], ...]
    centres: FloatArray
    highest: float
    points: FloatArray

    @property
    def unknowns(self) -> int:
        """Unknowns of the finer mesh."""
        return patch_unknowns(self.blocks, self.highest)

    @cached_property
    def _meshes(self) -> tuple[_Mesh, _Mesh]:
        coarse, fine = (self._mesh(refined) for refined in (COARSE, FINE))
        return coarse, fine

    def _mesh(self, refined: int) -> _Mesh:
        patches, block = [], []
        for number, parts in enumerate(self.blocks):
            for part in parts:
                across, along = halves(part, parts, self.highest)
                patches.append(_Patches.of(part, (refined * across, refined * along),
                                           seams(part, parts)))
                block += [number] * patches[-1].areas.size
        return _Mesh(patches, np.array(block), self.centres, self.waves.poisson_ratio)

    def compliance(self, a0: float) -> tuple[ComplexArray, ComplexArray]:
        """
        Solve at one frequency, G = rho = 1 at the surface.

        Returns
        -------
        compliance : (6 k, 6 k) complex array
            Over (x, y, z, rx, ry, rz) of each block, z up.
        motion : (p, 3, 6 k) complex array
            Of the points along x, y, z (up) per force and moment on the blocks.

        """
        waves = self.waves.at(a0)
        rough, better = (mesh.compliance(waves, self.points) for mesh in self._meshes)
        share = COARSE**2 / (FINE**2 - COARSE**2)
        compliance, motion = ((1.0 + share) * fine - share * coarse
                              for coarse, fine in zip(rough, better, strict=True))
        return compliance, motion


def seams(part: Part, parts: Sequence[Part]) -> tuple[bool, ...]:
    """Return whether all of each side of a part, -x, +x, -y, +y, touches one other part."""
    found = []
    for axis, sign in ((0, -1), (0, 1), (1, -1), (1, 1)):
        side = part.edges[axis][sign > 0]
        low, high = part.edges[1 - axis]
        slack = _TOUCH * (high - low)
        found.append(any(
            abs(other.edges[axis][sign < 0] - side) <= slack
            and other.edges[1 - axis][0] <= low + slack
            and other.edges[1 - axis][1] >= high - slack
            for other in parts if other is not part))
    return tuple(found)
