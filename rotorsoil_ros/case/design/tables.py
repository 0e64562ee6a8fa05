"""Which tables the ground of a case needs: solved, or out of the cache."""

from functools import lru_cache

from rotorsoil_ros.case.cache import Cache, content_key
from rotorsoil_ros.case.entries.ground import infinite_range, proportions
from rotorsoil_ros.case.entries.site import HIGHEST_ORDER, layered_site, site_reach
from rotorsoil_ros.ground.boundary.effort import HIGHEST_POISSON_RATIO
from rotorsoil_ros.ground.boundary.layered_model import (
    LAYERED_SITE_ALGORITHM,
    LayeredSite,
    LayeredSiteModel,
    LayeredSiteTable,
)
from rotorsoil_ros.ground.boundary.model import BoundaryElementModel
from rotorsoil_ros.ground.boundary.site import Site
from rotorsoil_ros.ground.boundary.table import BOUNDARY_ALGORITHM, BoundaryTable
from rotorsoil_ros.ground.elements.table import DimensionlessTable
from rotorsoil_ros.ground.green import GREEN_ALGORITHM, GreenModel, GreenTable, pairs_of
from rotorsoil_ros.ground.half_space import a0_range, ELEMENTS_ALGORITHM, InfiniteElementModel
from rotorsoil_ros.ground.layers.model import LAYERS_ALGORITHM, Proportions, ThinLayerModel
from rotorsoil_ros.ground.layers.profile import Embedment, LayeredSoil
from rotorsoil_ros.ground.layers.table import LayeredTable
from rotorsoil_ros.ground.soil import Contact, Soil


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
    return InfiniteElementModel(soil, contact, cache.kept(
        'compliance', key, rebuild=DimensionlessTable.from_arrays,
        solve=lambda: InfiniteElementModel.solved(
            soil, contact, geometry, omega_min=low, omega_max=high).table))


def thin_layer_model(
    ground: LayeredSoil, contact: Contact, embedment: Embedment, *, cache: Cache | None,
    speed_range: tuple[float, float],
) -> ThinLayerModel:
    """
    Return thin layers, solved unless a ground of these proportions was before.

    Parameters
    ----------
    ground, contact, embedment
        As `ThinLayerModel.solved`.
    cache : Cache or None
        Where dimensionless tables lie; without one they are kept in this process.
    speed_range : tuple of two floats
        Rotor speeds to be covered [rad/s].

    """
    scaled = proportions(ground, contact, embedment, speed_range)
    table = _layers_once(scaled) if cache is None else cache.kept(
        'compliance', layers_key(scaled), rebuild=LayeredTable.from_arrays, solve=scaled.table)
    return ThinLayerModel(ground, contact, table, embedment)


@lru_cache(maxsize=64)
def _layers_once(scaled: Proportions) -> LayeredTable:
    """Return the table of a ground that is looked at more than once, as an input by itself."""
    return scaled.table()


def layers_key(scaled: Proportions) -> str:
    """Return what identifies a table of layered ground: ratios of stiffness, density and size."""
    return content_key('layers', LAYERS_ALGORITHM, scaled)


def boundary_element_model(
    soil: Soil, site: Site, *, cache: Cache, speed_range: tuple[float, float],
    spread: float = 0.0,
) -> BoundaryElementModel:
    """
    Return boundary elements for a soil, solved unless a site of this kind was before.

    Parameters
    ----------
    soil, site
        As `BoundaryElementModel.solved_together`.
    cache : Cache
        Where dimensionless tables lie.
    speed_range : tuple of two floats
        Rotor speeds to be covered [rad/s].
    spread : float
        How far Poisson's ratio may be off: solved for its ends too, where it is not 0 [-].

    """
    a0_max, scaled = site_reach(site, soil, speed_range), site.scaled()
    ends = (soil.poisson_ratio - spread, soil.poisson_ratio, soil.poisson_ratio + spread)
    return BoundaryElementModel(soil, site, tuple(
        _boundary_table(scaled, ratio, soil.loss_factor, a0_max, cache)
        for ratio in sorted({min(max(end, 0.0), HIGHEST_POISSON_RATIO) for end in ends})))


