"""What does a run leave on the disk? A bag as rosbag2 shapes it, never over an older one."""

from collections import Counter
from dataclasses import dataclass
import os
from pathlib import Path
from types import TracebackType
from typing import Any

import yaml

import rotorsoil_ros
from rotorsoil_ros.live.events import NANOSECONDS
from rotorsoil_ros.live.interfaces import definition, type_hash
from rotorsoil_ros.live.mcap_writer import McapWriter
from rotorsoil_ros.live.messages import Records

METADATA_VERSION = 9  # of rosbag2 in Jazzy
MEBIBYTE = 1 << 20
FOREVER = {'sec': 9223372036, 'nsec': 854775807}


def offered_qos(*, latched: bool) -> list[dict[str, Any]]:
    """Return the quality of service with which a topic was offered, as rosbag2 writes it."""
    return [{
        'history': 'keep_last', 'depth': 1 if latched else 10, 'reliability': 'reliable',
        'durability': 'transient_local' if latched else 'volatile',
        'deadline': dict(FOREVER), 'lifespan': dict(FOREVER), 'liveliness': 'automatic',
        'liveliness_lease_duration': dict(FOREVER), 'avoid_ros_namespace_conventions': False}]


@dataclass(frozen=True, slots=True)
class Topic:
    """One topic of a log: name, type, and whether its last message is kept for latecomers."""

    name: str
    type: str
    latched: bool


class LogFile:
    """One MCAP file; topics announce themselves with their first message."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.topics: dict[str, Topic] = {}
        self._stream = path.open('wb')
        self._writer = McapWriter(
            self._stream, profile='ros2', library=f'rotorsoil_ros {rotorsoil_ros.__version__}')
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
        """Put everything that has come so far onto the disk."""
        self._writer.flush()

    def close(self) -> None:
        """Finish the file; a second time does nothing."""
        if not self._stream.closed:
            self._writer.close()
            self._stream.close()

    @property
    def size(self) -> int:
        """Bytes written."""
        return self._writer.size

    @property
    def counts(self) -> Counter[str]:
        """Messages by topic."""
        return Counter({name: self._writer.counts.get(channel, 0)
                        for name, channel in self._channels.items()})

    @property
    def span_ns(self) -> tuple[int, int]:
        """First time and duration of what has reached the disk [ns]."""
        first, last = self._writer.start_ns, self._writer.end_ns
        return (first, last - first) if last >= first else (0, 0)

    def _announce(self, records: Records) -> int:
        kind = records.type
        if kind not in self._schemas:
            self._schemas[kind] = self._writer.add_schema(kind, 'ros2msg', definition(kind))
        qos = yaml.safe_dump(offered_qos(latched=records.latched), sort_keys=False)
        channel = self._writer.add_channel(records.topic, self._schemas[kind], {
            'offered_qos_profiles': qos, 'topic_type_hash': type_hash(kind)})
        self._channels[records.topic] = channel
        self.topics[records.topic] = Topic(records.topic, kind, records.latched)
        return channel


class BagWriter:
    """
    A bag directory: `<name>/<name>_0.mcap` and `metadata.yaml`.

    A new file begins when one exceeds `split_mib` or spans `split_s` of message time; zero
    never splits.
    """

    def __init__(self, path: Path, *, split_mib: float = 0.0, split_s: float = 0.0) -> None:
        self.path = path
        self._split_size = split_mib * MEBIBYTE
        self._split_ns = split_s * NANOSECONDS
        self._done: list[LogFile] = []
        self._file = self._open()
        self._write_metadata()

    def write(self, records: Records) -> None:
        """Append messages of one topic."""
        self._file.write(records)

    def flush(self) -> None:
        """Put everything onto the disk; call it every second, whatever the traffic."""
        self._file.flush()
        if 0 < self._split_size <= self._file.size or 0 < self._split_ns <= self._file.span_ns[1]:
            self._file.close()
            self._done.append(self._file)
            self._file = self._open()
            self._write_metadata()

    def close(self) -> None:
        """Finish the file and say in `metadata.yaml` what the bag holds."""
        self._file.close()
        self._write_metadata()

    def _open(self) -> LogFile:
        return LogFile(self.path / f'{self.path.name}_{len(self._done)}.mcap')

    def _write_metadata(self) -> None:
        files = [*self._done, self._file]
        text = yaml.safe_dump(
            {'rosbag2_bagfile_information': metadata(files)}, sort_keys=False)
        partial = self.path / 'metadata.yaml.tmp'
        partial.write_text(text, encoding='utf-8')
        os.replace(partial, self.path / 'metadata.yaml')


def metadata(files: list[LogFile]) -> dict[str, Any]:
    """Return what `metadata.yaml` says of the files of a bag."""
    topics = {name: topic for file in files for name, topic in file.topics.items()}
    counts = sum((file.counts for file in files), Counter())
    spans = [file.span_ns for file in files if file.counts.total()]
    start = min((first for first, _ in spans), default=0)
    stop = max((first + duration for first, duration in spans), default=start)
    return {
        'version': METADATA_VERSION, 'storage_identifier': 'mcap',
        'duration': {'nanoseconds': stop - start},
        'starting_time': {'nanoseconds_since_epoch': start},
        'message_count': counts.total(),
        'topics_with_message_count': [
            {'topic_metadata': {
                'name': topic.name, 'type': topic.type, 'serialization_format': 'cdr',
                'offered_qos_profiles': offered_qos(latched=topic.latched),
                'type_description_hash': type_hash(topic.type)},
             'message_count': counts[topic.name]} for topic in topics.values()],
        'compression_format': '', 'compression_mode': '',
        'relative_file_paths': [file.path.name for file in files],
        'files': [
            {'path': file.path.name,
             'starting_time': {'nanoseconds_since_epoch': file.span_ns[0]},
             'duration': {'nanoseconds': file.span_ns[1]},
             'message_count': file.counts.total()} for file in files],
        'custom_data': None, 'ros_distro': 'jazzy'}


def new_directory(directory: Path, name: str) -> Path:
    """
    Make and return the first of `name`, `name_2`, `name_3`... that does not exist.

    What exists is never touched.
    """
    directory.mkdir(parents=True, exist_ok=True)
    path, number = directory / name, 1
    while True:
        try:
            path.mkdir()
        except FileExistsError:
            number += 1
            path = directory / f'{name}_{number}'
        else:
            return path
