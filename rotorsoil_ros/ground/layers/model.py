"""What a contact on layers, on rock or in the ground gives way by, by the thin-layer method."""

from dataclasses import dataclass, replace
import math

import numpy as np

from rotorsoil_ros.arrays import ComplexArray, FloatArray, inside, ROUNDING
from rotorsoil_ros.errors import require
from rotorsoil_ros.ground.half_space import keep_passive
from rotorsoil_ros.ground.layers.profile import (
    Embedment,
    Layer,
    LayeredSoil,
    require_room,
    require_thickness,
    SURFACE,
)
from rotorsoil_ros.ground.layers.table import LayeredTable
from rotorsoil_ros.ground.layers.tabulate import Radii, tabulate
from rotorsoil_ros.ground.soil import Contact, equivalent_radii, Soil

# Part of every cache key: raise it when mesh, waves or fit change what a table says.
LAYERS_ALGORITHM = 2

# Upper ends of tables [-]: few of them, so that grounds of another stiffness share a table.
_ENDS = (0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0, 20.0)

# Ratios are kept to so many digits: what differs by round-off is one ground.
_DIGITS = 11


@dataclass(frozen=True, slots=True)
class Proportions:
    """
    Ground and contact in units of the soil below the base and of the contact's radius.

    Attributes
    ----------
    ground : LayeredSoil
        G and rho of the soil below the base are one.
    embedment : Embedment
        Of the base.
    radii : Radii
        Sliding is one.
    a0_max : float
        omega r / c_s up to which a table reaches.

    """

    ground: LayeredSoil
    embedment: Embedment
    radii: Radii
    a0_max: float

    @classmethod
    def of(
        cls, ground: LayeredSoil, contact: Contact, embedment: Embedment, *, omega_max: float,
    ) -> 'Proportions':
        """
        Return the proportions of a ground in SI units, for frequencies up to one in [rad/s].

        Raises
        ------
        RotorSoilError
            If the range or a layer is beyond the method's reach.

        """
        require_room(ground, embedment)
        radii = equivalent_radii(contact).tolist()
        length, soil = radii[0], ground.at(embedment.depth)
        require_thickness(ground, min(radii))
        a0 = omega_max * length / soil.shear_wave_speed
        end = next((end for end in _ENDS if a0 <= end * (1.0 + ROUNDING)), math.nan)
        require(math.isfinite(end), 'a0', f'<= {_ENDS[-1]:g} [-] for layered ground', a0)

        def ratio(value: float) -> float:
            return float(f'{value:.{_DIGITS}g}')

        def scaled(own: Soil) -> Soil:
            return Soil(ratio(own.shear_modulus / soil.shear_modulus), own.poisson_ratio,
                        ratio(own.density / soil.density), own.loss_factor)

        layers = tuple(Layer(ratio(layer.thickness / length), scaled(layer.soil))
                       for layer in ground.layers)
        return cls(
            LayeredSoil(layers, None if ground.below is None else scaled(ground.below)),
            replace(embedment, depth=ratio(embedment.depth / length)),
            Radii(*(ratio(radii[dof] / length) for dof in (0, 2, 3, 4, 5))), end)

    def table(self) -> LayeredTable:
        """Solve for the compliances of this ground."""
        return tabulate(self.ground, self.embedment, self.radii, a0_max=self.a0_max)


@dataclass(frozen=True, slots=True)
class ThinLayerModel:
    """
    Rigid massless contact welded to layers, or cylinder in them.

    Attributes
    ----------
    ground : LayeredSoil
        Layers on a half-space or on rigid rock; a loss factor of at least 0.005 everywhere.
    contact : Contact
        Area of the base.
    table : LayeredTable
        Solved compliance of ground and contact of these proportions.
    embedment : Embedment
        Depth of the base and welded share of the wall.

    Notes
    -----
    A rectangle takes, per degree of freedom, the disc of equal area or equal second moment, and
    for a coupling the mean of both, as `InfiniteElementModel`: exact for a circle.

    """

    ground: LayeredSoil
    contact: Contact
    table: LayeredTable
    embedment: Embedment = SURFACE

    @classmethod
    def solved(
        cls, ground: LayeredSoil, contact: Contact, *, omega_max: float,
        embedment: Embedment = SURFACE,
    ) -> 'ThinLayerModel':
        """
        Return the model with a table solved now, for frequencies up to one in [rad/s].

        Raises
        ------
        RotorSoilError
            If the ground or the range is out of the method's reach.
        NotSolvedError
            If the table does not converge.

        """
        scaled = Proportions.of(ground, contact, embedment, omega_max=omega_max)
        return cls(ground, contact, scaled.table(), embedment)

    @property
    def material(self) -> Soil:
        """What is below the base."""
        return self.ground.at(self.embedment.depth)

    @property
    def _unit(self) -> tuple[float, float, float]:
        """Shear modulus [Pa], length [m] and frequency [rad/s] in which the table counts."""
        soil = self.material
        length = float(equivalent_radii(self.contact)[0])
        return soil.shear_modulus, length, soil.shear_wave_speed / length

    @property
    def omega_range(self) -> tuple[float, float]:
        """Frequencies that the table covers [rad/s]."""
        return 0.0, float(self.table.edges[-1]) * self._unit[2]

    @property
    def singular(self) -> FloatArray:
        """Frequencies at which a wave of the layers begins to travel, rising [rad/s]."""
        return np.asarray(self.table.edges[1:-1] * self._unit[2])

    @property
    def second_opinion(self) -> 'ThinLayerModel':
        """The same ground by poorer functions, which differ where solves do not decide."""
        return replace(self, table=self.table.second)

    def scaled(self, *, modulus: float, density: float = 1.0) -> 'ThinLayerModel':
        """Return the model on ground with all moduli and densities times a factor: exact."""
        return replace(self, ground=self.ground.changed(lambda soil: replace(
            soil, shear_modulus=modulus * soil.shear_modulus, density=density * soil.density)))

    def compliance(self, omega: FloatArray) -> ComplexArray:
        """
        Return the compliance of the massless contact, (n, 6, 6) over (x, y, z, rx, ry, rz).

        Parameters
        ----------
        omega : (n,) float array
            Excitation frequencies [rad/s].

        Raises
        ------
        OutOfTableError
            If a frequency lies outside `omega_range`.

        """
        omega = inside(omega, self.omega_range, name='frequency', unit='rad/s',
                       where='where layered ground was solved')
        modulus, length, unit = self._unit
        flat = omega.ravel()
        entries = self.table.compliance(flat / unit)
        xx, zz, rxrx, ryry, rzrz, x_ry, y_rx = (entries / modulus).T
        total = np.zeros((flat.size, 6, 6), dtype=complex)
        for dof, values, power in ((0, xx, 1), (1, xx, 1), (2, zz, 1), (3, rxrx, 3),
                                   (4, ryry, 3), (5, rzrz, 3)):
            total[:, dof, dof] = values / length**power
        for sway, rock, values in ((0, 4, x_ry), (1, 3, y_rx)):
            total[:, sway, rock] = total[:, rock, sway] = values / length**2
            keep_passive(total, sway, rock)
        keep_passive(total, 2, 5)
        return total.reshape(*omega.shape, 6, 6)
