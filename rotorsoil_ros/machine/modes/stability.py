"""At which speeds does a vibration of the machine grow on its own, which, and what feeds it."""

from collections.abc import Iterator
from dataclasses import asdict, dataclass
from itertools import pairwise
import json
import math

import numpy as np
from scipy.optimize import linear_sum_assignment

from rotorsoil_ros.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from rotorsoil_ros.errors import NotSolvedError, solved
from rotorsoil_ros.machine.coupled import CoupledModel
from rotorsoil_ros.machine.modes import feeding
from rotorsoil_ros.machine.modes.feeding import CAUSES, Feed, feeds, knots
from rotorsoil_ros.machine.modes.names import ModeNames
from rotorsoil_ros.machine.modes.pencil import Pencil, Vibrations
from rotorsoil_ros.units import rad_s_to_rpm

# A vibration grows if it gains more than this share of |lambda|: less is round-off.
_ROUND_OFF = 1e-9

# What does not swing, |Re w| below this share of |w|, creeps away rather than whirls.
_CREEPING = 0.2

# Speeds at which the search begins, and up to how many it looks closer.
_FIRST_SPEEDS = 17
_MOST_SPEEDS = 1000

# Of the range: nearer speeds are one. A threshold is found to the second share of itself.
_SAME_SPEED = 1e-7
_FOUND = 1e-12
_STEPS = 60

# Places in an interval at which the curve through its ends is looked at.
_ALONG = np.linspace(0.0, 1.0, 17)

# Vibrations of one frequency may feed each other if they are damped less than this.
_LIGHT = 0.1

# A single crossing of zero is clear if the slopes at its ends miss no more of it than this share.
_CROSSING = 0.25

# Modes are looked for this far above what could grow at most: the bound itself is then inside.
_ABOVE = 1.2


@dataclass(frozen=True, slots=True)
class Instability:
    """
    One mode that grows over a range of speeds.

    Attributes
    ----------
    name : str
        What an engineer calls it.
    low, high : float
        Rotor speeds between which it grows [rad/s]: thresholds, or the ends of what was looked at.
    speed, frequency, damping_ratio : float
        Where it grows most: rotor speed, damped frequency [rad/s], and -Re lambda / |lambda|.
    whirl : int
        +1 forward, -1 backward, 0 where it does not whirl but creeps away.
    feeds : tuple of Feed
        What gives it energy there, most first.

    """

    name: str
    low: float
    high: float
    speed: float
    frequency: float
    damping_ratio: float
    whirl: int
    feeds: tuple[Feed, ...]


@dataclass(frozen=True, slots=True)
class Stability:
    """
    Every mode that grows on its own, over a range of speeds.

    Attributes
    ----------
    span : tuple of two floats
        Rotor speeds that were looked at, tables of bearings clip them [rad/s].
    instabilities : tuple of Instability
        Rising with the lowest speed of each; empty where the machine is stable.
    highest : float
        Frequency up to which a mode could grow and was looked for [rad/s]; 0 where nothing gives
        energy, so that none can.
    untold_above : float
        Frequency above which a mode could grow but the support is not known [rad/s]; infinite
        where everything is known.
    doubt : str
        Why nothing is known; empty if it is.

    """

    span: tuple[float, float]
    instabilities: tuple[Instability, ...]
    highest: float
    untold_above: float = math.inf
    doubt: str = ''

    def to_json(self) -> str:
        """Return everything as one line of text."""
        return json.dumps(asdict(self))

    @classmethod
    def from_json(cls, text: str) -> 'Stability':
        """Rebuild what `to_json` wrote."""
        entries = json.loads(text)
        entries['span'] = tuple(entries['span'])
        entries['instabilities'] = tuple(
            Instability(**{**one, 'feeds': tuple(Feed(**feed) for feed in one['feeds'])})
            for one in entries['instabilities'])
        return cls(**entries)

    def holds(self, speed: FloatArray) -> BoolArray:
        """Return at which speeds, (n,) [rad/s], no mode is known to grow."""
        stable = np.ones(np.shape(speed), dtype=bool)
        for one in self.instabilities:
            stable &= ~((speed >= one.low) & (speed <= one.high))
        return stable

    @property
    def unstable(self) -> FloatArray:
        """Ranges of speed in which a mode grows, joined and rising, (u, 2) [rad/s]."""
        joined: list[list[float]] = []
        for one in sorted(self.instabilities, key=lambda one: one.low):
            if joined and one.low <= joined[-1][1]:
                joined[-1][1] = max(joined[-1][1], one.high)
            else:
                joined.append([one.low, one.high])
        return np.array(joined).reshape(-1, 2)


