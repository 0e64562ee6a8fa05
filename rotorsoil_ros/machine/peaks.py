"""Where a machine answers its unbalance with more than on either side."""

from dataclasses import dataclass
import math

import numpy as np

from rotorsoil_ros.arrays import FloatArray, prominent_peaks
from rotorsoil_ros.machine.response import Predictor

# Points per piece of the table: its polynomials are smooth, a peak spans several.
_POINTS = 16

# A peak stands out when it rises by this factor over the valleys beside it.
_PROMINENCE = 1.5

# Peaks this much smaller than the largest would clutter a list.
_NEGLIGIBLE = 1e-3

# Peaks of several channels within this share of the speed are one resonance.
_SAME_RESONANCE = 0.055


@dataclass(frozen=True, slots=True)
class Peak:
    """Local maximum: speed [rad/s], channel, and amplitude [m or rad, zero-to-peak]."""

    speed: float
    channel: str
    amplitude: float


def resolved_speeds(predictor: Predictor) -> FloatArray:
    """Return speeds (n,) [rad/s] that are as dense as the response is sharp."""
    pieces = predictor.table.pieces
    share = np.arange(_POINTS) / _POINTS
    left, right = pieces.edges[:-1, None], pieces.edges[1:, None]
    speeds = np.append((left + (right - left) * share)[pieces.resolved], pieces.edges[-1])
    return np.unique(speeds[predictor.covers(speeds)])


def channel_peaks(predictor: Predictor, channel: str) -> list[Peak]:
    """Return the peaks of one channel, slowest first."""
    column = predictor.channels.index(channel)
    speeds = resolved_speeds(predictor)

    def amplitude(speed: FloatArray) -> FloatArray:
        return np.abs(predictor.predict(speed).displacement[:, column])

    level = np.log(amplitude(speeds) + np.finfo(float).tiny)
    found = prominent_peaks(level, math.log(_PROMINENCE))
    peaks = []
    for index in found:
        near = np.linspace(speeds[index - 1], speeds[index + 1], 201)
        near = near[predictor.covers(near)]
        sizes = amplitude(near)
        best = int(sizes.argmax())
        peaks.append(Peak(float(near[best]), channel, float(sizes[best])))
    return peaks


def resonances(predictor: Predictor, channels: tuple[str, ...]) -> list[Peak]:
    """Return, for each speed at which channels of one unit peak, the largest peak there."""
    largest: list[Peak] = []
    everything = [peak for channel in channels for peak in channel_peaks(predictor, channel)]
    for peak in sorted(everything, key=lambda peak: -peak.amplitude):
        if largest and peak.amplitude < _NEGLIGIBLE * largest[0].amplitude:
            break
        if all(abs(peak.speed - other.speed) > _SAME_RESONANCE * other.speed for other in largest):
            largest.append(peak)
    return sorted(largest, key=lambda peak: peak.speed)
