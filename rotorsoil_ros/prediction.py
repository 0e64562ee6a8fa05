"""What a coupled model answers."""

from dataclasses import dataclass

import numpy as np

from rotorsoil_ros.arrays import ComplexArray, FloatArray


class Prediction:
    """
    Once-per-turn response of every channel, complex and zero-to-peak.

    Attributes
    ----------
    speed : (n,) float array
        Rotor speed [rad/s].
    parts : (n, 2, 2, c) float array
        Real parts, then imaginary parts, of displacement and of force.

    """

    __slots__ = ('parts', 'speed')

    def __init__(
        self, speed: FloatArray, displacement: ComplexArray, force: ComplexArray,
    ) -> None:
        vectors = np.stack([displacement, force], axis=1)
        self.speed = speed
        self.parts: FloatArray = np.stack([vectors.real, vectors.imag], axis=1)

    @classmethod
    def of_parts(cls, speed: FloatArray, parts: FloatArray) -> 'Prediction':
        """Return what consists of these parts, as they are."""
        prediction = cls.__new__(cls)
        prediction.speed, prediction.parts = speed, parts
        return prediction

    @property
    def displacement(self) -> ComplexArray:
        """Displacement, (n, c) [m], or [rad] for the rotations of a foundation."""
        return self._vector(0)

    @property
    def force(self) -> ComplexArray:
        """
        Transmitted force, (n, c).

        Through the bearing [N] for its journal and housing; into the soil [N, N m] for a
        foundation; NaN where a channel transmits none.

        """
        return self._vector(1)

    @property
    def velocity(self) -> ComplexArray:
        """Velocity, i speed X, (n, c) [m/s, rad/s]."""
        return 1j * self.speed[:, None] * self.displacement

    def _vector(self, number: int) -> ComplexArray:
        vector = np.empty((len(self.parts), self.parts.shape[3]), dtype=complex)
        # Not a sum with 1j: it would make NaN of both parts where one is infinite.
        vector.real, vector.imag = self.parts[:, 0, number], self.parts[:, 1, number]
        vector.flags.writeable = False  # a copy: writing to it would change nothing
        return vector


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
