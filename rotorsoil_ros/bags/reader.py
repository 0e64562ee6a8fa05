"""What does a bag hold? Its messages in the order in which they were received, chunk by chunk."""

from bisect import bisect_left
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
import errno
import io
from itertools import groupby, pairwise
from pathlib import Path
import statistics
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
import zstandard

from rotorsoil_ros.bags.metadata import files, FOREIGN
from rotorsoil_ros.errors import InputError
from rotorsoil_ros.events import LAST_STAMP
from rotorsoil_ros.wire.dating import LONGEST_NS
from rotorsoil_ros.wire.definitions import ros_name
from rotorsoil_ros.wire.messages import Records

RECORD_HEADER = struct.Struct('<BQ')
MESSAGE_HEADER = struct.Struct('<HIQQ')
ZSTD_MAGIC = b'\x28\xb5\x2f\xfd'
CDR = 'cdr'
LARGEST_RECORD = 1 << 28  # [bytes]; a file that claims more is broken or hostile
MOST_WAITING = 1 << 18  # messages of chunks that overlap; beyond, order gives way to memory
LOOSE = 1000  # messages without a chunk are handed on in portions of so many
SAMPLE = 100  # messages at the beginning of a file, of whose times the middle one is believed
BROKEN = (McapError, struct.error, zstandard.ZstdError, RuntimeError, UnicodeDecodeError,
          OverflowError)

Tell: TypeAlias = Callable[[str], object]
Wanted: TypeAlias = Callable[[str, str], bool]
Picks: TypeAlias = Callable[['Source'], bool]
Entry: TypeAlias = tuple['Source', int, bytes]


@dataclass(frozen=True, slots=True)
class Source:
    """
    A channel of a bag: its topic, the type of its messages and how they are encoded.

    `definition` is the `ros2msg` schema of the type, where the bag tells it.
    """

    topic: str
    type: str
    encoding: str = CDR
    definition: str = field(default='', compare=False, repr=False)


def sources(path: Path, *, tell: Tell = lambda text: None) -> Counter[Source]:
    """Return how many messages there are of every channel of a bag or MCAP file."""
    from rotorsoil_ros.bags import foreign  # which itself needs this room

    found, cut = Counter[Source](), list[str]()
    for file in files(path):
        found.update(foreign.counted(file) if file.suffix in FOREIGN
                     else _counted(file) or _counted_one_by_one(file, cut.append))
    if cut and not found:
        raise InputError(f'{"; ".join(cut)}, where nothing is')
    for text in cut:
        tell(text)
    return found


def messages(
    path: Path, wanted: Wanted, *, tell: Tell = lambda text: None,
) -> Iterator[tuple[Source, int, bytes]]:
    """Read source, time of reception [ns] and CDR of every wanted message, one by one."""
    for file in files(path):
        for chunk in _chunks(file, wanted, tell):
            yield from chunk


def batches(
    path: Path, wanted: Wanted, *, at_most: int, span_ns: int = LAST_STAMP,
    tell: Tell = lambda text: None,
) -> Iterator[Records]:
    """
    Read wanted messages as batches of one topic; memory does not grow with the bag.

    Parameters
    ----------
    path : Path
        Bag directory or MCAP file.
    wanted : callable
        Whether a topic of a type is wanted; what is not CDR never is.
    at_most : int
        Messages in a batch.
    span_ns : int
        Topics are apart by no more than this [ns]: where it matters what is told together.
    tell : callable
        Hears, file by file, what was left out.

    """
    for file in files(path):
        for chunk in _chunks(file, wanted, tell):
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


