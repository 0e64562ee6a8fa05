"""The models that a case stands for, with their tables out of the cache."""

from collections.abc import Iterator
from dataclasses import replace
from functools import lru_cache
from itertools import islice
import math
from pathlib import Path

import numpy as np

import rotorsoil_ros
from rotorsoil_ros.arrays import ComplexArray
from rotorsoil_ros.case.cache import Cache, content_key
from rotorsoil_ros.case.config import Case, infinite_range, proportions
from rotorsoil_ros.case.design.ground import band_contents
from rotorsoil_ros.case.entries.ground import THIN_LAYERS
from rotorsoil_ros.case.summary import stability_doubts, unstable
from rotorsoil_ros.errors import InputError, RotorSoilError, solved
from rotorsoil_ros.ground.accuracy import mapping_error
from rotorsoil_ros.ground.cone import ConeModel
from rotorsoil_ros.ground.elements.table import DimensionlessTable, require_kind
from rotorsoil_ros.ground.half_space import a0_range, ELEMENTS_ALGORITHM, InfiniteElementModel
from rotorsoil_ros.ground.layers.model import LAYERS_ALGORITHM, Proportions, ThinLayerModel
from rotorsoil_ros.ground.layers.profile import Embedment, LayeredSoil, LEAST_LOSS_FACTOR
from rotorsoil_ros.ground.layers.table import LayeredTable
from rotorsoil_ros.ground.neighbours import on_soil
from rotorsoil_ros.ground.soil import Contact, RigidSoil, Soil, SoilModel
from rotorsoil_ros.ground.table import ComplianceTable
from rotorsoil_ros.machine.band import (
    depends_on_soil,
    highest_poisson_ratio,
    of_other_form,
    on_soils,
    ResponseBand,
)
from rotorsoil_ros.machine.coupled import CoupledModel
from rotorsoil_ros.machine.response import ResponseTable, TOLERANCE
from rotorsoil_ros.machine.spread import Place, SoilSpread

# What a message holds of an answer, in a log that has to explain itself.
UNITS = {
    'position': 'displacement, m or rad, zero-to-peak',
    'velocity': 'm/s or rad/s, zero-to-peak',
    'effort': 'transmitted force, N or N m, zero-to-peak',
    'phase': 'rad',
    'convention': 'x(t) = Re(X exp(+i omega t))',
}

# Rectangles that are longer than any that was measured are taken to be off by this.
_LARGEST_MAPPING = 0.5


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
        soils = soil_models(case, directory)
    return CoupledModel(case.rotor, case.foundations, soils, case.couples)


def soil_models(case: Case, directory: Path) -> tuple[SoilModel, ...]:
    """Return the model of the soil under each foundation, as `coupled_model`."""
    return tuple(_soil_model(case, index, Cache(directory))
                 for index in range(len(case.foundations)))


def _soil_model(case: Case, index: int, cache: Cache) -> SoilModel:
    if case.support.model == 'rigid':
        return RigidSoil()
    if case.support.model == 'table':
        return case.tables[index]
    if case.soil is None:
        raise InputError(f'{case.path}: soil: is missing')
    contact = case.foundations[index].contact
    if case.support.model == 'cone':
        return ConeModel(case.soil, contact)
    if case.ground is not None:
        return thin_layer_model(case.ground, contact, case.embedments[index], cache=cache,
                                speed_range=case.speed_range)
    return infinite_element_model(case.soil, contact, case.support.geometry, cache=cache,
                                  speed_range=case.speed_range)


def infinite_element_model(
    soil: Soil, contact: Contact, geometry: str, *, cache: Cache,
    speed_range: tuple[float, float],
) -> InfiniteElementModel:
    """
    Return infinite elements for a soil, solved unless a soil of its kind was before.

    Parameters
    ----------
    soil, contact, geometry
        As `InfiniteElementModel.solved`.
    cache : Cache
        Where dimensionless tables lie.
    speed_range : tuple of two floats
        Rotor speeds to be covered [rad/s].

    """
    low, high = infinite_range(soil, contact, geometry, speed_range)
    key = compliance_key(
        soil, geometry, *a0_range(soil, contact, geometry, omega_min=low, omega_max=high))
    stored = cache.load('compliance', key)
    if stored is not None:
        return InfiniteElementModel(soil, contact, DimensionlessTable.from_arrays(stored))
    model = InfiniteElementModel.solved(soil, contact, geometry, omega_min=low, omega_max=high)
    cache.store('compliance', key, model.table.to_arrays())
    return model


