"""A run leaves one recording of the viewer beside each file of its bag, and old ones make room."""

import os
import time

import numpy as np
import pytest

from rotorsoil_ros.bags.retention import make_room, MARKER, new_directory
from rotorsoil_ros.bags.writer import LogFile
from rotorsoil_ros.node.run_log import LogSettings, RunLog
from rotorsoil_ros.testing.graph import DEADLINE_S

from recordings import assert_whole, column, predicted
from records import joint_records, START

SECOND = 10**9


def settings(directory, **others):
    return LogSettings(**({
        'directory': str(directory), 'name': 'run', 'mcap': True, 'rerun': True,
        'rerun_url': '', 'split_mib': 0.0, 'split_s': 1.0} | others))


def pass_time(log, machine, number):
    """Log and show two seconds of a run, and wait until they are on the disk."""
    before = START + 2 * number * SECOND
    log.write(joint_records(1500, start=before))
    log.show(predicted(machine, np.full(10, 300.0), start=before, period=SECOND // 10))
    log.flush()
    deadline = time.monotonic() + DEADLINE_S
    while log._bag.file.name == f'run_{number}.mcap':
        assert time.monotonic() < deadline, 'the bag was not split'


def test_a_recording_begins_with_each_file_of_the_bag(tmp_path, machine):
    pytest.importorskip('rerun', reason='rerun-sdk is optional')
    told = []
    log = RunLog(settings(tmp_path), {'fan': machine}, tell=told.append, complain=told.append)
    for number in range(3):
        pass_time(log, machine, number)
    log.close()
    assert told == []
    assert sorted(file.name for file in (tmp_path / 'run').iterdir()) == [
        MARKER, 'metadata.yaml', 'run.rrd', 'run_0.mcap', 'run_1.mcap', 'run_1.rrd', 'run_2.mcap',
        'run_2.rrd', 'run_3.mcap']
    for number, name in enumerate(('run', 'run_1', 'run_2')):
        assert_whole(tmp_path / 'run' / f'{name}.rrd')
        stamps, _ = column(tmp_path / 'run' / f'{name}.rrd', '/fan/speed', 'Scalars:scalars')
        assert len(stamps) == 10
        assert stamps[0] // SECOND == (START + 2 * number * SECOND) // SECOND


def test_old_recordings_of_the_bag_that_is_written_make_room_and_the_newest_stays(tmp_path):
    bag = new_directory(tmp_path, 'run')
    names = ['run.rrd', 'run_0.mcap', 'run_1.rrd', 'run_1.mcap', 'run_2.rrd', 'run_2.mcap']
    with LogFile(tmp_path / 'any.mcap') as log:
        log.flush()
    own = log.path.read_bytes()[:100].ljust(100, b'\0')
    for age, name in enumerate(names):
        (bag / name).write_bytes(own)
        os.utime(bag / name, (1e9 + age, 1e9 + age))
    removed = make_room(
        tmp_path, 'run', budget=350, current=bag, keep=bag / 'run_2.mcap',
        complain=pytest.fail)
    assert [file.name for file in removed] == names[:3]
    removed = make_room(
        tmp_path, 'run', budget=0, current=bag, keep=bag / 'run_2.mcap',
        complain=pytest.fail)
    assert [file.name for file in removed] == ['run_1.mcap']
    assert sorted(file.name for file in bag.iterdir()) == [
        MARKER, 'run_2.mcap', 'run_2.rrd']
