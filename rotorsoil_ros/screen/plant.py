"""What do the machines of a plant do together? All in one scene, each at its own frequency."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby
import math

import numpy as np
import rerun as rr

from rotorsoil_ros.arrays import ComplexArray, IntArray
from rotorsoil_ros.case.plant.together import Shaken
from rotorsoil_ros.channel import Channel
from rotorsoil_ros.events import NANOSECONDS, Predicted
from rotorsoil_ros.screen.channels import CHANNEL_COLOURS
from rotorsoil_ros.screen.picture import FRAME_NS, Picture
from rotorsoil_ros.screen.recording import Recording
from rotorsoil_ros.screen.scene import Scene

# Of message time, after which the last answer of a machine counts no more.
_QUIET_NS = 3 * NANOSECONDS
# Between the plant and what belongs to all: no machine is called so, their names are words.
_ALL = 'all-machines'


@dataclass(frozen=True)
class ShownPlant:
    """The machines of a plant that are shown, and the scene that all are in."""

    plant: str
    names: tuple[str, ...]
    scene: Scene

    def entity(self, *parts: str) -> str:
        """Return the path of something that belongs to all of them."""
        return rr.new_entity_path([self.plant, _ALL, *parts])


@dataclass(frozen=True, slots=True)
class _Part:
    """Last answer of one machine."""

    stamp_ns: int
    speed: float
    displacement: ComplexArray


class PlantView:
    """Draws a plant: its scene, and what every housing feels of all machines together."""

    def __init__(
        self, recording: Recording, shown: ShownPlant, channels: Sequence[Channel],
    ) -> None:
        self._recording, self._shown = recording, shown
        self._channels = tuple(channels)
        self._rows: list[tuple[int, str, _Part]] = []
        self._last: dict[str, _Part] = {}
        self._picture = Picture(recording, shown.entity('picture'), shown.entity('caption'),
                                shown.scene, shown.names)

    def take(self, event: Predicted) -> None:
        """Collect the answers of one of its machines, as many as are drawn."""
        if event.machine not in self._shown.names:
            return
        stamps, found = event.stamp_ns, event.prediction
        rows = self._recording.begins(
            f'{self._shown.plant} of {event.machine}', stamps, FRAME_NS)
        for row in rows.tolist():
            part = _Part(int(stamps[row]), float(found.speed[row]), found.displacement[row])
            self._rows.append((part.stamp_ns, event.machine, part))

    @property
    def held_ns(self) -> int:
        """How much message time waits to be sent [ns]."""
        return abs(self._rows[-1][0] - self._rows[0][0]) if self._rows else 0

    def flush(self) -> None:
        """Draw what was collected."""
        rows, self._rows = sorted(self._rows, key=lambda row: row[0]), []
        frames: list[tuple[int, list[_Part | None]]] = []
        # A frame holds what all have said by the end of its time.
        for _, period in groupby(rows, key=lambda row: row[0] // FRAME_NS):
            said = list(period)
            self._last |= {name: part for _, name, part in said}
            last_ns = said[-1][0]
            frames.append((last_ns, [self._heard(name, last_ns) for name in self._shown.names]))
        stamps = np.array([stamp_ns for stamp_ns, _ in frames], dtype=np.int64)
        new = self._recording.begins(f'{self._shown.plant} frames', stamps, FRAME_NS)
        if len(new):
            self._draw(stamps[new], [frames[row][1] for row in new])

    def _heard(self, name: str, stamp_ns: int) -> _Part | None:
        part = self._last.get(name)
        if part is None or abs(stamp_ns - part.stamp_ns) > _QUIET_NS or not np.isfinite(
                part.displacement).all():
            return None
        return part

    def _draw(self, stamp_ns: IntArray, frames: Sequence[Sequence[_Part | None]]) -> None:
        still = np.zeros(len(self._channels), dtype=complex)
        self._picture.draw(
            stamp_ns,
            np.array([[part.speed if part else math.nan for part in parts] for parts in frames]),
            np.array([[part.displacement if part else still for part in parts]
                      for parts in frames]))
        total = 1e3 * np.array([self._together(parts).velocity_rms for parts in frames])
        housings = [column for column, channel in enumerate(self._channels) if channel.is_housing]
        for number, column in enumerate(housings):
            channel = self._channels[column]
            self._recording.series(
                self._shown.entity('total', channel), stamp_ns, total[:, column],
                style=rr.SeriesLines(
                    names=channel, colors=CHANNEL_COLOURS[number % len(CHANNEL_COLOURS)]))

    def _together(self, parts: Sequence[_Part | None]) -> Shaken:
        heard = {name: part for name, part in zip(self._shown.names, parts, strict=True) if part}
        return Shaken(
            tuple(heard), self._channels, np.array([part.speed for part in heard.values()]),
            np.array([part.displacement for part in heard.values()]).reshape(
                -1, len(self._channels)))
