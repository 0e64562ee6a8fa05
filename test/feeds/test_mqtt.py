"""An edge node at a real broker: it is born, tells, dies and is born again."""

import json
import logging
import socket
from threading import Event
import time

import pytest

from rotorsoil_ros.channel import Channel
from rotorsoil_ros.errors import InputError
from rotorsoil_ros.feeds import mqtt
from rotorsoil_ros.feeds.mqtt import MqttOutlet, MqttSettings
from rotorsoil_ros.feeds.running import Clocks
from rotorsoil_ros.feeds.sparkplug import parse

from brokers import Broker, certified, Host
from plants import free_port, Plant, RUNNING, Running, until

X = Channel('bearing_1', 'housing', 'x')
FAST_S = 0.05
LIVE = Clocks(time.monotonic_ns, time.time_ns)


@pytest.fixture(autouse=True)
def _impatient(monkeypatch):
    monkeypatch.setattr(mqtt, 'BACK_OFF_S', (0.05,))


@pytest.fixture(scope='module')
def broker(tmp_path_factory):
    broker = Broker(tmp_path_factory.mktemp('broker'), free_port())
    yield broker
    broker.kill()


@pytest.fixture
def plant(machine):
    return Plant(machine)


@pytest.fixture
def host(broker):
    host = Host(broker.port)
    yield host
    host.close()


@pytest.fixture
def start(plant):
    """Return what starts an edge node; it has said goodbye when the test is over."""
    started = []

    def begin(port, **settings):
        settings = {'period_s': FAST_S, 'node': f'hall_{port}_{time.monotonic_ns()}'} | settings
        started.append(Running(MqttOutlet(MqttSettings('127.0.0.1', port, **settings)),
                               plant.board, LIVE))
        return started[-1]

    yield begin
    for each in started:
        each.end()


def numbers_of(host):
    """Return the numbers of the messages since the last birth of the node."""
    with host._lock:
        told = [mqtt_payload for mqtt_payload in host.heard if mqtt_payload[0][2] in (
            'NBIRTH', 'DBIRTH', 'DDATA', 'DDEATH')]
    births = [row for row, (parts, _) in enumerate(told) if parts[2] == 'NBIRTH']
    return [parse(payload).seq for _, payload in told[births[-1]:]]


def test_a_machine_is_born_told_and_dies_with_its_node(broker, host, plant, start):
    plant.turns(1.0, RUNNING)
    edge = start(broker.port)
    host.wait_for('DBIRTH/fan')
    assert host.kinds()[:2] == ['NBIRTH', 'DBIRTH/fan']
    born = host.last('DBIRTH/fan')
    assert born[f'{X}/Amplitude'].double_value == pytest.approx(abs(plant.expected(X, RUNNING)))
    assert len(born) == len(plant.board.machines['fan'].points)
    plant.turns(2.0, RUNNING + 3.0)
    host.wait_for('DDATA/fan')
    told = host.last('DDATA/fan')
    assert told[f'{X}/Amplitude'].double_value == pytest.approx(
        abs(plant.expected(X, RUNNING + 3.0)))
    assert f'{X}/Residual' not in told  # it has not changed
    edge.end()
    host.wait_for('NDEATH')
    assert host.last('NDEATH')['bdSeq'].long_value == host.last('NBIRTH')['bdSeq'].long_value
    assert numbers_of(host) == list(range(len(numbers_of(host))))


def test_what_has_not_changed_is_not_told_again(broker, host, plant, start):
    plant.turns(1.0, RUNNING)
    start(broker.port)
    host.wait_for('DBIRTH/fan')
    for tenth in range(5):
        plant.turns(1.1 + 0.1 * tenth, RUNNING)
    plant.turns(2.0, RUNNING + 3.0)
    host.wait_for('DDATA/fan')
    assert host.kinds().count('DDATA/fan') == 1


