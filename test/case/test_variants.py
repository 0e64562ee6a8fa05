"""What if? Every variant is the machine that its case file would be."""

from concurrent.futures import ThreadPoolExecutor
import csv
from pathlib import Path

import numpy as np
import pandas
import pytest

import rotorsoil_ros as rs
from rotorsoil_ros.case.design import variants
from rotorsoil_ros.case.design.variants import study
from rotorsoil_ros.cli import main
from rotorsoil_ros.errors import InputError
from rotorsoil_ros.figures.variants import study_figure

FAN = 'config/plant_fan.yaml'
UNSTABLE = Path('test/cases/unst/case.yaml')
GROUND, MASS = 'soil.shear_modulus', 'foundations.0.mass'


@pytest.fixture(scope='module')
def fan(tmp_path_factory):
    return rs.load(FAN, cache_directory=tmp_path_factory.mktemp('tables'))


@pytest.fixture(scope='module')
def found(fan):
    return study(fan, {GROUND: [4e7, 6e7, 1e8], MASS: [15000.0, 20000.0]}, rpm=[900.0, 990.0])


def test_every_variant_is_the_machine_of_such_a_case(fan, found):
    assert found.displacement.shape == (3, 2, 2, len(found.channels))
    for row, modulus in enumerate(found.values[GROUND]):
        for column, mass in enumerate(found.values[MASS]):
            alone = rs.load(FAN, cache_directory=fan.directory, **{GROUND: modulus, MASS: mass})
            np.testing.assert_array_equal(
                found.displacement[row, column], alone.response(rpm=[900.0, 990.0]).displacement)


def test_highest_velocity_is_that_of_the_housings(fan, found):
    housings = [index for index, channel in enumerate(found.channels) if channel.is_housing]
    velocity = found.velocity_mm_s_rms()[..., housings]
    np.testing.assert_array_equal(found.highest_mm_s_rms(), velocity.max(axis=(-2, -1)))
    alone = rs.load(FAN, cache_directory=fan.directory, **{GROUND: 6e7, MASS: 20000.0})
    assert found.highest_mm_s_rms()[1, 1] == pytest.approx(max(
        alone.response(rpm=[900.0, 990.0])[str(found.channels[index])].velocity_mm_s_rms().max()
        for index in housings), rel=1e-12)
    with pytest.raises(rs.RotorSoilError, match='channel must be'):
        found.highest_mm_s_rms('wheel_q')


def test_another_executor_finds_the_same(fan, found):
    with ThreadPoolExecutor(2) as pool:
        again = study(fan, dict(found.values), rpm=[900.0, 990.0], map=pool.map)
    np.testing.assert_array_equal(again.displacement, found.displacement)


def test_a_variant_that_is_no_machine_has_a_reason(fan):
    found = study(fan, {'soil.poisson_ratio': [0.2, 0.7]}, rpm=990.0)
    assert list(found.failures) == [(1,)]
    assert 'soil.poisson_ratio' in found.failures[1,]
    assert np.isnan(found.highest_mm_s_rms()).tolist() == [False, True]


def test_an_unstable_variant_has_no_steady_response(tmp_path):
    # Cross stiffness of opposite signs feeds a whirl; a symmetric one is a spring turned.
    machine = rs.load(UNSTABLE, cache_directory=tmp_path,
                      **{'rotor.bearings.1.stiffness.xz': 4e5})
    found = study(machine, {'rotor.bearings.0.stiffness.xz': [-4e5, 4e5]}, rpm=[1000.0, 1500.0])
    assert found.is_steady.tolist() == [False, True]
    assert found.failures == {}
    assert list(found.unstable) == [(0,)]
    assert 'grows, fed by the cross-coupled stiffness of b1' in found.unstable[0,]
    assert {row['failure'] for row in found.rows()} == {'', found.unstable[0,]}


@pytest.mark.parametrize('values, why', [
    ({}, '1 to 100000 variants'),
    ({GROUND: []}, 'one or more finite'),
    ({GROUND: [1e8, np.inf]}, 'one or more finite'),
    ({'soil.shear_modolus': [1e8]}, 'did you mean shear_modulus'),
])
def test_what_cannot_be_tried_is_refused(fan, values, why):
    with pytest.raises(InputError, match=why):
        study(fan, values, rpm=990.0)


def test_a_study_is_bounded_before_it_starts(fan, monkeypatch):
    monkeypatch.setattr(variants, 'MOST_VARIANTS', 5)
    with pytest.raises(InputError, match='1 to 5 variants, got 6'):
        study(fan, {GROUND: [1e8, 2e8, 3e8], MASS: [1e4, 2e4]}, rpm=990.0)


def test_table_has_a_row_for_every_variant_speed_and_channel(found):
    frame = pandas.DataFrame(found.rows())
    assert len(frame) == found.displacement.size
    [row] = frame[(frame[GROUND] == 6e7) & (frame[MASS] == 20000.0) & (frame.speed_rpm == 990.0)
                  & (frame.channel == 'fan_end_housing_x')].to_dict('records')
    column = [str(channel) for channel in found.channels].index('fan_end_housing_x')
    assert row['amplitude_m'] == abs(found.displacement[1, 1, 1, column])
    assert row['velocity_mm_s_rms'] == found.velocity_mm_s_rms()[1, 1, 1, column]


@pytest.mark.parametrize('values', [{GROUND: [4e7, 6e7]}, {GROUND: [4e7, 6e7], MASS: [1e4, 2e4]},
                                    {'soil.poisson_ratio': [0.2, 0.7]}])
def test_picture_has_units_on_every_axis(fan, values):
    figure = study_figure(study(fan, values, rpm=990.0))
    told = [text for axes in figure.axes for text in (axes.get_xlabel(), axes.get_ylabel())]
    assert set(values) <= set(told)
    assert 'highest velocity of a housing [mm/s rms]' in told


def test_picture_of_three_keys_is_refused(fan):
    found = study(fan, {GROUND: [1e8], MASS: [1e4], 'soil.density': [1900.0]}, rpm=990.0)
    with pytest.raises(InputError, match='one or two keys'):
        study_figure(found)


def test_verb_writes_table_and_picture(tmp_path, capsys):
    out, picture = tmp_path / 'x.csv', tmp_path / 'x.png'
    command = ['study', FAN, '--vary', f'{GROUND}=40e6:100e6:3', '--vary',
               'soil.poisson_ratio=0.25,0.7', '--rpm', '990', '-o', str(out),
               '--picture', str(picture), '--cache', str(tmp_path)]
    assert main(command) == 0
    assert picture.read_bytes().startswith(b'\x89PNG')
    with out.open() as stream:
        rows = list(csv.DictReader(stream))
    assert {float(row[GROUND]) for row in rows} == {40e6, 70e6, 100e6}
    assert 'poisson_ratio' in capsys.readouterr().err
    assert main(command) == 2
    assert 'exists; --force replaces it' in capsys.readouterr().err


@pytest.mark.parametrize('given', ['soil.density', '=1,2', 'soil.density=', 'soil.density=a,b',
                                   'soil.density=1:2:99999999999'])
def test_verb_refuses_what_is_no_list(given, capsys):
    with pytest.raises(SystemExit) as left:
        main(['study', FAN, '--vary', given, '--rpm', '990'])
    assert left.value.code == 2
    assert '--vary' in capsys.readouterr().err
