"""What a plant is asked about its machine, and whether an answer can be one."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from pydantic import ValidationError

from rotorsoil_ros.case import document
from rotorsoil_ros.case.authoring import library
from rotorsoil_ros.case.case_errors import message
from rotorsoil_ros.case.entries.entry import Entry, faults, Place
from rotorsoil_ros.case.plausible import asked
from rotorsoil_ros.case.quantities import (
    BalanceGrade,
    Kilogram,
    KilogramPerCubicMetre,
    Kilowatt,
    Metre,
    MetrePerSecond,
    Name,
    Rpm,
)
from rotorsoil_ros.errors import InputError

SOURCE = '--answer'


@dataclass(frozen=True, slots=True)
class Inquiry:
    """
    One thing that a plant may know.

    Attributes
    ----------
    key, unit : str
        How it is called and in which unit it is, if it has one.
    text : str
        What is asked.
    otherwise : str
        What is taken where nobody answers; empty where somebody has to.
    known : tuple of two floats or None
        Between which values such a thing lies, in its unit.
    slips : tuple of floats
        By which factors an answer in another unit is off, the likeliest first.

    """

    key: str
    unit: str
    text: str
    otherwise: str = ''
    known: tuple[float, float] | None = None
    slips: tuple[float, ...] = ()

    @property
    def choices(self) -> tuple[str, ...]:
        """What may be answered, where it is not a number."""
        shelves = {'kind': library.MACHINES, 'bearing': library.BEARINGS, 'soil': library.SOILS,
                   'pedestal': library.PEDESTALS}
        if self.key not in shelves:
            return ()
        found = library.names(shelves[self.key])
        return (*found, 'none') if self.key == 'pedestal' else found

    def faults(self, value: object) -> Iterator[str]:
        """Yield what is wrong with a number that no such thing has."""
        if self.known is not None and isinstance(value, float):
            yield from asked(self.key, value, (*self.known, self.unit, self.slips))


_MM, _TON = (1e-3, 1e-2), (1e3,)

QUESTIONS = (
    Inquiry('kind', '', 'which kind of machine'),
    Inquiry('name', '', 'how the machine is called: small letters, digits and _', 'its kind'),
    Inquiry('power_kw', 'kW', 'rated power', known=(0.1, 1e6), slips=(1e-3,)),
    Inquiry('rpm', 'rpm', 'rated speed', known=(10.0, 1e5)),
    Inquiry('rotor_mass', 'kg', 'mass of all that turns', 'by kind and size', (0.5, 5e5), _TON),
    Inquiry('shaft_diameter', 'm', 'diameter of the shaft between its bearings',
            'by torque and first bending', (5e-3, 3.0), _MM),
    Inquiry('bearing', '', 'type of the bearings', 'usual for the kind'),
    Inquiry('bearing_span', 'm', 'distance of the bearings', 'by size', (0.02, 50.0), _MM),
    Inquiry('overhang', 'm', 'from the last bearing to the middle of an overhung wheel',
            'by size', (0.02, 20.0), _MM),
    Inquiry('pedestal', '', 'what the bearings stand on', 'usual for the kind'),
    Inquiry('machine_mass', 'kg', 'mass of all that stands on the block and does not turn: '
            'motor, casing, frame', 'by torque and rotor', (1.0, 1e7), _TON),
    Inquiry('block_width', 'm', 'width of the foundation block, across the shaft',
            'three times the mass of the machine', (0.1, 60.0), _MM),
    Inquiry('block_length', 'm', 'its length, along the shaft', 'as its width', (0.1, 60.0),
            _MM),
    Inquiry('block_height', 'm', 'its height', 'as its width', (0.1, 20.0), _MM),
    Inquiry('shaft_height', 'm', 'height of the shaft above the top of the block', 'by size',
            (0.02, 20.0), _MM),
    Inquiry('soil', '', 'class of the soil below the block', 'unknown'),
    Inquiry('shear_wave_velocity', 'm/s', 'velocity of shear waves in it, if measured',
            'by class', (30.0, 3500.0), (1e3,)),
    Inquiry('density', 'kg/m^3', 'density of the soil, if measured', 'by class',
            (800.0, 3500.0), (1e3,)),
    Inquiry('balance_grade', '', 'balance grade of ISO 21940-11, as in G6.3',
            'usual for the kind'),
)


class Answers(Entry):
    """What a plant knows; None is what it does not."""

    kind: Literal['fan', 'pump', 'motor_driven', 'turbine']
    power_kw: Kilowatt
    rpm: Rpm
    name: Name | None = None
    rotor_mass: Kilogram | None = None
    shaft_diameter: Metre | None = None
    bearing: Literal['rolling', 'ball', 'journal', 'tilting_pad'] | None = None
    bearing_span: Metre | None = None
    overhang: Metre | None = None
    pedestal: Literal['steel', 'cast_iron', 'concrete', 'none'] | None = None
    machine_mass: Kilogram | None = None
    block_width: Metre | None = None
    block_length: Metre | None = None
    block_height: Metre | None = None
    shaft_height: Metre | None = None
    soil: Literal['loose_sand', 'dense_sand', 'soft_clay', 'stiff_clay', 'gravel',
                  'weathered_rock', 'unknown'] | None = None
    shear_wave_velocity: MetrePerSecond | None = None
    density: KilogramPerCubicMetre | None = None
    balance_grade: BalanceGrade | None = None


def parsed(settings: Sequence[str]) -> dict[str, Any]:
    """
    Return the answers of `KEY=VALUE` settings.

    Raises
    ------
    InputError
        If one has no `=` or a key stands there twice, a line for each.

    """
    found: dict[str, Any] = {}
    faults = []
    for setting in settings:
        key, equals, value = setting.partition('=')
        source = f'{SOURCE} {document.shown(setting)[1:-1]}'
        if not equals or not key:
            faults.append(f'{source}: must be KEY=VALUE')
        elif key in found:
            faults.append(f'{source}: {key} is answered twice')
        else:
            found[key] = document.parse(value, source=source)
    if faults:
        raise InputError('\n'.join(faults))
    return found


def checked(given: Mapping[str, Any]) -> Answers:
    """
    Return answers that can be true.

    Raises
    ------
    InputError
        With everything that is wrong, a line for each.

    """
    place = Path(SOURCE)
    wrong: list[str] = []
    try:
        answers = Answers.model_validate(dict(given))
    except ValidationError as error:
        wrong = [message(place, where, _with_unit(where, problem))
                 for where, problem in faults(error)]
        answers = _as_far_as_right(given, error)
    for question in QUESTIONS:
        value = getattr(answers, question.key, None)
        wrong += [f'{SOURCE}: {fault}' for fault in question.faults(value)]
    if (answers.bearing_span is not None and answers.block_length is not None
            and answers.bearing_span > answers.block_length):
        wrong.append(message(place, ('bearing_span',), (
            f'must be at most the length of the block, {answers.block_length:g} m, on which both '
            f'bearings stand, got {answers.bearing_span:g} m')))
    if wrong:
        raise InputError('\n'.join(wrong))
    return answers


def faults_of(question: Inquiry, value: object) -> list[str]:
    """Return what is wrong with one answer by itself."""
    try:
        answers = Answers.model_validate({**_ANY, question.key: value})
    except ValidationError as error:
        return [f'{question.key}: {problem}' for _, problem in faults(error)]
    return list(question.faults(getattr(answers, question.key)))


# Stands for what has to be told while the rest is looked at.
_ANY: dict[str, Any] = {'kind': 'fan', 'power_kw': 1.0, 'rpm': 1000.0}


def _with_unit(where: Place, problem: str) -> str:
    unit = next((one.unit for one in QUESTIONS if one.key == where[0]), '')
    return f'{problem}, in {unit}' if problem == 'is missing' and unit else problem


def _as_far_as_right(given: Mapping[str, Any], error: ValidationError) -> Answers:
    """Return the answers that are right by themselves, so that they are looked at too."""
    bad = {where[0] for where, _ in faults(error)}
    return Answers.model_validate(
        {**_ANY, **{key: value for key, value in given.items() if key not in bad}})
