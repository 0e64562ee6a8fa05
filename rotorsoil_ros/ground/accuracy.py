"""How far are the models of the ground from the ground itself: shapes, neighbours, cones."""

from dataclasses import dataclass
import math

import numpy as np

from rotorsoil_ros.arrays import ComplexArray, FloatArray
from rotorsoil_ros.ground.soil import (
    Circle,
    Contact,
    extents,
    second_opinion_of,
    singular_of,
    SoilModel,
)

# Largest error of any stiffness where discs of equal area and second moment stand for a welded
# rectangle, over a0 up to 3.8 and nu 0.25 to 1/3, against rigorous solutions of the rectangle:
# `python -m benchmarks.model_errors` for 1 and 2; longer ones were measured with more tables.
_RATIOS = (1.0, 1.5, 2.0, 3.0, 4.2)
_MAPPING = (0.13, 0.16, 0.24, 0.36, 0.37)

# Largest error of cones under a disc, any motion, a0 up to 6: theory manual, cones.
CONE_ERROR = 0.25

# Largest coupling |N_ij| / sqrt(N_ii N_jj) of two squares at a0 = 2 over their gap in half-widths,
# and the change of a block's own compliance by an unloaded neighbour.
_GAPS = (0.25, 1.0, 4.0, 16.0)
_COUPLINGS = (0.45, 0.29, 0.20, 0.13)
_CHANGES = (0.11, 0.08, 0.024, 0.012)


@dataclass(frozen=True, slots=True)
class StifferGround:
    """
    Ground that is stiffer by a share in every motion, as a rectangle is than its disc.

    Attributes
    ----------
    model : SoilModel
        The ground.
    share : float
        > 0 [-].

    """

    model: SoilModel
    share: float

    @property
    def singular(self) -> FloatArray:
        """Where a wave of the layers begins to travel, rising [rad/s]."""
        return singular_of(self.model)

    @property
    def second_opinion(self) -> 'StifferGround':
        """A poorer model of the same ground."""
        return StifferGround(second_opinion_of(self.model), self.share)

    def compliance(self, omega: FloatArray) -> ComplexArray:
        """Return the compliance of the massless contact, (n, 6, 6) over (x, y, z, rx, ry, rz)."""
        return np.asarray(self.model.compliance(omega) / (1.0 + self.share))


def side_ratio(contact: Contact) -> float:
    """Return length over width of a contact, at least 1."""
    sides = [last - first for first, last in extents(contact)]
    return max(sides) / min(sides)


def mapping_error(contact: Contact) -> float:
    """
    Return how far a stiffness may be off as a disc stands for the contact.

    Parameters
    ----------
    contact : Contact
        A circle is its own disc.

    Returns
    -------
    float
        Share of the stiffness; infinite for rectangles longer than any that was measured.

    """
    if isinstance(contact, Circle):
        return 0.0
    ratio = side_ratio(contact)
    if ratio > _RATIOS[-1]:
        return math.inf
    return float(np.interp(math.log(ratio), np.log(_RATIOS), _MAPPING))


def gap(one: Contact, other: Contact, *, distance: float) -> float:
    """
    Return the clear distance between two contacts that lie one behind the other along y.

    Parameters
    ----------
    one, other : Contact
        Both centred on the shaft's plane.
    distance : float
        Of their centres along y [m].

    Returns
    -------
    float
        [m]; negative where they overlap.

    """
    return distance - _reach(one) - _reach(other)


def _reach(contact: Contact) -> float:
    _, (first, last) = extents(contact)
    return 0.5 * (last - first)


def neglected_coupling(one: Contact, other: Contact, *, distance: float) -> tuple[float, float]:
    """
    Return what is left out where two blocks are taken as alone on the ground.

    Parameters
    ----------
    one, other, distance
        As in `gap`.

    Returns
    -------
    tuple of two floats
        Motion of a block by a load on the other, over the geometric mean of their own motions;
        change of a block's own motion by the other, unloaded [-]. That of two squares at
        a0 = 2; beyond 16 half-widths that at 16, which is an upper bound.

    """
    half = 0.5 * math.sqrt(max(one.area, other.area))
    clear = math.log(max(gap(one, other, distance=distance) / half, _GAPS[0]))
    return (float(np.interp(clear, np.log(_GAPS), _COUPLINGS)),
            float(np.interp(clear, np.log(_GAPS), _CHANGES)))