def test_a_rebirth_is_given_to_who_asks_and_to_nobody_else(broker, host, start, plant):
    node = f'asked_{time.monotonic_ns()}'
    plant.turns(1.0, RUNNING)
    start(broker.port, node=node)
    host.wait_for('DBIRTH/fan')
    command = b'\x12\x1a\n\x14Node Control/Rebirth \x0bp\x01'
    host.say(f'spBv1.0/rotorsoil/NCMD/{node}', b'\xff\xff')
    host.say(f'spBv1.0/rotorsoil/NCMD/other_{node}', command)
    host.say(f'spBv1.0/rotorsoil/NCMD/{node}', command)
    host.wait_for('NBIRTH', 2)
    host.wait_for('DBIRTH/fan', 2)
    first, second = host.payloads('NBIRTH')
    assert [metric.long_value for metric in first.metrics if metric.name == 'bdSeq'] == [
        metric.long_value for metric in second.metrics if metric.name == 'bdSeq']
    assert numbers_of(host)[:2] == [0, 1]
    assert host.kinds().count('NBIRTH') == 2


def test_a_broker_that_comes_later_and_dies_in_between_is_found_again(
        tmp_path, plant, start, caplog):
    caplog.set_level(logging.WARNING)
    port, state = free_port(), tmp_path / 'number'
    plant.turns(1.0, RUNNING)
    edge = start(port, state=state)
    until(lambda: 'Connection refused; trying again' in caplog.text, 'a complaint')
    broker = Broker(tmp_path, port)
    try:
        until(lambda: 'Sparkplug B at' in caplog.text, 'a connection')
        broker.kill()
        until(lambda: caplog.text.count('trying again') >= 2, 'a complaint')
        plant.turns(2.0, RUNNING + 3.0)
        broker.start()
        host = Host(port)
        host.say('spBv1.0/rotorsoil/NCMD/nobody', b'')
        until(lambda: caplog.text.count('Sparkplug B at') == 2, 'a connection')
        edge.end()
        host.close()
    finally:
        broker.kill()
    told = [record.message for record in caplog.records]
    assert told.count(f'127.0.0.1:{port}: Connection refused; trying again') <= 2
    # Two connections were asked for, and a third would be the next.
    assert state.read_text() == '2\n'


def test_the_will_is_told_when_the_edge_node_is_killed(broker, host, plant):
    plant.turns(1.0, RUNNING)
    outlet = MqttOutlet(MqttSettings('127.0.0.1', broker.port, node='killed', period_s=FAST_S))
    session = mqtt.Session(outlet, mqtt.EdgeNode('rotorsoil', 'killed', bd_seq=7), plant.board,
                           LIVE)
    steps = session.steps(Event())
    until(lambda: next(steps) or session.is_born, 'a birth')
    host.wait_for('DBIRTH/fan')
    session._client.socket().shutdown(socket.SHUT_RDWR)  # as the kernel does of a dead process
    host.wait_for('NDEATH')
    assert host.last('NDEATH')['bdSeq'].long_value == 7
    assert not host.payloads('NDEATH')[0].HasField('seq')


def test_nothing_is_told_before_the_primary_host_is_online_nor_after(broker, host, plant, start):
    plant.turns(1.0, RUNNING)
    name = f'scada_{time.monotonic_ns()}'

    def online(is_online, stamp):
        host.say(f'spBv1.0/STATE/{name}', json.dumps(
            {'online': is_online, 'timestamp': stamp}), retain=True)

    online(False, 1)
    start(broker.port, primary_host=name)
    host.say(f'spBv1.0/STATE/{name}', b'no JSON')
    assert not host.kinds().count('NBIRTH')
    online(True, 5)
    host.wait_for('NBIRTH')
    online(False, 4)  # older than what is known
    plant.turns(2.0, RUNNING + 3.0)
    host.wait_for('DDATA/fan')
    online(False, 6)
    host.wait_for('NDEATH')
    online(True, 7)
    host.wait_for('NBIRTH', 2)
    numbers = [metric.long_value for payload in host.payloads('NBIRTH')
               for metric in payload.metrics if metric.name == 'bdSeq']
    assert numbers[1] == numbers[0] + 1


