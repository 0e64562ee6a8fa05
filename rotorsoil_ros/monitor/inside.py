"""Do the measured amplitudes lie inside the band of the prediction? Counted, and told calmly."""

from collections import deque
from collections.abc import Iterator
import math
from typing import Any

import numpy as np
import numpy.typing as npt

from rotorsoil_ros.arrays import BoolArray, FloatArray
from rotorsoil_ros.channel import Channel
from rotorsoil_ros.compared import Reason, Weighed
from rotorsoil_ros.events import NANOSECONDS
from rotorsoil_ros.monitor.rules import Rules

HYSTERESIS = 0.05  # share by which it has to be better before the better is believed again
WINDOW_S = 10.0  # of points whose share inside the band is told while the machine runs
FEWEST = 5
_MOST_POINTS = 4096


def is_inside(
    value: FloatArray, low: FloatArray, high: FloatArray, *, margin: float,
) -> BoolArray:
    """Return which values lie between two bounds, widened by a share on either side."""
    return np.asarray((value >= (1.0 - margin) * low) & (value <= (1.0 + margin) * high))


def is_banded(reason: npt.NDArray[Any]) -> BoolArray:
    """Return which points are held against the band, the wider one of machines beside it too."""
    return np.asarray((reason == Reason.USED) | (reason == Reason.BESIDE))


def is_mixed(reason: npt.NDArray[Any]) -> BoolArray:
    """Return which points hold a part of another machine that is not told apart."""
    return np.asarray((reason == Reason.BESIDE) | (reason == Reason.NOT_APART))


class BandShare:
    """
    The share of points inside the band: of the last seconds, and of the whole run.

    That of the last seconds tells at once when a machine leaves its band. That of the run waits
    until a passage is over, because only then it is known where the machine really resonates.
    """

    def __init__(self, rules: Rules) -> None:
        self._rules = rules
        self._recent: dict[Channel, deque[tuple[int, bool]]] = {}
        self._counts: dict[Channel, tuple[int, int]] = {}
        self.outside: frozenset[Channel] = frozenset()

    def see(self, weighed: Weighed) -> None:
        """Take points into the window of the last seconds."""
        compared = weighed.compared
        inside, counts = self._judged(weighed)
        for column, channel in enumerate(compared.channels):
            points = self._recent.setdefault(channel, deque(maxlen=_MOST_POINTS))
            rows = np.flatnonzero(counts[:, column])
            points.extend(zip(compared.stamp_ns[rows].tolist(), inside[rows, column].tolist(),
                              strict=True))

    def count(self, weighed: Weighed) -> None:
        """Count points for good."""
        inside, counts = self._judged(weighed)
        for column, channel in enumerate(weighed.compared.channels):
            within, total = self._counts.get(channel, (0, 0))
            self._counts[channel] = (
                within + int(np.count_nonzero(inside[:, column] & counts[:, column])),
                total + int(np.count_nonzero(counts[:, column])))

    def settle(self) -> Iterator[tuple[Channel, bool]]:
        """Decide which channels lie outside the band now; yield those that changed."""
        outside = set(self.outside)
        for channel, points in self._recent.items():
            while points and points[0][0] < points[-1][0] - WINDOW_S * NANOSECONDS:
                points.popleft()
            share, wanted = self.recent(channel), self._rules.inside_share
            if share < wanted:
                outside.add(channel)
            elif share >= min(1.0, wanted + HYSTERESIS):
                outside.discard(channel)
        for channel in sorted(outside ^ self.outside):
            yield channel, channel in outside
        self.outside = frozenset(outside)

    def recent(self, channel: Channel) -> float:
        """Return the share of the last seconds, NaN of too few points."""
        points = self._recent.get(channel, ())
        if len(points) < FEWEST:
            return math.nan
        return sum(inside for _, inside in points) / len(points)

    def of_run(self) -> dict[Channel, float]:
        """Return the share of the whole run of every channel of which points count."""
        return {channel: within / total
                for channel, (within, total) in self._counts.items() if total}

    @property
    def channels(self) -> tuple[Channel, ...]:
        """Channels of which points were seen."""
        return tuple(self._recent)

    def _judged(self, weighed: Weighed) -> tuple[BoolArray, BoolArray]:
        """Return which points lie inside, and which count, (n, channels)."""
        compared = weighed.compared
        inside = is_inside(compared.amplitude, compared.low, compared.high,
                           margin=self._rules.amplitude_margin)
        return inside, np.asarray(
            is_banded(weighed.reason) & np.isfinite(compared.low + compared.high))
