"""Boundary elements on layers: against half-spaces, thin layers, themselves, and invariants."""

from dataclasses import replace
from itertools import pairwise
import math

import numpy as np
import pytest

from rotorsoil_ros.errors import OutOfTableError, RotorSoilError
from rotorsoil_ros.ground.boundary.layered_model import (
    LayeredSite,
    LayeredSiteModel,
    LayeredSiteTable,
)
from rotorsoil_ros.ground.boundary.layered_tabulate import solver_of
from rotorsoil_ros.ground.boundary.model import BoundaryElementModel
from rotorsoil_ros.ground.boundary.patches import PatchSolver
from rotorsoil_ros.ground.boundary.rectangle import RectangleSolver
from rotorsoil_ros.ground.boundary.reflections import LayeredWaves
from rotorsoil_ros.ground.boundary.site import Site
from rotorsoil_ros.ground.boundary.waves import SurfaceWaves
from rotorsoil_ros.ground.layers.profile import Layer, LayeredSoil, SURFACE
from rotorsoil_ros.ground.layers.tabulate import exact_compliance, Radii
from rotorsoil_ros.ground.plan import Part
from rotorsoil_ros.ground.soil import Rectangle, Soil

UNIT = Soil(1.0, 0.3, 1.0, 0.05)
SQUARE = Rectangle(1.0, 1.0)
ON_ROCK = LayeredSoil((Layer(1.5, UNIT),), None)
CRUST = LayeredSoil((Layer(0.5, UNIT),), Soil(0.25, 0.4, 0.9, 0.1))
# As little loss as is allowed, and every contrast.
LIGHT = LayeredSoil((Layer(3.5, replace(UNIT, loss_factor=0.005)),
                     Layer(1.0, Soil(3.0, 0.45, 1.1, 0.005))), None)
NO_POINTS = np.zeros((0, 2))
ORIGIN = np.zeros((1, 2))


def over_diagonals(difference, values):
    size = np.sqrt(np.abs(np.diagonal(values, axis1=-2, axis2=-1)))
    return np.abs(difference) / (size[..., :, None] * size[..., None, :])


def waves_on(ground, reach=3.0):
    return LayeredWaves.of(ground, reach, lowest=0.05, highest=4.0)


@pytest.fixture(scope='module')
def two_on_rock():
    site = Site.of((SQUARE, Rectangle(1.0, 1.5)), ((0.0, 0.0), (2.5, 0.0)), ((0.0, 4.0),))
    return LayeredSiteModel.solved(LIGHT, site, omega_max=1.0)


@pytest.mark.parametrize('thickness', [0.2, 1.0])
def test_layers_of_one_soil_reflect_nothing(thickness):
    """Closed forms and cuts of a half-space against the sum over the waves of its elements."""
    even = SurfaceWaves.of(0.3, 0.05, 20.0)
    layered = waves_on(LayeredSoil((Layer(thickness, UNIT),), UNIT))
    for a0 in (0.1, 2.0, 4.0):
        exact, found = (RectangleSolver(waves, 1.0, 4.0, NO_POINTS).compliance(a0)[0]
                        for waves in (even, layered))
        # Measured: 1e-5 at the lowest, 1e-4 at the highest.
        assert over_diagonals(found - exact, exact).max() < 2e-4


def strips(count):
    """Return as many strips of a disc of radius 1, each of the area that it stands for."""
    edges = np.sin(np.linspace(-0.5, 0.5, count + 1) * math.pi)
    under = 0.5 * (edges * np.sqrt(1.0 - edges**2) + np.arcsin(edges))
    return tuple(Part(0.5 * (high - low), area / (high - low), 0.5 * (low + high), 0.0)
                 for low, high, area in zip(edges, edges[1:], np.diff(under), strict=False))


@pytest.mark.parametrize('ground', [ON_ROCK, CRUST])
def test_strips_of_a_disc_are_the_disc_of_thin_layers(ground):
    """Independent of it: no mesh at the edge of a disc, another equation."""
    waves = waves_on(ground)
    few, many = (PatchSolver(waves, (strips(count),), ORIGIN, 2.0, NO_POINTS).compliance(1.3)[0]
                 for count in (8, 16))
    # The error of the staircase falls with the width of the strips.
    found = 2.0 * many - few
    [exact] = exact_compliance(ground, SURFACE, Radii(1.0, 1.0, 1.0, 1.0, 1.0), np.array([1.3]))
    own = np.sqrt(np.abs(exact[[0, 1, 2, 3, 4]]))
    error = np.abs(np.array([found[0, 0], found[2, 2], found[3, 3], found[4, 4], found[5, 5]])
                   - exact[:5]) / own**2
    # On a half-space the staircase costs as much in rocking.
    assert (error < [3e-3, 2e-3, 9e-3, 9e-3, 5e-3]).all()
    assert abs(found[0, 4] - exact[5]) < 3e-3 * own[0] * own[3]


def test_patches_are_the_series_and_points_are_tiny_blocks():
    place, waves = (3.0, 1.0), waves_on(ON_ROCK, 5.0)
    exact, moved = RectangleSolver(waves, 1.0, 3.0, np.array([place])).compliance(1.3)
    blocks = ((Part(0.5, 1.0, -0.5, 0.0), Part(0.5, 1.0, 0.5, 0.0)), (Part(0.02, 0.02, *place),))
    found, _ = PatchSolver(waves, blocks, np.array([[0.0, 0.0], place]), 3.0,
                           NO_POINTS).compliance(1.3)
    assert over_diagonals(found[:6, :6] - exact, exact).max() < 3e-3
    assert np.abs(found[6:9, :6] - moved[0]).max() < 5e-3 * np.abs(moved).max()


