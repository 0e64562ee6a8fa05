"""What could stand at a key of a case file, in place of what is wrong there."""

from collections.abc import Iterator, Mapping, Sequence
import difflib
from functools import cache
import random
from types import NoneType, UnionType
from typing import Annotated, Any, get_args, get_origin, get_type_hints, Literal, Union

from rotorsoil_ros.case.document import at
from rotorsoil_ros.case.entries.entry import Entry, Place
from rotorsoil_ros.case.quantities import A_FILE, A_NAME, Usual
from rotorsoil_ros.channel import Channel

# Keys whose values are names of others, and where those stand.
_NAMED_IN = {'foundation': 'foundations', 'disc': 'discs'}
# What nothing in a case is called.
_FRESH = ('stand_in', 'stand_in_2', 'stand_in_3', 'stand_in_4')


def kind_at(kind: Any, content: Any, place: Place) -> Any:
    """
    Return which kind of value the schema wants at a place of a document.

    Parameters
    ----------
    kind : type
        Of the whole document.
    content : Any
        The document: of kinds that a mapping may have it has the one whose keys it holds.
    place : tuple
        Keys and indices; where the schema knows no such place, None is returned.

    """
    for step in place:
        kind = _below(kind, content, step)
        content = inside(content, (step,))
    return kind


def _below(kind: Any, content: Any, step: int | str) -> Any:
    chosen = entry_kind(kind, content, holds=step)
    if chosen is not None:
        return hints(chosen)[str(step)]
    for choice in choices(kind):
        parts = get_args(choice)
        if get_origin(choice) is list and isinstance(step, int):
            return parts[0]
        if get_origin(choice) is tuple and isinstance(step, int) and step < len(parts):
            return parts[step]
        if get_origin(choice) is dict:
            return parts[1]
    return None


def inside(content: Any, place: Place) -> Any:
    """Return what a document holds at a place, None where there is no such place."""
    for step in place:
        if isinstance(content, Mapping):
            content = content.get(step)
        else:
            within = isinstance(content, list) and isinstance(step, int) and step < len(content)
            content = content[step] if within else None
    return content


def entry_kind(
    kind: Any, content: Any, *, holds: int | str | None = None,
) -> type[Entry] | None:
    """Return which mapping a kind is for a content, of those that hold a key; None if none."""
    entries = [choice for choice in choices(kind)
               if isinstance(choice, type) and issubclass(choice, Entry)
               and (holds is None or holds in choice.model_fields)]
    said = set(content) if isinstance(content, Mapping) else set()
    return max(entries, key=lambda entry: len(said & set(entry.model_fields)), default=None)


def choices(kind: Any) -> tuple[Any, ...]:
    """Return the kinds that a value may be of, without what their names add to them."""
    if get_origin(kind) is Annotated:
        return (kind,) if _usual(kind) else choices(get_args(kind)[0])
    if get_origin(kind) in (Union, UnionType):
        return tuple(choice for part in get_args(kind) for choice in choices(part)
                     if choice is not NoneType)
    return () if kind is None else (kind,)


@cache
def hints(entry: type[Entry]) -> dict[str, Any]:
    """Return of which kind each key of a mapping is."""
    return get_type_hints(entry, include_extras=True)


def _usual(kind: Any) -> tuple[Any, ...]:
    return next((part.values for part in get_args(kind)[1:] if isinstance(part, Usual)), ())


