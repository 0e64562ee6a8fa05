"""What can be said of a case before anything runs: derived quantities, and what looks odd."""

from collections.abc import Iterable, Iterator, Sequence
import itertools
import math

import numpy as np

from rotorsoil_ros.case.config import Case
from rotorsoil_ros.case.design.bearings import of_bearings, of_film, of_journal, of_seals
from rotorsoil_ros.case.design.ground import (
    band_contents,
    is_embedded,
    layers_told,
    model_error,
    of_neighbours,
    of_shapes,
    of_site,
)
from rotorsoil_ros.case.design.rigidity import bending_told
from rotorsoil_ros.case.design.sensing import of_sensors, sensors_told
from rotorsoil_ros.case.entries.support_file import FILED
from rotorsoil_ros.case.flexible.words import bodies_told, of_bodies, of_seats, seats_told
from rotorsoil_ros.case.plausible import slips
from rotorsoil_ros.channel import DOFS
from rotorsoil_ros.errors import NotSolvedError
from rotorsoil_ros.ground.accuracy import ShapeError
from rotorsoil_ros.ground.bed import as_one
from rotorsoil_ros.ground.soil import (
    equivalent_radii,
    singular_of,
    Soil,
    SoilModel,
)
from rotorsoil_ros.machine.coupled import CoupledModel
from rotorsoil_ros.machine.foundation import Foundation, soils_below
from rotorsoil_ros.machine.modes.stability import Stability
from rotorsoil_ros.machine.response import ResponseTable
from rotorsoil_ros.units import rad_s_to_hz, rad_s_to_rpm, Units

# Cones beside rigorous solutions (theory manual, cones): beyond these they are off by more than a
# quarter.
_SMALLEST_A0 = 1.5
_LARGEST_A0 = 6.0
_LARGEST_A0_INCOMPRESSIBLE = 2.0
_LARGEST_POISSON_RATIO = 0.45

# The share of a threshold up to which machines run.
_OF_THRESHOLD = 0.8

# Of the shaft's length: beyond, slopes are no longer small and no linear beam holds.
_SURVIVED = 0.05


def derived_quantities(
    case: Case, soil_models: Sequence[SoilModel], shapes: Sequence[ShapeError | None] = (),
) -> Iterator[tuple[str, str]]:
    """
    Yield names and values, with units, of what follows from a case and its soil.

    Parameters
    ----------
    case : Case
        The machine.
    soil_models : sequence of SoilModel
        Below each block, or one below all.
    shapes : sequence of ShapeError or None
        How far the model of each block is from its shape, where somebody has measured it.

    """
    low, high = case.speed_range
    yield 'case', f'{case.name} ({case.path})'
    if case.berth is not None:
        yield 'among others', case.berth.told
    yield 'speed range', f'{rad_s_to_rpm(low):g} to {rad_s_to_rpm(high):g} rpm'
    if case.rotor.is_upright:
        yield 'orientation', ('vertical: y along the shaft is up, x and z are horizontal, z '
                              'against y of the ground')
    yield 'rotor mass', f'{case.rotor.mass:.4g} kg'
    yield 'mesh', f'{len(case.rotor.node_positions)} nodes on {case.rotor.length:g} m of shaft'
    planes = [*((disc.name, 'kg m') for disc in case.rotor.discs),
              *((f'{name}, couple', 'kg m^2') for name in case.couples)]
    for (name, unit), value in zip(planes, case.unbalance, strict=True):
        yield f'unbalance of {name}', f'{abs(value):g} {unit} at {np.angle(value):g} rad'
    yield 'support model', case.support.model
    if case.soil is not None:
        yield 'shear wave speed c_s', f'{case.soil.shear_wave_speed:.5g} m/s'
        yield 'dilatational wave speed c_p', f'{case.soil.pressure_wave_speed:.5g} m/s'
    yield from layers_told(case)
    below = map(as_one, soils_below(case.foundations, soil_models))
    for foundation, model, shape in itertools.zip_longest(case.foundations, below, shapes):
        yield from _of_foundation(case, foundation, model)
        told = model_error(case, foundation, shape)
        if told:
            yield f'{foundation.name}: model error', told
    yield from bending_told(case, soil_models)
    yield from bodies_told(case)
    yield from seats_told(case)
    yield from of_site(case, soil_models)
    yield from sensors_told(case)
    for journal in case.journals:
        yield from of_journal(case, journal)
    yield from of_seals(case)
    if band_contents(case):
        yield 'edges of the band hold', band_contents(case)


