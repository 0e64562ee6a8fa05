"""Slips by name: vectors that look like another unit, or like a phase of the other sense."""

from collections.abc import Callable, Iterator
from dataclasses import replace
import math

import numpy as np

from rotorsoil_ros.arrays import ComplexArray, FloatArray
from rotorsoil_ros.monitor.identification.fit import Problem
from rotorsoil_ros.monitor.suspicion import LEFT_AS_IS, LEFT_SHARE, SAID, UNDO

_LEFT_WITHOUT, _COHERENT = 0.05, 0.8
_LEFT_MENDED = 0.25
_FEWEST_CHANNELS = 3
_NEAR_FACTOR, _NEAR_ANGLE = 0.10, math.radians(12.0)

_FACTORS = {
    2.0: 'peak-to-peak for zero-to-peak', math.sqrt(2.0): 'zero-to-peak for rms',
    2.0 * math.sqrt(2.0): 'peak-to-peak for rms',
    25.4: 'mil for um or mm for inch', 9.81: 'g for m/s^2',
    1000.0: 'um for mm or mm for m'}
_ANGLES = {math.pi: 'its direction is reversed (180 degrees)',
           0.5 * math.pi: 'its angle is 90 degrees off: velocity for displacement, or x for z',
           -0.5 * math.pi: 'its angle is 90 degrees off: velocity for displacement, or x for z'}

Left = Callable[[Problem], float]


def of_all_channels(problem: Problem, omega: FloatArray, left: Left) -> str:
    """
    Return which slip in all channels explains the run better, or nothing.

    Parameters
    ----------
    problem : Problem
        The run as it is.
    omega : (n,) float array
        Speed of each row [rad/s].
    left : callable
        Share of the power that the best scalars and columns of a problem leave.

    """
    as_is = left(problem)
    if as_is <= LEFT_AS_IS:
        return ''
    found = {name: left(replace(problem, measured=undo(problem.measured, omega[:, None])))
             for name, undo in UNDO.items()}
    best = min(found, key=lambda name: found[name])
    return SAID[best] if found[best] < LEFT_SHARE * as_is else ''


def of_one_channel(
    problem: Problem, left: Left, predicted: Callable[[Problem, int], ComplexArray],
) -> tuple[int, str] | None:
    """
    Return which channel slipped and how, or None.

    Parameters
    ----------
    problem, left
        As `of_all_channels`.
    predicted : callable
        The vectors of a channel, (n,), that all the other channels imply.

    """
    channels = problem.measured.shape[1]
    if channels < _FEWEST_CHANNELS:
        return None
    as_is = left(problem)
    without = [left(_without(problem, channel)) for channel in range(channels)]
    suspect = int(np.argmin(without))
    if not (as_is > LEFT_AS_IS and without[suspect] < _LEFT_WITHOUT):
        return None
    implied, given = predicted(problem, suspect), problem.given[:, suspect]
    mine, theirs = problem.measured[given, suspect], implied[given]
    power = float(np.vdot(theirs, theirs).real)
    if power <= 0.0:
        return None
    ratio = complex(np.vdot(theirs, mine) / power)
    coherence = abs(np.vdot(theirs, mine)) / math.sqrt(power * np.vdot(mine, mine).real)
    if coherence < _COHERENT:
        return None
    for undone, said in _named(ratio):
        measured = problem.measured.copy()
        measured[:, suspect] /= undone
        if left(replace(problem, measured=measured)) < _LEFT_MENDED * as_is:
            return suspect, said
    return None


def _without(problem: Problem, channel: int) -> Problem:
    measured = problem.measured.copy()
    measured[:, channel] = complex(np.nan, np.nan)
    return replace(problem, measured=measured)


def _named(ratio: complex) -> Iterator[tuple[complex, str]]:
    """Yield the slips that a ratio of measured to implied looks like, and what undoes them."""
    size, turn = abs(ratio), math.atan2(ratio.imag, ratio.real)
    for factor, name in _FACTORS.items():
        for power in (1, -1):
            wanted = factor**power
            if abs(size / wanted - 1.0) <= _NEAR_FACTOR and abs(turn) <= _NEAR_ANGLE:
                yield wanted, f'it is {wanted:.3g} times what the others imply ({name}?)'
    for angle, name in _ANGLES.items():
        if abs(math.remainder(turn - angle, 2.0 * math.pi)) <= _NEAR_ANGLE and (
                abs(size - 1.0) <= _NEAR_FACTOR):
            yield complex(math.cos(angle), math.sin(angle)), name
