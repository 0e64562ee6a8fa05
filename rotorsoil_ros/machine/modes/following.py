"""At which speeds free vibrations have to be solved for, so that the decay of each is known."""

from itertools import pairwise

import numpy as np

from rotorsoil_ros.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from rotorsoil_ros.errors import NotSolvedError
from rotorsoil_ros.machine.coupled import CoupledModel
from rotorsoil_ros.machine.modes.eigen import CREEPING
from rotorsoil_ros.machine.modes.feeding import knots
from rotorsoil_ros.machine.modes.pencil import Pencil, Vibrations
from rotorsoil_ros.units import rad_s_to_rpm

# A vibration grows if it gains more than this share of |lambda|: less is round-off.
_ROUND_OFF = 1e-9

# Speeds at which the search begins, and up to how many it looks closer.
_FIRST_SPEEDS = 17
_MOST_SPEEDS = 1000

# Of the range: nearer speeds are one.
_SAME_SPEED = 1e-7

# Places in an interval at which the curve through its ends is looked at.
ALONG_CURVE = np.linspace(0.0, 1.0, 17)

# Vibrations of one frequency may feed each other if they are damped less than this.
_LIGHT = 0.1

# A single crossing of zero is clear if the slopes at its ends miss no more of it than this share.
_CROSSING = 0.25


def first_speeds(model: CoupledModel, span: tuple[float, float]) -> FloatArray:
    """Return speeds to begin with: between neighbours every coefficient is smooth."""
    speeds = [np.linspace(*span, _FIRST_SPEEDS)]
    speeds += [knots(bearing, span) for bearing in model.all_bearings.following]
    return np.unique(np.concatenate(speeds))


def followed(pencil: Pencil, speed: FloatArray) -> list[Vibrations]:
    """Return vibrations at speeds that are close enough to follow the decay of each."""
    samples = vibrations_at(pencil, speed)
    shortest = _SAME_SPEED * (speed[-1] - speed[0])
    checked: dict[tuple[float, float], FloatArray] = {}
    while True:
        closer = [place for left, right in pairwise(samples)
                  for place in _once(checked, left, right, shortest)]
        if not closer:
            return samples
        if len(samples) + len(closer) > _MOST_SPEEDS:
            raise NotSolvedError('stability could not be followed between '
                                 f'{rad_s_to_rpm(min(closer)):g} and '
                                 f'{rad_s_to_rpm(max(closer)):g} rpm')
        samples = sorted(samples + vibrations_at(pencil, np.unique(closer)),
                         key=lambda one: one.speed)


def _once(
    checked: dict[tuple[float, float], FloatArray], left: Vibrations, right: Vibrations,
    shortest: float,
) -> FloatArray:
    """Return where to look closer between two speeds, which is decided once."""
    ends = left.speed, right.speed
    if ends not in checked:
        checked[ends] = _closer(left, right, shortest)
    return checked[ends]


def vibrations_at(pencil: Pencil, speed: FloatArray) -> list[Vibrations]:
    """Return vibrations without their mirror images and what lies far above all others."""
    kept = []
    for found in pencil.at(speed):
        size = np.abs(found.frequency)
        wanted = (found.frequency.real > -CREEPING * size) & (size < 2.0 * pencil.solver.span[1])
        kept.append(Vibrations(found.speed, found.frequency[wanted], found.slope[wanted],
                               found.vector[wanted]))
    return kept


def _closer(left: Vibrations, right: Vibrations, shortest: float) -> FloatArray:
    """Return speeds inside an interval that have to be looked at, none if all is clear."""
    wide = right.speed - left.speed
    if wide < 2.0 * shortest:
        return np.zeros(0)
    one, other = continued(left, right)
    alone = (np.setdiff1d(np.flatnonzero(grows(left)), one).size
             + np.setdiff1d(np.flatnonzero(grows(right)), other).size)
    if alone or not _is_clear(left, right, one, other).all():
        return np.array([left.speed + 0.5 * wide])
    return _meetings(left, right, one, other, shortest)


