"""Are the values of a stretch those of a motion? Clipped, frozen and held ones are not."""

from typing import NamedTuple

import numpy as np

from rotorsoil_ros.arrays import BoolArray, FloatArray, IntArray
from rotorsoil_ros.monitor.vectors.orders import block_edges
from rotorsoil_ros.monitor.vectors.refusal import Flaw, Refusal
from rotorsoil_ros.monitor.vectors.sampling import Sampling

_NORMAL = 1.4826  # standard deviations in a median of absolute deviations

# A value so many deviations off is a spike, of the signal and of what a fit leaves.
_SPIKE, _LEFT_SPIKE = 10.0, 8.0
_SMALLEST_SPIKE = 0.5  # of the deviation of the signal: a smaller one does no harm

_LONGEST_STILL, _STILL_TURNS = 8, 0.5

# Clipped: so many values at one extreme, such a share of all, and so many times as many as on
# the levels beside it.
_AT_RAIL, _RAIL_SHARE, _RAIL_RATIO = 5, 0.008, 5.0
# Or the outermost of so many bins holds from this to that share and stands above its neighbour;
# coarser resolution makes a flat top of its own, and so does sampling locked to the turn.
_BINS, _BIN_SHARE, _BIN_MOST, _BIN_RATIO, _BIN_STEPS = 33, 0.03, 0.45, 6.0, 66
_LOCKED_BELOW, _LOCKED, _LOCKED_UNEVEN, _LOCKED_RUN = 32.0, 0.5, 2.0, 3

# A share of equal neighbours beyond what the resolution explains says that values are held; the
# rate at which new ones come must be so many times the order.
_HELD, _BY_RESOLUTION, _HELD_ORDER = 0.1, 1.2, 0.05

# Block means of what a fit leaves: an offset that jumps by 1 adds this to 1X, at most this share.
_JUMP_ADDS, _JUMP_SHARE = 0.064, 0.06


class Values(NamedTuple):
    """How the values of a stretch were found: their rate [1/s], and what holding them hides."""

    rate: float
    hidden: float = 0.0


def spread(values: FloatArray) -> tuple[FloatArray, float]:
    """Return how far values lie from their median, and the deviation that most of them keep."""
    away = np.abs(values - _median(values))
    return away, _NORMAL * _median(away)


def spikes(values: FloatArray) -> tuple[BoolArray, float]:
    """Return which values stand far out of the others, and the deviation of these [m/s^2]."""
    away, deviation = spread(values)
    return np.asarray(away > max(_SPIKE * deviation, 1e-6 * float(away.max()))), deviation


def left_spikes(residual: FloatArray, *, deviation: float) -> BoolArray:
    """Return which samples a fit leaves far out, so far that they matter beside a deviation."""
    away, left = spread(residual)
    return np.asarray(away > max(_LEFT_SPIKE * left, _SMALLEST_SPIKE * deviation))


