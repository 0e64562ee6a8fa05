"""What blocks of any plan on layers give way by, from boundary elements on layered ground."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
import itertools
import math
from typing import Any

import numpy as np
import numpy.typing as npt

from rotorsoil_ros.arrays import ComplexArray, FloatArray, IntArray
from rotorsoil_ros.errors import require
from rotorsoil_ros.ground.boundary.effort import (
    highest_a0,
    HIGHEST_POISSON_RATIO,
    require_solvable,
)
from rotorsoil_ros.ground.boundary.model import SiteGround
from rotorsoil_ros.ground.boundary.site import Site
from rotorsoil_ros.ground.boundary.table import spread
from rotorsoil_ros.ground.layers.profile import Layer, LayeredSoil
from rotorsoil_ros.ground.layers.table import LayeredTable
from rotorsoil_ros.ground.soil import Soil

# Part of every cache key: raise it when the method changes what a table says.
LAYERED_SITE_ALGORITHM = 2

# Waves that come back from below the uppermost layer are smooth over its thickness: elements are
# as small as for waves of this a0 over it. A thinner one, of the shortest half side, would need
# more elements than can be solved.
_PER_THICKNESS = 1.0
_THINNEST = 0.1

# Ratios are kept to so many digits: what differs by round-off is one ground.
_DIGITS = 11


@dataclass(frozen=True, slots=True)
class LayeredSite:
    """
    Layers and what stands on them, in units of the uppermost layer and of the site's length.

    Attributes
    ----------
    ground : LayeredSoil
        G and rho of the uppermost layer are one; no two neighbours are of one soil.
    site : Site
        `scaled`.
    a0_max : float
        omega b / c_s of the uppermost layer up to which a table reaches [-].

    """

    ground: LayeredSoil
    site: Site
    a0_max: float

    @classmethod
    def of(cls, ground: LayeredSoil, site: Site, *, omega_max: float) -> 'LayeredSite':
        """
        Return the proportions of a ground in SI units, for frequencies up to one in [rad/s].

        Raises
        ------
        RotorSoilError
            If layers, blocks or range are beyond the method's reach.

        """
        top, scaled = ground.soils[0], site.scaled()
        require(top.poisson_ratio <= HIGHEST_POISSON_RATIO, 'poisson_ratio',
                f'<= {HIGHEST_POISSON_RATIO} for boundary elements', top.poisson_ratio)

        def ratio(value: float) -> float:
            return float(f'{value:.{_DIGITS}g}')

        def over_top(soil: Soil) -> Soil:
            return replace(soil, shear_modulus=ratio(soil.shear_modulus / top.shear_modulus),
                           density=ratio(soil.density / top.density))

        joined = _joined(ground.changed(over_top))
        if joined.layers:
            require(joined.layers[0].thickness >= _THINNEST * site.length, 'thickness',
                    f'>= {_THINNEST * site.length:.3g} m, {_THINNEST:g} of the shortest half side '
                    f'of a block, of the uppermost layer for boundary elements',
                    joined.layers[0].thickness)
        own = replace(joined, layers=tuple(
            replace(layer, thickness=ratio(layer.thickness / site.length))
            for layer in joined.layers))
        found = cls(own, scaled, highest_a0(
            scaled, omega_max * site.length / top.shear_wave_speed))
        require_solvable(scaled, found.shortest)
        return found

    @property
    def shortest(self) -> float:
        """The a0 whose waves are as short as anything that elements have to tell [-]."""
        slowest = min(soil.shear_wave_speed for soil in self.ground.soils)
        thickness = self.ground.layers[0].thickness if self.ground.layers else math.inf
        return max(self.a0_max / slowest, _PER_THICKNESS / thickness)

    def table(self) -> 'LayeredSiteTable':
        """
        Solve for the compliances of this site.

        Raises
        ------
        NotSolvedError
            If the frequencies do not join.

        """
        # Here and not above: Hankel functions and splines take 0.1 s to import, and a stored
        # table needs none.
        from rotorsoil_ros.ground.boundary.layered_tabulate import tabulated_on_layers

        return tabulated_on_layers(self)


def _joined(ground: LayeredSoil) -> LayeredSoil:
    """Return layers of which no two neighbours are of one soil."""
    kept: list[Layer] = []
    for soil, layers in itertools.groupby(ground.layers, lambda layer: layer.soil):
        kept.append(Layer(sum(layer.thickness for layer in layers), soil))
    if kept and kept[-1].soil == ground.below:
        kept.pop()
    return LayeredSoil(tuple(kept), ground.below)


@dataclass(frozen=True, slots=True, eq=False)
class LayeredSiteTable:
    """
    Compliance of a site of unit length on layers, G = rho = 1 at the surface.

    Attributes
    ----------
    of : LayeredSite
        What was solved.
    functions : LayeredTable
        Of a0, one of each entry.
    entries : (q, 2) int array
        Row and column of each, as in `BoundaryTable`.
    loss : float
        Share of each static compliance that follows its load late, as in `BoundaryTable` [-].

    """

    of: LayeredSite
    functions: LayeredTable
    entries: IntArray
    loss: float = 0.0

    def values(self, a0: FloatArray) -> ComplexArray:
        """Return compliance above motion of the points, (n, 6 k + 3 p, 6 k)."""
        found = spread(self.functions.compliance(a0), self.entries, self.of.site)
        if self.loss:
            own = np.arange(found.shape[2])
            found[:, own, own] += self.loss * self.at_rest / (1.0 + 1j * a0)[:, None]
        return found

    @property
    def at_rest(self) -> FloatArray:
        """Real diagonal of the compliance at rest, (6 k,)."""
        diagonal = self.entries[:, 0] == self.entries[:, 1]
        found = np.zeros(6 * len(self.of.site.blocks))
        found[self.entries[diagonal, 0]] = self.functions.compliance(np.zeros(1))[
            0, diagonal].real
        return found

    def to_arrays(self) -> dict[str, npt.NDArray[Any]]:
        """Return the table as plain arrays; what was solved is part of its key."""
        return {**self.functions.to_arrays(), 'entries': self.entries,
                'loss': np.array(self.loss)}

    @classmethod
    def from_arrays(
        cls, of: LayeredSite, arrays: Mapping[str, npt.NDArray[Any]],
    ) -> 'LayeredSiteTable':
        """Return the table that `to_arrays` took apart."""
        return cls(of, LayeredTable.from_arrays(arrays), arrays['entries'],
                   float(arrays['loss']))


@dataclass(frozen=True, slots=True)
class LayeredSiteModel(SiteGround):
    """
    Rigid massless contacts welded to the surface of layers, coupled through them.

    Attributes
    ----------
    ground : LayeredSoil
        Layers on a half-space or on rigid rock; a loss factor of at least 0.005 everywhere.
    site : Site
        Blocks, and points on the ground whose motion is asked for.
    table : LayeredSiteTable
        Solved for these proportions.

    """

    ground: LayeredSoil
    site: Site
    table: LayeredSiteTable

    @classmethod
    def solved(
        cls, ground: LayeredSoil, site: Site, *, omega_max: float,
    ) -> 'LayeredSiteModel':
        """
        Return the model with a table solved now, for frequencies up to one in [rad/s].

        Raises
        ------
        RotorSoilError
            If ground, blocks or range are out of the method's reach.
        NotSolvedError
            If the table does not converge.

        """
        return cls(ground, site, LayeredSite.of(ground, site, omega_max=omega_max).table())

    @property
    def material(self) -> Soil:
        """The uppermost layer."""
        return self.ground.soils[0]

    @property
    def a0_max(self) -> float:
        """Highest a0 that the table covers [-]."""
        return self.table.of.a0_max

    @property
    def singular(self) -> FloatArray:
        """Frequencies at which a wave of the layers begins to travel, rising [rad/s]."""
        return np.asarray(self.table.functions.edges[1:-1] * self.unit)

    @property
    def second_opinion(self) -> 'LayeredSiteModel':
        """The same ground by poorer functions, which differ where solves do not decide."""
        return replace(self, table=replace(self.table, functions=self.table.functions.second))

    def scaled(self, *, modulus: float, density: float = 1.0) -> 'LayeredSiteModel':
        """Return the model on ground with all moduli and densities times a factor: exact."""
        return replace(self, ground=self.ground.changed(lambda soil: replace(
            soil, shear_modulus=modulus * soil.shear_modulus, density=density * soil.density)))

    def scaled_values(self, a0: FloatArray) -> ComplexArray:
        """Return compliance above motion of the points, (n, 6 k + 3 p, 6 k), no dimension."""
        return self.table.values(a0)
