"""
Let a node run for an hour of its machine in minutes, and see whether it stays as it is.

A node in a process of its own, with MCAP in small splits, a budget and rerun, hears of one fan
what a plant would send for an hour: speeds at 100 Hz, measured vectors at 10 Hz and raw samples of
a housing at 500 Hz, as fast as it answers. Resident memory, threads and open files of the process
are read along the way; after a first quarter, in which buffers fill, they must stay. At the end
`/diagnostics` must have counted every message that was sent, and the log must be readable.

A short run is over before all buffers are full: it judges threads, files and losses, not memory.

    python -m benchmarks.soak [--short | --messages N] [--no-rerun]
"""

import argparse
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import dataclass, field
import math
import os
from pathlib import Path
import struct
import sys
import tempfile
import time

from diagnostic_msgs.msg import DiagnosticArray
import numpy as np
import rclpy
from rclpy.context import Context
from rclpy.experimental import EventsExecutor
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.serialization import serialize_message
from sensor_msgs.msg import Imu, JointState

from rotorsoil_ros.bags import reader as bag_reader
from rotorsoil_ros.events import NANOSECONDS

from benchmarks.node import process, resident_mib

CASE = Path(__file__).resolve().parents[1] / 'config' / 'plant_fan.yaml'
DOMAIN = '58'
HOUSING = 'fan_end_housing_x'
IMU = f'measured/{HOUSING}/imu'
RATE_HZ, SAMPLES, MEASURED_EVERY = 100, 5, 10  # speeds; samples with each; a vector with each
MESSAGES, SHORT = 2_000_000, 250_000
SLOW, FAST, HOLD_S = 60.0, 170.0, 20.0  # [rad/s], [rad/s], [s]
SWING = 20e-6  # [m]
WINDOW = 40  # speeds under way
WAIT_S = 120.0
LOOKS, READINGS = 20, 20  # what is printed is the median of so many readings
WARM, COUNTED = 5, 3  # looks: the first that counts, and how many make a state
FLAT = 0.02
FILLED = 600_000  # samples by which buffers are full; before, memory is told and not judged
START_NS = 1_700_000_000 * NANOSECONDS
DROPPED = ('dropped', 'measurements_dropped')
RELIABLE = QoSProfile(depth=1000, reliability=ReliabilityPolicy.RELIABLE)


class Template:
    """A message as bytes, of which stamp and one number are replaced."""

    def __init__(self, message: JointState | Imu, number: float) -> None:
        self._bytes = bytearray(serialize_message(message))
        self._at = self._bytes.index(struct.pack('<d', number))

    def of(self, stamp_ns: int, number: float) -> bytes:
        """Return the message of a time [ns] with a number."""
        struct.pack_into('<iI', self._bytes, 4, *divmod(stamp_ns, NANOSECONDS))
        struct.pack_into('<d', self._bytes, self._at, number)
        return bytes(self._bytes)


