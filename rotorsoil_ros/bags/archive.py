"""Years of recorded runs, answered by whatever has processors: one record for every bag."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass, field
from functools import lru_cache
import hashlib
import json
import os
from pathlib import Path
import pickle
from typing import Any, get_type_hints

from rotorsoil_ros.background import Mapper
from rotorsoil_ros.bags.metadata import files
from rotorsoil_ros.bags.predict import predict
from rotorsoil_ros.bags.tables.files import opened
from rotorsoil_ros.case.machine import load, Machine
from rotorsoil_ros.errors import InputError, RotorSoilError
from rotorsoil_ros.events import Event
from rotorsoil_ros.monitor.comparison import Comparison, Run
from rotorsoil_ros.monitor.criteria import criteria, Expectation
from rotorsoil_ros.monitor.minutes import ground_by_minute, Minute, Minutes
from rotorsoil_ros.monitor.monitor import Monitor
from rotorsoil_ros.monitor.points import ChannelPoints, Collector
from rotorsoil_ros.wire.speeds import SpeedSource, USUAL


@dataclass(frozen=True, slots=True)
class Record:
    """
    What became of one bag.

    Attributes
    ----------
    bag, machine : str
        Its path, and under which name it was answered.
    out : str
        Log of its predictions; empty where none is kept.
    counts : dict of str to int
        How many speeds for which reason.
    remarks : list of str
        What of it could not be read, and why.
    failure : str
        Why it has no answer; empty where it has.
    minutes : list of Minute
        Its statistics, where they were asked for.

    """

    bag: str
    machine: str = ''
    out: str = ''
    counts: dict[str, int] = field(default_factory=dict)
    remarks: list[str] = field(default_factory=list)
    failure: str = ''
    minutes: list[Minute] = field(default_factory=list)


@dataclass(frozen=True, slots=True)
class Job:
    """
    One bag to be answered, in words that another process understands.

    Attributes
    ----------
    machine : bytes
        Case and directory of the cache, pickled.
    bag, record : Path
        What to read, and the file that says what became of it.
    log : Path or None
        Where to write the predictions.
    has_statistics : bool
        Whether minutes are kept.
    speed : SpeedSource
        What tells the speed.

    """

    machine: bytes
    bag: Path
    record: Path
    log: Path | None
    has_statistics: bool
    speed: SpeedSource

    @property
    def identity(self) -> str:
        """What it is that was answered: bag, case and wishes as they are now."""
        parts = [(file.name, file.stat().st_size, file.stat().st_mtime_ns)
                 for file in (files(self.bag) if self.bag.exists() else ())]
        told = repr((str(self.bag.resolve()), sorted(parts), self.log is not None,
                     self.has_statistics, self.speed))
        return hashlib.sha256(told.encode() + self.machine).hexdigest()

    @property
    def begun(self) -> Path:
        """File that is there while somebody answers the bag."""
        return self.record.with_suffix('.begun')

    def known(self) -> Record | None:
        """Return what became of it the last time, if nothing has changed since."""
        try:
            told: dict[str, Any] = json.loads(self.record.read_text())
            if told.pop('identity') != self.identity:
                return None
            minutes = [Minute(**row) for row in told.pop('minutes')]
            record = Record(**told, minutes=minutes)
        except (OSError, ValueError, KeyError, TypeError):
            return None
        return record if not record.out or Path(record.out).exists() else None

    def keep(self, record: Record) -> Record:
        """Write down what became of it, all at once, and return it."""
        partial = self.record.with_suffix('.partial')
        partial.write_text(json.dumps({'identity': self.identity, **asdict(record)}))
        os.replace(partial, self.record)
        return record


def predict_many(
    case: Machine | Path | str, bags: Sequence[Path | str], out: Path | str, *,
    map: Mapper['Job', Record] = map,  # noqa: A002, as every executor calls it
    has_predictions: bool = True, has_statistics: bool = False, speed: SpeedSource = USUAL,
    cache_directory: str | Path | None = None,
) -> Iterator[Record]:
    """
    Answer many bags, each by itself, on any executor; yield a record for each, in their order.

    What is done stays done: records lie in `out`, and a second call answers only what has none
    or has changed. A bag that cannot be answered is a record that says why, and stops nothing.
    Tables are computed before anything is handed out, and shared through the cache.

    Parameters
    ----------
    case : Machine, Path or str
        The machine, or its case file.
    bags : sequence of Path or str
        Bag directories or MCAP files.
    out : Path or str
        Directory of the records, and of the predictions.
    map : callable
        `map` itself, or that of an executor whose workers can read the bags and the cache.
    has_predictions : bool
        Whether each answer is written, as the node would: more than twenty times its input.
    has_statistics : bool
        Whether records hold statistics by minute and channel.
    speed : SpeedSource
        What tells the speed.
    cache_directory : str, Path or None
        Of tables; the user's by default.

    Raises
    ------
    InputError
        If the case is wrong, no bag is given, or one is given twice.

    """
    machine = case if isinstance(case, Machine) else load(case, cache_directory=cache_directory)
    jobs = _jobs(machine, [Path(bag) for bag in bags], Path(out), has_predictions=has_predictions,
                 has_statistics=has_statistics, speed=speed)
    criteria(machine.case, machine.model, machine.case.unbalance, machine.directory)
    known = {job.record: record for job in jobs if (record := job.known()) is not None}
    new = iter(map(answer_bag, [job for job in jobs if job.record not in known]))
    return (known[job.record] if job.record in known else next(new) for job in jobs)


def _jobs(
    machine: Machine, bags: Sequence[Path], out: Path, *, has_predictions: bool,
    has_statistics: bool, speed: SpeedSource,
) -> list[Job]:
    if not bags:
        raise InputError('no bag is given')
    if len({bag.resolve() for bag in bags}) < len(bags):
        raise InputError('a bag is given twice')
    out.mkdir(parents=True, exist_ok=True)
    packed = pickle.dumps(Machine(machine.case, machine.directory))
    return [Job(packed, bag, out / f'{name}.json', out / f'{name}.mcap' if has_predictions
                else None, has_statistics, speed)
            for bag, name in zip(bags, _names(bags), strict=True)]


def _names(bags: Sequence[Path]) -> Iterator[str]:
    """Yield a name for each bag: its own, with a mark of its place where another has it too."""
    own = [bag.stem if bag.suffix else bag.name for bag in bags]
    for bag, name in zip(bags, own, strict=True):
        place = hashlib.sha256(str(bag.resolve()).encode()).hexdigest()[:8]
        yield name if own.count(name) == 1 else f'{name}_{place}'


@lru_cache(maxsize=4)
def _machine(packed: bytes) -> Machine:
    """Return a machine whose tables a worker reads once."""
    machine: Machine = pickle.loads(packed)
    return machine


def answer_bag(job: Job) -> Record:
    """Answer one bag and write its record; what cannot be answered is a record too."""
    if (known := job.known()) is not None:
        return known
    job.begun.touch()
    try:
        record = _answered(job)
    except (RotorSoilError, OSError) as error:
        record = Record(str(job.bag), failure=str(error))
    job.keep(record)
    job.begun.unlink(missing_ok=True)
    return record


def _answered(job: Job) -> Record:
    machine = _machine(job.machine)
    book = Book(machine) if job.has_statistics else None
    answered = predict(machine, job.bag, job.log, speed=job.speed, listener=book)
    failed = bool(answered.failure)
    return Record(
        str(job.bag), answered.machine, '' if failed or job.log is None else str(job.log),
        dict(answered.counts), list(answered.remarks), answered.failure,
        book.rows() if book is not None and not failed else [])


def write_statistics(path: Path, records: Iterable[Record]) -> None:
    """
    Write the minutes of all bags as one table, .csv or .parquet.

    Raises
    ------
    InputError
        If the name ends with neither, or Parquet is asked for where pyarrow is not installed.

    """
    with opened(path, {'bag': str, **get_type_hints(Minute)}) as write:
        for record in records:
            write([{'bag': record.bag, **asdict(row)} for row in record.minutes])


class Book:
    """Listens to a run and knows its minutes in the end."""

    def __init__(self, machine: Machine) -> None:
        self._machine = machine
        self._points = Collector()

    def begin(self, monitor: Monitor) -> None:
        """Listen to a monitor from its first message on."""
        self._monitor = monitor
        self._minutes = Minutes(monitor.machine, monitor.table.channels,
                                monitor.table.stability)
        monitor.judge.account.zones.listener = self._minutes.take_zone

    def __call__(self, event: Event) -> None:
        """Take in an event."""
        self._minutes(event)
        self._points(event)

    def rows(self) -> list[Minute]:
        """Return the minutes."""
        judge, points = self._monitor.judge, self._points.points()
        ground = ground_by_minute(self._compared(points)) if points else {}
        return self._minutes.rows(points, margin=judge.account.rules.amplitude_margin,
                                  ground=ground)

    def _compared(self, points: list[ChannelPoints]) -> Comparison:
        machine, judge = self._machine, self._monitor.judge
        stamp_ns, speed = self._points.speeds()
        run = Run(self._monitor.machine, stamp_ns, speed, [(0, machine.case.unbalance)], [],
                  judge.is_synthetic)
        return Comparison(run, Expectation.of(machine.case, machine.directory), judge.account,
                          judge.runout, points)
