"""The process starts fast, stops at once at a signal, and leaves a finished log."""

import signal
import time

import pytest

from rotorsoil_ros.bags import reader as bag_reader
from rotorsoil_ros.errors import InputError
from rotorsoil_ros.wire.definitions import JOINT_STATE

from graphs import speak

# Far above what benchmarks/lookup.py measures (0.3 s and 1.5 s): a busy machine is no failure,
# a hang is one.
STOPS_WITHIN_S = 4.0
STARTS_WITHIN_S = 10.0


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


def test_a_kill_loses_at_most_a_second_and_the_next_start_saves_the_rest(
        start, graph, tmp_path):
    process, _ = start(f'log.directory:={tmp_path}', 'speed_depth:=1000', 'log.rerun:=false')
    said = speak(graph, lambda said: len(said) > 50 and said[-1] - said[0] > 2.3e9)
    process.kill()
    process.wait(10.0)
    broken = tmp_path / 'run' / 'run_0.mcap'
    before = broken.read_bytes()
    with pytest.raises(InputError, match='was never finished'):
        bag_reader.topics(tmp_path / 'run')

    _, told = start(f'log.directory:={tmp_path}', 'log.rerun:=false', until='was never finished')
    assert sum('was never finished' in line for line in told) == 1
    assert broken.read_bytes() == before
    graph.until(lambda: 'recovered' in (tmp_path / 'run' / 'metadata.yaml').read_text(),
                'new metadata')
    assert bag_reader.topics(tmp_path / 'run')['/rotorsoil/fan/amplitude'][0] == JOINT_STATE
    answered = [stamp for source, stamp, _ in bag_reader.messages(
        tmp_path / 'run', lambda topic, _: topic == '/rotorsoil/fan/amplitude')]
    # A second of the flush, and what was under way while the machine was busy.
    assert said[-1] - answered[-1] < 1.1e9
    assert set(answered) <= set(said)

    _, told = start(f'log.directory:={tmp_path}', 'log.rerun:=false')
    assert not any('was never finished' in line for line in told)
