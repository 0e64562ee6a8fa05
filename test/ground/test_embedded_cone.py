"""Stacks of cones against rigorous cylinders, published values, and what any support obeys."""

import numpy as np
import pytest

from rotorsoil_ros.errors import RotorSoilError
from rotorsoil_ros.ground.cone import ConeModel
from rotorsoil_ros.ground.embedded_cone import EmbeddedConeModel
from rotorsoil_ros.ground.layers.profile import Embedment
from rotorsoil_ros.ground.soil import Circle, Rectangle, Soil

from oracles.published import REFERENCE

DISC = Circle(1.0)


def test_block_in_the_ground_is_the_rigorous_one_within_what_the_page_says():
    rows = np.genfromtxt(REFERENCE / 'ground' / 'emb0.5_half.csv', delimiter=',', names=True)
    found = EmbeddedConeModel(Soil(1.0, 0.25, 1.0, 0.05), DISC, Embedment(0.5)).compliance(
        rows['a0'])
    exact = {name: rows[f'{name}_re'] + 1j * rows[f'{name}_im']
             for name in ('xx', 'zz', 'ryry', 'rzrz', 'x_ry')}
    # The table counts z downward: its rotation lowers the edge at +x, as +ry does with z up.
    for name, (i, j) in {'xx': (0, 0), 'zz': (2, 2), 'ryry': (4, 4), 'rzrz': (5, 5),
                         'x_ry': (0, 4)}.items():
        own = {0: 'xx', 2: 'zz', 4: 'ryry', 5: 'rzrz'}
        size = np.sqrt(np.abs(exact[own[i]] * exact[own[j]]))
        # docs/theory/cones.md; torsion is the worst, at a0 = 6.
        assert (np.abs(found[:, i, j] - exact[name]) / size).max() < 0.13


@pytest.mark.parametrize('depth, published', [(0.5, 13.23), (1.0, 19.89), (2.0, 32.75)])
def test_twist_at_rest_is_that_of_the_published_cylinder(depth, published):
    """Luco (1976), torsion of an embedded cylinder, over G r^3."""
    model = EmbeddedConeModel(Soil(1.0, 0.25, 1.0), DISC, Embedment(depth))
    stiffness = 1.0 / model.compliance(np.zeros(1))[0, 5, 5].real
    assert stiffness == pytest.approx(published, rel=0.12)


def test_block_that_hardly_stands_in_the_ground_is_one_on_the_surface():
    soil, omega = Soil(1.0, 0.45, 1.0, 0.1), np.array([0.0, 0.7, 3.0])
    found, surface = (np.diagonal(model.compliance(omega), axis1=1, axis2=2) for model in (
        EmbeddedConeModel(soil, DISC, Embedment(1e-4)), ConeModel(soil, DISC)))
    np.testing.assert_allclose(found, surface, rtol=1e-3)


@pytest.mark.parametrize('poisson', [0.0, 0.25, 0.45])
@pytest.mark.parametrize('depth', [0.1, 1.0, 3.0])
def test_stack_is_passive_and_reciprocal_at_every_frequency(poisson, depth):
    """Without material damping too: what the excavated soil takes away is inertia alone."""
    model = EmbeddedConeModel(Soil(1.0, poisson, 1.0), Rectangle(1.0, 2.0), Embedment(depth))
    values = model.compliance(np.linspace(0.01, 8.0, 200))
    np.testing.assert_allclose(values, values.swapaxes(1, 2), rtol=1e-9, atol=1e-15)
    size = np.sqrt(np.abs(np.diagonal(values, axis1=1, axis2=2)))
    loss = np.linalg.eigvalsh(-values.imag / (size[:, :, None] * size[:, None]))
    assert loss.min() > 0.0


def test_a_block_that_lies_across_is_the_other_one_turned():
    soil, hole = Soil(2.0, 0.3, 1.5, 0.05), Embedment(0.7)
    along, across = (EmbeddedConeModel(soil, contact, hole).compliance(np.array([0.9]))[0]
                     for contact in (Rectangle(1.0, 2.0), Rectangle(2.0, 1.0)))
    order = [1, 0, 2, 4, 3, 5]
    turned = along[order][:, order] * np.outer(*[[1, 1, 1, -1, -1, -1]] * 2)
    np.testing.assert_allclose(across, turned, rtol=1e-12, atol=1e-18)


def test_answers_do_not_depend_on_what_else_is_asked():
    model = EmbeddedConeModel(Soil(1.0, 0.3, 1.0, 0.05), DISC, Embedment(1.0))
    np.testing.assert_allclose(model.compliance(np.array([0.2, 9.0]))[0],
                               model.compliance(np.array([0.2]))[0], rtol=1e-12)


def test_gap_beside_a_wall_is_refused():
    with pytest.raises(RotorSoilError, match='side_contact must be 1 with the model cone'):
        EmbeddedConeModel(Soil(1.0, 0.3, 1.0), DISC, Embedment(1.0, 0.5))
