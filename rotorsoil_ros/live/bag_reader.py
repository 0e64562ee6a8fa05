"""What does a bag hold? Its messages in the order in which they were received, chunk by chunk."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
import io
from pathlib import Path
import struct
from typing import BinaryIO, TypeAlias
import zlib

import lz4.frame
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.reader import SeekingReader
from mcap.records import Channel, Chunk, Schema
from mcap.writer import MCAP0_MAGIC
import yaml
import zstandard

from rotorsoil_ros.live.messages import Records
from rotorsoil_ros.physics.errors import InputError

RECORD_HEADER = struct.Struct('<BQ')
MESSAGE_HEADER = struct.Struct('<HIQQ')
LARGEST_RECORD = 1 << 30  # [bytes]; a file that claims more is broken or hostile
LAST_STAMP = (1 << 63) - 1
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
        with _open(file) as stream:
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


def batches(path: Path, wanted: Wanted, *, at_most: int) -> Iterator[Records]:
    """Read wanted messages as batches of one topic; memory does not grow with the bag."""
    for file in files(path):
        for chunk in _chunks(file, wanted):
            by_source: dict[Source, list[Entry]] = {}
            for entry in chunk:
                by_source.setdefault(entry[0], []).append(entry)
            longest = max(map(len, by_source.values()), default=0)
            for start in range(0, longest, at_most):
                for source, entries in by_source.items():
                    if part := entries[start:start + at_most]:
                        yield Records(source.topic, source.type, [time for _, time, _ in part],
                                      [payload for _, _, payload in part])


def files(path: Path) -> list[Path]:
    """Return the MCAP files of a bag directory in their order, or the one file that it is."""
    if path.is_file():
        return [path]
    if not path.is_dir():
        raise InputError(f'{path}: no such file or bag directory')
    listed = _listed(path / 'metadata.yaml')
    found = [path / Path(name).name for name in listed] if listed else sorted(
        path.glob('*.mcap'), key=lambda file: (len(file.name), file.name))
    if not found or any(file.suffix != '.mcap' for file in found):
        raise InputError(f'{path}: holds no MCAP file; other storages must be converted first')
    return found


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
def _open(file: Path) -> Iterator[BinaryIO]:
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
        raise InputError(f'{file}: {error.strerror}') from error
    except BROKEN as error:
        raise InputError(f'{file}: is damaged ({error or type(error).__name__})') from error


def _chunks(file: Path, wanted: Wanted) -> Iterator[list[Entry]]:
    """Read a file chunk by chunk, wanted messages only."""
    contents = Contents(file, wanted)
    with _open(file) as stream:
        stream.seek(len(MCAP0_MAGIC))
        while (opcode := contents.read(stream)) not in (Opcode.DATA_END, Opcode.FOOTER):
            if opcode == Opcode.CHUNK or len(contents.entries) >= LOOSE:
                yield contents.take()
        yield contents.take()


class Contents:
    """What of a file has been read and not yet taken."""

    def __init__(self, file: Path, wanted: Wanted) -> None:
        self.entries: list[Entry] = []
        self._file = file
        self._wanted = wanted
        self._schemas: dict[int, str] = {0: ''}
        self._sources: dict[int, Source] = {}

    def take(self) -> list[Entry]:
        """Hand over what was read."""
        entries, self.entries = self.entries, []
        return entries

    def read(self, stream: BinaryIO) -> int:
        """Read the next record of the file and return its kind."""
        opcode, length = RECORD_HEADER.unpack(stream.read(RECORD_HEADER.size))
        if length > LARGEST_RECORD:
            raise InputError(f'{self._file}: is damaged (a record of {length} bytes)')
        if opcode in (Opcode.SCHEMA, Opcode.CHANNEL, Opcode.MESSAGE):
            self._add(opcode, stream.read(length), 0, length)
        elif opcode == Opcode.CHUNK:
            self._unpack(Chunk.read(ReadDataStream(io.BytesIO(stream.read(length)))))
        else:
            stream.seek(length, io.SEEK_CUR)
        return int(opcode)

    def _unpack(self, chunk: Chunk) -> None:
        body = self._decompressed(chunk)
        if chunk.uncompressed_crc and zlib.crc32(body) != chunk.uncompressed_crc:
            raise InputError(f'{self._file}: is damaged (a chunk fails its checksum)')
        at = 0
        while at < len(body):
            opcode, length = RECORD_HEADER.unpack_from(body, at)
            at += RECORD_HEADER.size
            self._add(opcode, body, at, length)
            at += length

    def _decompressed(self, chunk: Chunk) -> bytes:
        if chunk.uncompressed_size > LARGEST_RECORD:
            raise InputError(f'{self._file}: is damaged (a chunk of {chunk.uncompressed_size} B)')
        match chunk.compression:
            case '':
                return chunk.data
            case 'zstd':
                return zstandard.decompress(chunk.data, chunk.uncompressed_size)
            case 'lz4':
                return bytes(lz4.frame.decompress(chunk.data))
        raise InputError(f'{self._file}: unknown compression {chunk.compression!r}')

    def _add(self, opcode: int, body: bytes, at: int, length: int) -> None:
        """Keep a message that is wanted; learn from a schema or a channel."""
        if opcode == Opcode.MESSAGE:
            channel, _, log_time, _ = MESSAGE_HEADER.unpack_from(body, at)
            source = self._sources.get(channel)
            if source is None or log_time > LAST_STAMP:
                raise InputError(f'{self._file}: is damaged (channel {channel}, time {log_time})')
            if source.is_wanted:
                payload = body[at + MESSAGE_HEADER.size:at + length]
                self.entries.append((source, log_time, payload))
        elif opcode == Opcode.SCHEMA:
            schema = Schema.read(ReadDataStream(io.BytesIO(body[at:at + length])))
            self._schemas[schema.id] = schema.name
        elif opcode == Opcode.CHANNEL:
            channel = Channel.read(ReadDataStream(io.BytesIO(body[at:at + length])))
            if channel.id not in self._sources:
                self._sources[channel.id] = Source(
                    channel.topic, self._schemas.get(channel.schema_id, ''), self._wanted)