def thin_layer_model(
    ground: LayeredSoil, contact: Contact, embedment: Embedment, *, cache: Cache,
    speed_range: tuple[float, float],
) -> ThinLayerModel:
    """
    Return thin layers, solved unless a ground of these proportions was before.

    Parameters
    ----------
    ground, contact, embedment
        As `ThinLayerModel.solved`.
    cache : Cache
        Where dimensionless tables lie.
    speed_range : tuple of two floats
        Rotor speeds to be covered [rad/s].

    """
    scaled = proportions(ground, contact, embedment, speed_range)
    key = layers_key(scaled)
    stored = cache.load('compliance', key)
    if stored is not None:
        return ThinLayerModel(ground, contact, LayeredTable.from_arrays(stored), embedment)
    table = scaled.table()
    cache.store('compliance', key, table.to_arrays())
    return ThinLayerModel(ground, contact, table, embedment)


def layers_key(scaled: Proportions) -> str:
    """Return what identifies a table of layered ground: ratios of stiffness, density and size."""
    return content_key('layers', LAYERS_ALGORITHM, scaled)


def compliance_key(soil: Soil, geometry: str, a0_min: float, a0_max: float) -> str:
    """Return what identifies a dimensionless table: neither G, nor density, nor size."""
    return content_key('compliance', ELEMENTS_ALGORITHM, geometry, soil.poisson_ratio,
                       soil.loss_factor, a0_min, a0_max)


def response_key(case: Case, model: CoupledModel) -> str:
    """Return what identifies the response table of a case: all of it but its unbalance."""
    return content_key('response', TOLERANCE, model.rotor, model.foundations,
                       [_identity(soil) for soil in model.soil_models], case.speed_range,
                       model.couples)


def key_of(model: InfiniteElementModel) -> str:
    """Return what identifies the dimensionless table of a model."""
    table = model.table
    return compliance_key(model.soil, table.geometry, table.a0_min, table.a0_max)


def _identity(model: SoilModel) -> object:
    if isinstance(model, InfiniteElementModel):
        return ['infinite', model.soil, model.contact, key_of(model)]
    if isinstance(model, ThinLayerModel):
        return ['layers', LAYERS_ALGORITHM, model.ground, model.contact, model.embedment,
                float(model.table.edges[-1])]
    if isinstance(model, ComplianceTable):
        return ['table', model.omega, model.values, *model.cut_offs]
    return model


def stored_response_table(
    case: Case, model: CoupledModel, directory: Path,
) -> ResponseTable | None:
    """Return the response table of a case if the cache holds it."""
    key = response_key(case, model)
    arrays = Cache(directory).load('response', key)
    return None if arrays is None else ResponseTable.from_arrays(
        arrays, model.channels, key=key)


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
    stored = stored_response_table(case, model, directory)
    if stored is not None:
        return stored
    with solved('the response of this machine'):
        table = replace(ResponseTable.build(model, case.speed_range),
                        key=response_key(case, model))
    Cache(directory).store('response', table.key, table.to_arrays())
    return table


def response_band(
    case: Case, model: CoupledModel, table: ResponseTable, directory: Path,
    spread: SoilSpread | None = None,
) -> ResponseBand | None:
    """
    Return the response of a case on all soils of its spread, or of another one.

    Besides the soil it holds what else the spread says and, unless that says otherwise, the
    error of the models: every second machine stands on infinite elements instead of cones, and
    of each pair of these one on ground as much stiffer as a rectangle may be than its disc.
    None where nothing is uncertain, as with known bearings on a support that knows of no soil.
    """
    spread = spread or case.uncertainty
    with_soil = case.soil is not None and depends_on_soil(model)
    if not with_soil and not spread.inputs(with_soil=False):
        return None
    elements, stiffer = _other_forms(case, spread, directory)
    forms = _forms(spread.places(with_soil=with_soil), with_elements=bool(elements),
                   with_stiffer=any(stiffer))
    others = []
    for place, on_solved, on_stiffer in islice(forms, spread.samples - 1):
        machine = machine_at(case, model, spread, place, Cache(directory))
        solved_on = [on_soil(one, _soil_at(case.soil, model, spread, place), block.contact)
                     for one, block in zip(elements, model.foundations, strict=False)
                     if case.soil is not None]
        others.append(of_other_form(machine, solved=solved_on, stiffer=stiffer,
                                    takes_solved=on_solved, takes_stiffer=on_stiffer))
    return ResponseBand.build(table, others, unbalance_factor=spread.unbalance_factor)


