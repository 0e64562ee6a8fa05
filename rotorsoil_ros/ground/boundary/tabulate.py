"""Boundary elements for one site: the method that fits, and a table of its answers."""

from dataclasses import dataclass, replace
import math

import numpy as np

from rotorsoil_ros.arrays import ComplexArray, FloatArray, IntArray
from rotorsoil_ros.errors import require
from rotorsoil_ros.ground.boundary.effort import HIGHEST_POISSON_RATIO
from rotorsoil_ros.ground.boundary.kernels import GroundWaves
from rotorsoil_ros.ground.boundary.patches import PatchSolver
from rotorsoil_ros.ground.boundary.rectangle import RectangleSolver
from rotorsoil_ros.ground.boundary.site import Site
from rotorsoil_ros.ground.boundary.table import BoundaryTable, delays
from rotorsoil_ros.ground.boundary.waves import SurfaceWaves
from rotorsoil_ros.ground.joining import joined

# Lowest frequency that is solved, over the highest; below, the functions know themselves to be
# even and odd about zero.
_LOWEST = 0.01

# Largest error between the solved frequencies, of the geometric mean of two diagonals: of series,
# of patches, whose solves have some noise of their own, and what will do at worst.
_SERIES_TOLERANCE, _PATCH_TOLERANCE, _ACCEPTED = 5e-6, 3e-5, 1e-3

# Frequencies at which a table is looked at for energy, and how much more than what it gives there
# it has to lose.
_CHECKED = 400
_MARGIN = 1.5

# Entries below this share of their diagonals are zero by symmetry.
_NONE = 1e-10


@dataclass(frozen=True)
class SiteSolver:
    """The method that fits a site, x and y exchanged where a rectangle lies across."""

    method: RectangleSolver | PatchSolver
    lies_across: bool
    unknowns: int

    @classmethod
    def of(cls, site: Site, waves: GroundWaves, a0_max: float) -> 'SiteSolver':
        """Choose for waves as short as those of an a0."""
        points = np.array(site.points).reshape(-1, 2)
        part = site.rectangle
        if part is None:
            patches = PatchSolver(waves, site.placed, np.array(site.centres), a0_max, points)
            return cls(patches, False, patches.unknowns)
        across = part.half_width > part.half_length
        rectangle = RectangleSolver(waves, part.ratio, a0_max,
                                    points[:, ::-1] if across else points)
        return cls(rectangle, across, rectangle.unknowns)

    def solve(self, a0: float) -> ComplexArray:
        """Return compliance above motion of the points, (6 k + 3 p, 6 k), as its method."""
        compliance, motion = self.method.compliance(a0)
        if self.lies_across:
            # A mirror in x = y: it exchanges x and y and turns every rotation around.
            order, sign = [1, 0, 2, 4, 3, 5], np.array([1.0, 1.0, 1.0, -1.0, -1.0, -1.0])
            compliance = compliance[order][:, order] * np.outer(sign, sign)
            motion = motion[:, order[:3]][:, :, order] * sign
        return np.concatenate([compliance, motion.reshape(-1, compliance.shape[1])])


def tabulated(
    site: Site, *, poisson_ratio: float, loss_factor: float, a0_max: float,
) -> BoundaryTable:
    """
    Solve a site of unit length.

    Raises
    ------
    RotorSoilError
        If the kind of soil is out of reach.
    NotSolvedError
        If the frequencies do not join.

    """
    require(0.0 <= poisson_ratio <= HIGHEST_POISSON_RATIO, 'poisson_ratio',
            f'in [0, {HIGHEST_POISSON_RATIO}] for boundary elements', poisson_ratio)
    solver = SiteSolver.of(
        site, SurfaceWaves.of(poisson_ratio, loss_factor, 1.01 * a0_max * site.extent), a0_max)
    stiff = 1.0 + 1j * loss_factor
    entries = entries_of(solver.solve(_LOWEST * a0_max))
    rows, columns = entries.T
    ahead, slow = delays(site)[rows, columns], math.sqrt(abs(stiff))

    tolerance = _PATCH_TOLERANCE if site.rectangle is None or site.points else _SERIES_TOLERANCE

    def solve(point: complex) -> ComplexArray:
        found = solver.solve(abs(point) * slow)[rows, columns]
        return np.asarray(found * stiff * np.exp(point * ahead))

    found = joined('these contacts by boundary elements', solve, (_LOWEST * a0_max, a0_max),
                   loss_factor=loss_factor, scale=lambda values: scale_of(values, entries),
                   tolerance=tolerance, accepted=_ACCEPTED)
    return passive(BoundaryTable(site, poisson_ratio, loss_factor, a0_max, found.function, entries,
                                 found.measured_error, found.solves, solver.unknowns))


def passive(table: BoundaryTable) -> BoundaryTable:
    """Return a table whose loss is just large enough that it gives energy nowhere."""
    a0 = checked_at(table.a0_max)
    size = 6 * len(table.site.blocks)
    own = table.values(np.zeros(1), 0.0)[0, :size].diagonal().real.astype(float)
    # What a late share of one would dissipate of each static compliance.
    late = a0 / (1.0 + a0**2)
    return replace(table, loss=max(needed_loss(
        table.values(a0, loss_factor)[:, :size], own, late)
        for loss_factor in {0.0, table.loss_factor}))


def checked_at(a0_max: float) -> FloatArray:
    """Return the frequencies > 0 at which a table is looked at for energy."""
    found: FloatArray = a0_max * np.linspace(0.0, 1.0, _CHECKED)[1:] ** 2
    return found


def needed_loss(values: ComplexArray, at_rest: FloatArray, late: FloatArray) -> float:
    """
    Return which share of its static compliance each motion has to lose so that none gives.

    Parameters
    ----------
    values : (n, d, d) complex array
        Compliance.
    at_rest : (d,) float array
        Its diagonal at rest.
    late : (n,) float array
        What a share of one dissipates of each static compliance.

    """
    own = np.sqrt(at_rest)
    gain = -np.linalg.eigvalsh(-values.imag / np.outer(own, own))[:, 0]
    return _MARGIN * max(0.0, float((gain / late).max()))


def entries_of(found: ComplexArray) -> IntArray:
    """Return row and column of what is not zero by symmetry or reciprocity, (q, 2)."""
    size = found.shape[1]
    own = np.sqrt(np.abs(np.diagonal(found)))
    scale = np.concatenate([own, np.full(len(found) - size, own.min())])
    there = np.abs(found) > _NONE * np.outer(scale, own)
    # A motion that vanishes at one frequency does not at another.
    there[size:] = True
    return np.argwhere(np.triu(there) | (np.arange(len(found)) >= size)[:, None])


def scale_of(values: ComplexArray, entries: IntArray) -> FloatArray:
    """Return what an error of each entry is measured against, (n, q)."""
    rows, columns = entries.T
    size = columns.max() + 1
    own = np.zeros((len(values), size))
    diagonal = rows == columns
    own[:, rows[diagonal]] = np.sqrt(np.abs(values[:, diagonal]))
    scale = own[:, columns] * own[:, np.minimum(rows, size - 1)]
    # Of a point: the largest of its three motions by the same load, at this frequency.
    place, load = (rows - size) // 3, columns
    for number in np.unique(place[place >= 0]):
        for column in range(size):
            same = (place == number) & (load == column)
            largest = np.abs(values[:, same]).max(axis=1)
            scale[:, same] = np.maximum(largest, 0.1 * largest.max())[:, None]
    return scale
