"""How a rigid block on the soil moves under the bearings that stand on it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
import math

import numpy as np
from scipy.sparse.csgraph import connected_components

from rotorsoil_ros.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from rotorsoil_ros.channel import DOFS
from rotorsoil_ros.errors import NotSolvedError, require
from rotorsoil_ros.ground.soil import below_each, Contact, RigidSoil, SharedGround, SoilModel
from rotorsoil_ros.machine.flexible.body import CONTACT, Dof, FlexibleBody, GREEN, WINKLER
from rotorsoil_ros.machine.placement import AT_ORIGIN, Placement

# Young's modulus of what most blocks are made of [Pa].
CONCRETE = 30e9


def solid_inertia(
    contact: Contact, *, mass: float, height: float,
) -> tuple[float, float, float]:
    """Return the inertia of a solid block on its contact, about its centre [kg m^2]."""
    x, y, z = (mass * moment / contact.area for moment in contact.second_moments)
    upright = mass * height**2 / 12.0
    return x + upright, y + upright, z


@dataclass(frozen=True, slots=True)
class Stand:
    """
    What a foundation stands on in place of the ground.

    Attributes
    ----------
    foundation : str
        Name of that below.
    places : tuple of str
        Of that below, one for each contact in their order; none on a rigid block.
    elevation : float
        Of the contact above that of the lowest foundation [m].

    """

    foundation: str
    places: tuple[str, ...]
    elevation: float


@dataclass(frozen=True, slots=True)
class Foundation:
    """
    Rigid block with everything that moves with it.

    Attributes
    ----------
    name : str
        Name of the block, first part of its channels.
    contact : Contact
        Area of contact with the soil; its centre is where the block's motion is reported.
    centre_y : float
        Position of the contact centre along the shaft [m].
    mass : float
        m [kg], may be zero.
    centre_of_gravity_height : float
        z_c above the contact plane [m].
    inertia : tuple of three floats
        Moments of inertia about the centre of gravity, axes x, y, z [kg m^2].
    height : float or None
        Of the block above the contact plane [m]; nothing but pictures depends on it.
    centre_x : float
        Position of the contact centre across the shaft, whose plane is x = 0 [m].
    inertia_product : float
        Integral of x y dm about the centre of gravity [kg m^2]: of an L, not of a rectangle.
    young_modulus : float
        Of what it is made of [Pa]; whether it is rigid depends on it, and nothing else.
    body : FlexibleBody or None
        What it is where it bends: then mass and inertia above are for people only.
    on : Stand or None
        What carries it; None is the ground.

    """

    name: str
    contact: Contact
    centre_y: float
    mass: float
    centre_of_gravity_height: float
    inertia: tuple[float, float, float]
    height: float | None = None
    centre_x: float = 0.0
    inertia_product: float = 0.0
    young_modulus: float = CONCRETE
    body: FlexibleBody | None = None
    on: Stand | None = None

    def __post_init__(self) -> None:
        require(0.0 <= self.mass < math.inf, 'mass', '>= 0 kg and finite', self.mass)
        require(math.isfinite(self.centre_y), 'centre_y', 'finite, in m', self.centre_y)
        require(math.isfinite(self.centre_x), 'centre_x', 'finite, in m', self.centre_x)
        require(math.isfinite(self.centre_of_gravity_height), 'centre_of_gravity_height',
                'finite, in m', self.centre_of_gravity_height)
        if self.height is not None:
            require(0.0 < self.height < math.inf, 'height', '> 0 m and finite', self.height)
        require(0.0 < self.young_modulus < math.inf, 'young_modulus', '> 0 Pa and finite',
                self.young_modulus)
        for axis, value in zip('xyz', self.inertia, strict=True):
            require(0.0 <= value < math.inf, f'inertia about {axis}', '>= 0 kg m^2 and finite',
                    value)

    @property
    def is_solid(self) -> bool:
        """Whether it fills its outline: blocks and rafts do, frames on footings do not."""
        return self.body is None or self.body.bed in (WINKLER, GREEN)

    @property
    def elevation(self) -> float:
        """Height of its contact above that of the lowest foundation [m]."""
        return 0.0 if self.on is None else self.on.elevation

    @property
    def footing(self) -> list[Dof]:
        """Motions of its contacts, their places counted from the centre of all of them."""
        if self.body is None:
            return [Dof(self.name, axis, CONTACT, (0.0, 0.0, 0.0)) for axis in DOFS]
        middle = np.array(self.body.centre)
        own = [self.body.dofs[row] for row in self.body.contacts.tolist()]
        places = [(np.array(dof.place) - middle).tolist() for dof in own]
        return [replace(dof, place=(x, y, z))
                for dof, (x, y, z) in zip(own, places, strict=True)]

    def under(self, above: 'Foundation') -> FloatArray:
        """
        Return how it moves below the contacts of another that stands on it.

        Per rigid motion about its own contact (c, 6), or per motion of its interface (c, p) if it
        bends.

        Raises
        ------
        RotorSoilError
            If there is no such place, or it has not the motions that are needed.

        """
        assert above.on is not None
        if self.body is None:
            x, y, z = (above.centre_x - self.centre_x, above.centre_y - self.centre_y,
                       above.elevation - self.elevation)
            return np.array([replace(dof, place=(
                dof.place[0] + x, dof.place[1] + y, dof.place[2] + z)).rigid_row
                for dof in above.footing])
        names = dict(zip(dict.fromkeys(dof.station for dof in above.footing), above.on.places,
                         strict=True))
        return np.array([self.body.motion(names[dof.station], dof.axis) for dof in above.footing])

    @property
    def drawn_height(self) -> float:
        """Height of the block in pictures [m]: a uniform block's unless it is given."""
        if self.height is not None:
            return self.height
        return 2.0 * max(self.centre_of_gravity_height, 0.05 * self.contact.characteristic_length)

    @property
    def mass_matrix(self) -> FloatArray:
        """
        Mass matrix about the contact centre, (6, 6) over (x, y, z, rx, ry, rz).

        A centre of gravity z_c above the contact couples sliding and rocking.

        References
        ----------
        Seed paper, eq. (8), corrected: it is diagonal only about the centre of gravity.

        """
        m, height = self.mass, self.centre_of_gravity_height
        matrix = np.diag([m, m, m, *self.inertia])
        matrix[3, 3] += m * height**2
        matrix[4, 4] += m * height**2
        # The top of a block that turns by +ry moves toward +x, by +rx toward -y.
        matrix[0, 4] = matrix[4, 0] = m * height
        matrix[1, 3] = matrix[3, 1] = -m * height
        matrix[3, 4] = matrix[4, 3] = -self.inertia_product
        return matrix

    def seat_rows(
        self, *, position: float, height: float, place: Placement = AT_ORIGIN,
    ) -> FloatArray:
        """
        Return x and z of a point on the block per unit motion of the block, (2, 6).

        The point lies in the vertical plane of a shaft that is placed somewhere, `position` [m]
        along it and `height` [m] above the contact.
        """
        return place.seat_rows(position=position, height=height,
                               centre=(self.centre_x, self.centre_y))


