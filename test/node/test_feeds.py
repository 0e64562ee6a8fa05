"""Feeds hear the graph as it is: two halls with a fan each, machines that come, nodes that go."""

import asyncio
import os
import signal
import subprocess
import sys

from asyncua import Client, ua
import pytest

from rotorsoil_ros.channel import Channel
from rotorsoil_ros.domain import own_domain
from rotorsoil_ros.feeds.address_space import NAMESPACE, STATUS
from rotorsoil_ros.feeds.board import Board
from rotorsoil_ros.feeds.hearsay import Inbox
from rotorsoil_ros.feeds.points import Quality
from rotorsoil_ros.node.listener import GraphListener
from rotorsoil_ros.testing.graph import DEADLINE_S, Graph

from brokers import Broker, Host
from graphs import exact, joint_state, STAMP
from plants import free_port, until

X = Channel('bearing_1', 'housing', 'x')
SPEED = 300.0


class Ears:
    """A listener in a graph, and the board of what it hears."""

    def __init__(self, context):
        self.listener = GraphListener(inbox := Inbox(), context)
        self.board = Board(inbox, plant=False)
        self.now_ns = 0

    def point(self, machine, channel, quantity):
        self.listener.hear(0.05)
        self.board.refresh(self.now_ns)
        found = self.board.machines.get(machine)
        return found and found.points.get((channel, quantity))

    def wait_for(self, graph, machine, quality):
        graph.until(lambda: (point := self.point(machine, X, 'Amplitude')) is not None
                    and point.quality is quality, f'{machine} {quality}')
        return self.point(machine, X, 'Amplitude')


@pytest.fixture
def ears(graph):
    ears = Ears(graph.context)
    yield ears
    ears.listener.close()


def test_two_halls_with_a_fan_each_are_heard_and_another_domain_is_not(
        graph, bench, ears, machine):
    """What the page of operations shows: a namespace for each hall, or a domain."""
    halls = {}
    for hall in ('hall_1', 'hall_2'):
        node = bench.node('fan', cli=['--ros-args', '-r', f'__ns:=/{hall}'])
        assert node.start()
        halls[hall] = graph.probe.create_publisher(
            type(joint_state([1.0])), f'/{hall}/fan/joint_states', 1000)
    apart = Graph(domain=own_domain.__wrapped__())  # one more that nobody has
    deaf = Ears(apart.context)
    try:
        for number, (hall, publisher) in enumerate(halls.items()):
            ears.wait_for(graph, f'{hall}.fan', Quality.WAITING)  # by its model, before any speed
            graph.until(publisher.get_subscription_count, 'a match')
            publisher.publish(joint_state([SPEED + number], stamp=STAMP + number))
        for number, hall in enumerate(halls):
            told = ears.wait_for(graph, f'{hall}.fan', Quality.GOOD)
            column = machine.table.channels.index(X)
            assert told.value == pytest.approx(
                abs(exact(machine, SPEED + number).displacement[0, column]), rel=1e-13)
            assert told.stamp_ns == STAMP + number
            graph.until(lambda hall=hall: ears.point(f'{hall}.fan', '', 'State') is not None
                        and ears.point(f'{hall}.fan', '', 'State').value, 'a state')
        assert ears.board.machines.keys() == {'hall_1.fan', 'hall_2.fan'}
        assert deaf.point('hall_1.fan', X, 'Amplitude') is None
        assert deaf.board.machines == {}
    finally:
        deaf.listener.close()
        apart.close()


def test_what_the_machines_of_a_plant_do_together_is_heard_of_the_plant(graph, bench, ears):
    bench.active('fan_house', fan_house__case='fan_house')
    total = bench.hear('/rotorsoil/fan_house/total')
    bench.speaker('/fan_house/fan_1/joint_states')(joint_state([150.0], stamp=STAMP))
    housing = Channel('fan_1_fan_end', 'housing', 'x')
    graph.until(lambda: (told := ears.point('fan_house', housing, 'VelocityRms')) is not None
                and told.quality is Quality.GOOD, 'the total')
    told = ears.point('fan_house', housing, 'VelocityRms')
    graph.until(lambda: total, 'the same by itself')
    assert told.value == total[0].velocity[list(total[0].name).index(housing)] > 0.0
    graph.until(lambda: ears.point('fan_house', '', 'State').value == 'WARN', 'that one is silent')
    assert ears.board.machines.keys() == {'fan_house', 'fan_house/fan_1', 'fan_house/fan_2'}


