"""Whether the speed changed slowly enough for a steady-state prediction to hold."""

from collections.abc import Sequence
from dataclasses import dataclass
import math

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from rotorsoil_ros.arrays import BoolArray, FloatArray

# From p = 1.5 on the peak of a passage is within 4 % of the steady one (theory manual).
SLOW_ENOUGH = 1.5

# Before the resonance, in units of the square root of the rate: nearer, the response lags.
_APPROACH = 3.0

# Afterwards the free vibration decays as exp(-p tau) while the forced one falls as 1 / tau:
# at tau = 5 / p it is down to a twentieth of it.
DECAY = 5.0

# Up to where behind the resonance a passage moves the peak, without damping, in units of the
# square root of the rate: Lewis' limit.
LARGEST_SHIFT = 2.16

# Samples over which a slope is fitted: speeds out of single turns scatter.
SLOPE_SAMPLES = 15


@dataclass(frozen=True, slots=True)
class Resonance:
    """A critical speed [rad/s] and the damping ratio of its mode."""

    speed: float
    damping_ratio: float


def passage_number(resonance: Resonance, rate: float) -> float:
    """
    Return p = zeta omega_n / sqrt(rate): the bandwidth against the rate of speed [rad/s^2].

    References
    ----------
    Lewis (1932), Trans. ASME 54, for p = 0; the envelope A' = -p A + exp(i tau^2 / 2) / 2.

    """
    if rate == 0.0:
        return math.inf
    return resonance.damping_ratio * resonance.speed / math.sqrt(abs(rate))


def speed_rate(time: FloatArray, speed: FloatArray) -> FloatArray:
    """Return the rate of speed [rad/s^2] at each sample, a slope fitted over its neighbours."""
    rates = np.zeros_like(speed)
    half = SLOPE_SAMPLES // 2
    inner = np.arange(half, max(half, len(time) - half))
    if len(inner):
        since = sliding_window_view(time, SLOPE_SAMPLES)
        since = since - since.mean(axis=1, keepdims=True)
        spread = np.sum(since**2, axis=1)
        slope = np.sum(since * sliding_window_view(speed, SLOPE_SAMPLES), axis=1)
        np.divide(slope, spread, out=rates[inner[0]:inner[-1] + 1], where=spread > 0.0)
    for index in np.setdiff1d(np.arange(len(time)), inner):
        near = slice(max(0, index - half), index + half + 1)
        since = time[near] - time[near].mean()
        spread = since @ since
        if spread > 0.0:
            rates[index] = since @ speed[near] / spread
    return rates


def is_quasi_static(
    time: FloatArray, speed: FloatArray, resonances: Sequence[Resonance],
) -> BoolArray:
    """
    Tell which samples of a run a steady-state prediction may be held against.

    Parameters
    ----------
    time : (n,) float array
        Ascending [s].
    speed : (n,) float array
        Rotor speed [rad/s].
    resonances : sequence of Resonance
        Critical speeds of the machine.

    Returns
    -------
    (n,) bool array
        False while a resonance is passed with p < 1.5, and after it until its free vibration
        has died away.

    """
    holds = np.ones(len(time), dtype=bool)
    if len(time) < 2:
        return holds
    rate = speed_rate(time, speed)
    root = np.sqrt(np.abs(rate))
    moving = root > 0.0
    for resonance in resonances:
        bandwidth = resonance.damping_ratio * resonance.speed
        passage = np.full(len(time), np.inf)
        passage[moving] = bandwidth / root[moving]
        beyond = np.zeros(len(time))
        beyond[moving] = ((speed - resonance.speed) * np.sign(rate))[moving] / root[moving]
        reach = np.maximum(_APPROACH, DECAY / np.maximum(passage, np.finfo(float).tiny))
        holds &= ~((passage < SLOW_ENOUGH) & (beyond > -_APPROACH) & (beyond < reach))
    return holds
