"""What blocks of any plan on a half-space give way by, from boundary elements."""

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace

import numpy as np

from rotorsoil_ros.arrays import ComplexArray, FloatArray, inside
from rotorsoil_ros.errors import require, RotorSoilError
from rotorsoil_ros.ground.boundary.effort import highest_a0
from rotorsoil_ros.ground.boundary.site import Site
from rotorsoil_ros.ground.boundary.table import BoundaryTable
from rotorsoil_ros.ground.soil import Contact, Soil, static_scale


class SiteGround(ABC):
    """Ground below rigid massless contacts that are coupled through it."""

    __slots__ = ()

    site: Site

    @property
    @abstractmethod
    def material(self) -> Soil:
        """What makes frequencies and compliances dimensionless: the material at the surface."""

    @property
    @abstractmethod
    def a0_max(self) -> float:
        """Highest a0 that is known [-]."""

    @abstractmethod
    def scaled_values(self, a0: FloatArray) -> ComplexArray:
        """Return compliance above motion of the points, (n, 6 k + 3 p, 6 k), no dimension."""

    @property
    def blocks(self) -> int:
        """Number of blocks that stand on this ground, k."""
        return len(self.site.blocks)

    @property
    def unit(self) -> float:
        """Frequency at which a0 is one [rad/s]."""
        return self.material.shear_wave_speed / self.site.length

    @property
    def omega_range(self) -> tuple[float, float]:
        """Lowest and highest frequency that the tables cover [rad/s]."""
        return 0.0, self.a0_max * self.unit

    def compliance(self, omega: FloatArray) -> ComplexArray:
        """
        Return the compliance of the massless contacts.

        Parameters
        ----------
        omega : (n,) float array
            Excitation frequencies [rad/s].

        Returns
        -------
        (n, 6 k, 6 k) complex array
            Over (x, y, z, rx, ry, rz) of each block about its centre [m/N], [1/N], [rad/(N m)].

        Raises
        ------
        OutOfTableError
            If a frequency lies outside `omega_range`.

        """
        size = 6 * self.blocks
        return self._values(omega)[..., :size, :]

    def point_motion(self, omega: FloatArray) -> ComplexArray:
        """
        Return the motion of the points on the ground, (n, 3 p, 6 k) over (x, y, z) of each.

        Per force and moment of each block on the ground [m/N], [1/N]; parameters and errors as
        in `compliance`.
        """
        return self._values(omega)[..., 6 * self.blocks:, :]

    def _values(self, omega: FloatArray) -> ComplexArray:
        omega = inside(omega, self.omega_range, name='frequency', unit='rad/s',
                       where='where the boundary elements were solved')
        a0 = np.minimum(omega.ravel() / self.unit, self.a0_max)
        return self._dimensioned(self.scaled_values(a0)).reshape(
            *omega.shape, -1, 6 * self.blocks)

    def _dimensioned(self, values: ComplexArray) -> ComplexArray:
        """Give dimensionless values, (n, 6 k + 3 p, 6 k), their units."""
        length = self.site.length
        # A rotation is over a length, and a moment is a force at it.
        own = np.tile([1.0] * 3 + [1.0 / length] * 3, self.blocks)
        rows = np.concatenate([own, np.ones(3 * len(self.site.points))])
        return np.asarray(values * np.outer(rows, own) / (self.material.shear_modulus * length))


@dataclass(frozen=True, slots=True)
class BoundaryElementModel(SiteGround):
    """
    Rigid massless contacts welded to one half-space, coupled through it.

    Attributes
    ----------
    soil : Soil
        Half-space.
    site : Site
        Blocks, and points on the ground whose motion is asked for.
    tables : tuple of BoundaryTable
        Solved for this site over its length, by rising Poisson's ratio.

    Notes
    -----
    G, rho and size are a rescaling, and eta another point of the same analytic functions. Between
    the Poisson's ratios of two tables the compliance is interpolated linearly, which keeps it
    passive; beyond them it is scaled by the static compliances of a disc (`static_scale`).

    Where radiation is weaker than the error of the tables, a loss of less than 3e-4 of a motion's
    own size, which is an analytic function of frequency as all the rest, keeps -Im N positive
    semidefinite (`BoundaryTable.loss`).

    """

    soil: Soil
    site: Site
    tables: tuple[BoundaryTable, ...]

    def __post_init__(self) -> None:
        require(len(self.tables) > 0, 'tables', 'at least one', 0)
        for table in self.tables:
            if table.site != self.site.scaled():
                raise RotorSoilError('table must be that of the site')

    @classmethod
    def solved(
        cls, soil: Soil, contact: Contact, *, omega_max: float,
    ) -> 'BoundaryElementModel':
        """Return the model of one contact, solved now for frequencies up to one [rad/s]."""
        return cls.solved_together(soil, Site.of((contact,), ((0.0, 0.0),)),
                                   omega_max=omega_max)

    @classmethod
    def solved_together(
        cls, soil: Soil, site: Site, *, omega_max: float,
    ) -> 'BoundaryElementModel':
        """
        Return the model of several contacts, solved now for frequencies up to one [rad/s].

        Raises
        ------
        RotorSoilError
            If soil or frequency are out of reach.
        NotSolvedError
            If the frequencies do not join.

        """
        # Here and not above: Hankel functions and splines take 0.1 s to import, and a stored
        # table needs none.
        from rotorsoil_ros.ground.boundary.tabulate import tabulated

        scaled = site.scaled()
        a0_max = highest_a0(scaled, omega_max * site.length / soil.shear_wave_speed)
        return cls(soil, site, (tabulated(
            scaled, poisson_ratio=soil.poisson_ratio, loss_factor=soil.loss_factor,
            a0_max=a0_max),))

    @property
    def material(self) -> Soil:
        """The half-space."""
        return self.soil

    @property
    def a0_max(self) -> float:
        """Highest a0 that all tables cover [-]."""
        return min(table.a0_max for table in self.tables)

    def on(self, soil: Soil) -> 'BoundaryElementModel':
        """Return the same blocks on another soil, from the same tables."""
        return replace(self, soil=soil)

    def scaled_values(self, a0: FloatArray) -> ComplexArray:
        """Return what the tables say for the Poisson's ratio of the soil, without dimension."""
        ratio, loss = self.soil.poisson_ratio, self.soil.loss_factor
        known = [table.poisson_ratio for table in self.tables]
        above = int(np.searchsorted(known, ratio))
        if above < len(known) and known[above] == ratio:
            return self.tables[above].values(a0, loss)
        if 0 < above < len(known):
            lower, upper = known[above - 1:above + 1]
            share = (ratio - lower) / (upper - lower)
            return ((1.0 - share) * self.tables[above - 1].values(a0, loss)
                    + share * self.tables[above].values(a0, loss))
        nearest = min(above, len(known) - 1)
        scale = np.tile(static_scale(known[nearest], ratio), self.blocks)
        points = np.tile(static_scale(known[nearest], ratio)[:3], len(self.site.points))
        return self.tables[nearest].values(a0, loss) * np.outer(
            np.concatenate([scale, points]), scale)
