"""The drawn machine is the machine: shape, orbits and scale."""

from dataclasses import replace
import math

import numpy as np
import pytest

from rotorsoil_ros.ground.layers.profile import Embedment
from rotorsoil_ros.screen.scene import round_scale, Scene


@pytest.fixture
def scene(machine):
    return Scene(machine.case, machine.table.channels)


@pytest.fixture
def channel(machine):
    return machine.table.channels.index


@pytest.fixture
def line(scene):
    [line] = scene.lines
    return line


def motion(machine, **amplitudes):
    """Return one row of displacements, zero but for the named channels."""
    row = np.zeros((1, len(machine.table.channels)), dtype=complex)
    for name, value in amplitudes.items():
        row[0, machine.table.channels.index(name)] = value
    return row


def test_the_shaft_passes_through_its_stations_and_no_further_is_bent(line):
    places = np.array([station.y for station in line.stations])
    offsets = np.random.default_rng(2).normal(size=(1, len(places), 2))
    shaft = line.shaft(offsets)[0]
    np.testing.assert_allclose(shaft[:, 1], line.y)
    for number, place in enumerate(places):
        x = np.interp(place, line.y, shaft[:, 0])
        z = np.interp(place, line.y, shaft[:, 2]) - line.start[2]
        # 61 points are joined by straight lines: a hundredth of the offsets.
        np.testing.assert_allclose([x, z], offsets[0, number], atol=2e-2)


def test_a_shaft_that_tilts_is_straight(line):
    places = np.array([station.y for station in line.stations])
    offsets = np.stack([0.1 + places, -places], axis=1)[None]
    shaft = line.shaft(offsets)[0]
    np.testing.assert_allclose(shaft[:, 0], 0.1 + line.y, atol=1e-12)
    np.testing.assert_allclose(shaft[:, 2], line.start[2] - line.y, atol=1e-12)


def test_positive_spin_takes_z_into_x(line, machine):
    # x = sin, z = cos: X = -i, Z = 1, as a forward unbalance drives it.
    row = motion(machine, disc_1_x=-1j, disc_1_z=1.0)
    disc = [station.name for station in line.stations].index('disc_1')
    for turn, expected in ((0.0, (0.0, 1.0)), (0.5 * math.pi, (1.0, 0.0))):
        got = line.offsets(np.real(row * np.exp(1j * turn)))[0, disc]
        np.testing.assert_allclose(got, expected, atol=1e-15)


def test_an_orbit_is_the_scaled_path_of_its_station(line, machine):
    orbit = line.orbits(motion(machine, disc_2_x=-2j, disc_2_z=1.0), np.array([3.0]))
    disc = [station.name for station in line.stations].index('disc_2')
    x, z = orbit[0, disc, :, 0], orbit[0, disc, :, 2] - line.start[2]
    np.testing.assert_allclose((x / 6.0)**2 + (z / 3.0)**2, 1.0, rtol=1e-12)


def test_a_disc_has_the_radius_of_its_inertia(line):
    disc = next(station for station in line.stations if station.name == 'disc_1')
    assert disc.radius == pytest.approx(math.sqrt(2.0 * 2.0e-3 / 0.7))


def test_rocking_counts_by_how_far_it_moves_the_block(scene, machine):
    assert scene.largest(np.abs(motion(machine, disc_1_x=3.0j)))[0] == 3.0
    assert scene.largest(np.abs(motion(machine, block_ry=2.0)))[0] == pytest.approx(2.0 * 0.5)
    assert math.isnan(scene.largest(np.abs(motion(machine, disc_1_x=math.nan)))[0])


@pytest.mark.parametrize('wanted, scale', [
    (1.0, 1.0), (1.99, 1.0), (2.0, 2.0), (4.9, 2.0), (9.99, 5.0), (12345.0, 10000.0),
    (0.3, 0.2), (1e-4, 1e-4)])
def test_scales_are_round(wanted, scale):
    assert round_scale(wanted) == pytest.approx(scale, rel=1e-12)


def test_a_scale_is_kept_until_the_picture_would_be_too_large_or_too_small(scene):
    largest = np.array([1e-5, 1.4e-5, 0.0, 0.9e-5, 1e-3, 1e-5])
    scales = scene.scales(largest, 1.0)
    assert scales.tolist() == [10000.0, 5000.0, 5000.0, 5000.0, 100.0, 10000.0]


def test_a_block_is_as_high_as_its_case_says(machine):
    [block] = machine.case.foundations
    case = replace(machine.case, foundations=(replace(block, height=0.3),))
    [drawn] = Scene(case, machine.table.channels).blocks
    assert (drawn.height, drawn.is_schematic) == (0.3, False)
    [unknown] = Scene(machine.case, machine.table.channels).blocks
    assert unknown.is_schematic


def test_a_block_stands_in_its_hole(machine):
    case = replace(machine.case, embedments=(Embedment(0.25),))
    [block] = Scene(case, machine.table.channels).blocks
    rim, *edges = block.hole
    assert {point[2] for point in rim} == {0.25}
    assert min(abs(x) for x, _, _ in rim) > block.half_width
    # From the edge of the ground down to each corner of the base.
    assert [edge[1][2] for edge in edges] == [0.0] * 4
    [on_surface] = Scene(machine.case, machine.table.channels).blocks
    assert on_surface.hole == []
