"""How the bearing housings move under the forces that the bearings put into them."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
import math

import numpy as np
import scipy.linalg

from rotorsoil_ros.arrays import ComplexArray, FloatArray
from rotorsoil_ros.errors import OutOfTableError, RotorSoilError
from rotorsoil_ros.ground.rational import Continuation
from rotorsoil_ros.ground.soil import below_each, SharedGround, SoilModel
from rotorsoil_ros.machine.foundation import BlockReceptance, carrying, Foundation
from rotorsoil_ros.rotor.bearing import Bearing

# Samples from which the compliance is continued.
_SAMPLES = 120

# Poles of the soil that weigh less are noise of its fit.
_NOISE = 1e-4

# What hardly swings, |Re w| below this share of |w|, has no natural frequency.
_CREEPING = 0.2


@dataclass(frozen=True)
class Support:
    """
    Blocks on soil, and pedestals on them, below the bearings.

    Attributes
    ----------
    bearings : sequence of Bearing
        What stands on the blocks.
    shaft_height : float
        Of the bearings above the contact plane [m].
    foundations : sequence of Foundation
        The blocks.
    soil_models : sequence of SoilModel
        The soil under each, or one `SharedGround` under all of them.

    """

    bearings: Sequence[Bearing]
    shaft_height: float
    foundations: Sequence[Foundation]
    soil_models: Sequence[SoilModel]

    def __post_init__(self) -> None:
        _ = self.soils
        names = {foundation.name for foundation in self.foundations}
        for bearing in self.bearings:
            if bearing.foundation is not None and bearing.foundation not in names:
                raise RotorSoilError(f'foundation of {bearing.name} must be one of '
                                     f'{sorted(names)}, got {bearing.foundation}')

    @cached_property
    def soils(self) -> tuple[SoilModel, ...]:
        """What each block stands on, as if the others were not loaded."""
        return below_each(self.soil_models, len(self.foundations))

    @property
    def _shared(self) -> SharedGround | None:
        """The ground below all blocks, if it is one."""
        first = self.soil_models[0] if len(self.soil_models) == 1 else None
        return first if isinstance(first, SharedGround) else None

    def ground(self, omega: FloatArray) -> ComplexArray:
        """Return the compliance of the ground under all blocks, (n, 6 f, 6 f)."""
        if self._shared is not None:
            return self._shared.compliance(omega)
        size = 6 * len(self.soil_models)
        total = np.zeros((len(omega), size, size), dtype=complex)
        for index, model in enumerate(self.soil_models):
            own = slice(6 * index, 6 * index + 6)
            total[:, own, own] = model.compliance(omega)
        return total

    def points(self, omega: FloatArray) -> ComplexArray:
        """Return the motion of points on the ground per load of the blocks, (n, 3 p, 6 f)."""
        if self._shared is not None:
            return self._shared.point_motion(omega)
        return np.zeros((len(omega), 0, 6 * len(self.foundations)), dtype=complex)

    @cached_property
    def block_mass(self) -> FloatArray:
        """Mass matrix of all blocks, (6 f, 6 f)."""
        return np.asarray(scipy.linalg.block_diag(
            np.zeros((0, 0)), *(block.mass_matrix for block in self.foundations)))

    @cached_property
    def seat_rows(self) -> FloatArray:
        """
        Seat motion per unit block motion, (f, 2 b, 6), zero where a bearing stands elsewhere.

        References
        ----------
        The matrix T of the congruence X_B = T q, which needs no inverse of the flexibility
        of the seed paper's eq. (7): with three collinear bearings that one is singular.

        """
        rows = np.zeros((len(self.foundations), 2 * len(self.bearings), 6))
        for block, foundation in enumerate(self.foundations):
            for seat, bearing in enumerate(self.bearings):
                if bearing.foundation == foundation.name:
                    rows[block, 2 * seat:2 * seat + 2] = foundation.seat_rows(
                        position=bearing.position, height=self.shaft_height)
        return rows

    @cached_property
    def block_rows(self) -> FloatArray:
        """Seat motion per unit motion of all blocks, (2 b, 6 f)."""
        return self.seat_rows.transpose(1, 0, 2).reshape(2 * len(self.bearings), -1)

    @cached_property
    def _seat_pairs(self) -> FloatArray:
        """Products of the motion of two seats per unit motion of the blocks, (6 f, 6 f, 4 b^2)."""
        pairs = np.einsum('pi,qj->ijpq', self.block_rows, self.block_rows)
        return np.asarray(pairs.reshape(*pairs.shape[:2], math.prod(pairs.shape[2:])))

    @cached_property
    def pedestal_axes(self) -> list[int]:
        """Those of the housings' (x, z) that have a pedestal of their own below them."""
        return [2 * index + axis for index, bearing in enumerate(self.bearings)
                if bearing.pedestal is not None for axis in range(2)]

    @cached_property
    def housing_mass(self) -> FloatArray:
        """Mass of the housings over (x, z) of each, (2 b, 2 b) [kg]."""
        own = [bearing.pedestal.mass for bearing in self.bearings if bearing.pedestal is not None]
        total = np.zeros((2 * len(self.bearings), 2 * len(self.bearings)))
        total[np.ix_(self.pedestal_axes, self.pedestal_axes)] = scipy.linalg.block_diag(*own)
        return total

    def pedestals(self, omega: FloatArray) -> ComplexArray:
        """Return the compliance of all pedestals, (n, 2 b, 2 b); zero where one is rigid."""
        total = np.zeros((len(omega), *self.housing_mass.shape), dtype=complex)
        for index, bearing in enumerate(self.bearings):
            if bearing.pedestal is not None:
                pair = slice(2 * index, 2 * index + 2)
                total[:, pair, pair] = bearing.pedestal.compliance(omega)
        return total

    def standing(self, omega: FloatArray) -> 'Standing':
        """Return how the support answers forces at frequencies (n,) [rad/s]."""
        blocks = BlockReceptance.of(self.ground(omega), self.block_mass, omega)
        deflection = self.pedestals(omega)
        deflection += blocks.between(self._seat_pairs).reshape(-1, *deflection.shape[1:])
        return Standing(self, omega, blocks, deflection)

    @cached_property
    def motion_rows(self) -> FloatArray:
        """
        Housing motion per motion of the support, (2 b, s).

        The motion of the support is that of its blocks, then the deflection of its pedestals.
        """
        seats = self.block_rows
        return np.concatenate([seats, np.eye(len(seats))[:, self.pedestal_axes]], axis=1)

    @cached_property
    def motion_mass(self) -> FloatArray:
        """Mass matrix of the motion of the support, (s, s)."""
        rows = self.motion_rows
        total = np.asarray(rows.T @ self.housing_mass @ rows)
        blocks = len(self.block_mass)
        total[:blocks, :blocks] += self.block_mass
        return total

    def motion_compliance(self, omega: FloatArray) -> ComplexArray:
        """Return the compliance of soils and pedestals without any mass, (n, s, s)."""
        size, blocks = len(self.motion_mass), 6 * len(self.foundations)
        total = np.zeros((len(omega), size, size), dtype=complex)
        total[:, :blocks, :blocks] = self.ground(omega)
        axes = np.array(self.pedestal_axes, dtype=int)
        total[:, blocks:, blocks:] = self.pedestals(omega)[:, axes[:, None], axes]
        return total

    def answers(self, omega: float) -> bool:
        """Return whether every soil knows its compliance at a frequency [rad/s]."""
        try:
            return bool(np.all(np.isfinite(self.motion_compliance(np.array([omega])))))
        except OutOfTableError:
            return False

    def known(self, highest: float) -> tuple[float, float]:
        """Return the part of 0 to `highest` [rad/s] for which every soil gives an answer."""
        def edge(inside: float, outside: float) -> float:
            if self.answers(outside):
                return outside
            while abs(outside - inside) > 1e-4 * highest:
                middle = 0.5 * (inside + outside)
                known = self.answers(middle)
                inside, outside = (middle, outside) if known else (inside, middle)
            return inside

        within = highest
        while not self.answers(within) and within > 1e-6 * highest:
            within *= 0.5
        return edge(within, 0.0), edge(within, highest)

    def continued(self, span: tuple[float, float]) -> Continuation:
        """Return the compliance without any mass, continued from frequencies in a span."""
        low, high = span
        omega = np.unique(np.concatenate([
            np.linspace(low, high, _SAMPLES // 2),
            np.geomspace(max(low, 1e-3 * high), high, _SAMPLES // 2)]))
        return Continuation.of(omega, self.motion_compliance)

    def natural_frequencies(
        self, carried: FloatArray, highest: float,
    ) -> tuple[FloatArray, ComplexArray]:
        """
        Return how the support vibrates under bodies that are rigid themselves.

        Parameters
        ----------
        carried : (2 b, 2 b) float array
            Mass over (x, z) of the housings [kg].
        highest : float
            Frequency up to which to look, as far as the soil is known [rad/s].

        Returns
        -------
        frequency : (m,) float array
            |lambda| of what vibrates, rising [rad/s].
        motion : (m, 2 b) complex array
            Of the housings.

        """
        if not len(self.motion_mass):
            return np.zeros(0), np.zeros((0, len(carried)), dtype=complex)
        span = self.known(highest)
        compliance = self.continued(span)
        size, unit, soil = compliance.size, 0.5 * span[1], compliance.states(_NOISE)
        rows = self.motion_rows * size
        mass = size[:, None] * self.motion_mass * size + rows.T @ carried @ rows
        own, states = len(mass), len(soil.poles)
        # z = constant p + left xi, w xi = poles xi + right p, p = w^2 M z with w z = unit u.
        a = np.zeros((2 * own + states,) * 2, dtype=complex)
        b = np.zeros_like(a)
        motion, rate, state = slice(0, own), slice(own, 2 * own), slice(2 * own, None)
        a[motion, motion], a[motion, state] = np.eye(own), -soil.left
        b[motion, rate] = unit * soil.constant @ mass
        a[rate, rate], b[rate, motion] = unit * np.eye(own), np.eye(own)
        a[state, state] = np.diag(soil.poles)
        b[state, rate], b[state, state] = -unit * soil.right @ mass, np.eye(states)
        frequency, vectors = scipy.linalg.eig(a, b)
        finite = np.isfinite(frequency)
        frequency, vectors = frequency[finite], vectors[:, finite]
        chosen = np.flatnonzero((frequency.real > _CREEPING * np.abs(frequency))
                                & (np.abs(frequency) <= span[1]))
        chosen = chosen[np.argsort(np.abs(frequency[chosen]))]
        return np.abs(frequency[chosen]), (rows @ vectors[motion, chosen]).T


@dataclass(frozen=True)
class Standing:
    """
    Support at some frequencies.

    Attributes
    ----------
    support : Support
        What it is.
    omega : (n,) float array
        Excitation frequency [rad/s].
    block_receptance : BlockReceptance
        Of all blocks on the ground.
    deflection : (n, 2 b, 2 b) complex array
        Motion of the housings per force into their pedestals [m/N].

    """

    support: Support
    omega: FloatArray
    block_receptance: BlockReceptance
    deflection: ComplexArray

    @cached_property
    def receptance(self) -> ComplexArray:
        """
        Motion of the housings over (x, z) of each per force on them, (n, 2 b, 2 b) [m/N].

        A pedestal is a compliance in series with that of its seat, and carries the housing.
        """
        return self._carried(self.deflection)

    def _carried(self, motion: ComplexArray) -> ComplexArray:
        """Return what the mass of the housings makes of their motion, (n, 2 b, k)."""
        mass = self.support.housing_mass
        if not mass.any():  # the usual case, at no cost
            return motion
        return np.linalg.solve(carrying(self.deflection, mass, self.omega), motion)

    def pushed(self, loads: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
        """
        Return what moves while the bearings exert nothing.

        Parameters
        ----------
        loads : (2 b + 6 f, k) complex array
            Forces on the housings, then on each block [N, N m].

        Returns
        -------
        housings (n, 2 b, k), blocks (n, 6 f, k) : complex arrays
            Motion of the housings; that of the blocks without the housings' forces [m, rad].

        """
        count = self.receptance.shape[1]
        if not loads.any():  # the usual case, at no cost
            return (np.zeros((1, count, loads.shape[1]), dtype=complex),
                    np.zeros((1, len(loads) - count, loads.shape[1]), dtype=complex))
        blocks = self.block_receptance.motion(loads[None, count:])
        seats = self.support.block_rows @ blocks
        return self._carried(seats + self.deflection @ loads[:count]), blocks

    def blocks(
        self, through: ComplexArray, housings: ComplexArray, loads: ComplexArray,
        pushed: ComplexArray,
    ) -> tuple[ComplexArray, ComplexArray]:
        """
        Return motion and soil force of the blocks, each (n, 6 f, k) [m, rad], [N, N m].

        What enters the soil is the force at the seats, the load and the block's inertia; the
        compliance, which may be zero, is not inverted for it.

        Parameters
        ----------
        through, housings : (n, 2 b, k) complex arrays
            Force through the bearings [N] and motion of the housings [m].
        loads, pushed : (2 b + 6 f, k), (n, 6 f, k) complex arrays
            As in `pushed`, and its second result.

        """
        square = self.omega[:, None, None] ** 2
        count = through.shape[1]
        seats = through + loads[:count]
        if self.support.housing_mass.any():
            seats = seats + square * (self.support.housing_mass @ housings)
        at_seats = self.support.block_rows.T @ seats
        motion = pushed + self.block_receptance.motion(at_seats)
        return motion, at_seats + loads[count:] + square * (self.support.block_mass @ motion)
