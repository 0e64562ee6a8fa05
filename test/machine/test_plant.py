"""Several machines on one block: a dense solve, closed forms, mirrors and reciprocity."""

import csv
from dataclasses import dataclass, replace
import math
from pathlib import Path

import numpy as np
import pytest

from rotorsoil_ros.case import config
from rotorsoil_ros.errors import OutOfTableError, RotorSoilError
from rotorsoil_ros.ground.cone import ConeModel
from rotorsoil_ros.ground.soil import Rectangle, Soil
from rotorsoil_ros.machine.coupled import UNBALANCE_FORCE
from rotorsoil_ros.machine.foundation import Foundation
from rotorsoil_ros.machine.placement import Placement
from rotorsoil_ros.machine.plant.neighbour import Neighbour
from rotorsoil_ros.machine.plant.source import SourceModel
from rotorsoil_ros.rotor.bearing import SpeedTable
from rotorsoil_ros.rotor.disc import Disc
from rotorsoil_ros.rotor.shaft import Material
from rotorsoil_ros.units import rpm_to_rad_s

from machines import (
    bearing,
    channel,
    elastic_machine,
    paper_rotor,
    renamed,
    Restrained,
    SOIL,
    Springs,
    two_blocks,
    uniform_rotor,
)
from oracles.plant import dense_plant

ROOT = Path(__file__).parents[2]
TWO_FANS = ROOT / 'test' / 'reference' / 'foundation' / 'two_fans.csv'
PLACES = {'parallel': (Placement(-1.25, -0.2), Placement(1.25, -0.2)),
          'facing': (Placement(-1.25, -0.2), Placement(1.25, 1.3, math.pi))}


@dataclass(frozen=True, slots=True)
class WeighedBlock(Foundation):
    """A block whose mass matrix somebody has worked out, centre of gravity aside."""

    matrix: tuple[float, ...] = ()

    @property
    def mass_matrix(self):
        """The matrix."""
        return np.array(self.matrix).reshape(6, 6)


@pytest.fixture(scope='module')
def fan():
    return config.load(ROOT / 'config' / 'plant_fan.yaml').rotor


@pytest.fixture(scope='module')
def reference():
    """Return the numbers of the header and the rows of the file."""
    lines = TWO_FANS.read_text().splitlines()
    head = next(line for line in lines if 'mass matrix' in line)
    matrix = tuple(float(word) for word in head.rpartition(':')[2].split())
    return matrix, list(csv.DictReader(line for line in lines if not line.startswith('#')))


def fans(fan, places, *, source=0, speed=0.0, matrix=None):
    """Return one of two equal fans on the block of the reference as a source."""
    contact = Rectangle(2.5, 1.5)
    block = Foundation('block', contact, 0.0, 43200.0, 0.6, (38e3, 95e3, 120e3))
    if matrix is not None:
        block = WeighedBlock('block', contact, 0.0, matrix[0], 0.7, (1.0, 1.0, 1.0),
                             matrix=matrix)
    soil = ConeModel(Soil(100e6, 0.3, 1900.0, 0.05), contact)
    rotors = [renamed(fan, 'fan_1'), renamed(fan, 'fan_2')]
    other = 1 - source
    return SourceModel(
        rotors[source], (block,), (soil,), place=places[source],
        neighbours=(Neighbour(rotors[other], places[other], speed),), index=source)


def test_two_fans_on_one_block_are_those_of_the_dense_assembly(fan, reference):
    matrix, rows = reference
    worst = 0.0
    cases = {(row['machines'], row['source'], row['other_rpm']) for row in rows}
    for machines, source, other in sorted(cases):
        own = [row for row in rows
               if (row['machines'], row['source'], row['other_rpm']) == (machines, source, other)]
        model = fans(fan, PLACES[machines], source=int(source[-1]) - 1,
                     speed=rpm_to_rad_s(float(other)), matrix=matrix)
        speeds = sorted({float(row['source_rpm']) for row in own})
        found = model.unbalance_response(rpm_to_rad_s(np.array(speeds)), [0.0, 1.0])
        for row in own:
            got = found.displacement[speeds.index(float(row['source_rpm'])),
                                     model.channels.index(row['channel'])]
            expected = complex(float(row['real']), float(row['imag']))
            largest = np.abs(found.displacement[speeds.index(float(row['source_rpm']))]).max()
            worst = max(worst, abs(got - expected) / max(abs(expected), 1e-6 * largest))
    assert worst < 1e-7


