"""How much of the motion of the ground reaches each place of a machine."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from rotorsoil_ros.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from rotorsoil_ros.channel import Channel, DOFS
from rotorsoil_ros.ground.boundary.model import SiteGround
from rotorsoil_ros.machine.bearings import Bearings
from rotorsoil_ros.machine.coupled import CoupledModel
from rotorsoil_ros.machine.pieces import Pieces, refine
from rotorsoil_ros.machine.response import TOLERANCE
from rotorsoil_ros.prediction import columns_of, Prediction
from rotorsoil_ros.units import rad_s_to_hz, rad_s_to_rpm, to_lag_deg

# The motions of the ground, which does not turn where nothing stands on it.
ALONG = DOFS[:3]

# Pieces of a table before the first refinement.
_FIRST_PIECES = 32

# Share of the largest motion, or force, that nobody would feel of a small one.
_NOTHING = 1e-6

# How many frequencies beside the speed are solved, up to this multiple of the highest speed.
_BESIDE, _HIGHEST_ORDER = 400, 2.0


@dataclass(frozen=True, slots=True, eq=False)
class Transmissibility:
    """
    Motion of every channel per motion of the ground, complex, labelled.

    `found['fan_z']` is that of one channel. The ground moves alike below all blocks and where
    bearings stand on it without one, as a wave does that is long beside the foundation.

    Attributes
    ----------
    channels : tuple of Channel
        What moves.
    omega : (n,) float array
        Frequency of the motion [rad/s].
    speed : float
        Of the rotor [rad/s].
    ratio : (n, c, 3) complex array
        Per motion of the ground along x, y, z [m/m], of a rotation [rad/m]; lead positive.

    """

    channels: tuple[Channel, ...]
    omega: FloatArray
    speed: float
    ratio: ComplexArray

    @classmethod
    def of(cls, model: CoupledModel, omega: FloatArray, *, speed: float) -> 'Transmissibility':
        """Solve at frequencies (n,) [rad/s] while the rotor turns at a speed [rad/s]."""
        ratio, _ = model.ground_response(omega, speed=speed)
        return cls(model.channels, omega, speed, ratio)

    def __len__(self) -> int:
        """Return the number of frequencies."""
        return len(self.omega)

    def __getitem__(self, names: str | tuple[str, ...]) -> 'Transmissibility':
        """Return that of some channels only, as a `Response` does."""
        columns = columns_of(self.channels, names)
        return replace(self, channels=tuple(self.channels[column] for column in columns),
                       ratio=self.ratio[:, columns])

    @property
    def frequency_hz(self) -> FloatArray:
        """Frequency of the motion, (n,) [Hz]."""
        return rad_s_to_hz(self.omega)

    @property
    def speed_rpm(self) -> float:
        """Rotor speed [rpm]."""
        return float(rad_s_to_rpm(self.speed))

    @property
    def amplitude(self) -> FloatArray:
        """Magnitude, (n, c, 3) [m/m, rad/m]."""
        return np.abs(self.ratio)

    def phase_lag_deg(self) -> FloatArray:
        """Return by how much each lags the ground, (n, c, 3) in [0, 360) [deg]."""
        return to_lag_deg(np.asarray(np.angle(self.ratio)))


@dataclass(frozen=True)
class GroundTable:
    """
    Response to ground that moves once per turn, as complex polynomials between speeds.

    Attributes
    ----------
    channels : tuple of Channel
        What moves.
    transmits_force : (c,) bool array
        Which channels have a force.
    pieces : Pieces
        Over (x, y, z of the ground, channels then forces) [m/m], [N/m].
    omega : (m,) float array
        Frequencies of any motion, while the rotor turns at one speed [rad/s].
    beside : (m, 3, w) complex array
        The same at these.

    """

    channels: tuple[Channel, ...]
    transmits_force: BoolArray
    pieces: Pieces
    omega: FloatArray
    beside: ComplexArray

    @classmethod
    def build(
        cls, model: CoupledModel, speed_range: tuple[float, float], *, rated: float,
    ) -> 'GroundTable':
        """
        Solve over a range of speeds until it can be interpolated, and up to twice of it at one.

        Parameters
        ----------
        model : CoupledModel
            The machine.
        speed_range : tuple of two floats
            Lowest and highest speed [rad/s].
        rated : float
            That one speed [rad/s].

        Raises
        ------
        NotSolvedError
            If nothing can be resolved.

        """
        def at(omega: FloatArray, speed: float | None) -> ComplexArray:
            displacement, force = model.ground_response(omega, speed=speed)
            rows = np.concatenate([displacement, force[:, model.transmits_force]], axis=1)
            return np.asarray(rows.transpose(0, 2, 1))

        def solve(speed: FloatArray) -> tuple[ComplexArray, ComplexArray]:
            wanted = at(speed, None)
            return wanted, wanted[:, :0]

        omega = _beside_the_speed(model, _HIGHEST_ORDER * speed_range[1])
        return cls(model.channels, model.transmits_force, refine(
            solve, np.linspace(*speed_range, _FIRST_PIECES + 1), groups=model.groups,
            tolerance=TOLERANCE, columns=len(ALONG), floor=_NOTHING), omega, at(omega, rated))

    def at(self, speed: FloatArray) -> tuple[ComplexArray, ComplexArray]:
        """
        Look up displacement and force at speeds (n,) [rad/s], (n, c, 3) each.

        Both are NaN where nothing is known, forces also where none is transmitted.
        """
        return self.parted(self.pieces.at(np.asarray(speed, dtype=float)))

    def parted(self, rows: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
        """Return displacement and force, (n, c, 3) each, of rows (n, 3, w)."""
        values, moving = rows.transpose(0, 2, 1), len(self.channels)
        force = np.full((len(values), moving, len(ALONG)), complex(np.nan, np.nan))
        force[:, self.transmits_force] = values[:, moving:]
        return values[:, :moving], force

    def to_arrays(self) -> dict[str, np.ndarray]:
        """Return everything but the channels as plain arrays."""
        return {'transmits_force': self.transmits_force, 'edges': self.pieces.edges,
                'resolved': self.pieces.resolved, 'coefficients': self.pieces.coefficients,
                'omega': self.omega, 'beside': self.beside}

    @classmethod
    def from_arrays(
        cls, arrays: Mapping[str, np.ndarray], channels: tuple[Channel, ...],
    ) -> 'GroundTable':
        """Rebuild a table from `to_arrays` and the channels of its model."""
        return cls(channels, arrays['transmits_force'], Pieces(
            arrays['edges'], arrays['resolved'], arrays['coefficients']), arrays['omega'],
            arrays['beside'])


def _beside_the_speed(model: CoupledModel, highest: float) -> FloatArray:
    """Return frequencies [rad/s] of which ground and bearings tell, up to a highest one."""
    low, high = model.support.known(highest)
    for rotor in model.rotors:
        first, last = Bearings(rotor.bearings).frequency_range
        low, high = max(low, first), min(high, last)
    low = max(low, high / _BESIDE)
    return np.linspace(low, high, _BESIDE if low < high else 0)


@dataclass(frozen=True)
class MovingGround:
    """
    Ground whose motion is measured beside a machine that moves it, too.

    Attributes
    ----------
    table : GroundTable
        What the machine does of a motion of the ground.
    loads : (6 k,) int array
        Channels by whose forces the blocks load the ground.
    sensors : int
        How many there are.
    others : tuple of float
        Speeds at which other machines on the same blocks usually run [rad/s].
    around : SiteGround or None
        Ground below the blocks, with the sensors as its points; None where nobody can tell how
        it moves beside them.
    unknown : str
        Why nobody can.

    Notes
    -----
    With P the motion of the sensors per load r of the blocks, u the motion of the ground where
    nothing stands on it, and R what the blocks load it with per such motion, a sensor measures

        u_meas = u + P (r_own + R u)   =>   u = (1 + P R)^-1 (u_meas - P r_own).

    """

    table: GroundTable
    loads: IntArray
    sensors: int
    others: tuple[float, ...]
    around: SiteGround | None
    unknown: str = ''

    def own(self, speed: FloatArray, force: ComplexArray) -> ComplexArray:
        """
        Return what the machine does to the sensors, (n, s, 3) [m].

        Parameters
        ----------
        speed : (n,) float array
            [rad/s].
        force : (n, c) complex array
            What all channels transmit [N, N m].

        """
        found = np.einsum('nik,nk->ni', self.beside(speed), force[:, self.loads])
        return np.asarray(found.reshape(len(speed), -1, len(ALONG)))

    def free(
        self, speed: FloatArray, measured: ComplexArray, own: ComplexArray,
    ) -> ComplexArray:
        """Return the motion without the machine by what sensors measure, (n, s, 3) [m]."""
        _, force = self.table.at(speed)
        unit = disturbed(self.beside(speed), force[:, self.loads])
        known = np.isfinite(unit).all(axis=(2, 3))
        found = np.full(measured.shape, complex(np.nan, np.nan))
        found[known] = np.linalg.solve(unit[known], (measured - own)[known][..., None])[..., 0]
        return found

    def parts(self, speed: FloatArray, motion: ComplexArray) -> Prediction:
        """Return what the ground does to every channel by its motion (n, 3) [m]."""
        displacement, force = self.table.at(speed)
        return Prediction(speed, *(np.einsum('nca,na->nc', one, motion)
                                   for one in (displacement, force)))

    def through(self, channels: Sequence[Channel]) -> ComplexArray:
        """
        Return motion of channels per motion that each sensor feels of the ground, (m, s, k, 3).

        At the frequencies of the table, and as if the blocks were not felt there where nobody
        can tell.
        """
        moved, force = self.table.parted(self.table.beside)
        moved = moved[:, [self.table.channels.index(channel) for channel in channels]]
        unit = np.broadcast_to(np.eye(len(ALONG), dtype=complex), (
            len(moved), self.sensors, len(ALONG), len(ALONG)))
        if self.around is not None:
            unit = disturbed(self.beside(self.table.omega), force[:, self.loads])
        found = np.full((len(moved), self.sensors, len(channels), len(ALONG)),
                        complex(np.nan, np.nan))
        known = np.isfinite(unit).all(axis=(1, 2, 3))
        # Solved from the right: T (1 + P R)^-1.
        found[known] = np.linalg.solve(unit[known].swapaxes(2, 3), moved[known][
            :, None].swapaxes(2, 3)).swapaxes(2, 3)
        return found

    def beside(self, omega: FloatArray) -> ComplexArray:
        """Return P, (n, 3 s, 6 k); NaN where nobody can tell."""
        if self.around is None:
            return np.full((len(omega), len(ALONG) * self.sensors, len(self.loads)),
                           complex(np.nan, np.nan))
        known = (omega >= 0.0) & (omega <= self.around.omega_range[1])
        found = self.around.point_motion(np.where(known, omega, 0.0))
        return np.where(known[:, None, None], found, complex(np.nan, np.nan))


def disturbed(beside: ComplexArray, loading: ComplexArray) -> ComplexArray:
    """
    Return what sensors feel per motion of the ground without the machine, (n, s, 3, 3).

    Parameters
    ----------
    beside : (n, 3 s, 6 k) complex array
        Motion of the sensors per load.
    loading : (n, 6 k, 3) complex array
        Load per motion of the ground.

    """
    count = len(ALONG)
    return np.asarray((beside @ loading).reshape(len(beside), -1, count, count) + np.eye(count))
