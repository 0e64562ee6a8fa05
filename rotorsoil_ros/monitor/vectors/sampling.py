"""When was each sample taken? What stamps tell of it, and what they cannot."""

from collections.abc import Iterator
from dataclasses import dataclass
import math

import numpy as np

from rotorsoil_ros.arrays import FloatArray
from rotorsoil_ros.monitor.vectors.refusal import Flaw, Refusal

# Spacings within these multiples of their mean come from a sensor that samples evenly.
_EVEN = (0.5, 1.5)

# So small a share of the mean spacing lies between samples that came together; random times
# have 10 % such, packets of two 50 %.
_TOGETHER, _MOST_TOGETHER = 0.1, 0.4

# A hole longer than this share of the stretch leaves too little to part orders.
_LONGEST_HOLE = 0.4

# Two time axes further apart than this phase of 1X are held against each other [rad]; where the
# signal does not decide between them, a vector is lost beyond the second one (it shrinks by 10 %).
_APART, _WORST_SCATTER = 0.1, 0.45

# Logarithm of the likelihood at which the signal has decided between two time axes.
_DECIDED = 20.0

# Sorted stamps that scattered by more than a step lie as if by chance: more than this share of
# the spacings is below such a share of their mean (by chance 26 %). Their order is then not that
# in which the samples were taken, and the signal must speak for them with this much per sample.
_CLOSE, _BY_CHANCE = 0.3, 0.15
# How far they scatter is then a guess: half of what is allowed elsewhere.
_SPEAKS, _WORST_GUESS = 0.4, 0.2

_WHOLE = 0.15  # share of a step by which a spacing may miss a number of whole steps
_FEWEST_LOST = 3
_MOSTLY = 0.8


@dataclass(frozen=True, slots=True)
class Sampling:
    """
    How a stretch was sampled.

    Attributes
    ----------
    step : float
        Between two samples, while it samples [s].
    is_even : bool
        Whether no spacing differs much from the others.
    has_lost : bool
        Whether spacings are whole steps: samples of an even grid are missing.
    is_ordered : bool
        Whether stamps can lie in the order in which the samples were taken.

    """

    step: float
    is_even: bool
    has_lost: bool = False
    is_ordered: bool = True

    @property
    def rate(self) -> float:
        """Samples per second."""
        return 1.0 / self.step


def sampling(
    time: FloatArray, *, until: float, turn_rate: float, turns: float,
) -> Sampling | Refusal:
    """
    Return how a stretch was sampled, or why that is not known.

    Parameters
    ----------
    time : (n,) float array
        Stamps, ascending [s].
    until : float
        Where the next stretch begins [s].
    turn_rate, turns : float
        Of the rotor [1/s], and how many of its turns make a stretch.

    """
    spacing = np.diff(time)
    mean = float(time[-1] - time[0]) / max(len(spacing), 1)
    hole = max(float(spacing.max(initial=0.0)), until - float(time[-1]))
    if len(spacing) and (spacing < _TOGETHER * mean).mean() > _MOST_TOGETHER:
        size = len(time) / (1 + np.count_nonzero(spacing >= _TOGETHER * mean))
        return Refusal(Flaw.PACKETS, f'stamps come in packets of about {size:.0f}: when each '
                                     'sample was taken is not told')
    if hole * turn_rate > _LONGEST_HOLE * turns:
        return Refusal(Flaw.MISSING, f'samples missing over {hole:.3g} s')
    if not mean > 0.0:
        return Refusal(Flaw.MISSING, 'a single sample in the stretch')
    if spacing.min() >= _EVEN[0] * mean and spacing.max() <= _EVEN[1] * mean:
        return Sampling(mean, is_even=True)
    if (step := _step_of_lost(spacing)) is not None:
        return Sampling(step, is_even=False, has_lost=True)
    return Sampling(float(np.median(spacing)), is_even=False,
                    is_ordered=bool(np.mean(spacing < _CLOSE * mean) <= _BY_CHANCE))


def end_of_packet(time: FloatArray, end: int) -> int:
    """Return where the packet ends that a stretch ends in, 0 while that has not come."""
    if not end:
        return 0
    apart = _TOGETHER * float(time[end - 1] - time[0]) / max(end - 1, 1)
    ends = np.flatnonzero(np.diff(time[end - 1:]) >= apart)
    return end + int(ends[0]) if len(ends) else 0


