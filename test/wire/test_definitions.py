"""Every type reads and writes as rclpy has it, though neither it nor a package is needed."""

from importlib import import_module
from pathlib import Path
import re

from hypothesis import given, strategies as some
import numpy as np
import pytest
from rclpy.serialization import deserialize_message, serialize_message
from rosbags.typesys import get_typestore, Stores

from rotorsoil_ros.wire.cdr import encode, Layout
from rotorsoil_ros.wire.definitions import _source, _with_parts, type_hash, TYPE_HASHES
from rotorsoil_ros.wire.messages import FAILURE, INFO, WARNING

TYPES = sorted(TYPE_HASHES)
STORE = get_typestore(Stores.ROS2_JAZZY)
WORDS = some.text(some.characters(exclude_characters='\0', exclude_categories=['Cs']), max_size=9)
NUMBERS = {
    'double': some.floats(), 'int32': some.integers(-2**31, 2**31 - 1),
    'uint32': some.integers(0, 2**32 - 1), 'uint8': some.integers(0, 255),
    'octet': some.integers(0, 255)}


def message_class(name):
    package, *_, kind = name.split('/')
    return getattr(import_module(f'{package}.msg'), kind)


def values_of(kind):
    """Return a strategy for what rclpy says that a field holds."""
    if kind == 'string':
        return WORDS
    if kind in NUMBERS:
        return NUMBERS[kind]
    if found := re.fullmatch(r'sequence<(.+)>', kind):
        return some.lists(values_of(found[1]), max_size=3)
    if found := re.fullmatch(r'(.+)\[(\d+)\]', kind):
        return some.lists(values_of(found[1]), min_size=int(found[2]), max_size=int(found[2]))
    fields = message_class(kind).get_fields_and_field_types()
    return some.fixed_dictionaries({name: values_of(part) for name, part in fields.items()})


def message_of(kind, values):
    """Return the message of rclpy that says the same."""
    if kind == 'octet':
        return bytes([values])
    if kind == 'string' or kind in NUMBERS:
        return values
    if found := re.fullmatch(r'sequence<(.+)>|(.+)\[\d+\]', kind):
        return [message_of(found[1] or found[2], value) for value in values]
    cls = message_class(kind)
    fields = cls.get_fields_and_field_types()
    return cls(**{name: message_of(fields[name], value) for name, value in values.items()})


def flat(values, path=''):
    """Yield path and value of every number and string, vectors and arrays at once."""
    if isinstance(values, dict):
        if values.keys() in ({'x', 'y', 'z'}, {'x', 'y', 'z', 'w'}):
            yield path, [values[axis] for axis in 'xyzw' if axis in values]
            return
        for name, value in values.items():
            yield from flat(value, f'{path}.{name}' if path else name)
    elif isinstance(values, list) and values and isinstance(values[0], dict):
        for number, value in enumerate(values):
            yield from flat(value, f'{path}[{number}]')
    else:
        yield path, values


def padding_cleared(layout, cdr):
    clean = bytearray(layout.size)
    spans = [at for at, _ in layout.fixed] + [layout.span(path) for path in layout.dtype.names]
    for at in spans:
        clean[at] = cdr[at]
    return bytes(clean)


def assert_says(layout, cdr, values):
    row, = layout.rows([cdr])
    for path, value in flat(values):
        if path in layout.texts:
            assert list(layout.texts[path]) == ([value] if isinstance(value, str) else value)
        elif path in layout.dtype.names:
            np.testing.assert_array_equal(row[path], value)
        else:
            assert value == []  # of compounds


@pytest.mark.parametrize('kind', TYPES)
@given(draw=some.data())
def test_what_is_written_is_byte_for_byte_what_rclpy_writes(kind, draw):
    values = draw.draw(values_of(kind))
    message = message_of(kind, values)
    ours, theirs = encode(kind, values), serialize_message(message)
    layout = Layout.of(kind, ours)
    assert padding_cleared(layout, ours) == ours
    # Where an array is empty, rclpy appends some stray bytes.
    assert padding_cleared(layout, theirs[:len(ours)]) == ours
    again = serialize_message(deserialize_message(ours, type(message)))
    assert padding_cleared(layout, again[:len(ours)]) == ours


@pytest.mark.parametrize('kind', TYPES)
@given(draw=some.data())
def test_what_rclpy_writes_is_read(kind, draw):
    values = draw.draw(values_of(kind))
    cdr = serialize_message(message_of(kind, values))
    assert_says(Layout.of(kind, cdr), cdr, values)


@pytest.mark.parametrize('kind', TYPES)
@given(draw=some.data())
def test_what_an_independent_writer_says_in_big_endian_is_read(kind, draw):
    values = draw.draw(values_of(kind))
    foreign = STORE.deserialize_cdr(encode(kind, values), kind)
    cdr = bytes(STORE.serialize_cdr(foreign, kind, little_endian=False))
    layout = Layout.of(kind, cdr)
    assert layout.order == '>'
    assert_says(layout, cdr, values)


@pytest.mark.parametrize('kind', TYPES)
def test_a_message_of_which_nothing_is_said_is_a_new_one(kind):
    blank = encode(kind, {})
    assert deserialize_message(blank, message_class(kind)) == message_class(kind)()


def test_a_field_that_there_is_not_is_refused():
    with pytest.raises(ValueError, match=r'has the fields data, got date'):
        encode('std_msgs/msg/String', {'date': 'today'})
    with pytest.raises(ValueError, match='needs 9 values, got 3'):
        encode('sensor_msgs/msg/Imu', {'orientation_covariance': [-1.0, 0.0, 0.0]})


@pytest.mark.parametrize('kind', TYPES)
def test_definitions_are_those_that_the_packages_install(kind):
    package = import_module(f'{kind.split("/")[0]}.msg')
    share = next(above / 'share' for above in Path(package.__file__).parents
                 if (above / 'share' / 'std_msgs').is_dir())
    for part in _with_parts(kind):
        assert _source(part) == (share / f'{part}.msg').read_text()
    assert type_hash(kind) in (share / f'{kind}.json').read_text()


def test_severities_are_those_of_the_log_message():
    log = message_class('rcl_interfaces/Log')
    assert (log.INFO, log.WARN, log.ERROR) == (INFO, WARNING, FAILURE)
