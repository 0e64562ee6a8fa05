"""A log as a long table says what the log says, message by message, with units in its columns."""

import csv
import math
from pathlib import Path

import numpy as np
import pyarrow.parquet
import pytest

from rotorsoil_ros.bags.predict import predict
from rotorsoil_ros.bags.tables.exported import COLUMNS, export_log
from rotorsoil_ros.bags.tables.imported import import_table
from rotorsoil_ros.case.machine import Machine
from rotorsoil_ros.cli import main
from rotorsoil_ros.errors import InputError
from rotorsoil_ros.units import rpm_to_rad_s

START = 1_700_000_000_000_000_000
CHANNEL = 'drive_end_housing_x'


@pytest.fixture(scope='module')
def fan(cache):
    return Machine.load(Path('config/plant_fan.yaml'), cache_directory=cache)


@pytest.fixture(scope='module')
def log(fan, tmp_path_factory):
    """Return a log of a fan that was measured 30 % above its prediction at 20 constant speeds."""
    place = tmp_path_factory.mktemp('log')
    rpm = np.linspace(700.0, 1500.0, 20)
    answer = fan.response(rpm=rpm)[CHANNEL]
    # So far apart that each is a machine which has always turned so.
    rows = zip(np.arange(20) * 11.0, rpm, 1.3 * answer.displacement_um_pp().ravel(),
               answer.phase_lag_deg().ravel(), strict=True)
    (place / 'run.csv').write_text('time,rpm,um,deg\n' + ''.join(
        ','.join(map(repr, map(float, row))) + '\n' for row in rows))
    import_table(place / 'run.csv', {
        'machine': 'plant_fan', 'time': {'column': 'time', 'unit': 's'},
        'speed': {'column': 'rpm', 'unit': 'rpm'},
        'channels': {CHANNEL: {'amplitude': {'column': 'um', 'unit': 'um p-p'},
                               'phase': {'column': 'deg', 'unit': 'deg', 'sense': 'lag'}}}},
        place / 'run.mcap', start_ns=START)
    predict(fan, place / 'run.mcap', place / 'log.mcap')
    return place / 'log.mcap'


@pytest.fixture(scope='module')
def rows(log, tmp_path_factory):
    out = tmp_path_factory.mktemp('csv') / 'log.csv'
    count = export_log(log, out)
    with out.open(newline='') as stream:
        found = list(csv.DictReader(stream))
    assert len(found) == count
    return found


def column(rows, name):
    return np.array([float(row[name] or 'nan') for row in rows])


def test_every_speed_has_a_row_for_every_channel_with_what_the_table_says(rows, fan):
    assert list(rows[0]) == list(COLUMNS)
    assert {row['machine'] for row in rows} == {'plant_fan'}
    stamps = [START + 11 * 10**9 * step for step in range(20)]
    by_channel = {name: [row for row in rows if row['channel'] == name]
                  for name in fan.table.channels}
    assert sum(map(len, by_channel.values())) == len(rows)
    predicted = fan.table.predictor(fan.case.unbalance).predict(
        column(by_channel[CHANNEL], 'speed_rad_s'))
    for name, own in by_channel.items():
        assert [int(row['stamp_ns']) for row in own] == stamps
        at = fan.table.channels.index(name)
        unit, other = (name.unit, {'m': 'rad', 'rad': 'm'}[name.unit])
        np.testing.assert_allclose(column(own, f'predicted_{unit}'),
                                   np.abs(predicted.displacement[:, at]), rtol=1e-12)
        assert np.isnan(column(own, f'predicted_{other}')).all()
        np.testing.assert_allclose(column(own, 'predicted_phase_rad'),
                                   np.angle(predicted.displacement[:, at]), atol=1e-9)
        # A machine that has always turned so answers steadily, of which nothing is said twice.
        for quantity in (unit, 'phase_rad'):
            np.testing.assert_array_equal(
                column(own, f'steady_{quantity}'), column(own, f'predicted_{quantity}'))


def test_what_was_measured_stands_beside_it_with_residual_band_and_zone(rows):
    own = [row for row in rows if row['channel'] == CHANNEL]
    size, expected = column(own, 'measured_m'), column(own, 'predicted_m')
    np.testing.assert_allclose(size, 1.3 * expected, rtol=1e-9)
    np.testing.assert_allclose(column(own, 'residual_m'), 0.3 * expected, rtol=1e-6)
    np.testing.assert_allclose(column(own, 'measured_velocity_m_s_rms'),
                               size * column(own, 'speed_rad_s') / math.sqrt(2.0), rtol=1e-12)
    low, high = column(own, 'predicted_low_m'), column(own, 'predicted_high_m')
    told = np.isfinite(low)
    assert told.any()
    assert (low[told] <= expected[told] * 1.0000001).all()
    assert (expected[told] <= high[told] * 1.0000001).all()
    assert {row['measured_zone'] for row in own} & set('ABCD')
    others = [row for row in rows if row['channel'] != CHANNEL]
    assert np.isnan(column(others, 'measured_m')).all()
    assert {row['measured_zone'] for row in others} == {''}


def test_parquet_holds_the_same_with_null_where_nothing_is_known(log, rows, tmp_path):
    assert export_log(log, tmp_path / 'log.parquet') == len(rows)
    found = pyarrow.parquet.read_table(tmp_path / 'log.parquet').to_pylist()
    for mine, theirs in zip(found, rows, strict=True):
        for name, kind in COLUMNS.items():
            assert mine[name] == (kind(theirs[name]) if theirs[name] else
                                  '' if mine[name] == '' else None)


def test_the_verb_writes_what_was_measured_without_any_case(log, tmp_path, capsys):
    out = tmp_path / 'run.csv'
    assert main(['export', str(log.with_name('run.mcap')), '-o', str(out)]) == 0
    assert 'run.csv: 20 rows' in capsys.readouterr().out
    with out.open(newline='') as stream:
        found = list(csv.DictReader(stream))
    np.testing.assert_allclose(column(found, 'speed_rad_s'),
                               rpm_to_rad_s(np.linspace(700.0, 1500.0, 20)), rtol=1e-12)
    assert np.isfinite(column(found, 'measured_phase_rad')).all()
    plant = tmp_path / 'plant.csv'
    assert main(['export', str(log.with_name('run.mcap')), '-o', str(plant), '--units',
                 'plant']) == 0
    with plant.open(newline='') as stream:
        told = list(csv.DictReader(stream))
    np.testing.assert_allclose(column(told, 'measured_um_pp'),
                               2e6 * column(found, 'measured_m'), rtol=1e-12)
    np.testing.assert_allclose(column(told, 'speed_rpm'), np.linspace(700.0, 1500.0, 20))
    assert main(['export', str(log), '-o', str(out)]) == 2
    assert 'exists; --force replaces it' in capsys.readouterr().err


def test_memory_is_of_seconds_and_not_of_the_log(log, monkeypatch, rows, tmp_path):
    monkeypatch.setattr('rotorsoil_ros.bags.tables.exported.ROWS_AT_ONCE', 7)
    export_log(log, tmp_path / 'log.csv')
    with (tmp_path / 'log.csv').open(newline='') as stream:
        assert list(csv.DictReader(stream)) == rows


@pytest.mark.parametrize('name, options, words', [
    ('x.xlsx', {}, r'must end with \.csv or \.parquet'),
    ('x.csv', {'machine': 'pump'}, 'tells nothing of pump')])
def test_what_cannot_be_written_is_refused(log, tmp_path, name, options, words):
    with pytest.raises(InputError, match=words):
        export_log(log, tmp_path / name, **options)
    assert list(tmp_path.iterdir()) == []
