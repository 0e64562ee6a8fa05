"""In which unit a value of a case file is, and which values are refused at once."""

import math
import re
from typing import Annotated

from pydantic import BeforeValidator

from rotorsoil_ros.case.document import shown

# Larger than any stiffness or speed; products of such numbers still fit into a double.
_LARGEST_NUMBER = 1e18
# Below lie denormal numbers, which have no inverse.
_SMALLEST_NUMBER = 1e-300
# More elements in one section are a slip of the keyboard and would fill the memory.
_LARGEST_COUNT = 1000
_NAME = re.compile(r'[a-z][a-z0-9_]{0,63}')
_GRADE = re.compile(r'[Gg] ?([0-9]{1,5}(?:\.[0-9]{1,5})?)')


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
        if 0.0 < abs(value) < _SMALLEST_NUMBER:
            raise ValueError(f'{rule}, 0 or at least {_SMALLEST_NUMBER:g}, got {value:g}')
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


def _grade(value: object) -> float:
    """Return a balance grade of ISO 21940-11 as e Omega [m/s]."""
    found = _GRADE.fullmatch(value) if isinstance(value, str) else None
    if found is None or not float(found[1]) > 0.0:
        raise ValueError('must be a balance grade in mm/s with its G, as in G6.3, got '
                         f'{shown(value)}')
    return 1e-3 * float(found[1])


def _file(value: object) -> str:
    if not isinstance(value, str) or not value.isprintable() or not value.strip():
        raise ValueError(f'must be the path of a file, got {shown(value)}')
    return value


Name = Annotated[str, BeforeValidator(_name)]
FileName = Annotated[str, BeforeValidator(_file)]
Count = Annotated[int, BeforeValidator(_count)]
Ratio = Annotated[float, _number_in('')]
Metre = Annotated[float, _number_in('m')]
MetrePerSecond = Annotated[float, _number_in('m/s')]
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
BalanceGrade = Annotated[float, BeforeValidator(_grade)]
