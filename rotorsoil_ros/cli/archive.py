"""Many recorded runs at once: answered, counted by minute, on as many processors as there are."""

from argparse import Namespace
from collections.abc import Iterator
from pathlib import Path
import sys
from typing import TYPE_CHECKING

from rotorsoil_ros.cli.progress import progress
from rotorsoil_ros.errors import InputError

if TYPE_CHECKING:
    from rotorsoil_ros.background import Mapper
    from rotorsoil_ros.bags.archive import Job, Record
    from rotorsoil_ros.case.machine import Machine
    from rotorsoil_ros.wire.speeds import SpeedSource


def is_archive(arguments: Namespace) -> bool:
    """Return whether `predict` was asked for more than the answer to one profile."""
    return len(arguments.profiles) > 1 or any(
        getattr(arguments, name) is not None for name in ('jobs', 'dask', 'statistics'))


def predict_archive(arguments: Namespace, machine: 'Machine', speed: 'SpeedSource') -> int:
    """Answer every bag, each in a file of its own, and write the statistics of all."""
    from rotorsoil_ros.bags.archive import predict_many, write_statistics
    from rotorsoil_ros.bags.tables.files import require_suffix

    if arguments.rrd:
        raise InputError('--rrd records one profile: answer it alone')
    if arguments.statistics is not None:
        require_suffix(arguments.statistics)
    out = _place(arguments)
    records = []
    with progress('predicting') as report:
        for record in predict_many(
                machine, arguments.profiles, out, map=_map(arguments), speed=speed,
                has_predictions=arguments.output is not None,
                has_statistics=arguments.statistics is not None):
            records.append(record)
            report(len(records), len(arguments.profiles))
    if arguments.statistics is not None:
        write_statistics(arguments.statistics, records)
    for record in records:
        for line in _told(record):
            print(line, file=sys.stderr if record.failure else sys.stdout)
    failed = sum(bool(record.failure) for record in records)
    print(f'{len(records) - failed} of {len(records)} bags answered'
          + (f'; statistics: {arguments.statistics}' if arguments.statistics else ''))
    return 1 if failed or any(record.counts.get('unstable') for record in records) else 0


def _place(arguments: Namespace) -> Path:
    """Return where records lie: beside the predictions, or beside the statistics alone."""
    if arguments.output is not None:
        if arguments.output.is_file():
            raise InputError(f'{arguments.output}: is a file; several bags need a directory')
        return Path(arguments.output)
    return Path(arguments.statistics).with_suffix('.records')


def _map(arguments: Namespace) -> 'Mapper[Job, Record]':
    from rotorsoil_ros.bags.workers import cluster, processes

    if arguments.dask is not None:
        return cluster(arguments.dask)
    number: int = arguments.jobs or 1
    return map if number == 1 else processes(number)


def _told(record: 'Record') -> Iterator[str]:
    yield from (f'{record.bag}: {remark}' for remark in record.remarks)
    if record.failure:
        yield f'{record.bag}: {record.failure}'
        return
    counts = ', '.join(f'{number} {reason}' for reason, number in record.counts.items())
    yield f'{record.out or record.bag}: {record.machine}: {counts}'
