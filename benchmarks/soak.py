"""
Let a machine run for a day in minutes and see whether memory stays where it is.

Sends speeds at 100 Hz of message time through the path of the node's callback (CDR in,
look-up, CDR out, MCAP log with splits), and with every tenth a measured vector that is held
against the prediction; does once per second of message time what the node does then; and prints
resident memory and cost per message along the way. With `--machines N` the same number of
messages is spread over N machines: the cost per message must not depend on it.

    python -m benchmarks.soak [--messages N] [--machines N] [--no-log]
"""

import argparse
from collections.abc import Iterator
from contextlib import ExitStack
import math
import os
from pathlib import Path
import sys
import tempfile
import time

from rclpy.serialization import serialize_message
from sensor_msgs.msg import JointState

from rotorsoil_ros.case.machine import Machine
from rotorsoil_ros.events import NANOSECONDS
from rotorsoil_ros.monitor.criteria import criteria
from rotorsoil_ros.monitor.monitor import Monitor
from rotorsoil_ros.node.run_log import LogSettings, RunLog
from rotorsoil_ros.wire.handlers import Inlet, inlet, MEASURED_TOPICS
from rotorsoil_ros.wire.messages import Encoder, Messenger, pack_stamp, Topics
from rotorsoil_ros.wire.speeds import ROTOR_JOINT

CASE = Path(__file__).resolve().parents[1] / 'config' / 'paper_rotor.yaml'
RATE_HZ = 100
MEASURED_EVERY = 10
DAY = 24 * 3600 * RATE_HZ
LOOKS = 20
FLAT = 0.02
BEHIND = 100  # batches
START_NS = 1_700_000_000 * NANOSECONDS


def resident_mib() -> float:
    """Return the resident memory of this process."""
    pages = int(Path('/proc/self/statm').read_text().split()[1])
    return pages * os.sysconf('SC_PAGE_SIZE') / 2**20


def speeds() -> Iterator[bytes]:
    """Yield a JointState every 10 ms of message time, running up and down each minute."""
    message = JointState(name=[ROTOR_JOINT], position=[0.0], velocity=[0.0], effort=[0.0])
    step = 0
    while True:
        message.velocity[0] = 400.0 + 300.0 * math.sin(step / (60 * RATE_HZ) * 2.0 * math.pi)
        yield stamped(message, step)
        step += 1


def stamped(message: JointState, step: int) -> bytes:
    """Return a message at the time of a step."""
    body = bytearray(serialize_message(message))
    body[4:12] = pack_stamp(*divmod(START_NS + step * NANOSECONDS // RATE_HZ, NANOSECONDS))
    return bytes(body)


class Plant:
    """Machines with inlets, monitors and one log, as the node has them."""

    def __init__(self, names: list[str], stack: ExitStack, directory: Path, *, logs: bool) -> None:
        machine = Machine.load(CASE, cache_directory=directory / 'cache')
        settings = LogSettings(
            directory=str(directory / 'logs') if logs else '', name='soak', mcap=True,
            rerun=False, rerun_url='', split_mib=16.0, split_s=0.0, budget_mib=256.0)
        self._complaints: list[str] = []
        self.log = RunLog(
            settings, {}, tell=lambda text: None, complain=self._complaints.append)
        stack.callback(self.log.close)
        self.monitors, self.inlets = [], list[Inlet]()
        self._measured: list[list[Inlet]] = []
        judged_by = criteria(
            machine.case, machine.model, machine.case.unbalance, directory / 'cache')
        for name in names:
            encoder = Encoder(name, machine.table.channels, Topics.of('', name))
            monitor = Monitor(name, machine.table, machine.case.unbalance, sinks=[
                Messenger(encoder, [lambda records: None, self.log.write]), self.log.show])
            monitor.judge.take_criteria(judged_by)
            monitor.begin(START_NS, machine.description(name, machine.case.unbalance))
            self.monitors.append(monitor)
            self.inlets.append(inlet('joint_states', f'/{name}/joint_states', monitor,
                                     log=self.log.write))
            self._measured.append([
                inlet(kind, f'/{name}/{kind}', monitor, log=self.log.write)
                for kind in MEASURED_TOPICS])

    def measure(self, step: int) -> None:
        """Tell one machine a vector of one of its housings."""
        message = JointState(name=['bearing_2_housing_x'], position=[1e-6], velocity=[math.nan],
                             effort=[math.nan])
        for taken_in in self._measured[step // MEASURED_EVERY % len(self._measured)]:
            taken_in((0,), (stamped(message, step),))

    def second(self, now_ns: int) -> None:
        """Do what the node does once a second."""
        for monitor in self.monitors:
            monitor.tick(now_ns, stale_after_s=3.0)
        self.log.flush()
        while self.log.backlog > BEHIND:  # a day passes faster than its log is written
            time.sleep(0.001)
        if self._complaints:
            sys.exit(self._complaints[0])


def run(plant: Plant, messages: int) -> tuple[list[float], float]:
    """Send messages; return resident memory [MiB] at equal distances and the cost of one [us]."""
    said, seen, spent = speeds(), list[float](), 0
    for step in range(messages):
        cdr = next(said)
        taken_in = plant.inlets[step % len(plant.inlets)]
        before = time.thread_time_ns()
        taken_in((0,), (cdr,))
        spent += time.thread_time_ns() - before
        if step % MEASURED_EVERY == 0:
            plant.measure(step)
        if step % RATE_HZ == RATE_HZ - 1:
            plant.second(START_NS + step * NANOSECONDS // RATE_HZ)
        if step % (messages // LOOKS) == messages // LOOKS - 1:
            seen.append(resident_mib())
    return seen, spent / messages / 1000


def main() -> int:
    """Run the soak; return 1 if memory grows."""
    parser = argparse.ArgumentParser(description=__doc__.split('\n\n')[0])
    parser.add_argument('--messages', type=int, default=DAY, help='default: 24 h at 100 Hz')
    parser.add_argument('--machines', type=int, default=1)
    parser.add_argument('--no-log', dest='logs', action='store_false', help='without MCAP')
    arguments = parser.parse_args()
    with ExitStack() as stack:
        directory = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        names = [f'machine_{number}' for number in range(arguments.machines)]
        seen, cost_us = run(Plant(names, stack, directory, logs=arguments.logs),
                            arguments.messages)
    # The first quarter fills buffers and the first index.
    settled = seen[LOOKS // 4:]
    growth = max(settled) / settled[0] - 1.0
    print(f'{arguments.messages} messages, {arguments.machines} machines: {cost_us:.1f} us each')
    print('resident MiB:', ' '.join(f'{value:.1f}' for value in seen))
    print(f'growth after the first quarter: {100.0 * growth:.2f} %')
    return int(growth > FLAT)


if __name__ == '__main__':
    raise SystemExit(main())
