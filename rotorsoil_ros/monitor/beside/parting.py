"""Which part of a measured vector is another machine's? Vectors that follow each other tell."""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rotorsoil_ros.arrays import ComplexArray, FloatArray, IntArray

# Vectors of this time are looked at together, so many at most [s].
MEMORY_S, _MOST_ROWS = 20.0, 64

# As long as all speeds stay within this share of themselves.
_ONE_SPEED = 0.005

# What may change meanwhile: the machine's own vector by this share of itself in a second, the
# phase of another by this angle (its speed is told that much wrongly, 0.2 rpm) [1/s, rad/s].
_OWN_CHANGE, _PHASE_CHANGE = 0.003, 0.02

# By which share of itself a vector errs at least, and smaller parts are none.
_LEAST_ERROR, _NOTHING = 0.01, 1e-6

# Of parts of which less than this share is in a vector, the vectors tell nothing.
_FAINT = 0.05

_ROUNDS, _MOST_CORRELATED = 3, 0.95


@dataclass(frozen=True, slots=True, eq=False)
class BesideRow:
    """
    A vector over c channels, and what is known of m machines beside it at its stamp.

    Attributes
    ----------
    time, own : float
        When [s], and the speed of the machine [rad/s].
    vector, error : (c,) arrays
        What was measured, NaN without a phase, and its standard error [m, rad].
    speed : (m,) float array
        Of the others [rad/s].
    turn : (m,) complex array
        Unit vectors at which their parts are, from any stamp on, times the share of the part that
        is in the vector; NaN where that is not known.
    size : (c, m) float array
        Amplitudes that are predicted of them [m, rad].
    expected : (c,) float array
        And of the machine itself [m, rad].

    """

    time: float
    own: float
    vector: ComplexArray
    error: FloatArray
    speed: FloatArray
    turn: ComplexArray
    size: FloatArray
    expected: FloatArray


class Parting:
    """
    Tells the parts of several machines apart in the vectors of some channels.

    A vector V_k of a machine holds a constant of its own and of each other machine a part X at
    the angle phi_k by which that one has turned more: V_k = X_0 + sum X exp(i phi_k). Before
    anything is measured X is of the predicted size, or as much larger as the vector is than all
    that is predicted for it, and of any phase; with each vector it is known better, unless phi
    stays where it is. What is not known of it is its standard deviation, which is all of that
    size for a single vector, or at equal speeds.
    """

    def __init__(self) -> None:
        self._rows: deque[BesideRow] = deque()
        self._kept_s = -np.inf

    def forget(self) -> None:
        """Begin anew: angles from now on have nothing to do with those before."""
        self._rows.clear()
        self._kept_s = -np.inf

    def part(self, row: BesideRow) -> tuple[ComplexArray, FloatArray]:
        """
        Return the part of each machine and its standard deviation, both (c, m) [m, rad].

        Parameters
        ----------
        row : BesideRow
            The latest vector; those before it are remembered.

        """
        while self._rows and self._rows[0].time < row.time - MEMORY_S:
            self._rows.popleft()
        found, spread = np.zeros(row.size.shape, dtype=complex), row.size.copy()
        asked = np.flatnonzero(np.isfinite(row.turn) & (np.abs(row.turn) > _FAINT))
        told = np.isfinite(row.vector)
        if len(asked) and told.any():
            parts, errors = _fitted(_alike([*self._rows, row], asked), asked)
            found[np.ix_(told, asked)], spread[np.ix_(told, asked)] = parts[told], errors[told]
        if row.time - self._kept_s >= MEMORY_S / _MOST_ROWS:
            self._rows.append(row)
            self._kept_s = row.time
        return found, spread


def _alike(rows: Sequence[BesideRow], asked: IntArray) -> list[BesideRow]:
    """Return the rows at which the machine and those asked for ran as fast as at the last."""
    speed = np.array([[row.own, *row.speed[asked]] for row in rows])
    like = np.all(np.abs(speed - speed[-1]) <= _ONE_SPEED * speed[-1], axis=1)
    return [row for row, holds in zip(rows[:-1], like.tolist(), strict=False) if holds] + [
        rows[-1]]


def _fitted(rows: Sequence[BesideRow], asked: IntArray) -> tuple[ComplexArray, FloatArray]:
    """
    Return the parts of the machines asked for and their standard deviations, (c, k) each.

    Notes
    -----
    Least squares with what is known before. The variance of the vectors is that of what is left,
    not less than what each says, and more where what is left follows itself in time: then the
    speeds or the parts are not what they were taken to be.

    """
    since = np.array([row.time for row in rows]) - rows[-1].time
    turn = np.array([row.turn[asked] for row in rows])
    system = np.concatenate([np.ones((len(rows), 1)), since[:, None], turn,
                             since[:, None] * turn], axis=1)
    measured = np.array([row.vector for row in rows]).T
    given = np.isfinite(measured)
    measured = np.where(given, measured, 0.0)
    count = np.maximum(given.sum(axis=1), 1)
    scale = np.sqrt((np.abs(measured)**2).sum(axis=1) / count)
    scale = np.where(scale > 0.0, scale, 1.0)
    measured = measured / scale[:, None]
    error = np.array([row.error for row in rows]).T / scale[:, None]
    last = rows[-1]
    likely = np.sqrt(np.fmax(last.expected, 0.0)**2 + np.nansum(last.size**2, axis=1))
    larger = np.maximum(scale / np.where(likely > 0.0, likely, scale), 1.0)
    size = np.maximum((larger / scale)[:, None] * last.size[:, asked], _NOTHING)
    least = _LEAST_ERROR**2 + np.where(given, error**2, 0.0).sum(axis=1) / count
    known = np.concatenate([
        np.broadcast_to([_NOTHING**2, _OWN_CHANGE**-2], (len(size), 2)),
        size**-2, (_PHASE_CHANGE * size)**-2], axis=1)
    gram = np.einsum('kp,ck,kq->cpq', system.conj(), given, system)
    against = np.einsum('kp,ck->cp', system.conj(), measured)
    variance, unit = least, np.eye(system.shape[1])
    for _ in range(_ROUNDS):
        spread = np.linalg.inv(gram / variance[:, None, None] + known[:, None, :] * unit)
        solution = np.einsum('cpq,cq->cp', spread, against) / variance[:, None]
        variance = np.maximum(least, _variance(
            np.where(given, measured - solution @ system.T, 0.0), count))
    here = slice(2, 2 + len(asked))
    deviation = np.sqrt(np.einsum('cpp->cp', spread).real[:, here])
    return solution[:, here] * scale[:, None], deviation * scale[:, None]


def _variance(left: ComplexArray, count: FloatArray) -> FloatArray:
    """Return the variance of what is left, (c, n), as much more as it follows itself in time."""
    power = (np.abs(left)**2).sum(axis=1)
    following = (left[:, 1:] * left[:, :-1].conj()).real.sum(axis=1)
    correlated = np.clip(following / np.maximum(power, np.finfo(float).tiny), 0.0,
                         _MOST_CORRELATED)
    return np.asarray(
        power / np.maximum(count - 2, 1) * (1.0 + correlated) / (1.0 - correlated))
