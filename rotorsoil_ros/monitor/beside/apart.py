"""Takes what other machines do out of measured vectors, and widens what they are held against."""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from rotorsoil_ros.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from rotorsoil_ros.channel import Channel
from rotorsoil_ros.compared import Beside, Compared
from rotorsoil_ros.events import NANOSECONDS
from rotorsoil_ros.monitor.beside.companions import Companions
from rotorsoil_ros.monitor.beside.heard import HeardBeside, MIXED_SHARE
from rotorsoil_ros.monitor.beside.parting import BesideRow, Parting

# A part that is told apart is known within so many of its standard deviations.
_SURE = 2.0


@dataclass
class _Followed:
    """The vectors of some channels, and where the others were at the latest of them."""

    parting: Parting = field(default_factory=Parting)
    stamp_ns: int = -1
    phase: ComplexArray = field(default_factory=lambda: np.zeros(0, dtype=complex))
    mixed: '_Since' = field(default_factory=lambda: _Since())
    blurred: '_Since' = field(default_factory=lambda: _Since())


class _Since:
    """For how long something has held of each channel."""

    def __init__(self) -> None:
        self._since: dict[int, int] = {}

    def seconds(self, stamp_ns: IntArray, holds: BoolArray) -> FloatArray:
        """Return for how long it has at stamps (n,) [ns], (n, c) [s]; NaN where it does not."""
        found = np.full(holds.shape, np.nan)
        for row, stamp in enumerate(stamp_ns.tolist()):
            for column in np.flatnonzero(~holds[row]).tolist():
                self._since.pop(column, None)
            for column in np.flatnonzero(holds[row]).tolist():
                since = self._since.setdefault(column, stamp)
                found[row, column] = max(stamp - since, 0) / NANOSECONDS
        return found


class Apart:
    """
    Tells what of measured vectors is of the machine that they are held against.

    Attributes
    ----------
    companions : Companions
        The machines beside it.
    heard : HeardBeside
        Counts how much of them was in the vectors.

    """

    def __init__(self, companions: Companions) -> None:
        self.companions = companions
        self.heard = HeardBeside(companions.others)
        self._followed: dict[tuple[Channel, ...], _Followed] = defaultdict(_Followed)

    def moves(self, channel: Channel, stamp_ns: int, own: float, alone: FloatArray) -> float:
        """Return by how much those whose part is not known alone may move a vector [m]."""
        companions = self.companions
        speed = companions.seen(stamp_ns, stamp_ns)[0][None]
        leak = companions.leaks(np.array([own]), speed, of_samples=np.ones(1, dtype=bool))
        size = companions.parts(speed, (channel,))[0, 0]
        return float(_in(np.where(np.isfinite(alone), 0.0, np.abs(leak[0])),
                         np.where(np.isnan(size), np.inf, size)).sum())

    def less(self, compared: Compared, parts: Sequence[FloatArray | None]) -> Compared:
        """
        Return vectors less what others have put into them, beside bands as wide as is not known.

        Parameters
        ----------
        compared : Compared
            What was measured beside what is predicted, n vectors over c channels.
        parts : sequence of n (m,) float arrays or None
            Amplitudes of what the others do, NaN where samples did not tell them apart [m]; None
            of vectors that were not found in samples.

        """
        companions, followed = self.companions, self._followed[compared.channels]
        speed, phase = (np.array(part) for part in zip(
            *(self._look(followed, stamp) for stamp in compared.stamp_ns.tolist()), strict=True))
        alone = np.array([np.full(speed.shape[1], np.nan) if part is None else part
                          for part in parts])
        leak = np.where(np.isfinite(alone), 0.0, companions.leaks(
            compared.speed, speed, of_samples=np.array([part is not None for part in parts])))
        size = companions.parts(speed, compared.channels)
        vector = compared.amplitude * np.exp(1j * compared.phase)
        # Of what has no answer nobody knows how large it is.
        turn = np.where(np.isnan(size).any(axis=1), np.nan, leak * phase)
        found, spread = (np.array(part) for part in zip(*(
            followed.parting.part(BesideRow(stamp / NANOSECONDS, *rest)) for stamp, *rest in zip(
                compared.stamp_ns.tolist(), compared.speed.tolist(), vector, compared.deviation,
                speed, turn, size, np.abs(compared.predicted), strict=True)), strict=True))
        left = vector - np.nansum(found * turn[:, None, :], axis=2)
        told = np.isfinite(left)
        less = replace(compared, amplitude=np.where(told, np.abs(left), compared.amplitude),
                       phase=np.where(told, np.angle(left), compared.phase))
        share = np.abs(leak)[:, None, :]
        # What is not told apart is in the amplitude of the vector already.
        around = np.where(np.isfinite(alone)[:, None, :], alone[:, None, :], np.sqrt(
            np.abs(found)**2 + (1.0 - share**2) * spread**2))
        return self._beside(followed, less, speed, size, around, share=share, spread=spread)

    def _beside(
        self, followed: _Followed, less: Compared, speed: FloatArray, size: FloatArray,
        around: FloatArray, *, share: FloatArray, spread: FloatArray,
    ) -> Compared:
        """Return vectors with what is known and not known of the others, and wider bands."""
        is_known, stamps = np.isfinite(size), less.stamp_ns
        unsure = _in(share, np.where(is_known, _SURE * spread, np.inf))
        slack = np.minimum(unsure, _in(share, np.where(is_known, size, np.inf)))
        is_mixed = unsure > MIXED_SHARE * less.amplitude[:, :, None]
        self.heard.note(less.channels, less.speed, speed, slack, is_mixed, less.amplitude)
        whole = np.sqrt(less.amplitude**2 + np.nansum(around**2, axis=2))
        is_blurred = unsure > MIXED_SHARE * whole[:, :, None]
        rms = speed[:, None, :] / np.sqrt(2.0)
        return _widened(replace(less, beside=Beside(
            slack.sum(axis=2), followed.mixed.seconds(stamps, np.any(is_mixed, axis=2)),
            followed.blurred.seconds(stamps, np.any(is_blurred, axis=2)), rms * around,
            rms * size)))

    def _look(self, followed: _Followed, stamp_ns: int) -> tuple[FloatArray, ComplexArray]:
        """Return the speed of each machine at the next stamp, and where it is, (m,) each."""
        companions, before = self.companions, followed.stamp_ns
        is_next = 0 <= before <= stamp_ns
        speed, turned = companions.seen(before if is_next else stamp_ns, stamp_ns)
        told = companions.is_told(speed)
        phase = followed.phase * turned if is_next else np.full(len(speed), complex(np.nan))
        if np.isnan(phase[told]).any():
            followed.parting.forget()
            phase = np.where(told, 1.0 + 0.0j, np.nan)
        followed.stamp_ns, followed.phase = stamp_ns, phase
        return speed, phase


def _in(share: FloatArray, size: FloatArray) -> FloatArray:
    """Return which amplitude of a size is in a vector by its share; nothing of no share."""
    with np.errstate(invalid='ignore'):
        return np.where(share > 0.0, share * size, 0.0)


def _widened(compared: Compared) -> Compared:
    """Return what was compared, its bands wider by what others may have done to the vectors."""
    assert compared.beside is not None
    slack, size = compared.beside.slack, np.abs(compared.predicted)
    with np.errstate(invalid='ignore', divide='ignore'):
        turn = np.where(slack < size, np.arcsin(np.minimum(slack / size, 1.0)), np.pi)
    return replace(compared, low=np.maximum(compared.low - slack, 0.0),
                   high=compared.high + slack, behind=compared.behind - turn,
                   ahead=compared.ahead + turn)
