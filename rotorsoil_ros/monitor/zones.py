"""In which zone a housing vibrates, by the model's class of its support. Nothing chatters."""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
import math
from typing import Literal

import numpy as np

from rotorsoil_ros.arrays import BoolArray, FloatArray
from rotorsoil_ros.case.zone_limits import (
    held_support_class,
    held_zone,
    support_class,
    SupportClass,
    Zone,
    zone,
    ZoneLimits,
)
from rotorsoil_ros.channel import Channel
from rotorsoil_ros.compared import Reason, Weighed
from rotorsoil_ros.events import NANOSECONDS
from rotorsoil_ros.monitor.inside import HYSTERESIS
from rotorsoil_ros.monitor.vectors.history import STEADY

# After this time without another vector a second is judged as it is [s].
SECOND_PATIENCE_S = 2.0

# Only such vectors are motions of the housing: others are noise, runout or no number.
_MOTIONS = (Reason.USED, Reason.NOT_QUASI_STATIC, Reason.STILL_RINGS, Reason.NO_PREDICTION,
            Reason.OUT_OF_TABLE, Reason.BESIDE, Reason.NOT_APART)


_WELL = ('A', 'B')


@dataclass(frozen=True, slots=True)
class HousingZone:
    """
    Worst zone of a housing: what, where [rad/s], how fast [m/s rms], by which limits.

    `zone` is empty where the speed of a machine beside it is not known and the others alone are
    not in zone C: of that nobody can say that it is well. `shares` are those of each machine in
    the square of the velocity, NaN of such a one; none where they could not be told apart, or the
    machine is alone.
    """

    channel: Channel
    source: str
    speed: float
    velocity: float
    zone: Zone | Literal['']
    support: SupportClass
    limits: tuple[float, float, float]
    is_steady: bool
    shares: Mapping[str, float] = field(default_factory=dict)

    @property
    def badness(self) -> tuple[bool, float]:
        """By what zones are compared: those at constant speed count first."""
        # What is known in part may be as bad as where zone C begins.
        least = self.velocity if self.zone else max(self.velocity, self.limits[1])
        # That of displacement falls with speed: at standstill there is none.
        return self.is_steady, least / (self.limits[2] or math.inf)


@dataclass(slots=True)
class HousingState:
    """
    One housing channel as last held.

    Attributes
    ----------
    velocity, alarm, trip : float
        How fast it moves, and from which velocity on that is an alarm and a reason to stop
        [m/s rms].
    zone, support : str or None
        Its zone, and the class of its support.
    shares : mapping of str to float
        As those of a `HousingZone`.

    """

    velocity: float = math.nan
    alarm: float = math.nan
    trip: float = math.nan
    zone: Zone | None = None
    support: SupportClass | None = None
    shares: Mapping[str, float] = field(default_factory=dict)

    @property
    def exceeds(self) -> str:
        """Which of both limits is exceeded; nothing where none is."""
        return 'trip' if self.velocity > self.trip else (
            'alarm' if self.velocity > self.alarm else '')


@dataclass(slots=True, eq=False)
class _Second:
    """
    What was measured of a housing in one second of its own time; (n,) each.

    Velocities are (n, machines): of the machine itself, then of each beside it. Those that are
    not told apart are in the velocity of the machine itself.
    """

    second: int
    speed: FloatArray
    measured: FloatArray
    predicted: FloatArray
    is_steady: BoolArray
    is_blurred: BoolArray

    def extended(self, other: '_Second') -> '_Second':
        return _Second(self.second, *(np.concatenate([getattr(self, name), getattr(other, name)])
                                      for name in ('speed', 'measured', 'predicted',
                                                   'is_steady', 'is_blurred')))


