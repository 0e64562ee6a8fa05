"""Branch points that a table shows: closed forms, layers on rock, and curves that have none."""

import numpy as np
import pytest

from rotorsoil_ros.ground.branch_points import branch_points
from rotorsoil_ros.ground.cone import ConeModel
from rotorsoil_ros.ground.layers.profile import Layer, LayeredSoil, SURFACE
from rotorsoil_ros.ground.layers.tabulate import exact_compliance, Radii
from rotorsoil_ros.ground.soil import Rectangle, Soil

NOISE = np.random.default_rng(0)


def of_diagonal(*functions):
    values = np.zeros((len(functions[0]), 6, 6), dtype=complex)
    for index, function in enumerate(functions):
        values[:, index, index] = function
    return values


def rows(count):
    return np.linspace(2.0, 100.0, count)


@pytest.mark.parametrize('loss', [0.005, 0.01, 0.04, 0.1])
@pytest.mark.parametrize('count', [50, 200])
def test_a_logarithm_beside_the_real_axis_is_found(loss, count):
    omega = rows(count)
    smooth = 1.0 / (150.0**2 * (1.0 + 0.1j) - omega**2) * 150.0**2
    own = np.log(1.0 + 1j * loss - (omega / 40.0) ** 2)
    found = branch_points(omega, of_diagonal(smooth - 0.2 * own, smooth))
    assert found == pytest.approx([40.0], rel=1e-2)


def test_a_resonance_is_no_branch_point():
    omega = rows(150)
    assert branch_points(omega, of_diagonal(
        1.0 / (1.0 + 0.1j - (omega / 40.0) ** 2), 1.0 / (1.0 + 0.02j - (omega / 70.0) ** 2),
        np.ones(150))).size == 0


@pytest.mark.parametrize('count, noise', [(12, 0.0), (60, 0.0), (300, 0.0), (60, 1e-2)])
@pytest.mark.parametrize('loss', [0.0, 0.1])
def test_cones_have_none(count, noise, loss):
    omega = np.linspace(2.0, 900.0, count)
    values = ConeModel(Soil(1e8, 0.3, 1900.0, loss), Rectangle(1.0, 1.5)).compliance(omega)
    assert branch_points(omega, values * (
        1.0 + noise * NOISE.standard_normal(values.shape))).size == 0


@pytest.fixture(scope='module')
def on_rock():
    """Return rows of a disc on a layer of two radii on rock, nu 0.3: 80 of them to a0 = 3."""
    a0 = np.linspace(0.05, 3.0, 80)
    ground = LayeredSoil((Layer(2.0, Soil(1.0, 0.3, 1.0, 0.03)),), None)
    found = exact_compliance(ground, SURFACE, Radii(1.0, 1.0, 1.0, 1.0, 1.0), a0)
    return a0, of_diagonal(*found[:, [0, 0, 1, 2, 3, 4]].T)


@pytest.mark.parametrize('noise', [0.0, 1e-3, 1e-2])
def test_cut_offs_of_a_layer_on_rock_are_found(on_rock, noise):
    a0, values = on_rock
    found = branch_points(a0, values * (1.0 + noise * NOISE.standard_normal(values.shape)))
    shear = np.pi / 4.0
    pressure = shear * np.sqrt(2.0 * 0.7 / 0.4)
    for expected in (shear, 3.0 * shear):
        assert np.abs(found / expected - 1.0).min() < 1.5e-2
    # The wave of no group velocity below the cut-off of pressure waves, and that, are one here.
    assert np.abs(found / (0.981 * pressure) - 1.0).min() < 2e-2
    assert len(found) <= 4


def test_too_few_rows_tell_none():
    omega = rows(10)
    assert branch_points(omega, of_diagonal(
        np.log(1.0 + 0.05j - (omega / 40.0) ** 2), np.ones(10))).size == 0
