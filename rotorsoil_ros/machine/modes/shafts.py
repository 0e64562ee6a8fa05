"""All shafts on the same blocks, each in few shapes and each at its own speed."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
import math

import numpy as np
import scipy.linalg

from rotorsoil_ros.arrays import AnyArray, ComplexArray, FloatArray, IntArray, side_by_side
from rotorsoil_ros.machine.coupled import CoupledModel
from rotorsoil_ros.rotor.assembly import Rotor
from rotorsoil_ros.rotor.losses import Losses, WHIRL_DIRECTIONS
from rotorsoil_ros.rotor.reduced import ReducedRotor
from rotorsoil_ros.rotor.whirl import held, ORBITS

# Modes at rest beyond those wanted that span the shapes of a rotor.
MORE_SHAPES = 6

# Ratio of a mode's 1 / omega to the largest below which it is round-off.
_MASSLESS = 1e-6

# A shaft at rest whirls in no direction; one that creeps, relative to its lowest mode, does.
_CREEP = 1e-9


@dataclass(frozen=True)
class ShaftLine:
    """
    One of them.

    Attributes
    ----------
    rotor : Rotor
        What turns, or stands.
    basis : ReducedRotor
        The same in a subspace.
    speed : float or None
        Its own [rad/s]; None where it has the one that is asked about.

    """

    rotor: Rotor
    basis: ReducedRotor
    speed: float | None

    @classmethod
    def of(cls, rotor: Rotor, speed: float | None, *, count: int) -> 'ShaftLine':
        """Reduce a rotor to so many modes at rest, and what else they ask for."""
        return cls(rotor, ReducedRotor.of(rotor, rotor.nominal_springs, count=count), speed)

    @classmethod
    def up_to(
        cls, rotor: Rotor, speed: float | None, highest: float, *, count: int,
    ) -> 'ShaftLine':
        """Reduce a rotor to all that it takes up to a frequency [rad/s], so many at least."""
        while True:
            found = cls.of(rotor, speed, count=count)
            slow = found.slow(highest)
            if count >= slow + MORE_SHAPES or found.is_whole(count):
                return found
            count = slow + MORE_SHAPES

    def larger(self) -> 'ShaftLine':
        """Return the same rotor in a larger subspace."""
        return ShaftLine.of(self.rotor, self.speed, count=2 * len(self.basis.mass))

    def slow(self, highest: float) -> int:
        """Return how many of its shapes swing below a frequency [rad/s]."""
        return int((self.basis.mass * highest**2 > 1.0).sum())

    def is_whole(self, count: int) -> bool:
        """Return whether so many shapes are all that its mesh has."""
        return count >= len(self.basis.shapes)

    @property
    def journals(self) -> FloatArray:
        """Deflection of the journals per coordinate in units of their springs, (b, r)."""
        rows = [2 * self.rotor.node_of(bearing.position) for bearing in self.rotor.bearings]
        return np.asarray(np.sqrt(self.rotor.nominal_springs)[:, None] * self.basis.shapes[rows])

    def lag(self, frequency: float, lag: float) -> float:
        """Return the sign of a frequency [rad/s] less its speed where that matters, else 0."""
        losses = self.basis.losses
        if self.speed is None or losses is None or not losses.is_hysteretic:
            return lag if self.speed is None else 0.0
        return math.copysign(1.0, frequency - self.speed)

    def whirls(
        self, speed: FloatArray, lag: float,
    ) -> tuple[AnyArray, AnyArray, AnyArray]:
        """Return its modes at speeds (n,) [rad/s] as `ReducedRotor.whirls`."""
        turns = speed if self.speed is None else np.array([self.speed])
        least = _CREEP * float(self.basis.mass.max()) ** -0.5
        found = self.basis.whirls(np.maximum(turns, least), lag)
        inverse, right, left = (np.broadcast_to(part, (len(speed), *part.shape[1:]))
                                for part in found)
        return inverse, right, left

    def highest(self, speed: FloatArray, count: int) -> float:
        """Return a frequency above its first modes on its nominal springs [rad/s]."""
        ends = np.array([speed.min(), speed.max()]) if self.speed is None else (
            np.array([self.speed]))
        inverse, _ = self.basis.spin(ends)
        both = np.sort(np.concatenate([inverse, -inverse], axis=1), axis=1)[:, ::-1]
        # What has no mass has no mode, but some round-off instead.
        massive = int((both > _MASSLESS * both[:, :1]).sum(axis=1).min())
        return float((1.1 / both[:, min(count, massive) - 1]).max())

    def defect(
        self, w: ComplexArray, shape: ComplexArray, speed: float,
    ) -> tuple[FloatArray, FloatArray]:
        """
        Return what the subspace makes wrong, as energy, and its strain energy, (p,) each.

        Parameters
        ----------
        w : (p,) complex array
            Frequencies [rad/s].
        shape : (p, 2, r) complex array
            Shapes, forward and backward.
        speed : float
            That is asked about [rad/s].

        Notes
        -----
        Forces that the full model lacks in these shapes would bend the rotor by so much.

        """
        rotor, basis, w = self.rotor, self.basis, w[:, None, None]
        turns = speed if self.speed is None else self.speed
        turning = w * turns * np.array([1.0, -1.0])[:, None]
        stiffness, mass, polar = held(rotor, rotor.nominal_springs)
        journals = [2 * rotor.node_of(bearing.position) for bearing in rotor.bearings]
        # What the bearings must exert for the reduced equations to hold, in both of them.
        exerted = (shape - w**2 * shape * basis.mass + turning * (shape @ basis.polar)
                   + _lost(basis.losses, shape, w, turns)) @ (
            np.linalg.pinv(basis.shapes[journals]))
        full = shape @ basis.shapes.T
        lacking = full @ stiffness - w**2 * (full @ mass) + turning * (full @ polar)
        lacking += _lost(rotor.losses, full, w, turns)
        lacking[..., journals] -= exerted
        bent = scipy.linalg.solve(stiffness, lacking.reshape(-1, len(stiffness)).T,
                                  assume_a='pos').T.reshape(full.shape)
        return (np.abs((lacking.conj() * bent).sum(axis=(1, 2))),
                (np.abs(shape) ** 2).sum(axis=(1, 2)))

    def bent(self, shape: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
        """Return deflections (x, z) of every node and slopes in their planes, (k, 2) each."""
        motion = self.basis.shapes @ shape.T @ ORBITS
        return motion[::2], motion[1::2]


def _lost(
    losses: Losses | None, shape: ComplexArray, w: ComplexArray, speed: float,
) -> ComplexArray:
    """Return what a lossy shaft exerts on shapes (p, 2, m) of frequencies (p, 1, 1)."""
    if losses is None:
        return np.zeros_like(shape)
    return np.stack([
        shape[:, index] @ losses.held(direction, speed=speed, lag=1.0).T
        + w[:, 0] * (shape[:, index] @ losses.rate(direction).T)
        for index, direction in enumerate(WHIRL_DIRECTIONS)], axis=1)


@dataclass(frozen=True)
class Shafts:
    """
    Every shaft of a plant.

    Attributes
    ----------
    each : tuple of ShaftLine
        In the order of the machines.

    """

    each: tuple[ShaftLine, ...]

    @classmethod
    def up_to(cls, model: CoupledModel, highest: float, *, count: int) -> 'Shafts':
        """Reduce the rotors of a model as `ShaftLine.up_to`."""
        return cls(tuple(ShaftLine.up_to(rotor, speed, highest, count=count)
                         for rotor, speed in zip(model.rotors, model.own_speeds, strict=True)))

    @property
    def own(self) -> ShaftLine:
        """The one whose speed is asked about."""
        return next(one for one in self.each if one.speed is None)

    def larger(self) -> 'Shafts':
        """Return all in a larger subspace."""
        return Shafts(tuple(one.larger() for one in self.each))

    @property
    def is_whole(self) -> bool:
        """Whether nothing is left out."""
        return all(one.is_whole(len(one.basis.mass)) for one in self.each)

    @cached_property
    def rows(self) -> tuple[slice, ...]:
        """Where the coordinates of each are among those of all."""
        ends = np.cumsum([0, *(len(one.basis.mass) for one in self.each)]).tolist()
        return tuple(slice(*pair) for pair in pairwise(ends))

    @cached_property
    def seats(self) -> tuple[slice, ...]:
        """Where the bearings of each are among those of all."""
        ends = np.cumsum([0, *(len(one.rotor.bearings) for one in self.each)]).tolist()
        return tuple(slice(*pair) for pair in pairwise(ends))

    @cached_property
    def springs(self) -> FloatArray:
        """Nominal stiffness of every bearing, (b,) [N/m]."""
        return np.concatenate([one.rotor.nominal_springs for one in self.each])

    @cached_property
    def mass(self) -> FloatArray:
        """Diagonal of the mass matrix, (r,) [s^2]."""
        return np.concatenate([one.basis.mass for one in self.each])

    @cached_property
    def journals(self) -> FloatArray:
        """Deflection of all journals per coordinate in units of their springs, (b, r)."""
        return np.asarray(scipy.linalg.block_diag(*(one.journals for one in self.each)))

    def slow(self, stiffness: ComplexArray, highest: float) -> int:
        """
        Return how many motions along x and z swing below a frequency [rad/s] at rest.

        On bearings of a stiffness (n, 2 b, 2 b) in units of their springs, at most: as many as
        the stiffness less highest^2 mass has negative eigenvalues (Sylvester).
        """
        # Mostly all are alike.
        stiffness = np.unique(0.5 * (stiffness + stiffness.swapaxes(1, 2)).real, axis=0)
        moves = np.kron(self.journals, np.eye(2))
        one = np.eye(moves.shape[1])
        beyond = moves.T @ (stiffness - np.eye(len(moves))) @ moves
        values = np.linalg.eigvalsh(one + beyond - highest**2 * np.repeat(self.mass, 2) * one)
        return int((values < 0.0).sum(axis=1).max())

    @cached_property
    def turning_points(self) -> FloatArray:
        """Frequencies of vibration at which what a hysteretic neighbour exerts turns, (h,)."""
        return np.unique([one.speed for one in self.each if one.speed and one.lag(0.0, 0.0)])

    def whirls(
        self, speed: FloatArray, frequency: float, lag: float,
    ) -> tuple[AnyArray, AnyArray, AnyArray]:
        """
        Return the whirl modes of all shafts as `ReducedRotor.whirls`, those of one together.

        Parameters
        ----------
        speed : (n,) float array
            That is asked about [rad/s].
        frequency, lag : float
            Of the vibration [rad/s], and its sign less that speed.

        """
        found = [one.whirls(speed, one.lag(frequency, lag)) for one in self.each]
        inverse = np.concatenate([one for one, _, _ in found], axis=-1)
        return (inverse, side_by_side([one for _, one, _ in found], len(speed), 2),
                side_by_side([one for _, _, one in found], len(speed), 2))

    @cached_property
    def modes(self) -> tuple[IntArray, ...]:
        """Which of all whirl modes, forward then backward, are those of each shaft."""
        count = 2 * len(self.mass)
        return tuple(np.concatenate([
            np.arange(2 * rows.start, 2 * rows.stop) + half for half in (0, count)])
            for rows in self.rows)

    def gyroscopic(self) -> tuple[FloatArray, FloatArray]:
        """Return the polar part of the equations: what stays, and what goes with the speed."""
        polar = [one.basis.polar for one in self.each]
        fixed = [matrix * (one.speed or 0.0) for one, matrix in zip(self.each, polar, strict=True)]
        follows = [matrix * (one.speed is None)
                   for one, matrix in zip(self.each, polar, strict=True)]
        return scipy.linalg.block_diag(*fixed), scipy.linalg.block_diag(*follows)

    def losses(
        self, frequency: float, lag: float,
    ) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
        """
        Return what lossy shafts exert on motions and on rates, and per speed, (2 r, 2 r) each.

        At the speed zero of what is asked about; parameters as in `whirls`.
        """
        def of(part: str, way: int, one: ShaftLine) -> ComplexArray:
            losses = one.basis.losses
            if losses is None or (part == 'turning' and one.speed is not None):
                return np.zeros((len(one.basis.mass),) * 2, dtype=complex)
            if part == 'held':
                return losses.held(way, speed=one.speed or 0.0, lag=one.lag(frequency, lag))
            return losses.rate(way) if part == 'rate' else losses.turning(way)

        constant, rate, turning = (
            np.asarray(scipy.linalg.block_diag(*(of(part, way, one) for way in WHIRL_DIRECTIONS
                                                 for one in self.each)))
            for part in ('held', 'rate', 'turning'))
        return constant, rate, turning

    def kinetic(self, rotor: ComplexArray) -> FloatArray:
        """Return the kinetic energy of each in shapes (..., 2, r) per squared frequency."""
        energy = (np.abs(rotor) ** 2 * self.mass).sum(axis=-2)
        return np.stack([energy[..., rows].sum(axis=-1) for rows in self.rows], axis=-1)

    def bent(self, rotor: ComplexArray) -> Iterator[tuple[ComplexArray, ComplexArray]]:
        """Yield deflections and slopes of each in a shape (2, r), as `ShaftLine.bent`."""
        for one, rows in zip(self.each, self.rows, strict=True):
            yield one.bent(rotor[:, rows])
