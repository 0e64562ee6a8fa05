"""What is one value of a feed? A number or a word, its unit, and how far it can be trusted."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import Enum
import math
from typing import NamedTuple

import numpy as np

from rotorsoil_ros.channel import Channel
from rotorsoil_ros.units import rad_s_to_rpm, to_lag_deg, to_um_pp


class Quality(Enum):
    """How far a value can be trusted: why not, and which words say so if nothing better does."""

    GOOD = ''
    STALE = 'the last one known: nothing new has come'
    # From here on there is no value at all.
    OUT_OF_TABLE = 'the speed is outside the table of the case'
    UNSTABLE = 'the case is unstable at this speed: there is no steady vibration'
    STANDING = 'the machine stands still'
    UNANSWERED = 'there is no answer for this speed'
    REJECTED = 'what the sensor sends cannot be used'
    NOT_MEASURED = 'nothing was measured'
    WAITING = 'nothing has come yet'
    SILENT = 'the node says nothing: it has stopped, or nothing reaches this feed'

    @property
    def is_bad(self) -> bool:
        """Whether there is no value."""
        return self not in (Quality.GOOD, Quality.STALE)


@dataclass(frozen=True, slots=True)
class Unit:
    """
    Unit of a number, as whoever reads a feed sees it.

    Attributes
    ----------
    symbol, says : str
        As in um p-p; in words.
    code : str
        Common code of UN/ECE Recommendation 20, by which OPC UA knows units; it tells no
        peak-to-peak from zero-to-peak, which only symbol and words do.
    convert : callable
        Turns SI into it.
    range : pair of float, or None
        Between which values always lie; None where nobody knows.

    """

    symbol: str
    says: str
    code: str
    convert: Callable[[float], float] = float
    range: tuple[float, float] | None = None


class Quantity(NamedTuple):
    """
    What is told of a place, or of a whole machine.

    `kind` is a key of the units, or empty for words; `is_measured` is true of what only a sensor
    can tell.
    """

    says: str
    kind: str = ''
    is_measured: bool = False
    is_of_housings: bool = False


# Of every channel; the names are public, and those of nodes and metrics.
OF_CHANNEL: Mapping[str, Quantity] = {
    'Amplitude': Quantity('predicted displacement', 'displacement'),
    'Phase': Quantity('predicted phase', 'phase'),
    'AmplitudeLow': Quantity('lower edge of the band of the prediction', 'displacement'),
    'AmplitudeHigh': Quantity('upper edge of the band of the prediction', 'displacement'),
    'Residual': Quantity('measured minus predicted, as vectors', 'displacement', True),
    'InsideBand': Quantity('share of the last points that lie in the band', 'share', True),
    'Verdict': Quantity('passes, fails or undecided, over the run so far', '', True),
    'VelocityRms': Quantity('predicted velocity of the housing', 'velocity', False, True),
    'MeasuredVelocityRms': Quantity('measured velocity of the housing', 'velocity', True, True),
    'AlarmVelocityRms': Quantity('from which velocity on there is an alarm', 'velocity', True,
                                 True),
    'TripVelocityRms': Quantity('from which velocity on to stop', 'velocity', True, True),
    'PredictedZone': Quantity('zone A, B, C or D of the prediction', '', True, True),
    'MeasuredZone': Quantity('zone A, B, C or D of the measurement', '', True, True),
    'Reason': Quantity('why something of this channel cannot be trusted; empty: it can'),
}
OF_MACHINE: Mapping[str, Quantity] = {
    'Speed': Quantity('speed of the rotor', 'speed'),
    'State': Quantity('OK, WARN, ERROR or STALE'),
    'Summary': Quantity('what the state rests on, in one sentence'),
    'VibrationState': Quantity('OK, WARN, ERROR or STALE of what is measured', '', True),
    'VibrationSummary': Quantity('what that rests on, in one sentence', '', True),
    'Verdict': Quantity('passes, fails or undecided, over the run so far', '', True),
}

_SI = {
    'displacement': Unit('m', 'metre, zero-to-peak', 'MTR'),
    'rotation': Unit('rad', 'radian, zero-to-peak', 'C81'),
    'phase': Unit('rad', 'radian of lead', 'C81', range=(-math.pi, math.pi)),
    'velocity': Unit('m/s', 'metre per second, root mean square', 'MTS'),
    'speed': Unit('rad/s', 'radian per second', '2A'),
    'share': Unit('1', 'one', 'C62', range=(0.0, 1.0)),
}
_PLANT = {
    'displacement': Unit('µm p-p', 'micrometre, peak-to-peak', '4H',
                         lambda value: float(to_um_pp(np.asarray(value)))),
    'rotation': Unit('µrad p-p', 'microradian, peak-to-peak', 'B97',
                     lambda value: float(to_um_pp(np.asarray(value)))),
    'phase': Unit('°', 'degree of lag', 'DD',
                  lambda value: float(to_lag_deg(np.asarray(value))), (0.0, 360.0)),
    'velocity': Unit('mm/s', 'millimetre per second, root mean square', 'C16',
                     lambda value: 1e3 * value),
    'speed': Unit('rpm', 'revolutions per minute', 'RPM', rad_s_to_rpm),
    'share': Unit('%', 'per cent', 'P1', lambda value: 100.0 * value, (0.0, 100.0)),
}


@dataclass(frozen=True, slots=True)
class Point:
    """
    One value of one quantity of one place of one machine.

    Attributes
    ----------
    machine, channel, quantity : str
        Whose; the channel is empty for the machine itself.
    value : float, str or None
        In its unit; None where there is none, which its quality says.
    unit : Unit or None
        None of words.
    quality : Quality
        How far it can be trusted.
    reason : str
        Why not, in words.
    stamp_ns : int
        Of the message that told it [ns].

    """

    machine: str
    channel: str
    quantity: str
    value: float | str | None
    unit: Unit | None
    quality: Quality
    reason: str
    stamp_ns: int

    @property
    def key(self) -> tuple[str, str]:
        """Where it stands within its machine."""
        return self.channel, self.quantity

    def says_the_same(self, other: 'Point | None') -> bool:
        """Whether another one says nothing else, at whatever time."""
        return other is not None and (self.value, self.quality, self.reason) == (
            other.value, other.quality, other.reason)


def unit_of(channel: str, quantity: str, *, plant: bool) -> Unit | None:
    """Return the unit of a quantity; none of words."""
    kind = (OF_CHANNEL if channel else OF_MACHINE)[quantity].kind
    if kind == 'displacement' and Channel.parse(channel).is_rotation:
        kind = 'rotation'
    return (_PLANT if plant else _SI)[kind] if kind else None


def quantities_of(channel: str) -> Mapping[str, Quantity]:
    """Return what is told of a channel, or of the machine, whose channel is empty."""
    if not channel:
        return OF_MACHINE
    housing = Channel.parse(channel).is_housing
    return {name: quantity for name, quantity in OF_CHANNEL.items()
            if housing or not quantity.is_of_housings}


def quantities_of_plant(channel: str) -> Mapping[str, Quantity]:
    """Return what is told of all machines of a plant together."""
    told = ('Amplitude', 'VelocityRms', 'Reason') if channel else ('State', 'Summary')
    return {name: quantity for name, quantity in quantities_of(channel).items() if name in told}
