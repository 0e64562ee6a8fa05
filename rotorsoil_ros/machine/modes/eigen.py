"""Complex frequencies at which rotor, bearings and support vibrate without a force."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from rotorsoil_ros.arrays import AnyArray, BoolArray, ComplexArray, FloatArray, IntArray
from rotorsoil_ros.ground.continuation import Continuation
from rotorsoil_ros.machine.modes.below import Elastic
from rotorsoil_ros.rotor.whirl import ORBITS

# Frequencies w = lambda / i with less real part than this share of |w| do not vibrate: they
# creep back, and a hysteretic soil alone gives such ones a little of it.
CREEPING = 0.2

# A vibration with less damping than this is felt: its amplification factor is above 2.5.
FELT_BELOW = 0.2

# Newton's iteration stops at this relative step, whose square is the error left.
_CONVERGED = 1e-7
_ITERATIONS = 12

# Steps of inverse iteration after which what is near a frequency is all that is left.
_INVERSE = 3

# A guess that moves farther, relative to itself, was hardly one of this mode.
_NEAR_GUESS = 0.05

# Two vectors are one from this cosine on, at frequencies equal within the steps.
_SAME = 0.999


@dataclass(frozen=True)
class FreeVibration:
    """
    Machine at some speeds, in units in which every nominal bearing spring is one.

    Attributes
    ----------
    inverse : (n, 2, 2 r) float or complex array
        1 / w of the rotor's forward and backward whirl modes on nominal springs [s].
    journals, driven : (n, 2, b, 2 r) float or complex arrays
        Their deflection at the bearings, and how much forces there drive them.
    bearings : three (n, 2 b, 2 b) complex arrays
        The series of `Bearings.series`, a + w b - w^2 c over (x, z) of each.
    rows : (2 b, s) complex array
        Housing motion per motion of the support.
    mass : (s, s) complex array
        Of the support.
    spring : (s, s) complex array
        Its stiffness beside the compliance: of foundations that bend.
    compliance : Continuation
        Of the support without its mass.
    highest : float
        Frequency up to which modes are looked for [rad/s].
    reach : float
        Rotor modes up to this many times `highest` are unknowns of their own.
    elastic : Elastic
        What bends of its foundations; forces act on it where they act on the housings.
    within : tuple of two (n,) float arrays
        Frequencies between which all this holds [rad/s].
    shafts : tuple of (slice, int array)
        Which of the bearings, and of the modes forward then backward, are those of each shaft.
    slow : int
        So many motions of the rotors on their real bearings are within `reach`.

    """

    inverse: AnyArray
    journals: AnyArray
    driven: AnyArray
    bearings: tuple[ComplexArray, ComplexArray, ComplexArray]
    rows: ComplexArray
    mass: ComplexArray
    spring: ComplexArray
    elastic: Elastic
    compliance: Continuation
    highest: float
    reach: float
    within: tuple[FloatArray, FloatArray]
    shafts: tuple[tuple[slice, IntArray], ...]
    slow: int

    @cached_property
    def modes(self) -> tuple[AnyArray, ComplexArray, ComplexArray]:
        """
        Return all whirl modes, forward then backward.

        Inverse frequencies (n, m), orbits of the journals (n, 2 b, m), and how much forces there
        drive each (n, m, 2 b).
        """
        count = len(self.inverse)
        orbits, driven = (
            np.moveaxis(own[:, :, :, None] * turn[None, :, None, :, None], 1, 3)
            .reshape(count, len(self.rows), -1)
            for own, turn in ((self.journals, ORBITS), (self.driven, ORBITS.conj())))
        return self.inverse.reshape(count, -1), orbits, driven.transpose(0, 2, 1)

    @cached_property
    def slowness(self) -> FloatArray:
        """How long each takes, (n, m) [s]; negative of what does not swing the right way."""
        inverse, _, _ = self.modes
        size = np.abs(inverse)
        return np.where(inverse.real > -CREEPING * size, size, -size)

    @cached_property
    def resonant(self) -> IntArray:
        """Rotor modes that may resonate, (n, k): they are unknowns of their own."""
        count = int((self.slowness * self.highest * self.reach > 1.0).sum(axis=1).max())
        # Where a bearing is softer one way than its nominal spring a forward and a backward one
        # make what is slow there.
        count = min(count + 2 * max(self.slow - count, 0), self.slowness.shape[1])
        return np.argsort(-self.slowness, axis=1)[:, :count]

    def pick(
        self, modes: IntArray,
    ) -> tuple[AnyArray, ComplexArray, ComplexArray]:
        """Return some of these, (n, k) of each speed."""
        inverse, orbits, driven = self.modes
        return (np.take_along_axis(inverse, modes, axis=1),
                np.take_along_axis(orbits, modes[:, None], axis=2),
                np.take_along_axis(driven, modes[:, :, None], axis=1))

    @cached_property
    def _residues(self) -> list[ComplexArray]:
        """Of each shaft, (n, m, 4 b^2): no mode moves the journals of another."""
        _, orbits, driven = self.modes
        found: list[ComplexArray] = []
        for seats, modes in self.shafts:
            ports = slice(2 * seats.start, 2 * seats.stop)
            pairs = (orbits[:, ports, modes].transpose(0, 2, 1)[..., None]
                     * driven[:, modes, None, ports])
            found.append(pairs.reshape(*pairs.shape[:2], -1))
        return found

    def summed(self, weights: AnyArray) -> ComplexArray:
        """Return the journals' receptance by modes of weights (n, p, m), (n, p, 2 b, 2 b)."""
        total = np.zeros((*weights.shape[:2], len(self.rows), len(self.rows)), dtype=complex)
        for (seats, modes), residues in zip(self.shafts, self._residues, strict=True):
            ports, count = slice(2 * seats.start, 2 * seats.stop), 2 * (seats.stop - seats.start)
            flat = weights[..., modes] @ residues
            total[..., ports, ports] = flat.reshape(*weights.shape[:2], count, count)
        return total

    def _gains(self, frequency: ComplexArray) -> ComplexArray:
        """Return 1 / (1 - w / omega_k) of modes that cannot resonate, else 0, (n, p, m)."""
        inverse, _, _ = self.modes
        stiffness = 1.0 - frequency[..., None] * inverse[:, None]
        np.put_along_axis(stiffness, self.resonant[:, None], np.inf, axis=2)
        return np.asarray(1.0 / stiffness)

    def _moves(
        self, frequency: ComplexArray,
    ) -> tuple[ComplexArray, ComplexArray, ComplexArray, ComplexArray]:
        """
        Return gap and housing motion over the unknowns, housing motion and mass of the support.

        What bends moves the housings by X f besides, f being the force through the bearings.
        """
        _, orbits, _ = self.pick(self.resonant)
        ports = len(self.rows)
        gives, bent, mass = self.elastic.follows(frequency)
        rows, less = self.rows + bent, self.summed(self._gains(frequency)) - np.eye(ports)
        gap = np.concatenate([
            -np.eye(ports) - less + less @ gives,
            np.broadcast_to(orbits[:, None], (*frequency.shape, *orbits.shape[1:])),
            less @ rows], axis=-1)
        if self.elastic.mass.size:
            gap = np.linalg.solve(np.eye(ports) - less @ gives, gap)
        housing = gives @ (gap + np.eye(ports, gap.shape[-1]))
        housing[..., gap.shape[-1] - rows.shape[-1]:] += rows
        return gap, housing, rows, self.mass + mass

    def matrix(self, frequency: ComplexArray) -> ComplexArray:
        """
        Return the matrix that is singular at an eigenvalue.

        Parameters
        ----------
        frequency : (n, p) complex array
            w = lambda / i [rad/s].

        Returns
        -------
        (n, p, d, d) complex array
            Over the forces g of the bearings beyond their nominal springs, the amplitudes p
            of resonant rotor modes, and the motion z of the support.

        """
        inverse, orbits, driven = self.pick(self.resonant)
        _, ports, modes = orbits.shape
        own = len(self.mass)
        w = frequency[..., None, None]
        one = np.eye(ports)
        constant, rate, inertia = (part[:, None] for part in self.bearings)
        extra = constant + w * rate - w**2 * inertia - one
        compliance = self.compliance(frequency)
        gap, housing, rows, mass = self._moves(frequency)
        through = gap + np.eye(ports, gap.shape[-1])
        force, mode = slice(0, ports), slice(ports, ports + modes)
        modal, motion = range(ports, ports + modes), slice(ports + modes, None)
        total = np.zeros((*frequency.shape, gap.shape[-1], gap.shape[-1]), dtype=complex)
        # Bearings g = (Z - 1) gap; modes (1 - w / w_k) p = -S (g - Y z), S driven; support
        # z = N (Y^T (g + gap) + (w^2 M - K) z), where the compliance N may be zero.
        total[..., force, :] = np.eye(ports, gap.shape[-1]) - extra @ gap
        total[..., mode, :] = driven[:, None] @ (np.eye(ports, gap.shape[-1]) - housing)
        total[..., modal, modal] += 1.0 - frequency[..., None] * inverse[:, None]
        total[..., motion, :] = -(compliance @ rows.swapaxes(-2, -1)) @ through
        total[..., motion, motion] += np.eye(own) + compliance @ (self.spring - w**2 * mass)
        return total

    def solve(
        self, guess: ComplexArray, vector: ComplexArray,
    ) -> tuple[ComplexArray, ComplexArray, BoolArray, FloatArray]:
        """
        Solve for the frequencies next to guesses (n, p), NaN where there is none [rad/s].

        Parameters
        ----------
        guess, vector : (n, p), (n, p, d) complex arrays
            As `Guesses.lowest`.

        Returns
        -------
        frequency : (n, p) complex array
            w [rad/s], NaN where there are fewer.
        vector : (n, p, d) complex array
            What `matrix` sends to zero.
        sound : (n,) bool array
            Whether every guess has led to a mode of its own.
        untold : (n,) float array
            Lowest frequency of a light vibration that is left out, as its compliance is not
            determined [rad/s]; infinite where there is none.

        """
        exists = np.isfinite(guess)
        frequency = np.where(exists, guess, self.highest)
        wanted: BoolArray = exists & self.compliance.agrees(frequency)
        light = exists & ~wanted & (np.abs(frequency.imag) < FELT_BELOW * np.abs(frequency))
        untold = np.where(light, frequency.real, np.inf).min(axis=1, initial=np.inf)
        # Those that are solved for first, in their order; no others.
        order = np.argsort(~wanted, axis=1, kind='stable')[:, :wanted.sum(axis=1).max(initial=0)]
        guess, frequency, wanted = (np.take_along_axis(one, order, axis=1)
                                    for one in (guess, frequency, wanted))
        vector = np.take_along_axis(vector, order[..., None], axis=1)
        vector[~wanted] = 1.0
        # What a rough fit says far from the real axis may have no mode near its guess.
        doubtful = self.compliance.is_rough & (guess.imag > FELT_BELOW * np.abs(guess))
        active: BoolArray = wanted.copy()
        for _ in range(_ITERATIONS):
            step, vector = self._newton(frequency, vector)
            frequency = frequency + np.where(wanted, step, 0.0)
            active &= np.abs(step) > _CONVERGED * np.abs(frequency)
            active &= ~(doubtful & self._left(guess, frequency))
            if not active.any():
                break
        moved = wanted & self._left(guess, frequency)
        frequency = np.where(wanted & ~active & vibrates(frequency), frequency, np.nan)
        # What has left its own guess does not take that of another.
        unsound = active | moved | _repeats(np.where(moved, np.nan, frequency), vector)
        frequency = np.where(unsound & doubtful, np.nan, frequency)
        unsound &= ~doubtful
        return frequency, vector, np.asarray(~unsound.any(axis=1)), untold

    @staticmethod
    def _left(guess: ComplexArray, frequency: ComplexArray) -> BoolArray:
        """Return which have moved too far to be what was guessed."""
        return np.asarray(np.abs(frequency - guess) > _NEAR_GUESS * np.abs(frequency))

    def nearest(self, frequency: ComplexArray) -> tuple[ComplexArray, ComplexArray, BoolArray]:
        """
        Solve for the vibrations next to frequencies (n, 1), by inverse iteration first.

        Returns
        -------
        frequency (n, 1), vector (n, 1, d) : complex arrays
            As `solve`.
        sound : (n,) bool array
            Whether each is near.

        """
        guess, near = frequency, self.matrix(frequency * (1.0 + 1e-9j))
        vector = np.ones((*frequency.shape, near.shape[-1]), dtype=complex)
        for _ in range(_INVERSE):
            vector = np.linalg.solve(near, vector[..., None])[..., 0]
            vector /= np.linalg.norm(vector, axis=-1, keepdims=True)
        for _ in range(_ITERATIONS):
            step, vector = self._newton(frequency, vector)
            frequency = frequency + step
            active = np.abs(step) > _CONVERGED * np.abs(frequency)
            if not active.any():
                break
        return frequency, vector, np.asarray(~(active | self._left(guess, frequency))[:, 0])

    def _newton(
        self, frequency: ComplexArray, vector: ComplexArray,
    ) -> tuple[ComplexArray, ComplexArray]:
        """Return the step of every frequency and its next vector."""
        # A little beside: at an eigenvalue itself the matrix has no inverse.
        shift = 1e-7 * np.abs(frequency)
        near = self.matrix(frequency + shift)
        slope = (self.matrix(frequency + 2.0 * shift) - near) / shift[..., None, None]
        vector = vector / np.linalg.norm(vector, axis=-1, keepdims=True)
        change = np.linalg.solve(near, slope @ vector[..., None])[..., 0]
        along = (vector.conj() * change).sum(axis=-1)
        return shift - 1.0 / along, change / along[..., None]

    def bent(self, frequency: ComplexArray, vector: ComplexArray) -> ComplexArray:
        """Return the elastic coordinates of the foundations, (n, p, e)."""
        gap, _, _, _ = self._moves(frequency)
        through = (gap @ vector[..., None])[..., 0] + vector[..., :len(self.rows)]
        return self.elastic.motion(
            frequency, through, vector[..., vector.shape[-1] - len(self.mass):])

    def amplitudes(self, frequency: ComplexArray, vector: ComplexArray) -> ComplexArray:
        """Return the amplitudes of all rotor modes, forward then backward, (n, p, m)."""
        _, _, driven = self.modes
        ports, modes = len(self.rows), self.resonant.shape[1]
        _, housing, _, _ = self._moves(frequency)
        load = (housing @ vector[..., None])[..., 0] - vector[..., :ports]
        forced = self._gains(frequency) * (load @ driven.transpose(0, 2, 1))
        np.put_along_axis(forced, self.resonant[:, None],
                          vector[..., ports:ports + modes], axis=2)
        return forced


def _repeats(frequency: ComplexArray, vector: ComplexArray) -> BoolArray:
    """Return which modes have been found before in their row, (n, p)."""
    unit = vector / np.linalg.norm(vector, axis=-1, keepdims=True)
    parallel = np.abs(unit.conj() @ unit.transpose(0, 2, 1)) > _SAME
    gap = np.abs(frequency[:, :, None] - frequency[:, None])
    same = gap <= 2.0 * _CONVERGED * np.abs(frequency)[:, None]
    return np.asarray(np.tril(parallel & same, -1).any(axis=2))


def vibrates(frequency: ComplexArray) -> BoolArray:
    """Return which eigenvalues vibrate at all; overdamped ones have no frequency."""
    return np.asarray(frequency.real > CREEPING * np.abs(frequency))
