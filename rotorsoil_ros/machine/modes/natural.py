"""At which frequencies the support of a machine vibrates on its own, the rotor riding on it."""

import numpy as np
import scipy.linalg

from rotorsoil_ros.arrays import ComplexArray, FloatArray
from rotorsoil_ros.ground.rational import Continuation
from rotorsoil_ros.machine.support import Support

# Poles of the soil that weigh less are noise of its fit.
_NOISE = 1e-4

# What hardly swings, |Re w| below this share of |w|, has no natural frequency.
_CREEPING = 0.2


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
    pieces = support.continued_by_pieces(span)
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
    size, unit, soil = compliance.size, 0.5 * span[1], compliance.states(_NOISE)
    rows = support.motion_rows * size
    mass = size[:, None] * support.motion_mass * size + rows.T @ carried @ rows
    own, states = len(mass), len(soil.poles)
    # z = constant p + left xi, w xi = poles xi + right p, p = w^2 M z with w z = unit u.
    a = np.zeros((2 * own + states,) * 2, dtype=complex)
    b = np.zeros_like(a)
    motion, rate, state = slice(0, own), slice(own, 2 * own), slice(2 * own, None)
    a[motion, motion], a[motion, state] = np.eye(own), -soil.left
    b[motion, rate] = unit * soil.constant @ mass
    a[rate, rate], b[rate, motion] = unit * np.eye(own), np.eye(own)
    a[state, state] = np.diag(soil.poles)
    b[state, rate], b[state, state] = -unit * soil.right @ mass, np.eye(states)
    frequency, vectors = scipy.linalg.eig(a, b)
    finite = np.isfinite(frequency)
    frequency, vectors = frequency[finite], vectors[:, finite]
    chosen = np.flatnonzero((frequency.real > _CREEPING * np.abs(frequency))
                            & (np.abs(frequency) <= span[1])
                            & (frequency.real >= within[0]) & (frequency.real <= within[1]))
    return np.abs(frequency[chosen]), (rows @ vectors[motion, chosen]).T
