"""At which speeds does a vibration of the machine grow on its own, which, and what feeds it."""

from collections.abc import Iterator
from dataclasses import asdict, dataclass
from itertools import pairwise
import json
import math

import numpy as np

from rotorsoil_ros.arrays import BoolArray, FloatArray
from rotorsoil_ros.errors import solved
from rotorsoil_ros.machine.coupled import CoupledModel
from rotorsoil_ros.machine.modes import feeding
from rotorsoil_ros.machine.modes.eigen import CREEPING
from rotorsoil_ros.machine.modes.feeding import CROSS, Feed, feeds
from rotorsoil_ros.machine.modes.following import (
    ALONG_CURVE,
    between,
    continued,
    first_speeds,
    followed,
    grows,
    vibrations_at,
)
from rotorsoil_ros.machine.modes.names import ModeNames
from rotorsoil_ros.machine.modes.pencil import Pencil, Vibrations

# A threshold is found to this share of itself, or as well as so many steps do.
_FOUND = 1e-12
_STEPS = 60

# Modes are looked for this far above what could grow at most: the bound itself is then inside.
_ABOVE = 1.2

# Why nothing is known below: bearings, or the support.
_BELOW = 'tables of bearings begin there', 'the file of the support begins there'


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
    untold_above, untold_below : float
        Frequencies above and below which a mode could grow but is not known [rad/s]; infinite and
        zero where everything is known.
    untold_why : str
        Why not above.
    why_below : str
        Why not below.
    doubt : str
        Why nothing is known; empty if it is.

    """

    span: tuple[float, float]
    instabilities: tuple[Instability, ...]
    highest: float
    untold_above: float = math.inf
    doubt: str = ''
    untold_below: float = 0.0
    untold_why: str = ''
    why_below: str = ''

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
    low, high = model.bearings.within_tables(span, following=False)
    bound = feeding.highest_fed(model, (low, high))
    if bound == 0.0:
        return Stability((low, high), (), 0.0)
    # Nothing vibrates faster than the mesh: a damper that takes nothing sets no other bound.
    wanted = min(_ABOVE * bound, feeding.fastest(model))
    with solved('stability of this machine'):
        pencil = Pencil.up_to(model, wanted)
        samples = followed(pencil, first_speeds(model, (low, high)))
        found = list(_instabilities(pencil, samples))
    above, why = _untold(model, pencil, (low, high), bound, wanted)
    return Stability((low, high), tuple(sorted(found, key=lambda one: (one.low, one.frequency))),
                     min(wanted, pencil.solver.span[1]), above, untold_why=why,
                     untold_below=max(model.bearings.frequency_range[0], model.support.reach[0]),
                     why_below=_BELOW[model.support.reach[0] > model.bearings.frequency_range[0]])


def _untold(
    model: CoupledModel, pencil: Pencil, span: tuple[float, float], bound: float, wanted: float,
) -> tuple[float, str]:
    """Return above which frequency a mode may grow unseen [rad/s], and why."""
    known = pencil.solver.span[1]
    if known < wanted / _ABOVE:
        return known, ('tables of bearings end there'
                       if known == model.bearings.frequency_range[1] else
                       'the support is not known there, and a bearing could feed one')
    feed = feeding.boundless(model, span)
    if feed and wanted == _ABOVE * bound:
        return known, f'{feed} could feed one, and none was looked for'
    return math.inf, ''


def _instabilities(pencil: Pencil, samples: list[Vibrations]) -> Iterator[Instability]:
    """Join growing vibrations across the speeds, and yield one entry for each of them."""
    is_open = {int(mode): _Growth(samples[0].speed, [(samples[0], int(mode))])
               for mode in np.flatnonzero(grows(samples[0]))}
    for left, right in pairwise(samples):
        one, other = (side.tolist() for side in continued(left, right))
        before, after = grows(left), grows(right)
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
        moving = np.abs(rotor) ** 2 * np.tile(pencil.solver.shafts.mass, 2)
        forward, backward = moving.reshape(2, -1).sum(axis=1)
        whirl = 0 if abs(w.real) < CREEPING * abs(w) else 1 if forward >= backward else -1
        is_of_films = whirl > 0 and _is_fed_by_films(pencil, given)
        name = _name(pencil, found, mode, 'fluid-film whirl, ' if is_of_films else '')
        yield Instability(name, self.low, high, found.speed, abs(w.real),
                          _damping(found, mode), whirl, given)


def _is_fed_by_films(pencil: Pencil, given: tuple[Feed, ...]) -> bool:
    """Return whether most of what is given comes from the cross-coupling of fluid films."""
    films = {bearing.name for bearing in pencil.model.all_bearings.each if bearing.is_film}
    return sum(feed.share for feed in given
               if feed.name in films and feed.cause == CROSS) > 0.5


def _name(pencil: Pencil, found: Vibrations, mode: int, how: str) -> str:
    pencil = pencil.where(found.speed, complex(found.frequency[mode]))
    rotor, support = (pencil.part(found, mode, name) for name in ('rotor', 'support'))
    frequency = float(np.clip(np.abs(found.frequency[mode].real), *pencil.solver.span))
    deflections = [deflection for deflection, _ in pencil.solver.shafts.bent(
        rotor.reshape(2, -1))]
    return ModeNames(pencil.model).of(
        deflections, support * pencil.size, frequency=frequency, speed=found.speed, how=how)


def _damping(found: Vibrations, mode: int) -> float:
    return float(found.frequency[mode].imag / np.abs(found.frequency[mode]))


def _threshold(
    pencil: Pencil, left: tuple[Vibrations, int], right: tuple[Vibrations, int],
) -> float:
    """Return where the decay of a vibration is zero, by the false position (Illinois)."""
    ends = [left[0].speed, right[0].speed]
    decay = [float(found.frequency[mode].imag) for found, mode in (left, right)]
    curve = between(left[0], right[0], np.array([left[1]]), np.array([right[1]]))[0]
    places = np.linspace(ends[0], ends[1], len(ALONG_CURVE))
    last = -1
    for _ in range(_STEPS):
        speed = (ends[0] * decay[1] - ends[1] * decay[0]) / (decay[1] - decay[0])
        near = np.interp(speed, places, curve.real) + 1j * np.interp(speed, places, curve.imag)
        (found,) = vibrations_at(pencil, np.array([speed]))
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
