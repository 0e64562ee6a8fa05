"""How user units become SI: the only place in which a 60 appears."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
import math
from typing import TypeVar

import numpy as np

from rotorsoil_ros.arrays import FloatArray

RADIANS_PER_TURN = 2.0 * math.pi
SECONDS_PER_MINUTE = 60.0

GRAVITY = 9.81  # [m/s^2]
STANDARD_GRAVITY = 9.80665  # [m/s^2] in one g

# rad/s in one of each unit that a speed is told in.
SPEED_UNITS = {'rad_s': 1.0, 'rpm': RADIANS_PER_TURN / SECONDS_PER_MINUTE,
               'hz': RADIANS_PER_TURN, 'deg_s': math.radians(1.0)}

Number = TypeVar('Number', float, FloatArray)


def rpm_to_rad_s(speed_rpm: Number) -> Number:
    """Return revolutions per minute as rad/s."""
    return speed_rpm * RADIANS_PER_TURN / SECONDS_PER_MINUTE


def rad_s_to_rpm(speed: Number) -> Number:
    """Return rad/s as revolutions per minute."""
    return speed * SECONDS_PER_MINUTE / RADIANS_PER_TURN


def hz_to_rad_s(frequency_hz: Number) -> Number:
    """Return cycles per second as rad/s."""
    return frequency_hz * RADIANS_PER_TURN


def rad_s_to_hz(omega: Number) -> Number:
    """Return rad/s as cycles per second."""
    return omega / RADIANS_PER_TURN


def to_um_pp(amplitude: FloatArray) -> FloatArray:
    """Return zero-to-peak amplitudes in m as micrometres peak-to-peak (rad as microradians)."""
    return 2e6 * amplitude


def to_mm_s_rms(amplitude: FloatArray) -> FloatArray:
    """Return zero-to-peak velocities in m/s as mm/s rms (rad/s as mrad/s)."""
    return 1e3 / math.sqrt(2.0) * amplitude


def to_lag_deg(phase: FloatArray) -> FloatArray:
    """Return phases in rad, lead positive, as degrees of lag in [0, 360)."""
    # Of a tiny lead the remainder would round up to the full turn that it stands for.
    lag = np.mod(-np.degrees(phase), 360.0)
    return np.where(lag == 360.0, 0.0, lag)


# Ends of the names of SI columns, longest first, what replaces them, and how.
_PLANT_COLUMNS: tuple[tuple[str, str, Callable[[float], float]], ...] = (
    ('velocity_m_s_rms', 'velocity_mm_s_rms', lambda value: 1e3 * value),
    ('speed_rad_s', 'speed_rpm', rad_s_to_rpm),
    ('phase_rad', 'phase_lag_deg', lambda value: float(to_lag_deg(np.array(value)))),
    ('_rad', '_urad_pp', lambda value: 2e6 * value),
    ('_m', '_um_pp', lambda value: 2e6 * value))


def plant_column(name: str) -> tuple[str, Callable[[float], float]]:
    """Return how a column of a table in SI is called in units of a plant, and the conversion."""
    for end, other, convert in _PLANT_COLUMNS:
        if name.endswith(end):
            return name.removesuffix(end) + other, convert
    return name, lambda value: value


def in_plant_units(row: Mapping[str, str | int | float]) -> dict[str, str | int | float]:
    """Return a row of a table in SI, amplitudes zero-to-peak, in units of a plant."""
    found: dict[str, str | int | float] = {}
    for name, value in row.items():
        other, convert = plant_column(name)
        found[other] = convert(value) if isinstance(value, float) else value
    return found


@dataclass(frozen=True, slots=True)
class Units:
    """
    How quantities are said: in units of a plant, or in SI.

    Attributes
    ----------
    are_of_plant : bool
        rpm, um peak-to-peak and mm/s rms instead of rad/s, m zero-to-peak and m/s rms.

    """

    are_of_plant: bool = True

    def speed(self, omega: float, digits: int = 6) -> str:
        """Return a speed of so many digits in words."""
        if self.are_of_plant:
            return f'{rad_s_to_rpm(omega):.{digits}g} rpm'
        return f'{omega:.{digits}g} rad/s'

    def displacement(self, amplitude: float, unit: str = 'm', *, digits: int = 4) -> str:
        """Return an amplitude, zero-to-peak [m], or [rad] if that is its unit, in words."""
        if self.are_of_plant:
            return f'{2e6 * amplitude:.{digits}g} u{unit} p-p'
        return f'{amplitude:.{digits}g} {unit} zero-to-peak'

    def velocity(self, rms: float) -> str:
        """Return a velocity [m/s rms] in words."""
        return f'{1e3 * rms:.3g} mm/s rms' if self.are_of_plant else f'{rms:.3g} m/s rms'
