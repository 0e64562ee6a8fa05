"""What does a coupled model answer?"""

from dataclasses import dataclass

from rotorsoil_ros.physics.arrays import ComplexArray, FloatArray


@dataclass(frozen=True, slots=True)
class Prediction:
    """
    Once-per-turn response of every channel, complex and zero-to-peak.

    Attributes
    ----------
    speed : (n,) float array
        Rotor speed [rad/s].
    displacement : (n, c) complex array
        [m], or [rad] for the rotations of a foundation.
    force : (n, c) complex array
        Through the bearing [N] for its journal and housing; into the soil [N, N m] for a
        foundation; NaN where a channel transmits none.

    """

    speed: FloatArray
    displacement: ComplexArray
    force: ComplexArray

    @property
    def velocity(self) -> ComplexArray:
        """Velocity, i speed X, (n, c) [m/s, rad/s]."""
        return 1j * self.speed[:, None] * self.displacement
