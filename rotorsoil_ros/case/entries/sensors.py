"""What a case says of the accelerometers on the machine: of all of them, and of some."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
import difflib
import math

from rotorsoil_ros.case.case_errors import Faults
from rotorsoil_ros.case.schema import PickupEntry
from rotorsoil_ros.errors import require


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

    def __post_init__(self) -> None:
        require(self.range > 0.0, 'range', '> 0 m/s^2', self.range)

    @classmethod
    def of(cls, entry: PickupEntry) -> 'Pickup':
        """Return what an entry says."""
        return cls(math.inf if entry.range is None else entry.range, entry.units or '',
                   entry.orientation == 'use', entry.stamps == 'packets', entry.anti_alias is True)


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
    entry = faults.entries.sensors
    said = entry.model_dump(exclude={'channels'}, exclude_none=True)
    if faults.entries.anti_alias and 'anti_alias' not in said:
        said['anti_alias'] = True

    def usual() -> Pickup:
        with faults.at('sensors', entry=entry):
            return Pickup.of(PickupEntry(**said))

    def other(_: int, name: str) -> Pickup:
        if name not in channels:
            near = difflib.get_close_matches(name, channels, n=1)
            raise faults.error('sensors', 'channels', name, problem=(
                'is not a channel of this machine' + (
                    f'; did you mean {near[0]}?' if near else '')))
        own = entry.channels[name]
        with faults.at('sensors', 'channels', name, entry=own):
            return Pickup.of(PickupEntry(**said | own.model_dump(exclude_none=True)))

    found = faults.attempt(usual)
    others = faults.attempt_each(other, entry.channels)
    if found is None or others is None:
        return None
    return Sensors(found, dict(zip(entry.channels, others, strict=True)))
