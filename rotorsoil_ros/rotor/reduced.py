"""The few shapes that carry the shaft, at rest and turning."""

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import scipy.linalg

from rotorsoil_ros.arrays import AnyArray, FloatArray
from rotorsoil_ros.rotor.assembly import Rotor
from rotorsoil_ros.rotor.losses import Losses, receding, WHIRL_DIRECTIONS
from rotorsoil_ros.rotor.whirl import held, spinning

# Shapes that are this close to a combination of others add nothing but round-off.
_DEPENDENT = 1e-8


Whirls: TypeAlias = tuple[AnyArray, AnyArray, AnyArray]


@dataclass(frozen=True)
class ReducedRotor:
    """
    Rotor on isotropic springs in a subspace of its shapes in one plane.

    Coordinates are such that the stiffness matrix is the identity and the mass matrix diagonal.

    Attributes
    ----------
    shapes : (2 k, r) float array
        Deflections and slopes per coordinate.
    mass : (r,) float array
        Diagonal of the mass matrix, 1 / omega^2 of the coordinate [s^2].
    polar : (r, r) float array
        Polar inertia, which couples the planes [s^2].
    losses : Losses or None
        What the shaft does besides, in these coordinates.

    """

    shapes: FloatArray
    mass: FloatArray
    polar: FloatArray
    losses: Losses | None = None

    @classmethod
    def of(cls, rotor: Rotor, springs: FloatArray, *, count: int) -> 'ReducedRotor':
        """
        Choose the subspace.

        Parameters
        ----------
        rotor : Rotor
            Shaft and discs.
        springs : (b,) float array
            Isotropic stiffness put in place of each bearing [N/m].
        count : int
            Modes at rest that are kept.

        Notes
        -----
        Besides the modes at rest it holds what their gyroscopic couples bend statically, and
        what forces at the bearings bend, quasi-statically: the error of a frequency falls with
        the fourth power and more of its distance from the modes that are left out.

        """
        stiffness, mass, polar = held(rotor, springs)
        size = len(stiffness)
        count = min(count, size)
        _, modes = scipy.linalg.eigh(mass, stiffness, subset_by_index=[size - count, size - 1])
        factor = scipy.linalg.cho_factor(stiffness)
        rows = [2 * rotor.node_of(bearing.position) for bearing in rotor.bearings]
        bent = scipy.linalg.cho_solve(factor, np.eye(size)[:, sorted(set(rows))])
        quick = scipy.linalg.cho_solve(factor, mass @ bent)
        couples = [polar @ modes] + ([] if rotor.losses is None else [rotor.losses.bent(modes)])
        turned = scipy.linalg.cho_solve(factor, np.concatenate(couples, axis=1))
        upper = np.triu(factor[0])
        candidates = upper @ np.concatenate([modes, turned, bent, quick], axis=1)
        length = np.linalg.norm(candidates, axis=0)
        basis, sizes, _ = np.linalg.svd(
            candidates[:, length > 0.0] / length[length > 0.0], full_matrices=False)
        shapes = scipy.linalg.solve_triangular(upper, basis[:, sizes > _DEPENDENT * sizes[0]])
        inertia, turn = np.linalg.eigh(shapes.T @ mass @ shapes)
        shapes = shapes @ turn
        return cls(shapes, np.maximum(inertia, 0.0), shapes.T @ polar @ shapes,
                   None if rotor.losses is None else rotor.losses.within(shapes))

    def spin(self, speed: FloatArray) -> tuple[FloatArray, FloatArray]:
        """
        Solve for forward whirl at fixed speeds.

        Parameters
        ----------
        speed : (n,) float array
            Rotor speed [rad/s].

        Returns
        -------
        inverse : (n, 2 r) float array
            1 / omega of each whirl mode [s]; negative ones whirl backward.
        amplitude : (n, r, 2 r) float array
            Their coordinates, normalised to unit energy.

        """
        inverse, vectors = np.linalg.eigh(spinning(self.mass, self.polar, speed))
        return inverse, vectors[:, :len(self.mass)]

    def whirls(
        self, speed: FloatArray, lag: float,
    ) -> Whirls:
        """
        Solve for forward and backward whirl at fixed speeds.

        Parameters
        ----------
        speed : (n,) float array
            Rotor speed [rad/s].
        lag : float
            Sign of whirl frequency less rotor speed, which a hysteretic shaft asks for.

        Returns
        -------
        inverse : (n, 2, 2 r) float or complex array
            1 / w of each whirl mode [s]; what has a negative real part is no mode.
        right, left : (n, 2, r, 2 r), (n, 2, 2 r, r) float or complex arrays
            Their coordinates, and how much forces on the coordinates drive them.

        """
        if self.losses is None:
            values, shapes = self.spin(speed)
            right = np.stack([shapes, shapes], axis=1)
            return np.stack([values, -values], axis=1), right, right.swapaxes(2, 3)
        one = np.eye(len(self.mass))
        stiffness = np.array([[one + self.losses.held(direction, speed=place, lag=lag)
                               for direction in WHIRL_DIRECTIONS] for place in speed.tolist()])
        rate = np.array([[self.losses.rate(direction) + direction * place * self.polar
                          for direction in WHIRL_DIRECTIONS] for place in speed.tolist()])
        return receding(stiffness, rate, np.diag(self.mass), float(self.mass.max() ** -0.5))

