"""What became of a machine, minute by minute? Few numbers in place of every prediction."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
import math
from typing import Any

import numpy as np
import numpy.typing as npt

from rotorsoil_ros.arrays import BoolArray, FloatArray, IntArray
from rotorsoil_ros.channel import Channel
from rotorsoil_ros.errors import RotorSoilError
from rotorsoil_ros.events import Event, NANOSECONDS, Predicted
from rotorsoil_ros.machine.modes.stability import Stability
from rotorsoil_ros.monitor.comparison import Comparison
from rotorsoil_ros.monitor.identification.case import identify_case, Wanted
from rotorsoil_ros.monitor.identification.used import UsedVectors
from rotorsoil_ros.monitor.identification.words import widening
from rotorsoil_ros.monitor.inside import is_inside
from rotorsoil_ros.monitor.points import ChannelPoints
from rotorsoil_ros.monitor.zones import HousingZone
from rotorsoil_ros.units import SECONDS_PER_MINUTE

MINUTE_NS = int(SECONDS_PER_MINUTE) * NANOSECONDS
GROUND = 'soil.shear_modulus'

# At one speed a softer ground and another unbalance look alike: only a minute in which the speed
# moves by this share tells of the ground.
_TELLING = 0.2


@dataclass(frozen=True, slots=True)
class Minute:
    """
    One channel of a machine in one minute; NaN and '' where nothing tells.

    Attributes
    ----------
    machine : str
        Name of the machine.
    minute_ns : int
        When it begins, since 1970 [ns].
    channel, unit : str
        Where, and the unit of what follows without another.
    speeds : int
        How many speeds were answered.
    speed_rad_s, predicted : float
        Their mean, and that of the predicted amplitudes, zero-to-peak.
    vectors, used : int
        How many vectors were measured, and held against their prediction.
    residual_re, residual_im, residual_rms : float
        Mean and root of the mean square of measured minus predicted vectors.
    inside : float
        Share of amplitudes inside the band, widened as the judge does [-].
    zone_predicted, zone_measured : str
        Worst second.
    ground_factor, ground_factor_error : float
        Effective shear modulus over that of the case, and its standard error within the
        tolerances of the case [-].
    unstable : int
        How many speeds have no answer, as the machine is unstable at them.

    """

    machine: str
    minute_ns: int
    channel: str
    unit: str
    speeds: int = 0
    speed_rad_s: float = math.nan
    predicted: float = math.nan
    vectors: int = 0
    used: int = 0
    residual_re: float = math.nan
    residual_im: float = math.nan
    residual_rms: float = math.nan
    inside: float = math.nan
    zone_predicted: str = ''
    zone_measured: str = ''
    ground_factor: float = math.nan
    ground_factor_error: float = math.nan
    unstable: int = 0


COLUMNS = tuple(field.name for field in fields(Minute))


class Minutes:
    """
    A sink that keeps of a run what is told minute by minute.

    Sums are taken over the whole of a minute in the order of its messages, so that they are the
    same to the last bit however the messages come: one by one or in thousands.
    """

    def __init__(
        self, machine: str, channels: Sequence[Channel], stability: Stability,
    ) -> None:
        self.machine = machine
        self._stability = stability
        self._channels = tuple(channels)
        self._open: list[tuple[FloatArray, FloatArray]] = []
        self._minute = 0
        self._answered: dict[int, list[tuple[int, float, FloatArray, int]]] = {}
        self._zones: dict[tuple[int, Channel, str], str] = {}

    def __call__(self, event: Event) -> None:
        """Take in answers."""
        if not isinstance(event, Predicted):
            return
        speed, size = event.prediction.speed, np.abs(event.prediction.displacement)
        minutes = event.stamp_ns // MINUTE_NS
        edges = np.flatnonzero(np.diff(minutes)) + 1
        for start, end in zip([0, *edges], [*edges, len(minutes)], strict=True):
            if (minute := int(minutes[start])) != self._minute:
                self._close()
                self._minute = minute
            self._open.append((speed[start:end], size[start:end]))

    def take_zone(self, second: int, found: HousingZone) -> None:
        """Take in the zone of a housing in a second of the run."""
        place = second * NANOSECONDS // MINUTE_NS, found.channel, found.source
        self._zones[place] = max(self._zones.get(place, ''), found.zone)

    def _close(self) -> None:
        """Sum up the minute that is open."""
        if not self._open:
            return
        speed, size = (np.concatenate(part) for part in zip(*self._open, strict=True))
        self._open = []
        answered = np.isfinite(size).any(axis=1)
        self._answered.setdefault(self._minute, []).append((
            int(np.count_nonzero(answered)), float(speed[answered].sum()),
            size[answered].sum(axis=0), int(np.count_nonzero(~self._stability.holds(speed)))))

    def rows(
        self, points: Sequence[ChannelPoints] = (), *, margin: float = 0.0,
        ground: Mapping[int, tuple[float, float]] | None = None,
    ) -> list[Minute]:
        """
        Return the minutes of every channel, by time and then by channel.

        Parameters
        ----------
        points : sequence of ChannelPoints
            What was measured.
        margin : float
            Share by which the band is widened.
        ground : mapping of int to (float, float)
            By minute the effective shear modulus over that of the case, and its error.

        """
        self._close()
        measured = dict(_measured(points, margin))
        told = sorted({*self._answered, *(minute for minute, _ in measured)})
        return [row for minute in told
                for row in self._of(minute, measured, (ground or {}).get(minute))]

    def _of(
        self, minute: int, measured: Mapping[tuple[int, Channel], Mapping[str, Any]],
        ground: tuple[float, float] | None,
    ) -> Iterator[Minute]:
        parts = self._answered.get(minute, [])
        number = sum(count for count, _, _, _ in parts)
        speed = sum(total for _, total, _, _ in parts)
        size = np.sum([total for _, _, total, _ in parts], axis=0)
        unstable = sum(lost for _, _, _, lost in parts)
        factor, error = ground or (math.nan, math.nan)
        for column, channel in enumerate(self._channels):
            row = Minute(
                self.machine, minute * MINUTE_NS, channel.name, channel.unit, number,
                zone_predicted=self._zones.get((minute, channel, 'predicted'), ''),
                zone_measured=self._zones.get((minute, channel, 'measured'), ''),
                ground_factor=factor, ground_factor_error=error, unstable=unstable,
                **measured.get((minute, channel), {}))
            yield replace(row, speed_rad_s=speed / number,
                          predicted=float(size[column]) / number) if number else row


def _measured(
    points: Sequence[ChannelPoints], margin: float,
) -> Iterator[tuple[tuple[int, Channel], dict[str, Any]]]:
    """Yield what is told of the vectors of each minute and channel."""
    for channel in points:
        minutes = channel.stamp_ns // MINUTE_NS
        inside = is_inside(channel.amplitude, channel.low, channel.high, margin=margin)
        residual = channel.measured - channel.predicted
        for minute in np.unique(minutes).tolist():
            rows = minutes == minute
            used = rows & channel.used
            yield (minute, channel.channel), {
                'vectors': int(np.count_nonzero(rows)), 'used': int(np.count_nonzero(used)),
                'inside': _mean(inside[used & np.isfinite(channel.low)]),
                **_left(residual[used])}


def _left(residual: npt.NDArray[np.complexfloating[Any, Any]]) -> dict[str, float]:
    """Return mean and root mean square of residual vectors, those with a phase."""
    given = residual[np.isfinite(residual)]
    return {'residual_re': _mean(given.real), 'residual_im': _mean(given.imag),
            'residual_rms': math.sqrt(_mean(given.real**2 + given.imag**2))}


def _mean(values: FloatArray | BoolArray) -> float:
    return float(values.mean()) if len(values) else math.nan


def ground_by_minute(comparison: Comparison) -> dict[int, tuple[float, float]]:
    """
    Return the effective shear modulus over that of the case, and its error, where it is told.

    A minute tells of the ground where its speed moves enough and the fit does not refuse: see
    `identify_case`. What is told is what holds within the tolerances of the case.
    """
    minutes = np.unique(np.concatenate(
        [points.stamp_ns[points.used] // MINUTE_NS for points in comparison.points]
        or [np.zeros(0, dtype=np.int64)]))
    found = ((minute, _ground(comparison, minute)) for minute in minutes.tolist())
    return {minute: ground for minute, ground in found if ground is not None}


def _ground(comparison: Comparison, minute: int) -> tuple[float, float] | None:
    wanted = Wanted(scalars=(GROUND,))
    rows = [_within(points, points.stamp_ns // MINUTE_NS == minute)
            for points in comparison.points]
    try:
        speed = UsedVectors.of(replace(comparison, points=rows),
                               with_transients=wanted.with_transients).speed
        if np.ptp(speed) < _TELLING * speed.max():
            return None
        found = identify_case(replace(comparison, points=rows), wanted)
    except RotorSoilError:  # the case has no such soil, or the minute cannot tell
        return None
    if found.slip:
        return None
    factor = math.exp(found.tolerant.state.logs[0])
    return factor, factor * widening(found.tolerant) * float(found.tolerant.log_width[0])


def _within(points: ChannelPoints, rows: BoolArray | IntArray) -> ChannelPoints:
    """Return some of the points of a channel."""
    return ChannelPoints(points.channel, *(
        getattr(points, field.name)[rows] for field in fields(points)[1:]))
