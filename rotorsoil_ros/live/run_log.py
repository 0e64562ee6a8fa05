"""What does a running node leave behind, and what if the disk does not take it."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib.util import find_spec
import os
from pathlib import Path
import socket
from typing import TYPE_CHECKING
from urllib.parse import urlsplit

from rotorsoil_ros.live.bag_writer import BagWriter, new_directory
from rotorsoil_ros.live.events import Event
from rotorsoil_ros.live.machine import Machine
from rotorsoil_ros.live.messages import Records
from rotorsoil_ros.physics.errors import InputError

if TYPE_CHECKING:
    from rotorsoil_ros.live.viewer import RerunSink

RERUN_PORT = 9876
KNOCK_S = 0.2


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


class RunLog:
    """
    The bag and the recording of one run.

    A disk that fails ends the log with one message; it never ends the node.
    """

    def __init__(
        self, settings: LogSettings, machines: Mapping[str, Machine], *,
        tell: Callable[[str], object],
    ) -> None:
        self.path: Path | None = None
        self._tell = tell
        self._bag: BagWriter | None = None
        self._viewer: RerunSink | None = None
        if settings.directory and (settings.mcap or settings.rerun):
            self.path = new_directory(Path(settings.directory).expanduser(), settings.name)
        if self.path and settings.mcap:
            self._bag = BagWriter(
                self.path, split_mib=settings.split_mib, split_s=settings.split_s)
        if (self.path and settings.rerun) or settings.rerun_url:
            self._viewer = self._open_viewer(settings, machines)

    def write(self, records: Records) -> None:
        """Log messages of one topic."""
        if self._bag is not None:
            try:
                self._bag.write(records)
            except OSError as error:
                self._give_up(error)

    def show(self, event: Event) -> None:
        """Show an event in the viewer."""
        if self._viewer is not None:
            self._viewer(event)

    def flush(self) -> None:
        """Put everything onto the disk; called once a second."""
        if self._viewer is not None:
            self._viewer.flush()
        if self._bag is not None:
            try:
                self._bag.flush()
            except OSError as error:
                self._give_up(error)

    def close(self) -> None:
        """Finish bag and recording."""
        viewer, self._viewer = self._viewer, None
        if viewer is not None:
            viewer.close()
        bag, self._bag = self._bag, None
        if bag is not None:
            try:
                bag.close()
            except OSError as error:
                self._tell(f'log {bag.path} could not be finished: {error.strerror}')

    def _give_up(self, error: OSError) -> None:
        bag, self._bag = self._bag, None
        if bag is not None:
            self._tell(f'log {bag.path} failed and ends here: {error.strerror}')

    def _open_viewer(
        self, settings: LogSettings, machines: Mapping[str, Machine],
    ) -> 'RerunSink | None':
        recording = self.path / f'{self.path.name}.rrd' if self.path and settings.rerun else None
        url = settings.rerun_url
        if url and not listens(url):
            self._tell(f'nobody listens at {url}: the run is not shown live')
            url = ''
        if recording is None and not url:
            return None
        try:
            return open_viewer(recording, machines, url=url)
        except InputError as error:
            self._tell(str(error))
            return None


def listens(url: str) -> bool:
    """Return whether a viewer listens; rerun would wait for one that does not, for seconds."""
    address = urlsplit(url)
    try:
        with socket.create_connection((address.hostname, address.port or RERUN_PORT), KNOCK_S):
            return True
    except (OSError, ValueError):
        return False


def open_viewer(
    recording: Path | None, machines: Mapping[str, Machine], *, url: str = '',
) -> 'RerunSink':
    """
    Open a recording, or a connection to a viewer, or both.

    Raises
    ------
    InputError
        If rerun is not installed: it is large and optional, so that it is imported only here.

    """
    if find_spec('rerun') is None:
        raise InputError('rerun-sdk is not installed: nothing is recorded for its viewer')
    # It warns of a missing footer, which is missing so that memory does not grow.
    os.environ.setdefault('RUST_LOG', 'error')
    from rotorsoil_ros.live.viewer import RerunSink
    return RerunSink(recording, machines, url=url)
