"""What can be said of foundations that bend, before anything runs."""

from collections.abc import Iterator

import numpy as np

from rotorsoil_ros.case.config import Case
from rotorsoil_ros.case.flexible.entries import LEAST_REACH
from rotorsoil_ros.channel import DOFS
from rotorsoil_ros.machine.flexible.body import FlexibleBody, GROUNDED
from rotorsoil_ros.machine.flexible.receptance import NOT_WORTH_A_WORD, SeatReceptance
from rotorsoil_ros.machine.foundation import Foundation
from rotorsoil_ros.units import rad_s_to_hz

# Modes up to so many times the highest 1X frequency leave about a percent.
_GOOD_REACH = 3.0
# Modes that are told, the lowest of all.
_TOLD = 5

# Shapes of unit modal mass reach about 2 times one over the root of the mass; beyond so much they
# are of something else.
_FAR_OFF = 30.0

# How far each way to put ground below patches was off, in displacement of the seats: worst and
# median of several rafts and soils, against the half-space below 48 patches.
_BEDS = {
    'winkler': 'springs of the whole contact shared out by area: seats of rafts were off by up to '
               '30%, 4 to 21% in the median; rocking is softer than that of the whole',
    'green': 'patches coupled through the half-space: seats of rafts were off by up to 15%, 6 to '
             '11% in the median; a rigid body on them finds 2 to 6% less stiffness',
    'each': 'each contact alone on the ground: right of footings that stand 2 to 3 widths apart; '
            'of patches side by side off by 60 to 90%',
}


def bodies_told(case: Case) -> Iterator[tuple[str, str]]:
    """Yield what every foundation that bends is."""
    for block in case.foundations:
        if block.body is not None:
            yield from _told(block, block.body)


def _told(block: Foundation, body: FlexibleBody) -> Iterator[tuple[str, str]]:
    name = block.name
    if body.bed != GROUNDED:
        x, y, z = _centre_of_gravity(body)
        yield f'{name}: mass and centre of gravity', (
            f'{block.mass:.7g} kg at x {x:.4g}, y {y:.4g}, z {z:.4g} m of its own axes')
    hertz = np.sort(rad_s_to_hz(body.frequencies))
    yield f'{name}: bends', (
        ', '.join(f'{one:.4g}' for one in hertz[:_TOLD].tolist())
        + (', ...' if len(hertz) > _TOLD else '') + ' Hz where '
        + ('its base is held' if body.bed == GROUNDED else 'nothing holds it')
        + f'; {len(hertz)} modes up to {hertz.max(initial=0.0):.4g} Hz and what they leave out, '
        + f'loss factor {body.residual_loss:g}')
    if body.bed != GROUNDED and block.on is None:
        how = {'winkler': 'a Winkler bed', 'green': 'one half-space',
               'each': 'ground of their own'}.get(body.bed, 'the ground')
        yield f'{name}: stands on', (
            f'{len(body.patches)} contact{"s" if len(body.patches) > 1 else ""}, '
            f'{len(body.contacts)} motions, on {how}')


def _centre_of_gravity(body: FlexibleBody) -> tuple[float, float, float]:
    mass = body.mass
    return (float(mass[1, 5] / mass[0, 0]), float(-mass[0, 5] / mass[0, 0]),
            float(mass[0, 4] / mass[0, 0]))


def bed_error(block: Foundation) -> str:
    """Return how far the ground below the patches of a foundation is off; empty of one contact."""
    return '' if block.body is None else _BEDS.get(block.body.bed, '')


def of_bodies(case: Case) -> Iterator[str]:
    """Yield which foundations that bend are known by too few modes, and what is left out."""
    for index, block in enumerate(case.foundations):
        entry = case.content['foundations'][index].get('flexible') or {}
        if block.body is None:
            continue
        if entry.get('modes') is not None:
            yield from _odd_shapes(index, block.body)
        reach = block.body.reach / case.speed_range[1]
        if reach < _GOOD_REACH:
            yield (f'foundations.{index}: {block.name} is known by modes up to {reach:.3g} times '
                   f'the highest 1X frequency; {_GOOD_REACH:g} times leave about 1%, 2 times '
                   'up to 2.5%')


def beyond_modes(case: Case, omega: float) -> Iterator[str]:
    """Yield which foundations that bend are known by too few modes for a frequency [rad/s]."""
    for index, block in enumerate(case.foundations):
        if block.body is not None and omega * LEAST_REACH > block.body.reach:
            reach = float(rad_s_to_hz(block.body.reach))
            way = (', keep_up_to brings more' if 'stiffness' in case.content['foundations'][index][
                'flexible'] else '')
            yield (f'foundations.{index}.flexible: {block.name} is known by modes up to '
                   f'{reach:.4g} Hz, which is good to {reach / LEAST_REACH:.4g} Hz; beyond, seats '
                   f'may be off by factors{way}')


def _odd_shapes(index: int, body: FlexibleBody) -> Iterator[str]:
    """Yield that the shapes of modes do not look like those of unit modal mass."""
    if not len(body.stiffness):
        return
    moving = [row for row, dof in enumerate(body.dofs) if dof.axis in DOFS[:3]]
    lowest = np.abs(body.shapes[moving, body.stiffness.argmin()]).max(initial=0.0)
    beside = float(lowest * np.sqrt(body.mass[0, 0]))
    if not 1.0 / _FAR_OFF < beside < _FAR_OFF:
        yield (f'foundations.{index}.flexible.modes: shapes of the lowest mode reach '
               f'{beside:.3g} times one over the root of the mass, which is about 2 of a slab: '
               'are they of unit modal mass, in kg?')


def seats_told(case: Case) -> Iterator[tuple[str, str]]:
    """Yield what a file of receptances says of foundation and ground."""
    for table in case.tables:
        if not isinstance(table, SeatReceptance):
            continue
        low, high = (rad_s_to_hz(float(end)) for end in (table.omega[0], table.omega[-1]))
        yield 'foundation and ground', (
            f'receptances of {len(table.seats)} motions of the seats at {len(table.omega)} '
            f'frequencies from {low:.4g} to {high:.4g} Hz; outside nothing is known, loads of '
            'bearings at rest need none of it; ' + (
                f'all follow one law within {table.missed:.1g} of a row' if table.law is not None
                else 'a curve leads through measured ones, with noise of about '
                     f'{table.missed:.1%} of a row'))
        if max(table.skew, table.given) > NOT_WORTH_A_WORD:
            yield 'foundation and ground: taken out', (
                f'mirror images differed by up to {table.skew:.2g} of a row, and up to '
                f'{table.given:.2g} of one gave energy')


def of_seats(case: Case) -> Iterator[str]:
    """Yield what looks odd about a file of receptances and the bearings on it."""
    for table in case.tables:
        if not isinstance(table, SeatReceptance):
            continue
        if table.apart:
            count = len(table.seats)
            yield (f'support.file: {table.apart} of the {count * (count - 1) // 2} pairs of '
                   'motions are not there: a force at one is taken not to move the other, which '
                   'no block does')
        for index, bearing in enumerate(case.rotor.bearings):
            if bearing.pedestal is not None:
                yield (f'rotor.bearings.{index}.pedestal: stands on the seat of support.file; '
                       'receptances that `seats` writes, or of a test on the housing, hold the '
                       'pedestal already')
