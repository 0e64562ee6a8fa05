"""Which keys a bearing may have: coefficients, tables of them, or the geometry of a journal."""

from typing import Annotated, Literal

from pydantic import Discriminator, Tag

from rotorsoil_ros.case.entries.entry import AXES, CONSTANT, Entry, MAP, NUMBER, TABLE
from rotorsoil_ros.case.quantities import (
    Celsius,
    Clearance,
    Count,
    Degree,
    Hertz,
    Kilogram,
    Metre,
    Name,
    Newton,
    NewtonPerMetre,
    NewtonSecondPerMetre,
    OilGrade,
    PascalSecond,
    Ratio,
    Rpm,
)


class Stiffness(Entry):
    """Of a bearing, force direction first."""

    xx: NewtonPerMetre
    xz: NewtonPerMetre = 0.0
    zx: NewtonPerMetre = 0.0
    zz: NewtonPerMetre


class Damping(Entry):
    """Of a bearing, force direction first."""

    xx: NewtonSecondPerMetre
    xz: NewtonSecondPerMetre = 0.0
    zx: NewtonSecondPerMetre = 0.0
    zz: NewtonSecondPerMetre


class Inertia(Entry):
    """Of a seal's fluid, force direction first."""

    xx: Kilogram
    xz: Kilogram = 0.0
    zx: Kilogram = 0.0
    zz: Kilogram


class StiffnessTable(Entry):
    """Stiffness at some speeds of the rotor."""

    speed_rpm: list[Rpm]
    xx: list[NewtonPerMetre]
    xz: list[NewtonPerMetre] | None = None
    zx: list[NewtonPerMetre] | None = None
    zz: list[NewtonPerMetre]


class DampingTable(Entry):
    """Damping at some speeds of the rotor."""

    speed_rpm: list[Rpm]
    xx: list[NewtonSecondPerMetre]
    xz: list[NewtonSecondPerMetre] | None = None
    zx: list[NewtonSecondPerMetre] | None = None
    zz: list[NewtonSecondPerMetre]


class InertiaTable(Entry):
    """Inertia at some speeds of the rotor."""

    speed_rpm: list[Rpm]
    xx: list[Kilogram]
    xz: list[Kilogram] | None = None
    zx: list[Kilogram] | None = None
    zz: list[Kilogram]


class StiffnessMap(Entry):
    """Stiffness at some frequencies of vibration, a row of them for every speed of the rotor."""

    speed_rpm: list[Rpm] | None = None
    frequency_hz: list[Hertz]
    xx: list[list[NewtonPerMetre]]
    xz: list[list[NewtonPerMetre]] | None = None
    zx: list[list[NewtonPerMetre]] | None = None
    zz: list[list[NewtonPerMetre]]


class DampingMap(Entry):
    """Damping at some frequencies of vibration, a row of them for every speed of the rotor."""

    speed_rpm: list[Rpm] | None = None
    frequency_hz: list[Hertz]
    xx: list[list[NewtonSecondPerMetre]]
    xz: list[list[NewtonSecondPerMetre]] | None = None
    zx: list[list[NewtonSecondPerMetre]] | None = None
    zz: list[list[NewtonSecondPerMetre]]


def _over_what(value: object) -> str:
    keys = value if isinstance(value, dict) else type(value).model_fields if isinstance(
        value, Entry) else ()
    return MAP if 'frequency_hz' in keys else TABLE if 'speed_rpm' in keys else CONSTANT


def _per_axis(value: object) -> str:
    return AXES if isinstance(value, (dict, MassPerAxis)) else NUMBER


class MassPerAxis(Entry):
    """Mass that differs between the directions."""

    xx: Kilogram
    zz: Kilogram


class PedestalEntry(Entry):
    """Elastic structure between a bearing's housing and the block."""

    mass: Annotated[
        Annotated[Kilogram, Tag(NUMBER)] | Annotated[MassPerAxis, Tag(AXES)],
        Discriminator(_per_axis)]
    stiffness: Stiffness
    damping: Damping


class OilEntry(Entry):
    """Oil of a film by its grade and mean temperature."""

    grade: OilGrade
    temperature: Celsius


class ViscosityTable(Entry):
    """Viscosity of a film at some speeds of the rotor."""

    speed_rpm: list[Rpm]
    viscosity: list[PascalSecond]


def _thick(value: object) -> str:
    return TABLE if isinstance(value, (dict, ViscosityTable)) else NUMBER


class JournalEntry(Entry):
    """Hydrodynamic bearing by its geometry and its oil."""

    ways = ('viscosity',), ('oil',)
    type: Literal['plain', 'axial_groove', 'elliptic', 'tilting_pad']
    diameter: Metre
    length: Metre
    radial_clearance: Clearance
    viscosity: Annotated[
        Annotated[PascalSecond, Tag(NUMBER)] | Annotated[ViscosityTable, Tag(TABLE)],
        Discriminator(_thick)] | None = None
    oil: OilEntry | None = None
    preload: Ratio | None = None
    arc_deg: Degree | None = None
    groove_deg: Degree | None = None
    pads: Count | None = None
    pivot: Ratio | None = None
    load_on: Literal['pad', 'gap'] | None = None
    least_film: Clearance | None = None


class BearingEntry(Entry):
    """Bearing, by its coefficients or as a journal, and the block below it."""

    ways = ('stiffness', 'damping'), ('journal',)
    name: Name
    position: Metre
    foundation: Name | None = None
    seat: Name | None = None
    stiffness: Annotated[
        Annotated[Stiffness, Tag(CONSTANT)] | Annotated[StiffnessTable, Tag(TABLE)]
        | Annotated[StiffnessMap, Tag(MAP)], Discriminator(_over_what)] | None = None
    damping: Annotated[
        Annotated[Damping, Tag(CONSTANT)] | Annotated[DampingTable, Tag(TABLE)]
        | Annotated[DampingMap, Tag(MAP)], Discriminator(_over_what)] | None = None
    inertia: Annotated[
        Annotated[Inertia, Tag(CONSTANT)] | Annotated[InertiaTable, Tag(TABLE)],
        Discriminator(_over_what)] | None = None
    journal: JournalEntry | None = None
    load: tuple[Newton, Newton] | None = None
    alignment: Metre = 0.0
    pedestal: PedestalEntry | None = None
