"""What of a machine's vibration comes from the ground? Sensors beside it tell, turn by turn."""

from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
import math

import numpy as np

from rotorsoil_ros.arrays import ComplexArray, FloatArray
from rotorsoil_ros.channel import Channel
from rotorsoil_ros.compared import Compared, Weighed
from rotorsoil_ros.events import (
    Diagnostics,
    Event,
    Grounded,
    Level,
    Measured,
    NANOSECONDS,
    Samples,
)
from rotorsoil_ros.machine.response import Predictor
from rotorsoil_ros.machine.transmissibility import MovingGround
from rotorsoil_ros.monitor.beside.companions import Companion, Companions
from rotorsoil_ros.monitor.ground.account import GroundAccount, LATEST_VECTORS, MILLI
from rotorsoil_ros.monitor.ground.broadband import Spectra
from rotorsoil_ros.monitor.ground.sensor import SensorOnGround
from rotorsoil_ros.monitor.rules import Judging
from rotorsoil_ros.monitor.vectors.axes import in_si
from rotorsoil_ros.monitor.vectors.history import History
from rotorsoil_ros.monitor.vectors.pairing import MOST_UNMATCHED, Pairing, PATIENCE
from rotorsoil_ros.monitor.vectors.refusal import Refusal
from rotorsoil_ros.monitor.zones import Zones

GROUND_PART = 'ground'  # what its diagnostics are called

# Stamps of which it is remembered how the ground moved: a vector is weighed when its passage is
# over.
_MOST_KNOWN = 1 << 14

# Sensors that differ by more than this share of their mean do not tell of one motion, and a
# sensor that feels more of the machine than this share of all it feels tells little else.
DISAGREE, MOSTLY_OWN = 0.5, 0.7


