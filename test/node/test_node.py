"""The node on a real graph: what it answers, when it is silent, what it refuses."""

from contextlib import suppress
import io
import json
import math
from pathlib import Path

from diagnostic_msgs.msg import DiagnosticArray
from lifecycle_msgs.msg import Transition
from mcap.exceptions import EndOfFile
from mcap.reader import NonSeekingReader
import numpy as np
import pytest
from rcl_interfaces.srv import DescribeParameters
from rclpy.executors import SingleThreadedExecutor
from rclpy.experimental import EventsExecutor
from rclpy.lifecycle import TransitionCallbackReturn
from rclpy.parameter import Parameter
from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64, String

from rotorsoil_ros.case.machine import Machine
from rotorsoil_ros.events import Level

from graphs import assert_answers, exact, joint_state, LATCHED, STAMP, stamp_ns
from records import topics_of


def test_a_speed_is_answered_with_the_bits_of_the_table_and_its_own_stamp(bench, machine):
    bench.active('fan')
    amplitude, phase = bench.answers()
    publish = bench.speaker()
    publish(joint_state([1.0, 300.0], names=['gear', 'rotor']))
    bench.graph.until(lambda: amplitude and phase, 'the answer')
    assert stamp_ns(amplitude[0]) == stamp_ns(phase[0]) == STAMP
    assert amplitude[0].name == phase[0].name == list(machine.table.channels)
    assert_answers(amplitude[0], phase[0], exact(machine, 300.0))


def test_a_bare_speed_is_stamped_on_receipt(bench, machine):
    node = bench.active('fan')
    amplitude, phase = bench.answers()
    publish = bench.speaker('/fan/rotor/speed', Float64)
    before = node.get_clock().now().nanoseconds
    publish(Float64(data=300.0))
    bench.graph.until(lambda: amplitude and phase, 'the answer')
    assert before <= stamp_ns(amplitude[0]) <= node.get_clock().now().nanoseconds
    assert_answers(amplitude[0], phase[0], exact(machine, 300.0))


def test_every_speed_of_a_burst_is_answered_in_order(bench):
    bench.active('fan', speed_reliability='reliable')
    amplitude, _ = bench.answers()
    publish = bench.speaker()
    for step in range(200):
        publish(joint_state([300.0], stamp=STAMP + step))
        bench.graph.executor.spin_once(timeout_sec=0.001)
    bench.graph.until(lambda: len(amplitude) == 200, 'every answer')
    assert [stamp_ns(message) - STAMP for message in amplitude] == list(range(200))


@pytest.mark.parametrize('executor', [EventsExecutor, SingleThreadedExecutor])
def test_speeds_that_find_no_room_are_counted_and_told(bench, executor):
    bench.graph.use(executor)
    node = bench.active('fan', speed_depth=10)
    reports = bench.hear('/diagnostics', DiagnosticArray)
    amplitude, _ = bench.answers()
    publish = bench.speaker()
    publish(joint_state([300.0]))
    bench.graph.until(lambda: amplitude, 'the first answer')
    for step in range(1, 201):  # while nobody takes them
        publish(joint_state([300.0], stamp=STAMP + step))
    counts = node._watches['fan'].monitor.health.counts
    bench.graph.until(lambda: stamp_ns(amplitude[-1]) == STAMP + 200, 'the last answer')
    assert counts['received'] < 201
    assert counts['received'] + counts['dropped'] == 201
    bench.graph.until(lambda: any(f'{counts["dropped"]} dropped' in status.message
                          and status.level == Level.WARN.value.to_bytes()
                          for report in reports for status in report.status), 'a warning')


@pytest.mark.parametrize('speed', [math.nan, math.inf, -300.0, 0.0, 1e9])
def test_a_speed_without_an_answer_is_answered_with_nan(bench, speed):
    node = bench.active('fan')
    amplitude, phase = bench.answers()
    bench.speaker()(joint_state([speed]))
    bench.graph.until(lambda: amplitude and phase, 'the answer')
    for message in (amplitude[0], phase[0]):
        assert stamp_ns(message) == STAMP
        for name in ('position', 'velocity', 'effort'):
            assert np.isnan(getattr(message, name)).all()
    assert node._watches['fan'].monitor.health.counts['answered'] == 0


