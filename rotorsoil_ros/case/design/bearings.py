"""What is said of bearings, films and seals before anything runs, and what of them looks odd."""

from collections.abc import Iterator
from dataclasses import replace
import math

import numpy as np

from rotorsoil_ros.case.config import Case
from rotorsoil_ros.case.journal_entries import Journal
from rotorsoil_ros.rotor.coefficients import Coefficients, values as values_of
from rotorsoil_ros.units import GRAVITY, rad_s_to_hz, rad_s_to_rpm

# A film: load over length times diameter [Pa], Reynolds numbers above which it has vortices (times
# the root of radius over clearance) and is turbulent, eccentricity below which it is about to
# whirl.
_HEAVIEST = 2.5e6
_VORTICES, _TURBULENT = 41.0, 1000.0
_LIGHTEST = 0.05

# Cross terms that differ by less than this share of all coefficients are symmetric.
_SYMMETRIC = 1e-12


def of_journal(case: Case, journal: Journal) -> Iterator[tuple[str, str]]:
    """Yield where the journal floats at both ends of the speed range, and what that takes."""
    name, ends = journal.name, journal.at(np.array(case.speed_range))
    across, up = ends.load.tolist()
    yield f'{name}: load on the journal', (
        f'{ends.carried:.4g} N ({across:.4g} across, {up:.4g} up), '
        f'{1e-6 * ends.specific_load:.3g} MPa of its length and diameter')
    if journal.oil is not None:
        colder, warmer = (replace(journal.oil, temperature=journal.oil.temperature + change)
                          .viscosity / journal.oil.viscosity for change in (-10.0, 10.0))
        yield f'{name}: oil', (
            f'ISO VG {journal.oil.grade} at {journal.oil.temperature:g} deg C, '
            f'{1e3 * journal.oil.viscosity:.4g} mPa s; 10 K colder or warmer make '
            f'{colder:.2f} or {warmer:.2f} of it')
    for what, values, unit in (
            ('Sommerfeld number', ends.sommerfeld, ''), ('eccentricity', ends.eccentricity, ''),
            ('attitude', np.degrees(ends.attitude), ' deg'),
            ('least film', 1e6 * ends.least, ' um'), ('loss at least', ends.loss, ' W')):
        slow, fast = values.tolist()
        yield f'{name}: {what}', f'{slow:.4g} to {fast:.4g}{unit} over the speed range'
    if ends.bearing.kind == 'tilting_pad':
        yield f'{name}: pads', ('follow vibration of the speed itself; to modes of another '
                                'frequency they are somewhat stiffer or softer')
    else:
        threshold = journal.states.rigid_threshold(ends.carried / GRAVITY)
        yield f'{name}: a rigid rotor of its load', (
            f'whirls from {rad_s_to_rpm(threshold):.5g} rpm on (textbook)'
            if threshold < math.inf else
            f'whirls nowhere up to {rad_s_to_rpm(float(journal.states.speed[-1])):.5g} rpm '
            '(textbook)')


def of_seals(case: Case) -> Iterator[tuple[str, str]]:
    """Yield below which frequency cross-coupling outdoes the damping of bearings and seals."""
    films = {journal.name for journal in case.journals}
    speed = np.array(case.speed_range)
    for bearing in case.rotor.bearings:
        if bearing.name in films:
            continue
        stiffness, damping, _ = bearing.coefficients(speed, speed)
        skew = 0.5 * np.abs(stiffness[:, 1, 0] - stiffness[:, 0, 1])
        direct = 0.5 * np.trace(damping, axis1=1, axis2=2)
        if np.any(skew > _SYMMETRIC * np.abs(stiffness).max()):
            with np.errstate(divide='ignore'):
                slow, fast = (skew / direct).tolist()
            yield f'{bearing.name}: alone it feeds whirl', (
                f'slower than {rad_s_to_hz(slow):.4g} to {rad_s_to_hz(fast):.4g} Hz over the '
                f'speed range, {fast / speed[1]:.3g} times the speed at its end (textbook, cross '
                'stiffness over damping)')


def of_film(case: Case, journal: Journal) -> Iterator[str]:
    """Yield where a film is thin, heavily loaded, turbulent or about to whirl."""
    name, bearing, states = journal.name, journal.states.bearing, journal.states
    low, high = case.speed_range
    thin = states.thinner(journal.least_film)
    if thin > low:
        yield (f'{name}: below {rad_s_to_rpm(thin):.4g} rpm the film is thinner than '
               f'{1e6 * journal.least_film:g} um: friction is mixed and coefficients are not '
               'those of a film')
    if states.specific_load > _HEAVIEST:
        yield (f'{name}: carries {1e-6 * states.specific_load:.3g} MPa of its length and '
               f'diameter, more than {1e-6 * _HEAVIEST:g} MPa')
    reynolds = journal.viscosity.density * journal.at(np.array([high])).reynolds[0]
    vortices = _VORTICES * math.sqrt(bearing.radius / bearing.radial_clearance)
    if reynolds > min(vortices, _TURBULENT):
        what = ('is turbulent: its coefficients are larger than those of a laminar one'
                if reynolds > _TURBULENT else 'has vortices')
        yield (f'{name}: at {rad_s_to_rpm(high):g} rpm the film has a Reynolds number of '
               f'{reynolds:.4g} (limit {min(vortices, _TURBULENT):.4g}) and {what}')
    light = np.flatnonzero((states.eccentricity < _LIGHTEST) & (states.speed <= high))
    if bearing.kind != 'tilting_pad' and len(light):
        yield (f'{name}: from {rad_s_to_rpm(float(states.speed[light].min())):.4g} rpm on the '
               f'eccentricity is below {_LIGHTEST:g}: so lightly loaded a film is about to whirl')


def of_bearings(case: Case) -> Iterator[str]:
    """Yield where a bearing or a pedestal gives energy or pushes by itself."""
    films = {journal.name for journal in case.journals}
    for index, bearing in enumerate(case.rotor.bearings):
        # Films push across by nature: what comes of it is told by the stability.
        parts = [] if bearing.name in films else [('', bearing.stiffness, bearing.damping)]
        if bearing.pedestal is not None:
            parts.append(('pedestal.', bearing.pedestal.stiffness, bearing.pedestal.damping))
        for place, *matrices in parts:
            for name, unit, matrix in zip(('stiffness', 'damping'), ('N/m', 'N s/m'), matrices,
                                          strict=True):
                least = _least(matrix)
                if least < 0.0:
                    yield (f'rotor.bearings.{index}.{place}{name}: of {bearing.name} is negative '
                           f'in some direction, {least:.4g} {unit}: '
                           + ('it feeds vibration' if name == 'damping' else 'it pushes away'))


def _least(matrix: Coefficients) -> float:
    """Return the smallest eigenvalue of the symmetric part, over all points of a table."""
    given = values_of(matrix)
    symmetric = 0.5 * (given + given.swapaxes(-2, -1))
    least = float(np.linalg.eigvalsh(symmetric).min())
    # Round-off of a matrix that is just not negative is none.
    return least if least < -1e-12 * float(np.abs(given).max()) else 0.0
