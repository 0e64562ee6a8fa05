"""In which unit a value of a case file is, and which values are refused at once."""

from dataclasses import dataclass
from functools import cache, partial
import math
import re
import tokenize
from typing import Annotated, TYPE_CHECKING, TypeGuard

from pydantic import BeforeValidator

from rotorsoil_ros.case.document import shown

if TYPE_CHECKING:
    import pint

# Larger than any stiffness or speed; products of such numbers still fit into a double.
_LARGEST_NUMBER = 1e18
# Below lie denormal numbers, which have no inverse.
_SMALLEST_NUMBER = 1e-300
# More elements in one section are a slip of the keyboard and would fill the memory.
_LARGEST_COUNT = 1000
_NAME = re.compile(r'[a-z][a-z0-9_]{0,63}')
# A number and what can be a unit: nothing that a parser would have to compute for long.
_WITH_UNIT = re.compile(
    r'([-+]?(?:[0-9]{1,20}(?:\.[0-9]{0,20})?|\.[0-9]{1,20})(?:[eE][-+]?[0-9]{1,3})?)\s*'
    r'((?:[A-Za-zµμ°%Ω]+(?:\^[-+]?[0-9])?[ */·]{0,2}){1,6})')
_OIL = re.compile(r'(?:(?:ISO ?)?VG ?)?([0-9]{1,4})', re.IGNORECASE)
_SIDE = re.compile(r'([0-9]{1,3}(?:\.[0-9]{1,6})?) ?([LlRr])')
_GRADE = re.compile(r'[Gg] ?([0-9]{1,5}(?:\.[0-9]{1,5})?)')


def _number_in(unit: str, *, may_be_endless: bool = False) -> BeforeValidator:
    """Return a validator that takes finite numbers, or text of a number and its unit."""
    return BeforeValidator(partial(_number, unit=unit, may_be_endless=may_be_endless))


def _number(value: object, *, unit: str, may_be_endless: bool = False) -> float:
    """Return a finite number, given as one or as text with its unit."""
    rule = f'must be a finite number{unit and f" in {unit}"}'
    if may_be_endless:
        rule = f'must be a number in {unit}, or .inf'
    if isinstance(value, str) and (found := _WITH_UNIT.fullmatch(value.strip())):
        value = _converted(float(found[1]), found[2], unit, rule)
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise ValueError(f'{rule}, got {shown(value)}')
    if may_be_endless and value == math.inf:
        return math.inf
    if not math.isfinite(value):
        raise ValueError(f'{rule}, got {value}')
    if abs(value) > _LARGEST_NUMBER:
        raise ValueError(f'{rule} of at most {_LARGEST_NUMBER:g}, got {value:g}')
    if 0.0 < abs(value) < _SMALLEST_NUMBER:
        raise ValueError(f'{rule}, 0 or at least {_SMALLEST_NUMBER:g}, got {value:g}')
    return float(value)


def _converted(number: float, given: str, unit: str, rule: str) -> float:
    """Return a number in another unit in the unit of its key."""
    import pint  # a quarter of a second, for who writes units only

    said = f'{number:g} {given}'
    # Of an acceleration it is that of gravity and no gram.
    known = 'standard_gravity' if unit == 'm/s^2' and given.strip() == 'g' else given
    try:
        registry = _registry()
        return float(registry.Quantity(number, known).to(_spelled(unit)).magnitude)
    except pint.UndefinedUnitError as error:
        raise ValueError(f'{rule}, got {shown(said)}, a unit that is not known') from error
    except pint.DimensionalityError as error:
        raise ValueError(f'{rule}, got {shown(said)}, which is none of that') from error
    except (pint.errors.PintError, tokenize.TokenError, ValueError, TypeError, ArithmeticError,
            SyntaxError, AttributeError) as error:
        raise ValueError(f'{rule}, got {shown(said)}') from error


@cache
def _registry() -> 'pint.UnitRegistry[float]':
    import pint

    registry: pint.UnitRegistry[float] = pint.UnitRegistry(
        cache_folder=None, on_redefinition='ignore')
    # Here only turns come per second: 16.5 Hz of a rotor are 990 rpm.
    registry.define('hertz = turn / second = Hz')
    return registry


def _spelled(unit: str) -> str:
    """Return a unit of a case file as pint spells it."""
    return unit.replace(' ', '*') or 'dimensionless'


def is_name(value: object) -> TypeGuard[str]:
    """Return whether something may be called so."""
    return isinstance(value, str) and _NAME.fullmatch(value) is not None


def _name(value: object) -> str:
    if not is_name(value):
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


def _oil_grade(value: object) -> int:
    """Return the number of an ISO viscosity grade."""
    found = _OIL.fullmatch(str(value).strip()) if isinstance(value, (str, int)) else None
    if found is None or isinstance(value, bool):
        raise ValueError(f'must be an ISO viscosity grade, as in 46 or VG46, got {shown(value)}')
    return int(found[1])