def test_a_message_without_the_rotor_is_counted_and_ignored(bench):
    node = bench.active('fan', fan__rotor_joint='main_shaft')
    amplitude, _ = bench.answers()
    publish = bench.speaker()
    publish(joint_state([300.0]))
    publish(joint_state([], names=['main_shaft']))
    publish(joint_state([400.0], names=['main_shaft'], stamp=STAMP + 5))
    bench.graph.until(lambda: len(amplitude) == 2, 'the answers')
    counts = node._watches['fan'].monitor.health.counts
    assert (counts['joint_missing'], counts['velocity_missing'], counts['nan']) == (1, 1, 1)
    assert np.isnan(amplitude[0].position).all()
    assert stamp_ns(amplitude[1]) == STAMP + 5


def test_machines_are_answered_each_on_its_own(bench, machine):
    bench.active('fan', 'pump', pump__unbalance__disc_1__moment=2.0e-5)
    fan, pump = bench.answers('fan')[0], bench.answers('pump')[0]
    bench.speaker('/fan/joint_states')(joint_state([300.0]))
    bench.speaker('/pump/joint_states')(joint_state([300.0]))
    bench.graph.until(lambda: fan and pump, 'both answers')
    np.testing.assert_allclose(pump[0].position, 2.0 * np.array(fan[0].position), rtol=1e-14)
    assert (len(fan), len(pump)) == (1, 1)


def test_the_model_is_there_for_latecomers(bench, machine):
    bench.active('fan')
    model = bench.hear('/rotorsoil/fan/model', String, LATCHED)
    bench.graph.until(lambda: model, 'the latched model')
    said = json.loads(model[0].data)
    assert said['machine'] == 'fan'
    assert said['case'] == 'paper_rotor'
    assert said['channels'] == list(machine.table.channels)
    assert said['speed_range_rad_s'] == list(machine.table.speed_range)
    assert said['tables'] == {'response': machine.table.key}


def test_unbalance_acts_on_the_next_message_and_the_model_says_so(bench, machine):
    node = bench.active('fan')
    amplitude, phase = bench.answers()
    model = bench.hear('/rotorsoil/fan/model', String, LATCHED)
    publish = bench.speaker()
    result, = node.set_parameters([Parameter('fan.unbalance.disc_2.moment', value=1)])
    assert result.successful  # an integer is a number
    node.set_parameters([Parameter('fan.unbalance.disc_2.phase', value=0.5 * math.pi)])
    publish(joint_state([300.0]))
    bench.graph.until(lambda: amplitude and phase, 'the answer')
    changed = machine.case.unbalance.copy()
    changed[1] = complex(math.cos(0.5 * math.pi), 1.0)
    assert_answers(amplitude[0], phase[0], exact(machine, 300.0, changed))
    bench.graph.until(lambda: model and json.loads(model[-1].data)['unbalance']['disc_2'] == {
        'moment_kg_m': 1.0, 'phase_rad': 0.5 * math.pi}, 'the new model')


def test_the_unbalance_of_the_case_reaches_the_table_to_the_last_bit(bench, tmp_path):
    # Through modulus and phase another number may come back, by the last bit.
    case = tmp_path / 'case.yaml'
    case.write_text(Path(bench.case_file).read_text().replace(
        'unbalances:', 'unbalances:\n  - {disc: disc_2, moment: 1.1e-5, phase: 0.2}'))
    node = bench.active('fan', fan__case=str(case))
    fan = Machine.load(case, cache_directory=bench.cache)
    assert node.settings.unbalance('fan', fan).tobytes() == fan.case.unbalance.tobytes()


def test_the_log_reaches_the_disk_every_second(bench, tmp_path):
    bench.active('fan', log__directory=str(tmp_path))
    bench.speaker(listeners=())(joint_state([300.0]))

    def is_on_disk():
        content = io.BytesIO((tmp_path / 'run' / 'run_0.mcap').read_bytes())
        topics = set()
        with suppress(EndOfFile):  # nobody has finished the file
            for _, channel, _ in NonSeekingReader(content).iter_messages(log_time_order=False):
                topics.add(channel.topic)
        return '/rotorsoil/fan/amplitude' in topics

    bench.graph.until(is_on_disk, 'the flush')


@pytest.mark.parametrize('name, value, reason', [
    ('fan.unbalance.disc_1.moment', math.nan, ''),
    ('fan.unbalance.disc_1.moment', math.inf, ''),
    ('fan.unbalance.disc_1.moment', -1e-9, ''),
    ('fan.unbalance.disc_1.moment', 'heavy', 'must be a number in kg m'),
    ('fan.unbalance.disc_1.moment', True, 'must be a number in kg m'),
    ('fan.unbalance.disc_1.phase', math.nan, 'must be finite'),
    ('stale_after_s', 0, 'must be finite and 0.1 to'),
    ('speed_depth', 20, 'is read when the node is configured'),
    ('fan.case', '/elsewhere.yaml', 'is read when the node is configured')])
