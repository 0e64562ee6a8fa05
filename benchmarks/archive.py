"""
Answer an archive: in a plain loop, and in one and two processes, with statistics only.

    python -m benchmarks.archive --bags 40 --speeds 3000
    python -m benchmarks.archive --bags 40 --speeds 60000

Everything in one run. The loop calls `predict` on bag after bag, as somebody would who does not
know of `predict_many`. Efficiency is the loop's time over that of all processes together, by the
wall clock and by processor time, which says the same on a machine with as many idle cores.
"""

import argparse
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from functools import partial
import os
from pathlib import Path
import resource
import tempfile
import time

import numpy as np

from rotorsoil_ros.bags.archive import Book, Job, predict_many, Record
from rotorsoil_ros.bags.predict import predict
from rotorsoil_ros.bags.profile import write_speed_profile
from rotorsoil_ros.bags.workers import processes
from rotorsoil_ros.case.machine import Machine

CASE = Path(__file__).resolve().parents[1] / 'config' / 'plant_fan.yaml'


def profiles(directory: Path, bags: int, speeds: int) -> list[Path]:
    """Write runs, 50 speeds a second, that go up and down."""
    directory.mkdir()
    stamp_ns = 1_700_000_000 * 10**9 + 20_000_000 * np.arange(speeds)
    speed = 110.0 + 70.0 * np.sin(np.arange(speeds) / 500.0)
    paths = [directory / f'{number}.mcap' for number in range(bags)]
    for path in paths:
        write_speed_profile(path, 'fan', stamp_ns, speed)
    return paths


Seconds = tuple[float, float]  # wall clock, and processor time of this process and its children


def of_living_children() -> float:
    """Return what processes have spent that have not ended, and theirs that have [s]."""
    found = [pid for task in Path('/proc/self/task').iterdir()
             for pid in (task / 'children').read_text().split()]
    fields = [Path(f'/proc/{pid}/stat').read_text().rsplit(')', 1)[1].split() for pid in found]
    return sum(int(ticks) for each in fields for ticks in each[11:15]) / os.sysconf('SC_CLK_TCK')


def timed(call: Callable[[], None]) -> Seconds:
    """Return how long a call takes."""
    def spent() -> float:
        used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF,
                                                    resource.RUSAGE_CHILDREN)]
        return sum(each.ru_utime + each.ru_stime for each in used) + of_living_children()

    wall, processor = time.perf_counter(), spent()
    call()
    return time.perf_counter() - wall, spent() - processor


def loop(machine: Machine, paths: list[Path]) -> None:
    """Answer one bag after the other, statistics only."""
    for path in paths:
        book = Book(machine)
        predict(machine, path, None, listener=book)
        book.rows()


def archived(machine: Machine, paths: list[Path], out: Path, number: int) -> None:
    """Answer all bags in processes, from their start to their end."""
    def mapped(function: Callable[[Job], Record], jobs: Iterable[Job], /) -> Iterator[Record]:
        for record in processes(number)(partial(with_peak, function), jobs):
            PEAKS.append(record.counts.pop('peak_kib', 0))
            yield record

    for record in predict_many(machine, paths, out, map=mapped,
                               has_predictions=False, has_statistics=True):
        assert not record.failure, record.failure


PEAKS: list[int] = []


def with_peak(function: Callable[[Job], Record], job: Job) -> Record:
    """Answer one bag; tell among its counts how much memory the process has had [KiB]."""
    record = function(job)
    counts = {**record.counts, 'peak_kib': resource.getrusage(resource.RUSAGE_SELF).ru_maxrss}
    return replace(record, counts=counts)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--bags', type=int, default=40)
    parser.add_argument('--speeds', type=int, default=3000)
    wanted = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        place = Path(name)
        machine = Machine.load(CASE, cache_directory=place / 'cache')
        paths = profiles(place / 'bags', wanted.bags, wanted.speeds)
        tiny = profiles(place / 'tiny', 2, 1)
        loop(machine, tiny)  # fills the cache
        number = wanted.bags * wanted.speeds
        plain = timed(lambda: loop(machine, paths))
        print(f'{wanted.bags} bags of {wanted.speeds} speeds, statistics only')
        print(f'  plain loop: {plain[0]:.2f} s, {plain[1]:.2f} s of processors, '
              f'{number / plain[1]:.3g} speeds/s and core')
        for number_of, what in enumerate(('the first', 'the next')):
            start_up = timed(lambda out=f'out_0_{number_of}': archived(
                machine, tiny, place / out, 2))
            print(f'  start-up of {what} two processes: {start_up[0]:.2f} s, '
                  f'{start_up[1]:.2f} s of processors')
        for jobs in (1, 2):
            wall, processor = timed(
                lambda jobs=jobs: archived(machine, paths, place / f'out_{jobs}', jobs))
            print(f'  {jobs} process{"es" if jobs > 1 else ""}: {wall:.2f} s, '
                  f'{processor:.2f} s of processors; efficiency {plain[0] / jobs / wall:.2f}, '
                  f'by processor time {plain[1] / processor:.2f}')
        start = time.perf_counter()
        again = list(predict_many(machine, paths, place / 'out_2', has_predictions=False,
                                  has_statistics=True))
        print(f'  known already: {1e3 * (time.perf_counter() - start) / len(again):.2f} ms a bag')
        print(f'  memory of the largest process: {max(PEAKS) / 1024:.0f} MiB')


if __name__ == '__main__':
    main()
