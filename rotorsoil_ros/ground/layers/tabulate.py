"""What a disc on layers, or a cylinder in them, gives way by: solved, and as a table."""

from dataclasses import dataclass
import math

import numpy as np

from rotorsoil_ros.arrays import ComplexArray, FloatArray
from rotorsoil_ros.ground.layers.cutoffs import singular_frequencies
from rotorsoil_ros.ground.layers.cylinder import HEAVE, RigidCylinder, SWAY, TWIST
from rotorsoil_ros.ground.layers.joining import joined_pieces, SolveMany
from rotorsoil_ros.ground.layers.line import LineMesh, VerticalLine
from rotorsoil_ros.ground.layers.profile import Embedment, LayeredSoil
from rotorsoil_ros.ground.layers.table import entry_scale, LayeredTable

# Round-off of a solve: a fit that follows it more closely has poles where there are none.
_NOISE = 3e-6


@dataclass(frozen=True, slots=True)
class Radii:
    """Radii of the discs that stand for a contact: sliding, heave, rx, ry, rz."""

    sliding: float
    heaving: float
    pitching: float
    rocking: float
    turning: float


def exact_compliance(
    ground: LayeredSoil, embedment: Embedment, radii: Radii, a0: FloatArray, *,
    mesh: LineMesh | None = None, span: tuple[float, float] | None = None,
) -> ComplexArray:
    """
    Return compliances by one solve per frequency, in the units of the ground.

    Parameters
    ----------
    ground, embedment, radii
        What stands where.
    a0 : (n,) float array
        Frequencies, each > 0.
    mesh : LineMesh, optional
        In place of the usual one.
    span : tuple of two floats, optional
        Frequencies for which the line is cut; those asked for if there is none.

    Returns
    -------
    (n, 7) complex array
        As `LayeredTable.compliance`.

    """
    span = span or (float(a0.min()), float(a0.max()))
    cylinder = _cylinder(ground, embedment, radii, span, mesh or LineMesh.beside(embedment))
    return np.array([_compliance(cylinder, radii, omega) for omega in a0.tolist()])


def _cylinder(
    ground: LayeredSoil, embedment: Embedment, radii: Radii, span: tuple[float, float],
    mesh: LineMesh,
) -> RigidCylinder:
    smallest = min(radii.sliding, radii.heaving, radii.pitching, radii.rocking, radii.turning)
    return RigidCylinder(VerticalLine.through(
        ground, embedment, radius=smallest, lowest=span[0], highest=span[1], mesh=mesh))


def _compliance(cylinder: RigidCylinder, radii: Radii, omega: float) -> ComplexArray:
    """Return one row over `ENTRIES`; couplings are those of the mean of two radii."""
    at = cylinder.at(omega)
    swaying: dict[float, ComplexArray] = {}

    def sway(radius: float) -> ComplexArray:
        if radius not in swaying:
            swaying[radius] = np.linalg.inv(at.stiffness(SWAY, radius))
        return swaying[radius]

    heave = 1.0 / at.stiffness(HEAVE, radii.heaving)[0, 0]
    twist = 1.0 / at.stiffness(TWIST, radii.turning)[0, 0]
    # A rotation about x tilts towards -y where one about y tilts towards +x.
    return np.array([
        sway(radii.sliding)[0, 0], heave, sway(radii.pitching)[1, 1],
        sway(radii.rocking)[1, 1], twist,
        sway(math.sqrt(radii.sliding * radii.rocking))[0, 1],
        -sway(math.sqrt(radii.sliding * radii.pitching))[0, 1]])


def tabulate(
    ground: LayeredSoil, embedment: Embedment, radii: Radii, *, a0_max: float,
    tolerance: float = 1e-4,
) -> LayeredTable:
    """
    Return the compliance of a contact on layered ground from rest to a frequency.

    Parameters
    ----------
    ground, embedment, radii
        In units in which the soil below the base has G = rho = 1.
    a0_max : float
        Highest frequency.
    tolerance : float
        Largest error at frequencies that a piece has not seen.

    Raises
    ------
    NotSolvedError
        If the tolerance is not met.

    """
    def solver(span: tuple[float, float]) -> tuple[SolveMany, int]:
        cylinder = _cylinder(ground, embedment, radii, span, LineMesh.beside(embedment))
        return (lambda omega: np.array([_compliance(cylinder, radii, one)
                                        for one in omega.tolist()]), len(cylinder.line.depth))

    return joined_pieces(solver, singular_frequencies(ground, a0_max), a0_max,
                         scale=entry_scale, tolerance=tolerance, noise=_NOISE)
