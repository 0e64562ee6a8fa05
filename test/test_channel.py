import copy
import pickle

import pytest

from rotorsoil_ros.channel import ACROSS, across, Channel, DOFS, HOUSING, JOURNAL, named
from rotorsoil_ros.errors import RotorSoilError

import machines

CHANNELS = [Channel('drive_end', JOURNAL, 'x'), Channel('fan', '', 'z'), Channel('b_1', '', 'ry'),
            Channel('b', HOUSING, 'z')]


def test_channel_is_found_under_its_name():
    assert Channel('drive_end', JOURNAL, 'x') == 'drive_end_journal_x'
    assert {Channel('fan', '', 'z'): 1}['fan_z'] == 1
    assert ('fan_x', 'fan_z').index(Channel('fan', '', 'z')) == 1
    assert f'{Channel("fan", "", "z")}' == Channel('fan', '', 'z').name == 'fan_z'


@pytest.mark.parametrize('channel', CHANNELS)
def test_name_reads_as_what_it_was_made_of(channel):
    read = Channel.parse(str(channel))
    assert (read.station, read.part, read.axis) == (channel.station, channel.part, channel.axis)


@pytest.mark.parametrize('name', ['', '_', 'x', '_x', 'temperature', 'fan_w', 'fan_X', 'journal'])
def test_name_without_an_axis_is_a_place_of_unknown_motion(name):
    read = Channel.parse(name)
    assert (read, read.station, read.part, read.axis) == (name, name, '', '')
    assert not read.is_rotation
    assert not read.is_housing


def test_model_tells_a_disc_from_a_journal_where_the_name_does_not():
    disc = Channel('fan_journal', '', 'x')
    assert Channel.parse(disc).part == JOURNAL
    assert named('fan_journal_x', [disc]).part == ''
    assert named('fan_journal_x', [disc]).station == 'fan_journal'
    assert named('other_journal_x', [disc]).part == JOURNAL


def test_model_names_its_channels_itself():
    model = machines.paper_machine()
    by_name = {str(channel): channel for channel in model.channels}
    bearing, block = model.rotor.bearings[0].name, model.foundations[0].name
    assert by_name[f'{bearing}_housing_z'].is_housing
    assert by_name[f'{bearing}_housing_z'].station == bearing
    assert [by_name[f'{block}_{dof}'].is_rotation for dof in DOFS] == [False] * 3 + [True] * 3


@pytest.mark.parametrize('channel', CHANNELS)
def test_channel_survives_copies_and_other_processes(channel):
    for again in (copy.deepcopy(channel), pickle.loads(pickle.dumps(channel))):
        assert again == channel
        assert (again.station, again.part, again.axis) == (
            channel.station, channel.part, channel.axis)


def test_channel_tells_its_unit_and_its_motion():
    assert [channel.unit for channel in CHANNELS] == ['m', 'm', 'rad', 'm']
    assert [channel.motion for channel in CHANNELS] == ['journal_x', 'z', 'ry', 'housing_z']
    assert [channel.place for channel in CHANNELS] == ['drive_end_journal', 'fan', 'b_1',
                                                       'b_housing']


def test_channel_cannot_be_changed():
    with pytest.raises(AttributeError):
        CHANNELS[0].axis = 'z'


def test_unknown_axis_is_refused():
    with pytest.raises(RotorSoilError, match=r"axis must be one of x, y, z, rx, ry, rz, got 'w'"):
        Channel('fan', '', 'w')


def test_place_moves_across_the_shaft():
    assert across('b', HOUSING) == tuple(f'b_housing_{axis}' for axis in ACROSS)
