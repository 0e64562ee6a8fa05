"""
How a batch of messages becomes MCAP at a few microseconds a message.

`mcap.writer.Writer` takes 8 to 12 us for each; here the headers of a whole chunk are packed at
once, and the records around them are written by the `mcap` package as ever.
"""

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
import io
from itertools import pairwise
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
import numpy as np
import zstandard

from rotorsoil_ros.arrays import IntArray

CHUNK_SIZE = 1 << 20
ZSTD_LEVEL = 1  # twice as fast as 3, and float64 noise does not get smaller
MESSAGE_RECORD = np.dtype([
    ('opcode', 'u1'), ('length', '<u8'), ('channel', '<u2'), ('sequence', '<u4'),
    ('log_time', '<u8'), ('publish_time', '<u8')])
HEADER_SIZE = MESSAGE_RECORD.itemsize
UNCOUNTED = 9  # opcode and length of a record do not count in its length
INDEX_HEADER = struct.Struct('<BQHI')
FOOTER_BODY = struct.Struct('<BQQQ')
LARGEST_STAMP = (1 << 64) - 1


@dataclass(slots=True)
class Messages:
    """
    What waits for its chunk.

    Attributes
    ----------
    front : list of bytes
        Records of schemas and channels, which come before the messages.
    channels, stamp_ns, payloads : lists
        One entry for each message.
    size : int
        Bytes of all of it.

    """

    front: list[bytes] = field(default_factory=list)
    channels: list[int] = field(default_factory=list)
    stamp_ns: list[int] = field(default_factory=list)
    payloads: list[bytes] = field(default_factory=list)
    size: int = 0

    def body(self, sequences: Mapping[int, int]) -> tuple[bytes, dict[int, IntArray]]:
        """
        Return the records in their order, and when and where those of each channel are.

        The latter are (n, 2) arrays of stamp [ns] and place. Sequences say how many messages
        a channel had before.
        """
        count, front = len(self.payloads), b''.join(self.front)
        length = np.fromiter(map(len, self.payloads), dtype=np.int64, count=count)
        headers = np.empty(count, dtype=MESSAGE_RECORD)
        headers['opcode'], headers['channel'] = Opcode.MESSAGE, self.channels
        headers['length'] = length + (HEADER_SIZE - UNCOUNTED)
        headers['log_time'] = headers['publish_time'] = self.stamp_ns
        place = np.cumsum(length + HEADER_SIZE) - length - HEADER_SIZE + len(front)
        entries = np.stack([headers['log_time'], place.astype(np.uint64)], axis=1)
        index = {}
        for channel, rows in _runs(headers['channel']):
            index[channel] = entries[rows]
            headers['sequence'][rows] = sequences.get(channel, 0) + np.arange(len(rows))
        packed = headers.tobytes()
        parts = [front] * (2 * count + 1)
        parts[1::2] = [packed[at:at + HEADER_SIZE] for at in range(0, len(packed), HEADER_SIZE)]
        parts[2::2] = self.payloads
        return b''.join(parts), index