def stability(model: CoupledModel, span: tuple[float, float]) -> Stability:
    """
    Find every mode that grows on its own, at rest and at any speed of a range.

    Parameters
    ----------
    model : CoupledModel
        The machine.
    span : tuple of two floats
        Lowest and highest rotor speed [rad/s]; what tables of bearings do not hold is left out.

    Returns
    -------
    Stability
        With thresholds that are roots of the decay of a mode, not points of a grid.

    Raises
    ------
    NotSolvedError
        If modes cannot be followed.

    Notes
    -----
    A machine whose bearings and pedestals take energy in every motion cannot have such a mode, and
    nothing is solved. Otherwise all eigenvalues below the largest frequency that could be fed are
    found at speeds between which a cubic through their values and slopes predicts the decay of
    each; where that prediction, less what it misses, would leave the sign open, it is halved.
    Speeds at which two light modes have one frequency are looked at by themselves, as they may
    feed each other there only.

    """
    low, high = model.within_tables(span)
    bound = feeding.highest_fed(model, (low, high))
    if bound == 0.0:
        return Stability((low, high), (), 0.0)
    # Nothing vibrates faster than the mesh: a damper that takes nothing sets no other bound.
    wanted = min(_ABOVE * bound, feeding.fastest(model))
    with solved('stability of this machine'):
        pencil = Pencil.up_to(model, wanted)
        samples = _followed(pencil, _first(model, (low, high)))
        found = list(_instabilities(pencil, samples))
    known = pencil.solver.span[1]
    return Stability((low, high), tuple(sorted(found, key=lambda one: (one.low, one.frequency))),
                     min(wanted, known), known if known < wanted / _ABOVE else math.inf)


def _first(model: CoupledModel, span: tuple[float, float]) -> FloatArray:
    """Return speeds to begin with: between neighbours every coefficient is smooth."""
    speeds = [np.linspace(*span, _FIRST_SPEEDS)]
    speeds += [knots(bearing, span) for bearing in model.rotor.bearings]
    return np.unique(np.concatenate(speeds))


def _followed(pencil: Pencil, speed: FloatArray) -> list[Vibrations]:
    """Return vibrations at speeds that are close enough to follow the decay of each."""
    samples = _kept(pencil, speed)
    shortest = _SAME_SPEED * (speed[-1] - speed[0])
    checked: dict[tuple[float, float], FloatArray] = {}
    while True:
        closer = [place for left, right in pairwise(samples)
                  for place in _once(checked, left, right, shortest)]
        if not closer:
            return samples
        if len(samples) + len(closer) > _MOST_SPEEDS:
            raise NotSolvedError('stability could not be followed between '
                                 f'{rad_s_to_rpm(min(closer)):g} and '
                                 f'{rad_s_to_rpm(max(closer)):g} rpm')
        samples = sorted(samples + _kept(pencil, np.unique(closer)), key=lambda one: one.speed)


def _once(
    checked: dict[tuple[float, float], FloatArray], left: Vibrations, right: Vibrations,
    shortest: float,
) -> FloatArray:
    """Return where to look closer between two speeds, which is decided once."""
    ends = left.speed, right.speed
    if ends not in checked:
        checked[ends] = _closer(left, right, shortest)
    return checked[ends]


def _kept(pencil: Pencil, speed: FloatArray) -> list[Vibrations]:
    """Return vibrations without their mirror images and what lies far above all others."""
    kept = []
    for found in pencil.at(speed):
        size = np.abs(found.frequency)
        wanted = (found.frequency.real > -_CREEPING * size) & (size < 2.0 * pencil.solver.span[1])
        kept.append(Vibrations(found.speed, found.frequency[wanted], found.slope[wanted],
                               found.vector[wanted]))
    return kept


