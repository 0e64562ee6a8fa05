"""What is said of errors of the ground's models, against rigorous contacts."""

import csv
import math

import numpy as np
import pytest

from rotorsoil_ros.channel import DOFS
from rotorsoil_ros.ground.accuracy import gap, neglected_coupling, shape_error
from rotorsoil_ros.ground.boundary.model import BoundaryElementModel
from rotorsoil_ros.ground.half_space import InfiniteElementModel
from rotorsoil_ros.ground.plan import Part, Plan
from rotorsoil_ros.ground.soil import Circle, Rectangle, Soil

from oracles.published import REFERENCE

MOTIONS = ('xx', 'yy', 'zz', 'rxrx', 'ryry', 'rzrz')


def table_of(name):
    with (REFERENCE / 'contact' / name).open() as stream:
        return list(csv.DictReader(line for line in stream if not line.startswith('#')))


@pytest.mark.parametrize('ratio', [1.0, 2.0])
def test_a_disc_is_off_by_what_is_said_of_the_rectangle(ratio):
    rows = [row for row in table_of('rectangles.csv') if row['contact'] == 'bonded'
            and float(row['nu']) == 0.25 and float(row['L_over_B']) == ratio
            and float(row['eta']) == 0.0 and float(row['a0']) <= 3.81]
    a0 = np.array([float(row['a0']) for row in rows])
    rigorous = np.array([[complex(float(row[f're_{motion}']), float(row[f'im_{motion}']))
                          for motion in MOTIONS] for row in rows])
    soil, contact = Soil(1.0, 0.25, 1.0), Rectangle(1.0, ratio)
    disc = InfiniteElementModel.solved(soil, contact, 'disc', omega_min=0.0,
                                       omega_max=float(a0.max()))
    off = np.abs(np.diagonal(disc.compliance(a0), axis1=1, axis2=2) / rigorous - 1.0)
    exact = BoundaryElementModel.solved(soil, contact, omega_max=float(a0.max()))
    found = shape_error(disc, exact, a0)
    assert found.share == pytest.approx(off.max(), abs=5e-3)  # what boundary elements are off by
    row, dof = np.unravel_index(off.argmax(), off.shape)
    assert (found.dof, found.omega) == (DOFS[dof], a0[row])


@pytest.mark.parametrize('clear', [0.25, 4.0])
def test_neglected_coupling_is_that_of_two_rigorous_squares(clear):
    entries = {(row['row'], row['column']): abs(complex(float(row['re']), float(row['im'])))
               for row in table_of('two_blocks.csv') if row['case'] == 'two_squares'
               and float(row['gap_over_B']) == clear and float(row['a0']) == 2.0}
    own = {dof: size for (dof, other), size in entries.items() if dof == other}
    largest = max(size / math.sqrt(own[one] * own[other])
                  for (one, other), size in entries.items() if one[-1] != other[-1])
    square = Rectangle(1.0, 1.0)
    coupling, _ = neglected_coupling(square, square, apart=(0.0, 2.0 + clear))
    assert coupling == pytest.approx(largest, abs=0.02)  # two digits were noted


def test_gap_is_the_clear_distance_of_any_two_contacts():
    assert gap(Rectangle(1.0, 0.75), Rectangle(2.0, 0.5), apart=(0.0, 3.0)) == 1.75
    assert gap(Circle(1.0), Rectangle(2.0, 0.5), apart=(0.0, 1.0)) == -0.5
    assert gap(Rectangle(1.0, 1.0), Rectangle(1.0, 1.0), apart=(5.0, -6.0)) == 5.0
    assert gap(Circle(1.0), Circle(0.5), apart=(3.0, 4.0)) == pytest.approx(3.5)
    ell = Plan((Part(1.0, 1.0, 0.0, 0.0), Part(1.0, 0.5, 2.0, -0.5)))
    # Above the foot of the L, beside its stem: about the centroid (2/3, -1/6).
    assert gap(ell, Rectangle(0.25, 0.25), apart=(1.0, 1.0)) == pytest.approx(
        5.0 / 3.0 - 1.0 - 0.25, abs=1e-12)
