"""What a case says of the accelerometers on the machine and on the ground beside it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
import difflib
import math

from rotorsoil_ros.case.case_errors import Faults
from rotorsoil_ros.case.entries.support_file import RECEPTANCE
from rotorsoil_ros.case.schema import GroundSensorEntry, PickupEntry
from rotorsoil_ros.channel import Channel, DOFS
from rotorsoil_ros.errors import require, RotorSoilError
from rotorsoil_ros.ground.boundary.site import Site
from rotorsoil_ros.ground.soil import Circle, Contact, Rectangle
from rotorsoil_ros.machine.foundation import Foundation


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
class GroundSensor:
    """
    Accelerometer of three axes on the ground.

    Attributes
    ----------
    name : str
        First part of its channels.
    x, y : float
        Where it stands, in the axes of the blocks [m].
    of : str
        Name of the block below which the ground is taken to move as here; empty without any.
    pickup : Pickup
        What is known of it; its axes are those of the blocks, z up.

    """

    name: str
    x: float
    y: float
    of: str
    pickup: Pickup

    @property
    def channels(self) -> tuple[Channel, ...]:
        """Its motions along x, y, z."""
        return tuple(Channel(self.name, '', axis) for axis in DOFS[:3])


@dataclass(frozen=True, slots=True)
class Sensors:
    """All accelerometers: what holds for those on the machine, who differs, and the ground's."""

    usual: Pickup = Pickup()
    others: Mapping[str, Pickup] = field(default_factory=dict)
    ground: tuple[GroundSensor, ...] = ()

    def of(self, channel: str) -> Pickup:
        """Return what is known of the accelerometer of a channel."""
        return self.others.get(channel, self.usual)


def sensors_of(
    faults: Faults, channels: Sequence[str], foundations: Sequence[Foundation],
) -> Sensors | None:
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
    ground = _on_ground(faults, foundations)
    if found is None or others is None or ground is None:
        return None
    return Sensors(found, dict(zip(entry.channels, others, strict=True)), ground)


def _on_ground(
    faults: Faults, foundations: Sequence[Foundation],
) -> tuple[GroundSensor, ...] | None:
    """Return the sensors on the ground, or None where one is at fault."""
    entries = faults.entries.ground
    foundations = [block for block in foundations if block.on is None]
    blocks = {block.name: block for block in foundations}

    def of() -> str:
        if entries.sensors and faults.entries.support.model == RECEPTANCE:
            raise faults.error('ground', 'sensors', problem=(
                'need a support model that tells how the machine follows the ground, got '
                f'{RECEPTANCE}'))
        if entries.of is not None and entries.of not in blocks:
            raise faults.error('ground', 'of', problem=(
                f'must be one of the foundations, {", ".join(blocks) or "none"}, got '
                f'{entries.of}'))
        if entries.of is not None and not entries.sensors:
            raise faults.error('ground', 'of', problem=(
                f'belongs to ground.sensors, of which there are none, got {entries.of}'))
        return entries.of or ''

    def sensor(index: int, entry: GroundSensorEntry) -> GroundSensor:
        with faults.at('ground', 'sensors', index, entry=entry):
            if entry.stamps is not None:
                raise RotorSoilError(f'stamps must not be {entry.stamps} of a sensor on the '
                                     'ground, whose phase is needed')
            x, y = entry.place.x, entry.place.y
            for block in foundations:
                site_around([block], [(x, y)])
            nearest = min(foundations, default=None, key=lambda block: math.dist(
                (x, y), (block.centre_x, block.centre_y)))
            said = entry if entry.anti_alias is not None else entry.model_copy(
                update={'anti_alias': faults.entries.anti_alias})
            return GroundSensor(entry.name, x, y, entries.of or (
                '' if nearest is None else nearest.name), Pickup.of(said, is_upright=False))

    chosen, found = faults.attempt(of), faults.attempt_each(sensor, entries.sensors)
    return None if chosen is None else found


def site_around(
    foundations: Sequence[Foundation], places: Sequence[tuple[float, float]],
) -> Site:
    """
    Return blocks on the ground and places beside them; a circle as a square of its area.

    Raises
    ------
    RotorSoilError
        If a place is not beside the blocks, or blocks overlap.

    """
    grounded = [block for block in foundations if block.on is None]
    return Site.of(tuple(_with_corners(block.contact) for block in grounded),
                   tuple((block.centre_x, block.centre_y) for block in grounded),
                   tuple(places))


def _with_corners(contact: Contact) -> Contact:
    if not isinstance(contact, Circle):
        return contact
    half = 0.5 * math.sqrt(contact.area)
    return Rectangle(half, half)
