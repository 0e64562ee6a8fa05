"""What is typical of soils, bearings, pedestals and kinds of machines, with how far it spreads."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
import math
from typing import Any, TypeAlias

from rotorsoil_ros.case import document
from rotorsoil_ros.rotor.shaft import Material

Range: TypeAlias = tuple[float, float]

# Which file of config/library holds what; its head names the sources.
SOILS, BEARINGS, PEDESTALS = 'soils', 'bearings', 'pedestals'
MACHINES = 'machines'
_COMMON = 'common'


@cache
def entries(name: str) -> dict[str, Any]:
    """Return what a file of the library says, by the names of its entries."""
    path = files('rotorsoil_ros') / 'config' / 'library' / f'{name}.yaml'
    return dict(document.parse(path.read_text(encoding='utf-8'), source=str(path)))


def names(name: str) -> tuple[str, ...]:
    """Return the names of the entries of a file, in its order."""
    return tuple(entry for entry in entries(name) if entry != _COMMON)


def material(name: str) -> Material:
    """Return the material that a case may call by this name."""
    return Material(**entries('materials')[name])


def common() -> Mapping[str, float]:
    """Return the rules of thumb that hold for all kinds of machines."""
    return dict(entries(MACHINES)[_COMMON])


@dataclass(frozen=True, slots=True)
class SoilClass:
    """Lowest and highest [m/s], [-], [kg/m^3], [-] of what a class of soil has."""

    means: str
    shear_wave_velocity: Range
    poisson_ratio: Range
    density: Range
    damping_ratio: Range

    @classmethod
    def named(cls, name: str) -> 'SoilClass':
        """Return the class of this name."""
        entry: dict[str, Any] = {key: tuple(value) if isinstance(value, list) else value
                                 for key, value in entries(SOILS)[name].items()}
        return cls(**entry)


@dataclass(frozen=True, slots=True)
class Coefficients:
    """
    What a bearing is like, and how far that spreads.

    Attributes
    ----------
    stiffness, damping : mapping of str to float
        Over xx, zz and, of an oil film, xz and zx [N/m], [N s/m].
    is_film : bool
        Whether the damping is that at one speed and falls as this grows.
    stiffness_factor, damping_factor : float
        Either may be off by such a factor [-].

    """

    stiffness: Mapping[str, float]
    damping: Mapping[str, float]
    is_film: bool
    stiffness_factor: float
    damping_factor: float


def bearing(name: str, *, diameter: float, load: float, speed: float) -> Coefficients:
    """
    Return what a bearing of a type is like.

    Parameters
    ----------
    name : str
        Of its type.
    diameter : float
        Of the shaft in it [m].
    load : float
        Static, downward [N].
    speed : float
        Of the rotor [rad/s].

    """
    entry = entries(BEARINGS)[name]
    spread = entry['stiffness_factor'], entry['damping_factor']
    if 'constant' not in entry:
        clearance = entry['clearance_per_diameter'] * diameter
        return Coefficients(
            {key: value * load / clearance for key, value in entry['stiffness'].items()},
            {key: value * load / (clearance * speed) for key, value in entry['damping'].items()},
            True, *spread)
    powers = entry['powers']
    up = entry['constant'] * math.prod((
        entry['elements'] ** powers['elements'],
        (entry['size_per_bore'] * diameter) ** powers['size'], load ** powers['load']))
    stiffness = {'xx': entry['across_over_up'] * up, 'zz': up}
    return Coefficients(
        stiffness, {key: entry['damping_time'] * value for key, value in stiffness.items()},
        False, *spread)


@dataclass(frozen=True, slots=True)
class PedestalKind:
    """Stiffness [N/m] over xx and zz, damping ratio and share of the carried mass [-]."""

    means: str
    stiffness: Mapping[str, float]
    damping_ratio: float
    mass_share: float
    stiffness_factor: float

    @classmethod
    def named(cls, name: str) -> 'PedestalKind':
        """Return the kind of this name."""
        return cls(**entries(PEDESTALS)[name])

    def damping(self, carried: float) -> dict[str, float]:
        """Return damping [N s/m] over xx and zz under a mass that it carries [kg]."""
        moving = (1.0 + self.mass_share) * carried
        return {key: 2.0 * self.damping_ratio * math.sqrt(value * moving)
                for key, value in self.stiffness.items()}


@dataclass(frozen=True, slots=True)
class MachineKind:
    """Rules of thumb for one kind of machine: lengths over the diameter of what turns [-]."""

    means: str
    disc: str
    layout: str
    grade: str
    mass_constant: float
    mass_power: float
    width: float
    span: float
    shaft_height: float
    casing: float
    bearing: str
    pedestal: str
    overhang: float = 0.0
    rim_speed: float | None = None
    surface_stress: float | None = None

    @classmethod
    def named(cls, name: str) -> 'MachineKind':
        """Return the kind of this name."""
        return cls(**entries(MACHINES)[name])

    @property
    def is_overhung(self) -> bool:
        """Whether what turns sits outside of both bearings."""
        return self.layout == 'overhung'

    def diameter(self, *, torque: float, speed: float) -> float:
        """Return the diameter of what turns [m], of a torque [N m] and a speed [rad/s]."""
        if self.rim_speed is not None:
            return 2.0 * self.rim_speed / speed
        assert self.surface_stress is not None
        # Torque of the stress over the surface of a cylinder, width times as long as wide.
        return float((2.0 * torque / (math.pi * self.surface_stress * self.width)) ** (1.0 / 3.0))
