"""To which speed does a measured vector belong? Amplitudes, phases and speeds find each other."""

from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
import math
from typing import TypeAlias

import numpy as np

from rotorsoil_ros.arrays import BoolArray, FloatArray
from rotorsoil_ros.channel import Channel
from rotorsoil_ros.events import Demodulated, Measured, NANOSECONDS
from rotorsoil_ros.monitor.vectors.history import History

MOST_UNMATCHED = 1024  # vectors that wait; what waits longer is given up
LARGEST_MOTION = 1e3  # [m, rad]; no machine moves further
PATIENCE = 2  # ticks after which an amplitude goes without its phase
MORE_PATIENCE = 5  # and a vector without the speeds of machines beside its own

# A slow-roll vector is the mean of what was measured within this share of its speed.
SLOW_ROLL_WINDOW = 0.05

Names: TypeAlias = tuple[Channel, ...]


@dataclass(slots=True)
class Vectors:
    """
    What was measured at one stamp: displacements of some channels, and the speed then.

    Attributes
    ----------
    stamp_ns, channels : int, tuple of Channel
        When [ns] and where.
    amplitude, phase : (channels,) float array
        Of the displacement [m, rad], [rad].
    velocity, velocity_phase : (channels,) float array
        Of the velocity [m/s, rad/s], [rad].
    deviation : (channels,) float array
        Standard error of the amplitude [m, rad], 0 where it is not known.
    speed : float
        Told nearest to the stamp [rad/s]; NaN while it is not known.
    beside : (m,) float array or None
        Amplitude of what m other machines do, NaN where it is in the vector [m]; None of vectors
        that were not found in samples, over turns that are known.

    """

    stamp_ns: int
    channels: Names
    amplitude: FloatArray | None = None
    phase: FloatArray | None = None
    velocity: FloatArray | None = None
    velocity_phase: FloatArray | None = None
    deviation: FloatArray = field(default_factory=lambda: np.zeros(0))
    speed: float = math.nan
    beside: FloatArray | None = None
    ticks: int = field(default=0, compare=False)

    def __post_init__(self) -> None:
        if not len(self.deviation):
            self.deviation = np.zeros(len(self.channels))

    def put(self, quantity: str, displacement: FloatArray, velocity: FloatArray) -> None:
        """Keep one half."""
        if quantity == 'amplitude':
            self.amplitude, self.velocity = displacement, velocity
        else:
            self.phase, self.velocity_phase = displacement, velocity

    def displacement(self) -> tuple[FloatArray, FloatArray]:
        """Return amplitude and phase; a velocity becomes one where nothing else was measured."""
        assert self.amplitude is not None
        assert self.velocity is not None
        amplitude = self.amplitude
        phase = np.full(len(amplitude), np.nan) if self.phase is None else self.phase
        other = np.isnan(amplitude)
        if other.any() and self.speed > 0.0:
            amplitude = np.where(other, self.velocity / self.speed, amplitude)
            if self.velocity_phase is not None:
                phase = np.where(other, self.velocity_phase - 0.5 * np.pi, phase)
        possible = (amplitude >= 0.0) & (amplitude <= LARGEST_MOTION)
        return np.where(possible, amplitude, np.nan), np.where(np.isfinite(phase), phase, np.nan)


class Pairing:
    """
    Joins amplitudes and phases of one stamp, and waits for the speed that was told nearest.

    What is measured may arrive before its speed: it waits until a later speed is known, or
    until the next tick.

    Attributes
    ----------
    until : callable or None
        Returns up to which stamp all speeds are known that matter besides [ns].

    """

    def __init__(self, history: History, *, tolerance_s: float) -> None:
        self._history = history
        self.until: Callable[[], int] | None = None
        self._tolerance_ns = tolerance_s * NANOSECONDS
        self._halves: dict[tuple[int, Names], Vectors] = {}
        self._waiting: deque[Vectors] = deque()
        self.given_up = 0

    @property
    def is_idle(self) -> bool:
        """Whether nothing waits for a speed."""
        return not self._waiting

    def take(self, measured: Measured) -> None:
        """Take in amplitudes or phases."""
        for row, stamp in enumerate(measured.stamp_ns.tolist()):
            key = stamp, measured.channels
            vectors = self._halves.pop(key, None) or Vectors(stamp, measured.channels)
            vectors.put(measured.quantity, measured.displacement[row], measured.velocity[row])
            if vectors.amplitude is not None and vectors.phase is not None:
                self._wait(vectors)
            else:
                self._halves[key] = vectors
        while len(self._halves) > MOST_UNMATCHED:
            self._part(next(iter(self._halves)))

    def take_demodulated(self, found: Demodulated) -> None:
        """Take in vectors that were found in raw samples."""
        nothing = np.full(1, np.nan)
        for row, stamp in enumerate(found.stamp_ns.tolist()):
            self._wait(Vectors(
                stamp, (found.channel,), found.amplitude[row, :1], found.phase[row, :1], nothing,
                nothing, found.deviation[row:row + 1], beside=found.beside[row]))

    def tick(self) -> None:
        """Let amplitudes go whose phases do not come."""
        for key in list(self._halves):
            self._halves[key].ticks += 1
            if self._halves[key].ticks >= PATIENCE:
                self._part(key)

    def ready(self, *, is_tick: bool = False) -> Iterator[Vectors]:
        """
        Yield vectors with their speeds; at a tick those too that no later speed follows.

        The speed of a vector near which none was told is NaN.
        """
        history, tolerance_ns = self._history, self._tolerance_ns
        until = history.last_ns if self.until is None else self.until()
        for _ in range(len(self._waiting)):
            vectors = self._waiting.popleft()
            ahead = vectors.stamp_ns - history.last_ns
            vectors.ticks += is_tick
            if (vectors.ticks < PATIENCE and not (is_tick and ahead <= tolerance_ns)
                    if ahead > 0 else vectors.ticks < MORE_PATIENCE and vectors.stamp_ns > until):
                self._waiting.append(vectors)
                continue
            vectors.speed = history.speed_near(vectors.stamp_ns, tolerance_ns=tolerance_ns)
            self.given_up += math.isnan(vectors.speed)
            yield vectors

    def _part(self, key: tuple[int, Names]) -> None:
        """Let a half go: an amplitude alone is of use, a phase alone is not."""
        vectors = self._halves.pop(key)
        if vectors.amplitude is None:
            self.given_up += 1
        else:
            vectors.ticks = 0
            self._wait(vectors)

    def _wait(self, vectors: Vectors) -> None:
        self._waiting.append(vectors)
        if len(self._waiting) > MOST_UNMATCHED:
            self._waiting.popleft()
            self.given_up += 1


