"""config/plant_fan.yaml against the story in its comments."""

from pathlib import Path

import numpy as np
import pytest

from rotorsoil_ros.case.config import load
from rotorsoil_ros.case.models import coupled_model
from rotorsoil_ros.units import rad_s_to_rpm, rpm_to_rad_s

PATH = Path(__file__).parents[2] / 'config' / 'plant_fan.yaml'
NO_CACHE = Path('no cache is needed for cones')

# mass [kg], centre along y and up [m], inertia about its own centre over x, y, z [kg m^2]
CONCRETE = 2.0 * 3.0 * 1.2 * 2400.0
PARTS = [
    (CONCRETE, 0.0, 0.6, CONCRETE / 12.0 * np.array([3**2 + 1.2**2, 2**2 + 1.2**2, 2**2 + 3**2])),
    (1500.0, -0.8, 1.9, np.array([162.0, 122.0, 162.0])),  # motor, 0.9 m x 0.7 m
    (800.0, 0.55, 1.5, np.array([130.0, 130.0, 130.0])),  # pedestals and frame, about 1 m
]


def test_block_carries_concrete_motor_and_pedestals():
    [block] = load(PATH).foundations
    mass = sum(part[0] for part in PARTS)
    height = sum(part[0] * part[2] for part in PARTS) / mass
    inertia = sum(own + m * np.array([y**2 + (z - height)**2, (z - height)**2, y**2])
                  for m, y, z, own in PARTS)
    assert block.mass == pytest.approx(mass)
    assert block.centre_of_gravity_height == pytest.approx(height, abs=0.005)  # digits of the file
    np.testing.assert_allclose(block.inertia, inertia, rtol=5e-3)


def test_machine_weighs_3_t_and_is_balanced_to_g_6_3():
    case = load(PATH)
    assert case.rotor.mass + 1500.0 + 800.0 == pytest.approx(3000.0, rel=0.01)
    permissible = 6.3e-3 / rpm_to_rad_s(1500.0) * case.rotor.mass
    assert abs(case.unbalance[1]) == pytest.approx(permissible, rel=0.02)


def test_running_speed_lies_between_rocking_and_the_shafts_critical():
    case = load(PATH)
    model = coupled_model(case, NO_CACHE)
    speed = rpm_to_rad_s(np.linspace(200.0, 4000.0, 3801))
    response = np.abs(model.unbalance_response(speed, case.unbalance).displacement)
    rocking = speed[response[:1800, model.channels.index('block_ry')].argmax()]
    shaft = speed[response[:, model.channels.index('wheel_x')].argmax()]
    assert 1250.0 < rad_s_to_rpm(rocking) < 1400.0  # "about 1300 rpm"
    assert 3200.0 < rad_s_to_rpm(shaft) < 3400.0  # "near 3300 rpm"


def test_housings_are_in_a_good_zone_at_running_speed():
    case = load(PATH)
    model = coupled_model(case, NO_CACHE)
    velocity = model.unbalance_response(rpm_to_rad_s(np.array([1500.0])), case.unbalance).velocity
    housings = [i for i, name in enumerate(model.channels) if '_housing_' in name]
    worst = np.abs(velocity[0, housings]).max() / np.sqrt(2.0)
    assert 0.5e-3 < worst < 2.3e-3  # zone A/B of a fan on a flexible support begins at 2.3 mm/s
