"""How does a recording end? In few large pieces, and with a footer that tells where each lies."""

from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import partial
import os
from pathlib import Path
import sys

from rotorsoil_ros.background import Child, Children, run_as_child
from rotorsoil_ros.errors import InputError

# To end a recording takes about three times its size of memory.
LARGEST_RECORDING = 512 * 1024 * 1024
ENDING_S = 30.0  # for each of the last ones, when the node stops


class Endings:
    """
    Ends recordings that nobody writes any more, one after the other in another process.

    While one is written it has no footer: that would stay in memory, two kilobytes for every
    piece, until the end. So one that was cut off, as by a kill, has none.
    """

    def __init__(self, complain: Callable[[str], object]) -> None:
        self._complain = complain
        self._children = Children()
        self._failed: dict[Path, str] = {}
        self._ended = 0

    def end(self, recording: Path) -> None:
        """Begin to end a recording."""
        self._children.ask(str(recording), partial(Child, __name__, [str(recording)]),
                           partial(self._look, recording))

    def step(self) -> None:
        """Look after what runs."""
        self._children.step()

    def close(self) -> None:
        """Wait for those that are not ended yet, and for those whose process was interrupted."""
        for recording in list(self._failed):
            self.end(recording)
        self._children.step()
        ended = -1
        while not self._children.are_done and ended < self._ended:
            ended = self._ended
            self._children.step(wait_s=ENDING_S)
        self._children.close()
        for recording, failure in self._failed.items():
            self._complain(f'{recording}: has no footer: {failure}')

    def _look(self, recording: Path, child: Child) -> None:
        self._ended += 1
        self._failed.pop(recording, None)
        if child.failure and recording.exists():  # it may have made room
            self._failed[recording] = child.failure


def end(recording: Path) -> None:
    """
    Give a recording its footer, in the place of itself when that is whole.

    Raises
    ------
    InputError
        If it is too large for that, or no recording.

    """
    from rerun_cli.__main__ import main  # type: ignore[import-untyped]

    if recording.stat().st_size > LARGEST_RECORDING:
        raise InputError(f'{recording}: is larger than {LARGEST_RECORDING >> 20} MiB')
    aside = recording.with_name(f'.{recording.name}.ending')
    sys.argv = ['rerun', 'rrd', 'optimize', str(recording), '-o', str(aside)]
    try:
        if main():
            raise InputError(f'{recording}: cannot be read to its end')
        os.replace(aside, recording)
    finally:
        with suppress(OSError):
            aside.unlink(missing_ok=True)


def _end_all(recordings: Sequence[str]) -> None:
    for recording in recordings:
        end(Path(recording))


if __name__ == '__main__':
    run_as_child(_end_all)
