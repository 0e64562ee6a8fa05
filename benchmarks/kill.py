"""
Kill a node a hundred times while it works, and see what the next starts find.

A node in a process of its own hears speeds of one fan and logs its answers with small splits.
It is ended by SIGKILL, each time after another time: many while it answers, some while it starts,
which is while it recovers what the one before has left. Then a last node is let alone until
nothing is left to recover. Every bag must be readable as a whole, by this package and by rosbags,
and hold all answers that the driver has heard but those of the last second.

    python -m benchmarks.kill [--kills N] [--rate HZ]
"""

import argparse
from collections.abc import Callable, Iterator
from contextlib import contextmanager, ExitStack
from dataclasses import dataclass
import math
import os
from pathlib import Path
import signal
import subprocess
import sys
import tempfile
import time

import numpy as np
from rosbags.highlevel import AnyReader

from rotorsoil_ros.bags import metadata as bag_metadata, reader as bag_reader
from rotorsoil_ros.bags.unfinished import undescribed, unfinished
from rotorsoil_ros.errors import RotorSoilError
from rotorsoil_ros.events import NANOSECONDS

from benchmarks.soak import Driver, node_command

DOMAIN = '59'
AMPLITUDE = '/rotorsoil/fan/amplitude'
RATE_HZ = 500
ALIVE_S = 4.0  # at the longest, after the first answer
GOLDEN = (math.sqrt(5.0) - 1.0) / 2.0  # its multiples spread evenly: no time is met twice
STARTING_EVERY, START_S = 5, 3.0  # kills while the node starts
MOST_LOST_S = 1.0
RECOVERED_WITHIN_S = 600.0


@dataclass(frozen=True)
class Kill:
    """What one kill left: names of the bags, and when answers were heard, first and last [ns]."""

    bags: tuple[str, ...]
    first_ns: int
    answered_ns: int


@contextmanager
def running(directory: Path) -> Iterator[subprocess.Popen[bytes]]:
    """Run a node that logs below a directory; kill it at the end if nobody has."""
    command = node_command(directory, 'log.split_mib:=0.25', 'log.rerun:=false')
    with subprocess.Popen(command, stdout=subprocess.DEVNULL,
                          stderr=subprocess.DEVNULL) as process:
        try:
            yield process
        finally:
            process.kill()
            process.wait()


def bags(directory: Path) -> set[str]:
    """Return the names of all bags."""
    logs = directory / 'logs'
    return {path.name for path in logs.iterdir()} if logs.is_dir() else set()


def speak(driver: Driver, rate_hz: int, holds: Callable[[], object]) -> None:
    """Tell speeds at a rate until something holds."""
    began, said = time.monotonic(), 0
    while not holds():
        driver.speed(time.time_ns(), 100.0 + 50.0 * math.sin(said / rate_hz))
        said += 1
        while (left := began + said / rate_hz - time.monotonic()) > 0.0:
            driver.executor.spin_once(timeout_sec=left)


def kill(driver: Driver, directory: Path, number: int, rate_hz: int) -> Kill:
    """Start a node, let it work for some time under load, and kill it."""
    before, share = bags(directory), number * GOLDEN % 1.0
    driver.first_ns = driver.answered_ns = 0
    with running(directory) as process:
        deadline = time.monotonic() + RECOVERED_WITHIN_S
        if number % STARTING_EVERY:
            speak(driver, rate_hz, lambda: driver.answered_ns or time.monotonic() > deadline)
            until = time.monotonic() + share * ALIVE_S
        else:
            until = time.monotonic() + share * START_S
        speak(driver, rate_hz, lambda: time.monotonic() > until)
        process.send_signal(signal.SIGKILL)
        process.wait()
    for _ in range(10):  # what was on its way
        driver.executor.spin_once(timeout_sec=0.01)
    return Kill(tuple(bags(directory) - before), driver.first_ns, driver.answered_ns)


def let_recover(directory: Path) -> float:
    """Let a last node do what is left to do; return how long that took [s]."""
    logs, began = directory / 'logs', time.monotonic()
    with running(directory) as process:
        known = bags(directory)
        while bags(directory) == known or any(unfinished(logs)) or any(undescribed(logs)):
            if time.monotonic() - began > RECOVERED_WITHIN_S or process.poll() is not None:
                sys.exit('what was left is not recovered')
            time.sleep(0.1)
        spent = time.monotonic() - began
        process.send_signal(signal.SIGTERM)
        process.wait(RECOVERED_WITHIN_S)
    return spent


def stamps(bag: Path) -> list[int]:
    """Return the times of the answers in a bag [ns]; exit if it cannot be read as a whole."""
    try:
        found = [stamp for _, stamp, _ in bag_reader.messages(
            bag, lambda topic, _: topic == AMPLITUDE, tell=lost_in(bag))]
        with AnyReader([bag]) as reader:
            others = sum(connection.topic == AMPLITUDE for connection, _, _ in reader.messages())
    except (RotorSoilError, OSError, ValueError) as error:
        sys.exit(f'{bag} cannot be read: {error}')
    if others != len(found):
        sys.exit(f'{bag}: rosbags reads {others} answers and not {len(found)}')
    return found


def lost_in(bag: Path) -> Callable[[str], object]:
    """Return what exits when a reader leaves something out."""
    return lambda text: sys.exit(f'{bag}: {text}')


def report(directory: Path, kills: list[Kill], rate_hz: int, spent_s: float) -> int:
    """Read every bag, print what is lost, and return 1 if it is more than the last second."""
    lost, answers, recovered = list[float](), 0, 0
    for one in kills:
        for bag in one.bags:
            known = stamps(directory / 'logs' / bag)
            answers += len(known)
            recovered += sum(bag_metadata.RECOVERED in file.stem
                             for file in bag_metadata.files(directory / 'logs' / bag))
            if one.answered_ns:
                last = max(known, default=one.first_ns)  # nothing had reached the disk yet
                lost.append(max(0, one.answered_ns - last) / NANOSECONDS)
    silent = sum(not one.bags for one in kills)
    print(f'{len(kills)} kills at {rate_hz} speeds/s, {silent} of them before there was a log; '
          f'{len(lost)} bags with answers that were heard, {recovered} files recovered, '
          f'{answers} answers read; the last start had recovered all after {spent_s:.1f} s')
    print(f'lost before a kill: median {np.median(lost):.2f} s, 90 % within '
          f'{np.percentile(lost, 90):.2f} s, worst {max(lost):.2f} s')
    return int(max(lost) > MOST_LOST_S)


def main() -> int:
    """Kill a node again and again; return 1 if more is lost than may be."""
    parser = argparse.ArgumentParser(description=__doc__.split('\n\n')[0])
    parser.add_argument('--kills', type=int, default=100)
    parser.add_argument('--rate', type=int, default=RATE_HZ, help='speeds per second')
    arguments = parser.parse_args()
    os.environ.setdefault('ROS_DOMAIN_ID', DOMAIN)
    os.environ.update(ROS_AUTOMATIC_DISCOVERY_RANGE='LOCALHOST', OMP_NUM_THREADS='1')
    with ExitStack() as stack:
        directory = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        driver = Driver()
        stack.callback(driver.close)
        kills = [kill(driver, directory, number, arguments.rate)
                 for number in range(1, arguments.kills + 1)]
        return report(directory, kills, arguments.rate, let_recover(directory))


if __name__ == '__main__':
    raise SystemExit(main())