class McapWriter:
    """
    Write messages in the order in which they come, chunked, compressed, indexed, checked.

    The stream must not buffer: a write that fails leaves it as it was before, so that it can
    be closed. What did not reach it is not counted.
    """

    def __init__(self, stream: BinaryIO, *, profile: str, library: str) -> None:
        self.size = self.index_size = 0  # bytes
        self.counts: dict[int, int] = defaultdict(int)
        self.start_ns, self.end_ns = LARGEST_STAMP, 0
        self.longest_ns = 0
        self._first_ns: dict[int, int] = {}
        self._spanning: set[int] = set()
        self._stream = stream
        self._crc = 0
        self._schemas: list[Schema] = []
        self._channels: list[Channel] = []
        self._sequences: dict[int, int] = defaultdict(int)
        self._chunk_indexes: list[bytes] = []
        self._compressor = zstandard.ZstdCompressor(level=ZSTD_LEVEL)
        self._waiting = Messages()
        self._write(MCAP0_MAGIC + _bytes(Header(profile, library)))

    def add_schema(self, name: str, encoding: str, definition: str) -> int:
        """Say how messages of a type are read; return the number of the schema."""
        schema = Schema(
            id=len(self._schemas) + 1, name=name, encoding=encoding, data=definition.encode())
        self._schemas.append(schema)
        self._append(_bytes(schema))
        return schema.id

    def add_channel(
        self, topic: str, schema: int, metadata: Mapping[str, str], *, spans: bool = True,
    ) -> int:
        """Announce a topic and whether it counts in `longest_ns`; return its channel."""
        channel = Channel(
            id=len(self._channels) + 1, topic=topic, message_encoding='cdr', schema_id=schema,
            metadata=dict(metadata))
        self._channels.append(channel)
        if spans:
            self._spanning.add(channel.id)
        self._append(_bytes(channel))
        return channel.id

    def add_messages(
        self, channel: int, log_time_ns: Sequence[int], payloads: Sequence[bytes],
    ) -> None:
        """Append messages of one channel."""
        waiting, count = self._waiting, len(payloads)
        if count == 1:  # the live node, where this counts
            waiting.channels.append(channel)
            waiting.stamp_ns.append(log_time_ns[0])
            waiting.payloads.append(payloads[0])
            waiting.size += len(payloads[0]) + HEADER_SIZE
        else:
            waiting.channels += [channel] * count
            waiting.stamp_ns += log_time_ns
            waiting.payloads += payloads
            waiting.size += sum(map(len, payloads)) + count * HEADER_SIZE
        if waiting.size > CHUNK_SIZE:
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

    def _append(self, record: bytes) -> None:
        self._waiting.front.append(record)
        self._waiting.size += len(record)

    def _end_chunk(self) -> None:
        """Compress what has come and write it with the index of its messages."""
        if not self._waiting.payloads:
            return
        waiting, self._waiting = self._waiting, Messages()
        body, index = waiting.body(self._sequences)
        times = {'message_start_time': min(waiting.stamp_ns),
                 'message_end_time': max(waiting.stamp_ns)}
        data = self._compressor.compress(body)
        chunk = _bytes(Chunk(
            compression='zstd', data=data, uncompressed_crc=zlib.crc32(body),
            uncompressed_size=len(body), **times))
        indexes, offsets, at = [chunk], {}, self.size + len(chunk)
        for channel, entries in index.items():
            offsets[channel] = at
            indexes.append(_message_index(channel, entries.tobytes()))
            at += len(indexes[-1])
            self._sequences[channel] += len(entries)
        entry = _bytes(ChunkIndex(
            chunk_length=len(chunk), chunk_start_offset=self.size, compression='zstd',
            compressed_size=len(data), uncompressed_size=len(body),
            message_index_length=at - self.size - len(chunk), message_index_offsets=offsets,
            **times))
        self._write(b''.join(indexes))
        self._count(entry, index, times)

    def _count(
        self, entry: bytes, index: Mapping[int, IntArray], times: Mapping[str, int],
    ) -> None:
        """Take note of a chunk that has reached the file."""
        self._chunk_indexes.append(entry)
        self.index_size += len(entry)
        for channel, entries in index.items():
            self.counts[channel] += len(entries)
            if channel in self._spanning:
                first = self._first_ns.setdefault(channel, int(entries[0, 0]))
                self.longest_ns = max(self.longest_ns, int(entries[-1, 0]) - first)
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


def _message_index(channel: int, entries: bytes) -> bytes:
    """Return a MessageIndex record: when and where in its chunk each message is."""
    length = len(entries) + INDEX_HEADER.size - UNCOUNTED
    return INDEX_HEADER.pack(Opcode.MESSAGE_INDEX, length, channel, len(entries)) + entries


def _runs(channels: IntArray) -> Iterator[tuple[int, IntArray]]:
    """Yield each channel once, with the rows that are of it, in their order."""
    order = np.argsort(channels, kind='stable')
    ends = np.flatnonzero(np.diff(channels[order].astype(int), prepend=-1, append=-1))
    for start, stop in pairwise(ends):
        yield int(channels[order[start]]), order[start:stop]


def _write_group(records: Sequence[bytes], summary: io.BytesIO, start: int) -> SummaryOffset:
    """Write records of one kind into the summary; return where they are."""
    before = summary.tell()
    summary.write(b''.join(records))
    return SummaryOffset(records[0][0], start + before, summary.tell() - before)