class Driver:
    """Speaks for a fan, and hears the answers."""

    def __init__(self) -> None:
        self.context = Context()
        rclpy.init(context=self.context)
        self.node = Node('soak_driver', context=self.context)
        self.answered = self.first_ns = self.answered_ns = 0
        self.said: dict[str, int] = {}
        self._publishers = {
            name: self.node.create_publisher(kind, f'fan/{name}', RELIABLE)
            for name, kind in (('joint_states', JointState), ('measured/amplitude', JointState),
                               (IMU, Imu))}
        self.node.create_subscription(
            JointState, 'rotorsoil/fan/amplitude', self._hear, RELIABLE, raw=True)
        self.node.create_subscription(DiagnosticArray, '/diagnostics', self._count, 100)
        self.executor = EventsExecutor(context=self.context)
        self.executor.add_node(self.node)
        speed = JointState(name=['rotor'], velocity=[1.25])
        vector = JointState(name=[HOUSING], position=[1.25], velocity=[math.nan],
                            effort=[math.nan])
        sample = Imu()
        sample.linear_acceleration.x = 1.25
        self._speed, self._vector = Template(speed, 1.25), Template(vector, 1.25)
        self._sample = Template(sample, 1.25)

    def close(self) -> None:
        """Leave the graph."""
        self.executor.shutdown()
        self.node.destroy_node()
        self.context.shutdown()

    def _hear(self, data: bytes) -> None:
        seconds, nanoseconds = struct.unpack_from('<iI', data, 4)
        self.answered += 1
        self.answered_ns = seconds * NANOSECONDS + nanoseconds
        self.first_ns = self.first_ns or self.answered_ns

    def _count(self, message: DiagnosticArray) -> None:
        for status in message.status:
            if status.name in ('rotorsoil: fan', 'rotorsoil: log'):
                self.said |= {value.key: int(value.value) for value in status.values
                              if value.value.isdecimal()}

    def until(self, holds: Callable[[], object], what: str) -> None:
        """Spin until something holds."""
        deadline = time.monotonic() + WAIT_S
        while not holds():
            if time.monotonic() > deadline:
                sys.exit(f'{what} did not happen within {WAIT_S:g} s: {self.said}')
            self.executor.spin_once(timeout_sec=0.02)

    def wait(self) -> None:
        """Return when the node hears every topic."""
        self.until(lambda: self.node.count_publishers('/rotorsoil/fan/amplitude') and all(
            publisher.get_subscription_count() for publisher in self._publishers.values()),
            'a node that hears')
        self.until(lambda: bool(self.said), 'the first diagnostics')

    def speed(self, stamp_ns: int, speed: float) -> None:
        """Tell a speed [rad/s]."""
        self._publishers['joint_states'].publish(self._speed.of(stamp_ns, speed))

    def vector(self, stamp_ns: int) -> None:
        """Tell what a measuring system has found at the housing."""
        self._publishers['measured/amplitude'].publish(self._vector.of(stamp_ns, SWING))

    def sample(self, stamp_ns: int, acceleration: float) -> None:
        """Tell a raw sample [m/s^2] of the housing."""
        self._publishers[IMU].publish(self._sample.of(stamp_ns, acceleration))


def node_command(directory: Path, *parameters: str) -> list[str]:
    """Return the command of a node that watches the fan and logs below a directory."""
    command = [sys.executable, '-m', 'rotorsoil_ros.node.node', '--ros-args']
    for parameter in ('machines:=[fan]', f'fan.case:={CASE}', 'speed_depth:=1000',
                      'speed_reliability:=reliable', f'cache:={directory / "cache"}',
                      f'log.directory:={directory / "logs"}', *parameters):
        command += ['-p', parameter]
    return command


@dataclass
class Taken:
    """What a process takes, read again and again: memory [MiB], threads, open files."""

    memory: list[float] = field(default_factory=list)
    threads: list[float] = field(default_factory=list)
    files: list[float] = field(default_factory=list)

    def read(self, pid: int) -> None:
        """Read once more."""
        own = Path(f'/proc/{pid}')
        self.memory.append(resident_mib(pid))
        self.threads.append(len(list((own / 'task').iterdir())))
        self.files.append(len(list((own / 'fd').iterdir())))


def growth(seen: list[float]) -> float:
    """Return by which share the end lies above the warmed state."""
    return end(seen) / warmed(seen) - 1.0


def warmed(seen: list[float]) -> float:
    """Return the state after buffers have filled."""
    return float(np.median(seen[WARM * READINGS:(WARM + COUNTED) * READINGS]))


def end(seen: list[float]) -> float:
    """Return the last state."""
    return float(np.median(seen[-COUNTED * READINGS:]))


