"""What a file of ROSS says, TOML or JSON, read with suspicion."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
import json
import math
from pathlib import Path
import tomllib
from typing import Any, TypeAlias

from rotorsoil_ros.case.document import shown
from rotorsoil_ros.errors import InputError

Table: TypeAlias = Mapping[str, Any]

_LARGEST_BYTES = 16 * 1024 * 1024


def one_line(title: str) -> str:
    """Return a title as it can be printed."""
    return title if title.isprintable() else shown(title)


def _is_number(value: object) -> bool:
    return (isinstance(value, (int, float)) and not isinstance(value, bool)
            and math.isfinite(value))


@dataclass(frozen=True)
class RossFile:
    """
    A saved rotor: one table for each element, called by class and tag.

    Attributes
    ----------
    path : Path
        Where it lies.
    tables : dict
        What it holds.
    faults : dict
        Numbers that are none, by the lines that tell them: read on, all are told together.

    """

    path: Path
    tables: dict[str, Any]
    faults: dict[str, None] = field(default_factory=dict)

    @classmethod
    def read(cls, path: Path) -> 'RossFile':
        """Read a file; an InputError tells in one line what is wrong with it."""
        try:
            if path.stat().st_size > _LARGEST_BYTES:
                raise InputError(f'{path}: must be smaller than {_LARGEST_BYTES} bytes')
            text = path.read_text(encoding='utf-8')
            is_json = path.suffix.lower() == '.json'
            tables = json.loads(text) if is_json else tomllib.loads(text)
        except OSError as error:
            raise InputError(f'{path}: cannot be read: {error.strerror}') from error
        except UnicodeDecodeError as error:
            raise InputError(f'{path}: is not a text file in UTF-8 (byte {error.start})') \
                from error
        except (tomllib.TOMLDecodeError, json.JSONDecodeError, RecursionError) as error:
            kind = 'JSON' if path.suffix.lower() == '.json' else 'TOML'
            raise InputError(f'{path}: is not {kind}: {" ".join(str(error).split())}') from error
        if not isinstance(tables, dict):
            raise InputError(f'{path}: must hold elements by their names, got {shown(tables)}')
        return cls(path, tables)

    @property
    def major(self) -> int:
        """Number before the first dot of the version that saved it, 0 if it does not say."""
        first = str(self.tables.get('ross_version', '')).partition('.')[0]
        return int(first) if first.isascii() and first.isdigit() and len(first) < 10 else 0

    def error(self, place: str, problem: str) -> InputError:
        """Return the error to raise at a place of the file."""
        return InputError(': '.join(filter(None, (str(self.path), one_line(place), problem))))

    def of_kind(self, *kinds: str) -> Iterator[tuple[str, Table]]:
        """Yield title and content of the elements of some classes of ROSS."""
        for title, table in self.tables.items():
            if isinstance(table, dict) and title.startswith(kinds) and 'n' in table:
                yield title, table

    def node(self, title: str, table: Table) -> int:
        """Return the node on which an element stands or begins."""
        node = table.get('n')
        if not isinstance(node, int) or isinstance(node, bool) or node < 0:
            raise self.error(f'{title}.n', f'must be the number of a node, got {shown(node)}')
        return node

    def number(
        self, title: str, table: Table, key: str, default: float | None = None,
    ) -> float:
        """Return a finite number; without a default it has to be there, else a fault is kept."""
        value = table.get(key, default)
        if value is None:
            return self.kept(f'{title}.{key}', 'is missing')
        if not _is_number(value):
            return self.kept(f'{title}.{key}', f'must be a finite number, got {shown(value)}')
        return float(value)

    def kept(self, place: str, problem: str) -> float:
        """Keep a fault; return a number in place of what is none."""
        self.faults[str(self.error(place, problem))] = None
        return 1.0

    @contextmanager
    def telling_all(self) -> Iterator[None]:
        """Raise one InputError with every fault that was kept, and with one that ends it."""
        try:
            yield
        except InputError as error:
            self.faults[str(error)] = None
        if self.faults:
            raise InputError('\n'.join(self.faults))

    def numbers(self, title: str, table: Table, key: str, unit: str) -> list[float]:
        """Return coefficients, of which older files have one as a bare number."""
        values = table.get(key)
        if not isinstance(values, list):
            return [self.number(title, table, key)]
        for value in values:
            if not _is_number(value):
                self.kept(f'{title}.{key}', f'must be finite numbers in {unit}, '
                                             f'got {shown(value)}')
                return [float(number) for number in range(len(values))]
        if not values:
            return [self.kept(f'{title}.{key}', 'is empty')]
        return [float(value) for value in values]


@dataclass
class RossReader:
    """
    Turns a part of a file into what a case holds of it.

    Attributes
    ----------
    file : RossFile
        The saved rotor.
    assumed, lost : lists of str
        Where it notes what was decided, and what could not be carried over.

    """

    file: RossFile
    assumed: list[str]
    lost: list[str]