def unpacked(time: FloatArray) -> tuple[int, FloatArray]:
    """
    Return when samples of packets were taken, of an even sensor whose last one came at once.

    Parameters
    ----------
    time : (n,) float array
        Stamps in the order in which the samples came, up to the end of a packet [s].

    Returns
    -------
    int
        How many samples the first packet has: since when it gathered them is not told.
    (m,) float array
        When each of the others was taken [s].

    """
    spacing = np.diff(time)
    apart = _TOGETHER * float(time[-1] - time[0]) / max(len(spacing), 1)
    last = np.flatnonzero(np.append(spacing >= apart, True))
    arrival, sizes = time[last], np.diff(last)
    number = np.arange(last[0] + 1, len(time)) - np.repeat(last[:-1], sizes)
    return int(last[0]) + 1, np.repeat(arrival[:-1], sizes) + number * np.repeat(
        np.diff(arrival) / sizes, sizes)


def _step_of_lost(spacing: FloatArray) -> float | None:
    """Return the step of an even grid of which samples are missing; None if there is none."""
    short = float(np.quantile(spacing, 0.1))
    if not short > 0.0:
        return None
    short = float(np.median(spacing[spacing <= _EVEN[1] * short]))
    steps = np.rint(spacing / short)
    far = steps > 1.0
    off = np.abs(spacing / short - steps)
    is_whole = np.count_nonzero(far) > _FEWEST_LOST and min(
        np.mean(off[far] <= _WHOLE), np.mean(off <= _WHOLE)) >= _MOSTLY
    return float(spacing.sum() / steps.sum()) if is_whole else None


def even_grids(time: FloatArray, taken: Sampling) -> Iterator[FloatArray]:
    """Yield times at which an even sensor may have taken the samples, (n,) each [s]."""
    count = np.arange(len(time))
    if not taken.has_lost:
        slope, start = np.polyfit(count, time, 1)
        yield start + slope * count
        by_step = taken.step * count
        yield by_step + np.median(time - by_step)
    steps = np.concatenate([[0.0], np.cumsum(np.maximum(
        np.rint(np.diff(time) / taken.step), 1.0))])
    slope, start = np.polyfit(steps, time, 1)
    yield start + slope * steps


def phase_scatter(time: FloatArray, grid: FloatArray, *, speed: float) -> float:
    """Return how far stamps lie from a grid, as phase of 1X, root mean square [rad]."""
    return speed * float(np.sqrt(np.mean((time - grid) ** 2)))


def told_by(
    apart: float, likelihood: float, taken: Sampling, *, number: int, step_phase: float,
) -> tuple[bool, float]:
    """
    Return whether stamps must be refused, and the phase scatter that is left in them [rad].

    Parameters
    ----------
    apart : float
        Phase of 1X between stamps and grid, root mean square [rad].
    likelihood : float
        Logarithm of that of the grid over that of the stamps, by what each leaves unexplained.
    taken : Sampling
        How the samples were taken.
    number, step_phase : int, float
        How many there are, and the phase of 1X in one step [rad].

    """
    decided, worst = _DECIDED, _WORST_SCATTER
    if not taken.is_ordered:
        # Sorting hides how far stamps stray: of r steps the square root of r / sqrt(pi) is left.
        apart *= max(1.0, math.sqrt(math.pi) * apart / step_phase)
        decided, worst = max(_DECIDED, _SPEAKS * number), _WORST_GUESS
    if apart <= _APART or likelihood < -decided:
        return False, 0.0
    return likelihood > _DECIDED or apart > worst, apart


def scattered(apart: float, *, speed: float) -> Refusal:
    """Return the refusal of stamps that scatter by a phase of 1X [rad] at a speed [rad/s]."""
    return Refusal(Flaw.STAMPS, f'stamps scatter by {1e3 * apart / speed:.2g} ms: they tell when '
                                'a sample came, not when it was taken')


def image(
    order: int, *, rate: float, turn_rate: float, turns: float, highest: int,
) -> int | None:
    """Return the lowest other order, up to a highest, that sampling makes look like one."""
    for other in range(1, highest + 1):
        for sign in (-1, 1):
            beat = abs(other + sign * order) * turn_rate
            folds = round(beat / rate)
            if folds and abs(beat - folds * rate) < 1.5 * turn_rate / turns:
                return other
    return None


