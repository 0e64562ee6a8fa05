"""Where tables wait for the next start, and how one knows that they are the right ones."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, is_dataclass
import hashlib
import json
import logging
import os
from pathlib import Path
import tempfile
from typing import Any, Protocol, TypeVar
import zipfile
import zlib

import numpy as np

# To be raised whenever the physics gives other numbers for the same case: old tables must go.
ALGORITHM = 3

# A table that one user computes serves the service of another: temporary files are private.
READABLE = 0o644

_KEY = '__key__'
_LOG = logging.getLogger(__name__)

# What reading a damaged or foreign .npz raises.
_UNREADABLE = (OSError, EOFError, KeyError, ValueError, TypeError, MemoryError, RuntimeError,
               zipfile.BadZipFile, zlib.error)


class Storable(Protocol):
    """A table that can be taken apart."""

    def to_arrays(self) -> dict[str, Any]:
        """Return all of it as plain arrays."""
        ...


_Table = TypeVar('_Table', bound=Storable)


def directory(chosen: str | Path | None = None) -> Path:
    """Return the directory of the cache: the chosen one, $ROTORSOIL_CACHE, or the user's."""
    if chosen is not None:
        return Path(chosen)
    if os.environ.get('ROTORSOIL_CACHE'):
        return Path(os.environ['ROTORSOIL_CACHE'])
    if os.environ.get('XDG_CACHE_HOME'):
        return Path(os.environ['XDG_CACHE_HOME']) / 'rotorsoil'
    return Path.home() / '.cache' / 'rotorsoil'


def content_key(*parts: object) -> str:
    """
    Return what identifies a computation: the same for equal content, in every process.

    Parameters
    ----------
    parts
        Numbers, strings, arrays, dataclasses and sequences of them that determine the result.

    Returns
    -------
    str
        SHA-256 of their canonical form, in hexadecimal digits.

    """
    canonical = json.dumps([ALGORITHM, *parts], default=_plain, sort_keys=True, allow_nan=False)
    return hashlib.sha256(canonical.encode()).hexdigest()


def _plain(value: Any) -> object:
    if is_dataclass(value) and not isinstance(value, type):
        named = {field.name: getattr(value, field.name) for field in fields(value)}
        return [type(value).__name__, named]
    if isinstance(value, np.ndarray):
        parts = value.view(float) if np.iscomplexobj(value) else value
        return [str(value.dtype), parts.tolist()]
    raise TypeError(f'{type(value).__name__} cannot be part of a key')


def _label(key: str, arrays: Mapping[str, np.ndarray]) -> str:
    # Names and content too: damage to a zip's directory can lose or exchange an array without a
    # checksum of the zip failing, and a copy may be torn.
    content = hashlib.sha256()
    for name in sorted(arrays):
        content.update(f'{name} {arrays[name].dtype} {arrays[name].shape}'.encode())
        content.update(np.ascontiguousarray(arrays[name]).tobytes())
    return f'{key} {content.hexdigest()}'


@dataclass(frozen=True)
class Cache:
    """
    Arrays in files of a directory, each under the key of what determined it.

    A file that is not what it should be, and a directory that cannot be written, are logged
    as warnings: the caller computes again, and nothing wrong is ever returned.

    Attributes
    ----------
    directory : Path
        Where the files lie; it comes into being with the first of them.

    """

    directory: Path

    def path(self, kind: str, key: str) -> Path:
        """Return the file that holds, or would hold, the arrays of a key."""
        return self.directory / f'{kind}_{key}.npz'

    def kept(
        self, kind: str, key: str, *, rebuild: Callable[[dict[str, Any]], _Table],
        solve: Callable[[], _Table],
    ) -> _Table:
        """Return the table of a key, rebuilt of what is stored, or solved and stored now."""
        stored = self.load(kind, key)
        if stored is not None:
            return rebuild(stored)
        table = solve()
        self.store(kind, key, table.to_arrays())
        return table

    def load(self, kind: str, key: str) -> dict[str, np.ndarray] | None:
        """Return the arrays stored under a key, or None if they have to be computed."""
        path = self.path(kind, key)
        try:
            with path.open('rb') as stream, np.load(stream, allow_pickle=False) as stored:
                arrays = dict(stored)
                found = str(arrays.pop(_KEY))
        except FileNotFoundError:
            return None
        except _UNREADABLE as error:
            _LOG.warning('%s cannot be read and is computed again: %s', path, error)
            return None
        if found != _label(key, arrays):
            _LOG.warning('%s holds something else and is computed again: %s', path, found[:64])
            return None
        return arrays

    def store(self, kind: str, key: str, arrays: dict[str, np.ndarray]) -> None:
        """Store arrays under a key; a reader sees the whole file or none."""
        if any(array.dtype.hasobject for array in arrays.values()):
            raise TypeError('an array of objects would be pickled')
        path = self.path(kind, key)
        partial = None
        try:
            self.directory.mkdir(parents=True, exist_ok=True)
            with tempfile.NamedTemporaryFile(
                    dir=self.directory, prefix='.partial_', delete=False) as stream:
                partial = stream.name
                labelled: dict[str, Any] = {_KEY: np.array(_label(key, arrays)), **arrays}
                np.savez(stream, **labelled)
                os.fchmod(stream.fileno(), READABLE)
            os.replace(partial, path)
        except OSError as error:
            _LOG.warning('%s cannot be written: %s', path, error)
            if partial is not None:
                Path(partial).unlink(missing_ok=True)
