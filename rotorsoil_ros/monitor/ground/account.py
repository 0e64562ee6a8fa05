"""What part of measured vibration comes from the ground, and what is left without it."""

from collections import deque
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
import math

import numpy as np

from rotorsoil_ros.arrays import ComplexArray, FloatArray
from rotorsoil_ros.channel import Channel
from rotorsoil_ros.compared import Weighed
from rotorsoil_ros.monitor.rules import Rules
from rotorsoil_ros.monitor.zones import Zones

# Vectors of which a machine that runs tells: of the last minute or so.
LATEST_VECTORS = 128

MICRO, MILLI = 1e6, 1e3

# A part above this share of what is measured should leave less than this of the residual.
_WORTH, _LEFT = 0.1, 0.7


@dataclass(frozen=True, slots=True)
class GroundShare:
    """
    What the ground has done to a channel once per turn, over some vectors; NaN without any.

    Attributes
    ----------
    channel : Channel
        Where.
    vectors : int
        Of how many.
    part : float
        Velocity by the ground [m/s rms, rad/s rms].
    share : float
        That over the measured velocity [-].
    residual, residual_less : float
        Measured less predicted vector, and less the ground's part too, root mean square of the
        amplitude [m, rad].
    scatter, scatter_less : float
        Their scatter about their mean [m, rad].

    """

    channel: Channel
    vectors: int
    part: float
    share: float
    residual: float
    residual_less: float
    scatter: float
    scatter_less: float

    @classmethod
    def of(
        cls, channel: Channel, speed: FloatArray, measured: ComplexArray,
        predicted: ComplexArray, part: ComplexArray,
    ) -> 'GroundShare':
        """Return what n vectors say [rad/s], [m, rad]; those of which one is unknown do not."""
        known = np.isfinite(measured) & np.isfinite(predicted) & np.isfinite(part)
        speed, measured, part = speed[known], measured[known], part[known]
        left = measured - predicted[known]
        if not len(left):
            return cls(channel, 0, *[math.nan] * 6)
        moved, by_ground = _rms(speed * measured), _rms(speed * part)
        return cls(channel, len(left), by_ground / math.sqrt(2.0),
                   by_ground / moved if moved else math.nan, _rms(left), _rms(left - part),
                   float(np.std(left)), float(np.std(left - part)))


    @property
    def doubt(self) -> str:
        """Why a part that is worth telling is hardly the ground's; empty where it may be."""
        if not (self.share > _WORTH and self.residual_less > _LEFT * self.residual):
            return ''
        left = self.residual_less / self.residual
        return (f'{self.channel}: without the part of the ground {left:.0%} of the residual are '
                'left: once per turn it is hardly the ground, or the machine is not as unbalanced '
                'as its case says, and does more to the sensors than was taken off')


def _rms(values: ComplexArray) -> float:
    return float(np.sqrt(np.mean(np.abs(values) ** 2)))


class GroundAccount:
    """Latest vectors of every channel, and its zone without what comes from the ground."""

    def __init__(self, rules: Rules, channels: Sequence[Channel], measured: Zones) -> None:
        self.zones, self._measured = Zones(rules.zones, channels), measured
        self._latest: dict[Channel, deque[tuple[float, complex, complex, complex]]] = {}

    def take(self, weighed: Weighed, parts: Mapping[Channel, ComplexArray]) -> None:
        """Take n vectors with the part of the ground in each channel, (n,) [m, rad]."""
        compared = weighed.compared
        measured = compared.amplitude * np.exp(1j * compared.phase)
        nothing = np.full(len(compared.stamp_ns), complex(np.nan, np.nan))
        part = np.stack([parts.get(channel, nothing) for channel in compared.channels], axis=1)
        less = measured - part
        self.zones.natural = self._measured.natural
        self.zones.machines = self._measured.machines
        self.zones.take(replace(weighed, compared=replace(
            compared, amplitude=np.abs(less), phase=np.angle(less))))
        for column, channel in enumerate(compared.channels):
            rows = zip(compared.speed.tolist(), *(one[:, column].tolist() for one in (
                measured, compared.predicted, part)), strict=True)
            self._latest.setdefault(channel, deque(maxlen=LATEST_VECTORS)).extend(
                row for row in rows if np.isfinite(row).all())

    def shares(self) -> Iterator[GroundShare]:
        """Yield what the latest vectors of each channel say."""
        for channel, rows in self._latest.items():
            if rows:
                speed, *vectors = (np.array(part) for part in zip(*rows, strict=True))
                yield GroundShare.of(channel, speed, *vectors)

    def values(self, shares: Iterable[GroundShare]) -> dict[str, float | str]:
        """Return shares by keys that say their unit, and zones without the ground."""
        found: dict[str, float | str] = {}
        for share in shares:
            name, unit = share.channel, f'u{share.channel.unit}'
            found |= {f'{name}_ground_{MILLI_UNITS[share.channel.unit]}': MILLI * share.part,
                      f'{name}_ground_share': share.share,
                      f'{name}_residual_{unit}': MICRO * share.residual,
                      f'{name}_residual_without_ground_{unit}': MICRO * share.residual_less}
        for channel, state in self.zones.measured.items():
            found[f'{channel}_without_ground_mm_s_rms'] = MILLI * state.velocity
            found[f'{channel}_zone_without_ground'] = state.zone or ''
        return found


# What a velocity in thousandths is called in a key.
MILLI_UNITS = {'m': 'mm_s_rms', 'rad': 'mrad_s_rms'}
