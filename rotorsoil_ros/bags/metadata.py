"""What does a bag say of itself? Its `metadata.yaml`, as rosbag2 in Jazzy writes it."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
import os
from pathlib import Path
from typing import Any

import yaml

import rotorsoil_ros
from rotorsoil_ros.wire.definitions import type_hash

VERSION = 9  # of rosbag2 in Jazzy
WRITER = 'rotorsoil_ros'
FOREVER = {'sec': 9223372036, 'nsec': 854775807}
FILE_NAME = 'metadata.yaml'

# The one in C takes a tenth of the time, which counts while machines are being answered.
Dumper = getattr(yaml, 'CSafeDumper', yaml.SafeDumper)


@dataclass(frozen=True, slots=True)
class Topic:
    """One topic of a log: name, type, and whether its last message is kept for latecomers."""

    name: str
    type: str
    latched: bool


@dataclass(frozen=True, slots=True)
class FileEntry:
    """One file of a bag: name, first time and duration [ns], number of messages."""

    name: str
    start_ns: int
    duration_ns: int
    count: int


@dataclass(frozen=True, slots=True)
class Contents:
    """What a bag holds: its files in their order, its topics, and messages by topic."""

    files: Sequence[FileEntry]
    topics: Mapping[str, Topic]
    counts: Mapping[str, int]


def offered_qos(*, latched: bool) -> list[dict[str, Any]]:
    """Return the quality of service with which a topic was offered, as rosbag2 writes it."""
    return [{
        'history': 'keep_last', 'depth': 1 if latched else 10, 'reliability': 'reliable',
        'durability': 'transient_local' if latched else 'volatile',
        'deadline': dict(FOREVER), 'lifespan': dict(FOREVER), 'liveliness': 'automatic',
        'liveliness_lease_duration': dict(FOREVER), 'avoid_ros_namespace_conventions': False}]


@cache
def offered_qos_text(*, latched: bool) -> str:
    """Return the same as text, for the channels of an MCAP file."""
    return str(yaml.dump(offered_qos(latched=latched), Dumper=Dumper, sort_keys=False))


def write(directory: Path, contents: Contents, gaps: Mapping[str, str]) -> None:
    """
    Write `metadata.yaml`: whoever reads it meanwhile sees the old one or the new one.

    Parameters
    ----------
    directory : Path
        Of the bag.
    contents : Contents
        What it holds.
    gaps : mapping of str
        What it does not hold although it should, and why.

    """
    text = yaml.dump({'rosbag2_bagfile_information': information(contents, gaps)},
                     Dumper=Dumper, sort_keys=False)
    partial = directory / f'{FILE_NAME}.tmp'
    try:
        partial.write_text(text, encoding='utf-8')
        os.replace(partial, directory / FILE_NAME)
    except OSError:
        partial.unlink(missing_ok=True)
        raise


def information(contents: Contents, gaps: Mapping[str, str]) -> dict[str, Any]:
    """Return what `metadata.yaml` says of a bag."""
    files = contents.files
    filled = [file for file in files if file.count]
    start = min((file.start_ns for file in filled), default=0)
    stop = max((file.start_ns + file.duration_ns for file in filled), default=start)
    return {
        'version': VERSION, 'storage_identifier': 'mcap',
        'duration': {'nanoseconds': stop - start},
        'starting_time': {'nanoseconds_since_epoch': start},
        'message_count': sum(contents.counts.values()),
        'topics_with_message_count': [
            {'topic_metadata': {
                'name': topic.name, 'type': topic.type, 'serialization_format': 'cdr',
                'offered_qos_profiles': offered_qos(latched=topic.latched),
                'type_description_hash': type_hash(topic.type)},
             'message_count': contents.counts.get(topic.name, 0)}
            for topic in contents.topics.values()],
        'compression_format': '', 'compression_mode': '',
        'relative_file_paths': [file.name for file in files],
        'files': [
            {'path': file.name,
             'starting_time': {'nanoseconds_since_epoch': file.start_ns},
             'duration': {'nanoseconds': file.duration_ns},
             'message_count': file.count} for file in files],
        'custom_data': {'writer': f'{WRITER} {rotorsoil_ros.__version__}', **gaps},
        'ros_distro': 'jazzy'}


def total(counts: Sequence[Mapping[str, int]]) -> Counter[str]:
    """Return the sum of messages by topic."""
    return sum((Counter(count) for count in counts), Counter())