def unlike(source=0, *, speeds=(0.0, 210.0, 150.0), place=None):
    """Return one of three machines, two of them alike in nothing, on two blocks."""
    first, second = two_blocks(cross=3e7).rotor, elastic_machine().rotor
    blocks = two_blocks().foundations
    soils = tuple(ConeModel(SOIL, block.contact) for block in blocks)
    rotors = [renamed(first, 'a'), renamed(second, 'b'), renamed(paper_rotor(), 'c', 'left')]
    places = [Placement(0.4, 0.1, 0.3), Placement(-0.5, 1.8, 2.8), place or Placement(0.0, 0.2)]
    others = [number for number in range(3) if number != source]
    return SourceModel(
        rotors[source], blocks, soils, place=places[source], index=source,
        neighbours=tuple(Neighbour(rotors[one], places[one], speeds[one]) for one in others))


def dense(model, *, omega, speed, load, ground=(0.0, 0.0, 0.0)):
    """Return rotors, housings and blocks of the full assembly of a source and its neighbours."""
    machines = [(one.rotor, (one.place.x, one.place.y, one.place.heading), one.speed)
                for one in model.neighbours]
    machines.insert(model.index, (
        model.rotor, (model.place.x, model.place.y, model.place.heading), speed))
    return dense_plant(
        model.foundations, model.support.ground(np.array([omega]))[0], machines, omega=omega,
        source=model.index, load=load, ground=ground)


def by_channel(model, rotors, housings, blocks):
    """Return what the full assembly says of every channel, (c,)."""
    found = []
    for rotor, motion, seats in zip(model.rotors, rotors, housings, strict=True):
        for index, seat in enumerate(rotor.bearings):
            node = 4 * rotor.node_of(seat.position)
            found += [*motion[node:node + 2], *seats[2 * index:2 * index + 2]]
        for station in rotor.stations[len(rotor.bearings):]:
            node = 4 * rotor.node_of(station.position)
            found += [*motion[node:node + 2]]
    return np.array([*found, *blocks])


@pytest.mark.parametrize('source', [0, 1, 2])
def test_source_among_neighbours_is_that_of_the_full_assembly(source):
    """Films, pedestals, two blocks, headings, neighbours turning and standing; loads anywhere."""
    model = unlike(source)
    rotor, disc = model.rotor, model.rotor.discs[0]
    for speed in (40.0, 133.0, 260.0):
        load = np.zeros(4 * len(rotor.node_positions), dtype=complex)
        node = 4 * rotor.node_of(disc.position)
        load[node:node + 2] = speed**2 * UNBALANCE_FORCE
        expected = by_channel(model, *dense(model, omega=speed, speed=speed, load=load))
        moments = np.eye(len(model.planes))[0]
        found = model.unbalance_response(np.array([speed]), moments).displacement[0]
        np.testing.assert_allclose(found, expected, rtol=1e-7,
                                   atol=1e-9 * np.abs(expected).max())


def test_ground_that_moves_is_that_of_the_full_assembly():
    model = unlike(1)
    still = np.zeros(4 * len(model.rotor.node_positions))
    for omega in (25.0, 140.0):
        found, _ = model.ground_response(np.array([omega]), speed=210.0)
        for column, ground in enumerate(np.eye(3)):
            expected = by_channel(model, *dense(model, omega=omega, speed=210.0, load=still,
                                                ground=ground))
            np.testing.assert_allclose(found[0, :, column], expected, rtol=1e-7, atol=1e-9)


def test_two_jeffcott_rotors_on_one_block_follow_the_closed_form():
    """Both are masses on springs on a block that can only heave."""
    k1, k2, m1, m2, own, spring = 4e6, 7e6, 30.0, 45.0, 800.0, 9e7
    block = Foundation('block', Rectangle(1.0, 1.0), 0.5, own, 0.0, (1e3, 1e3, 1e3))
    soil = Restrained(Springs(spring * np.eye(6), 1e-9 * np.eye(6)), 'z')

    def rotor(name, mass, stiffness):
        # Light, stiff shaft: the mass swings on both bearings.
        return uniform_rotor(
            length=1.0, diameter=0.2, elements=2, material=Material(1e17, 0.3, 1e-6),
            discs=[Disc(f'{name}_wheel', 0.5, mass, 1e-9, 0.0)],
            bearings=[bearing(f'{name}_{end}', place, stiffness=0.5 * stiffness)
                      for end, place in (('left', 0.0), ('right', 1.0))])

    model = SourceModel(rotor('a', m1, k1), (block,), (soil,), index=0, neighbours=(
        Neighbour(rotor('b', m2, k2), Placement(0.7, 0.0), 90.0),))
    w = np.linspace(60.0, 700.0, 50)
    swings = sum(k * m * w**2 / (k - m * w**2) for k, m in ((k1, m1), (k2, m2)))
    expected = w**2 * k1 / (k1 - m1 * w**2) / (spring - own * w**2 - swings)
    found = channel(model, model.unbalance_response(w, [1.0]), 'block_z')
    # The shaft is not quite rigid: what that shifts is largest where the curve is steep.
    np.testing.assert_allclose(found, expected, rtol=1e-6, atol=2e-5 * np.abs(expected).max())
    assert np.median(np.abs(found / expected - 1.0)) < 1e-6


