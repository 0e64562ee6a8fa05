"""What all bearings and seals of a rotor are together, at a speed and to a vibration."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
import math

import numpy as np

from rotorsoil_ros.arrays import ComplexArray, FloatArray
from rotorsoil_ros.errors import OutOfTableError
from rotorsoil_ros.rotor.bearing import Bearing
from rotorsoil_ros.units import rad_s_to_rpm


@dataclass(frozen=True)
class Bearings:
    """
    Bearings and seals.

    Attributes
    ----------
    each : tuple of Bearing
        In the order of the rotor.
    at : tuple of float or None
        Speed of the shaft in each that turns at one of its own [rad/s]; None, or nothing at all,
        where it has the speed that is asked about.

    """

    each: tuple[Bearing, ...]
    at: tuple[float | None, ...] = ()

    @cached_property
    def _at(self) -> tuple[float | None, ...]:
        return self.at or (None,) * len(self.each)

    @cached_property
    def following(self) -> tuple[Bearing, ...]:
        """Those whose shaft has the speed that is asked about."""
        return tuple(one for one, own in zip(self.each, self._at, strict=True) if own is None)

    def between(
        self, span: tuple[float, float],
    ) -> Iterator[tuple[Bearing, tuple[float, float]]]:
        """Yield each, and between which speeds its shaft turns while a span is asked about."""
        for one, own in zip(self.each, self._at, strict=True):
            yield one, span if own is None else (own, own)

    @property
    def frequencies(self) -> FloatArray:
        """Frequencies of vibration at which a table bends, rising [rad/s]."""
        return np.unique(np.concatenate([np.zeros(0), *(one.frequencies for one in self.each)]))

    @property
    def frequency_range(self) -> tuple[float, float]:
        """Frequencies of vibration at which all of them are known [rad/s]."""
        ranges = [one.frequency_range for one in self.each]
        return max(low for low, _ in ranges), min(high for _, high in ranges)

    def within_tables(
        self, span: tuple[float, float], *, following: bool = True,
    ) -> tuple[float, float]:
        """
        Return the part of a span of speeds [rad/s] that all tables of bearings hold.

        Parameters
        ----------
        span : tuple of two floats
            Lowest and highest speed [rad/s].
        following : bool
            Whether the vibration has the frequency of the speed, so that tables over it count.

        Raises
        ------
        OutOfTableError
            If they hold none of it.

        """
        ranges = [bearing.speed_range for bearing in self.following]
        ranges += [bearing.frequency_range for bearing in self.each if following]
        low = max([span[0], *(first for first, _ in ranges)])
        high = min([span[1], *(last for _, last in ranges)])
        if not low <= high:
            raise OutOfTableError(
                f'tables of bearings must hold some speed of {rad_s_to_rpm(span[0]):g} to '
                f'{rad_s_to_rpm(span[1]):g} rpm, there is none that all of them hold')
        return low, high

    def coefficients(
        self, speed: FloatArray, omega: FloatArray,
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """
        Return stiffness, damping and inertia of all bearings.

        Parameters
        ----------
        speed, omega : (n,) float arrays
            Speed that is asked about, and frequency of the vibration [rad/s].

        Returns
        -------
        three (n, 2 b, 2 b) float arrays
            Over (x, z) of each.

        """
        # Without tables one row stands for all speeds, at no cost.
        tabled = any(math.isfinite(one.speed_range[0]) or len(one.frequencies)
                     for one in self.each)
        rows = slice(None) if tabled else slice(1)
        total = np.zeros((3, len(speed[rows]), 2 * len(self.each), 2 * len(self.each)))
        for index, (bearing, own) in enumerate(zip(self.each, self._at, strict=True)):
            pair = slice(2 * index, 2 * index + 2)
            turns = speed[rows] if own is None else np.full(len(speed[rows]), own)
            total[:, :, pair, pair] = bearing.coefficients(turns, omega[rows])
        stiffness, damping, inertia = np.broadcast_to(
            total, (3, len(speed), *total.shape[2:]))
        return stiffness, damping, inertia

    def dynamic_stiffness(self, omega: FloatArray, speed: FloatArray) -> ComplexArray:
        """Return the dynamic stiffness of all bearings, (n, 2 b, 2 b) over (x, z) of each."""
        stiffness, damping, inertia = self.coefficients(speed, omega)
        w = omega[:, None, None]
        return np.asarray(stiffness + 1j * w * damping - w**2 * inertia)

    def series(
        self, speed: FloatArray, between: tuple[float, float],
    ) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
        """
        Return what bearings are to a vibration that grows or decays, a + w b - w^2 c.

        Parameters
        ----------
        speed : (n,) float array
            Rotor speed [rad/s].
        between : tuple of two floats
            Frequencies between which no table bends [rad/s].

        Returns
        -------
        a, b, c : (n, 2 b, 2 b) complex arrays

        """
        low, high = between
        if not len(self.frequencies):
            stiffness, damping, inertia = self.coefficients(speed, speed)
            return stiffness + 0j, 1j * damping, inertia + 0j
        first, last = (self.coefficients(speed, np.full(len(speed), end))
                       for end in between)
        stiff, damp = ((after - before) / (high - low)
                       for before, after in zip(first[:2], last[:2], strict=True))
        damping = first[1] - low * damp
        return (first[0] - low * stiff + 0j, stiff + 1j * damping, first[2] - 1j * damp)
