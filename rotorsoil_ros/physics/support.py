"""How do the bearing housings move under the forces that the bearings put into them?"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from rotorsoil_ros.physics.arrays import ComplexArray, FloatArray
from rotorsoil_ros.physics.errors import RotorSoilError
from rotorsoil_ros.physics.foundation import Foundation, add_mass
from rotorsoil_ros.physics.rotor import Bearing
from rotorsoil_ros.physics.soil import SoilModel


@dataclass(frozen=True)
class Support:
    """
    Blocks on soil below the bearings.

    Attributes
    ----------
    bearings : sequence of Bearing
        What stands on the blocks.
    shaft_height : float
        Of the bearings above the contact plane [m].
    foundations, soil_models : equally long sequences
        The blocks and the soil under each.

    """

    bearings: Sequence[Bearing]
    shaft_height: float
    foundations: Sequence[Foundation]
    soil_models: Sequence[SoilModel]

    def __post_init__(self) -> None:
        if len(self.foundations) != len(self.soil_models):
            raise RotorSoilError(f'{len(self.foundations)} foundations need as many soil models, '
                                 f'got {len(self.soil_models)}')
        names = {foundation.name for foundation in self.foundations}
        for bearing in self.bearings:
            if bearing.foundation is not None and bearing.foundation not in names:
                raise RotorSoilError(f'foundation of {bearing.name} must be one of '
                                     f'{sorted(names)}, got {bearing.foundation}')

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

    def blocks(self, omega: FloatArray) -> ComplexArray:
        """Return the receptance of each block at its contact centre, (f, n, 6, 6) [m/N]."""
        return np.array([
            add_mass(model.compliance(omega), foundation.mass_matrix, omega)
            for foundation, model in zip(self.foundations, self.soil_models, strict=True)
        ], dtype=complex).reshape(-1, len(omega), 6, 6)

    def seats(self, blocks: ComplexArray) -> ComplexArray:
        """Return the receptance between the seats, (n, 2 b, 2 b) over (x, z) of each [m/N]."""
        rows = self.seat_rows
        return np.asarray((rows[:, None] @ blocks @ rows.transpose(0, 2, 1)[:, None]).sum(axis=0))

    def block_motion(self, blocks: ComplexArray, seat_force: ComplexArray) -> ComplexArray:
        """Return block motion, (f, n, 6, p), under forces into the seats, (n, 2 b, p) [N]."""
        return np.asarray(blocks @ (self.seat_rows.transpose(0, 2, 1)[:, None] @ seat_force))

    def soil_force(
        self, omega: FloatArray, *, motion: ComplexArray, seat_force: ComplexArray,
    ) -> ComplexArray:
        """
        Return the force of each block on the soil, (f, n, 6, p) [N, N m].

        It is what enters at the seats plus the block's inertia; the compliance, which may be
        zero, is not inverted for it.
        """
        masses = np.array([foundation.mass_matrix for foundation in self.foundations])
        masses = masses.reshape(-1, 6, 6)
        inertia = omega[:, None, None] ** 2 * (masses[:, None] @ motion)
        return np.asarray(self.seat_rows.transpose(0, 2, 1)[:, None] @ seat_force + inertia)
