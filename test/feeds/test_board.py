"""What a feed tells is what the node said, and how far that can be trusted."""

import math

import numpy as np
import pytest

from rotorsoil_ros.channel import Channel
from rotorsoil_ros.events import Level
from rotorsoil_ros.feeds.board import SILENCE_S
from rotorsoil_ros.feeds.hearsay import HEARD, places_in, Speaker
from rotorsoil_ros.feeds.points import OF_CHANNEL, Quality, quantities_of, unit_of
from rotorsoil_ros.wire.messages import DIAGNOSTICS_TOPIC, OWN_TOPICS, PLANT_TOPICS

from plants import Plant, RUNNING, SECOND, START, totals

X = Channel('bearing_1', 'housing', 'x')
PREDICTED = [name for name, quantity in OF_CHANNEL.items()
             if not quantity.is_measured and name != 'Reason']


@pytest.fixture
def plant(machine):
    return Plant(machine)


def qualities(machine, names, channel=X):
    return {machine.points[channel, name].quality for name in names}


@pytest.mark.parametrize('topic, node, machine, told, name', [
    ('/rotorsoil/fan/amplitude', 'rotorsoil', 'fan', 'amplitude', 'fan'),
    ('/hall_2/rotorsoil/fan/phase', 'hall_2/rotorsoil', 'fan', 'phase', 'hall_2.fan'),
    ('/hall_2/line/rotorsoil/fan/model', 'hall_2/line/rotorsoil', 'fan', 'model',
     'hall_2.line.fan'),
    ('/watcher/fan/residual', 'watcher', 'fan', 'residual', 'watcher.fan'),
    ('/hall_2/rotorsoil/house/fan/phase', 'hall_2/rotorsoil', 'house/fan', 'phase',
     'hall_2.house/fan')])
def test_a_topic_tells_who_speaks(topic, node, machine, told, name):
    place, what = Speaker.of(topic)
    assert (place.node, place.machine, what, place.name) == (node, machine, told, name)
    assert topic == f'/{place.path}/{told}'


@pytest.mark.parametrize('topic', [
    *(f'/rotorsoil/fan/{name}' for name in OWN_TOPICS if name not in HEARD),
    '/amplitude', '/fan/amplitude_x', '/diagnostics', ''])
def test_other_topics_are_nobodys(topic):
    assert Speaker.of(topic) is None


def test_who_answers_has_every_topic_of_ours_and_nobody_else_does():
    ours = {f'/hall/watcher/fan/{name}': kind for name, kind in OWN_TOPICS.items()}
    other = {'/camera/left/amplitude_low': 'sensor_msgs/msg/JointState'}
    assert places_in({**ours, **other}) == [Speaker('hall/watcher', 'fan')]
    del ours['/hall/watcher/fan/residual']
    assert places_in(ours) == []
    plant = {f'/rotorsoil/house/{name}': kind for name, kind in PLANT_TOPICS.items()}
    assert places_in({**plant, '/bill/total': 'sensor_msgs/msg/JointState'}) == [
        Speaker('rotorsoil', 'house')]


def test_every_value_of_every_channel_is_there_before_the_first_speed(plant, machine):
    seen = plant.at()
    assert seen.channels == tuple(machine.table.channels)
    assert {channel for channel, _ in seen.points} == {'', *machine.table.channels}
    assert qualities(seen, PREDICTED) == {Quality.WAITING}
    assert {point.value for point in seen.points.values() if point.quantity != 'Reason'} == {None}
    assert 'VelocityRms' not in quantities_of('disc_1_x')


