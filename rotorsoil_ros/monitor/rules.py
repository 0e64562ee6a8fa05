"""What a machine has to keep to, so that it counts as behaving as predicted."""

from dataclasses import dataclass, field
import math

from rotorsoil_ros.case.config import Case
from rotorsoil_ros.case.entries.sensors import Sensors
from rotorsoil_ros.case.zone_limits import ISO_10816_3, USUAL_GROUP, ZoneLimits
from rotorsoil_ros.errors import require


@dataclass(frozen=True, slots=True)
class Matching:
    """
    How points are matched and cleaned.

    Attributes
    ----------
    tolerance : float
        Largest distance between the stamps of a measurement and of a speed [s].
    slow_roll_speed : float
        Speed whose mean vector is runout and is subtracted from the channel [rad/s]; NaN: none.
    noise : float
        Amplitude below which nothing is compared [m, rad].

    """

    tolerance: float = 0.05
    slow_roll_speed: float = math.nan
    noise: float = 0.0

    def __post_init__(self) -> None:
        require(0.0 <= self.tolerance < math.inf, 'tolerance', '>= 0 s and finite',
                self.tolerance)
        require(not self.slow_roll_speed <= 0.0, 'slow_roll_speed', '> 0 rad/s',
                self.slow_roll_speed)
        require(0.0 <= self.noise < math.inf, 'noise', '>= 0 m and finite', self.noise)


@dataclass(frozen=True, slots=True)
class Rules:
    """
    When a machine behaves as predicted.

    Attributes
    ----------
    matching : Matching
        How points are matched and cleaned.
    amplitude_margin : float
        Share by which an amplitude may lie outside the band and still count as inside.
    inside_share : float
        Share of a channel's points that must be inside.
    critical_margin : float
        Share by which a measured critical speed may differ from the predicted one, and a
        measured peak may exceed what is predicted (API 617, verification by test: 5 %).
    largest_lag : float
        Share of a mode's response by which a changing speed may lead it away from the steady
        one; points beyond are not held against the machine.
    zones : ZoneLimits
        Of housing velocity.

    """

    matching: Matching = field(default_factory=Matching)
    amplitude_margin: float = 0.10
    inside_share: float = 0.90
    critical_margin: float = 0.05
    largest_lag: float = 0.05
    zones: ZoneLimits = ISO_10816_3[USUAL_GROUP]

    def __post_init__(self) -> None:
        for name in ('amplitude_margin', 'inside_share', 'critical_margin', 'largest_lag'):
            require(0.0 <= getattr(self, name) <= 1.0, name, 'in [0, 1]', getattr(self, name))


@dataclass(frozen=True, slots=True)
class Judging:
    """
    How measurements are held against predictions.

    Attributes
    ----------
    rules : Rules
        When a machine behaves as predicted.
    turns : float
        Turns of the rotor that make one vector of raw samples.
    band_period_s : float
        Message time between two bands while the speed changes; 0: one with every speed [s].
    sensors : Sensors
        What is known of the accelerometers.

    """

    rules: Rules = field(default_factory=Rules)
    turns: float = 10.0
    band_period_s: float = 0.1
    sensors: Sensors = field(default_factory=Sensors)

    @classmethod
    def of(cls, case: Case, *, matching: Matching | None = None, **other: float) -> 'Judging':
        """Return how a case is judged."""
        return cls(Rules(matching=matching or Matching(), zones=case.zones),
                   sensors=case.sensors, **other)
