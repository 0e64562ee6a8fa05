"""Zones against the printed limits."""

import math

import pytest

from rotorsoil_ros.case.zone_limits import held_zone, ISO_10816_3, support_class, zone, ZoneLimits
from rotorsoil_ros.errors import RotorSoilError

RIGID = ISO_10816_3[1].of('rigid')


@pytest.mark.parametrize('velocity_mm_s, expected', [
    (0.0, 'A'), (2.3, 'A'), (2.31, 'B'), (4.51, 'C'), (7.1, 'C'), (7.2, 'D'), (1e3, 'D')])
def test_zone_of_a_large_machine_on_rigid_support(velocity_mm_s, expected):
    assert zone(velocity_mm_s * 1e-3, RIGID) == expected


def test_flexible_support_is_allowed_more():
    assert zone(3.4e-3, ISO_10816_3[1].of('flexible')) == 'A'
    assert zone(3.4e-3, ISO_10816_3[2].of('flexible')) == 'B'


def test_value_on_a_boundary_does_not_chatter():
    held = None
    seen = []
    for velocity in (4.4e-3, 4.6e-3, 4.45e-3, 4.52e-3, 4.3e-3, 4.0e-3):
        held = held_zone(held, velocity, RIGID, hysteresis=0.1)
        seen.append(held)
    assert seen == ['B', 'C', 'C', 'C', 'C', 'B']


def test_support_is_rigid_from_a_quarter_above_the_running_speed():
    assert support_class(125.0, 100.0) == 'rigid'
    assert support_class(124.9, 100.0) == 'flexible'


@pytest.mark.parametrize('velocity', [math.nan, -1.0])
def test_velocity_that_is_none_has_no_zone(velocity):
    with pytest.raises(RotorSoilError, match='velocity must be >= 0 m/s'):
        zone(velocity, RIGID)


def test_limits_must_rise():
    with pytest.raises(RotorSoilError, match='rigid must be three rising velocities'):
        ZoneLimits('mine', (2e-3, 1e-3, 3e-3), (1e-3, 2e-3, 3e-3))
