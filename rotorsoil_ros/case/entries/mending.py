"""All that is wrong with a case file, though some of it hides the rest."""

from collections import Counter
from collections.abc import Callable, Sequence
from copy import deepcopy
from typing import Any

from rotorsoil_ros.case.case_errors import place_of
from rotorsoil_ros.case.entries.entry import Entry, meant_key, Place
from rotorsoil_ros.case.entries.stand_in import (
    entry_kind,
    inside,
    kind_at,
    meant_word,
    StandIns,
)
from rotorsoil_ros.errors import InputError

# Documents in which what is wrong is mended, each in its own way: as many as a kind of numbers
# has values, or as there are blocks to stand on, so that together they try every one.
_DRAWS = 5
_MOST_DRAWS = 16
# A mended document shows what was hidden behind what was mended, and so on.
_MOST_ROUNDS = 60
# Values that are tried at a place before what holds it is mended instead.
_LAST_ATTEMPT = 5

# Tells what is wrong with a document and can be seen at once, where it was mended at some places.
Check = Callable[[dict[str, Any], frozenset[Place]], Sequence[InputError]]


def all_faults(
    schema: type[Entry], content: dict[str, Any], first: Sequence[InputError], check: Check,
) -> list[InputError]:
    """
    Return every fault of a document that does not hang on another one.

    What is at fault is replaced by something else, in several ways, and the document is read
    again, until nothing more is found. A fault that shows whatever was put in place of the
    others is one of its own; one that comes or goes with it is not told.

    Parameters
    ----------
    schema : type
        Of the document.
    content : dict
        The document; stays as it is.
    first : sequence of InputError
        What is wrong with it, as far as it can be seen at once.
    check : callable
        Tells the same of a mended document.

    """
    blocks = content.get('foundations')
    draws = max(_DRAWS, min(_MOST_DRAWS, len(blocks) if isinstance(blocks, list) else 0))
    mended = [_Mended(schema, content, draw, check) for draw in range(draws)]
    hidden = [one.hidden(first) for one in mended]
    everywhere = [fault for text, fault in hidden[0].items()
                  if all(text in found for found in hidden)]
    return [*{str(fault): fault for fault in first}.values(), *(
        fault for fault in everywhere if all(one.still_shows(fault) for one in mended))]


