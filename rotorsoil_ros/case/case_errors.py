"""Where in a case file a fault lies, and how it is told in one line."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
import re
from typing import TypeVar

from pydantic import ValidationError

from rotorsoil_ros.case import schema
from rotorsoil_ros.case.document import shown
from rotorsoil_ros.case.entries.bearing import BearingEntry
from rotorsoil_ros.case.entries.entry import Entry, faults, Place
from rotorsoil_ros.errors import InputError, RotorSoilError

T = TypeVar('T')
E = TypeVar('E')
M = TypeVar('M', bound=Entry)

# Keys that a machine of several has for itself.
_OF_MACHINE = ('rotor', 'unbalances', 'speed_range_rpm')


def message(path: Path, place: Place, problem: str) -> str:
    """Return `file: key.path: problem`."""
    steps = (str(step) for step in place)
    words = (step if step.isidentifier() or step.isdigit() else shown(step) for step in steps)
    return ': '.join(filter(None, (str(path), '.'.join(words), problem)))


class CaseError(InputError):
    """What is wrong at one key of a file, in one line; `under` a place of the case it stands."""

    def __init__(self, path: Path, place: Place, problem: str, *, under: Place = ()) -> None:
        super().__init__(message(path, place, problem))
        self.place = (*under, *place)


def place_of(error: InputError) -> Place:
    """Return at which key a case is at fault, nowhere where another file is."""
    return error.place if isinstance(error, CaseError) else ()


def validated(
    kind: type[M], path: Path, content: object, rotor_files: Mapping[Place, Path],
) -> tuple[M | None, list[InputError]]:
    """Return a document as entries, or all that is wrong with their form."""
    def of(place: Place, problem: str) -> InputError:
        under = place[:2]
        if under in rotor_files and place[2:3] == ('rotor',):
            return CaseError(rotor_files[under], place[2:], problem, under=under)
        return CaseError(path, place, problem)

    try:
        return kind.model_validate(content), []
    except ValidationError as error:
        return None, [of(place, problem) for place, problem in faults(error)]


@dataclass(frozen=True)
class Faults:
    """
    Says at which key of its file a document is refused.

    Attributes
    ----------
    path : Path
        The file.
    entries : schema.Document
        What it says.
    found : list of InputError
        Faults that were met so far, a line each.
    under : tuple
        Place of the machine in the file of a plant, below which its own keys stand.
    rotor_file : Path or None
        The file that describes its rotor, where that is another one.
    seats : tuple of str
        On which the bearings of all machines of a plant stand; none of one alone.

    """

    path: Path
    entries: schema.Document
    found: list[InputError] = field(default_factory=list)
    under: Place = ()
    rotor_file: Path | None = None
    seats: tuple[str, ...] = ()

    def attempt(self, build: Callable[[], T]) -> T | None:
        """Return what is built, or keep what is wrong with it for later, and return None."""
        try:
            return build()
        except InputError as error:
            self.found.append(error)
            return None

    def attempt_each(
        self, build: Callable[[int, E], T], entries: Iterable[E],
    ) -> tuple[T, ...] | None:
        """Return what is built of every entry, or None if one is at fault."""
        built = [self.attempt(partial(build, index, entry))
                 for index, entry in enumerate(entries)]
        sound = tuple(one for one in built if one is not None)
        return sound if len(sound) == len(built) else None

    @contextmanager
    def at(self, *place: int | str, entry: Entry | None = None) -> Iterator[None]:
        """Turn a refusal of the physics into an error at a key of the file."""
        try:
            yield
        except InputError:
            raise
        except RotorSoilError as error:
            # The physics says `mass must be ...` or `position of disc_1 must be ...`.
            problem = str(error)
            found = re.match(r'(\w+)(?: of (\w+)| about \w+)? must ', problem)
            if found and found[2]:
                place = (*self._station(found[2]), found[1])
            elif found and entry is not None and found[1] in type(entry).model_fields:
                place = (*place, found[1])
                problem = problem.removeprefix(f'{found[1]} ')
            raise self.error(*place, problem=problem) from error

    def error(self, *place: int | str, problem: str) -> InputError:
        """Return the error to raise at a key."""
        if self.rotor_file is not None and place[:1] == ('rotor',):
            # A key of that file is none of this one.
            return CaseError(self.rotor_file, place, problem, under=self.under)
        if place and place[0] in _OF_MACHINE:
            place = (*self.under, *place)
        return CaseError(self.path, place, problem)

    def names_differ(self) -> bool:
        """Return whether no two stations have one name; the second of them is a fault."""
        seen: dict[str, Place] = {}
        for place, name in self._stations():
            if name in seen:
                first = '.'.join(map(str, seen[name]))
                self.found.append(self.error(
                    *place, 'name', problem=f'must differ from that of {first}, got {name} twice'))
            seen.setdefault(name, place)
        return len(seen) == len(self._stations())

    def _stations(self) -> list[tuple[Place, str]]:
        rotor = self.entries.rotor
        groups: list[tuple[Place, Sequence[
            schema.FoundationEntry | schema.DiscEntry | BearingEntry
            | schema.ProbeEntry | schema.GroundProbeEntry | schema.GroundSensorEntry]]] = [
            (('foundations',), self.entries.foundations), (('rotor', 'discs'), rotor.discs),
            (('rotor', 'bearings'), rotor.bearings), (('rotor', 'probes'), rotor.probes),
            (('ground', 'probes'), self.entries.ground.probes),
            (('ground', 'sensors'), self.entries.ground.sensors)]
        return [((*group, index), entry.name) for group, entries in groups
                for index, entry in enumerate(entries)]

    def _station(self, name: str) -> Place:
        return next((place for place, own in self._stations() if own == name), ('rotor',))
