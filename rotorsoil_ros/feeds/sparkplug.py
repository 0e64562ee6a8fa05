"""
Messages of an edge node of Sparkplug B 3.0: births, data and deaths, numbered as they must be.

What carries them is not known here. The schema is the part of Eclipse Tahu's `sparkplug_b.proto`
that an edge node needs, by the field numbers of the specification, chapter 6.4; `protobuf`
encodes it.
"""

from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from google.protobuf.message import DecodeError

import rotorsoil_ros
from rotorsoil_ros.feeds.points import OF_CHANNEL, OF_MACHINE, Point, Quality

NAMESPACE_B = 'spBv1.0'
REBIRTH, BD_SEQ = 'Node Control/Rebirth', 'bdSeq'
SEQUENCE_LENGTH = 256  # numbers begin again after 255
NS_IN_MS = 1_000_000

# Datatypes and codes of quality, chapter 6.4.16 and 6.4.8.
INT32, INT64, DOUBLE, BOOLEAN, WORDS_TYPE = 3, 4, 10, 11, 12
GOOD_CODE, STALE_CODE, BAD_CODE = 192, 500, 0

# Of our own, as others may know the same schema.
_POOL = descriptor_pool.DescriptorPool()
_SCHEMA = {
    'Payload': ['timestamp 1 uint64', 'metrics 2 *Metric', 'seq 3 uint64', 'uuid 4 string',
                'body 5 bytes'],
    'Metric': ['name 1 string', 'alias 2 uint64', 'timestamp 3 uint64', 'datatype 4 uint32',
               'is_historical 5 bool', 'is_transient 6 bool', 'is_null 7 bool',
               'properties 9 PropertySet', 'int_value 10 |uint32', 'long_value 11 |uint64',
               'float_value 12 |float', 'double_value 13 |double', 'boolean_value 14 |bool',
               'string_value 15 |string', 'bytes_value 16 |bytes'],
    'PropertySet': ['keys 1 *string', 'values 2 *PropertyValue'],
    'PropertyValue': ['type 1 uint32', 'is_null 2 bool', 'int_value 3 |uint32',
                      'long_value 4 |uint64', 'float_value 5 |float', 'double_value 6 |double',
                      'boolean_value 7 |bool', 'string_value 8 |string']}


class Message(NamedTuple):
    """A topic and the bytes that go there."""

    topic: str
    payload: bytes


class EdgeNode:
    """
    Numbers and words the messages of one edge node.

    Parameters
    ----------
    group, node : str
        How it is called.
    bd_seq : int
        Of its first connection; the next ones count on.

    """

    def __init__(self, group: str, node: str, *, bd_seq: int = 0) -> None:
        self.group, self.node = group, node
        self.bd_seq = bd_seq % SEQUENCE_LENGTH
        self._seq = 0

    def command_topic(self) -> str:
        """Return where it is told what to do."""
        return self._topic('NCMD')

    def connect_again(self) -> None:
        """Count one more connection: its birth and its death carry the next number."""
        self.bd_seq = (self.bd_seq + 1) % SEQUENCE_LENGTH

    def death(self, now_ms: int) -> Message:
        """Return what says that the connection has ended, which is its will as well."""
        payload = _payload(now_ms)
        self._number(payload, now_ms)
        return Message(self._topic('NDEATH'), payload.SerializeToString())

    def birth(self, now_ms: int) -> Message:
        """Return what says that it is there; numbers of messages begin with it."""
        self._seq = 0
        payload = _payload(now_ms, seq=self._next())
        self._number(payload, now_ms)
        payload.metrics.add(name=REBIRTH, timestamp=now_ms, datatype=BOOLEAN, boolean_value=False)
        payload.metrics.add(name='Properties/Version', timestamp=now_ms, datatype=WORDS_TYPE,
                            string_value=rotorsoil_ros.__version__)
        return Message(self._topic('NBIRTH'), payload.SerializeToString())

    def device_birth(self, device: str, points: Iterable[Point], now_ms: int) -> Message:
        """Return what says that a machine is there, with everything that is told of it."""
        return self._device('DBIRTH', device, points, now_ms, is_birth=True)

    def device_data(self, device: str, points: Iterable[Point], now_ms: int) -> Message:
        """Return what has changed of a machine."""
        return self._device('DDATA', device, points, now_ms, is_birth=False)

    def device_death(self, device: str, now_ms: int) -> Message:
        """Return what says that nothing is known of a machine any more."""
        payload = _payload(now_ms, seq=self._next())
        return Message(self._topic('DDEATH', device), payload.SerializeToString())

    def _device(
        self, kind: str, device: str, points: Iterable[Point], now_ms: int, *, is_birth: bool,
    ) -> Message:
        payload = _payload(now_ms, seq=self._next())
        for point in points:
            _add(payload, point, now_ms, is_birth=is_birth)
        return Message(self._topic(kind, device), payload.SerializeToString())

    def _number(self, payload: Any, now_ms: int) -> None:
        payload.metrics.add(
            name=BD_SEQ, timestamp=now_ms, datatype=INT64, long_value=self.bd_seq)

    def _next(self) -> int:
        number, self._seq = self._seq, (self._seq + 1) % SEQUENCE_LENGTH
        return number

    def _topic(self, kind: str, *device: str) -> str:
        # What a name of Sparkplug must not hold stands between a plant and its machine.
        return '/'.join((NAMESPACE_B, self.group, kind, self.node,
                         *(name.replace('/', ':') for name in device)))


