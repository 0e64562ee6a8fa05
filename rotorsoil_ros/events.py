"""What can happen to a machine, in frozen words that every sink understands."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from enum import IntEnum, StrEnum
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from rotorsoil_ros.arrays import ComplexArray, FloatArray, IntArray
from rotorsoil_ros.channel import Channel
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

    """

    machine: str
    channel: Channel
    stamp_ns: IntArray
    speed: FloatArray
    orders: tuple[int, ...]
    amplitude: FloatArray
    phase: FloatArray
    deviation: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Beside:
    """
    What the machines on the same blocks do to n measured vectors of one of them.

    Attributes
    ----------
    slack : (n, channels) float array
        By how much they may have moved an amplitude, less what could be told apart and was
        taken out [m, rad].
    measured, predicted : (n, channels, machines) float array
        How fast each of them moves the channel, as far as it could be told apart and else as
        predicted; and as predicted. NaN where its speed is not known [m/s, rad/s rms].

    """

    slack: FloatArray
    measured: FloatArray
    predicted: FloatArray


@dataclass(frozen=True, slots=True)
class Compared:
    """
    Measured once-per-turn vectors beside what was predicted for the speed at their stamps.

    Attributes
    ----------
    machine : str
        Name of the machine.
    stamp_ns, speed : (n,) arrays
        Of the measurement [ns]; told nearest to it [rad/s].
    channels : tuple of Channel
        Where; each of them is predicted.
    amplitude, phase : (n, channels) float array
        Measured, less runout where it is known [m, rad], [rad]; phases NaN where unknown.
    deviation : (n, channels) float array
        Standard error of the amplitude [m, rad], 0 where it is not known.
    predicted : (n, channels) complex array
        [m, rad]; NaN where the table has a gap.
    low, high : (n, channels) float array
        Band of the predicted amplitude, NaN where none is known.
    behind, ahead : (n, channels) float array
        Band of the predicted phase about that of the prediction [rad], likewise.
    beside : Beside or None
        What machines beside it do, by which the bands are wider; None of one that is alone.

    """

    machine: str
    stamp_ns: IntArray
    speed: FloatArray
    channels: tuple[Channel, ...]
    amplitude: FloatArray
    phase: FloatArray
    deviation: FloatArray
    predicted: ComplexArray
    low: FloatArray
    high: FloatArray
    behind: FloatArray
    ahead: FloatArray
    beside: Beside | None = None

    @property
    def residual(self) -> FloatArray:
        """
        Amplitude of measured minus predicted, (n, channels) [m, rad].

        Beyond what machines beside it may have done: that is no residual of this one.
        """
        measured = self.amplitude * np.exp(1j * self.phase)
        apart = np.asarray(np.abs(measured - self.predicted))
        return apart if self.beside is None else np.maximum(apart - self.beside.slack, 0.0)

    def rows(self, which: npt.NDArray[Any]) -> 'Compared':
        """Return some of the points."""
        return self._made(lambda part: part[which], self.channels)

    def columns(self, which: Sequence[int]) -> 'Compared':
        """Return some of the channels."""
        if len(which) == len(self.channels):
            return self
        return self._made(lambda part: part[:, which] if part.ndim > 1 else part,
                          tuple(self.channels[column] for column in which))

    @classmethod
    def joined(cls, events: Iterable['Compared']) -> list['Compared']:
        """Return what was compared, once for each set of channels."""
        by_channels: dict[tuple[Channel, ...], list[Compared]] = {}
        for event in events:
            by_channels.setdefault(event.channels, []).append(event)
        return [found[0]._made(lambda *parts: np.concatenate(parts), channels, *found[1:])
                if len(found) > 1 else found[0] for channels, found in by_channels.items()]

    def _made(
        self, make: Callable[..., npt.NDArray[Any]], channels: tuple[Channel, ...],
        *others: 'Compared',
    ) -> 'Compared':
        """Return an event with arrays that are made of those of this one and of others."""
        beside = None if self.beside is None else Beside(*(
            make(*(getattr(each.beside, name) for each in (self, *others)))
            for name in Beside.__slots__))
        return Compared(machine=self.machine, channels=channels, beside=beside, **{
            name: make(*(getattr(each, name) for each in (self, *others))) for name in _ARRAYS})


_ARRAYS = tuple(entry.name for entry in fields(Compared)
                if entry.name not in ('machine', 'channels', 'beside'))


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


class Reason(StrEnum):
    """Why a measured point is not held against its prediction."""

    USED = ''
    NOT_FINITE = 'measured value is negative or not finite'
    NO_SPEED = 'no speed reported near its stamp'
    OUT_OF_TABLE = 'outside the speed range of the prediction'
    NO_PREDICTION = 'channel or speed has no prediction'
    SLOW_ROLL = 'slow roll, taken as runout'
    BELOW_NOISE = 'below noise'
    BESIDE = 'held against a band that the part of machines beside it widens'
    NOT_QUASI_STATIC = 'not quasi-static'
    STILL_RINGS = 'may ring from before the beginning'


@dataclass(frozen=True, slots=True)
class Weighed:
    """
    Whether compared points count, decided when their passage is over.

    Attributes
    ----------
    compared : Compared
        The points; NaN as their speed where none was told near them.
    rate : (n,) float array
        Of the speed [rad/s^2].
    reason : (n, channels) array of Reason
        Why a point does not count; USED where it does.

    """

    compared: Compared
    rate: FloatArray
    reason: npt.NDArray[Any]

    @property
    def machine(self) -> str:
        """Name of the machine."""
        return self.compared.machine


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