def _of_foundation(
    case: Case, foundation: Foundation, model: SoilModel,
) -> Iterator[tuple[str, str]]:
    name = foundation.name
    yield f'{name}: mass over rotor mass', f'{foundation.mass / case.rotor.mass:.4g}'
    if (on := foundation.on) is not None:
        places = f' at {", ".join(on.places)}' if on.places else ''
        yield f'{name}: stands on', f'{on.foundation}{places}, {on.elevation:.4g} m up'
        return
    if case.soil is not None:
        radius = equivalent_radii(foundation.contact)[2]
        yield f'{name}: mass ratio m / (rho r0^3)', (
            f'{foundation.mass / (case.soil.density * radius**3):.4g}')
        low, high = (a0(case.soil, foundation, speed) for speed in case.speed_range)
        yield f'{name}: a0', f'{low:.3g} to {high:.3g}'
    singular = singular_of(model)
    if singular.size:
        yield f'{name}: waves of the layers begin', (
            'at ' + ', '.join(f'{rad_s_to_hz(one):.4g}' for one in singular.tolist())
            + ' Hz; below the first nothing is radiated')
    # A strip gives way without bound at rest, and a file may not know rest: theirs is told where
    # the machine starts.
    where, omega = 'static', 0.0
    strip = case.support.model == 'infinite_elements' and case.support.geometry != 'disc'
    if strip or case.support.model == 'table':
        where, omega = 'slowest', case.speed_range[0]
    for dof, compliance in zip(DOFS, np.diagonal(model.compliance(np.array([omega]))[0]),
                               strict=True):
        unit = 'N/m' if len(dof) == 1 else 'N m/rad'
        stiffness = 'rigid' if compliance == 0.0 else f'{(1.0 / compliance).real:.4g} {unit}'
        yield f'{name}: {where} stiffness {dof}', stiffness


def a0(soil: Soil, foundation: Foundation, omega: float) -> float:
    """Return the dimensionless frequency of a block, omega b / c_s or omega r0 / c_s."""
    return omega * foundation.contact.characteristic_length / soil.shear_wave_speed


def warnings(case: Case, shapes: Sequence[ShapeError | None] = ()) -> Iterator[str]:
    """
    Yield what is allowed but looks like a slip, or lies where a model is poor.

    Parameters
    ----------
    case, shapes
        As `derived_quantities`.

    """
    if not np.any(case.unbalance):
        yield 'unbalances: none, every prediction will be zero'
    yield from slips(case)
    for disc in case.rotor.discs:
        if disc.polar_inertia > 2.0 * disc.diametral_inertia:
            yield (f'{disc.name}: polar inertia {disc.polar_inertia:g} kg m^2 is more than twice '
                   f'the diametral {disc.diametral_inertia:g} kg m^2, which no body has')
    yield from of_bearings(case)
    for journal in case.journals:
        yield from of_film(case, journal)
    yield from of_neighbours(case)
    yield from of_shapes(case, shapes)
    yield from of_bodies(case)
    yield from of_sensors(case)
    yield from of_seats(case)
    for foundation in case.foundations:
        small, medium, large = sorted(foundation.inertia)
        if large > (1.0 + 1e-9) * (small + medium):
            yield (f'{foundation.name}: inertia {large:g} kg m^2 about one axis is more than '
                   'that about both others, which no body has')
        if (case.soil is not None and case.support.model != 'rigid'
                and foundation.on is None):
            yield from _of_soil(case, case.soil, foundation)


def near_threshold(case: Case, beyond: Stability) -> Iterator[str]:
    """Yield which mode begins to whirl too near above the speed range."""
    high = case.speed_range[1]
    for one in beyond.instabilities:
        if high < one.low < high / _OF_THRESHOLD:
            yield (f'the speed range ends at {high / one.low:.0%} of {rad_s_to_rpm(one.low):.5g} '
                   f'rpm, from which on {one.name} grows, fed by '
                   + ' and '.join(feed.name for feed in one.feeds)
                   + f'; at most {_OF_THRESHOLD:.0%} are usual')


def unstable(found: Stability) -> Iterator[str]:
    """Yield for each mode that grows on its own which it is, where, and what feeds it."""
    for one in found.instabilities:
        low, high = rad_s_to_rpm(one.low), rad_s_to_rpm(one.high)
        everywhere = (one.low, one.high) == found.span
        where = f'at {low:.6g} rpm' if low == high else (
            f'at all speeds looked at, {low:g} to {high:g} rpm' if everywhere else
            f'from {low:.6g} to {high:.6g} rpm')
        how = 'creeps away without whirling' if not one.whirl else (
            f'{"forward" if one.whirl > 0 else "backward"} whirl at '
            f'{rad_s_to_hz(one.frequency):.4g} Hz, damping ratio {one.damping_ratio:.3g} at '
            f'{rad_s_to_rpm(one.speed):.4g} rpm')
        fed = ' and '.join(
            f'the {cause} of ' + ', '.join(f'{feed.name} ({feed.share:.0%})'
                                           for feed in one.feeds if feed.cause == cause)
            for cause in dict.fromkeys(feed.cause for feed in one.feeds))
        yield f'unstable {where}: {one.name} ({how}) grows, fed by {fed}'


