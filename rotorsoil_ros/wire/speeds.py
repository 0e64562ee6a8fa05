"""How does a plant tell its speed? Any number of any message, of any joint, in any unit."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
import math
import re
import struct
from typing import NamedTuple, TypeAlias

import numpy as np

from rotorsoil_ros.arrays import FloatArray
from rotorsoil_ros.errors import InputError
from rotorsoil_ros.events import LAST_STAMP
from rotorsoil_ros.units import SPEED_UNITS
from rotorsoil_ros.wire.cdr import ARRAYS, Layout, Layouts, SIZES
from rotorsoil_ros.wire.dating import Dating, Note
from rotorsoil_ros.wire.definitions import (
    Compound,
    compound,
    HEADER,
    JOINT_STATE,
    Kind,
    leads_with_stamp,
    Number,
    NUMBERS,
    ros_name,
    Several,
    TIME,
)

ROTOR_JOINT = 'rotor'
FIELD_PATH = r'\w+(\[\d+\])?(\.\w+(\[\d+\])?)*'
MESSAGE_TYPE = r'\w+/(msg/)?\w+'
MOST_SHOWN = 12
CODES = {np.dtype(code).str[1:]: code for code in NUMBERS.values()}  # of numpy, for `struct`

Explain: TypeAlias = Callable[[str, str], object]


@dataclass(frozen=True, slots=True)
class SpeedSource:
    """
    Where the speed of a rotor is told, and how.

    Attributes
    ----------
    topic : str
        Its topic; empty: `<machine>/joint_states` and `<machine>/rotor/speed`.
    type : str
        Of its messages, such as `std_msgs/msg/Float32`; empty: what the topic has.
    field : str
        Which number in the message, such as `twist.angular.z` or `velocity[2]`; empty: the
        velocity of the joint in a JointState, in others the only number.
    unit : str
        Of the number: rad_s, rpm, hz or deg_s.
    ratio : float
        Turns of the rotor for one turn of what is told; negative where it counts backwards.
    joint : str
        Which joint of a JointState.

    """

    topic: str = ''
    type: str = ''
    field: str = ''
    unit: str = 'rad_s'
    ratio: float = 1.0
    joint: str = ROTOR_JOINT

    def __post_init__(self) -> None:
        for name, rule, holds in (
                ('unit', f'one of {", ".join(SPEED_UNITS)}', self.unit in SPEED_UNITS),
                ('ratio', 'finite and not 0', math.isfinite(self.ratio) and self.ratio != 0.0),
                ('field', 'the path of a number, as in twist.angular.z or velocity[2]',
                 not self.field or re.fullmatch(FIELD_PATH, self.field)),
                ('type', 'a message type, as in std_msgs/msg/Float32',
                 not self.type or re.fullmatch(MESSAGE_TYPE, self.type))):
            if not holds:
                raise InputError(f'speed {name} must be {rule}, got {getattr(self, name)!r}')

    @property
    def is_usual(self) -> bool:
        """Whether speeds are told as this package tells them itself."""
        return self == USUAL

    @property
    def factor(self) -> float:
        """Speed of the rotor [rad/s] for one of what is told."""
        return self.ratio * SPEED_UNITS[self.unit]

    @property
    def knows_angle(self) -> bool:
        """Whether an angle that is told beside is one of the rotor: behind a gear it is not."""
        return abs(self.ratio) == 1.0

    def fits(self, message_type: str, told: str = '') -> str:
        """Say why a type does not hold such a speed; nothing if it does."""
        if self.type and ros_name(self.type) != message_type:
            return f'{message_type}: needed is {ros_name(self.type)}'
        try:
            _place(self, message_type, compound(message_type, told))
        except InputError as error:
            return str(error)
        return ''


USUAL = SpeedSource()


class Speeds(NamedTuple):
    """
    Messages that told a speed, with their n stamps [ns], speeds [rad/s] and angles [rad].

    An angle that was not told is NaN.
    """

    messages: Sequence[bytes]
    stamps: Sequence[int]
    speed: FloatArray
    angle: FloatArray


NOTHING = Speeds((), (), np.array([]), np.array([]))

# Stamp [ns], or None where the message is of no use; speed [rad/s]; angle [rad]; fault.
Told: TypeAlias = tuple[int | None, float, float, str]


class Found(NamedTuple):
    """Where in a layout a number is: bytes and code, or why it is not there."""

    at: int = 0
    code: str = 'd'
    fault: str = ''


class SpeedReader:
    """
    Reads the speeds of one topic; what it cannot read it counts by its reason, and explains.

    Parameters
    ----------
    message_type : str
        Of the topic.
    source : SpeedSource
        What in the messages is the speed.
    note, explain : callable
        Take a reason and how often it was met, and a reason and a sentence that says more.
    told : str
        `ros2msg` schema of the type, where this package may not know it.

    Raises
    ------
    InputError
        If such messages do not hold such a speed.

    """

    def __init__(
        self, message_type: str, source: SpeedSource, *, note: Note,
        explain: Explain = lambda reason, text: None, told: str = '',
    ) -> None:
        kind = compound(message_type, told)
        self._place = _place(source, message_type, kind)
        self._layouts = Layouts(message_type, told)
        self._dating = Dating(note) if leads_with_stamp(kind) else None
        self._note, self._explain = note, explain
        self._factor = source.factor
        self._turn = math.copysign(1.0, source.ratio) if source.knows_angle else math.nan
        self._layout: Layout | None = None
        self._fault = 'malformed'  # of a message without a layout
        self._unpack = self._unpack_angle = struct.Struct('<d').unpack_from
        self._at = self._angle_at = 0

    def read(self, received_ns: Sequence[int], cdrs: Sequence[bytes]) -> Speeds:
        """Read messages that were received at the given times [ns]."""
        if len(cdrs) == 1:
            return self._read_one(received_ns, cdrs)
        messages, stamps, speeds, angles = [], [], [], []
        for row, cdr in enumerate(cdrs):
            stamp, speed, angle, fault = self._read(received_ns, row, cdr)
            if fault:
                self._note(fault, 1)
            if stamp is not None:
                messages.append(cdr)
                stamps.append(stamp)
                speeds.append(speed)
                angles.append(angle)
        return Speeds(messages, stamps, np.array(speeds, dtype=float),
                      np.array(angles, dtype=float))

    def _read_one(self, received_ns: Sequence[int], cdrs: Sequence[bytes]) -> Speeds:
        """Read what a live node hears: the same as many, with less ado."""
        stamp, speed, angle, fault = self._read(received_ns, 0, cdrs[0])
        if fault:
            self._note(fault, 1)
        if stamp is None:
            return NOTHING
        return Speeds(cdrs, (stamp,), np.array((speed,)), np.array((angle,)))

    def _read(self, received_ns: Sequence[int], row: int, cdr: bytes) -> Told:
        """Return what the message of a row tells, at its own stamp if that can be one."""
        layout = self._layouts.layout(cdr)
        if layout is not self._layout:
            self._learn(layout)
        if layout is None or self._fault == 'joint_missing':
            return None, math.nan, math.nan, self._fault
        if self._dating is None:
            dated: int | None = received_ns[row]
        else:
            stamp = layout.stamp_ns(cdr)
            if not 0 <= stamp <= LAST_STAMP:
                return None, math.nan, math.nan, 'malformed'
            dated = self._dating.date(stamp, received_ns, row)
        angle = (self._turn * self._unpack_angle(cdr, self._angle_at)[0] if self._angle_at
                 else math.nan)
        speed = math.nan if self._fault else self._factor * self._unpack(cdr, self._at)[0]
        return dated, speed, angle, self._fault

    def _learn(self, layout: Layout | None) -> None:
        """Find out where in such messages the speed is, or why it is not there."""
        self._layout = layout
        if layout is None:
            self._fault = 'malformed'
            return
        found = self._place.speed(layout)
        self._at, self._fault = found.at, found.fault
        self._unpack = struct.Struct(layout.order + found.code).unpack_from
        angle = self._place.angle(layout)
        self._angle_at = 0 if angle.fault else angle.at
        self._unpack_angle = struct.Struct(layout.order + angle.code).unpack_from
        if found.fault:
            self._explain(found.fault, self._place.why(layout))


class _OfJoint:
    """One array of a JointState, at the place of a joint."""

    def __init__(self, joint: str, array: str) -> None:
        self._joint, self._array = joint, array

    def speed(self, layout: Layout) -> Found:
        return self._in(layout, self._array)

    def angle(self, layout: Layout) -> Found:
        return self._in(layout, 'position')

    def why(self, layout: Layout) -> str:
        names = layout.texts['name']
        if self._joint in names:
            return f'joint {self._joint} is told without {self._array}'
        near = get_close_matches(self._joint, names, n=1)
        return (f'needed is {self._joint}, there are {", ".join(names[:MOST_SHOWN]) or "none"}'
                + (f'; did you mean {near[0]}?' if near else ''))

    def _in(self, layout: Layout, array: str) -> Found:
        names = layout.texts['name']
        if self._joint not in names:
            return Found(fault='joint_missing')
        return _element(layout, array, names.index(self._joint))


class _OfField:
    """A number at a path, or one of several that lie side by side there."""

    def __init__(self, path: str, index: int | None) -> None:
        self._path, self._index = path, index

    def speed(self, layout: Layout) -> Found:
        if self._index is not None:
            return _element(layout, self._path, self._index)
        if self._path not in (layout.dtype.fields or {}):
            return Found(fault='velocity_missing')
        return Found(layout.span(self._path).start, _code(layout, self._path))

    def angle(self, layout: Layout) -> Found:
        del layout
        return Found(fault='joint_missing')  # a number alone has no angle beside it

    def why(self, layout: Layout) -> str:
        del layout
        return f'the message is too short for {self._path}' + (
            '' if self._index is None else f'[{self._index}]')


def _element(layout: Layout, path: str, index: int) -> Found:
    """Return where one of the numbers of a path is."""
    if path not in (layout.dtype.fields or {}):
        return Found(fault='velocity_missing')
    span, code = layout.span(path), _code(layout, path)
    at = span.start + SIZES[code] * index
    return Found(at, code) if at < span.stop else Found(fault='velocity_missing')


def _code(layout: Layout, path: str) -> str:
    """Return how `struct` calls the numbers of a path."""
    return CODES[layout.dtype[path].base.str[1:]]


def _place(source: SpeedSource, message_type: str, kind: Compound) -> _OfJoint | _OfField:
    """Return what finds the speed in messages of a type."""
    if message_type == JOINT_STATE and source.field in ('', *ARRAYS):
        return _OfJoint(source.joint, source.field or 'velocity')
    numbers = dict(_numbers(kind, ''))
    shown = ', '.join([*numbers][:MOST_SHOWN]) or 'none'
    if not source.field and len(numbers) != 1:
        raise InputError(f'{message_type}: the field of the speed must be named; its numbers '
                         f'are {shown}')
    field = source.field or next(iter(numbers))
    # What counts is that there is such a number, not how many an array happens to hold.
    known = numbers.get(re.sub(r'\[\d+\]', '[0]', field))
    if known is None:
        near = get_close_matches(field, numbers, n=1)
        raise InputError(f'{message_type}: has no number {field}; its numbers are {shown}'
                         + (f'; did you mean {near[0]}?' if near else ''))
    parent, index = known
    if index == 0 and field.endswith(']'):
        parent, index = field[:field.rindex('[')], int(field[field.rindex('[') + 1:-1])
    elif index is not None:
        parent = field.rpartition('.')[0]
    else:
        parent = field
    return _OfField(parent, index)


def _numbers(kind: Kind, path: str) -> Iterator[tuple[str, tuple[str, int | None]]]:
    """Yield the path of every number of a message, and its place: of arrays the first."""
    match kind:
        case Number(code=code):
            if code != '?':
                yield path, (path, None)
        case Several(of=Number()):
            yield f'{path}[0]', (path, 0)
        case Several(of=of):
            yield from _numbers(of, f'{path}[0]')
        case Compound(fields=fields):
            for row, (name, part) in enumerate(fields):
                own = f'{path}.{name}' if path else name
                if kind.is_vector:
                    yield own, (path, row)
                elif part not in (compound(HEADER), compound(TIME)):
                    yield from _numbers(part, own)
