"""How rotor, bearings, pedestals and blocks answer a force together."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rotorsoil_ros.arrays import ComplexArray, FloatArray
from rotorsoil_ros.errors import NotSolvedError
from rotorsoil_ros.machine.standing import Standing
from rotorsoil_ros.rotor.assembly import Rotor
from rotorsoil_ros.rotor.whirl import PortReceptance


@dataclass(frozen=True, slots=True)
class Answer:
    """
    Motion and forces under unit columns of loads, each (n, ..., k).

    Attributes
    ----------
    ports : tuple of (n, 2 p, k) complex arrays
        Motion of the ports of every rotor [m].
    housings : (n, 2 b, k) complex array
        Motion of the bearing housings [m].
    blocks : (n, l, k) complex array
        Motion of the foundations' places [m, rad].
    through : (n, 2 b, k) complex array
        Force through the bearings [N].
    into_soil : (n, g, k) complex array
        Force on the ground of the places that stand on it [N, N m].
    ground : (n, 3 p, k) complex array
        Motion of points on the ground [m].

    """

    ports: tuple[ComplexArray, ...]
    housings: ComplexArray
    blocks: ComplexArray
    through: ComplexArray
    into_soil: ComplexArray
    ground: ComplexArray

    def by_channel(self, rotors: Sequence[Rotor]) -> tuple[ComplexArray, ComplexArray]:
        """Return motion of and force through the channels of rotors, blocks and ground."""
        length, _, columns = self.blocks.shape

        def interleave(journal: ComplexArray, housing: ComplexArray) -> ComplexArray:
            pairs = (length, journal.shape[1] // 2, 2, columns)
            both = np.stack([journal.reshape(pairs), housing.reshape(pairs)], axis=2)
            return both.reshape(length, 2 * journal.shape[1], columns)

        displacement, force, first = [], [], 0
        for rotor, ports in zip(rotors, self.ports, strict=True):
            seats, own = 2 * len(rotor.bearings), slice(first, first + 2 * len(rotor.bearings))
            moved = np.concatenate([interleave(ports[:, :seats], self.housings[:, own]),
                                    ports[:, seats:2 * len(rotor.stations)]], axis=1)
            displacement.append(moved if rotor.view is None else rotor.view @ moved)
            force.append(interleave(self.through[:, own], self.through[:, own]))
            first = own.stop
        return (np.concatenate([*displacement, self.blocks, self.ground], axis=1),
                np.concatenate([*force, self.into_soil], axis=1))


def answer(
    rotor: PortReceptance, standing: Standing, loads: ComplexArray, *, ground: FloatArray,
    bearings: ComplexArray, springs: FloatArray,
) -> Answer:
    """
    Solve for the motion of everything.

    Parameters
    ----------
    rotor, bearings, springs
        As `driven`.
    standing : Standing
        What the bearings stand on, at the same frequencies.
    loads : (2 p + 2 b + l, k) complex array
        Columns of forces over (x, z) of the ports, over (x, z) of the housings and over the
        places of the foundations [N, N m], the same at every frequency.
    ground : (3, k) float array
        Motion of the ground in the same columns [m].

    """
    reach = rotor.shapes.shape[1]
    below = loads[reach:]
    moved, pushed = standing.pushed(below, ground)
    ports, through = driven(rotor, standing.receptance, moved, loads[:reach],
                            bearings=bearings, springs=springs)
    motion = standing.receptance @ through + moved
    return gathered(standing, (ports,), motion, through, below, pushed, ground)


def gathered(
    standing: Standing, ports: tuple[ComplexArray, ...], housings: ComplexArray,
    through: ComplexArray, below: ComplexArray, pushed: ComplexArray, ground: FloatArray,
) -> Answer:
    """Add what blocks and ground do under known forces through all bearings."""
    blocks, into_soil = standing.blocks(through, housings, below, pushed)
    points = standing.support.points(standing.omega) @ into_soil
    points += np.tile(ground, (points.shape[1] // 3, 1))
    return Answer(ports, housings, blocks, through, into_soil, points)


def driven(
    rotor: PortReceptance, housings: ComplexArray, moved: ComplexArray, loads: ComplexArray, *,
    bearings: ComplexArray, springs: FloatArray,
) -> tuple[ComplexArray, ComplexArray]:
    """
    Solve for a rotor in its bearings.

    Parameters
    ----------
    rotor : PortReceptance
        The rotor on isotropic springs in place of its bearings, which are its first ports.
    housings : (n, 2 b, 2 b) complex array
        Motion of the housings per force on them [m/N]; zero where they are led.
    moved : (n or 1, 2 b, k) complex array
        Motion of the housings while the bearings exert nothing [m].
    loads : (2 p, k) complex array
        Columns of forces over (x, z) of the ports [N].
    bearings : (n, 2 b, 2 b) complex array
        Dynamic stiffness of the bearings over (x, z) of each [N/m].
    springs : (2 b,) float array
        Those isotropic springs [N/m].

    Returns
    -------
    ports (n, 2 p, k), through (n, 2 b, k) : complex arrays
        Motion of the ports [m], force of the bearings on their housings [N].

    Raises
    ------
    NotSolvedError
        If the system is singular: an undamped resonance is hit.

    """
    count, journals = len(springs), slice(0, len(springs))
    # Through the bearings f = Z (x_journal - H f - u); what the springs in the rotor's modes have
    # not yet taken, g = f - k0 x_journal, obeys  A g = (Z - A k0) x_journal - Z u.
    a = np.eye(count) + bearings @ housings
    w = bearings - a * springs
    free = rotor.motion(loads)
    near = rotor.shapes[:, journals]
    size = count + near.shape[2]
    # All that w multiplies at once: what the journals do by g, by the modes and by the loads.
    moves = np.concatenate([rotor.between(count // 2), -near, np.broadcast_to(
        free[:, journals], (len(near), count, free.shape[2]))], axis=2)
    forces = w @ moves
    system = np.zeros((len(near), size, size), dtype=complex)
    system[:, :count] = forces[..., :size]
    system[:, :count, :count] += a
    system[:, count:, :count] = rotor.driven[:, :, journals]
    system[:, range(count, size), range(count, size)] = rotor.stiffness
    right = np.concatenate([forces[..., size:] - bearings @ moved, rotor.driven @ loads], axis=1)
    try:
        solution = np.linalg.solve(system, right)
    except np.linalg.LinAlgError as error:
        raise NotSolvedError('the coupled system is singular: a resonance without damping is '
                             'hit') from error
    beyond, amplitude = solution[:, :count], solution[:, count:]
    ports = free - rotor.motion(beyond) + rotor.shapes @ amplitude
    return ports, beyond + springs[:, None] * ports[:, journals]
