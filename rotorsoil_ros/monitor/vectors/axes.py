"""Are axes and unit of a sensor those of the machine? Gravity tells, and the sensor itself."""

from dataclasses import replace
import math

import numpy as np

from rotorsoil_ros.arrays import FloatArray
from rotorsoil_ros.case.entries.sensors import Pickup
from rotorsoil_ros.events import Samples
from rotorsoil_ros.monitor.vectors.refusal import Flaw, NOT_SEEN, Refusal, SEEN
from rotorsoil_ros.units import STANDARD_GRAVITY

# The mean over this time is held to be that of rest [s]; until then the mean so far stands in.
_LOOKED_AT_S = 10.0

# Means that are gravity in m/s^2, and in g.
_GRAVITY, _IN_G = (8.8, 10.8), (0.9, 1.1)

# Turned by more than this from the vertical, axes are not those of the machine [rad].
_UPRIGHT = math.radians(10.0)

# Axes that a sensor says are turned by more than this are not those of the machine; where its
# orientation is used, it may stray from its mean by less [rad].
_TURNED, _STRAYS = math.radians(5.0), math.radians(2.0)

# Axes of a machine that stands over those of the ground: its y is up, its z against y.
_STANDING = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])

# Columns of what a sensor says with each sample: three axes, then a quaternion x, y, z, w.
_FELT, _QUATERNION, _WIDTH = slice(0, 3), slice(3, 7), 7


def said_with(samples: Samples) -> FloatArray:
    """Return axes and orientation of samples, (n, 7), NaN where the sensor says nothing."""
    rows = np.full((len(samples.stamp_ns), _WIDTH), np.nan)
    if len(samples.felt):
        rows[:, _FELT] = samples.felt
    if len(samples.orientation):
        rows[:, _QUATERNION] = samples.orientation
    return rows


def in_si(samples: Samples, pickup: Pickup) -> Samples:
    """Return samples in m/s^2, whatever unit their messages are in."""
    if pickup.units != 'g':
        return samples
    return replace(samples, acceleration=STANDARD_GRAVITY * samples.acceleration,
                   felt=STANDARD_GRAVITY * samples.felt)


