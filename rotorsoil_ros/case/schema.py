"""Which keys a case file may have, and of which kind and unit each is."""

from collections.abc import Hashable
import difflib
import math
import re
from typing import Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, model_validator, ValidationError
from pydantic_core import ErrorDetails, PydanticCustomError

from rotorsoil_ros.case.document import shown

# Larger than any stiffness or speed; products of such numbers still fit into a double.
_LARGEST_NUMBER = 1e18
# More elements in one section are a slip of the keyboard and would fill the memory.
_LARGEST_COUNT = 1000
_NAME = re.compile(r'[a-z][a-z0-9_]{0,63}')


def _number_in(unit: str) -> BeforeValidator:
    """Return a validator that takes finite numbers only: no text, no truth value."""
    rule = f'must be a finite number{unit and f" in {unit}"}'

    def validate(value: object) -> float:
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise ValueError(f'{rule}, got {shown(value)}')
        if not math.isfinite(value):
            raise ValueError(f'{rule}, got {value}')
        if abs(value) > _LARGEST_NUMBER:
            raise ValueError(f'{rule} of at most {_LARGEST_NUMBER:g}, got {value:g}')
        return float(value)

    return BeforeValidator(validate)


def _name(value: object) -> str:
    if not isinstance(value, str) or not _NAME.fullmatch(value):
        raise ValueError('must be a name of at most 64 small letters, digits and _, first a '
                         f'letter, got {shown(value)}')
    return value


def _count(value: object) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or value > _LARGEST_COUNT:
        raise ValueError(f'must be a whole number up to {_LARGEST_COUNT}, got {shown(value)}')
    return value


Name = Annotated[str, BeforeValidator(_name)]
Count = Annotated[int, BeforeValidator(_count)]
Ratio = Annotated[float, _number_in('')]
Metre = Annotated[float, _number_in('m')]
Kilogram = Annotated[float, _number_in('kg')]
KilogramPerMetre = Annotated[float, _number_in('kg/m')]
KilogramMetre = Annotated[float, _number_in('kg m')]
KilogramSquareMetre = Annotated[float, _number_in('kg m^2')]
KilogramPerCubicMetre = Annotated[float, _number_in('kg/m^3')]
Pascal = Annotated[float, _number_in('Pa')]
NewtonPerMetre = Annotated[float, _number_in('N/m')]
NewtonSecondPerMetre = Annotated[float, _number_in('N s/m')]
Radian = Annotated[float, _number_in('rad')]
Rpm = Annotated[float, _number_in('rpm')]


class Entry(BaseModel):
    """One mapping of a case file."""

    model_config = ConfigDict(extra='forbid', frozen=True)

    @model_validator(mode='before')
    @classmethod
    def _refuse_unknown_keys(cls, value: Any) -> Any:
        if isinstance(value, dict):
            for key in value:
                if key not in cls.model_fields:
                    raise PydanticCustomError('unknown_key', '{problem}', {
                        'key': key, 'problem': _unknown(key, list(cls.model_fields))})
        return value


def _unknown(key: Hashable, known: list[str]) -> str:
    near = difflib.get_close_matches(str(key), known, n=1)
    if near:
        return f'is not a known key; did you mean {near[0]}?'
    return f'is not a known key; known here: {", ".join(known)}'


class Soil(Entry):
    """Half-space."""

    shear_modulus: Pascal
    poisson_ratio: Ratio
    density: KilogramPerCubicMetre
    loss_factor: Ratio


class Support(Entry):
    """Which model of the soil stands below the blocks."""

    model: Literal['rigid', 'cone', 'infinite_elements']
    geometry: Literal['disc', 'plane_strain', 'plane_stress'] = 'disc'


class Foundation(Entry):
    """Block; its contact is a rectangle or a circle."""

    name: Name
    half_width: Metre | None = None
    half_length: Metre | None = None
    radius: Metre | None = None
    centre_y: Metre | None = None
    mass: Kilogram
    centre_of_gravity_height: Metre
    inertia: tuple[KilogramSquareMetre, KilogramSquareMetre, KilogramSquareMetre]
    height: Metre | None = None


class Material(Entry):
    """Shaft material."""

    young_modulus: Pascal
    poisson_ratio: Ratio
    density: KilogramPerCubicMetre


class Section(Entry):
    """Piece of shaft; a diameter at the right end makes it conical."""

    length: Metre
    outer_diameter: Metre
    outer_diameter_end: Metre | None = None
    inner_diameter: Metre = 0.0
    inner_diameter_end: Metre | None = None
    elements: Count
    material: Material | None = None
    added_mass: KilogramPerMetre | None = None


class Disc(Entry):
    """Rigid disc."""

    name: Name
    position: Metre
    mass: Kilogram
    diametral_inertia: KilogramSquareMetre
    polar_inertia: KilogramSquareMetre


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


class Bearing(Entry):
    """Bearing and the block below it."""

    name: Name
    position: Metre
    foundation: Name | None = None
    stiffness: Stiffness
    damping: Damping


class Probe(Entry):
    """Place on the shaft whose motion is wanted."""

    name: Name
    position: Metre


class Rotor(Entry):
    """What turns."""

    shaft_height: Metre
    material: Material | None = None
    shaft: list[Section]
    discs: list[Disc] = []
    bearings: list[Bearing]
    probes: list[Probe] = []


class Unbalance(Entry):
    """Unbalance on one disc."""

    disc: Name
    moment: KilogramMetre
    phase: Radian = 0.0


class Document(Entry):
    """The whole file."""

    name: Name
    soil: Soil | None = None
    support: Support
    foundations: list[Foundation] = []
    rotor: Rotor
    unbalances: list[Unbalance] = []
    speed_range_rpm: tuple[Rpm, Rpm]


_WHAT = {
    'missing': 'is missing',
    'model_type': 'must hold keys and values, got {input}',
    'list_type': 'must be a list, got {input}',
    'tuple_type': 'must be a list, got {input}',
    'too_long': 'has more entries than it should: {input}',
    'literal_error': 'must be {expected}, got {input}',
}


def first_fault(error: ValidationError) -> tuple[tuple[int | str, ...], str]:
    """Return where a document is at fault first, and what is wrong there, in one line."""
    detail: ErrorDetails = error.errors(include_url=False)[0]
    context = detail.get('ctx', {})
    if detail['type'] == 'unknown_key':
        return (*detail['loc'], str(context['key'])), context['problem']
    if detail['type'] == 'value_error':
        return detail['loc'], str(context['error'])
    got = shown(detail['input'])
    if detail['type'] not in _WHAT:
        return detail['loc'], f'{detail["msg"]}, got {got}'
    return detail['loc'], _WHAT[detail['type']].format(input=got, **context)
