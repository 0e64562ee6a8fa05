"""How do the messages of a log describe themselves? By the definitions of their packages."""

from collections.abc import Iterator
from functools import cache
from importlib.util import find_spec
import json
from pathlib import Path

from rotorsoil_ros.errors import InputError

SEPARATOR = '=' * 80
BUILTIN = frozenset((
    'bool', 'byte', 'char', 'float32', 'float64', 'int8', 'uint8', 'int16', 'uint16', 'int32',
    'uint32', 'int64', 'uint64', 'string', 'wstring'))


@cache
def definition(message_type: str) -> str:
    """Return the `ros2msg` schema of a type such as `std_msgs/msg/String`, parts included."""
    own, *parts = _with_parts(message_type)
    sections = [_source(own).read_text(encoding='utf-8')]
    for part in parts:
        package, _, name = part.split('/')
        text = _source(part).read_text(encoding='utf-8')
        sections.append(f'{SEPARATOR}\nMSG: {package}/{name}\n{text}')
    return '\n'.join(sections)


@cache
def type_hash(message_type: str) -> str:
    """Return the RIHS01 hash of a type; empty where its package does not carry one."""
    source = _source(message_type).with_suffix('.json')
    if not source.is_file():
        return ''
    hashes = json.loads(source.read_text(encoding='utf-8'))['type_hashes']
    return next((entry['hash_string'] for entry in hashes if entry['type_name'] == message_type),
                '')


def _with_parts(message_type: str) -> list[str]:
    """Return a type and every type that it is made of, each once."""
    found = [message_type]
    for known in found:  # grows while it is walked
        found += [part for part in _parts(known) if part not in found]
    return found


def _parts(message_type: str) -> Iterator[str]:
    package = message_type.split('/')[0]
    seen = set()
    for line in _source(message_type).read_text(encoding='utf-8').splitlines():
        words = line.split('#')[0].split()
        part = words[0].split('[')[0].split('<=')[0] if words else ''
        if not part or part in BUILTIN or part in seen:
            continue
        seen.add(part)
        owner, _, name = part.rpartition('/')
        yield f'{owner.removesuffix("/msg") or package}/msg/{name}'


@cache
def _source(message_type: str) -> Path:
    """
    Return the `.msg` file of a type.

    It lies in `share` beside the `lib` that holds the Python package, with the wheels as with
    apt or colcon. The ament index would know it too, but the wheels leave its path unset.
    """
    package, _, name = message_type.split('/')
    spec = find_spec(package)
    for above in Path(spec.origin).parents if spec and spec.origin else ():
        source = above / 'share' / package / 'msg' / f'{name}.msg'
        if source.is_file():
            return source
    raise InputError(f'{message_type}: its definition is not installed beside the package')
