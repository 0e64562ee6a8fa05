"""How a rigid block on the soil moves under the bearings that stand on it."""

from dataclasses import dataclass
import math

import numpy as np

from rotorsoil_ros.physics.arrays import ComplexArray, FloatArray
from rotorsoil_ros.physics.soil import Contact, require


@dataclass(frozen=True, slots=True)
class Foundation:
    """
    Rigid block with everything that moves with it.

    Attributes
    ----------
    name : str
        Name of the block, first part of its channels.
    contact : Contact
        Area of contact with the soil; its centre is where the block's motion is reported.
    centre_y : float
        Position of the contact centre along the shaft [m].
    mass : float
        m [kg], may be zero.
    centre_of_gravity_height : float
        z_c above the contact plane [m].
    inertia : tuple of three floats
        Moments of inertia about the centre of gravity, axes x, y, z [kg m^2].
    height : float or None
        Of the block above the contact plane [m]; nothing but pictures depends on it.

    """

    name: str
    contact: Contact
    centre_y: float
    mass: float
    centre_of_gravity_height: float
    inertia: tuple[float, float, float]
    height: float | None = None

    def __post_init__(self) -> None:
        require(0.0 <= self.mass < math.inf, 'mass', '>= 0 kg and finite', self.mass)
        require(math.isfinite(self.centre_y), 'centre_y', 'finite, in m', self.centre_y)
        require(math.isfinite(self.centre_of_gravity_height), 'centre_of_gravity_height',
                'finite, in m', self.centre_of_gravity_height)
        if self.height is not None:
            require(0.0 < self.height < math.inf, 'height', '> 0 m and finite', self.height)
        for axis, value in zip('xyz', self.inertia, strict=True):
            require(0.0 <= value < math.inf, f'inertia about {axis}', '>= 0 kg m^2 and finite',
                    value)

    @property
    def drawn_height(self) -> float:
        """Height of the block in pictures [m]: a uniform block's unless it is given."""
        if self.height is not None:
            return self.height
        return 2.0 * max(self.centre_of_gravity_height, 0.05 * self.contact.characteristic_length)

    @property
    def mass_matrix(self) -> FloatArray:
        """
        Mass matrix about the contact centre, (6, 6) over (x, y, z, rx, ry, rz).

        A centre of gravity z_c above the contact couples sliding and rocking.

        References
        ----------
        Seed paper, eq. (8), corrected: it is diagonal only about the centre of gravity.

        """
        m, height = self.mass, self.centre_of_gravity_height
        matrix = np.diag([m, m, m, *self.inertia])
        matrix[3, 3] += m * height**2
        matrix[4, 4] += m * height**2
        # The top of a block that turns by +ry moves toward +x, by +rx toward -y.
        matrix[0, 4] = matrix[4, 0] = m * height
        matrix[1, 3] = matrix[3, 1] = -m * height
        return matrix

    def seat_rows(self, *, position: float, height: float) -> FloatArray:
        """
        Return x and z of a point on the block per unit motion of the block, (2, 6).

        The point lies in the vertical plane of the shaft, `position` [m] along it and
        `height` [m] above the contact: u(r) = u + theta x r.
        """
        along = position - self.centre_y
        return np.array([
            [1.0, 0.0, 0.0, 0.0, height, -along],
            [0.0, 0.0, 1.0, along, 0.0, 0.0],
        ])


def add_mass(compliance: ComplexArray, mass: FloatArray, omega: FloatArray) -> ComplexArray:
    """
    Return the receptance of a compliant body that carries a mass.

    Parameters
    ----------
    compliance : (n, d, d) complex array
        Displacement per force without the mass [m/N]; zero where it cannot move.
    mass : (d, d) float array
        Mass matrix [kg].
    omega : (n,) float array
        Excitation frequency [rad/s].

    Returns
    -------
    (n, d, d) complex array
        (I - omega^2 N M)^-1 N [m/N].

    References
    ----------
    Seed paper, eqs. (7) and (8), corrected: the inertia is added to the dynamic stiffness.

    """
    # Not (N^-1 - w^2 M)^-1: a rigid base has N = 0 and no inverse.
    return np.linalg.solve(carrying(compliance, mass, omega), compliance)


def carrying(compliance: ComplexArray, mass: FloatArray, omega: FloatArray) -> ComplexArray:
    """Return I - omega^2 N M, (n, d, d): what a mass makes of a compliance's motion [-]."""
    size = len(mass)
    # One product of tall matrices instead of many small ones, and no copies.
    carried: ComplexArray = (compliance.reshape(-1, size) @ mass).reshape(-1, size, size)
    carried *= -(omega[:, None, None] ** 2)
    carried[:, range(size), range(size)] += 1.0
    return carried
