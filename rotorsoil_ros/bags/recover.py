"""What can be saved of a log whose writer was killed? Everything up to the break."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from datetime import datetime, UTC
import io
import os
from pathlib import Path
from typing import BinaryIO

from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Header, Schema
from mcap.writer import CompressionType, MCAP0_MAGIC, Writer

from rotorsoil_ros.bags.reader import (
    BROKEN,
    inside,
    LARGEST_RECORD,
    MESSAGE_HEADER,
    RECORD_HEADER,
    unpacked,
)
from rotorsoil_ros.errors import InputError
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

    """

    messages: int
    last_ns: int
    damaged_chunks: int

    def __str__(self) -> str:
        """Say it in one line."""
        told = f'{self.messages} messages'
        if self.messages:
            when = datetime.fromtimestamp(self.last_ns // NANOSECONDS, UTC)
            told += f' until {when:%Y-%m-%d %H:%M:%S} UTC ({self.last_ns} ns)'
        if self.damaged_chunks:
            told += f', {self.damaged_chunks} damaged parts left out'
        return told


def recover(broken: Path, out: Path, *, progress: Progress | None = None) -> Saved:
    """
    Write everything readable of an unfinished or damaged MCAP file into a fresh, indexed one.

    Parameters
    ----------
    broken, out : Path
        File to read, which is not touched, and file to write, which must not exist.
    progress : callable
        Called with the number of bytes read and their total.

    Raises
    ------
    InputError
        If `broken` is not an MCAP file, or if `out` exists.

    """
    if out.exists():
        raise InputError(f'{out}: exists already, and nothing is ever overwritten')
    partial = out.with_name(f'{out.name}.partial')
    with broken.open('rb') as stream:
        if stream.read(len(MCAP0_MAGIC)) != MCAP0_MAGIC:
            raise InputError(f'{broken}: is not an MCAP file')
        try:
            with partial.open('wb') as target:
                saved = _copy(stream, target, progress or (lambda done, total: None))
            os.replace(partial, out)
        finally:
            partial.unlink(missing_ok=True)
    return saved


def _copy(stream: BinaryIO, target: BinaryIO, progress: Progress) -> Saved:
    copy, total = Copy(target), os.fstat(stream.fileno()).st_size
    damaged = 0
    for opcode, content in whole_records(stream):
        try:
            copy.add(opcode, content)
        except BROKEN:
            damaged += 1
        progress(stream.tell(), total)
    copy.finish()
    return Saved(copy.messages, copy.last_ns, damaged)


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

    def __init__(self, target: BinaryIO) -> None:
        self.messages = 0
        self.last_ns = 0
        self._writer = Writer(target, compression=CompressionType.ZSTD, enable_data_crcs=True)
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
        self._writer.add_message(
            self._channels[channel], log_time, content[MESSAGE_HEADER.size:], publish_time,
            sequence)
        self.messages += 1
        self.last_ns = max(self.last_ns, log_time)


def _stream(content: bytes) -> ReadDataStream:
    return ReadDataStream(io.BytesIO(content))
