"""What does a bag say of itself? Its `metadata.yaml`, as rosbag2 in Jazzy writes it."""

from collections import Counter
from collections.abc import Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass
from functools import cache
import os
from pathlib import Path
import re
from typing import Any

import yaml

import rotorsoil_ros
from rotorsoil_ros.errors import InputError
from rotorsoil_ros.wire.definitions import type_hash

VERSION = 9  # of rosbag2 in Jazzy
WRITER = 'rotorsoil_ros'
FOREVER = {'sec': 9223372036, 'nsec': 854775807}
FILE_NAME = 'metadata.yaml'
INFORMATION = 'rosbag2_bagfile_information'
RECOVERED = '_recovered'
SQLITE, ROS1 = '.db3', '.bag'
FOREIGN = (SQLITE, ROS1)  # storages that are read, and never written

# The one in C takes a tenth of the time, which counts while machines are being answered.
Dumper = getattr(yaml, 'CSafeDumper', yaml.SafeDumper)


@dataclass(frozen=True, slots=True)
class Topic:
    """One topic of a log: name, type, and the qualities of service that it was offered with."""

    name: str
    type: str
    offered_qos: str  # as the channels of MCAP files have it: YAML


@dataclass(frozen=True, slots=True)
class FileEntry:
    """One file of a bag: name, first time and duration [ns], number of messages."""

    name: str
    start_ns: int
    duration_ns: int
    count: int


@dataclass(frozen=True, slots=True)
class BagContents:
    """What a bag holds: its files in their order, its topics, and messages by topic."""

    files: Sequence[FileEntry]
    topics: Mapping[str, Topic]
    counts: Mapping[str, int]


def files(path: Path) -> list[Path]:
    """
    Return the files of a bag directory in their order, or the one file that it is.

    Where a broken file was recovered beside itself, it is the recovered one.
    """
    if path.is_file():
        return [path]
    if not path.is_dir():
        raise InputError(f'{path}: no such file or bag directory')
    known = read(path)
    _refuse_compressed(path, known)
    listed = [path / Path(name).name for name in known.get('relative_file_paths', ())]
    found = list(dict.fromkeys(
        beside(file) if beside(file).is_file() else file
        for file in listed or without_recovered(files_in(path))))
    if strange := [file.name for file in found if file.suffix not in ('.mcap', *FOREIGN)]:
        raise InputError(f'{path}: {", ".join(strange)}: of a storage that is not read; `ros2 bag '
                         'convert` it first')
    if not found:
        packed = ', '.join(sorted(file.name for file in path.glob('*.mcap.*')))
        raise InputError(f'{path}: holds no MCAP file' + (
            f', but {packed}: unpack them first' if packed else
            ', nor one of SQLite'))
    return found


def files_in(bag: Path) -> list[Path]:
    """Return the files that lie in a directory, MCAP if there are any, by their numbers."""
    found = list(bag.glob('*.mcap')) or list(bag.glob(f'*{SQLITE}'))
    return sorted(found, key=lambda file: (number_in(file.stem), file.name))


def number_in(name: str) -> int:
    """Return the last number in the name of a file of a bag, zero if it has none."""
    numbers = re.findall(r'_(\d+)', name)
    return int(numbers[-1][:18]) if numbers else 0


def beside(file: Path) -> Path:
    """Return where a file of a bag is recovered to."""
    return file.with_name(f'{file.stem}{RECOVERED}.mcap')


def without_recovered(found: Sequence[Path]) -> list[Path]:
    """Leave out the broken files that were recovered beside themselves."""
    return [file for file in found if not beside(file).is_file()]


def gaps(bag: Path) -> dict[str, str]:
    """Return what a bag says that it does not hold, and why."""
    custom = read(bag).get('custom_data') or {}
    return {str(name): str(text) for name, text in custom.items() if name != 'writer'}


def read(bag: Path) -> dict[str, Any]:
    """Return what the `metadata.yaml` of a bag says, nothing if it is not there."""
    path = bag / FILE_NAME
    if not path.is_file():
        return {}
    try:
        said = yaml.safe_load(path.read_text(encoding='utf-8'))[INFORMATION]
        [str(name) for name in said['relative_file_paths']]
    except (yaml.YAMLError, UnicodeDecodeError, KeyError, TypeError) as error:
        raise InputError(f'{path}: is not the metadata of a bag') from error
    return dict(said)


def _refuse_compressed(path: Path, known: Mapping[str, Any]) -> None:
    """Raise InputError for what rosbag2 has compressed around the messages or the files."""
    mode, how = str(known.get('compression_mode') or ''), known.get('compression_format')
    if mode.upper() == 'MESSAGE':
        names = [topic['topic_metadata']['name']
                 for topic in known.get('topics_with_message_count') or ()]
        raise InputError(
            f'{path}: {", ".join(names)}: each message is compressed with {how} '
            '(compression_mode MESSAGE); `ros2 bag convert` it first')
    if mode.upper() == 'FILE':
        names = [str(name) for name in known['relative_file_paths']]
        raise InputError(f'{path}: {", ".join(names)}: compressed with {how} as whole files '
                         '(compression_mode FILE); unpack them first')


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


@cache
def _profiles(text: str) -> list[dict[str, Any]]:
    """Return profiles of text; none of text that says none, which readers take for the same."""
    try:
        said = yaml.safe_load(text)
    except yaml.YAMLError:
        return []
    return said if isinstance(said, list) else []


def write(directory: Path, contents: BagContents, gaps: Mapping[str, str]) -> None:
    """
    Write `metadata.yaml`: whoever reads it meanwhile sees the old one or the new one.

    Parameters
    ----------
    directory : Path
        Of the bag.
    contents : BagContents
        What it holds.
    gaps : mapping of str
        What it does not hold although it should, and why.

    """
    text = yaml.dump({INFORMATION: information(contents, gaps)},
                     Dumper=Dumper, sort_keys=False)
    partial = directory / f'{FILE_NAME}.tmp'
    try:
        partial.write_text(text, encoding='utf-8')
        os.replace(partial, directory / FILE_NAME)
    except OSError:
        partial.unlink(missing_ok=True)
        raise


def information(contents: BagContents, gaps: Mapping[str, str]) -> dict[str, Any]:
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
                'offered_qos_profiles': deepcopy(_profiles(topic.offered_qos)),  # else: aliases
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
