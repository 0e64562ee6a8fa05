"""How rotor, bearings, pedestals and blocks answer a force together."""

from dataclasses import dataclass

import numpy as np

from rotorsoil_ros.arrays import ComplexArray, FloatArray
from rotorsoil_ros.errors import NotSolvedError
from rotorsoil_ros.machine.support import Standing
from rotorsoil_ros.rotor.whirl import PortReceptance


@dataclass(frozen=True, slots=True)
class Answer:
    """
    Motion and forces under unit columns of loads, each (n, ..., k).

    Attributes
    ----------
    ports : (n, 2 p, k) complex array
        Motion of the rotor's ports [m].
    housings : (n, 2 b, k) complex array
        Motion of the bearing housings [m].
    blocks : (n, 6 f, k) complex array
        Motion of the blocks [m, rad].
    through : (n, 2 b, k) complex array
        Force through the bearings [N].
    into_soil : (n, 6 f, k) complex array
        Force of the blocks on the soil [N, N m].
    ground : (n, 3 p, k) complex array
        Motion of points on the ground [m].

    """

    ports: ComplexArray
    housings: ComplexArray
    blocks: ComplexArray
    through: ComplexArray
    into_soil: ComplexArray
    ground: ComplexArray


def answer(
    rotor: PortReceptance, standing: Standing, loads: ComplexArray, *,
    bearings: ComplexArray, springs: FloatArray,
) -> Answer:
    """
    Solve for the motion of everything.

    Parameters
    ----------
    rotor : PortReceptance
        The rotor on isotropic springs in place of its bearings, which are its first ports.
    standing : Standing
        What the bearings stand on, at the same frequencies.
    loads : (2 p + 2 b + 6 f, k) complex array
        Columns of forces over (x, z) of the ports, over (x, z) of the housings and over the
        axes of the blocks [N, N m], the same at every frequency.
    bearings : (n, 2 b, 2 b) complex array
        Dynamic stiffness of the bearings over (x, z) of each [N/m].
    springs : (2 b,) float array
        Those isotropic springs [N/m].

    Raises
    ------
    NotSolvedError
        If the system is singular: an undamped resonance is hit.

    """
    count, reach = len(springs), rotor.shapes.shape[1]
    journals, loads, below = slice(0, count), loads[:reach], loads[reach:]
    housings, (moved, pushed) = standing.receptance, standing.pushed(below)
    # Through the bearings f = Z (x_journal - H f - u); what the springs in the rotor's modes have
    # not yet taken, g = f - k0 x_journal, obeys  A g = (Z - A k0) x_journal - Z u.
    a = np.eye(count) + bearings @ housings
    w = bearings - a * springs
    free = rotor.motion(loads)
    near = rotor.shapes[:, journals]
    adjoint = rotor.shapes.conj().transpose(0, 2, 1)
    size = count + near.shape[2]
    # All that w multiplies at once: what the journals do by g, by the modes and by the loads.
    moves = np.concatenate([rotor.between(count // 2), -near, np.broadcast_to(
        free[:, journals], (len(near), count, free.shape[2]))], axis=2)
    forces = w @ moves
    system = np.zeros((len(standing.omega), size, size), dtype=complex)
    system[:, :count] = forces[..., :size]
    system[:, :count, :count] += a
    system[:, count:, :count] = adjoint[:, :, journals]
    system[:, range(count, size), range(count, size)] = rotor.stiffness
    right = np.concatenate([forces[..., size:] - bearings @ moved, adjoint @ loads], axis=1)
    try:
        solution = np.linalg.solve(system, right)
    except np.linalg.LinAlgError as error:
        raise NotSolvedError('the coupled system is singular: a resonance without damping is '
                             'hit') from error
    beyond, amplitude = solution[:, :count], solution[:, count:]
    ports = free - rotor.motion(beyond) + rotor.shapes @ amplitude
    through = beyond + springs[:, None] * ports[:, journals]
    motion = housings @ through + moved
    blocks, into_soil = standing.blocks(through, motion, below, pushed)
    ground = standing.support.points(standing.omega) @ into_soil
    return Answer(ports, motion, blocks, through, into_soil, ground)
