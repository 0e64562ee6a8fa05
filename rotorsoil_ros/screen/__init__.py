"""The recording for rerun and the live view; rerun is large and optional: loaded when asked."""

from collections.abc import Callable, Mapping
from importlib.util import find_spec
import os
from pathlib import Path
from typing import TYPE_CHECKING

from rotorsoil_ros.case.machine import Machine
from rotorsoil_ros.errors import InputError

if TYPE_CHECKING:
    from rotorsoil_ros.screen.viewer import RerunSink


def recorder(path: Path, machine: Machine) -> 'Callable[[str], RerunSink]':
    """Return what opens a recording of a machine under the name that it is given."""
    return lambda name: open_viewer(path, {name: machine}, ends=True)


def open_viewer(
    recording: Path | None, machines: Mapping[str, Machine], *, url: str = '', ends: bool = False,
) -> 'RerunSink':
    """
    Open a recording, or a connection to a viewer, or both.

    One that `ends`, as that of a recorded run does, gets its footer when it is closed; of those of
    a node `footer.Endings` takes care.

    Raises
    ------
    InputError
        If rerun is not installed: it is large and optional, so that it is imported only here.

    """
    if find_spec('rerun') is None:
        raise InputError('rerun-sdk is not installed: nothing is recorded for its viewer')
    # It warns of a missing footer, which comes when the recording is ended.
    os.environ.setdefault('RUST_LOG', 'error')
    from rotorsoil_ros.screen.viewer import RerunSink
    return RerunSink(recording, machines, url=url, ends=ends)
