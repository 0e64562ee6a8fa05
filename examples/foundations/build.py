"""
Make the files of two foundations that bend: a raft of bricks, and a table-top frame of beams.

`python build.py` writes them beside this file; `raft_house.yaml` and `turbine_deck.yaml` read
them. The raft leaves its modes and what they leave out; the frame its matrices.
"""

import csv
from itertools import pairwise
from pathlib import Path

import numpy as np
import scipy.io
import scipy.sparse
from skfem import Basis, BilinearForm, ElementHex2, ElementVector, MeshHex
from skfem.helpers import dot
from skfem.models.elasticity import lame_parameters, linear_elasticity

from rotorsoil_ros.machine.flexible.body import Dof, FlexibleBody
from rotorsoil_ros.machine.flexible.reduction import FiniteElements

HERE = Path(__file__).parent
CONCRETE, POISSON, DENSITY = 30e9, 0.2, 2400.0   # [Pa], [-], [kg/m^3]
LENGTH, WIDTH, THICKNESS = 12.0, 4.0, 1.0        # of the raft along x, y, z [m]
FANS = {'fan_1': -3.0, 'fan_2': 3.0}             # where their shafts are [m]
AXES = ('x', 'y', 'z')
TURN = 2.0 * np.pi


def raft() -> FlexibleBody:
    """Return the raft with its modes up to 100 Hz: six by two bricks of 27 nodes."""
    mesh = MeshHex.init_tensor(np.linspace(-0.5 * LENGTH, 0.5 * LENGTH, 7),
                               np.linspace(-0.5 * WIDTH, 0.5 * WIDTH, 3),
                               np.array([0.0, THICKNESS]))
    basis = Basis(mesh, ElementVector(ElementHex2()))
    stiffness = linear_elasticity(*lame_parameters(CONCRETE, POISSON)).assemble(basis)
    mass = BilinearForm(lambda u, v, w: DENSITY * dot(u, v)).assemble(basis)
    # Every node has its three translations one after the other.
    axis = np.empty(basis.N, dtype=int)
    for dofs in (basis.nodal_dofs, basis.edge_dofs, basis.facet_dofs, basis.interior_dofs):
        for row, own in enumerate(dofs):
            axis[own] = row % 3
    places = basis.doflocs.T
    known = {index: Dof('node', AXES[axis[index]], 'probe', tuple(places[index]))
             for index in range(basis.N)}
    dofs, picks = [], []

    def ask(station: str, kind: str, place: tuple[float, ...], area: float,
            rows: dict[str, np.ndarray]) -> None:
        for direction, row in rows.items():
            dofs.append(Dof(station, direction, kind, place, area))
            picks.append(row)

    for fan, x in FANS.items():
        for end, y in (('drive_end', -0.5), ('fan_end', 0.5)):
            near = (np.abs(places[:, 2] - THICKNESS) < 1e-6) & (
                np.hypot(places[:, 0] - x, places[:, 1]) < 1.5)
            ask(f'{fan}_{end}', 'seat', (x, y, 2.0), 0.0,
                _carried(places, axis, near, (x, y, 2.0), AXES))
    number = 0
    for x in np.arange(-5.0, 6.0, 2.0):
        for y in (-1.0, 1.0):
            number += 1
            ask(f'patch_{number}', 'contact', (x, y, 0.0), 4.0, _mean_of_face(places, axis, x, y))
    for name, x, y in (('corner_1', -6, -2), ('corner_2', -6, 2), ('corner_3', 6, -2),
                       ('corner_4', 6, 2), ('middle', 0, 0)):
        at = np.linalg.norm(places - (x, y, THICKNESS), axis=1) < 1e-6
        ask(name, 'probe', (x, y, THICKNESS), 0.0,
            {'z': (at & (axis == 2)).astype(float)})
    pick = scipy.sparse.csc_matrix(np.array(picks))
    return FiniteElements.of(stiffness.tocsc(), mass.tocsc(), dofs, pick, known).body(
        TURN * 100.0, loss=0.04)


def _carried(
    places: np.ndarray, axis: np.ndarray, near: np.ndarray, to: tuple[float, ...],
    directions: tuple[str, ...],
) -> dict[str, np.ndarray]:
    """Return the motion of a place that some nodes carry: their rigid motion that fits best."""
    own = np.flatnonzero(near)
    rows = np.array([Dof('node', AXES[axis[index]], 'probe', tuple(places[index] - to)).rigid_row
                     for index in own])
    found = {}
    for direction, motion in zip(directions, np.linalg.pinv(rows), strict=False):
        found[direction] = np.zeros(len(places))
        found[direction][own] = motion
    return found


