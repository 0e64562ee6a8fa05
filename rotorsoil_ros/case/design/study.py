"""How is a machine judged at one speed? Solved, held against limits and margins, and explained."""

from collections.abc import Iterator
import math
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from rotorsoil_ros.arrays import FloatArray
from rotorsoil_ros.case import document
from rotorsoil_ros.case.authoring.comments import Guess, guesses
from rotorsoil_ros.case.config import Case
from rotorsoil_ros.case.design.advice import findings, next_step, verdict_of
from rotorsoil_ros.case.design.ground import band_contents, model_error
from rotorsoil_ros.case.design.influence import extremes, influences
from rotorsoil_ros.case.design.margins import near_modes
from rotorsoil_ros.case.design.report import DesignReport, HousingAnswer
from rotorsoil_ros.case.design.rigidity import of_rigidity
from rotorsoil_ros.case.design.shapes import shape_errors
from rotorsoil_ros.case.entries.support_file import FILED
from rotorsoil_ros.case.flexible.words import seats_told
from rotorsoil_ros.case.zone_limits import RIGID_MARGIN, support_class
from rotorsoil_ros.channel import across, Channel, HOUSING
from rotorsoil_ros.errors import InputError, NotSolvedError, RotorSoilError
from rotorsoil_ros.machine.damping import DampingSplit
from rotorsoil_ros.machine.modes.natural import lowest_natural_frequency
from rotorsoil_ros.machine.modes.stability import Stability, stability
from rotorsoil_ros.units import rad_s_to_rpm, rpm_to_rad_s

if TYPE_CHECKING:
    from rotorsoil_ros.case.machine import Machine


def design_report(machine: 'Machine', rpm: float) -> DesignReport:
    """
    Return whether the foundation of a machine is right for it at a speed.

    Parameters
    ----------
    machine : Machine
        The machine.
    rpm : float
        Running speed, within the speed range of the case [rpm].

    Raises
    ------
    InputError
        If the speed is beyond that range.

    """
    case, speed = machine.case, float(rpm_to_rad_s(rpm))
    low, high = case.speed_range
    if not low <= speed <= high:
        raise InputError(f'{case.path}: speed_range_rpm: must hold the running speed, got '
                         f'[{rad_s_to_rpm(low):g}, {rad_s_to_rpm(high):g}] rpm, and {rpm:g} rpm '
                         'to judge')
    growth = _growth(machine, speed)
    housings = _housings(machine, speed, exists=bool(growth.holds(np.array([speed]))[0]))
    modes = near_modes(machine.model, speed)
    has_numbers = any(math.isfinite(one.velocity[1]) for one in housings)
    moved = () if not has_numbers else tuple(influences(
        case, machine.model, speed=speed,
        channel=machine.model.channels.index(housings[0].channel)))
    found = findings(case, growth, housings, modes, moved)
    found.unknown += of_rigidity(case, machine.model.soil_models)
    return DesignReport(
        case=case, speed=speed, verdict=verdict_of(found), reasons=found.in_order,
        stable=found.stable, housings=housings, modes=modes,
        damping=_damping(machine, rpm), influences=moved,
        next_step=next_step(machine, found, housings, modes, moved),
        assumptions=tuple(_assumptions(machine)), not_modelled=tuple(_not_modelled(case)),
        guesses=tuple(_guesses(case)))


def _damping(machine: 'Machine', rpm: float) -> DampingSplit | None:
    """Return where the energy of the unbalance goes, where there is a steady answer to it."""
    try:
        found = machine.damping_split(rpm=rpm)
    except RotorSoilError:  # a resonance without damping has no number
        return None
    return found if found.total[0] > 0.0 else None


def _growth(machine: 'Machine', speed: float) -> Stability:
    """Return what grows at a speed [rad/s], or why that is not known."""
    try:
        return stability(machine.model, (speed, speed))
    except NotSolvedError as error:
        return Stability((speed, speed), (), math.inf, doubt=str(error))


