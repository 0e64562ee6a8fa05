"""Discs on one half-space move each other as the wave equation says."""

import csv
from pathlib import Path

import numpy as np
import pytest

from rotorsoil_ros.errors import OutOfTableError, RotorSoilError
from rotorsoil_ros.ground.green import GreenModel, GreenTable
from rotorsoil_ros.ground.soil import Soil

REFERENCE = Path(__file__).parents[1] / 'reference' / 'foundation' / 'green_discs.csv'
PLACES = tuple((x, y) for x in (-3.0, -1.0, 1.0, 3.0) for y in (-1.0, 1.0))


@pytest.fixture(scope='module')
def patches():
    """Return eight patches of 2 x 2 m on the soil of the fan."""
    return GreenModel.solved(Soil(100e6, 0.3, 1900.0, 0.05), PLACES, (1.1284,) * 8,
                             omega_max=400.0)


def test_two_discs_are_the_published_ones():
    rows = list(csv.DictReader(line for line in REFERENCE.read_text().splitlines()
                               if line[0] != '#'))
    apart = sorted({float(row['distance_over_radius']) for row in rows})
    for ratio in {row['nu'] for row in rows}:
        own = [row for row in rows if row['nu'] == ratio]
        table = GreenTable.solved(float(ratio), 0.05, np.array([[1.0, 1.0, d] for d in apart]),
                                  max(float(row['a0']) for row in own))
        for row in own:
            vertical, mean, difference = table.at(np.array([float(row['a0'])]))[
                0, apart.index(float(row['distance_over_radius']))]
            turn = 2.0 * float(row['theta'])
            found = {'zz': vertical, 'xx': mean - difference * np.cos(turn),
                     'yy': mean + difference * np.cos(turn), 'xy': -difference * np.sin(turn)}
            size = abs(complex(float(row['xx_re']), float(row['xx_im'])))
            for name, value in found.items():
                exact = complex(float(row[f'{name}_re']), float(row[f'{name}_im']))
                # The integral of the reference ends where 2e-4 of the self term is left.
                assert abs(value - exact) < 3e-4 * size


def test_one_disc_at_rest_gives_way_by_the_textbook():
    # Even pressure: mean settlement 8 (1 - nu) / (3 pi^2) of p / (G a), Timoshenko & Goodier.
    table = GreenTable.solved(0.3, 0.05, np.array([[1.0, 1.0, 0.0]]), 0.5)
    found = table.at(np.zeros(1))[0, 0, 0] * (1.0 + 0.05j)
    assert found == pytest.approx(8.0 * 0.7 / (3.0 * np.pi**2), rel=1e-4)


def test_patches_take_energy_and_are_reciprocal(patches):
    found = patches.compliance(np.linspace(0.0, 400.0, 9))
    np.testing.assert_allclose(found, found.transpose(0, 2, 1), atol=1e-20)
    assert np.linalg.eigvalsh(-found.imag).min() > 0.0


def test_another_stiffness_is_a_rescaling(patches):
    omega = np.array([50.0, 150.0])
    softer = patches.on(Soil(25e6, 0.3, 1900.0, 0.05)).compliance(0.5 * omega)
    np.testing.assert_allclose(softer, 4.0 * patches.compliance(omega), rtol=1e-12)


def test_beyond_its_range_and_without_loss_it_is_refused(patches):
    with pytest.raises(OutOfTableError):
        patches.compliance(np.array([500.0]))
    with pytest.raises(RotorSoilError, match=r'loss_factor must be >= 0\.005'):
        GreenModel.solved(Soil(1e8, 0.3, 1900.0, 0.0), PLACES, (1.0,) * 8, omega_max=100.0)
