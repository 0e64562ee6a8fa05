"""What a machine that stands by does to the blocks that another one shakes."""

from dataclasses import dataclass, replace
from functools import cached_property
import math

import numpy as np

from rotorsoil_ros.arrays import ComplexArray, FloatArray
from rotorsoil_ros.errors import require
from rotorsoil_ros.machine.coupled import CoupledModel
from rotorsoil_ros.machine.coupling import driven
from rotorsoil_ros.machine.placement import Placement
from rotorsoil_ros.rotor.assembly import Rotor
from rotorsoil_ros.rotor.whirl import WhirlModes


@dataclass(frozen=True)
class Neighbour:
    """
    Machine that stands by, idle or at a speed of its own.

    Whoever shakes it meets an apparent stiffness at its housings: its rotor answers at the
    frequency of the shaking, with gyroscopic couples and bearings as at its own speed.

    Attributes
    ----------
    rotor : Rotor
        What turns, or stands.
    place : Placement
        Where its shaft lies.
    speed : float
        Its own, 0 where it stands [rad/s].

    """

    rotor: Rotor
    place: Placement
    speed: float

    def __post_init__(self) -> None:
        require(0.0 <= self.speed < math.inf, 'speed', '>= 0 rad/s and finite', self.speed)

    @property
    def held_speed(self) -> float:
        """
        Speed at which its bearings are looked up [rad/s].

        A journal at rest lies on metal, of which no table tells: the slowest speed that all
        tables know stands for it.
        """
        slowest = max(bearing.speed_range[0] for bearing in self.rotor.bearings)
        return max(self.speed, slowest)

    @cached_property
    def _led(self) -> CoupledModel:
        """The same rotor, its housings led by somebody else."""
        return CoupledModel(replace(self.rotor, bearings=tuple(
            replace(bearing, foundation=None, pedestal=None) for bearing in self.rotor.bearings)))

    def led(self, omega: FloatArray) -> tuple[ComplexArray, ComplexArray]:
        """
        Return what happens while its housings move.

        Parameters
        ----------
        omega : (n,) float array
            Frequency at which they do [rad/s].

        Returns
        -------
        ports (n, 2 s, 2 b), through (n, 2 b, 2 b) : complex arrays
            Motion of the stations [m/m] and force of the bearings on the housings [N/m], per
            unit motion of the housings over (x, z) of each. The latter is minus the apparent
            stiffness.

        """
        model, count = self._led, 2 * len(self.rotor.bearings)
        highest = float(np.abs(omega).max(initial=0.0))
        ports = np.empty((len(omega), 2 * len(model.ports), count), dtype=complex)
        through = np.empty((len(omega), count, count), dtype=complex)
        lags = model.lags(omega, self.speed)
        for lag in np.unique(lags).tolist():
            rows = np.flatnonzero(lags == lag)
            bearings = model.bearings.dynamic_stiffness(
                omega[rows], np.full(len(rows), self.held_speed))
            ports[rows], through[rows] = driven(
                self._modes(highest, lag).receptance(omega[rows]),
                np.zeros((1, count, count), dtype=complex), np.eye(count, dtype=complex)[None],
                np.zeros((ports.shape[1], count), dtype=complex),
                bearings=bearings, springs=np.repeat(model.rotor.nominal_springs, 2))
        return ports, through

    def _modes(self, highest: float, lag: float) -> WhirlModes:
        """Return modes that serve up to a frequency; found once for all below a power of two."""
        reach = 2.0 ** math.ceil(math.log2(max(highest, 1.0)))
        found = self._found.get((reach, lag))
        if found is None:
            model = self._led
            found = self._found[reach, lag] = WhirlModes.at(
                self.rotor, model.ports, springs=model.rotor.nominal_springs, speed=self.speed,
                highest=reach, lag=lag)
        return found

    @cached_property
    def _found(self) -> dict[tuple[float, float], WhirlModes]:
        return {}
