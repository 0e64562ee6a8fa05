"""The process stops at a signal, leaves a finished log, and loses nothing that was on the disk."""

from contextlib import suppress
import signal
import subprocess
import sys

from mcap.exceptions import EndOfFile
from mcap.reader import NonSeekingReader
import pytest

from rotorsoil_ros.bags import reader as bag_reader
from rotorsoil_ros.testing.graph import DEADLINE_S
from rotorsoil_ros.wire.definitions import JOINT_STATE

from graphs import speak
from records import topics_of

PARAMETER_FILES = {
    'BROKEN': 'a: [\n', 'EMPTY': '', 'OTHER': '/**: {ros__parameters: {machines: [fan], fan: '
                                              '{case: 7}}}\n'}
AMPLITUDE = '/rotorsoil/fan/amplitude'


def on_disk(path):
    """Return the times of the answers in a file that nobody has finished."""
    found = []
    with path.open('rb') as stream, suppress(EndOfFile):
        for _, channel, message in NonSeekingReader(stream).iter_messages(log_time_order=False):
            if channel.topic == AMPLITUDE:
                found.append(message.log_time)
    return found


@pytest.mark.parametrize('stop, executor', [
    (signal.SIGINT, 'events'), (signal.SIGTERM, 'events'), (signal.SIGTERM, 'single'),
    (signal.SIGHUP, 'events')])
def test_a_signal_stops_the_node_and_its_log_is_finished(start, tmp_path, stop, executor):
    process, _ = start(f'log.directory:={tmp_path}', f'executor:={executor}')
    process.send_signal(stop)
    _, rest = process.communicate(timeout=DEADLINE_S)
    assert process.returncode == 0
    assert 'Traceback' not in rest
    assert '/rotorsoil/fan/model' in topics_of(tmp_path / 'run')


@pytest.mark.parametrize('parameter, complaint', [
    ('fan.case:=/nowhere.yaml', '/nowhere.yaml'),
    ('stale_after_s:=never', 'parameter stale_after_s: must be a number in s'),
    ('machines:=fan', 'parameter machines:'), ('speed_depth:=0', 'parameter speed_depth:')])
def test_bad_input_ends_the_process_with_2_and_one_line(start, parameter, complaint):
    process, told = start(parameter, until='nothing that it says')
    assert process.wait(DEADLINE_S) == 2
    assert len(told) == 1
    assert complaint in told[0]


@pytest.mark.parametrize('arguments, complaint', [
    (['--params-file', '/nowhere.yaml'], "Couldn't parse params file: '--params-file /nowhere"),
    (['-p', 'foo'], "Couldn't parse parameter override rule: '-p foo'"),
    (['-r', 'foo'], "Couldn't parse remap rule: '-r foo'"),
    (['--log-level', 'loud'], "Couldn't parse log level: '--log-level loud'"),
    (['--foo'], "arguments after --ros-args must be known, got ['--foo']"),
    (['--params-file', 'BROKEN'], "Couldn't parse params file: '--params-file"),
    (['--params-file', 'EMPTY'], 'parameter machines: must name at least one machine, got none'),
    (['--params-file', 'OTHER'], 'parameter fan.case: Trying to set parameter'),
    (['-p', 'machines:=[fan]', '-p', 'fan.case:=paper_rotor', '-p', 'fan.speed.ratio:=two'],
     'parameter fan.speed.ratio: must be a number')])
def test_arguments_that_ros_does_not_know_end_it_with_2_and_one_line(
        arguments, complaint, tmp_path):
    for name, text in PARAMETER_FILES.items():
        (tmp_path / name).write_text(text)
    arguments = [str(tmp_path / each) if each in PARAMETER_FILES else each for each in arguments]
    done = subprocess.run(
        [sys.executable, '-m', 'rotorsoil_ros.node.node', '--ros-args', *arguments],
        capture_output=True, text=True, timeout=DEADLINE_S)
    assert done.returncode == 2
    (line,) = (done.stdout + done.stderr).splitlines()
    assert complaint in line


def test_arguments_before_those_of_ros_are_refused_with_a_hint():
    done = subprocess.run(
        [sys.executable, '-m', 'rotorsoil_ros.node.node', '-p', 'machines:=[fan]'],
        capture_output=True, text=True, timeout=DEADLINE_S)
    assert done.returncode == 2
    assert 'arguments must stand behind --ros-args, got -p machines:=[fan]' in done.stderr


def test_a_kill_loses_nothing_that_was_on_the_disk_and_the_next_start_saves_it(
        start, graph, tmp_path):
    process, _ = start(f'log.directory:={tmp_path}', 'speed_depth:=1000', 'log.rerun:=false')
    broken = tmp_path / 'run' / 'run_0.mcap'
    said = speak(graph, lambda said: len(on_disk(broken)) > 50)
    process.kill()
    process.wait(DEADLINE_S)
    kept = on_disk(broken)
    before = broken.read_bytes()
    assert topics_of(tmp_path / 'run')[AMPLITUDE][1] == len(kept)  # even before it is saved

    _, told = start(f'log.directory:={tmp_path}', 'log.rerun:=false', until='was never finished')
    assert sum('was never finished' in line for line in told) == 1
    assert broken.read_bytes() == before
    graph.until(lambda: 'recovered' in (tmp_path / 'run' / 'metadata.yaml').read_text(),
                'new metadata')
    assert topics_of(tmp_path / 'run')[AMPLITUDE][0] == JOINT_STATE
    answered = [stamp for source, stamp, _ in bag_reader.messages(
        tmp_path / 'run', lambda topic, _: topic == AMPLITUDE)]
    assert answered == kept == sorted(set(kept) & set(said))

    _, told = start(f'log.directory:={tmp_path}', 'log.rerun:=false')
    assert not any('was never finished' in line for line in told)
