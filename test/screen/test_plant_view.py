"""Machines of a plant stand in one scene, each moving all of it at its own frequency."""

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip('rerun', reason='rerun-sdk is optional')

from rotorsoil_ros.case import document
from rotorsoil_ros.case.config import case_of
from rotorsoil_ros.case.models import coupled_model
from rotorsoil_ros.screen.blueprint import Shown
from rotorsoil_ros.screen.channels import HOUSINGS, NEIGHBOURS, trends
from rotorsoil_ros.screen.plant import PlantView, ShownPlant
from rotorsoil_ros.screen.scene import Scene

from recordings import Paper, predicted, START

CONFIG = Path(__file__).parents[2] / 'config'
SECOND = 10**9
TOGETHER = '/house/all-machines/'


@pytest.fixture
def house(tmp_path):
    """Return the case of a fan whose neighbours are turned and upright, and its channels."""
    content = document.read(CONFIG / 'fan_house.yaml')
    fan = document.read(CONFIG / 'plant_fan.yaml')['rotor']
    content['machines'][0]['rotor'] = fan
    content['machines'][1] |= {
        'rotor': fan, 'place': {'x': 1.25, 'y': 0.8, 'heading': '90 deg'}}
    content['machines'].append(content['machines'][0] | {
        'name': 'pump', 'rotor': fan | {'orientation': 'vertical'},
        'place': {'x': 0.5, 'y': -0.9}})
    case = case_of(tmp_path / 'house.yaml', content | {'source': 'fan_1'})
    return case, coupled_model(case, tmp_path).channels


def test_every_machine_stands_at_its_place_and_heading(house):
    scene = Scene(*house)
    ends = {line.name: line.points(line.y[[0, -1]], np.zeros((2, 2))) for line in scene.lines}
    length = house[0].rotor.length
    for name, start, end in (
            ('fan_1', (-1.25, -0.2, 2.0), (-1.25, -0.2 + length, 2.0)),
            ('fan_2', (1.25, 0.8, 2.0), (1.25 - length, 0.8, 2.0)),
            ('pump', (0.5, -0.9, 2.0), (0.5, -0.9, 2.0 + length))):
        np.testing.assert_allclose(ends[name], [start, end], atol=1e-12, err_msg=name)
    [block] = scene.blocks
    feet = [leg[1] for leg in block.legs]  # the tops of six trestles, on the shafts
    np.testing.assert_allclose(feet[-2:], [(0.5, -0.9, 2.25), (0.5, -0.9, 3.25)], atol=1e-12)
    assert {name for name, _ in scene.names} == {'fan_1', 'fan_2', 'pump'}


def test_neighbours_of_one_machine_rest_and_those_of_the_plant_move(house):
    case, channels = house
    at = channels.index('fan_2_wheel_x')
    motion = np.zeros((1, len(channels)))
    motion[0, at] = 1.0
    alone, whole = Scene(case, channels), Scene(case, channels, whole=True)
    assert [line.name for line in alone.moving] == ['fan_1']
    assert [line.name for line in whole.moving] == [line.name for line in alone.lines]
    assert (alone.largest(motion)[0], whole.largest(motion)[0]) == (0.0, 1.0)


def test_a_disc_of_a_standing_machine_lies_flat(house):
    scene = Scene(*house)
    pump = next(line for line in scene.lines if line.name == 'pump')
    rims = pump.discs(np.zeros((1, len(pump.stations), 2)))[0]
    assert np.ptp(rims[..., 2], axis=1) == pytest.approx(0.0)
    assert np.ptp(rims[1, :, 0]) == pytest.approx(2.0 * max(
        station.radius for station in pump.stations))


def test_what_neighbours_do_has_a_tab_of_its_own(house):
    case, channels = house
    shown = trends('fan_1', case, channels)
    kinds = {trend.channel: trend.kind for trend in shown}
    assert kinds['fan_1_fan_end_housing_x'] == HOUSINGS
    beside = [channel for channel, kind in kinds.items() if kind == NEIGHBOURS]
    assert beside == [channel for channel in channels
                      if channel.is_housing and not channel.startswith('fan_1')]
    assert all(channels[trend.column] == trend.channel for trend in shown)


