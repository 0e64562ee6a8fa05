"""Boundary elements for one site on layers: a table of their answers, piece by piece."""

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from rotorsoil_ros.arrays import ComplexArray, FloatArray
from rotorsoil_ros.ground.boundary.reflections import LayeredWaves
from rotorsoil_ros.ground.boundary.tabulate import (
    checked_at,
    entries_of,
    needed_loss,
    scale_of,
    SiteSolver,
)
from rotorsoil_ros.ground.layers.cutoffs import singular_frequencies
from rotorsoil_ros.ground.layers.joining import joined_pieces, SolveMany

if TYPE_CHECKING:
    from rotorsoil_ros.ground.boundary.layered_model import LayeredSite, LayeredSiteTable

# Largest error between the solved frequencies, of the geometric mean of two diagonals, and what
# of it is round-off of the waves near rest.
_TOLERANCE, _NOISE = 2e-4, 5e-5

# Where entries that vanish by symmetry are told from others, of the highest frequency: anywhere.
_ANYWHERE = 0.37


def solver_of(of: 'LayeredSite', span: tuple[float, float]) -> tuple[SiteSolver, int]:
    """Return what solves frequencies between two, and the nodes that it has over the depth."""
    waves = LayeredWaves.of(of.ground, of.site.extent, lowest=span[0], highest=span[1])
    # One mesh for all spans: where pieces meet they say the same.
    return SiteSolver.of(of.site, waves, of.shortest), waves.nodes


def tabulated_on_layers(of: 'LayeredSite') -> 'LayeredSiteTable':
    """
    Solve a site of unit length on layers.

    Raises
    ------
    NotSolvedError
        If the frequencies do not join.

    """
    from rotorsoil_ros.ground.boundary.layered_model import LayeredSiteTable

    anywhere = _ANYWHERE * of.a0_max
    entries = entries_of(solver_of(of, (anywhere, of.a0_max))[0].solve(anywhere))
    rows, columns = entries.T

    def solver(span: tuple[float, float]) -> tuple[SolveMany, int]:
        method, nodes = solver_of(of, span)

        def solve(a0: FloatArray) -> ComplexArray:
            return np.array([method.solve(one)[rows, columns] for one in a0.tolist()])

        return solve, nodes

    functions = joined_pieces(
        solver, singular_frequencies(of.ground, of.a0_max), of.a0_max,
        scale=lambda values: scale_of(values, entries), tolerance=_TOLERANCE,
        noise=_NOISE)
    return _passive(LayeredSiteTable(of, functions, entries))


def _passive(table: 'LayeredSiteTable') -> 'LayeredSiteTable':
    """Return a table whose loss is just large enough that it gives energy nowhere."""
    a0 = checked_at(table.of.a0_max)
    values = table.values(a0)
    return replace(table, loss=needed_loss(
        values[:, :values.shape[2]], table.at_rest, a0 / (1.0 + a0**2)))
