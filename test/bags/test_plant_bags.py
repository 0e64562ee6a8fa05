"""Bags of plants: which machine a topic tells of, and one message that tells all speeds."""

from pathlib import Path

import numpy as np
import pytest

from rotorsoil_ros.bags.comparison import compare, Wish
from rotorsoil_ros.bags.feed import Inputs
from rotorsoil_ros.bags.predict import predict
from rotorsoil_ros.bags.profile import in_plants, read_profile
from rotorsoil_ros.bags.tables.exported import export_log
from rotorsoil_ros.bags.writer import LogFile
from rotorsoil_ros.case.machine import Machine
from rotorsoil_ros.errors import InputError
from rotorsoil_ros.profile import Profile
from rotorsoil_ros.wire.definitions import JOINT_STATE
from rotorsoil_ros.wire.messages import JointStateWriter, Records

from records import START, topics_of

HOUSE = Path(__file__).parents[2] / 'config' / 'fan_house.yaml'
STAMPS = [START + 10**8 * step for step in range(40)]
SPEEDS = {'fan_1': np.linspace(60.0, 150.0, 40), 'fan_2': np.linspace(70.0, 160.0, 40)}


@pytest.fixture(scope='module')
def fan(cache):
    return Machine.load(Path(f'{HOUSE}#fan_1'), cache_directory=cache)


def states(topic, names, **given):
    """Return JointStates of names, of whose arrays some are given, (n, names)."""
    values = np.full((len(STAMPS), 3, len(names)), np.nan)
    for array, value in given.items():
        values[:, ('position', 'velocity', 'effort').index(array)] = value
    return Records(topic, JOINT_STATE, STAMPS, JointStateWriter(names).write(STAMPS, values))


@pytest.fixture
def bag(tmp_path):
    """Return what writes records as a bag."""
    def write(*records, name='bag.mcap'):
        with LogFile(tmp_path / name) as log:
            for each in records:
                log.write(each)
        return tmp_path / name
    return write


def told_apart(plant):
    return [states(f'/{plant}/{name}/joint_states', ['rotor'], velocity=speed[:, None])
            for name, speed in SPEEDS.items()]


def test_machine_of_a_plant_is_answered_as_the_node_answers_it(fan, bag, tmp_path):
    said = predict(fan, bag(*told_apart('hall')), tmp_path / 'log.mcap')
    assert said.machine == 'hall/fan_1'
    assert said.counts['answered'] == len(STAMPS)
    assert {'/hall/fan_1/joint_states', '/rotorsoil/hall/fan_1/amplitude',
            '/rotorsoil/hall/fan_1/model'} <= {*topics_of(tmp_path / 'log.mcap')}


def test_one_message_for_all_is_the_same_as_one_for_each(fan, bag, tmp_path):
    together = bag(states('/hall/joint_states', ['fan_2', 'fan_1'], velocity=np.stack(
        [SPEEDS['fan_2'], SPEEDS['fan_1']], axis=1)))
    apart = bag(*told_apart('hall'), name='apart.mcap')
    logs = {}
    for name, profile in (('together', together), ('apart', apart)):
        assert predict(fan, profile, tmp_path / f'{name}.log').machine == 'hall/fan_1'
        logs[name] = topics_of(tmp_path / f'{name}.log')
    assert logs['together'] == logs['apart']
    assert Inputs.of(together, machine='hall/fan_2').speed.joint == 'fan_2'


def test_measured_vectors_of_a_machine_are_held_against_its_part(fan, bag):
    answered = fan.predict(Profile('fan_1', np.array(STAMPS), SPEEDS['fan_1']))
    column = fan.table.channels.index('fan_2_fan_end_housing_x')
    vector, names = answered.displacement[:, [column]], [fan.table.channels[column]]
    log = bag(*told_apart('hall'), states('/hall/fan_1/measured/amplitude', names,
                                          position=np.abs(vector)),
              states('/hall/fan_1/measured/phase', names, position=np.angle(vector)))
    for name in ('fan_1', 'hall/fan_1', ''):
        found = compare(log, fan, Wish(machine=name))
        assert found.run.machine == 'hall/fan_1'
        [points] = found.points
        np.testing.assert_allclose(points.measured, vector[:, 0], rtol=1e-9)
        np.testing.assert_allclose(points.predicted, vector[:, 0], rtol=1e-9)
    with pytest.raises(InputError, match='nothing measured'):
        compare(log, fan, Wish(machine='hall/fan_2'))


def test_equal_machines_of_two_plants_are_not_mixed_up(fan, bag, tmp_path):
    both = [records for hall in ('hall_a', 'hall_b') for records in told_apart(hall)]
    answers = [states(f'/rotorsoil/{hall}/fan_1/amplitude', ['block_x'], position=size)
               for hall, size in (('hall_a', 1.0), ('hall_b', 2.0))]
    models = [Records(f'/rotorsoil/{hall}/fan_1/model', 'std_msgs/msg/String', STAMPS[:1], [
        b'\0\1\0\0\1\0\0\0\0']) for hall in ('hall_a', 'hall_b')]
    log = bag(*both, *answers, *models)
    assert in_plants(topics_of(log)) == {'hall_a/fan_1', 'hall_b/fan_1'}
    assert read_profile(log, machine='hall_b/fan_1').machine == 'hall_b/fan_1'
    with pytest.raises(InputError, match='machine must be one of hall_a/fan_1'):
        read_profile(log, machine='fan_1')
    export_log(log, tmp_path / 'table.csv')
    lines = [line.split(',') for line in (tmp_path / 'table.csv').read_text().splitlines()]
    column = lines[0].index('predicted_m')
    told = {(line[0], float(line[column])) for line in lines[1:] if line[column]}
    assert told == {('hall_a/fan_1', 1.0), ('hall_b/fan_1', 2.0)}


@pytest.mark.parametrize('topics, plants', [
    (['/rotorsoil/fan/model', '/fan/joint_states'], set()),
    (['/hall/rotorsoil/fan/model', '/hall/fan/joint_states'], set()),
    (['/hall/rotorsoil/house/fan/model', '/hall/house/fan/joint_states'], {'house/fan'}),
    (['/watcher/house/fan/model', '/house/fan/rotor/speed'], {'house/fan'}),
    (['/site/watcher/fan/model', '/site/fan/rotor/speed'], set())])
def test_plants_are_told_from_halls_by_where_the_node_stands(topics, plants):
    assert in_plants(topics) == plants
