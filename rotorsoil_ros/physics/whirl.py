"""How does the turning rotor on plain springs answer a force, at any speed at once?"""

from dataclasses import dataclass

import numpy as np
import scipy.linalg

from rotorsoil_ros.physics.arrays import ComplexArray, FloatArray
from rotorsoil_ros.physics.rotor import Rotor

# A mode whose dynamic stiffness fell below this share of its static one is kept out of the sum
# and solved for: dividing by it would cost as many digits as the share has zeros.
_NEAR_POLE = 1e-3

# Orbit of a unit whirl over (x, z): forward turns with the spin, from z into x.
_ORBITS = np.array([[-1j, 1.0], [1j, 1.0]]) / np.sqrt(2.0)


@dataclass(frozen=True, slots=True)
class WhirlModes:
    """
    Forward and backward whirl modes of a rotor on isotropic springs, at chosen ports.

    With omega = order * speed the rotor's matrices depend on omega^2 alone: in forward whirl
    K0 - omega^2 (M - J / order), in backward whirl K0 - omega^2 (M + J / order), where J is
    the polar inertia. Two real symmetric eigenproblems therefore serve every speed.

    Attributes
    ----------
    inverse_square : (2, m) float array
        1 / omega_k^2 of forward and backward modes [s^2]; negative where gyroscopic stiffening
        leaves no resonance.
    shapes : (2, p, m) float array
        Their shapes at the ports, normalised to unit strain energy (phi^T K0 phi = 1).

    References
    ----------
    Lalanne & Ferraris (1998), ch. 2, for the whirling directions of a symmetric rotor.

    """

    inverse_square: FloatArray
    shapes: FloatArray

    @classmethod
    def of(
        cls, rotor: Rotor, ports: list[int], *, springs: FloatArray, order: float,
    ) -> 'WhirlModes':
        """
        Solve for the modes.

        Parameters
        ----------
        rotor : Rotor
            Shaft and discs.
        ports : list of int
            Rows of the plane matrices at which forces act or motion is wanted.
        springs : (b,) float array
            Isotropic stiffness put in place of each bearing [N/m].
        order : float
            Excitation frequency over speed.

        """
        stiffness, mass, polar = rotor.plane_matrices
        stiffness = stiffness.copy()
        for bearing, spring in zip(rotor.bearings, springs, strict=True):
            row = 2 * rotor.node_of(bearing.position)
            stiffness[row, row] += spring
        pairs = []
        for direction in (-1.0, 1.0):
            pairs.append(scipy.linalg.eigh(mass + direction / order * polar, stiffness))
        return cls(np.array([values for values, _ in pairs]),
                   np.array([shapes[ports] for _, shapes in pairs]))

    def receptance(self, omega: FloatArray) -> 'PortReceptance':
        """
        Return the receptance between all ports.

        Parameters
        ----------
        omega : (n,) float array
            Excitation frequency [rad/s].

        """
        count = self.shapes.shape[1]
        stiffness = 1.0 - omega[:, None] ** 2 * self.inverse_square.reshape(1, -1)
        size = np.abs(stiffness)
        near = int((size < _NEAR_POLE).sum(axis=1).max(initial=0))
        nearest = np.argpartition(size, near, axis=1)[:, :near]
        small = np.take_along_axis(stiffness, nearest, axis=1)
        gain = 1.0 / np.where(size < np.finfo(float).tiny, 1.0, stiffness)
        np.put_along_axis(gain, nearest, 0.0, axis=1)

        residues = np.einsum('dpm,dqm->dmpq', self.shapes, self.shapes)
        forward, backward = (
            (part @ residue.reshape(-1, count * count)).reshape(-1, count, count)
            for part, residue in zip(np.split(gain, 2, axis=1), residues, strict=True))
        between = np.empty((len(omega), count, 2, count, 2), dtype=complex)
        between[:, :, 0, :, 0] = between[:, :, 1, :, 1] = 0.5 * (forward + backward)
        between[:, :, 0, :, 1] = -0.5j * (forward - backward)
        between[:, :, 1, :, 0] = 0.5j * (forward - backward)

        shapes = np.concatenate([self.shapes[0], self.shapes[1]], axis=1).T
        orbits = np.repeat(_ORBITS, self.shapes.shape[2], axis=0)
        modes = np.einsum('nkp,nka->npak', shapes[nearest], orbits[nearest])
        return PortReceptance(
            between.reshape(len(omega), 2 * count, 2 * count),
            modes.reshape(len(omega), 2 * count, near), small)


@dataclass(frozen=True, slots=True)
class PortReceptance:
    """
    Receptance of the rotor on its springs: a regular part and the modes close to resonance.

    The motion under port forces F is X = regular F + shapes p, where the amplitudes p of the
    nearly resonant modes obey stiffness p = shapes^H F.

    Attributes
    ----------
    regular : (n, 2 p, 2 p) complex array
        Receptance of all other modes over (x, z) of each port [m/N].
    shapes : (n, 2 p, k) complex array
        Shapes of the k modes kept apart.
    stiffness : (n, k) float array
        Their dynamic stiffness, 1 - omega^2 / omega_k^2; it may be zero.

    """

    regular: ComplexArray
    shapes: ComplexArray
    stiffness: FloatArray
