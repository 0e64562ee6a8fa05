"""How does a measured table become a bag? Speed and vectors, at the times of the table."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
import math
import os
from pathlib import Path
from typing import Any

import numpy as np

from rotorsoil_ros.arrays import FloatArray, IntArray
from rotorsoil_ros.bags.tables.cells import (
    amplitude_unit,
    Clock,
    contradict,
    decimal_sign,
    EARLIEST_NS,
    holds_numbers,
    number,
    PHASE_UNITS,
    plain_unit,
    SPEED_SPELLINGS,
    start_of,
    TIME_UNITS,
)
from rotorsoil_ros.bags.tables.mapping import checked, Column, Map, map_of, read_map
from rotorsoil_ros.bags.tables.sheet import Cell, Headed, read_sheet
from rotorsoil_ros.bags.writer import BagWriter, LogFile
from rotorsoil_ros.errors import InputError
from rotorsoil_ros.events import LAST_STAMP, NANOSECONDS
from rotorsoil_ros.units import RADIANS_PER_TURN, SPEED_UNITS
from rotorsoil_ros.wire.cdr import ARRAYS
from rotorsoil_ros.wire.definitions import JOINT_STATE
from rotorsoil_ros.wire.messages import JointStateWriter, Records
from rotorsoil_ros.wire.speeds import ROTOR_JOINT

STEADY_NS = 10 * NANOSECONDS  # between rows of which nobody says when they were measured
MOST_FAULTS = 40
ROWS_WRITTEN = 4096


@dataclass(frozen=True)
class ImportedTable:
    """
    What became of a table.

    Attributes
    ----------
    machine : str
        Its machine.
    channels : tuple of str
        What was measured.
    stamp_ns, speed : (n,) arrays
        Of the rows [ns], [rad/s].
    remarks : list of str
        What a reader should know.

    """

    machine: str
    channels: tuple[str, ...]
    stamp_ns: IntArray
    speed: FloatArray
    remarks: list[str]


def import_table(
    table: Path | str, mapping: Path | str | Mapping[str, Any], out: Path | str, *,
    start_ns: int | None = None,
) -> ImportedTable:
    """
    Turn a measured table into a bag with speed and vectors.

    Parameters
    ----------
    table : Path or str
        CSV, Excel, or UFF 58.
    mapping : Path, str or mapping
        Which column is what: a YAML file, or what it would say.
    out : Path or str
        MCAP file to write, or a bag directory that does not exist yet.
    start_ns : int or None
        When the first row was measured, where neither table nor map tell a date [ns]; None:
        when the table was written last.

    Raises
    ------
    InputError
        With every fault of map or table, a line each.

    """
    table, out = Path(table), Path(out)
    said = (checked(mapping, lambda place: '.'.join(map(str, place)) or 'map')
            if isinstance(mapping, Mapping) else read_map(Path(mapping)))
    return write_table_bag(table, said, out, start_ns=start_ns)


def import_with_options(table: Path, options: Mapping[str, Any], out: Path) -> ImportedTable:
    """Turn a table with one channel into a bag, as options say what its columns are."""
    return write_table_bag(table, map_of(options), out)


def write_table_bag(
    table: Path, said: Map, out: Path, *, start_ns: int | None = None,
) -> ImportedTable:
    """Read a table by a map and write its bag."""
    sheet = read_sheet(table, sheet=said.said.sheet)
    columns = _Columns(table, said, sheet.headed(said.said.columns()), sheet.delimiter)
    stamps, speed, motions = columns.read(
        start_ns if start_ns is not None else table.stat().st_mtime_ns)
    machine, channels = said.said.machine, tuple(said.said.channels)
    records = [
        _states(f'/{machine}/joint_states', (ROTOR_JOINT,), stamps, {'velocity': speed[:, None]}),
        *(_states(f'/{machine}/measured/{quantity}', channels, stamps, {
            array: motions[quantity, array] for array in ('position', 'velocity')})
          for quantity in ('amplitude', 'phase')
          if any(np.isfinite(motions[quantity, array]).any()
                 for array in ('position', 'velocity')))]
    _write(out, records)
    return ImportedTable(machine, channels, stamps, speed, columns.remarks)


class _Columns:
    """The columns of a table, read by a map; what is wrong is kept, all of it."""

    def __init__(self, table: Path, said: Map, headed: Headed, delimiter: str) -> None:
        self._table, self._map, self._headed = table, said, headed
        self._delimiter = delimiter
        self._faults: list[str] = []
        self._row_faults: list[tuple[int, str]] = []
        self.remarks: list[str] = []
        self._rows = list(self._below_units())
        # Of the whole table: a column of whole numbers does not tell it.
        self._sign = decimal_sign((cell.strip() for _, cells in self._rows for cell in cells
                                   if isinstance(cell, str)), delimiter)

    def _below_units(self) -> Iterator[tuple[int, list[Cell]]]:
        """Yield the rows with numbers; one of units may be the last between them and the names."""
        header, rows = self._headed.header, self._headed.rows
        first = next((at for at, (_, cells) in enumerate(rows) if holds_numbers(cells)), 0)
        for place, cell in enumerate(rows[first - 1][1][:len(header)] if first and header else ()):
            if cell and not self._headed.unit(place):
                header[place] += f' [{str(cell).strip(" []()")}]'
        for number_, cells in rows[first if header else 0:]:
            if any(str(cell).strip() for cell in cells if cell is not None):
                yield number_, cells

    def read(
        self, written_ns: int,
    ) -> tuple[IntArray, FloatArray, dict[tuple[str, str], FloatArray]]:
        """Return stamps, speeds, and amplitudes and phases by array of the message."""
        said = self._map.said
        speed = self._speed()
        motions = {(quantity, array): np.full((len(self._rows), len(said.channels)), np.nan)
                   for quantity in ('amplitude', 'phase') for array in ('position', 'velocity')}
        for column, name in enumerate(said.channels):
            self._motion(name, column, speed, motions)
        stamps = self._stamps(speed, written_ns)
        self._tell()
        if said.time is not None and said.time.every == 'turn':
            order = np.argsort(speed, kind='stable')  # the real order is that of a rising speed
            speed, motions = speed[order], {key: rows[order] for key, rows in motions.items()}
        return stamps, speed, motions

    def _tell(self) -> None:
        """Raise InputError with all that was found wrong."""
        if not self._rows and not self._faults:
            self._faults.append(f'{self._table}: has no row below row {self._headed.number}')
        rows = [f'{self._table}: row {row}: {text}' for row, text in sorted(self._row_faults)]
        if len(rows) > MOST_FAULTS:
            rows[MOST_FAULTS:] = [f'{self._table}: and {len(rows) - MOST_FAULTS} more']
        if self._faults or rows:
            raise InputError('\n'.join([*self._faults, *rows]))

    def _speed(self) -> FloatArray:
        said = self._map.said.speed
        unit = self._unit(('speed', 'unit'), said.column, said.unit, SPEED_SPELLINGS,
                          'rpm, Hz, rad/s or deg/s')
        found = said.ratio * SPEED_UNITS[SPEED_SPELLINGS[unit]] * self._numbers(
            'speed', said.column) if unit else np.full(len(self._rows), np.nan)
        for row in np.flatnonzero(~(found >= 0.0)).tolist() if unit else ():
            if not any(at == self._rows[row][0] and text.startswith('speed')
                       for at, text in self._row_faults):
                self._row_faults.append((self._rows[row][0], 'speed: must be told and >= 0, got '
                                         f'{self._shown(row, said.column)}'))
        return found

    def _motion(
        self, name: str, column: int, speed: FloatArray,
        motions: Mapping[tuple[str, str], FloatArray],
    ) -> None:
        """Read amplitude and phase of a channel."""
        said = self._map.said.channels[name]
        own = 'channels', name
        text = said.amplitude.unit or self._titled(said.amplitude.column)
        try:
            unit = amplitude_unit(text)
        except InputError as error:
            self._fault((*own, 'amplitude', 'unit'), str(error))
            return
        self._agree((*own, 'amplitude', 'unit'), said.amplitude.column, said.amplitude.unit)
        size = unit.factor * self._numbers(f'{name} amplitude', said.amplitude.column)
        for row in np.flatnonzero(size < 0.0).tolist():
            self._row_faults.append((self._rows[row][0], f'{name} amplitude: must be >= 0, got '
                                     f'{self._shown(row, said.amplitude.column)}'))
        array = 'velocity' if unit.derived == 1 else 'position'
        phase = self._phase(name)
        if unit.derived == 2:  # of a harmonic motion the displacement is -a / omega^2
            with np.errstate(divide='ignore', invalid='ignore'):
                size = np.where(speed > 0.0, size / speed**2, np.nan)
            phase = phase + math.pi
        motions['amplitude', array][:, column] = size
        motions['phase', array][:, column] = np.angle(np.exp(1j * phase))

    def _phase(self, name: str) -> FloatArray:
        """Return the phase of a channel [rad], lead positive; NaN where none is told."""
        said, place = self._map.said.channels[name].phase, ('channels', name, 'phase', 'unit')
        if said is None:
            return np.full(len(self._rows), np.nan)
        unit = self._unit(place, said.column, said.unit, PHASE_UNITS, 'deg or rad')
        if not unit:
            return np.full(len(self._rows), np.nan)
        found = PHASE_UNITS[unit] * self._numbers(f'{name} phase', said.column)
        return -found if said.sense == 'lag' else found

    def _unit(
        self, place: tuple[str, ...], column: Column, said: str, known: Mapping[str, Any],
        rule: str,
    ) -> str:
        """Return the unit of a column, as said or as its name tells; nothing if neither does."""
        unit = plain_unit(said or self._titled(column))
        if unit in known:
            self._agree(place, column, said)
            return unit
        self._fault(place, f'must be {rule}, got {unit!r}' if unit else f'must be said: {rule}')
        return ''

    def _agree(self, place: tuple[str, ...], column: Column, said: str) -> None:
        """Refuse a unit of which the name of its column says another."""
        titled = plain_unit(self._titled(column))
        if said and titled and contradict(plain_unit(said), titled):
            self._fault(place, f'must agree with the name of the column, which says {titled!r}, '
                               f'got {said!r}')

    def _titled(self, column: Column) -> str:
        place = self._place(column)
        return '' if place is None else self._headed.unit(place)

    def _place(self, column: Column) -> int | None:
        try:
            return self._headed.place(column)
        except InputError as error:
            text = f'{self._table}: column {column}: {error}'
            if text not in self._faults:
                self._faults.append(text)
            return None

    def _fault(self, place: tuple[str, ...], problem: str) -> None:
        self._faults.append(self._map.fault(place, problem))

    def _cells(self, column: Column) -> list[Cell]:
        place = self._place(column)
        return [cells[place] if place is not None and place < len(cells) else None
                for _, cells in self._rows]

    def _shown(self, row: int, column: Column) -> str:
        return repr(self._cells(column)[row])

    def _numbers(self, what: str, column: Column) -> FloatArray:
        """Return the numbers of a column, NaN where there is none."""
        cells = self._cells(column)
        sign, found = self._sign, np.full(len(cells), np.nan)
        for row, cell in enumerate(cells):
            try:
                found[row] = number(cell, sign)
            except InputError as error:
                self._row_faults.append((self._rows[row][0], f'{what}: {error}'))
        if len(cells) and np.isinf(found).any():
            row = int(np.flatnonzero(np.isinf(found))[0])
            self._row_faults.append((self._rows[row][0], f'{what}: must be finite'))
        return found

    def _stamps(self, speed: FloatArray, written_ns: int) -> IntArray:
        """Return the times of the rows [ns]."""
        said, count = self._map.said.time, len(self._rows)
        if said is None:
            self.remarks.append('the map tells no time: each row is taken as a steady point, '
                                f'{STEADY_NS // NANOSECONDS} s after the one before it')
            since = STEADY_NS * np.arange(count)
        elif said.every == 'turn':
            rising = np.sort(speed)
            with np.errstate(divide='ignore'):
                turns = np.concatenate([[0.0], RADIANS_PER_TURN / rising[:-1]]).cumsum()[:count]
            if not np.isfinite(turns).all():
                self._faults.append(f'{self._table}: speed must be > 0 where each row is a turn')
                turns = np.zeros(count)
            since = np.rint(turns * NANOSECONDS).astype(np.int64)
        elif said.column is None:
            since = np.rint(float(said.every or 0.0) * NANOSECONDS * np.arange(count)).astype(
                np.int64)
        else:
            since = self._times(said.column)
        return self._dated(since, written_ns)

    def _times(self, column: Column) -> IntArray:
        """Return the times of a column, which must not go backwards [ns]."""
        said, cells = self._map.said.time, self._cells(column)
        assert said is not None
        unit = plain_unit(said.unit or ('' if said.format else self._titled(column)))
        dates = said.format or any(not isinstance(cell, (int, float, str)) for cell in cells
                                   if cell is not None)
        if not dates and unit not in TIME_UNITS:
            self._fault(('time', 'unit'), f'must be said: {", ".join(TIME_UNITS)}; or a format '
                        'of dates, `iso`, `excel` or as in "%d.%m.%Y %H:%M:%S"; or '
                        '`elapsed`')
            return np.arange(len(cells), dtype=np.int64)
        clock = Clock(unit='' if said.format else unit if unit in TIME_UNITS else '',
                      form=said.format, zone=said.zone)
        sign, found, last = self._sign, np.zeros(len(cells), dtype=np.int64), None
        for row, cell in enumerate(cells):
            try:
                time = clock.read(cell, sign)
                if last is not None and time < last:
                    raise InputError(f'must not go backwards, got {cell!r}')
                found[row] = last = time
            except InputError as error:
                self._row_faults.append((self._rows[row][0], f'time: {error}'))
        return found

    def _dated(self, since: IntArray, written_ns: int) -> IntArray:
        """Return times with a date: their own, that of the map, or that of the file."""
        said = self._map.said.time
        if not len(since):
            return since
        if since[0] >= EARLIEST_NS:
            dated = since
        elif said is not None and said.start:
            dated = start_of(said.start) + since
        else:
            begin = written_ns - written_ns % NANOSECONDS
            dated = begin + since - since[0]
            self.remarks.append('no date is told: the first row is dated as the table was written')
        if dated[-1] > LAST_STAMP or dated[0] <= 0:
            self._faults.append(f'{self._table}: time: must lie between 1970 and 2038')
        return np.asarray(dated, dtype=np.int64)


def _states(
    topic: str, names: tuple[str, ...], stamps: IntArray, given: Mapping[str, FloatArray],
) -> Records:
    """Return JointStates of some names, of whose arrays some are given."""
    values = np.full((len(stamps), len(ARRAYS), len(names)), np.nan)
    for array, value in given.items():
        values[:, ARRAYS.index(array)] = value
    times = stamps.tolist()
    return Records(topic, JOINT_STATE, times, JointStateWriter(names).write(times, values))


def _write(out: Path, records: list[Records]) -> None:
    """Write a file or a bag, complete or not at all."""
    if out.suffix != '.mcap':
        if out.exists():
            raise InputError(f'{out}: exists; name a directory that does not, or a file .mcap')
        out.mkdir(parents=True)
        bag = BagWriter(out)
        for each in _slices(records):
            bag.write(each)
        bag.close()
        return
    partial = out.with_name(f'{out.name}.partial')
    try:
        with LogFile(partial) as log:
            for each in _slices(records):
                log.write(each)
        os.replace(partial, out)
    finally:
        partial.unlink(missing_ok=True)


def _slices(records: list[Records]) -> Iterator[Records]:
    """Yield messages some at a time, so that topics come side by side, as they were measured."""
    longest = max((len(each.payloads) for each in records), default=0)
    for start in range(0, longest, ROWS_WRITTEN):
        part = slice(start, start + ROWS_WRITTEN)
        yield from (each._replace(log_time_ns=each.log_time_ns[part],
                                  payloads=each.payloads[part]) for each in records)