def layered_site_model(
    ground: LayeredSoil, site: Site, *, cache: Cache | None, speed_range: tuple[float, float],
) -> LayeredSiteModel:
    """
    Return boundary elements on layers, solved unless a site of these proportions was before.

    Parameters
    ----------
    ground, site
        As `LayeredSiteModel.solved`.
    cache : Cache or None
        As in `thin_layer_model`.
    speed_range : tuple of two floats
        Rotor speeds to be covered [rad/s].

    """
    scaled = layered_site(ground, site, speed_range)
    return LayeredSiteModel(ground, site, _site_once(scaled) if cache is None else cache.kept(
        'compliance', layered_site_key(scaled),
        rebuild=lambda stored: LayeredSiteTable.from_arrays(scaled, stored), solve=scaled.table))


@lru_cache(maxsize=64)
def _site_once(scaled: LayeredSite) -> LayeredSiteTable:
    return scaled.table()


def layered_site_key(scaled: LayeredSite) -> str:
    """Return what identifies a table of a site on layers: its ratios and how far it reaches."""
    return content_key('site on layers', LAYERED_SITE_ALGORITHM, scaled)


def _boundary_table(
    site: Site, poisson_ratio: float, loss_factor: float, a0_max: float, cache: Cache,
) -> BoundaryTable:
    def solve() -> BoundaryTable:
        # Here and not above: what solves takes 0.1 s to import, and a stored table needs none.
        from rotorsoil_ros.ground.boundary.tabulate import tabulated

        return tabulated(site, poisson_ratio=poisson_ratio, loss_factor=loss_factor,
                         a0_max=a0_max)

    return cache.kept('compliance', site_key(site, poisson_ratio, loss_factor, a0_max),
                      rebuild=lambda stored: BoundaryTable.from_arrays(site, stored), solve=solve)


def green_model(
    soil: Soil, places: tuple[tuple[float, float], ...], radii: tuple[float, ...], *,
    cache: Cache, speed_range: tuple[float, float],
) -> GreenModel:
    """
    Return patches coupled through a half-space, solved unless such a grid was before.

    Parameters
    ----------
    soil, places, radii
        As `GreenModel.solved`.
    cache : Cache
        Where dimensionless tables lie.
    speed_range : tuple of two floats
        Rotor speeds to be covered [rad/s].

    """
    highest = HIGHEST_ORDER * speed_range[1]
    pairs, _ = pairs_of(places, radii)
    key = content_key('green', GREEN_ALGORITHM, pairs, soil.poisson_ratio, soil.loss_factor,
                      highest * radii[0] / soil.shear_wave_speed)
    return GreenModel(soil, places, radii, cache.kept(
        'compliance', key, rebuild=GreenTable.from_arrays,
        solve=lambda: GreenModel.solved(soil, places, radii, omega_max=highest).table))


def site_key(site: Site, poisson_ratio: float, loss_factor: float, a0_max: float) -> str:
    """Return what identifies a table of a site of unit length."""
    return content_key('boundary', BOUNDARY_ALGORITHM, site, poisson_ratio, loss_factor, a0_max)


def compliance_key(soil: Soil, geometry: str, a0_min: float, a0_max: float) -> str:
    """Return what identifies a dimensionless table: neither G, nor density, nor size."""
    return content_key('compliance', ELEMENTS_ALGORITHM, geometry, soil.poisson_ratio,
                       soil.loss_factor, a0_min, a0_max)


def key_of(model: BoundaryElementModel | InfiniteElementModel | LayeredSiteModel) -> str:
    """Return what identifies the dimensionless table of a model."""
    if isinstance(model, LayeredSiteModel):
        return layered_site_key(model.table.of)
    if isinstance(model, BoundaryElementModel):
        own = model.tables[0]
        return site_key(own.site, own.poisson_ratio, own.loss_factor, own.a0_max)
    table = model.table
    return compliance_key(model.soil, table.geometry, table.a0_min, table.a0_max)
