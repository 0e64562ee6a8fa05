"""Thin layers against rigorous tables, closed forms and published cylinders."""

import json
import math
from pathlib import Path

import numpy as np
import pytest

from rotorsoil_ros.ground.layers.cylinder import HEAVE, RigidCylinder, SWAY, TWIST
from rotorsoil_ros.ground.layers.line import LineMesh, VerticalLine
from rotorsoil_ros.ground.layers.profile import Embedment, Layer, LayeredSoil
from rotorsoil_ros.ground.layers.table import entry_scale
from rotorsoil_ros.ground.layers.tabulate import exact_compliance, Radii
from rotorsoil_ros.ground.soil import Soil

from oracles.published import half_space

REFERENCE = Path(__file__).parents[2] / 'reference'
DISC_QUANTITIES = ('Fh', 'Fv', 'Fr', 'Fhr', 'Ft')
UNIT = Radii(1.0, 1.0, 1.0, 1.0, 1.0)


def soil(nu=0.3, eta=0.05, modulus=1.0, density=1.0):
    return Soil(modulus, nu, density, eta)


def on_rock(depth, **kinds):
    return LayeredSoil((Layer(depth, soil(**kinds)),), None)


def disc(ground, a0, *, embedment=None, **options):
    """Return xx, zz, ryry, x_ry and rzrz of a cylinder of radius one, (n, 5)."""
    found = exact_compliance(ground, embedment or Embedment(), UNIT, np.atleast_1d(a0), **options)
    return found[:, [0, 1, 3, 5, 4]]


def off(found, expected):
    """Return errors, of the coupling relative to the mean of its diagonals."""
    scale = np.abs(expected)
    scale[:, 3] = np.sqrt(scale[:, 0] * scale[:, 2])
    return np.abs(found - expected) / scale


def reference_ground(name):
    told = json.loads((REFERENCE / 'ground' / f'{name}.json').read_text())

    def made(entry):
        return Soil(entry['shear_modulus'], entry['poisson_ratio'], entry['density'],
                    entry['loss_factor'])

    layers = tuple(Layer(one['thickness'], made(one)) for one in told['layers'])
    below = None if told['base'] is None else made(told['base'])
    rows = np.loadtxt(REFERENCE / 'ground' / f'{name}.csv', delimiter=',', skiprows=1)
    return (LayeredSoil(layers, below), Embedment(told['embedment']), rows[:, 0],
            rows[:, 1::2] + 1j * rows[:, 2::2])


@pytest.mark.parametrize('name', [
    'rock_d1', 'rock_d4', 'crust_over_soft', 'three_layers', 'emb0.5_half', 'emb1_rock3'])
def test_reference_tables_are_met(name):
    ground, embedment, a0, expected = reference_ground(name)
    some = np.linspace(0, len(a0) - 1, 7).astype(int)
    found = disc(ground, a0[some], embedment=embedment, span=(0.05, 6.0))
    # The tables are good to 0.03 %; 0.06 % is what the mesh adds in rocking.
    assert off(found, expected[some]).max() < 9e-4


@pytest.mark.parametrize('thicknesses', [(), (0.7,), (0.3, 1.1), (0.2, 0.5, 2.0)])
def test_identical_layers_are_the_half_space(thicknesses):
    own = soil(nu=0.25, eta=0.1)
    ground = LayeredSoil(tuple(Layer(one, own) for one in thicknesses), own)
    tabulated, columns = half_space('disk_bonded_nu0.25_eta0.10.csv', DISC_QUANTITIES)
    a0 = np.array([0.2, 1.0, 3.0, 6.0])
    expected = columns[np.searchsorted(tabulated, a0)]
    assert off(disc(ground, a0, span=(0.05, 6.0)), expected).max() < 5e-4


def test_wave_that_is_pushed_over_the_real_axis_by_the_end_is_still_outgoing():
    # By the sign of Im k alone, these are off by 77 %, 96 % and 730 % without damping.
    tabulated, columns = half_space('disk_bonded_nu0.25_eta0.00.csv', DISC_QUANTITIES)
    a0 = np.array([2.0, 3.0, 6.0])
    found = disc(LayeredSoil((), soil(nu=0.25, eta=0.005)), a0, span=(0.05, 6.0))
    # What the least loss factor itself changes.
    assert off(found, columns[np.searchsorted(tabulated, a0)]).max() < 0.02


@pytest.mark.parametrize('depth, expected', [(0.5, 13.23), (1.0, 19.89), (2.0, 32.75)])
def test_torsion_of_an_embedded_cylinder_is_that_of_luco(depth, expected):
    found = disc(LayeredSoil((), soil(eta=0.005)), 0.02, embedment=Embedment(depth))[0, 4]
    assert (1.0 / found).real == pytest.approx(expected, rel=3e-3)


def test_heave_at_rest_is_that_of_the_welded_disc():
    nu = 0.25
    exact = 4.0 * math.log(3.0 - 4.0 * nu) / (1.0 - 2.0 * nu)  # Mossakovskii
    found = disc(LayeredSoil((), soil(nu=nu, eta=0.005)), 0.002)[0, 1]
    assert (1.0 / found).real == pytest.approx(exact, rel=1e-3)


@pytest.mark.parametrize('depth', [0.0, 0.5, 1.0])
def test_fast_vibration_sends_plane_waves_from_base_and_wall(depth):
    # Luco et al. (1978): dashpots of the base, rho c A, and of the wall.
    a0, nu = 20.0, 0.25
    found = disc(LayeredSoil((), soil(nu=nu, eta=0.005)), a0, embedment=Embedment(depth))[0]
    determinant = found[0] * found[2] - found[3] ** 2
    damping = np.array([found[2] / determinant, 1.0 / found[1], 1.0 / found[4]]).imag / a0
    pressure = math.sqrt(2.0 * (1.0 - nu) / (1.0 - 2.0 * nu))
    expected = np.array([math.pi * (1.0 + depth * (1.0 + pressure)),
                         math.pi * pressure + 2.0 * math.pi * depth,
                         0.5 * math.pi + 2.0 * math.pi * depth])
    np.testing.assert_allclose(damping, expected, rtol=1e-2)


