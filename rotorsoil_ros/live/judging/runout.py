"""What a probe sees although nothing vibrates: measured at slow roll, subtracted above it."""

from collections.abc import Sequence

import numpy as np

from rotorsoil_ros.physics.arrays import BoolArray, FloatArray
from rotorsoil_ros.physics.comparison import SLOW_ROLL_WINDOW


class Runout:
    """
    The mean vector of each channel near the slow-roll speed, as far as it has been seen.

    A machine that comes back to slow roll is measured anew: runout changes with temperature.
    """

    def __init__(self, slow_roll_speed: float) -> None:
        self._speed = slow_roll_speed
        self._sums: dict[str, complex] = {}
        self._counts: dict[str, int] = {}
        self._has_left: set[str] = set()

    def is_rolling(self, speed: FloatArray) -> BoolArray:
        """Return which speeds, (n,) [rad/s], are those of slow roll; none if none is named."""
        return np.asarray(np.abs(speed - self._speed) <= SLOW_ROLL_WINDOW * self._speed)

    def subtract(
        self, channels: Sequence[str], speed: FloatArray, amplitude: FloatArray,
        phase: FloatArray,
    ) -> tuple[FloatArray, FloatArray]:
        """
        Learn from vectors at slow roll, and subtract from all what is known.

        Parameters
        ----------
        channels : sequence of str
            Where was measured.
        speed : (n,) float array
            [rad/s].
        amplitude, phase : (n, channels) float array
            Displacements [m, rad], [rad]; without a phase nothing can be subtracted.

        """
        if np.isnan(self._speed):
            return amplitude, phase
        vectors = amplitude * np.exp(1j * phase)
        rolling = self.is_rolling(speed)
        for column, channel in enumerate(channels):
            for row in np.flatnonzero(np.isfinite(vectors[:, column])).tolist():
                vectors[row, column] -= self._of(
                    channel, complex(vectors[row, column]), rolls=bool(rolling[row]))
        known = np.isfinite(vectors)
        return (np.where(known, np.abs(vectors), amplitude),
                np.where(known, np.angle(vectors), phase))

    def _of(self, channel: str, vector: complex, *, rolls: bool) -> complex:
        """Return the runout of a channel, after learning from a vector."""
        if not rolls:
            self._has_left.add(channel)
        elif channel in self._has_left or channel not in self._counts:
            self._has_left.discard(channel)
            self._sums[channel], self._counts[channel] = vector, 1
        else:
            self._sums[channel] += vector
            self._counts[channel] += 1
        count = self._counts.get(channel, 0)
        return self._sums[channel] / count if count else 0j
