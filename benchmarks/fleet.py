"""
Measure a node that watches fifty machines: how it starts, and what a message costs.

Cold start: fifty cases on three kinds of soil, infinite elements, empty cache. Then as many
machines in one node process, reliable, each at 10 Hz, against one machine at the same number of
messages per second, and against a bare node with the same topics, in turns: latency, what was
lost, CPU time per message, resident memory. With plants, some of the machines are those of each.

    python -m benchmarks.fleet [--machines N] [--plants N] [--sources N] [--rate HZ] [--seconds S]
                               [--rounds N] [--no-start]
"""

import argparse
from contextlib import ExitStack, suppress
import os
from pathlib import Path
import struct
import sys
import tempfile
import time

import numpy as np
import rclpy
from rclpy.context import Context
from rclpy.experimental import EventsExecutor
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.serialization import serialize_message
from sensor_msgs.msg import JointState

from rotorsoil_ros.case.loading import load_all

from benchmarks.node import BARE, cpu_seconds, process, resident_mib
from benchmarks.plant import HOUSE, house_of

FASTEST = 700.0  # rad/s, of a machine of its own
OF_PLANT = 0.2  # of that speed; those of the shipped plant turn slower
CASE = Path(__file__).resolve().parents[1] / 'config' / 'paper_rotor.yaml'
POISSON_RATIOS = (0.25, 0.35, 0.45)
DOMAIN = '56'
WAIT_S = 60.0
RELIABLE = QoSProfile(depth=1000, reliability=ReliabilityPolicy.RELIABLE)


def write_cases(directory: Path, count: int) -> list[Path]:
    """Write cases whose soils are of three kinds and all differ in stiffness."""
    text = CASE.read_text().replace('model: cone', 'model: infinite_elements')
    paths = []
    for number in range(count):
        kind = POISSON_RATIOS[number % len(POISSON_RATIOS)]
        path = directory / f'machine_{number}.yaml'
        path.write_text(
            text.replace('poisson_ratio: 0.25', f'poisson_ratio: {kind}')
            .replace('shear_modulus: 48.0e6', f'shear_modulus: {48.0e6 + 1e4 * number}'))
        paths.append(path)
    return paths


def start_cold(directory: Path, count: int) -> None:
    """Print how long it takes to load machines of which nothing is in the cache."""
    paths, told = write_cases(directory, count), list[str]()
    start = time.perf_counter()
    load_all(paths, cache_directory=directory / 'fleet', tell=told.append)
    cold = time.perf_counter() - start
    start = time.perf_counter()
    load_all(paths, cache_directory=directory / 'fleet', tell=told.append)
    soils = len(list((directory / 'fleet').glob('compliance*')))
    print(f'cold start of {count} machines on {len(POISSON_RATIOS)} kinds of soil: {cold:.1f} s, '
          f'{soils} soils computed, {len(told)} lines of progress; '
          f'warm {time.perf_counter() - start:.1f} s', flush=True)


