"""What happens in a graph that is not as it should be, and when a case changes under way."""

import json
import math
import threading

from diagnostic_msgs.msg import DiagnosticArray
import numpy as np
import pytest
import rclpy
from rclpy.context import Context
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import QoSProfile
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64, String
from std_srvs.srv import Trigger

from rotorsoil_ros.bags.metadata import files as bag_files
from rotorsoil_ros.bags.retention import new_directory
from rotorsoil_ros.domain import own_domain
from rotorsoil_ros.errors import RotorSoilError
from rotorsoil_ros.machine.transient.state import Transient
from rotorsoil_ros.node.node import Survived
from rotorsoil_ros.testing.graph import DEADLINE_S

from graphs import assert_answers, Bench, exact, joint_state, LATCHED, STAMP, stamp_ns
from records import topics_of


@pytest.fixture
def case(bench, tmp_path):
    """Return a case file that may be changed."""
    path = tmp_path / 'fan.yaml'
    with open(bench.case_file, encoding='utf-8') as source:
        path.write_text(source.read())
    return path


def reload(bench, machine='fan'):
    return bench.call(Trigger, f'/rotorsoil/{machine}/reload', Trigger.Request())


def ask(bench, publish, amplitude, speed, step):
    before = len(amplitude)
    publish(joint_state([speed], stamp=STAMP + step))
    bench.graph.until(lambda: len(amplitude) > before, 'the answer')
    return amplitude[-1]


def test_a_case_is_reloaded_while_speeds_are_answered(bench, case, machine):
    node = bench.active('fan', fan__case=str(case))
    amplitude, _ = bench.answers()
    model = bench.hear('/rotorsoil/fan/model', String, LATCHED)
    publish = bench.speaker()
    node.set_parameters([Parameter('fan.unbalance.disc_2.moment', value=2e-5)])
    old = ask(bench, publish, amplitude, 300.0, 0)
    case.write_text(case.read_text().replace('mass: 42.0', 'mass: 420.0'))
    reloading = bench.ask(Trigger, '/rotorsoil/fan/reload', Trigger.Request())
    bench.graph.until(lambda: node._reloaders['fan']._errand, 'the errand')
    assert reload(bench).message.endswith('a reload is under way')
    asked = 0
    while not reloading.done() and asked < 50:  # it computes, and speeds are answered
        asked += 1
        ask(bench, publish, amplitude, 300.0, asked)
    assert asked > 5
    bench.graph.until(reloading.done, 'the answer')
    assert reloading.result().success
    assert reloading.result().message.startswith(f'fan: reloaded {case}')
    new = ask(bench, publish, amplitude, 300.0, asked + 1)  # what is answered has happened
    assert new.position != old.position
    assert node.get_parameter('fan.unbalance.disc_2.moment').value == 2e-5  # what was set stays
    new_key = node._watches['fan'].monitor.table.key
    assert new_key != machine.table.key
    bench.graph.until(lambda: model and json.loads(model[-1].data)['tables'] == {
        'response': new_key}, 'the new model')
    again = ask(bench, publish, amplitude, 300.0, asked + 2)
    assert again.position == new.position


def test_a_case_that_is_wrong_is_refused_and_the_old_one_stays(bench, case):
    bench.active('fan', fan__case=str(case))
    amplitude, _ = bench.answers()
    publish = bench.speaker()
    old = ask(bench, publish, amplitude, 300.0, 0)
    for text, complaint in ((case.read_text().replace('mass: 42.0', 'mass: -42.0'), 'mass'),
                            ('{', 'fan.yaml')):
        case.write_text(text)
        answer = reload(bench)
        assert not answer.success
        assert complaint in answer.message
        assert answer.message.endswith('the old case stays')
    assert ask(bench, publish, amplitude, 300.0, 1).position == old.position


def test_who_waits_for_a_reload_is_told_when_the_case_cannot_be_solved(bench, case):
    bench.active('fan', fan__case=str(case))
    case.write_text(case.read_text().replace('model: cone', 'model: nothing'))
    answer = reload(bench)
    assert not answer.success
    assert answer.message.endswith('the old case stays')


def test_who_waits_for_a_reload_is_told_when_the_node_is_cleaned_up(bench, case):
    node = bench.active('fan', fan__case=str(case))
    case.write_text(case.read_text().replace('mass: 42.0', 'mass: 421.0'))
    reloading = bench.ask(Trigger, '/rotorsoil/fan/reload', Trigger.Request())
    bench.graph.until(lambda: node._reloaders['fan']._asked, 'who waits')
    node.release()
    bench.graph.until(reloading.done, 'the answer')
    assert not reloading.result().success
    assert reloading.result().message.endswith('the old case stays')


