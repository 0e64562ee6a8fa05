"""What of the vibration of a housing comes with the ground, at all other frequencies."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
import math

import numpy as np
from scipy.interpolate import CubicSpline

from rotorsoil_ros.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from rotorsoil_ros.channel import Channel
from rotorsoil_ros.events import NANOSECONDS
from rotorsoil_ros.machine.transmissibility import MovingGround
from rotorsoil_ros.monitor.beside.companions import Companions
from rotorsoil_ros.monitor.vectors.history import History
from rotorsoil_ros.monitor.vectors.orders import SpeedTrack
from rotorsoil_ros.units import hz_to_rad_s, rad_s_to_hz, rpm_to_rad_s

# Samples are looked at by so many seconds, in segments that overlap by half.
STRETCH_S, _SEGMENT_S = 32, 4.0
_STRETCH_NS = STRETCH_S * NANOSECONDS

# Overall velocity is that from this frequency on, of machines slower than this from the other
# (ISO 20816-1) [Hz], [rad/s].
_LOWEST_HZ, _SLOW, _LOWEST_OF_SLOW_HZ = 10.0, rpm_to_rad_s(600.0), 2.0

# Up to this share of the slower rate samples are joined without a loss.
_OF_RATE = 0.25

# Lines of the rotor, and of other machines that are off their speed by some slip, are left out:
# so many bins to each side, and so much of the frequency.
_ORDERS, _BINS, _SLIP = 10, 2, 0.03

# A hole of more samples than this is no stretch, and neither is less than this share of one.
_LONGEST_HOLE, _LEAST = 4, 0.9

# Below this coherence it is not the ground; chance gives 0.1 to the average of one stretch.
LEAST_COHERENCE = 0.3


@dataclass(frozen=True, slots=True)
class Broadband:
    """
    What of a housing's vibration comes with the ground, the lines of rotors left out.

    Attributes
    ----------
    channel, sensor : Channel, str
        Of which housing, by which sensor.
    band : tuple of two floats
        Lowest and highest frequency [Hz].
    averages : int
        Over how many segments.
    measured, ground, coherent : float
        Velocity of the housing, what the motion of the ground makes of it by the model, and what
        is coherent with that [m/s rms].
    coherence : float
        Of both, mean over the ground's part [-].

    """

    channel: Channel
    sensor: str
    band: tuple[float, float]
    averages: int
    measured: float
    ground: float
    coherent: float
    coherence: float

    @property
    def said(self) -> str:
        """In words what the coherence says of the ground's part."""
        if self.coherence < LEAST_COHERENCE:
            return f'not the ground: coherence {self.coherence:.2f}'
        return f'coherence {self.coherence:.2f}'


class _Power:
    """Sums of the cross-spectral matrix of a housing and the ground: (bins, 4, 4)."""

    def __init__(self, rate: float, slower: float) -> None:
        self.rate, self.highest = rate, _OF_RATE * slower
        self.size = round(_SEGMENT_S * rate)
        self.frequency = np.asarray(np.fft.rfftfreq(self.size, 1.0 / rate), dtype=float)
        self.total = np.zeros((len(self.frequency), 4, 4), dtype=complex)
        self.number = np.zeros(len(self.frequency), dtype=int)

    def add(self, signals: FloatArray, lines: BoolArray) -> None:
        """Add a stretch, (4, n) [m/s^2]; where there are lines it says nothing."""
        # Half a second, for who hears the ground only.
        from scipy.signal import csd

        _, density = csd(signals[:, None], signals[None], self.rate, nperseg=self.size)
        self.total[~lines] += density.transpose(2, 0, 1)[~lines]
        self.number[~lines] += 1

    @property
    def averages(self) -> int:
        """Over how many segments of all stretches the best known bin is a mean."""
        return int(self.number.max()) * (round(2.0 * STRETCH_S / _SEGMENT_S) - 1)