@pytest.mark.parametrize('name', ['house/total', 'house/picture', 'house/caption', 'house'])
def test_a_machine_of_any_name_is_drawn_apart_from_its_plant(house, name):
    case, channels = house
    plant = ShownPlant('house', (name,), Scene(case, channels))
    machine = Shown(name, case, trends(name, case, channels), Scene(case, channels))
    own = [trend.entity for trend in machine.trends] + [
        machine.entity(part) for part in ('speed', 'picture', 'caption')]
    for together in (plant.entity('total', channels[0]), *(
            plant.entity(part) for part in ('picture', 'caption'))):
        assert not [path for path in own if path == together
                    or path.startswith(f'{together}/') or together.startswith(f'{path}/')]
    assert not [path for path in own if path.startswith(plant.entity('total') + '/')]


@pytest.fixture
def paper():
    return Paper()


@pytest.fixture
def plant(paper, machine):
    """Return the view of two sources `fan` and `other` on one block."""
    channels = machine.table.channels
    return PlantView(paper, ShownPlant('house', ('fan', 'other'), Scene(
        machine.case, channels)), channels)


def answers(machine, name, speed, *, start=START):
    found = predicted(machine, [speed] * 11, start=start, period=SECOND // 10)
    return type(found)(name, found.stamp_ns, found.prediction)


def test_each_source_moves_the_block_at_its_own_frequency(paper, machine, plant):
    for name, speed in (('fan', 300.0), ('other', 150.0)):
        plant.take(answers(machine, name, speed))
    plant.flush()
    [words] = paper.drawn[TOGETHER + 'caption', 'TextDocument:text'][-1]
    scale = float(words.split(' x ')[1].split('*')[0])
    assert 'fan 2865 rpm, other 1432 rpm' in words
    first = machine.table.channels.index('block_x')
    # One turn of the fastest takes 4 s: after 1 s it is at a quarter, the other at an eighth.
    assert START % (4 * SECOND) == 0
    expected = sum(np.real(answers(machine, 'it', speed).prediction.displacement[
        0, first:first + 3] * np.exp(1j * turn))
        for speed, turn in ((300.0, 0.5 * np.pi), (150.0, 0.25 * np.pi)))
    moved = paper.drawn[TOGETHER + 'picture/block/moving', 'Transform3D:translation'][-1][0]
    np.testing.assert_allclose(moved, scale * expected, rtol=1e-6)  # single precision


def test_housings_feel_the_root_of_the_sum_of_squares(paper, machine, plant):
    events = [answers(machine, 'fan', 300.0), answers(machine, 'other', 150.0)]
    for event in events:
        plant.take(event)
    plant.flush()
    at = machine.table.channels.index('bearing_1_housing_z')
    parts = [event.prediction.speed[0] * abs(event.prediction.displacement[0, at])
             for event in events]
    assert paper.drawn[TOGETHER + 'total/bearing_1_housing_z', 'values'] == pytest.approx(
        [1e3 * np.hypot(*parts) / np.sqrt(2.0)] * 11)


def test_a_silent_machine_adds_nothing_and_is_named(paper, machine, plant):
    plant.take(answers(machine, 'other', 150.0))
    plant.take(answers(machine, 'fan', 300.0, start=START + 5 * SECOND))
    plant.flush()
    [words] = paper.drawn[TOGETHER + 'caption', 'TextDocument:text'][-1]
    assert 'at fan 2865 rpm, nothing of other;' in words
    alone = answers(machine, 'fan', 300.0).prediction
    at = machine.table.channels.index('bearing_1_housing_z')
    assert paper.drawn[TOGETHER + 'total/bearing_1_housing_z', 'values'][-1] == pytest.approx(
        1e3 * 300.0 * abs(alone.displacement[0, at]) / np.sqrt(2.0))
