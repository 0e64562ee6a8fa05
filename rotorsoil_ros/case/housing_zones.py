"""In which zone a housing vibrates, by the model's class of its support."""

from dataclasses import dataclass
import math

import numpy as np

from rotorsoil_ros.case.expectation import Expectation
from rotorsoil_ros.physics.arrays import BoolArray, FloatArray
from rotorsoil_ros.physics.comparison import ChannelPoints, nearest, Reference
from rotorsoil_ros.physics.quasistatic import speed_rate
from rotorsoil_ros.physics.zones import support_class, SupportClass, Zone, zone, ZoneLimits

# What is in the name of a channel of a housing.
HOUSING = '_housing_'

# Slower than this share of itself per second a speed counts as constant [1/s].
STEADY = 0.005


@dataclass(frozen=True, slots=True)
class HousingZone:
    """Worst zone of a housing: what, where [rad/s], how fast [m/s rms], by which limits."""

    channel: str
    source: str
    speed: float
    velocity: float
    zone: Zone
    support: SupportClass
    limits: tuple[float, float, float]
    is_steady: bool


def housing_zones(
    channel: ChannelPoints, reference: Reference, expectation: Expectation, *,
    limits: ZoneLimits, tolerance: float,
) -> list[HousingZone]:
    """
    Return the worst zone predicted and measured, at constant speed if there was any.

    Parameters
    ----------
    channel : ChannelPoints
        Of a housing.
    reference : Reference
        The run.
    expectation : Expectation
        The case; it tells the class of the support.
    limits : ZoneLimits
        Boundaries [m/s].
    tolerance : float
        Of stamps that belong together [s].

    """
    index = nearest(channel.stamp_ns, reference.stamp_ns, tolerance=tolerance)
    rate = speed_rate(reference.time, reference.speed)[index]
    steady = np.isfinite(channel.speed) & (np.abs(rate) <= STEADY * np.abs(channel.speed))
    natural = expectation.lowest_natural_speed(channel.channel[-1])
    found = [_worst(channel, source, amplitude, steady, natural=natural, limits=limits)
             for source, amplitude in (('predicted', np.abs(channel.predicted)),
                                       ('measured', channel.amplitude))]
    return [entry for entry in found if entry is not None]


def _worst(
    channel: ChannelPoints, source: str, amplitude: FloatArray, steady: BoolArray, *,
    natural: float, limits: ZoneLimits,
) -> HousingZone | None:
    velocity = np.abs(channel.speed) * amplitude / math.sqrt(2.0)
    chosen = np.isfinite(velocity)
    if (chosen & steady).any():
        chosen &= steady
    if not chosen.any():
        return None
    candidates = []
    flexible = np.array([support_class(natural, speed) == 'flexible'
                         for speed in channel.speed.tolist()])
    for support, of_class in (('rigid', ~flexible), ('flexible', flexible)):
        if (mine := chosen & of_class).any():
            at = int(np.where(mine, velocity, -1.0).argmax())
            kind: SupportClass = 'rigid' if support == 'rigid' else 'flexible'
            bounds, value = limits.of(kind), float(velocity[at])
            candidates.append(HousingZone(
                channel.channel, source, float(channel.speed[at]), value, zone(value, bounds),
                kind, bounds, bool(steady[at])))
    return max(candidates, key=lambda entry: entry.velocity / entry.limits[2])
