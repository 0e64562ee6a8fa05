"""What can feed a vibration: bearings, pedestals and the shaft, and how fast at most."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
import math

import numpy as np
import scipy.linalg

from rotorsoil_ros.arrays import ComplexArray, FloatArray
from rotorsoil_ros.machine.coupled import CoupledModel
from rotorsoil_ros.machine.modes.pencil import Pencil, Vibrations
from rotorsoil_ros.rotor.assembly import Rotor
from rotorsoil_ros.rotor.bearing import Bearing
from rotorsoil_ros.rotor.coefficients import Coefficients, FrequencyTable, SpeedTable, tables
from rotorsoil_ros.rotor.losses import WHIRL_DIRECTIONS
from rotorsoil_ros.rotor.whirl import held

# Cross terms that differ by less than this share of all coefficients are symmetric.
_ROUND_OFF = 1e-12

# The soil is passive: what seems to give more than this of all power is a slip of its fit.
_ARTEFACT = 1e-3

# What gives less than this share of all power gives nothing.
_NOTHING = 1e-9

# A torque, and the cross terms of a seal's mass, may feed modes of any frequency: they are looked
# for up to so many times the highest speed.
BOUNDLESS = 4.0

# A damping ratio below which what a torque takes is not missed: steel alone has more.
_FELT = 1e-3

# Of a torque that goes through, what both sides of a node have of it, relative to it.
_CANCELLED = 1e-9

# Share of the largest 1 / omega^2 below which a mode of the mesh has no mass.
_MASSLESS = 1e-13

# What may feed a vibration: coefficients of a bearing, then what the shaft does by itself.
CROSS, NEGATIVE_DAMPING, NEGATIVE_STIFFNESS, ADDED_MASS = (
    'cross-coupled stiffness', 'negative damping', 'negative stiffness', 'added mass')
_OF_SHAFT = 'internal damping', 'external damping', 'torque'
_OF_BEARING = CROSS, NEGATIVE_DAMPING, NEGATIVE_STIFFNESS, ADDED_MASS


@dataclass(frozen=True, slots=True)
class _Range:
    """Smallest and largest 2 x 2 coefficients over (x, z) between two points of a table."""

    least: FloatArray
    most: FloatArray

    @property
    def lowest_eigenvalue(self) -> float:
        """Lower bound of the eigenvalues of the symmetric part (Gershgorin)."""
        across = max(abs(self.least[0, 1] + self.least[1, 0]),
                     abs(self.most[0, 1] + self.most[1, 0]))
        return float(min(self.least[0, 0], self.least[1, 1]) - 0.5 * across)

    @property
    def skew(self) -> float:
        """Upper bound of half the difference of the cross terms."""
        size = max(float(np.abs(self.least).max()), float(np.abs(self.most).max()))
        skew = 0.5 * max(abs(self.most[0, 1] - self.least[1, 0]),
                         abs(self.least[0, 1] - self.most[1, 0]))
        return float(skew) if skew > _ROUND_OFF * size else 0.0


def highest_fed(model: CoupledModel, span: tuple[float, float]) -> float:
    """
    Return below which |lambda| any growing vibration lies, at speeds in a span [rad/s].

    Parameters
    ----------
    model : CoupledModel
        The machine.
    span : tuple of two floats
        Rotor speeds [rad/s].

    Returns
    -------
    float
        [rad/s]; 0 where nothing gives energy, so that no vibration can grow; infinite where a
        damper that takes nothing sets no bound.

    Notes
    -----
    The equations of motion times conj(lambda) v^H have the real part

        |l|^2 s m + |l|^2 c + s k + w q + (what the passive rest takes) = 0,   l = s + i w,

    with m, c, k the symmetric matrices in the shape v and q half the difference of the cross
    terms. With s > 0 a bearing can only balance it while |l| c < |q| + max(-k, 0).

    """
    highest = max(_of_shaft(rotor, span[1] if own is None else own)
                  for rotor, own in zip(model.rotors, model.own_speeds, strict=True))
    for fastest_speed, (stiffness, damping, inertia) in _of_everything(model, span):
        lowest = damping.lowest_eigenvalue
        gives = stiffness.skew + max(-stiffness.lowest_eigenvalue, 0.0)
        if _gives(inertia):
            highest = max(highest, BOUNDLESS * fastest_speed)
        if gives > 0.0 or lowest < 0.0:
            highest = max(highest, gives / lowest if lowest > 0.0 else math.inf)
    return highest


def _of_shaft(rotor: Rotor, fastest_speed: float) -> float:
    """Return below which |lambda| a growing vibration lies that the shaft feeds [rad/s]."""
    losses = rotor.losses
    if losses is None:
        return 0.0
    if _torque_feeds(rotor) > 0.0:
        return BOUNDLESS * fastest_speed
    # Material feeds a whirl that is slower than the rotor; it grows by its loss factor at most.
    return (1.0 + float(losses.is_hysteretic)) * fastest_speed * bool(
        losses.viscous.any() or losses.is_hysteretic)


def _gives(inertia: _Range) -> bool:
    return inertia.skew > 0.0 or inertia.lowest_eigenvalue < 0.0


def boundless(model: CoupledModel, span: tuple[float, float]) -> str:
    """Return what may feed a mode of any frequency; nothing where all of it is bounded."""
    if any(_torque_feeds(rotor) > _FELT for rotor in model.rotors):
        return 'the torque'
    heavy = any(_gives(inertia) for _, (_, _, inertia) in _of_everything(model, span))
    return 'the mass of a seal' if heavy else ''


def _torque_feeds(rotor: Rotor) -> float:
    """
    Return which damping ratio a torque takes from a mode at most.

    It gives by its symmetric part alone, at the slopes of its ends. Of a motion of unit strain
    energy these are what couples there bend.
    """
    losses = rotor.losses
    if losses is None or not losses.torsion.any():
        return 0.0
    giving = 0.5 * (losses.torsion + losses.torsion.T)
    rows = np.flatnonzero(np.abs(giving).max(axis=0) > _CANCELLED * np.abs(losses.torsion).max())
    stiffness, _, _ = held(rotor, rotor.nominal_springs)
    bent = scipy.linalg.cho_solve(scipy.linalg.cho_factor(stiffness),
                                  np.eye(len(stiffness))[:, rows])[rows]
    values = scipy.linalg.eigvals(bent @ giving[np.ix_(rows, rows)])
    return 0.5 * float(np.abs(values).max(initial=0.0))


def fastest(model: CoupledModel) -> float:
    """Return a frequency above all modes of the rotors' meshes [rad/s]."""
    found = 0.0
    for rotor in model.rotors:
        stiffness, mass, _ = held(rotor, rotor.nominal_springs)
        values = scipy.linalg.eigh(mass, stiffness, eigvals_only=True)
        found = max(found, 2.0 / math.sqrt(values[values > _MASSLESS * values[-1]].min()))
    return found


