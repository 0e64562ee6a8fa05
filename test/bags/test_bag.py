"""A log is a bag that every reader reads, and a broken one is refused in one line."""

from contextlib import suppress
import io
from itertools import islice
import struct
import zlib

from hypothesis import given, HealthCheck, settings, strategies as some
from mcap.exceptions import EndOfFile
from mcap.opcode import Opcode
from mcap.reader import make_reader, NonSeekingReader
from mcap.records import Chunk, DataEnd, MessageIndex
from mcap.stream_reader import get_chunk_data_stream, StreamReader
import pytest
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import StoragePlugin, Writer as ForeignWriter
from rosbags.rosbag2.enums import CompressionFormat, CompressionMode
import yaml

from rotorsoil_ros.bags import reader as bag_reader
from rotorsoil_ros.bags.metadata import files as bag_files
from rotorsoil_ros.bags.retention import new_directory
from rotorsoil_ros.bags.writer import BagWriter, LogFile
from rotorsoil_ros.errors import InputError
from rotorsoil_ros.wire.definitions import (
    definition,
    DIAGNOSTICS,
    FLOAT64,
    JOINT_STATE,
    STRING,
    type_hash,
)

from records import (
    float_records,
    joint_records,
    read_all,
    START,
    STORE,
    string_records,
    topics_of,
    written,
)

TYPES = (JOINT_STATE, STRING, DIAGNOSTICS, FLOAT64)


def test_rosbags_reads_message_for_message_what_was_written(bag):
    batches = [string_records(), joint_records(3000), float_records(2000)]
    for records in batches:
        bag.write(records)
    bag.close()
    with AnyReader([bag.path]) as reader:
        found = sorted((time, connection.topic, bytes(raw))
                       for connection, time, raw in reader.messages())
        assert {connection.topic: connection.msgtype for connection in reader.connections} == {
            '/rotorsoil/fan/model': STRING, '/fan/joint_states': JOINT_STATE,
            '/fan/rotor/speed': FLOAT64}
        speeds = [reader.deserialize(raw, connection.msgtype).data
                  for connection, _, raw in reader.messages() if connection.msgtype == FLOAT64]
    assert found == written(*batches)
    assert speeds == list(range(2000))


def test_the_reference_library_finds_every_checksum_right(bag):
    bag.write(joint_records(8990))
    bag.write(joint_records(10, start=START + 8990 * 10**6))
    bag.write(joint_records(2000))  # more than a chunk
    bag.write(float_records(1, start=START + 5))
    bag.close()
    content = (bag.path / 'run_0.mcap').read_bytes()
    indexed = make_reader(io.BytesIO(content), validate_crcs=True)
    assert sum(1 for _ in indexed.iter_messages()) == 11001
    streamed = NonSeekingReader(io.BytesIO(content), validate_crcs=True)
    assert sum(1 for _ in streamed.iter_messages(log_time_order=False)) == 11001
    summary = indexed.get_summary()
    assert summary.statistics.message_start_time == START
    assert summary.statistics.message_end_time == START + 8999 * 10**6
    assert summary.statistics.chunk_count == len(summary.chunk_indexes) > 1
    assert indexed.get_header().profile == 'ros2'
    records = list(StreamReader(io.BytesIO(content), emit_chunks=True).records)
    assert all(record.data_section_crc for record in records if isinstance(record, DataEnd))
    start, _, crc = struct.unpack('<QQI', content[-28:-8])
    assert zlib.crc32(content[start:-12]) == crc


def test_the_index_of_a_chunk_points_at_its_messages(bag):
    bag.write(joint_records(3))
    bag.write(float_records(2))
    bag.close()
    with (bag.path / 'run_0.mcap').open('rb') as stream:
        records = list(StreamReader(stream, emit_chunks=True).records)
    chunk, = (record for record in records if isinstance(record, Chunk))
    body = get_chunk_data_stream(chunk)[0].read(chunk.uncompressed_size)
    entries = [(index.channel_id, *entry) for index in records
               if isinstance(index, MessageIndex) for entry in index.records]
    assert len(entries) == 5
    for channel, stamp, offset in entries:
        opcode, _, said_channel, _, said_stamp = struct.unpack_from('<BQHIQ', body, offset)
        assert (opcode, said_channel, said_stamp) == (Opcode.MESSAGE, channel, stamp)


