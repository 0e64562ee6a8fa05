"""Logs of the dead are recovered, those of the living are left alone, the oldest make room."""

import os
from pathlib import Path

import pytest
from rosbags.highlevel import AnyReader
import yaml

from rotorsoil_ros.bags.metadata import files as bag_files
from rotorsoil_ros.bags.retention import make_room, MARKER, new_directory
from rotorsoil_ros.bags.unfinished import is_unfinished, Recovery, unfinished
from rotorsoil_ros.bags.writer import BagWriter, LogFile

from records import joint_records, read_all, START, string_records

KIB = 1024


def finished(directory, name, *, age=0, count=500):
    bag = BagWriter(new_directory(directory, name))
    bag.write(joint_records(count))
    bag.close()
    os.utime(bag.path / 'metadata.yaml', (1e9 - age, 1e9 - age))
    return bag.path


@pytest.fixture
def killed(tmp_path):
    """Return a bag of two files whose writer died in the second."""
    bag = BagWriter(new_directory(tmp_path, 'run'), split_s=0.01)
    bag.write(joint_records(100))
    bag.flush()
    bag.write(joint_records(40, start=START + 10**9))
    bag.write(string_records())
    bag._file.flush()
    content = bag.file.read_bytes()
    listed = (bag.path / 'metadata.yaml').read_bytes()
    bag.close()
    bag.file.write_bytes(content)
    (bag.path / 'metadata.yaml').write_bytes(listed)
    return bag.path


def refuse(text):
    raise AssertionError(text)


def recover_all(directory):
    told, complaints = [], []
    recovery = Recovery(directory, tell=told.append, complain=complaints.append)
    recovery.wait(600.0)
    assert recovery.is_done
    return told, complaints


def test_a_bag_with_a_broken_file_is_whole_again_and_nothing_was_touched(killed, tmp_path):
    before = {file.name: file.read_bytes() for file in killed.glob('*.mcap')}
    told, complaints = recover_all(tmp_path)
    assert len(told) == 1
    assert '41 messages until' in told[0]
    assert not complaints
    assert [file.name for file in bag_files(killed)] == [
        'run_0.mcap', 'run_1_recovered.mcap']
    assert {name: (killed / name).read_bytes() for name in before} == before
    assert len(read_all(killed)) == 141
    with AnyReader([killed]) as reader:
        assert reader.message_count == 141
    said = yaml.safe_load((killed / 'metadata.yaml').read_text())['rosbag2_bagfile_information']
    assert said['custom_data']['recovered'] == 'run_1_recovered.mcap'
    assert recover_all(tmp_path) == ([], [])


def test_what_cannot_be_recovered_is_complained_of(killed, tmp_path):
    content = (killed / 'run_1.mcap').read_bytes()
    (killed / 'run_1.mcap').write_bytes(content)
    (killed / 'run_1_recovered.mcap.partial').mkdir()
    told, complaints = recover_all(tmp_path)
    assert not told
    assert len(complaints) == 1
    assert 'Is a directory' in complaints[0]


def test_the_file_of_a_living_writer_and_a_foreign_file_are_left_alone(tmp_path):
    (tmp_path / 'run').mkdir()
    with LogFile(tmp_path / 'run' / 'run_0.mcap') as log:
        log.write(joint_records(10))
        log.flush()
        assert not is_unfinished(log.path)
        (tmp_path / 'run' / 'foreign.mcap').write_bytes(b'\x89MCAP0\r\n' + bytes(100))
        assert list(unfinished(tmp_path)) == []


def test_the_oldest_logs_make_room_and_nothing_else_does(tmp_path):
    old = finished(tmp_path, 'run', age=30)
    middle = finished(tmp_path, 'run', age=20)
    new = finished(tmp_path, 'run', age=10)
    foreign = finished(tmp_path, 'other', age=99)
    (tmp_path / 'run_9').mkdir()
    (tmp_path / 'run_9' / 'notes').write_text('not a log')
    (old / 'notes').write_text('precious')
    living = BagWriter(new_directory(tmp_path, 'run'))
    living.write(joint_records(1))
    living.flush()
    size = sum(file.stat().st_size for bag in (new, living.path) for file in bag.iterdir())
    removed = make_room(tmp_path, 'run', budget=size, current=living.path, keep=living.file,
                        complain=refuse)
    living.close()
    assert removed == [old, middle]
    assert [path.name for path in old.iterdir()] == ['notes']
    assert not middle.exists()
    assert foreign.exists()
    assert new.exists()
    assert (tmp_path / 'run_9' / 'notes').exists()