def _probe_angle(value: object) -> float | str:
    """Return degrees from z towards x, or as a plant says it: 45L, 45R."""
    if isinstance(value, str) and (found := _SIDE.fullmatch(value.strip())):
        return f'{found[1]}{found[2].upper()}'
    try:
        return _number(value, unit='deg')
    except ValueError as error:
        raise ValueError('must be degrees from z towards x, or 45L or 45R as seen from the '
                         f'driver, got {shown(value)}') from error


def _file(value: object) -> str:
    if not isinstance(value, str) or not value.isprintable() or not value.strip():
        raise ValueError(f'must be the path of a file, got {shown(value)}')
    return value


@dataclass(frozen=True, init=False)
class Usual:
    """Values that things of a kind have; what is wrong with a file is searched for with them."""

    values: tuple[object, ...]

    def __init__(self, *values: object) -> None:
        object.__setattr__(self, 'values', values)


A_NAME = Usual('stand_in')
Name = Annotated[str, BeforeValidator(_name), A_NAME]
A_FILE = Usual('stand_in.csv')
FileName = Annotated[str, BeforeValidator(_file), A_FILE]
Count = Annotated[int, BeforeValidator(_count), Usual(4, 5, 9, 1, 31)]
Ratio = Annotated[float, _number_in(''), Usual(0.3, 0.0, 1.0, 0.1, 2.0)]
Metre = Annotated[float, _number_in('m'), Usual(0.1, 1.0, 0.0, 0.5, 6.0)]
Clearance = Annotated[float, _number_in('m'), Usual(1e-4, 2e-5, 1e-3, 5e-4, 5e-6)]
MetreOrEndless = Annotated[float, _number_in('m', may_be_endless=True), Usual(1.0, 0.2, 30.0)]
MetrePerSecond = Annotated[float, _number_in('m/s'), Usual(150.0, 2e-3, 5e-3, 9e-3, 700.0)]
MetrePerSecondSquared = Annotated[float, _number_in('m/s^2'), Usual(20.0, 500.0)]
Kilogram = Annotated[float, _number_in('kg'), Usual(500.0, 20.0, 4e4, 1.0, 0.0)]
Kilowatt = Annotated[float, _number_in('kW'), Usual(75.0, 4.0)]
KilogramPerMetre = Annotated[float, _number_in('kg/m'), Usual(0.0, 10.0)]
KilogramMetre = Annotated[float, _number_in('kg m'), Usual(0.01, 1e-4, 1.0, 0.0)]
KilogramSquareMetre = Annotated[float, _number_in('kg m^2'), Usual(50.0, 1.0, 2e4, 0.01, 0.0)]
KilogramPerCubicMetre = Annotated[
    float, _number_in('kg/m^3'), Usual(2000.0, 1600.0, 7850.0, 2400.0)]
Pascal = Annotated[float, _number_in('Pa'), Usual(5e7, 2e8, 2e11, 1e9, 2e7)]
NewtonPerMetre = Annotated[float, _number_in('N/m'), Usual(1e8, 1e6, 2e9, 0.0)]
NewtonSecondPerMetre = Annotated[float, _number_in('N s/m'), Usual(1e4, 100.0, 1e6, 0.0)]
Newton = Annotated[float, _number_in('N'), Usual(-3000.0, 0.0, -50.0)]
NewtonMetre = Annotated[float, _number_in('N m'), Usual(0.0, 500.0, -50.0)]
Second = Annotated[float, _number_in('s'), Usual(0.0, 1e-5)]
PerSecond = Annotated[float, _number_in('1/s'), Usual(0.0, 1.0)]
PascalSecond = Annotated[float, _number_in('Pa s'), Usual(0.02, 0.06, 0.005)]
Degree = Annotated[float, _number_in('deg'), Usual(60.0, 20.0, 120.0)]
ProbeAngle = Annotated[float | str, BeforeValidator(_probe_angle), Usual(45.0, -45.0)]
Celsius = Annotated[float, _number_in('degC'), Usual(45.0, 60.0, 30.0)]
Radian = Annotated[float, _number_in('rad'), Usual(0.0, 1.0, 3.0)]
Hertz = Annotated[float, _number_in('Hz'), Usual(20.0, 5.0, 80.0)]
Rpm = Annotated[float, _number_in('rpm'), Usual(1000.0, 100.0, 3000.0, 0.0, 2e4)]
BalanceGrade = Annotated[float, BeforeValidator(_grade), Usual('G6.3', 'G2.5')]
OilGrade = Annotated[int, BeforeValidator(_oil_grade), Usual(46, 32, 68)]
