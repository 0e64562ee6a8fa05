"""The rotor in few shapes against the rotor in all of them."""

import numpy as np
import pytest

from rotorsoil_ros.rotor.disc import Disc
from rotorsoil_ros.rotor.reduced import ReducedRotor
from rotorsoil_ros.rotor.shaft import Material
from rotorsoil_ros.rotor.whirl import held

from machines import bearing, paper_machine, STEEL, two_blocks, uniform_rotor

MODEL = paper_machine()
SPRINGS = MODEL.rotor.nominal_springs


def rows(model):
    """Return the rows of the plane matrices at the bearings."""
    return [2 * model.rotor.node_of(one.position) for one in model.rotor.bearings]


def test_few_shapes_have_the_whirl_of_all_of_them_at_any_speed():
    # Modes at rest alone would be wrong by 1e-6: gyroscopic couples bend the shaft otherwise.
    speed = np.array([0.0, 942.0, 3000.0])
    few, _ = ReducedRotor.of(MODEL.rotor, SPRINGS, count=9).spin(speed)
    full, _ = ReducedRotor.of(MODEL.rotor, SPRINGS, count=1000).spin(speed)
    for ends in (slice(None, 3), slice(-3, None)):
        np.testing.assert_allclose(few[:, ends], full[:, ends], rtol=1e-9)


def test_few_shapes_bend_under_bearing_forces_as_the_whole_shaft_does():
    model = two_blocks()  # on three bearings: two would not bend it
    at = rows(model)
    stiffness, _, _ = held(model.rotor, model.rotor.nominal_springs)
    few = ReducedRotor.of(model.rotor, model.rotor.nominal_springs, count=2)
    np.testing.assert_allclose(few.shapes[at] @ few.shapes[at].T,
                               np.linalg.inv(stiffness)[np.ix_(at, at)], rtol=1e-9)


def test_coordinates_have_unit_stiffness_and_their_own_mass():
    stiffness, mass, polar = held(MODEL.rotor, SPRINGS)
    few = ReducedRotor.of(MODEL.rotor, SPRINGS, count=6)
    np.testing.assert_allclose(few.shapes.T @ stiffness @ few.shapes, np.eye(len(few.mass)),
                               atol=1e-8)  # 1e9 N/m beside a slender shaft
    np.testing.assert_allclose(few.shapes.T @ mass @ few.shapes, np.diag(few.mass),
                               atol=1e-12 * few.mass.max())
    np.testing.assert_allclose(few.shapes.T @ polar @ few.shapes, few.polar, rtol=1e-12)


def test_forward_whirl_obeys_its_equation():
    few = ReducedRotor.of(MODEL.rotor, SPRINGS, count=6)
    speed = np.array([500.0])
    inverse, amplitude = few.spin(speed)
    omega, shape = 1.0 / inverse[0, -1], amplitude[0, :, -1]
    residual = shape + omega * speed[0] * few.polar @ shape - omega**2 * few.mass * shape
    np.testing.assert_allclose(residual, 0.0, atol=1e-10 * np.abs(shape).max())
    assert omega > few.mass.max() ** -0.5  # forward whirl stiffens


@pytest.mark.parametrize('count', [1, 3, 50])
def test_shaft_without_mass_is_reduced_too(count):
    rotor = uniform_rotor(
        length=1.0, diameter=0.05, elements=4, material=Material(2.1e11, 0.3, 0.0),
        discs=[Disc('d', 0.5, 10.0, 0.0, 0.0)],
        bearings=[bearing('a', 0.0, stiffness=1e8), bearing('b', 1.0, stiffness=1e8)])
    few = ReducedRotor.of(rotor, np.array([1e8, 1e8]), count=count)
    assert np.all(few.mass >= 0.0)
    inverse, _ = few.spin(np.array([100.0]))
    assert (inverse > 1e-6 * inverse.max()).sum() == 1


def test_two_bearings_at_one_place_are_reduced_once():
    rotor = uniform_rotor(
        length=1.0, diameter=0.05, elements=4, material=STEEL,
        bearings=[bearing('a', 0.0, stiffness=1e8), bearing('b', 1.0, stiffness=1e8),
                  bearing('seal', 1.0, stiffness=1e5)])
    few = ReducedRotor.of(rotor, np.array([1e8, 1e8, 1e5]), count=1000)
    assert len(few.mass) == len(few.shapes) == 10
