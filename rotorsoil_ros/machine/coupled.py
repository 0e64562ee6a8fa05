"""How a rotor vibrates on blocks that stand on soil."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
import math
from typing import TypeVar

import numpy as np

from rotorsoil_ros.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from rotorsoil_ros.channel import Channel, DOFS
from rotorsoil_ros.errors import NotSolvedError, require, RotorSoilError
from rotorsoil_ros.ground.soil import SoilModel
from rotorsoil_ros.machine.bearings import Bearings
from rotorsoil_ros.machine.coupling import Answer, answer
from rotorsoil_ros.machine.foundation import Foundation
from rotorsoil_ros.machine.placement import AT_ORIGIN, Placement
from rotorsoil_ros.machine.support import Support
from rotorsoil_ros.prediction import Prediction, Response
from rotorsoil_ros.rotor.assembly import Rotor
from rotorsoil_ros.rotor.whirl import WhirlModes

# An unbalance at phase zero points up at t = 0 and moves toward +x: its force over (x, z),
# per moment and squared speed (Lalanne & Ferraris, sec. 1.2.5).
UNBALANCE_FORCE = np.array([-1j, 1.0])

# Speeds that are solved together: bounds memory, yet is long enough to hide Python.
_CHUNK = 1024

# Bytes of a block that is taken and given back untouched before a sweep: from then on the C
# library keeps what is freed up to that size, where it would return every temporary array above
# 128 KiB to the system and be handed it again, zeroed page by page, a quarter of the time.
_KEPT = 1 << 24

_T = TypeVar('_T')

# Ground that does not move, under any number of columns of loads.
_STILL = np.zeros((3, 1))


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
    place : Placement
        Where the shaft lies.

    """

    rotor: Rotor
    foundations: Sequence[Foundation] = ()
    soil_models: Sequence[SoilModel] = ()
    couples: Sequence[str] = ()
    points: Sequence[str] = ()
    place: Placement = AT_ORIGIN

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
                       self.foundations, self.soil_models, self.place)

    @property
    def rotors(self) -> tuple[Rotor, ...]:
        """All that turn on these blocks, in the order of the channels."""
        return (self.rotor,)

    def in_order(self, own: _T, others: Sequence[_T]) -> tuple[_T, ...]:
        """Put what is the machine's between what is its neighbours'."""
        before = self.own_speeds.index(None)
        return (*others[:before], own, *others[before:])

    @property
    def own_speeds(self) -> tuple[float | None, ...]:
        """Speed at which each of them turns [rad/s]; None of the one that is asked about."""
        return (None,)

    @property
    def machines(self) -> tuple[str, ...]:
        """What each of them is called; nothing where there is only one."""
        return ('',)

    @property
    def own_seats(self) -> slice:
        """Where the machine's own housings stand among those of all, by x and z of each."""
        first = sum(2 * len(rotor.bearings)
                    for rotor in self.rotors[:self.own_speeds.index(None)])
        return slice(first, first + 2 * len(self.rotor.bearings))

    @cached_property
    def channels(self) -> tuple[Channel, ...]:
        """All motions, in the order of the last axis of a Prediction."""
        found = [channel for rotor in self.rotors for channel in rotor.channels]
        found += self.support.places
        found += [Channel(point, '', axis) for point in self.points for axis in DOFS[:3]]
        return tuple(found)

    @cached_property
    def transmits_force(self) -> BoolArray:
        """Which channels transmit a force, (c,) bool: bearings and what stands on the ground."""
        found = [channel.part != '' for rotor in self.rotors for channel in rotor.channels]
        found += [True] * self.support.transmitting
        return np.array(found + [False] * (len(self.channels) - len(found)))

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
    def bearings(self) -> Bearings:
        """All that holds the shaft."""
        return Bearings(self.rotor.bearings)

    @property
    def all_bearings(self) -> Bearings:
        """All that holds any shaft on these blocks."""
        return self.bearings

    @cached_property
    def ports(self) -> list[int]:
        """Rows of the rotor's plane matrices at stations, then at discs with couples."""
        rotor = self.rotor
        places = {disc.name: 2 * rotor.node_of(disc.position) for disc in rotor.discs}
        return [*(2 * rotor.node_of(station.position) for station in rotor.stations),
                *(places[name] + 1 for name in self.couples)]

    @cached_property
    def _synchronous_modes(self) -> WhirlModes:
        return WhirlModes.of(self.rotor, self.ports, springs=self.rotor.nominal_springs, order=1.0)

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
        forces = np.zeros((len(self.ports), 2, len(self.planes)), dtype=complex)
        for plane in range(len(self.planes)):
            forces[first[plane >= discs] + plane, :, plane] = UNBALANCE_FORCE
        return forces.reshape(2 * len(self.ports), len(self.planes))

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
        displacement, force = self._at(speed, omega, self._unit_load(channel))
        return Response(self.channels, np.full(len(omega), float(speed)), omega,
                        displacement[..., 0], force[..., 0])

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
        modes = WhirlModes.of(self.rotor, self.ports, springs=self.rotor.nominal_springs,
                              order=order)
        displacement, force = self._respond(modes, order * speed, speed, self._unit_load(channel))
        return Response(self.channels, speed, order * speed, displacement[..., 0], force[..., 0])

    def _unit_load(self, channel: str) -> ComplexArray:
        """Return a unit force at a channel, in the order of ports, housings and blocks."""
        led = [one for rotor in self.rotors if rotor is not self.rotor
               for one in rotor.channels if not one.is_housing]
        moving = self.channels[:len(self.channels) - self._on_ground]
        loaded = [one for one in moving if one not in led]
        if channel not in loaded:
            raise RotorSoilError(f'force must act at one of {", ".join(loaded)}, got {channel}')
        load = np.zeros((len(self.channels), 1), dtype=complex)
        load[self.channels.index(channel)] = 1.0
        return self._sorted(load)

    def _sorted(self, loads: ComplexArray) -> ComplexArray:
        """Put loads on the channels, (c, k), into the order of ports, housings and blocks."""
        ports, housings, first = [], [], 0
        for rotor in self.rotors:
            end = first + len(rotor.channels)
            # What a force at a channel does on the motions that it is made of.
            own = loads[first:end] if rotor.view is None else rotor.view.T @ loads[first:end]
            seats = 4 * len(rotor.bearings)
            pairs = own[:seats].reshape(-1, 2, 2, loads.shape[1])
            journal, housing = (pairs[:, part].reshape(-1, loads.shape[1]) for part in (0, 1))
            housings.append(housing)
            if rotor is self.rotor:
                slopes = np.zeros((2 * len(self.couples), loads.shape[1]))
                ports = [journal, own[seats:], slopes]
            first = end
        return np.concatenate([*ports, *housings, loads[first:len(loads) - self._on_ground]])

    def ground_response(self, omega: FloatArray, *, speed: float | None) -> tuple[
            ComplexArray, ComplexArray]:
        """
        Solve for the response to ground that moves.

        Parameters
        ----------
        omega : (n,) float array
            Frequency of the motion [rad/s].
        speed : float or None
            Fixed rotor speed [rad/s]; None: the ground moves once per turn, at any speed.

        Returns
        -------
        displacement, force : (n, c, 3) complex arrays
            As `synchronous_response`, per unit motion of the ground along x, y, z, the same
            below all blocks and where bearings stand on the ground itself [m/m], [N/m].

        """
        omega = np.asarray(omega, dtype=float)
        still = self._on_rotor(np.zeros((2 * len(self.ports), 3), dtype=complex))
        if speed is None:
            return self._respond(self._synchronous_modes, omega, omega, still, np.eye(3))
        return self._at(speed, omega, still, np.eye(3))

    def _at(
        self, speed: float, omega: FloatArray, loads: ComplexArray, ground: FloatArray = _STILL,
    ) -> tuple[ComplexArray, ComplexArray]:
        """Solve at a fixed speed, as `_respond`."""
        highest, lags = float(np.abs(omega).max(initial=0.0)), self.lags(omega, speed)
        displacement, force = self._unsolved(len(omega), loads.shape[1])
        for lag in np.unique(lags).tolist():
            rows = np.flatnonzero(lags == lag)
            modes = WhirlModes.at(self.rotor, self.ports, springs=self.rotor.nominal_springs,
                                  speed=speed, highest=highest, lag=lag)
            displacement[rows], force[rows] = self._respond(
                modes, omega[rows], np.full(len(rows), float(speed)), loads, ground)
        return displacement, force

    def lags(self, omega: FloatArray, speed: float) -> FloatArray:
        """
        Return the sign of excitation less rotor speed where it makes a difference, else 0, (n,).

        What a hysteretic shaft exerts turns its own where the rotor overtakes the force.
        """
        losses = self.rotor.losses
        if losses is None or not losses.is_hysteretic:
            return np.zeros(len(omega))
        return np.asarray(np.sign(omega - speed))

    def _unsolved(self, count: int, columns: int) -> tuple[ComplexArray, ComplexArray]:
        """Return displacements and forces to be filled in; where none is transmitted, NaN."""
        shape = (count, len(self.channels), columns)
        return np.empty(shape, dtype=complex), np.full(shape, complex(np.nan, np.nan))

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
        housings = sum(2 * len(rotor.bearings) for rotor in self.rotors)
        below = housings + len(self.support.places)
        return np.concatenate([loads, np.zeros((below, loads.shape[1]))])

    def _respond(
        self, modes: WhirlModes, omega: FloatArray, speed: FloatArray, loads: ComplexArray,
        ground: FloatArray = _STILL,
    ) -> tuple[ComplexArray, ComplexArray]:
        """Solve, some frequencies at a time, and sort by channel: (n, c, k) each."""
        np.empty(_KEPT, dtype=np.uint8)
        displacement, force = self._unsolved(len(omega), loads.shape[1])
        for start in range(0, len(omega), _CHUNK):
            chunk = slice(start, start + _CHUNK)
            found = self._answer(modes, omega[chunk], speed[chunk], loads, ground)
            displacement[chunk], force[chunk][:, self.transmits_force] = (
                found.by_channel(self.rotors))
        if not np.all(np.isfinite(displacement)):
            raise NotSolvedError('the coupled system has no finite solution')
        return displacement, force

    def _answer(
        self, modes: WhirlModes, omega: FloatArray, speed: FloatArray, loads: ComplexArray,
        ground: FloatArray,
    ) -> Answer:
        """Solve at all these frequencies at once."""
        return answer(
            modes.receptance(omega), self.support.standing(omega), loads, ground=ground,
            bearings=self.bearings.dynamic_stiffness(omega, speed),
            springs=np.repeat(self.rotor.nominal_springs, 2))
