"""The layouts for Foxglove and PlotJuggler show what the node of the shipped fan publishes."""

import json
from pathlib import Path
import re
from typing import get_args, get_type_hints
from xml.etree import ElementTree

from foxglove import layouts
import pytest
from ros_parser.message_path import parse_message_path

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


def test_foxglove_itself_knows_every_setting_of_a_plot(foxglove):
    """Held against the types of its own package, which writes layouts."""
    plots = [config for name, config in foxglove['configById'].items()
             if name.startswith('Plot!')]
    assert plots
    for config in plots:
        known = layouts.PlotConfig()._to_dict() | {'title': layouts.PlotPanel()}
        assert set(config) <= set(known)
        for name, kind in (('legendDisplay', 'legend_display'), ('xAxisVal', 'x_axis_val')):
            assert config[name] in words(layouts.PlotConfig, kind)
        for path in config['paths']:
            assert set(path) <= set(layouts.PlotSeries()._to_dict())
            assert path['timestampMethod'] in words(layouts.PlotSeries, 'timestamp_method')


def words(kind, name):
    """Return the words that a setting may be."""
    return [word for choice in get_args(get_type_hints(kind)[name]) for word in get_args(choice)]


def test_every_path_of_foxglove_is_one_number_of_a_message(foxglove):
    """Held against an independent parser of its paths."""
    paths = [path['value'] for config in foxglove['configById'].values()
             for path in config.get('paths', ())]
    for path in paths:
        said = parse_message_path(path)
        assert said.topic in TOPICS_OF_FAN
        field, index = said.segments
        assert field.field_name in ARRAYS
        assert index.index >= 0


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
