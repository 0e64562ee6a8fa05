"""What do bags hold that are no MCAP? SQLite of ROS 2, and ROS 1, read as everything else is."""

from collections import Counter
from collections.abc import Iterator
from contextlib import closing
from itertools import islice
from pathlib import Path
import sqlite3
from typing import Any

from rotorsoil_ros.bags.metadata import SQLITE
from rotorsoil_ros.bags.reader import CDR, Entry, Picks, Source, Tell, Wanted
from rotorsoil_ros.errors import InputError
from rotorsoil_ros.events import LAST_STAMP
from rotorsoil_ros.wire.definitions import ros_name

PORTION = 1000  # messages that are handed on together




def counted(file: Path) -> Counter[Source]:
    """Return how many messages there are of every channel of a file."""
    return _counted_in_sqlite(file) if file.suffix == SQLITE else _counted_in_ros1(file)


def portions(file: Path, wanted: Wanted, tell: Tell) -> Iterator[list[Entry]]:
    """Read the messages that are wanted in the order of their reception, some at a time."""
    def picks(source: Source) -> bool:
        return source.encoding == CDR and wanted(source.topic, source.type)

    entries = (_entries_in_sqlite if file.suffix == SQLITE else _entries_in_ros1)(file, picks)
    left_out = 0
    while portion := list(islice(entries, PORTION)):
        kept = [entry for entry in portion if 0 <= entry[1] <= LAST_STAMP]
        left_out += len(portion) - len(kept)
        yield kept
    if left_out:
        tell(f'{file}: {left_out} messages with an impossible time are left out')


def _opened(file: Path) -> sqlite3.Connection:
    # What a recorder has left is not written to, not even its journal.
    return sqlite3.connect(f'{file.resolve().as_uri()}?mode=ro&immutable=1', uri=True)


def _sqlite_sources(base: sqlite3.Connection) -> dict[int, Source]:
    tables = {name for (name,) in base.execute('SELECT name FROM sqlite_master')}
    told: dict[str, str] = {}
    if 'message_definitions' in tables:  # since Iron
        told = {str(kind): str(text) for kind, encoding, text in base.execute(
            'SELECT topic_type, encoding, encoded_message_definition FROM message_definitions')
            if encoding == 'ros2msg'}
    return {int(number): Source(str(topic), ros_name(str(kind)), str(encoding),
                                told.get(str(kind), ''))
            for number, topic, kind, encoding in base.execute(
                'SELECT id, name, type, serialization_format FROM topics')}


def _counted_in_sqlite(file: Path) -> Counter[Source]:
    found: Counter[Source] = Counter()
    try:
        with closing(_opened(file)) as base:
            sources = _sqlite_sources(base)
            numbers = dict(base.execute('SELECT topic_id, COUNT(*) FROM messages GROUP BY 1'))
            for number, source in sources.items():
                found[source] += int(numbers.get(number, 0))
    except sqlite3.Error as error:
        raise _damaged(file, error) from error
    return found


def _entries_in_sqlite(file: Path, picks: Picks) -> Iterator[Entry]:
    try:
        with closing(_opened(file)) as base:
            sources = {number: source for number, source in _sqlite_sources(base).items()
                       if picks(source)}
            marks = ','.join('?' * len(sources))
            for number, time, cdr in base.execute(
                    f'SELECT topic_id, timestamp, data FROM messages WHERE topic_id IN ({marks}) '
                    'ORDER BY timestamp, id', list(sources)):
                yield sources[number], int(time), bytes(cdr)
    except sqlite3.Error as error:
        raise _damaged(file, error) from error


def _damaged(file: Path, error: sqlite3.Error) -> InputError:
    return InputError(f'{file}: is no bag of ROS 2, or damaged ({error}); `ros2 bag convert` may '
                      'save it as MCAP')


class _Ros1Bag:
    """A bag of ROS 1, whose messages are turned into those of ROS 2 byte by byte."""

    def __init__(self, file: Path) -> None:
        try:
            from rosbags.rosbag1 import Reader, ReaderError
            from rosbags.typesys import get_types_from_msg, get_typestore, Stores
        except ImportError as error:
            raise InputError(
                f'{file}: is a bag of ROS 1: pip install "rotorsoil_ros[bags]" reads it, or '
                f'`rosbags-convert --src {file} --dst {file.stem} --dst-storage mcap` converts '
                'it') from error
        try:
            self.reader = Reader(file)
            self.reader.open()
        except (ReaderError, OSError, ValueError, AssertionError) as error:
            raise InputError(f'{file}: is no bag of ROS 1, or damaged ({error})') from error
        self.store = get_typestore(Stores.ROS2_JAZZY)
        self.sources: dict[Any, Source] = {}
        for connection in self.reader.connections:
            known = get_types_from_msg(connection.msgdef.data, connection.msgtype)
            self.store.register({name: kind for name, kind in known.items()
                                 if name not in self.store.fielddefs})
            told, _ = self.store.generate_msgdef(connection.msgtype, ros_version=2)
            self.sources[connection.id] = Source(
                connection.topic, connection.msgtype, CDR, told)

    def close(self) -> None:
        """Close the file."""
        self.reader.close()


def _counted_in_ros1(file: Path) -> Counter[Source]:
    found: Counter[Source] = Counter()
    with closing(_Ros1Bag(file)) as bag:
        for connection in bag.reader.connections:
            found[bag.sources[connection.id]] += connection.msgcount
    return found


def _entries_in_ros1(file: Path, picks: Picks) -> Iterator[Entry]:
    with closing(_Ros1Bag(file)) as bag:
        wanted = [connection for connection in bag.reader.connections
                  if picks(bag.sources[connection.id])]
        if not wanted:
            return
        for connection, time, raw in bag.reader.messages(connections=wanted):
            cdr = bag.store.ros1_to_cdr(raw, connection.msgtype)
            yield bag.sources[connection.id], int(time), bytes(cdr)