def test_a_value_is_that_of_the_prediction_at_the_stamp_of_the_speed(plant):
    plant.turns(1.0, RUNNING, RUNNING)
    seen, vector = plant.at(), plant.expected(X, RUNNING)
    told = {name: seen.points[X, name] for name in ('Amplitude', 'Phase', 'VelocityRms')}
    assert told['Amplitude'].value == pytest.approx(abs(vector), rel=1e-14)
    assert told['Phase'].value == pytest.approx(np.angle(vector), abs=1e-14)
    assert told['VelocityRms'].value == pytest.approx(
        RUNNING * abs(vector) / math.sqrt(2.0), rel=1e-14)
    assert {(point.quality, point.stamp_ns) for point in told.values()} == {
        (Quality.GOOD, START + SECOND + 1)}  # of two speeds the last one counts
    assert told['Amplitude'].unit.symbol == 'm'


def test_in_units_of_a_plant_it_is_the_same(machine):
    plant = Plant(machine, plant=True)
    plant.turns(1.0, RUNNING)
    plant.ticks(1.5)
    seen, vector = plant.at(), plant.expected(X, RUNNING)
    assert seen.points[X, 'Amplitude'].value == pytest.approx(2e6 * abs(vector), rel=1e-12)
    assert seen.points[X, 'Phase'].value == pytest.approx(
        -math.degrees(np.angle(vector)) % 360.0, abs=1e-9)
    assert seen.points['', 'Speed'].value == pytest.approx(RUNNING * 30.0 / math.pi, abs=1e-4)
    assert unit_of('block_rx', 'Amplitude', plant=True).symbol == 'µrad p-p'
    assert seen.points[X, 'Phase'].unit.range == (0.0, 360.0)


@pytest.mark.parametrize('speed, quality', [
    (1e4, Quality.OUT_OF_TABLE), (-5.0, Quality.UNANSWERED), (0.0, Quality.STANDING)])
def test_a_number_without_an_answer_says_why_and_is_none(plant, speed, quality):
    plant.turns(1.0, RUNNING)
    plant.at()
    plant.turns(1.1, speed)
    plant.ticks(1.5)
    seen = plant.at()
    assert qualities(seen, ('Amplitude', 'Phase')) == {quality}
    assert seen.points[X, 'Amplitude'].value is None
    assert f'Amplitude, Phase, VelocityRms: {quality.value}' in seen.points[X, 'Reason'].value
    plant.turns(1.6, RUNNING)
    assert qualities(plant.at(), ('Amplitude', 'Phase')) == {Quality.GOOD}


def test_a_speed_at_which_the_case_is_unstable_is_told_as_such(plant):
    plant.monitor.health.note('unstable', 2)
    plant.turns(1.0, math.nan)
    plant.ticks(1.5)
    assert qualities(plant.at(), ('Amplitude', 'Phase')) == {Quality.UNSTABLE}


def test_silence_of_the_speed_makes_the_last_value_uncertain(plant):
    plant.turns(1.0, RUNNING)
    for second in range(1, 7):
        plant.ticks(second)
    seen = plant.at()
    assert qualities(seen, ('Amplitude', 'Phase', 'VelocityRms')) == {Quality.STALE}
    assert seen.points[X, 'Amplitude'].value == pytest.approx(abs(plant.expected(X, RUNNING)))
    assert seen.points[X, 'Amplitude'].stamp_ns == START + SECOND
    assert seen.points['', 'State'].value == 'STALE'
    assert seen.points['', 'Speed'].quality is Quality.STALE


def test_silence_of_the_node_takes_every_value_back_and_a_restart_begins_anew(plant):
    plant.turns(1.0, RUNNING)
    plant.measures(1.0, 1.2, X)
    plant.ticks(1.5)
    assert plant.at(10.0).points[X, 'Residual'].quality is Quality.GOOD
    assert not plant.at(10.0 + SILENCE_S).is_silent
    seen = plant.at(10.1 + SILENCE_S)
    assert seen.is_silent
    assert {point.quality for key, point in seen.points.items() if key[1] != 'Reason'} == {
        Quality.SILENT}
    assert {point.value for key, point in seen.points.items() if key[1] != 'Reason'} == {None}
    plant.start()
    plant.turns(20.0, RUNNING)
    plant.ticks(20.5)
    seen = plant.at(30.0)
    assert not seen.is_silent
    assert seen.points[X, 'Amplitude'].quality is Quality.GOOD
    assert seen.points[X, 'Residual'].quality is Quality.NOT_MEASURED


