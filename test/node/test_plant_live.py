"""Several machines of one case file, live: parts by source, and what they do together."""

from pathlib import Path

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
import numpy as np
import pytest
from rclpy.parameter import Parameter
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger
import yaml

import rotorsoil_ros as rs
from rotorsoil_ros.bags import reader as bag_reader
from rotorsoil_ros.bags.predict import predict
from rotorsoil_ros.case import document
from rotorsoil_ros.case.machine import Machine
from rotorsoil_ros.case.plant.together import Plant
from rotorsoil_ros.units import rad_s_to_rpm

from graphs import joint_state, STAMP, stamp_ns
from records import topics_of

CONFIG = Path(__file__).parents[2] / 'config'
HOUSE = CONFIG / 'fan_house.yaml'
BOTH = 'fan_house/fan_1', 'fan_house/fan_2'


@pytest.fixture
def house(tmp_path):
    """Return what writes the fan house, changed."""
    def write(change):
        content = document.read(HOUSE)
        change(content)
        case = tmp_path / 'house.yaml'
        case.write_text(yaml.safe_dump(content))
        (tmp_path / 'plant_fan.yaml').write_text((CONFIG / 'plant_fan.yaml').read_text())
        return case
    return write


def geared(content):
    """Let the second fan turn with the first, at half its speed."""
    del content['machines'][1]['rated_rpm']
    content['machines'][1]['ratio'] = {'of': 'fan_1', 'times': 0.5}


def statuses(arrays):
    return [status for array in arrays for status in array.status]


@pytest.mark.parametrize('names', [BOTH, ('fan_1', 'fan_2')])
def test_each_machine_answers_its_part_and_the_total_adds_them(bench, cache, names):
    # As one entry of the node, or each machine as one of its own.
    entries = dict.fromkeys([name.partition('/')[0] for name in names])
    bench.active(*entries, stale_after_s=1.0, **{f'{name}__case': 'fan_house' for name in entries})
    parts = [bench.answers(name)[0] for name in names]
    total, *shares = (bench.hear(f'/rotorsoil/{name}') for name in (
        'fan_house/total', *(f'{name}/share' for name in names)))
    beats, said = (bench.hear(name, DiagnosticArray) for name in (
        '/rotorsoil/fan_house/beats', '/diagnostics'))
    first, second = (bench.speaker(f'/{name}/joint_states') for name in names)
    first(joint_state([150.0]))
    bench.graph.until(lambda: parts[0], 'the first answer')
    second(joint_state([140.0], stamp=STAMP + 7))
    bench.graph.until(lambda: total and stamp_ns(total[-1]) == STAMP + 7, 'the total')
    plant = Plant.load(HOUSE, cache_directory=cache)
    found = plant.shaken(rpm={'fan_1': rad_s_to_rpm(150.0), 'fan_2': rad_s_to_rpm(140.0)})
    for part, name, own in zip(parts, names, np.abs(found.displacement), strict=True):
        assert list(part[0].name) == list(found.channels)
        assert part[0].header.frame_id == name
        np.testing.assert_allclose(part[0].position, own, rtol=1e-6, atol=1e-15)
    np.testing.assert_allclose(total[-1].velocity, found.velocity_rms, rtol=1e-6, atol=1e-13)
    np.testing.assert_allclose(total[-1].position, found.highest, rtol=1e-6, atol=1e-15)
    assert total[-1].header.frame_id == 'fan_house'
    bench.graph.until(lambda: all(shares) and beats, 'who shakes whom')
    housings = [column for column, channel in enumerate(found.channels) if channel.is_housing]
    np.testing.assert_allclose([share[-1].position for share in shares],
                               found.share[:, housings], rtol=1e-5)
    np.testing.assert_allclose([share[-1].velocity for share in shares],
                               found.own_rms[:, housings], rtol=1e-6, atol=1e-13)
    assert list(shares[0][-1].name) == [found.channels[column] for column in housings]
    [beat], [status] = found.beats(), statuses(beats[-1:])
    assert status.name == f'rotorsoil: fan_house {names[0]} and {names[1]}'
    values = {value.key: value.value for value in status.values}
    # The housings mirror each other: which of them is the worst is for the last digit to say.
    assert values['channel'] in {'fan_1_fan_end_housing_x', 'fan_2_fan_end_housing_x'}
    np.testing.assert_allclose(
        [float(values[key]) for key in ('period_s', 'lowest_m', 'highest_m')],
        [2.0 * np.pi / 10.0, beat.lowest, beat.highest], rtol=1e-5)

    def told(summary, level):
        return any((status.message, status.level) == (summary, level)
                   for status in statuses(said))

    bench.graph.until(lambda: told(f'{", ".join(names)} together', DiagnosticStatus.OK),
                      'who is in the total')
    # Neither is heard any more; then one is, by itself.
    bench.graph.until(lambda: told(f'at least: nothing of {", ".join(names)}',
                                   DiagnosticStatus.STALE), 'that all are silent')
    first(joint_state([151.0], stamp=STAMP + 60 * 10**9))
    bench.graph.until(lambda: stamp_ns(total[-1]) > STAMP + 7, 'a total of one')
    np.testing.assert_allclose(total[-1].position, parts[0][-1].position, rtol=1e-12)


