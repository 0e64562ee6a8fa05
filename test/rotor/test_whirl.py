"""Whirl directions that the verbs print, against orbits and gyroscopics of full matrices."""

import csv
import io
from pathlib import Path

import numpy as np
import pytest
import scipy.linalg

from rotorsoil_ros.case.config import load
from rotorsoil_ros.case.models import coupled_model
from rotorsoil_ros.cli import main

from oracles.dense import rotor_matrices

ROSS = Path(__file__).parents[1] / 'reference' / 'ross' / 'hollow.toml'
NO_CACHE = Path('no cache is needed for a rigid support')

# A fan wheel far outside its bearings, on a slender shaft and on bearings twice as stiff across as
# upward: I_p = 1.9 I_d, so that its tilting never meets the speed in forward whirl.
OVERHUNG = """
name: overhung
support: {model: rigid}
rotor:
  shaft_height: 1.0
  material: {young_modulus: 2.1e11, poisson_ratio: 0.3, density: 7850.0}
  shaft: [{length: 0.9, outer_diameter: 0.04, inner_diameter: 0.0, elements: 18}]
  discs:
    - {name: wheel, position: 0.9, mass: 30.0, diametral_inertia: 1.0, polar_inertia: 1.9}
  bearings:
    - {name: rear, position: 0.0, stiffness: {xx: 4.0e7, zz: 2.0e7}, damping: {xx: 900, zz: 900}}
    - {name: front, position: 0.6, stiffness: {xx: 4.0e7, zz: 2.0e7}, damping: {xx: 900, zz: 900}}
unbalances: []
speed_range_rpm: [60, 12000]
"""


def modes_of(model, speed, *, gyroscopic):
    """Return eigenvalues (2 d,), and vectors (d, 2 d), of the full rotor on its bearings."""
    stiffness, mass, turning = rotor_matrices(model.rotor)
    damping = gyroscopic * speed * turning
    speeds = np.array([speed])
    springs, dampers, _ = (one[0] for one in model.bearings.coefficients(speeds, speeds))
    journals = [4 * model.rotor.node_of(bearing.position) + axis
                for bearing in model.rotor.bearings for axis in range(2)]
    place = np.ix_(journals, journals)
    stiffness[place] += springs
    damping[place] += dampers
    size, one = len(mass), np.eye(len(mass))
    values, vectors = scipy.linalg.eig(
        np.block([[np.zeros((size, size)), one], [-stiffness, -damping]]),
        scipy.linalg.block_diag(one, mass))
    return values, vectors[:size]


def direction_of_orbits(model, speed, omega):
    """Return the sign of the mass-weighted area that the nodes sweep, positive from z into x."""
    values, vectors = modes_of(model, speed, gyroscopic=1.0)
    which = int(np.abs(values - 1j * omega).argmin())
    assert abs(values[which].imag - omega) < 1e-6 * omega
    _, mass, _ = rotor_matrices(model.rotor)
    x, z = vectors[0::4, which], vectors[1::4, which]
    turn = np.exp(1j * np.linspace(0.0, 2.0 * np.pi, 361))
    across, up = ((motion[:, None] * turn).real for motion in (x, z))
    # Twice the area between successive positions, as a surveyor computes it.
    swept = (up[:, :-1] * across[:, 1:] - across[:, :-1] * up[:, 1:]).sum(axis=1)
    return int(np.sign(mass.diagonal()[0::4] @ swept))


def direction_by_gyroscopics(model, speed, omega):
    """Return +1 where more gyroscopic couple stiffens the mode, else -1; bearings are kept."""
    frequency = []
    for factor in (0.999, 1.001):
        values, _ = modes_of(model, speed, gyroscopic=factor)
        frequency.append(values[np.abs(values - 1j * omega).argmin()].imag)
    return int(np.sign(frequency[1] - frequency[0]))


def rows_of(capsys, *arguments):
    """Return the numbers of the CSV that a verb prints, as an array."""
    assert main([*arguments]) == 0
    head, *rows = csv.reader(io.StringIO(capsys.readouterr().out))
    return np.array([row[:head.index('name') if 'name' in head else None] for row in rows],
                    dtype=float)


@pytest.fixture(scope='module')
def cases(tmp_path_factory):
    """Return the case files: imported as a user does it, and written by hand."""
    folder = tmp_path_factory.mktemp('whirl')
    imported, overhung = folder / 'hollow.yaml', folder / 'overhung.yaml'
    assert main(['import-ross', str(ROSS), '-o', str(imported)]) == 0
    overhung.write_text(OVERHUNG)
    return {'imported': imported, 'overhung': overhung}


@pytest.mark.parametrize('name, whirls', [
    ('imported', [-1, 1, -1, 1]), ('overhung', [-1, 1, -1])])
def test_criticals_whirl_as_their_orbits_and_gyroscopics_say(cases, capsys, name, whirls):
    rows = rows_of(capsys, 'campbell', str(cases[name]), '--criticals')
    model = coupled_model(load(cases[name]), NO_CACHE)
    assert rows[:, 1].tolist() == whirls
    for direction in (direction_of_orbits, direction_by_gyroscopics):
        assert [direction(model, speed, speed) for speed in rows[:, 0]] == whirls


@pytest.mark.parametrize('name', ['imported', 'overhung'])
def test_modes_of_the_diagram_whirl_as_their_orbits_say(cases, capsys, name):
    rows = rows_of(capsys, 'campbell', str(cases[name]), '--rpm', '2000:11000:4', '--modes', '6')
    model = coupled_model(load(cases[name]), NO_CACHE)
    light = rows[rows[:, 3] < 0.1]
    assert len(light) >= 16
    found = [direction_of_orbits(model, speed, omega) for speed, _, omega, _, _ in light]
    assert found == light[:, 4].tolist()
    assert set(found) == {-1, 1}


def test_wheel_beyond_its_diametral_inertia_rises_above_the_speed_and_falls_to_rest(cases, capsys):
    # Closed form, Lalanne & Ferraris ch. 2: far up, forward tilting tends to Omega I_p / I_d,
    # backward tilting to zero.
    rows = rows_of(capsys, 'campbell', str(cases['overhung']), '--rpm', '6000:12000:2',
                   '--modes', '6')
    slow, fast = (rows[rows[:, 0] == speed] for speed in np.unique(rows[:, 0]))
    lowest, highest = (part[part[:, 4] < 0][0, 2] for part in (fast, slow))
    assert lowest < highest
    forward = fast[fast[:, 4] > 0][-1]
    assert forward[2] == pytest.approx(1.9 * forward[0], rel=0.1)
