"""What each bearing carries at rest: the weight of the rotor on two supports and more."""

import math

import numpy as np

from rotorsoil_ros.arrays import FloatArray
from rotorsoil_ros.rotor.assembly import Rotor
from rotorsoil_ros.rotor.bearing import Bearing
from rotorsoil_ros.rotor.coefficients import values
from rotorsoil_ros.units import GRAVITY


def static_loads(
    rotor: Rotor, *, compliance: FloatArray, alignment: FloatArray,
) -> FloatArray:
    """
    Return the weight that every bearing carries.

    Parameters
    ----------
    rotor : Rotor
        Shaft, discs and the places of the bearings; what holds them is not looked at.
    compliance : (b, b) float array
        How far the journals sink per force on the supports [m/N]: zero is rigid. What is
        infinite on the diagonal carries nothing.
    alignment : (b,) float array
        Height of each bearing above a straight line [m].

    Returns
    -------
    (b,) float array
        Positive where the support pushes the journal up [N].

    Notes
    -----
    Shaft, reactions r and supports A together:  K u - B r = f,  B^T u + A r = alignment, with
    the weight f = -g M (1, 0, 1, 0, ...). No stiffness is inverted, so that a support may be
    rigid. Two supports need no stiffness at all: what comes out is the lever rule.

    """
    stiffness, mass, _ = rotor.plane_matrices
    size = len(stiffness)
    rows = [2 * rotor.node_of(bearing.position) for bearing in rotor.bearings]
    carrying = np.flatnonzero(np.diagonal(compliance) < math.inf)
    lift = np.zeros(size)
    lift[::2] = 1.0
    # Stiffness and compliance differ by twenty orders: each side in its own unit.
    unit = float(stiffness.diagonal()[::2].max())
    system = np.zeros((size + len(carrying),) * 2)
    system[:size, :size] = stiffness / unit
    for column, support in enumerate(carrying.tolist()):
        system[rows[support], size + column] = -1.0
        system[size + column, rows[support]] = 1.0
    system[size:, size:] = unit * compliance[np.ix_(carrying, carrying)]
    right = np.concatenate([-GRAVITY * (mass @ lift) / unit, alignment[carrying]])
    found = np.zeros(len(rows))
    found[carrying] = unit * np.linalg.solve(system, right)[size:]
    return found


def sinking(bearing: Bearing, *, on_film: bool) -> float:
    """
    Return how far a support sinks under a weight [m/N]; infinite where it carries none.

    A film is as good as rigid. Dampers, and seals that only push across, carry nothing.
    """
    below = 0.0 if bearing.pedestal is None else float(
        np.linalg.solve(bearing.pedestal.stiffness, np.array([0.0, 1.0]))[1])
    if on_film:
        return below
    upright = float(values(bearing.stiffness).reshape(-1, 2, 2)[0, 1, 1])
    return below + 1.0 / upright if upright > 0.0 else math.inf