def asks_for_rebirth(payload: bytes) -> bool:
    """Return whether a command wants every birth again; of no command it does not."""
    try:
        metrics = parse(payload).metrics
    except DecodeError:
        return False
    return any(metric.name == REBIRTH and metric.boolean_value for metric in metrics)


def parse(payload: bytes) -> Any:
    """Return a payload as its message."""
    return _PAYLOAD.FromString(payload)


def metric_of(point: Point) -> str:
    """Return how a value is called."""
    return f'{point.channel}/{point.quantity}' if point.channel else point.quantity


def _payload(now_ms: int, **given: int) -> Any:
    return _PAYLOAD(timestamp=now_ms, **given)


def _add(payload: Any, point: Point, now_ms: int, *, is_birth: bool) -> None:
    """Add a value to a payload, with its unit and its range when it is introduced."""
    stamp_ms = point.stamp_ns // NS_IN_MS or now_ms
    metric = payload.metrics.add(name=metric_of(point), timestamp=stamp_ms,
                                 datatype=WORDS_TYPE if point.unit is None else DOUBLE)
    if point.value is None:
        metric.is_null = True
    elif isinstance(point.value, str):
        metric.string_value = point.value
    else:
        metric.double_value = point.value
    code = BAD_CODE if point.quality.is_bad else (
        GOOD_CODE if point.quality is Quality.GOOD else STALE_CODE)
    _property(metric, 'Quality', INT32, int_value=code)
    if point.reason:
        _property(metric, 'Reason', WORDS_TYPE, string_value=point.reason)
    if not is_birth:
        return
    says = (OF_CHANNEL if point.channel else OF_MACHINE)[point.quantity].says
    if point.unit is not None:
        _property(metric, 'engUnit', WORDS_TYPE, string_value=point.unit.symbol)
        says = f'{says}, {point.unit.says}'
        if point.unit.range is not None:
            low, high = point.unit.range
            _property(metric, 'engLow', DOUBLE, double_value=low)
            _property(metric, 'engHigh', DOUBLE, double_value=high)
    _property(metric, 'documentation', WORDS_TYPE, string_value=says)


def _property(metric: Any, key: str, kind: int, **value: object) -> None:
    metric.properties.keys.append(key)
    metric.properties.values.add(type=kind, **value)


def _payload_class(package: str = 'rotorsoil_ros.sparkplug_b') -> Any:
    """Return the class of payloads."""
    described = descriptor_pb2.FileDescriptorProto(
        name='sparkplug_b.proto', package=package, syntax='proto2')
    for name, fields in _SCHEMA.items():
        message = described.message_type.add(name=name)
        if any('|' in field for field in fields):
            message.oneof_decl.add(name='value')
        for field in fields:
            _field(message, *field.split(), package=package)
    _POOL.Add(described)
    return message_factory.GetMessageClass(_POOL.FindMessageTypeByName(f'{package}.Payload'))


def _field(message: Any, name: str, number: str, kind: str, *, package: str) -> None:
    field, plain = descriptor_pb2.FieldDescriptorProto, kind.lstrip('*|')
    added = message.field.add(
        name=name, number=int(number),
        label=field.LABEL_REPEATED if kind[0] == '*' else field.LABEL_OPTIONAL)
    if kind[0] == '|':
        added.oneof_index = 0
    if plain in _SCHEMA:
        added.type, added.type_name = field.TYPE_MESSAGE, f'.{package}.{plain}'
    else:
        added.type = getattr(field, f'TYPE_{plain.upper()}')


_PAYLOAD = _payload_class()


def names_of(parts: Sequence[str]) -> str:
    """Return what is wrong with names of groups and nodes; nothing if they may be used."""
    for part in parts:
        if not part or set(part) & set('+/#'):
            return f'must not be empty nor hold +, / or #, got {part!r}'
    return ''
