"""Tables of layered ground: cut-offs, pieces, what scales, and what is refused."""

from dataclasses import replace
import math

import numpy as np
import pytest

from rotorsoil_ros.errors import OutOfTableError, RotorSoilError
from rotorsoil_ros.ground.layers.cutoffs import singular_frequencies
from rotorsoil_ros.ground.layers.model import Proportions, ThinLayerModel
from rotorsoil_ros.ground.layers.profile import Embedment, Layer, LayeredSoil
from rotorsoil_ros.ground.layers.table import entry_scale, LayeredTable
from rotorsoil_ros.ground.layers.tabulate import exact_compliance, Radii, tabulate
from rotorsoil_ros.ground.soil import Circle, Rectangle, Soil

CLAY = Soil(20e6, 0.4, 1800.0, 0.06)
SAND = Soil(60e6, 0.3, 1900.0, 0.05)
ROCK = Soil(5e9, 0.25, 2400.0, 0.02)
UNIT = Soil(1.0, 0.3, 1.0, 0.05)


@pytest.fixture(scope='module')
def on_rock():
    return ThinLayerModel.solved(LayeredSoil((Layer(2.0, SAND),), None), Rectangle(1.0, 1.5),
                                 omega_max=300.0)


def test_cut_offs_of_a_layer_are_odd_quarter_waves():
    found = singular_frequencies(LayeredSoil((Layer(2.0, UNIT),), None), 4.0)
    pressure = math.sqrt(2.0 * 0.7 / 0.4)
    quarter = math.pi / 4.0
    for expected in (quarter, 3.0 * quarter, 5.0 * quarter, pressure * quarter):
        assert np.abs(found / expected - 1.0).min() < 1e-4
    # Of zero group velocity, nu = 0.3: 0.981 of the first cut-off of pressure waves.
    assert np.abs(found / (0.981 * pressure * quarter) - 1.0).min() < 2e-3


@pytest.mark.parametrize('below, has_some', [
    (SAND, False), (replace(SAND, shear_modulus=120e6), False), (ROCK, True)])
def test_only_what_is_like_rock_makes_cut_offs(below, has_some):
    ground = LayeredSoil((Layer(3.0, CLAY),), below)
    assert (len(singular_frequencies(ground, 120.0)) > 0) is has_some


@pytest.mark.parametrize('ground', [
    LayeredSoil((Layer(1.0, replace(UNIT, poisson_ratio=0.25)),), None),
    LayeredSoil((Layer(0.5, replace(UNIT, shear_modulus=4.0)),), UNIT)], ids=['rock', 'crust'])
def test_own_check_of_a_table_is_not_optimistic(ground):
    radii = Radii(1.0, 1.0, 1.0, 1.0, 1.0)
    table = tabulate(ground, Embedment(), radii, a0_max=3.0)
    a0 = np.sort(np.random.default_rng(0).uniform(0.05, 3.0, 40))
    exact = exact_compliance(ground, Embedment(), radii, a0, span=(0.02, 3.0))
    error = (np.abs(table.compliance(a0) - exact) / entry_scale(exact)).max()
    # Pieces have meshes of their own, which differ by less than this.
    assert error < table.measured_error + 2e-4
    assert table.measured_error <= 1e-4


def test_table_of_contrasts_and_little_damping_settles():
    # Nearly incompressible crust on soft clay on rock, a base between them: round-off of 1e-4.
    crust = Soil(40e6, 0.49, 1900.0, 0.005)
    clay = Soil(10e6, 0.45, 1900.0, 0.01)
    model = ThinLayerModel.solved(
        LayeredSoil((Layer(0.4, crust), Layer(2.0, clay)), None), Circle(1.0), omega_max=80.0,
        embedment=Embedment(0.4))
    assert model.table.measured_error <= 1e-3


def test_table_survives_its_file(on_rock):
    again = LayeredTable.from_arrays(on_rock.table.to_arrays())
    a0 = np.linspace(0.0, again.edges[-1], 50)
    np.testing.assert_array_equal(again.compliance(a0), on_rock.table.compliance(a0))


def test_one_factor_on_all_moduli_is_a_rescaling(on_rock):
    stiffer = on_rock.scaled(modulus=4.0)
    omega = np.array([0.0, 40.0, 110.0, 250.0])
    np.testing.assert_allclose(stiffer.compliance(2.0 * omega), on_rock.compliance(omega) / 4.0,
                               rtol=1e-12)
    given, scaled = (Proportions.of(ground, on_rock.contact, Embedment(), omega_max=omega_max)
                     for ground, omega_max in ((on_rock.ground, 300.0),
                                               (stiffer.ground, 600.0)))
    assert given == scaled


