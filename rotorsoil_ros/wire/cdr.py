"""Where a JointState keeps its stamp and its numbers inside its CDR bytes."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby
import struct
from typing import Any

import numpy as np
import numpy.typing as npt

from rotorsoil_ros.arrays import FloatArray, IntArray
from rotorsoil_ros.errors import InputError
from rotorsoil_ros.events import NANOSECONDS
from rotorsoil_ros.monitor.orders import LARGEST_ACCELERATION

LITTLE_ENDIAN = 1
BODY = 4  # CDR aligns from the end of its four encapsulation bytes
STAMP = slice(BODY, BODY + 8)
ARRAYS = ('position', 'velocity', 'effort')


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


@dataclass(frozen=True, slots=True, eq=False)
class JointLayout:
    """
    Where the numbers of all JointStates lie that differ in nothing but numbers.

    Attributes
    ----------
    names : tuple of str
        Joints.
    size : int
        Length of the message [bytes].
    fixed : tuple of (slice, bytes)
        What such messages share: names and counts, but not the padding, which is not zeroed.
    order : str
        Byte order, < or >.
    dtype : numpy structured type
        Fields sec, nanosec, position, velocity and effort laid over the bytes.

    """

    names: tuple[str, ...]
    size: int
    fixed: tuple[tuple[slice, bytes], ...]
    order: str
    dtype: np.dtype[Any]

    @classmethod
    def of(cls, cdr: bytes) -> 'JointLayout':
        """Read the layout of one message; raise InputError where it is not a JointState."""
        cursor = Cursor(cdr)
        cursor.skip(STAMP.stop - STAMP.start)
        cursor.text()
        names = tuple([cursor.text() for _ in range(cursor.count())])
        fields = {'sec': (f'{cursor.order}i4', STAMP.start),
                  'nanosec': (f'{cursor.order}u4', STAMP.start + 4)}
        for name in ARRAYS:
            length = cursor.count()
            fields[name] = (f'({length},){cursor.order}f8', cursor.skip(8 * length, align=8))
        dtype = np.dtype({
            'names': list(fields), 'formats': [kind for kind, _ in fields.values()],
            'offsets': [offset for _, offset in fields.values()], 'itemsize': len(cdr)})
        fixed = tuple((at, cdr[at]) for at in cursor.read)
        return cls(names, len(cdr), fixed, cursor.order, dtype)

    def fits(self, cdr: bytes) -> bool:
        """Return whether a message differs from this layout in nothing but its numbers."""
        return len(cdr) == self.size and all([cdr[at] == shared for at, shared in self.fixed])

    def stamp_ns(self, cdr: bytes) -> int:
        """Return the stamp of one message [ns]."""
        sec, nanosec = struct.unpack_from(self.order + 'iI', cdr, STAMP.start)
        return int(sec * NANOSECONDS + nanosec)

    def span(self, name: str) -> slice:
        """Return the bytes of one of the three arrays."""
        kind, offset = self.dtype.fields[name][:2]  # type: ignore[index]
        return slice(offset, offset + kind.itemsize)


@dataclass(frozen=True, slots=True)
class JointStates:
    """Decoded JointStates of one layout; an array that the message left empty is NaN."""

    names: tuple[str, ...]
    stamp_ns: IntArray
    position: FloatArray
    velocity: FloatArray
    effort: FloatArray


def decode(layout: JointLayout, cdrs: Sequence[bytes]) -> JointStates:
    """Decode n messages that all fit one layout; arrays are (n, names)."""
    rows = np.frombuffer(b''.join(cdrs), dtype=layout.dtype)
    stamp_ns = rows['sec'].astype(np.int64) * NANOSECONDS + rows['nanosec']
    width = len(layout.names)
    return JointStates(layout.names, stamp_ns, *(_full(rows[name], width) for name in ARRAYS))


class JointStateReader:
    """Decode JointStates as they come: one publisher keeps its layout, so it is read once."""

    def __init__(self) -> None:
        self._layout: JointLayout | None = None

    def runs(self, cdrs: Sequence[bytes]) -> Iterator[tuple[list[bytes], JointStates | None]]:
        """Split messages into runs of one layout, decoded; None where they are malformed."""
        for layout, run in groupby(cdrs, key=self.layout):
            messages = list(run)
            yield messages, decode(layout, messages) if layout else None

    def layout(self, cdr: bytes) -> JointLayout | None:
        """Return the layout of a message, the same object for the same layout."""
        if self._layout is None or not self._layout.fits(cdr):
            try:
                self._layout = JointLayout.of(cdr)
            except InputError:
                self._layout = None
        return self._layout


def _full(values: npt.NDArray[Any], width: int) -> FloatArray:
    """Return one value per joint: NaN where the message has none."""
    if values.shape[1] == width:
        return values.astype(float)
    full = np.full((len(values), width), np.nan)
    given = min(width, values.shape[1])
    full[:, :given] = values[:, :given]
    return full


IMU = 'sensor_msgs/msg/Imu'
SYNTHETIC = 'synthetic'  # begins the frame of every signal that no sensor measured
AXES = ('x', 'y', 'z')

# Doubles of an Imu before its linear acceleration: orientation and angular velocity, each with
# the covariance.
_BEFORE_ACCELERATION = 4 + 9 + 3 + 9

_NOT_MEASURED = -1.0  # in the first covariance


@dataclass(frozen=True, slots=True)
class Accelerations:
    """Stamps (n,) [ns] and accelerations (n, 3) [m/s^2], NaN where the sensor has none."""

    stamp_ns: IntArray
    acceleration: FloatArray
    is_synthetic: bool


@dataclass(frozen=True, slots=True, eq=False)
class _Layout:
    """Where the numbers lie in all messages of one sensor: they differ in nothing else."""

    opening: bytes
    frame: slice
    frame_id: bytes
    dtype: np.dtype[Any]
    is_synthetic: bool

    @classmethod
    def of(cls, cdr: bytes) -> '_Layout':
        cursor = Cursor(cdr)
        cursor.skip(STAMP.stop - STAMP.start)
        text = cursor.text()
        frame = slice(STAMP.stop, cursor.at)
        cursor.skip(8 * _BEFORE_ACCELERATION, align=8)
        at = cursor.skip(8 * len(AXES), align=8)
        covariance = cursor.skip(8, align=8)
        order = cursor.order
        dtype = np.dtype({
            'names': ['sec', 'nanosec', 'acceleration', 'covariance'],
            'formats': [f'{order}i4', f'{order}u4', f'(3,){order}f8', f'{order}f8'],
            'offsets': [STAMP.start, STAMP.start + 4, at, covariance], 'itemsize': len(cdr)})
        return cls(cdr[:2], frame, cdr[frame], dtype, text.startswith(SYNTHETIC))

    def fits(self, cdr: bytes) -> bool:
        return (len(cdr) == self.dtype.itemsize and cdr[:2] == self.opening
                and cdr[self.frame] == self.frame_id)


class ImuReader:
    """Decodes the samples of one topic as they come."""

    def __init__(self) -> None:
        self._layout: _Layout | None = None

    def runs(self, cdrs: Sequence[bytes]) -> Iterator[tuple[list[bytes], Accelerations | None]]:
        """Split messages into runs of one sensor, decoded; None where they are malformed."""
        for layout, run in groupby(cdrs, key=self._layout_of):
            messages = list(run)
            yield messages, _decode(layout, messages) if layout else None

    def _layout_of(self, cdr: bytes) -> _Layout | None:
        if self._layout is None or not self._layout.fits(cdr):
            try:
                self._layout = _Layout.of(cdr)
            except InputError:
                self._layout = None
        return self._layout


def _decode(layout: _Layout, cdrs: Sequence[bytes]) -> Accelerations:
    rows = np.frombuffer(b''.join(cdrs), dtype=layout.dtype)
    acceleration = rows['acceleration'].astype(float)
    acceleration[rows['covariance'] == _NOT_MEASURED] = np.nan
    acceleration[np.abs(acceleration) > LARGEST_ACCELERATION] = np.nan
    return Accelerations(rows['sec'].astype(np.int64) * NANOSECONDS + rows['nanosec'],
                         acceleration, layout.is_synthetic)