def test_who_waits_for_a_reload_is_answered_where_taking_it_raises(bench):
    node = bench.active('fan')

    def refuse(machines):
        raise RotorSoilError(f'{machines["fan"].case.name} cannot be taken')

    node._reloaders['fan']._take = refuse
    reloading = bench.ask(Trigger, '/rotorsoil/fan/reload', Trigger.Request())
    with pytest.raises(RotorSoilError, match='cannot be taken'):
        bench.graph.until(lambda: False, 'the failure')
    bench.graph.until(reloading.done, 'the answer')
    assert not reloading.result().success
    assert reloading.result().message == 'fan: the new case could not be taken: see the log'


def test_a_reload_works_with_other_discs_and_the_single_executor(graph, cache, case, case_file):
    graph.use(SingleThreadedExecutor)
    bench = Bench(graph, cache, case_file)
    node = bench.active('fan', fan__case=str(case))
    case.write_text(case.read_text().replace('disc_2', 'wheel'))
    assert reload(bench).success
    assert 'wheel_x' in node._watches['fan'].monitor.table.channels
    assert node.has_parameter('fan.unbalance.wheel.moment')
    assert not node.has_parameter('fan.unbalance.disc_2.moment')
    amplitude, _ = bench.answers()
    assert 'wheel_x' in ask(bench, bench.speaker(), amplitude, 300.0, 0).name
    node.release()


def test_a_reload_at_the_limit_of_threads_is_refused_and_the_node_lives(bench, monkeypatch):
    def refuse(thread):
        raise RuntimeError("can't start new thread")

    bench.active('fan')
    amplitude, _ = bench.answers()
    publish = bench.speaker()
    with monkeypatch.context() as limit:
        limit.setattr(threading.Thread, 'start', refuse)
        said = reload(bench)
    assert not said.success
    assert said.message == "can't start new thread; the old case stays"
    publish(joint_state([300.0]))
    bench.graph.until(lambda: amplitude, 'the answer')
    assert reload(bench).success


def test_two_publishers_of_one_speed_are_warned_of_by_name(bench, capfd):
    node = bench.active('fan')
    rival = bench.graph.add(Node('rival', context=bench.graph.context))
    rival.create_publisher(Float64, '/fan/rotor/speed', 10)
    bench.probe.create_publisher(JointState, '/fan/joint_states', 10)
    seen = []

    def warned():
        seen.append(capfd.readouterr().err)
        return '/probe on /fan/joint_states, /rival on /fan/rotor/speed' in ''.join(seen)

    bench.graph.until(warned, 'the warning')
    assert node._watches['fan'].monitor.health.publishers == 2
    bench.graph.nodes.remove(rival)
    rival.destroy_node()


def test_a_foreign_type_on_a_topic_of_the_node_harms_nobody(bench, graph):
    stranger = Context()
    rclpy.init(args=[], context=stranger, domain_id=graph.context.get_domain_id())
    other = Node('stranger', context=stranger)
    other.create_publisher(String, '/fan/joint_states', 10)
    bench.active('fan')
    bench.graph.until(lambda: bench.probe.count_publishers('/fan/joint_states'), 'the stranger')
    amplitude, _ = bench.answers()
    publish = bench.speaker('/fan/rotor/speed', Float64)
    publish(Float64(data=300.0))
    bench.graph.until(lambda: amplitude, 'the answer')
    other.destroy_node()
    stranger.try_shutdown()


def test_stamps_that_stand_still_or_jump_back_are_answered_and_counted(bench, machine, tmp_path):
    node = bench.active('fan', log__directory=str(tmp_path), log__split_s=100.0)
    amplitude, phase = bench.answers()
    publish = bench.speaker()
    stamps = [STAMP, STAMP, STAMP - 10**9, STAMP + 1, 0]
    for stamp in stamps:
        publish(joint_state([300.0], stamp=stamp))
    bench.graph.until(lambda: len(amplitude) == len(phase) == 5, 'the answers')
    # The last one was never set: it counts when it came, which no stamp here is near.
    assert [stamp_ns(message) for message in amplitude[:4]] == stamps[:4]
    assert stamp_ns(amplitude[4]) > STAMP + 10**9
    assert_answers(amplitude[2], phase[2], exact(machine, 300.0))
    counts = node._watches['fan'].monitor.health.counts
    assert (counts['repeated_stamp'], counts['backward_stamp'], counts['answered']) == (1, 1, 5)
    assert counts['stamp_not_set'] == 1
    node._log.flush()
    node._log.flush()
    node.release()
    assert len(bag_files(tmp_path / 'run')) == 2  # one split, not one each second