class StandIns:
    """
    Values that the schema takes, another one in each draw.

    Draws are independent of each other and of the place, and together they hold every value of
    a kind: what is wrong in all of them does not depend on what stands there.

    Parameters
    ----------
    content : Any
        The document: a name that is not there may be any that it speaks of.
    draw : int
        Which one.

    """

    def __init__(self, content: Any, draw: int) -> None:
        self._content, self._draw = content, draw

    def of(self, kind: Any, place: Place, *, attempt: int = 0) -> Any:
        """Return a value of a kind for a place; a further attempt is another one."""
        known = [choice for choice in choices(kind) if not _needs_file(choice)]
        if not known:
            return False
        choice = self._one_of(known, (*place, 'kind'), attempt)
        origin, parts = get_origin(choice), get_args(choice)
        if origin is Annotated:
            return self._one_of(self._usual(choice, place), place, attempt)
        if origin is Literal:
            return self._one_of(parts, place, attempt)
        if origin in (tuple, list):
            count = len(parts) if origin is tuple else 1 + (self._draw + attempt) % 2
            return _rising([self.of(parts[min(index, len(parts) - 1)], place,
                                    attempt=attempt + index) for index in range(count)])
        if isinstance(choice, type) and issubclass(choice, Entry):
            return self.entry(choice, {}, place, attempt=attempt)
        return {} if origin is dict else False

    def entry(
        self, kind: type[Entry], content: Mapping[str, Any], place: Place, *, attempt: int = 0,
    ) -> dict[str, Any]:
        """
        Return a whole mapping that keeps what it can of a content.

        Where a mapping may say a thing in several ways, one of them is left; a further attempt
        says it with other values.
        """
        said = [way for way in kind.ways if any(content.get(key) is not None for key in way)]
        way = self._one_of(said or kind.ways[:1], (*place, 'ways'), 0) if kind.ways else ()
        wanted = {name for name, field in kind.model_fields.items() if field.is_required() or (
            # What others may name is there in some draws.
            not content and self._draw % 2 and field.default_factory is list)}
        unwanted = {key for keys in kind.ways for key in keys} - (set() if attempt else set(way))
        kept = {key: value for key, value in content.items() if key not in unwanted}
        return kept | {key: self.of(hints(kind)[key], (*place, key), attempt=attempt)
                       for key in sorted(wanted | set(way)) if key not in kept}

    def _usual(self, kind: Any, place: Place) -> Sequence[Any]:
        """Return what a thing may be: for a name, those that the document speaks of."""
        if _usual(kind) == A_FILE.values:  # of which nobody hears that it is not there
            return [f'stand_in_{self._draw}.csv']
        if _usual(kind) != A_NAME.values:
            return _usual(kind)
        if place[-1] in _NAMED_IN:
            return list(_names(self._content, _NAMED_IN[place[-1]])) or _FRESH[:1]
        meant = dict.fromkeys((*_spoken_of(self._content), *_measured(self._content), *_FRESH))
        # One that is taken already would put what has it at fault.
        return [name for name in meant if name not in set(_declared(self._content))]

    def _one_of(self, values: Sequence[Any], place: Place, attempt: int) -> Any:
        order = random.Random(repr(place)).sample(range(len(values)), len(values))
        return values[order[(self._draw + attempt) % len(values)]]


def meant_word(kind: Any, said: object) -> str | None:
    """Return which word of a kind was probably meant, where one was misspelled."""
    words = [word for choice in choices(kind) if get_origin(choice) is Literal
             for word in get_args(choice) if isinstance(word, str)]
    return next(iter(difflib.get_close_matches(str(said), words, n=1)), None)


def _rising(values: list[Any]) -> list[Any]:
    return sorted(values) if all(isinstance(value, float) for value in values) else values


def _needs_file(kind: Any) -> bool:
    """Return whether a mapping is what another file says, which nobody has here."""
    return isinstance(kind, type) and issubclass(kind, Entry) and any(
        field.is_required() and _usual(hints(kind)[name]) == A_FILE.values
        for name, field in kind.model_fields.items())


def _names(content: Any, group: str) -> Iterator[str]:
    """Yield the names in every list of a document that is called so."""
    if isinstance(content, list):
        for value in content:
            yield from _names(value, group)
    elif isinstance(content, Mapping):
        for key, value in content.items():
            for entry in value if key == group and isinstance(value, list) else ():
                if isinstance(entry, Mapping) and isinstance(entry.get('name'), str):
                    yield entry['name']
            yield from _names(value, group)


def _spoken_of(content: Any) -> Iterator[str]:
    """Yield names by which a document refers to things."""
    if isinstance(content, Mapping):
        for key, value in content.items():
            if key in _NAMED_IN and isinstance(value, str):
                yield value
            yield from _spoken_of(value)
    elif isinstance(content, list):
        for value in content:
            yield from _spoken_of(value)


def _declared(content: Any) -> Iterator[str]:
    """Yield what things of a document are called."""
    if isinstance(content, Mapping):
        if isinstance(content.get('name'), str):
            yield content['name']
        content = list(content.values())
    for value in content if isinstance(content, list) else ():
        yield from _declared(value)


def _measured(content: Any) -> Iterator[str]:
    """Yield the stations of the channels that a document names."""
    channels = at(content, 'sensors.channels')
    for name in channels if isinstance(channels, Mapping) else ():
        yield Channel.parse(str(name)).station