def test_nonsense_is_refused_with_the_reason_and_the_old_value_stays(bench, name, value, reason):
    node = bench.active('fan')
    before = node.get_parameter(name).value
    result, = node.set_parameters([Parameter(name, value=value)])
    assert not result.successful
    assert reason in result.reason
    assert name in result.reason
    assert node.get_parameter(name).value == before


def test_every_parameter_says_what_it_is(bench):
    node = bench.active('fan')
    own = [name for name in node.settings.known if name != 'use_sim_time']
    assert {'machines', 'fan.case', 'fan.unbalance.disc_2.phase', 'log.split_mib'} <= set(own)
    described = bench.call(DescribeParameters, '/rotorsoil/describe_parameters',
                           DescribeParameters.Request(names=own))
    assert all(entry.description.endswith('.') for entry in described.descriptors)
    moment = next(entry for entry in described.descriptors if entry.name.endswith('1.moment'))
    assert '[kg m]' in moment.description
    assert moment.floating_point_range[0].from_value == 0.0


def test_life_cycle_services_configure_silence_and_release(bench):
    node = bench.node('fan')
    assert bench.state() == 'unconfigured'
    assert bench.change(Transition.TRANSITION_CONFIGURE)
    assert bench.change(Transition.TRANSITION_ACTIVATE)
    amplitude, _ = bench.answers()
    publish = bench.speaker()
    publish(joint_state([300.0]))
    bench.graph.until(lambda: len(amplitude) == 1, 'the answer')
    assert bench.change(Transition.TRANSITION_DEACTIVATE)
    publish(joint_state([300.0], stamp=STAMP + 1))
    assert bench.state() == 'inactive'  # a round trip later
    assert bench.change(Transition.TRANSITION_ACTIVATE)
    publish(joint_state([300.0], stamp=STAMP + 2))
    bench.graph.until(lambda: len(amplitude) == 2, 'the answer after the silence')
    assert stamp_ns(amplitude[1]) == STAMP + 2
    assert node._watches['fan'].monitor.health.counts['received'] == 2
    assert bench.change(Transition.TRANSITION_DEACTIVATE)
    assert bench.change(Transition.TRANSITION_CLEANUP)
    assert bench.state() == 'unconfigured'
    assert not node.has_parameter('fan.unbalance.disc_1.moment')
    bench.graph.until(lambda: not bench.probe.count_subscribers('/fan/joint_states'), 'release')
    assert bench.change(Transition.TRANSITION_CONFIGURE)
    assert node.has_parameter('fan.unbalance.disc_1.moment')
    assert bench.change(Transition.TRANSITION_ACTIVATE)
    assert bench.change(Transition.TRANSITION_ACTIVE_SHUTDOWN)
    assert bench.state() == 'finalized'


@pytest.mark.parametrize('parameters, complaint', [
    ({'machines': ['fan'], 'fan__case': '/nowhere.yaml'}, '/nowhere.yaml'),
    ({'machines': ['fan'], 'fan__case': ''}, 'parameter fan.case: must be the path'),
    ({'machines': ['Fan']}, 'parameter machines: must be different names'),
    ({'machines': ['fan', 'fan']}, 'parameter machines: must be different names'),
    ({'fan__unbalance__disc_1__moment': -1.0},
     'parameter fan.unbalance.disc_1.moment: Invalid parameter value (-1.0)'),
    ({'speed_reliability': 'sometimes'}, 'must be one of best_effort, reliable'),
    ({'log__directory': '/tmp/x', 'log__name': '../x'}, 'parameter log.name')])
def test_a_node_that_cannot_be_configured_says_why_in_one_line(
        bench, parameters, complaint, capfd):
    node = bench.node('fan', **parameters)
    assert node.trigger_configure() == TransitionCallbackReturn.FAILURE
    assert node.lifecycle_state == 'unconfigured'
    lines = [line for line in capfd.readouterr().err.splitlines() if '[ERROR]' in line]
    assert len(lines) == 1
    assert complaint in lines[0]