def stability_told(found: Stability, units: Units) -> str:
    """Return in one line whether a machine is stable, and between which speeds."""
    low, high = (units.speed(speed) for speed in found.span)
    if found.doubt:
        return 'not known, see the warning'
    if found.instabilities:
        ranges = ', '.join(f'{units.speed(start)} to {units.speed(end)}'
                           for start, end in found.unstable.tolist())
        return f'UNSTABLE, {ranges}: no steady response there, see the errors'
    how = 'no bearing gives energy' if not found.highest else (
        f'every mode up to {rad_s_to_hz(found.highest):.4g} Hz decays')
    return f'stable from {low} to {high}: {how}'


def clipped(
    model: CoupledModel, span: tuple[float, float], wanted: tuple[float, float],
) -> list[str]:
    """Return a remark where tables end before speeds [rad/s] that are looked at."""
    if wanted[0] >= span[0] and wanted[1] <= span[1]:
        return []
    low, high = (rad_s_to_rpm(speed) for speed in span)
    first, last = model.support.reach
    by_file = last == span[1] < wanted[1] or wanted[0] < span[0] == first
    return [f'critical speeds are looked for from {low:g} to {high:g} rpm only: '
            + ('the file of the support ends' if by_file else 'tables of bearings end') + ' there']


def stability_doubts(found: Stability) -> Iterator[str]:
    """Yield what is not known of the stability of a machine."""
    if found.doubt:
        yield f'whether the machine is stable is not known: {found.doubt}'
    for which, edge, why in (
            ('below', found.untold_below, found.why_below),
            ('above', found.untold_above, found.untold_why)):
        if 0.0 < edge < math.inf:
            yield (f'whether a mode {which} {rad_s_to_hz(edge):.4g} Hz is stable is not known: '
                   f'{why}')


def without_transients(case: Case, table: ResponseTable) -> Iterator[str]:
    """Yield why answers do not follow changes of the speed although the case wants it."""
    if table.poles.doubt and case.run_up == 'transient':
        yield f'answers are steady, however fast the speed changes: {table.poles.doubt}'


def undecided(case: Case, error: NotSolvedError) -> str:
    """Return why modes are not known, with what a user may do where a file is the reason."""
    if case.support.model not in FILED:
        return str(error)
    return (f'support.file: {error}; modes need what follows one smooth curve: give '
            'it at more frequencies, or without jumps (the response needs no modes)')


def implausible(
    case: Case, peaks: Iterable[tuple[str, float, float]],
) -> Iterator[str]:
    """
    Yield which peaks no machine survives.

    Parameters
    ----------
    case : Case
        The machine.
    peaks : iterable of (str, float, float)
        Channel, speed [rad/s] and amplitude [m].

    """
    length = case.rotor.length
    for channel, speed, amplitude in peaks:
        if amplitude > _SURVIVED * length:
            yield (f'the response peak of {amplitude:.3g} m of {channel} at '
                   f'{rad_s_to_rpm(speed):.5g} rpm is more than {_SURVIVED:.0%} of the '
                   f"shaft's length, {length:.3g} m: no machine survives it and no linear "
                   'model holds; is the unbalance right, and is all damping in the case?')


def _of_soil(case: Case, soil: Soil, foundation: Foundation) -> Iterator[str]:
    if case.support.model == 'cone':
        if is_embedded(case, foundation):  # held against thin layers: `model_error`
            return
        yield from _of_cones(soil, foundation, speed_range=case.speed_range)
    elif (case.support.model == 'infinite_elements'
          and soil.poisson_ratio > _LARGEST_POISSON_RATIO):
        yield (f'soil: nu is {soil.poisson_ratio:g}; above {_LARGEST_POISSON_RATIO:g} infinite '
               'elements are within 0.5 % only up to a0 = 6')
    if case.support.geometry != 'disc':
        yield (f'{foundation.name}: a strip radiates more than a block of finite length and '
               'holds y, rx and rz; geometry disc is the three-dimensional one')


def _of_cones(
    soil: Soil, foundation: Foundation, *, speed_range: tuple[float, float],
) -> Iterator[str]:
    lowest, highest = (a0(soil, foundation, speed) for speed in speed_range)
    if lowest < _SMALLEST_A0:
        yield (f'{foundation.name}: a0 starts at {lowest:.3g}; below {_SMALLEST_A0:g} cones damp '
               'too much, vertically by a quarter, rocking up to twofold')
    limit = _LARGEST_A0
    if soil.poisson_ratio > 1.0 / 3.0:
        limit = _LARGEST_A0_INCOMPRESSIBLE
    if highest > limit:
        yield (f'{foundation.name}: a0 reaches {highest:.3g}; above {limit:g} cones are off by '
               'more than a quarter for this soil')
