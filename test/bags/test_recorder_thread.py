"""Nobody waits for the disk, nothing is lost while there is room, and what is lost is written."""

from itertools import islice
import threading
import time

from mcap.reader import NonSeekingReader
import pytest
import yaml

from rotorsoil_ros.bags.metadata import files as bag_files
from rotorsoil_ros.bags.recorder import BagAside, ITEMS_AT_ONCE, Recorder
from rotorsoil_ros.events import Level

from records import joint_records, read_all, START, string_records

DEADLINE_S = 600.0  # for what hangs
BACKLOG = 32
SECOND = 10**9


class Desk:
    """A recording, what it tells, and a disk that can be held."""

    def __init__(self, directory):
        self.told, self.complaints = [], []
        self.goes, self.is_held = threading.Event(), threading.Event()
        self.goes.set()
        self.directory = directory
        self.aside = BagAside(self.begin, complain=self.complaints.append)
        self.recorder = self.aside._recorder

    def begin(self):
        recorder = Recorder(self.directory, 'run', split_mib=0.0, split_s=0.0,
                            budget_mib=0.0, tell=self.told.append,
                            complain=self.complaints.append)
        self._write = recorder._bag._file._stream.write
        recorder._bag._file._writer._stream = self
        return recorder

    def write(self, content):
        """Write as a stream does, once the disk goes."""
        self.is_held.set()
        assert self.goes.wait(DEADLINE_S)
        return self._write(content)

    def hold(self):
        """Let the disk hang, and wait until the thread hangs with it."""
        self.goes.clear()
        self.is_held.clear()
        self.aside.write(joint_records(1))
        self.aside.flush()
        assert self.is_held.wait(DEADLINE_S)

    def until(self, holds):
        deadline = time.monotonic() + DEADLINE_S
        while not holds():
            assert time.monotonic() < deadline
            if self.aside._aside._batches.empty():
                self.aside.flush()


@pytest.fixture
def desk(tmp_path, monkeypatch):
    monkeypatch.setattr('rotorsoil_ros.bags.recorder.LOG_BACKLOG', BACKLOG)
    desk = Desk(tmp_path)
    yield desk
    desk.goes.set()
    desk.aside.close()


def test_all_that_came_is_logged_in_its_order_when_the_run_ends(desk, tmp_path):
    sent = [joint_records(1, start=START + step * 10**6, topic=f'/{step % 3}')
            for step in range(9 * ITEMS_AT_ONCE + 10)]
    for records in sent:
        desk.aside.write(records)
    desk.aside.close()
    with (tmp_path / 'run' / 'run_0.mcap').open('rb') as stream:
        found = [(channel.topic, message.log_time, message.data) for _, channel, message in
                 NonSeekingReader(stream).iter_messages(log_time_order=False)]
    assert found == [(records.topic, records.log_time_ns[0], records.payloads[0])
                     for records in sent]
    assert desk.complaints == []


def test_a_second_is_on_the_disk_when_the_thread_has_taken_it(desk, tmp_path):
    desk.aside.write(joint_records(10))
    desk.aside.flush()
    desk.until(lambda: desk.aside.report(5).values['written'] == 10)
    assert desk.aside.report(5).stamp_ns == 5
    with (tmp_path / 'run' / 'run_0.mcap').open('rb') as stream:  # nothing was closed
        messages = NonSeekingReader(stream).iter_messages(log_time_order=False)
        assert len(list(islice(messages, 10))) == 10


def test_a_disk_that_hangs_holds_nobody_up_and_costs_a_gap_of_what_found_no_room(desk, tmp_path):
    desk.hold()
    for second in range(BACKLOG + 3):
        desk.aside.write(joint_records(10, start=START + (1 + second) * SECOND))
        desk.aside.write(string_records(start=START + second))
        desk.aside.flush()
    assert desk.aside.report(0).level is Level.ERROR
    assert desk.aside._aside._batches.qsize() == BACKLOG
    assert len(desk.aside._waiting) == 1  # the last model: it costs nothing to keep
    assert desk.complaints == ['the log does not keep up: not all of the run is logged']
    desk.goes.set()
    desk.until(lambda: desk.told)
    desk.aside.write(joint_records(10, start=START + 99 * SECOND))
    desk.aside.close()
    assert len(desk.complaints) == 1
    first, second = bag_files(tmp_path / 'run')
    assert [time for topic, time, _ in read_all(first) if 'joint' in topic] == [START] + [
        START + (1 + second) * SECOND + row * 10**6
        for second in range(BACKLOG) for row in range(10)]
    assert [time for topic, time, _ in read_all(second) if 'joint' in topic] == [
        START + 99 * SECOND + row * 10**6 for row in range(10)]
    # The model that came last in the gap is there, behind the one that the file opens with.
    assert [time for topic, time, _ in read_all(second) if 'model' in topic] == [
        START + BACKLOG - 1, START + BACKLOG + 2]
    said = yaml.safe_load((tmp_path / 'run' / 'metadata.yaml').read_text())
    assert said['rosbag2_bagfile_information']['custom_data']['gap_1'] == (
        f'30 messages until {START + (BACKLOG + 3) * SECOND + 9 * 10**6} ns: '
        'the disk did not keep up')
    report = desk.recorder.report(0)
    assert (report.values['lost'], report.values['written']) == (30, 1 + 11 * BACKLOG + 1 + 10)


def test_a_disk_that_hangs_at_the_end_is_left_alone(desk, monkeypatch):
    monkeypatch.setattr(desk.aside._aside, '_patience_s', 0.05)
    desk.hold()
    desk.aside.close()
    assert desk.complaints == ['the log did not finish within 0.05 s and is left alone']
