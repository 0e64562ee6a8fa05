"""Of what are messages made? What ROS says of the types that this package reads and writes."""

import ast
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
import re
from typing import TypeAlias

from rotorsoil_ros.errors import InputError

JOINT_STATE = 'sensor_msgs/msg/JointState'
IMU = 'sensor_msgs/msg/Imu'
TEMPERATURE = 'sensor_msgs/msg/Temperature'
FLOAT64 = 'std_msgs/msg/Float64'
STRING = 'std_msgs/msg/String'
DIAGNOSTICS = 'diagnostic_msgs/msg/DiagnosticArray'
LOG = 'rcl_interfaces/msg/Log'

# RIHS01 of each, which a reader holds against what its own packages say.
TYPE_HASHES = {
    JOINT_STATE: 'a13ee3a330e346c9d87b5aa18d24e11690752bd33a0350f11c5882bc9179260e',
    IMU: '7d9a00ff131080897a5ec7e26e315954b8eae3353c3f995c55faf71574000b5b',
    TEMPERATURE: '72514a14126ab9f8a9abec974c78e5610a367b59db5da355ff1fb982d5bad4b8',
    FLOAT64: '705ba9c3d1a09df43737eb67095534de36fd426c0587779bda2bc51fe790182a',
    STRING: 'df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18',
    DIAGNOSTICS: '5a8a36efb05fb25070fa0fb3810290c0e6cd4862b54a8fb975a1ee8dc55a333e',
    LOG: 'e28ce254ca8abc06abf92773b74602cdbf116ed34fbaf294fb9f81da9f318eac'}

SEPARATOR = '=' * 80
HEADER, TIME = 'std_msgs/msg/Header', 'builtin_interfaces/msg/Time'
NUMBERS = {  # how `struct` and numpy call them
    'bool': '?', 'byte': 'B', 'char': 'B', 'float32': 'f', 'float64': 'd', 'int8': 'b',
    'uint8': 'B', 'int16': 'h', 'uint16': 'H', 'int32': 'i', 'uint32': 'I', 'int64': 'q',
    'uint64': 'Q'}
FIELD = re.compile(  # type, array, name, and what follows: a default, or the value of a constant
    r'(?P<kind>[\w/]+)(?:<=\d+)?(?P<array>\[(?:<=)?\d*\])?\s+(?P<name>\w+)\s*(?P<rest>.*)')


@dataclass(frozen=True, slots=True)
class Number:
    """A number: its code in `struct`, and what it is when nobody says."""

    code: str
    default: float = 0


@dataclass(frozen=True, slots=True)
class Text:
    """A string."""


@dataclass(frozen=True, slots=True)
class Several:
    """Many of one kind: so many, or as many as the message says (None)."""

    of: 'Kind'
    count: int | None


@dataclass(frozen=True, slots=True)
class Compound:
    """A message, or a message within one: its fields in their order."""

    fields: tuple[tuple[str, 'Kind'], ...]

    @property
    def is_vector(self) -> bool:
        """Whether it is several numbers of one kind, which lie side by side."""
        codes = {part.code if isinstance(part, Number) else '' for _, part in self.fields}
        return len(self.fields) > 1 and len(codes) == 1 and '' not in codes


Kind: TypeAlias = Number | Text | Several | Compound


def definition(message_type: str) -> str:
    """Return the `ros2msg` schema of a type such as `std_msgs/msg/String`, parts included."""
    own, *parts = _with_parts(message_type)
    return '\n'.join([_source(own), *(
        f'{SEPARATOR}\nMSG: {part.replace("/msg/", "/")}\n{_source(part)}' for part in parts)])


def type_hash(message_type: str) -> str:
    """Return the RIHS01 hash of a type; empty where this package does not know it."""
    known = TYPE_HASHES.get(message_type)
    return f'RIHS01_{known}' if known else ''


def ros_name(name: str) -> str:
    """Return a type as ROS 2 names it; DDS says `p::msg::dds_::T_`, ROS 1 and old tools `p/T`."""
    package, *_, kind = re.split('::|/', name) if name else ('', '')
    return f'{package}/msg/{kind.rstrip("_")}' if package else name


def compound(message_type: str, told: str = '') -> Compound:
    """
    Return the fields of a type.

    Parameters
    ----------
    message_type : str
        Such as `std_msgs/msg/String`.
    told : str
        Its `ros2msg` schema, as a bag or another package tells it; what that leaves out is
        taken from what this package knows.

    Raises
    ------
    InputError
        If neither says of what it is made.

    """
    return _compound(message_type, f'MSG: {message_type}\n{told}' if told.strip() else '')


def leads_with_stamp(kind: Compound) -> bool:
    """Return whether messages begin with a stamp, their own or that of their header."""
    return bool(kind.fields) and kind.fields[0][1] in (compound(HEADER), compound(TIME))


@cache
def _compound(message_type: str, told: str) -> Compound:
    return Compound(tuple((field['name'], _kind(message_type, field, told))
                          for field in _fields(message_type, told)))


def _kind(owner: str, field: re.Match[str], told: str) -> Kind:
    of: Kind
    if code := NUMBERS.get(field['kind']):
        has_default = field['rest'] and not field['array']
        of = Number(code, ast.literal_eval(field['rest'].capitalize()) if has_default else 0)
    elif field['kind'] == 'string':
        of = Text()
    else:
        of = _compound(_full_name(owner, field['kind']), told)
    if field['array'] is None:
        return of
    count = field['array'].strip('[]')
    return Several(of, int(count) if count.isdigit() else None)


def _with_parts(message_type: str) -> list[str]:
    """Return a type and every type that it is made of, each once."""
    found = [message_type]
    for known in found:  # grows while it is walked
        parts = [_full_name(known, field['kind']) for field in _fields(known)
                 if field['kind'] not in NUMBERS and field['kind'] != 'string']
        found += [part for part in dict.fromkeys(parts) if part not in found]
    return found


def _fields(message_type: str, told: str = '') -> Iterator[re.Match[str]]:
    """Yield the fields of a type in their order; its constants are none."""
    for line in _source(message_type, told).splitlines():
        found = FIELD.match(line.split('#')[0].strip())
        if found and not found['rest'].startswith('='):
            yield found


def _full_name(owner: str, part: str) -> str:
    """Return the name of a part's type as written in another type's definition."""
    package, _, name = part.rpartition('/')
    return f'{package.removesuffix("/msg") or owner.split("/")[0]}/msg/{name}'


@cache
def _source(message_type: str, told: str = '') -> str:
    """Return the `.msg` file of a type: as told, else as its package (of Jazzy) holds it."""
    for part in re.split(f'^{SEPARATOR}$', told, flags=re.MULTILINE):
        name, _, text = part.strip().partition('\n')
        if name and ros_name(name.removeprefix('MSG:').strip()) == message_type:
            return text
    package, _, name = ros_name(message_type).split('/')
    source = files(__package__) / 'interfaces' / package / 'msg' / f'{name}.msg'
    if source.is_file():
        return source.read_text(encoding='utf-8')
    raise InputError(f'{message_type}: nothing tells of what it is made')