def soils_below(
    foundations: Sequence[Foundation], models: Sequence[SoilModel],
) -> tuple[SoilModel, ...]:
    """Return what each of some foundations stands on; what stands on another, on nothing soft."""
    grounded = [one.on is None for one in foundations]
    if len(models) != 1 or not isinstance(models[0], SharedGround):
        return below_each(models, len(grounded))
    found = iter(below_each(models, sum(grounded)))
    return tuple(next(found) if own else RigidSoil() for own in grounded)


@dataclass(frozen=True, slots=True)
class BlockReceptance:
    """
    Receptance of a block on its soil, by what of its motion is coupled at all.

    Attributes
    ----------
    size : int
        Number of degrees of freedom, d.
    parts : tuple of ((g, s) int array, (n, g, s, s) complex array)
        For each size s the g sets of so many coupled degrees of freedom, and the receptance
        within each [m/N]. What is in no set cannot move.

    """

    size: int
    parts: tuple[tuple[IntArray, ComplexArray], ...]

    @classmethod
    def of(
        cls, compliance: ComplexArray, mass: FloatArray, omega: FloatArray,
    ) -> 'BlockReceptance':
        """Add a mass to a compliance; parameters as in `add_mass`."""
        moving: BoolArray = np.any(compliance != 0.0, axis=0)
        # What cannot move couples nothing, whatever its mass.
        free = np.any(moving, axis=0)
        pattern = moving | ((mass != 0.0) & np.outer(free, free))
        parts = []
        for sets in _coupled(pattern.tobytes(), len(mass)):
            rows, columns = sets[:, :, None], sets[:, None]
            parts.append((sets, add_mass(compliance[:, rows, columns], mass[rows, columns],
                                         omega)))
        return cls(len(mass), tuple(parts))

    def between(self, pairs: FloatArray) -> ComplexArray:
        """
        Return the receptance between places on the block.

        Parameters
        ----------
        pairs : (d, d, p) float array
            Products of what a unit motion of two degrees of freedom does there.

        Returns
        -------
        (n, p) complex array

        """
        found = [values.reshape(len(values), -1)
                 @ pairs[sets[:, :, None], sets[:, None]].reshape(-1, pairs.shape[2])
                 for sets, values in self.parts]
        return np.asarray(sum(found, np.zeros((1, pairs.shape[2]), dtype=complex)))

    def motion(self, loads: ComplexArray) -> ComplexArray:
        """Return the motion under loads (n or 1, d, k) on the degrees of freedom, (n, d, k)."""
        length = max([len(loads), *(len(values) for _, values in self.parts)])
        total = np.zeros((length, *loads.shape[1:]), dtype=complex)
        for sets, values in self.parts:
            total[:, sets] = values @ loads[:, sets]
        return total


