"""What stands below the foundations of a case, and what identifies it."""

from rotorsoil_ros.case.cache import Cache
from rotorsoil_ros.case.config import Case
from rotorsoil_ros.case.design.sensing import unknown_beside
from rotorsoil_ros.case.design.tables import (
    boundary_element_model,
    green_model,
    infinite_element_model,
    key_of,
    layered_site_model,
    thin_layer_model,
)
from rotorsoil_ros.case.entries.sensors import site_around
from rotorsoil_ros.case.entries.site import BOUNDARY_ELEMENTS, site_of
from rotorsoil_ros.case.entries.support_file import RECEPTANCE, TABLE
from rotorsoil_ros.case.flexible.ground import bed_of, discs, welded
from rotorsoil_ros.errors import InputError, RotorSoilError
from rotorsoil_ros.ground.bed import PatchesApart, WinklerBed
from rotorsoil_ros.ground.boundary.layered_model import LayeredSiteModel
from rotorsoil_ros.ground.boundary.model import BoundaryElementModel, SiteGround
from rotorsoil_ros.ground.boundary.site import Site
from rotorsoil_ros.ground.cone import ConeModel
from rotorsoil_ros.ground.embedded_cone import EmbeddedConeModel
from rotorsoil_ros.ground.green import GreenModel
from rotorsoil_ros.ground.half_space import InfiniteElementModel
from rotorsoil_ros.ground.layers.model import LAYERS_ALGORITHM, ThinLayerModel
from rotorsoil_ros.ground.soil import Contact, RigidSoil, SoilModel
from rotorsoil_ros.ground.table import ComplianceTable
from rotorsoil_ros.machine.flexible.body import FlexibleBody, GROUNDED
from rotorsoil_ros.machine.flexible.receptance import SeatReceptance


def soil_models(case: Case, cache: Cache) -> tuple[SoilModel, ...]:
    """Return the model under each foundation, or one under all of them, as `coupled_model`."""
    if case.support.model == RECEPTANCE:
        return case.tables
    bends = any(block.body is not None for block in case.foundations)
    if case.support.model == BOUNDARY_ELEMENTS and case.soil is not None and not bends:
        site = site_of(case.foundations, case.ground_probes)
        if case.ground is not None:
            return (layered_site_model(case.ground, site, cache=cache,
                                       speed_range=case.speed_range),)
        return (boundary_element_model(case.soil, site, cache=cache,
                                       speed_range=case.speed_range),)
    return tuple(_soil_model(case, index, cache)
                 for index in range(len(case.foundations)))


def _soil_model(case: Case, index: int, cache: Cache) -> SoilModel:
    block = case.foundations[index]
    if block.on is not None:
        return welded(block)
    if block.body is None:
        return _below(case, index, block.contact, cache)
    if block.body.bed == GROUNDED:
        return RigidSoil()
    return bed_of(block, lambda contact: _below(case, index, contact, cache),
                  lambda body: _through(case, body, cache))


def _through(case: Case, body: FlexibleBody, cache: Cache) -> SoilModel:
    """Return the half-space that couples the patches of a body."""
    assert case.soil is not None
    return green_model(case.soil, *discs(body), cache=cache,
                       speed_range=case.speed_range)


def _below(case: Case, index: int, contact: Contact, cache: Cache) -> SoilModel:
    """Return the ground under one contact alone."""
    if case.support.model == 'rigid':
        return RigidSoil()
    if case.support.model == TABLE:
        return case.tables[index]
    if case.soil is None:
        raise InputError(f'{case.path}: soil: is missing')
    if case.support.model == 'cone':
        embedment = case.embedments[index]
        return (EmbeddedConeModel(case.soil, contact, embedment) if embedment.depth else
                ConeModel(case.soil, contact))
    alone = Site.of((contact,), ((0.0, 0.0),)) if (
        case.support.model == BOUNDARY_ELEMENTS) else None
    if case.ground is not None:
        if alone is not None:
            return layered_site_model(case.ground, alone, cache=cache,
                                      speed_range=case.speed_range)
        return thin_layer_model(case.ground, contact, case.embedments[index], cache=cache,
                                speed_range=case.speed_range)
    if alone is not None:
        return boundary_element_model(case.soil, alone, cache=cache, speed_range=case.speed_range)
    return infinite_element_model(case.soil, contact, case.support.geometry, cache=cache,
                                  speed_range=case.speed_range)


def around(case: Case, cache: Cache) -> SiteGround:
    """
    Return the ground that the blocks of a case load, its sensors as points beside them.

    By boundary elements, whichever model is below the blocks: a circle is a square as large.

    Raises
    ------
    RotorSoilError
        If nobody can tell how the ground moves there, with the reason.

    """
    if (why := unknown_beside(case)) or case.soil is None:
        raise RotorSoilError(why)
    site = site_around(case.foundations, [(one.x, one.y) for one in case.sensors.ground])
    if case.ground is not None:
        return layered_site_model(case.ground, site, cache=cache, speed_range=case.speed_range)
    return boundary_element_model(case.soil, site, cache=cache, speed_range=case.speed_range)


def identity(model: SoilModel) -> object:
    """Return what identifies a model of the ground in a key."""
    if isinstance(model, WinklerBed):
        return ['winkler', identity(model.model), model.shares, *model.axes]
    if isinstance(model, PatchesApart):
        return ['apart', [identity(one) for one in model.models], *model.kept]
    if isinstance(model, GreenModel):
        return ['green', model.soil, model.places, model.radii, model.table.highest]
    if isinstance(model, InfiniteElementModel):
        return ['infinite', model.soil, model.contact, key_of(model)]
    if isinstance(model, ThinLayerModel):
        return ['layers', LAYERS_ALGORITHM, model.ground, model.contact, model.embedment,
                float(model.table.edges[-1])]
    if isinstance(model, BoundaryElementModel):
        return ['boundary', model.soil, model.site, key_of(model)]
    if isinstance(model, LayeredSiteModel):
        return ['site on layers', model.ground, model.site, key_of(model)]
    if isinstance(model, ComplianceTable):
        return ['table', model.omega, model.values, *model.cut_offs, *model.branch_points]
    if isinstance(model, SeatReceptance):
        return ['seats', model.omega, model.values, *model.seats]
    return model
