"""How foundations that bend follow the forces at the bearings and what they stand on."""

from dataclasses import dataclass

import numpy as np
import scipy.linalg

from rotorsoil_ros.arrays import BoolArray, ComplexArray, FloatArray


@dataclass(frozen=True)
class Elastic:
    """
    Coordinates y of foundations that bend, each on a spring of its own.

    They obey (k - w^2 m) y = E^T f + w^2 M^T z, with f the force through the bearings and z the
    motion of the support otherwise, so that they need not be unknowns.

    Attributes
    ----------
    rows : (2 b, e) float array
        E, housing motion per each.
    coupling : (s, e) float array
        M, mass between each and the motion of the support.
    mass : (e,) float array
        m of each.
    spring : (e,) complex array
        k of each, with its loss.

    """

    rows: FloatArray
    coupling: FloatArray
    mass: FloatArray
    spring: ComplexArray

    def gains(self, frequency: ComplexArray) -> ComplexArray:
        """Return what each moves per force, (n, p, e)."""
        return np.asarray(1.0 / (self.spring - frequency[..., None] ** 2 * self.mass))

    def follows(
        self, frequency: ComplexArray,
    ) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
        """
        Return what they add at complex frequencies (n, p) [rad/s].

        Housing motion per force (n, p, 2 b, 2 b) and per motion of the support (n, p, 2 b, s),
        and dynamic mass of that motion, (n, p, s, s).
        """
        gains, square = self.gains(frequency)[..., None, :], frequency[..., None, None] ** 2
        driven = self.rows * gains
        return (driven @ self.rows.T, square * (driven @ self.coupling.T),
                square * ((self.coupling * gains) @ self.coupling.T))

    def motion(
        self, frequency: ComplexArray, through: ComplexArray, support: ComplexArray,
    ) -> ComplexArray:
        """Return the coordinates under forces (n, p, 2 b) and motions (n, p, s), (n, p, e)."""
        force = through @ self.rows + frequency[..., None] ** 2 * (support @ self.coupling)
        return self.gains(frequency) * force

    def slow(self, highest: float) -> BoolArray:
        """Return which may resonate below a frequency [rad/s], (e,)."""
        return np.asarray(self.spring.real < highest**2 * self.mass)

    def joined(
        self, rows: FloatArray, mass: FloatArray, spring: ComplexArray, *, highest: float,
    ) -> tuple[FloatArray, FloatArray, ComplexArray, ComplexArray]:
        """
        Return a support with what bends slowly as motions of its own, and the rest at rest.

        Parameters
        ----------
        rows, mass, spring : (2 b, s), (s, s), (s, s) arrays
            Of the support.
        highest : float
            What may resonate below is slow [rad/s].

        Returns
        -------
        rows (2 b, k), mass (k, k), spring (k, k), gives (2 b, 2 b)
            The last is housing motion per force by what is fast; springs of slow ones are not in.

        """
        slow = self.slow(highest)
        coupling, fast = self.coupling[:, slow], self.rows[:, ~slow]
        return (np.concatenate([rows, self.rows[:, slow]], axis=1),
                np.block([[mass, coupling], [coupling.T, np.diag(self.mass[slow])]]),
                scipy.linalg.block_diag(spring, np.zeros((slow.sum(),) * 2)),
                np.asarray((fast / self.spring[~slow]) @ fast.T))
