"""What does a run-up strike in a machine that is being looked for? The envelopes, many at once."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rotorsoil_ros.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from rotorsoil_ros.events import NANOSECONDS
from rotorsoil_ros.machine.coupled import CoupledModel
from rotorsoil_ros.machine.transient.poles import fit, Poles, sampled
from rotorsoil_ros.machine.transient.state import LONGEST_GAP_NS, step
from rotorsoil_ros.monitor.comparison import Run

# Of the speeds of a long run every so-manieth is taken; between them it went evenly.
_MOST_SPEEDS = 2000

# A run in which nothing deviates by more than this share of its steady response is a slow one.
_SLOW = 1e-3

# A light mode of a machine that differs is that of the machine as described which is no further
# away than this share of its frequency.
_SAME_MODE = 0.5


@dataclass(frozen=True, eq=False)
class Passing:
    """
    How the speed of a run changed.

    Attributes
    ----------
    time, speed : (m,) float arrays
        From the beginning on [s], and what was told [rad/s].
    begins : (m,) bool array
        Where the machine is taken to be steady for want of anything better.
    at : (n,) int array
        Which of them are those of the n rows that are looked at.
    like : Poles
        Of the machine as it is described: how the frequencies of its modes follow the speed.

    """

    time: FloatArray
    speed: FloatArray
    begins: BoolArray
    at: IntArray
    like: Poles

    @classmethod
    def of(
        cls, run: Run, stamp_ns: IntArray, speed: FloatArray, poles: Poles,
    ) -> 'Passing | None':
        """Return how a run came to stamps (n,) with speeds (n,) [rad/s]; None of a slow run."""
        if not len(poles):
            return None
        wanted = run.stamp_ns <= stamp_ns[-1]
        told = run.stamp_ns[wanted][::max(1, int(np.count_nonzero(wanted)) // _MOST_SPEEDS)]
        stamps = np.union1d(told, stamp_ns)
        gaps = np.diff(stamps) > LONGEST_GAP_NS
        found = cls((stamps - stamps[0]) / NANOSECONDS,
                    np.interp(stamps, run.stamp_ns, run.speed), np.concatenate([[True], gaps]),
                    np.searchsorted(stamps, stamp_ns), poles)
        share = found._deviations(poles.decay, poles.slope, speed) * _rates(
            poles.decay, poles.slope, speed)
        return found if np.abs(share).max(initial=0.0) > _SLOW else None

    def added(
        self, model: CoupledModel, speed: FloatArray, rows: Sequence[int], planes: Sequence[int],
    ) -> ComplexArray:
        """
        Return what the changes of speed add to the response of a machine, (n, c, p).

        Parameters
        ----------
        model : CoupledModel
            Another one than that as described.
        speed : (n,) float array
            Of the rows [rad/s].
        rows, planes : sequences of int
            Which c channels and p unbalance planes.

        """
        nothing = np.zeros((len(speed), len(rows), len(planes)), dtype=complex)
        span = float(self.speed.min()), float(self.speed.max())
        places, response = sampled(model, span, dense=np.unique(speed))
        if not len(places):
            return nothing
        columns = response[:, planes][:, :, rows].reshape(len(places), -1)
        fitted = fit(places, columns, np.zeros(columns.shape[1], dtype=int), span)
        if isinstance(fitted, str):
            return nothing
        decay, strength, _ = fitted
        slope = self._slopes(decay)
        away = self._deviations(decay, slope, speed) * (1.0 - slope)
        shaped = strength.reshape(len(decay), len(planes), len(rows))
        return np.asarray(np.einsum('nk,kpc->ncp', away, shaped))

    def _slopes(self, decay: ComplexArray) -> FloatArray:
        """Return the slopes of the modes as described that are nearest to those found, (k,)."""
        apart = np.abs(self.like.decay - decay[:, None])
        nearest = apart.argmin(axis=1)
        near = apart.min(axis=1) < _SAME_MODE * np.abs(decay)
        return np.where(near, self.like.slope[nearest], 0.0)

    def _deviations(
        self, decay: ComplexArray, slope: FloatArray, speed: FloatArray,
    ) -> ComplexArray:
        """Return d = v + 1 / A at the rows, (n, k) [s]."""
        rate = _rates(decay, slope, self.speed)
        gone, driven = step(rate[:-1], rate[1:], np.diff(self.time)[:, None])
        steady, envelope = -1.0 / rate, np.empty_like(rate)
        begins = self.begins.tolist()
        for row, now in enumerate(steady):
            envelope[row] = now if begins[row] else (
                gone[row - 1] * envelope[row - 1] + driven[row - 1])
        return np.asarray(envelope[self.at] + 1.0 / _rates(decay, slope, speed))


def _rates(decay: ComplexArray, slope: FloatArray, speed: FloatArray) -> ComplexArray:
    """Return A = (1 - g) (lambda - i Omega), (m, k) [1/s]."""
    return np.asarray((1.0 - slope) * (decay - 1j * speed[:, None]))
