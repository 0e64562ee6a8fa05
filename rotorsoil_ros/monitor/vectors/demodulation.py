"""Which once-per-turn vector is in raw samples? Found while they come, refused where unsure."""

from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import replace
import math

import numpy as np

from rotorsoil_ros.arrays import FloatArray, IntArray
from rotorsoil_ros.case.entries.sensors import Pickup
from rotorsoil_ros.channel import Channel, DOFS
from rotorsoil_ros.events import Demodulated, NANOSECONDS, Samples
from rotorsoil_ros.monitor.beside.apart import Apart
from rotorsoil_ros.monitor.vectors.axes import Axes, said_with
from rotorsoil_ros.monitor.vectors.history import History
from rotorsoil_ros.monitor.vectors.orders import (
    LARGEST_ACCELERATION,
    OrderVector,
    SpeedTrack,
    Turning,
)
from rotorsoil_ros.monitor.vectors.refusal import Flaw, Refusal, Refusals
from rotorsoil_ros.monitor.vectors.sampling import end_of_packet, unpacked
from rotorsoil_ros.monitor.vectors.stretch import ABOVE_NOISE, Finding, FITTED, Stretch, TOLD
from rotorsoil_ros.units import RADIANS_PER_TURN

MOST_SAMPLES = 1 << 16  # samples of a channel that wait for their speed

# So many vectors are looked at, at least so many of them; beyond this ratio of what they scatter
# by to what they say, they err by the former: of white noise 1.5 is exceeded once in a hundred.
_LOOKED_AT, _FEWEST, _LARGEST_RATIO = 11, 6, 3.0

# A speed that has moved by this share is another one.
_ONE_SPEED = 0.005

# Standard error that spreading packets adds to an amplitude, as a share of it: transport of
# less than a millisecond.
_OF_PACKETS = 0.0105

WIDENED = f'vectors scatter over {_LARGEST_RATIO:g} times more than each says: wider'


