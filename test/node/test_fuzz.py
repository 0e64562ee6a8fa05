"""Whatever bytes come in, none of them raises, hangs, fills the memory or changes a number."""

from contextlib import suppress
from dataclasses import replace
import io
import math
import struct

from geometry_msgs.msg import Vector3
from hypothesis import given, HealthCheck, settings, strategies as some
from mcap.data_stream import RecordBuilder
from mcap.records import Chunk, Header
import numpy as np
import pytest
from rclpy.serialization import serialize_message
from sensor_msgs.msg import Imu, JointState
import zstandard

from rotorsoil_ros.bags import reader as bag_reader
from rotorsoil_ros.bags.recover import recover
from rotorsoil_ros.channel import Channel
from rotorsoil_ros.errors import InputError
from rotorsoil_ros.events import LAST_STAMP, Measured, Predicted, Samples
from rotorsoil_ros.machine.spread import SoilSpread
from rotorsoil_ros.monitor.criteria import criteria
from rotorsoil_ros.monitor.monitor import Monitor
from rotorsoil_ros.wire.handlers import inlet, TOPICS
from rotorsoil_ros.wire.messages import Encoder, Topics
from rotorsoil_ros.wire.sensors import JointStateReader

from records import topics_of

DISC = Channel('disc_1', '', 'x')
MANY = settings(max_examples=400, suppress_health_check=[HealthCheck.function_scoped_fixture])
SOME = settings(max_examples=100, suppress_health_check=[HealthCheck.function_scoped_fixture])
MAGIC = b'\x89MCAP0\r\n'


def message():
    return serialize_message(JointState(
        name=['gear', 'rotor'], position=[0.0, 1.0], velocity=[5.0, 300.0], effort=[0.0, 2.0]))


def sample():
    return serialize_message(Imu(linear_acceleration=Vector3(x=1.0, y=2.0, z=9.81)))


@pytest.fixture(scope='module')
def inlets(machine):
    """Return inlets of a machine for every topic, and what comes out of them."""
    events = []
    monitor = Monitor('m', machine.table, machine.case.unbalance, sinks=[events.append])
    return [inlet(name, f'/m/{name}', monitor, log=events.append)
            for name in (*TOPICS, 'measured/disc_1_x/imu')], events


@pytest.fixture(scope='module')
def basis(machine, cache):
    case = replace(machine.case, uncertainty=SoilSpread(samples=3))
    found = criteria(case, machine.model, case.unbalance, cache)
    return lambda: found  # whose repr is short: hypothesis prints it


def is_sane(events, machine):
    low, high = machine.table.speed_range
    for event in events:
        if isinstance(event, Predicted):
            speed = event.prediction.speed
            answered = np.isfinite(event.prediction.displacement).all(axis=1)
            assert answered.tolist() == ((speed >= low) & (speed <= high)).tolist()
            assert ((event.stamp_ns >= 0) & (event.stamp_ns <= LAST_STAMP)).all()
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
@given(at=some.integers(0, 320), value=some.integers(0, 2**32 - 1), cut=some.integers(0, 400))
def test_a_sample_with_a_few_bytes_changed_is_taken_or_counted(inlets, machine, at, value, cut):
    taken_in, events = inlets
    content = bytearray(sample())
    content[at:at + 4] = struct.pack('<I', value)
    for take in taken_in:
        take((0,), (bytes(content[:len(content) - cut] if cut < 330 else content),))
    is_sane(events, machine)


STAMPS = some.one_of(some.integers(0, LAST_STAMP), some.integers(0, 3 * 10**9))
NUMBERS = some.one_of(some.floats(), some.floats(-1e-3, 1e-3), some.floats(0.0, 1000.0))
CHANNELS = some.sampled_from(['disc_1_x', 'bearing_1_housing_z', 'block_rx', 'nobody', ''])
STEPS = some.lists(max_size=30, elements=some.one_of(
    some.tuples(some.just('speed'), STAMPS, NUMBERS, NUMBERS),
    some.tuples(some.sampled_from(['amplitude', 'phase']), STAMPS, CHANNELS, NUMBERS, NUMBERS),
    some.tuples(some.just('samples'), STAMPS, some.integers(1, 300), NUMBERS),
    some.tuples(some.just('tick'), STAMPS)))


@MANY
@given(steps=STEPS)
def test_whatever_is_measured_in_whatever_order_is_judged_without_a_traceback(
        machine, basis, steps):
    events = []
    monitor = Monitor('m', machine.table, machine.case.unbalance, sinks=[events.append])
    monitor.judge.take_criteria(basis())
    encoder = Encoder('m', machine.table.channels, Topics.of('', 'm'))
    for kind, stamp, *rest in steps:
        at = np.array([stamp])
        if kind == 'speed':
            monitor.on_speed(at, np.array(rest[:1]), np.array(rest[1:]))
        elif kind == 'samples':
            count, value = rest
            stamps = np.minimum(stamp + 10**6 * np.arange(count), LAST_STAMP)
            monitor.on_samples(Samples('m', DISC, stamps, np.full(count, value)))
        elif kind == 'tick':
            monitor.tick(stamp, stale_after_s=3.0)
        else:
            channel, *values = rest
            one, other = (np.array([[value]]) for value in values)
            monitor.on_measured(Measured('m', kind, at, (Channel.parse(channel),), one, other))
    monitor.tick(LAST_STAMP, stale_after_s=3.0)
    assert sum(len(list(encoder.encode(event))) for event in events)
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
        topics_of(path)
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
