"""A case, written as a file that a person can read and change."""

from collections.abc import Iterable, Mapping
from typing import Any

# A mapping of more characters than this gets a line for each of its keys.
_LONGEST_LINE = 96


def text_of(content: Mapping[str, Any], comments: Iterable[str]) -> str:
    """Return the YAML of a case: comments first, then one line for what fits into one."""
    head = [f'# {line}'.rstrip() for line in comments]
    return '\n'.join([*head, *_block(content, '')]) + '\n'


def _block(content: Mapping[str, Any], indent: str) -> Iterable[str]:
    for key, value in content.items():
        line = f'{indent}{key}: {_flow(value)}'
        if not isinstance(value, (dict, list)) or not value or (
                len(line) <= _LONGEST_LINE and not _holds_mappings(value)):
            yield line
        elif isinstance(value, dict):
            yield f'{indent}{key}:'
            yield from _block(value, indent + '  ')
        elif _holds_mappings(value):
            yield f'{indent}{key}:'
            for entry in value:
                yield from _entry(entry, indent + '  ')
        else:
            yield line


def _entry(entry: Mapping[str, Any], indent: str) -> Iterable[str]:
    """Yield an entry of a list; the first of its lines gets the dash."""
    line = f'{indent}- {_flow(entry)}'
    if len(line) <= _LONGEST_LINE:
        yield line
        return
    lines = list(_block(entry, indent + '  '))
    yield f'{indent}- {lines[0].lstrip()}'
    yield from lines[1:]


def _holds_mappings(value: Any) -> bool:
    """Return whether a value is a list of mappings, or a mapping that holds one."""
    if isinstance(value, list):
        return any(isinstance(entry, dict) for entry in value)
    return isinstance(value, dict) and any(_holds_mappings(entry) for entry in value.values())


def _flow(value: Any) -> str:
    if isinstance(value, Mapping):
        return '{' + ', '.join(f'{key}: {_flow(entry)}' for key, entry in value.items()) + '}'
    if isinstance(value, (list, tuple)):
        return '[' + ', '.join(map(_flow, value)) + ']'
    return str(value) if isinstance(value, str) else repr(value)
