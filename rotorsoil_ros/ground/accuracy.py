"""How far are the models of the ground from the ground itself: shapes, neighbours, cones."""

from dataclasses import dataclass
import math

import numpy as np

from rotorsoil_ros.arrays import ComplexArray, FloatArray
from rotorsoil_ros.channel import DOFS
from rotorsoil_ros.ground.plan import clearance, Part
from rotorsoil_ros.ground.soil import (
    Circle,
    Contact,
    parts_of,
    second_opinion_of,
    singular_of,
    SoilModel,
)

# Half side of what stands for a point [m].
_POINT = 1e-300

# Largest error of cones under a disc, any motion, a0 up to 6: theory manual, cones.
CONE_ERROR = 0.25

# Largest coupling |N_ij| / sqrt(N_ii N_jj) of two squares at a0 = 2 over their gap in half-widths,
# and the change of a block's own compliance by an unloaded neighbour:
# `python -m benchmarks.shapes`.
_GAPS = (0.25, 1.0, 4.0, 16.0)
_COUPLINGS = (0.43, 0.28, 0.20, 0.13)
_CHANGES = (0.12, 0.07, 0.023, 0.012)


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


@dataclass(frozen=True, slots=True)
class ShapeError:
    """
    How far a model is from what it stands for, at its worst.

    Attributes
    ----------
    share : float
        |N / N_exact - 1| of a diagonal compliance [-].
    dof : str
        Which.
    omega : float
        Where [rad/s].

    """

    share: float
    dof: str
    omega: float


def shape_error(model: SoilModel, exact: SoilModel, omega: FloatArray) -> ShapeError:
    """
    Compare the diagonal of two compliances of one contact.

    Parameters
    ----------
    model, exact : SoilModel
        What stands for the contact, and what knows its shape.
    omega : (n,) float array
        Frequencies at which both are known [rad/s].

    """
    one, other = (np.diagonal(each.compliance(omega), axis1=1, axis2=2)
                  for each in (model, exact))
    off = np.abs(one / other - 1.0)
    row, dof = np.unravel_index(off.argmax(), off.shape)
    return ShapeError(float(off[row, dof]), DOFS[dof], float(omega[row]))


def gap(one: Contact, other: Contact, *, apart: tuple[float, float]) -> float:
    """
    Return the clear distance between two contacts.

    Parameters
    ----------
    one, other : Contact
        On one ground.
    apart : (x, y)
        From the centre of the one to that of the other [m].

    Returns
    -------
    float
        [m]; negative where they overlap.

    """
    def reach(contact: Contact) -> tuple[float, tuple[Part, ...]]:
        # A circle is a point with all of its radius around it.
        if isinstance(contact, Circle):
            return contact.radius, (Part(_POINT, _POINT, 0.0, 0.0),)
        return 0.0, parts_of(contact)

    (first, mine), (second, theirs) = reach(one), reach(other)
    return min(clearance(part, Part(two.half_width, two.half_length, two.x + apart[0],
                                    two.y + apart[1]))
               for part in mine for two in theirs) - first - second


def neglected_coupling(
    one: Contact, other: Contact, *, apart: tuple[float, float],
) -> tuple[float, float]:
    """
    Return what is left out where two blocks are taken as alone on the ground.

    Parameters
    ----------
    one, other, apart
        As in `gap`.

    Returns
    -------
    tuple of two floats
        Motion of a block by a load on the other, over the geometric mean of their own motions;
        change of a block's own motion by the other, unloaded [-]. That of two squares at
        a0 = 2; beyond 16 half-widths that at 16, which is an upper bound.

    """
    half = 0.5 * math.sqrt(max(one.area, other.area))
    clear = math.log(max(gap(one, other, apart=apart) / half, _GAPS[0]))
    return (float(np.interp(clear, np.log(_GAPS), _COUPLINGS)),
            float(np.interp(clear, np.log(_GAPS), _CHANGES)))
