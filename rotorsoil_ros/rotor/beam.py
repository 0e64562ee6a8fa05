"""The matrices that a piece of turning shaft has in one plane."""

from dataclasses import dataclass
import math

import numpy as np

from rotorsoil_ros.arrays import FloatArray

# Five points integrate degree 9: the highest here is 8, the polar inertia of a conical element
# (degree 4) times two rotations (degree 2 each).
_POINTS, _WEIGHTS = np.polynomial.legendre.leggauss(5)


@dataclass(frozen=True, slots=True)
class BeamElements:
    """
    Shaft elements, each array (e,), diameters linear from the left to the right end.

    Attributes
    ----------
    length : (e,) float array
        Element length [m].
    outer_diameter, inner_diameter : (e, 2) float array
        Diameters at the left and the right end [m].
    young_modulus, poisson_ratio, density : (e,) float array
        Material [Pa], [-], [kg/m^3].
    added_mass : (e,) float array
        Mass per length that does not stiffen [kg/m].
    axial_force, torque : (e,) float array
        Tension [N], and what is exerted on the right end about the axis [N m].

    """

    length: FloatArray
    outer_diameter: FloatArray
    inner_diameter: FloatArray
    young_modulus: FloatArray
    poisson_ratio: FloatArray
    density: FloatArray
    added_mass: FloatArray
    axial_force: FloatArray
    torque: FloatArray

    @property
    def shear_modulus(self) -> FloatArray:
        """G = E / (2 (1 + nu)) [Pa]."""
        return self.young_modulus / (2.0 * (1.0 + self.poisson_ratio))


