"""What can happen to a machine, in four frozen words that every sink understands."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import IntEnum
from typing import TypeAlias

from rotorsoil_ros.physics.arrays import FloatArray, IntArray
from rotorsoil_ros.physics.prediction import Prediction

NANOSECONDS = 1_000_000_000


class Level(IntEnum):
    """How a machine is doing, in the numbers of diagnostic_msgs/DiagnosticStatus."""

    OK = 0
    WARN = 1
    ERROR = 2
    STALE = 3


@dataclass(frozen=True, slots=True)
class Predicted:
    """What a machine should do at each of n reported speeds: NaN where there is no answer."""

    machine: str
    stamp_ns: IntArray
    prediction: Prediction


@dataclass(frozen=True, slots=True)
class Measured:
    """
    One quantity of n measured 1X vectors.

    Attributes
    ----------
    machine, quantity : str
        Name of the machine; `amplitude` (zero-to-peak) or `phase` [rad].
    stamp_ns : (n,) int array
        When it was measured [ns].
    channels : tuple of str
        Where it was measured.
    displacement, velocity : (n, channels) float array
        Amplitude or phase of the displacement [m, rad] and of the velocity [m/s, rad/s];
        NaN where it was not measured.

    """

    machine: str
    quantity: str
    stamp_ns: IntArray
    channels: tuple[str, ...]
    displacement: FloatArray
    velocity: FloatArray


@dataclass(frozen=True, slots=True)
class Diagnostics:
    """Health of one machine: its level, one sentence, and numbers whose keys say their unit."""

    machine: str
    stamp_ns: int
    level: Level
    summary: str
    values: Mapping[str, float]


@dataclass(frozen=True, slots=True)
class Model:
    """What the predictions rest on from `stamp_ns` on."""

    machine: str
    stamp_ns: int
    description: Mapping[str, object]


Event: TypeAlias = Predicted | Measured | Diagnostics | Model
Sink: TypeAlias = Callable[[Event], None]
