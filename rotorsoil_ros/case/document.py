"""What a YAML file says, read as if nobody could be trusted to have written it well."""

from collections.abc import Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
import re
from typing import Any

import yaml

from rotorsoil_ros.errors import InputError

# A long case with bearing tables has a few thousand nodes in 50 kB; parsing takes 1 s per 250 kB.
_LARGEST_BYTES = 256 * 1024
_LARGEST_DEPTH = 24
_LARGEST_NODES = 50_000
_LARGEST_SHOWN = 64
# A mapping of more characters than this gets a line for each of its keys.
_LONGEST_LINE = 96

_ODD = {'\t', '\ufeff'}

SHIPPED = Path(__file__).parents[1] / 'config'


class _Words:
    """Safe loader with the scalars of YAML 1.2: 1e9 is a number, `on` and 1:30 are strings."""

    yaml_implicit_resolvers: dict[str, Any] = {}  # noqa: RUF012 - so declared by PyYAML

    def __init__(self, text: str) -> None:
        super().__init__(text)  # type: ignore[call-arg]
        self.wrong = set[tuple[int, str]]()  # lines and what is the matter

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Hashable, Any]:
        """Construct a mapping without a key that is no word or stands there twice; note it."""
        seen, good = set(), []
        for key, value in node.value:
            problem = None
            if not isinstance(key, yaml.ScalarNode):
                problem = 'a key must be a word'
            elif key.value in seen:
                problem = f'the key {key.value} stands here twice'
            else:
                seen.add(key.value)
                good.append((key, value))
            if problem is not None:
                self.wrong.add((key.start_mark.line + 1, problem))
        node.value = good
        return super().construct_mapping(node, deep=deep)  # type: ignore[misc, no-any-return]


def _number(_: Any, node: yaml.ScalarNode) -> int | float:
    """Return an int where it is one and short, a float elsewhere."""
    text = str(node.value)
    if len(text) < 16 and re.fullmatch(r'[-+]?[0-9]+', text):
        return int(text)
    return float(text.lower().replace('.inf', 'inf').replace('.nan', 'nan'))


class _Loader(_Words, yaml.SafeLoader):
    """In Python: whatever is wrong with a text is said in its words, everywhere the same."""


class _FastLoader(_Words, getattr(yaml, 'CSafeLoader', yaml.SafeLoader)):  # type: ignore[misc]
    """In C, where PyYAML has it: some forty times as fast."""


for _kind in (_Loader, _FastLoader):
    for _tag, _pattern, _first in (
            ('float', r'[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?$'
                      r'|[-+]?\.(inf|Inf|INF)$|\.(nan|NaN|NAN)$', '-+.0123456789'),
            ('bool', r'(true|True|TRUE|false|False|FALSE)$', 'tTfF'),
            ('null', r'(~|null|Null|NULL|)$', ['~', 'n', 'N', '']), ('merge', r'<<$', '<')):
        _kind.add_implicit_resolver(f'tag:yaml.org,2002:{_tag}', re.compile(_pattern),
                                    list(_first))
    _kind.add_constructor('tag:yaml.org,2002:float', _number)


def shown(value: object) -> str:
    """Return a value as an error message shows it: one line, not endless."""
    text = repr(value)
    return text if len(text) <= _LARGEST_SHOWN else f'{text[:_LARGEST_SHOWN]}...'


def read(path: Path) -> dict[str, Any]:
    """
    Read a YAML file that holds one mapping.

    Parameters
    ----------
    path : Path
        The file.

    Returns
    -------
    dict
        What it says, in plain Python values.

    Raises
    ------
    InputError
        If the file cannot be read, is not YAML, is too large, too deep, refers to itself or
        says a key twice.

    """
    try:
        with path.open('rb') as stream:
            content = stream.read(_LARGEST_BYTES + 1)
    except OSError as error:
        cases = ', '.join(sorted(file.stem for file in SHIPPED.glob('*.yaml')))
        is_name = isinstance(error, FileNotFoundError) and re.fullmatch(r'\w+', str(path))
        raise InputError(f'{path}: cannot be read: {error.strerror}'
                         + (f' (shipped cases: {cases})' if is_name else '')) from error
    if len(content) > _LARGEST_BYTES:
        raise InputError(f'{path}: is larger than {_LARGEST_BYTES // 1024} KiB: no case file')
    try:
        text = content.decode('utf-8')
    except UnicodeDecodeError as error:
        raise InputError(f'{path}: is not a text file in UTF-8 (byte {error.start})') from error
    document = parse(text, source=str(path))
    if not isinstance(document, dict):
        raise InputError(f'{path}: must hold keys and values, got {shown(document)}')
    return document


