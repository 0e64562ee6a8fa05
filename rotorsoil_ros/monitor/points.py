"""Measured and predicted vectors of one channel, point by point, and how far they lie apart."""

from collections import Counter, defaultdict
from collections.abc import Mapping
from dataclasses import dataclass
import math
from typing import Any

import numpy as np
import numpy.typing as npt

from rotorsoil_ros.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from rotorsoil_ros.channel import Channel
from rotorsoil_ros.compared import Reason, Weighed
from rotorsoil_ros.events import Event, Predicted
from rotorsoil_ros.monitor.inside import is_inside

_PER_CHANNEL = ('amplitude', 'phase', 'predicted', 'low', 'high', 'behind', 'ahead')


@dataclass(frozen=True, slots=True, eq=False)
class ChannelPoints:
    """
    One channel, measured beside predicted.

    Attributes
    ----------
    channel : Channel
        Its name.
    stamp_ns, speed : (n,) arrays
        Of the measurement, ascending [ns]; reported nearest to it, NaN where none is near
        [rad/s].
    amplitude : (n,) float array
        Measured, less runout where it is known [m, rad].
    phase : (n,) float array
        Measured [rad], NaN where it is not known.
    predicted : (n,) complex array
        NaN where there is no prediction.
    low, high : (n,) float array
        The band of its amplitude, NaN where there is none.
    behind, ahead : (n,) float array
        The band of its phase about that of the prediction [rad], likewise.
    reason : (n,) array of Reason
        Why a point is not used; USED where it is.

    """

    channel: Channel
    stamp_ns: IntArray
    speed: FloatArray
    amplitude: FloatArray
    phase: FloatArray
    predicted: ComplexArray
    low: FloatArray
    high: FloatArray
    behind: FloatArray
    ahead: FloatArray
    reason: npt.NDArray[Any]

    @property
    def used(self) -> BoolArray:
        """Which points are held against the machine."""
        return np.asarray(self.reason == Reason.USED)

    @property
    def measured(self) -> ComplexArray:
        """Measured vectors, NaN where there is no phase."""
        return np.asarray(self.amplitude * np.exp(1j * self.phase))

    @property
    def has_phase(self) -> bool:
        """Whether any point that is used has a phase."""
        chosen = self.used if self.used.any() else np.ones(len(self.phase), dtype=bool)
        return bool(np.isfinite(self.phase[chosen]).any())

    @property
    def excluded(self) -> dict[str, int]:
        """Number of points left out for each reason."""
        return dict(Counter(str(reason) for reason in self.reason if reason != Reason.USED))


class Collector:
    """A sink that keeps the speeds of a run and every point that was weighed."""

    def __init__(self) -> None:
        self._speeds: list[tuple[IntArray, FloatArray]] = []
        self._columns: dict[Channel, list[tuple[npt.NDArray[Any], ...]]] = defaultdict(list)

    def __call__(self, event: Event) -> None:
        """Keep what is told of speeds and points."""
        match event:
            case Predicted():
                self._speeds.append((event.stamp_ns, event.prediction.speed))
            case Weighed(compared=compared):
                for column, channel in enumerate(compared.channels):
                    self._columns[channel].append((
                        compared.stamp_ns, compared.speed,
                        *(getattr(compared, name)[:, column] for name in _PER_CHANNEL),
                        event.reason[:, column]))

    def speeds(self) -> tuple[IntArray, FloatArray]:
        """Return stamps, ascending [ns], and finite speeds [rad/s] of the run."""
        if not self._speeds:
            return np.array([], dtype=np.int64), np.array([])
        stamps, speed = (np.concatenate(part) for part in zip(*self._speeds, strict=True))
        given = np.isfinite(speed)
        stamps, first = np.unique(stamps[given], return_index=True)
        return stamps, speed[given][first]

    def points(self) -> list[ChannelPoints]:
        """Return the points of every channel."""
        return [_sorted(channel, parts) for channel, parts in self._columns.items()]


def _sorted(channel: Channel, parts: list[tuple[npt.NDArray[Any], ...]]) -> ChannelPoints:
    columns = [np.concatenate(part) for part in zip(*parts, strict=True)]
    order = np.argsort(columns[0], kind='stable')
    return ChannelPoints(channel, *(column[order] for column in columns))


@dataclass(frozen=True, slots=True)
class Statistics:
    """
    How far measured points that are used lie from their predictions; NaN where nothing tells.

    Attributes
    ----------
    bias, scatter : float
        Mean and standard deviation of measured less predicted amplitude [m, rad].
    ratio : float
        Median of measured over predicted amplitude [-].
    phase_bias, phase_scatter : float
        Mean and standard deviation of measured less predicted phase [rad].
    r_squared : float
        1 - |measured - predicted|^2 / |measured - its mean|^2: of the vectors where they have
        phases, else of the amplitudes.
    inside : float
        Share of the amplitudes inside the band, widened by a margin on either side.
    phase_inside : float
        Share of the phases inside the band, widened by the angle of which the margin is the
        sine.

    """

    bias: float
    scatter: float
    ratio: float
    phase_bias: float
    phase_scatter: float
    r_squared: float
    inside: float
    phase_inside: float


def statistics(
    points: ChannelPoints, *, margin: float, inside: Mapping[Channel, float],
) -> Statistics:
    """
    Return how the used points of a channel lie.

    Parameters
    ----------
    points : ChannelPoints
        The channel.
    margin : float
        Share by which the band is widened.
    inside : mapping of Channel to float
        By channel the share inside the band, as the judge has counted it.

    """
    used = points.used
    size, expected = points.amplitude[used], np.abs(points.predicted[used])
    if not len(size):
        return Statistics(*[math.nan] * 8)
    turn = np.exp(1j * (points.phase[used] - np.angle(points.predicted[used])))
    turn = turn[np.isfinite(turn)]
    mean_turn = turn.mean() if len(turn) else complex(np.nan, np.nan)
    moving = expected > 0.0
    return Statistics(
        bias=float(np.mean(size - expected)), scatter=float(np.std(size - expected)),
        ratio=float(np.median(size[moving] / expected[moving])) if moving.any() else math.nan,
        phase_bias=float(np.angle(mean_turn)) if len(turn) else math.nan,
        phase_scatter=(float(np.std(np.angle(turn * mean_turn.conjugate()))) if len(turn)
                       else math.nan),
        r_squared=_r_squared(points), inside=inside.get(points.channel, math.nan),
        phase_inside=_phase_inside(points, margin))


def _r_squared(points: ChannelPoints) -> float:
    used = points.used
    measured, predicted = points.measured[used], points.predicted[used]
    if not np.isfinite(measured).all():
        measured = points.amplitude[used].astype(complex)
        predicted = np.abs(predicted).astype(complex)
    spread = float(np.sum(np.abs(measured - measured.mean()) ** 2))
    left = float(np.sum(np.abs(measured - predicted) ** 2))
    return 1.0 - left / spread if spread > 0.0 else math.nan


def _phase_inside(points: ChannelPoints, margin: float) -> float:
    """Return the share of used phases inside their band, NaN where there is none."""
    told = points.used & np.isfinite(points.phase) & np.isfinite(points.behind)
    if not told.any():
        return math.nan
    turn = np.angle(np.exp(1j * (points.phase - np.angle(points.predicted))))[told]
    slack = math.asin(min(margin, 1.0))
    return float(np.mean(is_inside(turn, points.behind[told] - slack,
                                   points.ahead[told] + slack, margin=0.0)))
