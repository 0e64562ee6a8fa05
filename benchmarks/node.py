"""
Measure what physics costs beside a node that only answers.

Runs rotorsoil_node and a bare rclpy node in turns, as processes of their own, on the same
messages: JointState in, two JointStates of the same channels out, same executor and QoS; ours
without a log, with MCAP, and with MCAP and rerun. Prints the median over all rounds of: median
and 99th percentile of the latency at several rates, CPU share at each, the sustained rate and
resident memory; and their ratios to those of the bare node.

    python -m benchmarks.node [--seconds S] [--rounds N]
"""

import argparse
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
import os
from pathlib import Path
import signal
import struct
import subprocess
import sys
import tempfile
import time

import numpy as np
import rclpy
from rclpy.context import Context
from rclpy.executors import ExternalShutdownException
from rclpy.experimental import EventsExecutor
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.serialization import serialize_message
from sensor_msgs.msg import JointState

CASE = Path(__file__).resolve().parents[1] / 'config' / 'paper_rotor.yaml'
DOMAIN = '57'
RATES_HZ = (10, 100, 1000, 5000)
WINDOW = 32
RELIABLE = QoSProfile(depth=1000, reliability=ReliabilityPolicy.RELIABLE)
BEST_EFFORT = QoSProfile(depth=1000, reliability=ReliabilityPolicy.BEST_EFFORT)
CHANNELS = 18

BARE = """
import sys
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.experimental import EventsExecutor
from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import JointState

names = [f'bearing_{i}_journal_x' for i in range(18)]
values = [0.001 * i for i in range(18)]
reliability, *machines = sys.argv[1:]
qos = QoSProfile(depth=1000, reliability=ReliabilityPolicy[reliability.upper()])
rclpy.init()
node = rclpy.create_node('rotorsoil')

def watch(machine):
    publishers = [node.create_publisher(JointState, f'~/{machine}/{kind}', 10)
                  for kind in ('amplitude', 'phase')]

    def on_speed(message):
        speed = message.velocity[message.name.index('rotor')]
        for publisher in publishers:
            answer = JointState()
            answer.header.stamp = message.header.stamp
            answer.name = names
            answer.position = answer.velocity = answer.effort = [speed * v for v in values]
            publisher.publish(answer)

    node.create_subscription(JointState, f'{machine}/joint_states', on_speed, qos)

for machine in machines:
    watch(machine)
executor = EventsExecutor()
executor.add_node(node)
try:
    while rclpy.ok():
        executor.spin_once(timeout_sec=0.25)
except (KeyboardInterrupt, ExternalShutdownException):
    pass
"""


@dataclass
class Figures:
    """What one node was measured to need."""

    latency_us: dict[int, tuple[float, float]] = field(default_factory=dict)
    lost: dict[int, int] = field(default_factory=dict)
    cpu_share: dict[int, float] = field(default_factory=dict)
    sustained_hz: float = 0.0
    memory_mib: float = 0.0