def test_part_of_another_machine_is_no_residual(bench, cache):
    """Equally fast for ever: the vector holds both parts, of which nobody knows whose is whose."""
    bench.active('fan_house', fan_house__case='fan_house')
    residual = bench.hear('/rotorsoil/fan_house/fan_1/residual')
    said = bench.hear('/diagnostics', DiagnosticArray)
    speed, other = (bench.speaker(f'/{name}/joint_states') for name in BOTH)
    measured = {name: bench.speaker(f'/{BOTH[0]}/measured/{name}', listeners=())
                for name in ('amplitude', 'phase')}
    found = Plant.load(HOUSE, cache_directory=cache).shaken(
        rpm=dict.fromkeys(('fan_1', 'fan_2'), rad_s_to_rpm(150.0)))
    channel = 'fan_1_fan_end_housing_x'
    own, part = found.displacement[:, found.channels.index(channel)]
    for number in range(3):
        at = STAMP + number * 10**8
        speed(joint_state([150.0], stamp=at))
        other(joint_state([150.0], stamp=at))
        vector = own + np.exp(0.4j) * part
        for name, value in (('amplitude', abs(vector)), ('phase', np.angle(vector))):
            measured[name](JointState(header=joint_state([0.0], stamp=at).header, name=[channel],
                                      position=[float(value)]))
    bench.graph.until(lambda: len(residual) == 3, 'the residuals')
    assert abs(part) > 0.1 * abs(own)
    # Of the first nothing is known before it: the speed of the other is not yet.
    assert max(one.position[0] for one in residual[1:]) < 1e-9 * abs(part)
    bench.graph.until(lambda: any(
        value.key == 'fan_2_is' and value.value == 'not told apart'
        for status in statuses(said) for value in status.values), 'that it is said')


def test_one_message_tells_the_speeds_of_a_plant_by_its_joints(bench, cache, tmp_path):
    node = bench.active('hall', hall__case='fan_house', hall__fan_2__rotor_joint='right',
                        hall__fan_2__speed__unit='rpm', log__directory=str(tmp_path))
    parts = [bench.answers(f'hall/{name}')[0] for name in ('fan_1', 'fan_2')]
    total = bench.hear('/rotorsoil/hall/total')
    speak = bench.speaker('/hall/joint_states', listeners=())
    speak(joint_state([1400.0, 150.0], names=('right', 'fan_1')))
    bench.graph.until(lambda: all(parts) and total, 'all answers')
    assert stamp_ns(total[-1]) == STAMP
    speeds = [np.nanmedian(np.divide(part[0].velocity, part[0].position)) for part in parts]
    np.testing.assert_allclose(speeds, [150.0, 1400.0 * np.pi / 30.0], rtol=1e-9)
    node.release()
    # The log is that of machines whose speeds were told one by one, and is answered the same.
    log, again = tmp_path / 'run', tmp_path / 'again.mcap'
    assert {'/rotorsoil/hall/total', '/rotorsoil/hall/beats',
            '/rotorsoil/hall/fan_2/share'} <= {*topics_of(log)}
    for name in ('fan_1', 'fan_2'):
        fan = Machine.load(Path(f'{HOUSE}#{name}'), cache_directory=cache)
        assert predict(fan, log, again).machine == f'hall/{name}'
        told = [[payload for source, _, payload in bag_reader.messages(
            path, lambda topic, kind, name=name: topic == f'/rotorsoil/hall/{name}/amplitude')]
            for path in (log, again)]
        assert told[0] == told[1] != []