def test_all_that_is_wrong_with_parameters_and_cases_is_told_at_once(bench, tmp_path, capfd):
    case = tmp_path / 'fan.yaml'
    case.write_text('name: fan\n')
    node = bench.node('fan', machines=['fan', 'mill'], fan__case=str(case), mill__case='',
                      speed_reliability='sometimes', fan__speed__unit='knots')
    assert node.trigger_configure() == TransitionCallbackReturn.FAILURE
    said = capfd.readouterr().err
    for line in ('parameter speed_reliability: must be one of best_effort, reliable',
                 'parameter fan.speed.unit: must be one of', f'{case}: rotor: is missing',
                 f'{case}: speed_range_rpm: is missing', 'parameter mill.case: must be the path'):
        assert said.count(line) == 1


def test_a_bug_in_a_transition_is_told_with_its_trace(bench, monkeypatch, capfd):
    node = bench.node('fan')
    monkeypatch.setattr(node, '_load', lambda: 1 / 0)
    assert node.trigger_configure() == TransitionCallbackReturn.ERROR
    assert node.lifecycle_state == 'unconfigured'
    assert 'ZeroDivisionError' in capfd.readouterr().err


def test_diagnostics_come_each_second_and_at_once_when_the_level_changes(bench):
    bench.active('fan', stale_after_s=1)
    reports = bench.hear('/diagnostics', DiagnosticArray)
    publish = bench.speaker()
    bench.graph.until(lambda: reports, 'the first report')
    assert reports[0].status[0].level == b'\x03'
    del reports[:]
    publish(joint_state([300.0]))
    publish(joint_state([3000.0]))
    bench.graph.until(lambda: len(reports) == 2, 'two changes')
    assert [report.status[0].level for report in reports] == [b'\x00', b'\x01']
    bench.graph.until(lambda: reports[-1].status[0].level == b'\x03', 'staleness')
    status = reports[-1].status[0]
    assert status.hardware_id == 'fan'
    values = {entry.key: entry.value for entry in status.values}
    assert values['received'] == '2'
    assert values['above_table'] == '1'
    assert values['speed_rad_s'] == '3000.000000'
    assert float(values['silent_s']) > 1.0
    per_second = [stamp_ns(report) for report in reports[2:]]
    assert all(9e8 < step < 1.2e9 for step in np.diff(per_second))


def test_incompatible_quality_of_service_is_warned_of_by_topic(bench, capfd):
    bench.active('fan', speed_reliability='reliable')
    bench.probe.create_publisher(JointState, '/fan/joint_states', QoSProfile(
        depth=1, reliability=ReliabilityPolicy.BEST_EFFORT))
    seen = []

    def warned():
        seen.append(capfd.readouterr().err)
        return any('/fan/joint_states' in text and 'QoS' in text for text in seen)

    bench.graph.until(warned, 'the warning')


def test_a_machine_that_is_named_later_can_be_configured(bench):
    node = bench.node()
    assert node.trigger_configure() == TransitionCallbackReturn.FAILURE
    for name, value in (('machines', ['fan']), ('fan.case', bench.case_file)):
        result, = node.set_parameters([Parameter(name, value=value)])
        assert result.successful
    assert node.start()


def test_remapped_topics_are_heard_answered_and_logged_under_their_new_names(bench, tmp_path):
    node = bench.active('fan', log__directory=str(tmp_path), cli=[
        '--ros-args', '-r', 'fan/joint_states:=/plant/turbine', '-r', '~/fan/phase:=/angle'])
    phase = bench.hear('/angle')
    publish = bench.speaker('/plant/turbine', listeners=())
    bench.settle()
    publish(joint_state([300.0]))
    bench.graph.until(lambda: phase, 'the answer')
    node.release()
    topics = topics_of(tmp_path / 'run')
    assert {'/plant/turbine', '/angle', '/rotorsoil/fan/amplitude'} <= set(topics)


def test_a_disk_that_is_not_there_keeps_no_node_from_answering(bench, tmp_path):
    place = tmp_path / 'mount'
    place.write_text('not a directory')
    node = bench.active('fan', log__directory=str(place / 'logs'), log__rerun=False)
    amplitude, _ = bench.answers()
    publish = bench.speaker()
    publish(joint_state([300.0]))
    bench.graph.until(lambda: amplitude, 'the answer')
    node._tick()
    assert node._log.report(0).level == Level.ERROR
    place.unlink()
    bench.graph.until(lambda: node._log.path and node._log.report(0).level < Level.ERROR, 'a log')
    publish(joint_state([301.0], stamp=STAMP + 1))
    bench.graph.until(lambda: len(amplitude) == 2, 'the next answer')
    node.release()
    assert '/rotorsoil/fan/amplitude' in topics_of(place / 'logs' / 'run')