def test_more_elements_say_the_same():
    """A fifth of the error that is stated: 0.5 % of this plan."""
    for ground in (ON_ROCK, CRUST):
        waves = waves_on(ground)
        for a0 in (0.3, 1.5):
            found, finer = (RectangleSolver(waves, 1.5, highest, NO_POINTS).compliance(a0)[0]
                            for highest in (2.0, 6.0))
            assert over_diagonals(found - finer, finer).max() < 2e-3


def test_a_table_is_its_solves_and_every_row_is_reciprocal_and_passive(two_on_rock):
    omega = np.linspace(0.0, 1.0, 300)
    values = two_on_rock.compliance(omega)
    np.testing.assert_array_equal(values, values.swapaxes(1, 2))
    size = np.sqrt(np.abs(np.diagonal(values, axis1=1, axis2=2)))
    loss = np.linalg.eigvalsh(-values.imag / (size[:, :, None] * size[:, None]))
    assert loss.min() > 0.0
    of, table = two_on_rock.table.of, two_on_rock.table.functions
    edges = table.edges
    assert len(edges) > 2
    for left, right in pairwise(edges.tolist()):
        a0 = left + 0.37 * (right - left)
        exact = solver_of(of, (max(left, 0.02), right))[0].solve(a0)
        found = two_on_rock.table.values(np.array([a0]))[0]
        assert over_diagonals(found[:12] - exact[:12], exact[:12]).max() < 2.0 * max(
            table.measured_error, 1e-4)
    # From one piece to the next, each of its own solves, without a step.
    below, above = (two_on_rock.table.values(edges[1:-1] * side)
                    for side in (1.0 - 1e-12, 1.0 + 1e-12))
    assert over_diagonals(below[:, :12] - above[:, :12], below[:, :12]).max() < 3e-4


def test_a_half_space_told_in_layers_is_the_half_space():
    ground = LayeredSoil((Layer(0.05, UNIT), Layer(1.0, UNIT)), UNIT)
    site = Site.of((Rectangle(2.0, 1.0),), ((0.0, 0.0),))
    found = LayeredSiteModel.solved(ground, site, omega_max=2.0)
    assert found.singular.size == 0
    exact = BoundaryElementModel.solved_together(UNIT, site, omega_max=2.0)
    omega = np.linspace(0.0, 2.0, 60)
    own = exact.compliance(omega)
    assert over_diagonals(found.compliance(omega) - own, own).max() < 5e-4


def test_size_and_stiffness_are_a_scale(two_on_rock):
    length, modulus, density = 0.8, 50e6, 1900.0
    ground = LayeredSoil(tuple(Layer(length * layer.thickness, replace(
        layer.soil, shear_modulus=modulus * layer.soil.shear_modulus,
        density=density * layer.soil.density)) for layer in LIGHT.layers), None)
    site = Site.of((Rectangle(0.8, 0.8), Rectangle(0.8, 1.2)), ((1.0, 0.0), (3.0, 0.0)),
                   ((1.0, 3.2),))
    assert LayeredSite.of(ground, site, omega_max=0.99 * math.sqrt(modulus / density) / length
                          ) == two_on_rock.table.of
    real = replace(two_on_rock, ground=ground, site=site)
    omega = np.array([0.3, 0.9])
    power = np.tile([0, 0, 0, 1, 1, 1], 2)
    scale = modulus * length ** (1.0 + power[:, None] + power)
    np.testing.assert_allclose(real.compliance(omega * real.unit) * scale,
                               two_on_rock.compliance(omega), rtol=1e-9, atol=1e-12)
    twice = real.scaled(modulus=2.0)
    np.testing.assert_allclose(twice.compliance(omega * twice.unit) * 2.0 * scale,
                               two_on_rock.compliance(omega), rtol=1e-9, atol=1e-12)


def test_a_table_survives_a_file(two_on_rock):
    table = two_on_rock.table
    again = LayeredSiteTable.from_arrays(table.of, table.to_arrays())
    a0 = np.linspace(0.0, 1.0, 7)
    np.testing.assert_array_equal(again.values(a0), table.values(a0))


@pytest.mark.parametrize('ground, contact, omega, message', [
    (LayeredSoil((Layer(0.05, UNIT),), None), SQUARE, 1.0,
     r'thickness must be >= 0\.1 m, 0\.1 of the shortest half side .* uppermost layer'),
    (LayeredSoil((Layer(1.0, replace(UNIT, poisson_ratio=0.495)),), None), SQUARE, 1.0,
     r'poisson_ratio must be <= 0\.49 for boundary elements'),
    (ON_ROCK, SQUARE, 15.0, r'a0 must be <= 12'),
    (LayeredSoil((Layer(0.5, UNIT),), replace(UNIT, shear_modulus=0.01)), Rectangle(1.0, 4.0),
     3.9, 'boundary elements must be at most')])
def test_what_is_out_of_reach_is_refused_before_it_is_solved(ground, contact, omega, message):
    with pytest.raises(RotorSoilError, match=message):
        LayeredSite.of(ground, Site.of((contact,), ((0.0, 0.0),)), omega_max=omega)


def test_a_table_is_not_extrapolated(two_on_rock):
    with pytest.raises(OutOfTableError, match=r'frequency must be in \[0, 1\] rad/s'):
        two_on_rock.compliance(np.array([1.5]))
