"""What a contact on a half-space gives way by, from finite and infinite elements."""

from dataclasses import dataclass
import math

import numpy as np

from rotorsoil_ros.arrays import ComplexArray, FloatArray, inside
from rotorsoil_ros.errors import RotorSoilError
from rotorsoil_ros.ground.elements.table import (
    DimensionlessTable,
    require_kind,
    standard_range,
)
from rotorsoil_ros.ground.soil import Circle, Contact, equivalent_radii, Rectangle, Soil

# Part of every cache key: raise it when mesh, functions or fit change what a table says.
ELEMENTS_ALGORITHM = 1


def a0_range(
    soil: Soil, contact: Contact, geometry: str, *, omega_min: float, omega_max: float,
) -> tuple[float, float]:
    """
    Return the range of dimensionless frequency that a table needs for a case.

    Parameters
    ----------
    soil : Soil
        Half-space.
    contact : Contact
        Area between foundation and soil.
    geometry : str
        `disc`, `plane_strain` or `plane_stress`.
    omega_min, omega_max : float
        Excitation frequencies to be covered [rad/s].

    Returns
    -------
    tuple of float
        Smallest and largest a0 [-], widened to one of a few fixed ranges, so that soils of
        another G or rho and contacts of another size share one table.

    Raises
    ------
    RotorSoilError
        If the geometry does not fit the contact, or the range is beyond the method's.

    """
    lengths = _lengths(contact, geometry)
    return standard_range(
        geometry,
        omega_min * float(lengths.min()) / soil.shear_wave_speed,
        omega_max * float(lengths.max()) / soil.shear_wave_speed)