def _of_everything(
    model: CoupledModel, span: tuple[float, float],
) -> Iterator[tuple[float, tuple[_Range, _Range, _Range]]]:
    """Yield the highest speed and the coefficients of all that holds a shaft."""
    none = np.zeros((2, 2))
    for bearing, turns in model.all_bearings.between(span):
        points = np.sort(np.concatenate([np.array(turns), knots(bearing, turns)]))
        for left, right in pairwise(points.tolist()):
            stiffness, damping, inertia = (_between(matrix, left, right)
                                           for matrix in bearing.matrices)
            yield turns[1], (stiffness, damping, inertia)
        if bearing.pedestal is not None:
            stiffness, damping = (_Range(matrix, matrix) for matrix in (
                bearing.pedestal.stiffness, bearing.pedestal.damping))
            yield turns[1], (stiffness, damping, _Range(none, none))


def _between(matrix: Coefficients, left: float, right: float) -> _Range:
    if isinstance(matrix, FrequencyTable):
        # Straight between its frequencies.
        parts = [_between(part, left, right) for part in matrix.at]
        return _Range(np.min([part.least for part in parts], axis=0),
                      np.max([part.most for part in parts], axis=0))
    if not isinstance(matrix, SpeedTable):
        return _Range(matrix, matrix)
    # A monotone cubic stays between its points.
    both = matrix(np.clip(np.array([left, right]), matrix.speed[0], matrix.speed[-1]))
    return _Range(both.min(axis=0), both.max(axis=0))


def knots(bearing: Bearing, span: tuple[float, float]) -> FloatArray:
    """Return the speeds inside a span at which tables of a bearing have points [rad/s]."""
    own = [table.speed for matrix in bearing.matrices for table in tables(matrix)]
    speeds = np.unique(np.concatenate([np.zeros(0), *own]))
    return speeds[(speeds > span[0]) & (speeds < span[1])]


