"""What a machine has to keep to, so that it counts as behaving as predicted."""

from dataclasses import dataclass, field

from rotorsoil_ros.case.zone_limits import ISO_10816_3, USUAL_GROUP, ZoneLimits
from rotorsoil_ros.errors import require
from rotorsoil_ros.monitor.points import Matching


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
    zones : ZoneLimits
        Of housing velocity.

    """

    matching: Matching = field(default_factory=Matching)
    amplitude_margin: float = 0.10
    inside_share: float = 0.90
    critical_margin: float = 0.05
    zones: ZoneLimits = ISO_10816_3[USUAL_GROUP]

    def __post_init__(self) -> None:
        for name in ('amplitude_margin', 'inside_share', 'critical_margin'):
            require(0.0 <= getattr(self, name) <= 1.0, name, 'in [0, 1]', getattr(self, name))
