"""Messages of an edge node are those that Sparkplug B 3.0 asks for, byte by byte."""

import math

import pytest

from rotorsoil_ros.feeds.points import Point, Quality, unit_of
from rotorsoil_ros.feeds.sparkplug import asks_for_rebirth, EdgeNode, names_of, parse

NOW_MS = 1_700_000_000_123

# What pysparkplug 0.6.1 writes, whose schema protoc has made of that of Eclipse Tahu:
# NCmd(timestamp=1, metrics=(Metric(1, 'Node Control/Rebirth', DataType.BOOLEAN, value=True),)),
REBIRTH = bytes.fromhex(
    '0801121c0a144e6f646520436f6e74726f6c2f526562697274681801200b7001')
# and its protobuf classes, of a payload with everything that we use of the schema.
PAYLOAD = bytes.fromhex(
    '08fbd095ffbc311292010a15615f686f7573696e675f782f416d706c697475646518d836200a4a6b0a07517561'
    '6c6974790a07656e67556e69740a0d646f63756d656e746174696f6e1205080318c001120b080c4207c2b56d20'
    '702d701234080c423070726564696374656420646973706c6163656d656e742c206d6963726f6d657472652c20'
    '7065616b2d746f2d7065616b690000000000000440126d0a18615f686f7573696e675f782f4d65617375726564'
    '5a6f6e6518d836200c4a490a075175616c6974790a0d646f63756d656e746174696f6e1205080318c001122808'
    '0c42247a6f6e6520412c20422c2043206f722044206f6620746865206d6561737572656d656e747a014212d201'
    '0a11615f686f7573696e675f782f506861736518d836200a38014ab5010a075175616c6974790a06526561736f'
    '6e0a07656e67556e69740a06656e674c6f770a07656e67486967680a0d646f63756d656e746174696f6e120508'
    '0318f403122c080c4228746865206c617374206f6e65206b6e6f776e3a206e6f7468696e67206e657720686173'
    '20636f6d651206080c4202c2b0120b080a310000000000000000120b080a3100000000008076401222080c421e'
    '7072656469637465642070686173652c20646567726565206f66206c61671801')


def point(value, *, quality=Quality.GOOD, channel='a_housing_x', quantity='Amplitude', stamp=7):
    return Point('fan', channel, quantity, value, unit_of(channel, quantity, plant=True), quality,
                 quality.value, stamp * 10**9)


def test_bytes_are_those_of_another_implementation():
    edge = EdgeNode('plant', 'hall', bd_seq=3)
    edge.birth(NOW_MS)
    got = edge.device_birth('fan', [
        point(2.5), point('B', quantity='MeasuredZone'),
        point(None, quantity='Phase', quality=Quality.STALE)], NOW_MS)
    assert got.topic == 'spBv1.0/plant/DBIRTH/hall/fan'
    assert got.payload == PAYLOAD


def test_machine_of_a_plant_is_a_device_whose_name_a_topic_can_have():
    edge = EdgeNode('site', 'hall')
    assert edge.device_death('house/fan', NOW_MS).topic == 'spBv1.0/site/DDEATH/hall/house:fan'


def test_births_and_deaths_of_a_node_carry_the_number_of_the_connection():
    edge = EdgeNode('plant', 'hall', bd_seq=255)
    for number in (255, 0, 1):
        death, birth = parse(edge.death(NOW_MS).payload), parse(edge.birth(NOW_MS).payload)
        assert [(metric.name, metric.long_value) for metric in death.metrics] == [
            ('bdSeq', number)]
        assert not death.HasField('seq')
        told = {metric.name: metric for metric in birth.metrics}
        assert (told['bdSeq'].long_value, told['bdSeq'].datatype) == (number, 4)
        assert told['Node Control/Rebirth'].boolean_value is False
        assert birth.seq == 0
        edge.connect_again()


def test_messages_are_numbered_from_the_birth_on_and_after_255_from_nothing_again():
    edge = EdgeNode('plant', 'hall')
    seen = [parse(edge.birth(NOW_MS).payload).seq]
    for _ in range(300):
        seen.append(parse(edge.device_data('fan', [point(1.0)], NOW_MS).payload).seq)
    seen.append(parse(edge.device_death('fan', NOW_MS).payload).seq)
    assert seen == [number % 256 for number in range(302)]
    assert parse(edge.birth(NOW_MS).payload).seq == 0


@pytest.mark.parametrize('given, value, code', [
    (point(2.5), 2.5, 192), (point(2.5, quality=Quality.STALE), 2.5, 500),
    (point(None, quality=Quality.OUT_OF_TABLE), None, 0),
    (point(0.0), 0.0, 192)])
def test_what_cannot_be_trusted_says_so(given, value, code):
    metric, = parse(EdgeNode('g', 'n').device_data('fan', [given], NOW_MS).payload).metrics
    told = dict(zip(metric.properties.keys, metric.properties.values, strict=True))
    assert told['Quality'].int_value == code
    assert ('Reason' in told) == bool(given.reason)
    assert metric.is_null == (value is None)
    assert (metric.double_value if metric.HasField('double_value') else None) == value
    assert metric.timestamp == 7000


def test_a_birth_tells_units_and_ranges_once():
    edge = EdgeNode('g', 'n')
    given = point(90.0, quantity='Phase')
    for message, count in ((edge.device_birth('fan', [given], NOW_MS), 5),
                           (edge.device_data('fan', [given], NOW_MS), 1)):
        metric, = parse(message.payload).metrics
        told = dict(zip(metric.properties.keys, metric.properties.values, strict=True))
        assert len(told) == count
    metric, = parse(edge.device_birth('fan', [given], NOW_MS).payload).metrics
    told = dict(zip(metric.properties.keys, metric.properties.values, strict=True))
    assert told['engUnit'].string_value == '°'
    assert (told['engLow'].double_value, told['engHigh'].double_value) == (0.0, 360.0)
    assert told['documentation'].string_value == 'predicted phase, degree of lag'
    assert not math.isnan(metric.double_value)


@pytest.mark.parametrize('payload, asked', [
    (REBIRTH, True), (b'', False), (b'\xff' * 40, False),
    (EdgeNode('g', 'n').birth(NOW_MS).payload, False)])
def test_only_a_command_asks_for_a_rebirth(payload, asked):
    assert asks_for_rebirth(payload) is asked


@pytest.mark.parametrize('name', ['', 'a/b', 'a+', '#'])
def test_names_that_topics_cannot_have_are_refused(name):
    assert names_of(['good', name]).startswith('must not be empty nor hold +, / or #')
    assert names_of(['good']) == ''
