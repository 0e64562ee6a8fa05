"""What does a table file hold? Rows of cells, whoever wrote it: CSV, Excel, UFF 58."""

from collections import Counter
from collections.abc import Iterator, Sequence
import csv
from dataclasses import dataclass
from difflib import get_close_matches
from itertools import islice, zip_longest
from pathlib import Path
import re
from typing import Any, TypeAlias

import numpy as np

from rotorsoil_ros.bags.tables.cells import holds_numbers
from rotorsoil_ros.errors import InputError

Cell: TypeAlias = Any  # text, a number, a date or None, as the file has it

LARGEST_BYTES = 1 << 28
MOST_ROWS = 5_000_000
DELIMITERS = ';\t|,'
COMMENT = '#'
BOMS = {b'\xff\xfe': 'utf-16', b'\xfe\xff': 'utf-16', b'\xef\xbb\xbf': 'utf-8-sig'}
# How a column is called, and the unit behind it: `Speed [rpm]`, `Amplitude (um p-p)`.
TITLED = re.compile(r'(?P<name>.*?)\s*[\[(](?P<unit>[^\])]*)[\])]\s*')
HEADER_WITHIN = 200  # rows in which the names of the columns are looked for
UFF_SUFFIXES = ('.uff', '.unv', '.uf', '.58')
UFF_ABSCISSAE = {17: 'time', 18: 'frequency', 19: 'speed'}


@dataclass(frozen=True)
class Sheet:
    """
    Rows of a table file.

    Attributes
    ----------
    source : Path
        The file.
    rows : list of (int, list of cells)
        Each with its number in the file.
    delimiter : str
        Between the cells of a CSV; empty where cells are typed.

    """

    source: Path
    rows: list[tuple[int, list[Cell]]]
    delimiter: str = ''

    def headed(self, wanted: Sequence[str | int]) -> 'Headed':
        """
        Find the row that names the columns.

        Parameters
        ----------
        wanted : sequence of str or int
            Names of columns; or numbers, from 1 on, for a table without names.

        Raises
        ------
        InputError
            If no row has all the names.

        """
        names = [name for name in wanted if isinstance(name, str)]
        if not self.rows:
            raise InputError(f'{self.source}: is empty')
        if not names:  # columns by their numbers
            return self._numbered()
        header, below = max(self._headers(), key=lambda one: (
            sum(bool(_matches(name, one[0])) for name in names), -one[1]))
        missing = [name for name in names if not _matches(name, header)]
        if missing:
            raise InputError('\n'.join(
                f'{self.source}: has no column {name!r}{_near(name, header)}; there are '
                f'{", ".join(filter(None, header)) or "none"}' for name in missing))
        return Headed(header, self.rows[below:], self.rows[below - 1][0])

    def _numbered(self) -> 'Headed':
        """Return the rows below names that stand on top of columns which nobody calls by them."""
        first = next((at for at, (_, cells) in enumerate(self.rows[:HEADER_WITHIN])
                      if holds_numbers(cells)), 0)
        header = [] if first == 0 else [_text(cell) for cell in self.rows[first - 1][1]]
        return Headed(header, self.rows[first:], self.rows[first][0] - 1)

    def _headers(self) -> Iterator[tuple[list[str], int]]:
        """Yield what may name the columns, and which row is the first below it."""
        for at, (_, cells) in enumerate(self.rows[:HEADER_WITHIN], 1):
            yield [_text(cell) for cell in cells], at
            # A name may go over two rows, of which the upper is of several columns.
            if at < len(self.rows) and not holds_numbers(cells) and not holds_numbers(
                    self.rows[at][1]):
                yield _joined(cells, self.rows[at][1]), at + 1


def _text(cell: Cell) -> str:
    return '' if cell is None else str(cell).strip()


def _joined(upper: Sequence[Cell], lower: Sequence[Cell]) -> list[str]:
    names, group = [], ''
    for above, below in zip_longest(map(_text, upper), map(_text, lower), fillvalue=''):
        group = above or group
        names.append(' '.join(filter(None, (group if below else above, below))))
    return names


