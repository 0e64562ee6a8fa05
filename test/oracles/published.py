"""Reference data of `test/reference`, and the published rotors that it is about."""

import csv
import json
import math
from pathlib import Path

import numpy as np
import scipy.linalg

from rotorsoil_ros.rotor.disc import Disc
from rotorsoil_ros.rotor.shaft import Material

from machines import bearing, uniform_rotor
from oracles.dense import rotor_matrices

REFERENCE = Path(__file__).resolve().parents[1] / 'reference'
ROSS_FILES = REFERENCE / 'ross'
# ROSS has y up and x to the other side; its load is our unbalance at phase -pi/2.
ROSS_STATIONS = {'disc1': 'disc_1', 'brgA': 'bearing_1_journal', 'brgB': 'bearing_2_journal'}
ROSS_UNBALANCE = np.array([0.01 * np.exp(-0.5j * np.pi), 0.0])


def cases():
    """Return every benchmark of a rotor by its name."""
    content = json.loads((REFERENCE / 'rotor' / 'benchmarks.json').read_text())
    return {case['id']: case for case in content}


def published(name):
    """Return inputs, expected figures and tolerance of a benchmark of a rotor."""
    case = cases()[name]
    return case['inputs'], np.array(case['expected']), case['suggested_rtol']


def response(name):
    """Return a response over frequency: frequencies [rad/s] and complex columns by name."""
    rows = np.genfromtxt(REFERENCE / 'rotor' / name, delimiter=',', names=True)
    columns = {column[:-3]: rows[column] + 1j * rows[column[:-3] + '_im']
               for column in rows.dtype.names if column.endswith('_re')}
    return 2.0 * np.pi * rows['freq_hz'], columns


def half_space(name, quantities):
    """Return the frequencies of a rigorous compliance and its columns, (n,) and (n, q)."""
    columns = {quantity: {} for quantity in quantities}
    with (REFERENCE / 'soil' / name).open() as stream:
        for row in csv.reader(line for line in stream if not line.startswith('#')):
            if row[0] in columns:
                columns[row[0]][float(row[1])] = complex(float(row[2]), float(row[3]))
    a0 = np.array(list(columns[quantities[0]]))
    return a0, np.array([[columns[name][one] for name in quantities] for one in a0])


def ross_figures(file):
    """Return speed, eigenvalues [rad/s] and responses (4, 2) by disc that ROSS found of a file."""
    found = json.loads((ROSS_FILES / 'figures.json').read_text())[file]
    pairs = np.array(found['eigenvalues']) @ [1.0, 1j]
    responses = {disc: np.array(rows) @ [1.0, 1j] for disc, rows in found['response'].items()}
    return found['speed'], pairs, responses


def ross_criticals():
    """Return the critical speeds of hollow.toml by ROSS [rad/s]."""
    return np.array(json.loads((ROSS_FILES / 'figures.json').read_text())['hollow']['criticals'])


def ross_response(model, disc):
    """Return what ROSS calls horizontal and vertical of a disc, (4, 2), for 1e-4 kg m."""
    # Its phase 0 is our -pi/2, its x our -x.
    speeds = json.loads((ROSS_FILES / 'figures.json').read_text())['response_speeds']
    unbalance = np.zeros(len(model.planes), dtype=complex)
    unbalance[0] = 1e-4 * np.exp(-0.5j * np.pi)
    motion = model.unbalance_response(np.array(speeds), unbalance).displacement
    first = model.channels.index(f'{disc}_x')
    return motion[:, first:first + 2] * [-1.0, 1.0]


def whirl_frequencies(rotor, speed, count):
    """Return the lowest natural frequencies [rad/s] at one speed, from the full matrices."""
    stiffness, mass, gyroscopic = rotor_matrices(rotor)
    damping = speed * gyroscopic
    for one in rotor.bearings:
        node = 4 * rotor.node_of(one.position)
        stiffness[node:node + 2, node:node + 2] += one.stiffness
        damping[node:node + 2, node:node + 2] += one.damping
    size = len(mass)
    left = np.block([[np.zeros((size, size)), np.eye(size)], [-stiffness, -damping]])
    right = scipy.linalg.block_diag(np.eye(size), mass)
    values = scipy.linalg.eigvals(left, right)
    return np.sort(np.abs(values[values.imag > 0.0]))[:count]


def hollow_disc(name, position, *, inner, outer, width, density):
    """Return a cylindrical disc of given diameters."""
    mass = density * math.pi / 4.0 * (outer**2 - inner**2) * width
    polar = mass * (outer**2 + inner**2) / 8.0
    return Disc(name, position, mass, polar / 2.0 + mass * width**2 / 12.0, polar)


def pinned_shaft(given, spring=1e13):
    """Return a uniform shaft between stiff supports."""
    return uniform_rotor(
        length=given['L'], diameter=given['d'], elements=28,
        material=Material(given['E'], given['nu'], given['rho']),
        bearings=[bearing('a', 0.0, stiffness=spring, foundation=None),
                  bearing('b', given['L'], stiffness=spring, foundation=None)])


def lalanne_ferraris(given, damping_x, damping_z):
    """Return the three-disc rotor of the book, on ground that does not move."""
    discs = [hollow_disc(f'disc_{i + 1}', position, inner=2.0 * given['disc_ri'],
                         outer=2.0 * outer, width=width, density=given['rho'])
             for i, (position, outer, width) in enumerate(
                 zip(given['disc_pos'], given['disc_ro'], given['disc_h'], strict=True))]
    return uniform_rotor(
        length=given['L'], diameter=given['shaft_d'], elements=13,
        material=Material(given['E'], given['nu'], given['rho']), discs=discs,
        bearings=[bearing(name, position, foundation=None,
                          stiffness=np.diag([given['kxx'], given['kzz']]),
                          damping=np.diag([damping_x, damping_z]))
                  for name, position in zip('ab', given['brg_pos'], strict=True)])


def friswell(given, stiffness):
    """Return the two-disc rotor of Friswell et al. (2010), example 5.9."""
    material = Material(given['E'], given['E'] / given['G'] / 2.0 - 1.0, given['rho'])
    discs = [hollow_disc(f'disc_{i + 1}', position, inner=given['disc_di'], outer=outer,
                         width=given['disc_h'], density=given['rho'])
             for i, (position, outer) in enumerate(
                 zip(given['disc_pos'], given['disc_do'], strict=True))]
    return uniform_rotor(
        length=given['L'], diameter=given['d'], elements=given['n_elements'], material=material,
        discs=discs, bearings=[bearing(name, position, stiffness=stiffness, foundation=None)
                               for name, position in (('a', 0.0), ('b', given['L']))])


def jeffcott(given, *, damping_at_disc=0.0, foundation=None, stiffness=1e14, damping=0.0):
    """Return a disc in the middle of a massless shaft; a damper at it needs a third bearing."""
    shaft = Material(given['E'], 0.3, 0.0)
    supports = [bearing('a', 0.0, stiffness=stiffness, damping=damping, foundation=foundation),
                bearing('b', given['L'], stiffness=stiffness, damping=damping,
                        foundation=foundation)]
    if damping_at_disc:
        supports.append(bearing('damper', given['L'] / 2.0, stiffness=0.0,
                                damping=damping_at_disc, foundation=None))
    return uniform_rotor(length=given['L'], diameter=given['d'], elements=2, material=shaft,
                         discs=[Disc('disc', given['L'] / 2.0, given['m'], 0.0, 0.0)],
                         bearings=supports)
