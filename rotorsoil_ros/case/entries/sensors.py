"""What a case says of the accelerometers on the machine: of all of them, and of some."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
import difflib
import math

from rotorsoil_ros.case.case_errors import Faults
from rotorsoil_ros.case.schema import PickupEntry
from rotorsoil_ros.errors import require, RotorSoilError


@dataclass(frozen=True, slots=True)
class Pickup:
    """
    One accelerometer.

    Attributes
    ----------
    range : float
        Largest acceleration that it tells, of either sign [m/s^2].
    units : str
        In which its messages are, `m/s^2` or `g`; empty where nobody says.
    heading : float
        Of its own x axis about the vertical, from x of the machine on [rad]: towards y where the
        shaft lies.
    is_upright : bool
        Whether the shaft of the machine stands: its y is the vertical then.
    has_orientation : bool
        Whether the `orientation` of its messages turns its axes into those of the machine.
    comes_in_packets : bool
        Whether stamps tell when a packet of samples came, the last one taken just then.
    has_filter : bool
        Whether a filter before its converter lets nothing above half its rate pass.

    """

    range: float = math.inf
    units: str = ''
    has_orientation: bool = False
    comes_in_packets: bool = False
    has_filter: bool = False
    heading: float = 0.0
    is_upright: bool = False

    def __post_init__(self) -> None:
        require(self.range > 0.0, 'range', '> 0 m/s^2', self.range)

        require(-math.tau <= self.heading <= math.tau, 'heading_deg', 'between -360 and 360 deg',
                math.degrees(self.heading))
        if self.heading and self.has_orientation:
            raise RotorSoilError('heading_deg must not stand beside orientation: use, which tells '
                                 f'it, got {math.degrees(self.heading):g}')

    @classmethod
    def of(cls, entry: PickupEntry, *, is_upright: bool) -> 'Pickup':
        """Return what an entry says, on a machine whose shaft stands or lies."""
        return cls(math.inf if entry.range is None else entry.range, entry.units or '',
                   entry.orientation == 'use', entry.stamps == 'packets',
                   entry.anti_alias is True, math.radians(entry.heading_deg or 0.0), is_upright)


@dataclass(frozen=True, slots=True)
class Sensors:
    """All accelerometers of a machine: what holds for every one, and those that differ."""

    usual: Pickup = Pickup()
    others: Mapping[str, Pickup] = field(default_factory=dict)

    def of(self, channel: str) -> Pickup:
        """Return what is known of the accelerometer of a channel."""
        return self.others.get(channel, self.usual)


def sensors_of(faults: Faults, channels: Sequence[str]) -> Sensors | None:
    """Return what a document says of the accelerometers at channels, or None where it is wrong."""
    entry, is_upright = faults.entries.sensors, faults.entries.rotor.orientation == 'vertical'
    said = entry.model_dump(exclude={'channels'}, exclude_none=True)
    if faults.entries.anti_alias and 'anti_alias' not in said:
        said['anti_alias'] = True

    def usual() -> Pickup:
        with faults.at('sensors', entry=entry):
            return Pickup.of(PickupEntry(**said), is_upright=is_upright)

    def other(_: int, name: str) -> Pickup:
        if name not in channels:
            near = difflib.get_close_matches(name, channels, n=1)
            raise faults.error('sensors', 'channels', name, problem=(
                'is not a channel of this machine' + (
                    f'; did you mean {near[0]}?' if near else '')))
        own = entry.channels[name]
        with faults.at('sensors', 'channels', name, entry=own):
            return Pickup.of(PickupEntry(**said | own.model_dump(exclude_none=True)),
                             is_upright=is_upright)

    found = faults.attempt(usual)
    others = faults.attempt_each(other, entry.channels)
    if found is None or others is None:
        return None
    return Sensors(found, dict(zip(entry.channels, others, strict=True)))
