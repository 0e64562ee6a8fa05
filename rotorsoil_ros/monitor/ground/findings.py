"""What sensors on the ground say of a whole run, and how far that is to be trusted."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rotorsoil_ros.arrays import ComplexArray
from rotorsoil_ros.channel import Channel
from rotorsoil_ros.events import Event, Grounded
from rotorsoil_ros.monitor.ground.account import GroundShare
from rotorsoil_ros.monitor.ground.attribution import Attribution
from rotorsoil_ros.monitor.ground.broadband import Broadband, STRETCH_S
from rotorsoil_ros.monitor.points import ChannelPoints
from rotorsoil_ros.monitor.zones import HousingZone


@dataclass(frozen=True, eq=False)
class GroundFindings:
    """
    What ground that moves by itself did in a run.

    Attributes
    ----------
    parts : mapping of Channel to (n,) complex array
        What it did to every channel at each of its points [m, rad]; NaN where nobody knows.
    shares : list of GroundShare
        Over the points that are used, of every channel of which something is known.
    zones : list of HousingZone
        Worst measured zone of every housing without what the ground did.
    broadband : list of Broadband
        Of every frequency, by sensor and housing.
    remarks : list of str
        What a reader should know.

    """

    parts: dict[Channel, ComplexArray]
    shares: list[GroundShare]
    zones: list[HousingZone]
    broadband: list[Broadband]
    remarks: list[str]


class GroundCollector:
    """A sink that keeps what the ground did."""

    def __init__(self) -> None:
        self._told: list[Grounded] = []

    def __call__(self, event: Event) -> None:
        """Keep motions of the ground."""
        if isinstance(event, Grounded):
            self._told.append(event)

    def findings(
        self, attribution: Attribution, points: Sequence[ChannelPoints],
    ) -> GroundFindings:
        """Return what is to be said of a run with these points."""
        motion = {stamp: one for event in self._told
                  for stamp, one in zip(event.stamp_ns.tolist(), event.motion, strict=True)}
        unknown = np.full(3, complex(np.nan, np.nan))
        parts, shares = {}, []
        for channel in points:
            moved = np.array([motion.get(stamp, unknown) for stamp in channel.stamp_ns.tolist()])
            part = attribution.parts([channel.channel], channel.speed, moved.reshape(-1, 3)).get(
                channel.channel)
            if part is None:
                continue
            parts[channel.channel] = part
            used = channel.used
            share = GroundShare.of(
                channel.channel, channel.speed[used], channel.measured[used],
                channel.predicted[used], part[used])
            shares += [share] if share.vectors else []
        zones = [one for one in attribution.account.zones.worst() if one.source == 'measured']
        sensors = [f'{name}: {line}' for name, sensor in attribution.sensors.items()
                   for line in sensor.refusals.lines()]
        broadband = list(attribution.spectra.rows())
        is_raw = any(one.is_raw for one in attribution.sensors.values())
        short = [] if broadband or not is_raw else [
            f'no {STRETCH_S} s in which ground and housings were sampled together without a hole: '
            'of other frequencies than the speed nothing is told of the ground']
        return GroundFindings(parts, shares, zones, broadband,
                              [*attribution.doubts(), *(one.doubt for one in shares if one.doubt),
                               *sensors, *short])
