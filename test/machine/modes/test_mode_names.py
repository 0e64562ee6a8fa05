"""Names of modes where only one body moves or gives way."""

import numpy as np
import pytest

from rotorsoil_ros.ground.soil import RigidSoil
from rotorsoil_ros.machine.coupled import CoupledModel
from rotorsoil_ros.machine.foundation import Foundation
from rotorsoil_ros.machine.modes.critical import critical_speeds
from rotorsoil_ros.machine.modes.names import ModeNames
from rotorsoil_ros.rotor.bearing import Pedestal
from rotorsoil_ros.rotor.disc import Disc

from machines import bearing, CONTACT, Springs, STEEL, uniform_rotor

STIFF = 1e13


def machine(soil, *, shaft=0.3, spring=STIFF, pedestal=None, inertia=1.0):
    """Return a rotor on two bearings and a block, everything stiff that is not given."""
    bearings = [bearing(name, place, stiffness=spring, foundation='base')
                for name, place in (('a', 0.1), ('b', 1.1))]
    if pedestal is not None:
        bearings = [type(one)(one.name, one.position, one.foundation, one.stiffness, one.damping,
                              pedestal) for one in bearings]
    rotor = uniform_rotor(length=1.2, diameter=shaft, elements=12, material=STEEL, height=0.9,
                          bearings=bearings,
                          discs=[Disc('wheel', 0.6, 50.0, inertia, 2.0 * inertia)])
    block = Foundation('base', CONTACT, 0.6, 9000.0, 0.4, (800.0, 900.0, 1500.0))
    return CoupledModel(rotor, (block,), (soil,))


def names_of(model, highest):
    names = ModeNames(model)
    return [names.of_critical(one) for one in critical_speeds(model, (1.0, highest))]


@pytest.mark.parametrize('dof, expected', list(enumerate([
    'base sliding across', 'base sliding along', 'base heave', 'base rocking along',
    'base rocking across', 'base turning about the vertical'])))
def test_the_soft_spring_of_the_soil_names_the_mode(dof, expected):
    springs = np.full(6, STIFF)
    springs[dof] = 1e8
    assert set(names_of(machine(Springs(np.diag(springs), 1e2 * np.eye(6))), 400.0)) == {expected}


def test_a_slender_shaft_bends_first_second_and_third():
    found = names_of(machine(RigidSoil(), shaft=0.03, inertia=1e-3), 3500.0)
    assert found[:2] == ['shaft bending, first'] * 2
    order = list(dict.fromkeys(found))
    assert order == [f'shaft bending, {nth}' for nth in ('first', 'second', 'third')[:len(order)]]
    assert len(order) >= 2


def test_a_stiff_rotor_bounces_and_tilts_on_soft_bearings():
    found = names_of(machine(RigidSoil(), spring=1e7), 1500.0)
    assert {name.partition(',')[0] for name in found} == {
        'rotor bouncing on its bearings', 'rotor tilting on its bearings'}
    assert found[0].startswith('rotor bouncing')


def test_soft_pedestals_are_named_with_their_direction():
    soft = Pedestal(10.0 * np.eye(2), np.diag([1e7, STIFF]), np.zeros((2, 2)))
    found = names_of(machine(RigidSoil(), pedestal=soft), 1000.0)
    assert found
    assert all(name.startswith('pedestal of ') and name.endswith(' across') for name in found)
