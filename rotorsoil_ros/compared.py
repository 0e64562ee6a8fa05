"""Measured vectors beside what was predicted for them, and whether they count."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, fields
from enum import StrEnum
from typing import Any

import numpy as np
import numpy.typing as npt

from rotorsoil_ros.arrays import ComplexArray, FloatArray, IntArray
from rotorsoil_ros.channel import Channel


@dataclass(frozen=True, slots=True, eq=False)
class Beside:
    """
    What the machines on the same blocks do to n measured vectors of one of them.

    Attributes
    ----------
    slack : (n, channels) float array
        By how much they may have moved an amplitude, were they as predicted, less what could be
        told apart and was taken out [m, rad].
    mixed_s : (n, channels) float array
        For how long what is of the machine could not be told from what is theirs, however large
        they are; NaN where it can [s].
    blurred_s : (n, channels) float array
        For how long it could not be told how much each has in the whole; NaN where it can [s].
    measured, predicted : (n, channels, machines) float array
        How fast each of them moves the channel, as far as it could be told apart and else as
        predicted; and as predicted. NaN where its speed is not known [m/s, rad/s rms].

    """

    slack: FloatArray
    mixed_s: FloatArray
    blurred_s: FloatArray
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


class Reason(StrEnum):
    """Why a measured point is not held against its prediction."""

    USED = ''
    NOT_FINITE = 'measured value is negative or not finite'
    NO_SPEED = 'no speed reported near its stamp'
    OUT_OF_TABLE = 'outside the speed range of the prediction'
    NO_PREDICTION = 'channel or speed has no prediction'
    SLOW_ROLL = 'slow roll, taken as runout'
    BELOW_NOISE = 'below noise'
    BESIDE = 'held against a band that the part of a machine beside it widens'
    NOT_APART = 'not yet told apart from a machine beside it'
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
