"""Modes on ground with cut-offs, against the compliance solved at complex frequencies."""

from contextlib import suppress
from dataclasses import replace
import math

import numpy as np
import pytest
from scipy.optimize import newton

from rotorsoil_ros.errors import NotSolvedError
from rotorsoil_ros.ground.branch_points import branch_points
from rotorsoil_ros.ground.layers.cylinder import CylinderInWaves, HEAVE, RigidCylinder, SWAY
from rotorsoil_ros.ground.layers.line import LineMesh, VerticalLine
from rotorsoil_ros.ground.layers.model import ThinLayerModel
from rotorsoil_ros.ground.layers.profile import Layer, LayeredSoil, SURFACE
from rotorsoil_ros.ground.layers.waves import Waves
from rotorsoil_ros.ground.soil import Circle, Soil
from rotorsoil_ros.ground.table import ComplianceTable
from rotorsoil_ros.machine.coupled import CoupledModel
from rotorsoil_ros.machine.foundation import Foundation
from rotorsoil_ros.machine.modes.campbell import campbell
from rotorsoil_ros.machine.modes.critical import critical_speeds
from rotorsoil_ros.machine.modes.natural import natural_frequencies
from rotorsoil_ros.machine.modes.stability import stability
from rotorsoil_ros.machine.support import Support
from rotorsoil_ros.rotor.assembly import Rotor
from rotorsoil_ros.rotor.disc import Disc
from rotorsoil_ros.rotor.shaft import ShaftSection

from machines import bearing, STEEL

SAND = Soil(100e6, 0.3, 1900.0, 0.05)
RADIUS = 1.382
BLOCK = Foundation('block', Circle(RADIUS), 0.25, 19580.0, 0.74, (15e3, 15e3, 20e3))


def machine(depth, **coefficients):
    """Return a block on a layer on rock under a rotor of 0.4 % of its mass on stiff bearings."""
    rotor = Rotor(
        shaft_height=1.2, shaft=[ShaftSection(0.5, (0.1, 0.1), (0.0, 0.0), 4, STEEL)],
        discs=[Disc('wheel', 0.25, 50.0, 1.0, 2.0)],
        bearings=[bearing('left', 0.0, **coefficients), bearing('right', 0.5, **coefficients)])
    ground = LayeredSoil((Layer(depth, SAND),), None)
    model = ThinLayerModel.solved(ground, BLOCK.contact, omega_max=380.0)
    return CoupledModel(rotor, (BLOCK,), (model,))


class DirectGround:
    """Compliance at complex frequencies: the signs of the waves are kept from the real axis."""

    def __init__(self, depth):
        ground = LayeredSoil((Layer(depth, SAND),), None)
        self.cylinder = RigidCylinder(VerticalLine.through(
            ground, SURFACE, radius=RADIUS, lowest=20.0, highest=300.0, mesh=LineMesh()))

    def at(self, omega):
        waves = self.cylinder.at(omega.real).outgoing
        for share in np.linspace(0.0, 1.0, 9)[1:]:
            place = omega.real + 1j * share * omega.imag
            free = self.cylinder._outside.standing(place)
            waves = Waves(*followed(waves.k, free.k, free.u, free.w),
                          *followed(waves.q, free.q, free.v))
        return CylinderInWaves(self.cylinder.line, omega, waves,
                               self.cylinder._below.standing(omega))


def followed(before, wavenumber, shape, second=None):
    """Return waves with the sign of the nearest one before."""
    gaps = np.abs(wavenumber[:, None]**2 - before**2) / np.abs(before) ** 2
    nearest = before[gaps.argmin(axis=1)]
    sign = np.where(np.abs(wavenumber - nearest) < np.abs(wavenumber + nearest), 1.0, -1.0)
    return ((wavenumber * sign, shape) if second is None
            else (wavenumber * sign, shape, second * sign))


def root(function, guess):
    return newton(function, guess, x1=1.001 * guess, tol=1e-7 * abs(guess))


def heave(direct, mass):
    return lambda omega: direct.at(omega).stiffness(HEAVE, RADIUS)[0, 0] - omega**2 * mass


def sway(direct, mass):
    return lambda omega: np.linalg.det(
        (direct.at(omega).stiffness(SWAY, RADIUS) - omega**2 * mass)
        / np.array([[1e9, 1e9], [1e9, 1e9]]))


