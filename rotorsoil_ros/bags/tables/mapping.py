"""Which column is what? The map of a table, as a YAML file or as options, with all its faults."""

from collections.abc import Callable, Container, Mapping
from dataclasses import dataclass
import math
from pathlib import Path
import re
from typing import Annotated, Any, Self, TypeAlias

from pydantic import AfterValidator, Field, model_validator, ValidationError

from rotorsoil_ros.bags.tables.cells import (
    amplitude_unit,
    Clock,
    PHASE_UNITS,
    plain_unit,
    SPEED_SPELLINGS,
    start_of,
    TIME_UNITS,
)
from rotorsoil_ros.case import document
from rotorsoil_ros.case.entries.entry import Entry, faults
from rotorsoil_ros.errors import InputError

Column: TypeAlias = str | int
# Where a fault is told to be, given the keys that lead to it.
Spell: TypeAlias = Callable[[tuple[int | str, ...]], str]

PLAIN_NAME = re.compile(r'[A-Za-z][A-Za-z0-9_]*')
EXAMPLE = """machine: fan
time: {column: Time, unit: s}          # or format: "%d.%m.%Y %H:%M:%S"; or every: turn
speed: {column: Speed, unit: rpm}
channels:
  drive_end_housing_x:
    amplitude: {column: DE hor, unit: um p-p}
    phase: {column: DE hor phase, unit: deg, sense: lag}"""


def _said(check: Callable[[str], object]) -> AfterValidator:
    """Return a validator of a text that may be left out."""
    def validate(text: str) -> str:
        if text:
            check(text)
        return text
    return AfterValidator(validate)


def _one_of(known: Container[str], rule: str) -> AfterValidator:
    def check(text: str) -> None:
        if plain_unit(text) not in known:
            raise InputError(f'must be {rule}, got {text!r}')
    return _said(check)


def _name(text: str) -> str:
    if not PLAIN_NAME.fullmatch(text):
        raise InputError(f'must be a name of letters, digits and _, got {text!r}')
    return text


def _interval(every: str | float | None) -> str | float | None:
    if every not in (None, 'turn') and not (isinstance(every, float) and every > 0.0):
        raise InputError(f'must be turn or a number of seconds > 0, got {every!r}')
    return every


def _ratio(ratio: float) -> float:
    if ratio == 0.0 or not math.isfinite(ratio):
        raise InputError(f'must be finite and not 0, got {ratio:g}')
    return ratio


def _sense(sense: str) -> str:
    if sense not in ('lag', 'lead'):
        raise InputError('must be said: lag (the peak comes after the mark) or lead'
                         + (f', got {sense!r}' if sense else ''))
    return sense


class TimeMap(Entry):
    """When a row was measured."""

    column: Column | None = None
    unit: Annotated[str, _one_of(TIME_UNITS, f'one of {", ".join(TIME_UNITS)}')] = ''
    format: str = ''
    zone: Annotated[str, _said(lambda zone: Clock(zone=zone))] = ''
    start: Annotated[str, _said(start_of)] = ''
    every: Annotated[str | float | None, AfterValidator(_interval)] = None

    @model_validator(mode='after')
    def _is_one_way(self) -> Self:
        if (self.column is None) == (self.every is None):
            raise InputError('must have either a column or `every`')
        if self.unit and self.format:
            raise InputError('must not have both unit and format: times are numbers or dates')
        return self


class SpeedMap(Entry):
    """How fast it turned."""

    column: Column
    unit: Annotated[str, _one_of(SPEED_SPELLINGS, 'rpm, Hz, rad/s or deg/s')] = ''
    ratio: Annotated[float, AfterValidator(_ratio)] = 1.0


class AmplitudeMap(Entry):
    """How much something moved."""

    column: Column
    unit: Annotated[str, _said(amplitude_unit)] = ''


class PhaseMap(Entry):
    """With which phase it moved."""

    column: Column
    unit: Annotated[str, _one_of(PHASE_UNITS, 'deg or rad')] = ''
    # Asked for always: a phase of the other sense is as plausible as the right one.
    sense: Annotated[str, Field(validate_default=True), AfterValidator(_sense)] = ''


class ChannelMap(Entry):
    """One place that was measured."""

    amplitude: AmplitudeMap
    phase: PhaseMap | None = None


def _channels(channels: dict[str, ChannelMap]) -> dict[str, ChannelMap]:
    if not channels:
        raise InputError('is missing: where it was measured, as in drive_end_housing_x')
    return channels


class TableMap(Entry):
    """The whole map."""

    machine: Annotated[str, AfterValidator(_name)]
    time: TimeMap | None = None
    speed: SpeedMap
    channels: Annotated[dict[Annotated[str, AfterValidator(_name)], ChannelMap],
                        AfterValidator(_channels)]
    sheet: str = ''

    def columns(self) -> list[Column]:
        """Return every column that is named."""
        found: list[Column | None] = [self.time.column if self.time else None, self.speed.column]
        for channel in self.channels.values():
            found += [channel.amplitude.column, channel.phase.column if channel.phase else None]
        return [column for column in found if column is not None]


@dataclass(frozen=True)
class Map:
    """A map, and how a fault of it is told."""

    said: TableMap
    spell: Spell

    def fault(self, place: tuple[int | str, ...], problem: str) -> str:
        """Return the line that tells a fault."""
        return f'{self.spell(place)}: {problem}'


def read_map(source: Path) -> Map:
    """Read a map from a YAML file; raise InputError with all its faults."""
    return checked(document.read(source), _in_file(source))


def map_of(options: Mapping[str, Any]) -> Map:
    """Return a map of what options say, by their keys such as `channels.amplitude.unit`."""
    return checked(dict(options), _as_option)


def _in_file(source: Path) -> Spell:
    return lambda place: ': '.join(filter(None, (str(source), '.'.join(map(str, place)))))


def _as_option(place: tuple[int | str, ...]) -> str:
    """Return the option of a key: of the one channel of a table the name is an option itself."""
    steps = [str(step) for step in place]
    if steps[:1] == ['channels']:
        steps = steps[2:] or ['channel']
    if steps[-1:] == ['column']:
        steps.pop()
    return '--' + '-'.join(steps)


def checked(content: Mapping[str, Any], spell: Spell) -> Map:
    """Return a map if nothing is wrong with it; raise InputError with all that is."""
    try:
        return Map(TableMap.model_validate(content), spell)
    except ValidationError as error:
        raise InputError('\n'.join(
            f'{spell(_shortened(place))}: {problem}'
            for place, problem in faults(error))) from error


def _shortened(place: tuple[int | str, ...]) -> tuple[int | str, ...]:
    """Leave out which of several types a key could have had."""
    return tuple(step for step in place if step not in ('str', 'int', 'float', '[key]'))
