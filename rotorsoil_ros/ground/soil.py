"""What the ground is, where it is touched, and what every model of it must answer."""

from collections.abc import Sequence
from dataclasses import dataclass
import math
from typing import Protocol, runtime_checkable, TypeAlias, TypeVar

import numpy as np

from rotorsoil_ros.arrays import ComplexArray, FloatArray
from rotorsoil_ros.errors import require, RotorSoilError
from rotorsoil_ros.ground.plan import Part, Plan


@dataclass(frozen=True, slots=True)
class Soil:
    """
    Homogeneous isotropic half-space with hysteretic damping.

    Attributes
    ----------
    shear_modulus : float
        G [Pa].
    poisson_ratio : float
        nu, 0 <= nu < 0.5 [-].
    density : float
        rho [kg/m^3].
    loss_factor : float
        eta >= 0 [-]: every modulus is multiplied by (1 + i eta); eta is twice the damping ratio.

    """

    shear_modulus: float
    poisson_ratio: float
    density: float
    loss_factor: float = 0.0

    def __post_init__(self) -> None:
        require(0.0 < self.shear_modulus < math.inf, 'shear_modulus', '> 0 Pa and finite',
                self.shear_modulus)
        require(0.0 <= self.poisson_ratio < 0.5, 'poisson_ratio',
                'in [0, 0.5), of undrained (saturated) soil 0.49',
                self.poisson_ratio)
        require(0.0 < self.density < math.inf, 'density', '> 0 kg/m^3 and finite', self.density)
        require(0.0 <= self.loss_factor < 1.0, 'loss_factor', 'in [0, 1)', self.loss_factor)

    @property
    def shear_wave_speed(self) -> float:
        """Speed of shear waves without damping, sqrt(G / rho) [m/s]."""
        return math.sqrt(self.shear_modulus / self.density)

    @property
    def pressure_wave_speed(self) -> float:
        """Speed of dilatational waves without damping, c_s sqrt(2 (1 - nu) / (1 - 2 nu)) [m/s]."""
        nu = self.poisson_ratio
        return self.shear_wave_speed * math.sqrt(2.0 * (1.0 - nu) / (1.0 - 2.0 * nu))


@dataclass(frozen=True, slots=True)
class Rectangle:
    """Rectangular contact of half-width b along x and half-length l along y [m]."""

    half_width: float
    half_length: float

    def __post_init__(self) -> None:
        require(0.0 < self.half_width < math.inf, 'half_width', '> 0 m and finite',
                self.half_width)
        require(0.0 < self.half_length < math.inf, 'half_length', '> 0 m and finite',
                self.half_length)

    @property
    def area(self) -> float:
        """Contact area, 4 b l [m^2]."""
        return 4.0 * self.half_width * self.half_length

    @property
    def second_moments(self) -> tuple[float, float, float]:
        """Second moments of area about x, y and z through the centre [m^4]."""
        b, half_length = self.half_width, self.half_length
        about_x = 4.0 * b * half_length**3 / 3.0
        about_y = 4.0 * half_length * b**3 / 3.0
        return about_x, about_y, about_x + about_y

    @property
    def characteristic_length(self) -> float:
        """Length that makes a0 dimensionless: the half-width b [m]."""
        return self.half_width


@dataclass(frozen=True, slots=True)
class Circle:
    """Circular contact of the given radius r0 [m]."""

    radius: float

    def __post_init__(self) -> None:
        require(0.0 < self.radius < math.inf, 'radius', '> 0 m and finite', self.radius)

    @property
    def area(self) -> float:
        """Contact area, pi r0^2 [m^2]."""
        return math.pi * self.radius**2

    @property
    def second_moments(self) -> tuple[float, float, float]:
        """Second moments of area about x, y and z through the centre [m^4]."""
        about_diameter = math.pi * self.radius**4 / 4.0
        return about_diameter, about_diameter, 2.0 * about_diameter

    @property
    def characteristic_length(self) -> float:
        """Length that makes a0 dimensionless: the radius r0 [m]."""
        return self.radius


Contact: TypeAlias = Rectangle | Circle | Plan


def parts_of(contact: Rectangle | Plan) -> tuple[Part, ...]:
    """Return the rectangles of a contact about its centre."""
    if isinstance(contact, Plan):
        return contact.centred
    return (Part(contact.half_width, contact.half_length, 0.0, 0.0),)


