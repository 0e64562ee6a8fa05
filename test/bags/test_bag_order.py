"""Messages come in the order of their times, however the writer has laid them into chunks."""

from mcap.reader import make_reader
import numpy as np
import pytest

from rotorsoil_ros.bags import reader as bag_reader
from rotorsoil_ros.bags.writer import LogFile
from rotorsoil_ros.wire.definitions import JOINT_STATE
from rotorsoil_ros.wire.messages import JointStateWriter, Records

START = 1_700_000_000 * 10**9


def write(path, topics, count=9000, step=10**7):
    """Write one topic after the other, as a converter does: chunks overlap in time."""
    writer = JointStateWriter(['rotor'])
    random = np.random.default_rng(5)
    with LogFile(path) as log:
        for number, topic in enumerate(topics):
            stamps = [START + step * row + number for row in range(count)]
            log.write(Records(topic, JOINT_STATE, stamps,
                              writer.write(stamps, random.normal(size=(count, 3, 1)))))
            log.flush()


@pytest.fixture(scope='module')
def converted(tmp_path_factory):
    path = tmp_path_factory.mktemp('converted') / 'converted.mcap'
    write(path, ['/a/joint_states', '/a/measured/amplitude', '/a/measured/phase'])
    return path


def test_overlapping_chunks_are_read_as_the_reference_library_reads_them(converted):
    found = [(source.topic, time, bytes(payload))
             for source, time, payload in bag_reader.messages(converted, lambda *_: True)]
    with converted.open('rb') as stream:
        wanted = [(channel.topic, message.log_time, message.data) for _, channel, message in
                  make_reader(stream).iter_messages(log_time_order=True)]
    assert found == wanted


def test_batches_of_a_span_hold_nothing_of_another(converted):
    spans = []
    for batch in bag_reader.batches(converted, lambda *_: True, at_most=64, span_ns=10**9):
        seconds = {time // 10**9 for time in batch.log_time_ns}
        assert len(seconds) == 1
        assert len(batch.payloads) <= 64
        spans.append(seconds.pop())
    assert spans == sorted(spans)
    assert len(set(spans)) == 90


def test_order_gives_way_to_memory(converted, monkeypatch):
    """A file whose chunks all overlap is not kept whole, and nothing of it is lost."""
    monkeypatch.setattr(bag_reader, 'MOST_WAITING', 1000)
    held = [len(chunk) for chunk in bag_reader._chunks(converted, lambda *_: True, print)]
    assert sum(held) == 27000
    whole = [time for _, time, _ in bag_reader.messages(converted, lambda *_: True)]
    assert len(whole) == 27000
    assert whole != sorted(whole)  # the limit was felt: no more than it waited
