"""What can be saved of a log whose writer was killed? Everything up to the break."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from datetime import datetime, UTC
import fcntl
import io
import logging
import os
from pathlib import Path
import shutil
from typing import BinaryIO

from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.reader import SeekingReader
from mcap.records import Channel, Header, Schema
from mcap.writer import CompressionType, MCAP0_MAGIC, Writer

from rotorsoil_ros.background import run_as_child
from rotorsoil_ros.bags import metadata as bag_metadata
from rotorsoil_ros.bags.metadata import BagContents, beside, FileEntry, files_in, Topic
from rotorsoil_ros.bags.reader import (
    BROKEN,
    inside,
    LARGEST_RECORD,
    MESSAGE_HEADER,
    opened,
    possible_times,
    RECORD_HEADER,
    unpacked,
    usual_time,
)
from rotorsoil_ros.errors import InputError, RotorSoilError
from rotorsoil_ros.events import NANOSECONDS

Progress = Callable[[int, int], None]


@dataclass(frozen=True, slots=True)
class Saved:
    """
    What was saved of a broken file.

    Attributes
    ----------
    messages : int
        How many.
    last_ns : int
        Latest time of a message [ns], zero if there is none.
    damaged_chunks : int
        Parts before the break that fail their checksum; what was in them is lost.
    wrong_times : int
        Messages that were left out because no such log can have their time.

    """

    messages: int = 0
    last_ns: int = 0
    damaged_chunks: int = 0
    wrong_times: int = 0

    def __add__(self, other: 'Saved') -> 'Saved':
        """Return what was saved of both."""
        return Saved(self.messages + other.messages, max(self.last_ns, other.last_ns),
                     self.damaged_chunks + other.damaged_chunks,
                     self.wrong_times + other.wrong_times)

    def __str__(self) -> str:
        """Say it in one line."""
        told = f'{self.messages} messages'
        if self.messages:
            when = datetime.fromtimestamp(self.last_ns // NANOSECONDS, UTC)
            told += f' until {when:%Y-%m-%d %H:%M:%S} UTC ({self.last_ns} ns)'
        if self.damaged_chunks:
            told += f', {self.damaged_chunks} damaged parts left out'
        if self.wrong_times:
            told += f', {self.wrong_times} with an impossible time left out'
        return told


def recover(broken: Path, out: Path, *, progress: Progress | None = None) -> Saved:
    """
    Write everything readable of an unfinished or damaged log into a fresh, indexed one.

    Parameters
    ----------
    broken, out : Path
        File or bag directory to read, which is not touched, and the same to write, which must
        not exist.
    progress : callable
        Called with the number of bytes read and their total.

    Raises
    ------
    InputError
        If `broken` is no MCAP file and no bag of such, or if `out` exists.

    """
    if out.exists():
        raise InputError(f'{out}: exists already, and nothing is ever overwritten')
    partial = out.with_name(f'{out.name}.partial')
    progress = progress or (lambda done, total: None)
    if not broken.is_dir():
        return _recover_file(broken, partial, out, progress)
    partial.mkdir()
    try:
        saved = _recover_bag(broken, partial, progress)
        os.replace(partial, out)
    finally:
        shutil.rmtree(partial, ignore_errors=True)
    return saved


def _recover_bag(broken: Path, out: Path, progress: Progress) -> Saved:
    """Recover every file of a bag and describe what comes of it."""
    saved, refused = Saved(), list[str]()
    for file in bag_metadata.without_recovered(files_in(broken)):
        target = out / file.name
        try:
            saved += _recover_file(file, target.with_suffix('.partial'), target, progress)
        except InputError as error:
            refused.append(str(error))
    if not any(out.iterdir()):
        raise InputError('; '.join(refused) or f'{broken}: holds no MCAP file')
    describe(out, files_in(out), bag_metadata.gaps(broken) | {
        f'refused_{number}': text for number, text in enumerate(refused, 1)})
    return saved


def _recover_file(broken: Path, partial: Path, out: Path, progress: Progress) -> Saved:
    with broken.open('rb') as stream:
        if stream.read(len(MCAP0_MAGIC)) != MCAP0_MAGIC:
            raise InputError(f'{broken}: is not an MCAP file')
        try:
            with partial.open('ab') as target:
                with suppress(OSError):  # a process whose node was killed may still be at it
                    fcntl.flock(target, fcntl.LOCK_EX)
                if out.exists():
                    raise InputError(f'{out}: exists already, and nothing is ever overwritten')
                target.truncate(0)
                saved = _copy(stream, target, progress)
                os.replace(partial, out)
        finally:
            partial.unlink(missing_ok=True)
    return saved


def describe(bag: Path, files: Sequence[Path], gaps: Mapping[str, str]) -> None:
    """Write the metadata of a bag anew, from what its finished files say of themselves."""
    entries: list[FileEntry] = []
    topics: dict[str, Topic] = {}
    counts = []
    for file in files:
        entry, own, count = _summary(file)
        entries.append(entry)
        topics |= own
        counts.append(count)
    bag_metadata.write(bag, BagContents(entries, topics, bag_metadata.total(counts)), gaps)


def _summary(file: Path) -> tuple[FileEntry, dict[str, Topic], dict[str, int]]:
    with opened(file) as (stream, _):
        summary = SeekingReader(stream, record_size_limit=LARGEST_RECORD).get_summary()
    if summary is None or summary.statistics is None:
        raise InputError(f'{file}: has no summary of its topics')
    said = summary.statistics
    topics, counts = dict[str, Topic](), dict[str, int]()
    for channel in summary.channels.values():
        schema = summary.schemas.get(channel.schema_id)
        topics[channel.topic] = Topic(channel.topic, schema.name if schema else '',
                                      channel.metadata.get('offered_qos_profiles', ''))
        counts[channel.topic] = (counts.get(channel.topic, 0)
                                 + said.channel_message_counts.get(channel.id, 0))
    entry = FileEntry(file.name, said.message_start_time,
                      said.message_end_time - said.message_start_time, said.message_count)
    return entry, topics, counts


def _copy(stream: BinaryIO, target: BinaryIO, progress: Progress) -> Saved:
    copy, total = Copy(target, usual_time(stream)), os.fstat(stream.fileno()).st_size
    stream.seek(len(MCAP0_MAGIC))
    damaged = 0
    for opcode, content in whole_records(stream):
        try:
            copy.add(opcode, content)
        except BROKEN:
            damaged += 1
        progress(stream.tell(), total)
    copy.finish()
    return Saved(copy.messages, copy.last_ns, damaged, copy.wrong_times)


def whole_records(stream: BinaryIO) -> Iterator[tuple[int, bytes]]:
    """Yield kind and content of every record of the data section, up to its end or the break."""
    while len(head := stream.read(RECORD_HEADER.size)) == RECORD_HEADER.size:
        opcode, length = RECORD_HEADER.unpack(head)
        if length > LARGEST_RECORD or opcode in (Opcode.DATA_END, Opcode.FOOTER):
            return
        content = stream.read(length)
        if len(content) < length:
            return
        yield opcode, content


class Copy:
    """A fresh MCAP file into which records of a broken one are taken over."""

    def __init__(self, target: BinaryIO, around_ns: int | None) -> None:
        self.messages = self.wrong_times = 0
        self.last_ns = 0
        self._writer = Writer(target, compression=CompressionType.ZSTD, enable_data_crcs=True)
        self._earliest_ns, self._latest_ns = possible_times(around_ns)
        self._has_begun = False
        self._schemas = {0: 0}
        self._channels: dict[int, int] = {}

    def add(self, opcode: int, content: bytes) -> None:
        """Take over a record; a chunk as a whole or not at all."""
        if opcode == Opcode.HEADER and not self._has_begun:
            header = Header.read(_stream(content))
            self._begin(header.profile, header.library)
        elif opcode == Opcode.CHUNK:
            body = unpacked(content)
            for inner, at, length in list(inside(body)):
                self.add(inner, body[at:at + length])
        elif opcode == Opcode.SCHEMA:
            self._add_schema(Schema.read(_stream(content)))
        elif opcode == Opcode.CHANNEL:
            self._add_channel(Channel.read(_stream(content)))
        elif opcode == Opcode.MESSAGE:
            self._add_message(content)

    def finish(self) -> None:
        """Write the indexes."""
        self._begin('', '')
        self._writer.finish()  # type: ignore[no-untyped-call]

    def _begin(self, profile: str, library: str) -> None:
        if not self._has_begun:
            self._has_begun = True
            self._writer.start(profile, library)

    def _add_schema(self, schema: Schema) -> None:
        if schema.id not in self._schemas:
            self._schemas[schema.id] = self._writer.register_schema(
                schema.name, schema.encoding, schema.data)

    def _add_channel(self, channel: Channel) -> None:
        if channel.schema_id not in self._schemas:
            raise McapError(f'channel {channel.id} has no schema')
        if channel.id not in self._channels:
            self._channels[channel.id] = self._writer.register_channel(
                channel.topic, channel.message_encoding, self._schemas[channel.schema_id],
                channel.metadata)

    def _add_message(self, content: bytes) -> None:
        channel, sequence, log_time, publish_time = MESSAGE_HEADER.unpack_from(content)
        if channel not in self._channels:
            raise McapError(f'a message of an unknown channel {channel}')
        if not self._earliest_ns <= log_time <= self._latest_ns:
            self.wrong_times += 1
            return
        self._writer.add_message(
            self._channels[channel], log_time, content[MESSAGE_HEADER.size:], publish_time,
            sequence)
        self.messages += 1
        self.last_ns = max(self.last_ns, log_time)


def _stream(content: bytes) -> ReadDataStream:
    return ReadDataStream(io.BytesIO(content))


def _save_beside(arguments: Sequence[str]) -> None:
    """Recover files of bags beside themselves; say for each what was saved, or why nothing."""
    tell = logging.getLogger(__name__).warning  # to stderr: nobody has set logging up
    for file in map(Path, arguments):
        try:
            tell('%s: %s', beside(file), recover(file, beside(file)))
        except (RotorSoilError, OSError) as error:
            if beside(file).exists():
                tell('%s: by another process', beside(file))
            else:
                tell('%s: %s', file, error)


if __name__ == '__main__':
    run_as_child(_save_beside)