def test_a_restart_that_nobody_noticed_forgets_what_was_measured(plant):
    plant.turns(1.0, RUNNING, RUNNING)
    plant.measures(1.0, 1.2, X)
    plant.ticks(1.5)
    plant.at(1.0)
    plant.start()
    plant.turns(2.0, RUNNING)
    plant.ticks(2.5)
    assert plant.at(2.0).points[X, 'Residual'].quality is Quality.NOT_MEASURED


def test_residual_and_zones_come_from_what_is_measured(plant):
    plant.turns(1.0, RUNNING)
    plant.measures(1.0, 1.5, X)
    plant.ticks(1.5)
    plant.vibrates(1.6, {
        f'{X}_measured_mm_s_rms': 2.25, f'{X}_measured_zone': 'B', f'{X}_inside_band': 0.75,
        f'{X}_alarm_mm_s_rms': math.nan, f'{X}_verdict': 'fails', 'verdict': 'fails'}, Level.WARN)
    seen = plant.at().points
    assert seen[X, 'Residual'].value == pytest.approx(0.5 * abs(plant.expected(X, RUNNING)))
    assert seen[X, 'MeasuredVelocityRms'].value == pytest.approx(2.25e-3)
    assert (seen[X, 'MeasuredZone'].value, seen[X, 'InsideBand'].value) == ('B', 0.75)
    assert (seen[X, 'Verdict'].value, seen['', 'Verdict'].value) == ('fails', 'fails')
    assert seen[X, 'AlarmVelocityRms'].quality is Quality.NOT_MEASURED
    assert (seen['', 'VibrationState'].value, seen['', 'VibrationSummary'].value) == (
        'WARN', 'zone B')


def test_the_verdict_of_the_judge_is_told(plant):
    plant.turns(1.0, RUNNING)
    plant.measures(1.0, 1.5, X)
    plant.ticks(1.5)
    assert plant.at().points['', 'Verdict'].value == 'undecided'  # no band to hold it against


def test_a_sensor_that_is_rejected_has_no_values_until_it_is_accepted_again(plant):
    plant.at()
    told = {f'{X}_stretches': 4, f'{X}_refused': 0, f'{X}_measured_zone': 'B'}
    plant.vibrates(1.0, told)
    assert plant.at().points[X, 'MeasuredZone'].quality is Quality.GOOD
    plant.vibrates(2.0, told | {f'{X}_stretches': 6, f'{X}_refused': 2,
                                f'{X}_refused_because': 'stamps scatter by 3 ms'})
    plant.vibrates(3.0, told | {f'{X}_stretches': 6, f'{X}_refused': 2,
                                f'{X}_refused_because': 'stamps scatter by 3 ms'})
    seen = plant.at().points
    assert (seen[X, 'MeasuredZone'].value, seen[X, 'MeasuredZone'].quality) == (
        None, Quality.REJECTED)
    assert 'stamps scatter by 3 ms' in seen[X, 'Reason'].value
    plant.vibrates(4.0, told | {f'{X}_stretches': 7, f'{X}_refused': 2})
    assert plant.at().points[X, 'MeasuredZone'].value == 'B'


def test_silence_of_the_sensors_makes_only_what_is_measured_uncertain(plant):
    plant.turns(1.0, RUNNING)
    plant.vibrates(1.0, {f'{X}_measured_zone': 'B', f'{X}_predicted_zone': 'A'})
    plant.at()
    plant.vibrates(5.0, {f'{X}_measured_zone': 'B', f'{X}_predicted_zone': 'A'}, Level.STALE)
    seen = plant.at().points
    assert (seen[X, 'MeasuredZone'].value, seen[X, 'MeasuredZone'].quality) == (
        'B', Quality.STALE)
    assert seen[X, 'PredictedZone'].quality is Quality.GOOD
    assert seen[X, 'Amplitude'].quality is Quality.GOOD


