"""Boxes of rods, as finite elements of bodies that bend and stand on one another."""

from itertools import combinations

import numpy as np
import scipy.sparse

from rotorsoil_ros.channel import DOFS
from rotorsoil_ros.machine.flexible.body import CONTACT, Dof, PROBE, SEAT
from rotorsoil_ros.machine.flexible.reduction import FiniteElements

CORNERS = [(x, y) for x in (-1.0, 1.0) for y in (-0.7, 0.7)]


def truss(name, height, spring):
    """
    Return nodes and matrices of a box of rods between all its corners, with a node inside.

    Rods know no place to turn about: rigid motion stretches none of them.
    """
    nodes = np.array([*((x, y, z) for z in (0.0, height) for x, y in CORNERS),
                      (0.1, 0.05, 0.4 * height)])
    count = len(nodes)
    stiffness, mass = np.zeros((3 * count,) * 2), np.zeros(3 * count)
    for one, other in combinations(range(count), 2):
        way = (nodes[other] - nodes[one]) / np.linalg.norm(nodes[other] - nodes[one])
        own = [*range(3 * one, 3 * one + 3), *range(3 * other, 3 * other + 3)]
        pull = np.concatenate([-way, way])
        stiffness[np.ix_(own, own)] += spring * (1.0 + 0.1 * one) * np.outer(pull, pull)
    mass[:] = np.repeat(300.0 + 40.0 * np.arange(count), 3)
    return nodes, stiffness, np.diag(mass)


def mean(nodes, own):
    """Return the motion of a place that some nodes carry, (6, 3 n), and where it is."""
    middle = nodes[own].mean(axis=0)
    rows = np.concatenate([[Dof('', axis, PROBE, tuple(nodes[node] - middle)).rigid_row
                            for axis in DOFS[:3]] for node in own])
    found = np.zeros((6, 3 * len(nodes)))
    found[:, [3 * node + axis for node in own for axis in range(3)]] = np.linalg.pinv(rows)
    return found, tuple(middle)


def box(name, *, height, spring, asked):
    """Return finite elements of a box, its places as asked: station, kind, nodes, axes."""
    nodes, stiffness, mass = truss(name, height, spring)
    dofs, picks = [], []
    for station, kind, own, axes in asked:
        rows, place = mean(nodes, own) if len(own) > 1 else (
            np.eye(3 * len(nodes))[3 * own[0]:3 * own[0] + 3], tuple(nodes[own[0]]))
        for axis in axes:
            dofs.append(Dof(station, axis, kind, place, 1.0 if kind == CONTACT else 0.0))
            picks.append(rows[DOFS.index(axis)])
    known = {3 * node + axis: Dof('', DOFS[axis], PROBE, tuple(nodes[node]))
             for node in range(len(nodes)) for axis in range(3)}
    return FiniteElements.of(
        scipy.sparse.csc_matrix(stiffness), scipy.sparse.csc_matrix(mass), dofs,
        scipy.sparse.csc_matrix(np.array(picks)), known)


XYZ = DOFS[:3]
RAFT = [*((f'patch_{one}', CONTACT, [one], XYZ) for one in range(4)),
        ('pad', PROBE, [4, 5, 6, 7], DOFS), *((f'top_{one}', PROBE, [4 + one], XYZ)
                                              for one in range(4))]
FRAME = [('b1', SEAT, [4, 6], ('x', 'z')), ('b2', SEAT, [5, 7], ('x', 'z'))]
ON_ONE = [*FRAME, ('base', CONTACT, [0, 1, 2, 3], DOFS)]
ON_FOUR = [*FRAME, *((f'leg_{one}', CONTACT, [one], XYZ) for one in range(4))]


def elements(name, asked):
    """Return the raft below, or the frame on it."""
    return box(name, asked=asked, **{'raft': {'height': 0.8, 'spring': 4e8},
                                     'frame': {'height': 1.6, 'spring': 1.5e8}}[name])