def _housings(
    machine: 'Machine', speed: float, *, exists: bool,
) -> tuple[HousingAnswer, ...]:
    """Return every housing that can move, without a number where no steady answer exists."""
    case, rpm = machine.case, rad_s_to_rpm(speed)
    channels = [channel for bearing in case.rotor.bearings
                if case.support.model != 'rigid' or bearing.pedestal is not None
                for channel in across(bearing.name, HOUSING)]
    if not channels:
        return ()
    sizes = np.full((3, len(channels)), math.nan)
    if exists:
        bounds = machine.bounds(rpm=rpm)[tuple(channels)]
        sizes = np.concatenate([bounds.low, bounds.nominal, bounds.high])
    if exists and machine.envelope is not None and np.isfinite(sizes).all():
        columns = [machine.model.channels.index(channel) for channel in channels]
        low, high = extremes(case, machine.model, speed)
        sizes[0], sizes[2] = np.fmin(sizes[0], low[columns]), np.fmax(sizes[2], high[columns])
    for other in machine.others() if exists else ():
        sizes = _together(sizes, other, tuple(channels), speed)
    support = {axis: support_class(
        lowest_natural_frequency(machine.model, axis=axis, highest=RIGID_MARGIN * speed), speed)
        for axis in {channel.axis for channel in channels}}
    found = [HousingAnswer(channel, size, speed, support[channel.axis],
                           case.zones.of(support[channel.axis], speed))
             for channel, size in zip(channels, sizes.T, strict=True)]
    return tuple(sorted(found, key=lambda one: -one.badness))


def _together(
    sizes: FloatArray, other: 'Machine', channels: tuple[Channel, ...], speed: float,
) -> FloatArray:
    """Add what another machine does at its own speed: amplitudes (3, c) of the same velocity."""
    assert other.case.berth is not None
    rated = other.case.berth.rated_speed
    bounds = other.bounds(rpm=rad_s_to_rpm(rated))[channels]
    own = np.concatenate([bounds.low, bounds.nominal, bounds.high])
    # What is not known of its band is taken as it stands.
    own = np.where(np.isfinite(own), own, own[1])
    return np.asarray(np.sqrt(sizes**2 + (rated / speed * own) ** 2))


def _assumptions(machine: 'Machine') -> Iterator[str]:
    case = machine.case
    ground = case.support.model.replace('_', ' ')
    below = list(seats_told(case)) or [('ground', ground + ('' if case.soil is None else (
        f', c_s {case.soil.shear_wave_speed:.4g} m/s, nu {case.soil.poisson_ratio:g}, '
        f'{case.soil.density:g} kg/m^3')))]
    yield from map(': '.join, below)
    shapes = shape_errors(case, machine.model.support.soils, machine.directory)
    for block, shape in zip(case.foundations, shapes, strict=True):
        if told := model_error(case, block, shape):
            yield f'{block.name}: {told}'
    if case.berth is not None:
        yield (f'{case.name} {case.berth.told}; velocities are of all together, curves over the '
               f'speed of {case.name} alone')
    for disc, moment in zip(case.rotor.discs, case.unbalance, strict=False):
        if moment:
            yield f'unbalance of {disc.name}: {1e3 * abs(moment):.3g} kg mm'
    yield f'limits: {case.zones.label}'
    if contents := band_contents(case):
        yield f'lowest and highest: {contents}'


# What no case holds as yet, and by which key it would.
_LEFT_OUT = {
    'layers': 'layers and rock below', 'embedment': 'embedment of the block',
    'flexible': 'bending of the block', 'machines': 'other machines on the foundation',
}


def _not_modelled(case: Case) -> Iterator[str]:
    if case.support.model not in FILED:
        said = str(case.content)
        yield from (words for key, words in _LEFT_OUT.items() if f"'{key}'" not in said)
    yield 'vibration that is not once per turn (velocities are a lower bound of broadband rms)'
    yield 'misalignment, piles, ground motion from outside'


def _guesses(case: Case) -> list[Guess]:
    """Return what the file marks as guessed and nobody has set to something else since."""
    path = Path(case.path)
    try:
        text = path.read_text(encoding='utf-8')
        said = document.parse(text, source=str(path))
    except (OSError, UnicodeDecodeError, InputError):
        return []  # a case out of a log has no file
    return [one for one in guesses(text)
            if document.at(said, one.key) == document.at(case.content, one.key)]
