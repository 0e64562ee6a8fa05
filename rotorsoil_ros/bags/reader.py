"""What does a bag hold? Its messages in the order in which they were received, chunk by chunk."""

from bisect import bisect_left
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
import errno
import io
from itertools import groupby, pairwise
from pathlib import Path
import re
import struct
from typing import BinaryIO, TypeAlias
import zlib

import lz4.frame
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.reader import SeekingReader
from mcap.records import Channel, Chunk, ChunkIndex, Schema
from mcap.summary import Summary
from mcap.writer import MCAP0_MAGIC
import yaml
import zstandard

from rotorsoil_ros.errors import InputError
from rotorsoil_ros.events import LAST_STAMP
from rotorsoil_ros.wire.messages import Records

RECORD_HEADER = struct.Struct('<BQ')
MESSAGE_HEADER = struct.Struct('<HIQQ')
LARGEST_RECORD = 1 << 28  # [bytes]; a file that claims more is broken or hostile
MOST_WAITING = 1 << 18  # messages of chunks that overlap; beyond, order gives way to memory
LOOSE = 1000  # messages without a chunk are handed on in portions of so many
BROKEN = (McapError, struct.error, zstandard.ZstdError, RuntimeError, UnicodeDecodeError,
          OverflowError)

Wanted: TypeAlias = Callable[[str, str], bool]
Entry: TypeAlias = tuple['Source', int, bytes]


class Source:
    """A topic of a bag, with its type."""

    def __init__(self, topic: str, message_type: str, wanted: Wanted) -> None:
        self.topic = topic
        self.type = message_type
        self.is_wanted = wanted(topic, message_type)


def topics(path: Path) -> dict[str, tuple[str, int]]:
    """Return type and number of messages of every topic in a bag or MCAP file."""
    found: dict[str, tuple[str, int]] = {}
    for file in files(path):
        with opened(file) as stream:
            summary = SeekingReader(stream, record_size_limit=LARGEST_RECORD).get_summary()
        if summary is None or summary.statistics is None:
            raise InputError(f'{file}: has no summary of its topics')
        for channel in summary.channels.values():
            schema = summary.schemas.get(channel.schema_id)
            number = summary.statistics.channel_message_counts.get(channel.id, 0)
            before = found.get(channel.topic, ('', 0))[1]
            found[channel.topic] = (schema.name if schema else '', number + before)
    return found


def messages(path: Path, wanted: Wanted) -> Iterator[tuple[Source, int, bytes]]:
    """Read topic, time of reception [ns] and CDR of every wanted message, one by one."""
    for file in files(path):
        for chunk in _chunks(file, wanted):
            yield from chunk


