"""Where a run passed a resonance, and whether that was where and as high as predicted."""

from collections.abc import Sequence
from dataclasses import dataclass
import math

import numpy as np
from scipy.ndimage import median_filter
from scipy.signal import find_peaks

from rotorsoil_ros.arrays import FloatArray
from rotorsoil_ros.monitor.quasistatic import (
    DECAY,
    LARGEST_SHIFT,
    passage_number,
    Resonance,
    SLOW_ENOUGH,
    speed_rate,
)

# A peak rises by this factor over the valleys beside it ...
_PROMINENCE = 1.5
# ... and to this share of the largest amplitude of its sweep.
_NEGLIGIBLE = 0.1

# A sweep spans this share of its highest speed, and ends where the speed turns back by it.
_SPAN = 0.1

# Samples over which a median is taken, and from how many samples on.
_MEDIANS = ((40, 5), (20, 3))

# Peaks of several channels within this share of the speed are one resonance.
_SAME_RESONANCE = 0.055

# Peaks further apart than this share of the predicted speed do not belong together.
_FARTHEST = 0.35


@dataclass(frozen=True, slots=True)
class Passage:
    """
    A peak of the amplitude while the speed changed.

    Attributes
    ----------
    speed, amplitude : float
        Where [rad/s] and how high [m, rad].
    rate : float
        Of the speed there [rad/s^2]; negative in a run-down.
    sweep : int
        Number of the run-up or run-down.

    """

    speed: float
    amplitude: float
    rate: float
    sweep: int = 0

    def number(self, damping_ratio: float) -> float:
        """Return the passage number p for a mode of some damping."""
        return passage_number(Resonance(self.speed, damping_ratio), self.rate)

    def critical_range(self, damping_ratio: float) -> tuple[float, float]:
        """
        Return between which speeds the critical speed lies [rad/s].

        Notes
        -----
        A fast passage peaks late, by up to 2.16 sqrt(rate) (Lewis 1932).

        """
        if self.number(damping_ratio) >= SLOW_ENOUGH:
            return self.speed, self.speed
        late = LARGEST_SHIFT * math.sqrt(abs(self.rate))
        ends = self.speed, self.speed - math.copysign(late, self.rate)
        return min(ends), max(ends)


def passages(time: FloatArray, speed: FloatArray, amplitude: FloatArray) -> list[Passage]:
    """
    Find the peaks of every run-up and run-down.

    Parameters
    ----------
    time, speed, amplitude : (n,) float arrays
        Ascending [s], [rad/s] and [m, rad]; samples that are not finite are left out.

    """
    given = np.isfinite(speed) & np.isfinite(amplitude)
    time, speed, amplitude = time[given], speed[given], amplitude[given]
    found = []
    rate = speed_rate(time, speed)
    for number, sweep in enumerate(sweeps(speed)):
        smooth = amplitude[sweep]
        for samples, width in _MEDIANS:
            if len(smooth) >= samples:
                smooth = median_filter(smooth, width, mode='nearest')
                break
        level = np.log(np.maximum(smooth, _NEGLIGIBLE * smooth.max(initial=0.0))
                       + np.finfo(float).tiny)
        peaks, _ = find_peaks(level, prominence=math.log(_PROMINENCE))
        found += [Passage(float(speed[sweep][peak]), float(smooth[peak]),
                          float(rate[sweep][peak]), number) for peak in peaks]
    return found


def without_ringing(
    found: Sequence[Passage], resonances: Sequence[Resonance],
) -> tuple[list[Passage], list[Passage]]:
    """
    Part peaks from lobes that may be the free vibration after a larger peak passed too fast.

    Parameters
    ----------
    found : sequence of Passage
        Measured peaks, in the order of time.
    resonances : sequence of Resonance
        Critical speeds of the machine; the nearest one tells how fast a vibration dies away.

    Returns
    -------
    two lists of Passage
        Peaks, and lobes.

    """
    peaks: list[Passage] = []
    lobes: list[Passage] = []
    for passage in found:
        rings = any(
            before.sweep == passage.sweep and before.amplitude > passage.amplitude
            and abs(passage.speed - before.speed) < ringing_reach(
                damping_beside(before.speed, resonances), before)
            for before in peaks)
        (lobes if rings else peaks).append(passage)
    return peaks, lobes


def ringing_reach(damping_ratio: float, passage: Passage) -> float:
    """Return how far behind a peak its free vibration lasts [rad/s]; 0 if passed slowly."""
    number = passage.number(damping_ratio)
    if not number < SLOW_ENOUGH:
        return 0.0
    return DECAY / max(number, np.finfo(float).tiny) * math.sqrt(abs(passage.rate))


