"""Zones against the printed limits."""

import dataclasses
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


@pytest.mark.parametrize('group, hertz', [(1, 12.5), (2, 10.0)])
def test_displacement_is_the_stricter_limit_of_slow_machines(group, hertz):
    limits = ISO_10816_3[group]
    for support in ('rigid', 'flexible'):
        velocities, displacements = limits.of(support), getattr(limits, f'{support}_displacement')
        # Both criteria of a row meet at one frequency, as the published charts have it.
        for velocity, displacement in zip(velocities, displacements, strict=True):
            assert velocity / displacement / (2.0 * math.pi) == pytest.approx(hertz, rel=0.03)
        assert limits.of(support, 2.0 * math.pi * 0.5 * hertz) == tuple(
            math.pi * hertz * displacement for displacement in displacements)
        assert limits.of(support, 2.0 * math.pi * 2.0 * hertz) == velocities


def test_alarm_is_a_quarter_above_the_baseline_and_trip_above_the_last_boundary():
    limits = dataclasses.replace(ISO_10816_3[2], baseline=1.0e-3)
    assert limits.alarm('rigid') == pytest.approx(1.0e-3 + 0.25 * 2.8e-3)
    assert limits.trip('rigid') == pytest.approx(1.25 * 4.5e-3)
    assert dataclasses.replace(limits, baseline=9e-3).alarm('rigid') == 1.25 * 2.8e-3
    assert ISO_10816_3[2].alarm('rigid') == 2.8e-3
    with pytest.raises(RotorSoilError, match='baseline must be > 0 m/s'):
        dataclasses.replace(limits, baseline=0.0)
