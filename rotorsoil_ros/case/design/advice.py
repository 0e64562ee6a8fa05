"""What speaks against a machine, what is not known of it, and what to do next."""

from collections.abc import Sequence
from dataclasses import dataclass, field
import math
from typing import TYPE_CHECKING

import numpy as np

from rotorsoil_ros.case.config import Case
from rotorsoil_ros.case.design.influence import Influence, on_larger_blocks, velocity
from rotorsoil_ros.case.design.margins import NearModes, searched
from rotorsoil_ros.case.design.report import Acceptance, GOOD_ZONES, HousingAnswer
from rotorsoil_ros.case.summary import stability_doubts, unstable
from rotorsoil_ros.errors import RotorSoilError
from rotorsoil_ros.machine.modes.stability import Stability
from rotorsoil_ros.units import rad_s_to_rpm

if TYPE_CHECKING:
    from rotorsoil_ros.case.machine import Machine

# One step of the balance grades of ISO 21940-11, and a block that is this much larger.
_GRADE_STEP, _LARGER = 2.5, 1.25
_MM = 1e3


@dataclass(slots=True)
class Findings:
    """
    What was found out, in sentences without their full stop.

    Attributes
    ----------
    stable : bool or None
        As `DesignReport` has it.
    bad, unknown, good : list of str
        What speaks against the machine, what is not known, and what speaks for it.

    """

    stable: bool | None
    bad: list[str] = field(default_factory=list)
    unknown: list[str] = field(default_factory=list)
    good: list[str] = field(default_factory=list)

    @property
    def in_order(self) -> tuple[str, ...]:
        """All sentences, those that decide first."""
        return (*self.bad, *self.unknown, *self.good)


def verdict_of(found: Findings) -> Acceptance:
    """Return the verdict: what is bad decides, then what is not known."""
    if found.bad:
        return Acceptance.NOT_ACCEPTABLE
    return Acceptance.UNDECIDED if found.unknown else Acceptance.ACCEPTABLE


def findings(
    case: Case, growth: Stability, housings: Sequence[HousingAnswer], modes: NearModes,
    moved: Sequence[Influence],
) -> Findings:
    """Return what speaks against a machine at its speed, and what is not known."""
    doubts = list(stability_doubts(growth))
    found = Findings(False if growth.instabilities else None if doubts else True)
    found.bad += [f'no steady vibration exists, {text}' for text in unstable(growth)]
    found.unknown += doubts
    if not housings:
        found.unknown.append('ground and pedestals are rigid in this case, so that no housing '
                             'moves in it')
    elif not np.any(case.unbalance):
        found.unknown.append('the case has no unbalance, so that nothing excites the machine')
    elif found.stable is not False:
        _of_vibration(found, housings)
    found.bad += [
        f'{one.name} is critical at {one.critical.speed_rpm:.0f} rpm, {one.margin:.0%} from the '
        f'running speed, where {one.required:.0%} is asked' for one in modes.margins
        if one.is_missed]
    if modes.doubt:
        found.unknown.append(modes.doubt)
    elif not any(one.is_missed for one in modes.margins):
        found.good.append(f'every critical speed from {searched(modes)} keeps its margin')
    for one in moved:
        if not math.isfinite(one.largest):
            end = one.input.low if math.isnan(one.velocity[0]) else one.input.high
            found.unknown.append(f'with {end} the machine has no steady vibration')
    return found


