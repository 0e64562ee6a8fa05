"""Where free vibrations are, nearly: guesses of all of them out of a linear eigenproblem."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from rotorsoil_ros.arrays import ComplexArray, IntArray
from rotorsoil_ros.machine.modes.below import SupportModes
from rotorsoil_ros.machine.modes.eigen import FreeVibration, vibrates

# Guesses this far outside the piece of their compliance may still lead into it.
_ASIDE = 0.05


@dataclass(frozen=True)
class Guesses:
    """
    Linear stand-in for the equations of free vibration.

    Attributes
    ----------
    of : FreeVibration
        The equations.
    below : SupportModes
        Modes of its support.

    """

    of: FreeVibration
    below: SupportModes

    def pencil(self) -> tuple[ComplexArray, ComplexArray]:
        """
        Return A and B of a linear eigenproblem A y = w B y with nearly the same eigenvalues.

        Fast rotor modes answer the bearings statically and a motion of the housings with their
        gyroscopic couple and their mass; the support does by its own modes.
        """
        slow, static, first, second = self._slow
        inverse, orbits, driven = self.of.pick(slow)
        constant, linear, inertia = self.of.bearings
        below, (length, ports, modes) = self.below, orbits.shape
        heavy = ports if inertia.any() else 0
        sizes = (ports, modes, len(below.frequency), ports, ports, ports, heavy)
        ends = np.cumsum(sizes)
        force, mode, support, gap, housing, rate, swing = (
            slice(end - size, end) for size, end in zip(sizes, ends, strict=True))
        modal, own = (range(part.start, part.stop) for part in (mode, support))
        a = np.zeros((length, ends[-1], ends[-1]), dtype=complex)
        b = np.zeros_like(a)
        middle, one = 0.25 * self.of.highest, np.eye(ports)
        # Each block of rows in the order of the unknowns: bearings g = (Z - 1) gap,
        a[:, force, force] = one
        a[:, force, gap], b[:, force, gap] = one - constant, linear
        b[:, force, swing] = -middle * inertia[..., :heavy]
        a[:, swing, swing], b[:, swing, gap] = np.eye(heavy), np.eye(heavy, ports) / middle
        # the rotors' modes (1 - w / w_k) p = -S (g - h),
        a[:, mode, force], a[:, mode, housing] = driven, -driven
        a[:, modal, modal], b[:, modal, modal] = 1.0, inverse
        # the support's by forces g + gap, and the housings h that it moves, with v their rate,
        a[:, own, own], b[:, own, own] = 1.0 + below.centre * below.weight, below.weight
        a[:, support, force] = a[:, support, gap] = -below.driven
        a[:, housing, housing], a[:, housing, support] = one, -self.below.rows @ below.shape
        a[:, housing, force] = a[:, housing, gap] = -self.below.rows @ below.static
        b[:, housing, force] = b[:, housing, gap] = self.below.rows @ below.rate
        a[:, rate, rate], b[:, rate, housing] = one, one / middle
        # and what is between journals and housings.
        a[:, gap, gap], a[:, gap, mode] = one, -orbits
        a[:, gap, force], b[:, gap, force] = static, -first
        a[:, gap, housing], b[:, gap, housing] = one - static, first
        b[:, gap, rate] = middle * second
        return a, b

    @cached_property
    def _slow(self) -> tuple[IntArray, ComplexArray, ComplexArray, ComplexArray]:
        """Modes that are slow in either sense, (n, 2 k), and what others do, (n, 2 b, 2 b)."""
        inverse, _, _ = self.of.modes
        count = self.of.resonant.shape[1]
        order = np.argsort(-self.of.slowness, axis=1)
        slow = np.concatenate([self.of.resonant, order[:, order.shape[1] - count:]], axis=1)
        others = np.ones(inverse.shape)
        np.put_along_axis(others, slow, 0.0, axis=1)
        powers = others[:, None] * inverse[:, None] ** np.arange(3)[:, None]
        moments = self.of.summed(powers)
        return slow, moments[:, 0], moments[:, 1], moments[:, 2]

    def lowest(self, count: int) -> tuple[ComplexArray, ComplexArray]:
        """
        Solve the linear eigenproblem for as many modes as are wanted.

        Returns
        -------
        frequency : (n, p) complex array
            w of all that vibrates in range, ascending, filled up with NaN [rad/s].
        vector : (n, p, d) complex array
            What `FreeVibration.matrix` sends nearly to zero.

        """
        a, b = self.pencil()
        memory = np.flatnonzero(b.any(axis=(0, 1)))
        # No passive machine grows so: the inverse exists even without mass or static stiffness.
        centre = self.below.centre
        spread = np.linalg.solve(a - centre * b, b[..., memory])
        values, vectors = np.linalg.eig(spread[:, memory])
        values = np.where(np.abs(values) * self.of.highest < 1e-6, 1e-6 / self.of.highest, values)
        frequency = centre + 1.0 / values
        low, high = (end[:, None] for end in self.of.within)
        keep = (vibrates(frequency) & (np.abs(frequency) < 2.0 * self.of.highest)
                & (frequency.real > (1.0 - _ASIDE) * low)
                & (frequency.real < (1.0 + _ASIDE) * high))
        count = min(int(keep.sum(axis=1).max()), count)
        order = np.argsort(np.where(keep, frequency.real, np.inf), axis=1)[:, :count]
        full = (spread @ np.take_along_axis(vectors, order[:, None], axis=2)).transpose(0, 2, 1)
        found = np.take_along_axis(np.where(keep, frequency, np.nan), order, axis=1)
        return found, self._unknowns(np.where(np.isfinite(found), found, centre), full)

    def _unknowns(self, frequency: ComplexArray, full: ComplexArray) -> ComplexArray:
        """Return the unknowns of `matrix` out of those of the pencil, (n, p, d)."""
        ports, modes, below = len(self.of.rows), self.of.resonant.shape[1], self.below
        first, own = ports + 2 * modes, slice(len(self.of.mass))
        last = first + len(below.frequency)
        through = full[..., :ports] + full[..., last:last + ports]
        motion = full[..., first:last] @ below.shape[own].T + through @ below.static[own].T
        motion += frequency[..., None] * (through @ below.rate[own].T)
        return np.concatenate([full[..., :ports + modes], motion], axis=-1)
