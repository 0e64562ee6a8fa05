"""How far are the critical speeds from a running speed? Each beside what is asked."""

from collections.abc import Sequence
from dataclasses import dataclass
import math

from rotorsoil_ros.case.summary import clipped
from rotorsoil_ros.errors import NotSolvedError, OutOfTableError
from rotorsoil_ros.machine.coupled import CoupledModel
from rotorsoil_ros.machine.damping import DampingSplit, DampingSplitter
from rotorsoil_ros.machine.modes.critical import asked, critical_speeds, CriticalSpeed
from rotorsoil_ros.machine.modes.names import ModeNames
from rotorsoil_ros.machine.peaks import half_power_factors
from rotorsoil_ros.units import rad_s_to_rpm

# Critical speeds are looked for between these multiples of a running speed, or as near as the
# ground is known; the last is just what margins ask.
_REACHES = ((0.2, 2.5), (0.2, 2.0), (0.3, 1.6))


@dataclass(frozen=True, slots=True)
class SeparationMargin:
    """
    One critical speed beside a running speed.

    Attributes
    ----------
    name : str
        What an engineer calls the mode.
    critical : CriticalSpeed
        Where it is.
    half_power_factor : float
        Amplification factor by the response; NaN where it has no peak of this mode.
    margin, required : float
        Distance as a share of the running speed, and the least that it should be [-].
    split : DampingSplit or None
        Where the damping of the mode comes from; None where it hardly swings.

    """

    name: str
    critical: CriticalSpeed
    half_power_factor: float
    margin: float
    required: float
    split: DampingSplit | None

    @property
    def is_missed(self) -> bool:
        """Whether its own unbalance excites this mode, and it is too near."""
        # A mode of a neighbour only as far as the machine's own shaft shows it.
        is_excited = ((self.critical.whirl > 0 and not self.critical.owner)
                      or math.isfinite(self.half_power_factor))
        return is_excited and self.margin < self.required


def separation_margins(
    model: CoupledModel, criticals: Sequence[CriticalSpeed], running: float,
) -> list[SeparationMargin]:
    """Return the margin of every critical speed from a running speed [rad/s]."""
    names = ModeNames(model)
    return [SeparationMargin(
        names.of_critical(critical), critical, half_power, critical.separation_margin(running),
        critical.required_margin(running, half_power=half_power), split)
        for critical, half_power, split in zip(
            criticals, half_power_factors(model, criticals),
            DampingSplitter(model).of_modes(criticals), strict=True)]


@dataclass(frozen=True, slots=True)
class NearModes:
    """
    The critical speeds about a running speed.

    Attributes
    ----------
    margins : tuple of SeparationMargin
        All that were found, rising.
    span : tuple of two floats
        Between which speeds they were looked for [rad/s].
    doubt : str
        What is not known; empty if everything within the margins is.

    """

    margins: tuple[SeparationMargin, ...]
    span: tuple[float, float]
    doubt: str = ''

    def nearest(self, count: int) -> list[SeparationMargin]:
        """Return the nearest, those that are too near before all others, rising with speed."""
        chosen = sorted(self.margins, key=lambda one: (not one.is_missed, one.margin))[:count]
        return sorted(chosen, key=lambda one: one.critical.speed)


def near_modes(model: CoupledModel, running: float) -> NearModes:
    """Look for critical speeds well beyond what margins from a running speed [rad/s] ask."""
    doubt = ''
    for low, high in (*((low * running, high * running) for low, high in _REACHES),
                      asked(running)):
        try:
            span = model.support.within(model.bearings.within_tables((low, high)))
            found = critical_speeds(model, span)
        except (NotSolvedError, OutOfTableError) as error:
            doubt = f'critical speeds of the model are not known: {error}'
            continue
        least, most = asked(running)
        needed = max(least, low), min(most, high)
        short = clipped(model, span, needed)
        return NearModes(tuple(separation_margins(model, found, running)), span,
                         '; '.join(short))
    return NearModes((), (running, running), doubt)


def searched(found: NearModes) -> str:
    """Return between which speeds critical ones were looked for."""
    low, high = (rad_s_to_rpm(speed) for speed in found.span)
    return f'{low:.0f} to {high:.0f} rpm'