def machine_at(
    case: Case, model: CoupledModel, spread: SoilSpread, place: Place, cache: Cache | None = None,
) -> CoupledModel:
    """Return the machine at a place of a spread, on the ground that it has there."""
    machine = spread.machine(model, place)
    if case.soil is None or not depends_on_soil(model):
        return machine
    if spread.changes_ground(place) and case.support.geometry == 'disc':
        machine = replace(machine, soil_models=tuple(
            _other_ground(case, index, spread, place, cache)
            for index in range(len(machine.foundations))))
    return on_soils(machine, [_soil_at(case.soil, model, spread, place)])[0]


def _other_ground(
    case: Case, index: int, spread: SoilSpread, place: Place, cache: Cache | None,
) -> SoilModel:
    """Return what a block stands on at a place where the ground itself is another."""
    assert case.soil is not None
    lossy = replace(case.soil, loss_factor=max(case.soil.loss_factor, LEAST_LOSS_FACTOR))
    ground, embedment = spread.ground(case.ground or LayeredSoil((), lossy),
                                      case.embedments[index], place)
    contact, (low, high) = case.foundations[index].contact, case.speed_range
    # Softer soil has shorter waves: its table has to reach further.
    reach = max(1.0, 0.5 * spread.shear_modulus_factor**0.5)
    if cache is not None:
        return thin_layer_model(ground, contact, embedment, cache=cache,
                                speed_range=(low, reach * high))
    scaled = proportions(ground, contact, embedment, (low, reach * high))
    return ThinLayerModel(ground, contact, _solved_once(scaled), embedment)


@lru_cache(maxsize=32)
def _solved_once(scaled: Proportions) -> LayeredTable:
    """Return the table of a ground that is looked at more than once, as an input by itself."""
    return scaled.table()


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


def _other_forms(
    case: Case, spread: SoilSpread, directory: Path,
) -> tuple[list[SoilModel], list[float]]:
    """Return what the ground below each block may be instead, and how much stiffer."""
    stiffer = [0.0] * len(case.foundations)
    if (not spread.model_form or case.soil is None or case.support.geometry != 'disc'
            or case.support.model not in ('cone', 'infinite_elements', THIN_LAYERS)):
        return [], stiffer
    stiffer = [min(mapping_error(block.contact), _LARGEST_MAPPING) for block in case.foundations]
    if case.support.model != 'cone':
        return [], stiffer
    low, high = case.speed_range
    # A softer soil has shorter waves: its table has to reach further.
    reach = max(1.0, 0.5 * spread.shear_modulus_factor**0.5)
    try:
        require_kind('disc', case.soil.poisson_ratio, case.soil.loss_factor)
        elements: list[SoilModel] = [infinite_element_model(
            case.soil, block.contact, 'disc', cache=Cache(directory),
            speed_range=(low, reach * high)) for block in case.foundations]
    except RotorSoilError:  # beyond the reach of infinite elements: `band_contents` says so
        return [], stiffer
    return elements, stiffer


def description(
    case: Case, model: CoupledModel, table: ResponseTable, name: str, unbalance: ComplexArray,
) -> dict[str, object]:
    """Return what predictions under a name and an unbalance, (p,), rest on."""
    stable = table.stability
    compliances = {f'compliance of {foundation.name}': key_of(soil) for foundation, soil in zip(
        model.foundations, model.soil_models, strict=True)
        if isinstance(soil, InfiniteElementModel)}
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
        'units': UNITS,
        # All that is needed to compare the log with the case again.
        'document': case.content, 'files': case.files,
    }
