"""A node whose disk is really full goes on answering, and logs again when there is room."""

from contextlib import suppress
import signal
import subprocess

from diagnostic_msgs.msg import DiagnosticArray
import pytest
from rosbags.highlevel import AnyReader
from sensor_msgs.msg import JointState
import yaml

from rotorsoil_ros.bags import reader as bag_reader
from rotorsoil_ros.bags.metadata import files as bag_files
from rotorsoil_ros.bags.recover import recover
from rotorsoil_ros.testing.graph import DEADLINE_S

from graphs import speak, stamp_ns
from records import topics_of

AMPLITUDE = '/rotorsoil/fan/amplitude'
DISK_MIB = 2
LEFT = 24 * 1024  # bytes that are free when the node starts: some seconds of its log


@pytest.fixture
def disk(tmp_path):
    """Return a file system of its own, two mebibytes large."""
    path = tmp_path / 'disk'
    path.mkdir()
    mount = ['mount', '-t', 'tmpfs', '-o', f'size={DISK_MIB}m', 'tmpfs', str(path)]
    with suppress(OSError):
        if subprocess.run(mount, check=False, capture_output=True).returncode == 0:
            yield path
            subprocess.run(['umount', '--lazy', str(path)], check=True)
            return
    pytest.skip('mounting a file system is not allowed here')


@pytest.mark.slow
def test_a_disk_that_is_full_is_logged_to_again_when_there_is_room(start, graph, disk, tmp_path):
    ballast = disk / 'ballast'
    ballast.write_bytes(bytes(DISK_MIB * 2**20 - LEFT))
    reports, answered = [], []

    def hear(message):
        reports.extend((status.level, status.message) for status in message.status
                       if status.name == 'rotorsoil: log')

    graph.probe.create_subscription(DiagnosticArray, '/diagnostics', hear, 10)
    graph.probe.create_subscription(
        JointState, AMPLITUDE, lambda message: answered.append(stamp_ns(message)), 1000)
    process, _ = start(f'log.directory:={disk}', 'speed_depth:=1000', 'log.rerun:=false')
    said = speak(graph, lambda said: any(level == b'\x02' for level, _ in reports))
    assert reports[-1][1] == 'not logging: No space left on device'
    ballast.unlink()
    said += speak(graph, lambda said: reports[-1][0] == b'\x00' and said)
    graph.until(lambda: answered[-1] == said[-1], 'the last answer')
    process.send_signal(signal.SIGTERM)
    _, told = process.communicate(timeout=DEADLINE_S)
    assert process.returncode == 0
    assert told.count('No space left on device') == 2  # it failed; it goes on without ...
    assert 'Traceback' not in told
    bag = disk / 'run'
    first, second = bag_files(bag)
    logged = [time for source, time, _ in bag_reader.messages(
        bag, lambda topic, _: topic == AMPLITUDE)]
    assert logged == sorted(set(logged))
    assert set(logged) <= set(said)
    assert len(set(answered) - set(logged)) > 20  # answered while nothing was logged
    assert logged[-1] == answered[-1]
    with AnyReader([bag]) as reader:
        assert sum(1 for connection, _, _ in reader.messages()
                   if connection.topic == AMPLITUDE) == len(logged)
    assert topics_of(second)['/rotorsoil/fan/model'][1] == 1
    saved = recover(first, tmp_path / 'saved.mcap')
    assert saved.messages == sum(number for _, number in topics_of(first).values())
    information = yaml.safe_load((bag / 'metadata.yaml').read_text())
    gap = information['rosbag2_bagfile_information']['custom_data']['gap_1']
    assert gap.endswith('No space left on device')
