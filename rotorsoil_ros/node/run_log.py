"""What does a running node leave behind, and what if the disk does not take it."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
import socket
from typing import TYPE_CHECKING
from urllib.parse import urlsplit

from rotorsoil_ros.background import Aside
from rotorsoil_ros.bags.recorder import BagAside, Recorder
from rotorsoil_ros.bags.retention import new_directory
from rotorsoil_ros.bags.unfinished import Recovery
from rotorsoil_ros.case.machine import Machine
from rotorsoil_ros.errors import InputError
from rotorsoil_ros.events import Diagnostics, Event
from rotorsoil_ros.screen import open_viewer
from rotorsoil_ros.wire.messages import Records

if TYPE_CHECKING:
    from rotorsoil_ros.screen.viewer import RerunSink

RERUN_PORT = 9876
KNOCK_S = 0.2
HTTP2_FRAME = 9  # bytes of a header; the one of empty settings is a whole frame
HTTP2_HELLO = b'PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n' + b'\0\0\0\4\0\0\0\0\0'

Tell = Callable[[str], object]


@dataclass(frozen=True, slots=True)
class LogSettings:
    """What is asked for: where, under which name, in which forms, split when."""

    directory: str
    name: str
    mcap: bool
    rerun: bool
    rerun_url: str
    split_mib: float
    split_s: float
    budget_mib: float = 0.0


class RunLog:
    """
    The bag and the recording of one run.

    Neither a disk that fails nor a viewer that hangs ever ends the node.
    """

    def __init__(
        self, settings: LogSettings, machines: Mapping[str, Machine], *, tell: Tell,
        complain: Tell,
    ) -> None:
        self._settings = settings
        self._complain = complain
        self._bag: BagAside | None = None
        self._recovery: Recovery | None = None
        self._viewer: Aside[Event | Path] | None = None
        self._alone: Path | None = None  # directory of a recording without a bag
        self._directory = directory = _directory(settings)
        if directory is not None:
            self._recovery = Recovery(directory, tell=tell, complain=complain)
        if directory is not None and settings.mcap:
            self._bag = BagAside(Recorder(
                directory, settings.name, split_mib=settings.split_mib, split_s=settings.split_s,
                budget_mib=settings.budget_mib, tell=tell, complain=complain), complain=complain)
        else:
            self._make_alone(complain)
        self._shown_file = self._bag.file if self._bag is not None else None
        self._viewer = self._open_viewer(machines)

    @property
    def path(self) -> Path | None:
        """Directory of the log, if there is one."""
        if self._bag is not None:
            return self._bag.path
        return self._alone

    @property
    def is_written(self) -> bool:
        """Whether there is a bag."""
        return self._bag is not None

    @property
    def is_shown(self) -> bool:
        """Whether there is a recording or a viewer."""
        return self._viewer is not None

    @property
    def backlog(self) -> int:
        """Batches of messages that wait for the disk."""
        return 0 if self._bag is None else self._bag.backlog

    def write(self, records: Records) -> None:
        """Log messages of one topic."""
        if self._bag is not None:
            self._bag.write(records)

    def show(self, event: Event) -> None:
        """Show an event in the viewer."""
        if self._viewer is not None:
            self._viewer(event)

    def flush(self, *, wait_s: float = 0.0) -> None:
        """Put everything onto the disk, waiting for room if asked to; called once a second."""
        if self._bag is not None:
            self._bag.flush(wait_s=wait_s)
            self._follow(self._bag.file)
        elif self._make_alone(lambda text: None) and self._alone and self._viewer:
            self._viewer.put([self._alone / f'{self._alone.name}.rrd'])
        if self._viewer is not None:
            self._viewer.flush()
        if self._recovery is not None:
            self._recovery.step()

    def report(self, now_ns: int) -> Diagnostics | None:
        """Tell how logging goes, if anything is logged."""
        return self._bag.report(now_ns) if self._bag is not None else None

    def close(self) -> None:
        """Finish bag and recording."""
        viewer, self._viewer = self._viewer, None
        bag, self._bag = self._bag, None
        recovery, self._recovery = self._recovery, None
        if bag is not None:
            bag.close()
        if recovery is not None:
            recovery.close()
        if viewer is not None:
            viewer.close()

    def _make_alone(self, complain: Tell) -> bool:
        """Make a directory for a recording without a bag, unless there is one."""
        if self._directory is None or self._alone is not None:
            return False
        try:
            self._alone = new_directory(self._directory, self._settings.name)
        except OSError as error:
            complain(f'log {self._directory / self._settings.name} cannot be begun and is tried '
                     f'again: {error.strerror}')
            return False
        return True

    def _follow(self, file: Path | None) -> None:
        """Begin a recording of the viewer beside each new file of the bag."""
        if not self._settings.rerun or self._viewer is None or file in (None, self._shown_file):
            return
        # Before what was collected: the file began when the second before was put onto the disk.
        if file is not None and self._viewer.put([file.with_suffix('.rrd')]):
            self._shown_file = file

    def _open_viewer(self, machines: Mapping[str, Machine]) -> Aside[Event | Path] | None:
        settings, path = self._settings, self.path
        recording = path / f'{path.name}.rrd' if path and settings.rerun else None
        url = settings.rerun_url
        if url and not listens(url):
            self._complain(f'nobody listens at {url}: the run is not shown live')
            url = ''
        if not url and not (settings.rerun and settings.directory):
            return None
        try:
            sink = open_viewer(recording, machines, url=url)
        except (InputError, OSError, RuntimeError) as error:
            self._complain(str(error))
            return None
        return Aside(partial(_show, sink), sink.close, complain=self._complain)


def _show(sink: 'RerunSink', batch: list[Event | Path]) -> None:
    """Show events; at a path go on in a new recording, which is bounded as its bag is."""
    for item in batch:
        if isinstance(item, Path):
            sink.begin(item)
        else:
            sink(item)
    sink.flush()


def _directory(settings: LogSettings) -> Path | None:
    """Return where to log, if that is asked for."""
    if not settings.directory or not (settings.mcap or settings.rerun):
        return None
    try:
        return Path(settings.directory).expanduser()
    except RuntimeError as error:
        raise InputError(f'log.directory: {settings.directory}: {error}') from error


def listens(url: str) -> bool:
    """
    Return whether a viewer listens and answers; rerun would wait forever for one that does not.

    It speaks gRPC, and so HTTP/2, in which a server says its settings at once.
    """
    address = urlsplit(url)
    try:
        with socket.create_connection(
                (address.hostname, address.port or RERUN_PORT), KNOCK_S) as line:
            line.sendall(HTTP2_HELLO)
            return len(line.recv(HTTP2_FRAME)) > 0
    except (OSError, ValueError):
        return False
