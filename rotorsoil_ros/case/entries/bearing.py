"""Which keys a bearing may have: coefficients, tables of them, or the geometry of a journal."""

from typing import Annotated, Literal

from pydantic import Discriminator, Tag

from rotorsoil_ros.case.entries.entry import AXES, CONSTANT, Entry, NUMBER, TABLE
from rotorsoil_ros.case.quantities import (
    Celsius,
    Clearance,
    Count,
    Degree,
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


def _over_speed(value: object) -> str:
    is_table = (isinstance(value, (StiffnessTable, DampingTable))
                or (isinstance(value, dict) and 'speed_rpm' in value))
    return TABLE if is_table else CONSTANT


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
    stiffness: Annotated[
        Annotated[Stiffness, Tag(CONSTANT)] | Annotated[StiffnessTable, Tag(TABLE)],
        Discriminator(_over_speed)] | None = None
    damping: Annotated[
        Annotated[Damping, Tag(CONSTANT)] | Annotated[DampingTable, Tag(TABLE)],
        Discriminator(_over_speed)] | None = None
    journal: JournalEntry | None = None
    load: tuple[Newton, Newton] | None = None
    alignment: Metre = 0.0
    pedestal: PedestalEntry | None = None
