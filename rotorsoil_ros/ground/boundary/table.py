"""What boundary elements know of a site: compliance without G, rho and size."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from rotorsoil_ros.arrays import ComplexArray, FloatArray, IntArray
from rotorsoil_ros.ground.boundary.site import Site
from rotorsoil_ros.ground.infinite_rational import RationalFunction
from rotorsoil_ros.ground.joining import laplace_point

# Part of every cache key: raise it when the method changes what a table says.
BOUNDARY_ALGORITHM = 1

# Rayleigh waves run at 0.87 to 0.96 of c_s: what they need from block to block is taken out of
# what is interpolated.
_SLOWNESS = 1.08


@dataclass(frozen=True, eq=False)
class BoundaryTable:
    """
    Compliance of a site of unit length on a half-space with G = rho = 1.

    Attributes
    ----------
    site : Site
        `scaled`.
    poisson_ratio, loss_factor : float
        nu and eta of the soil [-].
    a0_max : float
        Highest a0 that was solved [-]; the lowest is 0.
    function : RationalFunction
        Of the Laplace variable: elastic compliances and motions, each ahead by its delay.
    entries : (q, 2) int array
        Row and column of each: first those of the upper triangle of the compliance over the six
        degrees of freedom of each block, then below it those of x, y, z of each point.
    measured_error : float
        Largest error at frequencies that a fit had not seen, of sqrt(N_ii N_jj).
    solves, unknowns : int
        Number of exact solves, and unknowns of each.
    loss : float
        Share of each static compliance N_0 that follows its load late, loss N_0 / (1 + s): it
        dissipates at least what the error of solves and fit lets the rest give [-].

    """

    site: Site
    poisson_ratio: float
    loss_factor: float
    a0_max: float
    function: RationalFunction
    entries: IntArray
    measured_error: float
    solves: int
    unknowns: int
    loss: float = 0.0

    def values(self, a0: FloatArray, loss_factor: float) -> ComplexArray:
        """Return compliance above motion of the points, (n, 6 k + 3 p, 6 k), on such a soil."""
        point = laplace_point(a0, loss_factor)
        size = 6 * len(self.site.blocks)
        rows, columns = self.entries.T
        ahead = delays(self.site)[rows, columns]
        found = spread(self.function(point) * np.exp(-np.outer(point, ahead)) / (
            1.0 + 1j * loss_factor), self.entries, self.site)
        own = np.arange(size)
        found[:, own, own] += self.loss * self._at_rest / (
            (1.0 + point) * (1.0 + 1j * loss_factor))[:, None]
        return found

    @cached_property
    def _at_rest(self) -> FloatArray:
        """Diagonal of the elastic compliance at rest, (6 k,)."""
        diagonal = self.entries[:, 0] == self.entries[:, 1]
        found = np.zeros(6 * len(self.site.blocks))
        found[self.entries[diagonal, 0]] = self.function(np.zeros(1, dtype=complex))[
            0, diagonal].real
        return found

    def to_arrays(self) -> dict[str, npt.NDArray[Any]]:
        """Return the table as plain arrays; its site is part of the key it is found by."""
        return {
            'kind': np.array([self.poisson_ratio, self.loss_factor, self.a0_max,
                              self.measured_error, self.solves, self.unknowns, self.loss]),
            'support': self.function.support, 'values': self.function.values,
            'weights': self.function.weights, 'entries': self.entries}

    @classmethod
    def from_arrays(
        cls, site: Site, arrays: Mapping[str, npt.NDArray[Any]],
    ) -> 'BoundaryTable':
        """Return the table that `to_arrays` took apart."""
        (poisson_ratio, loss_factor, a0_max, measured, solves, unknowns,
         loss) = arrays['kind'].tolist()
        function = RationalFunction(*(arrays[name] for name in ('support', 'values', 'weights')))
        return cls(site, poisson_ratio, loss_factor, a0_max, function, arrays['entries'],
                   measured, int(solves), int(unknowns), loss)


def spread(values: ComplexArray, entries: IntArray, site: Site) -> ComplexArray:
    """Return entries, (n, q), at their places and at those reciprocal, (n, 6 k + 3 p, 6 k)."""
    size, (rows, columns) = 6 * len(site.blocks), entries.T
    found = np.zeros((len(values), size + 3 * len(site.points), size), dtype=complex)
    found[:, rows, columns] = values
    inside = rows < size
    found[:, columns[inside], rows[inside]] = values[:, inside]
    return found


def delays(site: Site) -> FloatArray:
    """Return how long waves need for compliance and motion, over c_s, (6 k + 3 p, 6 k)."""
    between, to_points = site.delays()
    apart = np.concatenate([between.repeat(6, axis=0), to_points.repeat(3, axis=0)])
    return _SLOWNESS * apart.repeat(6, axis=1)
