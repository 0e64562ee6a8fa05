"""Which class of a message package does a name mean? The class, and of what it is made."""

from collections.abc import Iterator
from importlib import import_module
import re
from typing import Any

from rotorsoil_ros.errors import InputError
from rotorsoil_ros.wire.definitions import ros_name, SEPARATOR

# What rosidl calls the numbers that a `.msg` file calls otherwise.
SPELLED = {'float': 'float32', 'double': 'float64', 'boolean': 'bool', 'octet': 'byte'}
SEQUENCE = re.compile(r'sequence<(?P<of>.+?)(?:, (?P<most>\d+))?>')
ARRAY = re.compile(r'(?P<of>.+)\[(?P<count>\d+)\]')


def message_class(message_type: str) -> Any:
    """Return the class of a type such as `std_msgs/msg/Float32`."""
    package, _, name = ros_name(message_type).split('/')
    try:
        return getattr(import_module(f'{package}.msg'), name)
    except ImportError as error:
        raise InputError(f'{message_type}: package {package} is not installed') from error
    except AttributeError as error:
        raise InputError(f'{message_type}: package {package} has no such message') from error


def definition_of(message_type: str) -> str:
    """
    Return the `ros2msg` schema of a type, as its own package knows it.

    Names of constants and defaults are not in it: where the fields lie does not hang on them.
    """
    known: dict[str, Any] = {}
    _collect(message_class(message_type), ros_name(message_type), known)
    own, *parts = known
    return '\n'.join([*_lines(known[own]), *(
        '\n'.join([SEPARATOR, f'MSG: {part.replace("/msg/", "/")}', *_lines(known[part])])
        for part in parts)])


def _collect(kind: Any, name: str, known: dict[str, Any]) -> None:
    """Take down a class and every class that it is made of, each once."""
    known[name] = kind
    for spelled in kind.get_fields_and_field_types().values():
        part, _ = _taken_apart(spelled)
        if '/' in part and ros_name(part) not in known:
            _collect(message_class(part), ros_name(part), known)


def _lines(kind: Any) -> Iterator[str]:
    """Yield the fields of a class as a `.msg` file has them."""
    for name, spelled in kind.get_fields_and_field_types().items():
        part, several = _taken_apart(spelled)
        yield f'{part}{several} {name}'


def _taken_apart(spelled: str) -> tuple[str, str]:
    """Return the type of a field as a `.msg` file has it, and its brackets."""
    if found := SEQUENCE.fullmatch(spelled):
        several = f'[<={found["most"]}]' if found['most'] else '[]'
    elif found := ARRAY.fullmatch(spelled):
        several = f'[{found["count"]}]'
    part = re.sub(r'<\d+>$', '', found['of'] if found else spelled)  # a string may be bounded
    return SPELLED.get(part, part), several if found else ''
