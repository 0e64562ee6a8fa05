"""The temperature of the oil chooses among tables: which, when, and the same out of a log."""

import math

from films import OIL_CASE
import numpy as np
import pytest

from rotorsoil_ros.bags import reader as bag_reader
from rotorsoil_ros.bags.predict import predict
from rotorsoil_ros.bags.writer import LogFile
from rotorsoil_ros.case.config import load
from rotorsoil_ros.case.machine import Machine
from rotorsoil_ros.errors import InputError
from rotorsoil_ros.events import Predicted, Remark
from rotorsoil_ros.monitor.monitor import Monitor
from rotorsoil_ros.monitor.oil import OilTables
from rotorsoil_ros.wire.cdr import encode, Layout
from rotorsoil_ros.wire.definitions import JOINT_STATE, TEMPERATURE
from rotorsoil_ros.wire.messages import JointStateWriter, Records
from rotorsoil_ros.wire.sensors import joint_states

SPEED = 250.0


@pytest.fixture(scope='module')
def blower(tmp_path_factory):
    """Return a machine on oil films with tables of 40, 60 and 80 deg C besides that of 50."""
    directory = tmp_path_factory.mktemp('oil')
    path = directory / 'oiled.yaml'
    path.write_text(OIL_CASE)
    return Machine.load(path, cache_directory=directory)


def exact(machine, celsius):
    case = machine.case.with_oil_of(celsius)
    return Machine(case, machine.directory).table.predictor(case.unbalance).predict(
        np.array([SPEED])).displacement[0]


def tables(*temperatures):
    """Return tables that are only told apart."""
    return OilTables({celsius: f'of {celsius:g}' for celsius in temperatures})


def test_nearest_temperature_is_chosen_and_the_ends_go_on():
    oils = tables(40.0, 60.0, 80.0)
    told = [oils.chosen(celsius) for celsius in (10.0, 41.0, 63.0, 100.0, 200.0)]
    assert told == ['of 40', None, 'of 60', 'of 80', None]


def test_temperature_between_two_tables_does_not_go_to_and_fro():
    oils = tables(40.0, 60.0)
    oils.chosen(45.0)
    assert [oils.chosen(celsius) for celsius in (50.5, 49.5, 51.9, 49.0)] == [None] * 4
    assert oils.chosen(52.1) == 'of 60'
    assert [oils.chosen(celsius) for celsius in (49.0, 48.1, 50.0)] == [None] * 3
    assert oils.chosen(47.9) == 'of 40'


@pytest.mark.parametrize('celsius', [math.nan, math.inf, -math.inf])
def test_temperature_that_is_none_changes_nothing(celsius):
    oils = tables(40.0, 60.0)
    assert oils.chosen(celsius) is None
    assert math.isnan(oils.at)


def test_machine_without_such_tables_hears_nothing():
    assert OilTables({}).chosen(50.0) is None


def test_answers_are_those_of_the_oil_that_was_told(blower):
    events = []
    monitor = Monitor('m', blower.table, blower.case.unbalance, sinks=[events.append],
                      oils=blower.oils)

    def answer():
        monitor.on_speed(np.array([10**9]), np.array([SPEED]))
        return [one for one in events if isinstance(one, Predicted)][-1].prediction.displacement[0]

    np.testing.assert_array_equal(answer(), exact(blower, 50.0))
    for told, of in ((78.0, 80.0), (41.0, 40.0), (math.nan, 40.0)):
        monitor.on_oil_temperature(np.array([10**9]), np.array([told]))
        np.testing.assert_array_equal(answer(), exact(blower, of))
    remarks = [one.text for one in events if isinstance(one, Remark)]
    assert remarks == ['oil of 78.0 deg C: answered from the tables of 80 deg C',
                       'oil of 41.0 deg C: answered from the tables of 40 deg C']
    hot, cold = exact(blower, 80.0), exact(blower, 40.0)
    assert np.abs(hot - cold).max() > 0.02 * np.abs(cold).max(), 'oil makes no difference here'
    monitor.set_unbalance(2.0 * blower.case.unbalance)
    np.testing.assert_allclose(answer(), 2.0 * cold, rtol=1e-12)


def test_log_is_answered_as_it_was_told(blower, tmp_path):
    start, speeds = 1_700_000_000_000_000_000, np.full(6, SPEED)
    stamps = start + 10**9 * np.arange(6)
    with LogFile(tmp_path / 'run.mcap') as log:
        for index, stamp in enumerate(stamps.tolist()):
            if index == 3:
                header = {'stamp': dict(zip(('sec', 'nanosec'), divmod(stamp - 1, 10**9),
                                            strict=True))}
                log.write(Records('/oiled/oil_temperature', TEMPERATURE, [stamp - 1], [
                    encode(TEMPERATURE, {'header': header, 'temperature': 79.0})]))
            log.write(Records('/oiled/joint_states', JOINT_STATE, [stamp], JointStateWriter(
                ['rotor']).write([stamp], np.full((1, 3, 1), speeds[index]))))
    out = tmp_path / 'out.mcap'
    assert not predict(blower, tmp_path / 'run.mcap', out).failure
    payloads = [payload for source, _, payload in bag_reader.messages(out, lambda *_: True)
                if source.topic == '/rotorsoil/oiled/amplitude']
    told = joint_states(Layout.of(JOINT_STATE, payloads[0]), payloads).position
    np.testing.assert_allclose(told[:3], np.abs([exact(blower, 50.0)] * 3), rtol=1e-14)
    np.testing.assert_allclose(told[3:], np.abs([exact(blower, 80.0)] * 3), rtol=1e-14)
    # What was told is in the log, so that it can be answered again.
    again = tmp_path / 'again.mcap'
    predict(blower, out, again)
    repeated = [payload for source, _, payload in bag_reader.messages(again, lambda *_: True)
                if source.topic == '/rotorsoil/oiled/amplitude']
    assert [bytes(one) for one in repeated] == [bytes(one) for one in payloads]


@pytest.mark.parametrize('setting, said', [
    ('rotor.oil_temperatures=[60, 40]', 'must be rising temperatures in deg C, got [60.0, 40.0]'),
    ('rotor.oil_temperatures=["60 bar"]', "must be a finite number in degC, got '60 bar'"),
    (f'rotor.oil_temperatures={list(range(20))}', 'must be at most 16 temperatures in deg C, '
                                                  'got 20'),
])
def test_temperatures_that_are_none_are_refused(blower, setting, said):
    with pytest.raises(InputError, match=r'rotor\.oil_temperatures') as caught:
        load(blower.case.path, [setting])
    assert said in str(caught.value)


def test_temperatures_belong_to_oil_films(case_file):
    with pytest.raises(InputError, match=r'rotor\.oil_temperatures: belongs to a rotor with a '):
        load(case_file, ['rotor.oil_temperatures=[40, 60]'])