def _closer(left: Vibrations, right: Vibrations, shortest: float) -> FloatArray:
    """Return speeds inside an interval that have to be looked at, none if all is clear."""
    wide = right.speed - left.speed
    if wide < 2.0 * shortest:
        return np.zeros(0)
    one, other = _pairs(left, right)
    alone = (np.setdiff1d(np.flatnonzero(_grows(left)), one).size
             + np.setdiff1d(np.flatnonzero(_grows(right)), other).size)
    if alone or not _is_clear(left, right, one, other).all():
        return np.array([left.speed + 0.5 * wide])
    return _meetings(left, right, one, other, shortest)


def _grows(found: Vibrations) -> BoolArray:
    return np.asarray(found.frequency.imag < -_ROUND_OFF * np.abs(found.frequency))


def _pairs(left: Vibrations, right: Vibrations) -> tuple[IntArray, IntArray]:
    """Return which vibrations at two speeds continue each other: alike in the middle."""
    half = 0.5 * (right.speed - left.speed)
    ahead, back = left.frequency + half * left.slope, right.frequency - half * right.slope
    gap = np.abs(ahead[:, None] - back) / (np.abs(ahead)[:, None] + np.abs(back))
    one, other = linear_sum_assignment(gap)
    return np.asarray(one), np.asarray(other)


def _curves(
    left: Vibrations, right: Vibrations, one: IntArray, other: IntArray,
) -> ComplexArray:
    """Return the frequencies between two speeds as cubics, (pairs, places)."""
    wide, t = right.speed - left.speed, _ALONG
    weights = np.array([(1 + 2 * t) * (1 - t) ** 2, t * (1 - t) ** 2 * wide,
                        t**2 * (3 - 2 * t), t**2 * (t - 1) * wide])
    ends = np.stack([left.frequency[one], left.slope[one], right.frequency[other],
                     right.slope[other]], axis=1)
    return np.asarray(ends @ weights)


def _is_clear(
    left: Vibrations, right: Vibrations, one: IntArray, other: IntArray,
) -> BoolArray:
    """Return of which pairs the sign of the decay is sure between the ends."""
    decay = _curves(left, right, one, other).imag
    first, last = left.frequency[one], right.frequency[other]
    # What a straight line with the mean slope misses is far more than what a cubic misses.
    missed = np.abs((last - first).imag - 0.5 * (right.speed - left.speed)
                    * (left.slope[one] + right.slope[other]).imag)
    floor = _ROUND_OFF * np.minimum(np.abs(first), np.abs(last))
    sure = ((decay.min(axis=1) - missed > -floor) | (decay.max(axis=1) + missed < floor))
    turns = np.diff(decay, axis=1)
    crosses = (first.imag < -floor) != (last.imag < -floor)
    once = crosses & (np.all(turns > 0.0, axis=1) | np.all(turns < 0.0, axis=1))
    return np.asarray(sure | (once & (missed < _CROSSING * np.abs(last.imag - first.imag))))


def _meetings(
    left: Vibrations, right: Vibrations, one: IntArray, other: IntArray, shortest: float,
) -> FloatArray:
    """Return speeds at which two light vibrations have one frequency and may feed each other."""
    curves = _curves(left, right, one, other)
    light = np.flatnonzero((np.abs(curves.imag) < _LIGHT * np.abs(curves)).any(axis=1))
    wide, places = right.speed - left.speed, set()
    for index, mode in enumerate(light):
        gap = curves[light[index + 1:]].real - curves[mode].real
        row, step = np.nonzero(np.sign(gap[:, :-1]) * np.sign(gap[:, 1:]) < 0.0)
        before, after = gap[row, step], gap[row, step + 1]
        share = (step + before / (before - after)) / (len(_ALONG) - 1)
        # What they gain from each other falls below their decay this far beside the meeting.
        near = np.maximum(np.abs(curves[mode].imag).max(),
                          np.abs(curves[light[index + 1:]][row].imag).max(axis=1, initial=0.0))
        reach = np.maximum(near / np.maximum(np.abs(after - before) * (len(_ALONG) - 1),
                                             np.finfo(float).tiny) * 0.25, shortest / wide)
        places |= set(share[(share > reach) & (share < 1.0 - reach)].tolist())
    return left.speed + wide * np.array(sorted(places))


