"""How sharp is a critical speed, and how far from a running speed has one to look for others."""

from collections.abc import Sequence
import math

import numpy as np

from rotorsoil_ros.arrays import FloatArray
from rotorsoil_ros.channel import ACROSS, HOUSING
from rotorsoil_ros.machine.coupled import CoupledModel
from rotorsoil_ros.machine.modes import CriticalSpeed, MARGIN_ABOVE, MARGIN_BELOW

# A peak is looked at so many damping ratios to both sides, at so many speeds.
_WIDTHS = 10.0
_RESPONSE_POINTS = 2001
_HALF_POWER = 0.5**0.5

# Beyond the largest margin by so much: a critical speed just at it is still found.
_ROUND_OFF = 1e-6


def asked(running: float) -> tuple[float, float]:
    """Return between which speeds [rad/s] a margin from a running speed can be missed."""
    return ((1.0 - MARGIN_BELOW - _ROUND_OFF) * running,
            (1.0 + MARGIN_ABOVE + _ROUND_OFF) * running)


def half_power_factors(
    model: CoupledModel, criticals: Sequence[CriticalSpeed],
) -> list[float]:
    """
    Return the amplification factors by the response to unbalance that excites each mode most.

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
    speed = np.linspace(*model.within_tables(
        ((1.0 - reach) * critical.speed, (1.0 + reach) * critical.speed)), _RESPONSE_POINTS)
    # Of a forward orbit x = -i z: its part of the shape, at the discs, turned into phase.
    forward = 0.5 * (critical.deflection[:, 1] + 1j * critical.deflection[:, 0])
    excites = np.zeros(len(model.planes), dtype=complex)
    excites[:len(rows)] = forward[rows]
    blocks = {block.name for block in model.foundations}
    shaft = [index for index, channel in enumerate(model.channels)
             if channel.axis in ACROSS and channel.part != HOUSING
             and channel.station not in blocks]
    size = np.abs(model.unbalance_response(speed, excites).displacement[:, shaft])
    size = size[:, size[np.abs(speed - critical.speed).argmin()].argmax()]
    inner = 1 + np.flatnonzero((size[1:-1] > size[:-2]) & (size[1:-1] > size[2:]))
    # A peak is where its mode is, within its bandwidth, and no other mode is nearer.
    near = critical.damping_ratio * critical.speed + 2.0 * (speed[1] - speed[0])
    own = [top for top in inner.tolist() if np.abs(speeds - speed[top]).min()
           == abs(critical.speed - speed[top]) <= near]
    if not own:
        return math.nan
    return _sharpness(speed, size, min(own, key=lambda top: abs(critical.speed - speed[top])))


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
