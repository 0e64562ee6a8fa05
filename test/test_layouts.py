"""The layouts for Foxglove and PlotJuggler show what the node of the shipped fan publishes."""

import json
from pathlib import Path
import re
from xml.etree import ElementTree

import pytest

from rotorsoil_ros.case.machine import Machine
from rotorsoil_ros.wire.cdr import ARRAYS
from rotorsoil_ros.wire.handlers import TOPICS
from rotorsoil_ros.wire.messages import DIAGNOSTICS_TOPIC, NODE_NAME, OWN_TOPICS
from rotorsoil_ros.wire.speeds import ROTOR_JOINT

LAYOUTS = Path(__file__).parents[1] / 'layouts'
FAN = 'plant_fan'
TOPICS_OF_FAN = {f'/{FAN}/{name}' for name in TOPICS} | {
    f'/{NODE_NAME}/{FAN}/{name}' for name in OWN_TOPICS} | {DIAGNOSTICS_TOPIC}


@pytest.fixture(scope='module')
def channels(cache):
    machine = Machine.load(Path('config/plant_fan.yaml'), cache_directory=cache)
    return list(machine.table.channels)


@pytest.fixture(scope='module')
def foxglove():
    return json.loads((LAYOUTS / 'foxglove.json').read_text())


def panels(layout):
    """Return the panels that a layout of Foxglove places."""
    if isinstance(layout, str):
        return [layout]
    assert set(layout) == {'direction', 'first', 'second', 'splitPercentage'}
    return panels(layout['first']) + panels(layout['second'])


def test_foxglove_places_every_panel_that_it_configures_once(foxglove):
    placed = panels(foxglove['layout'])
    assert sorted(placed) == sorted(foxglove['configById'])


def test_every_path_of_foxglove_is_published_and_its_place_is_the_channel_it_says(
        foxglove, channels):
    housings = [channel for channel in channels if channel.is_housing]
    shown = 0
    for config in foxglove['configById'].values():
        if 'topicToRender' in config:
            assert config['topicToRender'] in TOPICS_OF_FAN
        for path in config.get('paths', ()):
            topic, array, index = re.fullmatch(r'([/\w]+)\.(\w+)\[(\d+)\]',
                                               path['value']).groups()
            assert topic in TOPICS_OF_FAN
            assert array in ARRAYS
            name = topic.rpartition('/')[2]
            names = housings if name == 'velocity_rms' else channels
            if NODE_NAME in topic and name in ('velocity_rms', 'amplitude_low', 'phase'):
                assert path['label'].split()[0] == names[int(index)]
            shown += 1
    assert shown > 10


def test_every_curve_of_plotjuggler_is_a_number_that_is_published(channels):
    root = ElementTree.parse(LAYOUTS / 'plotjuggler.xml').getroot()
    assert root.tag == 'root'
    [splitter] = root.iter('DockSplitter')
    areas = splitter.findall('DockArea')
    assert int(splitter.get('count')) == len(areas) == len(splitter.get('sizes').split(';'))
    curves = [curve.get('name') for curve in root.iter('curve')]
    assert len(set(curves)) == len(curves) > 10
    for curve in curves:
        topic, name, array = curve.rsplit('/', 2)
        assert topic in TOPICS_OF_FAN
        assert array in ARRAYS
        assert name == ROTOR_JOINT if topic.endswith('joint_states') else name in channels