def chosen(path: Path) -> tuple[Path, tuple[str, ...]]:
    """
    Return a file and the settings that its name brings.

    `FILE#NAME` is the machine of that name among several, unless a file is called so.
    """
    file, mark, source = str(path).rpartition('#')
    if not mark or path.exists():
        return located(path), ()
    return located(Path(file)), (f'source={source}',)


def located(path: Path) -> Path:
    """Return a file; where no file is called so, the shipped case of that name."""
    shipped = SHIPPED / f'{path}.yaml'
    is_name = re.fullmatch(r'\w+', str(path)) and not path.is_file() and shipped.is_file()
    return shipped if is_name else path.expanduser()


def parse(text: str, *, source: str) -> Any:
    """Return what a YAML text says; an InputError names the source and each line at fault."""
    try:
        # Both read the same, but for tabs and marks of byte order, of which one takes more.
        content, wrong = _loaded(text, _Loader if _ODD & set(text) else _FastLoader)
    except yaml.YAMLError:
        try:
            content, wrong = _loaded(text, _Loader)
        except yaml.YAMLError as error:
            raise InputError(f'{source}: {_one_line(error)}') from error
    if wrong:
        raise InputError('\n'.join(f'{source}: line {line}: {problem}'
                                   for line, problem in sorted(wrong)))
    return content


def _loaded(
    text: str, kind: type[_Loader] | type[_FastLoader],
) -> tuple[Any, set[tuple[int, str]]]:
    """Return what a text says, and lines of it with what is the matter with their keys."""
    _refuse_excess(text, kind)
    loader = kind(text)
    return _tree(loader.get_single_data()), loader.wrong


def _tree(value: Any) -> Any:
    """Copy what an alias repeats, so that an override of one place leaves the other alone."""
    if isinstance(value, dict):
        return {key: _tree(entry) for key, entry in value.items()}
    return [_tree(entry) for entry in value] if isinstance(value, list) else value


def _refuse_excess(text: str, kind: type[_Loader] | type[_FastLoader]) -> None:
    """Walk over the events, before anything is built, and refuse what would grow without end."""
    growth = _Growth()
    for event in yaml.parse(text, kind):
        problem = growth.add(event)
        if problem is not None:
            mark = event.start_mark
            raise yaml.MarkedYAMLError(
                problem=problem, problem_mark=mark if isinstance(mark, yaml.Mark) else None)


@dataclass
class _Growth:
    """What a stream of events builds: values, repeated ones counted, and open collections."""

    count: int = 0
    size_of_anchor: dict[str | None, int] = field(default_factory=dict)
    open_nodes: list[tuple[str | None, int]] = field(default_factory=list)

    def add(self, event: yaml.Event) -> str | None:
        """Take an event in and return what is wrong with it."""
        if isinstance(event, yaml.AliasEvent):
            self.count += self.size_of_anchor.get(event.anchor, 1)
            # An anchor still open is not in the dictionary: the alias would hold itself.
            if event.anchor not in self.size_of_anchor:
                return f'the alias *{event.anchor} repeats nothing that ends before it'
        elif isinstance(event, (yaml.ScalarEvent, yaml.CollectionStartEvent)):
            self.count += 1
            if event.tag is not None:
                return 'tags (!) are not allowed'
            if isinstance(event, yaml.ScalarEvent):
                self.size_of_anchor[event.anchor] = 1
            else:
                self.open_nodes.append((event.anchor, self.count))
        elif isinstance(event, yaml.CollectionEndEvent):
            anchor, start = self.open_nodes.pop()
            self.size_of_anchor[anchor] = self.count - start + 1
        if len(self.open_nodes) > _LARGEST_DEPTH:
            return f'nested deeper than {_LARGEST_DEPTH} levels'
        if self.count > _LARGEST_NODES:
            return f'more than {_LARGEST_NODES} values, repeated ones counted'
        return None


def _one_line(error: yaml.YAMLError) -> str:
    """Return what is wrong with a YAML text, with its place, in one line."""
    if isinstance(error, yaml.MarkedYAMLError):
        problem = ' '.join(' '.join(filter(None, (error.context, error.problem))).split())
        mark = error.problem_mark or error.context_mark
        return problem if mark is None else f'line {mark.line + 1}: {problem}'
    return ' '.join(str(error).split())


