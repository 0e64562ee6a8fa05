"""Pieces of a shaft with their material, and the places whose motion is wanted."""

from dataclasses import dataclass
import math

from rotorsoil_ros.errors import require


@dataclass(frozen=True, slots=True)
class Material:
    """Linear elastic material: E [Pa], nu [-], rho [kg/m^3]."""

    young_modulus: float
    poisson_ratio: float
    density: float

    def __post_init__(self) -> None:
        require(0.0 < self.young_modulus < math.inf, 'young_modulus', '> 0 Pa and finite',
                self.young_modulus)
        require(-1.0 < self.poisson_ratio <= 0.5, 'poisson_ratio', 'in (-1, 0.5]',
                self.poisson_ratio)
        require(0.0 <= self.density < math.inf, 'density', '>= 0 kg/m^3 and finite', self.density)


@dataclass(frozen=True, slots=True)
class ShaftDamping:
    """
    What a piece of shaft loses: in its material, which turns with it, and to what stands still.

    Attributes
    ----------
    viscous : float
        Of the material, stress per rate of strain over stress per strain [s].
    loss_factor : float
        Of the material, hysteretic, the same at every frequency [-].
    fixed_mass, fixed_stiffness : float
        What does not turn, proportional to mass [1/s] and to stiffness [s].

    """

    viscous: float = 0.0
    loss_factor: float = 0.0
    fixed_mass: float = 0.0
    fixed_stiffness: float = 0.0

    def __post_init__(self) -> None:
        for name, unit in (('viscous', 's'), ('fixed_mass', '1/s'), ('fixed_stiffness', 's')):
            value = getattr(self, name)
            require(0.0 <= value < math.inf, name, f'>= 0 {unit} and finite', value)
        require(0.0 <= self.loss_factor < 1.0, 'loss_factor', 'in [0, 1)', self.loss_factor)


@dataclass(frozen=True, slots=True)
class ShaftSection:
    """
    Piece of shaft whose diameters vary linearly, divided evenly into elements.

    Attributes
    ----------
    length : float
        [m].
    outer_diameter, inner_diameter : tuple of two floats
        At the left and the right end [m].
    elements : int
        Number of finite elements, at least 1.
    material : Material
        What it is made of.
    added_mass : float
        Mass per length that does not stiffen [kg/m].
    axial_force : float
        That pulls it; a negative one presses [N].
    torque : float
        That what lies to the right exerts on it, about the spin [N m].
    damping : ShaftDamping
        What it loses.

    """

    length: float
    outer_diameter: tuple[float, float]
    inner_diameter: tuple[float, float]
    elements: int
    material: Material
    added_mass: float = 0.0
    axial_force: float = 0.0
    torque: float = 0.0
    damping: ShaftDamping = ShaftDamping()

    def __post_init__(self) -> None:
        require(0.0 < self.length < math.inf, 'length', '> 0 m and finite', self.length)
        require(self.elements >= 1, 'elements', 'at least 1', self.elements)
        require(0.0 <= self.added_mass < math.inf, 'added_mass', '>= 0 kg/m and finite',
                self.added_mass)
        require(math.isfinite(self.axial_force), 'axial_force', 'finite, in N', self.axial_force)
        require(math.isfinite(self.torque), 'torque', 'finite, in N m', self.torque)
        for outer, inner in zip(self.outer_diameter, self.inner_diameter, strict=True):
            require(0.0 < outer < math.inf, 'outer_diameter', '> 0 m and finite', outer)
            require(0.0 <= inner < outer, 'inner_diameter',
                    f'>= 0 m and less than the outer diameter {outer:g} m', inner)


@dataclass(frozen=True, slots=True)
class Probe:
    """Station of the shaft whose motion is wanted: position along the shaft [m]."""

    name: str
    position: float
