"""Whether a vibration is good, acceptable or dangerous by the usual limits."""

from dataclasses import dataclass
import math
from typing import Literal, TypeAlias

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
    Boundaries A/B, B/C and C/D of housing velocity.

    Attributes
    ----------
    label : str
        Where the figures come from.
    rigid, flexible : tuple of three floats
        Root mean square [m/s] for the two support classes.

    """

    label: str
    rigid: tuple[float, float, float]
    flexible: tuple[float, float, float]

    def __post_init__(self) -> None:
        for name, limits in (('rigid', self.rigid), ('flexible', self.flexible)):
            if not 0.0 < limits[0] < limits[1] < limits[2] < math.inf:
                raise RotorSoilError(f'{name} must be three rising velocities > 0 m/s, '
                                     f'got {limits}')

    def of(self, support: SupportClass) -> tuple[float, float, float]:
        """Return the boundaries [m/s] for one class of support."""
        return self.rigid if support == 'rigid' else self.flexible


ISO_10816_3 = {
    1: ZoneLimits('ISO 10816-3:2009 group 1', (2.3e-3, 4.5e-3, 7.1e-3),
                  (3.5e-3, 7.1e-3, 11.0e-3)),
    2: ZoneLimits('ISO 10816-3:2009 group 2', (1.4e-3, 2.8e-3, 4.5e-3),
                  (2.3e-3, 4.5e-3, 7.1e-3)),
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
