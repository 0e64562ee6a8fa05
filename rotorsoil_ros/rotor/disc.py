"""Rigid bodies on a shaft, and how much unbalance a balance grade leaves on them."""

from dataclasses import dataclass
import math

from rotorsoil_ros.errors import require


@dataclass(frozen=True, slots=True)
class Disc:
    """Rigid disc: position along the shaft [m], mass [kg], inertias [kg m^2]."""

    name: str
    position: float
    mass: float
    diametral_inertia: float
    polar_inertia: float

    def __post_init__(self) -> None:
        require(0.0 <= self.mass < math.inf, 'mass', '>= 0 kg and finite', self.mass)
        require(0.0 <= self.diametral_inertia < math.inf, 'diametral_inertia',
                '>= 0 kg m^2 and finite', self.diametral_inertia)
        require(0.0 <= self.polar_inertia < math.inf, 'polar_inertia', '>= 0 kg m^2 and finite',
                self.polar_inertia)

    @classmethod
    def cylinder(
        cls, name: str, position: float, *, outer_diameter: float, inner_diameter: float,
        width: float, density: float,
    ) -> 'Disc':
        """Return a homogeneous cylindrical disc by its dimensions [m] and density [kg/m^3]."""
        require(0.0 < outer_diameter < math.inf, 'outer_diameter', '> 0 m and finite',
                outer_diameter)
        require(0.0 <= inner_diameter < outer_diameter, 'inner_diameter',
                f'>= 0 m and less than the outer diameter {outer_diameter:g} m', inner_diameter)
        require(0.0 < width < math.inf, 'width', '> 0 m and finite', width)
        require(0.0 < density < math.inf, 'density', '> 0 kg/m^3 and finite', density)
        mass = density * math.pi / 4.0 * (outer_diameter**2 - inner_diameter**2) * width
        polar = mass * (outer_diameter**2 + inner_diameter**2) / 8.0
        return cls(name, position, mass, polar / 2.0 + mass * width**2 / 12.0, polar)

    @property
    def radius(self) -> float:
        """Radius of the solid cylinder of its mass and inertia [m]."""
        return math.sqrt(2.0 * self.polar_inertia / self.mass) if self.mass > 0.0 else 0.0

    @property
    def thickness(self) -> float:
        """Thickness of that cylinder; 0 of one that is thinner than thin [m]."""
        square = (12.0 * self.diametral_inertia / self.mass - 3.0 * self.radius**2
                  if self.mass > 0.0 else 0.0)
        return math.sqrt(max(square, 0.0))


def permissible_unbalance(*, grade: float, mass: float, speed: float) -> float:
    """
    Return the residual unbalance of a whole rotor that its balance grade permits.

    Parameters
    ----------
    grade : float
        Eccentricity times speed [m/s]: G 6.3 is 6.3e-3 m/s.
    mass : float
        Of the rotor [kg].
    speed : float
        Highest service speed [rad/s].

    Returns
    -------
    float
        Moment m e = grade * mass / speed [kg m].

    References
    ----------
    ISO 21940-11:2016 (before: ISO 1940-1): a grade G is the permissible eccentricity times the
    highest service speed, e_per Omega in mm/s, and U_per = e_per m.

    """
    require(0.0 < grade < math.inf, 'grade', '> 0 m/s and finite', grade)
    require(0.0 < mass < math.inf, 'mass', '> 0 kg and finite', mass)
    require(0.0 < speed < math.inf, 'speed', '> 0 rad/s and finite', speed)
    return grade * mass / speed
