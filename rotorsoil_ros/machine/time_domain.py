"""
How would the machine shake while its speed changes? Integrated in time, not over frequencies.

An independent route to the same machine, for signals whose truth is known: shapes of the
rotor, blocks and soil in one system of equations of motion, stepped through a whole run.
"""

from dataclasses import dataclass

import numpy as np
import scipy.linalg

from rotorsoil_ros.arrays import ComplexArray, FloatArray
from rotorsoil_ros.channel import across, Channel, HOUSING
from rotorsoil_ros.errors import RotorSoilError
from rotorsoil_ros.machine.coupled import CoupledModel
from rotorsoil_ros.rotor.assembly import Rotor
from rotorsoil_ros.rotor.coefficients import values

# Modes of the shaft with its journals held, in each plane.
_MODES = 12

# Steps during which speed-dependent matrices stand still.
_FROZEN = 20

# Newmark's constant average acceleration: stable for any step, no damping of its own.
_BETA, _GAMMA = 0.25, 0.5


@dataclass(frozen=True, slots=True, eq=False)
class Shaking:
    """
    Motion over time.

    Attributes
    ----------
    time : (n,) float array
        [s].
    speed, angle : (n,) float arrays
        Of the rotor [rad/s], [rad].
    channels : tuple of Channel
        Housings.
    acceleration : (n, c) float array
        [m/s^2].

    """

    time: FloatArray
    speed: FloatArray
    angle: FloatArray
    channels: tuple[Channel, ...]
    acceleration: FloatArray


def shake(
    model: CoupledModel, time: FloatArray, speed: FloatArray, *, moment: FloatArray,
    phase: FloatArray, ground: FloatArray | None = None,
) -> Shaking:
    """
    Integrate the machine through a run, from rest.

    Parameters
    ----------
    model : CoupledModel
        The machine; bearings stand on blocks or on firm ground, without pedestals.
    time : (n,) float array
        Evenly spaced [s].
    speed : (n,) float array
        Of the rotor [rad/s].
    moment : (n, p) float array
        Unbalance of every disc over time [kg m].
    phase : (p,) float array
        Of every disc [rad].
    ground : (n, 3) float array or None
        Acceleration of the ground along x, y, z where nothing stands on it [m/s^2].

    Notes
    -----
    Ground that moves carries everything along: relative to it all that has mass feels -m a.
    Soil acts as spring and dashpot with the compliance at the momentary speed: exact for what
    turns with the rotor, a good stand-in for free vibration near it (theory manual, passage).
    Newmark's error is (omega dt)^2 / 12 of a frequency.

    """
    if any(bearing.pedestal is not None for bearing in model.rotor.bearings) or model.couples:
        raise RotorSoilError('integration in time knows no pedestals and no couples')
    if model.rotor.losses is not None or len(model.bearings.frequencies) or any(
            np.any(values(bearing.inertia)) for bearing in model.rotor.bearings):
        raise RotorSoilError('integration in time knows no damping of and no torque in the shaft, '
                             'no inertia of bearings and no tables over frequency')
    support = model.support
    if support.bends or support.is_stacked or support.table is not None:
        raise RotorSoilError('integration in time knows rigid blocks on the ground only, no '
                             'foundation that bends or stands on another and no table of seats')
    system = _System(model, speed)
    step = float(time[1] - time[0])
    rate = np.gradient(speed, time)
    angle = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]) * np.diff(time))])
    force = unbalance_force(angle[:, None] + phase, speed[:, None], rate[:, None], moment=moment)
    load = np.concatenate(force, axis=1) @ system.discs.T
    carried = np.zeros((len(time), 3)) if ground is None else ground
    motion = _newmark(system, speed, load - carried @ system.inertia.T, step)
    names = tuple(channel for bearing in model.rotor.bearings
                  for channel in across(bearing.name, HOUSING))
    return Shaking(time, speed, angle, names,
                   motion @ system.housings.T + carried @ system.carried.T)