def extents(contact: Contact) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return first and last x, first and last y of a contact about its centre [m]."""
    match contact:
        case Plan():
            return contact.extents
        case Circle(radius=radius):
            return (-radius, radius), (-radius, radius)
    return ((-contact.half_width, contact.half_width),
            (-contact.half_length, contact.half_length))


def equivalent_radii(contact: Contact) -> FloatArray:
    """
    Return the radius of the disc that stands for the contact in each degree of freedom.

    Parameters
    ----------
    contact : Contact
        Area of contact between foundation and soil.

    Returns
    -------
    (6,) float array
        Radii [m] over (x, y, z, rx, ry, rz): equal area for the translations, equal second
        moment of area about the axis of each rotation.

    References
    ----------
    Wolf, Foundation Vibration Analysis Using Simple Physical Models (1994), sec. 2.1.

    """
    about_x, about_y, about_z = contact.second_moments
    translation = math.sqrt(contact.area / math.pi)
    return np.array([
        translation, translation, translation,
        (4.0 * about_x / math.pi) ** 0.25,
        (4.0 * about_y / math.pi) ** 0.25,
        (2.0 * about_z / math.pi) ** 0.25,
    ])


def static_scale(before: float, after: float) -> FloatArray:
    """
    Return by what another Poisson's ratio multiplies displacements, (6,), roughly.

    The square roots of the ratios of the static compliances of a smooth disc, (2 - nu) for
    sliding, (1 - nu) for heaving and rocking, 1 for torsion: on both sides of a compliance they
    are exact at rest and keep it passive.
    """
    sliding = (2.0 - after) / (2.0 - before)
    heaving = (1.0 - after) / (1.0 - before)
    return np.sqrt([sliding, sliding, heaving, heaving, heaving, 1.0])


class SoilModel(Protocol):
    """What everything above the soil knows of it: one below each block, or one below all."""

    def compliance(self, omega: FloatArray) -> ComplexArray:
        """Return the compliance of the massless contact, (n, 6, 6) over (x, y, z, rx, ry, rz)."""
        ...


@runtime_checkable
class SharedGround(Protocol):
    """Ground below several blocks that move each other through it."""

    @property
    def blocks(self) -> int:
        """Number of blocks, k."""
        ...

    def compliance(self, omega: FloatArray) -> ComplexArray:
        """Return the compliance of all massless contacts, (n, 6 k, 6 k)."""
        ...

    def point_motion(self, omega: FloatArray) -> ComplexArray:
        """Return the motion of points on it per load on the blocks, (n, 3 p, 6 k)."""
        ...


Ground = TypeVar('Ground', bound=SoilModel)


@dataclass(frozen=True, slots=True)
class OneOfBlocks:
    """What one of several blocks stands on, the others lying on the ground without loads."""

    ground: SharedGround
    index: int

    @property
    def singular(self) -> FloatArray:
        """Where a wave of the layers begins to travel, rising [rad/s]."""
        return singular_of(self.ground)

    @property
    def second_opinion(self) -> 'OneOfBlocks':
        """The same block on a poorer model of the ground."""
        return OneOfBlocks(second_opinion_of(self.ground), self.index)

    def compliance(self, omega: FloatArray) -> ComplexArray:
        """Return the compliance of the massless contact, (n, 6, 6) over (x, y, z, rx, ry, rz)."""
        own = slice(6 * self.index, 6 * self.index + 6)
        return self.ground.compliance(omega)[..., own, own]


def below_each(models: Sequence[SoilModel], blocks: int) -> tuple[SoilModel, ...]:
    """
    Return what each of several blocks stands on.

    Raises
    ------
    RotorSoilError
        If there is neither one model for each nor one that knows of all of them.

    """
    if not blocks:
        return ()
    if len(models) == 1 and isinstance(models[0], SharedGround) and models[0].blocks == blocks:
        return tuple(OneOfBlocks(models[0], index) for index in range(blocks))
    if len(models) != blocks:
        raise RotorSoilError(f'{blocks} foundations need as many soil models, or one ground below '
                             f'all of them, got {len(models)}')
    return tuple(models)


def singular_of(model: SoilModel | SharedGround) -> FloatArray:
    """
    Return at which frequencies the compliance of a model has a branch point, rising [rad/s].

    There waves of a layer begin to travel: on both sides different functions continue it to
    vibrations that decay. A model without such places need not say so.
    """
    found: FloatArray = getattr(model, 'singular', np.zeros(0))
    return found


def second_opinion_of(model: Ground) -> Ground:
    """
    Return a poorer model of the same ground, or the model itself if there is none.

    What both say of real frequencies is nearly the same; what they say of vibrations that decay
    differs where the solves do not determine it.
    """
    found: Ground = getattr(model, 'second_opinion', model)
    return found


@dataclass(frozen=True, slots=True)
class RigidSoil:
    """Ground that does not move: the textbook support, as compliance zero."""

    def compliance(self, omega: FloatArray) -> ComplexArray:
        """Return zeros, (n, 6, 6)."""
        return np.zeros((*np.shape(omega), 6, 6), dtype=complex)