class Attribution:
    """
    Tells what ground that moves does to a machine, and judges the machine without it.

    As the judge it looks at stamps alone. A motion of the ground is looked for over the very
    turns of every measured vector; of a machine without any over those about each full second.
    """

    def __init__(
        self, machine: str, moving: MovingGround, judging: Judging, history: History,
        zones: Zones,
    ) -> None:
        self._machine, self.moving, self._history = machine, moving, history
        self.sensors = {sensor.name: SensorOnGround(sensor, history, turns=judging.turns)
                        for sensor in judging.sensors.ground}
        self._of = {channel: (sensor.name, axis) for sensor in judging.sensors.ground
                    for axis, channel in enumerate(sensor.channels)}
        self._tolerance_ns = judging.rules.matching.tolerance * NANOSECONDS
        self._pairing = Pairing(history, tolerance_s=judging.rules.matching.tolerance)
        self._halves: dict[tuple[str, int], ComplexArray] = {}
        self._waiting: dict[int, list[float]] = {}
        self._weighed: deque[Weighed] = deque()
        self._known: dict[int, ComplexArray | None] = {}
        self._led_ns, self._second = -1, -1
        self._sensors, self._turns = judging.sensors, judging.turns
        self.spectra = Spectra(moving, tuple(self.sensors), history)
        self.account = GroundAccount(judging.rules, moving.table.channels, zones)
        self._strangers: set[str] = set()
        self._apart = deque[float](maxlen=LATEST_VECTORS)
        self._own: dict[str, deque[float]] = {}

    def stand_beside(self, others: Sequence[Companion]) -> None:
        """Tell what other machines do to the sensors from what the ground does."""
        companions = Companions(self._history, others, turns=self._turns)
        housings = [channel for channel in self.moving.table.channels if channel.is_housing]
        for sensor in self.sensors.values():
            sensor.companions, sensor.felt_most = companions, housings[0]
        self.spectra.companions = companions

    def take(self, name: str, samples: Samples) -> None:
        """Keep samples of a sensor, as its messages have them."""
        if (sensor := self.sensors.get(name)) is None:
            self._strangers |= {name}
            return
        samples = in_si(samples, sensor.sensor.pickup)
        sensor.take(samples)
        if (felt := sensor.along_axes(samples)) is not None:
            self.spectra.take_ground(name, samples.stamp_ns, felt)

    def take_housing(self, samples: Samples) -> None:
        """Take samples of the machine, in m/s^2, whose axes are its own."""
        pickup = self._sensors.of(samples.channel)
        if not (pickup.heading or pickup.has_orientation or pickup.comes_in_packets):
            self.spectra.take(samples.channel, samples.stamp_ns, samples.acceleration)

    def take_measured(self, measured: Measured) -> Measured | None:
        """Keep vectors of the sensors; return what is left for the machine."""
        own = [column for column, name in enumerate(measured.channels) if name in self._of]
        if not own:
            return measured
        self._pairing.take(_columns(measured, own))
        other = [column for column in range(len(measured.channels)) if column not in own]
        return _columns(measured, other) if other else None

    def see(self, event: Event) -> None:
        """Note which vectors of the machine there are, and what becomes of them."""
        if isinstance(event, Compared):
            self._led_ns = int(event.stamp_ns[-1])
            for stamp, speed in zip(event.stamp_ns.tolist(), event.speed.tolist(), strict=True):
                self._want(stamp, speed)
        elif isinstance(event, Weighed):
            self._weighed.append(event)

    def _want(self, stamp: int, speed: float) -> None:
        if speed > 0.0 and stamp not in self._known:
            self._waiting.setdefault(stamp, [speed, 0])

    def tick(
        self, now_ns: int, predictor: Predictor, *, stale_after_s: float, is_last: bool = False,
    ) -> Iterator[Event]:
        """Tell how the ground moved, as far as it has been heard, and what that did."""
        self._take_told()
        self._want_full_second()
        for stamp, speed in self._ready(is_last=is_last):
            yield from self._told(stamp, speed, predictor)
        while self._weighed and (is_last or not any(
                stamp in self._waiting for stamp in self._weighed[0].compared.stamp_ns.tolist())):
            self._judge(self._weighed.popleft())
        self.account.zones.close(math.inf if is_last else now_ns)
        self.spectra.follow(is_last=is_last)
        yield self._diagnostics(now_ns, stale_after_s)

    def _take_told(self) -> None:
        """Put what other systems have measured together, axis by axis."""
        self._pairing.tick()
        for vectors in self._pairing.ready(is_tick=True):
            found = np.array(vectors.displacement()) if vectors.speed > 0.0 else None
            if found is None:
                continue
            for column, channel in enumerate(vectors.channels):
                name, axis = self._of[channel]
                key = name, vectors.stamp_ns
                motion = self._halves.setdefault(key, np.full(3, complex(np.nan, np.nan)))
                motion[axis] = found[0, column] * np.exp(1j * found[1, column])
                if np.isfinite(motion).all():
                    self.sensors[name].take_vector(vectors.stamp_ns, self._halves.pop(key))
        while len(self._halves) > MOST_UNMATCHED:
            self._halves.pop(next(iter(self._halves)))

    def _want_full_second(self) -> None:
        """Look at the latest full second about which all is known and nothing was measured."""
        speed = self._history.last_speed
        heard = [one for one in self.sensors.values() if one.is_raw]
        if not heard or not speed > 0.0:
            return
        reach = heard[0].end_of(0, speed)
        last_ns = min(self._history.last_ns, *(one.last_ns for one in heard))
        second = (last_ns - reach) // NANOSECONDS
        begin_ns = max(one.first_ns for one in heard) + reach
        # Another one, not a later one: stamps may go back.
        begin_ns = max(begin_ns, self._led_ns + 2 * reach)
        if second != self._second and second * NANOSECONDS >= begin_ns:
            self._second, stamp = second, second * NANOSECONDS
            self._want(stamp, self._history.speed_near(stamp, tolerance_ns=NANOSECONDS))

    def _ready(self, *, is_last: bool) -> list[tuple[int, float]]:
        """Return stamps and speeds about which all sensors that speak have been heard."""
        found = []
        for stamp in sorted(self._waiting):
            speed, ticks = self._waiting[stamp]
            self._waiting[stamp][1] += 1
            if is_last or ticks >= PATIENCE or all(
                    sensor.last_ns >= sensor.end_of(stamp, speed)
                    for sensor in self.sensors.values() if sensor.last_ns >= 0):
                found.append((stamp, speed))
                del self._waiting[stamp]
        return found

    def _told(self, stamp: int, speed: float, predictor: Predictor) -> Iterator[Grounded]:
        """Tell how the ground moved over the turns about one stamp, if it is known."""
        # One by one: the same to the last bit, whatever is looked at with them.
        measured = np.array([[self._at(sensor, stamp, speed) for sensor in self.sensors.values()]])
        turning = np.array([speed])
        own = self.moving.own(turning, predictor.answer(turning).force)
        motion = self._mean(self.moving.free(turning, measured, own)[0])
        self._look_at(measured[0], own[0])
        self._known[stamp] = motion
        if len(self._known) > _MOST_KNOWN:
            self._known.pop(next(iter(self._known)))
        if motion is not None:
            yield Grounded(self._machine, np.array([stamp]), motion[None],
                           self.moving.parts(turning, motion[None]))

    def _at(self, sensor: SensorOnGround, stamp: int, speed: float) -> ComplexArray:
        """Return what a sensor has measured, (3,); NaN where that is not known."""
        found = sensor.vector(stamp, speed, tolerance_ns=self._tolerance_ns)
        return np.full(3, complex(np.nan, np.nan)) if isinstance(found, Refusal) else found

    def _mean(self, motion: ComplexArray) -> ComplexArray | None:
        """Return the mean (3,) over the sensors (s, 3) that tell something, if any does."""
        told = motion[np.isfinite(motion).all(axis=1)]
        if not len(told):
            return None
        mean = np.asarray(told.mean(axis=0))
        if len(told) > 1 and (size := float(np.linalg.norm(mean))):
            self._apart.append(float(np.linalg.norm(told - mean, axis=1).max()) / size)
        return mean

    def _look_at(self, measured: ComplexArray, own: ComplexArray) -> None:
        """Note how much of what each sensor feels the machine does itself."""
        for name, felt, part in zip(self.sensors, measured, own, strict=True):
            size = float(np.linalg.norm(felt))
            if size > 0.0 and np.isfinite(part).all():
                self._own.setdefault(name, deque(maxlen=LATEST_VECTORS)).append(
                    float(np.linalg.norm(part)) / size)

    @property
    def disagreement(self) -> float:
        """By which share of their mean the sensors differ, median of the latest; NaN of one."""
        return float(np.median(self._apart)) if self._apart else math.nan

    @property
    def own_share(self) -> dict[str, float]:
        """Share of the machine itself in what each sensor feels, median of the latest."""
        return {name: float(np.median(shares)) for name, shares in self._own.items()}

    def _judge(self, weighed: Weighed) -> None:
        compared = weighed.compared
        motion = np.array([one if (one := self._known.get(stamp)) is not None else np.full(
            3, complex(np.nan, np.nan)) for stamp in compared.stamp_ns.tolist()])
        if not np.isfinite(motion).any():
            return
        part = self.parts(compared.channels, compared.speed, motion)
        self.account.take(weighed, part)

    def parts(
        self, channels: Sequence[Channel], speed: FloatArray, motion: ComplexArray,
    ) -> Mapping[Channel, ComplexArray]:
        """Return what a motion (n, 3) of the ground does to channels, (n,) each [m, rad]."""
        found = self.moving.parts(speed, motion).displacement
        known = self.moving.table.channels
        return {channel: found[:, known.index(channel)] for channel in channels
                if channel in known}

    def doubts(self) -> Iterator[str]:
        """Yield what keeps the ground's part from being known, or from being trusted."""
        if self.moving.around is None:
            yield ('what the machine itself does to the ground is not known, and so is not what '
                   f'the ground does to it once per turn: {self.moving.unknown}')
        own_share = self.own_share
        for name, sensor in self.sensors.items():
            if sensor.last_ns < 0:
                yield f'{name}: nothing heard' + (
                    f'; heard was {", ".join(sorted(self._strangers))}, which is none of the case'
                    if self._strangers else '')
            elif why := sensor.refusals.prevailing():
                yield f'{name}: {why}'
            if own_share.get(name, 0.0) > MOSTLY_OWN:
                yield (f'{name}: {own_share[name]:.0%} of what it feels once per turn is the '
                       'machine itself: what is left is a difference of near numbers')
        if self.disagreement > DISAGREE:
            yield (f'the sensors differ by {self.disagreement:.0%} of their mean, which is taken: '
                   'they do not feel one motion')

    def _diagnostics(self, now_ns: int, stale_after_s: float) -> Diagnostics:
        silent = [f'{name}: silent' for name, sensor in self.sensors.items()
                  if 0 <= sensor.last_ns < now_ns - stale_after_s * NANOSECONDS]
        every = list(self.account.shares())
        doubts = [*silent, *self.doubts(), *(one.doubt for one in every if one.doubt)]
        most = max((one for one in every if one.channel.is_housing),
                   key=lambda one: one.part, default=None)
        said = '' if most is None else (
            f'{MILLI * most.part:.2f} mm/s rms of {most.channel} from the ground, '
            f'{most.share:.0%} of what is measured')
        values = self.account.values(every)
        for name, sensor in self.sensors.items():
            values |= {f'{name}_{key}': value for key, value in sensor.refusals.values().items()}
        values |= {f'{name}_own_share': share for name, share in self.own_share.items()}
        for one in self.spectra.latest():
            key = f'{one.channel}_{one.sensor}_broadband'
            values |= {f'{key}_ground_mm_s_rms': MILLI * one.ground,
                       f'{key}_coherent_mm_s_rms': MILLI * one.coherent,
                       f'{key}_coherence': one.coherence}
        if math.isfinite(self.disagreement):
            values['sensors_differ_by'] = self.disagreement
        return Diagnostics(
            self._machine, now_ns, Level.WARN if doubts else Level.OK,
            '; '.join(filter(None, [*doubts, said])) or 'no vector of the ground yet', values,
            GROUND_PART)


def _columns(measured: Measured, which: Sequence[int]) -> Measured:
    """Return what was measured of some channels."""
    return replace(measured, channels=tuple(measured.channels[column] for column in which),
                   displacement=measured.displacement[:, which],
                   velocity=measured.velocity[:, which])
