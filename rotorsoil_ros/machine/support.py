"""How the bearing housings move under the forces that the bearings put into them."""

from dataclasses import dataclass
from functools import cached_property
import math

import numpy as np
import scipy.linalg

from rotorsoil_ros.arrays import ComplexArray, FloatArray, side_by_side
from rotorsoil_ros.errors import OutOfTableError, RotorSoilError
from rotorsoil_ros.ground.bed import as_one, below_patches
from rotorsoil_ros.ground.soil import SharedGround, SoilModel
from rotorsoil_ros.ground.table import ComplianceTable
from rotorsoil_ros.machine.flexible.points import SupportPoints
from rotorsoil_ros.machine.flexible.receptance import SeatReceptance
from rotorsoil_ros.machine.foundation import BlockReceptance, soils_below
from rotorsoil_ros.machine.standing import Below, OnBlocks, OnBodies, Standing
from rotorsoil_ros.units import rad_s_to_hz


@dataclass(frozen=True)
class Support(SupportPoints):
    """Blocks on soil, and pedestals on them, below the bearings."""

    def __post_init__(self) -> None:
        _ = self.soils
        if self.foundations and self.table is not None:
            raise RotorSoilError('foundations must be none on receptances of seats, which hold '
                                 f'them, got {len(self.foundations)}')
        names = {foundation.name for foundation in self.foundations}
        for bearing in self.bearings:
            if bearing.foundation is not None and bearing.foundation not in names:
                raise RotorSoilError(f'foundation of {bearing.name} must be one of '
                                     f'{sorted(names)}, got {bearing.foundation}')

    @cached_property
    def soils(self) -> tuple[SoilModel, ...]:
        """What each block stands on, as if the others were not loaded."""
        return tuple(map(as_one, soils_below(self.foundations, self.soil_models)))

    @property
    def _shared(self) -> SharedGround | None:
        """The ground below all blocks, if it is one."""
        first = self.soil_models[0] if len(self.soil_models) == 1 else None
        return first if isinstance(first, SharedGround) else None

    def ground(self, omega: FloatArray) -> ComplexArray:
        """Return the compliance of the ground under all contacts, (n, c, c), six of a block."""
        if self._shared is not None:
            return self._on_grounded(self._on_grounded(
                self._shared.compliance(omega)).swapaxes(1, 2))
        found = [model.compliance(omega) for model in self.soil_models]
        return side_by_side(found, len(omega))

    def _on_grounded(self, own: ComplexArray) -> ComplexArray:
        """Return columns (n, k, 6 g) of what stands on the ground among those of all contacts."""
        if not self.is_stacked:
            return own
        total = np.zeros((*own.shape[:2], self.contacts), dtype=complex)
        total[..., np.setdiff1d(np.arange(self.contacts), self.stacked[0])] = own
        return total

    def points(self, omega: FloatArray) -> ComplexArray:
        """Return the motion of points on the ground per load of the blocks, (n, 3 p, 6 f)."""
        if self._shared is not None:
            return self._on_grounded(self._shared.point_motion(omega))
        return np.zeros((len(omega), 0, self.transmitting), dtype=complex)

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

    def standing(self, omega: FloatArray) -> Standing:
        """Return how the support answers forces at frequencies (n,) [rad/s]."""
        below: Below = OnBodies(self, omega) if self.bends or self.is_stacked else OnBlocks(
            self, omega, BlockReceptance.of(self.ground(omega), self.block_mass, omega))
        return Standing(self, omega, below, self.pedestals(omega) + below.seats)

    @cached_property
    def turns(self) -> tuple[FloatArray, ...]:
        """
        Contacts and elastic coordinates of each part per motion of the support, (own, s).

        What stands on a foundation moves with it; then all springs together are those of a free
        body again: none between contacts and elastic coordinates, a unit one for each of these.
        """
        if not self.members:
            return ()
        contacts = np.split(np.arange(self.contacts), np.cumsum(
            [len(part.contacts) for part in self.members], dtype=int)[:-1])
        counts = [len(part.on_contacts.mass) - len(part.contacts) for part in self.members]
        first, size = self.contacts + len(self.pedestal_axes), self._size
        elastic = np.split(np.arange(first, size), np.cumsum(counts, dtype=int)[:-1])
        found = [np.eye(size)[np.append(*own)] for own in zip(contacts, elastic, strict=True)]
        for below in self._from_below:
            places = self.members[below].on_contacts.rows[self.members[below].places[3]]
            moved = places @ found[below]
            for index in self.above[below]:
                count = len(contacts[index])
                found[index][:count] += moved[:count]
                moved = moved[count:]
        if not self.is_stacked:
            return tuple(found)
        springs = sum((turn.T @ part.on_contacts.spring.real @ turn for part, turn in zip(
            self.members, found, strict=True)), np.zeros((size, size)))
        held, unit = springs[first:, first:], np.eye(size)
        unit[first:, :first] = -np.linalg.solve(held, springs[first:, :first])
        unit[first:, first:] = np.linalg.inv(np.linalg.cholesky(held)).T
        return tuple(turn @ unit for turn in found)

    @property
    def _from_below(self) -> list[int]:
        """Foundations that carry others, each behind that on which it stands."""
        order = [index for index, one in enumerate(self.foundations) if one.on is None]
        for index in order:
            order += self.above[index]
        return [index for index in order if self.above[index]]

    @cached_property
    def _size(self) -> int:
        return len(self.pedestal_axes) + sum(
            len(part.on_contacts.mass) for part in self.members)

    @property
    def elastic(self) -> int:
        """How many of the motions of the support, the last, are on unit springs of their own."""
        return self._size - self.contacts - len(self.pedestal_axes)

    @cached_property
    def point_motion(self) -> FloatArray:
        """Motion of seats, contacts and probes per motion of the support, (p, s)."""
        rows = np.zeros((len(self.point_rows), self._size))
        for part, points, turn in zip(
                self.members, self.point_indices, self.turns, strict=True):
            rows[points] = part.on_contacts.rows @ turn
        return rows

    @cached_property
    def motion_rows(self) -> FloatArray:
        """
        Housing motion per motion of the support, (2 b, s).

        The motion of the support is that of its contacts, then the deflection of its pedestals,
        then the elastic coordinates of its foundations.
        """
        rows = self.point_motion[:2 * len(self.bearings)].copy()
        pedestals = slice(self.contacts, self.contacts + len(self.pedestal_axes))
        rows[self.pedestal_axes, pedestals] = np.eye(len(self.pedestal_axes))
        return rows

    @cached_property
    def motion_mass(self) -> FloatArray:
        """Mass matrix of the motion of the support, (s, s)."""
        rows = self.motion_rows
        total = np.asarray(rows.T @ self.housing_mass @ rows)
        for part, turn in zip(self.members, self.turns, strict=True):
            total += turn.T @ part.on_contacts.mass @ turn
        return total

    @cached_property
    def bent_springs(self) -> tuple[ComplexArray, ...]:
        """Stiffness of each foundation over the motion of the support, (s, s)."""
        return tuple(turn.T @ part.on_contacts.spring @ turn
                     for part, turn in zip(self.members, self.turns, strict=True))

    @cached_property
    def motion_spring(self) -> ComplexArray:
        """Stiffness of the motion of the support beside its compliance, (s, s): of what bends."""
        # The elastic coordinates' own unit springs belong to the compliance.
        units = np.arange(self._size) >= self._size - self.elastic
        return np.asarray(sum(self.bent_springs, -np.diag(units.astype(complex))))

    def motion_compliance(self, omega: FloatArray) -> ComplexArray:
        """Return the compliance of soils and pedestals without mass, (n, c, c)."""
        axes = np.array(self.pedestal_axes, dtype=int)
        return side_by_side([self.ground(omega), self.pedestals(omega)[:, axes[:, None], axes]],
                            len(omega))

    def answers(self, omega: float) -> bool:
        """Return whether every soil knows its compliance at a frequency [rad/s]."""
        try:
            return bool(np.all(np.isfinite(self.motion_compliance(np.array([omega])))))
        except OutOfTableError:
            return False

    @property
    def reach(self) -> tuple[float, float]:
        """Between which frequencies files say what stands below [rad/s]; endless without one."""
        rows = [one.omega for own in self.soil_models for one in below_patches(own)
                if isinstance(one, (ComplianceTable, SeatReceptance))]
        return (max((float(omega[0]) for omega in rows), default=0.0),
                min((float(omega[-1]) for omega in rows), default=math.inf))

    def within(self, span: tuple[float, float]) -> tuple[float, float]:
        """
        Return the part of a span of frequencies [rad/s] that files below hold.

        Raises
        ------
        OutOfTableError
            If they hold none of it.

        """
        low, high = max(span[0], self.reach[0]), min(span[1], self.reach[1])
        if not low <= high:
            raise OutOfTableError(
                f'the file of the support must hold some of {rad_s_to_hz(span[0]):g} to '
                f'{rad_s_to_hz(span[1]):g} Hz, got {rad_s_to_hz(self.reach[0]):g} to '
                f'{rad_s_to_hz(self.reach[1]):g} Hz')
        return low, high

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

        within = min(highest, self.reach[1])
        while not self.answers(within) and within > 1e-6 * highest:
            within *= 0.5
        return edge(within, 0.0), edge(within, highest)
