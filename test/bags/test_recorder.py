"""Whatever the disk does, nobody is stopped, it is told once, and the gap is written down."""

import errno
import os
from pathlib import Path
import resource
import shutil

import pytest
import yaml

from rotorsoil_ros.bags.metadata import files as bag_files
from rotorsoil_ros.bags.recorder import Recorder
from rotorsoil_ros.bags.retention import MARKER
from rotorsoil_ros.bags.writer import LogFile
from rotorsoil_ros.events import Level

from records import joint_records, read_all, START, string_records

SECOND = 10**9


class Desk:
    """A recorder, what it tells, and seconds that pass."""

    def __init__(self, directory, **options):
        self.told, self.complaints, self.second = [], [], 0
        settings = {'split_mib': 0.0, 'split_s': 0.0, 'budget_mib': 0.0} | options
        self.recorder = Recorder(directory, 'run', tell=self.told.append,
                                 complain=self.complaints.append, **settings)

    def pass_second(self, count=100):
        self.recorder.write(joint_records(count, start=START + self.second * SECOND))
        self.second += 1
        self.recorder.flush()
        return self.recorder.report(self.second)


@pytest.fixture
def desk(tmp_path):
    desk = Desk(tmp_path)
    yield desk
    desk.recorder.close()


def gaps(bag):
    said = yaml.safe_load((bag / 'metadata.yaml').read_text())['rosbag2_bagfile_information']
    return {name: text for name, text in said['custom_data'].items() if name.startswith('gap')}