def test_a_case_that_is_reloaded_changes_the_channels(plant):
    plant.turns(1.0, RUNNING)
    plant.at()
    list(plant.board.settle())
    plant.reshapes([Channel.parse(name) for name in ('disc_1_x', 'pump_housing_z')])
    seen = plant.at()
    assert {channel for channel, _ in seen.points} == {'', 'disc_1_x', 'pump_housing_z'}
    assert {point.channel for point in plant.board.settle()} == {'pump_housing_z'}


@pytest.mark.parametrize('first, second, names', [
    (('/hall_1', 'fan'), ('/hall_2', 'fan'), ('hall_1.fan', 'hall_2.fan')),
    (('', 'house_1/fan'), ('', 'house_2/fan'), ('house_1/fan', 'house_2/fan'))])
def test_two_halls_or_plants_with_a_fan_each_are_told_apart(machine, first, second, names):
    one = Plant(machine, namespace=first[0], name=first[1])
    two = Plant(machine, namespace=second[0], name=second[1], inbox=one.inbox)
    one.turns(1.0, RUNNING)
    one.ticks(1.5)
    for second in range(1, 6):
        two.ticks(second)
    one.board.refresh(SECOND)
    states = {name: seen.points['', 'State'].value for name, seen in one.board.machines.items()}
    assert states == dict(zip(names, ('OK', 'STALE'), strict=True))


def test_what_machines_of_a_plant_do_together_is_told_of_the_plant(plant):
    board, turning = plant.board, Channel('block', '', 'rx')
    totals(plant.inbox, 'house', 1.0, {X: (3e-6, 2e-3), turning: (4e-6, 5e-3)}, Level.WARN)
    board.refresh(SECOND)
    house = board.machines['house'].points
    told = {(*key, point.value, point.quality) for key, point in house.items()
            if point.quantity != 'Reason'}
    assert told == {
        (X, 'Amplitude', 3e-6, Quality.GOOD), (X, 'VelocityRms', 2e-3, Quality.GOOD),
        (turning, 'Amplitude', 4e-6, Quality.GOOD), ('', 'State', 'WARN', Quality.GOOD),
        ('', 'Summary', 'at least', Quality.GOOD)}
    totals(plant.inbox, 'house', 2.0, {}, Level.STALE)  # nobody is heard
    board.refresh(2 * SECOND)
    seen = board.machines['house'].points[X, 'VelocityRms']
    assert (seen.value, seen.quality, seen.stamp_ns) == (2e-3, Quality.STALE, START + SECOND)


@pytest.mark.parametrize('topic', ['/rotorsoil/fan/amplitude', '/rotorsoil/fan/model',
                                   DIAGNOSTICS_TOPIC, '/rotorsoil/fan/unheard', ''])
@pytest.mark.parametrize('payload', [b'', b'\0\1\0\0', b'\xff' * 64, b'\0\1\0\0' + b'\xff' * 64])
def test_bytes_that_are_no_message_change_nothing(plant, topic, payload):
    plant.turns(1.0, RUNNING)
    before = dict(plant.at().points)
    plant.inbox.take(topic, payload)
    assert plant.at().points == before


def test_of_many_speeds_only_the_last_is_read(plant, monkeypatch):
    plant.at()
    read = []
    monkeypatch.setattr(plant.board._vectors, 'read', lambda topic, cdr: (
        read.append(topic), (0, (), {}))[1])
    for tenth in range(100):
        plant.turns(1.0 + 0.1 * tenth, RUNNING)
    plant.at()
    assert len(read) == len(set(read)) == 3
