"""To which speed does a measured vector belong? Amplitudes, phases and speeds find each other."""

from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
import math
from typing import TypeAlias

import numpy as np

from rotorsoil_ros.arrays import BoolArray, FloatArray
from rotorsoil_ros.events import Demodulated, Measured, NANOSECONDS
from rotorsoil_ros.monitor.history import History
from rotorsoil_ros.monitor.points import SLOW_ROLL_WINDOW

MOST = 1024  # vectors that wait; what waits longer is given up
LARGEST = 1e3  # [m, rad]; no machine moves further
PATIENCE = 2  # ticks after which an amplitude goes without its phase

Names: TypeAlias = tuple[str, ...]


@dataclass(slots=True)
class Vectors:
    """
    What was measured at one stamp: displacements of some channels, and the speed then.

    Attributes
    ----------
    stamp_ns, channels : int, tuple of str
        When [ns] and where.
    amplitude, phase : (channels,) float array
        Of the displacement [m, rad], [rad].
    swing, swing_phase : (channels,) float array
        Of the velocity [m/s, rad/s], [rad].
    deviation : (channels,) float array
        Standard error of the amplitude [m, rad], 0 where it is not known.
    speed : float
        Told nearest to the stamp [rad/s]; NaN while it is not known.

    """

    stamp_ns: int
    channels: Names
    amplitude: FloatArray | None = None
    phase: FloatArray | None = None
    swing: FloatArray | None = None
    swing_phase: FloatArray | None = None
    deviation: FloatArray = field(default_factory=lambda: np.zeros(0))
    speed: float = math.nan
    ticks: int = field(default=0, compare=False)

    def __post_init__(self) -> None:
        if not len(self.deviation):
            self.deviation = np.zeros(len(self.channels))

    def put(self, quantity: str, displacement: FloatArray, velocity: FloatArray) -> None:
        """Keep one half."""
        if quantity == 'amplitude':
            self.amplitude, self.swing = displacement, velocity
        else:
            self.phase, self.swing_phase = displacement, velocity

    def displacement(self) -> tuple[FloatArray, FloatArray]:
        """Return amplitude and phase; a velocity becomes one where nothing else was measured."""
        assert self.amplitude is not None
        assert self.swing is not None
        amplitude = self.amplitude
        phase = np.full(len(amplitude), np.nan) if self.phase is None else self.phase
        other = np.isnan(amplitude)
        if other.any() and self.speed > 0.0:
            amplitude = np.where(other, self.swing / self.speed, amplitude)
            if self.swing_phase is not None:
                phase = np.where(other, self.swing_phase - 0.5 * np.pi, phase)
        possible = (amplitude >= 0.0) & (amplitude <= LARGEST)
        return np.where(possible, amplitude, np.nan), np.where(np.isfinite(phase), phase, np.nan)


class Pairing:
    """
    Joins amplitudes and phases of one stamp, and waits for the speed that was told nearest.

    What is measured may arrive before its speed: it waits until a later speed is known, or
    until the next tick.
    """

    def __init__(self, history: History, *, tolerance_s: float) -> None:
        self._history = history
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
        while len(self._halves) > MOST:
            self._part(next(iter(self._halves)))

    def take_demodulated(self, found: Demodulated) -> None:
        """Take in vectors that were found in raw samples."""
        nothing = np.full(1, np.nan)
        for row, stamp in enumerate(found.stamp_ns.tolist()):
            self._wait(Vectors(
                stamp, (found.channel,), found.amplitude[row, :1], found.phase[row, :1], nothing,
                nothing, found.deviation[row:row + 1]))

    def tick(self) -> None:
        """Let amplitudes go whose phases do not come."""
        for key in list(self._halves):
            self._halves[key].ticks += 1
            if self._halves[key].ticks >= PATIENCE:
                self._part(key)

    def ready(self, *, is_tick: bool = False) -> Iterator[Vectors]:
        """Yield vectors whose speed is known; at a tick those too that no later speed follows."""
        history, tolerance_ns = self._history, self._tolerance_ns
        for _ in range(len(self._waiting)):
            vectors = self._waiting.popleft()
            ahead = vectors.stamp_ns - history.last_ns
            vectors.ticks += is_tick
            if ahead > 0 and not (is_tick and ahead <= tolerance_ns) and (
                    vectors.ticks < PATIENCE):
                self._waiting.append(vectors)
                continue
            vectors.speed = history.speed_near(vectors.stamp_ns, tolerance_ns=tolerance_ns)
            if math.isnan(vectors.speed):
                self.given_up += 1
            else:
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
        if len(self._waiting) > MOST:
            self._waiting.popleft()
            self.given_up += 1


class Runout:
    """
    The mean vector of each channel near the slow-roll speed, as far as it has been seen.

    A machine that comes back to slow roll is measured anew: runout changes with temperature.
    """

    def __init__(self, slow_roll_speed: float) -> None:
        self._speed = slow_roll_speed
        self._sums: dict[str, complex] = {}
        self._counts: dict[str, int] = {}
        self._has_left: set[str] = set()

    def is_rolling(self, speed: FloatArray) -> BoolArray:
        """Return which speeds, (n,) [rad/s], are those of slow roll; none if none is named."""
        return np.asarray(np.abs(speed - self._speed) <= SLOW_ROLL_WINDOW * self._speed)

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
        if np.isnan(self._speed):
            return amplitude, phase
        vectors = amplitude * np.exp(1j * phase)
        rolling = self.is_rolling(speed)
        for column, channel in enumerate(channels):
            for row in np.flatnonzero(np.isfinite(vectors[:, column])).tolist():
                vectors[row, column] -= self._of(
                    channel, complex(vectors[row, column]), rolls=bool(rolling[row]))
        known = np.isfinite(vectors)
        return (np.where(known, np.abs(vectors), amplitude),
                np.where(known, np.angle(vectors), phase))

    def _of(self, channel: str, vector: complex, *, rolls: bool) -> complex:
        """Return the runout of a channel, after learning from a vector."""
        if not rolls:
            self._has_left.add(channel)
        elif channel in self._has_left or channel not in self._counts:
            self._has_left.discard(channel)
            self._sums[channel], self._counts[channel] = vector, 1
        else:
            self._sums[channel] += vector
            self._counts[channel] += 1
        count = self._counts.get(channel, 0)
        return self._sums[channel] / count if count else 0j
