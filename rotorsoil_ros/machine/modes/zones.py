"""Between which frequencies of a vibration soil, bearings and shaft each follow one law."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
import math

import numpy as np

from rotorsoil_ros.arrays import ComplexArray, FloatArray
from rotorsoil_ros.ground.continuation import Continuation
from rotorsoil_ros.machine.modes.eigen import FELT_BELOW


@dataclass(frozen=True)
class Zone:
    """
    Frequencies of a vibration between which everything follows one law.

    Attributes
    ----------
    compliance : Continuation
        Of the support without its mass.
    told, owned : tuple of two floats
        Frequencies at which it holds, and those that belong to no other zone [rad/s].
    between : tuple of two floats
        Points of the bearings' tables over frequency about them [rad/s].
    lag : float
        Sign of whirl frequency less rotor speed: what a hysteretic shaft asks for, else 0.

    """

    compliance: Continuation
    told: tuple[float, float]
    owned: tuple[float, float]
    between: tuple[float, float]
    lag: float

    @property
    def middle(self) -> float:
        """A frequency inside [rad/s]."""
        return 0.5 * (self.told[0] + self.told[1])

    def ends(
        self, span: tuple[float, float], speed: FloatArray,
    ) -> tuple[FloatArray, FloatArray]:
        """Return the part of a span on this side of rotor speeds (n,) [rad/s]."""
        low, high = (np.full(len(speed), end) for end in span)
        return (np.maximum(low, speed) if self.lag > 0.0 else low,
                np.minimum(high, speed) if self.lag < 0.0 else high)

    def astray(
        self, frequency: ComplexArray, low: FloatArray, high: FloatArray,
    ) -> FloatArray:
        """
        Return which light vibrations of (n, p) lie just beyond ends (n,), else inf.

        Where a table leaves open where a zone ends, they may be of this zone all the same.
        """
        beyond = np.maximum(low[:, None] - frequency.real, frequency.real - high[:, None])
        light = frequency.imag < FELT_BELOW * np.abs(frequency)
        found = light & (beyond > 0.0) & (beyond <= self.compliance.blur)
        return np.where(found, frequency.real, np.inf)


def zones_of(
    pieces: Sequence[Continuation], span: tuple[float, float], bends: FloatArray, *,
    turning_points: FloatArray, lags: Sequence[float],
) -> tuple[Zone, ...]:
    """
    Return the zones of a machine, rising.

    Parameters
    ----------
    pieces : sequence of Continuation
        Compliance of the support between the branch points of its soil.
    span : tuple of two floats
        Frequencies that are looked at [rad/s].
    bends : (f,) float array
        Frequencies at which tables of bearings bend; beyond the first and the last of them no
        vibration is told [rad/s].
    turning_points : (h,) float array
        Frequencies at which what shafts that do not follow exert turns [rad/s].
    lags : sequence of float
        Signs of whirl frequency less rotor speed that make a difference.

    """
    cuts = np.union1d(bends, turning_points)
    cuts = cuts[(cuts > span[0]) & (cuts < span[1])].tolist()
    last = len(pieces) - 1
    found = []
    for index, piece in enumerate(pieces):
        told = span if len(pieces) == 1 else piece.span
        # What creeps belongs to the first, what is beyond all of them to the last.
        owned = (-math.inf if index == 0 and not len(bends) else told[0],
                 pieces[index + 1].span[0] if index < last else
                 span[1] if len(bends) else math.inf)
        for low, high in pairwise([-math.inf, *cuts, math.inf]):
            part, mine = ((max(low, ends[0]), min(high, ends[1])) for ends in (told, owned))
            if part[0] < part[1]:
                between = (low, high) if not len(bends) else _about(bends, part)
                found += [Zone(piece, part, mine, between, lag) for lag in lags]
    return tuple(found)


def _about(bends: FloatArray, part: tuple[float, float]) -> tuple[float, float]:
    """Return the points of tables on both sides of frequencies [rad/s], or the last two."""
    after = int(np.clip(np.searchsorted(bends, 0.5 * (part[0] + part[1])), 1, len(bends) - 1))
    return float(bends[after - 1]), float(bends[after])
