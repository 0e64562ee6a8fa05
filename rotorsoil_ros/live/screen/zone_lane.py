"""In which zone was every housing, and since when? A lane for each, predicted and measured."""

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from rotorsoil_ros.live.events import Zoned
from rotorsoil_ros.live.screen.recording import Recording

MEASURED, PREDICTED = 'measured', 'predicted'
UNKNOWN = '-'
COLOURS = {'A': (40, 150, 75), 'B': (140, 190, 70), 'C': (225, 160, 30), 'D': (205, 55, 50),
           UNKNOWN: (70, 70, 70)}


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
        # A lane that says that nothing is measured is more than an empty view.
        channels = {*event.predicted, *event.measured, *(channel for channel, _ in self._told)}
        for channel in sorted(channels):
            for source, zones in ((PREDICTED, event.predicted), (MEASURED, event.measured)):
                self._tell(channel, source, zones.get(channel) or UNKNOWN, stamp_ns)

    def _tell(self, channel: str, source: str, zone: str, stamp_ns: int) -> None:
        before = self._told.get((channel, source))
        if zone == before:
            return
        self._told[channel, source] = zone
        lane = f'{self._entity}/{source}/{channel}'
        if before is None:
            self._recording.still(lane, rr.StateConfiguration(
                values=list(COLOURS), labels=[*list(COLOURS)[:-1], f'not {source}'],
                colors=list(COLOURS.values())))
        self._recording.send(lane, np.array([stamp_ns]), rr.StateChange.columns(state=[zone]))