def test_contact_of_the_wall_only_stiffens():
    # Welded, lower half welded, open trench, on the surface: Re N at a0 = 0.1, rock at 3 radii.
    expected = {1.0: [.0817, .0651, .0695, .0495], 0.5: [.0846, .0721, .1056, .0611],
                0.0: [.1334, .0905, .1984, .1387]}
    for share, values in expected.items():
        found = disc(on_rock(3.0), 0.1, embedment=Embedment(1.0, share), span=(0.05, 1.0))[0]
        # Those of the trench are from a mesh that leaves 0.4 % at its corner.
        np.testing.assert_allclose(found[[0, 1, 2, 4]].real, values,
                                   atol=1e-4 if share else 6e-4)
    found = disc(on_rock(3.0), 0.1, span=(0.05, 1.0))[0]
    np.testing.assert_allclose(found[[0, 1, 2, 4]].real, [.1822, .1238, .2484, .1867], atol=1e-4)


@pytest.mark.parametrize('share, expected', [
    (0.2, [1.010, 1.007, 1.003, 1.003]), (0.5, [1.081, 1.045, 1.022, 1.023])])
@pytest.mark.parametrize('eta', [0.01, 0.05])
def test_below_the_first_cut_off_only_the_soil_itself_damps(share, expected, eta):
    found = disc(on_rock(2.0, eta=eta), share * math.pi / 4.0, span=(0.1, 1.0))[0, [0, 1, 2, 4]]
    np.testing.assert_allclose(-found.imag / (eta * found.real), expected, atol=2e-3)


def test_ground_takes_energy_in_every_motion():
    a0 = np.append(0.2 * math.pi / 4.0, np.linspace(0.05, 6.0, 29))
    found = disc(on_rock(2.0, eta=0.01), a0, span=(0.05, 6.0))
    sway = -np.array([[found[:, 0], found[:, 3]], [found[:, 3], found[:, 2]]]).imag
    assert np.linalg.eigvalsh(sway.transpose(2, 0, 1)).min() > 0.0
    assert (found[:, [1, 4]].imag < 0.0).all()


@pytest.mark.parametrize('motion', [SWAY, HEAVE, TWIST])
def test_both_macro_elements_are_reciprocal(motion):
    line = VerticalLine.through(on_rock(3.0), Embedment(1.0), radius=1.0, lowest=0.1, highest=2.0,
                                mesh=LineMesh())
    at = RigidCylinder(line).at(1.3)
    _, _, own = at.beneath(motion, 1.0)
    np.testing.assert_allclose(own, own.T, rtol=1e-8, atol=1e-8 * np.abs(own).max())
    total = at.stiffness(motion, 1.0)
    np.testing.assert_allclose(total, total.T, rtol=1e-9, atol=1e-9 * np.abs(total).max())


def test_finer_elements_at_the_edge_halve_the_error():
    ground, a0 = on_rock(1.0, nu=0.25), np.array([1.0])
    finest = disc(ground, a0, mesh=LineMesh(order=6, smallest=2e-4, per_wave=0.3))
    errors = [off(disc(ground, a0, mesh=LineMesh(smallest=smallest)), finest)[0, :3].max()
              for smallest in (0.016, 0.008)]
    assert errors[1] == pytest.approx(0.5 * errors[0], rel=0.25)


def test_nearly_incompressible_layer_does_not_lock():
    a0 = np.array([0.5, 2.0])
    usual, fine = (disc(on_rock(2.0, nu=0.499), a0, mesh=mesh, span=(0.05, 3.0))
                   for mesh in (LineMesh(), LineMesh(order=6, smallest=0.001, per_wave=0.2)))
    assert off(usual, fine).max() < 2e-3


def test_waves_above_rock_go_the_way_they_decay_up_to_a_cut_off():
    """Energy and decay disagree just below one where little is lost: rows jumped by a third."""
    unit = Soil(1.0, 0.21, 1.0, 0.05)
    ground = LayeredSoil((
        Layer(0.62, unit), Layer(1.57, Soil(3.06, 0.375, 1.23, 0.008)),
        Layer(0.33, Soil(7.38, 0.436, 1.07, 0.011)),
        Layer(0.33, Soil(4.83, 0.234, 1.28, 0.088))), None)
    a0 = np.linspace(1.80, 1.90, 41)
    values = exact_compliance(ground, Embedment(), UNIT, a0)
    # A cubic through neighbours meets each row.
    between = (4.0 * (values[1:-3] + values[3:-1]) - values[:-4] - values[4:]) / 6.0
    assert (np.abs(between - values[2:-2]) / entry_scale(values[2:-2])).max() < 1e-3


def test_open_trench_is_resolved_as_well_as_a_wall():
    ground = LayeredSoil((Layer(3.0, Soil(1.0, 0.45, 1.0, 0.03)),), Soil(4.0, 0.3, 1.0, 0.03))
    found, finer = (exact_compliance(ground, Embedment(1.0, 0.0), UNIT, np.ones(1), mesh=mesh)
                    for mesh in (None, LineMesh(smallest=0.00025)))
    # The singularity of a corner of three quarters of a space: linear in the smallest element.
    assert (np.abs(found - finer) / entry_scale(finer)).max() < 1e-3
