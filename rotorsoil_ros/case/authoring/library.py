"""What is typical of soils, bearings, pedestals and kinds of machines, with how far it spreads."""

from collections.abc import Mapping
from dataclasses import dataclass, field
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
class BearingKind:
    """
    What a type of bearings is like, and how far that spreads.

    Attributes
    ----------
    means : str
        What it is.
    stiffness_factor, damping_factor : float
        Either may be off by such a factor [-].
    constant, elements, size_per_bore, powers, across_over_up, damping_time
        Of a rolling bearing: k = constant n^a s^b W^c up, a share of it across, damping [s].
    film : mapping
        Type and pads of an oil film, as a case has them; empty of a rolling bearing.
    clearance_per_diameter, length_per_diameter : float
        Of a film: radial clearance and length over the diameter [-].
    oil : mapping
        Of a film, as a case has it.

    """

    means: str
    stiffness_factor: float
    damping_factor: float
    constant: float = 0.0
    elements: int = 0
    size_per_bore: float = 0.0
    powers: Mapping[str, float] = field(default_factory=dict)
    across_over_up: float = 1.0
    damping_time: float = 0.0
    film: Mapping[str, Any] = field(default_factory=dict)
    clearance_per_diameter: float = 0.0
    length_per_diameter: float = 0.0
    oil: Mapping[str, Any] = field(default_factory=dict)

    @classmethod
    def named(cls, name: str) -> 'BearingKind':
        """Return the type of this name."""
        return cls(**entries(BEARINGS)[name])

    def stiffness(self, *, diameter: float, load: float) -> dict[str, float]:
        """Return xx and zz [N/m] of a rolling bearing on a shaft [m] under a load [N]."""
        up = self.constant * math.prod((
            self.elements ** self.powers['elements'],
            (self.size_per_bore * diameter) ** self.powers['size'],
            load ** self.powers['load']))
        return {'xx': self.across_over_up * up, 'zz': up}

    def damping(self, *, diameter: float, load: float) -> dict[str, float]:
        """Return xx and zz [N s/m] of a rolling bearing."""
        return {key: self.damping_time * value
                for key, value in self.stiffness(diameter=diameter, load=load).items()}

    def journal(self, diameter: float) -> dict[str, Any]:
        """Return the geometry of an oil film about a shaft [m], as a case has it."""
        sizes = {'diameter': diameter, 'length': self.length_per_diameter * diameter,
                 'radial_clearance': self.clearance_per_diameter * diameter}
        return {**self.film, **{key: float(f'{value:.3g}') for key, value in sizes.items()},
                'oil': dict(self.oil)}


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