@dataclass(frozen=True, slots=True)
class Feed:
    """
    What one bearing, pedestal or the shaft gives to a vibration.

    Attributes
    ----------
    name : str
        Of the bearing, or `the pedestal of` it, or `the shaft` (`of` a machine among others).
    share : float
        Of all that is given [-].
    cause : str
        What of it gives: one of the words of this room.

    """

    name: str
    share: float
    cause: str


def feeds(pencil: Pencil, vibrations: Vibrations, index: int) -> tuple[Feed, ...]:
    """Return what gives energy to a vibration, most first; nothing if its soil seems to."""
    w = complex(vibrations.frequency[index])
    pencil = pencil.where(vibrations.speed, w)
    rotor, support, load = (pencil.part(vibrations, index, name)
                            for name in ('rotor', 'support', 'load'))
    gap = pencil.journals @ rotor - pencil.rows @ support
    model, shafts = pencil.model, pencil.solver.shafts
    blocks, asked = model.support.contacts, (vibrations.speed,) * 2
    terms: list[tuple[str, tuple[str, ...], FloatArray]] = [
        (bearing.name, _OF_BEARING, _taken(w, gap[pair], bearing, speed) / spring)
        for (bearing, (speed, _)), spring, pair in zip(
            model.all_bearings.between(asked), shafts.springs.tolist(), _pairs(0), strict=False)]
    deflection = support * pencil.size
    terms += [(f'the pedestal of {bearing.name}', _OF_BEARING, _passive(
        w, deflection[pair], bearing.pedestal.stiffness, bearing.pedestal.damping))
        for bearing, pair in zip((one for one in model.all_bearings.each
                                  if one.pedestal is not None), _pairs(blocks), strict=False)
        if bearing.pedestal is not None]
    for one, rows, name in zip(shafts.each, shafts.rows, model.machines, strict=True):
        if (losses := one.basis.losses) is not None:
            speed = np.array([vibrations.speed if one.speed is None else one.speed])
            own = [(motion.conj() * losses.exerted(
                way, motion[None], w=np.array([w]), speed=speed)[:, 0])
                for way, motion in zip(WHIRL_DIRECTIONS, rotor.reshape(2, -1)[:, rows],
                                       strict=True)]
            terms.append((f'the shaft of {name}' if name else 'the shaft', _OF_SHAFT,
                          (np.conj(1j * w) * np.sum(own, axis=(0, 2))).real))
    soil = float((np.conj(1j * w) * np.vdot(support[:blocks], load[:blocks])).real)
    total = sum(float(np.abs(taken).sum()) for _, _, taken in terms)
    if not total > 0.0 or soil < -_ARTEFACT * (total + abs(soil)):
        return ()
    given = [(name, -float(taken.sum()), causes[int(taken.argmin())])
             for name, causes, taken in terms if taken.sum() < -_NOTHING * total]
    whole = sum(power for _, power, _ in given)
    return tuple(Feed(name, power / whole, cause) for name, power, cause
                 in sorted(given, key=lambda one: -one[1]))


def _pairs(first: int) -> Iterator[slice]:
    place = first
    while True:
        yield slice(place, place + 2)
        place += 2


def _taken(w: complex, gap: ComplexArray, bearing: Bearing, speed: float) -> FloatArray:
    """Return what a bearing takes of a vibration exp(i w t) by each of its causes, (4,)."""
    omega = np.clip(np.array([w.real]), *bearing.frequency_range)
    stiffness, damping, inertia = (
        part[0] for part in bearing.coefficients(np.array([speed]), omega))
    # Of the force -w^2 M u.
    heavy = (np.conj(1j * w) * np.vdot(gap, -w**2 * inertia @ gap)).real
    return np.append(_passive(w, gap, stiffness, damping), heavy)


def _passive(
    w: complex, gap: ComplexArray, stiffness: FloatArray, damping: FloatArray,
) -> FloatArray:
    """Return what cross-coupling, damping and stiffness take of a vibration exp(i w t), (3,)."""
    skew = 0.5 * (stiffness - stiffness.T) / 1j
    return np.array([
        w.real * np.vdot(gap, skew @ gap).real,
        abs(w) ** 2 * np.vdot(gap, 0.5 * (damping + damping.T) @ gap).real,
        -w.imag * np.vdot(gap, 0.5 * (stiffness + stiffness.T) @ gap).real])
