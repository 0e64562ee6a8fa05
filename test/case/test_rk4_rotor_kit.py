"""config/rk4_rotor_kit.yaml against the description of the rig that its run-up came with."""

from pathlib import Path

import numpy as np
import pytest

from rotorsoil_ros.case.config import load
from rotorsoil_ros.case.models import coupled_model
from rotorsoil_ros.units import rpm_to_rad_s

PATH = Path(__file__).parents[2] / 'config' / 'rk4_rotor_kit.yaml'
NO_CACHE = Path('no cache is needed for cones')


def test_stations_are_the_nodes_of_the_note():
    rotor = load(PATH).rotor
    np.testing.assert_allclose(rotor.node_positions, 0.02 * np.arange(29), atol=1e-12)
    stations = [*rotor.bearings, *rotor.discs, *rotor.probes]
    assert [rotor.node_of(station.position) for station in stations] == [2, 26, 8, 20, 6, 22]


def test_discs_are_solid_cylinders():
    mass, radius, thickness = 0.8, 0.038, 0.025
    for disc in load(PATH).rotor.discs:
        assert disc.polar_inertia == pytest.approx(mass * radius**2 / 2.0, rel=2e-4)  # digits
        assert disc.diametral_inertia == pytest.approx(
            mass * (3.0 * radius**2 + thickness**2) / 12.0, rel=2e-4)


def test_first_critical_speed_is_that_of_the_note():
    case = load(PATH)
    model = coupled_model(case, NO_CACHE)
    speed = rpm_to_rad_s(np.linspace(1900.0, 2100.0, 20001))
    response = model.unbalance_response(speed, case.unbalance).displacement
    peak = speed[np.abs(response[:, model.channels.index('probe_1_x')]).argmax()]
    assert peak == pytest.approx(rpm_to_rad_s(2024.0), abs=rpm_to_rad_s(0.6))  # its digits


def test_bench_does_not_move():
    case = load(PATH)
    assert case.foundations == ()
    assert all(bearing.foundation is None for bearing in case.rotor.bearings)
