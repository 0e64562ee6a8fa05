"""Which once-per-turn vector is in raw samples? Found while they come."""

from collections.abc import Iterator
import math

import numpy as np

from rotorsoil_ros.live.events import Demodulated, NANOSECONDS, Samples
from rotorsoil_ros.live.history import History
from rotorsoil_ros.physics.arrays import FloatArray, IntArray
from rotorsoil_ros.physics.errors import NotSolvedError
from rotorsoil_ros.physics.orders import demodulate, OrderVector, SpeedTrack
from rotorsoil_ros.physics.units import RADIANS_PER_TURN

FITTED = (1, 2, 3)  # a harmonic that is there and not fitted would disturb the others
TOLD = 2
MOST = 1 << 16  # samples of a channel that wait for their speed


class Demodulator:
    """Keeps the samples of one channel until enough turns of the rotor are known for them."""

    def __init__(self, machine: str, channel: str, history: History, *, turns: float) -> None:
        self._machine, self._channel = machine, channel
        self._history = history
        self._turns = turns
        self._parts: list[tuple[IntArray, FloatArray]] = []
        self._count = 0
        self._done_ns = -1
        self.has_phase = False
        self.left_out = 0

    def take(self, samples: Samples) -> None:
        """Keep samples; the oldest are left out if nobody tells the speed."""
        self._parts.append((samples.stamp_ns, samples.acceleration))
        self._count += len(samples.stamp_ns)
        while self._count > MOST and len(self._parts) > 1:
            gone = len(self._parts.pop(0)[0])
            self._count -= gone
            self.left_out += gone

    def vectors(self) -> Iterator[Demodulated]:
        """Yield the vectors of all stretches that are complete."""
        zero_ns = self._history.last_ns
        track = self._history.speed_track(zero_ns)
        if not self._parts or track is None:
            return
        stamps, values = self._gathered(zero_ns + round(track.time[0] * NANOSECONDS))
        known = np.searchsorted(stamps, zero_ns, side='right')
        found: list[OrderVector] = []
        if known:
            found, rest = self._solved(stamps[:known], values[:known], track, zero_ns)
            stamps, values = stamps[rest:], values[rest:]
        self._parts, self._count = [(stamps, values)], len(stamps)
        if found:
            self.has_phase = found[-1].has_phase
            yield self._event(found, zero_ns)

    def _gathered(self, begin_ns: int) -> tuple[IntArray, FloatArray]:
        """Return what has been kept, in order; too late or before every speed is left out."""
        stamps = np.concatenate([stamps for stamps, _ in self._parts])
        values = np.concatenate([values for _, values in self._parts])
        chosen = (stamps >= begin_ns) & (stamps > self._done_ns) & np.isfinite(values)
        self.left_out += len(stamps) - int(np.count_nonzero(chosen))
        stamps, values = stamps[chosen], values[chosen]
        order = np.argsort(stamps, kind='stable')
        return stamps[order], values[order]

    def _solved(
        self, stamps: IntArray, values: FloatArray, track: SpeedTrack, zero_ns: int,
    ) -> tuple[list[OrderVector], int]:
        """Return the vectors of complete stretches, and how many samples those took."""
        time = (stamps - zero_ns) / NANOSECONDS
        angle, _, _ = track.at(time)
        stretch = np.floor((angle - angle[0]) / (self._turns * RADIANS_PER_TURN))
        starts = np.flatnonzero(np.diff(stretch)) + 1
        found = []
        for begin, end in zip([0, *starts[:-1].tolist()], starts.tolist(), strict=False):
            try:
                found.append(demodulate(time[begin:end], values[begin:end], track,
                                        orders=FITTED))
            except NotSolvedError:
                self.left_out += end - begin
        rest = int(starts[-1]) if len(starts) else 0
        if rest:
            self._done_ns = int(stamps[rest - 1])
        return found, rest

    def _event(self, found: list[OrderVector], zero_ns: int) -> Demodulated:
        vectors = np.array([vector.displacement[:TOLD] for vector in found])
        told = np.array([[0.0 if vector.has_phase else math.nan] for vector in found])
        return Demodulated(
            self._machine, self._channel,
            np.array([zero_ns + round(vector.time * NANOSECONDS) for vector in found]),
            np.array([vector.speed for vector in found]), FITTED[:TOLD], np.abs(vectors),
            np.angle(vectors) + told, np.array([vector.deviation[0] for vector in found]))
