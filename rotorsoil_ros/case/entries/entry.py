"""What every mapping of a case file is: no unknown keys, and all its faults at once."""

from collections.abc import Hashable, Mapping
import difflib
import re
from typing import Any, ClassVar, Self, TypeAlias

from pydantic import BaseModel, ConfigDict, model_validator, ValidationError
from pydantic.functional_validators import ModelWrapValidatorHandler
from pydantic_core import ErrorDetails, InitErrorDetails, PydanticCustomError

from rotorsoil_ros.case.document import shown

# Which of two shapes a value has, where a file may choose; no key can be called so.
CONSTANT, TABLE, NUMBER, AXES = '<constant>', '<table>', '<number>', '<axes>'
MAP = '<map>'
KEYS, WORD = '<keys>', '<word>'
EVEN, LAYERED = '<even>', '<layered>'
_REFUSED_KEY = '[key]'  # where pydantic refuses a key itself
_SHAPES = (CONSTANT, TABLE, MAP, NUMBER, AXES, KEYS, WORD, EVEN, LAYERED, _REFUSED_KEY)

_WHAT = {
    'missing': 'is missing',
    'model_type': 'must hold keys and values, got {input}',
    'dict_type': 'must hold keys and values, got {input}',
    'list_type': 'must be a list, got {input}',
    'tuple_type': 'must be a list, got {input}',
    'bool_type': 'must be true or false, got {input}',
    'too_long': 'has more entries than it should: {input}',
    'literal_error': 'must be {expected}, got {input}',
}

Place: TypeAlias = tuple[int | str, ...]


class Entry(BaseModel):
    """One mapping of a case file."""

    # The lowest pydantic that serves keeps names that begin with `model_` for itself.
    model_config = ConfigDict(extra='forbid', frozen=True, protected_namespaces=())

    # Sets of keys of which a mapping needs one, and has no other beside it.
    ways: ClassVar[tuple[tuple[str, ...], ...]] = ()

    @model_validator(mode='wrap')
    @classmethod
    def _refuse_unknown_keys(cls, value: Any, handler: ModelWrapValidatorHandler[Self]) -> Self:
        """Tell every unknown key, beside what is wrong with the others."""
        unknown = ([key for key in value if key not in cls.model_fields]
                   if isinstance(value, dict) else [])
        if not unknown:
            return handler(value)
        meant = {key: meant_key(key, cls, value) for key in unknown}
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


def given_or_named(value: object) -> str:
    """Return which shape something has that a file may spell out or call by its name."""
    return WORD if isinstance(value, str) else KEYS


def meant_key(key: Hashable, entry: type[Entry], value: Mapping[Hashable, Any]) -> str | None:
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
    told = _WHAT[detail['type']].format(input=got, **context)
    words = re.findall(r"'(\w+)'", context.get('expected', ''))
    near = difflib.get_close_matches(str(detail['input']), words, n=1)
    return place, f'{told}; did you mean {near[0]}?' if near else told