def test_machine_without_an_answer_is_named_and_adds_nothing(bench):
    bench.active('fan_house', fan_house__case='fan_house')
    total, said = bench.hear('/rotorsoil/fan_house/total'), bench.hear(
        '/diagnostics', DiagnosticArray)
    part = bench.answers(BOTH[0])[0]
    first, second = (bench.speaker(f'/{name}/joint_states') for name in BOTH)
    for step, speed in enumerate((np.nan, 0.0, 1000.0)):  # the table ends at 188 rad/s
        stamp = STAMP + 10**9 * step
        total.clear()
        said.clear()
        second(joint_state([speed], stamp=stamp))
        first(joint_state([150.0], stamp=stamp + 1))
        bench.graph.until(lambda stamp=stamp: total and stamp_ns(total[-1]) == stamp + 1 and any(
            status.message == f'at least: nothing of {BOTH[1]}' for status in statuses(said)),
            f'the total beside {speed}')
        np.testing.assert_allclose(total[-1].position, part[-1].position, rtol=1e-12)


def test_geared_machine_turns_with_the_other(bench, cache, house):
    case = house(geared)
    bench.active('house', house__case=str(case), house__fan_1__speed__unit='rpm',
                 house__fan_1__speed__topic='/plc/fan')
    slow = bench.answers('house/fan_2')[0]
    speak = bench.speaker('/plc/fan', listeners=())
    bench.graph.until(lambda: bench.probe.count_subscribers('/plc/fan') == 2, 'both')
    speak(joint_state([1432.0]))
    bench.graph.until(lambda: slow, 'the answer of the geared machine')
    fan = Plant.load(case, cache_directory=cache).machines['fan_2']
    looked_up = fan.table.predictor(fan.case.unbalance).predict(np.array([716.0 * np.pi / 30.0]))
    np.testing.assert_allclose(slow[0].position, np.abs(looked_up.displacement[0]), rtol=1e-9)


def test_geared_machine_alone_hears_the_master_that_others_watch(bench, house):
    bench.active('fan_2', fan_2__case=str(house(geared)))
    answers = bench.answers('fan_2')[0]
    bench.graph.speaker('/fan_1/joint_states', JointState).publish(joint_state([150.0]))
    bench.graph.until(lambda: answers, 'the answer')
    assert not bench.probe.count_publishers('/rotorsoil/fan_house/total')


def test_unbalance_of_a_machine_in_a_plant_is_a_parameter(bench):
    node = bench.active('hall', hall__case='fan_house',
                        hall__fan_2__unbalance__wheel__moment=0.056)
    assert node.get_parameter('hall.fan_1.unbalance.wheel.moment').value == pytest.approx(0.028)
    parts = {name: bench.answers(f'hall/{name}')[0] for name in ('fan_1', 'fan_2')}
    speak = bench.speaker('/hall/joint_states', listeners=())
    speak(joint_state([150.0, 150.0], names=('fan_1', 'fan_2')))
    bench.graph.until(lambda: all(parts.values()), 'both answers')
    for name in parts:
        node.set_parameters([Parameter(f'hall.{name}.unbalance.wheel.moment', value=0.028)])
    speak(joint_state([150.0, 150.0], names=('fan_1', 'fan_2'), stamp=STAMP + 1))
    bench.graph.until(lambda: all(len(part) == 2 for part in parts.values()), 'two answers')
    for factor, (before, after) in zip((1.0, 0.5), parts.values(), strict=True):
        np.testing.assert_allclose(after.position, factor * np.array(before.position), rtol=1e-9)


