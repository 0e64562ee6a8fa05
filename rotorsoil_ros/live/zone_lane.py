"""In which zone was every housing, and since when? A lane for each, predicted and measured."""

from collections.abc import Mapping

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from rotorsoil_ros.live.events import Zoned
from rotorsoil_ros.live.recording import Recording

MEASURED, PREDICTED = 'measured', 'predicted'
COLOURS = {'A': (40, 150, 75), 'B': (140, 190, 70), 'C': (225, 160, 30), 'D': (205, 55, 50)}


class ZoneLane:
    """The zones of one machine; only changes are sent."""

    def __init__(self, recording: Recording, entity: str) -> None:
        self._recording = recording
        self._entity = entity
        self._told: dict[tuple[str, str], str] = {}

    @staticmethod
    def views(entity: str, label: str) -> rrb.Horizontal:
        """Return the view of all lanes."""
        return rrb.Horizontal(*(rrb.StateTimelineView(
            name=f'Zones {source}, {label}', origin=f'{entity}/{source}',
            time_view=rrb.TimeAxis(link='LinkToGlobal'))
            for source in (MEASURED, PREDICTED)))

    def draw(self, event: Zoned, stamp_ns: int) -> None:
        """Draw what has changed."""
        self._lanes(PREDICTED, event.predicted, stamp_ns)
        self._lanes(MEASURED, event.measured, stamp_ns)

    def _lanes(self, source: str, zones: Mapping[str, str], stamp_ns: int) -> None:
        known = {channel for channel, of_source in self._told if of_source == source}
        for channel in sorted(known | set(zones)):
            zone = zones.get(channel, '')
            if self._told.get((channel, source), '') == zone:
                continue
            lane = f'{self._entity}/{source}/{channel}'
            if (channel, source) not in self._told:
                self._recording.still(lane, rr.StateConfiguration(
                    values=list(COLOURS), labels=list(COLOURS),
                    colors=list(COLOURS.values())))
            self._told[channel, source] = zone
            self._recording.send(lane, np.array([stamp_ns]),
                                 rr.StateChange.columns(state=[zone]))