@pytest.fixture
def feeding():
    """Return what starts a feed in a process of its own and waits until it tells."""
    running = []

    def start(*arguments, until_said):
        process = subprocess.Popen(
            [sys.executable, '-m', 'rotorsoil_ros.cli', 'feed', *map(str, arguments)],
            stderr=subprocess.PIPE, text=True,
            env={**os.environ, 'ROS_DOMAIN_ID': str(own_domain())})
        running.append(process)
        for line in process.stderr:
            if until_said in line:
                return process, line.strip()
        raise AssertionError(f'{arguments} has ended')

    yield start
    for process in running:
        process.kill()
        process.communicate()


def test_opcua_and_mqtt_tell_what_a_node_answers_until_it_is_killed(
        graph, start, feeding, machine, tmp_path):
    node, _ = start('log.rerun:=false')
    broker = Broker(tmp_path, free_port())
    server, said = feeding('opcua', '--endpoint', 'opc.tcp://127.0.0.1:0', '--period', '0.1',
                           '--units', 'si', until_said='OPC UA at')
    host = Host(broker.port)
    edge, _ = feeding('mqtt', '--broker', f'127.0.0.1:{broker.port}', '--period', '0.1',
                      until_said='Sparkplug B at')
    publish = graph.speaker('/fan/joint_states', type(joint_state([1.0])))
    wanted = abs(exact(machine, SPEED).displacement[0, machine.table.channels.index(X)])

    async def read(holds):
        async with Client(said.split()[3].rstrip(','), timeout=DEADLINE_S) as reader:
            index = await reader.get_namespace_index(NAMESPACE)
            value = reader.get_node(ua.NodeId(f'fan/{X}/Amplitude', index))
            async with asyncio.timeout(DEADLINE_S):
                while True:
                    found = await value.read_data_value(raise_on_bad_status=False)
                    if holds(found):
                        return found
                    publish.publish(joint_state([SPEED]))
                    await asyncio.sleep(0.1)

    def has(quality):
        return lambda found: found.StatusCode.value == STATUS[quality]

    try:
        found = asyncio.run(read(has(Quality.GOOD)))
        assert found.Value.Value == pytest.approx(wanted, rel=1e-13)
        host.wait_for('DBIRTH/fan')

        def told():
            publish.publish(joint_state([SPEED]))
            return {metric.name: metric.double_value
                    for kind in ('DBIRTH/fan', 'DDATA/fan') for payload in host.payloads(kind)
                    for metric in payload.metrics}[f'{X}/Amplitude']

        until(lambda: told() == pytest.approx(2e6 * wanted, rel=1e-13), 'the amplitude')
        assert node.poll() is None
        node.kill()
        node.wait(DEADLINE_S)
        asyncio.run(read(has(Quality.SILENT)))
        host.wait_for('DDEATH/fan')
        for process in (server, edge):
            process.send_signal(signal.SIGTERM)
            _, rest = process.communicate(timeout=DEADLINE_S)
            assert process.returncode == 0
            assert 'Traceback' not in rest
        host.wait_for('NDEATH')
    finally:
        host.close()
        broker.kill()


@pytest.mark.parametrize('arguments, said', [
    (['opcua', '--endpoint', 'nowhere'], '--endpoint: must be opc.tcp://HOST:PORT'),
    (['opcua', '--certificate', 'no.pem', '--key', 'no.key'], 'no.pem: No such file or directory'),
    (['mqtt', '--broker', 'a:b'], "argument --broker: must be HOST or HOST:PORT, got 'a:b'"),
    (['mqtt', '--group', 'a/b'], '--group: must not be empty nor hold'),
    (['mqtt', '--user', 'me', '--password-file', 'no'], 'no: No such file or directory'),
    (['mqtt', '--period', '0'], "argument --period: must be a time > 0 s, got '0'"),
    (['opcua', '--endpiont', 'x'], 'did you mean --endpoint?'),
    (['nothing'], 'argument KIND:'), ([], 'the following arguments are required: KIND')])
def test_bad_input_is_told_in_one_line(arguments, said, capsys, monkeypatch, tmp_path):
    from rotorsoil_ros.cli import main

    monkeypatch.chdir(tmp_path)
    try:
        status = main(['feed', *arguments])
    except SystemExit as stopped:
        status = stopped.code
    assert status == 2
    line, = capsys.readouterr().err.strip().splitlines()
    assert said in line
