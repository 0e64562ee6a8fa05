"""How the machine vibrates on its own, at any speed."""

from dataclasses import dataclass, fields, replace
from functools import cached_property
import math

import numpy as np
import scipy.linalg

from rotorsoil_ros.arrays import AnyArray, ComplexArray, FloatArray, IntArray
from rotorsoil_ros.errors import NotSolvedError, OutOfTableError
from rotorsoil_ros.ground.continuation import Continuation
from rotorsoil_ros.machine.continued import continued_by_pieces
from rotorsoil_ros.machine.coupled import CoupledModel
from rotorsoil_ros.machine.modes.eigen import FreeVibration
from rotorsoil_ros.machine.modes.elastic import Elastic
from rotorsoil_ros.machine.modes.zones import Zone, zones_of
from rotorsoil_ros.rotor.losses import Losses, WHIRL_DIRECTIONS
from rotorsoil_ros.rotor.reduced import ReducedRotor, Whirls
from rotorsoil_ros.rotor.whirl import held, ORBITS
from rotorsoil_ros.units import rad_s_to_hz, rad_s_to_rpm

# A shaft at rest whirls in no direction; one that creeps, relative to its lowest mode, does.
_CREEP = 1e-9

# Speeds that are solved together: bounds memory.
_CHUNK = 64

# Modes at rest beyond those wanted that span the rotor's shapes.
_MORE_SHAPES = 6

# Ratio of a mode's 1 / omega to the largest below which it is round-off.
_MASSLESS = 1e-6

# Relative error of a frequency that the subspace may cause.
_DEFECT = 1e-8

# Modes looked at beyond those wanted, at first and at most.
_SPARE = 6
_MOST_SPARE = 64

# Rotor modes that are solved for exactly, up to so many times the highest frequency: more of them
# only where fewer leave the guesses too rough.
_REACHES = (1.5, 5.0, 1e6)

# The search ends at this many times the rotor's own frequencies.
_HIGHEST = 30.0


@dataclass(frozen=True)
class Spectrum:
    """
    Lowest free vibrations at some speeds, NaN where a speed has fewer.

    Attributes
    ----------
    frequency : (n, p) complex array
        w = lambda / i [rad/s]: damped frequency + i decay, ascending in frequency.
    whirl : (n, p) int array
        +1 where the rotor's kinetic energy is that of a forward orbit, else -1.
    shape : (n, p, d) complex array
        Coordinates in which the kinetic energy is the sum of squares; the same at all speeds.
    rotor : (n, p, 2, r) complex array
        Shape of the rotor, forward and backward, in its reduced coordinates.
    support : (n, p, s) complex array
        Motion of the support, over the columns of `Support.motion_rows`.
    untold : (n,) float array
        Lowest frequency of a light vibration that is left out because what is known of the
        support does not determine it [rad/s]; infinite where there is none.

    """

    frequency: ComplexArray
    whirl: IntArray
    shape: ComplexArray
    rotor: ComplexArray
    support: ComplexArray
    untold: FloatArray