class Zones:
    """
    The zones of the housings of one machine, now and at their worst.

    The velocity of a housing is the median of its vectors in each second: one bad sample is no
    alarm. Seconds are those of the measurement's own time, so that it does not matter when, or
    in which parts, the vectors come.

    Attributes
    ----------
    machines : sequence of str
        Its name and those of the machines beside it, which shake the housing too: its zone is
        that of all together. None of a machine that is alone.

    """

    def __init__(self, limits: ZoneLimits, channels: Collection[Channel]) -> None:
        self._limits = limits
        self._channels = frozenset(channels)
        self.machines: Sequence[str] = ()
        self.natural: Mapping[str, float] = {}
        # Who is told the zone of every housing in every second of the run.
        self.listener: Callable[[int, HousingZone], None] = _nobody
        self._open: dict[Channel, _Second] = {}
        self._worst: dict[tuple[Channel, str], HousingZone] = {}
        self.predicted: dict[Channel, HousingState] = {}
        self.measured: dict[Channel, HousingState] = {}

    def predict(self, velocities: Mapping[Channel, FloatArray], speed: float) -> None:
        """Zone predicted housing velocities, (machines,) [m/s rms] each, at a speed [rad/s]."""
        for channel, parts in velocities.items():
            self._hold(self.predicted, channel, _Whole.of(parts[None], is_blurred=False), speed)

    def take(self, weighed: Weighed) -> None:
        """Take vectors of which it is known why they do not count."""
        compared, reason = weighed.compared, weighed.reason
        factor = np.abs(compared.speed) / math.sqrt(2.0)
        steady = np.abs(weighed.rate) <= STEADY * np.abs(compared.speed)
        seconds = compared.stamp_ns // NANOSECONDS
        for column, channel in enumerate(compared.channels):
            if not channel.is_housing or channel not in self._channels:
                continue
            measured = (factor * compared.amplitude[:, column])[:, None]
            predicted = (factor * np.abs(compared.predicted[:, column]))[:, None]
            blurred = np.zeros(len(seconds), dtype=bool)
            moves = np.isin(reason[:, column], _MOTIONS) & np.isfinite(measured[:, 0])
            if (beside := compared.beside) is not None:
                # At first it is not the whole that is known, but how large it is at this moment.
                moves &= ~(beside.blurred_s[:, column] < SECOND_PATIENCE_S)
                blurred = np.isfinite(beside.blurred_s[:, column])
                measured = np.concatenate([measured, beside.measured[:, column]], axis=1)
                predicted = np.concatenate([predicted, beside.predicted[:, column]], axis=1)
            for second in np.unique(seconds[moves]).tolist():
                rows = moves & (seconds == second)
                self._add(channel, _Second(second, compared.speed[rows], measured[rows],
                                           predicted[rows], steady[rows],
                                           blurred[rows]))

    def close(self, now_ns: float) -> None:
        """Judge the seconds to which nothing more will come at a time [ns]."""
        for channel, second in list(self._open.items()):
            if (second.second + 1 + SECOND_PATIENCE_S) * NANOSECONDS <= now_ns:
                self._judge(channel, self._open.pop(channel))

    def worst(self) -> list[HousingZone]:
        """Return the worst zone of every housing, measured and predicted, so far."""
        return list(self._worst.values())

    def _add(self, channel: Channel, new: _Second) -> None:
        known = self._open.get(channel)
        if known is not None and known.second == new.second:
            new = known.extended(new)
        elif known is not None:
            self._judge(channel, known)
        self._open[channel] = new

    def _judge(self, channel: Channel, second: _Second) -> None:
        speed, is_steady = float(second.speed[-1]), bool(second.is_steady.all())
        for source, values in (('predicted', second.predicted), ('measured', second.measured)):
            given = values[np.isfinite(values[:, 0])]
            if not len(given):
                continue
            whole = _Whole.of(given, is_blurred=(
                source == 'measured' and bool(second.is_blurred.any())))
            if source == 'measured':
                self._hold(self.measured, channel, whole, speed)
            support = support_class(self.natural[channel.axis], speed)
            limits = self._limits.of(support, abs(speed))
            found = HousingZone(channel, source, speed, whole.velocity,
                                whole.claims(zone(whole.velocity, limits)) or '', support,
                                limits, is_steady, self._named(whole))
            self.listener(second.second, found)
            before = self._worst.get((channel, source))
            if before is None or found.badness > before.badness:
                self._worst[channel, source] = found

    def _hold(
        self, states: dict[Channel, HousingState], channel: Channel, whole: '_Whole',
        speed: float,
    ) -> None:
        state = states.setdefault(channel, HousingState())
        state.velocity, state.shares = whole.velocity, self._named(whole)
        support = held_support_class(
            state.support, self.natural[channel.axis], speed, hysteresis=HYSTERESIS)
        # Other limits make another question: nothing is held over from the last one.
        before = state.zone if support == state.support else None
        state.support = support
        state.alarm = self._limits.alarm(support, abs(speed))
        state.trip = self._limits.trip(support, abs(speed))
        state.zone = whole.claims(held_zone(
            before, whole.velocity, self._limits.of(support, abs(speed)), hysteresis=HYSTERESIS))

    def _named(self, whole: '_Whole') -> Mapping[str, float]:
        return dict(zip(self.machines, whole.shares, strict=True)) if whole.shares else {}


@dataclass(frozen=True, slots=True)
class _Whole:
    """All machines together: their velocity [m/s rms], and the share of each in its square."""

    velocity: float
    shares: tuple[float, ...] = ()
    is_least: bool = False

    @classmethod
    def of(cls, parts: FloatArray, *, is_blurred: bool) -> '_Whole':
        """Return the median of n velocities of m machines, (n, m); NaN of one is not known."""
        if parts.shape[1] == 1:
            return cls(float(np.median(parts)))
        square = parts**2
        whole = np.nansum(square, axis=1)
        with np.errstate(invalid='ignore', divide='ignore'):
            shares = np.mean(square / whole[:, None], axis=0)
        return cls(float(np.median(np.sqrt(whole))), () if is_blurred else tuple(shares.tolist()),
                   bool(np.isnan(square).any()))

    def claims(self, found: Zone) -> Zone | None:
        """Return a zone, but none that is well while a machine is missing from the whole."""
        return None if self.is_least and found in _WELL else found


def _nobody(second: int, found: HousingZone) -> None:
    """Listen to nothing."""


def worst_state(states: Mapping[Channel, HousingState]) -> tuple[Channel, HousingState] | None:
    """Return the channel that is worst now, by its zone and then by its velocity."""
    known = [entry for entry in states.items() if entry[1].zone is not None]
    return max(known, key=lambda entry: (entry[1].zone or '', entry[1].velocity), default=None)
