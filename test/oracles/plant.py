"""All rotors of a plant and its blocks, assembled in full: the oracle of several machines."""

from itertools import pairwise

import numpy as np

from oracles.dense import rotor_matrices


def dense_plant(blocks, compliance, machines, *, omega, source, load, ground=(0.0, 0.0, 0.0)):
    """
    Return the motion of rotors, housings and blocks at one frequency.

    Parameters
    ----------
    blocks : sequence of Foundation
        What bearings stand on, by name.
    compliance : (6 f, 6 f) array
        Of the ground below them [m/N].
    machines : sequence of (Rotor, (x, y, heading), speed)
        All that turn; bearings may have pedestals.
    omega, source : float, int
        Frequency [rad/s], and which machine the load acts on.
    load : (4 k,) array
        Over (x, z, rx, rz) of the nodes of that machine.
    ground : three floats
        Motion of the ground along x, y, z.

    Returns
    -------
    rotors : list of (4 k,) arrays, housings : list of (2 b,) arrays, blocks : (6 f,) array

    """
    sizes = [4 * len(rotor.node_positions) for rotor, _, _ in machines]
    seats = [2 * len(rotor.bearings) for rotor, _, _ in machines]
    # Unknowns: rotors, housings, forces on the blocks' seats, motion of the blocks.
    first = np.cumsum([0, *sizes, *seats, *seats]).tolist()
    count = len(machines)
    at = [slice(a, b) for a, b in pairwise(first)]
    body = slice(first[-1], first[-1] + 6 * len(blocks))
    matrix = np.zeros((body.stop, body.stop), dtype=complex)
    right = np.zeros(body.stop, dtype=complex)
    names = [block.name for block in blocks]
    mass = np.zeros((6 * len(blocks), 6 * len(blocks)))
    for number, block in enumerate(blocks):
        mass[6 * number:6 * number + 6, 6 * number:6 * number + 6] = block.mass_matrix
    matrix[body, body] = np.eye(len(mass)) - omega**2 * compliance @ mass
    right[body] = np.tile([*ground, 0.0, 0.0, 0.0], len(blocks))
    for number, (rotor, (x, y, heading), speed) in enumerate(machines):
        own, housing, seat = at[number], at[count + number], at[2 * count + number]
        stiffness, inertia, gyroscopic = rotor_matrices(rotor)
        matrix[own, own] += stiffness - omega**2 * inertia + 1j * omega * speed * gyroscopic
        turn = np.array([[np.cos(heading), -np.sin(heading), 0.0],
                         [np.sin(heading), np.cos(heading), 0.0], [0.0, 0.0, 1.0]])
        for index, bearing in enumerate(rotor.bearings):
            pair, node = slice(2 * index, 2 * index + 2), 4 * rotor.node_of(bearing.position)
            spring = bearing.dynamic_stiffness(np.array([omega]), np.array([speed]))[0]
            journal = slice(own.start + node, own.start + node + 2)
            base = slice(housing.start + pair.start, housing.start + pair.stop)
            force = slice(seat.start + pair.start, seat.start + pair.stop)
            matrix[journal, journal] += spring
            matrix[journal, base] -= spring
            # The housing: what the bearing exerts goes into the seat or accelerates it.
            matrix[base, journal] -= spring
            matrix[base, base] += spring
            matrix[base, force] += np.eye(2)
            block = blocks[names.index(bearing.foundation)]
            place = (np.array([x, y, rotor.shaft_height]) + turn @ [0.0, bearing.position, 0.0]
                     - [block.centre_x, block.centre_y, 0.0])
            rows = np.zeros((2, len(mass)))
            for axis, along in enumerate((turn[:, 0], turn[:, 2])):
                begin = 6 * names.index(bearing.foundation)
                rows[axis, begin:begin + 6] = [*along, *np.cross(place, along)]
            # The seat: its deflection below the housing is the force over the pedestal.
            gives = np.zeros((2, 2), dtype=complex)
            if bearing.pedestal is not None:
                matrix[base, base] -= omega**2 * bearing.pedestal.mass
                gives = np.linalg.inv(bearing.pedestal.stiffness
                                      + 1j * omega * bearing.pedestal.damping)
            matrix[force, base] += np.eye(2)
            matrix[force, body] -= rows
            matrix[force, force] -= gives
            matrix[body, force] -= compliance @ rows.T
        if number == source:
            right[own] += load
    # Digits: equations of forces beside those of motions.
    scale = np.abs(matrix).max(axis=1)
    solution = np.linalg.solve(matrix / scale[:, None], right / scale)
    return ([solution[part] for part in at[:count]],
            [solution[part] for part in at[count:2 * count]], solution[body])


def plant_matrices(machines, blocks, *, stiffness, damping):
    """
    Return stiffness, damping and mass of several rotors on blocks on springs, assembled in full.

    Parameters
    ----------
    machines, blocks
        As `dense_plant`; what has no pedestal has its housing on the block itself.
    stiffness, damping : (6 f, 6 f) arrays
        Of the ground below the blocks [N/m], [N s/m].

    """
    sizes = [4 * len(rotor.node_positions) for rotor, _, _ in machines]
    pedestals = [2 * sum(one.pedestal is not None for one in rotor.bearings)
                 for rotor, _, _ in machines]
    first = np.cumsum([0, *sizes, *pedestals]).tolist()
    body = slice(first[-1], first[-1] + 6 * len(blocks))
    k, c, m = (np.zeros((body.stop, body.stop)) for _ in range(3))
    k[body, body], c[body, body] = stiffness, damping
    names = [block.name for block in blocks]
    for number, block in enumerate(blocks):
        own = slice(body.start + 6 * number, body.start + 6 * number + 6)
        m[own, own] = block.mass_matrix
    for number, (rotor, (x, y, heading), speed) in enumerate(machines):
        own, pedestal = slice(first[number], first[number + 1]), first[len(machines) + number]
        springs, inertia, gyroscopic = rotor_matrices(rotor)
        k[own, own] += springs
        m[own, own] += inertia
        c[own, own] += speed * gyroscopic
        turn = np.array([[np.cos(heading), -np.sin(heading), 0.0],
                         [np.sin(heading), np.cos(heading), 0.0], [0.0, 0.0, 1.0]])
        for bearing in rotor.bearings:
            block = blocks[names.index(bearing.foundation)]
            place = (np.array([x, y, rotor.shaft_height]) + turn @ [0.0, bearing.position, 0.0]
                     - [block.centre_x, block.centre_y, 0.0])
            seat = np.zeros((2, body.stop))
            begin = body.start + 6 * names.index(bearing.foundation)
            for axis, along in enumerate((turn[:, 0], turn[:, 2])):
                seat[axis, begin:begin + 6] = [*along, *np.cross(place, along)]
            housing = seat
            if bearing.pedestal is not None:
                housing = np.eye(body.stop)[pedestal:pedestal + 2]
                between, pedestal = housing - seat, pedestal + 2
                k += between.T @ bearing.pedestal.stiffness @ between
                c += between.T @ bearing.pedestal.damping @ between
                m += housing.T @ bearing.pedestal.mass @ housing
            node = own.start + 4 * rotor.node_of(bearing.position)
            gap = np.eye(body.stop)[node:node + 2] - housing
            for matrix, force in zip((k, c, m), bearing.coefficients(
                    *2 * (np.array([speed]),)), strict=True):
                matrix += gap.T @ force[0] @ gap
    return k, c, m