def _mean_of_face(
    places: np.ndarray, axis: np.ndarray, x: float, y: float,
) -> dict[str, np.ndarray]:
    """Return the mean motion of the base of one brick, by Simpson's rule over its nine nodes."""
    share = {-1: 1.0, 0: 4.0, 1: 1.0}
    found = {direction: np.zeros(len(places)) for direction in AXES}
    for index, (px, py, pz) in enumerate(places):
        i, j = round(px - x, 6), round(py - y, 6)
        if pz < 1e-6 and abs(i) <= 1.0 and abs(j) <= 1.0:
            found[AXES[axis[index]]][index] = share[round(i)] * share[round(j)] / 36.0
    return found


def write_raft(folder: Path) -> None:
    """Write the raft as modes, residual, rigid motion and table of motions."""
    body = raft()
    with (folder / 'raft_modes.csv').open('w', newline='') as stream:
        out = csv.writer(stream, lineterminator='\n')
        out.writerow(['dof', *(f'mode_{one + 1}' for one in range(len(body.stiffness)))])
        out.writerow(['hz', *_digits(np.sqrt(body.stiffness) / TURN)])
        out.writerows([name, *_digits(row)]
                      for name, row in zip(body.names, body.shapes, strict=True))
    for name, table in (('residual', body.residual), ('rigid', np.vstack([body.mass, body.rows]))):
        with (folder / f'raft_{name}.csv').open('w', newline='') as stream:
            csv.writer(stream, lineterminator='\n').writerows(map(_digits, table))
    _write_motions(folder / 'raft_dofs.csv', [*enumerate(body.dofs, start=1)])


def _digits(values: np.ndarray) -> list[str]:
    return [f'{value:.9e}' if abs(value) > 1e-30 else '0' for value in values]


def _write_motions(path: Path, dofs: list[tuple[int, Dof]]) -> None:
    with path.open('w', newline='') as stream:
        out = csv.writer(stream, lineterminator='\n')
        out.writerow(['index', 'name', 'kind', 'x', 'y', 'z', 'direction', 'area'])
        out.writerows([index, dof.station, dof.kind, *map(float, dof.place), dof.axis, dof.area]
                      for index, dof in dofs)


# The frame: 4 columns of 0.6 x 0.6 m, 4 m high, below a deck of girders 0.6 x 0.8 m.
COLUMNS = [(x, y) for y in (-2.5, 2.5) for x in (-1.5, 1.5)]
HEIGHT, SHAFT = 4.0, 5.0
SEATS = {'bearing_1': -1.5, 'bearing_2': 1.5}


def frame() -> tuple[scipy.sparse.csc_matrix, scipy.sparse.csc_matrix, list[tuple[int, Dof]]]:
    """Return stiffness, mass and motions of the table-top frame, of beams of Timoshenko."""
    nodes: dict[tuple[float, float, float], int] = {}
    beams: list[tuple[int, int, float, float]] = []

    def line(start: tuple[float, float, float], end: tuple[float, float, float], parts: int,
             wide: float, high: float) -> None:
        ends = [tuple(np.round(np.array(start) + share * (np.array(end) - start), 6))
                for share in np.linspace(0.0, 1.0, parts + 1)]
        for one, other in pairwise(ends):
            first, second = (nodes.setdefault(place, len(nodes)) for place in (one, other))
            beams.append((first, second, wide, high))

    for x, y in COLUMNS:
        line((x, y, 0.0), (x, y, HEIGHT), 4, 0.6, 0.6)
    for x in (-1.5, 1.5):
        line((x, -2.5, HEIGHT), (x, 2.5, HEIGHT), 10, 0.6, 0.8)
    for y in (-2.5, -1.5, 1.5, 2.5):
        line((-1.5, y, HEIGHT), (1.5, y, HEIGHT), 4, 0.6, 0.8)
    for y in SEATS.values():
        line((0.0, y, HEIGHT), (0.0, y, SHAFT), 1, 1.0, 1.0)  # bearing blocks
    places = np.array(list(nodes))
    stiffness, mass = (scipy.sparse.lil_matrix((6 * len(nodes),) * 2) for _ in range(2))
    for first, second, wide, high in beams:
        own = [*range(6 * first, 6 * first + 6), *range(6 * second, 6 * second + 6)]
        spring, inertia = _beam(places[second] - places[first], wide, high)
        stiffness[np.ix_(own, own)] += spring
        mass[np.ix_(own, own)] += inertia
    every = ('x', 'y', 'z', 'rx', 'ry', 'rz')
    kinds = {(0.0, y, SHAFT): (name, 'seat', ('x', 'z'), 0.0) for name, y in SEATS.items()}
    kinds |= {(x, y, 0.0): (f'footing_{number}', 'contact', every, 2.25)
              for number, (x, y) in enumerate(COLUMNS, start=1)}
    kinds |= {(x, y, HEIGHT): (f'corner_{number}', 'probe', ('x', 'z'), 0.0)
              for number, (x, y) in enumerate(COLUMNS, start=1)}
    motions = []
    for place, node in nodes.items():
        name, kind, wanted, area = kinds.get(place, (f'node_{node}', 'internal', every, 0.0))
        motions += [(6 * node + every.index(axis) + 1, Dof(name, axis, kind, place, area))
                    for axis in wanted]
    return stiffness.tocsc(), mass.tocsc(), motions


