"""Which keys a plant has: several machines on the same blocks, instead of one rotor."""

from typing import Annotated, TypeAlias

from pydantic import Discriminator, Field, StrictBool, Tag

from rotorsoil_ros.case.entries.entry import Entry, KEYS, WORD
from rotorsoil_ros.case.quantities import FileName, Metre, Name, Radian, Ratio, Rpm
from rotorsoil_ros.case.schema import Common, RotorEntry, UnbalanceEntry


class PlaceOfMachine(Entry):
    """Left end of a shaft in the axes of the blocks, and where the shaft points."""

    x: Metre
    y: Metre
    z: Metre | None = None
    heading: Radian = 0.0


class RatioEntry(Entry):
    """Speed of a machine as a multiple of another's."""

    of: Name
    times: Ratio


class PlantRotor(RotorEntry):
    """What turns; how high its shaft lies may be told by its place."""

    shaft_height: Metre | None = None  # type: ignore[assignment]


class RotorOfFile(Entry):
    """Rotor that another case file describes."""

    file: FileName


def _by_file(value: object) -> str:
    is_file = isinstance(value, RotorOfFile) or (isinstance(value, dict) and 'file' in value)
    return WORD if is_file else KEYS


AnyRotor: TypeAlias = Annotated[
    Annotated[PlantRotor, Tag(KEYS)] | Annotated[RotorOfFile, Tag(WORD)],
    Discriminator(_by_file)]


class MachineEntry(Entry):
    """One machine of several: its rotor, where it stands, and how fast it turns."""

    name: Name
    place: PlaceOfMachine
    foundation: Name | None = None
    rotor: AnyRotor
    unbalances: list[UnbalanceEntry] = Field(default_factory=list)
    rated_rpm: Rpm | None = None
    ratio: RatioEntry | None = None
    idle: StrictBool = False
    speed_range_rpm: tuple[Rpm, Rpm] | None = None


class PlantDocument(Common):
    """The whole file."""

    machines: list[MachineEntry]
    source: Name | None = None
    speed_range_rpm: tuple[Rpm, Rpm] | None = None
