"""Where a run passed a resonance, and whether that was where and as high as predicted."""

from collections.abc import Sequence
from dataclasses import dataclass, field
import math

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from rotorsoil_ros.arrays import BoolArray, FloatArray, prominent_peaks
from rotorsoil_ros.monitor.quasistatic import (
    LARGEST_SHIFT,
    passage_number,
    Resonance,
    SLOW_ENOUGH,
)
from rotorsoil_ros.units import rad_s_to_rpm, Units

# A peak rises by this factor over the valleys beside it ...
PROMINENCE = 1.5
# ... and to this share of the largest amplitude of its sweep.
_NEGLIGIBLE = 0.1

# At this many decay times of a passage its free vibration is down to a twentieth of the forced
# one: exp(-p tau) against 1 / tau.
_DECAY = 5.0

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


def passages(
    speed: FloatArray, amplitude: FloatArray, rate: FloatArray, *, sweep: int = 0,
) -> list[Passage]:
    """
    Find the peaks of one run-up or run-down.

    Parameters
    ----------
    speed, amplitude, rate : (n,) float arrays
        In the order of time [rad/s], [m, rad], [rad/s^2]; samples whose speed or amplitude is
        not finite are left out.
    sweep : int
        Number of the run-up or run-down.

    """
    given = np.isfinite(speed) & np.isfinite(amplitude)
    speed, smooth, rate = speed[given], amplitude[given], rate[given]
    for samples, width in _MEDIANS:
        if len(smooth) >= samples:
            smooth = _running_median(smooth, width)
            break
    level = np.log(np.maximum(smooth, _NEGLIGIBLE * smooth.max(initial=0.0))
                   + np.finfo(float).tiny)
    return [Passage(float(speed[peak]), float(smooth[peak]), float(rate[peak]), sweep)
            for peak in prominent_peaks(level, math.log(PROMINENCE))]


def _running_median(values: FloatArray, width: int) -> FloatArray:
    """Return the median of each value and its neighbours; the first and last ones repeat."""
    padded = np.pad(values, width // 2, mode='edge')
    return np.asarray(np.median(sliding_window_view(padded, width), axis=1))


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
    return _DECAY / max(number, np.finfo(float).tiny) * math.sqrt(abs(passage.rate))


def damping_beside(speed: float, resonances: Sequence[Resonance]) -> float:
    """Return the damping ratio of the resonance nearest to a speed [rad/s], NaN of none."""
    return min(resonances, key=lambda resonance: abs(resonance.speed - speed),
               default=Resonance(0.0, math.nan)).damping_ratio


@dataclass(frozen=True, slots=True)
class Allowed:
    """
    What a predicted peak allows a channel, and what the channel did there.

    Attributes
    ----------
    least, most : float
        Between which the measured peak has to be [m, rad].
    shown : float
        Largest amplitude that was measured where the peak may be [m, rad].

    """

    least: float = math.nan
    most: float = math.nan
    shown: float = math.nan


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
    allowed : Allowed
        By the prediction; NaN where there is none.
    is_followed : bool
        Whether the prediction knows how fast the peak was passed.

    """

    channel: str
    predicted: Passage | None
    measured: Passage | None
    damping_ratio: float
    allowed: Allowed = field(default_factory=Allowed)
    is_followed: bool = False

    @property
    def deviation(self) -> float:
        """Measured critical over predicted, less one: zero inside what a fast passage leaves."""
        if self.predicted is None or self.measured is None:
            return math.nan
        if self.is_followed:  # both are late alike
            return self.measured.speed / self.predicted.speed - 1.0
        low, high = self.measured.critical_range(
            0.0 if math.isnan(self.damping_ratio) else self.damping_ratio)
        return float(np.clip(self.predicted.speed, low, high)) / self.predicted.speed - 1.0

    @property
    def is_complete(self) -> bool:
        """Whether both sides have the peak."""
        return self.predicted is not None and self.measured is not None

    @property
    def is_slow(self) -> bool:
        """Whether the peak was passed slowly enough to be as high as at constant speed."""
        passed = self.measured or self.predicted
        return bool(passed and passed.number(self.damping_ratio) >= SLOW_ENOUGH)

    @property
    def is_held(self) -> bool:
        """Whether a measured peak has to be where and as high as the predicted one."""
        return self.is_followed or self.is_slow


def pair(
    channel: str, predicted: Sequence[Passage], measured: Sequence[Passage], *,
    allowed: Sequence[Allowed], resonances: Sequence[Resonance], are_followed: bool = False,
) -> list[PeakPair]:
    """
    Pair predicted and measured peaks, the closest first.

    Parameters
    ----------
    channel : str
        Where they are.
    predicted, measured : sequences of Passage
        Peaks of the same run.
    allowed : sequence of Allowed
        What each predicted peak allows.
    resonances : sequence of Resonance
        Critical speeds of the machine.
    are_followed : bool
        Whether predicted peaks know how fast they were passed.

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
                                  damping_ratio(predicted[i]), allowed[i], are_followed))
    pairs += [PeakPair(channel, predicted[i], None, damping_ratio(predicted[i]), allowed[i],
                       are_followed) for i in sorted(left)]
    pairs += [PeakPair(channel, None, measured[j], damping_ratio(measured[j]),
                       is_followed=are_followed) for j in sorted(right)]
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


def is_where(speed: FloatArray, peak: Passage) -> BoolArray:
    """Return which speeds [rad/s] are so near to a peak that its partner may be there."""
    return np.asarray(np.abs(speed / peak.speed - 1.0) <= _FARTHEST)


def is_decided(peak: PeakPair, speed: float, *, is_rising: bool) -> bool:
    """Return whether a peak without a partner cannot find one beyond a speed [rad/s] any more."""
    if peak.predicted is not None:
        last = peak.predicted.speed * (1.0 + _FARTHEST if is_rising else 1.0 - _FARTHEST)
    else:
        assert peak.measured is not None
        last = peak.measured.speed / (1.0 - _FARTHEST if is_rising else 1.0 + _FARTHEST)
    return speed > last if is_rising else speed < last


def peak_fault(peak: PeakPair, *, margin: float) -> str:
    """Return what is wrong with a peak; nothing if all is well or nothing can be said."""
    if peak.measured is None:
        assert peak.predicted is not None
        # One that does not stand out, as from an unbalance that grows, is there all the same.
        is_missing = peak.is_held and not peak.allowed.shown >= peak.allowed.least
        return '' if not is_missing else (
            f'{peak.channel}: the peak predicted at {rad_s_to_rpm(peak.predicted.speed):.0f} rpm '
            'was not measured')
    at = f'{peak.channel}: the peak measured at {rad_s_to_rpm(peak.measured.speed):.0f} rpm'
    if peak.predicted is None:
        return f'{at} is not predicted'
    if abs(peak.deviation) > margin:
        return (f'{at} is {100 * peak.deviation:+.1f} % from the predicted '
                f'{rad_s_to_rpm(peak.predicted.speed):.0f} rpm, allowed {100 * margin:.0f} %')
    if peak.measured.amplitude > peak.allowed.most:
        return (f'{at} is {Units().displacement(peak.measured.amplitude, digits=3)} high, at '
                f'most {Units().displacement(peak.allowed.most, digits=3)} predicted')
    return ''
