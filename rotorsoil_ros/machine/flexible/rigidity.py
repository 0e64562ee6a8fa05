"""Whether a block is as rigid as it is taken to be."""

from dataclasses import dataclass
import math

import numpy as np

from rotorsoil_ros.errors import OutOfTableError
from rotorsoil_ros.ground.plan import Plan
from rotorsoil_ros.ground.soil import Circle, extents, SoilModel
from rotorsoil_ros.machine.foundation import Foundation
from rotorsoil_ros.units import RADIANS_PER_TURN

# First bending of a free beam without shear, and what shear and rotary inertia make of it:
# within 7 % of finite elements for slabs of 12 x 4 x 1 to 3 x 2 x 1.2 m.
_THIN, _ROTARY, _SHEAR = 3.56, 49.5, 15.1
_SHEAR_SHARE, _POISSON_RATIO = 5.0 / 6.0, 0.2

# A block is rigid if its first bending lies this far above the excitation and above its heave.
ABOVE_EXCITATION, ABOVE_HEAVE = 3.3, 3.7

# Error of the rigid answer at rest over the squared ratio of bending to heave.
_STATIC_ERROR, _STATIC_OFFSET = 0.75, 1.6

# A plan that fills less of the rectangle around it is none.
_FILLED = 0.999


@dataclass(frozen=True, slots=True)
class Rigidity:
    """
    How far the bending of a free block is above what it is asked for.

    Attributes
    ----------
    bending, twist : float
        First frequencies of the free block [rad/s]; infinite twist where its plan is no rectangle.
    heave : float
        Of the rigid block on the static stiffness of its ground [rad/s]; 0 where none is known.
    excitation : float
        Highest frequency of once per turn [rad/s].
    length, width, thickness : float
        Of the slab that stands for it, the longest first [m].
    is_slab : bool
        Whether it is one, or a disc; of an L or a T the length is the longest extent.

    References
    ----------
    Theory manual, when a block is rigid.

    """

    bending: float
    twist: float
    heave: float
    excitation: float
    length: float
    width: float
    thickness: float
    is_slab: bool

    @property
    def lowest(self) -> float:
        """The lower of both [rad/s]."""
        return min(self.bending, self.twist)

    @property
    def over_excitation(self) -> float:
        """The lower of both over excitation [-]."""
        return self.lowest / self.excitation

    @property
    def over_heave(self) -> float:
        """Bending over heave [-]; infinite where heave is not known."""
        return self.bending / self.heave if self.heave > 0.0 else math.inf

    @property
    def is_rigid(self) -> bool:
        """Whether both are far enough."""
        return self.over_excitation >= ABOVE_EXCITATION and self.over_heave >= ABOVE_HEAVE

    @property
    def static_error(self) -> float:
        """Share by which the rigid answer is off at rest [-], of one raft, fitted."""
        return _STATIC_ERROR / (_STATIC_OFFSET + self.over_heave**2)


def free_bending(*, length: float, thickness: float, modulus: float, density: float) -> float:
    """
    Return the first bending frequency of a free slab [rad/s].

    Parameters
    ----------
    length, thickness : float
        [m].
    modulus, density : float
        Young's [Pa], and what rides on it spread over it [kg/m^3].

    References
    ----------
    Theory manual, when a block is rigid; of a thin slab Blevins, Formulas for Natural
    Frequency and Mode Shape (1979), table 8-1, free-free.

    """
    thin = _THIN * math.sqrt(modulus * thickness**2 / (12.0 * density)) / length**2
    shear = 2.0 * (1.0 + _POISSON_RATIO) / _SHEAR_SHARE
    slender = thickness**2 / (12.0 * length**2)
    return RADIANS_PER_TURN * thin / math.sqrt(1.0 + slender * (_ROTARY + _SHEAR * shear))


def free_twist(
    *, length: float, width: float, thickness: float, modulus: float, density: float,
) -> float:
    """
    Return the first frequency at which a free slab twists about its length [rad/s].

    Parameters
    ----------
    length, width, thickness : float
        [m].
    modulus, density : float
        As `free_bending`.

    References
    ----------
    Torsion constant of a rectangle: Young & Budynas, Roark's Formulas for Stress and Strain
    (2002), table 10.1.

    """
    wide, thin = max(width, thickness), min(width, thickness)
    slender = thin / wide
    constant = wide * thin**3 * (1.0 / 3.0 - 0.21 * slender * (1.0 - slender**4 / 12.0))
    polar = wide * thin * (wide**2 + thin**2) / 12.0
    shear = modulus / (2.0 * (1.0 + _POISSON_RATIO))
    return math.pi / length * math.sqrt(shear * constant / (density * polar))


def rigidity(block: Foundation, ground: SoilModel, speed: tuple[float, float]) -> Rigidity | None:
    """
    Return how rigid a block is.

    Parameters
    ----------
    block : Foundation
        Taken as rigid.
    ground : SoilModel
        Below it.
    speed : tuple of two floats
        Lowest and highest of the rotor [rad/s].

    Returns
    -------
    Rigidity or None
        None of a block without mass or height, and on ground that does not give way: nothing
        bends it there.

    """
    heave = _heave(block, ground, speed[0])
    thickness = block.height or 2.0 * block.centre_of_gravity_height
    if not (block.mass > 0.0 and thickness > 0.0) or heave == math.inf:
        return None
    contact = block.contact
    plan = [last - first for first, last in extents(contact)]
    # A block may stand on its narrow side, or higher than it is long.
    least, middle, longest = sorted([*plan, thickness])
    density = block.mass / (contact.area * thickness)
    bending = free_bending(length=longest, thickness=least, modulus=block.young_modulus,
                           density=density)
    is_slab = not isinstance(contact, Plan) or contact.area > _FILLED * math.prod(plan)
    twist = math.inf if isinstance(contact, Circle) or not is_slab else free_twist(
        length=longest, width=middle, thickness=least, modulus=block.young_modulus,
        density=density)
    return Rigidity(bending, twist, heave, speed[1], longest, middle, least, is_slab)


def _heave(block: Foundation, ground: SoilModel, lowest: float) -> float:
    """Return the frequency of a block on the static stiffness of its ground [rad/s]."""
    for omega in (0.0, lowest):
        try:
            gives = complex(ground.compliance(np.array([omega]))[0, 2, 2])
        except OutOfTableError:  # a file need not know rest
            continue
        if gives == 0.0:
            return math.inf
        if math.isfinite(abs(gives)) and (stiffness := (1.0 / gives).real) > 0.0:
            return math.sqrt(stiffness / block.mass) if block.mass > 0.0 else math.inf
    return 0.0
