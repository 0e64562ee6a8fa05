"""Raw acceleration samples in the CDR bytes of sensor_msgs/Imu."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Any

import numpy as np

from rotorsoil_ros.live.cdr import Cursor, STAMP
from rotorsoil_ros.live.events import NANOSECONDS
from rotorsoil_ros.physics.arrays import FloatArray, IntArray
from rotorsoil_ros.physics.errors import InputError

IMU = 'sensor_msgs/msg/Imu'
SYNTHETIC = 'synthetic'  # begins the frame of every signal that no sensor measured
AXES = ('x', 'y', 'z')

# Doubles of an Imu before its linear acceleration: orientation and angular velocity, each with
# the covariance.
_BEFORE_ACCELERATION = 4 + 9 + 3 + 9

LARGEST = 1e9  # [m/s^2]; no sensor tells more, and its square still fits into a double

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
    acceleration[np.abs(acceleration) > LARGEST] = np.nan
    return Accelerations(rows['sec'].astype(np.int64) * NANOSECONDS + rows['nanosec'],
                         acceleration, layout.is_synthetic)