def test_metadata_is_that_of_rosbag2(bag):
    empty = yaml.safe_load((bag.path / 'metadata.yaml').read_text())
    assert empty['rosbag2_bagfile_information']['message_count'] == 0
    bag.write(string_records())
    bag.write(joint_records(11))
    bag.close()
    said = yaml.safe_load((bag.path / 'metadata.yaml').read_text())['rosbag2_bagfile_information']
    assert said['version'] == 9
    assert said['storage_identifier'] == 'mcap'
    assert said['relative_file_paths'] == ['run_0.mcap']
    assert said['message_count'] == 12
    assert said['starting_time'] == {'nanoseconds_since_epoch': START}
    assert said['duration'] == {'nanoseconds': 10**7}
    topics = {entry['topic_metadata']['name']: entry for entry in
              said['topics_with_message_count']}
    assert topics['/fan/joint_states']['message_count'] == 11
    model = topics['/rotorsoil/fan/model']['topic_metadata']
    assert model['offered_qos_profiles'][0]['durability'] == 'transient_local'
    assert model['type_description_hash'] == STORE.hash_rihs01(STRING)


def test_channels_carry_the_quality_of_service_as_text(bag):
    bag.write(string_records())
    bag.close()
    with (bag.path / 'run_0.mcap').open('rb') as stream:
        channel, = make_reader(stream).get_summary().channels.values()
    profile, = yaml.safe_load(channel.metadata['offered_qos_profiles'])
    assert profile['durability'] == 'transient_local'
    assert profile['reliability'] == 'reliable'
    assert '*' not in channel.metadata['offered_qos_profiles']  # yaml-cpp reads no aliases there
    assert '*' not in (bag.path / 'metadata.yaml').read_text()


@pytest.mark.parametrize('message_type', TYPES)
def test_definitions_and_hashes_are_those_of_an_independent_typestore(message_type):
    from rosbags.typesys import get_types_from_msg
    parsed = get_types_from_msg(definition(message_type), message_type)
    for name, fields in parsed.items():
        assert fields == STORE.fielddefs[name], name
    assert type_hash(message_type) == STORE.hash_rihs01(message_type)


def test_an_existing_bag_is_never_touched(tmp_path):
    (tmp_path / 'run').mkdir()
    (tmp_path / 'run' / 'precious').write_text('data')
    second = BagWriter(new_directory(tmp_path, 'run'))
    third = BagWriter(new_directory(tmp_path, 'run'))
    second.close()
    third.close()
    assert [path.name for path in sorted(tmp_path.iterdir())] == ['run', 'run_2', 'run_3']
    assert (tmp_path / 'run_3' / 'run_3_0.mcap').is_file()
    assert (tmp_path / 'run' / 'precious').read_text() == 'data'


def test_what_was_flushed_survives_a_writer_that_was_killed(bag):
    bag.write(joint_records(10))
    bag.flush()
    content = (bag.path / 'run_0.mcap').read_bytes()  # nothing was closed
    messages = NonSeekingReader(io.BytesIO(content)).iter_messages(log_time_order=False)
    assert len(list(islice(messages, 10))) == 10
    with pytest.raises(EndOfFile):
        next(messages)
    bag.close()


def test_an_empty_log_is_a_whole_file(bag):
    bag.flush()
    bag.close()
    assert read_all(bag.path) == []
    assert topics_of(bag.path) == {}


def test_a_log_is_split_by_message_time_and_read_in_order(tmp_path):
    bag = BagWriter(new_directory(tmp_path, 'run'), split_s=1.0)
    for second in range(3):
        bag.write(joint_records(1001, start=START + 2 * second * 10**9))
        bag.flush()
    bag.close()
    names = [path.name for path in bag_files(bag.path)]
    assert names == ['run_0.mcap', 'run_1.mcap', 'run_2.mcap', 'run_3.mcap']
    times = [time for _, time, _ in read_all(bag.path)]
    assert len(times) == 3003
    assert times == sorted(times)
    with AnyReader([bag.path]) as reader:
        assert reader.message_count == 3003


def test_a_log_is_split_by_size(tmp_path):
    bag = BagWriter(new_directory(tmp_path, 'run'), split_mib=0.01)
    for _ in range(3):
        bag.write(joint_records(2000))
        bag.flush()
    bag.close()
    assert len(bag_files(bag.path)) == 4


