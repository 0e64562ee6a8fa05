"""How fast did the rotor turn a moment ago? Enough to date a measurement, and no more."""

from collections import deque
import math
from typing import Any

import numpy as np

from rotorsoil_ros.arrays import FloatArray, IntArray
from rotorsoil_ros.events import NANOSECONDS
from rotorsoil_ros.monitor.vectors.orders import SpeedTrack, turns_with

LATEST = 8192  # speeds kept as they came: a vector out of samples comes a second late
TRACK = 4096  # and such as lie a while apart
TRACK_NS = NANOSECONDS // 100
STEADY_S = 2.0
FASTEST = 1e6  # [rad/s]; no rotor turns faster

# Slower than this share of itself per second a speed counts as constant [1/s].
STEADY = 0.005

ROW = np.dtype([('stamp_ns', '<i8'), ('speed', '<f8'), ('angle', '<f8')])


class History:
    """
    Recent speeds of one machine: the latest as they came, older ones every 10 ms.

    A stamp that jumps back begins anew; one that repeats is the same moment told twice.
    """

    def __init__(self) -> None:
        self._latest: deque[tuple[int, float]] = deque(maxlen=LATEST)
        self._track: deque[tuple[int, float, float]] = deque(maxlen=TRACK)
        self._arrays: tuple[Any, ...] | None = None
        self.last_ns = -1
        self.epoch = 0
        self._thinned_ns = -TRACK_NS

    def add(self, stamp_ns: IntArray, speed: FloatArray, angle: FloatArray) -> None:
        """Keep speeds [rad/s] and rotor angles [rad, NaN where not told], all (n,)."""
        for row in zip(stamp_ns.tolist(), speed.tolist(), angle.tolist(), strict=True):
            stamp = row[0]
            if stamp < self.last_ns:
                self.forget()
            if stamp == self.last_ns or not abs(row[1]) <= FASTEST:
                continue
            self.last_ns = stamp
            self._latest.append(row[:2])
            if stamp - self._thinned_ns >= TRACK_NS:
                self._thinned_ns = stamp
                self._track.append(row)
                self._arrays = None

    def forget(self) -> None:
        """Begin anew, in another epoch: what came before has no place in this time."""
        self.epoch += 1
        self._latest.clear()
        self._track.clear()
        self._arrays = None
        self.last_ns, self._thinned_ns = -1, -TRACK_NS

    def speed_near(self, stamp_ns: int, *, tolerance_ns: float) -> float:
        """Return the speed told nearest to a stamp [rad/s], NaN if none is near."""
        among = self._latest
        if not among or stamp_ns < among[0][0]:
            distance, speed = min(((abs(row[0] - stamp_ns), row[1]) for row in (
                *self._track, *list(among)[:1])), default=(math.inf, math.nan))
        else:
            distance, speed = math.inf, math.nan
            for row in reversed(among):
                if abs(row[0] - stamp_ns) >= distance:
                    break
                distance, speed = abs(row[0] - stamp_ns), row[1]
        return speed if distance <= tolerance_ns else math.nan

    def track(self) -> tuple[IntArray, FloatArray, FloatArray]:
        """Return stamps [ns], ascending, speeds [rad/s] and angles [rad], at most 4096."""
        if self._arrays is None:
            rows = np.array(self._track, dtype=ROW)
            self._arrays = tuple(np.ascontiguousarray(rows[name]) for name in ROW.names or ())
        stamps, speed, angle = self._arrays
        return stamps, speed, angle

    def speed_track(self, from_ns: int) -> tuple[SpeedTrack | None, int]:
        """Return the track from a stamp on, and the stamp [ns] from which it counts seconds."""
        stamps, speed, angle = self.track()
        first = max(0, int(np.searchsorted(stamps, from_ns, side='right')) - 1)
        stamps, speed, angle = stamps[first:], speed[first:], angle[first:]
        if len(stamps) < 2:
            return None, from_ns
        time = (stamps - stamps[0]) / NANOSECONDS
        angles = angle if turns_with(time, speed, angle) else None
        return SpeedTrack(time, speed, angle=angles), int(stamps[0])

    @property
    def track_ns(self) -> int:
        """The latest stamp up to which the track goes [ns]."""
        return self._thinned_ns

    def between(self, from_ns: int, until_ns: int, *, within_s: float) -> SpeedTrack | None:
        """
        Return the track across two stamps, in seconds since the first.

        None where it does not reach across them, or has a gap longer than `within_s` [s].
        """
        rows: list[tuple[int, float, float]] = []
        for row in reversed(self._track):
            if row[0] >= until_ns:
                rows = [row]
            elif rows:
                rows.append(row)
            if len(rows) > 1 and row[0] <= from_ns:
                break
        else:
            return None
        stamps, speed, angle = (np.array(part) for part in zip(*reversed(rows), strict=True))
        time = (stamps - from_ns) / NANOSECONDS
        if np.diff(time).max() > within_s:
            return None
        return SpeedTrack(time, speed, angle=angle if turns_with(time, speed, angle) else None)

    def rate(self, over_s: float) -> float:
        """Return how fast the speed changed lately [rad/s^2]: a line through the last seconds."""
        stamps, speed, _ = self.track()
        near = stamps >= self.last_ns - over_s * NANOSECONDS
        since = (stamps[near] - self.last_ns) / NANOSECONDS
        if len(since) < 2:
            return 0.0
        since = since - since.mean()
        return float(since @ speed[near] / (since @ since))

    def is_steady(self) -> bool:
        """Return whether the speed has been constant lately."""
        return abs(self.rate(STEADY_S)) <= STEADY * self.last_speed

    @property
    def last_speed(self) -> float:
        """The latest speed [rad/s], NaN if there is none."""
        return self._latest[-1][1] if self._latest else math.nan


def nearest(
    wanted: IntArray, given: IntArray, *, tolerance_s: float = math.inf,
) -> IntArray:
    """
    Return the index of the nearest of given stamps [ns], ascending; the earlier of two.

    It is -1 beyond a tolerance [s].
    """
    if not len(given):
        return np.full(len(wanted), -1)
    after = np.clip(np.searchsorted(given, wanted), 0, len(given) - 1)
    before = np.maximum(after - 1, 0)
    index = np.where(wanted - given[before] <= given[after] - wanted, before, after)
    index = np.where(wanted > given[-1], len(given) - 1, index)
    near = np.abs(given[index] - wanted) <= tolerance_s * NANOSECONDS
    return np.asarray(np.where(near, index, -1))
