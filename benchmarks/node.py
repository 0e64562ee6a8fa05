"""
Measure what physics costs beside a node that only answers.

Runs rotorsoil_node and a bare rclpy node one after the other, as processes of their own, on the
same messages: JointState in, two JointStates of the same channels out, same executor and QoS.
Prints median and 99th percentile of the latency at several rates, CPU share at each, the
sustained rate, resident memory, and the ratios.

    python benchmarks/node.py [--seconds S]
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
from rclpy.executors import ExternalShutdownException
from rclpy.experimental import EventsExecutor
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.serialization import serialize_message
from sensor_msgs.msg import JointState

CASE = Path(__file__).resolve().parents[1] / 'config' / 'paper_rotor.yaml'
DOMAIN = '57'
RATES_HZ = (10, 100, 1000)
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
rclpy.init()
node = rclpy.create_node('rotorsoil')
publishers = [node.create_publisher(JointState, f'~/paper_rotor/{kind}', 10)
              for kind in ('amplitude', 'phase')]

def on_speed(message):
    speed = message.velocity[message.name.index('rotor')]
    for publisher in publishers:
        answer = JointState()
        answer.header.stamp = message.header.stamp
        answer.name = names
        answer.position = answer.velocity = answer.effort = [speed * v for v in values]
        publisher.publish(answer)

qos = QoSProfile(depth=1000, reliability=ReliabilityPolicy.BEST_EFFORT)
node.create_subscription(JointState, 'paper_rotor/joint_states', on_speed, qos)
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
        self.node = rclpy.create_node('benchmark_driver')
        self.publisher = self.node.create_publisher(
            JointState, 'paper_rotor/joint_states', RELIABLE)
        self.received = 0
        self.latencies: list[int] = []
        self.node.create_subscription(JointState, 'rotorsoil/paper_rotor/amplitude',
                                      self._on_answer, RELIABLE, raw=True)
        self.executor = EventsExecutor()
        self.executor.add_node(self.node)
        message = JointState(name=['rotor'], position=[0.0], velocity=[300.0], effort=[0.0])
        self._bytes = bytearray(serialize_message(message))

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
    with subprocess.Popen(command, stdout=subprocess.DEVNULL) as running:
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
        driver.node.destroy_node()
    return figures


def report(bare: Figures, ours: Figures) -> None:
    """Print both and their ratios."""
    print(f'{"":24}{"bare node":>14}{"rotorsoil":>14}{"ratio":>9}')

    def row(name: str, one: float, other: float, unit: str) -> None:
        print(f'{name:24}{one:>10.1f} {unit:3}{other:>10.1f} {unit:3}{other / one:>9.2f}')

    for rate in RATES_HZ:
        row(f'median latency {rate} Hz', bare.latency_us[rate][0], ours.latency_us[rate][0], 'us')
        row(f'99th percentile {rate} Hz', bare.latency_us[rate][1], ours.latency_us[rate][1],
            'us')
        row(f'CPU share {rate} Hz', 100 * bare.cpu_share[rate], 100 * ours.cpu_share[rate], '%')
        if bare.lost[rate] or ours.lost[rate]:
            print(f'  unanswered at {rate} Hz: {bare.lost[rate]} and {ours.lost[rate]}')
    row('sustained rate', bare.sustained_hz, ours.sustained_hz, 'Hz')
    row('resident memory', bare.memory_mib, ours.memory_mib, 'MiB')


def main() -> None:
    """Measure a bare node and rotorsoil_node."""
    parser = argparse.ArgumentParser(description=__doc__.split('\n\n')[0])
    parser.add_argument('--seconds', type=float, default=5.0, help='per rate')
    seconds = parser.parse_args().seconds
    os.environ.update(ROS_DOMAIN_ID=DOMAIN, ROS_AUTOMATIC_DISCOVERY_RANGE='LOCALHOST',
                      OMP_NUM_THREADS='1')
    rclpy.init()
    with tempfile.TemporaryDirectory() as cache:
        ours = [sys.executable, '-m', 'rotorsoil_ros.live.node', '--ros-args',
                '-p', 'machines:=[paper_rotor]', '-p', f'paper_rotor.case:={CASE}',
                '-p', 'speed_depth:=1000', '-p', f'cache:={cache}']
        with suppress(KeyboardInterrupt, ExternalShutdownException):
            report(measure([sys.executable, '-c', BARE], seconds), measure(ours, seconds))
    rclpy.try_shutdown()


if __name__ == '__main__':
    main()
