"""A block is rigid as far as its first bending is above excitation and heave, and is said so."""

from itertools import permutations
import math
from pathlib import Path

import numpy as np
import pytest

from rotorsoil_ros.case.config import load
from rotorsoil_ros.case.design.rigidity import of_rigidity
from rotorsoil_ros.cli import main
from rotorsoil_ros.ground.cone import ConeModel
from rotorsoil_ros.ground.plan import Part, Plan
from rotorsoil_ros.ground.soil import Circle, Rectangle, RigidSoil, Soil
from rotorsoil_ros.machine.flexible.rigidity import free_bending, free_twist, rigidity
from rotorsoil_ros.machine.foundation import Foundation, solid_inertia

FAN = Path(__file__).parents[3] / 'config' / 'plant_fan.yaml'
SOIL = Soil(100e6, 0.3, 1900.0, 0.05)
RAFT = ['foundations.0.half_width=6', 'foundations.0.half_length=2', 'foundations.0.height=1',
        'foundations.0.mass=115200', 'foundations.0.inertia=[1.6e5, 1.39e6, 1.5e6]',
        'foundations.0.centre_of_gravity_height=0.5']


@pytest.mark.parametrize('length, thickness, by_elements', [
    (12.0, 1.0, 24.7), (6.0, 1.0, 93.0), (5.0, 1.2, 149.0), (3.0, 1.2, 346.0), (8.0, 0.8, 44.0)])
def test_free_slab_bends_as_three_dimensional_finite_elements_say(
        length, thickness, by_elements):
    # Quadratic 27-node bricks, E 30 GPa, nu 0.2, 2400 kg/m^3; the formula is within 7 %.
    found = free_bending(length=length, thickness=thickness, modulus=30e9, density=2400.0)
    assert found / (2.0 * math.pi) == pytest.approx(by_elements, rel=0.07)


@pytest.mark.parametrize('length, width, thickness, by_elements', [
    (6.0, 6.0, 0.6, 37.7), (6.0, 6.0, 1.5, 83.6), (4.0, 4.0, 2.0, 195.4), (10.0, 9.0, 0.8, 20.3),
    (6.0, 4.5, 0.4, 33.9), (2.0, 2.0, 2.0, 521.8), (3.0, 2.0, 1.2, 303.6), (5.0, 5.0, 0.3, 27.8)])
def test_free_slab_twists_as_three_dimensional_finite_elements_say(
        length, width, thickness, by_elements):
    # As above; a square slab bends half as high again.
    found = free_twist(length=length, width=width, thickness=thickness, modulus=30e9,
                       density=2400.0)
    assert found / (2.0 * math.pi) == pytest.approx(by_elements, rel=0.09)
    bent = free_bending(length=length, thickness=thickness, modulus=30e9, density=2400.0)
    assert found < bent


def test_slender_slab_is_the_beam_of_euler_and_bernoulli():
    # beta L = 4.730041 of the free-free beam; 3.56 has three digits.
    exact = 4.730041**2 * math.sqrt(30e9 * 0.01**2 / (12.0 * 2400.0)) / 10.0**2
    found = free_bending(length=10.0, thickness=0.01, modulus=30e9, density=2400.0)
    assert found == pytest.approx(exact, rel=1e-3)


def block(contact, mass=17280.0, height=1.2):
    inertia = solid_inertia(contact, mass=mass, height=height)
    return Foundation('block', contact, 0.0, mass, 0.5 * height, inertia, height)


def test_heave_is_that_of_the_block_on_the_static_stiffness():
    contact = Rectangle(1.0, 1.5)
    ground = ConeModel(SOIL, contact)
    found = rigidity(block(contact), ground, (1.0, 150.0))
    stiffness = (1.0 / ground.compliance(np.zeros(1))[0, 2, 2]).real
    assert found.heave == pytest.approx(math.sqrt(stiffness / 17280.0), rel=1e-12)
    assert found.is_rigid
    assert found.is_slab


