"""How soil under a rigid base gives way, pictured as truncated cones."""

from dataclasses import dataclass
import math

import numpy as np

from rotorsoil_ros.arrays import ComplexArray, FloatArray
from rotorsoil_ros.ground.soil import Contact, equivalent_radii, Soil

# Above this Poisson's ratio waves at c_p would radiate too much: c = 2 c_s and a trapped mass.
_NEARLY_INCOMPRESSIBLE = 1.0 / 3.0


@dataclass(frozen=True, slots=True)
class Cone:
    """
    Truncated cone below a disc.

    Attributes
    ----------
    radius : float
        r0 of the disc [m].
    apex_height : float
        z0, from the apex to the disc [m].
    wave_speed : complex
        c of the waves it carries, hysteretic damping included [m/s].
    density : float
        rho [kg/m^3].
    trapped_mass : float
        Soil that moves with the disc [kg], or turns with it [kg m^2].

    """

    radius: float
    apex_height: float
    wave_speed: complex
    density: float
    trapped_mass: float

    def translational_stiffness(self, omega: FloatArray) -> ComplexArray:
        """
        Return the dynamic stiffness of a disc that moves along one axis.

        Parameters
        ----------
        omega : (n,) float array
            Excitation frequency [rad/s].

        Returns
        -------
        (n,) complex array
            rho c^2 A0 (1 / z0 + i omega / c) - omega^2 Delta M [N/m].

        References
        ----------
        Seed paper, eq. (12); Wolf & Deeks (2004), sec. 2.1.

        """
        area = math.pi * self.radius**2
        spring = self.density * self.wave_speed**2 * area / self.apex_height
        dashpot = self.density * self.wave_speed * area
        return spring + 1j * omega * dashpot - omega**2 * self.trapped_mass

    def rotational_stiffness(self, omega: FloatArray, *, second_moment: float) -> ComplexArray:
        """
        Return the dynamic stiffness of a disc that turns about one axis.

        Parameters
        ----------
        omega : (n,) float array
            Excitation frequency [rad/s].
        second_moment : float
            I0 of the disc about that axis [m^4].

        Returns
        -------
        (n,) complex array
            (rho c^2 I0 / z0) (3 + 3 i b0 - b0^2) / (1 + i b0) - omega^2 Delta I [N m/rad],
            where b0 = omega z0 / c.

        References
        ----------
        Wolf (1994), sec. 2.3; Wolf & Deeks (2004), sec. 2.2.

        """
        b0 = omega * self.apex_height / self.wave_speed
        spring = self.density * self.wave_speed**2 * second_moment / self.apex_height
        travelling = (3.0 + 3j * b0 - b0**2) / (1.0 + 1j * b0)
        return spring * travelling - omega**2 * self.trapped_mass


@dataclass(frozen=True, slots=True)
class ConeModel:
    """
    One cone for each of the six degrees of freedom of a contact.

    Notes
    -----
    Within 25 % of the rigorous stiffness; below a0 = 1.5 it radiates too much, above all in
    rocking (theory manual, cones). Static stiffness is that of the smooth disc, exactly.

    """

    soil: Soil
    contact: Contact

    @property
    def cones(self) -> tuple[Cone, ...]:
        """
        Cones of (x, y, z, rx, ry, rz).

        Apex heights match the static stiffness of the disc on a half-space:
        8 G r0 / (2 - nu), 4 G r0 / (1 - nu), 8 G r0^3 / (3 (1 - nu)), 16 G r0^3 / 3.
        """
        soil = self.soil
        nu = soil.poisson_ratio
        trapped = max(0.0, nu - _NEARLY_INCOMPRESSIBLE)
        shear_speed = soil.shear_wave_speed
        axial_speed = 2.0 * shear_speed if trapped else soil.pressure_wave_speed
        axial_ratio = (1.0 - nu) * (axial_speed / shear_speed) ** 2
        radii = equivalent_radii(self.contact)
        sliding, heaving, rocking_x, rocking_y, turning = radii[[0, 2, 3, 4, 5]].tolist()
        loss = np.sqrt(1.0 + 1j * soil.loss_factor)

        def cone(radius: float, slope: float, speed: float, trapped_mass: float = 0.0) -> Cone:
            return Cone(radius, slope * radius, complex(speed * loss), soil.density, trapped_mass)

        def rocking(radius: float) -> Cone:
            return cone(radius, 9.0 * math.pi / 32.0 * axial_ratio, axial_speed,
                        0.3 * math.pi * trapped * soil.density * radius**5)

        horizontal = cone(sliding, math.pi / 8.0 * (2.0 - nu), shear_speed)
        vertical = cone(heaving, math.pi / 4.0 * axial_ratio, axial_speed,
                        2.4 * math.pi * trapped * soil.density * heaving**3)
        torsion = cone(turning, 9.0 * math.pi / 32.0, shear_speed)
        return (horizontal, horizontal, vertical, rocking(rocking_x), rocking(rocking_y), torsion)

    def compliance(self, omega: FloatArray) -> ComplexArray:
        """Return the compliance of the massless contact, (n, 6, 6) over (x, y, z, rx, ry, rz)."""
        omega = np.asarray(omega, dtype=float)
        result = np.zeros((*omega.shape, 6, 6), dtype=complex)
        cones = self.cones
        for dof, cone in enumerate(cones[:3]):
            result[..., dof, dof] = 1.0 / cone.translational_stiffness(omega)
        for dof, cone, second_moment in zip(
                (3, 4, 5), cones[3:], self.contact.second_moments, strict=True):
            result[..., dof, dof] = 1.0 / cone.rotational_stiffness(
                omega, second_moment=second_moment)
        return result
