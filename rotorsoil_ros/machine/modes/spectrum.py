"""How the machine vibrates on its own, at any speed."""

from dataclasses import dataclass, fields, replace
from functools import cached_property
import math

import numpy as np

from rotorsoil_ros.arrays import AnyArray, BoolArray, ComplexArray, FloatArray, IntArray
from rotorsoil_ros.errors import NotSolvedError, OutOfTableError
from rotorsoil_ros.ground.continuation import Continuation
from rotorsoil_ros.machine.continued import continued_by_pieces
from rotorsoil_ros.machine.coupled import CoupledModel
from rotorsoil_ros.machine.modes.below import Elastic, parted, sizes, SupportModes
from rotorsoil_ros.machine.modes.eigen import FreeVibration
from rotorsoil_ros.machine.modes.guesses import Guesses
from rotorsoil_ros.machine.modes.shafts import MORE_SHAPES, ShaftLine, Shafts
from rotorsoil_ros.machine.modes.zones import Zone, zones_of
from rotorsoil_ros.rotor.reduced import Whirls
from rotorsoil_ros.units import rad_s_to_hz, rad_s_to_rpm

# Speeds that are solved together, of a machine alone: bounds memory.
_CHUNK = 64

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
        +1 where the rotors' kinetic energy is that of a forward orbit, else -1.
    owner : (n, p) int array
        Number of the neighbour, from 1 in the order of all machines, whose rotor has most of the
        kinetic energy; 0 where none has.
    shape : (n, p, d) complex array
        Coordinates in which the kinetic energy is the sum of squares; the same at all speeds.
    rotor : (n, p, 2, r) complex array
        Shape of the rotors, forward and backward, in their reduced coordinates.
    support : (n, p, s) complex array
        Motion of the support, over the columns of `Support.motion_rows`.
    untold : (n,) float array
        Lowest frequency of a light vibration that is left out because what is known of the
        support does not determine it [rad/s]; infinite where there is none.

    """

    frequency: ComplexArray
    whirl: IntArray
    owner: IntArray
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
    shafts : Shafts
        Its rotor in a subspace, and those of its neighbours.
    pieces : tuple of Continuation
        Compliance of the support without its mass, between the branch points of the soil.
    span : tuple of two floats
        Frequencies between which modes are looked for [rad/s].
    following : bool
        Whether only what has the frequency of the speed is wanted: no hysteresis of the shaft is
        felt in forward whirl then, as it stands still in the rotor.

    """

    model: CoupledModel
    shafts: Shafts
    pieces: tuple[Continuation, ...]
    span: tuple[float, float]
    following: bool = False

    @classmethod
    def up_to(
        cls, model: CoupledModel, highest: float, *, shapes: int = 0, following: bool = False,
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
            Least number of modes at rest that span the shapes of each rotor.
        following : bool
            As of the solver.

        """
        shafts = Shafts.up_to(model, highest, count=max(shapes, MORE_SHAPES))
        (low, high), (first, last) = (model.support.known(highest),
                                      model.all_bearings.frequency_range)
        span = max(low, first), min(high, last)
        if not span[0] < span[1]:
            raise OutOfTableError(
                f'tables of bearings must hold some frequency of vibration up to '
                f'{rad_s_to_hz(high):.4g} Hz, got {rad_s_to_hz(first):g} to '
                f'{rad_s_to_hz(last):g} Hz')
        return cls(model, shafts, continued_by_pieces(model.support, span), span, following)

    @cached_property
    def zones(self) -> tuple[Zone, ...]:
        """Frequencies between which soil, bearings and shaft each follow one law, rising."""
        losses = self.shafts.own.basis.losses
        is_split = losses is not None and losses.is_hysteretic and not self.following
        return zones_of(self.pieces, self.span, self.model.all_bearings.frequencies,
                        turning_points=self.shafts.turning_points,
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
        shapes = count // 2 + MORE_SHAPES
        own = ShaftLine.of(model.rotor, None, count=shapes)
        first = highest = own.highest(speed, count)
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
        chunk = max(_CHUNK // len(self.shafts.each), 1)
        parts = [self._solve(speed[start:start + chunk], count, spare)
                 for start in range(0, len(speed), chunk)]
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
                    or solver.shafts.is_whole):
                return solver, found
            solver = replace(solver, shafts=solver.shafts.larger())

    def defect(self, speed: FloatArray, found: Spectrum) -> float:
        """
        Return the largest relative error of a frequency that the rotors' subspaces cause.

        At the highest speed, by the energy of what the full models lack there.
        """
        row = int(speed.argmax())
        exists = np.isfinite(found.frequency[row])
        w = found.frequency[row, exists]
        shape = found.rotor[row, exists]
        defects = [one.defect(w, shape[..., rows], float(speed[row]))
                   for one, rows in zip(self.shafts.each, self.shafts.rows, strict=True)]
        kinetic = np.abs(w[:, None] * found.shape[row, exists]) ** 2
        error, energy = (np.sum(parts, axis=0) for parts in zip(*defects, strict=True))
        return float((error / (energy + kinetic.sum(axis=1))).max(initial=0.0))

    def _solve(self, speed: FloatArray, count: int, spare: int) -> Spectrum:
        whirls = {side: self.shafts.whirls(speed, zone.middle, zone.lag)
                  for side, zone in dict(zip(self._sides, self.zones, strict=True)).items()}
        parts, strays = zip(*(self._solve_zone(speed, whirls[side], zone, count + spare)
                              for side, zone in zip(self._sides, self.zones, strict=True)),
                            strict=True)
        found, astray = _merged(list(parts), count), np.concatenate(strays, axis=1)
        # What another zone tells there, as one beside it may too, is not lost.
        blur = max(zone.compliance.blur for zone in self.zones)
        gap = np.abs(astray[:, :, None] - found.frequency.real[:, None])
        told = np.fmin.reduce(gap, axis=2, initial=np.inf) <= blur
        lost = np.where(told, np.inf, astray).min(axis=1, initial=np.inf)
        return replace(found, untold=np.minimum(found.untold, lost))

    @property
    def _sides(self) -> list[tuple[float, int]]:
        """On which side of what turns with the frequency each zone is."""
        return [(zone.lag, int(np.searchsorted(self.shafts.turning_points, zone.middle)))
                for zone in self.zones]

    def nearest(self, speed: FloatArray, frequency: ComplexArray) -> tuple[Spectrum, BoolArray]:
        """
        Return the vibration at each speed that is nearest to a frequency, (n,) [rad/s] each.

        And whether there is one so near in the zone of the frequency.
        """
        parts, where, sound = list[Spectrum](), list[IntArray](), np.zeros(len(speed), dtype=bool)
        for zone in self.zones:
            low, high = zone.ends(zone.owned, speed)
            rows = np.flatnonzero((frequency.real >= low) & (frequency.real < high))
            if not len(rows):
                continue
            whirls = self.shafts.whirls(speed[rows], zone.middle, zone.lag)
            vibration = self._at(speed[rows], whirls, zone, _REACHES[0])
            found, vector, sound[rows] = vibration.nearest(frequency[rows, None])
            parts.append(self._spectrum(vibration, whirls[1], found, vector,
                                        np.full(len(rows), np.inf)))
            where.append(rows)
        order = np.argsort(np.concatenate(where))
        return Spectrum(*(np.concatenate([getattr(part, field.name) for part in parts])[order]
                          for field in fields(Spectrum))), sound

    def _solve_zone(
        self, speed: FloatArray, whirls: Whirls,
        zone: Zone, count: int,
    ) -> tuple[Spectrum, FloatArray]:
        """Return the vibrations whose frequency lies in a zone, and those just beyond it."""
        for reach in _REACHES:
            vibration = self._at(speed, whirls, zone, reach)
            frequency, vector, sound, untold = vibration.solve(
                *Guesses(vibration, self._below[id(zone.compliance)]).lowest(count))
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
        shafts, exists = self.shafts, np.isfinite(frequency)
        states = vibration.amplitudes(np.where(exists, frequency, 0.0), vector)
        turn, half = amplitude.transpose(0, 1, 3, 2), amplitude.shape[3]
        rotor = np.stack([states[..., :half] @ turn[:, 0], states[..., half:] @ turn[:, 1]],
                         axis=2)
        support = np.concatenate([
            vector[..., vector.shape[2] - len(vibration.mass):] * vibration.compliance.size,
            vibration.bent(np.where(exists, frequency, 0.0), vector)],
            axis=-1) @ self._parted[0].T
        moving = np.sqrt(shafts.mass) * rotor
        forward, backward = (np.abs(moving) ** 2).sum(axis=-1).transpose(2, 0, 1)
        values, axes = np.linalg.eigh(self.model.support.motion_mass)
        below = support @ (axes * np.sqrt(np.maximum(values, 0.0)))
        # Explicitly: -1 cannot be told where there is no mode at all.
        moving = moving.reshape(*exists.shape, math.prod(moving.shape[2:]))
        shape = np.concatenate([moving, below], axis=-1)
        share = shafts.kinetic(rotor)
        most = share.argmax(axis=-1)
        beside = 2.0 * share.max(axis=-1) > (np.abs(shape) ** 2).sum(axis=-1)
        beside &= most != shafts.each.index(shafts.own)
        return Spectrum(
            frequency, np.where(exists, np.where(forward >= backward, 1, -1), 0),
            np.where(exists & beside, 1 + most, 0),
            np.where(exists[..., None], shape, np.nan), rotor, support, untold)

    def _at(
        self, speed: FloatArray, whirls: Whirls,
        zone: Zone, reach: float,
    ) -> FreeVibration:
        inverse, right, left = whirls
        model, size = self.model, zone.compliance.size
        unit, journals = np.repeat(np.sqrt(self.shafts.springs), 2), self.shafts.journals
        constant, rate, inertia = (part / (unit[:, None] * unit)
                                   for part in model.all_bearings.series(speed, zone.between))
        held, bends = slice(0, len(size)), slice(len(size), None)
        _, rows, mass, spring = self._parted
        rows = unit[:, None] * rows
        elastic = Elastic(rows[:, bends], size[:, None] * mass[held, bends],
                          np.diagonal(mass[bends, bends]))
        return FreeVibration(
            inverse, journals @ right, journals @ left.swapaxes(2, 3), (constant, rate, inertia),
            rows[:, held] * size, size[:, None] * mass[held, held] * size,
            size[:, None] * spring[held, held] * size, elastic, zone.compliance,
            self.span[1], reach, zone.ends(zone.told, speed),
            tuple(zip(self.shafts.seats, self.shafts.modes, strict=True)),
            self.shafts.slow(constant, reach * self.span[1]))

    @cached_property
    def _below(self) -> dict[int, SupportModes]:
        """Modes of the support in each piece, which no speed changes."""
        support, unit = self.model.support, np.repeat(np.sqrt(self.shafts.springs), 2)[:, None]
        return {id(piece): SupportModes.of(
            support, piece, self.span[1], rough=True,
            rows=unit * support.motion_rows * sizes(support, piece)) for piece in self.pieces}

    @cached_property
    def _parted(self) -> tuple[ComplexArray, ComplexArray, ComplexArray, ComplexArray]:
        """Coordinates of the support as `parted`, and its rows, mass and stiffness over them."""
        support = self.model.support
        turn = parted(support)
        return (turn, support.motion_rows @ turn, turn.T @ support.motion_mass @ turn,
                turn.T @ support.motion_spring @ turn)


def _merged(parts: list[Spectrum], count: int) -> Spectrum:
    """Return at most `count` vibrations of all pieces, sorted by frequency."""
    frequency = np.concatenate([part.frequency for part in parts], axis=1)
    most = min(count, int(np.isfinite(frequency).sum(axis=1).max(initial=0)))
    order = np.argsort(frequency.real, axis=1)[:, :most]
    # The rows of one speed are reordered alike, whatever else they hold.
    rows = np.arange(len(frequency))[:, None]

    def joined(name: str) -> np.ndarray:
        return np.concatenate([getattr(part, name) for part in parts], axis=1)[rows, order]

    return Spectrum(joined('frequency'), joined('whirl'), joined('owner'), joined('shape'),
                    joined('rotor'), joined('support'),
                    np.min([part.untold for part in parts], axis=0))


def _widen(values: np.ndarray, width: int) -> np.ndarray:
    """Fill up the second axis, if there is one: with NaN, or with the 0 of no whirl."""
    if values.ndim == 1:
        return values
    missing = [(0, 0)] * values.ndim
    missing[1] = (0, width - values.shape[1])
    return np.pad(values, missing, constant_values=np.nan if values.dtype == complex else 0)