def unbalance_force(
    angle: FloatArray, speed: FloatArray, rate: FloatArray, *, moment: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """
    Return the forces along x and z of unbalances at angles from z towards x [N].

    References
    ----------
    Lalanne & Ferraris (1998), sec. 1.2.5, with the term of a changing speed.

    """
    sine, cosine = np.sin(angle), np.cos(angle)
    return (moment * (speed**2 * sine - rate * cosine),
            moment * (speed**2 * cosine + rate * sine))


class _System:
    """Equations of motion in rotor shapes of x, of z, and what of every block can move."""

    def __init__(self, model: CoupledModel, speed: FloatArray) -> None:
        rotor = model.rotor
        stiffness, mass, polar = rotor.plane_matrices
        shapes = _shapes(stiffness, mass, [2 * rotor.node_of(bearing.position)
                                           for bearing in rotor.bearings])
        count = shapes.shape[1]
        self._model = model
        size = 2 * count + 6 * len(model.foundations)
        plane = slice(0, count), slice(count, 2 * count)
        self.mass, self._shaft, self._gyroscopic = (np.zeros((size, size)) for _ in range(3))
        for part in plane:
            self.mass[part, part] = shapes.T @ mass @ shapes
            self._shaft[part, part] = shapes.T @ stiffness @ shapes
        # Positive spin takes z into x: with the slopes of both planes taken alike, the couple
        # on z comes with x' and the one on x with -z'.
        turning = shapes.T @ polar @ shapes
        self._gyroscopic[plane[1], plane[0]] = turning
        self._gyroscopic[plane[0], plane[1]] = -turning
        blocks = 2 * count
        self.mass[blocks:, blocks:] = model.support.block_mass
        self.discs = _rows(rotor, shapes, [disc.position for disc in rotor.discs], size).T
        journals = _rows(rotor, shapes, [bearing.position for bearing in rotor.bearings], size)
        self.housings = np.zeros((2 * len(rotor.bearings), size))
        self.housings[:, blocks:] = model.support.block_rows
        # `_rows` has all x first, bearings have x and z in turn.
        order = np.arange(2 * len(rotor.bearings)).reshape(2, -1).T.ravel()
        self._stretch = journals[order] - self.housings
        along = self._along(shapes)
        self.inertia, self.carried = self.mass @ along, (
            self.housings @ along + model.support.firm_rows)
        self._hold(blocks, np.array([speed.min(), speed.max()]))

    def _along(self, shapes: FloatArray) -> FloatArray:
        """Return what a unit motion (x, y, z) of the ground carries along, (d, 3)."""
        support = self._model.support
        # Deflections and slopes take turns.
        own, *_ = np.linalg.lstsq(shapes, np.tile([1.0, 0.0], len(shapes) // 2))
        return np.concatenate([*(np.outer(own, axis) for axis in support.mounts[0].axes),
                               support.follow_rows])

    def _hold(self, blocks: int, speed: FloatArray) -> None:
        """Leave out what the soil holds entirely."""
        gives = np.any(self._soils(speed) != 0.0, axis=(0, 1))
        self._free = np.flatnonzero(gives)
        kept = np.concatenate([np.arange(blocks), blocks + self._free])
        for name in ('mass', '_shaft', '_gyroscopic'):
            setattr(self, name, getattr(self, name)[np.ix_(kept, kept)])
        self.inertia = self.inertia[kept]
        self.discs, self.housings = self.discs[kept], self.housings[:, kept]
        self._stretch = self._stretch[:, kept]

    def _soils(self, speed: FloatArray) -> ComplexArray:
        """Return the compliance under all blocks, (n, 6 f, 6 f)."""
        return self._model.support.ground(speed)

    def matrices(self, speed: FloatArray) -> tuple[FloatArray, FloatArray, ComplexArray]:
        """
        Return what resists at speeds (n,) [rad/s].

        Returns
        -------
        stiffness, damping : (n, d, d) float arrays
            Of the rotor on its bearings; the last coordinates are those of the soil.
        compliance : (n, s, s) complex array
            Of the soil, over the last s coordinates.

        """
        spring, damper, _ = self._model.bearings.coefficients(speed, speed)
        stiffness = self._shaft + self._stretch.T @ spring @ self._stretch
        damping = (self._stretch.T @ damper @ self._stretch
                   + speed[:, None, None] * self._gyroscopic)
        return stiffness, damping, self._soils(speed)[:, self._free[:, None], self._free]


def _shapes(stiffness: FloatArray, mass: FloatArray, journals: list[int]) -> FloatArray:
    """
    Return shapes of the shaft, (2 k, r): what journals impose, and modes with journals held.

    References
    ----------
    Craig & Bampton (1968), AIAA Journal 6, p. 1313.

    """
    held = np.unique(journals)
    inner = np.setdiff1d(np.arange(len(stiffness)), held)
    inside = np.ix_(inner, inner)
    count = min(_MODES, len(inner))
    _, modes = scipy.linalg.eigh(stiffness[inside], mass[inside],
                                 subset_by_index=(0, count - 1))
    shapes = np.zeros((len(stiffness), len(held) + count))
    shapes[held, np.arange(len(held))] = 1.0
    shapes[inner, :len(held)] = -np.linalg.solve(
        stiffness[inside], stiffness[np.ix_(inner, held)])
    shapes[inner, len(held):] = modes
    return shapes


def _rows(rotor: Rotor, shapes: FloatArray, places: list[float], size: int) -> FloatArray:
    """Return deflections at places along x, then along z, per coordinate."""
    count = shapes.shape[1]
    at = [2 * rotor.node_of(place) for place in places]
    rows = np.zeros((2 * len(places), size))
    rows[:len(places), :count] = shapes[at]
    rows[len(places):, count:2 * count] = shapes[at]
    return rows


def _newmark(system: _System, speed: FloatArray, load: FloatArray, step: float) -> FloatArray:
    """Step through the run; return accelerations, (n, d)."""
    starts = np.arange(0, len(speed), _FROZEN)
    inverse, damping, stiffness = _steppers(
        system, speed[np.minimum(starts + _FROZEN // 2, len(speed) - 1)], step)
    place, velocity, acceleration = (np.zeros(load.shape[1]) for _ in range(3))
    found = np.empty_like(load)
    for number, start in enumerate(starts.tolist()):
        for index in range(start, min(start + _FROZEN, len(speed))):
            place = place + step * velocity + (0.5 - _BETA) * step**2 * acceleration
            velocity = velocity + (1.0 - _GAMMA) * step * acceleration
            acceleration = (inverse[number] @ load[index] - damping[number] @ velocity
                            - stiffness[number] @ place)
            place = place + _BETA * step**2 * acceleration
            velocity = velocity + _GAMMA * step * acceleration
            found[index] = acceleration
    return found


def _steppers(
    system: _System, speed: FloatArray, step: float,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """
    Return what load, predicted velocity and predicted place do to the acceleration.

    Notes
    -----
    With q and q' of the contact and the momentary speed W, a soil of spring K and dashpot C,
    1 / N = K + i W C, exerts r = K q + C q' = Re R where N R = q - i q' / W. That is an equation
    for R with the compliance itself: it stands beside the equations of motion, and nothing is
    inverted for it.

    Returns
    -------
    three (n, d, d) float arrays

    """
    stiffness, damping, compliance = system.matrices(speed)
    count, size, own = len(speed), system.mass.shape[0], compliance.shape[1]
    # Of the soil's equations and unknowns: entries near one, whatever the unit.
    unit = np.sqrt(np.abs(np.einsum('nii->ni', compliance)).max(axis=0))
    scaled = compliance / (unit[:, None] * unit)
    pick = np.eye(size)[size - own:] / unit[:, None]
    total = np.zeros((count, size + 2 * own, size + 2 * own))
    real, imaginary = slice(size, size + own), slice(size + own, size + 2 * own)
    total[:, :size, :size] = system.mass + _GAMMA * step * damping + _BETA * step**2 * stiffness
    total[:, :size, real] = pick.T
    total[:, real, :size] = -_BETA * step**2 * pick
    total[:, imaginary, :size] = _GAMMA * step / speed[:, None, None] * pick
    total[:, real, real] = total[:, imaginary, imaginary] = scaled.real
    total[:, real, imaginary], total[:, imaginary, real] = -scaled.imag, scaled.imag
    right = np.zeros((count, size + 2 * own, 3 * size))
    right[:, :size, :size] = np.eye(size)
    right[:, :size, size:2 * size], right[:, :size, 2 * size:] = damping, stiffness
    # What is predicted of the contact, with the signs of the terms that are subtracted.
    right[:, imaginary, size:2 * size] = pick / speed[:, None, None]
    right[:, real, 2 * size:] = -pick
    found = np.linalg.solve(total, right)[:, :size]
    return found[..., :size], found[..., size:2 * size], found[..., 2 * size:]
