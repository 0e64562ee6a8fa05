"""In which zone a housing vibrates, by the model's class of its support."""

from collections import deque
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
import math

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
from rotorsoil_ros.events import Compared, Level, NANOSECONDS
from rotorsoil_ros.monitor.criteria import Expectation
from rotorsoil_ros.monitor.points import ChannelPoints, nearest, Reference
from rotorsoil_ros.monitor.quasistatic import speed_rate
from rotorsoil_ros.monitor.rules import Rules

# Slower than this share of itself per second a speed counts as constant [1/s].
STEADY = 0.005


@dataclass(frozen=True, slots=True)
class HousingZone:
    """Worst zone of a housing: what, where [rad/s], how fast [m/s rms], by which limits."""

    channel: Channel
    source: str
    speed: float
    velocity: float
    zone: Zone
    support: SupportClass
    limits: tuple[float, float, float]
    is_steady: bool


def housing_zones(
    channel: ChannelPoints, reference: Reference, expectation: Expectation, *,
    limits: ZoneLimits, tolerance: float,
) -> list[HousingZone]:
    """
    Return the worst zone predicted and measured, at constant speed if there was any.

    Parameters
    ----------
    channel : ChannelPoints
        Of a housing.
    reference : Reference
        The run.
    expectation : Expectation
        The case; it tells the class of the support.
    limits : ZoneLimits
        Boundaries [m/s].
    tolerance : float
        Of stamps that belong together [s].

    """
    index = nearest(channel.stamp_ns, reference.stamp_ns, tolerance=tolerance)
    rate = speed_rate(reference.time, reference.speed)[index]
    steady = np.isfinite(channel.speed) & (np.abs(rate) <= STEADY * np.abs(channel.speed))
    natural = expectation.lowest_natural_speed(channel.channel.axis)
    found = [_worst(channel, source, amplitude, steady, natural=natural, limits=limits)
             for source, amplitude in (('predicted', np.abs(channel.predicted)),
                                       ('measured', channel.amplitude))]
    return [entry for entry in found if entry is not None]


def _worst(
    channel: ChannelPoints, source: str, amplitude: FloatArray, steady: BoolArray, *,
    natural: float, limits: ZoneLimits,
) -> HousingZone | None:
    velocity = np.abs(channel.speed) * amplitude / math.sqrt(2.0)
    chosen = np.isfinite(velocity)
    if (chosen & steady).any():
        chosen &= steady
    if not chosen.any():
        return None
    candidates = []
    flexible = np.array([support_class(natural, speed) == 'flexible'
                         for speed in channel.speed.tolist()])
    for support, of_class in (('rigid', ~flexible), ('flexible', flexible)):
        if (mine := chosen & of_class).any():
            kind: SupportClass = 'rigid' if support == 'rigid' else 'flexible'
            # The worst is what comes closest to its limit: that of displacement falls with speed.
            highest = np.array([limits.of(kind, abs(speed))[2]
                                for speed in channel.speed.tolist()])
            share = velocity / np.where(highest > 0.0, highest, 1.0)
            at = int(np.where(mine, share, -1.0).argmax())
            bounds, value = limits.of(kind, abs(float(channel.speed[at]))), float(velocity[at])
            candidates.append(HousingZone(
                channel.channel, source, float(channel.speed[at]), value, zone(value, bounds),
                kind, bounds, bool(steady[at])))
    return max(candidates, key=lambda entry: entry.velocity / entry.limits[2])


HYSTERESIS = 0.05  # share of a limit, below which the better zone is believed again
WINDOW_S = 10.0  # of points whose share inside the band is judged
FEWEST = 5
LEVELS = {'A': Level.OK, 'B': Level.OK, 'C': Level.WARN, 'D': Level.ERROR}
MM = 1e3


@dataclass(slots=True)
class HousingState:
    """One housing channel: velocity [m/s rms], zone and class of its support as last held."""

    velocity: float = math.nan
    zone: Zone | None = None
    support: SupportClass | None = None


