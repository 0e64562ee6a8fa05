"""The models that a case stands for, with their tables out of the cache."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import islice
import math
from pathlib import Path

import numpy as np

import rotorsoil_ros
from rotorsoil_ros.arrays import ComplexArray
from rotorsoil_ros.case.cache import Cache, content_key
from rotorsoil_ros.case.config import Case
from rotorsoil_ros.case.design.below import around, identity, soil_models
from rotorsoil_ros.case.design.ground import band_contents
from rotorsoil_ros.case.design.shapes import other_forms
from rotorsoil_ros.case.design.tables import (
    boundary_element_model,
    key_of,
    layered_site_model,
    thin_layer_model,
)
from rotorsoil_ros.case.entries.site import BOUNDARY_ELEMENTS, site_of
from rotorsoil_ros.case.flexible.ground import bed_of, welded
from rotorsoil_ros.case.summary import stability_doubts, unstable
from rotorsoil_ros.channel import Channel, DOFS
from rotorsoil_ros.errors import RotorSoilError, solved
from rotorsoil_ros.ground.boundary.layered_model import LayeredSiteModel
from rotorsoil_ros.ground.boundary.model import BoundaryElementModel
from rotorsoil_ros.ground.half_space import InfiniteElementModel
from rotorsoil_ros.ground.layers.profile import Embedment, LayeredSoil, LEAST_LOSS_FACTOR
from rotorsoil_ros.ground.neighbours import on_soil
from rotorsoil_ros.ground.soil import Contact, Soil, SoilModel
from rotorsoil_ros.machine.band import (
    depends_on_soil,
    highest_poisson_ratio,
    of_other_form,
    on_soils,
    ResponseBand,
)
from rotorsoil_ros.machine.coupled import CoupledModel
from rotorsoil_ros.machine.flexible.body import FlexibleBody
from rotorsoil_ros.machine.placement import Placement
from rotorsoil_ros.machine.plant.source import SourceModel
from rotorsoil_ros.machine.response import ResponseTable, TOLERANCE
from rotorsoil_ros.machine.spread import Place, SoilSpread
from rotorsoil_ros.machine.transient.poles import Poles
from rotorsoil_ros.machine.transmissibility import GroundTable, MovingGround

# What a message holds of an answer, in a log that has to explain itself.
UNITS = {
    'position': 'displacement, m or rad, zero-to-peak',
    'velocity': 'm/s or rad/s, zero-to-peak',
    'effort': 'transmitted force, N or N m, zero-to-peak',
    'phase': 'rad',
    'convention': 'x(t) = Re(X exp(+i omega t))',
}


def coupled_model(case: Case, directory: Path) -> CoupledModel:
    """
    Return rotor, blocks and soil of a case as one model.

    Parameters
    ----------
    case : Case
        The machine.
    directory : Path
        Of the cache, in which the tables of infinite elements lie or will lie.

    Raises
    ------
    NotSolvedError
        If infinite elements do not converge.

    """
    with solved('the ground under this machine'):
        soils = soil_models(case, Cache(directory))
    points = tuple(probe.name for probe in case.ground_probes)
    if case.berth is not None:
        return case.berth.model(case.rotor, case.foundations, soils, couples=case.couples,
                                points=points)
    return CoupledModel(case.rotor, case.foundations, soils, case.couples, points,
                        Placement(is_upright=case.rotor.is_upright))




def response_key(case: Case, model: CoupledModel) -> str:
    """Return what identifies the response table of a case: all of it but its unbalance."""
    return content_key('response', 2, TOLERANCE, model.rotor, model.foundations,
                       [identity(soil) for soil in model.soil_models], case.speed_range,
                       model.couples, model.points, *_among(model))


def _among(model: CoupledModel) -> list[object]:
    """Return what identifies the neighbours of a machine, nothing where it has none."""
    if not isinstance(model, SourceModel):
        return []
    return [model.place, list(model.neighbours), model.index]


def _followed(case: Case, table: ResponseTable) -> ResponseTable:
    """Return a table that follows changes of the speed only if the case wants it."""
    if case.run_up == 'transient':
        return table
    return replace(table, poles=Poles.none('run_up: quasi_static, as the case wants it'))


def response_table(case: Case, model: CoupledModel, directory: Path) -> ResponseTable:
    """
    Return the response table of a case, computed and stored if the cache does not hold it.

    Parameters
    ----------
    case : Case
        The machine.
    model : CoupledModel
        What it stands for.
    directory : Path
        Of the cache.

    Raises
    ------
    RotorSoilError
        If the case cannot be solved.

    """
    key = response_key(case, model)
    with solved('the response of this machine'):
        table = Cache(directory).kept(
            'response', key, rebuild=lambda arrays: ResponseTable.from_arrays(
                arrays, model.channels),
            solve=lambda: ResponseTable.build(model, case.speed_range))
    return _followed(case, replace(table, key=key))


def moving_ground(case: Case, model: CoupledModel, directory: Path) -> MovingGround:
    """
    Return what a machine does of ground that moves, and what it does to sensors there.

    Its table is computed and stored if the cache does not hold it.

    Parameters
    ----------
    case, model, directory
        As `response_table`.

    Raises
    ------
    RotorSoilError
        If the case cannot be solved.

    """
    rated = case.speed_range[1] if case.berth is None else case.berth.rated_speed
    cache = Cache(directory)
    key = content_key('moving ground', 1, response_key(case, model), rated)
    arrays = cache.load('ground', key)
    if arrays is None:
        with solved('the response of this machine to ground that moves'):
            table = GroundTable.build(model, case.speed_range, rated=rated)
        cache.store('ground', key, table.to_arrays())
    else:
        table = GroundTable.from_arrays(arrays, model.channels)
    loads = np.array([model.channels.index(Channel(block.name, '', dof))
                      for block in model.foundations if block.on is None
                      for dof in DOFS], dtype=int)
    sensors = len(case.sensors.ground)
    others = () if case.berth is None else tuple(
        one.speed for one in case.berth.neighbours if one.speed)
    try:
        with solved('the ground beside this machine'):
            beside = around(case, cache)
    except RotorSoilError as error:
        return MovingGround(table, loads, sensors, others, None, str(error))
    return MovingGround(table, loads, sensors, others, beside)


def response_band(
    case: Case, model: CoupledModel, table: ResponseTable, directory: Path,
    spread: SoilSpread | None = None,
) -> ResponseBand | None:
    """
    Return the response of a case on all soils of its spread, or of another one.

    Besides the soil it holds what else the spread says and, unless that says otherwise, the
    error of the models: every second machine stands on the ground of its own shape, blocks
    coupled through it (boundary elements; of circles infinite elements), instead of cones and
    discs; where that is not known, on ground as much stiffer as it may be.
    None where nothing is uncertain, as with known bearings on a support that knows of no soil.
    Of a machine among others it holds those that stand, and those at their highest speed.
    """
    spread = spread or case.uncertainty
    with_soil = case.soil is not None and depends_on_soil(model)
    otherwise = _otherwise(case, model)
    if not with_soil and not spread.inputs(with_soil=False) and not otherwise:
        return None
    if (case.soil is not None and case.ground is None and not model.support.bends
            and case.support.model == BOUNDARY_ELEMENTS):
        model = replace(model, soil_models=(boundary_element_model(
            case.soil, site_of(case.foundations, case.ground_probes), cache=Cache(directory),
            speed_range=case.speed_range, spread=spread.poisson_ratio),))
    elements, stiffer = other_forms(
        case, soil_models(case, Cache(directory)), spread, directory)
    forms = _forms(spread.places(with_soil=with_soil), with_elements=bool(elements),
                   with_stiffer=any(stiffer))
    others = []
    for place, on_solved, on_stiffer in islice(forms, spread.samples - 1):
        machine = machine_at(case, model, spread, place, Cache(directory))
        solved_on = [on_soil(one, _soil_at(case.soil, model, spread, place), block.contact,
                              of=case.soil)
                     for one, block in zip(elements, model.foundations, strict=False)
                     if case.soil is not None]
        others.append(of_other_form(machine, solved=solved_on, stiffer=stiffer,
                                    takes_solved=on_solved, takes_stiffer=on_stiffer))
    return ResponseBand.build(table, [*others, *otherwise],
                              unbalance_factor=spread.unbalance_factor)


def _otherwise(case: Case, model: CoupledModel) -> tuple[CoupledModel, ...]:
    """Return the machine with its neighbours at other speeds, where it has any that turn."""
    if case.berth is None or not isinstance(model, SourceModel):
        return ()
    return case.berth.otherwise(model)


def machine_at(
    case: Case, model: CoupledModel, spread: SoilSpread, place: Place, cache: Cache | None = None,
) -> CoupledModel:
    """Return the machine at a place of a spread, on the ground that it has there."""
    machine = spread.machine(model, place)
    if case.soil is None or not depends_on_soil(model):
        return machine
    layered = case.ground is not None
    if spread.changes_ground(place, layered=layered) and case.support.geometry == 'disc':
        machine = replace(machine, soil_models=_other_grounds(case, spread, place, cache))
    return on_soils(machine, [_soil_at(case.soil, model, spread, place)], of=case.soil)[0]


def _other_grounds(
    case: Case, spread: SoilSpread, place: Place, cache: Cache | None,
) -> tuple[SoilModel, ...]:
    """Return what blocks stand on at a place where the ground itself is another."""
    assert case.soil is not None
    lossy = replace(case.soil, loss_factor=max(case.soil.loss_factor, LEAST_LOSS_FACTOR))
    low, high = case.speed_range
    # Softer soil has shorter waves: its table has to reach further.
    speeds = low, max(1.0, 0.5 * spread.shear_modulus_factor**0.5) * high
    grounds = [spread.ground(case.ground or LayeredSoil((), lossy), own, place)
               for own in case.embedments]
    bends = any(block.body is not None for block in case.foundations)
    if case.support.model == BOUNDARY_ELEMENTS and not bends:
        return (layered_site_model(grounds[0][0], site_of(case.foundations, case.ground_probes),
                                   cache=cache, speed_range=speeds),)
    def under(ground: LayeredSoil, embedment: Embedment) -> Callable[[Contact], SoilModel]:
        return lambda contact: thin_layer_model(ground, contact, embedment, cache=cache,
                                                speed_range=speeds)

    return tuple(bed_of(block, under(*own), _no_coupling) if block.on is None else welded(block)
                 for block, own in zip(case.foundations, grounds, strict=True))


def _no_coupling(body: FlexibleBody) -> SoilModel:
    raise RotorSoilError(f'patches are coupled through a half-space only, {len(body.patches)} of '
                         'them stand on layers')


def _soil_at(soil: Soil, model: CoupledModel, spread: SoilSpread, place: Place) -> Soil:
    return spread.soil(soil, place, highest_poisson_ratio=highest_poisson_ratio(model))


def _forms(
    places: list[dict[str, float]], *, with_elements: bool, with_stiffer: bool,
) -> Iterator[tuple[dict[str, float], bool, bool]]:
    """Yield places, and whether on infinite elements and on stiffer ground."""
    alone = [place for place in places[1:] if len(place) == 1]
    ways = [(on_elements, on_stiffer) for on_stiffer in (False, True)[:1 + with_stiffer]
            for on_elements in (False, True)[:1 + with_elements]]
    # What one input alone does is told by the model of the case.
    yield from ((place, *ways[0]) for place in alone)
    for way in ways[1:]:
        yield from ((place, *way) for place in (*alone[:2], places[0]))
    yield from ((place, *ways[number % len(ways)])
                for number, place in enumerate(places[1 + len(alone):]))


def blocks_on_each(model: CoupledModel) -> list[str]:
    """Return which block stands on each model of the soil, or which blocks on the only one."""
    names = [block.name for block in model.foundations]
    return [' and '.join(names)] if len(model.soil_models) == 1 else names


def description(
    case: Case, model: CoupledModel, table: ResponseTable, name: str, unbalance: ComplexArray,
) -> dict[str, object]:
    """Return what predictions under a name and an unbalance, (p,), rest on."""
    stable = table.stability
    compliances = {f'compliance of {names}': key_of(soil) for names, soil in zip(
        blocks_on_each(model), model.soil_models, strict=True)
        if isinstance(soil, (BoundaryElementModel, InfiniteElementModel, LayeredSiteModel))}
    return {
        'machine': name, 'case': case.name, 'version': rotorsoil_ros.__version__,
        'support': case.support.model, 'tables': {'response': table.key, **compliances},
        'accuracy': table.accuracy if math.isfinite(table.accuracy) else None,
        'speed_range_rad_s': list(table.speed_range),
        'stable': not stable.instabilities and not stable.doubt,
        'unstable_rad_s': stable.unstable.tolist(), 'unstable': list(unstable(stable)),
        'doubts': list(stability_doubts(stable)), 'band_holds': band_contents(case),
        'gaps_rad_s': table.gaps.tolist(), 'channels': list(table.channels),
        'unbalance': {
            disc: {'moment_kg_m': float(np.abs(value)), 'phase_rad': float(np.angle(value))}
            for disc, value in zip(table.planes, unbalance, strict=True)},
        'run_up': 'quasi_static' if table.poles.doubt else 'transient',
        'run_up_doubt': table.poles.doubt,
        'free_vibrations': [{'decay_rad_s': [decay.real, decay.imag], 'slope': slope}
                            for decay, slope in zip(table.poles.decay.tolist(),
                                                    table.poles.slope.tolist(), strict=True)],
        'units': UNITS,
        # All that is needed to compare the log with the case again.
        'document': case.content, 'files': case.files,
    }
