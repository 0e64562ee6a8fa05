"""How does the machine vibrate: in which zone, inside the band or not? Nothing chatters."""

from collections import deque
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
import math

import numpy as np

from rotorsoil_ros.case.comparison import Rules
from rotorsoil_ros.case.housing_zones import HOUSING
from rotorsoil_ros.live.events import Compared, Level, NANOSECONDS
from rotorsoil_ros.physics.arrays import BoolArray
from rotorsoil_ros.physics.zones import (
    held_support_class,
    held_zone,
    SupportClass,
    Zone,
)

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
        self.predicted: dict[str, HousingState] = {}
        self.measured: dict[str, HousingState] = {}
        self._inside: dict[str, deque[tuple[int, bool]]] = {}
        self.outside: frozenset[str] = frozenset()

    def predict(
        self, velocities: Mapping[str, float], speed: float, natural: Mapping[str, float],
    ) -> None:
        """Zone predicted housing velocities [m/s rms] at a speed [rad/s]."""
        for channel, velocity in velocities.items():
            self._hold(self.predicted, channel, velocity, speed, natural)

    def measure(self, compared: Compared, natural: Mapping[str, float]) -> None:
        """Zone measured housing velocities by their median: one bad sample is no alarm."""
        velocity = np.abs(compared.speed)[:, None] * compared.amplitude / math.sqrt(2.0)
        for column, channel in enumerate(compared.channels):
            given = velocity[:, column][np.isfinite(velocity[:, column])]
            if HOUSING in channel and len(given):
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

    def settle(self) -> Iterator[tuple[str, bool]]:
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

    def share_inside(self, channel: str) -> float:
        """Return the share of recent points inside the band, NaN of too few."""
        points = self._inside.get(channel, ())
        if len(points) < FEWEST:
            return math.nan
        return sum(inside for _, inside in points) / len(points)

    @property
    def channels(self) -> tuple[str, ...]:
        """Channels of which points were compared."""
        return tuple(self._inside)

    def _hold(
        self, states: dict[str, HousingState], channel: str, velocity: float, speed: float,
        natural: Mapping[str, float],
    ) -> None:
        state = states.setdefault(channel, HousingState())
        state.velocity = velocity
        support = held_support_class(
            state.support, natural[channel[-1]], speed, hysteresis=HYSTERESIS)
        # Other limits make another question: nothing is held over from the last one.
        before = state.zone if support == state.support else None
        state.support = support
        state.zone = held_zone(before, velocity, self._rules.zones.of(support),
                               hysteresis=HYSTERESIS)


def worst(states: Mapping[str, HousingState]) -> tuple[str, HousingState] | None:
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