@pytest.fixture
def full_disk():
    """Return what lets no file grow beyond a size, and what ends that."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)

    def limit(size):
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft if size is None else size, hard))

    yield limit
    limit(None)


def test_a_full_disk_costs_a_gap_that_is_told_once_and_written_down(desk, tmp_path, full_disk):
    assert desk.pass_second().level is Level.OK
    full_disk((tmp_path / 'run' / 'run_0.mcap').stat().st_size + 2000)
    reports = [desk.pass_second() for _ in range(3)]
    assert [report.level for report in reports] == [Level.ERROR] * 3
    assert reports[-1].summary == 'not logging: File too large'
    assert reports[-1].values['lost'] == 300
    full_disk(None)
    assert desk.pass_second().level is Level.WARN  # these are lost as well, but it works again
    report = desk.pass_second()
    assert (report.level, report.values['lost'], report.values['gaps']) == (Level.OK, 400, 1)
    desk.recorder.close()
    assert len(desk.complaints) == len(desk.told) == 1
    assert [file.name for file in bag_files(tmp_path / 'run')] == [
        'run_0.mcap', 'run_1.mcap']  # the first one could even be finished
    stamps = [time for _, time, _ in read_all(tmp_path / 'run')]
    assert len(stamps) == 200
    assert stamps[0] == START
    assert stamps[100] == START + 5 * SECOND
    assert gaps(tmp_path / 'run') == {
        'gap_1': f'400 messages until {START + 4 * SECOND + 99 * 10**6} ns: File too large'}


def vanish(path):
    shutil.rmtree(path)


def become_a_file(path):
    shutil.rmtree(path.parent)
    path.parent.write_text('in the way')


def lose_the_file(path):
    (path / 'run_0.mcap').unlink()


def be_replaced(path):
    os.replace(path / 'metadata.yaml', path / 'run_0.mcap')


@pytest.mark.parametrize('harm', [vanish, lose_the_file, be_replaced])
def test_what_is_deleted_is_noticed_within_a_second_and_begun_anew(desk, tmp_path, harm):
    desk.pass_second()
    harm(tmp_path / 'run')
    assert desk.pass_second().level is Level.ERROR
    assert desk.pass_second().level is Level.WARN
    assert desk.pass_second().level is Level.OK
    desk.recorder.close()
    assert len(desk.complaints) == 1
    assert 'was deleted while it was written' in desk.complaints[0]
    assert len(read_all(tmp_path / 'run')) == 100
    assert next(iter(gaps(tmp_path / 'run').values())).startswith('300 messages until')


def test_a_directory_that_became_a_file_is_waited_for(tmp_path):
    desk = Desk(tmp_path / 'logs')
    desk.pass_second()
    become_a_file(tmp_path / 'logs' / 'run')
    levels = [desk.pass_second().level for _ in range(3)]
    assert levels == [Level.ERROR] * 3
    (tmp_path / 'logs').unlink()
    desk.pass_second()
    assert desk.pass_second().level is Level.OK
    desk.recorder.close()
    assert len(read_all(tmp_path / 'logs' / 'run')) == 100
    assert len(desk.complaints) == 1


def test_a_file_after_a_gap_opens_with_the_last_model_even_one_from_the_gap(
        desk, tmp_path, full_disk):
    desk.recorder.write(string_records())
    desk.pass_second()
    full_disk(1000)
    desk.pass_second()
    desk.recorder.write(string_records(start=START + 7))
    assert desk.pass_second().values['lost'] == 200  # the model is not: it is still to come
    full_disk(None)
    desk.pass_second()
    report = desk.pass_second()
    assert (report.values['written'], report.values['lost']) == (201, 300)
    desk.recorder.close()
    told = [time for topic, time, _ in read_all(tmp_path / 'run' / 'run_1.mcap')
            if topic == '/rotorsoil/fan/model']
    assert told == [START + 7]


def test_a_disk_that_stays_full_collects_no_litter(desk, tmp_path, full_disk):
    desk.pass_second()
    full_disk(1000)
    for _ in range(5):
        desk.pass_second()
    full_disk(None)
    assert sorted(path.name for path in tmp_path.iterdir()) == ['run']
    assert sorted(path.name for path in (tmp_path / 'run').iterdir()) == [
        MARKER, 'metadata.yaml', 'run_0.mcap']


@pytest.mark.skipif(not Path('/dev/full').exists(), reason='there is no device that is full')
def test_a_log_onto_a_full_device_ends_in_one_complaint(desk, tmp_path):
    desk.recorder._bag._file._stream.close()
    desk.recorder._bag._file._writer._stream = open('/dev/full', 'wb', buffering=0)  # noqa: SIM115
    desk.recorder._bag._file._stream = desk.recorder._bag._file._writer._stream
    assert desk.pass_second().level is Level.ERROR
    assert len(desk.complaints) == 1


def test_the_budget_splits_and_removes_the_oldest_files_of_a_long_run(tmp_path):
    budget_mib = 0.2
    desk = Desk(tmp_path, budget_mib=budget_mib)
    for _ in range(60):
        desk.pass_second(400)
    desk.recorder.close()
    files = bag_files(tmp_path / 'run')
    assert set(files) == set((tmp_path / 'run').glob('*.mcap'))
    assert 2 < len(files) < 12
    size = sum(file.stat().st_size for file in files)
    assert 0.5 * budget_mib * 2**20 < size < 1.2 * budget_mib * 2**20
    stamps = [time for _, time, _ in read_all(tmp_path / 'run')]
    assert stamps[-1] == START + 59 * SECOND + 399 * 10**6
    assert not desk.complaints


def test_the_index_of_an_endless_file_takes_bounded_memory(desk, tmp_path, monkeypatch):
    monkeypatch.setattr('rotorsoil_ros.bags.writer.LARGEST_INDEX', 1000)
    for _ in range(50):
        desk.pass_second(1)
    assert desk.recorder._bag._file.index_size < 1200
    desk.recorder.close()
    assert len(read_all(tmp_path / 'run')) == 50
    assert len(bag_files(tmp_path / 'run')) > 3


def test_errno_is_told_in_words(desk, monkeypatch):
    def fail(*_):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(desk.recorder._bag, 'write', fail)
    assert desk.pass_second().summary.startswith('logging again')
    assert 'No space left on device' in desk.complaints[0]


def test_a_split_that_may_not_be_made_is_told_and_tried_again(tmp_path, monkeypatch):
    """As when somebody takes the right to write while the run is on."""
    desk = Desk(tmp_path, split_s=0.05)
    opened = []

    def refuse(path):
        opened.append(path)
        if len(opened) < 3:
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(path))
        return LogFile(path)

    monkeypatch.setattr('rotorsoil_ros.bags.writer.LogFile', refuse)
    levels = [desk.pass_second().level for _ in range(5)]
    desk.recorder.close()
    assert levels[0] is Level.ERROR
    assert levels[-1] is Level.OK
    assert len(desk.complaints) == len(desk.told) == 1
    assert 'Permission denied' in desk.complaints[0]
    assert len(gaps(tmp_path / 'run')) == 1
    assert len(read_all(tmp_path / 'run')) == desk.recorder.report(0).values['written']