@dataclass(slots=True)
class _SlowRoll:
    """What one channel has measured at slow roll."""

    total: complex = 0j
    power: float = 0.0
    count: int = 0
    visits: int = 1
    has_left: bool = False

    def learn(self, vector: complex) -> None:
        if self.has_left:
            self.total, self.power, self.count, self.has_left = 0j, 0.0, 0, False
            self.visits += 1
        self.total += vector
        self.power += abs(vector) ** 2
        self.count += 1

    @property
    def mean(self) -> complex:
        return self.total / self.count

    @property
    def scatter(self) -> float:
        return math.sqrt(max(self.power / self.count - abs(self.mean) ** 2, 0.0))


class Runout:
    """
    The mean vector of each channel near the slow-roll speed, as far as it has been seen.

    A machine that comes back to slow roll is measured anew: runout changes with temperature.

    Parameters
    ----------
    slow_roll_speed : float
        [rad/s]; NaN: nothing is subtracted.
    hindsight : mapping of str to complex
        What a run will show later, by channel: subtracted until the channel itself has seen
        slow roll. A machine that is watched while it runs has none.

    """

    def __init__(
        self, slow_roll_speed: float, hindsight: Mapping[str, complex] | None = None,
    ) -> None:
        self._speed = slow_roll_speed
        self._hindsight = hindsight or {}
        self._seen: dict[str, _SlowRoll] = {}
        self.first: dict[str, complex] = {}
        self.was_missed = False

    def is_rolling(self, speed: FloatArray) -> BoolArray:
        """Return which speeds, (n,) [rad/s], are those of slow roll; none if none is named."""
        return np.asarray(np.abs(speed - self._speed) <= SLOW_ROLL_WINDOW * self._speed)

    def of(self, channel: str) -> complex:
        """Return the runout of a channel as it is known now [m, rad], NaN if it is not."""
        if seen := self._seen.get(channel):
            return seen.mean
        return self._hindsight.get(channel, complex(math.nan, math.nan))

    def scatter(self, channel: str) -> float:
        """Return the standard deviation of what was measured at slow roll [m, rad]."""
        return self._seen[channel].scatter if channel in self._seen else 0.0

    def subtract(
        self, channels: Sequence[str], speed: FloatArray, amplitude: FloatArray,
        phase: FloatArray,
    ) -> tuple[FloatArray, FloatArray]:
        """
        Learn from vectors at slow roll, and subtract from all what is known.

        Parameters
        ----------
        channels : sequence of str
            Where was measured.
        speed : (n,) float array
            [rad/s].
        amplitude, phase : (n, channels) float array
            Displacements [m, rad], [rad]; without a phase nothing can be subtracted.

        """
        if math.isnan(self._speed):
            return amplitude, phase
        vectors = amplitude * np.exp(1j * phase)
        rolling = self.is_rolling(speed)
        for column, channel in enumerate(channels):
            for row in np.flatnonzero(np.isfinite(vectors[:, column])).tolist():
                vectors[row, column] -= self._after(
                    channel, complex(vectors[row, column]), rolls=bool(rolling[row]))
        known = np.isfinite(vectors)
        return (np.where(known, np.abs(vectors), amplitude),
                np.where(known, np.angle(vectors), phase))

    def _after(self, channel: str, vector: complex, *, rolls: bool) -> complex:
        """Return the runout of a channel, after learning from a vector."""
        if rolls:
            seen = self._seen.setdefault(channel, _SlowRoll())
            seen.learn(vector)
            if seen.visits == 1:
                self.first[channel] = seen.mean
        elif channel in self._seen:
            self._seen[channel].has_left = True
        known = self.of(channel)
        self.was_missed |= math.isnan(known.real)
        return 0j if math.isnan(known.real) else known