class Axes:
    """
    Holds the axes of one sensor against gravity and against what it says of them itself.

    All hangs on the first ten seconds of stretches: on their stamps, on no clock.
    """

    def __init__(self, pickup: Pickup, column: int) -> None:
        self._pickup, self._column = pickup, column
        self._seconds, self._felt_s = 0.0, 0.0
        self._felt = np.zeros(3)
        self._turns = np.zeros((4, 4))

    def along(self, values: FloatArray, said: FloatArray, *, seconds: float) -> (
            FloatArray | Refusal):
        """
        Return the acceleration along an axis of the machine, or why it is not known.

        Parameters
        ----------
        values : (n,) float array
            Along the axis of the sensor [m/s^2].
        said : (n, 7) float array
            Axes [m/s^2] and orientation, as `said_with` returns them.
        seconds : float
            How long the stretch is.

        """
        felt, quaternion = said[:, _FELT], said[:, _QUATERNION]
        self._see(felt, quaternion, seconds)
        to_machine = self.to_machine
        if self._pickup.heading and not np.isfinite(felt).all():
            return Refusal(Flaw.TURNED, 'the sensor has a heading, but not every sample has three '
                                        'axes')
        if self._pickup.has_orientation:
            if not np.isfinite(said).all():
                return Refusal(Flaw.TURNED, 'the orientation is to be used, but not every sample '
                                            'has one, and three axes')
            mean = self._mean
            if (strays := float(np.max(_apart(quaternion, mean)))) > _STRAYS:
                return Refusal(Flaw.TURNED, 'the orientation of the sensor strays by '
                                            f'{math.degrees(strays):.0f} deg from its mean')
            values = felt @ to_machine[self._column]
        elif (tilt := _largest_turn(quaternion)) > _TURNED:
            return Refusal(Flaw.TURNED, 'the orientation of the sensor turns its axes by '
                                        f'{math.degrees(tilt):.0f} deg')
        elif self._pickup.heading:
            values = felt @ to_machine[self._column]
        refusal = self._against_gravity(to_machine)
        return values if refusal is None else refusal

    @property
    def to_machine(self) -> FloatArray:
        """The matrix (3, 3) from axes of the sensor to those of the machine, as known now."""
        if not self._pickup.has_orientation:
            return _heading(self._pickup)
        turned = _matrix(self._mean)
        return _STANDING @ turned if self._pickup.is_upright else turned

    @property
    def _mean(self) -> FloatArray:
        """Mean of what the sensor says of its orientation, a unit quaternion."""
        return np.asarray(np.linalg.eigh(self._turns)[1][:, -1])

    def peaks(self, values: FloatArray, said: FloatArray) -> FloatArray:
        """Return the largest (n,) that the sensor felt along the axes that count [m/s^2]."""
        turns = self._pickup.has_orientation or self._pickup.heading
        return np.abs(said[:, _FELT]).max(axis=1) if turns else np.abs(values)

    def words(self) -> str:
        """Return what gravity says of unit and axes; empty while it is not known."""
        if self._felt_s < _LOOKED_AT_S:
            return ''
        size = float(np.linalg.norm(self._felt)) / self._felt_s
        return SEEN if _GRAVITY[0] <= size <= _GRAVITY[1] else NOT_SEEN

    def _see(self, felt: FloatArray, quaternion: FloatArray, seconds: float) -> None:
        """Look at a stretch, as long as the first seconds last."""
        if self._felt_s < _LOOKED_AT_S and np.isfinite(felt).all():
            self._felt += seconds * felt.mean(axis=0)
            self._felt_s += seconds
        if self._seconds < _LOOKED_AT_S and np.isfinite(quaternion).all():
            # The mean of rotations is the direction that most of q q^T has: q and -q are one.
            self._turns += quaternion.T @ quaternion
            self._seconds += seconds

    def _against_gravity(self, to_machine: FloatArray) -> Refusal | None:
        """Return why the mean of what was felt is that of other axes, or of another unit."""
        if not self._felt_s:
            return None
        mean = to_machine @ self._felt / self._felt_s
        size, units = float(np.linalg.norm(mean)), self._pickup.units
        if _IN_G[0] <= size <= _IN_G[1] and not units:
            return Refusal(Flaw.UNITS, f'looks like g, not m/s^2: the mean of three axes is '
                                       f'{size:.3g}; state sensors: units in the case')
        if units == 'g' and _GRAVITY[0] <= size / STANDARD_GRAVITY <= _GRAVITY[1]:
            return Refusal(Flaw.UNITS, 'looks like m/s^2, not g as the case says: the mean of '
                                       f'three axes is {size / STANDARD_GRAVITY:.3g}')
        up = 1 if self._pickup.is_upright else 2
        tilt = math.atan2(float(np.linalg.norm(np.delete(mean, up))), abs(mean[up]))
        if _GRAVITY[0] <= size <= _GRAVITY[1] and tilt > _UPRIGHT:
            return Refusal(Flaw.AXES, 'axes are not those of the machine: gravity is '
                                      f'{math.degrees(tilt):.0f} deg off {"xyz"[up]}')
        return None


def _heading(pickup: Pickup) -> FloatArray:
    """Return the matrix (3, 3) from axes of a sensor that is turned about the vertical."""
    cosine, sine = math.cos(pickup.heading), math.sin(pickup.heading)
    about_z = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
    # The same turn of a machine whose vertical is its y.
    return _STANDING @ about_z @ _STANDING.T if pickup.is_upright else about_z


def _largest_turn(quaternion: FloatArray) -> float:
    """Return the largest angle of unit quaternions (n, 4) [rad]; where none is told it is 0."""
    # The whole angle from both parts: of a small one the cosine alone has no digits.
    angle = 2.0 * np.arctan2(np.linalg.norm(quaternion[:, :3], axis=1),
                             np.abs(quaternion[:, 3]))
    return float(np.max(np.where(np.isfinite(angle), angle, 0.0)))


def _apart(quaternion: FloatArray, mean: FloatArray) -> FloatArray:
    """Return the angles (n,) between unit quaternions and one of them [rad]."""
    # Half of it from the chord: of a small one the cosine alone has no digits.
    chord = np.minimum(np.linalg.norm(quaternion - mean, axis=1),
                       np.linalg.norm(quaternion + mean, axis=1))
    return np.asarray(4.0 * np.arcsin(np.minimum(0.5 * chord, 1.0)))


def _matrix(quaternion: FloatArray) -> FloatArray:
    """Return the matrix (3, 3) that turns as a unit quaternion x, y, z, w does."""
    x, y, z, w = quaternion
    return np.array([
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)],
        [2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)],
        [2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)]])