def test_plant_is_reloaded_as_a_whole(bench, cache, house):
    case = house(lambda content: None)
    expected = Plant.load(case, cache_directory=cache).shaken(
        rpm={'fan_1': rad_s_to_rpm(150.0), 'fan_2': rad_s_to_rpm(140.0)}).highest
    bench.active('hall', hall__case=str(case))
    total = bench.hear('/rotorsoil/hall/total')
    speak = bench.speaker('/hall/joint_states', listeners=())

    def turn(stamp, factor):
        speak(joint_state([150.0, 140.0], names=('fan_1', 'fan_2'), stamp=stamp))
        bench.graph.until(lambda: total and stamp_ns(total[-1]) == stamp and np.allclose(
            total[-1].position, factor * expected, rtol=1e-6, atol=1e-15), f'{factor} of it')

    def reload():
        return bench.call(Trigger, '/rotorsoil/hall/reload', Trigger.Request())

    def lighter(content):
        for machine in content['machines']:
            machine['unbalances'][0]['moment'] *= 0.5

    turn(STAMP, 1.0)
    house(lighter)
    answer = reload()
    assert answer.success, answer.message
    assert answer.message == f'hall: reloaded {case}'
    turn(STAMP + 1, 0.5)
    house(lambda content: content['machines'][1].update(name='fan_3'))
    answer = reload()
    assert not answer.success
    assert answer.message == (
        'hall: machines must be hall/fan_1, hall/fan_2 as before, got hall/fan_1, hall/fan_3; to '
        'watch others clean up and configure again; the old case stays')


def idle(content):
    for machine in content['machines']:
        machine.pop('rated_rpm', None)
        machine['idle'] = True


@pytest.mark.parametrize('entries, said', [
    ({'house': idle}, 'machines: must name at least one machine that turns, got fan_1, fan_2, '
                      'idle all of them'),
    ({'fan_1': '', 'fan_2': '', 'fan_house': ''},
     'parameter machines: fan_1, fan_2 cannot be told together as fan_house: fan_house is '
     'another machine or plant; name a plant once, as machines: [fan_house]'),
    ({'a': '#fan_1', 'b': '#fan_1'},
     'parameter machines: a, b cannot be told together as fan_house: fan_1 is there 2 times; '
     'name a plant once, as machines: [fan_house]')])
def test_what_cannot_be_watched_together_is_told_in_one_line(bench, house, capfd, entries, said):
    node = bench.node(*entries, **{
        f'{name}__case': str(house(how)) if callable(how) else f'{HOUSE}{how}'
        for name, how in entries.items()})
    assert not node.start()
    told = [line for line in capfd.readouterr().err.splitlines() if '[ERROR]' in line]
    assert len(told) == 1
    assert told[0].endswith(said)


def test_plants_machines_and_slips_stand_side_by_side_in_a_namespace(bench):
    node = bench.active('hall_a', 'hall_b', 'pump', hall_a__case='fan_house',
                        hall_b__case='fan_house', hall_b__fan_2__speed__topik='/x',
                        hall_a__speed__topic='/y', cli=['--ros-args', '-r', '__ns:=/site'])
    assert [*node._watches] == ['hall_a/fan_1', 'hall_a/fan_2', 'hall_b/fan_1', 'hall_b/fan_2',
                                'pump']
    total = bench.hear('/site/rotorsoil/hall_b/total')
    bench.graph.speaker('/site/hall_b/fan_1/joint_states', JointState).publish(
        joint_state([150.0]))
    bench.graph.until(lambda: total, 'the total')
    assert not bench.probe.count_publishers('/site/rotorsoil/pump/total')
    slips = {name: watch.monitor.health.slips for name, watch in node._watches.items()}
    assert slips.pop('hall_b/fan_2') == (
        'parameter hall_b.fan_2.speed.topik is not known; did you mean hall_b.fan_2.speed.topic?',)
    [slip] = slips.pop('hall_a/fan_1')
    assert slip.startswith('parameter hall_a.speed.topic is not known; did you mean hall_')
    assert not any(slips.values())


def test_blocks_on_one_ground_and_a_probe_in_the_yard_are_answered(bench, cache):
    bench.active('fan', fan__case='fan_on_l_block')
    told = bench.answers('fan')[0]
    bench.speaker('/fan/joint_states')(joint_state([150.0]))
    bench.graph.until(lambda: told, 'the answer')
    fan = rs.load(CONFIG / 'fan_on_l_block.yaml', cache_directory=cache)
    looked_up = fan.table.predictor(fan.case.unbalance).predict(np.array([150.0]))
    assert list(told[0].name) == list(map(str, fan.table.channels))
    assert {'yard_z', 'next_block_z'} <= set(told[0].name)
    np.testing.assert_allclose(told[0].position, np.abs(looked_up.displacement[0]), rtol=1e-12)
