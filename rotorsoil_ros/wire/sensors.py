"""What do sensors say? Vectors, samples and temperatures out of messages, as arrays."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Any, Generic, TypeVar

import numpy as np
import numpy.typing as npt

from rotorsoil_ros.arrays import FloatArray, IntArray
from rotorsoil_ros.events import NANOSECONDS
from rotorsoil_ros.monitor.vectors.orders import LARGEST_ACCELERATION
from rotorsoil_ros.wire.cdr import ARRAYS, Layout, Layouts, NOT_MEASURED, SYNTHETIC
from rotorsoil_ros.wire.definitions import IMU, JOINT_STATE


@dataclass(frozen=True, slots=True)
class JointStates:
    """Decoded JointStates of one layout; an array that the message left empty is NaN."""

    names: tuple[str, ...]
    stamp_ns: IntArray
    position: FloatArray
    velocity: FloatArray
    effort: FloatArray


@dataclass(frozen=True, slots=True)
class Accelerations:
    """
    Stamps (n,) [ns] and accelerations (n, 3) [m/s^2], NaN where the sensor has none.

    `orientation` is a unit quaternion (n, 4) x, y, z, w, NaN where the sensor has none.
    """

    stamp_ns: IntArray
    acceleration: FloatArray
    is_synthetic: bool
    orientation: FloatArray


@dataclass(frozen=True, slots=True)
class Temperatures:
    """Stamps (n,) [ns] and temperatures (n,) [deg C]."""

    stamp_ns: IntArray
    celsius: FloatArray


Decoded = TypeVar('Decoded', bound=JointStates | Accelerations | Temperatures)


class Reader(Layouts, Generic[Decoded]):
    """Decodes messages as they come."""

    def __init__(
        self, message_type: str, decode: Callable[[Layout, Sequence[bytes]], Decoded],
    ) -> None:
        super().__init__(message_type)
        self._decode = decode

    def runs(self, cdrs: Sequence[bytes]) -> Iterator[tuple[list[bytes], Decoded | None]]:
        """Split messages into runs of one layout, decoded; None where they are malformed."""
        for layout, run in groupby(cdrs, key=self.layout):
            messages = list(run)
            yield messages, self._decode(layout, messages) if layout else None


class JointStateReader(Reader[JointStates]):
    """Decodes JointStates."""

    def __init__(self) -> None:
        super().__init__(JOINT_STATE, joint_states)


class ImuReader(Reader[Accelerations]):
    """Decodes samples of accelerometers."""

    def __init__(self) -> None:
        super().__init__(IMU, accelerations)


def temperatures(layout: Layout, cdrs: Sequence[bytes]) -> Temperatures:
    """Decode n temperatures that all fit one layout."""
    rows = layout.rows(cdrs)
    return Temperatures(_stamps(rows), rows['temperature'].astype(float))


def joint_states(layout: Layout, cdrs: Sequence[bytes]) -> JointStates:
    """Decode n messages that all fit one layout; arrays are (n, names)."""
    rows, names = layout.rows(cdrs), layout.texts['name']
    return JointStates(names, _stamps(rows), *(
        _full(rows[array], len(names)) for array in ARRAYS))


def accelerations(layout: Layout, cdrs: Sequence[bytes]) -> Accelerations:
    """Decode n samples that all fit one layout."""
    rows = layout.rows(cdrs)
    acceleration = rows['linear_acceleration'].astype(float)
    acceleration[rows['linear_acceleration_covariance'][:, 0] == NOT_MEASURED] = np.nan
    acceleration[np.abs(acceleration) > LARGEST_ACCELERATION] = np.nan
    return Accelerations(_stamps(rows), acceleration,
                         layout.texts['header.frame_id'][0].startswith(SYNTHETIC),
                         _orientation(rows))


def _orientation(rows: np.ndarray) -> FloatArray:
    """Return orientations (n, 4) as unit quaternions, NaN where none is told."""
    quaternion = rows['orientation'].astype(float)
    largest = np.max(np.abs(quaternion), axis=1)
    is_told = (np.isfinite(largest) & (largest > 0.0)
               & (rows['orientation_covariance'][:, 0] != NOT_MEASURED))
    # Only its direction counts; whoever sends 1e300 must not make squares overflow.
    scaled = np.where(is_told[:, None], quaternion, np.nan) / np.where(
        is_told, largest, 1.0)[:, None]
    return np.asarray(scaled / np.linalg.norm(scaled, axis=1)[:, None])


def _stamps(rows: np.ndarray) -> IntArray:
    """Return the stamps (n,) of stamped messages [ns]."""
    seconds = rows['header.stamp.sec'].astype(np.int64)
    return np.asarray(seconds * NANOSECONDS + rows['header.stamp.nanosec'])


def _full(values: npt.NDArray[Any], width: int) -> FloatArray:
    """Return one value per joint: NaN where the message has none."""
    if values.shape[1] == width:
        return values.astype(float)
    full = np.full((len(values), width), np.nan)
    given = min(width, values.shape[1])
    full[:, :given] = values[:, :given]
    return full
