"""What a coupled model answers."""

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


@dataclass(frozen=True, slots=True)
class FrequencyResponse:
    """
    Response of every channel to a harmonic force, complex and zero-to-peak.

    Attributes
    ----------
    speed, omega : (n,) float arrays
        Rotor speed and excitation frequency [rad/s].
    displacement, force : (n, c) complex arrays
        As in `Prediction`, per newton, or per newton metre about an axis of a foundation.

    """

    speed: FloatArray
    omega: FloatArray
    displacement: ComplexArray
    force: ComplexArray

    @property
    def velocity(self) -> ComplexArray:
        """Velocity, i omega X, (n, c) [m/s, rad/s]."""
        return 1j * self.omega[:, None] * self.displacement
