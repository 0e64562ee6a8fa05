"""What is to be said of the machines beside one: counted value by value, told in sentences."""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
import math

import numpy as np

from rotorsoil_ros.arrays import BoolArray, FloatArray
from rotorsoil_ros.channel import Channel
from rotorsoil_ros.events import Level, Remark
from rotorsoil_ros.monitor.beside.companions import Companion
from rotorsoil_ros.units import rad_s_to_hz, rad_s_to_rpm, to_um_pp

# Where another machine may have moved a value by more than this share of it, the value is not
# that of its own machine.
MIXED_SHARE = 0.2

# Speeds that differ by less are the same: they beat with a quarter of an hour [rad/s].
_SAME = 0.006


@dataclass
class _Tally:
    """How much of one machine was in the vectors of another; speeds in rad/s, amplitudes in m."""

    values: int = 0
    widened: int = 0
    unknown: int = 0
    closest: float = math.inf
    at: Counter[str] = field(default_factory=Counter)
    most: float = 0.0
    where: str = ''
    speed: float = math.nan
    is_in: bool = False
    was_in: bool = False


class HeardBeside:
    """Counts of each machine beside another how often it was in what was measured of that one."""

    def __init__(self, companions: Sequence[Companion]) -> None:
        self._companions = tuple(companions)
        self._tallies = [_Tally() for _ in companions]
        self._values = Counter[str]()

    def note(
        self, channels: Sequence[Channel], own: FloatArray, speed: FloatArray,
        slack: FloatArray, is_mixed: BoolArray, amplitude: FloatArray,
    ) -> None:
        """
        Take in n vectors over c channels.

        Parameters
        ----------
        channels : sequence of Channel
            Where.
        own, speed : (n,), (n, m) float arrays
            Speeds of the machine and of those beside it [rad/s], NaN where not known.
        slack : (n, c, m) float array
            By how much each of them may have moved an amplitude, were it as predicted [m, rad].
        is_mixed : (n, c, m) bool array
            Whether it was not told apart.
        amplitude : (n, c) float array
            What was measured [m, rad].

        """
        given = np.isfinite(amplitude)
        self._values.update({str(channel): int(number) for channel, number in zip(
            channels, np.count_nonzero(given, axis=0), strict=True)})
        moves = given & np.array([not channel.is_rotation for channel in channels])
        for number, tally in enumerate(self._tallies):
            most, told = slack[:, :, number], speed[:, number]
            is_wide = given & is_mixed[:, :, number]
            tally.at.update({str(channel): int(number) for channel, number in zip(
                channels, np.count_nonzero(is_wide, axis=0), strict=True)})
            tally.values += int(np.count_nonzero(given))
            tally.widened += int(np.count_nonzero(is_wide))
            tally.unknown += int(np.count_nonzero(given & np.isnan(told)[:, None]))
            tally.is_in |= bool(is_wide.any())
            tally.speed = float(told[-1])
            tally.closest = min(tally.closest, float(np.fmin.reduce(
                np.abs(told - own), initial=math.inf)))
            size = np.where(moves & is_wide & np.isfinite(most), most, 0.0)
            row, column = divmod(int(size.argmax()), len(channels))
            if size[row, column] > tally.most:
                tally.most, tally.where = float(size[row, column]), channels[column]

    def mixed_at(self, channel: str) -> list[str]:
        """Return the machines whose part was not told apart in most values of a channel."""
        return [one.name for one, tally in zip(self._companions, self._tallies, strict=True)
                if 2 * tally.at[channel] > self._values[channel]]

    def lines(self) -> Iterator[str]:
        """Yield what a reader of a run should know."""
        for one, tally in zip(self._companions, self._tallies, strict=True):
            if one.history is None:
                yield (f'{one.name}: nobody tells its speed: taken to run at '
                       f'{rad_s_to_rpm(one.rated_speed):.4g} rpm')
            elif one.driver:
                yield f'{one.name}: turns {one.times:g} times as fast as {one.driver}'
            if tally.unknown:
                yield (f'{one.name}: its speed is not known beside {tally.unknown} of '
                       f'{tally.values} values: their totals are a lower bound')
            if tally.widened:
                yield (f'{one.name} {_near(one, tally.closest)}: {tally.widened} of '
                       f'{tally.values} values hold its part, which could not be told apart, '
                       f'predicted up to {_um(tally.most)} at {tally.where}: they are left out, '
                       'or held against a band that is wider by it and against nothing else')

    def news(self, machine: str, now_ns: int) -> Iterator[Remark]:
        """Yield a remark for every machine that came into the vectors or is told apart again."""
        for one, tally in zip(self._companions, self._tallies, strict=True):
            if tally.is_in != tally.was_in:
                yield Remark(machine, now_ns, Level.OK, (
                    f'{one.name} {_near(one, tally.closest)}: its part is in what is measured '
                    'and not told apart') if tally.is_in else f'{one.name} is told apart')
            tally.was_in, tally.is_in = tally.is_in, False

    def values(self) -> Iterator[tuple[str, float | str]]:
        """Yield what is known of each machine now."""
        for one, tally in zip(self._companions, self._tallies, strict=True):
            yield f'{one.name}_speed_rpm', rad_s_to_rpm(tally.speed)
            yield f'{one.name}_is', ('taken at its rated speed' if one.history is None else
                                     'not heard' if math.isnan(tally.speed) else
                                     'not told apart' if tally.was_in else 'told apart')


def _near(one: Companion, apart: float) -> str:
    """Return how near another machine came by its speed [rad/s], in words."""
    ran = 'ran' if one.history is not None else 'would have run'
    return f'{ran} at the same speed' if apart < _SAME else (
        f'{ran} as near as {rad_s_to_hz(apart):.3g} Hz')


def _um(amplitude: float) -> str:
    return f'{float(to_um_pp(np.array(amplitude))):.3g} um p-p'
