"""Pieces of a shaft with their material, and the places whose motion is wanted."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
import math

import numpy as np

from rotorsoil_ros.arrays import FloatArray
from rotorsoil_ros.channel import across, Channel
from rotorsoil_ros.errors import require

# Sine of the angle between two probes below which they look the same way.
_PARALLEL = 0.1


@dataclass(frozen=True, slots=True)
class Material:
    """Linear elastic material: E [Pa], nu [-], rho [kg/m^3]."""

    young_modulus: float
    poisson_ratio: float
    density: float

    def __post_init__(self) -> None:
        require(0.0 < self.young_modulus < math.inf, 'young_modulus', '> 0 Pa and finite',
                self.young_modulus)
        require(-1.0 < self.poisson_ratio <= 0.5, 'poisson_ratio', 'in (-1, 0.5]',
                self.poisson_ratio)
        require(0.0 <= self.density < math.inf, 'density', '>= 0 kg/m^3 and finite', self.density)


@dataclass(frozen=True, slots=True)
class ShaftDamping:
    """
    What a piece of shaft loses: in its material, which turns with it, and to what stands still.

    Attributes
    ----------
    viscous : float
        Of the material, stress per rate of strain over stress per strain [s].
    loss_factor : float
        Of the material, hysteretic, the same at every frequency [-].
    fixed_mass, fixed_stiffness : float
        What does not turn, proportional to mass [1/s] and to stiffness [s].

    """

    viscous: float = 0.0
    loss_factor: float = 0.0
    fixed_mass: float = 0.0
    fixed_stiffness: float = 0.0

    def __post_init__(self) -> None:
        for name, unit in (('viscous', 's'), ('fixed_mass', '1/s'), ('fixed_stiffness', 's')):
            value = getattr(self, name)
            require(0.0 <= value < math.inf, name, f'>= 0 {unit} and finite', value)
        require(0.0 <= self.loss_factor < 1.0, 'loss_factor', 'in [0, 1)', self.loss_factor)


@dataclass(frozen=True, slots=True)
class ShaftSection:
    """
    Piece of shaft whose diameters vary linearly, divided evenly into elements.

    Attributes
    ----------
    length : float
        [m].
    outer_diameter, inner_diameter : tuple of two floats
        At the left and the right end [m].
    elements : int
        Number of finite elements, at least 1.
    material : Material
        What it is made of.
    added_mass : float
        Mass per length that does not stiffen [kg/m].
    axial_force : float
        That pulls it; a negative one presses [N].
    torque : float
        That what lies to the right exerts on it, about the spin [N m].
    damping : ShaftDamping
        What it loses.

    """

    length: float
    outer_diameter: tuple[float, float]
    inner_diameter: tuple[float, float]
    elements: int
    material: Material
    added_mass: float = 0.0
    axial_force: float = 0.0
    torque: float = 0.0
    damping: ShaftDamping = ShaftDamping()

    def __post_init__(self) -> None:
        require(0.0 < self.length < math.inf, 'length', '> 0 m and finite', self.length)
        require(self.elements >= 1, 'elements', 'at least 1', self.elements)
        require(0.0 <= self.added_mass < math.inf, 'added_mass', '>= 0 kg/m and finite',
                self.added_mass)
        require(math.isfinite(self.axial_force), 'axial_force', 'finite, in N', self.axial_force)
        require(math.isfinite(self.torque), 'torque', 'finite, in N m', self.torque)
        for outer, inner in zip(self.outer_diameter, self.inner_diameter, strict=True):
            require(0.0 < outer < math.inf, 'outer_diameter', '> 0 m and finite', outer)
            require(0.0 <= inner < outer, 'inner_diameter',
                    f'>= 0 m and less than the outer diameter {outer:g} m', inner)


@dataclass(frozen=True, slots=True)
class Probe:
    """
    Station of the shaft whose motion is wanted.

    Attributes
    ----------
    name : str
        First part of its channels, or the whole of its one.
    position : float
        Along the shaft [m].
    angle : float or None
        Of the one direction in which it looks, from z (up) towards x [rad]; None is along x and
        along z.
    relative_to : str
        Name of the bearing to whose housing it is fixed; empty of one that stands still.

    """

    name: str
    position: float
    angle: float | None = None
    relative_to: str = ''

    def __post_init__(self) -> None:
        if self.angle is not None:
            require(math.isfinite(self.angle), 'angle', 'finite, in rad', self.angle)

    @property
    def channels(self) -> tuple[Channel, ...]:
        """What it tells: along x and along z, or in its own direction."""
        return across(self.name) if self.angle is None else (Channel(self.name, '', ''),)

    @property
    def directions(self) -> FloatArray:
        """Of its channels over (x, z), (1 or 2, 2)."""
        if self.angle is None:
            return np.eye(2)
        return np.array([[math.sin(self.angle), math.cos(self.angle)]])


@dataclass(frozen=True, slots=True)
class Orbit:
    """
    A place whose motion two channels tell: along x and z, or from two sides.

    Attributes
    ----------
    name : str
        Of the place, or of both probes.
    position : float
        Along the shaft [m].
    channels : tuple of two Channels
        Which.
    turn : (2, 2) float array
        Motion over (x, z) per what they tell.

    """

    name: str
    position: float
    channels: tuple[Channel, Channel]
    turn: FloatArray

    @classmethod
    def of(cls, station: str, position: float, part: str = '') -> 'Orbit':
        """Return that of a place that is told along x and z."""
        channels = across(station, part)
        return cls(channels[0].place, position, channels, np.eye(2))


def crossed(probes: Sequence[Probe]) -> Iterator[Orbit]:
    """Yield the pairs of probes at one place that do not look the same way."""
    left = [probe for probe in probes if probe.angle is not None]
    while left:
        one = left.pop(0)
        for other in left:
            seen = np.concatenate([one.directions, other.directions])
            if ((other.position, other.relative_to) == (one.position, one.relative_to)
                    and abs(np.linalg.det(seen)) > _PARALLEL):
                left.remove(other)
                yield Orbit(f'{one.name}_{other.name}', one.position,
                            (one.channels[0], other.channels[0]), np.linalg.inv(seen))
                break