class _Mended:
    """A document in which what is wrong is replaced in the way of one draw."""

    def __init__(
        self, schema: type[Entry], content: dict[str, Any], draw: int, check: Check,
    ) -> None:
        self._schema, self._check, self._original = schema, check, content
        self._content = deepcopy(content)
        self._stand_ins = StandIns(content, draw)
        self._attempts: Counter[Place] = Counter()
        self._changed: dict[Place, set[Place]] = {}

    def hidden(self, first: Sequence[InputError]) -> dict[str, InputError]:
        """Return what shows, by its words, when what was found first is mended, and so on."""
        told: dict[str, InputError] = {}
        found = first
        for _ in range(_MOST_ROUNDS):
            if not any([self._mend(place) for place in dict.fromkeys(map(place_of, found))]):
                break
            found = self._check(self._content, self._places)
            told |= {str(fault): fault for fault in found if not self._is_own(place_of(fault))}
        known = {str(fault) for fault in first}
        return {text: fault for text, fault in told.items() if text not in known}

    def still_shows(self, fault: InputError) -> bool:
        """Return whether what the user wrote is at fault where all else is mended."""
        content = deepcopy(self._content)
        for place in self._changed.get(place_of(fault), ()):
            _restore(content, self._original, place)
        return str(fault) in map(str, self._check(content, self._places))

    @property
    def _places(self) -> frozenset[Place]:
        return frozenset(place for places in self._changed.values() for place in places)

    def _is_own(self, place: Place) -> bool:
        """Return whether what stands at a place was put there."""
        return any(place[:depth] in self._places for depth in range(1, len(place) + 1))

    def _mend(self, place: Place) -> bool:
        """Replace what stands at a place; return whether there was something to try."""
        fault, changed = place, self._changed.setdefault(place, set())
        while place:
            attempt = self._attempts[place]
            self._attempts[place] += 1
            parent = inside(self._content, place[:-1])
            if attempt > _LAST_ATTEMPT or not isinstance(parent, (dict, list)):
                place = place[:-1] if len(place) > 2 else ()
            elif new := self._another(
                    parent, place, attempt, goes=attempt == _LAST_ATTEMPT if place == fault
                    else isinstance(inside(parent, place[-1:]), list)):
                changed |= new
                return True
        return False

    def _another(
        self, parent: Any, place: Place, attempt: int, *, goes: bool,
    ) -> set[Place]:
        """Put something else at a place; return where the document is another one."""
        if isinstance(parent, list):
            return self._put(parent, place, attempt)
        owner = entry_kind(kind_at(self._schema, self._content, place[:-1]), parent)
        if owner is None or place[-1] not in owner.model_fields:
            return self._rename_or_drop(parent, place, owner)
        in_a_way = any(place[-1] in way for way in owner.ways)
        if in_a_way and (changed := self._whole(place[:-1], owner, parent, attempt=0)):
            return changed
        field = owner.model_fields[str(place[-1])]
        if goes and not in_a_way and place[-1] in parent and not field.is_required():
            del parent[place[-1]]
            return {place}
        return self._put(parent, place, attempt)

    def _rename_or_drop(
        self, parent: dict[Any, Any], place: Place, owner: type[Entry] | None,
    ) -> set[Place]:
        """Give what an unknown key says to the one that it was probably meant to be."""
        key = next((key for key in parent if str(key) == str(place[-1])), None)
        if key is None:
            return set()
        meant = None if owner is None else meant_key(key, owner, parent)
        value = parent.pop(key)
        if meant is not None and parent.get(meant) is None:
            parent[meant] = value
        return {place}

    def _whole(
        self, place: Place, owner: type[Entry], content: dict[str, Any], *, attempt: int,
    ) -> set[Place]:
        """Make a mapping say in one way what it may say in several, and leave out nothing."""
        value = self._stand_ins.entry(owner, content, place, attempt=attempt)
        changed = {(*place, key) for key in {*content, *value}
                   if content.get(key) != value.get(key)}
        content.clear()
        content.update(value)
        return changed

    def _put(self, parent: Any, place: Place, attempt: int) -> set[Place]:
        kind, before = kind_at(self._schema, self._content, place), inside(parent, place[-1:])
        owner = entry_kind(kind, before)
        if owner is not None and isinstance(before, dict) and (owner.ways or not attempt):
            return self._whole(place, owner, before, attempt=attempt)
        fresh = (attempt == 0 and meant_word(kind, before)) or self._stand_ins.of(
            kind, place, attempt=attempt)
        if fresh == before:
            return set()
        if attempt == 0 and _hold_mappings(before) and _hold_mappings(fresh):
            before.extend(fresh)  # there are too few of them, perhaps
            return {(*place, index) for index in range(len(before) - len(fresh), len(before))}
        if isinstance(parent, list) and int(place[-1]) >= len(parent):
            parent.append(fresh)
        else:
            parent[place[-1]] = fresh
        return {place}


def _hold_mappings(value: Any) -> bool:
    return isinstance(value, list) and len(value) > 0 and all(
        isinstance(entry, dict) for entry in value)


def _restore(content: Any, original: Any, place: Place) -> None:
    """Put back what a document said at a place, or that it said nothing."""
    parent, was, step = inside(content, place[:-1]), inside(original, place[:-1]), place[-1]
    if isinstance(parent, dict) and isinstance(was, dict):
        parent.pop(step, None)
        if step in was:
            parent[step] = deepcopy(was[step])
    elif isinstance(parent, list) and isinstance(was, list):
        parent[int(step):int(step) + 1] = deepcopy(was[int(step):int(step) + 1])