@contextmanager
def opened(file: Path) -> Iterator[tuple[BinaryIO, bool]]:
    """Open an MCAP file, with whether it was finished; say in one line what is wrong with it."""
    try:
        with file.open('rb') as stream:
            magic = stream.read(len(MCAP0_MAGIC))
            if magic.startswith(ZSTD_MAGIC):
                raise InputError(f'{file}: is compressed as a whole; unpack it with `zstd -d`')
            if magic != MCAP0_MAGIC:
                raise InputError(f'{file}: is not an MCAP file')
            size = stream.seek(0, io.SEEK_END)
            stream.seek(-len(MCAP0_MAGIC), io.SEEK_END)
            is_finished = stream.read() == MCAP0_MAGIC and size >= 2 * len(MCAP0_MAGIC)
            stream.seek(0)
            yield stream, is_finished
    except OSError as error:
        # A place that no file has comes from an index that somebody damaged.
        said = 'is damaged' if error.errno == errno.EINVAL else error.strerror
        raise InputError(f'{file}: {said}') from error
    except InputError:
        raise
    except (*BROKEN, ValueError) as error:  # the library lets places of damaged indexes through
        raise InputError(f'{file}: is damaged ({error or type(error).__name__}); '
                         '`rotorsoil recover` saves the rest') from error


def _summary(stream: BinaryIO) -> Summary | None:
    """Return what a finished file says of itself, if it says all: every part of it is optional."""
    stream.seek(0)
    summary = SeekingReader(stream, record_size_limit=LARGEST_RECORD).get_summary()
    if summary is None or summary.statistics is None:
        return None
    said = summary.statistics
    is_whole = (said.channel_message_counts.keys() <= summary.channels.keys()
                and sum(said.channel_message_counts.values()) == said.message_count
                and len(summary.chunk_indexes) == said.chunk_count)
    return summary if is_whole else None


def _counted(file: Path) -> Counter[Source] | None:
    """Return the messages of every channel as a file sums them up; None where it does not."""
    with opened(file) as (stream, is_finished):
        summary = _summary(stream) if is_finished else None
    if summary is None or summary.statistics is None:
        return None
    said = summary.statistics.channel_message_counts
    found: Counter[Source] = Counter()
    for channel in summary.channels.values():
        found[_source(channel, summary.schemas)] += said.get(channel.id, 0)
    return found


def _counted_one_by_one(file: Path, tell: Tell) -> Counter[Source]:
    contents, found = Contents(lambda source: True, with_payloads=False), Counter[Source]()
    with opened(file) as (stream, is_finished):
        for _ in _in_order(stream, contents, is_finished=is_finished, file=file, tell=tell):
            found.update(source for source, _, _ in contents.take())
        found.update(dict.fromkeys(contents.sources, 0))
    return found


def _chunks(file: Path, wanted: Wanted, tell: Tell) -> Iterator[list[Entry]]:
    """Read wanted messages chunk by chunk; chunks that overlap in time are merged."""
    if file.suffix in FOREIGN:
        from rotorsoil_ros.bags import foreign

        yield from foreign.portions(file, wanted, tell)
        return
    with opened(file) as (stream, is_finished):
        contents = Contents(
            lambda source: source.encoding == CDR and wanted(source.topic, source.type),
            around_ns=usual_time(stream))
        summary = _summary(stream) if is_finished else None
        if summary is not None and _overlap(summary.chunk_indexes):
            yield from _merged(stream, summary, contents)
        else:
            for _ in _in_order(
                    stream, contents, is_finished=is_finished, file=file, tell=tell):
                yield sorted(contents.take(), key=_time)
    for source, times in contents.wrong_times.items():
        tell(f'{file}: {source.topic}: {len(times)} messages with an impossible time are left '
             f'out, the first at {times[0]} ns')


def usual_time(stream: BinaryIO) -> int | None:
    """Return the time around which those of a file lie, by its first messages [ns]."""
    contents = Contents(lambda source: True, with_payloads=False)
    stream.seek(len(MCAP0_MAGIC))
    try:
        while len(contents.entries) < SAMPLE and contents.read(stream) not in ENDS:
            pass
    except BROKEN:  # whoever reads on will meet it again
        pass
    return statistics.median_high([time for _, time, _ in contents.entries] or [0]) or None


ENDS = (Opcode.DATA_END, Opcode.FOOTER)