def annulus(outer: FloatArray, inner: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return area [m^2] and diametral second moment of area [m^4] of an annulus."""
    area = math.pi / 4.0 * (outer**2 - inner**2)
    return area, math.pi / 64.0 * (outer**4 - inner**4)


def shear_coefficient(poisson_ratio: FloatArray, diameter_ratio: FloatArray) -> FloatArray:
    """
    Return Timoshenko's shear coefficient of an annulus, inner over outer diameter given.

    References
    ----------
    Cowper (1966), J. Applied Mechanics 33, table 1, hollow circle.

    """
    square = (1.0 + diameter_ratio**2) ** 2
    return 6.0 * (1.0 + poisson_ratio) * square / (
        (7.0 + 6.0 * poisson_ratio) * square
        + (20.0 + 12.0 * poisson_ratio) * diameter_ratio**2)


def _shape_functions(
    place: FloatArray, length: FloatArray, shear: FloatArray,
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """
    Return deflection, rotation, curvature and shear strain of the four element dofs.

    Parameters
    ----------
    place : (g,) float array
        Gauss points, 0 at the left end, 1 at the right.
    length, shear : (e,) float array
        Element length [m] and shear parameter 12 E I / (kappa G A L^2).

    Returns
    -------
    four (e, g, 4) float arrays
        Over the dofs (deflection, slope) left, (deflection, slope) right.

    References
    ----------
    Przemieniecki, Theory of Matrix Structural Analysis (1968), sec. 11.

    """
    s = place[None, :]
    size = length[:, None]
    phi = shear[:, None]
    scale = 1.0 / (1.0 + phi)
    deflection = np.stack([
        scale * (1.0 - 3.0 * s**2 + 2.0 * s**3 + phi * (1.0 - s)),
        scale * size * (s - 2.0 * s**2 + s**3 + 0.5 * phi * (s - s**2)),
        scale * (3.0 * s**2 - 2.0 * s**3 + phi * s),
        scale * size * (-(s**2) + s**3 - 0.5 * phi * (s - s**2)),
    ], axis=-1)
    rotation = np.stack([
        scale * 6.0 / size * (s**2 - s),
        scale * (1.0 - 4.0 * s + 3.0 * s**2 + phi * (1.0 - s)),
        scale * 6.0 / size * (s - s**2),
        scale * (-2.0 * s + 3.0 * s**2 + phi * s),
    ], axis=-1)
    curvature = np.stack([
        scale * 6.0 / size**2 * (2.0 * s - 1.0),
        scale / size * (-4.0 + 6.0 * s - phi),
        scale * 6.0 / size**2 * (1.0 - 2.0 * s),
        scale / size * (-2.0 + 6.0 * s + phi),
    ], axis=-1)
    # Slope of the deflection minus the rotation: constant along the element.
    one = np.ones_like(s)
    strain = np.stack([
        -scale * phi / size * one,
        -0.5 * scale * phi * one,
        scale * phi / size * one,
        -0.5 * scale * phi * one,
    ], axis=-1)
    return deflection, rotation, curvature, strain


@dataclass(frozen=True, slots=True)
class ElementMatrices:
    """
    Matrices of elements in one plane, (e, 4, 4) each, over (deflection, slope) of both nodes.

    Attributes
    ----------
    elastic, mass : (e, 4, 4) float array
        Stiffness without any load [N/m, N, N m], mass with rotary inertia [kg, kg m, kg m^2].
    polar : (e, 4, 4) float array
        Polar inertia of the rotations [kg m^2]: couples the two planes at spin speed.
    tension : (e, 4, 4) float array
        What the axial force adds to the stiffness.
    torsion : (e, 4, 4) float array
        What the torque makes of a motion in one plane in the other one; not symmetric.

    """

    elastic: FloatArray
    mass: FloatArray
    polar: FloatArray
    tension: FloatArray
    torsion: FloatArray


def element_matrices(elements: BeamElements) -> ElementMatrices:
    """
    Return the matrices of Timoshenko elements.

    Parameters
    ----------
    elements : BeamElements
        The shaft's elements.

    Notes
    -----
    Exact for a uniform element at rest; a conical one has the shear parameter of its middle. An
    axial force does work on the slope of the deflection, P w'^2 / 2. The torque is a couple that
    keeps its direction along the axis: on the slope in one plane it bends the other one, in
    which a slender beam is taken, as in Zorzi & Nelson.

    References
    ----------
    Lalanne & Ferraris, Rotordynamics Prediction in Engineering, 2nd ed. (1998), sec. 1.2;
    Przemieniecki (1968), sec. 11 and, for the axial force, sec. 15; Zorzi & Nelson (1980),
    J. Mech. Des. 102, p. 158, for the torque.

    """
    place = 0.5 * (_POINTS + 1.0)
    step = 0.5 * _WEIGHTS[None, :] * elements.length[:, None]
    left, right = 1.0 - place[None, :], place[None, :]
    outer = elements.outer_diameter[:, :1] * left + elements.outer_diameter[:, 1:] * right
    inner = elements.inner_diameter[:, :1] * left + elements.inner_diameter[:, 1:] * right
    area, moment = annulus(outer, inner)
    middle_outer = elements.outer_diameter.mean(axis=1)
    middle_inner = elements.inner_diameter.mean(axis=1)
    middle_area, middle_moment = annulus(middle_outer, middle_inner)
    kappa = shear_coefficient(elements.poisson_ratio, middle_inner / middle_outer)
    shear_stiffness = kappa * elements.shear_modulus
    shear = (12.0 * elements.young_modulus * middle_moment
             / (shear_stiffness * middle_area * elements.length**2))
    deflection, rotation, curvature, strain = _shape_functions(place, elements.length, shear)

    def integral(weight: FloatArray, field: FloatArray) -> FloatArray:
        return np.asarray(np.einsum('eg,egi,egj->eij', step * weight, field, field))

    bending = elements.young_modulus[:, None] * moment
    density = elements.density[:, None]
    stiffness = (integral(bending, curvature)
                 + integral(shear_stiffness[:, None] * area, strain))
    mass = (integral(density * area + elements.added_mass[:, None], deflection)
            + integral(density * moment, rotation))
    _, slope, bend, _ = _shape_functions(place, elements.length, np.zeros_like(shear))
    return ElementMatrices(
        stiffness, mass, integral(2.0 * density * moment, rotation),
        integral(elements.axial_force[:, None], rotation + strain),
        np.einsum('eg,egi,egj->eij', step * elements.torque[:, None], bend, slope))