class Vibration:
    """The zones and the share inside the band of one machine, held against chatter."""

    def __init__(self, rules: Rules) -> None:
        self._rules = rules
        self.predicted: dict[Channel, HousingState] = {}
        self.measured: dict[Channel, HousingState] = {}
        self._inside: dict[Channel, deque[tuple[int, bool]]] = {}
        self.outside: frozenset[Channel] = frozenset()

    def predict(
        self, velocities: Mapping[Channel, float], speed: float, natural: Mapping[str, float],
    ) -> None:
        """Zone predicted housing velocities [m/s rms] at a speed [rad/s]."""
        for channel, velocity in velocities.items():
            self._hold(self.predicted, channel, velocity, speed, natural)

    def measure(self, compared: Compared, natural: Mapping[str, float]) -> None:
        """Zone measured housing velocities by their median: one bad sample is no alarm."""
        velocity = np.abs(compared.speed)[:, None] * compared.amplitude / math.sqrt(2.0)
        for column, channel in enumerate(compared.channels):
            given = velocity[:, column][np.isfinite(velocity[:, column])]
            if channel.is_housing and len(given):
                self._hold(self.measured, channel, float(np.median(given)),
                           float(compared.speed[-1]), natural)

    def compare(self, compared: Compared, counts: BoolArray) -> None:
        """Count points (those that count, (n, channels)) that lie inside the band or outside."""
        margin = self._rules.amplitude_margin
        inside = ((compared.amplitude >= (1.0 - margin) * compared.low)
                  & (compared.amplitude <= (1.0 + margin) * compared.high))
        counts = counts & np.isfinite(compared.low) & np.isfinite(compared.amplitude)
        for column, channel in enumerate(compared.channels):
            points = self._inside.setdefault(channel, deque(maxlen=4096))
            rows = np.flatnonzero(counts[:, column])
            points.extend(zip(compared.stamp_ns[rows].tolist(), inside[rows, column].tolist(),
                              strict=True))

    def settle(self) -> Iterator[tuple[Channel, bool]]:
        """Decide which channels lie outside the band; yield those that changed."""
        outside = set(self.outside)
        for channel, points in self._inside.items():
            while points and points[0][0] < points[-1][0] - WINDOW_S * NANOSECONDS:
                points.popleft()
            share = self.share_inside(channel)
            wanted = self._rules.inside_share
            if share < wanted:
                outside.add(channel)
            elif share >= min(1.0, wanted + HYSTERESIS):
                outside.discard(channel)
        for channel in sorted(outside ^ self.outside):
            yield channel, channel in outside
        self.outside = frozenset(outside)

    def share_inside(self, channel: Channel) -> float:
        """Return the share of recent points inside the band, NaN of too few."""
        points = self._inside.get(channel, ())
        if len(points) < FEWEST:
            return math.nan
        return sum(inside for _, inside in points) / len(points)

    @property
    def channels(self) -> tuple[Channel, ...]:
        """Channels of which points were compared."""
        return tuple(self._inside)

    def _hold(
        self, states: dict[Channel, HousingState], channel: Channel, velocity: float, speed: float,
        natural: Mapping[str, float],
    ) -> None:
        state = states.setdefault(channel, HousingState())
        state.velocity = velocity
        support = held_support_class(
            state.support, natural[channel.axis], speed, hysteresis=HYSTERESIS)
        # Other limits make another question: nothing is held over from the last one.
        before = state.zone if support == state.support else None
        state.support = support
        state.zone = held_zone(before, velocity, self._rules.zones.of(support, abs(speed)),
                               hysteresis=HYSTERESIS)


def worst(states: Mapping[Channel, HousingState]) -> tuple[Channel, HousingState] | None:
    """Return the channel that is worst, by its zone and then by its velocity."""
    known = [entry for entry in states.items() if entry[1].zone is not None]
    return max(known, key=lambda entry: (entry[1].zone or '', entry[1].velocity), default=None)


def values(vibration: Vibration) -> dict[str, float | str]:
    """Return what is known of every channel, by keys that say their unit."""
    found: dict[str, float | str] = {}
    for source, states in (('measured', vibration.measured), ('predicted', vibration.predicted)):
        for channel, state in states.items():
            found[f'{channel}_{source}_mm_s_rms'] = MM * state.velocity
            found[f'{channel}_{source}_zone'] = state.zone or ''
            found[f'{channel}_{source}_support'] = state.support or ''
    for channel in vibration.channels:
        found[f'{channel}_inside_band'] = vibration.share_inside(channel)
    return found