class Spectra:
    """
    Holds samples of sensors on the ground against those of housings, stretch by stretch.

    Memory does not grow: of every stretch the spectra are added up and its samples go.
    """

    def __init__(self, moving: MovingGround, sensors: Sequence[str], history: History) -> None:
        self._moving, self._sensors, self._history = moving, tuple(sensors), history
        self._parts: dict[str, list[tuple[IntArray, FloatArray]]] = {}
        self._power: dict[tuple[str, Channel], _Power] = {}
        self._channels: dict[str, Channel] = {}
        self._lowest_hz = _LOWEST_HZ
        self._looked, self._rows = 0, list[Broadband]()
        self._begin_ns = 0
        # Who runs beside the machine, where it is known.
        self.companions: Companions | None = None

    def take_ground(self, sensor: str, stamp_ns: IntArray, felt: FloatArray) -> None:
        """Keep samples of a sensor, (n, 3) [m/s^2]."""
        self._begin_ns = self._begin_ns or int(stamp_ns[0])
        self._parts.setdefault(sensor, []).append((stamp_ns, felt))

    def take(self, channel: Channel, stamp_ns: IntArray, acceleration: FloatArray) -> None:
        """Keep samples of a housing, (n,) [m/s^2]."""
        if channel.is_housing and channel in self._moving.table.channels:
            self._channels[channel] = channel
            self._parts.setdefault(channel, []).append((stamp_ns, acceleration[:, None]))

    def follow(self, *, is_last: bool = False) -> None:
        """Look at the stretches that are complete."""
        heard = [sensor for sensor in self._sensors if self._parts.get(sensor)]
        if not heard or not self._channels:
            self._parts = {key: parts[-1:] for key, parts in self._parts.items()}
            return
        while self._parts:
            first = min(self._index(parts[0][0][0]) for parts in self._parts.values())
            ends = sorted(self._index(parts[-1][0][-1]) for parts in self._parts.values())
            # Who is a whole stretch behind all others is not waited for.
            if not (is_last or ends[0] > first or ends[-1] > first + 1):
                return
            self._look(first)
            if is_last and first >= ends[-1]:
                return

    def _index(self, stamp: int) -> int:
        """Return in which stretch a stamp lies, counted from the first sample of the ground."""
        return (int(stamp) - self._begin_ns) // _STRETCH_NS

    def _look(self, index: int) -> None:
        """Add a stretch to the sums, and let its samples go."""
        begin = self._begin_ns + index * _STRETCH_NS
        end = begin + _STRETCH_NS
        signals = {}
        for key, parts in list(self._parts.items()):
            stamps, values = (np.concatenate(part) for part in zip(*parts, strict=True))
            inside = stamps < end
            self._parts[key] = [(stamps[~inside], values[~inside])]
            if not len(stamps[~inside]):
                del self._parts[key]
            if (found := _even(stamps[inside] - begin, values[inside])) is not None:
                signals[key] = found
        speeds, others = self._speeds(begin, end), list(self._others(begin, end))
        for sensor in self._sensors if len(speeds) else ():
            for channel in self._channels.values():
                if sensor in signals and channel in signals:
                    self._add(sensor, channel, signals[sensor], signals[channel], speeds, others)

    def _speeds(self, begin: int, end: int) -> FloatArray:
        stamps, speed, _ = self._history.track()
        return speed[(stamps >= begin) & (stamps < end) & (speed > 0.0)]

    def _add(
        self, sensor: str, channel: Channel, ground: '_Signal', housing: '_Signal',
        speeds: FloatArray, others: Sequence[tuple[float, float]],
    ) -> None:
        rates = ground.rate, housing.rate
        power = self._power.setdefault((sensor, channel), _Power(max(rates), min(rates)))
        begin = max(ground.time[0], housing.time[0])
        end = min(ground.time[-1], housing.time[-1])
        time = begin + np.arange(math.floor((end - begin) * power.rate)) / power.rate
        if len(time) < power.size:
            return
        if speeds.max() < _SLOW:
            self._lowest_hz = _LOWEST_OF_SLOW_HZ
        power.add(np.concatenate([housing.at(time), ground.at(time)]),
                  _lines(power.frequency, speeds, others))

    def _others(self, begin: int, end: int) -> Iterator[tuple[float, float]]:
        """Yield between which speeds other machines ran, near the rated one if nobody tells."""
        told: list[tuple[float, SpeedTrack | None]] = [
            (speed, None) for speed in self._moving.others]
        if self.companions is not None:
            told = [(one.rated_speed, one.track(begin, end, begin))
                    for one in self.companions.others]
        for rated, track in told:
            if track is None:
                yield (1.0 - _SLIP) * rated, (1.0 + _SLIP) * rated
            else:
                yield float(track.speed.min()), float(track.speed.max())

    def latest(self) -> list[Broadband]:
        """Return what is known by now of every pair, looked at after each stretch."""
        if self._looked != (number := sum(one.averages for one in self._power.values())):
            self._looked, self._rows = number, list(self.rows())
        return self._rows

    def rows(self) -> Iterator[Broadband]:
        """Yield what is known by now of every pair."""
        channels = list(self._channels.values())
        if not self._power:
            return
        through = self._moving.through(channels)
        for (sensor, channel), power in self._power.items():
            yield from self._of(sensor, channel, power, through[
                :, self._sensors.index(sensor), channels.index(channel)])

    def _of(
        self, sensor: str, channel: Channel, power: _Power, through: ComplexArray,
    ) -> Iterator[Broadband]:
        known = np.isfinite(through).all(axis=1)
        omega, through = self._moving.table.omega[known], through[known]
        highest = min(rad_s_to_hz(float(omega.max(initial=0.0))), power.highest)
        chosen = ((power.number > 0) & (power.frequency >= self._lowest_hz)
                  & (power.frequency <= highest))
        if not chosen.any():
            return
        frequency = hz_to_rad_s(power.frequency[chosen])
        # Of velocity.
        weight = power.number[chosen] * frequency**2
        density = power.total[chosen] / weight[:, None, None]
        response = np.stack([np.interp(frequency, omega, one) for one in through.T], axis=1)
        of_ground = np.einsum('na,nab,nb->n', response.conj(), density[:, 1:, 1:], response).real
        both = np.einsum('na,na->n', density[:, 0, 1:], response)
        of_housing = density[:, 0, 0].real
        product = of_housing * of_ground
        # What does not move is coherent with nothing.
        coherence = np.divide(np.abs(both) ** 2, product, out=np.zeros(len(product)),
                              where=product > 0.0)
        measured, ground, coherent = (math.sqrt(float(power.frequency[1] * one.sum())) for one in (
            of_housing, of_ground, coherence * of_housing))
        yield Broadband(
            channel, sensor, (self._lowest_hz, highest), power.averages, measured, ground,
            coherent, float((coherence * of_ground).sum() / of_ground.sum())
            if of_ground.any() else 0.0)


