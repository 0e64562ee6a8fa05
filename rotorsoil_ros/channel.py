"""Which motion of which place? The name of a channel, and what it is made of."""

from collections.abc import Iterable
from dataclasses import dataclass

from rotorsoil_ros.errors import RotorSoilError

# Degrees of freedom of a block and its contact, in the order of every matrix over them.
DOFS = ('x', 'y', 'z', 'rx', 'ry', 'rz')

# Across the shaft: the degrees of freedom of everything that is on it or carries it.
ACROSS = ('x', 'z')

# Parts of a bearing; discs, probes and foundations have none.
JOURNAL, HOUSING = 'journal', 'housing'


@dataclass(frozen=True, eq=False, repr=False)
class Channel(str):
    """
    One motion of one place.

    It *is* its name, `<station>_<part>_<axis>` or `<station>_<axis>`, so that messages, logs
    and tables carry it and look it up as any name. What it is made of is told to it once: by
    the model that has it, or by `parse` at the edge where only a name is known.

    Attributes
    ----------
    station : str
        Name of the bearing, disc, probe or foundation.
    part : str
        `journal` or `housing` of a bearing, empty for anything else.
    axis : str
        One of x, y, z, rx, ry, rz; empty where somebody's name does not tell it.

    """

    station: str
    part: str
    axis: str

    def __new__(cls, station: str, part: str, axis: str) -> 'Channel':
        """Spell the name, the same wherever the channel is met."""
        if axis and axis not in DOFS:
            raise RotorSoilError(f'axis must be one of {", ".join(DOFS)}, got {axis!r}')
        return super().__new__(cls, '_'.join(filter(None, (station, part, axis))))

    def __reduce__(self) -> tuple[type['Channel'], tuple[str, str, str]]:
        """Let a copy and another process make it anew."""
        return type(self), (self.station, self.part, self.axis)

    @classmethod
    def parse(cls, name: str) -> 'Channel':
        """
        Return the channel of a name that no model explains.

        A disc named `fan_journal` reads as the journal of a bearing `fan`: who has a model
        looks the name up among its channels instead, as `named` does.
        """
        place, _, axis = name.rpartition('_')
        if not place or axis not in DOFS:
            return cls(name, '', '')
        station, _, part = place.rpartition('_')
        if station and part in (JOURNAL, HOUSING):
            return cls(station, part, axis)
        return cls(place, '', axis)

    @property
    def name(self) -> str:
        """Its name, as messages and logs spell it."""
        return str(self)

    @property
    def place(self) -> str:
        """Name of what moves, without its direction."""
        return '_'.join(filter(None, (self.station, self.part)))

    @property
    def motion(self) -> str:
        """What of its station it is: `journal_x`, `rx`."""
        return '_'.join(filter(None, (self.part, self.axis)))

    @property
    def is_rotation(self) -> bool:
        """Whether it turns about its axis instead of moving along it."""
        return self.axis in DOFS[3:]

    @property
    def is_housing(self) -> bool:
        """Whether it is of a bearing housing: what vibration zones judge."""
        return self.part == HOUSING

    @property
    def unit(self) -> str:
        """Unit of its displacement: m, or rad of a rotation."""
        return 'rad' if self.is_rotation else 'm'


def named(name: str, known: Iterable[Channel]) -> Channel:
    """Return the channel of a name: the one that is known under it, else what it reads as."""
    return next((channel for channel in known if channel == name), None) or Channel.parse(name)


def across(station: str, part: str = '') -> tuple[Channel, Channel]:
    """Return the channels of a place along x and along z."""
    x, z = (Channel(station, part, axis) for axis in ACROSS)
    return x, z
