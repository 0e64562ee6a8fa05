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
from rotorsoil_ros.screen.footer import Endings
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
        self._bag: BagAside | None = None
        self._recovery: Recovery | None = None
        self._viewer: Aside[Event | Path] | None = None
        self._shown_file: Path | None = None
        directory = _directory(settings)
        if directory is not None:
            self._recovery = Recovery(directory, tell=tell, complain=complain)
        if directory is not None and settings.mcap:
            self._bag = BagAside(partial(
                Recorder, directory, settings.name, split_mib=settings.split_mib,
                split_s=settings.split_s, budget_mib=settings.budget_mib, tell=tell,
                complain=complain), complain=complain)
            self._shown_file = self._bag.file
        self._records = settings.rerun and directory is not None
        self._display = display = Display(
            settings, machines, directory, self._bag.path if self._bag else None, complain)
        if self._records or settings.rerun_url:
            self._viewer = Aside(
                display.take, display.close, begin=display.begin, complain=complain)

    @property
    def path(self) -> Path | None:
        """Directory of the log, if there is one."""
        return self._display.alone if self._bag is None else self._bag.path

    @property
    def is_written(self) -> bool:
        """Whether there is a bag."""
        return self._bag is not None

    @property
    def is_shown(self) -> bool:
        """Whether there is a recording or a viewer."""
        return self._viewer is not None and not self._viewer.has_failed

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
        """Put everything onto the disk, waiting for room if asked to; called again and again."""
        if self._bag is not None:
            self._bag.flush(wait_s=wait_s)
            self._follow(self._bag.file)
        if self._viewer is not None:
            self._viewer.flush()

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
            self._display.end()

    def _follow(self, file: Path | None) -> None:
        """Begin a recording of the viewer beside each new file of the bag."""
        if not self._records or self._viewer is None or file in (None, self._shown_file):
            return
        # Before what was collected: the file began when the second before was put onto the disk.
        if file is not None and self._viewer.put([file.with_suffix('.rrd')]):
            self._shown_file = file


class Display:
    """
    Records and shows on the thread on which it was opened.

    Parameters
    ----------
    settings, machines : LogSettings, mapping
        What is asked for, and what is shown.
    directory : Path or None
        Where logs lie.
    bag : Path or None
        Beside which files it records; without a bag it makes a directory of its own.

    """

    def __init__(
        self, settings: LogSettings, machines: Mapping[str, Machine], directory: Path | None,
        bag: Path | None, complain: Tell,
    ) -> None:
        self.alone: Path | None = None
        self._settings, self._machines, self._complain = settings, machines, complain
        self._directory, self._bag = directory, bag
        self._sink: RerunSink | None = None
        self._file: Path | None = None
        self._is_whole = False
        self._endings = Endings(complain)

    def begin(self) -> None:
        """Open a recording, a viewer or both."""
        url = self._settings.rerun_url
        if url and not listens(url):
            self._complain(f'nobody listens at {url}: the run is not shown live')
            url = ''
        path = self._bag or self._make_alone(self._complain)
        if url or self._settings.rerun:
            self._file = path / f'{path.name}.rrd' if path and self._settings.rerun else None
            self._sink = open_viewer(self._file, self._machines, url=url)

    def take(self, batch: list[Event | Path]) -> None:
        """Show events; at a path go on in a new recording, which is bounded as its bag is."""
        if self._sink is None:
            return
        if self.alone is None and (path := self._make_alone(lambda text: None)):
            self._go_on(path / f'{path.name}.rrd')
        for item in batch:
            if isinstance(item, Path):
                self._go_on(item)
            else:
                self._sink(item)
        self._sink.flush()
        self._endings.step()

    def close(self) -> None:
        """Finish the recording."""
        if self._sink is not None:
            self._sink.close()
            self._is_whole = self._file is not None

    def end(self) -> None:
        """Give what was recorded its footer, once nobody writes it any more."""
        if self._is_whole and self._file is not None:
            self._endings.end(self._file)
        self._endings.close()

    def _go_on(self, file: Path) -> None:
        assert self._sink is not None
        self._sink.begin(file)
        if self._file is not None:
            self._endings.end(self._file)
        self._file = file

    def _make_alone(self, complain: Tell) -> Path | None:
        """Make a directory for a recording without a bag."""
        settings = self._settings
        if self._directory is None or settings.mcap or not settings.rerun:
            return None
        try:
            self.alone = new_directory(self._directory, settings.name)
        except OSError as error:
            complain(f'log {self._directory / settings.name} cannot be begun and is tried '
                     f'again: {error.strerror}')
        return self.alone


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