def _of_vibration(found: Findings, housings: Sequence[HousingAnswer]) -> None:
    worst = housings[0]
    rpm = rad_s_to_rpm(worst.speed)
    low, nominal, high = (_MM * worst.velocity).tolist()
    limit = _MM * worst.limits[1]
    if not math.isfinite(nominal):
        found.bad.append(f'at {rpm:.0f} rpm a resonance without damping has no steady answer')
        return
    bad = [one for one in housings if one.zones[1] not in GOOD_ZONES]
    if bad:
        one = max(bad, key=lambda own: float(own.velocity[1]))
        found.bad.append(
            f'{one.channel} vibrates with {_MM * one.velocity[1]:.3g} mm/s rms at {rpm:.0f} rpm, '
            f'zone {one.zones[1]}; up to {_MM * one.limits[1]:.3g} mm/s is acceptable')
    elif worst.worst not in GOOD_ZONES:
        found.unknown.append(
            f'at {rpm:.0f} rpm {worst.channel} vibrates with {nominal:.3g} mm/s rms, zone '
            f'{worst.zones[1]}, but as far as the machine is known with {low:.3g} to {high:.3g}, '
            f'and above {limit:.3g} mm/s is too much')
    else:
        known = high if math.isfinite(high) else nominal
        found.good.insert(0, f'at {rpm:.0f} rpm no housing vibrates with more than {known:.3g} '
                             f'mm/s rms, zone {worst.worst}, and up to {limit:.3g} mm/s is '
                             'acceptable')


def next_step(
    machine: 'Machine', found: Findings, housings: Sequence[HousingAnswer], modes: NearModes,
    moved: Sequence[Influence],
) -> str:
    """Return in words what to do now."""
    if found.stable is False:
        return ('Take out what feeds the vibration: other bearings, more damping, or a lower '
                'speed; then ask again')
    if not housings:
        return ('Describe ground and block (`soil`, `support`, `foundations`), or the pedestals '
                'of the bearings; then ask again')
    missed = [one for one in modes.nearest(len(modes.margins)) if one.is_missed]
    if found.bad:
        steps = [_move(one.name, one.critical.speed, one.required, housings[0].speed)
                 for one in missed[:1]]
        steps += _remedies(machine, housings[0])
        return '; '.join(steps) or 'Change the design; then ask again'
    if found.unknown and moved:
        return (f'Find out what decides, {moved[0].input.words}: {moved[0].input.advice}; '
                'then ask again')
    if found.unknown:
        return 'Mend what is not known (see above); then ask again'
    if moved:
        return (f'Nothing has to be changed. To be surer of it: {moved[0].input.advice}. Measure '
                'the first run-up and hold it against this case: rotorsoil compare')
    return ('Nothing has to be changed. Say in `uncertainty` how far soil and bearings are known; '
            'measure the first run-up and hold it against this case: rotorsoil compare')


def _move(name: str, speed: float, required: float, running: float) -> str:
    """Say where a critical speed has to go."""
    above = speed > running
    goal = rad_s_to_rpm(running * (1.0 + required if above else 1.0 - required))
    how = ('a stiffer shaft or stiffer bearings' if name.startswith(('shaft', 'rotor')) else
           'stiffer pedestals' if name.startswith('pedestal') else 'a larger block')
    how = how if above else f'more mass instead of {how}'
    return (f'Move {name} from {rad_s_to_rpm(speed):.0f} rpm to {"above" if above else "below"} '
            f'{goal:.0f} rpm ({how})')


def _remedies(machine: 'Machine', worst: HousingAnswer) -> list[str]:
    """Return what usual remedies would make of the worst housing, computed."""
    case, model = machine.case, machine.model
    now = float(worst.velocity[1])
    if not math.isfinite(now) or worst.zones[1] in GOOD_ZONES:
        return []
    said = [f'Balanced one grade better the worst housing would have '
            f'{_MM * now / _GRADE_STEP:.3g} instead of {_MM * now:.3g} mm/s']
    block = f'a block {_LARGER - 1.0:.0%} longer and wider'
    try:
        larger = on_larger_blocks(case, machine.directory, _LARGER)
        there = velocity(case, larger, speed=worst.speed,
                         channel=model.channels.index(worst.channel))
        if not math.isfinite(there):
            raise RotorSoilError('there it has no steady answer')
    except RotorSoilError as error:
        return [*said, f'what it would have on {block} is not known: {error}']
    return [*said, f'on {block} {_MM * there:.3g} mm/s']