def test_equal_machines_on_both_sides_of_a_block_mirror_each_other(fan):
    """Across the plane x = 0, in which the spin turns round: both stand still."""
    left, right = Placement(-1.25, -0.2), Placement(1.25, -0.2)
    first, second = (fans(fan, (left, right), source=source) for source in (0, 1))
    hz = np.array([8.0, 19.0, 31.0])
    swapped = {'fan_1': 'fan_2', 'fan_2': 'fan_1', 'block': 'block'}
    for axis, sign in (('x', -1.0), ('z', 1.0)):
        one = first.frequency_response(2 * math.pi * hz, speed=0.0,
                                       channel=f'fan_1_wheel_{axis}')
        other = second.frequency_response(2 * math.pi * hz, speed=0.0,
                                          channel=f'fan_2_wheel_{axis}')
        for name in first.channels:
            machine = next(own for own in swapped if name.startswith(own))
            twin = second.channels.index(name.replace(machine, swapped[machine], 1))
            turned = sign * (-1.0 if name.axis in ('x', 'ry', 'rz') else 1.0)
            np.testing.assert_allclose(
                other.displacement[:, twin],
                turned * one.displacement[:, first.channels.index(name)],
                rtol=1e-8, atol=1e-18)


def test_machines_at_rest_shake_each_other_alike(fan):
    """Maxwell and Betti: a force on one wheel moves the other as that one moves the first."""
    omega = 2 * math.pi * np.array([7.0, 21.0, 40.0])
    places = (Placement(-1.1, -0.4, 0.2), Placement(1.4, 1.2, 2.6))
    first, second = (fans(fan, places, source=source) for source in (0, 1))
    for here, there in (('x', 'z'), ('z', 'x'), ('x', 'x')):
        out = first.frequency_response(omega, speed=0.0, channel=f'fan_1_wheel_{here}')
        back = second.frequency_response(omega, speed=0.0, channel=f'fan_2_wheel_{there}')
        np.testing.assert_allclose(out[f'fan_2_wheel_{there}'].displacement,
                                   back[f'fan_1_wheel_{here}'].displacement, rtol=1e-8)


def test_a_journal_at_rest_is_that_of_the_slowest_speed_known():
    rotor = elastic_machine().rotor
    table = SpeedTable(np.array([50.0, 300.0]), np.stack([1e8 * np.eye(2), 3e8 * np.eye(2)]))
    rotor = replace(rotor, bearings=tuple(
        replace(one, damping=1e4 * np.eye(2)) for one in rotor.bearings))
    film = replace(rotor, bearings=tuple(replace(one, stiffness=table) for one in rotor.bearings))
    idle = Neighbour(film, Placement(), 0.0)
    slow = replace(rotor, bearings=tuple(
        replace(one, stiffness=1e8 * np.eye(2)) for one in rotor.bearings))
    omega = np.array([80.0])
    for got, expected in zip(idle.led(omega), Neighbour(slow, Placement(), 0.0).led(omega),
                             strict=True):
        np.testing.assert_allclose(got, expected, rtol=1e-9, atol=1e-12 * np.abs(expected).max())
    with pytest.raises(OutOfTableError, match='table of one'):
        Neighbour(film, Placement(), 400.0).led(omega)


def test_force_may_act_on_the_source_and_all_housings_only(fan):
    model = fans(fan, PLACES['parallel'])
    omega = np.array([50.0])
    with pytest.raises(RotorSoilError, match='force must act at one of'):
        model.frequency_response(omega, speed=0.0, channel='fan_2_wheel_x')
    # A force on a housing of a neighbour is one on the source where that stands in its place.
    out = model.frequency_response(omega, speed=0.0, channel='fan_2_fan_end_housing_z')
    back = model.frequency_response(omega, speed=0.0, channel='fan_1_wheel_z')
    np.testing.assert_allclose(out['fan_1_wheel_z'].displacement,
                               back['fan_2_fan_end_housing_z'].displacement, rtol=1e-9)
    with pytest.raises(RotorSoilError, match='index must be 0 to 1, got 2'):
        replace(model, index=2)
