"""Case files with their comments: what is marked as a guess, and edits that leave the rest."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
import re
from typing import Any, TypeAlias

import yaml

from rotorsoil_ros.case import document
from rotorsoil_ros.case.authoring.new_case import MARK

_GUESS = re.compile(re.escape(MARK) + r'\b(?: *\[[^\]]*\])?:? *(.*)$')

# From, to, and what stands there instead.
_Edit: TypeAlias = tuple[int, int, str]


@dataclass(frozen=True, slots=True)
class Guess:
    """A key of a case file that is marked as a guess, and why it is this one."""

    key: str
    why: str


def guesses(text: str) -> list[Guess]:
    """Return what a case file marks as guesses, in its order; the head of a file is no key."""
    lines = text.splitlines()
    marked = {number: found[1] for number, line in enumerate(lines)
              if not line.lstrip().startswith('#') and (found := _GUESS.search(line))}
    if not marked:
        return []
    first: dict[int, str] = {}
    for key, line in _starts(_root(text), ''):
        first.setdefault(line, key)
    return [Guess(first[line], why) for line, why in marked.items() if line in first]


def _root(text: str) -> yaml.Node:
    root = yaml.compose(text, yaml.SafeLoader)
    assert root is not None
    return root


def _starts(node: yaml.Node, path: str) -> Iterator[tuple[str, int]]:
    """Yield each key path and the line on which all of it, or its key, stands."""
    for key, start, value in _children(node):
        own = f'{path}.{key}' if path else str(key)
        line = start.start_mark.line
        if value.start_mark.line > line or _end(value)[1] == line:
            yield own, line
        yield from _starts(value, own)


def _children(node: yaml.Node) -> Iterator[tuple[str | int, yaml.Node, yaml.Node]]:
    """Yield key or index, where it begins, and value of what a collection holds."""
    if isinstance(node, yaml.MappingNode):
        yield from ((key.value, key, value) for key, value in node.value)
    elif isinstance(node, yaml.SequenceNode):
        yield from ((index, value, value) for index, value in enumerate(node.value))


def _end(node: yaml.Node) -> tuple[int, int]:
    """Return index and line of the end of a node, without the comments behind it."""
    last = node
    # The end of a block collection is where the next token begins.
    while isinstance(last, yaml.CollectionNode) and not last.flow_style and last.value:
        last = last.value[-1][1] if isinstance(last, yaml.MappingNode) else last.value[-1]
    return last.end_mark.index, last.end_mark.line


def edited(text: str, content: Mapping[str, Any]) -> str:
    """
    Return a case file so that it says something else, everything else left as it stands.

    Parameters
    ----------
    text : str
        The file.
    content : mapping
        What it shall say: lines of which nothing changes stay, with their comments.

    Returns
    -------
    str
        Which reads as `content`. A file whose aliases make it say one thing in two places
        cannot be edited in one of them: that is written anew, without comments.

    """
    before = document.parse(text, source='case')
    edits = sorted(_edits(text, _root(text), before, content), reverse=True)
    for start, end, new in edits:
        text = text[:start] + new + text[end:]
    if document.parse(text, source='case') != content:
        return document.text_of(content, [])
    return text


def _edits(text: str, node: yaml.Node, before: Any, after: Any) -> Iterator[_Edit]:
    """Yield what makes the text of a node say something else."""
    if before == after and isinstance(before, bool) is isinstance(after, bool):
        return
    if isinstance(before, dict) and isinstance(after, Mapping) and set(before) <= set(after):
        pairs = [(value, before[key], after[key]) for key, _, value in _children(node)]
        fresh = [f'{key}: {document.flow(after[key])}' for key in after if key not in before]
    elif isinstance(before, list) and isinstance(after, list) and len(before) <= len(after):
        pairs = [(value, before[int(index)], after[int(index)])
                 for index, _, value in _children(node)]
        fresh = [document.flow(entry) for entry in after[len(before):]]
        if not getattr(node, 'flow_style', True):
            fresh = [f'- {entry}' for entry in fresh]
    else:
        yield node.start_mark.index, _end(node)[0], document.flow(after)
        return
    for value, old, new in pairs:
        yield from _edits(text, value, old, new)
    if fresh:
        yield _appended(text, node, fresh)


def _appended(text: str, node: yaml.Node, fresh: list[str]) -> _Edit:
    """Return the edit that puts new entries at the end of a collection."""
    end = _end(node)[0]
    if getattr(node, 'flow_style', True):
        comma = ', ' if node.value else ''
        return end - 1, end - 1, comma + ', '.join(fresh)
    newline = text.find('\n', end)
    place = len(text) if newline < 0 else newline
    indent = ' ' * node.start_mark.column
    return place, place, ''.join(f'\n{indent}{line}' for line in fresh)
