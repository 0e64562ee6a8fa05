"""How much of the motion of the ground reaches each place of a machine."""

from dataclasses import dataclass, replace

import numpy as np

from rotorsoil_ros.arrays import ComplexArray, FloatArray
from rotorsoil_ros.channel import Channel, DOFS
from rotorsoil_ros.machine.coupled import CoupledModel
from rotorsoil_ros.prediction import columns_of
from rotorsoil_ros.units import rad_s_to_hz, rad_s_to_rpm, to_lag_deg

# The motions of the ground, which does not turn where nothing stands on it.
ALONG = DOFS[:3]


@dataclass(frozen=True, slots=True, eq=False)
class Transmissibility:
    """
    Motion of every channel per motion of the ground, complex, labelled.

    `found['fan_z']` is that of one channel. The ground moves alike below all blocks and where
    bearings stand on it without one, as a wave does that is long beside the foundation.

    Attributes
    ----------
    channels : tuple of Channel
        What moves.
    omega : (n,) float array
        Frequency of the motion [rad/s].
    speed : float
        Of the rotor [rad/s].
    ratio : (n, c, 3) complex array
        Per motion of the ground along x, y, z [m/m], of a rotation [rad/m]; lead positive.

    """

    channels: tuple[Channel, ...]
    omega: FloatArray
    speed: float
    ratio: ComplexArray

    @classmethod
    def of(cls, model: CoupledModel, omega: FloatArray, *, speed: float) -> 'Transmissibility':
        """Solve at frequencies (n,) [rad/s] while the rotor turns at a speed [rad/s]."""
        ratio, _ = model.ground_response(omega, speed=speed)
        return cls(model.channels, omega, speed, ratio)

    def __len__(self) -> int:
        """Return the number of frequencies."""
        return len(self.omega)

    def __getitem__(self, names: str | tuple[str, ...]) -> 'Transmissibility':
        """Return that of some channels only, as a `Response` does."""
        columns = columns_of(self.channels, names)
        return replace(self, channels=tuple(self.channels[column] for column in columns),
                       ratio=self.ratio[:, columns])

    @property
    def frequency_hz(self) -> FloatArray:
        """Frequency of the motion, (n,) [Hz]."""
        return rad_s_to_hz(self.omega)

    @property
    def speed_rpm(self) -> float:
        """Rotor speed [rpm]."""
        return float(rad_s_to_rpm(self.speed))

    @property
    def amplitude(self) -> FloatArray:
        """Magnitude, (n, c, 3) [m/m, rad/m]."""
        return np.abs(self.ratio)

    def phase_lag_deg(self) -> FloatArray:
        """Return by how much each lags the ground, (n, c, 3) in [0, 360) [deg]."""
        return to_lag_deg(np.asarray(np.angle(self.ratio)))
