"""How did the ground move while a vector was measured? Its samples over the same turns."""

from collections import deque
from collections.abc import Sequence

import numpy as np

from rotorsoil_ros.arrays import ComplexArray, FloatArray, IntArray
from rotorsoil_ros.case.entries.sensors import GroundSensor
from rotorsoil_ros.channel import Channel, DOFS
from rotorsoil_ros.events import NANOSECONDS, Samples
from rotorsoil_ros.monitor.beside.companions import Companions
from rotorsoil_ros.monitor.vectors.axes import Axes, said_with
from rotorsoil_ros.monitor.vectors.history import History
from rotorsoil_ros.monitor.vectors.orders import OrderVector, SpeedTrack, Turning
from rotorsoil_ros.monitor.vectors.pairing import MOST_UNMATCHED
from rotorsoil_ros.monitor.vectors.refusal import Flaw, Refusal, Refusals
from rotorsoil_ros.monitor.vectors.stretch import Finding, FITTED, Stretch
from rotorsoil_ros.units import RADIANS_PER_TURN

_MOST_SAMPLES = 1 << 16  # of a sensor that wait for a vector of the machine

# A stretch that begins later than this share of half of its turns has not been heard.
_LATE = 0.5


class SensorOnGround:
    """
    Keeps what one sensor says until it is known for which turns it is wanted.

    A motion below its own noise is kept: what leaks into it from beside the speed leaks into the
    vectors of the machine just so, and leaves them with it.
    """

    def __init__(self, sensor: GroundSensor, history: History, *, turns: float) -> None:
        self.sensor, self._history, self._turns = sensor, history, turns
        self.refusals = Refusals()
        self.first_ns = self.last_ns = -1
        # Who runs beside the machine, and the housing by which it is told who does most.
        self.companions: Companions | None = None
        self.felt_most = Channel('', '', '')
        self._axes = {axis: Axes(sensor.pickup, DOFS.index(axis)) for axis in DOFS[:3]}
        self._parts: list[tuple[IntArray, FloatArray]] = []
        self._told: deque[tuple[int, ComplexArray]] = deque(maxlen=MOST_UNMATCHED)
        self._count = 0

    @property
    def is_raw(self) -> bool:
        """Whether it sends samples, and not vectors."""
        return self._count > 0

    def take(self, samples: Samples) -> None:
        """Keep samples; the oldest go where nobody wants them."""
        if self.first_ns < 0 or int(samples.stamp_ns[0]) < self.last_ns - NANOSECONDS:
            self._parts, self._count = [], 0  # or its time has begun anew
            self.first_ns = int(samples.stamp_ns[0])
        self._parts.append((samples.stamp_ns, said_with(samples)))
        self._count += len(samples.stamp_ns)
        self.last_ns = int(samples.stamp_ns[-1])
        if self._count > 2 * _MOST_SAMPLES:
            self._join()

    def along_axes(self, samples: Samples) -> FloatArray | None:
        """Return samples (n, 3) along the axes of the ground; None while nobody knows them."""
        if self.sensor.pickup.has_orientation and not self.refusals.stretches:
            return None
        return np.asarray(samples.felt @ self._axes['x'].to_machine.T)

    def take_vector(self, stamp_ns: int, motion: ComplexArray) -> None:
        """Keep a vector (3,) [m] that another system has measured."""
        self._told.append((stamp_ns, motion))
        self.last_ns = max(self.last_ns, stamp_ns)

    def end_of(self, stamp_ns: int, speed: float) -> int:
        """Return up to which stamp it must have been heard for a vector at a speed [rad/s]."""
        return stamp_ns + (self._half_ns(speed) if self.is_raw else 0)

    def vector(
        self, stamp_ns: int, speed: float, *, tolerance_ns: float,
    ) -> ComplexArray | Refusal:
        """
        Return the motion (3,) [m] over the turns in the middle of which a stamp lies.

        Parameters
        ----------
        stamp_ns, speed : int, float
            Of a vector of the machine [ns], [rad/s].
        tolerance_ns : float
            How far from the stamp that of a told vector may lie [ns].

        """
        near = min(self._told, key=lambda one: abs(one[0] - stamp_ns), default=None)
        if near is not None and abs(near[0] - stamp_ns) <= tolerance_ns:
            return near[1]
        found = self._found(stamp_ns, self._half_ns(speed))
        self.refusals.note(found if isinstance(found, Refusal) else None)
        return found

    def _half_ns(self, speed: float) -> int:
        return round(0.5 * self._turns * RADIANS_PER_TURN / speed * NANOSECONDS)

    def _found(self, stamp_ns: int, half_ns: int) -> ComplexArray | Refusal:
        begin, end = stamp_ns - half_ns, stamp_ns + half_ns
        stamps, said = self._between(begin, end)
        track, zero_ns = self._history.speed_track(begin)
        if track is None or not track.has_phase:
            return Refusal(Flaw.UNSOLVED, 'no phase reference: the ground has no phase to the '
                                          'rotor')
        time = (stamps - zero_ns) / NANOSECONDS
        known = (time >= track.time[0]) & (time <= track.time[-1])
        time, said = time[known], said[known]
        # Holes within and behind are found with all other flaws.
        if not len(time) or time[0] > (begin + _LATE * half_ns - zero_ns) / NANOSECONDS:
            return Refusal(Flaw.MISSING, 'samples missing over the turns of a vector')
        at, until = Turning.of(time, track), (end - zero_ns) / NANOSECONDS
        beside = self._beside(stamps, zero_ns, float(at.speed[len(time) // 2]))
        vectors = []
        for axis, axes in self._axes.items():
            # Without one of them nobody knows what it does to the machine.
            found = self._along(axes, said[:, DOFS.index(axis)], said, at, until, track, beside)
            if isinstance(found, Refusal):
                return Refusal(found.flaw, f'{axis}: {found.text}')
            vectors.append(found.displacement[0])
        self.refusals.gravity = axes.words()
        return np.array(vectors)

    def _along(
        self, axes: Axes, values: FloatArray, said: FloatArray, at: Turning, until: float,
        track: SpeedTrack, beside: Sequence[SpeedTrack],
    ) -> OrderVector | Refusal:
        """Return the vector along one axis of the ground."""
        if not np.isfinite(values).all():
            return Refusal(Flaw.MISSING, 'not measured')
        along = axes.along(values, said, seconds=until - float(at.time[0]))
        if isinstance(along, Refusal):
            return along
        return Finding(Stretch(at, along, axes.peaks(values, said), until, self._turns,
                               self.sensor.pickup, beside=beside, above_noise=0.0),
                       track).vector()

    def _beside(self, stamps: IntArray, zero_ns: int, speed: float) -> Sequence[SpeedTrack]:
        """Return how other machines turned whose fields the samples tell from that of this one."""
        if self.companions is None:
            return ()
        return list(self.companions.told_apart(
            self.felt_most, int(stamps[0]), int(stamps[-1]), zero_ns=zero_ns, own=speed,
            orders=FITTED).values())

    def _between(self, begin: int, end: int) -> tuple[IntArray, FloatArray]:
        """Return stamps and what was said from a stamp up to another, in order."""
        if not self._parts:
            return np.zeros(0, dtype=np.int64), np.zeros((0, 7))
        if len(self._parts) > 1:
            self._join()
        stamps, said = self._parts[0]
        chosen = (stamps >= begin) & (stamps < end)
        stamps, first = np.unique(stamps[chosen], return_index=True)
        return stamps, said[chosen][first]

    def _join(self) -> None:
        stamps, said = (np.concatenate(part)[-_MOST_SAMPLES:] for part in zip(
            *self._parts, strict=True))
        self._parts, self._count = [(stamps, said)], len(stamps)
