"""How a rotor vibrates on blocks that stand on soil."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
import math

import numpy as np

from rotorsoil_ros.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from rotorsoil_ros.channel import ACROSS, across, Channel, DOFS, HOUSING, JOURNAL
from rotorsoil_ros.errors import NotSolvedError, OutOfTableError, require, RotorSoilError
from rotorsoil_ros.ground.soil import SoilModel
from rotorsoil_ros.machine.coupling import Answer, answer
from rotorsoil_ros.machine.foundation import Foundation
from rotorsoil_ros.machine.modes.natural import natural_frequencies
from rotorsoil_ros.machine.support import Support
from rotorsoil_ros.prediction import Prediction, Response
from rotorsoil_ros.rotor.assembly import Rotor
from rotorsoil_ros.rotor.whirl import WhirlModes
from rotorsoil_ros.units import rad_s_to_rpm

# An unbalance at phase zero points up at t = 0 and moves toward +x: its force over (x, z),
# per moment and squared speed (Lalanne & Ferraris, sec. 1.2.5).
UNBALANCE_FORCE = np.array([-1j, 1.0])

# Speeds that are solved together: bounds memory, yet is long enough to hide Python.
_CHUNK = 1024

# A mode belongs to a direction if this share of the housings' motion is in it.
_IN_DIRECTION = 0.1
_STILL = 1e-9

# Bytes of a block that is taken and given back untouched before a sweep: from then on the C
# library keeps what is freed up to that size, where it would return every temporary array above
# 128 KiB to the system and be handed it again, zeroed page by page, a quarter of the time.
_KEPT = 1 << 24


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
    couples : sequence of str
        Discs whose unbalance is also a couple: each is a plane of its own.
    points : sequence of str
        Names of the points on the ground whose motion its `SharedGround` tells, in its order.

    """

    rotor: Rotor
    foundations: Sequence[Foundation] = ()
    soil_models: Sequence[SoilModel] = ()
    couples: Sequence[str] = ()
    points: Sequence[str] = ()

    def __post_init__(self) -> None:
        discs = [disc.name for disc in self.rotor.discs]
        for name in self.couples:
            if name not in discs:
                raise RotorSoilError(f'couples must be on discs, {", ".join(discs)}, got {name}')
        repeated = {name for name in self.channels if self.channels.count(name) > 1}
        if repeated:
            raise RotorSoilError(f'names must differ between stations, got {min(repeated)} twice')
        support = self.support
        known = support.points(np.zeros(1)).shape[1] if self.points else 0
        if known != self._on_ground:
            raise RotorSoilError(f'{len(self.points)} points on the ground need a ground that '
                                 f'tells their motion, got one of {known // 3} points')

    @cached_property
    def support(self) -> Support:
        """The blocks below the bearings."""
        return Support(self.rotor.bearings, self.rotor.shaft_height,
                       self.foundations, self.soil_models)

    @cached_property
    def channels(self) -> tuple[Channel, ...]:
        """All motions, in the order of the last axis of a Prediction."""
        rotor = self.rotor
        found = [channel for bearing in rotor.bearings for part in (JOURNAL, HOUSING)
                 for channel in across(bearing.name, part)]
        found += [channel for station in rotor.stations[len(rotor.bearings):]
                  for channel in across(station.name)]
        found += [Channel(foundation.name, '', dof)
                  for foundation in self.foundations for dof in DOFS]
        found += [Channel(point, '', axis) for point in self.points for axis in DOFS[:3]]
        return tuple(found)

    @cached_property
    def transmits_force(self) -> BoolArray:
        """Which channels transmit a force, (c,) bool: bearings and foundations."""
        stations = 2 * len(self.rotor.discs) + 2 * len(self.rotor.probes)
        return np.array([True] * (4 * len(self.rotor.bearings)) + [False] * stations
                        + [True] * (6 * len(self.foundations)) + [False] * self._on_ground)

    @property
    def _on_ground(self) -> int:
        """Number of channels on the ground, the last of all."""
        return 3 * len(self.points)

    @cached_property
    def groups(self) -> IntArray:
        """Kind of each channel and then of each transmitted force, (w,) int: same unit, same."""
        turns = np.array([channel.is_rotation for channel in self.channels])
        return np.concatenate([turns, 2 + turns[self.transmits_force]])

    @property
    def planes(self) -> tuple[str, ...]:
        """Names of the unbalance planes: the discs, then couples as `<disc>_couple`."""
        return (*(disc.name for disc in self.rotor.discs),
                *(f'{name}_couple' for name in self.couples))

    @cached_property
    def nominal_springs(self) -> FloatArray:
        """Isotropic stiffness that stands in for each bearing in the rotor's modes [N/m]."""
        own = [bearing.nominal_stiffness for bearing in self.rotor.bearings]
        # A bearing that is only a damper still has to hold the shaft in the modes.
        shaft, _, _ = self.rotor.plane_matrices
        least = 1e-3 * shaft.diagonal()[::2].max()
        return np.array([spring if spring > 0.0 else least for spring in own])

    @cached_property
    def _ports(self) -> list[int]:
        rotor = self.rotor
        places = {disc.name: 2 * rotor.node_of(disc.position) for disc in rotor.discs}
        return [*(2 * rotor.node_of(station.position) for station in rotor.stations),
                *(places[name] + 1 for name in self.couples)]

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
            moment * exp(i phase) of every plane [kg m], of couples [kg m^2].

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
        """
        Port forces per unit unbalance of each plane and squared speed, (2 p, planes).

        A couple of moment m e d is an unbalance m e half of d toward +y and its opposite half of
        d toward -y. In the plane of z it exerts the couple d F_z about +x, in the plane of x the
        couple d F_x about -z: on the slopes what an unbalance exerts on the deflections.
        """
        discs = len(self.rotor.discs)
        first = [len(self.rotor.bearings), len(self.rotor.stations) - discs]
        forces = np.zeros((len(self._ports), 2, len(self.planes)), dtype=complex)
        for plane in range(len(self.planes)):
            forces[first[plane >= discs] + plane, :, plane] = UNBALANCE_FORCE
        return forces.reshape(2 * len(self._ports), len(self.planes))

    def frequency_response(
        self, omega: FloatArray, *, speed: float, channel: str,
    ) -> Response:
        """
        Solve for the response to a unit harmonic force while the rotor turns at fixed speed.

        Parameters
        ----------
        omega : (n,) float array
            Excitation frequency [rad/s].
        speed : float
            Rotor speed [rad/s], 0 for an impact test at rest.
        channel : str
            Where and in which direction the force acts, one of `channels`: 1 N, or 1 N m about
            an axis of a foundation.

        Raises
        ------
        NotSolvedError
            If the system is singular: an undamped resonance is hit.

        """
        omega = np.asarray(omega, dtype=float)
        modes = WhirlModes.at(self.rotor, self._ports, springs=self.nominal_springs, speed=speed,
                              highest=float(np.abs(omega).max(initial=0.0)))
        return self._forced(modes, omega, np.full(len(omega), float(speed)), channel)

    def harmonic_response(
        self, speed: FloatArray, *, order: float, channel: str,
    ) -> Response:
        """
        Solve for the response to a unit harmonic force at a multiple of the speed.

        Parameters
        ----------
        speed : (n,) float array
            Rotor speed [rad/s]: it sets gyroscopic couples and the tables of bearings.
        order : float
            Excitation frequency over speed: it sets inertia, damping and soil.
        channel : str
            As in `frequency_response`.

        """
        require(0.0 < order < math.inf, 'order', '> 0 and finite', order)
        speed = np.asarray(speed, dtype=float)
        modes = WhirlModes.of(self.rotor, self._ports, springs=self.nominal_springs, order=order)
        return self._forced(modes, order * speed, speed, channel)

    def _forced(
        self, modes: WhirlModes, omega: FloatArray, speed: FloatArray, channel: str,
    ) -> Response:
        loaded = self.channels[:len(self.channels) - self._on_ground]
        if channel not in loaded:
            raise RotorSoilError(f'force must act at one of {", ".join(loaded)}, got {channel}')
        load = np.zeros((len(self.channels), 1), dtype=complex)
        load[self.channels.index(channel)] = 1.0
        displacement, force = self._respond(modes, omega, speed, self._sorted(load))
        return Response(self.channels, speed, omega, displacement[..., 0], force[..., 0])

    def _sorted(self, loads: ComplexArray) -> ComplexArray:
        """Put loads on the channels, (c, k), into the order of ports, housings and blocks."""
        loads = loads[:len(loads) - self._on_ground]
        bearings = 4 * len(self.rotor.bearings)
        blocks = len(loads) - 6 * len(self.foundations)
        seats = loads[:bearings].reshape(-1, 2, 2, loads.shape[1])
        journal, housing = (seats[:, part].reshape(-1, loads.shape[1]) for part in (0, 1))
        slopes = np.zeros((2 * len(self.couples), loads.shape[1]))
        return np.concatenate([journal, loads[bearings:blocks], slopes, housing, loads[blocks:]])

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
            Columns of forces over (x, z) of the ports: bearings, discs, probes [N], then of
            couples on the slopes of discs [N m].

        Returns
        -------
        displacement, force : (n, c, k) complex arrays
            Over `channels` [m, rad] and [N, N m]; force is NaN where none is transmitted.

        """
        speed = np.asarray(speed, dtype=float)
        return self._respond(self._synchronous_modes, speed, speed, self._on_rotor(loads))

    def _on_rotor(self, loads: ComplexArray) -> ComplexArray:
        """Extend loads on the ports by none on housings and blocks."""
        below = 2 * len(self.rotor.bearings) + 6 * len(self.foundations)
        return np.concatenate([loads, np.zeros((below, loads.shape[1]))])

    def _respond(
        self, modes: WhirlModes, omega: FloatArray, speed: FloatArray, loads: ComplexArray,
    ) -> tuple[ComplexArray, ComplexArray]:
        """Solve, some frequencies at a time, and sort by channel: (n, c, k) each."""
        np.empty(_KEPT, dtype=np.uint8)
        shape = (len(omega), len(self.channels), loads.shape[1])
        displacement = np.empty(shape, dtype=complex)
        force = np.full(shape, complex(np.nan, np.nan))
        for start in range(0, len(omega), _CHUNK):
            chunk = slice(start, start + _CHUNK)
            found = answer(
                modes.receptance(omega[chunk]), self.support.standing(omega[chunk]), loads,
                bearings=self.bearing_stiffness(omega[chunk], speed[chunk]),
                springs=np.repeat(self.nominal_springs, 2))
            displacement[chunk], force[chunk][:, self.transmits_force] = self._arrange(found)
        if not np.all(np.isfinite(displacement)):
            raise NotSolvedError('the coupled system has no finite solution')
        return displacement, force

    def _arrange(self, found: Answer) -> tuple[ComplexArray, ComplexArray]:
        """Put the answer into the order of the channels."""
        length, _, columns = found.ports.shape
        bearings, stations = len(self.rotor.bearings), len(self.rotor.stations)
        pairs = (length, bearings, 2, columns)

        def interleave(journal: ComplexArray, housing: ComplexArray) -> ComplexArray:
            both = np.stack([journal.reshape(pairs), housing.reshape(pairs)], axis=2)
            return both.reshape(length, 4 * bearings, columns)

        displacement = np.concatenate([
            interleave(found.ports[:, :2 * bearings], found.housings),
            found.ports[:, 2 * bearings:2 * stations], found.blocks, found.ground], axis=1)
        return displacement, np.concatenate([
            interleave(found.through, found.through), found.into_soil], axis=1)

    def lowest_natural_frequency(self, axis: str, highest: float) -> float:
        """
        Return the lowest frequency of machine and support in a direction, the rotor being rigid.

        Parameters
        ----------
        axis : str
            `x` or `z`, in which the housings move.
        highest : float
            Up to which to look, as far as the soil is known [rad/s].

        Returns
        -------
        float
            [rad/s]; infinite where there is none, as on a rigid support.

        References
        ----------
        ISO 20816-1: the class of a support goes by the lowest natural frequency of the combined
        machine and support in the direction of measurement; shaft bending is none of it.

        """
        column = ACROSS.index(axis)
        frequency, motion = natural_frequencies(self.support, self._riding_mass, highest)
        power = np.abs(motion).reshape(len(motion), len(self.rotor.bearings), 2) ** 2
        total = power.sum(axis=(1, 2))
        # A block that slides along the shaft moves no housing across it, but for round-off.
        moves = ((power[..., column].sum(axis=1) >= _IN_DIRECTION * total)
                 & (total > _STILL * total.max(initial=0.0)))
        return float(frequency[moves].min(initial=math.inf))

    @cached_property
    def _riding_mass(self) -> FloatArray:
        """Mass of the rotor as a rigid body on its housings, (2 b, 2 b) [kg]."""
        rotor = self.rotor
        _, mass, _ = rotor.plane_matrices
        places = rotor.node_positions
        rigid = np.stack([np.column_stack([np.ones_like(places), np.zeros_like(places)]).ravel(),
                          np.column_stack([places, np.ones_like(places)]).ravel()], axis=1)
        seats = np.array([[1.0, bearing.position] for bearing in rotor.bearings])
        # Of three bearings and more the line that fits best.
        follows = np.linalg.pinv(seats)
        plane = follows.T @ (rigid.T @ mass @ rigid) @ follows
        return np.kron(plane, np.eye(2))

    def within_tables(self, span: tuple[float, float]) -> tuple[float, float]:
        """
        Return the part of a span of speeds [rad/s] that all tables of bearings hold.

        Raises
        ------
        OutOfTableError
            If they hold none of it.

        """
        ranges = [bearing.speed_range for bearing in self.rotor.bearings]
        low = max([span[0], *(first for first, _ in ranges)])
        high = min([span[1], *(last for _, last in ranges)])
        if not low <= high:
            raise OutOfTableError(
                f'tables of bearings must hold some speed of {rad_s_to_rpm(span[0]):g} to '
                f'{rad_s_to_rpm(span[1]):g} rpm, there is none that all of them hold')
        return low, high

    def bearing_coefficients(self, speed: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return stiffness and damping of all bearings, (n, 2 b, 2 b) over (x, z) of each."""
        bearings = self.rotor.bearings
        # Without tables one row stands for all speeds, at no cost.
        rows = speed if any(math.isfinite(one.speed_range[0]) for one in bearings) else speed[:1]
        stiffness, damping = (np.zeros((len(rows), 2 * len(bearings), 2 * len(bearings)))
                              for _ in range(2))
        for index, bearing in enumerate(bearings):
            pair = slice(2 * index, 2 * index + 2)
            stiffness[:, pair, pair], damping[:, pair, pair] = bearing.coefficients(rows)
        shape = (len(speed), *stiffness.shape[1:])
        return np.broadcast_to(stiffness, shape), np.broadcast_to(damping, shape)

    def bearing_stiffness(self, omega: FloatArray, speed: FloatArray) -> ComplexArray:
        """Return the dynamic stiffness of all bearings, (n, 2 b, 2 b) over (x, z) of each."""
        stiffness, damping = self.bearing_coefficients(speed)
        return np.asarray(stiffness + (1j * omega)[:, None, None] * damping)
