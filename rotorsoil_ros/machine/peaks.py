"""Where a machine answers its unbalance with more than on either side, and how sharply."""

from collections.abc import Sequence
from dataclasses import dataclass
import math

import numpy as np

from rotorsoil_ros.arrays import ComplexArray, FloatArray, prominent_peaks
from rotorsoil_ros.channel import ACROSS, HOUSING
from rotorsoil_ros.errors import OutOfTableError
from rotorsoil_ros.machine.coupled import CoupledModel
from rotorsoil_ros.machine.modes.critical import CriticalSpeed
from rotorsoil_ros.machine.response import Predictor

# Points per piece of the table: its polynomials are smooth, a peak spans several.
_POINTS = 16

# A peak stands out when it rises by this factor over the valleys beside it.
_PROMINENCE = 1.5

# Peaks this much smaller than the largest, or than what else moves there, would clutter a list.
_NEGLIGIBLE, _BESIDE = 1e-3, 0.1

# Peaks of several channels within this share of the speed are one resonance.
_SAME_RESONANCE = 0.055

# A peak is looked at so many damping ratios to both sides, at so many speeds.
_WIDTHS = 10.0
_RESPONSE_POINTS = 2001
# Share of a speed about which something has to be known.
_LEAST_REACH = 1e-3
_HALF_POWER = 0.5**0.5


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
    """
    Return, for each speed at which channels of one unit peak, the largest peak there.

    What hardly moves beside the others at its speed is left out: patches of a raft have peaks of
    their own below a machine that passes them smoothly.
    """
    largest: list[Peak] = []
    everything = [peak for channel in channels for peak in channel_peaks(predictor, channel)]
    columns = [predictor.channels.index(channel) for channel in channels]
    moved = np.abs(predictor.predict(np.array([peak.speed for peak in everything])).displacement)
    beside = moved[:, columns].max(axis=1, initial=0.0).tolist()
    everything = [peak for peak, most in zip(everything, beside, strict=True)
                  if peak.amplitude >= _BESIDE * most]
    for peak in sorted(everything, key=lambda peak: -peak.amplitude):
        if largest and peak.amplitude < _NEGLIGIBLE * largest[0].amplitude:
            break
        if all(abs(peak.speed - other.speed) > _SAME_RESONANCE * other.speed for other in largest):
            largest.append(peak)
    return sorted(largest, key=lambda peak: peak.speed)


def half_power_factors(
    model: CoupledModel, criticals: Sequence[CriticalSpeed],
) -> list[float]:
    """
    Return the amplification factors by the shaft's response to what excites each mode most.

    Parameters
    ----------
    model : CoupledModel
        The machine.
    criticals : sequence of CriticalSpeed
        Where it resonates: a peak belongs to the one that is nearest to it.

    Returns
    -------
    list of float
        N_c / (N_2 - N_1) [-]: the speed of the peak over the width at 0.707 of its height; NaN
        where the response has no such peak, as of a backward mode or a heavily damped one, or
        where bearings are not known as far.

    References
    ----------
    API 617 (7th ed.), 1.2.6 and fig. 1; API RP 684 (2nd ed.): unbalance where the mode moves
    most, in phase with it.

    """
    speeds = np.array([critical.speed for critical in criticals])
    return [_half_power_factor(model, critical, speeds) for critical in criticals]


def _half_power_factor(
    model: CoupledModel, critical: CriticalSpeed, speeds: FloatArray,
) -> float:
    rows = [model.rotor.node_of(disc.position) for disc in model.rotor.discs]
    if critical.damping_ratio <= 0.0 or not rows:
        return math.nan
    reach = min(0.9, max(_WIDTHS * critical.damping_ratio, 1e-9))
    # Of a forward orbit x = -i z: its part of the shape, at the discs, turned into phase.
    forward = 0.5 * (critical.deflection[:, 1] + 1j * critical.deflection[:, 0])
    excites = np.zeros(len(model.planes), dtype=complex)
    excites[:len(rows)] = forward[rows]
    shaft = [model.channels.index(channel) for channel in model.rotor.channels
             if channel.axis in ACROSS and channel.part != HOUSING]
    speed, size = _about(model, critical.speed, reach, excites)
    size = size[:, shaft]
    size = size[:, size[np.abs(speed - critical.speed).argmin()].argmax()]
    inner = 1 + np.flatnonzero((size[1:-1] > size[:-2]) & (size[1:-1] > size[2:]))
    # A peak is where its mode is, within its bandwidth, and no other mode is nearer.
    near = critical.damping_ratio * critical.speed + 2.0 * (speed[1] - speed[0])
    own = [top for top in inner.tolist() if np.abs(speeds - speed[top]).min()
           == abs(critical.speed - speed[top]) <= near]
    if not own:
        return math.nan
    return _sharpness(speed, size, min(own, key=lambda top: abs(critical.speed - speed[top])))


def _about(
    model: CoupledModel, middle: float, reach: float, excites: ComplexArray,
) -> tuple[FloatArray, FloatArray]:
    """Return speeds [rad/s] and answers about a middle, as far as bearings and ground go."""
    while True:
        ends = model.bearings.within_tables(((1.0 - reach) * middle, (1.0 + reach) * middle))
        speed = np.linspace(*ends, _RESPONSE_POINTS)
        try:
            return speed, np.abs(model.unbalance_response(speed, excites).displacement)
        except OutOfTableError:
            if reach < _LEAST_REACH:
                raise
            reach *= 0.8


def _sharpness(speed: FloatArray, size: FloatArray, top: int) -> float:
    """Return speed over width at 0.707 of a peak's height; NaN if it does not fall so far."""
    below = np.flatnonzero(size[:top] < _HALF_POWER * size[top])
    above = top + np.flatnonzero(size[top:] < _HALF_POWER * size[top])
    if not len(below) or not len(above):
        return math.nan

    def crossing(left: int) -> float:
        share = (_HALF_POWER * size[top] - size[left]) / (size[left + 1] - size[left])
        return float(speed[left] + share * (speed[left + 1] - speed[left]))

    return float(speed[top] / (crossing(int(above[0]) - 1) - crossing(int(below[-1]))))