@dataclass(frozen=True, slots=True)
class InfiniteElementModel:
    """
    Rigid massless contact welded to a half-space, by finite and infinite elements.

    Attributes
    ----------
    soil : Soil
        Half-space.
    contact : Contact
        Area between foundation and soil; a plane geometry needs a rectangle.
    table : DimensionlessTable
        Solved compliance of this kind of soil.

    Notes
    -----
    A rectangle on a disc takes, per degree of freedom, the disc of equal area (translations) or
    equal second moment (rotations), and for the coupling of two of them the geometric mean of
    their radii: it is exact for a circle and leaves the loss at low frequency, which does not
    depend on the radius, unchanged. A plane geometry is the strip of half-width b; its
    compliance per unit length is divided by the length 2 l, and y, rx and rz are restrained.

    The loss -Im N is kept positive semidefinite: where radiation is weaker than the table's
    error, a coupling loses no more than its diagonals allow and a diagonal no less than nothing.

    """

    soil: Soil
    contact: Contact
    table: DimensionlessTable

    def __post_init__(self) -> None:
        _lengths(self.contact, self.table.geometry)
        for name in ('poisson_ratio', 'loss_factor'):
            solved, asked = getattr(self.table, name), getattr(self.soil, name)
            if not solved == asked:
                raise RotorSoilError(
                    f'{name} of the table must be that of the soil, {asked:g}, got {solved:g}')

    @classmethod
    def solved(
        cls, soil: Soil, contact: Contact, geometry: str, *, omega_min: float, omega_max: float,
    ) -> 'InfiniteElementModel':
        """
        Return the model with a table solved now, for frequencies in [rad/s].

        Raises
        ------
        RotorSoilError
            If soil, contact, geometry or range are out of the method's reach.
        NotSolvedError
            If a system is singular or the table does not converge.

        """
        # Here and not above: scikit-fem takes 0.3 s to import, and a stored table needs none.
        from rotorsoil_ros.ground.elements.tabulate import tabulate

        a0_min, a0_max = a0_range(
            soil, contact, geometry, omega_min=omega_min, omega_max=omega_max)
        return cls(soil, contact, tabulate(
            geometry, poisson_ratio=soil.poisson_ratio, loss_factor=soil.loss_factor,
            a0_min=a0_min, a0_max=a0_max))

    @property
    def omega_range(self) -> tuple[float, float]:
        """Lowest and highest frequency that the table covers for every motion [rad/s]."""
        lengths = _lengths(self.contact, self.table.geometry)
        speed = self.soil.shear_wave_speed
        return (self.table.a0_min * speed / float(lengths.min()),
                self.table.a0_max * speed / float(lengths.max()))

    def compliance(self, omega: FloatArray) -> ComplexArray:
        """
        Return the compliance of the massless contact, (n, 6, 6) over (x, y, z, rx, ry, rz).

        Parameters
        ----------
        omega : (n,) float array
            Excitation frequencies [rad/s].

        Returns
        -------
        (n, 6, 6) complex array
            [m/N], [1/N] and [rad/(N m)].

        Raises
        ------
        OutOfTableError
            If a frequency lies outside `omega_range`.

        """
        omega = inside(omega, self.omega_range, name='frequency', unit='rad/s',
                       where='where the infinite elements were solved')
        flat = omega.ravel()
        is_disc = self.table.geometry == 'disc'
        compliance = self._disc(flat) if is_disc else self._strip(flat)
        return compliance.reshape(*omega.shape, 6, 6)

    def _entries(self, omega: FloatArray, length: float) -> ComplexArray:
        a0 = omega * (length / self.soil.shear_wave_speed)
        # The product may round past the table's end by less than the check above forgives.
        return self.table.compliance(np.clip(a0, self.table.a0_min, self.table.a0_max))

    def _disc(self, omega: FloatArray) -> ComplexArray:
        modulus = self.soil.shear_modulus
        compliance = np.zeros((omega.size, 6, 6), dtype=complex)
        radii = equivalent_radii(self.contact)
        for dof, entry in enumerate(('xx', 'xx', 'zz', 'ryry', 'ryry', 'rzrz')):
            radius = radii[dof]
            power = 1 if dof < 3 else 3
            column = self.table.entries.index(entry)
            compliance[:, dof, dof] = (
                self._entries(omega, radius)[:, column] / (modulus * radius**power))
        # A rotation about x tilts towards -y where one about y tilts towards +x.
        for sway, rock, sign in ((0, 4, 1.0), (1, 3, -1.0)):
            radius = math.sqrt(radii[sway] * radii[rock])
            coupling = self._entries(omega, radius)[:, 3] / (modulus * radius**2)
            compliance[:, sway, rock] = compliance[:, rock, sway] = sign * coupling
            keep_passive(compliance, sway, rock)
        keep_passive(compliance, 2, 5)
        return compliance

    def _strip(self, omega: FloatArray) -> ComplexArray:
        contact = self.contact
        assert isinstance(contact, Rectangle)
        width, length = contact.half_width, 2.0 * contact.half_length
        entries = self._entries(omega, width) / (self.soil.shear_modulus * length)
        compliance = np.zeros((omega.size, 6, 6), dtype=complex)
        compliance[:, 0, 0], compliance[:, 2, 2] = entries[:, 0], entries[:, 1]
        compliance[:, 4, 4] = entries[:, 2] / width**2
        compliance[:, 0, 4] = compliance[:, 4, 0] = entries[:, 3] / width
        keep_passive(compliance, 0, 4)
        return compliance


def _lengths(contact: Contact, geometry: str) -> FloatArray:
    """Return the lengths that make frequencies dimensionless in this geometry [m]."""
    require_kind(geometry, 0.0, 0.0)
    if geometry == 'disc':
        return equivalent_radii(contact)
    if not isinstance(contact, Rectangle):
        what = (f'a circle of radius {contact.radius:g} m' if isinstance(contact, Circle)
                else f'a plan of {len(contact.parts)} parts')
        raise RotorSoilError(f'geometry {geometry} must have a rectangular contact, got {what}')
    return np.array([contact.half_width])


def keep_passive(compliance: ComplexArray, first: int, second: int) -> None:
    """Limit the losses of two coupled motions so that -Im N stays positive semidefinite."""
    for dof in (first, second):
        diagonal = compliance[:, dof, dof]
        diagonal.imag[:] = np.minimum(diagonal.imag, 0.0)
    largest = np.sqrt(compliance[:, first, first].imag * compliance[:, second, second].imag)
    coupling = compliance[:, first, second]
    coupling.imag[:] = np.clip(coupling.imag, -largest, largest)
    compliance[:, second, first] = coupling
