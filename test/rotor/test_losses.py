"""Axial force and torque against closed forms, and the modes of a lossy pencil."""

import math

import numpy as np
import pytest
import scipy.linalg

from rotorsoil_ros.errors import RotorSoilError
from rotorsoil_ros.rotor.assembly import Rotor
from rotorsoil_ros.rotor.bearing import Bearing
from rotorsoil_ros.rotor.losses import receding
from rotorsoil_ros.rotor.shaft import Material, ShaftDamping, ShaftSection

LENGTH, DIAMETER = 2.0, 0.01
STEEL = Material(2.1e11, 0.3, 7850.0)
BENDING = STEEL.young_modulus * math.pi / 64.0 * DIAMETER**4
EULER = math.pi**2 * BENDING / LENGTH**2


def pinned(**loads):
    """Return a slender rod on two rigid bearings."""
    section = ShaftSection(LENGTH, (DIAMETER, DIAMETER), (0.0, 0.0), 24, STEEL, **loads)
    return Rotor(0.5, (section,), (), tuple(
        Bearing(name, place, None, 1e9 * np.eye(2), np.zeros((2, 2)))
        for name, place in (('a', 0.0), ('b', LENGTH))))


def held(rotor):
    """Return stiffness and mass with the ends held."""
    stiffness, mass, _ = rotor.plane_matrices
    free = np.setdiff1d(np.arange(len(stiffness)), [0, len(stiffness) - 2])
    return stiffness[np.ix_(free, free)], mass[np.ix_(free, free)], free


@pytest.mark.parametrize('share', [-0.9, -0.3, 0.5, 4.0])
def test_axial_force_changes_the_frequency_of_a_pinned_rod_by_the_root_of_one_plus_its_share(
    share,
):
    # Timoshenko, Young & Weaver: omega = omega_0 sqrt(1 + P / P_Euler), of a slender rod.
    found = [math.sqrt(scipy.linalg.eigh(*held(pinned(axial_force=force))[:2],
                                         eigvals_only=True)[0])
             for force in (0.0, share * EULER)]
    # Shear of a rod of 200 diameters is 4e-5 of its stiffness, which a force may leave little of.
    assert found[1] / found[0] == pytest.approx(math.sqrt(1.0 + share), rel=1e-4 / (1.0 + share))


def test_pressed_rod_buckles_at_the_load_of_euler():
    assert pinned(axial_force=-0.5 * EULER).buckling_factor == pytest.approx(2.0, rel=1e-4)
    assert pinned(axial_force=0.5 * EULER).buckling_factor == math.inf
    with pytest.raises(RotorSoilError, match=r'axial_force must stay below the load that buckles '
                                             r'the shaft, 1 times it, got 1\.0'):
        pinned(axial_force=-1.01 * EULER)


def test_twisted_rod_buckles_at_the_torque_of_greenhill():
    # Greenhill (1883): pinned ends buckle at T = 2 pi E I / L.
    rotor = pinned(torque=1.0)
    stiffness, _, free = held(rotor)
    torsion = rotor.losses.torsion[np.ix_(free, free)]
    torques = scipy.linalg.eigvals(stiffness, 1j * torsion)
    assert np.abs(torques[np.isfinite(torques)]).min() == pytest.approx(
        2.0 * math.pi * BENDING / LENGTH, rel=3e-4)  # shear, and 24 elements


def test_modes_of_a_lossy_pencil_add_up_to_its_inverse():
    rng = np.random.default_rng(5)
    stiffness, rate = (rng.normal(size=(4, 4)) + 1j * rng.normal(size=(4, 4)) for _ in range(2))
    mass = np.diag([1.0, 2.0, 0.0, 3.0])  # what has no mass has no mode of its own
    inverse, right, left = receding(stiffness, rate, mass, 2.0)
    for w in (0.3, 5.0, 1.0 - 2.0j):
        exact = np.linalg.inv(stiffness + w * rate - w**2 * mass)
        np.testing.assert_allclose((right / (1.0 - w * inverse)) @ left, exact, rtol=1e-9)


@pytest.mark.parametrize('values, rule', [
    ({'viscous': -1.0}, 'viscous must be >= 0 s and finite, got -1'),
    ({'loss_factor': 1.0}, r'loss_factor must be in \[0, 1\), got 1'),
    ({'fixed_mass': math.inf}, 'fixed_mass must be >= 0 1/s and finite'),
    ({'fixed_stiffness': math.nan}, 'fixed_stiffness must be >= 0 s and finite')])
def test_impossible_damping_is_refused(values, rule):
    with pytest.raises(RotorSoilError, match=rule):
        ShaftDamping(**values)
