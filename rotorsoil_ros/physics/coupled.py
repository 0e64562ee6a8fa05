"""How does a rotor vibrate on blocks that stand on soil?"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from rotorsoil_ros.physics.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from rotorsoil_ros.physics.errors import NotSolvedError, RotorSoilError
from rotorsoil_ros.physics.foundation import Foundation
from rotorsoil_ros.physics.prediction import Prediction
from rotorsoil_ros.physics.rotor import Rotor
from rotorsoil_ros.physics.soil import DOFS, SoilModel
from rotorsoil_ros.physics.support import Support
from rotorsoil_ros.physics.whirl import WhirlModes

# An unbalance at phase zero points up at t = 0 and moves toward +x: its force over (x, z),
# per moment and squared speed (Lalanne & Ferraris, sec. 1.2.5).
UNBALANCE_FORCE = np.array([-1j, 1.0])

# Speeds that are solved together: bounds memory, yet is long enough to hide Python.
_CHUNK = 2048


@dataclass(frozen=True)
class CoupledModel:
    """
    Rotor, bearings, blocks and soil.

    Attributes
    ----------
    rotor : Rotor
        What turns.
    foundations, soil_models : equally long sequences
        Blocks and the soil under each; bearings without a block stand on firm ground.

    """

    rotor: Rotor
    foundations: Sequence[Foundation] = ()
    soil_models: Sequence[SoilModel] = ()

    def __post_init__(self) -> None:
        repeated = {name for name in self.channels if self.channels.count(name) > 1}
        if repeated:
            raise RotorSoilError(f'names must differ between stations, got {min(repeated)} twice')
        _ = self.support

    @cached_property
    def support(self) -> Support:
        """The blocks below the bearings."""
        return Support(self.rotor.bearings, self.rotor.shaft_height,
                       self.foundations, self.soil_models)

    @cached_property
    def channels(self) -> tuple[str, ...]:
        """Names of all motions, in the order of the last axis of a Prediction."""
        rotor = self.rotor
        names = [f'{bearing.name}_{part}_{axis}' for bearing in rotor.bearings
                 for part in ('journal', 'housing') for axis in 'xz']
        names += [f'{station.name}_{axis}' for station in rotor.stations[len(rotor.bearings):]
                  for axis in 'xz']
        names += [f'{foundation.name}_{dof}' for foundation in self.foundations for dof in DOFS]
        return tuple(names)

    @cached_property
    def transmits_force(self) -> BoolArray:
        """Which channels transmit a force, (c,) bool: bearings and foundations."""
        stations = 2 * len(self.rotor.discs) + 2 * len(self.rotor.probes)
        return np.array([True] * (4 * len(self.rotor.bearings)) + [False] * stations
                        + [True] * (6 * len(self.foundations)))

    @cached_property
    def groups(self) -> IntArray:
        """Kind of each channel and then of each transmitted force, (w,) int: same unit, same."""
        turns = np.array([name.rsplit('_', 1)[1].startswith('r') for name in self.channels])
        return np.concatenate([turns, 2 + turns[self.transmits_force]])

    @property
    def planes(self) -> tuple[str, ...]:
        """Names of the discs, which are the unbalance planes."""
        return tuple(disc.name for disc in self.rotor.discs)

    @cached_property
    def nominal_springs(self) -> FloatArray:
        """Isotropic stiffness that stands in for each bearing in the rotor's modes [N/m]."""
        still = np.zeros(1)
        own = [np.abs(np.diagonal(bearing.dynamic_stiffness(still, still)[0])).mean()
               for bearing in self.rotor.bearings]
        # A bearing that is only a damper still has to hold the shaft in the modes.
        shaft, _, _ = self.rotor.plane_matrices
        least = 1e-3 * shaft.diagonal()[::2].max()
        return np.array([spring if spring > 0.0 else least for spring in own])

    @cached_property
    def _ports(self) -> list[int]:
        rotor = self.rotor
        return [2 * rotor.node_of(station.position) for station in rotor.stations]

    @cached_property
    def _synchronous_modes(self) -> WhirlModes:
        return WhirlModes.of(self.rotor, self._ports, springs=self.nominal_springs, order=1.0)

    def unbalance_response(self, speed: FloatArray, unbalance: ComplexArray) -> Prediction:
        """
        Solve for the response to unbalance, exactly at every speed.

        Parameters
        ----------
        speed : (n,) float array
            Rotor speed [rad/s], which is also the excitation frequency.
        unbalance : (p,) complex array
            moment * exp(i phase) of every plane [kg m].

        Returns
        -------
        Prediction
            Over `channels`.

        Raises
        ------
        NotSolvedError
            If the system is singular: an undamped resonance is hit.

        """
        loads = self.plane_forces @ np.asarray(unbalance, dtype=complex)
        displacement, force = self.synchronous_response(speed, loads[:, None])
        square = speed[:, None] ** 2
        return Prediction(speed, square * displacement[..., 0], square * force[..., 0])

    @cached_property
    def plane_forces(self) -> ComplexArray:
        """Port forces per unit unbalance of each plane and squared speed, (2 p, planes)."""
        first = len(self.rotor.bearings)
        forces = np.zeros((len(self._ports), 2, len(self.planes)), dtype=complex)
        for plane in range(len(self.planes)):
            forces[first + plane, :, plane] = UNBALANCE_FORCE
        return forces.reshape(-1, len(self.planes))

    def synchronous_response(
        self, speed: FloatArray, loads: ComplexArray,
    ) -> tuple[ComplexArray, ComplexArray]:
        """
        Solve for the response to forces on the shaft that turn once per revolution.

        Parameters
        ----------
        speed : (n,) float array
            Rotor speed and excitation frequency [rad/s].
        loads : (2 p, k) complex array
            Columns of forces over (x, z) of the ports: bearings, discs, probes [N].

        Returns
        -------
        displacement, force : (n, c, k) complex arrays
            Over `channels` [m, rad] and [N, N m]; force is NaN where none is transmitted.

        """
        speed = np.asarray(speed, dtype=float)
        shape = (len(speed), len(self.channels), loads.shape[1])
        displacement = np.empty(shape, dtype=complex)
        force = np.full(shape, complex(np.nan, np.nan))
        for start in range(0, len(speed), _CHUNK):
            chunk = slice(start, start + _CHUNK)
            displacement[chunk], force[chunk][:, self.transmits_force] = self._solve(
                speed[chunk], loads)
        if not np.all(np.isfinite(displacement)):
            raise NotSolvedError('the coupled system has no finite solution')
        return displacement, force

    def _solve(
        self, speed: FloatArray, loads: ComplexArray,
    ) -> tuple[ComplexArray, ComplexArray]:
        rotor = self._synchronous_modes.receptance(speed)
        blocks = self.support.blocks(speed)
        seats = self.support.seats(blocks)
        journals = slice(0, 2 * len(self.rotor.bearings))

        bearings = self.bearing_stiffness(speed, speed)
        springs = np.repeat(self.nominal_springs, 2)
        # Through the bearings f = Z (x_journal - seats f); what the springs in the rotor's
        # modes have not yet taken, g = f - k0 x_journal, obeys  A g = (Z - A k0) x_journal.
        a = np.eye(len(springs)) + bearings @ seats
        w = bearings - a * springs
        free = rotor.regular @ loads
        near = rotor.shapes[:, journals]
        adjoint = rotor.shapes.conj().transpose(0, 2, 1)
        count = len(springs)
        size = count + near.shape[2]
        system = np.zeros((len(speed), size, size), dtype=complex)
        system[:, :count, :count] = a + w @ rotor.regular[:, journals, journals]
        system[:, :count, count:] = -w @ near
        system[:, count:, :count] = adjoint[:, :, journals]
        system[:, range(count, size), range(count, size)] = rotor.stiffness
        right = np.concatenate([w @ free[:, journals], adjoint @ loads], axis=1)
        try:
            solution = np.linalg.solve(system, right)
        except np.linalg.LinAlgError as error:
            raise NotSolvedError('the coupled system is singular: a resonance without damping '
                                 'is hit') from error
        residual, amplitude = solution[:, :count], solution[:, count:]
        ports = free - rotor.regular[:, :, journals] @ residual + rotor.shapes @ amplitude
        through = residual + springs[:, None] * ports[:, journals]
        return self._arrange(speed, ports, through, blocks, seats)

    def _arrange(
        self, speed: FloatArray, ports: ComplexArray, through: ComplexArray,
        blocks: ComplexArray, seats: ComplexArray,
    ) -> tuple[ComplexArray, ComplexArray]:
        """Put port motion, bearing forces and block motion into the order of the channels."""
        length, _, columns = ports.shape
        bearings = len(self.rotor.bearings)
        pairs = (length, bearings, 2, columns)

        def interleave(journal: ComplexArray, housing: ComplexArray) -> ComplexArray:
            both = np.stack([journal.reshape(pairs), housing.reshape(pairs)], axis=2)
            return both.reshape(length, 4 * bearings, columns)

        motion = self.support.block_motion(blocks, through)
        into_soil = self.support.soil_force(speed, motion=motion, seat_force=through)

        def flat(block: ComplexArray) -> ComplexArray:
            return block.transpose(1, 0, 2, 3).reshape(length, -1, columns)

        displacement = np.concatenate([
            interleave(ports[:, :2 * bearings], seats @ through),
            ports[:, 2 * bearings:], flat(motion)], axis=1)
        return displacement, np.concatenate([interleave(through, through), flat(into_soil)],
                                            axis=1)

    def bearing_stiffness(self, omega: FloatArray, speed: FloatArray) -> ComplexArray:
        """Return the dynamic stiffness of all bearings, (n, 2 b, 2 b) over (x, z) of each."""
        bearings = self.rotor.bearings
        stiffness = np.zeros((len(omega), len(bearings), 2, len(bearings), 2), dtype=complex)
        for index, bearing in enumerate(bearings):
            stiffness[:, index, :, index] = bearing.dynamic_stiffness(omega, speed)
        return stiffness.reshape(len(omega), 2 * len(bearings), 2 * len(bearings))