@dataclass(frozen=True)
class SpectrumSolver:
    """
    What all speeds share.

    Attributes
    ----------
    model : CoupledModel
        The machine.
    basis : ReducedRotor
        Its rotor in a subspace.
    pieces : tuple of Continuation
        Compliance of the support without its mass, between the branch points of the soil.
    span : tuple of two floats
        Frequencies between which modes are looked for [rad/s].
    following : bool
        Whether only what has the frequency of the speed is wanted: no hysteresis of the shaft is
        felt in forward whirl then, as it stands still in the rotor.

    """

    model: CoupledModel
    basis: ReducedRotor
    pieces: tuple[Continuation, ...]
    span: tuple[float, float]
    following: bool = False

    @classmethod
    def up_to(
        cls, model: CoupledModel, highest: float, *, shapes: int = _MORE_SHAPES,
        following: bool = False,
    ) -> 'SpectrumSolver':
        """
        Prepare for modes up to a frequency, as far as the soil is known.

        Parameters
        ----------
        model : CoupledModel
            The machine.
        highest : float
            Frequency [rad/s].
        shapes : int
            Least number of modes at rest that span the rotor's shapes.
        following : bool
            As of the solver.

        """
        while True:
            basis = ReducedRotor.of(model.rotor, model.nominal_springs, count=shapes)
            slow = int((basis.mass * highest**2 > 1.0).sum())
            if shapes >= slow + _MORE_SHAPES or shapes >= len(basis.shapes):
                break
            shapes = slow + _MORE_SHAPES
        (low, high), (first, last) = model.support.known(highest), model.bearings.frequency_range
        span = max(low, first), min(high, last)
        if not span[0] < span[1]:
            raise OutOfTableError(
                f'tables of bearings must hold some frequency of vibration up to '
                f'{rad_s_to_hz(high):.4g} Hz, got {rad_s_to_hz(first):g} to '
                f'{rad_s_to_hz(last):g} Hz')
        return cls(model, basis, continued_by_pieces(model.support, span), span, following)

    @cached_property
    def zones(self) -> tuple[Zone, ...]:
        """Frequencies between which soil, bearings and shaft each follow one law, rising."""
        losses = self.basis.losses
        is_split = losses is not None and losses.is_hysteretic and not self.following
        return zones_of(self.pieces, self.span, self.model.bearings.frequencies,
                        lags=(-1.0, 1.0) if is_split else (0.0,))

    @classmethod
    def lowest(
        cls, model: CoupledModel, speed: FloatArray, count: int,
    ) -> Spectrum:
        """
        Return the lowest modes at each speed.

        Parameters
        ----------
        model : CoupledModel
            The machine.
        speed : (n,) float array
            Rotor speeds [rad/s].
        count : int
            Modes wanted at each.

        """
        shapes = count // 2 + _MORE_SHAPES
        basis = ReducedRotor.of(model.rotor, model.nominal_springs, count=shapes)
        first = highest = _highest(basis, speed, count)
        spare = _SPARE
        while True:
            _, found = cls.up_to(model, highest, shapes=shapes).refined(speed, count, spare=spare)
            enough = np.isfinite(found.frequency).sum(axis=1).min() >= count
            ended = not model.support.answers(highest) or highest > _HIGHEST * first
            if enough or (ended and spare > _MOST_SPARE):
                return found
            spare, highest = 4 * spare, highest if ended else 2.0 * highest

    def solve(self, speed: FloatArray, count: int, *, spare: int = _SPARE) -> Spectrum:
        """
        Return at most `count` modes at each of the speeds (n,) [rad/s].

        So many `spare` ones are looked at besides: their order, and whether they vibrate at all,
        shows only in the end.
        """
        parts = [self._solve(speed[start:start + _CHUNK], count, spare)
                 for start in range(0, len(speed), _CHUNK)]
        width = max(part.frequency.shape[1] for part in parts)
        return Spectrum(*(np.concatenate([_widen(getattr(part, field.name), width)
                                          for part in parts]) for field in fields(Spectrum)))

    def refined(
        self, speed: FloatArray, count: int, *, spare: int = _SPARE,
    ) -> tuple['SpectrumSolver', Spectrum]:
        """Solve; should its subspace be too small for that, do it again with a larger one."""
        solver = self
        while True:
            found = solver.solve(speed, count, spare=spare)
            if (solver.defect(speed, found) <= _DEFECT
                    or len(solver.basis.mass) == len(solver.basis.shapes)):
                return solver, found
            basis = ReducedRotor.of(self.model.rotor, self.model.nominal_springs,
                                    count=2 * len(solver.basis.mass))
            solver = replace(solver, basis=basis)

    def defect(self, speed: FloatArray, found: Spectrum) -> float:
        """
        Return the largest relative error of a frequency that the rotor's subspace causes.

        At the highest speed: forces that the full model lacks there would bend the rotor by so
        much of its energy.
        """
        model, basis = self.model, self.basis
        row = int(speed.argmax())
        exists = np.isfinite(found.frequency[row])
        w = found.frequency[row, exists][:, None, None]
        turning = w * speed[row] * np.array([1.0, -1.0])[:, None]
        shape = found.rotor[row, exists]
        stiffness, mass, polar = held(model.rotor, model.nominal_springs)
        journals = [2 * model.rotor.node_of(bearing.position) for bearing in model.rotor.bearings]
        # What the bearings must exert for the reduced equations to hold, in both of them.
        exerted = (shape - w**2 * shape * basis.mass + turning * (shape @ basis.polar)
                   + self._lost(basis.losses, shape, w, speed[row])) @ (
            np.linalg.pinv(basis.shapes[journals]))
        full = shape @ basis.shapes.T
        lacking = full @ stiffness - w**2 * (full @ mass) + turning * (full @ polar)
        lacking += self._lost(model.rotor.losses, full, w, speed[row])
        lacking[..., journals] -= exerted
        bent = scipy.linalg.solve(stiffness, lacking.reshape(-1, len(stiffness)).T,
                                  assume_a='pos').T.reshape(full.shape)
        error = np.abs((lacking.conj() * bent).sum(axis=(1, 2)))
        kinetic = np.abs(w[:, 0] * found.shape[row, exists]) ** 2
        energy = (np.abs(shape) ** 2).sum(axis=(1, 2)) + kinetic.sum(axis=1)
        return float((error / energy).max(initial=0.0))

    @staticmethod
    def _lost(
        losses: Losses | None, shape: ComplexArray, w: ComplexArray, speed: float,
    ) -> ComplexArray:
        """Return what a lossy shaft exerts on shapes (p, 2, m) of frequencies (p, 1, 1)."""
        if losses is None:
            return np.zeros_like(shape)
        return np.stack([
            shape[:, index] @ losses.held(direction, speed=float(speed), lag=1.0).T
            + w[:, 0] * (shape[:, index] @ losses.rate(direction).T)
            for index, direction in enumerate(WHIRL_DIRECTIONS)], axis=1)

    def deflection(self, rotor: ComplexArray) -> ComplexArray:
        """Return (x, z) of every node, (k, 2), in a shape of the rotor, (2, r)."""
        return self.bent(rotor)[0]

    def bent(self, rotor: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
        """Return deflections as `deflection`, and slopes in the planes of x and z, (k, 2)."""
        motion = self.basis.shapes @ rotor.T @ ORBITS
        return motion[::2], motion[1::2]

    def _solve(self, speed: FloatArray, count: int, spare: int) -> Spectrum:
        turning = np.maximum(speed, _CREEP * self.basis.mass.max() ** -0.5)
        whirls = {lag: self.basis.whirls(turning, lag)
                  for lag in {zone.lag for zone in self.zones}}
        parts, strays = zip(*(self._solve_zone(speed, whirls[zone.lag], zone, count + spare)
                              for zone in self.zones), strict=True)
        found, astray = _merged(list(parts), count), np.concatenate(strays, axis=1)
        # What another zone tells there, as one beside it may too, is not lost.
        blur = max(zone.compliance.blur for zone in self.zones)
        gap = np.abs(astray[:, :, None] - found.frequency.real[:, None])
        told = np.fmin.reduce(gap, axis=2, initial=np.inf) <= blur
        lost = np.where(told, np.inf, astray).min(axis=1, initial=np.inf)
        return replace(found, untold=np.minimum(found.untold, lost))

    def _solve_zone(
        self, speed: FloatArray, whirls: Whirls,
        zone: Zone, count: int,
    ) -> tuple[Spectrum, FloatArray]:
        """Return the vibrations whose frequency lies in a zone, and those just beyond it."""
        for reach in _REACHES:
            vibration = self._at(speed, whirls, zone, reach)
            frequency, vector, sound, untold = vibration.solve(count)
            if sound.all():
                break
        else:
            raise NotSolvedError('modes could not be told apart at '
                                 f'{rad_s_to_rpm(float(speed[~sound][0])):g} rpm')
        low, high = vibration.within
        known = (frequency.real >= low[:, None]) & (frequency.real <= high[:, None])
        untold = np.where((untold >= low) & (untold <= high), untold, np.inf)
        return self._spectrum(vibration, whirls[1], np.where(known, frequency, np.nan), vector,
                              untold), zone.astray(frequency, low, high)

    def _spectrum(
        self, vibration: FreeVibration, amplitude: AnyArray, frequency: ComplexArray,
        vector: ComplexArray, untold: FloatArray,
    ) -> Spectrum:
        """Turn what the equations are solved for into shapes that all speeds share."""
        basis, exists = self.basis, np.isfinite(frequency)
        states = vibration.amplitudes(np.where(exists, frequency, 0.0), vector)
        turn, half = amplitude.transpose(0, 1, 3, 2), amplitude.shape[3]
        rotor = np.stack([states[..., :half] @ turn[:, 0], states[..., half:] @ turn[:, 1]],
                         axis=2)
        support = np.concatenate([
            vector[..., vector.shape[2] - len(vibration.mass):] * vibration.compliance.size,
            vibration.bent(np.where(exists, frequency, 0.0), vector) @ self._turn.T], axis=-1)
        moving = np.sqrt(basis.mass) * rotor
        forward, backward = (np.abs(moving) ** 2).sum(axis=-1).transpose(2, 0, 1)
        values, axes = np.linalg.eigh(self.model.support.motion_mass)
        below = support @ (axes * np.sqrt(np.maximum(values, 0.0)))
        # Explicitly: -1 cannot be told where there is no mode at all.
        moving = moving.reshape(*exists.shape, math.prod(moving.shape[2:]))
        shape = np.concatenate([moving, below], axis=-1)
        return Spectrum(
            frequency, np.where(exists, np.where(forward >= backward, 1, -1), 0),
            np.where(exists[..., None], shape, np.nan), rotor, support, untold)

    def _at(
        self, speed: FloatArray, whirls: Whirls,
        zone: Zone, reach: float,
    ) -> FreeVibration:
        inverse, right, left = whirls
        model, support, size = self.model, self.model.support, zone.compliance.size
        rows = [2 * model.rotor.node_of(bearing.position) for bearing in model.rotor.bearings]
        unit = np.sqrt(model.nominal_springs)
        journals = unit[:, None] * self.basis.shapes[rows]
        unit = np.repeat(unit, 2)
        constant, rate, inertia = (part / (unit[:, None] * unit)
                                   for part in model.bearings.series(speed, zone.between))
        own, mass, turn = len(size), support.motion_mass, self._turn
        held = slice(0, own)
        spring = np.diagonal(turn.T @ support.motion_spring[own:, own:] @ turn)
        elastic = Elastic(
            unit[:, None] * support.motion_rows[:, own:] @ turn,
            size[:, None] * mass[:own, own:] @ turn,
            np.diagonal(turn.T @ mass[own:, own:] @ turn), 1.0 + spring)
        return FreeVibration(
            inverse, journals @ right, journals @ left.swapaxes(2, 3), (constant, rate, inertia),
            unit[:, None] * support.motion_rows[:, held] * size,
            size[:, None] * mass[held, held] * size,
            size[:, None] * support.motion_spring[held, held] * size, elastic, zone.compliance,
            self.span[1], reach, zone.ends(zone.told, speed))

    @cached_property
    def _turn(self) -> FloatArray:
        """
        Elastic coordinates of the support between which there is no mass, by columns, (e, e).

        What several losses would join them by is left out: of each is kept what it loses itself.
        """
        own = len(self.model.support.motion_mass) - self.model.support.elastic
        _, turn = np.linalg.eigh(self.model.support.motion_mass[own:, own:])
        return np.asarray(turn)


def _merged(parts: list[Spectrum], count: int) -> Spectrum:
    """Return at most `count` vibrations of all pieces, sorted by frequency."""
    frequency = np.concatenate([part.frequency for part in parts], axis=1)
    most = min(count, int(np.isfinite(frequency).sum(axis=1).max(initial=0)))
    order = np.argsort(frequency.real, axis=1)[:, :most]
    # The rows of one speed are reordered alike, whatever else they hold.
    rows = np.arange(len(frequency))[:, None]

    def joined(name: str) -> np.ndarray:
        return np.concatenate([getattr(part, name) for part in parts], axis=1)[rows, order]

    return Spectrum(joined('frequency'), joined('whirl'), joined('shape'), joined('rotor'),
                    joined('support'), np.min([part.untold for part in parts], axis=0))


def _highest(basis: ReducedRotor, speed: FloatArray, count: int) -> float:
    """Return a frequency above the first modes of the rotor on its nominal springs."""
    inverse, _ = basis.spin(np.array([speed.min(), speed.max()]))
    both = np.sort(np.concatenate([inverse, -inverse], axis=1), axis=1)[:, ::-1]
    # What has no mass has no mode, but some round-off instead.
    massive = int((both > _MASSLESS * both[:, :1]).sum(axis=1).min())
    return float((1.1 / both[:, min(count, massive) - 1]).max())


def _widen(values: np.ndarray, width: int) -> np.ndarray:
    """Fill up the second axis, if there is one: with NaN, or with the 0 of no whirl."""
    if values.ndim == 1:
        return values
    missing = [(0, 0)] * values.ndim
    missing[1] = (0, width - values.shape[1])
    return np.pad(values, missing, constant_values=np.nan if values.dtype == complex else 0)
