"""What if? The response of a machine with all values of some keys of its case."""

from argparse import Namespace
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
import csv
import sys
from typing import TextIO, TYPE_CHECKING

from rotorsoil_ros.case.design.variants import Study, study as solve, Tried, Variant
from rotorsoil_ros.cli.arguments.options import PLANT
from rotorsoil_ros.cli.progress import progress
from rotorsoil_ros.cli.sweeps import machine_of, values
from rotorsoil_ros.cli.table import opened, units_of
from rotorsoil_ros.errors import InputError
from rotorsoil_ros.units import in_plant_units

if TYPE_CHECKING:
    from rotorsoil_ros.background import Mapper


def study(arguments: Namespace) -> int:
    """Solve every variant, write a row for each, its speeds and channels, and draw it."""
    varied = dict(arguments.vary)
    if len(varied) < len(arguments.vary):
        raise InputError('--vary: a key is given twice')
    if arguments.picture is not None and len(varied) > 2:
        raise InputError('--picture shows one or two keys')
    with progress('solving') as report, _mapped(arguments.jobs) as mapped:
        number, total = 0, 1
        for each in varied.values():
            total *= len(each)

        def counted(
            function: Callable[[Variant], Tried], variants: Iterable[Variant], /,
        ) -> Iterator[Tried]:
            nonlocal number
            for tried in mapped(function, variants):
                number += 1
                report(number, total)
                yield tried

        found = solve(machine_of(arguments), varied, rpm=values(arguments.rpm), map=counted)
    with opened(arguments.output) as stream:
        _write(found, stream, plant=units_of(arguments) == PLANT)
    if arguments.picture is not None:
        from rotorsoil_ros.figures.variants import study_figure

        study_figure(found).savefig(arguments.picture)
    for line in dict.fromkeys([*found.failures.values(), *found.unstable.values()]):
        print(line, file=sys.stderr)
    return 0


@contextmanager
def _mapped(jobs: int) -> 'Iterator[Mapper[Variant, Tried]]':
    if jobs == 1:
        yield map
        return
    from functools import partial

    from rotorsoil_ros.bags.workers import pool_of

    with pool_of(jobs) as pool:
        yield partial(pool.map, chunksize=8)


def _write(found: Study, stream: TextIO, *, plant: bool) -> None:
    rows = [in_plant_units(row) if plant else row
            for row in found.rows()]
    names = dict.fromkeys(name for row in rows for name in row)
    writer = csv.DictWriter(stream, names, restval='', lineterminator='\n')
    writer.writeheader()
    writer.writerows(rows)
