"""Shapes that stand for many elements: the whole rotor's answers, at the cost of few."""

import math

import numpy as np
import pytest

from rotorsoil_ros.machine.coupled import CoupledModel
from rotorsoil_ros.rotor import whirl
from rotorsoil_ros.rotor.disc import Disc
from rotorsoil_ros.rotor.projection import shapes_at_ports
from rotorsoil_ros.rotor.whirl import held

from machines import bearing, LENGTH, paper_machine, STEEL, uniform_rotor
from oracles.dense import dense_forced


def overhung(*, stiffness, elements=100):
    """Return a rotor with a heavy thin wheel beyond its bearings."""
    return CoupledModel(uniform_rotor(
        length=1.2, diameter=0.06, elements=elements, material=STEEL,
        discs=[Disc('wheel', 1.2, 40.0, 1.2, 2.3), Disc('hub', 0.3, 5.0, 0.02, 0.03)],
        bearings=[bearing('a', 0.0, stiffness=stiffness, damping=200.0, foundation=None),
                  bearing('b', 0.8, stiffness=stiffness, damping=200.0, foundation=None)]))


MACHINES = {
    'paper': (paper_machine(elements=112), 'disc_1_z'),
    'overhung on hard bearings': (overhung(stiffness=1e9), 'wheel_x'),
    'overhung on soft bearings': (overhung(stiffness=1e5), 'hub_z'),
}


@pytest.mark.parametrize('name', list(MACHINES))
@pytest.mark.parametrize('highest, speed', [
    (900.0, 0.0), (900.0, 300.0), (100.0, 3000.0), (3000.0, 50.0)])
def test_answers_are_those_of_all_elements(name, highest, speed, monkeypatch):
    model, force = MACHINES[name]
    omega = np.linspace(5.0, highest, 80)
    found = model.frequency_response(omega, speed=speed, channel=force).displacement
    few = shapes_at_ports(*held(model.rotor, model.rotor.nominal_springs), model.ports,
                          highest=highest, speed=speed)
    assert few.shape[1] < 0.2 * few.shape[0]
    monkeypatch.setattr(whirl, 'shapes_at_ports', lambda stiffness, *_, **__: np.eye(
        len(stiffness)))
    expected = model.frequency_response(omega, speed=speed, channel=force).displacement
    scale = np.abs(expected).max(axis=1, keepdims=True)
    # round-off of 226 unknowns, more by the sharpness of resonances
    np.testing.assert_allclose(found / scale, expected / scale, rtol=0.0, atol=2e-8)


def test_answers_at_ports_are_those_of_the_assembled_system():
    model, force = MACHINES['paper']
    omega, speed = np.linspace(0.0, 1200.0, 40), np.full(40, 700.0)
    found = model.frequency_response(omega, speed=700.0, channel=force).displacement
    expected = dense_forced(model, omega, speed, force).displacement
    scale = np.abs(expected).max(axis=1, keepdims=True)
    np.testing.assert_allclose(found / scale, expected / scale, rtol=0.0, atol=1e-7)


def test_shapes_do_not_multiply_with_the_elements():
    counts = [shapes_at_ports(
        *held(model.rotor, model.rotor.nominal_springs), model.ports, highest=900.0,
        speed=300.0).shape[1]
        for model in (paper_machine(elements=elements) for elements in (80, 160, 320))]
    assert max(counts) - min(counts) <= 3
    assert max(counts) < 50


@pytest.mark.parametrize('highest, speed', [(0.0, 300.0), (1e6, 0.0)])
def test_all_shapes_are_kept_where_few_would_not_do(highest, speed):
    model = paper_machine(elements=60)
    basis = shapes_at_ports(*held(model.rotor, model.rotor.nominal_springs), model.ports,
                            highest=highest, speed=speed)
    np.testing.assert_array_equal(basis, np.eye(len(basis)))


def test_slow_modes_at_rest_are_among_the_shapes():
    # Closed form: a pinned beam has omega_k = (k pi / L)^2 sqrt(E I / (rho A)).
    model = CoupledModel(uniform_rotor(
        length=LENGTH, diameter=0.02, elements=120, material=STEEL,
        bearings=[bearing(name, place, stiffness=1e10, foundation=None)
                  for name, place in (('a', 0.0), ('b', LENGTH))]))
    stiffness, mass, polar = held(model.rotor, model.rotor.nominal_springs)
    basis = shapes_at_ports(stiffness, mass, polar, model.ports, highest=1000.0, speed=0.0)
    squares = np.linalg.eigvals(np.linalg.solve(basis.T @ stiffness @ basis,
                                                basis.T @ mass @ basis)).real
    lowest = np.sort(squares)[:-4:-1] ** -0.5
    bending = np.sqrt(STEEL.young_modulus / STEEL.density) * 0.02 / 4.0
    expected = (math.pi * np.arange(1, 4) / LENGTH) ** 2 * bending
    np.testing.assert_allclose(lowest, expected, rtol=1e-2)  # shear and rotary inertia