def test_every_file_of_a_split_log_says_what_it_rests_on(tmp_path):
    bag = BagWriter(new_directory(tmp_path, 'run'), split_s=1.0)
    bag.write(string_records())
    bag.write(string_records(start=START + 7))  # the last one counts
    for second in range(3):
        bag.write(joint_records(1001, start=START + (100 + 2 * second) * 10**9))
        bag.flush()
    assert bag.written == 3005
    bag.close()
    assert bag.written == 3005
    files = bag_files(bag.path)
    models = [[time for topic, time, _ in read_all(file) if topic == '/rotorsoil/fan/model']
              for file in files]
    # An old stamp does not make a file look as if it spanned more than a second.
    assert models == [[START, START + 7], [START + 7], [START + 7], [START + 7]]
    said = yaml.safe_load((bag.path / 'metadata.yaml').read_text())['rosbag2_bagfile_information']
    assert said['message_count'] == 3008 == len(read_all(bag.path))
    assert [file['message_count'] for file in said['files']] == [1003, 1002, 1002, 1]
    with AnyReader([bag.path]) as reader:
        assert reader.message_count == 3008


@pytest.mark.parametrize('compression', [None, CompressionMode.STORAGE])
def test_bags_of_another_writer_are_read(tmp_path, compression):
    writer = ForeignWriter(tmp_path / 'foreign', version=9, storage_plugin=StoragePlugin.MCAP)
    if compression:
        writer.set_compression(compression, CompressionFormat.ZSTD)
    records = float_records(50)
    with writer:
        connection = writer.add_connection(records.topic, FLOAT64, typestore=STORE)
        for time, payload in zip(records.log_time_ns, records.payloads, strict=True):
            writer.write(connection, time, payload)
    assert topics_of(tmp_path / 'foreign') == {records.topic: (FLOAT64, 50)}
    assert [time for _, time, _ in read_all(tmp_path / 'foreign')] == records.log_time_ns


def test_batches_are_of_one_topic_and_not_too_long(bag):
    bag.write(joint_records(50))
    bag.write(float_records(30))
    bag.close()
    batches = list(bag_reader.batches(bag.path, lambda *_: True, at_most=20))
    assert [(batch.topic, len(batch.payloads)) for batch in batches] == [
        ('/fan/joint_states', 20), ('/fan/rotor/speed', 20), ('/fan/joint_states', 20),
        ('/fan/rotor/speed', 10), ('/fan/joint_states', 10)]


@pytest.fixture
def small(tmp_path):
    path = tmp_path / 'small.mcap'
    with LogFile(path) as log:
        log.write(joint_records(3))
    return path


@pytest.mark.parametrize('content, complaint', [
    (b'', 'is not an MCAP file'), (b'not mcap at all', 'is not an MCAP file'),
    (b'\x28\xb5\x2f\xfd' + bytes(50), 'is compressed as a whole'),
    (b'\x89MCAP0\r\n', 'was never finished'),
    (b'\x89MCAP0\r\n' + bytes(50), 'was never finished.*where nothing is')])
def test_a_foreign_file_is_refused(tmp_path, content, complaint):
    path = tmp_path / 'profile.mcap'
    path.write_bytes(content)
    with pytest.raises(InputError, match=f'profile.mcap: {complaint}'):
        bag_reader.sources(path)


@pytest.mark.parametrize('lost', [1, 30, 300, 1000])
def test_an_unfinished_file_is_read_up_to_its_break_and_that_is_told(small, lost):
    whole, told = read_all(small), []
    content = small.read_bytes()
    small.write_bytes(content[:max(60, len(content) - lost)])
    assert read_all(small, tell=told.append) in (whole, [])
    assert told == [f'{small}: was never finished; it is read up to its break']


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=150)
@given(data=some.data())
def test_a_damaged_file_is_read_right_or_refused(small, data):
    content = bytearray(small.read_bytes())
    intact = read_all(small)
    at = data.draw(some.integers(8, len(content) - 9))
    content[at] ^= data.draw(some.integers(1, 255))
    damaged = small.with_name('damaged.mcap')
    damaged.write_bytes(content)
    with suppress(InputError):
        # Chunks have checksums; what stands outside of them cannot change a message.
        assert set(read_all(damaged)) <= set(intact)


def test_a_directory_without_mcap_is_refused(tmp_path):
    with pytest.raises(InputError, match='holds no MCAP file'):
        bag_files(tmp_path)
    with pytest.raises(InputError, match='no such file or bag directory'):
        bag_files(tmp_path / 'nowhere')
    (tmp_path / 'metadata.yaml').write_text('rosbag2_bagfile_information: 3')
    with pytest.raises(InputError, match='is not the metadata of a bag'):
        bag_files(tmp_path)


def test_metadata_cannot_lead_out_of_the_bag(bag, tmp_path):
    bag.write(float_records(1))
    bag.close()
    text = (bag.path / 'metadata.yaml').read_text()
    (bag.path / 'metadata.yaml').write_text(text.replace('run_0.mcap', '../../run_0.mcap'))
    assert bag_files(bag.path) == [bag.path / 'run_0.mcap']