def test_rectangle_in_two_parts_is_a_slab_and_an_l_is_said_not_to_be():
    whole, cut = Rectangle(1.0, 1.5), Plan((Part(0.5, 1.5, -0.5, 0.0), Part(0.5, 1.5, 0.5, 0.0)))
    corner = Plan((Part(1.0, 1.5, 0.0, 0.0), Part(0.4, 0.75, -1.4, -0.75)))
    one, same, other = (rigidity(block(contact), ConeModel(SOIL, contact), (1.0, 150.0))
                        for contact in (whole, cut, corner))
    assert same.bending == pytest.approx(one.bending, rel=1e-12)
    assert same.is_slab
    assert not other.is_slab


def test_block_twists_or_bends_whichever_way_it_stands():
    """A slab of three sides has one lowest frequency, and a disc does not twist like a square."""
    sides = (1.0, 3.0, 8.0)
    found = []
    for width, length, height in permutations(sides):
        contact = Rectangle(0.5 * width, 0.5 * length)
        found.append(rigidity(block(contact, 2400.0 * math.prod(sides), height),
                              ConeModel(SOIL, contact), (1.0, 150.0)))
    assert [one.lowest for one in found] == pytest.approx([found[0].lowest] * 6)
    # By bricks, E 30 GPa; the wall of 8 x 1 m, 3 m high, bends sideways.
    assert found[0].lowest / (2.0 * math.pi) == pytest.approx(54.6, rel=0.07)
    square = Rectangle(3.0, 3.0)
    twists = rigidity(block(square, 2400.0 * 21.6, 0.6), ConeModel(SOIL, square), (1.0, 150.0))
    assert twists.lowest == twists.twist
    assert twists.over_excitation == pytest.approx(37.7 * 2.0 * math.pi / 150.0, rel=0.09)
    disc = Circle(3.0)
    assert rigidity(block(disc), ConeModel(SOIL, disc), (1.0, 150.0)).twist == math.inf


def test_nothing_is_said_of_a_block_on_rigid_ground_or_without_a_body():
    contact = Rectangle(1.0, 1.5)
    assert rigidity(block(contact), RigidSoil(), (1.0, 150.0)) is None
    bare = Foundation('block', contact, 0.0, 42.0, 0.0, (1.0, 1.0, 1.0))
    assert rigidity(bare, ConeModel(SOIL, contact), (1.0, 150.0)) is None


def test_raft_is_warned_about_with_its_numbers():
    case = load(FAN, RAFT)
    [said] = of_rigidity(case, [ConeModel(case.soil, case.foundations[0].contact)])
    assert said.startswith('foundations.0: block is not rigid: free, it bends at 24.6 Hz (slab '
                           '12 m, 1 m thick, E 30 GPa); 3.3 times the highest 1X frequency of 30 '
                           'Hz are 99 Hz')
    assert '3.7 times its heave' in said


def test_either_condition_alone_is_told():
    slow = load(FAN, [*RAFT, 'speed_range_rpm=[10, 300]'])
    [said] = of_rigidity(slow, [ConeModel(slow.soil, slow.foundations[0].contact)])
    assert 'highest 1X' not in said
    assert 'heave' in said
    stiff = load(FAN, ['speed_range_rpm=[100, 8000]'])
    [said] = of_rigidity(stiff, [ConeModel(stiff.soil, stiff.foundations[0].contact)])
    assert 'heave' not in said


def test_check_and_report_say_it(capsys, tmp_path):
    settings = [word for one in RAFT for word in ('--set', one)]
    main(['check', str(FAN), *settings])
    assert 'warning: foundations.0: block is not rigid' in capsys.readouterr().out
    status = main(['report', str(FAN), '--rpm', '1480', '-o', str(tmp_path / 'out'), *settings])
    assert status == 1
    assert 'block is not rigid: free, it bends at 24.6 Hz' in capsys.readouterr().out
