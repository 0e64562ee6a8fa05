"""Which measured vectors of a run are used to find out what explains it."""

from dataclasses import dataclass

import numpy as np

from rotorsoil_ros.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from rotorsoil_ros.channel import Channel
from rotorsoil_ros.compared import Reason
from rotorsoil_ros.errors import NotSolvedError
from rotorsoil_ros.monitor.comparison import Comparison
from rotorsoil_ros.monitor.identification.passing import Passing
from rotorsoil_ros.monitor.points import ChannelPoints

# Speeds beyond these say no more, and each costs a solution.
_MOST_ROWS = 240

# Rows further apart than so many times the usual are not neighbours.
_GAP = 3.0


@dataclass(frozen=True)
class UsedVectors:
    """
    Measured vectors that are used.

    Attributes
    ----------
    channels : tuple of Channel
        Where, c of them.
    elapsed, speed : (n,) float arrays
        Share of the run, and speed [rad/s].
    measured : (n, c) complex array
        [m, rad], NaN where there is none.
    stretch : (n,) int array
        Number of the uninterrupted stretch that a row belongs to.
    passing : Passing or None
        How the speed came to be what it was at each row; None where it changed so slowly, or the
        machine is answered so, that this does not matter.

    """

    channels: tuple[Channel, ...]
    elapsed: FloatArray
    speed: FloatArray
    measured: ComplexArray
    stretch: IntArray
    passing: Passing | None = None

    @classmethod
    def of(cls, comparison: Comparison, *, with_transients: bool) -> 'UsedVectors':
        """
        Return the vectors of a comparison, also those of an answer that lags if wanted.

        What is looked for follows the changes of the speed wherever the case does: then all that
        a resonance struck is used, wherever the resonance was.
        """
        with_transients = with_transients or len(comparison.expectation.table.poles) > 0
        chosen = [(points, usable) for points in comparison.points
                  if (usable := _usable(points, with_transients)).any()]
        if not chosen:
            raise NotSolvedError('the run holds no vector with a phase that could be used')
        stamps = np.unique(np.concatenate([points.stamp_ns[usable] for points, usable in chosen]))
        if len(stamps) > _MOST_ROWS:
            stamps = stamps[np.linspace(0, len(stamps) - 1, _MOST_ROWS).round().astype(int)]
        speed = np.full(len(stamps), np.nan)
        measured = np.full((len(stamps), len(chosen)), complex(np.nan, np.nan))
        for column, (points, usable) in enumerate(chosen):
            own, first = np.unique(points.stamp_ns[usable], return_index=True)
            _, row, at = np.intersect1d(stamps, own, return_indices=True)
            measured[row, column] = points.measured[usable][first[at]]
            speed[row] = points.speed[usable][first[at]]
        step = np.diff(stamps)
        gaps = step > _GAP * np.median(step) if len(step) else np.zeros(0, dtype=bool)
        elapsed = (stamps - stamps[0]) / max(int(stamps[-1] - stamps[0]), 1)
        return cls(tuple(points.channel for points, _ in chosen), elapsed, speed, measured,
                   np.concatenate([[0], np.cumsum(gaps)]),
                   Passing.of(comparison.run, stamps, speed, comparison.expectation.table.poles))


def _usable(points: ChannelPoints, with_transients: bool) -> BoolArray:
    usable = points.used
    if with_transients:
        usable = usable | (points.reason == Reason.NOT_QUASI_STATIC)
    return np.asarray(usable & np.isfinite(points.phase))