def damping_beside(speed: float, resonances: Sequence[Resonance]) -> float:
    """Return the damping ratio of the resonance nearest to a speed [rad/s], NaN of none."""
    return min(resonances, key=lambda resonance: abs(resonance.speed - speed),
               default=Resonance(0.0, math.nan)).damping_ratio


def sweeps(speed: FloatArray) -> list[slice]:
    """Return the stretches in which the speed, (n,) [rad/s], only rises or only falls."""
    if not len(speed):
        return []
    turn_back = _SPAN * float(speed.max())
    turns, extreme, rising = [0], 0, 0
    for index, value in enumerate(speed.tolist()):
        ahead = (value - float(speed[extreme])) * rising
        if rising == 0 and abs(value - float(speed[0])) > turn_back:
            rising, extreme = (1 if value > speed[0] else -1), index
        elif ahead > 0.0:
            extreme = index
        elif ahead < -turn_back:
            turns.append(extreme)
            rising, extreme = -rising, index
    if rising == 0:
        return []
    return [slice(start, stop + 1) for start, stop in zip(
        turns, [*turns[1:], len(speed) - 1], strict=True)]


@dataclass(frozen=True, slots=True)
class PeakPair:
    """
    A predicted peak of a channel beside a measured one; either may be missing.

    Attributes
    ----------
    channel : str
        Where.
    predicted, measured : Passage or None
        The peaks.
    damping_ratio : float
        Of the critical speed next to them [-]; NaN where none is known.
    limit : float
        Amplitude that the measured peak must not exceed [m, rad].

    """

    channel: str
    predicted: Passage | None
    measured: Passage | None
    damping_ratio: float
    limit: float

    @property
    def deviation(self) -> float:
        """Measured critical over predicted, less one: zero inside what a fast passage leaves."""
        if self.predicted is None or self.measured is None:
            return math.nan
        low, high = self.measured.critical_range(
            0.0 if math.isnan(self.damping_ratio) else self.damping_ratio)
        return float(np.clip(self.predicted.speed, low, high)) / self.predicted.speed - 1.0

    @property
    def is_slow(self) -> bool:
        """Whether the peak was passed slowly enough to be as high as at constant speed."""
        passed = self.measured or self.predicted
        return bool(passed and passed.number(self.damping_ratio) >= SLOW_ENOUGH)


def pair(
    channel: str, predicted: Sequence[Passage], measured: Sequence[Passage], *,
    limits: Sequence[float], resonances: Sequence[Resonance],
) -> list[PeakPair]:
    """
    Pair predicted and measured peaks, the closest first.

    Parameters
    ----------
    channel : str
        Where they are.
    predicted, measured : sequences of Passage
        Peaks of the same run.
    limits : sequence of float
        What each predicted peak allows [m, rad].
    resonances : sequence of Resonance
        Critical speeds of the machine.

    """
    def damping_ratio(passage: Passage) -> float:
        return damping_beside(passage.speed, resonances)

    distance = {(i, j): abs(there.speed / here.speed - 1.0)
                for i, here in enumerate(predicted) for j, there in enumerate(measured)
                if here.rate * there.rate >= 0.0}
    pairs, left, right = [], set(range(len(predicted))), set(range(len(measured)))
    for (i, j), apart in sorted(distance.items(), key=lambda entry: entry[1]):
        if i in left and j in right and apart <= _FARTHEST:
            left.remove(i)
            right.remove(j)
            pairs.append(PeakPair(channel, predicted[i], measured[j],
                                  damping_ratio(predicted[i]), limits[i]))
    pairs += [PeakPair(channel, predicted[i], None, damping_ratio(predicted[i]), limits[i])
              for i in sorted(left)]
    pairs += [PeakPair(channel, None, measured[j], damping_ratio(measured[j]), math.nan)
              for j in sorted(right)]
    return pairs


def told_once(pairs: Sequence[PeakPair]) -> list[PeakPair]:
    """Leave out peaks without a partner where another channel has a pair at the same speed."""
    told = [(each.predicted.speed, each.measured.speed) for each in pairs
            if each.predicted is not None and each.measured is not None]

    def is_told(each: PeakPair) -> bool:
        if each.predicted is None and each.measured is not None:
            return any(abs(each.measured.speed / speed - 1.0) < _SAME_RESONANCE
                       for _, speed in told)
        if each.measured is None and each.predicted is not None:
            return any(abs(each.predicted.speed / speed - 1.0) < _SAME_RESONANCE
                       for speed, _ in told)
        return False

    return [each for each in pairs if not is_told(each)]
