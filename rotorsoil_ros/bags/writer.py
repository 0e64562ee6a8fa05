"""What does a run leave on the disk? A bag as rosbag2 shapes it, never over an older one."""

from collections import Counter
from contextlib import suppress
import errno
import fcntl
import os
from pathlib import Path
from types import TracebackType

import rotorsoil_ros
from rotorsoil_ros.bags import metadata as bag_metadata
from rotorsoil_ros.bags.mcap_writer import McapWriter
from rotorsoil_ros.bags.metadata import BagContents, FileEntry, offered_qos_text, Topic
from rotorsoil_ros.events import NANOSECONDS
from rotorsoil_ros.wire.definitions import definition, type_hash
from rotorsoil_ros.wire.messages import Records

MEBIBYTE = 1 << 20
LARGEST_INDEX = 4 * MEBIBYTE  # the index of a file is held in memory until the file is finished


class LogFile:
    """One MCAP file; topics announce themselves with their first message."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.topics: dict[str, Topic] = {}
        self._stream = path.open('wb', buffering=0)
        # Nobody takes the file for that of a dead writer while this one lives.
        with suppress(OSError):
            fcntl.flock(self._stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
        try:
            self._writer = McapWriter(
                self._stream, profile='ros2',
                library=f'{bag_metadata.WRITER} {rotorsoil_ros.__version__}')
        except OSError:
            self._stream.close()
            raise
        self._schemas: dict[str, int] = {}
        self._channels: dict[str, int] = {}

    def __enter__(self) -> 'LogFile':
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def write(self, records: Records) -> None:
        """Append messages of one topic."""
        channel = self._channels.get(records.topic)
        if channel is None:
            channel = self._announce(records)
        self._writer.add_messages(channel, records.log_time_ns, records.payloads)

    def flush(self) -> None:
        """Put everything that has come so far into the file."""
        self._writer.flush()

    def close(self) -> None:
        """Finish the file; a second time does nothing, unless the first one failed."""
        if not self._stream.closed:
            self._writer.close()
            self._stream.close()

    def discard(self) -> None:
        """Leave the file as it is."""
        self._stream.close()

    def check(self) -> None:
        """Raise FileNotFoundError if the file is no longer where it was opened."""
        own = os.fstat(self._stream.fileno())
        with suppress(FileNotFoundError, NotADirectoryError):
            there = self.path.stat()
            if (there.st_ino, there.st_dev) == (own.st_ino, own.st_dev):
                return
        raise FileNotFoundError(errno.ENOENT, 'was deleted while it was written', str(self.path))

    @property
    def size(self) -> int:
        """Bytes written."""
        return self._writer.size

    @property
    def index_size(self) -> int:
        """Bytes of memory that its index takes."""
        return self._writer.index_size

    @property
    def counts(self) -> Counter[str]:
        """Messages by topic that have reached the file."""
        return Counter({name: self._writer.counts.get(channel, 0)
                        for name, channel in self._channels.items()})

    @property
    def span_ns(self) -> tuple[int, int]:
        """First time and duration of what has reached the file [ns]."""
        first, last = self._writer.start_ns, self._writer.end_ns
        return (first, last - first) if last >= first else (0, 0)

    @property
    def longest_ns(self) -> int:
        """Time from first to last message of what spans most, latched topics aside [ns]."""
        return self._writer.longest_ns

    @property
    def entry(self) -> FileEntry:
        """What the bag says of this file."""
        return FileEntry(self.path.name, *self.span_ns, self.counts.total())

    def _announce(self, records: Records) -> int:
        kind = records.type
        if kind not in self._schemas:
            self._schemas[kind] = self._writer.add_schema(kind, 'ros2msg', definition(kind))
        offered_qos = offered_qos_text(latched=records.latched)
        channel = self._writer.add_channel(records.topic, self._schemas[kind], {
            'offered_qos_profiles': offered_qos,
            'topic_type_hash': type_hash(kind)}, spans=not records.latched)
        self._channels[records.topic] = channel
        self.topics[records.topic] = Topic(records.topic, kind, offered_qos)
        return channel


class BagWriter:
    """
    A bag directory: `<name>/<name>_0.mcap` and `metadata.yaml`.

    A new file begins when one exceeds `split_mib` or spans `split_s` of message time; zero
    splits only when the index of the file takes too much memory. It opens with the last message
    of every latched topic, at its own time: read alone, it says what it rests on.
    """

    def __init__(
        self, path: Path, *, split_mib: float = 0.0, split_s: float = 0.0,
        gaps: dict[str, str] | None = None, latched: dict[str, Records] | None = None,
    ) -> None:
        self.path = path
        self.gaps = {} if gaps is None else gaps
        self.latched = {} if latched is None else latched
        self.finished_size = 0
        self._split_size = split_mib * MEBIBYTE
        self._split_ns = split_s * NANOSECONDS
        self._done: list[FileEntry] = []
        self._topics: dict[str, Topic] = {}
        self._counts: Counter[str] = Counter()
        self._number = self._written = 0
        self._file = self._open()
        try:
            self._write_metadata()
        except OSError:
            self._file.discard()
            raise

    def write(self, records: Records) -> None:
        """Append messages of one topic."""
        self.remember(records)
        self._file.write(records)

    def remember(self, records: Records) -> None:
        """Keep the last message of a latched topic for files to come."""
        if records.latched:
            self.latched[records.topic] = last_of(records)

    def flush(self) -> None:
        """Put everything onto the disk; call it again and again, whatever the traffic."""
        self._file.check()
        self._file.flush()
        if self._is_full():
            self._finish_file()
            self._file = self._open()
            self._write_metadata()

    def close(self) -> None:
        """Finish the file and say in `metadata.yaml` what the bag holds."""
        try:
            self._finish_file()
            self._write_metadata()
        finally:
            self._file.discard()

    def abandon(self) -> None:
        """Finish after a failure what can be finished, and leave the rest for `resume`."""
        with suppress(OSError):
            self._drop_deleted()
            self._finish_file()
            self._write_metadata()

    def resume(self, gap: str) -> None:
        """Begin a new file after a failure; write down what is missing and why."""
        self._drop_deleted()
        self._finish_file()
        self._file = self._open()
        self.gaps[f'gap_{len(self.gaps) + 1}'] = gap
        self._write_metadata()

    def forget(self, name: str) -> None:
        """Drop a file that was removed to make room."""
        self._done = [entry for entry in self._done if entry.name != name]
        self._write_metadata()

    @property
    def file(self) -> Path:
        """The file that is being written."""
        return self._file.path

    @property
    def size(self) -> int:
        """Bytes written to all files."""
        return self.finished_size + (0 if self._is_closed else self._file.size)

    @property
    def written(self) -> int:
        """Messages that have reached the disk, repeated ones once."""
        return self._written + (0 if self._is_closed else self._written_to_file)

    @property
    def _written_to_file(self) -> int:
        # What is repeated stands in the first chunk, which is in the file as a whole or not.
        return max(0, self._file.counts.total() - self._repeated)

    def _is_full(self) -> bool:
        file = self._file
        return (0 < self._split_size <= file.size or 0 < self._split_ns <= file.longest_ns
                or file.index_size > LARGEST_INDEX)

    def _open(self) -> LogFile:
        file = LogFile(self.path / f'{self.path.name}_{self._number}.mcap')
        for records in self.latched.values():
            file.write(records)
        self._repeated = len(self.latched)
        self._number += 1
        self._is_closed = False
        return file

    def _finish_file(self) -> None:
        """Close the file and keep of it only what the bag says of it."""
        if not self._is_closed:
            self._file.close()
            self._is_closed = True
            self._done.append(self._file.entry)
            self._topics |= self._file.topics
            self._counts += self._file.counts
            self._written += self._written_to_file
            self.finished_size += self._file.size

    def _drop_deleted(self) -> None:
        """Know nothing of the file any more if it is gone."""
        if not self._is_closed:
            try:
                self._file.check()
            except FileNotFoundError:
                self._is_closed = True
                self._file.discard()

    def _write_metadata(self) -> None:
        files, topics, counts = self._done, self._topics, self._counts
        if not self._is_closed:
            files = [*files, self._file.entry]
            topics, counts = topics | self._file.topics, counts + self._file.counts
        bag_metadata.write(self.path, BagContents(files, topics, counts), self.gaps)


def last_of(records: Records) -> Records:
    """Return the last message alone: what a latched topic is worth to latecomers."""
    return records._replace(
        log_time_ns=records.log_time_ns[-1:], payloads=records.payloads[-1:])
