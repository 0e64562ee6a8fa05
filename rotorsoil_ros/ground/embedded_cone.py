"""How soil around a block in the ground gives way, pictured as a stack of discs with cones."""

from dataclasses import dataclass
import math

import numpy as np

from rotorsoil_ros.arrays import ComplexArray, FloatArray
from rotorsoil_ros.errors import require
from rotorsoil_ros.ground.cone import Cone, ConeModel
from rotorsoil_ros.ground.layers.profile import Embedment
from rotorsoil_ros.ground.soil import Contact, Soil

# Discs per radius of depth, eight of a shear wave at a0 = 6; at least and at most.
_PER_RADIUS, _LEAST, _MOST = 8.0, 5, 60


@dataclass(frozen=True, slots=True)
class EmbeddedConeModel:
    """
    Rigid block in a half-space as a stack of discs, each with a cone upward and one downward.

    Attributes
    ----------
    soil : Soil
        Half-space.
    contact : Contact
        Base of the block.
    embedment : Embedment
        Depth of the base; the whole wall is welded.

    Notes
    -----
    A force on a disc in the ground moves it by half of what a cone at the surface would give, and
    all others by what is left of the wave at their distance; images above the surface make it
    free. Discs that move as one body and the soil between them, which was dug out, make the
    block. Where each motion has a disc of its own radius, so has its stack.

    References
    ----------
    Wolf & Deeks (2004), Foundation Vibration Analysis, ch. 4 and 5; Meek & Wolf (1994), Cone
    models for embedded foundation, J. Geotech. Eng. 120, p. 60.

    """

    soil: Soil
    contact: Contact
    embedment: Embedment

    def __post_init__(self) -> None:
        require_whole_wall(self.embedment)

    def compliance(self, omega: FloatArray) -> ComplexArray:
        """Return the compliance of the massless contact, (n, 6, 6) over (x, y, z, rx, ry, rz)."""
        omega = np.asarray(omega, dtype=float)
        flat = omega.ravel()
        depth, soil = self.embedment.depth, self.soil
        slide, _, heave, roll, pitch, twist = ConeModel(soil, self.contact).cones
        discs = min(max(_LEAST, 1 + math.ceil(_PER_RADIUS * depth / slide.radius)), _MOST)
        height = depth * (1.0 - np.arange(discs) / (discs - 1.0))
        stack = _Stack(flat, depth - height)
        about_x, about_y, about_z = self.contact.second_moments
        one = np.ones_like(height)
        total = np.zeros((flat.size, 6, 6), dtype=complex)
        square = (flat**2)[:, None, None]
        for dof, cone, area in ((2, heave, None), (5, twist, about_z)):
            own = soil.density * depth * (self.contact.area if area is None else area)
            stiffness = stack.stiffness(cone, area, one[:, None])
            stiffness += square * (own - cone.trapped_mass)
            total[:, dof, dof] = 1.0 / stiffness[:, 0, 0]
        for across, turn, cone, second, sign in ((0, 4, pitch, about_y, 1.0),
                                                 (1, 3, roll, about_x, -1.0)):
            stiffness = stack.stiffness(slide, None, np.stack([one, sign * height], axis=1))
            stiffness[:, 1:, 1:] += stack.stiffness(cone, second, one[:, None])
            stiffness[:, 1, 1] -= flat**2 * cone.trapped_mass
            mass = soil.density * self.contact.area * depth
            dug = np.array([[mass, 0.5 * sign * mass * depth],
                            [0.5 * sign * mass * depth,
                             mass * depth**2 / 3.0 + soil.density * second * depth]])
            pair = np.array([across, turn])
            total[:, pair[:, None], pair] = np.linalg.inv(stiffness + square * dug)
        return total.reshape(*omega.shape, 6, 6)


def require_whole_wall(embedment: Embedment) -> None:
    """Raise a RotorSoilError if part of a wall stands free, which cones cannot tell."""
    require(embedment.side_contact == 1.0, 'side_contact',
            '1 with the model cone, which knows no gap beside a wall (thin_layers do)',
            embedment.side_contact)


@dataclass(frozen=True, slots=True)
class _Stack:
    """Discs in the ground at depths (d,) and frequencies (n,)."""

    omega: FloatArray
    depth: FloatArray

    def stiffness(
        self, cone: Cone, second_moment: float | None, motion: FloatArray,
    ) -> ComplexArray:
        """Return the stiffness of discs that move together, (d, r) per motion, (n, r, r)."""
        direct = np.abs(self.depth[:, None] - self.depth)
        image = self.depth[:, None] + self.depth
        number = 1j * self.omega[:, None, None] / cone.wave_speed

        def left(distance: FloatArray) -> ComplexArray:
            """Return the share of the motion of a disc that is left at a distance on its axis."""
            z0, z = cone.apex_height, cone.apex_height + distance
            if second_moment is None:
                return np.asarray(z0 / z * np.exp(-number * distance))
            return np.asarray((1.0 / z**3 + number / z**2) / (1.0 / z0**3 + number / z0**2)
                              * np.exp(-number * distance))

        massless = Cone(cone.radius, cone.apex_height, cone.wave_speed, cone.density, 0.0)
        own = (massless.translational_stiffness(self.omega) if second_moment is None else
               massless.rotational_stiffness(self.omega, second_moment=second_moment))
        flexibility = (left(direct) + left(image)) / (2.0 * own[:, None, None])
        forces = np.linalg.solve(flexibility, np.broadcast_to(
            motion, (len(self.omega), *motion.shape)).astype(complex))
        return np.asarray(motion.T @ forces)
