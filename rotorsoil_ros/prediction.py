"""What a coupled model answers."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from rotorsoil_ros.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from rotorsoil_ros.channel import Channel
from rotorsoil_ros.errors import RotorSoilError
from rotorsoil_ros.units import rad_s_to_hz, rad_s_to_rpm, to_lag_deg, to_mm_s_rms, to_um_pp

if TYPE_CHECKING:
    from pandas import DataFrame
    from xarray import Dataset


# Rows (m,), and real and imaginary parts of their velocity (m, 2, c).
Ringing: TypeAlias = tuple[IntArray, FloatArray]


class Prediction:
    """
    Once-per-turn response of every channel, complex and zero-to-peak.

    Attributes
    ----------
    speed : (n,) float array
        Rotor speed [rad/s].
    parts : (n, 2, 2, c) float array
        Real parts, then imaginary parts, of displacement and of force.
    ringing : (rows, (m, 2, c) float array) or None
        Rows in which what was struck rings at a frequency of its own, and real and imaginary
        parts of the velocity there.

    """

    __slots__ = ('parts', 'ringing', 'speed')

    def __init__(
        self, speed: FloatArray, displacement: ComplexArray, force: ComplexArray,
    ) -> None:
        vectors = np.stack([displacement, force], axis=1)
        self.speed = speed
        self.parts: FloatArray = np.stack([vectors.real, vectors.imag], axis=1)
        self.ringing: Ringing | None = None

    @classmethod
    def of_parts(
        cls, speed: FloatArray, parts: FloatArray, ringing: Ringing | None = None,
    ) -> 'Prediction':
        """Return what consists of these parts, as they are."""
        prediction = cls.__new__(cls)
        prediction.speed, prediction.parts, prediction.ringing = speed, parts, ringing
        return prediction

    @property
    def displacement(self) -> ComplexArray:
        """Displacement, (n, c) [m], or [rad] for the rotations of a foundation."""
        return self._vector(0)

    @property
    def force(self) -> ComplexArray:
        """
        Transmitted force, (n, c).

        Through the bearing [N] for its journal and housing; into the soil [N, N m] for a
        foundation; NaN where a channel transmits none.

        """
        return self._vector(1)

    @property
    def velocity(self) -> ComplexArray:
        """Velocity, i speed X where nothing rings, (n, c) [m/s, rad/s]."""
        velocity = np.asarray(1j * self.speed[:, None] * self.displacement)
        if self.ringing is not None:
            rows, parts = self.ringing
            velocity[rows] = parts[:, 0] + 1j * parts[:, 1]
        return velocity

    def at(self, rows: IntArray) -> 'Prediction':
        """Return the response at some speeds, of what is steady."""
        return Prediction.of_parts(self.speed[rows], self.parts[rows])

    def with_own(
        self, steady: Callable[[], FloatArray], own: Callable[[FloatArray], FloatArray],
    ) -> FloatArray:
        """Return of the velocity what is true of it, (n, c): where it rings, of its own parts."""
        if self.ringing is None:
            return steady()
        rows, parts = self.ringing
        found = own(parts)
        if len(rows) == len(self.speed):
            return found
        velocity = steady()
        velocity[rows] = found
        return velocity

    def _vector(self, number: int) -> ComplexArray:
        vector = np.empty((len(self.parts), self.parts.shape[3]), dtype=complex)
        # Not a sum with 1j: it would make NaN of both parts where one is infinite.
        vector.real, vector.imag = self.parts[:, 0, number], self.parts[:, 1, number]
        vector.flags.writeable = False  # a copy: writing to it would change nothing
        return vector


@dataclass(frozen=True, slots=True, eq=False)
class Response:
    """
    Vibration of every channel, complex and zero-to-peak, labelled, in SI.

    The last axis is that of the channels; `response['fan_z', 'block_z']` is the response of
    these alone. Plant units exist in the methods that say theirs. An array with labels was
    chosen over an xarray Dataset for its weight: nothing but numpy is needed to ask a machine,
    and who has xarray or pandas gets theirs from `to_xarray` or `to_pandas`.

    Attributes
    ----------
    channels : tuple of Channel
        What moves, with its unit.
    speed, omega : (n,) float arrays
        Rotor speed and frequency of the vibration [rad/s].
    displacement : (n, c) complex array
        x(t) = Re(X exp(+i omega t)) [m], of a rotation [rad]; of a unit force per N or N m.
    force : (n, c) complex array
        Transmitted force [N, N m], as in `Prediction`; NaN where a channel transmits none.
    stamp_ns : (n,) int array or None
        When, where the speeds are those of a profile [ns].
    own_velocity : (n, c) complex array or None
        Velocity, where something rings at a frequency of its own; None: i omega X.

    """

    channels: tuple[Channel, ...]
    speed: FloatArray
    omega: FloatArray
    displacement: ComplexArray
    force: ComplexArray
    stamp_ns: IntArray | None = None
    own_velocity: ComplexArray | None = None

    @classmethod
    def of(
        cls, channels: tuple[Channel, ...], prediction: Prediction,
        stamp_ns: IntArray | None = None,
    ) -> 'Response':
        """Return what a model answered to its unbalance, labelled."""
        return cls(channels, prediction.speed, prediction.speed, prediction.displacement,
                   prediction.force, stamp_ns,
                   None if prediction.ringing is None else prediction.velocity)

    def where(self, exists: BoolArray) -> 'Response':
        """Return the same with NaN where no steady response exists, (n,)."""
        if exists.all():
            return self
        rows, none = exists[:, None], complex(np.nan, np.nan)
        return replace(self, displacement=np.where(rows, self.displacement, none),
                       force=np.where(rows, self.force, none))

    def __len__(self) -> int:
        """Return the number of speeds or frequencies."""
        return len(self.omega)

    def __getitem__(self, names: str | tuple[str, ...]) -> 'Response':
        """
        Return the response of some channels only.

        Raises
        ------
        RotorSoilError
            If there is no such channel; the message names the nearest.

        """
        columns = columns_of(self.channels, names)
        own = None if self.own_velocity is None else self.own_velocity[:, columns]
        return replace(self, channels=tuple(self.channels[column] for column in columns),
                       displacement=self.displacement[:, columns], force=self.force[:, columns],
                       own_velocity=own)

    @property
    def units(self) -> dict[str, str]:
        """Unit of the displacement of each channel."""
        return {channel.name: channel.unit for channel in self.channels}

    @property
    def velocity(self) -> ComplexArray:
        """Velocity, i omega X where nothing rings, (n, c) [m/s, rad/s]."""
        if self.own_velocity is not None:
            return self.own_velocity
        return 1j * self.omega[:, None] * self.displacement

    @property
    def amplitude(self) -> FloatArray:
        """Zero-to-peak displacement, (n, c) [m, rad]."""
        return np.abs(self.displacement)

    @property
    def phase(self) -> FloatArray:
        """Phase of the displacement in [-pi, pi], lead positive, (n, c) [rad]."""
        return np.asarray(np.angle(self.displacement))

    @property
    def speed_rpm(self) -> FloatArray:
        """Rotor speed, (n,) [rpm]."""
        return rad_s_to_rpm(self.speed)

    @property
    def frequency_hz(self) -> FloatArray:
        """Frequency of the vibration, (n,) [Hz]."""
        return rad_s_to_hz(self.omega)

    def displacement_um_pp(self) -> FloatArray:
        """Return displacements, (n, c) [um peak-to-peak], of rotations [urad peak-to-peak]."""
        return to_um_pp(self.amplitude)

    def velocity_mm_s_rms(self) -> FloatArray:
        """Return velocities, (n, c) [mm/s rms], of rotations [mrad/s rms]."""
        return to_mm_s_rms(np.abs(self.velocity))

    def phase_lag_deg(self) -> FloatArray:
        """Return by how much displacements lag the unbalance, (n, c) in [0, 360) [deg]."""
        return to_lag_deg(self.phase)

    def to_pandas(self) -> 'DataFrame':
        """
        Return the displacements as a DataFrame: one complex column [m, rad] for each channel.

        The index is the time of a profile, the frequency of a force, or else the speed. Needs
        pandas, which this package does not.
        """
        import pandas

        if self.stamp_ns is not None:
            index = pandas.Index(pandas.to_datetime(self.stamp_ns), name='time')
        elif np.array_equal(self.speed, self.omega):
            index = pandas.Index(self.speed, name='speed_rad_s')
        else:
            index = pandas.Index(self.omega, name='omega_rad_s')
        frame = pandas.DataFrame(self.displacement, index=index,
                                 columns=pandas.Index(map(str, self.channels), name='channel'))
        frame.attrs['units'] = self.units
        return frame

    def to_xarray(self) -> 'Dataset':
        """
        Return everything as a Dataset over `sample` and `channel`.

        Its variables are displacement, velocity and force; speed [rad/s], omega [rad/s] and the
        stamps of a profile [ns] are coordinates, as are the parts and the unit of each channel.
        Needs xarray, which this package does not.
        """
        import xarray

        both = ('sample', 'channel')
        along: dict[str, FloatArray | IntArray] = {'speed': self.speed, 'omega': self.omega}
        if self.stamp_ns is not None:
            along['stamp_ns'] = self.stamp_ns
        return xarray.Dataset(
            {'displacement': (both, self.displacement), 'velocity': (both, self.velocity),
             'force': (both, self.force)},
            {**{name: ('sample', values) for name, values in along.items()},
             'channel': list(map(str, self.channels)),
             **{name: ('channel', [getattr(channel, name) for channel in self.channels])
                for name in ('station', 'part', 'axis', 'unit')}},
            {'convention': 'x(t) = Re(X exp(+i omega t)), zero-to-peak, SI'})


@dataclass(frozen=True, slots=True, eq=False)
class Bounds:
    """
    Between which amplitudes a response lies, as far as the soil is known.

    Attributes
    ----------
    channels : tuple of Channel
        What moves, with its unit.
    speed : (n,) float array
        Rotor speed [rad/s].
    low, nominal, high : (n, c) float array
        Zero-to-peak displacement [m, rad]: smallest on any of the soils, on that of the case,
        largest; NaN where none is known.

    """

    channels: tuple[Channel, ...]
    speed: FloatArray
    low: FloatArray
    nominal: FloatArray
    high: FloatArray

    def __len__(self) -> int:
        """Return the number of speeds."""
        return len(self.speed)

    def __getitem__(self, names: str | tuple[str, ...]) -> 'Bounds':
        """Return the bounds of some channels only, as a `Response` does."""
        columns = columns_of(self.channels, names)
        return Bounds(tuple(self.channels[column] for column in columns), self.speed,
                      self.low[:, columns], self.nominal[:, columns], self.high[:, columns])

    @property
    def speed_rpm(self) -> FloatArray:
        """Rotor speed, (n,) [rpm]."""
        return rad_s_to_rpm(self.speed)

    def displacement_um_pp(self) -> FloatArray:
        """Return low, nominal and high, (3, n, c) [um peak-to-peak], of rotations [urad]."""
        return to_um_pp(np.stack([self.low, self.nominal, self.high]))

    def velocity_mm_s_rms(self) -> FloatArray:
        """Return low, nominal and high velocity, (3, n, c) [mm/s rms], of rotations [mrad/s]."""
        sizes = np.stack([self.low, self.nominal, self.high])
        return to_mm_s_rms(np.abs(self.speed)[:, None] * sizes)


def columns_of(channels: Sequence[Channel], names: str | tuple[str, ...]) -> list[int]:
    """Return where channels stand, (k,); a name that is not among them is refused."""
    wanted = (names,) if isinstance(names, str) else tuple(names)
    for name in wanted:
        if name not in channels:
            near = get_close_matches(name, channels, n=1)
            raise RotorSoilError(
                f'channel must be one of {", ".join(channels)}, got {name!r}'
                + (f'; did you mean {near[0]}?' if near else ''))
    return [channels.index(name) for name in wanted]
