"""What a program gets from `import rotorsoil_ros`, and at which cost."""

import subprocess
import sys
from types import ModuleType

import numpy as np
import pandas
import pytest
import xarray

import rotorsoil_ros as rs

SPEEDS = [1500.0, 2400.0, 3000.0]  # [rpm]


@pytest.fixture(scope='module')
def rotor(case_file, cache):
    return rs.load(case_file, cache_directory=cache)


def test_every_public_name_is_there_and_is_listed():
    assert rs.__all__ == sorted(rs.__all__)
    assert set(rs.__all__) <= set(dir(rs))
    assert not any(isinstance(getattr(rs, name), ModuleType) for name in rs.__all__)
    assert all(getattr(rs, name).__doc__ for name in rs.__all__)


def test_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match='has no attribute'):
        _ = rs.responce


def test_import_costs_nothing_and_a_name_only_its_room():
    code = ('import sys, rotorsoil_ros as rs\n'
            "heavy = {'numpy', 'scipy', 'rclpy', 'matplotlib', 'pydantic', 'yaml', 'rerun'}\n"
            'assert not heavy & set(sys.modules), heavy & set(sys.modules)\n'
            'rs.Soil\n'
            "assert not heavy - {'numpy'} & set(sys.modules)\n"
            'rs.load\n'
            "assert not {'rclpy', 'matplotlib', 'rerun', 'mcap'} & set(sys.modules)\n")
    done = subprocess.run([sys.executable, '-c', code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_response_is_what_the_model_solves(rotor):
    run = rotor.response(rpm=SPEEDS)
    solved = rotor.model.unbalance_response(run.speed, rotor.case.unbalance)
    np.testing.assert_array_equal(run.displacement, solved.displacement)
    np.testing.assert_array_equal(run.force, solved.force)
    np.testing.assert_allclose(run.speed_rpm, SPEEDS, rtol=1e-15)  # there and back
    assert run.channels == rotor.model.channels


def test_channel_is_chosen_by_name(rotor):
    run = rotor.response(rpm=SPEEDS)
    names = run.channels[3], run.channels[0]
    chosen = run[names]
    assert chosen.channels == names
    np.testing.assert_array_equal(chosen.displacement, run.displacement[:, [3, 0]])
    np.testing.assert_array_equal(run[names[0]].force[:, 0], run.force[:, 3])
    assert len(chosen) == len(SPEEDS)


def test_wrong_channel_is_named_with_the_nearest(rotor):
    with pytest.raises(rs.RotorSoilError, match=r"got 'disk_1_x'; did you mean disc_1_x\?"):
        _ = rotor.response(rpm=SPEEDS)['disk_1_x']
    with pytest.raises(rs.RotorSoilError, match='channel must be one of'):
        rotor.frf(force='nowhere', hz=10.0)


def test_plant_units_are_the_textbook_ones():
    omega = np.array([100.0])
    fan_x, block_ry = rs.Channel('fan', '', 'x'), rs.Channel('block', '', 'ry')
    run = rs.Response((fan_x, block_ry), omega, omega, np.array([[1e-6j, 2e-6]]),
                      np.full((1, 2), np.nan + 0j))
    assert run.displacement_um_pp().tolist() == [[2.0, 4.0]]
    # 1 um at 100 rad/s is 0.1 mm/s zero-to-peak.
    np.testing.assert_allclose(run.velocity_mm_s_rms(), [[0.1 / 2**0.5, 0.2 / 2**0.5]])
    # A lead of a quarter turn is a lag of three.
    assert run.phase_lag_deg().tolist() == [[270.0, 0.0]]
    assert run.units == {'fan_x': 'm', 'block_ry': 'rad'}


def test_frf_is_symmetric_at_rest(rotor):
    first, second = 'disc_1_x', 'disc_2_x'
    hz = [3.0, 12.0]
    there = rotor.frf(force=first, hz=hz)[second].displacement
    np.testing.assert_allclose(there, rotor.frf(force=second, hz=hz)[first].displacement,
                               rtol=1e-9)  # round-off of two solves (Maxwell)
    np.testing.assert_allclose(rotor.frf(force=first, hz=hz).frequency_hz, hz, rtol=1e-15)


def test_first_order_of_a_force_is_the_frf_at_running_speed(rotor):
    [by_order] = rotor.order_response(order=1.0, force='disc_1_x', rpm=1500.0).displacement
    [by_frequency] = rotor.frf(force='disc_1_x', hz=25.0, rpm=1500.0).displacement
    np.testing.assert_allclose(by_order, by_frequency, rtol=1e-9)  # two routes to one mode set


def test_profile_is_answered_as_the_table_does_and_nan_beyond_it(rotor):
    low, high = rotor.table.speed_range
    speeds = np.array([0.5 * (low + high), 2.0 * high])
    answer = rotor.predict(rs.Profile('m', np.array([7, 8]), speeds))
    looked_up = rotor.table.predictor(rotor.case.unbalance).predict(speeds[:1])
    np.testing.assert_array_equal(answer.displacement[0], looked_up.displacement[0])
    assert np.isnan(answer.displacement[1]).all()
    assert answer.stamp_ns.tolist() == [7, 8]


def test_band_holds_the_nominal_response(case_file, cache):
    fan = rs.load(case_file, cache_directory=cache, uncertainty={'samples': 4},
                  support={'model': 'cone'})
    bounds = fan.band(rpm=SPEEDS)
    nominal = fan.response(rpm=SPEEDS)
    # Bounds are straight lines between the speeds at which they were computed.
    assert np.all(bounds.low <= bounds.nominal * (1.0 + 1e-3))
    assert np.all(bounds.nominal <= bounds.high * (1.0 + 1e-3))
    np.testing.assert_allclose(bounds.nominal, nominal.amplitude, rtol=1e-4)  # table, solved
    low, _, _ = bounds['disc_1_x'].displacement_um_pp()
    np.testing.assert_array_equal(low, 2e6 * bounds['disc_1_x'].low)


def test_rigid_ground_has_no_band(case_file, cache):
    rigid = rs.load(case_file, cache_directory=cache, support={'model': 'rigid'})
    with pytest.raises(rs.InputError, match='rigid knows of no soil'):
        rigid.band(rpm=SPEEDS)


def test_overrides_go_key_by_key(case_file, cache):
    softer = rs.load(case_file, cache_directory=cache, soil={'shear_modulus': 30e6},
                     **{'foundations.0.mass': 50.0})
    plain = rs.load(case_file, cache_directory=cache)
    assert softer.case.soil.shear_modulus == 30e6
    assert softer.case.soil.density == plain.case.soil.density
    assert softer.case.foundations[0].mass == 50.0


def test_critical_speeds_are_crossings_of_the_campbell_diagram(rotor):
    for critical in rotor.critical_speeds()[:2]:
        modes = rotor.campbell(rpm=critical.speed_rpm)
        nearest = np.abs(modes.omega[0] - critical.speed).min()
        assert nearest < 1e-6 * critical.speed  # the root is found to 1e-12, modes to 1e-6


@pytest.mark.parametrize('rpm', [-1.0, np.nan, np.inf, [[1.0]], []])
def test_what_is_no_speed_is_refused(rotor, rpm):
    with pytest.raises(rs.RotorSoilError, match='rpm must be'):
        rotor.response(rpm=rpm)


def test_frames_carry_labels_and_units(rotor):
    run = rotor.response(rpm=SPEEDS)
    frame, cube = run.to_pandas(), run.to_xarray()
    assert isinstance(frame, pandas.DataFrame)
    assert isinstance(cube, xarray.Dataset)
    np.testing.assert_array_equal(frame['disc_1_x'], run['disc_1_x'].displacement[:, 0])
    assert frame.index.name == 'speed_rad_s'
    assert frame.attrs['units']['block_ry'] == 'rad'
    np.testing.assert_array_equal(
        cube['velocity'].sel(channel='disc_1_x'), run['disc_1_x'].velocity[:, 0])
