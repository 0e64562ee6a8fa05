"""Which once-per-turn vector is in raw samples? Found while they come."""

from collections.abc import Iterator, Sequence
import math

import numpy as np

from rotorsoil_ros.arrays import FloatArray, IntArray
from rotorsoil_ros.channel import Channel
from rotorsoil_ros.errors import NotSolvedError
from rotorsoil_ros.events import Demodulated, NANOSECONDS, Samples
from rotorsoil_ros.monitor.vectors.history import History
from rotorsoil_ros.monitor.vectors.orders import demodulate, LARGEST_ACCELERATION, OrderVector
from rotorsoil_ros.units import RADIANS_PER_TURN

FITTED = (1, 2, 3)  # a harmonic that is there and not fitted would disturb the others
TOLD = 2
MOST = 1 << 16  # samples of a channel that wait for their speed


class Demodulator:
    """Keeps the samples of one channel until enough turns of the rotor are known for them."""

    def __init__(self, machine: str, channel: Channel, history: History, *, turns: float) -> None:
        self._machine, self._channel = machine, channel
        self._history = history
        self._turns = turns
        self._parts: list[tuple[IntArray, FloatArray]] = []
        self._count = 0
        self._done_ns = -1
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
        told = self._history.track()[0]
        if not self._parts or not len(told):
            return
        stamps, values = self._gathered(int(told[0]))
        found = []
        while (known := int(np.searchsorted(stamps, told[-1], side='right'))):
            vector, taken = self._first(stamps[:known], values[:known])
            if not taken:
                break
            self._done_ns = int(stamps[taken - 1])
            stamps, values = stamps[taken:], values[taken:]
            if vector is not None:
                found.append(vector)
        self._parts, self._count = [(stamps, values)], len(stamps)
        if found:
            yield self._event(found)

    def _gathered(self, begin_ns: int) -> tuple[IntArray, FloatArray]:
        """Return what has been kept, in order; too late or before every speed is left out."""
        stamps = np.concatenate([stamps for stamps, _ in self._parts])
        values = np.concatenate([values for _, values in self._parts])
        chosen = ((stamps >= begin_ns) & (stamps > self._done_ns)
                  & (np.abs(values) <= LARGEST_ACCELERATION))
        self.left_out += len(stamps) - int(np.count_nonzero(chosen))
        stamps, values = stamps[chosen], values[chosen]
        order = np.argsort(stamps, kind='stable')
        return stamps[order], values[order]

    def _first(
        self, stamps: IntArray, values: FloatArray,
    ) -> tuple[tuple[int, OrderVector] | None, int]:
        """Return stamp and vector of the first stretch, and how many samples it takes."""
        # Counted from its own first sample, it does not matter when this is asked.
        track, zero_ns = self._history.speed_track(int(stamps[0]))
        if track is None:
            return None, 0
        time = (stamps - zero_ns) / NANOSECONDS
        angle, _, _ = track.at(time)
        end = int(np.argmax(angle - angle[0] >= self._turns * RADIANS_PER_TURN))
        if not end:
            return None, 0
        try:
            vector = demodulate(time[:end], values[:end], track, orders=FITTED)
        except NotSolvedError:
            self.left_out += end
            return None, end
        return (zero_ns + round(vector.time * NANOSECONDS), vector), end

    def _event(self, found: Sequence[tuple[int, OrderVector]]) -> Demodulated:
        vectors = np.array([vector.displacement[:TOLD] for _, vector in found])
        told = np.array([[0.0 if vector.has_phase else math.nan] for _, vector in found])
        return Demodulated(
            self._machine, self._channel, np.array([stamp for stamp, _ in found]),
            np.array([vector.speed for _, vector in found]), FITTED[:TOLD], np.abs(vectors),
            np.angle(vectors) + told, np.array([vector.deviation[0] for _, vector in found]))