def steps(messages: int) -> Iterator[tuple[int, float]]:
    """Yield stamp [ns] and speed [rad/s] of a fan that runs up, holds, runs down and holds."""
    for step in range(messages // messages_of(1) * RATE_HZ):
        phase = step / RATE_HZ / HOLD_S % 4.0
        share = min(phase, 1.0) if phase < 2.0 else 3.0 - min(phase, 3.0)
        yield START_NS + step * NANOSECONDS // RATE_HZ, SLOW + share * (FAST - SLOW)


def messages_of(seconds: int) -> int:
    """Return how many messages come in so many seconds of the machine."""
    return seconds * (RATE_HZ * (1 + SAMPLES) + RATE_HZ // MEASURED_EVERY)


def run(driver: Driver, pid: int, messages: int) -> tuple[Taken, dict[str, int]]:
    """Send messages as fast as they are answered; return readings and what was sent."""
    state, sent, angle = Taken(), {'received': 0, 'measured': 0, 'samples': 0}, 0.0
    period = 1.0 / (RATE_HZ * SAMPLES)
    each = messages // messages_of(1) * RATE_HZ // (LOOKS * READINGS)
    for stamp_ns, speed in steps(messages):
        driver.speed(stamp_ns, speed)
        sent['received'] += 1
        for number in range(SAMPLES):
            driver.sample(stamp_ns + int(number * period * NANOSECONDS),
                          -SWING * speed**2 * math.sin(angle))
            angle += speed * period
            sent['samples'] += 1
        if sent['received'] % MEASURED_EVERY == 0:
            driver.vector(stamp_ns)
            sent['measured'] += 1
        driver.until(lambda: sent['received'] - driver.answered < WINDOW, 'an answer')
        if sent['received'] % each == 0:
            state.read(pid)
    driver.until(lambda: sum(driver.said.get(name, 0) for name in (*sent, *DROPPED))
                 >= sum(sent.values()), 'a node that has counted what was sent')
    return state, sent


def faults(state: Taken, said: dict[str, int], logged: int) -> list[str]:
    """Return what did not stay, was lost or cannot be read."""
    found = [f'{name} grew by {100.0 * growth(seen):.1f} %'
             for name, seen in vars(state).items() if growth(seen) > FLAT
             and (name != 'memory' or said['samples'] > FILLED)]
    found += [f'{said[name]} messages: {name.replace("_", " ")}'
              for name in (*DROPPED, 'lost') if said.get(name)]
    return found if logged else [*found, 'the log holds no answer']


def report(state: Taken, sent: dict[str, int], spent_s: float) -> None:
    """Print what was measured."""
    total, machine_s = sum(sent.values()), sent['received'] / RATE_HZ
    print(f'{total} messages: {sent["received"]} speeds, {sent["measured"]} vectors, '
          f'{sent["samples"]} raw samples; {machine_s:.0f} s of the machine in {spent_s:.0f} s, '
          f'{total / spent_s:.0f} messages/s')
    for name, seen in vars(state).items():
        looks = [np.median(seen[at:at + READINGS]) for at in range(0, len(seen), READINGS)]
        print(f'{name:>8}: ' + ' '.join(f'{value:.0f}' for value in looks))
        print(f'{"":>8}  warmed {warmed(seen):.1f}, end {end(seen):.1f}: '
              f'{100.0 * growth(seen):+.2f} %')


def main() -> int:
    """Run the soak; return 1 if anything grew or was lost."""
    parser = argparse.ArgumentParser(description=__doc__.split('\n\n')[0])
    parser.add_argument('--messages', type=int, default=MESSAGES)
    parser.add_argument('--short', dest='messages', action='store_const', const=SHORT)
    parser.add_argument('--no-rerun', dest='rerun', action='store_false')
    arguments = parser.parse_args()
    os.environ.setdefault('ROS_DOMAIN_ID', DOMAIN)
    os.environ.update(ROS_AUTOMATIC_DISCOVERY_RANGE='LOCALHOST', OMP_NUM_THREADS='1')
    with ExitStack() as stack:
        directory = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        driver = Driver()
        stack.callback(driver.close)
        with process(node_command(
                directory, 'log.split_mib:=2', 'log.budget_mib:=64',
                f'log.rerun:={str(arguments.rerun).lower()}')) as running:
            driver.wait()
            began = time.monotonic()
            state, sent = run(driver, running.pid, arguments.messages)
            report(state, sent, time.monotonic() - began)
        bag = directory / 'logs' / 'run'
        logged = sum(1 for _ in bag_reader.messages(
            bag, lambda topic, kind: topic.endswith('/amplitude')))
        files = len(list(bag.glob('*.mcap'))), len(list(bag.glob('*.rrd')))
        print(f'left within the budget: {files[0]} MCAP files, {files[1]} recordings, '
              f'{logged} amplitudes')
        found = faults(state, driver.said, logged)
    print('\n'.join(found) or 'nothing grew and nothing is lost')
    return int(bool(found))


if __name__ == '__main__':
    raise SystemExit(main())
