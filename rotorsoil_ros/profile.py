"""Which speeds a machine ran at, and when."""

from dataclasses import dataclass

from rotorsoil_ros.arrays import FloatArray, IntArray
from rotorsoil_ros.units import rad_s_to_rpm


@dataclass(frozen=True, slots=True, eq=False)
class Profile:
    """
    Which speeds a machine ran at.

    Attributes
    ----------
    machine : str
        Its name, empty if the topic tells none.
    stamp_ns : (n,) int array
        When [ns].
    speed : (n,) float array
        [rad/s].

    """

    machine: str
    stamp_ns: IntArray
    speed: FloatArray

    @property
    def speed_rpm(self) -> FloatArray:
        """Speeds, (n,) [rpm]."""
        return rad_s_to_rpm(self.speed)
