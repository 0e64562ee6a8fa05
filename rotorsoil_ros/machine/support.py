"""How the bearing housings move under the forces that the bearings put into them."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
import math

import numpy as np
import scipy.linalg

from rotorsoil_ros.arrays import ComplexArray, FloatArray
from rotorsoil_ros.errors import OutOfTableError, RotorSoilError
from rotorsoil_ros.ground.continuation import Continuation, typical_size
from rotorsoil_ros.ground.soil import (
    below_each,
    second_opinion_of,
    SharedGround,
    singular_of,
    SoilModel,
)
from rotorsoil_ros.machine.foundation import BlockReceptance, carrying, Foundation
from rotorsoil_ros.machine.placement import AT_ORIGIN, Placement
from rotorsoil_ros.rotor.bearing import Bearing

# Samples from which the compliance is continued, and those of a piece between branch points.
_SAMPLES = 120
_PIECE_SAMPLES = 48

# A piece is longer than this share of the highest frequency.
_NO_PIECE = 1e-6
# Relative to its end: in a shorter one no vibration is told, only the response.
_NARROW = 0.03


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
    place : Placement
        Where the shaft of the bearings lies.
    burden : (6 f, 6 f) float array or None
        Mass that rides on the blocks besides, as a rigid part of them [kg].

    """

    bearings: Sequence[Bearing]
    shaft_height: float
    foundations: Sequence[Foundation]
    soil_models: Sequence[SoilModel]
    place: Placement = AT_ORIGIN
    burden: FloatArray | None = None

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
        own = np.asarray(scipy.linalg.block_diag(
            np.zeros((0, 0)), *(block.mass_matrix for block in self.foundations)))
        return own if self.burden is None else own + self.burden

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
                        position=bearing.position, height=self.shaft_height, place=self.place)
        return rows

    @cached_property
    def firm_rows(self) -> FloatArray:
        """Motion per unit motion (x, y, z) of the ground, (2 b, 3), of what stands on no block."""
        on_ground = replace(self.place, x=0.0, y=0.0).seat_rows(
            position=0.0, height=0.0, centre=(0.0, 0.0))[:, :3]
        return np.concatenate([np.zeros((0, 3)), *(
            on_ground * (bearing.foundation is None) for bearing in self.bearings)])

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

    @property
    def _other(self) -> Callable[[FloatArray], ComplexArray] | None:
        """What a second opinion says of the same, where some soil has one."""
        others = tuple(map(second_opinion_of, self.soil_models))
        if all(other is own for other, own in zip(others, self.soil_models, strict=True)):
            return None
        return replace(self, soil_models=others).motion_compliance

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
        return Continuation.of(omega, self.motion_compliance, other=self._other)

    def _singular(self, span: tuple[float, float]) -> FloatArray:
        """Return the branch points of all soils inside a span, rising [rad/s]."""
        low, high = span
        found = np.unique(np.concatenate([np.zeros(0), *map(singular_of, self.soil_models)]))
        return np.asarray(found[(found > low + _NO_PIECE * high)
                                & (found < (1.0 - _NO_PIECE) * high)])

    def continued_by_pieces(self, span: tuple[float, float]) -> tuple[Continuation, ...]:
        """
        Return continuations between the frequencies where the soil has branch points.

        Each is fitted to frequencies of its own piece alone and holds for vibrations whose
        frequency lies in it; all have one size. Between two branch points so close that no
        function could be told from the next, there is none.
        """
        (low, high), singular = span, self._singular(span)
        if not singular.size:
            return (self.continued(span),)
        edges = np.concatenate([[low], singular, [high]])
        edges = edges[np.diff(edges, prepend=-math.inf) > _NO_PIECE * high]
        edges[-1] = high
        along = 0.5 * (1.0 - np.cos(np.pi * np.arange(_PIECE_SAMPLES) / (_PIECE_SAMPLES - 1)))
        samples = [left + (right - left) * along for left, right in pairwise(edges.tolist())
                   if right - left > _NARROW * right]
        size = typical_size(self.motion_compliance(np.concatenate(samples)))
        return tuple(Continuation.of(
            omega, self.motion_compliance, size, self._other,
            (float(omega[0]), float(omega[-1]))) for omega in samples)


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

    def pushed(
        self, loads: ComplexArray, ground: FloatArray,
    ) -> tuple[ComplexArray, ComplexArray]:
        """
        Return what moves while the bearings exert nothing.

        Parameters
        ----------
        loads : (2 b + 6 f, k) complex array
            Forces on the housings, then on each block [N, N m].
        ground : (3, k) float array
            Motion of the ground along x, y, z where nothing stands on it, everywhere alike [m].

        Returns
        -------
        housings (n, 2 b, k), blocks (n, 6 f, k) : complex arrays
            Motion of the housings; that of the blocks without the housings' forces [m, rad].

        References
        ----------
        Seed paper, eqs. (4) and (5), for the motion of the ground: the block follows it as far
        as its own inertia lets it, (I - omega^2 N M)^-1 u_g, which needs no inverse of N.

        """
        count = self.receptance.shape[1]
        if not loads.any() and not ground.any():  # the usual case, at no cost
            return (np.zeros((1, count, loads.shape[1]), dtype=complex),
                    np.zeros((1, len(loads) - count, loads.shape[1]), dtype=complex))
        support = self.support
        blocks = self.block_receptance.motion(loads[None, count:])
        firm = support.firm_rows @ ground
        if ground.any():
            moves = np.tile(np.concatenate([ground, np.zeros_like(ground)]),
                            (len(support.foundations), 1))
            follows = carrying(support.ground(self.omega), support.block_mass, self.omega)
            blocks = blocks + np.linalg.solve(follows, moves)
        seats = support.block_rows @ blocks + firm
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