@dataclass(frozen=True)
class Headed:
    """A table whose columns have names: `header` (empty: none), rows below, number of its row."""

    header: list[str]
    rows: list[tuple[int, list[Cell]]]
    number: int

    def place(self, column: str | int) -> int:
        """Return where a column is; raise InputError where that is not one place."""
        if isinstance(column, int):
            widest = max((len(cells) for _, cells in self.rows), default=0)
            if not 1 <= column <= widest:
                raise InputError(f'must be a column from 1 to {widest}, got {column}')
            return column - 1
        found = _matches(column, self.header)
        if len(found) != 1:
            raise InputError(f'{column!r} names {len(found)} columns; name one by its number, '
                             f'from 1 on: {", ".join(str(place + 1) for place in found)}')
        return found[0]

    def unit(self, place: int) -> str:
        """Return the unit that stands behind the name of a column, or nothing."""
        found = TITLED.fullmatch(self.header[place]) if place < len(self.header) else None
        return found['unit'].strip() if found else ''


def _matches(name: str, cells: Sequence[Cell]) -> list[int]:
    """Return the places of cells that say a name: exactly, else but for case and unit."""
    texts = [str(cell or '').strip() for cell in cells]
    exact = [place for place, text in enumerate(texts) if text == name.strip()]
    return exact or [place for place, text in enumerate(texts)
                     if text and _plain(text) == _plain(name)]


def _plain(text: str) -> str:
    found = TITLED.fullmatch(text)
    return ' '.join((found['name'] if found and found['name'] else text).lower().split())


def _near(name: str, header: Sequence[str]) -> str:
    near = get_close_matches(name.lower(), [text.lower() for text in header], n=1, cutoff=0.5)
    return f'; did you mean {near[0]!r}?' if near else ''


def read_sheet(path: Path, *, sheet: str = '') -> Sheet:
    """
    Read a table file.

    Parameters
    ----------
    path : Path
        CSV, TSV or text; `.xlsx` or `.xlsm`; `.uff` or `.unv` with data sets 58.
    sheet : str
        Of a workbook; empty: its first.

    Raises
    ------
    InputError
        If it cannot be read.

    """
    try:
        if path.stat().st_size > LARGEST_BYTES:
            raise InputError(f'{path}: is larger than {LARGEST_BYTES >> 20} MiB')
        suffix = path.suffix.lower()
        if suffix in ('.xlsx', '.xlsm'):
            return Sheet(path, list(_workbook_rows(path, sheet)))
        if suffix == '.xls':
            raise InputError(f'{path}: is of an old Excel; save it as .xlsx or CSV')
        if suffix in UFF_SUFFIXES:
            return Sheet(path, list(_uff_rows(path)))
        return _csv_sheet(path, path.read_bytes())
    except OSError as error:
        raise InputError(f'{path}: cannot be read: {error.strerror}') from error


def _csv_sheet(path: Path, content: bytes) -> Sheet:
    if b'\0' in content[:4096] and content[:2] not in BOMS:
        raise InputError(f'{path}: is no text file')
    encoding = next((name for bom, name in BOMS.items() if content.startswith(bom)), 'utf-8')
    try:
        text = content.decode(encoding)
    except UnicodeDecodeError:
        text = content.decode('cp1252', errors='replace')  # what Windows still writes
    lines = [(number, line) for number, line in enumerate(text.splitlines(), 1)
             if line.strip() and not line.lstrip().startswith(COMMENT)]
    told = re.fullmatch(r'sep=(.)', lines[0][1].strip()) if lines else None
    lines = lines[1:] if told else lines
    delimiter = told[1] if told else _delimiter([line for _, line in lines[:HEADER_WITHIN]])
    cells = list(csv.reader((line for _, line in lines), delimiter=delimiter, strict=False))
    # A quoted cell may go over several lines; such a file keeps its count, not its numbers.
    numbers = ([number for number, _ in lines] if len(cells) == len(lines)
               else range(1, len(cells) + 1))
    return Sheet(path, list(zip(numbers, cells, strict=True)), delimiter)


