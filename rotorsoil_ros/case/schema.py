"""Which keys a case file may have, and of which kind and unit each is."""

from collections.abc import Hashable, Mapping
import difflib
from typing import Annotated, Any, Literal, Self, TypeAlias

from pydantic import (
    BaseModel,
    ConfigDict,
    Discriminator,
    model_validator,
    StrictBool,
    StringConstraints,
    Tag,
    ValidationError,
)
from pydantic.functional_validators import ModelWrapValidatorHandler
from pydantic_core import ErrorDetails, InitErrorDetails, PydanticCustomError

from rotorsoil_ros.case.document import shown
from rotorsoil_ros.case.quantities import (
    BalanceGrade,
    Count,
    FileName,
    Kilogram,
    KilogramMetre,
    KilogramPerCubicMetre,
    KilogramPerMetre,
    KilogramSquareMetre,
    Metre,
    MetrePerSecond,
    Name,
    NewtonPerMetre,
    NewtonSecondPerMetre,
    Pascal,
    Radian,
    Ratio,
    Rpm,
)

# Which of two shapes a value has, where a file may choose; no key can be called so.
_CONSTANT, _TABLE, _NUMBER, _AXES = '<constant>', '<table>', '<number>', '<axes>'
_KEYS, _WORD = '<keys>', '<word>'
_SHAPES = (_CONSTANT, _TABLE, _NUMBER, _AXES, _KEYS, _WORD)

class Entry(BaseModel):
    """One mapping of a case file."""

    # The lowest pydantic that serves keeps names that begin with `model_` for itself.
    model_config = ConfigDict(extra='forbid', frozen=True, protected_namespaces=())

    @model_validator(mode='wrap')
    @classmethod
    def _refuse_unknown_keys(cls, value: Any, handler: ModelWrapValidatorHandler[Self]) -> Self:
        """Tell every unknown key, beside what is wrong with the others."""
        unknown = ([key for key in value if key not in cls.model_fields]
                   if isinstance(value, dict) else [])
        if not unknown:
            return handler(value)
        meant = {key: _meant(key, cls, value) for key in unknown}
        faults = [InitErrorDetails(
            type=PydanticCustomError('unknown_key', '{problem}', {
                'problem': _unknown(key, meant[key], list(cls.model_fields))}),
            loc=(str(key),), input=value[key]) for key in unknown]
        try:
            handler({key: entry for key, entry in value.items() if key not in unknown})
        except ValidationError as error:
            # What is missing because it is misspelled is told once.
            faults += [_again(detail) for detail in error.errors(include_url=False)
                       if not (detail['type'] == 'missing' and detail['loc'][-1:] in
                               {(name,) for name in meant.values()})]
        raise ValidationError.from_exception_data(cls.__name__, faults)


def _meant(key: Hashable, entry: type[Entry], value: Mapping[Hashable, Any]) -> str | None:
    """Return the key that a wrong one was probably meant to be, first one that is not there."""
    known = list(entry.model_fields)
    for choice in ([name for name in known if name not in value], known):
        if near := difflib.get_close_matches(str(key), choice, n=1):
            return near[0]
    return None


def _unknown(key: Hashable, meant: str | None, known: list[str]) -> str:
    if meant is not None:
        return f'is not a known key; did you mean {meant}?'
    return f'is not a known key; known here: {", ".join(known)}'


def _again(detail: ErrorDetails) -> InitErrorDetails:
    """Return an error as it has to be raised again."""
    kind: str | PydanticCustomError = detail['type']
    context = detail.get('ctx', {})
    if kind == 'unknown_key':
        kind, context = PydanticCustomError('unknown_key', '{problem}', context), {}
    return InitErrorDetails(type=kind, loc=detail['loc'], input=detail['input'], ctx=context)


class SoilEntry(Entry):
    """Half-space, by its shear modulus or by the velocity of its shear waves."""

    shear_modulus: Pascal | None = None
    shear_wave_velocity: MetrePerSecond | None = None
    poisson_ratio: Ratio
    density: KilogramPerCubicMetre
    loss_factor: Ratio


class SupportEntry(Entry):
    """Which model of the soil stands below the blocks."""

    model: Literal['rigid', 'cone', 'infinite_elements', 'table']
    geometry: Literal['disc', 'plane_strain', 'plane_stress'] = 'disc'
    file: FileName | None = None


class FoundationEntry(Entry):
    """Block; its contact is a rectangle or a circle."""

    name: Name
    half_width: Metre | None = None
    half_length: Metre | None = None
    radius: Metre | None = None
    centre_y: Metre | None = None
    mass: Kilogram | None = None
    centre_of_gravity_height: Metre | None = None
    inertia: tuple[KilogramSquareMetre, KilogramSquareMetre, KilogramSquareMetre] | None = None
    height: Metre | None = None
    density: KilogramPerCubicMetre | None = None
    stiffness_file: FileName | None = None


class MaterialEntry(Entry):
    """Shaft material."""

    young_modulus: Pascal
    poisson_ratio: Ratio
    density: KilogramPerCubicMetre


def _given_or_named(value: object) -> str:
    return _WORD if isinstance(value, str) else _KEYS


AnyMaterial: TypeAlias = Annotated[
    Annotated[MaterialEntry, Tag(_KEYS)]
    | Annotated[Literal['steel', 'stainless_steel', 'cast_iron', 'aluminium'], Tag(_WORD)],
    Discriminator(_given_or_named)]