def batches(
    path: Path, wanted: Wanted, *, at_most: int, span_ns: int = LAST_STAMP,
) -> Iterator[Records]:
    """
    Read wanted messages as batches of one topic; memory does not grow with the bag.

    Parameters
    ----------
    path : Path
        Bag directory or MCAP file.
    wanted : callable
        Whether a topic of a type is wanted.
    at_most : int
        Messages in a batch.
    span_ns : int
        Topics are apart by no more than this [ns]: where it matters what is told together.

    """
    for file in files(path):
        for chunk in _chunks(file, wanted):
            for _, span in groupby(chunk, key=lambda entry: entry[1] // span_ns):
                yield from _by_topic(list(span), at_most)


def _by_topic(entries: Sequence[Entry], at_most: int) -> Iterator[Records]:
    by_source: dict[Source, list[Entry]] = {}
    for entry in entries:
        by_source.setdefault(entry[0], []).append(entry)
    longest = max(map(len, by_source.values()), default=0)
    for start in range(0, longest, at_most):
        for source, own in by_source.items():
            if part := own[start:start + at_most]:
                yield Records(source.topic, source.type, [time for _, time, _ in part],
                              [payload for _, _, payload in part])


def files(path: Path) -> list[Path]:
    """Return the MCAP files of a bag directory in their order, or the one file that it is."""
    if path.is_file():
        return [path]
    if not path.is_dir():
        raise InputError(f'{path}: no such file or bag directory')
    listed = _listed(path / 'metadata.yaml')
    found = [path / Path(name).name for name in listed] if listed else files_in(path)
    if not found or any(file.suffix != '.mcap' for file in found):
        raise InputError(f'{path}: holds no MCAP file; other storages must be converted first')
    return found


def files_in(bag: Path) -> list[Path]:
    """Return the MCAP files that lie in a directory, in the order of their numbers."""
    return sorted(bag.glob('*.mcap'), key=lambda file: (number_in(file.stem), file.name))


def number_in(name: str) -> int:
    """Return the last number in the name of a file of a bag, zero if it has none."""
    numbers = re.findall(r'_(\d+)', name)
    return int(numbers[-1][:18]) if numbers else 0


def _listed(path: Path) -> list[str]:
    """Return the files that a `metadata.yaml` names, none if it is not there."""
    if not path.is_file():
        return []
    try:
        document = yaml.safe_load(path.read_text(encoding='utf-8'))
        return [str(name) for name in document['rosbag2_bagfile_information'][
            'relative_file_paths']]
    except (yaml.YAMLError, UnicodeDecodeError, KeyError, TypeError) as error:
        raise InputError(f'{path}: is not the metadata of a bag') from error


@contextmanager
def opened(file: Path) -> Iterator[BinaryIO]:
    """Open an MCAP file that was finished; say in one line what is wrong with one that is not."""
    try:
        with file.open('rb') as stream:
            if stream.read(len(MCAP0_MAGIC)) != MCAP0_MAGIC:
                raise InputError(f'{file}: is not an MCAP file')
            stream.seek(-len(MCAP0_MAGIC), io.SEEK_END)
            if stream.read() != MCAP0_MAGIC:
                raise InputError(f'{file}: was never finished; `rotorsoil recover` saves its data')
            stream.seek(0)
            yield stream
    except OSError as error:
        # A place that no file has comes from an index that somebody damaged.
        said = 'is damaged' if error.errno == errno.EINVAL else error.strerror
        raise InputError(f'{file}: {said}') from error
    except InputError:
        raise
    except (*BROKEN, ValueError) as error:  # the library lets places of damaged indexes through
        raise InputError(f'{file}: is damaged ({error or type(error).__name__})') from error


def _chunks(file: Path, wanted: Wanted) -> Iterator[list[Entry]]:
    """Read wanted messages chunk by chunk; chunks that overlap in time are merged."""
    contents = Contents(wanted)
    with opened(file) as stream:
        summary = SeekingReader(stream, record_size_limit=LARGEST_RECORD).get_summary()
        if summary is not None and _overlap(summary.chunk_indexes):
            yield from _merged(stream, summary, contents)
            return
        stream.seek(len(MCAP0_MAGIC))
        while (opcode := contents.read(stream)) not in (Opcode.DATA_END, Opcode.FOOTER):
            if opcode == Opcode.CHUNK or len(contents.entries) >= LOOSE:
                yield sorted(contents.take(), key=_time)
        yield sorted(contents.take(), key=_time)


def _overlap(indexes: Sequence[ChunkIndex]) -> bool:
    return any(after.message_start_time < before.message_end_time
               for before, after in pairwise(indexes))


def _merged(stream: BinaryIO, summary: Summary, contents: 'Contents') -> Iterator[list[Entry]]:
    """Read chunks in the order of their first messages, and messages in that of their times."""
    contents.learn(summary)
    waiting: list[Entry] = []
    for index in sorted(summary.chunk_indexes, key=lambda index: index.message_start_time):
        waiting.sort(key=_time)
        cut = bisect_left(waiting, index.message_start_time, key=_time)
        cut = max(cut, len(waiting) - MOST_WAITING)
        yield waiting[:cut]
        stream.seek(index.chunk_start_offset)
        contents.read(stream)
        waiting = waiting[cut:] + contents.take()
    yield sorted(waiting, key=_time)


def _time(entry: Entry) -> int:
    return entry[1]


class Contents:
    """What of a file has been read and not yet taken."""

    def __init__(self, wanted: Wanted) -> None:
        self.entries: list[Entry] = []
        self._wanted = wanted
        self._schemas: dict[int, str] = {0: ''}
        self._sources: dict[int, Source] = {}

    def take(self) -> list[Entry]:
        """Hand over what was read."""
        entries, self.entries = self.entries, []
        return entries

    def learn(self, summary: Summary) -> None:
        """Take schemas and channels from the summary: chunks will not come in their order."""
        self._schemas |= {number: schema.name for number, schema in summary.schemas.items()}
        for channel in summary.channels.values():
            self._announce(channel)

    def read(self, stream: BinaryIO) -> int:
        """Read the next record of the file and return its kind."""
        opcode, length = RECORD_HEADER.unpack(stream.read(RECORD_HEADER.size))
        if length > LARGEST_RECORD:
            raise McapError(f'a record of {length} bytes')
        if opcode in (Opcode.SCHEMA, Opcode.CHANNEL, Opcode.MESSAGE):
            self._add(opcode, stream.read(length), 0, length)
        elif opcode == Opcode.CHUNK:
            self._unpack(unpacked(stream.read(length)))
        else:
            stream.seek(length, io.SEEK_CUR)
        return int(opcode)

    def _unpack(self, body: bytes) -> None:
        for opcode, at, length in inside(body):
            self._add(opcode, body, at, length)

    def _add(self, opcode: int, body: bytes, at: int, length: int) -> None:
        """Keep a message that is wanted; learn from a schema or a channel."""
        if opcode == Opcode.MESSAGE:
            channel, _, log_time, _ = MESSAGE_HEADER.unpack_from(body, at)
            source = self._sources.get(channel)
            if source is None or log_time > LAST_STAMP:
                raise McapError(f'channel {channel}, time {log_time}')
            if source.is_wanted:
                payload = body[at + MESSAGE_HEADER.size:at + length]
                self.entries.append((source, log_time, payload))
        elif opcode == Opcode.SCHEMA:
            schema = Schema.read(ReadDataStream(io.BytesIO(body[at:at + length])))
            self._schemas[schema.id] = schema.name
        elif opcode == Opcode.CHANNEL:
            self._announce(Channel.read(ReadDataStream(io.BytesIO(body[at:at + length]))))

    def _announce(self, channel: Channel) -> None:
        if channel.id not in self._sources:
            self._sources[channel.id] = Source(
                channel.topic, self._schemas.get(channel.schema_id, ''), self._wanted)


def unpacked(content: bytes) -> bytes:
    """
    Return the records in a Chunk record, decompressed and held against their checksum.

    Raises
    ------
    McapError, or another of BROKEN
        If they are damaged, or would not fit into memory.

    """
    chunk = Chunk.read(ReadDataStream(io.BytesIO(content)))
    size = chunk.uncompressed_size
    if size > LARGEST_RECORD:
        raise McapError(f'a chunk of {size} bytes')
    match chunk.compression:
        case '':
            body = chunk.data
        case 'zstd':
            # What the frame says of itself would be believed, and that much memory asked for.
            if zstandard.frame_content_size(chunk.data) not in (-1, size):
                raise McapError('a chunk of another size than it says')
            body = zstandard.decompress(chunk.data, size)
        case 'lz4':
            body = lz4.frame.LZ4FrameDecompressor().decompress(chunk.data, size + 1)
        case _:
            raise McapError(f'unknown compression {chunk.compression!r}')
    if len(body) != size or chunk.uncompressed_crc not in (0, zlib.crc32(body)):
        raise McapError('a chunk fails its checksum')
    return bytes(body)


def inside(body: bytes) -> Iterator[tuple[int, int, int]]:
    """Yield kind, place and length of every record of an unpacked chunk."""
    at = 0
    while at < len(body):
        opcode, length = RECORD_HEADER.unpack_from(body, at)
        at += RECORD_HEADER.size
        if length > len(body) - at:
            raise McapError('a record that ends outside of its chunk')
        yield opcode, at, length
        at += length