def test_the_bag_of_another_living_node_makes_no_room(tmp_path):
    with LogFile(finished(tmp_path, 'run') / 'run_1.mcap') as log:
        log.write(joint_records(1))
        log.flush()
        own = new_directory(tmp_path, 'run')
        assert make_room(tmp_path, 'run', budget=0, current=own, keep=None,
                         complain=refuse) == []


def test_a_log_is_known_by_its_marker_over_restarts_and_not_by_its_name(tmp_path):
    """A second log called `run` and the first one called `run_2` look the same but are not."""
    own = [finished(tmp_path, 'run', age=age) for age in (50, 40, 30)]
    other = finished(tmp_path, 'run_2', age=99)
    assert [bag.name for bag in own] == ['run', 'run_2', 'run_3']
    assert other.name == 'run_2_2'
    kept = finished(tmp_path, 'run', age=98)
    kept = kept.rename(tmp_path / 'keep_this')
    for name in ('analysis.rrd', 'table.tmp', 'converted.mcap', 'run_9.mcap'):
        (own[0] / name).write_text('precious')
    living = BagWriter(new_directory(tmp_path, 'run'))
    removed = make_room(tmp_path, 'run', budget=0, current=living.path, keep=living.file,
                        complain=refuse)
    living.close()
    assert removed == own
    assert sorted(file.name for file in own[0].iterdir()) == [
        'analysis.rrd', 'converted.mcap', 'run_9.mcap', 'table.tmp']
    assert [bag.exists() for bag in (*own[1:], other, kept)] == [False, False, True, True]


def test_what_cannot_be_removed_is_told_and_the_rest_makes_room(tmp_path, monkeypatch):
    old, new = finished(tmp_path, 'run', age=20), finished(tmp_path, 'run', age=10)
    unlink = Path.unlink

    def refused(path, **options):
        if path.parent == old:
            raise PermissionError(13, 'Permission denied')
        unlink(path, **options)

    monkeypatch.setattr(Path, 'unlink', refused)
    told = []
    assert make_room(tmp_path, 'run', budget=0, current=None, keep=None,
                     complain=told.append) == [new]
    assert f'{old}/run_0.mcap: cannot be removed to make room: Permission denied' in told
    assert not new.exists()


def test_a_recovered_file_that_the_metadata_does_not_know_is_described(killed, tmp_path):
    """As when the node died after the recovery and before it wrote the metadata."""
    said = (killed / 'metadata.yaml').read_text()
    recover_all(tmp_path)
    (killed / 'metadata.yaml').write_text(
        said.replace('custom_data:', 'custom_data:\n    gap_1: x'))
    assert recover_all(tmp_path) == ([], [])
    known = yaml.safe_load((killed / 'metadata.yaml').read_text())
    known = known['rosbag2_bagfile_information']
    assert known['relative_file_paths'] == ['run_0.mcap', 'run_1_recovered.mcap']
    assert known['custom_data']['gap_1'] == 'x'
    (killed / 'metadata.yaml').unlink()
    assert recover_all(tmp_path) == ([], [])
    with AnyReader([killed]) as reader:
        assert reader.message_count == 141


@pytest.mark.parametrize('place', ['run_1.mcap', 'metadata.yaml', MARKER])
@pytest.mark.parametrize('make', [
    os.mkfifo, os.mkdir, lambda path: os.symlink('/dev/zero', path)])
def test_whatever_lies_in_place_of_a_file_holds_nobody_up(killed, tmp_path, place, make):
    (killed / place).unlink(missing_ok=True)
    make(killed / place)
    told, complaints = recover_all(tmp_path)
    assert len(told) == (place != 'run_1.mcap')  # what is broken is saved all the same
    make_room(tmp_path, 'run', budget=0, current=None, keep=None, complain=complaints.append)
    assert all(str(killed / place) in text for text in complaints)
    assert (killed / place).is_symlink() or not (killed / place).is_file()