class Section(Entry):
    """Piece of shaft; a diameter at the right end makes it conical."""

    length: Metre
    outer_diameter: Metre
    outer_diameter_end: Metre | None = None
    inner_diameter: Metre = 0.0
    inner_diameter_end: Metre | None = None
    elements: Count
    material: AnyMaterial | None = None
    added_mass: KilogramPerMetre | None = None


class DiscEntry(Entry):
    """Rigid disc, by its mass and inertias or by its dimensions."""

    name: Name
    position: Metre
    mass: Kilogram | None = None
    diametral_inertia: KilogramSquareMetre | None = None
    polar_inertia: KilogramSquareMetre | None = None
    outer_diameter: Metre | None = None
    inner_diameter: Metre = 0.0
    width: Metre | None = None
    density: KilogramPerCubicMetre | None = None


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
    return _TABLE if is_table else _CONSTANT


def _per_axis(value: object) -> str:
    return _AXES if isinstance(value, (dict, MassPerAxis)) else _NUMBER


class MassPerAxis(Entry):
    """Mass that differs between the directions."""

    xx: Kilogram
    zz: Kilogram


class PedestalEntry(Entry):
    """Elastic structure between a bearing's housing and the block."""

    mass: Annotated[
        Annotated[Kilogram, Tag(_NUMBER)] | Annotated[MassPerAxis, Tag(_AXES)],
        Discriminator(_per_axis)]
    stiffness: Stiffness
    damping: Damping


class BearingEntry(Entry):
    """Bearing and the block below it."""

    name: Name
    position: Metre
    foundation: Name | None = None
    stiffness: Annotated[
        Annotated[Stiffness, Tag(_CONSTANT)] | Annotated[StiffnessTable, Tag(_TABLE)],
        Discriminator(_over_speed)]
    damping: Annotated[
        Annotated[Damping, Tag(_CONSTANT)] | Annotated[DampingTable, Tag(_TABLE)],
        Discriminator(_over_speed)]
    pedestal: PedestalEntry | None = None


class ProbeEntry(Entry):
    """Place on the shaft whose motion is wanted."""

    name: Name
    position: Metre


class RotorEntry(Entry):
    """What turns."""

    shaft_height: Metre
    material: AnyMaterial | None = None
    shaft: list[Section]
    discs: list[DiscEntry] = []
    bearings: list[BearingEntry]
    probes: list[ProbeEntry] = []


class UnbalanceEntry(Entry):
    """Unbalance on one disc: a moment, or what a balance grade permits, and a couple."""

    disc: Name
    moment: KilogramMetre | None = None
    grade: BalanceGrade | None = None
    rated_speed_rpm: Rpm | None = None
    share: Ratio = 1.0
    phase: Radian = 0.0
    couple: KilogramSquareMetre | None = None
    couple_phase: Radian = 0.0


class Uncertainty(Entry):
    """How far the machine and its soil may be from what the file says."""

    shear_modulus_factor: Ratio | None = None
    poisson_ratio: Ratio | None = None
    loss_factor: Ratio | None = None
    samples: Count | None = None
    soil_density_factor: Ratio | None = None
    bearing_stiffness_factor: Ratio | None = None
    bearing_damping_factor: Ratio | None = None
    pedestal_stiffness_factor: Ratio | None = None
    foundation_mass_factor: Ratio | None = None
    rotor_mass_factor: Ratio | None = None
    shaft_stiffness_factor: Ratio | None = None
    shaft_height_factor: Ratio | None = None
    unbalance_factor: Ratio | None = None
    model_form: StrictBool | None = None


Velocities: TypeAlias = tuple[MetrePerSecond, MetrePerSecond, MetrePerSecond]
Displacements: TypeAlias = tuple[Metre, Metre, Metre]


class ZonesEntry(Entry):
    """Limits of housing velocity: those of a group of the standard, or one's own."""

    group: Literal[1, 2] | None = None
    label: Annotated[str, StringConstraints(min_length=1, max_length=64)] | None = None
    rigid: Velocities | None = None
    flexible: Velocities | None = None
    rigid_displacement: Displacements | None = None
    flexible_displacement: Displacements | None = None
    baseline: MetrePerSecond | None = None


class Document(Entry):
    """The whole file."""

    name: Name
    soil: SoilEntry | None = None
    support: SupportEntry
    foundations: list[FoundationEntry] = []
    rotor: RotorEntry
    unbalances: list[UnbalanceEntry] = []
    speed_range_rpm: tuple[Rpm, Rpm]
    uncertainty: Uncertainty | None = None
    zones: ZonesEntry | None = None
    anti_alias: bool = False


_WHAT = {
    'missing': 'is missing',
    'model_type': 'must hold keys and values, got {input}',
    'list_type': 'must be a list, got {input}',
    'tuple_type': 'must be a list, got {input}',
    'too_long': 'has more entries than it should: {input}',
    'literal_error': 'must be {expected}, got {input}',
}


Place: TypeAlias = tuple[int | str, ...]


def faults(error: ValidationError) -> list[tuple[Place, str]]:
    """Return where a document is at fault, and what is wrong there, a line each."""
    return [_fault(detail) for detail in error.errors(include_url=False)]


def _fault(detail: ErrorDetails) -> tuple[Place, str]:
    context = detail.get('ctx', {})
    place = tuple(step for step in detail['loc'] if step not in _SHAPES)
    if detail['type'] == 'unknown_key':
        return place, context['problem']
    if detail['type'] == 'value_error':
        return place, str(context['error'])
    got = shown(detail['input'])
    if detail['type'] not in _WHAT:
        return place, f'{detail["msg"]}, got {got}'
    return place, _WHAT[detail['type']].format(input=got, **context)