def grows(found: Vibrations) -> BoolArray:
    """Return which vibrations grow."""
    return np.asarray(found.frequency.imag < -_ROUND_OFF * np.abs(found.frequency))


def continued(left: Vibrations, right: Vibrations) -> tuple[IntArray, IntArray]:
    """Return which vibrations at two speeds continue each other: alike in the middle."""
    half = 0.5 * (right.speed - left.speed)
    ahead, back = left.frequency + half * left.slope, right.frequency - half * right.slope
    gap = np.abs(ahead[:, None] - back) / (np.abs(ahead)[:, None] + np.abs(back))
    return assigned(gap)


def assigned(cost: FloatArray) -> tuple[IntArray, IntArray]:
    """Return which rows and columns belong together, at the least cost (m, n) of all."""
    from scipy.optimize import linear_sum_assignment  # a tenth of all imports of a start

    rows, columns = linear_sum_assignment(cost)
    return np.asarray(rows), np.asarray(columns)


def between(
    left: Vibrations, right: Vibrations, one: IntArray, other: IntArray,
) -> ComplexArray:
    """Return the frequencies between two speeds as cubics, (pairs, places)."""
    wide, t = right.speed - left.speed, ALONG_CURVE
    weights = np.array([(1 + 2 * t) * (1 - t) ** 2, t * (1 - t) ** 2 * wide,
                        t**2 * (3 - 2 * t), t**2 * (t - 1) * wide])
    ends = np.stack([left.frequency[one], left.slope[one], right.frequency[other],
                     right.slope[other]], axis=1)
    return np.asarray(ends @ weights)


def _is_clear(
    left: Vibrations, right: Vibrations, one: IntArray, other: IntArray,
) -> BoolArray:
    """Return of which pairs the sign of the decay is sure between the ends."""
    decay = between(left, right, one, other).imag
    first, last = left.frequency[one], right.frequency[other]
    # What a straight line with the mean slope misses is far more than what a cubic misses.
    missed = np.abs((last - first).imag - 0.5 * (right.speed - left.speed)
                    * (left.slope[one] + right.slope[other]).imag)
    floor = _ROUND_OFF * np.minimum(np.abs(first), np.abs(last))
    sure = ((decay.min(axis=1) - missed > -floor) | (decay.max(axis=1) + missed < floor))
    turns = np.diff(decay, axis=1)
    crosses = (first.imag < -floor) != (last.imag < -floor)
    once = crosses & (np.all(turns > 0.0, axis=1) | np.all(turns < 0.0, axis=1))
    return np.asarray(sure | (once & (missed < _CROSSING * np.abs(last.imag - first.imag))))


def _meetings(
    left: Vibrations, right: Vibrations, one: IntArray, other: IntArray, shortest: float,
) -> FloatArray:
    """Return speeds at which two light vibrations have one frequency and may feed each other."""
    curves = between(left, right, one, other)
    light = np.flatnonzero((np.abs(curves.imag) < _LIGHT * np.abs(curves)).any(axis=1))
    wide, places = right.speed - left.speed, set()
    for index, mode in enumerate(light):
        gap = curves[light[index + 1:]].real - curves[mode].real
        row, step = np.nonzero(np.sign(gap[:, :-1]) * np.sign(gap[:, 1:]) < 0.0)
        before, after = gap[row, step], gap[row, step + 1]
        share = (step + before / (before - after)) / (len(ALONG_CURVE) - 1)
        # What they gain from each other falls below their decay this far beside the meeting.
        near = np.maximum(np.abs(curves[mode].imag).max(),
                          np.abs(curves[light[index + 1:]][row].imag).max(axis=1, initial=0.0))
        reach = np.maximum(near / np.maximum(np.abs(after - before) * (len(ALONG_CURVE) - 1),
                                             np.finfo(float).tiny) * 0.25, shortest / wide)
        places |= set(share[(share > reach) & (share < 1.0 - reach)].tolist())
    return left.speed + wide * np.array(sorted(places))