def _median(values: FloatArray) -> float:
    """Return the upper median: numpy's own takes five times as long for some hundred values."""
    return float(np.partition(values, len(values) // 2)[len(values) // 2])


def examine(
    values: FloatArray, taken: Sampling, *, turn_rate: float, turns: float,
) -> Values | Refusal:
    """
    Return how the values of a stretch were found, or why they are none of a motion.

    Parameters
    ----------
    values : (n,) float array
        Acceleration in the order of time, without spikes [m/s^2].
    taken : Sampling
        How they were sampled.
    turn_rate, turns : float
        Of the rotor [1/s], and how many of its turns make a stretch.

    """
    change = np.diff(values)
    per_turn = taken.rate / turn_rate
    if (still := _still(values, change, fewest=max(_LONGEST_STILL, _STILL_TURNS * per_turn))):
        return still
    levels, counts = _levels(values)
    resolution = float(np.diff(levels).min())
    if (rail := _rail(values, levels, counts, resolution, is_locked=_is_locked(
            per_turn, taken, turns))) is not None:
        return Refusal(Flaw.CLIPPED, f'clipped at {rail:.4g} m/s^2')
    return _held(change, taken, resolution, turn_rate)


def jump(residual: FloatArray, *, first: float, deviation: float) -> Refusal | None:
    """Return the refusal of an offset that jumps, by 1X and its deviation [m/s^2]."""
    edges = block_edges(len(residual))
    means = np.add.reduceat(residual, edges[:-1]) / np.diff(edges)
    height = float(np.ptp(means))
    if height * _JUMP_ADDS > max(_JUMP_SHARE * first, deviation):
        return Refusal(Flaw.JUMP, f'offset jumps by {height:.3g} m/s^2')
    return None


def _still(values: FloatArray, change: FloatArray, *, fewest: float) -> Refusal | None:
    """Return the refusal of values that stay the same so many times or more."""
    same = change == 0.0
    if np.count_nonzero(same) < fewest - 1:
        return None
    begin, length = _longest_run(same)
    if length < fewest - 1:
        return None
    return Refusal(Flaw.STILL, f'sensor stands still at {values[begin]:.4g} m/s^2')


def _levels(values: FloatArray) -> tuple[FloatArray, IntArray]:
    """Return the levels that values take, ascending, and how often each is taken."""
    ordered = np.sort(values)
    begins = np.concatenate([[0], np.flatnonzero(np.diff(ordered)) + 1])
    return ordered[begins], np.diff(begins, append=len(ordered))


def _held(
    change: FloatArray, taken: Sampling, resolution: float, turn_rate: float,
) -> Values | Refusal:
    share = float(np.mean(change == 0.0))
    step = float(np.sqrt(np.mean(change**2)))
    if share - _BY_RESOLUTION * resolution / step <= _HELD:
        return Values(taken.rate)
    rate = taken.rate * (1.0 - share)
    if turn_rate > _HELD_ORDER * rate:
        return Refusal(Flaw.HELD, f'values are held: {rate:.0f} new ones a second of '
                                  f'{taken.rate:.0f}')
    return Values(rate, np.pi * turn_rate / rate)


def _is_locked(per_turn: float, taken: Sampling, turns: float) -> bool:
    """Return whether the sensor samples the same places of every turn: few levels are normal."""
    slack = (_LOCKED if taken.is_even else _LOCKED_UNEVEN) / turns
    return per_turn < _LOCKED_BELOW and abs(per_turn - round(per_turn)) < slack


def _rail(
    values: FloatArray, levels: FloatArray, counts: IntArray, resolution: float, *,
    is_locked: bool,
) -> float | None:
    """Return the level at which values are clipped, None if they are not."""
    n = len(values)
    extent = float(levels[-1] - levels[0])
    bins = np.bincount(np.minimum(((levels - levels[0]) * (_BINS / extent)).astype(int),
                                  _BINS - 1), weights=counts, minlength=_BINS)
    for rail, at, beside, top, neighbour in (
            (levels[0], counts[0], counts[1:3], bins[0], bins[1]),
            (levels[-1], counts[-1], counts[-3:-1], bins[-1], bins[-2])):
        if at >= max(_AT_RAIL, _RAIL_SHARE * n, _RAIL_RATIO * beside.mean()) and (
                not is_locked or _longest_run(values == rail)[1] >= _LOCKED_RUN):
            return float(rail)
        if (not is_locked and extent >= _BIN_STEPS * resolution
                and max(_AT_RAIL, _BIN_SHARE * n, _BIN_RATIO * (neighbour + 0.5)) <= top <= (
                    _BIN_MOST * n)):
            return float(rail)
    return None


def _longest_run(holds: BoolArray) -> tuple[int, int]:
    """Return where the longest run of what holds begins, and its length."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], holds, [False]])))
    if not len(edges):
        return 0, 0
    lengths = edges[1::2] - edges[::2]
    return int(edges[2 * int(np.argmax(lengths))]), int(lengths.max())
