"""The models that a case stands for, with their tables out of the cache."""

from dataclasses import replace
from pathlib import Path

from rotorsoil_ros.case.cache import Cache, content_key
from rotorsoil_ros.case.config import Case, infinite_range
from rotorsoil_ros.errors import InputError, solved
from rotorsoil_ros.ground.cone import ConeModel
from rotorsoil_ros.ground.elements.table import DimensionlessTable
from rotorsoil_ros.ground.half_space import a0_range, ALGORITHM, InfiniteElementModel
from rotorsoil_ros.ground.soil import Contact, RigidSoil, Soil, SoilModel
from rotorsoil_ros.ground.table import ComplianceTable
from rotorsoil_ros.machine.band import (
    depends_on_soil,
    highest_poisson_ratio,
    on_soils,
    ResponseBand,
    SoilSpread,
)
from rotorsoil_ros.machine.coupled import CoupledModel
from rotorsoil_ros.machine.response import ResponseTable, TOLERANCE


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


def compliance_key(soil: Soil, geometry: str, a0_min: float, a0_max: float) -> str:
    """Return what identifies a dimensionless table: neither G, nor density, nor size."""
    return content_key('compliance', ALGORITHM, geometry, soil.poisson_ratio, soil.loss_factor,
                       a0_min, a0_max)


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
    if isinstance(model, ComplianceTable):
        return ['table', model.omega, model.values]
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
    case: Case, model: CoupledModel, table: ResponseTable, spread: SoilSpread | None = None,
) -> ResponseBand | None:
    """
    Return the response of a case on all soils of its spread, or of another one.

    None on a support that knows of no soil.
    """
    if case.soil is None or not depends_on_soil(model):
        return None
    soils = (spread or case.uncertainty).soils(
        case.soil, highest_poisson_ratio=highest_poisson_ratio(model))
    return ResponseBand.build(table, on_soils(model, soils[1:]))
