"""Which channels are shown together? Each is one entity and has one colour."""

from collections.abc import Sequence
from dataclasses import dataclass

import rerun as rr

from rotorsoil_ros.case.config import Case
from rotorsoil_ros.case.plant.berth import placed
from rotorsoil_ros.channel import Channel

MICRO = 1e6  # [um, urad] per [m, rad]
PROBES, DISCS, JOURNALS, HOUSINGS, BLOCK, ROCKING, NEIGHBOURS = (
    'Probes', 'Discs', 'Journals', 'Housings', 'Foundation', 'Rocking of the foundation',
    'Neighbours')
CHANNEL_COLOURS = ((78, 154, 230), (255, 159, 54), (80, 190, 90), (235, 90, 90), (178, 133, 219),
           (190, 130, 115), (240, 145, 205), (160, 160, 160), (208, 209, 60), (60, 205, 220))


@dataclass(frozen=True, slots=True)
class Trend:
    """
    One channel on the screen.

    Attributes
    ----------
    channel : Channel
        Which.
    column : int
        Of those that are predicted.
    kind, entity : str
        What it is shown among, and its path, split at the station.
    colour : tuple of three ints
        Of its lines.

    """

    channel: Channel
    column: int
    kind: str
    entity: str
    colour: tuple[int, int, int]

    @property
    def unit(self) -> str:
        """Unit in which its displacement is shown."""
        return 'urad' if self.kind == ROCKING else 'um'

    @property
    def faint(self) -> tuple[int, int, int]:
        """Its colour for what stays behind it."""
        red, green, blue = (round(0.55 * part) for part in self.colour)
        return red, green, blue

    @property
    def pale(self) -> tuple[int, int, int]:
        """Its colour for what stands beside it."""
        red, green, blue = (round(part + 0.55 * (255 - part)) for part in self.colour)
        return red, green, blue


def moving_housings(case: Case) -> list[str]:
    """Return the bearings whose housings stand on something that gives way."""
    blocks = {foundation.name for foundation in case.foundations}
    return [bearing.name for bearing in case.rotor.bearings
            if bearing.foundation in blocks or bearing.pedestal is not None]


def trends(machine: str, case: Case, channels: Sequence[Channel]) -> list[Trend]:
    """
    Return how the channels of a case are shown.

    Of a neighbour its housings are, as in every total: with all that it has ten machines would
    show a hundred.
    """
    _, *beside = placed(case)
    owners = {station.name: NEIGHBOURS for _, rotor, _ in beside
              for stations in (rotor.bearings, rotor.discs, rotor.probes) for station in stations}
    owners |= {bearing.name: JOURNALS for bearing in case.rotor.bearings}
    owners |= {disc.name: DISCS for disc in case.rotor.discs}
    owners |= {probe.name: PROBES for probe in case.rotor.probes}
    owners |= {probe.name: PROBES for probe in case.ground_probes}
    owners |= {foundation.name: BLOCK for foundation in case.foundations}
    shown: list[Trend] = []
    for column, channel in enumerate(channels):
        # Patches and probes of a foundation that bends have names of their own.
        kind = _kind(channel, owners.get(channel.station, BLOCK))
        if kind == NEIGHBOURS and not channel.is_housing:
            continue
        colour = CHANNEL_COLOURS[sum(trend.kind == kind for trend in shown) % len(CHANNEL_COLOURS)]
        entity = entity_of(machine, channel.station, channel.motion)
        shown.append(Trend(channel, column, kind, entity, colour))
    return shown


def entity_of(machine: str, *parts: str) -> str:
    """Return the path of something of a machine; one of a plant stands below it."""
    return rr.new_entity_path([*machine.split('/'), *parts])


def _kind(channel: Channel, kind_of_owner: str) -> str:
    if kind_of_owner == NEIGHBOURS:
        return NEIGHBOURS
    if channel.is_housing:
        return HOUSINGS
    return ROCKING if channel.is_rotation else kind_of_owner
