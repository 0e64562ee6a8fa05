"""What can happen to a machine, in frozen words that every sink understands."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import IntEnum
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from rotorsoil_ros.arrays import ComplexArray, FloatArray, IntArray
from rotorsoil_ros.channel import Channel
from rotorsoil_ros.compared import Compared, Weighed
from rotorsoil_ros.prediction import Prediction

NANOSECONDS = 1_000_000_000
LAST_STAMP = (1 << 31) * NANOSECONDS - 1  # seconds of a stamp are an int32: until 2038


class Level(IntEnum):
    """How a machine is doing, in the numbers of diagnostic_msgs/DiagnosticStatus."""

    OK = 0
    WARN = 1
    ERROR = 2
    STALE = 3


@dataclass(frozen=True, slots=True)
class Predicted:
    """
    What a machine should do at each of n reported speeds: NaN where there is no answer.

    Attributes
    ----------
    machine : str
        Its name.
    stamp_ns : (n,) int array
        When [ns].
    prediction : Prediction
        With what the changes of the speed have struck.
    steady : Prediction or None
        As if each speed had been there for ever; None of a machine that is answered so.

    """

    machine: str
    stamp_ns: IntArray
    prediction: Prediction
    steady: Prediction | None = None


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
    channels : tuple of Channel
        Where it was measured.
    displacement, velocity : (n, channels) float array
        Amplitude or phase of the displacement [m, rad] and of the velocity [m/s, rad/s];
        NaN where it was not measured.

    """

    machine: str
    quantity: str
    stamp_ns: IntArray
    channels: tuple[Channel, ...]
    displacement: FloatArray
    velocity: FloatArray


@dataclass(frozen=True, slots=True)
class Band:
    """
    Between which amplitudes the prediction lies, as far as the soil is known.

    Attributes
    ----------
    machine : str
        Name of the machine.
    stamp_ns, speed : (n,) arrays
        Of the speeds that it belongs to [ns], [rad/s].
    low, high : (n, channels) float array
        Displacement amplitude of every predicted channel, zero-to-peak [m, rad].

    """

    machine: str
    stamp_ns: IntArray
    speed: FloatArray
    low: FloatArray
    high: FloatArray


@dataclass(frozen=True, slots=True)
class Samples:
    """
    Raw acceleration of one channel.

    Attributes
    ----------
    machine, channel : str, Channel
        Where.
    stamp_ns, acceleration : (n,) arrays
        When [ns], and what was felt [m/s^2].
    is_synthetic : bool
        Computed, not measured.
    felt : (n, 3) float array
        Along all axes of the sensor [m/s^2]; empty: it has no other.
    orientation : (n, 4) float array
        Unit quaternion x, y, z, w by which the sensor says that its axes are turned, NaN where it
        says nothing; empty: it never does.

    """

    machine: str
    channel: Channel
    stamp_ns: IntArray
    acceleration: FloatArray
    is_synthetic: bool = False
    felt: FloatArray = field(default_factory=lambda: np.zeros((0, 3)))
    orientation: FloatArray = field(default_factory=lambda: np.zeros((0, 4)))


@dataclass(frozen=True, slots=True)
class Demodulated:
    """
    Displacement vectors of one channel that were found in its raw samples.

    Attributes
    ----------
    machine, channel : str
        Where.
    stamp_ns, speed : (n,) arrays
        Middle of each stretch of samples [ns], and the speed there [rad/s].
    orders : tuple of int
        Multiples of the speed, 1 first.
    amplitude, phase : (n, orders) float array
        Zero-to-peak [m], [rad]; phases are NaN where nothing tells the angle of the rotor.
    deviation : (n,) float array
        Standard error of the first order's amplitude [m].
    beside : (n, machines) float array
        Amplitude of what each machine beside it does to the channel [m], NaN where the samples
        of a stretch do not tell it apart; empty of a machine that is alone.

    """

    machine: str
    channel: Channel
    stamp_ns: IntArray
    speed: FloatArray
    orders: tuple[int, ...]
    amplitude: FloatArray
    phase: FloatArray
    deviation: FloatArray
    beside: FloatArray = field(default_factory=lambda: np.zeros((0, 0)))


@dataclass(frozen=True, slots=True)
class Grounded:
    """
    What ground that moves by itself did to a machine, once per turn.

    Attributes
    ----------
    machine : str
        Name of the machine.
    stamp_ns : (n,) int array
        Middle of the turns over which sensors on the ground were heard [ns].
    motion : (n, 3) complex array
        Of the ground along x, y, z as if the machine did not stand on it [m].
    prediction : Prediction
        What that motion does to every channel.

    """

    machine: str
    stamp_ns: IntArray
    motion: ComplexArray
    prediction: Prediction


@dataclass(frozen=True, slots=True)
class Expected:
    """By what the machine is judged from `stamp_ns` on: criteria as plain arrays."""

    machine: str
    stamp_ns: int
    criteria: Mapping[str, npt.NDArray[Any]]


@dataclass(frozen=True, slots=True)
class Zoned:
    """In which zone (A, B, C, D) each housing channel is, predicted and measured."""

    machine: str
    stamp_ns: int
    predicted: Mapping[Channel, str]
    measured: Mapping[Channel, str]


@dataclass(frozen=True, slots=True)
class Remark:
    """Something that a reader of the log should know happened at `stamp_ns`."""

    machine: str
    stamp_ns: int
    level: Level
    text: str


@dataclass(frozen=True, slots=True)
class Diagnostics:
    """
    Health of one machine: its level, one sentence, and values whose keys say their unit.

    `parts` are the same of something that belongs to it, each under a name of its own.
    """

    machine: str
    stamp_ns: int
    level: Level
    summary: str
    values: Mapping[str, float | str]
    name: str = ''
    parts: tuple['Diagnostics', ...] = ()


@dataclass(frozen=True, slots=True)
class Model:
    """What the predictions rest on from `stamp_ns` on."""

    machine: str
    stamp_ns: int
    description: Mapping[str, object]


Event: TypeAlias = (
    Predicted | Measured | Band | Samples | Demodulated | Compared | Grounded | Weighed | Expected
    | Zoned | Remark | Diagnostics | Model)
Sink: TypeAlias = Callable[[Event], None]