def test_time_that_runs_a_hundred_times_faster_changes_no_answer(bench, machine):
    node = bench.active('fan', use_sim_time=True)
    amplitude, phase = bench.answers()
    publish = bench.speaker()
    clock = bench.probe.create_publisher(Clock, '/clock', QoSProfile(depth=10))
    bench.graph.until(clock.get_subscription_count, 'who listens to the clock')
    now_ns = STAMP
    speeds = np.linspace(100.0, 800.0, 100)
    for step, speed in enumerate(speeds):
        now_ns += 10**8  # every millisecond
        said = Clock()
        said.clock.sec, said.clock.nanosec = divmod(now_ns, 10**9)
        clock.publish(said)
        publish(joint_state([speed], stamp=now_ns))
        bench.graph.until(lambda step=step: len(amplitude) > step, 'the answer')
    bench.graph.until(lambda: len(phase) == 100, 'the answers')
    # To the last bit what is computed without a graph, on a run-up in which much is struck.
    predictor, transient = (machine.table.predictor(machine.case.unbalance),
                            Transient(machine.table.poles))
    for row, speed in enumerate(speeds):
        moved = transient.follow(np.array([stamp_ns(amplitude[row])]), np.array([speed]))
        assert_answers(amplitude[row], phase[row],
                       predictor.moved(exact(machine, speed), moved))
    assert moved is not None
    bench.graph.until(lambda: node.get_clock().now().nanoseconds == now_ns, 'the clock')
    bare = bench.speaker('/fan/rotor/speed', Float64)
    bare(Float64(data=300.0))
    bench.graph.until(lambda: len(amplitude) == 101, 'the answer')
    assert stamp_ns(amplitude[-1]) == now_ns


def test_nobody_who_is_told_nonsense_gives_another_number(bench, machine):
    bench.active('fan')
    amplitude, phase = bench.answers()
    publish = bench.speaker()
    for garbage in (b'', b'\0', b'\0\1\0\0', bytes(100), b'\0\1\0\0' + b'\xff' * 60):
        publish(garbage)
    publish(joint_state([math.nan]))
    publish(joint_state([300.0], stamp=STAMP + 1))
    bench.graph.until(lambda: amplitude and stamp_ns(amplitude[-1]) == STAMP + 1, 'the answer')
    bench.graph.until(lambda: len(phase) == len(amplitude), 'the phase')
    assert_answers(amplitude[-1], phase[-1], exact(machine, 300.0))


def test_a_namesake_is_noticed_and_told_once(bench, capfd, monkeypatch):
    monkeypatch.setattr('rotorsoil_ros.node.node.NAMESAKE_TICKS', 2)
    told, hall = [], '/hall'  # where no node of another test has been
    node = bench.active('fan', cli=['--ros-args', '-r', f'__ns:={hall}'])
    reports = bench.hear('/diagnostics', DiagnosticArray)

    def is_reported():
        last = [status.message for report in reports[-1:] for status in report.status]
        return any(' nodes are called /hall/rotorsoil' in message for message in last)

    def is_told():
        told.append(capfd.readouterr().err)
        return '2 nodes are called /hall/rotorsoil' in ''.join(told)

    other = Context()
    rclpy.init(context=other, domain_id=own_domain())
    namesake = Node('rotorsoil', namespace=hall, context=other)
    bench.graph.until(is_told, 'the warning')
    bench.graph.until(is_reported, 'the diagnostics')
    for _ in range(3):
        node._look_for_namesakes()
    assert ''.join(told).count(' nodes are called') == 1
    assert ' nodes are called' not in capfd.readouterr().err
    namesake.destroy_node()
    other.shutdown()
    bench.graph.until(lambda: not node._namesake_ticks, 'the end of the namesake')
    bench.graph.until(lambda: not is_reported(), 'the diagnostics of one alone')


def test_what_a_callback_raises_is_told_once_and_survived():
    told = []
    survived = Survived(told.append)
    for _ in range(3):
        with survived:
            raise KeyError('fault')
    assert len(told) == 1
    assert "KeyError: 'fault'" in told[0]
    for stop in (KeyboardInterrupt, ExternalShutdownException):
        with pytest.raises(stop), survived:
            raise stop


def test_a_disk_that_hangs_at_the_start_is_waited_for_aside(bench, tmp_path, monkeypatch):
    """As a network drive whose server is gone: no error, no answer."""
    goes = threading.Event()

    def hang(directory, name):
        assert goes.wait(DEADLINE_S)
        return new_directory(directory, name)

    monkeypatch.setattr('rotorsoil_ros.background.OPENING_S', 0.01)
    monkeypatch.setattr('rotorsoil_ros.bags.recorder.new_directory', hang)
    monkeypatch.setattr('rotorsoil_ros.bags.unfinished.undescribed', lambda directory: range(
        not goes.wait(DEADLINE_S)))
    reports = bench.hear('/diagnostics', DiagnosticArray)

    def is_said(what):
        return any(what in status.message for report in reports for status in report.status)

    node = bench.active('fan', log__directory=str(tmp_path))
    amplitude, _ = bench.answers()
    publish = bench.speaker()
    publish(joint_state([300.0]))
    bench.graph.until(lambda: amplitude, 'the answer')
    bench.graph.until(lambda: is_said('not logging: the disk does not answer'), 'the reason')
    goes.set()
    bench.graph.until(lambda: is_said('logging to'), 'the log')
    node.release()
    assert topics_of(tmp_path / 'run')['/rotorsoil/fan/amplitude'][1] == 1  # nothing is lost