@lru_cache
def _coupled(flags: bytes, size: int) -> tuple[IntArray, ...]:
    """Return sets of coupled degrees of freedom, one array (g, s) for each size of a set."""
    pattern = np.frombuffer(flags, dtype=bool).reshape(size, size)
    _, labels = connected_components(pattern, directed=False)
    members: dict[int, list[int]] = {}
    for dof in np.flatnonzero((pattern | pattern.T).any(axis=0)).tolist():
        members.setdefault(int(labels[dof]), []).append(dof)
    sizes: dict[int, list[list[int]]] = {}
    for found in members.values():
        sizes.setdefault(len(found), []).append(found)
    return tuple(np.array(found) for found in sizes.values())


def add_mass(compliance: ComplexArray, mass: FloatArray, omega: FloatArray) -> ComplexArray:
    """
    Return the receptance of a compliant body that carries a mass.

    Parameters
    ----------
    compliance : (n, ..., d, d) complex array
        Displacement per force without the mass [m/N]; zero where it cannot move.
    mass : (..., d, d) float array
        Mass matrix [kg].
    omega : (n,) float array
        Excitation frequency [rad/s].

    Returns
    -------
    (n, ..., d, d) complex array
        (I - omega^2 N M)^-1 N [m/N].

    Raises
    ------
    NotSolvedError
        If an undamped resonance is hit.

    References
    ----------
    Seed paper, eqs. (7) and (8), corrected: the inertia is added to the dynamic stiffness.

    """
    # Not (N^-1 - w^2 M)^-1: a rigid base has N = 0 and no inverse.
    inertia = carrying(compliance, mass, omega)
    with np.errstate(divide='ignore', invalid='ignore'):
        found = _SOLVERS.get(compliance.shape[-1], _eliminated)(inertia, compliance)
    if not np.all(np.isfinite(found)):
        raise NotSolvedError('the coupled system has no finite solution: a mass on its support '
                             'resonates without damping, or nothing holds it')
    return found


def _divided(matrix: ComplexArray, right: ComplexArray) -> ComplexArray:
    return np.asarray(right / matrix)


def _by_cramer(matrix: ComplexArray, right: ComplexArray) -> ComplexArray:
    # For two unknowns the rule is as exact as elimination (Higham, Accuracy and Stability of
    # Numerical Algorithms, 2nd ed., sec. 1.10.1), and without a call for each frequency.
    (a, b), (c, d) = np.moveaxis(matrix, (-2, -1), (0, 1))
    adjugate = np.stack([np.stack([d, -b], axis=-1), np.stack([-c, a], axis=-1)], axis=-2)
    return np.asarray((adjugate @ right) / (a * d - b * c)[..., None, None])


def _eliminated(matrix: ComplexArray, right: ComplexArray) -> ComplexArray:
    try:
        return np.linalg.solve(matrix, right)
    except np.linalg.LinAlgError:
        return np.full_like(right, np.nan)


# By the number of unknowns: for few of them a call for each frequency costs more than the sum.
_SOLVERS = {1: _divided, 2: _by_cramer}


def carrying(compliance: ComplexArray, mass: FloatArray, omega: FloatArray) -> ComplexArray:
    """Return I - omega^2 N M, (n, ..., d, d): what a mass makes of a compliance's motion [-]."""
    square = (omega**2).reshape(-1, *[1] * (compliance.ndim - 1))
    return np.eye(compliance.shape[-1]) - square * (compliance @ mass)
