"""Who runs beside a machine? How fast, and what would that do to a vector that is measured."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, partial
import math
from typing import Protocol

import numpy as np

from rotorsoil_ros.arrays import BoolArray, ComplexArray, FloatArray
from rotorsoil_ros.case.machine import Machine
from rotorsoil_ros.channel import Channel
from rotorsoil_ros.events import NANOSECONDS
from rotorsoil_ros.machine.response import Predictor
from rotorsoil_ros.monitor.vectors.history import History
from rotorsoil_ros.monitor.vectors.orders import SpeedTrack
from rotorsoil_ros.units import RADIANS_PER_TURN

# A machine of which nothing was told for so long runs at a speed that nobody knows [s].
UNHEARD_S = 3.0

# A speed that nobody tells may be off the rated one by this share of it: slip, load, a converter.
RATED_WITHIN = 0.05

# Below this share of the slowest speed that is predicted a machine stands: it does nothing.
_STANDS = 0.05

# Whose part turns by more than this against another in a stretch of samples, fewer turns than the
# one in which it goes round, is told apart by them; so many machines at most.
_APART, _MOST_FITTED = 0.25, 4


@dataclass(frozen=True)
class Companion:
    """
    A machine that runs beside another one.

    Attributes
    ----------
    name : str
        Its name.
    rated_speed : float
        At which it is taken to run where nobody tells [rad/s].
    predictor : callable
        Returns what predicts its part, as it is now.
    history : callable or None
        Returns what is told of its speed, or of that of the machine which drives it; None where
        nobody tells.
    times : float
        Turns of it for one turn of what is told.
    driver : str
        Name of the machine that drives it where that one's speed is told; empty of its own.

    """

    name: str
    rated_speed: float
    predictor: Callable[[], Predictor]
    history: Callable[[], History] | None = None
    times: float = 1.0
    driver: str = ''

    def seen(self, from_ns: int, until_ns: int) -> tuple[float, float]:
        """
        Return its speed at a stamp [rad/s], and by which angle it has turned since another [rad].

        NaN where it is not known; whole turns may be left out.
        """
        if self.history is None:
            return self.rated_speed, math.nan
        track = self.history().between(from_ns, until_ns, within_s=UNHEARD_S)
        if track is None:  # it may be heard again
            track = self.history().between(until_ns, until_ns, within_s=UNHEARD_S)
            return (math.nan if track is None else
                    self.times * float(track.at(np.zeros(1))[1][0])), math.nan
        angle, speed, _ = track.at(np.array([0.0, (until_ns - from_ns) / NANOSECONDS]))
        return self.times * float(speed[1]), self.times * float(angle[1] - angle[0])

    def track(self, from_ns: int, until_ns: int, zero_ns: int) -> SpeedTrack | None:
        """Return how it turned between two stamps, in seconds since another; None if unknown."""
        found = None if self.history is None else self.history().between(
            from_ns, until_ns, within_s=UNHEARD_S)
        if found is None:
            return None
        # The angle of a machine that drives it says little of its own.
        return SpeedTrack(found.time + (from_ns - zero_ns) / NANOSECONDS,
                          self.times * found.speed, None,
                          found.angle if self.times == 1.0 else None)

    def latest(self, now_ns: int) -> float:
        """Return its speed as it was told last [rad/s], NaN if that is long ago."""
        if self.history is None:
            return self.rated_speed
        history = self.history()
        is_heard = abs(now_ns - history.last_ns) <= UNHEARD_S * NANOSECONDS
        return self.times * history.last_speed if is_heard else math.nan


class Runner(Protocol):
    """A machine of which it is told how fast it turns, and known what it does then."""

    @property
    def history(self) -> History:
        """What is told of its speed."""

    @property
    def predictor(self) -> Predictor:
        """What its predictions are looked up in now."""


def companions_of(
    machine: Machine, others: Sequence[Machine], told: Mapping[str, Runner],
) -> list[Companion]:
    """
    Return the machines that run beside one.

    Parameters
    ----------
    machine, others : Machine, sequence of Machine
        One of several of a plant, and the others that run.
    told : mapping of str to Runner
        By name those machines of the plant, the one itself among them, that are listened to.

    """
    geared = {one.case.name: one.case.berth.geared for one in (machine, *others)
              if one.case.berth is not None and one.case.berth.geared is not None}
    found = []
    for other in others:
        name, times, berth = other.case.name, 1.0, other.case.berth
        while name not in told and name in geared:
            name, ratio = geared[name]
            times *= ratio
        driver, own = told.get(name), told.get(other.case.name)
        assert berth is not None
        found.append(Companion(
            other.case.name, berth.rated_speed,
            partial(_predictor, own) if own is not None else
            cache(partial(other.table.predictor, other.case.unbalance)),
            None if driver is None else partial(_history, driver), times,
            '' if driver is None or own is not None else name))
    return found


def _predictor(runner: Runner) -> Predictor:
    return runner.predictor


def _history(runner: Runner) -> History:
    return runner.history


class Companions:
    """
    The machines beside one machine, m of them in the order of the case.

    Parameters
    ----------
    own : History
        Speeds of the machine itself.
    others : sequence of Companion
        Those beside it.
    turns : float
        Turns of the machine over which vectors of raw samples are taken; those that come as
        vectors, of which nobody knows, are taken to be no shorter.

    """

    def __init__(self, own: History, others: Sequence[Companion], *, turns: float) -> None:
        self._own, self.others, self._turns = own, tuple(others), turns
        self.rated = np.array([one.rated_speed for one in others])

    def heard_until(self) -> int:
        """Return up to which stamp all speeds are known of those that have been heard lately."""
        own = until = self._own.last_ns
        for one in self.others:
            if one.history is not None:
                told = one.history().track_ns
                if own - told <= UNHEARD_S * NANOSECONDS:
                    until = min(until, told)
        return until

    def seen(self, from_ns: int, until_ns: int) -> tuple[FloatArray, ComplexArray]:
        """
        Return the speed of each, (m,) [rad/s], and how far it turned since another stamp.

        That is exp(i phi), (m,), by the angle phi that it turned more than the machine did. NaN
        where it is not known.
        """
        speed, angle = np.array([one.seen(from_ns, until_ns) for one in self.others]).T
        own = self._own.between(from_ns, until_ns, within_s=UNHEARD_S)
        if own is None:
            return speed, np.full(len(speed), complex(math.nan, math.nan))
        turned = np.diff(own.at(np.array([0.0, (until_ns - from_ns) / NANOSECONDS]))[0])
        return speed, np.exp(1j * (angle - turned))

    def latest(self, now_ns: int) -> FloatArray:
        """Return the speed of each as it was told last, (m,) [rad/s], NaN if long ago."""
        return np.array([one.latest(now_ns) for one in self.others])

    def parts(self, speed: FloatArray, channels: Sequence[Channel]) -> FloatArray:
        """
        Return the predicted amplitude of each part, (n, channels, m) [m, rad].

        At the rated speed where none is known; NaN where there is no answer, and 0 where it
        stands or the channel is not one that is predicted.

        Parameters
        ----------
        speed : (n, m) float array
            Of each [rad/s], NaN where it is not known.
        channels : sequence of Channel
            Where.

        """
        speed = np.where(np.isfinite(speed), speed, self.rated)
        found = np.zeros((len(speed), len(channels), len(self.others)))
        for number, one in enumerate(self.others):
            predictor, told = one.predictor(), speed[:, number]
            known = [column for column, name in enumerate(channels) if name in predictor.channels]
            columns = [predictor.channels.index(channels[column]) for column in known]
            stands = np.abs(told) <= _STANDS * predictor.table.speed_range[0]
            found[:, known, number] = np.where(
                stands[:, None], 0.0, np.abs(predictor.answer(told).displacement[:, columns]))
        return found

    def told_apart(
        self, channel: Channel, from_ns: int, until_ns: int, *, zero_ns: int, own: float,
        orders: Sequence[int],
    ) -> dict[int, SpeedTrack]:
        """
        Return which of them samples between two stamps tell apart, and how these turned.

        Parameters
        ----------
        channel : Channel
            Where was measured: those that move it most come first.
        from_ns, until_ns, zero_ns : int
            Of the first and the last sample, and from where tracks count their seconds [ns].
        own : float
            Speed of the machine [rad/s].
        orders : sequence of int
            Multiples of it that are looked for besides: what is as fast is not told apart.

        """
        span = (until_ns - from_ns) / NANOSECONDS / RADIANS_PER_TURN
        tracks = {}
        for number, one in enumerate(self.others):
            if (track := one.track(from_ns, until_ns, zero_ns)) is not None:
                tracks[number] = track
        speed = np.full(len(self.others), np.nan)
        speed[list(tracks)] = [float(np.median(track.speed)) for track in tracks.values()]
        size = speed**2 * self.parts(speed[None], (channel,))[0, 0]
        found: dict[int, SpeedTrack] = {}
        taken = [0.0, *(order * own for order in orders)]
        for number in np.argsort(-np.where(np.isnan(size), np.inf, size), kind='stable').tolist():
            if number in tracks and size[number] != 0.0 and len(found) < _MOST_FITTED and all(
                    abs(speed[number] - other) * span >= _APART for other in taken):
                taken.append(float(speed[number]))
                found[number] = tracks[number]
        return found

    def spread_out(self, numbers: Sequence[int], values: FloatArray) -> FloatArray:
        """Return values of some of them as those of all, (m,), NaN of the others."""
        found = np.full(len(self.others), np.nan)
        found[list(numbers)] = values
        return found

    def is_told(self, speed: FloatArray) -> BoolArray:
        """Return which of speeds, (n, m), were told and not taken to be the rated ones."""
        return np.asarray(np.isfinite(speed) & np.array(
            [one.history is not None for one in self.others]))

    def leaks(
        self, own: FloatArray, speed: FloatArray, *, of_samples: BoolArray,
    ) -> FloatArray:
        """
        Return which share of each part is in vectors of the machine, (n, m).

        Parameters
        ----------
        own : (n,) float array
            Its speed [rad/s].
        speed : (n, m) float array
            Of the others [rad/s], NaN where it is not known.
        of_samples : (n,) bool array
            Which vectors were found in samples, over turns that are known.

        Notes
        -----
        The mean of exp(i w t) over T seconds is sinc(w T / 2 pi). Where w or T is known in part
        only, it is the most that it may be.

        """
        is_told = self.is_told(speed)
        apart = np.where(is_told, speed - own[:, None], np.maximum(
            np.abs(self.rated - own[:, None]) - RATED_WITHIN * self.rated, 0.0))
        with np.errstate(divide='ignore', invalid='ignore'):
            turned = self._turns * apart / own[:, None]
            most = np.minimum(1.0, 1.0 / (0.5 * RADIANS_PER_TURN * np.abs(turned)))
        return np.where(is_told & of_samples[:, None], np.sinc(turned), most)