def test_proportions_alone_identify_a_table():
    one = Proportions.of(LayeredSoil((Layer(1.0, CLAY), Layer(2.0, SAND)), None), Circle(0.5),
                         Embedment(0.5), omega_max=100.0)
    other = Proportions.of(LayeredSoil((Layer(3.0, CLAY), Layer(6.0, SAND)), None), Circle(1.5),
                           Embedment(1.5), omega_max=33.0)
    assert one == other


def test_every_motion_of_a_rectangle_loses_energy(on_rock):
    found = on_rock.compliance(np.linspace(0.0, on_rock.omega_range[1], 200))
    np.testing.assert_array_equal(found, found.swapaxes(1, 2))
    size = np.sqrt(np.abs(np.einsum('nii->ni', found)))
    loss = -(found / (size[:, :, None] * size[:, None])).imag
    assert np.linalg.eigvalsh(loss).min() > 0.0


def test_couplings_of_both_directions_have_opposite_signs(on_rock):
    found = on_rock.compliance(np.array([50.0]))[0]
    assert found[0, 4].real > 0.0 > found[1, 3].real


def test_circle_stiffens_evenly():
    model = ThinLayerModel.solved(LayeredSoil((Layer(1.0, CLAY),), SAND), Circle(1.0),
                                  omega_max=60.0, embedment=Embedment(0.4, 0.5))
    found = model.compliance(np.array([0.0, 30.0]))
    np.testing.assert_allclose(found[:, 0, 0], found[:, 1, 1], rtol=1e-12)
    np.testing.assert_allclose(found[:, 3, 3], found[:, 4, 4], rtol=1e-12)
    np.testing.assert_allclose(found[:, 0, 4], -found[:, 1, 3], rtol=1e-12)


def test_singular_frequencies_are_those_of_the_ground(on_rock):
    expected = SAND.shear_wave_speed * 2.0 * math.pi / 8.0
    assert on_rock.singular[0] == pytest.approx(expected, rel=1e-4)


def test_table_is_not_extrapolated(on_rock):
    with pytest.raises(OutOfTableError, match='where layered ground was solved'):
        on_rock.compliance(np.array([1.01 * on_rock.omega_range[1]]))


def test_rock_at_a_depth_cuts_and_deepens():
    ground = LayeredSoil((Layer(1.0, CLAY), Layer(2.0, SAND)), ROCK)
    assert [(one.thickness, one.soil) for one in ground.on_rock(2.0).layers] == [
        (1.0, CLAY), (1.0, SAND)]
    assert ground.on_rock(4.0).layers == (Layer(1.0, CLAY), Layer(2.0, SAND), Layer(1.0, ROCK))
    assert LayeredSoil((Layer(1.0, CLAY),), None).on_rock(3.0).layers == (Layer(3.0, CLAY),)


@pytest.mark.parametrize('wrong, message', [
    (lambda: Layer(0.0, CLAY), r'thickness must be > 0 m'),
    (lambda: LayeredSoil((), None), 'at least one above rigid rock'),
    (lambda: LayeredSoil((Layer(1.0, replace(CLAY, loss_factor=0.0)),), None),
     r'loss_factor must be >= 0\.005 in layered'),
    (lambda: LayeredSoil((Layer(1.0, replace(CLAY, poisson_ratio=0.4995)),), None),
     r'poisson_ratio must be <= 0\.499'),
    (lambda: Embedment(-1.0), r'embedment must be >= 0 m'),
    (lambda: Embedment(1.0, 1.5), r'side_contact must be in \[0, 1\]'),
    (lambda: Embedment(0.0, 0.5), 'side_contact must stand beside an embedment > 0 m'),
    (lambda: Proportions.of(LayeredSoil((Layer(1.0, CLAY),), None), Circle(1.0), Embedment(1.0),
                            omega_max=10.0), r'embedment must be < 1 m, where the rock begins'),
    (lambda: Proportions.of(LayeredSoil((Layer(1e-3, CLAY),), SAND), Circle(1.0), Embedment(),
                            omega_max=10.0), r'thickness must be >= 0\.01 of the radius'),
    (lambda: Proportions.of(LayeredSoil((), SAND), Circle(1.0), Embedment(), omega_max=1e5),
     r'a0 must be <= 20')])
def test_impossible_ground_is_refused(wrong, message):
    with pytest.raises(RotorSoilError, match=message):
        wrong()
