"""
How would the machine shake while its speed changes? Integrated in time, not over frequencies.

An independent route to the same machine, for signals whose truth is known: shapes of the
rotor, blocks and soil in one system of equations of motion, stepped through a whole run.
"""

from dataclasses import dataclass

import numpy as np
import scipy.linalg

from rotorsoil_ros.physics.arrays import FloatArray
from rotorsoil_ros.physics.coupled import CoupledModel
from rotorsoil_ros.physics.errors import RotorSoilError
from rotorsoil_ros.physics.rotor import Rotor

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
    channels : tuple of str
        Housings.
    acceleration : (n, c) float array
        [m/s^2].

    """

    time: FloatArray
    speed: FloatArray
    angle: FloatArray
    channels: tuple[str, ...]
    acceleration: FloatArray


def shake(
    model: CoupledModel, time: FloatArray, speed: FloatArray, *, moment: FloatArray,
    phase: FloatArray,
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

    Notes
    -----
    Soil acts as spring and dashpot with the dynamic stiffness at the momentary speed: exact for
    what turns with the rotor, a good stand-in for free vibration near it (design note, 5.1).
    Newmark's error is (omega dt)^2 / 12 of a frequency.

    """
    if any(bearing.pedestal is not None for bearing in model.rotor.bearings) or model.couples:
        raise RotorSoilError('integration in time knows no pedestals and no couples')
    system = _System(model)
    step = float(time[1] - time[0])
    rate = np.gradient(speed, time)
    angle = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]) * np.diff(time))])
    force = unbalance_force(angle[:, None] + phase, speed[:, None], rate[:, None], moment=moment)
    load = np.concatenate(force, axis=1) @ system.discs.T
    motion = _newmark(system, speed, load, step)
    names = tuple(f'{bearing.name}_housing_{axis}' for bearing in model.rotor.bearings
                  for axis in 'xz')
    return Shaking(time, speed, angle, names, motion @ system.housings.T)


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
    """Equations of motion in rotor shapes of x, of z, and the six motions of every block."""

    def __init__(self, model: CoupledModel) -> None:
        rotor = model.rotor
        stiffness, mass, polar = rotor.plane_matrices
        shapes = _shapes(stiffness, mass, [2 * rotor.node_of(bearing.position)
                                           for bearing in rotor.bearings])
        count = shapes.shape[1]
        self._model, self._modes = model, count
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
        for index, foundation in enumerate(model.foundations):
            own = slice(blocks + 6 * index, blocks + 6 * index + 6)
            self.mass[own, own] = foundation.mass_matrix
        self.discs = _rows(rotor, shapes, [disc.position for disc in rotor.discs], size).T
        journals = _rows(rotor, shapes, [bearing.position for bearing in rotor.bearings], size)
        self.housings = np.zeros((2 * len(rotor.bearings), size))
        for index, rows in enumerate(model.support.seat_rows):
            self.housings[:, blocks + 6 * index:blocks + 6 * index + 6] = rows
        # `_rows` has all x first, bearings have x and z in turn.
        order = np.arange(2 * len(rotor.bearings)).reshape(2, -1).T.ravel()
        self._stretch = journals[order] - self.housings

    def matrices(self, speed: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return stiffness and damping at speeds (n,) [rad/s], (n, d, d) each."""
        spring, damper = self._model.bearing_coefficients(speed)
        stiffness = self._shaft + self._stretch.T @ spring @ self._stretch
        damping = (self._stretch.T @ damper @ self._stretch
                   + speed[:, None, None] * self._gyroscopic)
        for index, soil in enumerate(self._model.soil_models):
            first = 2 * self._modes + 6 * index
            compliance = soil.compliance(speed)
            free = np.flatnonzero(np.any(compliance != 0.0, axis=(0, 1)))
            # Here the stiffness itself is wanted: it is an entry of the equations of motion.
            dynamic = np.linalg.inv(compliance[:, free[:, None], free])
            rows, columns = first + free[:, None], first + free
            stiffness[:, rows, columns] += dynamic.real
            damping[:, rows, columns] += dynamic.imag / speed[:, None, None]
            for dof in set(range(6)) - set(free.tolist()):
                stiffness[:, first + dof, first + dof] += 1e6 * np.abs(stiffness).max()
        return stiffness, damping


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
    stiffness, damping = system.matrices(speed[np.minimum(starts + _FROZEN // 2,
                                                          len(speed) - 1)])
    inverse = np.linalg.inv(
        system.mass + _GAMMA * step * damping + _BETA * step**2 * stiffness)
    place, velocity, acceleration = (np.zeros(load.shape[1]) for _ in range(3))
    found = np.empty_like(load)
    for number, start in enumerate(starts.tolist()):
        for index in range(start, min(start + _FROZEN, len(speed))):
            place = place + step * velocity + (0.5 - _BETA) * step**2 * acceleration
            velocity = velocity + (1.0 - _GAMMA) * step * acceleration
            acceleration = inverse[number] @ (
                load[index] - damping[number] @ velocity - stiffness[number] @ place)
            place = place + _BETA * step**2 * acceleration
            velocity = velocity + _GAMMA * step * acceleration
            found[index] = acceleration
    return found
