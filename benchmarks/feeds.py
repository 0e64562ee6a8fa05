"""
Measure what feeds cost a node of fifty machines, and how old a value is when a client has it.

Fifty machines in one node process, each at 10 Hz, in turns without a feed, with the OPC UA server,
and with the Sparkplug edge node as well, all in processes of their own: latency of the node's
answers, what was lost, processor time of node and feeds. Then, with the feeds renewing values ten
times a second, the age of an amplitude (from the stamp of its speed) when a subscribed client of
OPC UA and a subscriber of the broker have it. The broker is mosquitto where it is installed, else
amqtt, whose own cost is then part of the delay.

    python -m benchmarks.feeds [--machines N] [--rate HZ] [--seconds S] [--rounds N]
"""

import argparse
import asyncio
from collections.abc import Iterator
from contextlib import contextmanager, ExitStack
import os
from pathlib import Path
import shutil
import socket
import sys
import tempfile
import time

from asyncua import Client, ua
import numpy as np
from paho.mqtt import client as paho
from paho.mqtt.enums import CallbackAPIVersion

from rotorsoil_ros.feeds.address_space import NAMESPACE, TICKS_TO_1970
from rotorsoil_ros.feeds.sparkplug import parse

from benchmarks.fleet import Driver, ours
from benchmarks.node import cpu_seconds, process, resident_mib

DOMAIN = '57'
MOSQUITTO = shutil.which('mosquitto') or shutil.which('mosquitto', path='/usr/sbin')
CHANNEL = 'bearing_1_housing_x'
FEEDS = ('no feed', 'opcua', 'opcua and mqtt')


def free_port() -> int:
    """Return a port that nobody uses."""
    with socket.socket() as probe:
        probe.bind(('127.0.0.1', 0))
        return int(probe.getsockname()[1])


@contextmanager
def broker(directory: Path) -> Iterator[int]:
    """Run a broker; yield its port."""
    port = free_port()
    if MOSQUITTO:
        config = directory / 'mosquitto.conf'
        config.write_text(f'listener {port} 127.0.0.1\nallow_anonymous true\n')
        command = [MOSQUITTO, '-c', str(config)]
    else:
        config = directory / 'amqtt.yaml'
        config.write_text(repr({
            'listeners': {'default': {'type': 'tcp', 'bind': f'127.0.0.1:{port}'}},
            'plugins': {'amqtt.plugins.authentication.AnonymousAuthPlugin': {
                'allow_anonymous': True}}}))
        command = [sys.executable, '-m', 'amqtt.scripts.broker_script', '-c', str(config)]
    with process(command):
        yield port


def feed(*arguments: str) -> list[str]:
    """Return the command of a feed."""
    return [sys.executable, '-m', 'rotorsoil_ros.cli', 'feed', *arguments]


def commands(feeds: str, *, opcua: int, mqtt: int, period: str) -> list[list[str]]:
    """Return the commands of the feeds that take part."""
    found = [feed('opcua', '--endpoint', f'opc.tcp://127.0.0.1:{opcua}', '--period', period),
             feed('mqtt', '--broker', f'127.0.0.1:{mqtt}', '--period', period)]
    return found[:FEEDS.index(feeds)]


def measure(
    feeds: str, directory: Path, machines: int, rate_hz: float, seconds: float,
) -> list[float]:
    """Return median, 99th percentile [us], losses, processor shares [%] and memory [MiB]."""
    names = [f'machine_{number}' for number in range(machines)]
    with ExitStack() as stack:
        node = stack.enter_context(process(ours(names, directory)))
        port = stack.enter_context(broker(directory))
        running = [stack.enter_context(process(command)) for command in commands(
            feeds, opcua=free_port(), mqtt=port, period='1')]
        driver = Driver(machines)
        stack.callback(driver.close)
        driver.wait()
        driver.pace(rate_hz, 15.0)  # until every feed has found every machine
        before = [cpu_seconds(each.pid) for each in (node, *running)]
        start = time.monotonic()
        latencies, lost = driver.pace(rate_hz, seconds)
        spent = time.monotonic() - start
        shares = [100.0 * (cpu_seconds(each.pid) - was) / spent
                  for each, was in zip((node, *running), before, strict=True)]
        memory = [resident_mib(each.pid) for each in running]
        return [float(np.median(latencies)), float(np.percentile(latencies, 99)), float(lost),
                *[*shares, 0.0, 0.0][:3], *[*memory, 0.0, 0.0][:2]]