class Driver:
    """Publishes speeds and receives answers, both as bytes, so that it is not what is measured."""

    def __init__(self) -> None:
        self.context = Context()
        rclpy.init(context=self.context)
        self.node = Node('benchmark_driver', context=self.context)
        self.publisher = self.node.create_publisher(
            JointState, 'paper_rotor/joint_states', RELIABLE)
        self.received = 0
        self.latencies: list[int] = []
        self.node.create_subscription(JointState, 'rotorsoil/paper_rotor/amplitude',
                                      self._on_answer, RELIABLE, raw=True)
        self.executor = EventsExecutor(context=self.context)
        self.executor.add_node(self.node)
        message = JointState(name=['rotor'], position=[0.0], velocity=[300.0], effort=[0.0])
        self._bytes = bytearray(serialize_message(message))

    def close(self) -> None:
        """Leave the graph altogether: who stays would be one more to be served."""
        self.executor.shutdown()
        self.node.destroy_node()
        self.context.shutdown()

    def _on_answer(self, data: bytes) -> None:
        seconds, nanoseconds = struct.unpack_from('<iI', data, 4)
        self.latencies.append(time.monotonic_ns() - seconds * 1_000_000_000 - nanoseconds)
        self.received += 1

    def publish(self) -> None:
        """Publish one speed stamped with the monotonic clock."""
        now = time.monotonic_ns()
        struct.pack_into('<iI', self._bytes, 4, now // 1_000_000_000, now % 1_000_000_000)
        self.publisher.publish(bytes(self._bytes))

    def wait_for_node(self) -> None:
        """Return when the first answer arrives."""
        deadline = time.monotonic() + 60.0
        while not self.received:
            if time.monotonic() > deadline:
                sys.exit('the node did not answer within 60 s')
            self.publish()
            self.executor.spin_once(timeout_sec=0.1)
        self.drain(0.3)

    def drain(self, seconds: float) -> None:
        """Receive for some time."""
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0.0:
            self.executor.spin_once(timeout_sec=left)

    def pace(self, rate_hz: int, seconds: float) -> tuple[np.ndarray, int]:
        """Publish at a rate; return latencies [us] and the number of unanswered speeds."""
        self.latencies.clear()
        count = max(50, int(rate_hz * seconds))
        start = time.monotonic()
        for index in range(count):
            due = start + index / rate_hz
            while (left := due - time.monotonic()) > 0.0:
                self.executor.spin_once(timeout_sec=left)
            self.publish()
        self.drain(0.5)
        return np.array(self.latencies) / 1e3, count - len(self.latencies)

    def saturate(self, seconds: float) -> float:
        """Keep a window of speeds under way; return answers per second."""
        self.received, sent = 0, 0
        start = time.monotonic()
        while time.monotonic() - start < seconds:
            while sent - self.received < WINDOW:
                self.publish()
                sent += 1
            self.executor.spin_once(timeout_sec=0.05)
        return self.received / (time.monotonic() - start)


@contextmanager
def process(command: list[str]) -> Iterator[subprocess.Popen[bytes]]:
    """Run a command and stop it by SIGINT."""
    with subprocess.Popen(command, stdout=subprocess.DEVNULL,
                          stderr=subprocess.DEVNULL) as running:
        try:
            yield running
        finally:
            running.send_signal(signal.SIGINT)
            running.wait(20)


def cpu_seconds(pid: int) -> float:
    """Return user and system time of a process."""
    fields = Path(f'/proc/{pid}/stat').read_text().rsplit(')', 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf('SC_CLK_TCK')


def resident_mib(pid: int) -> float:
    """Return the resident memory of a process."""
    pages = int(Path(f'/proc/{pid}/statm').read_text().split()[1])
    return pages * os.sysconf('SC_PAGE_SIZE') / 2**20


def measure(command: list[str], seconds: float) -> Figures:
    """Run a node and put it through all rates."""
    figures = Figures()
    driver = Driver()
    try:
        with process(command) as running:
            driver.wait_for_node()
            for rate in RATES_HZ:
                before, start = cpu_seconds(running.pid), time.monotonic()
                latencies, lost = driver.pace(rate, seconds)
                spent = time.monotonic() - start
                figures.latency_us[rate] = (float(np.median(latencies)),
                                            float(np.percentile(latencies, 99)))
                figures.lost[rate] = lost
                figures.cpu_share[rate] = (cpu_seconds(running.pid) - before) / spent
            figures.sustained_hz = driver.saturate(seconds)
            figures.memory_mib = resident_mib(running.pid)
    finally:
        driver.close()
    return figures


def rows(figures: Figures) -> dict[str, tuple[float, str]]:
    """Return what is printed of one run: name, value, unit."""
    found: dict[str, tuple[float, str]] = {}
    for rate in RATES_HZ:
        median, tail = figures.latency_us[rate]
        found[f'median latency {rate} Hz'] = median, 'us'
        found[f'99th percentile {rate} Hz'] = tail, 'us'
        found[f'CPU share {rate} Hz'] = 100.0 * figures.cpu_share[rate], '%'
        found[f'unanswered {rate} Hz'] = float(figures.lost[rate]), ''
    found['sustained rate'] = figures.sustained_hz, 'Hz'
    found['resident memory'] = figures.memory_mib, 'MiB'
    return found


def report(runs: dict[str, list[Figures]]) -> None:
    """Print the median of all rounds of each node, and its ratio to the bare one."""
    tables = {name: [rows(figures) for figures in found] for name, found in runs.items()}
    print(f'{"":24}' + ''.join(f'{name:>22}' for name in tables))
    for row, (_, unit) in tables['bare'][0].items():
        middle = {name: float(np.median([one[row][0] for one in table]))
                  for name, table in tables.items()}
        bare = middle['bare']
        cells = [f'{value:>10.1f} {unit:4}' + (f'{value / bare:>7.2f}' if bare else ' ' * 7)
                 for value in middle.values()]
        print(f'{row:24}' + ''.join(cells))


def commands(directory: Path) -> dict[str, list[str]]:
    """Return what is measured: the bare node, and ours with more and more of a log."""
    ours = [sys.executable, '-m', 'rotorsoil_ros.node.node', '--ros-args',
            '-p', 'machines:=[paper_rotor]', '-p', f'paper_rotor.case:={CASE}',
            '-p', 'speed_depth:=1000', '-p', f'cache:={directory / "cache"}']
    logged = [*ours, '-p', f'log.directory:={directory / "logs"}', '-p']
    return {'bare': [sys.executable, '-c', BARE, 'best_effort', 'paper_rotor'], 'no log': ours,
            'MCAP': [*logged, 'log.rerun:=false'], 'MCAP and rerun': [*logged, 'log.rerun:=true']}


def main() -> None:
    """Measure a bare node and rotorsoil_node."""
    parser = argparse.ArgumentParser(description=__doc__.split('\n\n')[0])
    parser.add_argument('--seconds', type=float, default=3.0, help='per rate')
    parser.add_argument('--rounds', type=int, default=3, help='of all nodes in turn')
    arguments = parser.parse_args()
    os.environ.update(ROS_DOMAIN_ID=DOMAIN, ROS_AUTOMATIC_DISCOVERY_RANGE='LOCALHOST',
                      OMP_NUM_THREADS='1')
    with tempfile.TemporaryDirectory() as directory, suppress(
            KeyboardInterrupt, ExternalShutdownException):
        runs: dict[str, list[Figures]] = {}
        for _ in range(arguments.rounds):
            for name, command in commands(Path(directory)).items():
                runs.setdefault(name, []).append(measure(command, arguments.seconds))
        report(runs)


if __name__ == '__main__':
    main()