@pytest.fixture(scope='module', params=[1.5, 3.0])
def found(request):
    model = machine(request.param, stiffness=1e10)
    return request.param, model, campbell(model, np.array([30.0]), 8)


def nearest(found, omega):
    """Return the eigenfrequency w = lambda / i closest to one."""
    frequency = found.eigenvalue[0] / 1j
    return frequency[np.abs(frequency - omega).argmin()]


def test_heave_on_rock_is_that_of_the_ground_at_its_complex_frequency(found):
    depth, model, modes = found
    total = BLOCK.mass + model.rotor.mass
    expected = root(heave(DirectGround(depth), total), 2.0 * math.pi * (41.2 + 1.2j) if (
        depth == 1.5) else 2.0 * math.pi * (28.8 + 1.0j))
    assert abs(nearest(modes, expected) / expected - 1.0) < 2e-3


def test_light_sway_just_below_a_cut_off_is_told(found):
    depth, model, modes = found
    mass = BLOCK.mass_matrix[np.ix_([0, 4], [0, 4])]
    rotor = model.rotor.mass
    mass += rotor * np.array([[1.0, 1.2], [1.2, 1.44]])
    expected = root(sway(DirectGround(depth), mass), 2.0 * math.pi * (25.0 + 0.6j) if (
        depth == 1.5) else 2.0 * math.pi * (18.95 + 0.47j))
    assert expected.real < model.soil_models[0].singular[0]
    assert abs(nearest(modes, expected) / expected - 1.0) < 3e-3


def test_modes_of_pieces_are_the_same_for_every_range():
    model = machine(1.5, stiffness=1e10)
    whole, part = (critical_speeds(model, (50.0, high)) for high in (280.0, 200.0))
    assert len(part) >= 2
    # What the table itself is good for.
    np.testing.assert_allclose([one.speed for one in part],
                               [one.speed for one in whole][:len(part)], rtol=2e-4)


def test_natural_frequencies_lie_in_the_pieces_of_their_continuation(found):
    _depth, model, modes = found
    support = Support(model.rotor.bearings, model.rotor.shaft_height, (BLOCK,),
                      model.soil_models)
    carried = 0.5 * model.rotor.mass * np.eye(4)
    frequency, _ = natural_frequencies(support, carried, 300.0)
    light = modes.damping_ratio[0] < 0.05
    expected = np.abs(modes.eigenvalue[0, light])[0]
    assert np.abs(frequency / expected - 1.0).min() < 5e-3


def as_table(model, count):
    """Return a machine whose ground is a table of so many rows of what it stands on."""
    [soil] = model.soil_models
    omega = np.linspace(3.0, 370.0, count)
    values = soil.compliance(omega)
    table = ComplianceTable(omega, values, (), tuple(branch_points(omega, values).tolist()))
    return replace(model, soil_models=(table,))


def light(found):
    return np.array([(one.speed, one.damping_ratio) for one in found if one.damping_ratio < 0.1])


def test_table_of_a_layer_on_rock_has_its_modes_or_says_what_it_leaves_open(found):
    depth, model, _ = found
    # Of 1.5 m up to just below the first cut-off: what lies on it no table tells.
    span = (40.0, 230.0 if depth == 1.5 else 300.0)
    expected = light(critical_speeds(model, span))
    assert len(expected) >= 2
    told = light(critical_speeds(as_table(model, 400), span))
    # The table is a fit within 1e-4 itself; the damping of a mode just below a cut-off feels it.
    np.testing.assert_allclose(told[:, 0], expected[:, 0], rtol=2e-3)
    np.testing.assert_allclose(told[:, 1], expected[:, 1], rtol=0.05)
    for count in (60, 25):
        # An error where they leave a light mode open: never a mode less without a word.
        with suppress(NotSolvedError):
            rough = light(critical_speeds(as_table(model, count), span))
            np.testing.assert_allclose(rough[:, 0], expected[:, 0], rtol=2e-2)


def test_bearing_that_feeds_a_block_on_rock_is_found():
    pushing = [[1e7, 8e6], [-8e6, 1e7]]
    unstable = stability(machine(1.5, stiffness=pushing), (10.0, 300.0))
    stable = stability(machine(1.5, stiffness=1e7), (10.0, 300.0))
    assert unstable.instabilities
    assert not stable.instabilities
