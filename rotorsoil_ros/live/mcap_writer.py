"""
How a batch of messages becomes MCAP at a few microseconds a message.

`mcap.writer.Writer` takes 8 to 12 us for each; here a message is one packed header and one
list entry, and the records around them are written by the `mcap` package as ever.
"""

from collections import defaultdict
from collections.abc import Mapping, Sequence
import io
import struct
from typing import BinaryIO
import zlib

from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    Channel,
    Chunk,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    McapRecord,
    Schema,
    Statistics,
    SummaryOffset,
)
from mcap.writer import MCAP0_MAGIC
import zstandard

CHUNK_SIZE = 1 << 20
ZSTD_LEVEL = 1  # twice as fast as 3, and float64 noise does not get smaller
MESSAGE_HEADER = struct.Struct('<BQHIQQ')
INDEX_HEADER = struct.Struct('<BQHI')
INDEX_ENTRY = struct.Struct('<QQ')
FOOTER_BODY = struct.Struct('<BQQQ')
SKIPPED = len(MESSAGE_HEADER.pack(0, 0, 0, 0, 0, 0)) - 9  # counts in the length of a message
LAST_STAMP = (1 << 64) - 1


class McapWriter:
    """
    Write messages in the order in which they come, chunked, compressed, indexed, checked.

    The stream must not buffer: a write that fails leaves it as it was before, so that it can
    be closed. What did not reach it is not counted.
    """

    def __init__(self, stream: BinaryIO, *, profile: str, library: str) -> None:
        self.size = self.index_size = 0  # bytes
        self.counts: dict[int, int] = defaultdict(int)
        self.start_ns, self.end_ns = LAST_STAMP, 0
        self.longest_ns = 0
        self._first_ns: dict[int, int] = {}
        self._stream = stream
        self._crc = 0
        self._schemas: list[Schema] = []
        self._channels: list[Channel] = []
        self._sequences: dict[int, int] = defaultdict(int)
        self._chunk_indexes: list[bytes] = []
        self._compressor = zstandard.ZstdCompressor(level=ZSTD_LEVEL)
        self._begin_chunk()
        self._write(MCAP0_MAGIC + _bytes(Header(profile, library)))

    def add_schema(self, name: str, encoding: str, definition: str) -> int:
        """Say how messages of a type are read; return the number of the schema."""
        schema = Schema(
            id=len(self._schemas) + 1, name=name, encoding=encoding, data=definition.encode())
        self._schemas.append(schema)
        self._append(_bytes(schema))
        return schema.id

    def add_channel(self, topic: str, schema: int, metadata: Mapping[str, str]) -> int:
        """Announce a topic; return the number of the channel."""
        channel = Channel(
            id=len(self._channels) + 1, topic=topic, message_encoding='cdr', schema_id=schema,
            metadata=dict(metadata))
        self._channels.append(channel)
        self._append(_bytes(channel))
        return channel.id

    def add_messages(
        self, channel: int, log_time_ns: Sequence[int], payloads: Sequence[bytes],
    ) -> None:
        """Append messages of one channel."""
        index, sequence = self._index[channel], self._sequences[channel]
        append, pack = self._parts.append, MESSAGE_HEADER.pack
        for stamp, payload in zip(log_time_ns, payloads, strict=True):
            index.append((stamp, self._filled))
            length = len(payload) + SKIPPED
            append(pack(Opcode.MESSAGE, length, channel, sequence & 0xffffffff, stamp, stamp))
            append(payload)
            self._filled += length + 9
            sequence += 1
        self._sequences[channel] = sequence
        if self._filled > CHUNK_SIZE:
            self._end_chunk()

    def flush(self) -> None:
        """Put everything that has come so far into the file."""
        self._end_chunk()

    def close(self) -> None:
        """Write the indexes; the stream stays open, and what has failed may be tried again."""
        self._end_chunk()
        end = _bytes(DataEnd(self._crc))
        summary, start = io.BytesIO(), self.size + len(end)
        groups = [[_bytes(schema) for schema in self._schemas],
                  [_bytes(channel) for channel in self._channels],
                  [_bytes(self._statistics())], self._chunk_indexes]
        offsets = [_write_group(group, summary, start) for group in groups if group]
        offsets_start = start + summary.tell()
        summary.write(b''.join(_bytes(offset) for offset in offsets))
        body = summary.getvalue()
        crc = zlib.crc32(FOOTER_BODY.pack(Opcode.FOOTER, 20, start, offsets_start),
                         zlib.crc32(body))
        self._write(end + body + _bytes(Footer(start, offsets_start, crc)) + MCAP0_MAGIC)

    def _begin_chunk(self) -> None:
        self._parts: list[bytes] = []
        self._filled = 0
        self._index: dict[int, list[tuple[int, int]]] = defaultdict(list)

    def _append(self, record: bytes) -> None:
        self._parts.append(record)
        self._filled += len(record)

    def _end_chunk(self) -> None:
        """Compress what has come and write it with the index of its messages."""
        if not any(self._index.values()):
            return
        body, index = b''.join(self._parts), self._index
        self._begin_chunk()
        stamps = [stamp for entries in index.values() for stamp, _ in entries]
        times = {'message_start_time': min(stamps), 'message_end_time': max(stamps)}
        data = self._compressor.compress(body)
        chunk = _bytes(Chunk(
            compression='zstd', data=data, uncompressed_crc=zlib.crc32(body),
            uncompressed_size=len(body), **times))
        indexes, offsets, at = [chunk], {}, self.size + len(chunk)
        for channel, entries in index.items():
            offsets[channel] = at
            indexes.append(_message_index(channel, entries))
            at += len(indexes[-1])
        entry = _bytes(ChunkIndex(
            chunk_length=len(chunk), chunk_start_offset=self.size, compression='zstd',
            compressed_size=len(data), uncompressed_size=len(body),
            message_index_length=at - self.size - len(chunk), message_index_offsets=offsets,
            **times))
        self._write(b''.join(indexes))
        self._count(entry, index, times)

    def _count(
        self, entry: bytes, index: Mapping[int, list[tuple[int, int]]], times: Mapping[str, int],
    ) -> None:
        """Take note of a chunk that has reached the file."""
        self._chunk_indexes.append(entry)
        self.index_size += len(entry)
        for channel, entries in index.items():
            self.counts[channel] += len(entries)
            first = self._first_ns.setdefault(channel, entries[0][0])
            self.longest_ns = max(self.longest_ns, entries[-1][0] - first)
        self.start_ns = min(self.start_ns, times['message_start_time'])
        self.end_ns = max(self.end_ns, times['message_end_time'])

    def _write(self, data: bytes) -> None:
        """Append all of it or nothing."""
        rest = memoryview(data)
        try:
            while rest:
                rest = rest[self._stream.write(rest):]
        except OSError:
            self._stream.seek(self._stream.truncate(self.size))
            raise
        self._crc = zlib.crc32(data, self._crc)
        self.size += len(data)

    def _statistics(self) -> Statistics:
        counts = {channel: count for channel, count in self.counts.items() if count}
        return Statistics(
            attachment_count=0, metadata_count=0, channel_count=len(self._channels),
            schema_count=len(self._schemas), chunk_count=len(self._chunk_indexes),
            channel_message_counts=counts, message_count=sum(counts.values()),
            message_start_time=self.start_ns if counts else 0, message_end_time=self.end_ns)


def _bytes(record: McapRecord) -> bytes:
    builder = RecordBuilder()
    record.write(builder)
    return bytes(builder.end())  # type: ignore[no-untyped-call]


def _message_index(channel: int, entries: list[tuple[int, int]]) -> bytes:
    """Return a MessageIndex record: when and where in its chunk each message is."""
    body = b''.join([INDEX_ENTRY.pack(*entry) for entry in entries])
    return INDEX_HEADER.pack(Opcode.MESSAGE_INDEX, len(body) + 6, channel, len(body)) + body


def _write_group(records: Sequence[bytes], summary: io.BytesIO, start: int) -> SummaryOffset:
    """Write records of one kind into the summary; return where they are."""
    before = summary.tell()
    summary.write(b''.join(records))
    return SummaryOffset(records[0][0], start + before, summary.tell() - before)
