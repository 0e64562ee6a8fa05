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
from rotorsoil_ros.bags.retention import Recovery
from rotorsoil_ros.bags.writer import new_directory
from rotorsoil_ros.case.machine import Machine
from rotorsoil_ros.errors import InputError
from rotorsoil_ros.events import Diagnostics, Event, Expected, Model
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
        self.path: Path | None = None
        self._complain = complain
        self._bag: BagAside | None = None
        self._recovery: Recovery | None = None
        self._viewer: Aside[Event | Path] | None = None
        self._shown_file: Path | None = None
        if settings.directory and (settings.mcap or settings.rerun):
            directory = Path(settings.directory).expanduser()
            self.path = new_directory(directory, settings.name)
            self._recovery = Recovery(directory, tell=tell, complain=complain)
        if self.path and settings.mcap:
            self._bag = BagAside(Recorder(
                self.path, split_mib=settings.split_mib, split_s=settings.split_s,
                budget_mib=settings.budget_mib, tell=tell, complain=complain), complain=complain)
            self._shown_file = self._bag.file if settings.rerun else None
        if (self.path and settings.rerun) or settings.rerun_url:
            self._viewer = self._open_viewer(settings, machines)

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

    def _follow(self, file: Path) -> None:
        """Begin a recording of the viewer beside each new file of the bag."""
        if self._viewer is None or self._shown_file in (None, file):
            return
        # Before what was collected: the file began when the second before was put onto the disk.
        if self._viewer.put([file.with_suffix('.rrd')]):
            self._shown_file = file

    def _open_viewer(
        self, settings: LogSettings, machines: Mapping[str, Machine],
    ) -> Aside[Event | Path] | None:
        recording = self.path / f'{self.path.name}.rrd' if self.path and settings.rerun else None
        url = settings.rerun_url
        if url and not listens(url):
            self._complain(f'nobody listens at {url}: the run is not shown live')
            url = ''
        if recording is None and not url:
            return None
        try:
            show = Show(partial(open_viewer, machines=machines, url=url), recording)
        except InputError as error:
            self._complain(str(error))
            return None
        return Aside(show.take, show.close, complain=self._complain)


class Show:
    """What the viewer shows, in one recording after the other: each is bounded as its bag is."""

    def __init__(self, begin: 'Callable[[Path | None], RerunSink]', first: Path | None) -> None:
        self._begin = begin
        self._sink = begin(first)
        self._basis: dict[tuple[str, type], Model | Expected] = {}

    def take(self, batch: list[Event | Path]) -> None:
        """Show events; at a path go on in a new recording."""
        for item in batch:
            if isinstance(item, Path):
                self._sink.close()
                self._sink = self._begin(item)
                for basis in self._basis.values():  # on which what follows rests
                    self._sink(basis)
                continue
            if isinstance(item, (Model, Expected)):
                self._basis[item.machine, type(item)] = item
            self._sink(item)
        self._sink.flush()

    def close(self) -> None:
        """Finish the last recording."""
        self._sink.close()


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
