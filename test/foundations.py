"""Foundations that bend, out of the reference files, for the tests."""

import csv
from pathlib import Path

import numpy as np

from rotorsoil_ros.case.flexible import matrices, tables
from rotorsoil_ros.case.flexible.interface import Interface
from rotorsoil_ros.ground.bed import PatchesApart
from rotorsoil_ros.ground.soil import Rectangle
from rotorsoil_ros.machine.flexible.body import FlexibleBody
from rotorsoil_ros.machine.flexible.reduction import FiniteElements
from rotorsoil_ros.machine.foundation import Foundation
from rotorsoil_ros.machine.support import Support
from rotorsoil_ros.rotor.bearing import Bearing
from rotorsoil_ros.units import hz_to_rad_s

REFERENCE = Path(__file__).parent / 'reference' / 'foundation'
LOSS = 0.04


class Springs:
    """Springs with a loss and dashpots along each motion; infinite ones hold it."""

    def __init__(self, stiffness, damping, loss):
        self.stiffness, self.damping = np.array(stiffness), np.array(damping)
        self.loss = loss

    def compliance(self, omega):
        """Return what six motions give way by."""
        held = ~np.isfinite(self.stiffness)
        own = np.where(held, 1.0, self.stiffness) * (1.0 + 1j * self.loss)
        found = np.where(held, 0.0, 1.0 / (own + 1j * omega[:, None] * self.damping))
        return found[:, :, None] * np.eye(6)


FOOTING = Springs([9e8, 9e8, 1.2e9, 6e8, 9e9, 2e9], [9e6, 9e6, 16e6, 2e6, 50e6, 10e6], 0.06)
PATCH = Springs([1.5e8, 1.5e8, 1.86e8, np.inf, np.inf, np.inf], [7e5, 7e5, 1.2e6, 0, 0, 0], 0.05)


def frame_elements():
    """Return the matrices of the table-top frame."""
    stiffness, mass = (matrices.read(REFERENCE / f'frame_{name}.mtx') for name in 'KM')
    where = REFERENCE / 'frame_dofs.csv'
    rows = tables.motions(where, where.read_text())
    found = Interface.of(where, rows, stiffness.shape[0], None)
    return FiniteElements.of(stiffness, mass, found.dofs, found.pick, found.known)


def raft_body():
    """Return the raft of the reference, by its modes."""
    at = REFERENCE / 'raft_modes.csv'
    names, hertz, shapes = tables.modes(at, at.read_text())
    rigid, residual = (tables.numbers_of(at, (REFERENCE / f'raft_{name}.csv').read_text())
                       for name in ('rigid', 'residual'))
    return FlexibleBody(tuple(tables.dofs_of(at, names, rigid[6:])), rigid[:6], rigid[6:],
                        shapes, hz_to_rad_s(hertz) ** 2, residual,
                        np.full(len(hertz), LOSS), LOSS, 'each')


def bearing(name, position, foundation, seat=None):
    """Return a bearing whose coefficients do not matter."""
    return Bearing(name, position, foundation, 1e9 * np.eye(2), np.eye(2), seat=seat)


def apart(body, springs, own):
    """Return ground with the same springs under each patch, over its first motions."""
    kept = tuple(6 * patch + axis for patch in range(len(body.patches)) for axis in range(own))
    return PatchesApart([springs] * len(body.patches), kept, body.about_centre[body.contacts])


def frame_support(body, springs=FOOTING):
    """Return the frame on its footings below four bearings."""
    bearings = [bearing(f'bearing_{number + 1}', 5.0 * number, 'frame') for number in range(4)]
    block = Foundation('frame', Rectangle(1.0, 1.0), 7.5, 1.0, 1.0, (1.0, 1.0, 1.0), body=body)
    return Support(bearings, 10.0, [block], [apart(body, springs, 6)])


def raft_support(body, springs=PATCH):
    """Return the raft on its patches below the bearings of two fans."""
    bearings = [bearing(f'{fan}_{end}', place, 'raft', f'{fan}_{end}')
                for fan in ('fan_1', 'fan_2') for end, place in (('b1', -0.5), ('b2', 0.5))]
    block = Foundation('raft', Rectangle(6.0, 2.0), 0.0, 1.0, 1.0, (1.0, 1.0, 1.0), body=body)
    return Support(bearings, 2.0, [block], [apart(body, springs, 3)])


def published(name, support):
    """Return frequencies (n,) and receptances of the seats (n, 2 b, 2 b) of a reference file."""
    rows = list(csv.DictReader(
        line for line in (REFERENCE / name).read_text().splitlines() if line[0] != '#'))
    names = [f'{one.seat or one.name}_{axis}' for one in support.bearings for axis in 'xz']
    hertz = sorted({float(row['hz']) for row in rows})
    found = np.zeros((len(hertz), len(names), len(names)), dtype=complex)
    for row in rows:
        i, j = (names.index(row[key]) for key in ('response', 'force'))
        value = float(row['real']) + 1j * float(row['imag'])
        found[hertz.index(float(row['hz'])), [i, j], [j, i]] = value
    return hz_to_rad_s(np.array(hertz)), found


def off(found, exact):
    """Return by how much matrices (n, d, d) are off, (n,), of the norm."""
    return np.linalg.norm(found - exact, axis=(1, 2)) / np.linalg.norm(exact, axis=(1, 2))