def test_a_broker_that_never_answers_is_given_up_and_tried_again(
        plant, start, monkeypatch, caplog):
    monkeypatch.setattr(mqtt, 'ANSWER_S', 0.2)
    with socket.create_server(('127.0.0.1', 0)) as deaf:
        edge = start(deaf.getsockname()[1])
        until(lambda: 'the broker does not answer; trying again' in caplog.text, 'a complaint')
        edge.end()
    assert edge.failure is None


def test_a_broker_that_reads_nothing_makes_nothing_grow(plant, monkeypatch):
    outlet = MqttOutlet(MqttSettings('127.0.0.1', 1, period_s=0.001))
    session = mqtt.Session(outlet, mqtt.EdgeNode('g', 'n'), plant.board, LIVE)
    monkeypatch.setattr(session._client, 'connect', lambda *_: None)
    monkeypatch.setattr(session._client, 'want_write', lambda: True)
    monkeypatch.setattr(session, '_turn', lambda: None)
    monkeypatch.setattr(session._client, 'publish', pytest.fail)
    session._is_connected = True
    steps = session.steps(Event())
    for _ in range(100):
        plant.turns(1.0, RUNNING)
        next(steps)
    assert not session.is_born


# Of a certificate that is refused paho leaves the socket to the collector.
@pytest.mark.filterwarnings('ignore::pytest.PytestUnraisableExceptionWarning')
def test_encryption_and_passwords(tmp_path, plant, start, caplog):
    certificate, key = certified(tmp_path, 'broker', 'urn:broker')
    words = tmp_path / 'word'
    words.write_text('secret\n')
    port = free_port()
    broker = Broker(tmp_path, port, tls=(certificate, key), users={'hall': 'secret'})
    try:
        edge = start(port, authority=certificate, user='hall', password_file=words)
        until(lambda: f'Sparkplug B at 127.0.0.1:{port}, encrypted' in caplog.text, 'a birth')
        edge.end()
        words.write_text('wrong')
        refused = start(port, authority=certificate, user='hall', password_file=words)
        until(lambda: not refused.is_alive, 'an end')
        assert isinstance(refused.failure, InputError)
        assert str(refused.failure).startswith(f'--user: 127.0.0.1:{port}: ')
        caplog.clear()
        stranger, _ = certified(tmp_path, 'stranger', 'urn:stranger')
        start(port, authority=stranger, user='hall', password_file=words)
        until(lambda: 'trying again' in caplog.text, 'a complaint')
        assert 'certificate' in caplog.text.lower()
    finally:
        broker.kill()


@pytest.mark.parametrize('given, said', [
    ({'group': 'a/b'}, '--group: must not be empty nor hold'),
    ({'node': ''}, '--edge-node: must not be empty'),
    ({'primary_host': '#'}, '--primary-host: must not'),
    ({'certificate': 'c.pem'}, '--certificate and --key: one needs the other'),
    ({'certificate': 'c.pem', 'key': 'k.pem'}, '--certificate: needs --ca'),
    ({'password_file': 'word'}, '--password-file: needs --user')])
def test_what_cannot_be_meant_is_refused(given, said):
    with pytest.raises(InputError, match=said):
        MqttSettings('127.0.0.1', **given)


def test_files_that_cannot_be_used_are_told_in_one_line(tmp_path):
    other, nowhere = tmp_path / 'other.pem', tmp_path / 'nowhere.pem'
    other.write_text('no certificate\n')
    with pytest.raises(InputError, match=r'other\.pem: must be a certificate in PEM') as told:
        MqttOutlet(MqttSettings('127.0.0.1', authority=other))
    assert '\n' not in str(told.value)
    with pytest.raises(InputError, match=r'nowhere\.pem: No such file or directory'):
        MqttOutlet(MqttSettings('127.0.0.1', authority=nowhere))
    with pytest.raises(OSError, match=r'nowhere\.pem'):
        MqttOutlet(MqttSettings('127.0.0.1', user='hall', password_file=nowhere))


def test_a_number_that_cannot_be_kept_stops_nothing(broker, host, plant, start, tmp_path, caplog):
    plant.turns(1.0, RUNNING)
    edge = start(broker.port, state=tmp_path / 'missing' / 'number')
    host.wait_for('DBIRTH/fan')
    edge.end()
    assert 'No such file or directory' in caplog.text
