"""The process starts fast, stops at once at a signal, and leaves a finished log."""

import os
import signal
import subprocess
import sys
import time

import pytest

from rotorsoil_ros.live import bag_reader

STOPS_WITHIN_S = 1.0
STARTS_WITHIN_S = 3.0


@pytest.fixture
def start(case_file, cache, machine):
    """Return what starts a node and waits until it is active."""
    processes = []

    def run(*parameters, until='active'):
        arguments = ['machines:=[fan]', f'fan.case:={case_file}', f'cache:={cache}', *parameters]
        command = [sys.executable, '-m', 'rotorsoil_ros.live.node', '--ros-args']
        for argument in arguments:
            command += ['-p', argument]
        environment = {**os.environ, 'ROS_DOMAIN_ID': str(40 + os.getpid() % 20)}
        process = subprocess.Popen(
            command, stderr=subprocess.PIPE, text=True, env=environment)
        processes.append(process)
        told = []
        for line in process.stderr:
            told.append(line)
            if until in line:
                break
        return process, told

    yield run
    for process in processes:
        process.kill()
        process.communicate()


@pytest.mark.parametrize('stop, executor', [
    (signal.SIGINT, 'events'), (signal.SIGTERM, 'events'), (signal.SIGTERM, 'single')])
def test_a_signal_stops_the_node_and_its_log_is_finished(start, tmp_path, stop, executor):
    process, _ = start(f'log.directory:={tmp_path}', f'executor:={executor}')
    began = time.monotonic()
    process.send_signal(stop)
    _, rest = process.communicate(timeout=10.0)
    assert time.monotonic() - began < STOPS_WITHIN_S
    assert process.returncode == 0
    assert 'Traceback' not in rest
    assert '/rotorsoil/fan/model' in bag_reader.topics(tmp_path / 'run')


def test_the_node_is_active_soon_when_its_tables_are_cached(start):
    began = time.monotonic()
    start('log.rerun:=false')
    assert time.monotonic() - began < STARTS_WITHIN_S


@pytest.mark.parametrize('parameter, complaint', [
    ('fan.case:=/nowhere.yaml', '/nowhere.yaml'),
    ('stale_after_s:=never', 'parameter stale_after_s: must be a number in s'),
    ('machines:=fan', 'parameter machines:'), ('speed_depth:=0', 'parameter speed_depth:')])
def test_bad_input_ends_the_process_with_2_and_one_line(start, parameter, complaint):
    process, told = start(parameter, until='nothing that it says')
    assert process.wait(10.0) == 2
    assert len(told) == 1
    assert complaint in told[0]