class Ages:
    """How old amplitudes are when they arrive [s]."""

    def __init__(self, driver: Driver) -> None:
        self.opcua: list[float] = []
        self.mqtt: list[float] = []
        self._driver = driver

    def datachange_notification(self, node: object, value: object, data: object) -> None:
        """Take a value of OPC UA; its stamp is what the driver wrote, the steady clock."""
        stamp = data.monitored_item.Value.SourceTimestamp  # type: ignore[attr-defined]
        if stamp is not None and value is not None:
            ticks = ua.datetime_to_win_epoch(stamp) - TICKS_TO_1970
            self.opcua.append(time.monotonic() - ticks / 1e7)

    def hear(self, client: object, data: object, message: paho.MQTTMessage) -> None:
        """Take a message of the broker."""
        if '/DDATA/' in message.topic and message.topic.endswith('/machine_0'):
            for metric in parse(bytes(message.payload)).metrics:
                if metric.name == f'{CHANNEL}/Amplitude' and not metric.is_null:
                    self.mqtt.append(time.monotonic() - metric.timestamp / 1e3)

    async def listen(self, address: str, rate_hz: float, seconds: float) -> None:
        """Subscribe, and have the machines speak."""
        async with Client(address, timeout=60) as reader:
            index = await reader.get_namespace_index(NAMESPACE)
            node = reader.get_node(ua.NodeId(f'machine_0/{CHANNEL}/Amplitude', index))
            subscription = await reader.create_subscription(10, self)
            await subscription.subscribe_data_change(node)
            await asyncio.to_thread(self._driver.pace, rate_hz, seconds)


def delays(directory: Path, machines: int, rate_hz: float, seconds: float) -> Ages:
    """Return how old values are at both outlets with a period of 0.1 s."""
    names = [f'machine_{number}' for number in range(machines)]
    with ExitStack() as stack:
        stack.enter_context(process(ours(names, directory)))
        port, opcua = stack.enter_context(broker(directory)), free_port()
        for command in commands(FEEDS[-1], opcua=opcua, mqtt=port, period='0.1'):
            stack.enter_context(process(command))
        driver = Driver(machines)
        stack.callback(driver.close)
        driver.wait()
        driver.pace(rate_hz, 15.0)
        ages = Ages(driver)
        client = paho.Client(CallbackAPIVersion.VERSION2)
        client.on_message = ages.hear
        client.connect('127.0.0.1', port)
        client.subscribe('spBv1.0/#')
        client.loop_start()
        stack.callback(client.loop_stop)
        asyncio.run(ages.listen(f'opc.tcp://127.0.0.1:{opcua}', rate_hz, seconds))
    return ages


def main() -> None:
    """Measure in turns."""
    parser = argparse.ArgumentParser(description=__doc__.split('\n\n')[0])
    parser.add_argument('--machines', type=int, default=50)
    parser.add_argument('--rate', type=float, default=10.0, help='of each machine [Hz]')
    parser.add_argument('--seconds', type=float, default=20.0)
    parser.add_argument('--rounds', type=int, default=2)
    arguments = parser.parse_args()
    os.environ.update(ROS_DOMAIN_ID=DOMAIN, ROS_AUTOMATIC_DISCOVERY_RANGE='LOCALHOST',
                      OMP_NUM_THREADS='1')
    rate = arguments.rate * arguments.machines
    with tempfile.TemporaryDirectory() as name:
        runs: dict[str, list[list[float]]] = {}
        for _ in range(arguments.rounds):
            for feeds in FEEDS:
                runs.setdefault(feeds, []).append(measure(
                    feeds, Path(name), arguments.machines, rate, arguments.seconds))
        print(f'{arguments.machines} machines at {arguments.rate:g} Hz, renewed each second\n'
              f'{"":16}{"median us":>10}{"99 % us":>10}{"lost":>6}{"node %":>8}{"opcua %":>9}'
              f'{"mqtt %":>8}{"opcua MiB":>11}{"mqtt MiB":>10}')
        for feeds, found in runs.items():
            row = np.median(found, axis=0)
            print(f'{feeds:16}{row[0]:>10.0f}{row[1]:>10.0f}{sum(one[2] for one in found):>6.0f}'
                  f'{row[3]:>8.1f}{row[4]:>9.1f}{row[5]:>8.1f}{row[6]:>11.0f}{row[7]:>10.0f}')
        ages = delays(Path(name), arguments.machines, rate, arguments.seconds)
    for what, found in (('OPC UA', ages.opcua), ('Sparkplug B', ages.mqtt)):
        middle, tail = 1e3 * np.percentile(found, (50, 99)) if found else (np.nan, np.nan)
        print(f'{what}, renewed each 0.1 s: an amplitude is {middle:.0f} ms old, 99 % '
              f'{tail:.0f} ms, of {len(found)}')


if __name__ == '__main__':
    main()