def override(document: dict[str, Any], overrides: Sequence[str]) -> None:
    """
    Apply `key.path=value` settings to a document, in place and in order.

    Parameters
    ----------
    document : dict
        As `read` returns it.
    overrides : sequence of str
        Keys of mappings and indices of lists, joined by dots; the value is YAML.

    Raises
    ------
    InputError
        If a setting has no `=`, or its path leads through something that is not there; with a
        line for each that is wrong.

    """
    faults = []
    for setting in overrides:
        try:
            _set(document, setting)
        except InputError as error:
            faults.append(str(error))
    if faults:
        raise InputError('\n'.join(faults))


def _set(document: dict[str, Any], setting: str) -> None:
    path, equals, value = setting.partition('=')
    source = f'--set {shown(setting)[1:-1]}'
    if not equals or not all(path.split('.')):
        raise InputError(f'{source}: must be key.path=value')
    _put(document, path.split('.'), parse(value, source=source), source=source)


def replace_keys(document: dict[str, Any], given: Mapping[str, object]) -> None:
    """
    Put values at key paths of a document, in place and in order.

    Parameters
    ----------
    document : dict
        As `read` returns it.
    given : mapping
        Values by key path, as in `override`. A mapping goes key by key into what is there,
        everything else replaces it; arrays and their numbers become plain ones.

    Raises
    ------
    InputError
        If a path leads through something that is not there.

    """
    for path, value in given.items():
        if isinstance(value, Mapping) and value:
            replace_keys(document, {f'{path}.{key}': entry for key, entry in value.items()})
        elif not all(path.split('.')):
            raise InputError(f'{shown(path)}: must be key.path')
        else:
            _put(document, path.split('.'), _plain(value), source=path)


def _plain(value: object) -> object:
    """Return what YAML would hold instead of arrays, tuples and paths."""
    if hasattr(value, 'tolist'):
        return value.tolist()
    if isinstance(value, (list, tuple)):
        return [_plain(entry) for entry in value]
    if isinstance(value, Mapping):
        return {key: _plain(entry) for key, entry in value.items()}
    return str(value) if isinstance(value, Path) else value


def _put(document: dict[str, Any], steps: Sequence[str], value: Any, *, source: str) -> None:
    *parents, last = steps
    place: Any = document
    for depth, step in enumerate(parents):
        known = '.'.join(parents[:depth]) or 'the case'
        place = _enter(place, step, known=known, source=source)
    _assign(place, last, value, source=source, known='.'.join(parents) or 'the case')


def _enter(place: Any, step: str, *, known: str, source: str) -> Any:
    """Return what lies one step further down; a missing mapping begins empty."""
    if isinstance(place, dict):
        if place.get(step) is None:
            place[step] = {}
        return place[step]
    return place[_index(place, step, known=known, source=source)]


def _assign(place: Any, step: str, value: Any, *, known: str, source: str) -> None:
    if isinstance(place, dict):
        place[step] = value
    else:
        place[_index(place, step, known=known, source=source)] = value


def _index(place: Any, step: str, *, known: str, source: str) -> int:
    """Return the index of an entry of a list, which has to be there."""
    if not isinstance(place, list):
        raise InputError(f'{source}: {known} has no keys below it, it is {shown(place)}')
    if not (step.isascii() and step.isdigit() and len(step) < 10 and int(step) < len(place)):
        raise InputError(f'{source}: {known} has {len(place)} entries, counted from 0, and no '
                         f'entry {step}')
    return int(step)


def at(content: Any, path: str) -> Any:
    """Return what a document says at a key path, None where it says nothing."""
    for step in path.split('.'):
        if isinstance(content, list) and step.isdigit() and int(step) < len(content):
            content = content[int(step)]
        elif isinstance(content, Mapping):
            content = content.get(step)
        else:
            return None
    return content


def text_of(content: Mapping[str, Any], comments: Iterable[str]) -> str:
    """Return the YAML of a case: comments first, then one line for what fits into one."""
    head = [f'# {line}'.rstrip() for line in comments]
    return '\n'.join([*head, *_block(content, '')]) + '\n'


def _block(content: Mapping[str, Any], indent: str) -> Iterable[str]:
    for key, value in content.items():
        line = f'{indent}{key}: {flow(value)}'
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
    line = f'{indent}- {flow(entry)}'
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


def flow(value: Any) -> str:
    """Return a value as YAML writes it in one line."""
    if isinstance(value, Mapping):
        return '{' + ', '.join(f'{key}: {flow(entry)}' for key, entry in value.items()) + '}'
    if isinstance(value, (list, tuple)):
        return '[' + ', '.join(map(flow, value)) + ']'
    return str(value) if isinstance(value, str) else repr(value)