class Driver:
    """Speaks for machines in turn and hears all answers, both as bytes."""

    def __init__(self, names: list[str]) -> None:
        self.context = Context()
        rclpy.init(context=self.context)
        self.node = Node('fleet_driver', context=self.context)
        self.latencies: list[int] = []
        self.heard = [0] * len(names)
        self.publishers = []
        self._share = [OF_PLANT if '/' in name else 1.0 for name in names]
        for number, name in enumerate(names):
            self.publishers.append(self.node.create_publisher(
                JointState, f'{name}/joint_states', RELIABLE))
            self.node.create_subscription(
                JointState, f'rotorsoil/{name}/amplitude',
                lambda data, number=number: self._on_answer(number, data), RELIABLE, raw=True)
        self.executor = EventsExecutor(context=self.context)
        self.executor.add_node(self.node)
        message = JointState(name=['rotor'], position=[0.0], velocity=[300.0], effort=[0.0])
        self._bytes = bytearray(serialize_message(message))
        self._speed_at = self._bytes.index(struct.pack('<d', 300.0))

    def close(self) -> None:
        """Leave the graph."""
        self.executor.shutdown()
        self.node.destroy_node()
        self.context.shutdown()

    def _on_answer(self, number: int, data: bytes) -> None:
        seconds, nanoseconds = struct.unpack_from('<iI', data, 4)
        self.latencies.append(time.monotonic_ns() - seconds * 1_000_000_000 - nanoseconds)
        self.heard[number] += 1

    def publish(self, number: int, speed: float) -> None:
        """Tell the speed of one machine, stamped with the monotonic clock."""
        now = time.monotonic_ns()
        struct.pack_into('<iI', self._bytes, 4, now // 1_000_000_000, now % 1_000_000_000)
        struct.pack_into('<d', self._bytes, self._speed_at, self._share[number] * speed)
        self.publishers[number].publish(bytes(self._bytes))

    def wait(self) -> None:
        """Return when every machine has answered."""
        deadline = time.monotonic() + WAIT_S
        while not all(self.heard):
            if time.monotonic() > deadline:
                sys.exit(f'{self.heard.count(0)} machines did not answer within {WAIT_S:g} s')
            for number, count in enumerate(self.heard):
                if not count:
                    self.publish(number, 300.0)
            self.spin(0.2)
        self.spin(1.0)

    def spin(self, seconds: float) -> None:
        """Receive for some time."""
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0.0:
            self.executor.spin_once(timeout_sec=left)

    def pace(self, rate_hz: float, seconds: float) -> tuple[np.ndarray, int]:
        """Speak for all machines in turn; return latencies [us] and how many were not answered."""
        self.latencies.clear()
        count, start = int(rate_hz * seconds), time.monotonic()
        speed = FASTEST * (4.0 + 3.0 * np.sin(np.arange(count) / count * 20.0)) / 7.0
        for index in range(count):
            while (left := start + index / rate_hz - time.monotonic()) > 0.0:
                self.executor.spin_once(timeout_sec=left)
            self.publish(index % len(self.publishers), float(speed[index]))
        self.spin(1.0)
        return np.array(self.latencies) / 1e3, count - len(self.latencies)


def bare(names: list[str], directory: Path) -> list[str]:
    """Return the command of a bare node with the same topics."""
    del directory
    return [sys.executable, '-c', BARE, 'reliable', *names]


def ours(names: list[str], directory: Path) -> list[str]:
    """Return the command of the node that watches these machines."""
    entries = dict.fromkeys(name.partition('/')[0] for name in names)
    command = [sys.executable, '-m', 'rotorsoil_ros.node.node', '--ros-args',
               '-p', f'machines:=[{",".join(entries)}]', '-p', 'speed_reliability:=reliable',
               '-p', 'speed_depth:=100', '-p', f'cache:={directory / "cache"}']
    for entry in entries:
        command += ['-p', f'{entry}.case:={CASE if entry in names else directory / HOUSE.name}']
    return command


def names_of(machines: int, plants: int, sources: int) -> list[str]:
    """Return how machines are called, those of plants first."""
    among = [f'plant_{number}/fan_{one}' for number in range(plants) for one in range(sources)]
    return [*among, *(f'machine_{number}' for number in range(machines - len(among)))]


def measure(
    command: list[str], names: list[str], rate_hz: float, seconds: float,
) -> list[float]:
    """Return median and 99th percentile [us], losses, CPU per message [us], memory [MiB]."""
    with ExitStack() as stack:
        running = stack.enter_context(process(command))
        driver = Driver(names)
        stack.callback(driver.close)
        driver.wait()
        before = cpu_seconds(running.pid)
        latencies, lost = driver.pace(rate_hz, seconds)
        spent = cpu_seconds(running.pid) - before
        return [float(np.median(latencies)), float(np.percentile(latencies, 99)), float(lost),
                1e6 * spent / (rate_hz * seconds), resident_mib(running.pid)]


def report(runs: dict[tuple[str, int], list[list[float]]]) -> None:
    """Print the median of all rounds, and all losses."""
    print(f'{"":6}{"machines":>10}{"median us":>12}{"99 % us":>12}{"lost":>8}{"CPU us":>10}'
          f'{"MiB":>10}')
    for (node, machines), found in runs.items():
        median, tail, _, cost, memory = np.median(found, axis=0)
        lost = sum(one[2] for one in found)
        print(f'{node:6}{machines:>10}{median:>12.0f}{tail:>12.0f}{lost:>8.0f}{cost:>10.0f}'
              f'{memory:>10.1f}')


def main() -> None:
    """Measure the start, then one machine and many in turns."""
    parser = argparse.ArgumentParser(description=__doc__.split('\n\n')[0])
    parser.add_argument('--machines', type=int, default=50)
    parser.add_argument('--plants', type=int, default=0)
    parser.add_argument('--sources', type=int, default=2, help='machines of each plant')
    parser.add_argument('--rate', type=float, default=10.0, help='of each machine [Hz]')
    parser.add_argument('--seconds', type=float, default=20.0)
    parser.add_argument('--rounds', type=int, default=2)
    parser.add_argument('--no-start', dest='start', action='store_false', help='no cold start')
    arguments = parser.parse_args()
    os.environ.update(ROS_DOMAIN_ID=DOMAIN, ROS_AUTOMATIC_DISCOVERY_RANGE='LOCALHOST',
                      OMP_NUM_THREADS='1')
    with tempfile.TemporaryDirectory() as name, suppress(KeyboardInterrupt):
        directory = Path(name)
        house = house_of(arguments.sources, directory).rename(directory / HOUSE.name)
        # Nobody waits here for what is computed once.
        load_all([Path(f'{house}#fan_{one}') for one in range(
            arguments.sources if arguments.plants else 0)],
            cache_directory=directory / 'cache', tell=lambda text: None)
        if arguments.start:
            start_cold(directory, arguments.machines)
        runs: dict[tuple[str, int], list[list[float]]] = {}
        for _ in range(arguments.rounds):
            for machines in dict.fromkeys((1, arguments.machines)):
                names = names_of(machines, 0 if machines == 1 else arguments.plants,
                                 arguments.sources)
                for node in (bare, ours):
                    runs.setdefault((node.__name__, machines), []).append(measure(
                        node(names, directory), names,
                        arguments.rate * arguments.machines, arguments.seconds))
        report(runs)


if __name__ == '__main__':
    main()
