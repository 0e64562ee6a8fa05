"""How do rows become a file? CSV for anybody, Parquet for who has pyarrow; whole or not at all."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
import csv
import os
from pathlib import Path
from typing import Protocol

from rotorsoil_ros.errors import InputError

Value = float | int | str
Writes = Callable[[Sequence[Mapping[str, Value]]], object]


class TableFile(Protocol):
    """A table that is being written."""

    def __enter__(self) -> Writes:
        """Begin it; return what takes its rows."""

    def __exit__(self, *raised: object) -> None:
        """Finish it."""


def require_suffix(out: Path) -> None:
    """Refuse, before anything is computed, a name that says no format, or one without pyarrow."""
    if out.suffix not in _WRITERS:
        raise InputError(f'{out}: must end with {" or ".join(_WRITERS)}')


@contextmanager
def opened(out: Path, columns: Mapping[str, type]) -> Iterator[Writes]:
    """
    Yield what takes rows; `out` is there once all are written, and not if an error is raised.

    Parameters
    ----------
    out : Path
        `.csv`, or `.parquet` if pyarrow is installed.
    columns : mapping of str to type
        Name and kind of each column: float, int or str. What a row does not tell, and NaN, is an
        empty cell or null.

    Raises
    ------
    InputError
        If the suffix is another, or pyarrow is missing.

    """
    require_suffix(out)
    partial = out.with_name(f'{out.name}.partial')
    try:
        with _WRITERS[out.suffix](partial, columns) as write:
            yield write
        os.replace(partial, out)
    finally:
        partial.unlink(missing_ok=True)


class _CsvFile:
    """Writes rows as CSV; what is not known is an empty cell."""

    def __init__(self, path: Path, columns: Mapping[str, type]) -> None:
        self._path, self._columns = path, columns

    def __enter__(self) -> Writes:
        self._stream = self._path.open('w', encoding='utf-8', newline='')
        writer = csv.DictWriter(self._stream, self._columns, restval='', lineterminator='\n')
        writer.writeheader()
        return lambda rows: writer.writerows({
            name: '' if value != value else value for name, value in row.items()}
            for row in rows)

    def __exit__(self, *raised: object) -> None:
        self._stream.close()


class _ParquetFile:
    """Writes rows as parquet; what is not known is null."""

    def __init__(self, path: Path, columns: Mapping[str, type]) -> None:
        try:
            import pyarrow
            import pyarrow.parquet
        except ImportError as error:
            raise InputError(f'{path.with_suffix("")}: needs pyarrow: pip install '
                             '"rotorsoil_ros[tables]"; or write .csv') from error
        kinds = {str: pyarrow.string(), int: pyarrow.int64(), float: pyarrow.float64()}
        self._arrow = pyarrow
        self._schema = pyarrow.schema([(name, kinds[kind]) for name, kind in columns.items()])
        self._path = path

    def __enter__(self) -> Writes:
        self._file = self._arrow.parquet.ParquetWriter(self._path, self._schema)
        return lambda rows: self._file.write_table(self._arrow.table({
            name: [None if value != value else value
                   for value in (row.get(name, float('nan')) for row in rows)]
            for name in self._schema.names}, schema=self._schema))

    def __exit__(self, *raised: object) -> None:
        self._file.close()


_WRITERS: dict[str, Callable[[Path, Mapping[str, type]], TableFile]] = {
    '.csv': _CsvFile, '.parquet': _ParquetFile}