def _delimiter(lines: Sequence[str]) -> str:
    """Return what separates cells: what cuts most rows into as many, semicolons first."""
    best, most = ',', 0.0
    for delimiter in DELIMITERS:
        widths = Counter(len(cells) for cells in csv.reader(lines, delimiter=delimiter))
        width, count = max(widths.items(), key=lambda item: (item[0] > 1, item[1]),
                           default=(0, 0))
        # Decimal commas cut rows into as many as well: the first that does wins.
        if width > 1 and count > most + 0.1 * len(lines):
            best, most = delimiter, count
    return best


def _workbook_rows(path: Path, name: str) -> Iterator[tuple[int, list[Cell]]]:
    try:
        from openpyxl import load_workbook
        from openpyxl.utils.exceptions import InvalidFileException
    except ImportError as error:
        raise InputError(f'{path}: needs openpyxl: pip install "rotorsoil_ros[tables]", or save '
                         'it as CSV') from error
    from zipfile import BadZipFile

    try:
        book = load_workbook(path, read_only=True, data_only=True)
    except (BadZipFile, InvalidFileException, KeyError, ValueError) as error:
        raise InputError(f'{path}: is not a workbook of Excel ({error})') from error
    try:
        if name and name not in book.sheetnames:
            raise InputError(f'{path}: has no sheet {name!r}; there are '
                             f'{", ".join(book.sheetnames)}')
        page = book[name] if name else book.worksheets[0]
        for number, row in enumerate(islice(page.iter_rows(values_only=True), MOST_ROWS), 1):
            if any(cell is not None for cell in row) and not str(row[0] or '').startswith(COMMENT):
                yield number, list(row)
    finally:
        book.close()


def _uff_rows(path: Path) -> Iterator[tuple[int, list[Cell]]]:
    """Yield a header and the points of the data sets 58 of a file, which share an abscissa."""
    try:
        import pyuff
    except ImportError as error:
        raise InputError(f'{path}: needs pyuff: pip install "rotorsoil_ros[tables]"') from error
    try:
        file = pyuff.UFF(str(path))
        sets = [file.read_sets(number) for number, kind in enumerate(file.get_set_types())
                if int(kind) == 58]
    except Exception as error:  # pyuff raises nothing narrower
        raise InputError(f'{path}: is not a universal file ({error})') from error
    if not sets:
        raise InputError(f'{path}: holds no data set 58')
    shared = np.asarray(sets[0]['x'], dtype=float)
    header, columns = [_abscissa(sets[0])], [shared]
    for number, found in enumerate(sets, 1):
        x = np.asarray(found['x'], dtype=float)
        if x.shape != shared.shape or not np.allclose(x, shared):
            raise InputError(f'{path}: data set {number}: has another abscissa than the first')
        name, data = _function(found, number), np.asarray(found['data'])
        unit = str(found.get('ordinate_axis_units_lab') or '').strip()
        shown = f' [{unit}]' if unit and unit.upper() != 'NONE' else ''
        if np.iscomplexobj(data):
            header += [f'{name} amplitude{shown}', f'{name} phase [rad]']
            columns += [np.abs(data), np.angle(data)]
        else:
            header.append(f'{name}{shown}')
            columns.append(data.astype(float))
    yield 1, list(header)
    for number, row in enumerate(np.stack(columns, axis=1).tolist(), 2):
        yield number, row


def _abscissa(found: Any) -> str:
    name = UFF_ABSCISSAE.get(int(found.get('abscissa_spec_data_type') or 0), 'abscissa')
    unit = str(found.get('abscissa_axis_units_lab') or '').strip()
    return f'{name} [{unit}]' if unit and unit.upper() != 'NONE' else name


def _function(found: Any, number: int) -> str:
    """Return what a data set is called: its first line, else node and direction."""
    for key in ('id1', 'id2'):
        text = str(found.get(key) or '').strip()
        if text and text.upper() != 'NONE':
            return text
    node = found.get('rsp_node')
    return f'{node}{_direction(found)}' if node else f'set {number}'


def _direction(found: Any) -> str:
    number = int(found.get('rsp_dir') or 0)
    name = 'xyz'[abs(number) - 1] if 1 <= abs(number) <= 3 else ''
    return f'{"-" if number < 0 else "+"}{name}' if name else ''


