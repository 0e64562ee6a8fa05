"""
Which motions of the contact separate by symmetry, and what strain each of them needs.

Depth z points down into the soil here; a positive rotation about y lowers the edge at +x.
"""

from dataclasses import dataclass, replace
import math

import numpy as np

from rotorsoil_ros.arrays import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class SymmetryClass:
    """
    One separate problem: some displacement components under one or two rigid motions.

    Attributes
    ----------
    strain : (g, e, c) float array
        Strains e of the components c through g = d/dx, d/dz and, for the disc, 1/r.
    elasticity : (e, e) float array
        Stress per strain, in units of G.
    mass : (c, c) float array
        Kinetic energy of the components, in units of rho.
    fixed_on_axis : tuple of int
        Components that vanish on x = 0.
    motions : (m, c, 2) float array
        Each rigid motion's components on the contact, as constant + slope * x.
    share : float
        What the half model's energy is multiplied by: the circumference's integral of cos^2,
        or 2 for the two halves of a strip.

    """

    strain: FloatArray
    elasticity: FloatArray
    mass: FloatArray
    fixed_on_axis: tuple[int, ...]
    motions: FloatArray
    share: float

    @property
    def components(self) -> int:
        """Number of displacement components."""
        return len(self.mass)

    @property
    def stiffness(self) -> FloatArray:
        """Coefficients (g, g, c, c) of int g_i h_j in the stiffness matrix."""
        stiffness: FloatArray = np.einsum(
            'gec,ef,hfd->ghcd', self.strain, self.elasticity, self.strain)
        return stiffness


def plane_classes(poisson_ratio: float) -> tuple[SymmetryClass, SymmetryClass]:
    """Return sway with rocking, and heave, of a strip in plane strain."""
    strain = np.zeros((2, 3, 2))
    strain[0, 0, 0] = strain[1, 1, 1] = strain[1, 2, 0] = strain[0, 2, 1] = 1.0
    sway = SymmetryClass(
        strain=strain, elasticity=_elasticity(poisson_ratio, normal=2, shear=1), mass=np.eye(2),
        fixed_on_axis=(1,), share=2.0,
        motions=np.array([[[1.0, 0.0], [0.0, 0.0]], [[0.0, 0.0], [0.0, 1.0]]]))
    heave = replace(
        sway, fixed_on_axis=(0,), motions=np.array([[[0.0, 0.0], [1.0, 0.0]]]))
    return sway, heave


def disc_classes(poisson_ratio: float) -> tuple[SymmetryClass, SymmetryClass, SymmetryClass]:
    """Return sway with rocking (harmonic 1), heave and twist (harmonic 0) of a disc."""
    return _disc_sway(poisson_ratio), _disc_heave(poisson_ratio), _disc_twist()


def _elasticity(poisson_ratio: float, *, normal: int, shear: int) -> FloatArray:
    """Return Hooke's law for G = 1, normal strains first."""
    elasticity = np.diag([2.0] * normal + [1.0] * shear)
    elasticity[:normal, :normal] += 2.0 * poisson_ratio / (1.0 - 2.0 * poisson_ratio)
    return elasticity


def _disc_heave(poisson_ratio: float) -> SymmetryClass:
    # Components u_r, u_z; strains rr, tt, zz, rz.
    strain = np.zeros((3, 4, 2))
    strain[0, 0, 0] = strain[2, 1, 0] = strain[1, 2, 1] = 1.0
    strain[1, 3, 0] = strain[0, 3, 1] = 1.0
    return SymmetryClass(
        strain=strain, elasticity=_elasticity(poisson_ratio, normal=3, shear=1), mass=np.eye(2),
        fixed_on_axis=(0,), motions=np.array([[[0.0, 0.0], [1.0, 0.0]]]), share=2.0 * math.pi)


def _disc_twist() -> SymmetryClass:
    # Component u_t; strains rt = du/dr - u/r and zt.
    strain = np.zeros((3, 2, 1))
    strain[0, 0, 0] = strain[1, 1, 0] = 1.0
    strain[2, 0, 0] = -1.0
    return SymmetryClass(
        strain=strain, elasticity=np.eye(2), mass=np.eye(1), fixed_on_axis=(0,),
        motions=np.array([[[0.0, 1.0]]]), share=2.0 * math.pi)


def _disc_sway(poisson_ratio: float) -> SymmetryClass:
    """
    Return harmonic 1 of the disc.

    Notes
    -----
    u_r = (a + b) cos t, u_t = (b - a) sin t, u_z = w cos t with the components a, w, b: on the
    axis w = b = 0 and nothing of a is divided by r, so no singular term is left. A horizontal
    motion of the contact is a = 1.

    """
    strain = np.zeros((3, 6, 3))
    a, w, b = 0, 1, 2
    rr, tt, zz, rz, rt, zt = range(6)
    strain[0, rr, a] = strain[0, rr, b] = 1.0
    strain[2, tt, b] = 2.0
    strain[1, zz, w] = 1.0
    strain[1, rz, a] = strain[1, rz, b] = strain[0, rz, w] = 1.0
    strain[0, rt, b], strain[0, rt, a], strain[2, rt, b] = 1.0, -1.0, -2.0
    strain[1, zt, b], strain[1, zt, a], strain[2, zt, w] = 1.0, -1.0, -1.0
    motions = np.zeros((2, 3, 2))
    motions[0, a, 0] = motions[1, w, 1] = 1.0
    return SymmetryClass(
        strain=strain, elasticity=_elasticity(poisson_ratio, normal=3, shear=3),
        mass=np.diag([2.0, 1.0, 2.0]), fixed_on_axis=(w, b), motions=motions, share=math.pi)
