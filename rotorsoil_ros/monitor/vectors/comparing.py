"""What was measured beside what was predicted for it: vector by vector, nothing judged yet."""

from collections.abc import Iterator, Mapping, Sequence
from difflib import get_close_matches
import math

import numpy as np

from rotorsoil_ros.arrays import ComplexArray, FloatArray, IntArray
from rotorsoil_ros.channel import Channel
from rotorsoil_ros.compared import Compared
from rotorsoil_ros.events import Demodulated, Level, Measured, Remark
from rotorsoil_ros.machine.band import Envelope
from rotorsoil_ros.machine.response import Predictor
from rotorsoil_ros.machine.transient.state import Transient
from rotorsoil_ros.monitor.beside.apart import Apart
from rotorsoil_ros.monitor.rules import Matching
from rotorsoil_ros.monitor.vectors.history import History
from rotorsoil_ros.monitor.vectors.pairing import Pairing, Runout, Vectors

MOST_NAMES = 16


class Comparer:
    """
    Dates, joins and cleans what is measured of one machine, and puts it beside its prediction.

    Attributes
    ----------
    predictor, transient : Predictor, Transient
        What is predicted, and what changes of the speed add to it.
    envelope : Envelope or None
        The band, as soon as it is known.
    runout : Runout
        What is subtracted.
    apart : Apart or None
        What takes out the parts of other machines; None of one that is alone.
    pairing : Pairing
        What waits for its speed.

    """

    def __init__(
        self, machine: str, history: History, predictor: Predictor, transient: Transient, *,
        matching: Matching, hindsight: Mapping[str, complex] | None,
    ) -> None:
        self._machine = machine
        self.predictor, self.transient = predictor, transient
        self.envelope: Envelope | None = None
        self.apart: Apart | None = None
        self.pairing = Pairing(history, tolerance_s=matching.tolerance)
        self.runout = Runout(matching.slow_roll_speed, hindsight)
        self.paired: set[Channel] = set()
        self._unknown: set[Channel] = set()
        self._told: set[Channel] = set()

    def take(self, measured: Measured) -> None:
        """Take in amplitudes or phases."""
        self.paired |= set(measured.channels)
        self.pairing.take(measured)

    def take_demodulated(self, found: Demodulated) -> None:
        """Take in vectors out of raw samples; where vectors are told besides, those count."""
        if found.channel not in self.paired:
            self.pairing.take_demodulated(found)

    def compared(self, *, is_tick: bool = False) -> Iterator[Compared]:
        """Yield what has found its speed, NaN where nothing is predicted for it."""
        by_channels: dict[tuple[Channel, ...], list[Vectors]] = {}
        for vectors in self.pairing.ready(is_tick=is_tick):
            by_channels.setdefault(vectors.channels, []).append(vectors)
        for channels, found in by_channels.items():
            yield self._compare(channels, found)

    def predicted(self, compared: Compared) -> Compared | None:
        """Return the part for which speed and channel are predicted; None where nothing is."""
        known = [column for column, name in enumerate(compared.channels)
                 if name in self.predictor.channels]
        told = np.isfinite(compared.speed)
        if not (known and told.any()):
            return None
        return (compared if told.all() else compared.rows(told)).columns(known)

    def answers(
        self, stamp_ns: IntArray, speed: FloatArray,
    ) -> tuple[ComplexArray, ComplexArray]:
        """Return displacements without and with what changes of the speed have struck, (n, c)."""
        steady = self.predictor.answer(speed)
        moved = self.predictor.moved(steady, self.transient.at(stamp_ns, speed))
        return steady.displacement, moved.displacement

    def band(
        self, speed: FloatArray, steady: ComplexArray, moved: ComplexArray,
    ) -> Envelope | None:
        """Return the band about answers at speeds (n,) [rad/s]; None while it is not known."""
        if self.envelope is None:
            return None
        return self.envelope.at(speed).around(steady).opened(steady, moved)

    def velocities(self, now_ns: int, speed: float) -> dict[Channel, FloatArray]:
        """
        Return how fast every housing moves at a speed [rad/s].

        By this machine and by each beside it, (machines,) [m/s rms], NaN where it is not known.
        """
        row = self.answers(np.array([now_ns]), np.array([speed]))[1][0]
        moved = {name: np.array([speed * abs(row[column]) / math.sqrt(2.0)])
                 for column, name in enumerate(self.predictor.channels)
                 if name.is_housing and abs(row[column]) > 0.0}
        if self.apart is None:
            return moved
        others = self.apart.companions.latest(now_ns)
        sizes = self.apart.companions.parts(others[None], tuple(moved))[0]
        return {name: np.concatenate([own, others * size / math.sqrt(2.0)])
                for (name, own), size in zip(moved.items(), sizes, strict=True)}

    def strangers(self, now_ns: int) -> Iterator[Remark]:
        """Tell once which measured channels no prediction has: a slip in a name, mostly."""
        new = sorted(self._unknown - self._told)[:MOST_NAMES]
        self._unknown = set()
        if new and len(self._told) < MOST_NAMES:
            self._told |= set(new)
            near = [get_close_matches(name, self.predictor.channels, n=1) for name in new]
            yield Remark(self._machine, now_ns, Level.WARN, 'measured but not predicted: '
                         + ', '.join(name + (f' (did you mean {like[0]}?)' if like else '')
                                     for name, like in zip(new, near, strict=True)))

    def _compare(self, names: tuple[Channel, ...], found: Sequence[Vectors]) -> Compared:
        """Return vectors of the same channels beside their prediction, NaN where there is none."""
        self._unknown |= set(names).difference(self.predictor.channels)
        speed = np.array([vectors.speed for vectors in found])
        amplitude, phase = (np.array(part) for part in zip(
            *(vectors.displacement() for vectors in found), strict=True))
        amplitude, phase = self.runout.subtract(names, speed, amplitude, phase)
        columns = [self.predictor.channels.index(name) if name in self.predictor.channels
                   else -1 for name in names]
        unknown = np.array(columns) < 0
        stamps = np.array([vectors.stamp_ns for vectors in found])
        steady, moved = self.answers(stamps, speed)
        predicted = moved[:, columns]
        predicted[:, unknown] = complex(math.nan, math.nan)
        low = high = behind = ahead = np.full(amplitude.shape, np.nan)
        if (band := self.band(speed, steady, moved)) is not None:
            low, high, behind, ahead = (
                np.where(unknown, np.nan, part[:, columns])
                for part in (band.low, band.high, band.behind, band.ahead))
        compared = Compared(
            self._machine, stamps, speed, names, amplitude, phase,
            np.array([vectors.deviation for vectors in found]), predicted, low, high, behind,
            ahead)
        return compared if self.apart is None else self.apart.less(
            compared, [vectors.beside for vectors in found])

    def stand_beside(self, apart: Apart) -> None:
        """Take the parts of other machines out of what is measured from now on."""
        self.apart, self.pairing.until = apart, apart.companions.heard_until
