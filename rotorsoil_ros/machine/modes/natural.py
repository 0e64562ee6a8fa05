"""At which frequencies the support of a machine vibrates on its own, the rotor riding on it."""

import math

import numpy as np
import scipy.linalg

from rotorsoil_ros.arrays import ComplexArray, FloatArray
from rotorsoil_ros.channel import ACROSS
from rotorsoil_ros.ground.continuation import Continuation
from rotorsoil_ros.machine.continued import continued_by_pieces
from rotorsoil_ros.machine.coupled import CoupledModel
from rotorsoil_ros.machine.modes.below import sizes, SupportModes
from rotorsoil_ros.machine.modes.eigen import vibrates
from rotorsoil_ros.machine.support import Support
from rotorsoil_ros.rotor.assembly import Rotor

# A mode belongs to a direction if this share of the housings' motion is in it.
_IN_DIRECTION = 0.1
_STILL = 1e-9


def lowest_natural_frequency(model: CoupledModel, *, axis: str, highest: float) -> float:
    """
    Return the lowest frequency of machine and support in a direction, the rotor being rigid.

    Parameters
    ----------
    model : CoupledModel
        The machine.
    axis : str
        `x` or `z`, in which the housings move.
    highest : float
        Up to which to look, as far as the soil is known [rad/s].

    Returns
    -------
    float
        [rad/s]; infinite where there is none, as on a rigid support.

    References
    ----------
    ISO 20816-1: the class of a support goes by the lowest natural frequency of the combined
    machine and support in the direction of measurement; shaft bending is none of it.

    """
    riding = scipy.linalg.block_diag(*map(riding_mass, model.rotors))
    frequency, motion = natural_frequencies(model.support, riding, highest)
    own = motion[:, model.own_seats]
    power = np.abs(own).reshape(len(own), len(model.rotor.bearings), 2) ** 2
    total = power.sum(axis=(1, 2))
    # A block that slides along the shaft moves no housing across it, but for round-off.
    moves = ((power[..., ACROSS.index(axis)].sum(axis=1) >= _IN_DIRECTION * total)
             & (total > _STILL * total.max(initial=0.0)))
    return float(frequency[moves].min(initial=math.inf))


def riding_mass(rotor: Rotor) -> FloatArray:
    """Return the mass of a rotor as a rigid body on its housings, (2 b, 2 b) [kg]."""
    _, mass, _ = rotor.plane_matrices
    places = rotor.node_positions
    rigid = np.stack([np.column_stack([np.ones_like(places), np.zeros_like(places)]).ravel(),
                      np.column_stack([places, np.ones_like(places)]).ravel()], axis=1)
    seats = np.array([[1.0, bearing.position] for bearing in rotor.bearings])
    # Of three bearings and more the line that fits best.
    follows = np.linalg.pinv(seats)
    plane = follows.T @ (rigid.T @ mass @ rigid) @ follows
    return np.kron(plane, np.eye(2))


def natural_frequencies(
    support: Support, carried: FloatArray, highest: float,
) -> tuple[FloatArray, ComplexArray]:
    """
    Return how the support vibrates under bodies that are rigid themselves.

    Parameters
    ----------
    support : Support
        What stands on the ground.
    carried : (2 b, 2 b) float array
        Mass over (x, z) of the housings [kg].
    highest : float
        Frequency up to which to look, as far as the soil is known [rad/s].

    Returns
    -------
    frequency : (m,) float array
        |lambda| of what vibrates, rising [rad/s].
    motion : (m, 2 b) complex array
        Of the housings.

    """
    if not len(support.motion_mass):
        return np.zeros(0), np.zeros((0, len(carried)), dtype=complex)
    span = support.known(highest)
    pieces = continued_by_pieces(support, span)
    found = [_vibrations(support, piece, carried, span, piece.span if len(pieces) > 1 else span)
             for piece in pieces]
    frequency, motion = (np.concatenate(parts) for parts in zip(*found, strict=True))
    order = np.argsort(frequency)
    return frequency[order], motion[order]


def _vibrations(
    support: Support, compliance: Continuation, carried: FloatArray, span: tuple[float, float],
    within: tuple[float, float],
) -> tuple[FloatArray, ComplexArray]:
    """Return what vibrates between two frequencies, as `natural_frequencies`."""
    rows = support.motion_rows * sizes(support, compliance)
    modes = SupportModes.of(support, compliance, span[1], rows=rows, carried=carried)
    frequency = modes.frequency
    chosen = np.flatnonzero(vibrates(frequency) & (np.abs(frequency) <= span[1])
                            & (frequency.real >= within[0]) & (frequency.real <= within[1]))
    chosen = chosen[compliance.persists(frequency[chosen])]
    return np.abs(frequency[chosen]), (rows @ modes.shape[:, chosen]).T