def _in_order(
    stream: BinaryIO, contents: 'Contents', *, is_finished: bool, file: Path, tell: Tell,
) -> Iterator[None]:
    """Read records in the order of the file, in portions; one that is cut off up to there."""
    stream.seek(len(MCAP0_MAGIC))
    try:
        while (opcode := contents.read(stream)) not in ENDS:
            if opcode == Opcode.CHUNK or len(contents.entries) >= LOOSE:
                yield
    except BROKEN:
        if is_finished:
            raise
    yield
    if not is_finished:
        tell(f'{file}: was never finished; it is read up to its break')


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


def _source(channel: Channel, schemas: Mapping[int, Schema]) -> Source:
    schema = schemas.get(channel.schema_id)
    name, encoding = schema.name if schema else '', channel.message_encoding
    told = (schema.data.decode(errors='replace')
            if schema and schema.encoding == 'ros2msg' else '')
    return Source(channel.topic, ros_name(name) if encoding == CDR else name, encoding, told)


class Contents:
    """What of a file has been read and not yet taken."""

    def __init__(
        self, picks: Picks, *, around_ns: int | None = None, with_payloads: bool = True,
    ) -> None:
        self.entries: list[Entry] = []
        self.wrong_times: dict[Source, list[int]] = {}
        self._picks = picks
        self._with_payloads = with_payloads
        self._earliest_ns, self._latest_ns = possible_times(around_ns)
        self._schemas: dict[int, Schema] = {}
        self._sources: dict[int, tuple[Source, bool]] = {}

    @property
    def sources(self) -> list[Source]:
        """All that were announced so far."""
        return [source for source, _ in self._sources.values()]

    def take(self) -> list[Entry]:
        """Hand over what was read."""
        entries, self.entries = self.entries, []
        return entries

    def learn(self, summary: Summary) -> None:
        """Take schemas and channels from the summary: chunks will not come in their order."""
        self._schemas |= summary.schemas
        for channel in summary.channels.values():
            self._announce(channel)

    def read(self, stream: BinaryIO) -> int:
        """Read the next record of the file and return its kind."""
        opcode, length = RECORD_HEADER.unpack(stream.read(RECORD_HEADER.size))
        if length > LARGEST_RECORD or not opcode:
            raise McapError(f'a record of kind {opcode} and {length} bytes')
        if opcode in (Opcode.SCHEMA, Opcode.CHANNEL, Opcode.MESSAGE, Opcode.CHUNK):
            content = stream.read(length)
            if len(content) < length:
                raise McapError('a record that ends after the file')
            if opcode == Opcode.CHUNK:
                self._unpack(unpacked(content))
            else:
                self._add(opcode, content, 0, length)
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
            if channel not in self._sources:
                raise McapError(f'a message of an unknown channel {channel}')
            source, is_wanted = self._sources[channel]
            if not is_wanted:
                return
            if not self._earliest_ns <= log_time <= self._latest_ns:
                self.wrong_times.setdefault(source, []).append(log_time)
                return
            payload = body[at + MESSAGE_HEADER.size:at + length] if self._with_payloads else b''
            self.entries.append((source, log_time, payload))
        elif opcode == Opcode.SCHEMA:
            schema = Schema.read(ReadDataStream(io.BytesIO(body[at:at + length])))
            self._schemas[schema.id] = schema
        elif opcode == Opcode.CHANNEL:
            self._announce(Channel.read(ReadDataStream(io.BytesIO(body[at:at + length]))))

    def _announce(self, channel: Channel) -> None:
        if channel.id not in self._sources:
            source = _source(channel, self._schemas)
            self._sources[channel.id] = source, self._picks(source)


def possible_times(around_ns: int | None) -> tuple[int, int]:
    """Return the earliest and the latest time that a file may tell, by one that it does [ns]."""
    if around_ns is None:
        return 0, LAST_STAMP
    return max(0, around_ns - LONGEST_NS), min(LAST_STAMP, around_ns + LONGEST_NS)


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
