"""Units against their definitions."""

import math

import numpy as np
import pytest

from rotorsoil_ros import units


def test_one_turn_per_second_is_sixty_rpm():
    assert units.rpm_to_rad_s(60.0) == pytest.approx(2.0 * math.pi, rel=1e-15)
    assert units.hz_to_rad_s(1.0) == pytest.approx(2.0 * math.pi, rel=1e-15)


def test_conversions_undo_each_other():
    assert units.rad_s_to_rpm(units.rpm_to_rad_s(1234.5)) == pytest.approx(1234.5, rel=1e-15)
    assert units.rad_s_to_hz(units.hz_to_rad_s(12.5)) == pytest.approx(12.5, rel=1e-15)


def test_tiny_lead_is_no_lag_rather_than_a_turn():
    assert units.to_lag_deg(np.array([1e-18, 0.0])).tolist() == [0.0, 0.0]


def test_row_of_a_table_becomes_one_of_a_plant():
    row = {'channel': 'wheel_x', 'speed_rad_s': 10.0 * math.pi, 'predicted_m': 5e-6,
           'predicted_phase_rad': -0.5 * math.pi, 'measured_velocity_m_s_rms': 2e-3,
           'residual_rad': 1e-6, 'stamp_ns': 7}
    assert units.in_plant_units(row) == pytest.approx({
        'channel': 'wheel_x', 'speed_rpm': 300.0, 'predicted_um_pp': 10.0,
        'predicted_phase_lag_deg': 90.0, 'measured_velocity_mm_s_rms': 2.0,
        'residual_urad_pp': 2.0, 'stamp_ns': 7})