def _lines(
    frequency: FloatArray, speeds: FloatArray, others: Sequence[tuple[float, float]],
) -> BoolArray:
    """Return in which bins [Hz] rotors that run between speeds [rad/s] have their lines."""
    own = float(speeds.min()), float(speeds.max())
    lines = np.zeros(len(frequency), dtype=bool)
    for slow, fast in (*((order * own[0], order * own[1]) for order in range(1, _ORDERS + 1)),
                       *others):
        lines |= ((frequency >= rad_s_to_hz(slow) - _BINS / _SEGMENT_S)
                  & (frequency <= rad_s_to_hz(fast) + _BINS / _SEGMENT_S))
    return lines


@dataclass(frozen=True, slots=True, eq=False)
class _Signal:
    """Samples (n, k) that were taken evenly: times (n,) [s], rate [1/s]."""

    time: FloatArray
    values: FloatArray
    rate: float

    def at(self, time: FloatArray) -> FloatArray:
        """Return what lies between the samples, (k, m)."""
        return np.asarray(CubicSpline(self.time, self.values)(time)).T


def _even(since_ns: IntArray, values: FloatArray) -> _Signal | None:
    """Return samples of a stretch; None where it has holes or hardly anything is there."""
    since, first = np.unique(since_ns, return_index=True)
    values = values[first]
    if len(since) < 2 or not np.isfinite(values).all():
        return None
    time = since / NANOSECONDS
    step = float(np.median(np.diff(time)))
    if np.diff(time).max() > _LONGEST_HOLE * step or time[-1] - time[0] < _LEAST * STRETCH_S:
        return None
    return _Signal(time, values, 1.0 / step)
