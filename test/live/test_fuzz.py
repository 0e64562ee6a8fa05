"""Whatever bytes come in, none of them raises, hangs, fills the memory or changes a number."""

from contextlib import suppress
import io
import math
import struct

from hypothesis import given, HealthCheck, settings, strategies as some
from mcap.data_stream import RecordBuilder
from mcap.records import Chunk, Header
import numpy as np
import pytest
from rclpy.serialization import serialize_message
from sensor_msgs.msg import JointState
import zstandard

from rotorsoil_ros.live import bag_reader
from rotorsoil_ros.live.cdr import JointStateReader
from rotorsoil_ros.live.events import Predicted
from rotorsoil_ros.live.inlets import inlet, TOPICS
from rotorsoil_ros.live.monitor import Monitor
from rotorsoil_ros.live.recover import recover
from rotorsoil_ros.physics.errors import InputError

MANY = settings(max_examples=400, suppress_health_check=[HealthCheck.function_scoped_fixture])
SOME = settings(max_examples=100, suppress_health_check=[HealthCheck.function_scoped_fixture])
MAGIC = b'\x89MCAP0\r\n'


def message():
    return serialize_message(JointState(
        name=['gear', 'rotor'], position=[0.0, 1.0], velocity=[5.0, 300.0], effort=[0.0, 2.0]))


@pytest.fixture(scope='module')
def inlets(machine):
    """Return inlets of a machine for every topic, and what comes out of them."""
    events = []
    monitor = Monitor('m', machine.table, machine.case.unbalance, sinks=[events.append])
    return [inlet(name, f'/m/{name}', monitor, rotor_joint='rotor', log=events.append)
            for name in TOPICS], events


def is_sane(events, machine):
    low, high = machine.table.speed_range
    for event in events:
        if isinstance(event, Predicted):
            speed = event.prediction.speed
            answered = np.isfinite(event.prediction.displacement).all(axis=1)
            assert answered.tolist() == ((speed >= low) & (speed <= high)).tolist()
            assert (event.stamp_ns >= 0).all()
    events.clear()


@MANY
@given(content=some.binary(max_size=300))
def test_any_bytes_are_answered_or_counted(inlets, machine, content):
    taken_in, events = inlets
    for take in taken_in:
        take((0,), (content,))
    is_sane(events, machine)


@MANY
@given(at=some.integers(0, 167), value=some.integers(0, 2**32 - 1), cut=some.integers(0, 200))
def test_a_message_with_a_few_bytes_changed_is_answered_or_counted(
        inlets, machine, at, value, cut):
    taken_in, events = inlets
    content = bytearray(message())
    content[at:at + 4] = struct.pack('<I', value)
    for take in taken_in:
        take((0,), (bytes(content[:len(content) - cut] if cut < 50 else content),))
    is_sane(events, machine)


@MANY
@given(count=some.integers(1000, 2**32 - 1), where=some.sampled_from([12, 20]))
def test_a_count_that_promises_gigabytes_costs_nothing(count, where):
    content = bytearray(message())
    content[where:where + 4] = struct.pack('<I', count)
    assert JointStateReader().layout(bytes(content)) is None


@SOME
@given(content=some.binary(max_size=400))
def test_any_bytes_behind_the_magic_are_refused_in_one_line(tmp_path, content):
    path, out = tmp_path / 'fuzz.mcap', tmp_path / 'out.mcap'
    path.write_bytes(MAGIC + content + MAGIC)
    with pytest.raises(InputError) as caught:
        bag_reader.topics(path)
    assert '\n' not in str(caught.value)
    with suppress(InputError):
        list(bag_reader.messages(path, lambda *_: True))
    out.unlink(missing_ok=True)
    assert recover(path, out).messages == 0


def record(thing):
    builder = RecordBuilder()
    thing.write(builder)
    return bytes(builder.end())


@pytest.mark.parametrize('compression, said, data', [
    ('zstd', 100, zstandard.compress(bytes(1 << 24))),
    ('zstd', 1 << 40, zstandard.compress(bytes(100))),
    ('zstd', 100, b'\x28\xb5\x2f\xfd\xe0' + b'\xff' * 7 + b'\x7f' + bytes(20)),
    ('lz4', 100, b'\x04\x22\x4d\x18'), ('brotli', 3, b'abc'), ('', 1 << 30, b'abc')])
def test_a_bomb_in_a_chunk_is_refused_before_it_takes_memory(tmp_path, compression, said, data):
    path = tmp_path / 'bomb.mcap'
    chunk = Chunk(compression=compression, data=data, message_start_time=0, message_end_time=0,
                  uncompressed_crc=0, uncompressed_size=said)
    path.write_bytes(MAGIC + record(Header('', '')) + record(chunk) + MAGIC)
    with pytest.raises(InputError, match='is damaged'):
        list(bag_reader.messages(path, lambda *_: True))
    saved = recover(path, tmp_path / 'out.mcap')
    assert (saved.messages, saved.damaged_chunks) == (0, 1)
    assert not math.isnan(saved.last_ns)
    assert io.BytesIO(path.read_bytes()).read(8) == MAGIC
