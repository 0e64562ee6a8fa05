"""What a shaft does that no spring and no mass does: it loses energy, gives some, and twists."""

from dataclasses import dataclass

import numpy as np

from rotorsoil_ros.arrays import ComplexArray, FloatArray

# Forward and backward whirl, in the order of every axis of directions.
WHIRL_DIRECTIONS = (1, -1)


@dataclass(frozen=True, slots=True)
class Losses:
    """
    Damping of a rotor and the torque in it, in one plane or in a subspace of it.

    In whirl of direction d = +1 or -1 and frequency w, at rotor speed Omega, they exert
    i (w - d Omega) viscous + i sign(w - d Omega) hysteretic + i w (fixed - i d coupled)
    - i d torsion, on top of stiffness and mass.

    Attributes
    ----------
    viscous, hysteretic : (m, m) float arrays
        Of the material, which turns with the shaft [N s/m], [N/m].
    fixed : (m, m) float array
        Of what does not turn [N s/m].
    torsion, coupled : (m, m) float arrays
        What the torque makes of a motion in one plane in the other one [N/m], and the damping in
        proportion to it [N s/m].

    References
    ----------
    Zorzi & Nelson (1977), J. Eng. Power 99, p. 71, for material that loses in proportion to its
    rate of strain or to its strain; Genta (2005), Dynamics of Rotating Systems, ch. 3, for the
    sign of the latter; Zorzi & Nelson (1980), J. Mech. Des. 102, p. 158, for the torque.

    """

    viscous: FloatArray
    hysteretic: FloatArray
    fixed: FloatArray
    torsion: FloatArray
    coupled: FloatArray

    @property
    def does(self) -> tuple[bool, bool, bool]:
        """Whether its material, what does not turn, and the torque exert anything."""
        return (bool(self.viscous.any() or self.hysteretic.any()), bool(self.fixed.any()),
                bool(self.torsion.any()))

    @property
    def is_hysteretic(self) -> bool:
        """Whether what it exerts depends on which of whirl and rotor is faster."""
        return bool(self.hysteretic.any())

    @property
    def _parts(self) -> tuple[FloatArray, ...]:
        return (self.viscous, self.hysteretic, self.fixed, self.torsion, self.coupled)

    def within(self, shapes: FloatArray) -> 'Losses':
        """Return the same in coordinates of some shapes, (m, r)."""
        return Losses(*(shapes.T @ part @ shapes for part in self._parts))

    def bent(self, shapes: FloatArray) -> FloatArray:
        """Return all that it exerts on some shapes, (m, k r)."""
        return np.concatenate([part @ shapes for part in self._parts if part.any()], axis=1)

    def held(self, direction: int, *, speed: float, lag: float) -> ComplexArray:
        """
        Return what it exerts on a motion, whatever the frequency, (m, m).

        Parameters
        ----------
        direction : int
            +1 of forward, -1 of backward whirl.
        speed : float
            Of the rotor [rad/s].
        lag : float
            Sign of whirl frequency less rotor speed in forward whirl: -1, 0 or 1.

        """
        sign = lag if direction > 0 else 1.0
        return np.asarray(1j * (sign * self.hysteretic - direction * (
            self.torsion + speed * self.viscous)))

    def rate(self, direction: int) -> ComplexArray:
        """Return what it exerts on a motion per frequency, (m, m)."""
        return np.asarray(1j * (self.viscous + self.fixed) + direction * self.coupled)

    def turning(self, direction: int) -> ComplexArray:
        """Return how what it exerts changes with the speed, (m, m)."""
        return np.asarray(-1j * direction * self.viscous)

    def following(self, direction: int, *, order: float) -> tuple[ComplexArray, ComplexArray]:
        """Return `held` and `rate` where the frequency is the speed times an order."""
        constant = self.held(direction, speed=0.0, lag=float(np.sign(order - 1.0)))
        return constant, self.rate(direction) + self.turning(direction) / order

    def exerted(
        self, direction: int, motion: ComplexArray, *, w: ComplexArray, speed: FloatArray,
    ) -> ComplexArray:
        """
        Return what it exerts against a whirl, part by part.

        Parameters
        ----------
        direction : int
            As `held`.
        motion : (n, m) complex array
            Amplitudes of motions exp(i w t).
        w : (n,) complex array
            Their frequencies, damped frequency + i decay [rad/s].
        speed : (n,) float array
            Of the rotor [rad/s].

        Returns
        -------
        (3, n, m) complex array
            By the material, by what does not turn and by the torque.

        """
        turned = (w - direction * speed)[:, None]
        return np.stack([
            1j * turned * (motion @ self.viscous.T)
            + 1j * np.sign(turned.real) * (motion @ self.hysteretic.T),
            1j * w[:, None] * (motion @ self.fixed.T),
            direction * (w[:, None] * (motion @ self.coupled.T)
                         - 1j * (motion @ self.torsion.T))])


def receding(
    stiffness: ComplexArray, rate: ComplexArray, mass: FloatArray, unit: float,
) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
    """
    Resolve (stiffness + w rate - w^2 mass)^-1 into modes.

    Parameters
    ----------
    stiffness, rate, mass : (..., m, m) complex, complex and float arrays
        The stiffness must have an inverse, the mass need not.
    unit : float
        Frequency that makes motions and their rates alike [rad/s].

    Returns
    -------
    inverse : (..., 2 m) complex array
        1 / w_k of every mode [s].
    right, left : (..., m, 2 m), (..., 2 m, m) complex arrays
        The inverse is the sum of right left / (1 - w / w_k).

    Notes
    -----
    With v = (x, w x / unit) and G = [[-K^-1 C, unit K^-1 M], [1 / unit, 0]] the problem reads
    (1 - w G) v = (K^-1 f, 0): linear in w whatever has no mass.

    """
    size, sets = stiffness.shape[-1], stiffness.shape[:-2]
    one = np.broadcast_to(np.eye(size), stiffness.shape)
    both = np.linalg.solve(stiffness, np.concatenate(
        [-rate, np.broadcast_to(unit * mass, stiffness.shape), one], axis=-1))
    step = np.zeros((*sets, 2 * size, 2 * size), dtype=complex)
    step[..., :size, :], step[..., size:, :size] = both[..., :2 * size], one / unit
    inverse, vectors = np.linalg.eig(step)
    own = np.broadcast_to(np.eye(2 * size, size), (*sets, 2 * size, size))
    left = np.linalg.solve(vectors, own) @ both[..., 2 * size:]
    return inverse, vectors[..., :size, :], left
