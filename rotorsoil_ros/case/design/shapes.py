"""How far discs and cones are from the shape of each block, and what may stand in their place."""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np

from rotorsoil_ros.case.cache import Cache
from rotorsoil_ros.case.config import Case
from rotorsoil_ros.case.design.tables import (
    boundary_element_model,
    infinite_element_model,
    layered_site_model,
    thin_layer_model,
)
from rotorsoil_ros.case.entries.ground import THIN_LAYERS
from rotorsoil_ros.case.entries.site import site_of
from rotorsoil_ros.errors import RotorSoilError
from rotorsoil_ros.ground.accuracy import shape_error, ShapeError
from rotorsoil_ros.ground.elements.table import require_kind
from rotorsoil_ros.ground.layers.model import ThinLayerModel
from rotorsoil_ros.ground.layers.profile import LayeredSoil, LEAST_LOSS_FACTOR
from rotorsoil_ros.ground.soil import Circle, Soil, SoilModel
from rotorsoil_ros.machine.foundation import Foundation
from rotorsoil_ros.machine.spread import SoilSpread

# Frequencies at which a model is compared with what knows its shape, and the lowest of them over
# the highest where a machine starts from rest.
_COMPARED = 60
_LOWEST_SHARE = 0.02

# Shapes on layers are taken to be stiffer than their discs by no more than this, and by this where
# nobody knows.
_MOST_STIFFER = 0.5


def shape_errors(
    case: Case, soil_models: Sequence[SoilModel], directory: Path,
) -> tuple[ShapeError | None, ...]:
    """
    Return how far discs and cones are from the shape of each block over the speed range.

    Against boundary elements of that block alone; a circle on cones against infinite elements;
    cones of a block in the ground against thin layers under the same discs. The discs of such a
    block are compared on the surface of a half-space of the soil below its base. None where the
    model is exact, or the shape is beyond reach.
    """
    soil = case.soil
    if not _takes_discs(case) or soil is None:
        return (None,) * len(case.foundations)
    cache = Cache(directory)

    def error(index: int, block: Foundation, model: SoilModel) -> ShapeError | None:
        with suppress(RotorSoilError):
            return _shape_error(case, soil, index, block, model, cache)
        return None

    return tuple(None if block.body is not None or block.on is not None else error(
        index, block, model)
                 for index, (block, model) in enumerate(
        zip(case.foundations, soil_models, strict=True)))


def _takes_discs(case: Case) -> bool:
    return case.support.geometry == 'disc' and case.support.model in (
        'cone', 'infinite_elements', THIN_LAYERS)


def _shape_error(
    case: Case, soil: Soil, index: int, block: Foundation, model: SoilModel, cache: Cache,
) -> ShapeError | None:
    """Return the error of a block, None where there is none."""
    contact, (low, high) = block.contact, case.speed_range
    omega = np.linspace(max(low, _LOWEST_SHARE * high), high, _COMPARED)

    def disc() -> SoilModel:
        require_kind('disc', soil.poisson_ratio, soil.loss_factor)
        return infinite_element_model(soil, contact, 'disc', cache=cache,
                                      speed_range=case.speed_range)

    if case.support.model == 'cone' and case.embedments[index].depth:
        return shape_error(model, embedded_model(case, index, cache), omega)
    if isinstance(contact, Circle):
        return shape_error(model, disc(), omega) if case.support.model == 'cone' else None
    alone = site_of([block])
    if case.ground is not None and not case.embedments[index].depth:
        return shape_error(model, layered_site_model(
            case.ground, alone, cache=cache, speed_range=case.speed_range), omega)
    return shape_error(model if case.ground is None else disc(), boundary_element_model(
        soil, alone, cache=cache, speed_range=case.speed_range), omega)


def embedded_model(
    case: Case, index: int, cache: Cache, speed_range: tuple[float, float] | None = None,
) -> ThinLayerModel:
    """Return the thin layers that a block of a case, on cones in a half-space, is held against."""
    assert case.soil is not None
    lossy = replace(case.soil, loss_factor=max(case.soil.loss_factor, LEAST_LOSS_FACTOR))
    return thin_layer_model(LayeredSoil((), lossy), case.foundations[index].contact,
                            case.embedments[index], cache=cache,
                            speed_range=speed_range or case.speed_range)


def other_forms(
    case: Case, soil_models: Sequence[SoilModel], spread: SoilSpread, directory: Path,
) -> tuple[list[SoilModel], list[float]]:
    """Return what the ground below each block may be instead, and how much stiffer."""
    stiffer = [0.0] * len(case.foundations)
    bends = any(block.body is not None or block.on is not None for block in case.foundations)
    if not spread.model_form or case.soil is None or bends or not _takes_discs(case):
        return [], stiffer
    if case.support.model == THIN_LAYERS:
        shapes = shape_errors(case, soil_models, directory)
        return [], [0.0 if isinstance(block.contact, Circle) else
                    min(_MOST_STIFFER if shape is None else shape.share, _MOST_STIFFER)
                    for block, shape in zip(case.foundations, shapes, strict=True)]
    low, high = case.speed_range
    # A softer soil has shorter waves: its table has to reach further.
    speeds = low, max(1.0, 0.5 * spread.shear_modulus_factor**0.5) * high
    cache = Cache(directory)
    # Beyond the reach of either there is no other form: `band_contents` says so.
    with suppress(RotorSoilError):
        if any(embedment.depth for embedment in case.embedments):
            return [embedded_model(case, index, cache, speeds)
                    for index in range(len(case.foundations))], stiffer
        if not any(isinstance(block.contact, Circle) for block in case.foundations):
            return [boundary_element_model(
                case.soil, site_of(case.foundations), cache=cache, speed_range=speeds,
                spread=spread.poisson_ratio)], stiffer
        if case.support.model == 'cone':
            require_kind('disc', case.soil.poisson_ratio, case.soil.loss_factor)
            return [infinite_element_model(case.soil, block.contact, 'disc', cache=cache,
                                           speed_range=speeds)
                    for block in case.foundations], stiffer
    return [], stiffer
