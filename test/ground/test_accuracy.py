"""What is said of errors of the ground's models, against rigorous contacts."""

import csv
import math

import numpy as np
import pytest

from rotorsoil_ros.ground.accuracy import gap, mapping_error, neglected_coupling
from rotorsoil_ros.ground.half_space import InfiniteElementModel
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
    exact = np.array([[complex(float(row[f're_{motion}']), float(row[f'im_{motion}']))
                       for motion in MOTIONS] for row in rows])
    soil, contact = Soil(1.0, 0.25, 1.0), Rectangle(1.0, ratio)
    disc = InfiniteElementModel.solved(soil, contact, 'disc', omega_min=0.0,
                                       omega_max=float(a0.max()))
    found = np.diagonal(disc.compliance(a0), axis1=1, axis2=2)
    worst = np.abs(found / exact - 1.0).max()
    # Said of nu 0.25 to 1/3, of which this is one end.
    assert 0.7 * mapping_error(contact) < worst <= mapping_error(contact)


def test_a_circle_is_its_own_disc_and_a_very_long_contact_is_not_known():
    assert mapping_error(Circle(1.0)) == 0.0
    assert mapping_error(Rectangle(5.0, 1.0)) == math.inf
    errors = [mapping_error(Rectangle(1.0, ratio)) for ratio in (1.0, 1.2, 2.0, 2.5, 4.0)]
    assert errors == sorted(errors)
    assert mapping_error(Rectangle(2.0, 1.0)) == mapping_error(Rectangle(1.0, 2.0))


@pytest.mark.parametrize('clear', [0.25, 4.0])
def test_neglected_coupling_is_that_of_two_rigorous_squares(clear):
    entries = {(row['row'], row['column']): abs(complex(float(row['re']), float(row['im'])))
               for row in table_of('two_blocks.csv') if row['case'] == 'two_squares'
               and float(row['gap_over_B']) == clear and float(row['a0']) == 2.0}
    own = {dof: size for (dof, other), size in entries.items() if dof == other}
    largest = max(size / math.sqrt(own[one] * own[other])
                  for (one, other), size in entries.items() if one[-1] != other[-1])
    square = Rectangle(1.0, 1.0)
    coupling, _ = neglected_coupling(square, square, distance=2.0 + clear)
    assert coupling == pytest.approx(largest, abs=0.02)  # two digits were noted


def test_gap_is_clear_distance_along_the_shaft():
    assert gap(Rectangle(1.0, 0.75), Rectangle(2.0, 0.5), distance=3.0) == 1.75
    assert gap(Circle(1.0), Rectangle(2.0, 0.5), distance=1.0) == -0.5
