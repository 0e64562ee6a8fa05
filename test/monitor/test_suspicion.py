"""A slip of unit or of phase is named where the data says so, live and afterwards alike."""

import csv
import math
from pathlib import Path

import numpy as np
import pytest
from rcl_interfaces.msg import Log
from rclpy.serialization import deserialize_message

from rotorsoil_ros.bags import reader as bag_reader
from rotorsoil_ros.bags.comparison import compare
from rotorsoil_ros.bags.predict import predict
from rotorsoil_ros.bags.tables.imported import import_table
from rotorsoil_ros.case.machine import Machine
from rotorsoil_ros.monitor.verdict import Verdict
from rotorsoil_ros.units import rpm_to_rad_s

RUN_UP = Path(__file__).parents[1] / 'cases' / 'csv_with_bom' / 'run_up.csv'
CHANNEL = 'drive_end_housing_x'
REVERSED = 'phase looks reversed (lag given as lead)'
VELOCITIES = 'amplitudes look like mm/s: velocities were taken for displacements'


@pytest.fixture(scope='module')
def fan(cache):
    return Machine.load(Path('config/plant_fan.yaml'), cache_directory=cache)


@pytest.fixture(scope='module')
def truth(fan):
    """Return speeds [rpm] and what a housing of the fan does at them [m]."""
    rpm = np.linspace(400.0, 1500.0, 60)
    return rpm, fan.response(rpm=rpm)[CHANNEL].displacement.ravel()


@pytest.fixture
def judged(fan, tmp_path, cache):
    """Return what writes vectors as a table, imports it, and has it judged live and afterwards."""
    def run(rpm, vectors, *, unit='um 0-p', sense='lead', scale=1e6):
        with (tmp_path / 'run.csv').open('w', newline='') as stream:
            table = csv.writer(stream)
            table.writerow(['rpm', 'amplitude', 'phase'])
            table.writerows(zip(rpm.tolist(), (scale * np.abs(vectors)).tolist(),
                                np.degrees(np.angle(vectors)).tolist(), strict=True))
        import_table(tmp_path / 'run.csv', {
            'machine': 'plant_fan', 'speed': {'column': 'rpm', 'unit': 'rpm'},
            'channels': {CHANNEL: {
                'amplitude': {'column': 'amplitude', 'unit': unit},
                'phase': {'column': 'phase', 'unit': 'deg', 'sense': sense}}}},
            tmp_path / 'run.mcap', start_ns=1_700_000_000 * 10**9)
        predict(fan, tmp_path / 'run.mcap', tmp_path / 'log.mcap')
        events = [deserialize_message(payload, Log).msg for source, _, payload
                  in bag_reader.messages(tmp_path / 'log.mcap', lambda *_: True)
                  if source.topic == '/rotorsoil/plant_fan/events']
        return compare(tmp_path / 'log.mcap', fan, cache_directory=cache), events
    return run


def noisy(vectors, share=0.03):
    random = np.random.default_rng(0)
    size = share * np.sqrt(np.mean(np.abs(vectors) ** 2) / 2.0)
    return vectors + size * (random.normal(size=len(vectors))
                             + 1j * random.normal(size=len(vectors)))


def test_a_run_as_predicted_is_not_suspected(judged, truth):
    rpm, vectors = truth
    found, events = judged(rpm, noisy(vectors))
    assert found.verdict is Verdict.PASSES
    assert not any('look' in text for text in [*events, *found.remarks])


def test_lag_that_is_given_as_lead_is_named_and_passes_no_verdict(judged, truth):
    rpm, vectors = truth
    found, events = judged(rpm, noisy(vectors), sense='lag')
    assert REVERSED in found.remarks
    assert events.count(REVERSED) == 1
    assert found.verdict is Verdict.UNDECIDED


def test_mm_per_second_that_are_given_as_um_are_named_and_fail_nothing(judged, truth):
    rpm, vectors = truth
    found, events = judged(rpm, noisy(vectors) * rpm_to_rad_s(rpm), scale=1e3 / math.sqrt(2.0))
    assert VELOCITIES in found.remarks
    assert events.count(VELOCITIES) == 1
    assert (found.verdict, found.failures) == (Verdict.UNDECIDED, [])


def test_um_that_are_given_as_m_are_named_and_end_in_no_zone(judged, truth):
    rpm, vectors = truth
    found, events = judged(rpm, noisy(vectors), unit='m')
    [said] = [text for text in found.remarks if 'look like another unit' in text]
    assert said.startswith(f'amplitudes look like another unit: {CHANNEL} would move')
    assert any('look like another unit' in text for text in events)
    assert (found.verdict, found.failures) == (Verdict.UNDECIDED, [])


@pytest.mark.parametrize('change', [
    pytest.param(lambda rpm, vectors: 3.0 * np.exp(1j) * vectors, id='more unbalance elsewhere'),
    pytest.param(lambda rpm, vectors: np.interp(0.85 * rpm, rpm, np.abs(vectors)) * np.exp(
        1j * np.angle(vectors)), id='a peak elsewhere'),
    pytest.param(lambda rpm, vectors: vectors * np.linspace(1.0, 2.0, len(rpm)),
                 id='unbalance that grows'),
    pytest.param(lambda rpm, vectors: noisy(vectors, 2.0), id='noise'),
    pytest.param(lambda rpm, vectors: vectors[::-1], id='nonsense')])
def test_a_machine_that_is_another_is_not_taken_for_a_slip(judged, truth, change):
    rpm, vectors = truth
    found, events = judged(rpm, change(rpm, vectors))
    assert not any('look' in text for text in [*events, *found.remarks])


def test_points_at_one_speed_tell_no_unit(judged, truth):
    rpm, vectors = truth
    rpm = np.full(40, 1000.0) + np.linspace(0.0, 1.0, 40)
    found, _ = judged(rpm, noisy(np.full(40, vectors[30])) * rpm)
    assert not any('look like mm/s' in text for text in found.remarks)
