"""How thick oil is: mineral oils by their grade and temperature, or by what somebody measured."""

from dataclasses import dataclass
import math

import numpy as np

from rotorsoil_ros.arrays import FloatArray
from rotorsoil_ros.errors import require, RotorSoilError

# Kinematic viscosity at 100 deg C of an oil of viscosity index 100, by its grade, which is that at
# 40 deg C [mm^2/s].
AT_100 = {22: 4.3, 32: 5.4, 46: 6.8, 68: 8.7, 100: 11.4}

_KELVIN = 273.15
_COLDEST, _HOTTEST = -10.0, 150.0

# Of mineral oils about 15 deg C [kg/m^3], [kg/(m^3 K)].
_DENSITY, _EXPANSION, _DENSITY_AT = 875.0, 0.63, 15.0

_SMALL_UNIT = 1e-6  # m^2/s in mm^2/s


@dataclass(frozen=True, slots=True)
class Oil:
    """
    Mineral oil of viscosity index 100 or so.

    Attributes
    ----------
    grade : int
        ISO VG, one of 22, 32, 46, 68, 100.
    temperature : float
        Mean of the film [deg C].

    References
    ----------
    ASTM D341: log log (nu + 0.7) is straight over log T; ISO 3448: the grades.

    """

    grade: int
    temperature: float

    def __post_init__(self) -> None:
        if self.grade not in AT_100:
            raise RotorSoilError(f'grade must be one of ISO VG {", ".join(map(str, AT_100))}, '
                                 f'got {self.grade}')
        require(_COLDEST <= self.temperature <= _HOTTEST, 'temperature',
                f'{_COLDEST:g} to {_HOTTEST:g} deg C', self.temperature)

    @property
    def kinematic_viscosity(self) -> float:
        """Of the grade at the temperature [m^2/s]."""
        places = [math.log10(degrees + _KELVIN) for degrees in (40.0, 100.0)]
        heights = [math.log10(math.log10(nu + 0.7)) for nu in (self.grade, AT_100[self.grade])]
        slope = (heights[1] - heights[0]) / (places[1] - places[0])
        height = heights[0] + slope * (math.log10(self.temperature + _KELVIN) - places[0])
        return _SMALL_UNIT * float(10.0 ** (10.0 ** height) - 0.7)

    @property
    def density(self) -> float:
        """At the temperature [kg/m^3]."""
        return _DENSITY - _EXPANSION * (self.temperature - _DENSITY_AT)

    @property
    def viscosity(self) -> float:
        """Dynamic viscosity [Pa s]."""
        return self.kinematic_viscosity * self.density


@dataclass(frozen=True, slots=True)
class Viscosity:
    """
    Dynamic viscosity of an oil film, the same at all speeds or given over them.

    Attributes
    ----------
    speed : (n,) float array
        Rising speeds [rad/s]; one where it does not depend on them.
    values : (n,) float array
        At each of them [Pa s].
    density : float
        Of the oil [kg/m^3].

    """

    speed: FloatArray
    values: FloatArray
    density: float = _DENSITY

    def __post_init__(self) -> None:
        for value in self.values.tolist():
            require(0.0 < value < math.inf, 'viscosity', '> 0 Pa s and finite', value)

    @classmethod
    def constant(cls, value: float) -> 'Viscosity':
        """Return one value for every speed [Pa s]."""
        return cls(np.zeros(1), np.array([value]))

    @classmethod
    def of(cls, oil: Oil) -> 'Viscosity':
        """Return that of an oil."""
        return cls(np.zeros(1), np.array([oil.viscosity]), oil.density)

    def at(self, speed: FloatArray) -> FloatArray:
        """Return it at speeds (n,), straight in its logarithm, constant beyond the ends."""
        return np.asarray(np.exp(np.interp(speed, self.speed, np.log(self.values))))
