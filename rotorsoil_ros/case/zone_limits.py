"""Whether a vibration is good, acceptable or dangerous by the usual limits."""

from dataclasses import dataclass, replace
import math
from typing import Literal, TypeAlias

from rotorsoil_ros.case.case_errors import Faults
from rotorsoil_ros.case.schema import ZonesEntry
from rotorsoil_ros.errors import RotorSoilError

SupportClass: TypeAlias = Literal['rigid', 'flexible']
Zone: TypeAlias = Literal['A', 'B', 'C', 'D']

# A support counts as rigid in a direction if its lowest natural frequency there is at least
# this multiple of the running frequency.
RIGID_MARGIN = 1.25

_ZONES: tuple[Zone, ...] = ('A', 'B', 'C', 'D')


@dataclass(frozen=True, slots=True)
class ZoneLimits:
    """
    Boundaries A/B, B/C and C/D of housing vibration.

    Attributes
    ----------
    label : str
        Where the figures come from.
    rigid, flexible : tuple of three floats
        Root mean square [m/s] for the two support classes.
    rigid_displacement, flexible_displacement : tuple of three floats or None
        The same of displacement [m]: of both the stricter holds. None is no limit.
    baseline : float or None
        What the machine vibrates with when it is well [m/s], from which an alarm is set.

    """

    label: str
    rigid: tuple[float, float, float]
    flexible: tuple[float, float, float]
    rigid_displacement: tuple[float, float, float] | None = None
    flexible_displacement: tuple[float, float, float] | None = None
    baseline: float | None = None

    def __post_init__(self) -> None:
        for name, limits, unit in (
                ('rigid', self.rigid, 'velocities > 0 m/s'),
                ('flexible', self.flexible, 'velocities > 0 m/s'),
                ('rigid_displacement', self.rigid_displacement, 'displacements > 0 m'),
                ('flexible_displacement', self.flexible_displacement, 'displacements > 0 m')):
            if limits is not None and not 0.0 < limits[0] < limits[1] < limits[2] < math.inf:
                raise RotorSoilError(f'{name} must be three rising {unit}, got {limits}')
        if self.baseline is not None and not 0.0 < self.baseline < math.inf:
            raise RotorSoilError(f'baseline must be > 0 m/s and finite, got {self.baseline:g}')

    def of(self, support: SupportClass, speed: float = math.inf) -> tuple[float, float, float]:
        """
        Return the boundaries [m/s] for one class of support.

        Parameters
        ----------
        support : str
            `rigid` or `flexible`.
        speed : float
            Of the rotor, with which the housing vibrates [rad/s]: a displacement d is a velocity
            of speed times d, which is the stricter one of slow machines.

        """
        velocities, displacements = (
            (self.rigid, self.rigid_displacement) if support == 'rigid'
            else (self.flexible, self.flexible_displacement))
        if displacements is None:
            return velocities
        first, second, third = (min(velocity, speed * displacement) for velocity, displacement
                                in zip(velocities, displacements, strict=True))
        return first, second, third

    def alarm(self, support: SupportClass, speed: float = math.inf) -> float:
        """
        Return the velocity that is an alarm [m/s rms].

        References
        ----------
        ISO 20816-1: a quarter of boundary B/C above the baseline, and not more than 1.25 times
        that boundary; without a baseline the boundary itself.

        """
        _, boundary, _ = self.of(support, speed)
        if self.baseline is None:
            return boundary
        return min(self.baseline + _ABOVE_BASELINE * boundary, _MOST * boundary)

    def trip(self, support: SupportClass, speed: float = math.inf) -> float:
        """Return the velocity at which to stop [m/s rms], 1.25 times boundary C/D at most."""
        return _MOST * self.of(support, speed)[2]


# Of the boundaries B/C and C/D: how far an alarm lies above a baseline, and the most it may be.
_ABOVE_BASELINE, _MOST = 0.25, 1.25

# Quoted from general knowledge: the text of the standard is not public, and for displacement no
# public source was found. All that was checked: displacement and velocity of one row meet at
# 12.5 Hz (group 1) and at 10 Hz (group 2).
ISO_10816_3 = {
    1: ZoneLimits('ISO 10816-3:2009 group 1', (2.3e-3, 4.5e-3, 7.1e-3),
                  (3.5e-3, 7.1e-3, 11.0e-3), (29e-6, 57e-6, 90e-6), (45e-6, 90e-6, 140e-6)),
    2: ZoneLimits('ISO 10816-3:2009 group 2', (1.4e-3, 2.8e-3, 4.5e-3),
                  (2.3e-3, 4.5e-3, 7.1e-3), (22e-6, 45e-6, 71e-6), (37e-6, 71e-6, 113e-6)),
}
USUAL_GROUP = 2


def zone(velocity_rms: float, limits: tuple[float, float, float]) -> Zone:
    """Return the zone of a root mean square velocity [m/s]; a boundary belongs to the better."""
    if not velocity_rms >= 0.0:
        raise RotorSoilError(f'velocity must be >= 0 m/s, got {velocity_rms:g}')
    return _ZONES[sum(velocity_rms > limit for limit in limits)]


def held_zone(
    before: Zone | None, velocity_rms: float, limits: tuple[float, float, float], *,
    hysteresis: float,
) -> Zone:
    """
    Return the zone, unless the velocity fell less than a share below the boundary it crossed.

    Parameters
    ----------
    before : Zone or None
        The zone so far.
    velocity_rms : float
        Root mean square velocity [m/s].
    limits : tuple of three floats
        Boundaries [m/s].
    hysteresis : float
        Share of a boundary by which a value must fall below it to leave the worse zone.

    """
    now = zone(velocity_rms, limits)
    if before is None or now >= before:
        return now
    eased = tuple(limit * (1.0 - hysteresis) for limit in limits)
    return min(before, zone(velocity_rms, (eased[0], eased[1], eased[2])))


def support_class(lowest_natural_speed: float, speed: float) -> SupportClass:
    """
    Return whether a support counts as rigid in a direction.

    Parameters
    ----------
    lowest_natural_speed : float
        Lowest natural frequency of machine and support in that direction [rad/s].
    speed : float
        Running speed [rad/s].

    """
    return 'rigid' if lowest_natural_speed >= RIGID_MARGIN * speed else 'flexible'


def held_support_class(
    before: SupportClass | None, lowest_natural_speed: float, speed: float, *,
    hysteresis: float,
) -> SupportClass:
    """Return the class of a support, unless the speed is within a share of where it changes."""
    classes = {support_class(lowest_natural_speed, speed * (1.0 + turn * hysteresis))
               for turn in (-1, 1)}
    return before if before in classes else support_class(lowest_natural_speed, speed)


def zones_of(faults: Faults) -> ZoneLimits:
    """Return the limits of a group, or those that the file gives itself."""
    entry = faults.entries.zones or ZonesEntry()
    own = (entry.label, entry.rigid, entry.flexible, entry.rigid_displacement,
           entry.flexible_displacement)
    given = any(part is not None for part in own)
    if entry.group is not None and given:
        raise faults.error('zones', problem='needs either group, or label, rigid and flexible, '
                                            'got both')
    with faults.at('zones', entry=entry):
        if not given:
            return replace(ISO_10816_3[entry.group or USUAL_GROUP], baseline=entry.baseline)
        label, rigid, flexible, *displacements = own
        if label is None or rigid is None or flexible is None:
            raise faults.error('zones', problem='needs label, rigid and flexible together')
        return ZoneLimits(label, rigid, flexible, displacements[0], displacements[1],
                          entry.baseline)
