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
    return lambda name: open_viewer(path, {name: machine})


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
    from rotorsoil_ros.screen.viewer import RerunSink
    return RerunSink(recording, machines, url=url)