class Demodulator:
    """Keeps the samples of one channel until enough turns of the rotor are known for them."""

    def __init__(
        self, machine: str, channel: Channel, history: History, *, turns: float,
        pickup: Pickup,
    ) -> None:
        self._machine, self._channel = machine, channel
        self._history = history
        self._turns, self._pickup = turns, pickup
        self._axes = Axes(pickup, DOFS.index(channel.axis))
        self._parts: list[tuple[IntArray, FloatArray, FloatArray]] = []
        self._count = 0
        self._done_ns = -1
        self.left_out = 0
        self.refusals = Refusals()
        self._scatter = Scatter()
        self.apart: Apart | None = None  # who tells what other machines do to its vectors

    def take(self, samples: Samples) -> None:
        """Keep samples; the oldest are left out if nobody tells the speed."""
        self._parts.append((samples.stamp_ns, samples.acceleration, said_with(samples)))
        self._count += len(samples.stamp_ns)
        while self._count > MOST_SAMPLES and len(self._parts) > 1:
            gone = len(self._parts.pop(0)[0])
            self._count -= gone
            self.left_out += gone

    def vectors(self) -> Iterator[Demodulated]:
        """Yield the vectors of all stretches that are complete."""
        told = self._history.track()[0]
        if not self._parts or not len(told):
            return
        stamps, values, said = self._gathered(int(told[0]))
        until = told[-1] if self.apart is None else (
            min(told[-1], self.apart.companions.heard_until()))
        found = []
        while (known := int(np.searchsorted(stamps, until, side='right'))):
            vector, taken = self._first(stamps[:known], values[:known], said[:known])
            if not taken:
                break
            self._done_ns = int(stamps[taken - 1])
            stamps, values, said = stamps[taken:], values[taken:], said[taken:]
            if vector is not None:
                found.append(vector)
        self._parts, self._count = [(stamps, values, said)], len(stamps)
        if found:
            yield self._event(found)

    def _gathered(self, begin_ns: int) -> tuple[IntArray, FloatArray, FloatArray]:
        """Return what has been kept, in order; too late or before every speed is left out."""
        stamps, values, said = (np.concatenate(part) for part in zip(
            *self._parts, strict=True))
        chosen = ((stamps >= begin_ns) & (stamps > self._done_ns)
                  & (np.abs(values) <= LARGEST_ACCELERATION))
        self.left_out += len(stamps) - int(np.count_nonzero(chosen))
        stamps, values, said = stamps[chosen], values[chosen], said[chosen]
        # By value where stamps are equal: a log may hold such samples in another order. Of a
        # packet with one stamp nothing but the order in which they came tells more.
        packets = self._pickup.comes_in_packets
        order = np.argsort(stamps, kind='stable') if packets else np.lexsort((values, stamps))
        stamps, values, said = stamps[order], values[order], said[order]
        if packets:
            return stamps, values, said
        again = np.concatenate([[False], (np.diff(stamps) == 0) & (np.diff(values) == 0.0)])
        if again.any():
            self.refusals.left_out['samples told twice'] += int(np.count_nonzero(again))
            stamps, values, said = stamps[~again], values[~again], said[~again]
        return stamps, values, said

    def _first(
        self, stamps: IntArray, values: FloatArray, said: FloatArray,
    ) -> tuple[tuple[int, OrderVector] | None, int]:
        """Return stamp and vector of the first stretch, and how many samples it takes."""
        # Counted from its own first sample, it does not matter when this is asked.
        track, zero_ns = self._history.speed_track(int(stamps[0]))
        if track is None:
            return None, 0
        time = (stamps - zero_ns) / NANOSECONDS
        at = Turning.of(time, track)
        end = int(np.argmax(at.angle - at.angle[0] >= self._turns * RADIANS_PER_TURN))
        if self._pickup.comes_in_packets:
            end = end_of_packet(time, end)
        if not end:
            return None, 0
        beside = self._beside(stamps[:end], zero_ns, float(at.speed[end // 2]))
        found = self._found(at.rows(slice(0, end)), values[:end], said[:end], float(time[end]),
                            track, list(beside.values()))
        stamp_ns = 0
        if isinstance(found, OrderVector):
            stamp_ns = zero_ns + round(found.time * NANOSECONDS)
            if self.apart is not None:
                found = replace(found, beside=self.apart.companions.spread_out(
                    list(beside), found.beside))
            found = self._held_against_others(found, stamp_ns)
        self.refusals.note(found if isinstance(found, Refusal) else None)
        if isinstance(found, Refusal):
            self.left_out += end
            return None, end
        return (stamp_ns, found), end

    def _beside(self, stamps: IntArray, zero_ns: int, speed: float) -> dict[int, SpeedTrack]:
        """Return which other machines the samples of a stretch tell apart, and how they turned."""
        if self.apart is None or self._pickup.comes_in_packets or len(stamps) < 2:
            return {}
        return self.apart.companions.told_apart(
            self._channel, int(stamps[0]), int(stamps[-1]), zero_ns=zero_ns, own=speed,
            orders=FITTED)

    def _found(
        self, at: Turning, values: FloatArray, said: FloatArray, until: float,
        track: SpeedTrack, beside: Sequence[SpeedTrack],
    ) -> OrderVector | Refusal:
        """Return the vector of a stretch, if its axes and unit are those of the machine."""
        if self._pickup.comes_in_packets:
            first, taken = unpacked(at.time)
            if not len(taken):
                return Refusal(Flaw.PACKETS, 'a single packet in the stretch')
            at, until = Turning.of(taken, track), float(taken[-1])
            values, said = values[first:], said[first:]
        peaks = self._axes.peaks(values, said)
        along = self._axes.along(values, said, seconds=until - float(at.time[0]))
        self.refusals.gravity = self._axes.words()
        if isinstance(along, Refusal):
            return along
        finding = Finding(Stretch(at, along, peaks, until, self._turns, self._pickup,
                                  beside=beside), track)
        found = finding.vector()
        self.refusals.left_out.update(finding.left_out)
        if isinstance(found, OrderVector) and self._pickup.comes_in_packets:
            return replace(found, has_phase=False, deviation=np.hypot(
                found.deviation, _OF_PACKETS * np.abs(found.displacement)))
        return found

    def _held_against_others(
        self, found: OrderVector, stamp_ns: int,
    ) -> OrderVector | Refusal:
        """Return a vector with what its neighbours say of its error, which may be all of it."""
        vector = self._scatter.widened(found, moved=0.0 if self.apart is None else (
            self.apart.moves(self._channel, stamp_ns, found.speed, found.beside)))
        if vector is not found:
            self.refusals.left_out[WIDENED] += 1
            if abs(vector.displacement[0]) < ABOVE_NOISE * vector.deviation[0]:
                return Refusal(Flaw.NOISE, 'below noise: vectors scatter by more than a third '
                                           'of their size')
        return vector

    def _event(self, found: Sequence[tuple[int, OrderVector]]) -> Demodulated:
        vectors = np.array([vector.displacement for _, vector in found])
        told = np.array([[0.0 if vector.has_phase else math.nan] for _, vector in found])
        return Demodulated(
            self._machine, self._channel, np.array([stamp for stamp, _ in found]),
            np.array([vector.speed for _, vector in found]), TOLD, np.abs(vectors),
            np.angle(vectors) + told, np.array([vector.deviation[0] for _, vector in found]),
            np.array([vector.beside for _, vector in found]))


class Scatter:
    """
    Holds the latest vectors of a channel against each other, as long as the speed stays.

    A tone beside the order, or a speed that is told wrongly, leaves a residual in each stretch
    that looks like that of a better fit than it is; from stretch to stretch it shows.
    """

    def __init__(self) -> None:
        self._latest: deque[OrderVector] = deque(maxlen=_LOOKED_AT)

    def widened(self, vector: OrderVector, *, moved: float = 0.0) -> OrderVector:
        """
        Return a vector with the deviation of its neighbours, where that is the larger one.

        Parameters
        ----------
        vector : OrderVector
            The latest.
        moved : float
            By how much other machines may move vectors, which is no error [m].

        """
        known = self._latest
        if known and (abs(vector.speed - known[0].speed) > _ONE_SPEED * known[0].speed
                      or vector.has_phase is not known[0].has_phase):
            known.clear()
        known.append(vector)
        if len(known) < _FEWEST:
            return vector
        scatter = self._deviation()
        stated = math.sqrt(float(np.mean([each.deviation[0]**2 for each in known])))
        if not scatter > _LARGEST_RATIO * math.hypot(stated, moved):
            return vector
        # Of other orders nothing else is known.
        return replace(vector, deviation=np.maximum(vector.deviation, scatter))

    def _deviation(self) -> float:
        """Return by how much one part of a vector errs [m]: what changes steadily drops out."""
        first = np.array([each.displacement[0] for each in self._latest])
        # Without the angle of the rotor, phases of two stretches have nothing to do with another.
        parts, series = (2, first) if self._latest[0].has_phase else (1, np.abs(first))
        second = np.diff(series, 2)
        # A second difference of white noise has (1 + 4 + 1) times its variance.
        return float(np.sqrt(np.mean(np.abs(second)**2) / (6 * parts)))