def _beam(along: np.ndarray, wide: float, high: float) -> tuple[np.ndarray, np.ndarray]:
    """Return stiffness and consistent mass, (12, 12), of a beam in the axes of the frame."""
    length, area = float(np.linalg.norm(along)), wide * high
    shear = CONCRETE / (2.0 * (1.0 + POISSON))
    bending = area * high**2 / 12.0, area * wide**2 / 12.0
    short, long = sorted((wide, high))
    torsion = long * short**3 * (1.0 / 3.0 - 0.21 * short / long)
    spring, inertia = np.zeros((12, 12)), np.zeros((12, 12))
    stretch = np.array([[1.0, -1.0], [-1.0, 1.0]])
    swing = np.array([[2.0, 1.0], [1.0, 2.0]]) / 6.0
    for dof, stiff, heavy in ((0, CONCRETE * area, DENSITY * area),
                              (3, shear * torsion, DENSITY * sum(bending))):
        spring[np.ix_([dof, dof + 6], [dof, dof + 6])] += stiff / length * stretch
        inertia[np.ix_([dof, dof + 6], [dof, dof + 6])] += heavy * length * swing
    # Local y bends about z (width), local z about -y (height).
    for dofs, second, sign in (([1, 5, 7, 11], bending[1], 1.0),
                               ([2, 4, 8, 10], bending[0], -1.0)):
        soft = 12.0 * CONCRETE * second / (5.0 / 6.0 * shear * area * length**2)
        turn = np.diag([1.0, sign, 1.0, sign])
        own = CONCRETE * second / (length**3 * (1.0 + soft)) * np.array([
            [12.0, 6.0 * length, -12.0, 6.0 * length],
            [6.0 * length, (4.0 + soft) * length**2, -6.0 * length, (2.0 - soft) * length**2],
            [-12.0, -6.0 * length, 12.0, -6.0 * length],
            [6.0 * length, (2.0 - soft) * length**2, -6.0 * length, (4.0 + soft) * length**2]])
        heavy = DENSITY * area * length / 420.0 * np.array([
            [156.0, 22.0 * length, 54.0, -13.0 * length],
            [22.0 * length, 4.0 * length**2, 13.0 * length, -3.0 * length**2],
            [54.0, 13.0 * length, 156.0, -22.0 * length],
            [-13.0 * length, -3.0 * length**2, -22.0 * length, 4.0 * length**2]])
        spring[np.ix_(dofs, dofs)] += turn @ own @ turn
        inertia[np.ix_(dofs, dofs)] += turn @ heavy @ turn
    first = along / length
    up = np.array([0.0, 0.0, 1.0]) if abs(first[2]) < 0.9 else np.array([0.0, 1.0, 0.0])
    second = np.cross(up, first)
    axes = np.kron(np.eye(4), np.array([first, second / np.linalg.norm(second),
                                        np.cross(first, second / np.linalg.norm(second))]))
    return axes.T @ spring @ axes, axes.T @ inertia @ axes


def write_frame(folder: Path) -> None:
    """Write the frame as matrices and table of motions."""
    stiffness, mass, motions = frame()
    for name, matrix in (('K', stiffness), ('M', mass)):
        both = 0.5 * (matrix + matrix.T)
        both.data[np.abs(both.data) < 1e-12 * np.abs(both.data).max()] = 0.0
        both.eliminate_zeros()
        scipy.io.mmwrite(folder / f'frame_{name}.mtx', both, precision=13, symmetry='symmetric')
    _write_motions(folder / 'frame_dofs.csv', motions)


if __name__ == '__main__':
    write_raft(HERE)
    write_frame(HERE)
