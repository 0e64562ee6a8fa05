"""Where do the fields of a message lie in its CDR bytes? One walk, to read and to write them."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
import struct
import sys
from typing import Any

import numpy as np

from rotorsoil_ros.errors import InputError
from rotorsoil_ros.events import NANOSECONDS
from rotorsoil_ros.wire.definitions import (
    Compound,
    compound,
    Kind,
    Number,
    NUMBERS,
    Several,
    Text,
)

LITTLE_ENDIAN = 1
OPENING = bytes((0, sys.byteorder == 'little', 0, 0))  # of what is written: in native order
BODY = len(OPENING)  # CDR aligns from the end of its four encapsulation bytes
STAMP = slice(BODY, BODY + 8)  # of everything that begins with a header or a stamp
ARRAYS = ('position', 'velocity', 'effort')
AXES = ('x', 'y', 'z')
SYNTHETIC = 'synthetic'  # begins the frame of every signal that no sensor measured
NOT_MEASURED = -1.0  # in the first covariance

# Before a count, by how many bytes there are: the body begins at a multiple of four.
ALIGNING = (b'', b'\0\0\0', b'\0\0', b'\0')
SIZES = {code: struct.calcsize(f'={code}') for code in NUMBERS.values()}

count_bytes = struct.Struct('=I').pack


class Cursor:
    """Walk over CDR bytes that nobody vouches for, and remember what was text or a count."""

    def __init__(self, cdr: bytes) -> None:
        if len(cdr) < BODY or cdr[0] != 0 or cdr[1] > LITTLE_ENDIAN:
            raise InputError(f'message must start with plain CDR, got 0x{cdr[:BODY].hex()}')
        self.order = '<' if cdr[1] == LITTLE_ENDIAN else '>'
        self.at = BODY
        self.read: list[slice] = [slice(0, 2)]
        self._cdr = cdr

    def skip(self, length: int, *, align: int = 1) -> int:
        """Step over bytes that start aligned; return where they start."""
        start = BODY + -(-(self.at - BODY) // align) * align if length else self.at
        if start + length > len(self._cdr):
            raise InputError(f'message ends at byte {len(self._cdr)}, inside a field')
        self.at = start + length
        return start

    def count(self) -> int:
        """Read the length of a string or of a sequence."""
        start = self.skip(4, align=4)
        self._remember(start)
        return int(struct.unpack_from(self.order + 'I', self._cdr, start)[0])

    def text(self) -> str:
        """Read a string; bytes that are not UTF-8 are replaced."""
        start = self.skip(self.count())
        self._remember(start)
        return self._cdr[start:self.at].rstrip(b'\0').decode(errors='replace')

    def _remember(self, start: int) -> None:
        last = self.read[-1]
        if last.stop == start:
            self.read[-1] = slice(last.start, self.at)
        else:
            self.read.append(slice(start, self.at))


class _Walk:
    """Finds the fields of one message: where its numbers are, and what its strings say."""

    def __init__(self, cdr: bytes) -> None:
        self.cursor = Cursor(cdr)
        self.texts: dict[str, tuple[str, ...]] = {}
        self.places: dict[str, tuple[str, int]] = {}

    def find(self, kind: Kind, path: str) -> None:
        """Step over a field and take down what is in it."""
        cursor = self.cursor
        match kind:
            case Number(code=code):
                size = SIZES[code]
                self.places[path] = cursor.order + code, cursor.skip(size, align=size)
            case Text():
                self.texts[path] = (cursor.text(),)
            case Several(of=of, count=count):
                self._find_several(of, cursor.count() if count is None else count, path)
            case Compound(fields=fields):
                if kind.is_vector:
                    self._find_several(fields[0][1], len(fields), path)
                    return
                for name, part in fields:
                    self.find(part, f'{path}.{name}' if path else name)

    def _find_several(self, of: Kind, count: int, path: str) -> None:
        cursor = self.cursor
        match of:
            case Number(code=code):
                size = SIZES[code]
                at = cursor.skip(size * count, align=size)
                self.places[path] = f'({count},){cursor.order}{code}', at
            case Text():
                self.texts[path] = tuple([cursor.text() for _ in range(count)])
            case _:
                for number in range(count):
                    self.find(of, f'{path}[{number}]')


@dataclass(frozen=True, slots=True, eq=False)
class Layout:
    """
    Where the numbers of all messages lie that differ in nothing but numbers.

    Attributes
    ----------
    texts : mapping of tuples of str
        What the strings say, by path: `name`, `header.frame_id`, `status[0].message`.
    size : int
        Length of the message [bytes].
    fixed : tuple of (slice, bytes)
        What such messages share: strings and counts, but not the padding, which is not zeroed.
    order : str
        Byte order, < or >.
    dtype : numpy structured type
        Numbers by path, laid over the bytes; vectors and arrays as arrays.

    """

    texts: Mapping[str, tuple[str, ...]]
    size: int
    fixed: tuple[tuple[slice, bytes], ...]
    order: str
    dtype: np.dtype[Any]

    @classmethod
    def of(cls, message_type: str, cdr: bytes, told: str = '') -> 'Layout':
        """Read the layout of one message; raise InputError where it is not of its type."""
        walk = _Walk(cdr)
        walk.find(compound(message_type, told), '')
        kinds, offsets = zip(*walk.places.values(), strict=True) if walk.places else ((), ())
        dtype = np.dtype({'names': list(walk.places), 'formats': list(kinds),
                          'offsets': list(offsets), 'itemsize': len(cdr)})
        fixed = tuple((at, cdr[at]) for at in walk.cursor.read)
        return cls(walk.texts, len(cdr), fixed, walk.cursor.order, dtype)

    def fits(self, cdr: bytes) -> bool:
        """Return whether a message differs from this layout in nothing but its numbers."""
        if len(cdr) != self.size:
            return False
        for at, shared in self.fixed:  # noqa: SIM110 - a generator costs half a microsecond
            if cdr[at] != shared:
                return False
        return True

    def stamp_ns(self, cdr: bytes) -> int:
        """Return the stamp of one message, which begins with it [ns]."""
        sec, nanosec = struct.unpack_from(self.order + 'iI', cdr, STAMP.start)
        return int(sec * NANOSECONDS + nanosec)

    def span(self, path: str) -> slice:
        """Return the bytes of a number, a vector or an array."""
        kind, offset = self.dtype.fields[path][:2]  # type: ignore[index]
        return slice(offset, offset + kind.itemsize)

    def rows(self, cdrs: Sequence[bytes]) -> np.ndarray:
        """Lay the type over n messages that all fit."""
        return np.frombuffer(b''.join(cdrs), dtype=self.dtype)


def encode(message_type: str, values: Mapping[str, Any]) -> bytes:
    """
    Write one message; what is not given is as in a new one: zero, empty, or its default.

    Parameters
    ----------
    message_type : str
        One of those that are defined.
    values : mapping
        By field: numbers, strings, sequences, and mappings of messages within the message.

    """
    out = bytearray(OPENING)
    _put(compound(message_type))(values, out)
    return bytes(out)


@cache
def _put(kind: Kind) -> Callable[[Any, bytearray], None]:
    """Return what appends a value of some kind to the bytes of a message."""
    match kind:
        case Number():
            put = _put_numbers(kind)
            return lambda value, out: put((value,), out)
        case Text():
            return _put_text
        case Several(of=of, count=count):
            return _put_several(of, count)
        case Compound(fields=fields):
            return _put_compound(fields)


def _put_text(value: str, out: bytearray) -> None:
    text = value.encode()
    out += ALIGNING[len(out) % 4] + count_bytes(len(text) + 1) + text + b'\0'


def _put_numbers(number: Number) -> Callable[[Sequence[float], bytearray], None]:
    code, size = number.code, SIZES[number.code]

    def put(values: Sequence[float], out: bytearray) -> None:
        if len(values):  # of nothing Fast CDR does not even write the padding
            out += bytes((BODY - len(out)) % size)
            out += struct.pack(f'={len(values)}{code}', *values)
    return put


def _put_several(of: Kind, count: int | None) -> Callable[[Any, bytearray], None]:
    put_all = _put_numbers(of) if isinstance(of, Number) else _put_each(_put(of))

    def put_several(values: Any, out: bytearray) -> None:
        if count is None:
            out += ALIGNING[len(out) % 4] + count_bytes(len(values))
        elif len(values) != count:
            raise ValueError(f'needs {count} values, got {len(values)}')
        put_all(values, out)
    return put_several


def _put_each(put: Callable[[Any, bytearray], None]) -> Callable[[Sequence[Any], bytearray], None]:
    def put_each(values: Sequence[Any], out: bytearray) -> None:
        for value in values:
            put(value, out)
    return put_each


def _put_compound(
    fields: tuple[tuple[str, Kind], ...],
) -> Callable[[Mapping[str, Any], bytearray], None]:
    parts = [(name, _put(kind), _new(kind)) for name, kind in fields]
    names = frozenset(name for name, _ in fields)

    def put_compound(values: Mapping[str, Any], out: bytearray) -> None:
        if not values.keys() <= names:
            raise ValueError(f'has the fields {", ".join(names)}, got {", ".join(values)}')
        for name, put, new in parts:
            put(values.get(name, new), out)
    return put_compound


def _new(kind: Kind) -> Any:
    """Return what a field is when nobody says."""
    match kind:
        case Number(default=default):
            return default
        case Text():
            return ''
        case Several(of=of, count=count):
            return [_new(of)] * (count or 0)
        case Compound():
            return {}


class Layouts:
    """Finds the layouts of messages of one type: one publisher keeps its own, read once."""

    def __init__(self, message_type: str, told: str = '') -> None:
        self._type, self._definition = message_type, told
        self._layout: Layout | None = None

    def layout(self, cdr: bytes) -> Layout | None:
        """Return the layout of a message, the same object for the same layout."""
        if self._layout is None or not self._layout.fits(cdr):
            try:
                self._layout = Layout.of(self._type, cdr, self._definition)
            except InputError:
                self._layout = None
        return self._layout