def _instabilities(pencil: Pencil, samples: list[Vibrations]) -> Iterator[Instability]:
    """Join growing vibrations across the speeds, and yield one entry for each of them."""
    is_open = {int(mode): _Growth(samples[0].speed, [(samples[0], int(mode))])
               for mode in np.flatnonzero(_grows(samples[0]))}
    for left, right in pairwise(samples):
        one, other = (side.tolist() for side in _pairs(left, right))
        before, after = _grows(left), _grows(right)
        still: dict[int, _Growth] = {}
        for i, j in zip(one, other, strict=True):
            if after[j]:
                growth = is_open.pop(i) if before[i] else _Growth(
                    _threshold(pencil, (left, i), (right, j)), [])
                growth.seen.append((right, j))
                still[j] = growth
            elif before[i]:
                growth = is_open.pop(i)
                yield from growth.told(pencil, _threshold(pencil, (left, i), (right, j)))
        for growth in is_open.values():  # without a continuation
            yield from growth.told(pencil, right.speed)
        for j in np.setdiff1d(np.flatnonzero(after), list(still)).tolist():
            still[j] = _Growth(left.speed, [(right, j)])
        is_open = still
    for growth in is_open.values():
        yield from growth.told(pencil, samples[-1].speed)


@dataclass(slots=True)
class _Growth:
    """A vibration that grows from a speed on [rad/s], and where it was seen."""

    low: float
    seen: list[tuple[Vibrations, int]]

    def told(self, pencil: Pencil, high: float) -> Iterator[Instability]:
        """Yield what it is, unless it is an artefact of the soil's fit."""
        found, mode = min(self.seen, key=lambda one: _damping(*one))
        given = feeds(pencil, found, mode)
        if not given:
            return
        w = complex(found.frequency[mode])
        rotor = pencil.part(found, mode, 'rotor')
        moving = np.abs(rotor) ** 2 * np.tile(pencil.solver.basis.mass, 2)
        forward, backward = moving.reshape(2, -1).sum(axis=1)
        whirl = 0 if abs(w.real) < _CREEPING * abs(w) else 1 if forward >= backward else -1
        name = _name(pencil, found, mode)
        if whirl > 0 and _is_fed_by_films(pencil, given):
            name = f'fluid-film whirl, {name}'
        yield Instability(name, self.low, high, found.speed, abs(w.real),
                          _damping(found, mode), whirl, given)


def _is_fed_by_films(pencil: Pencil, given: tuple[Feed, ...]) -> bool:
    """Return whether most of what is given comes from the cross-coupling of fluid films."""
    films = {bearing.name for bearing in pencil.model.rotor.bearings if bearing.is_film}
    return sum(feed.share for feed in given
               if feed.name in films and feed.cause == CAUSES[0]) > 0.5


def _name(pencil: Pencil, found: Vibrations, mode: int) -> str:
    rotor, support = (pencil.part(found, mode, name) for name in ('rotor', 'support'))
    frequency = float(np.clip(np.abs(found.frequency[mode].real), *pencil.solver.span))
    return ModeNames(pencil.model).of(
        pencil.solver.deflection(rotor.reshape(2, -1)), support * pencil.compliance.size,
        frequency=frequency, speed=found.speed)


def _damping(found: Vibrations, mode: int) -> float:
    return float(found.frequency[mode].imag / np.abs(found.frequency[mode]))


def _threshold(
    pencil: Pencil, left: tuple[Vibrations, int], right: tuple[Vibrations, int],
) -> float:
    """Return where the decay of a vibration is zero, by the false position (Illinois)."""
    ends = [left[0].speed, right[0].speed]
    decay = [float(found.frequency[mode].imag) for found, mode in (left, right)]
    curve = _curves(left[0], right[0], np.array([left[1]]), np.array([right[1]]))[0]
    places = np.linspace(ends[0], ends[1], len(_ALONG))
    last = -1
    for _ in range(_STEPS):
        speed = (ends[0] * decay[1] - ends[1] * decay[0]) / (decay[1] - decay[0])
        near = np.interp(speed, places, curve.real) + 1j * np.interp(speed, places, curve.imag)
        (found,) = _kept(pencil, np.array([speed]))
        mode = int(np.abs(found.frequency - near).argmin())
        height = float(found.frequency[mode].imag)
        if abs(height) <= _FOUND * abs(found.frequency[mode]) or ends[1] - ends[0] <= (
                _FOUND * ends[1]):
            break
        side = 0 if (height > 0.0) == (decay[0] > 0.0) else 1
        if side == last:
            decay[1 - side] *= 0.5
        ends[side], decay[side], last = speed, height, side
    return speed
