"""Is this foundation right for this machine? Everything that one page says, as numbers."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
import math
from typing import Any

import numpy as np

import rotorsoil_ros
from rotorsoil_ros.arrays import FloatArray
from rotorsoil_ros.case.authoring.comments import Guess
from rotorsoil_ros.case.config import Case
from rotorsoil_ros.case.design.influence import Influence
from rotorsoil_ros.case.design.inputs import key_of
from rotorsoil_ros.case.design.margins import NearModes, SeparationMargin
from rotorsoil_ros.case.zone_limits import SupportClass, Zone, zone
from rotorsoil_ros.channel import Channel
from rotorsoil_ros.machine.damping import DampingSplit
from rotorsoil_ros.units import rad_s_to_rpm, to_mm_s_rms, to_um_pp

# Modes on the page.
NEAREST = 3
GOOD_ZONES = ('A', 'B')


class Acceptance(StrEnum):
    """Whether a foundation is right for its machine."""

    ACCEPTABLE = 'acceptable'
    NOT_ACCEPTABLE = 'not acceptable'
    UNDECIDED = 'undecided'


@dataclass(frozen=True, slots=True)
class HousingAnswer:
    """
    How one housing vibrates in one direction.

    Attributes
    ----------
    channel : Channel
        Which housing, and along which axis.
    amplitude : (3,) float array
        Displacement on the lowest edge of the band, of the case itself, and on the highest edge,
        zero-to-peak [m]; NaN where none is known.
    speed : float
        Of the rotor [rad/s].
    support : str
        Whether the machine counts as on a rigid or a flexible support along this axis.
    limits : tuple of three floats
        Boundaries of the zones [m/s rms].

    """

    channel: Channel
    amplitude: FloatArray
    speed: float
    support: SupportClass
    limits: tuple[float, float, float]

    @property
    def velocity(self) -> FloatArray:
        """Lowest, nominal and highest velocity, (3,) [m/s rms]."""
        return self.speed * self.amplitude / math.sqrt(2.0)

    @property
    def zones(self) -> tuple[Zone | None, ...]:
        """Zones of the three; None where there is no number."""
        return tuple(zone(value, self.limits) if math.isfinite(value) else None
                     for value in self.velocity.tolist())

    @property
    def worst(self) -> Zone | None:
        """Worst zone that is known."""
        return max((one for one in self.zones if one is not None), default=None)

    @property
    def badness(self) -> float:
        """Largest velocity that is known over boundary B/C [-]."""
        return float(np.nanmax(self.velocity, initial=0.0)) / self.limits[1]


@dataclass(frozen=True, slots=True)
class DesignReport:
    """
    What is to be said of one machine at one speed.

    Attributes
    ----------
    case : Case
        The machine.
    speed : float
        Of the rotor [rad/s].
    verdict : Acceptance
        In one word.
    reasons : tuple of str
        Why, the weightiest first.
    stable : bool or None
        Whether every vibration of the machine decays at this speed; None where that is not known.
    housings : tuple of HousingAnswer
        Those that can move at all, the worst first.
    modes : NearModes
        Critical speeds about it.
    damping : DampingSplit or None
        Where the energy of the unbalance goes; None without one, or without a steady answer.
    influences : tuple of Influence
        What each uncertain input does to the worst housing, the strongest first.
    next_step : str
        What to do now.
    assumptions, not_modelled : tuple of str
        What the answer rests on, and what it leaves out.
    guesses : tuple of Guess
        What of the case its file marks as guessed.

    """

    case: Case
    speed: float
    verdict: Acceptance
    reasons: tuple[str, ...]
    stable: bool | None
    housings: tuple[HousingAnswer, ...]
    modes: NearModes
    damping: DampingSplit | None
    influences: tuple[Influence, ...]
    next_step: str
    assumptions: tuple[str, ...]
    not_modelled: tuple[str, ...]
    guesses: tuple[Guess, ...]

    @property
    def speed_rpm(self) -> float:
        """Speed of the rotor [rpm]."""
        return rad_s_to_rpm(self.speed)

    @property
    def sentence(self) -> str:
        """The verdict and its first reason."""
        return f'{self.verdict[0].upper()}{self.verdict[1:]}: {self.reasons[0]}.'

    def to_json(self) -> dict[str, Any]:
        """Return everything in units of a plant, None where there is no number."""
        return {
            'verdict': str(self.verdict), 'sentence': self.sentence,
            'reasons': list(self.reasons), 'machine': self.case.name,
            'case_file': str(self.case.path), 'version': rotorsoil_ros.__version__,
            'speed_rpm': round(self.speed_rpm, 6), 'stable': self.stable,
            'housings': [_housing(one) for one in self.housings],
            'modes': [_mode(one) for one in self.modes.nearest(NEAREST)],
            'modes_searched_rpm': [rad_s_to_rpm(speed) for speed in self.modes.span],
            'damping': None if self.damping is None else {
                'power_w': float(self.damping.power[0]), 'shares': self.damping.shares(0)},
            'decides': _influence(self.influences[0]) if self.influences else None,
            'influences': [_influence(one) for one in self.influences],
            'next_step': self.next_step, 'zone_limits': self.case.zones.label,
            'inputs': self.case.content, 'assumptions': list(self.assumptions),
            'guesses': [{'key': one.key, 'why': one.why} for one in self.guesses],
            'not_modelled': list(self.not_modelled),
        }


def _numbers(values: FloatArray) -> list[float | None]:
    return [value if math.isfinite(value) else None for value in values.tolist()]


def _housing(one: HousingAnswer) -> Mapping[str, Any]:
    return {
        'housing': str(one.channel),
        'velocity_mm_s_rms': _numbers(to_mm_s_rms(one.speed * one.amplitude)),
        'displacement_um_pp': _numbers(to_um_pp(one.amplitude)),
        'zone': one.zones[1], 'zones': list(one.zones), 'support': one.support,
        'limits_mm_s_rms': [1e3 * limit for limit in one.limits],
    }


def _mode(one: SeparationMargin) -> Mapping[str, Any]:
    critical = one.critical
    return {
        'name': one.name, 'rpm': critical.speed_rpm, 'damping_ratio': critical.damping_ratio,
        'whirl': 'forward' if critical.whirl > 0 else 'backward', 'margin': one.margin,
        'required_margin': one.required, 'kept': not one.is_missed,
        'damping_shares': None if one.split is None else one.split.shares(0),
    }


def _influence(one: Influence) -> Mapping[str, Any]:
    [largest] = _numbers(1e3 * np.array([one.largest]))
    return {
        'input': one.input.words, 'key': f'uncertainty.{key_of(one.key)}',
        'velocity_mm_s_rms': _numbers(1e3 * one.ends), 'largest_mm_s_rms': largest,
        'swing': one.swing if math.isfinite(one.swing) else None, 'advice': one.input.advice,
    }
