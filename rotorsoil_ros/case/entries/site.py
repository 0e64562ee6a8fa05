"""Where blocks and probes stand on the ground, and what boundary elements can make of it."""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from rotorsoil_ros.case.case_errors import Faults
from rotorsoil_ros.errors import require, RotorSoilError
from rotorsoil_ros.ground.boundary.effort import highest_a0, HIGHEST_POISSON_RATIO
from rotorsoil_ros.ground.boundary.layered_model import LayeredSite
from rotorsoil_ros.ground.boundary.site import Site
from rotorsoil_ros.ground.layers.profile import LayeredSoil
from rotorsoil_ros.ground.soil import Soil
from rotorsoil_ros.machine.foundation import Foundation

if TYPE_CHECKING:
    from rotorsoil_ros.case.config import Case

BOUNDARY_ELEMENTS = 'boundary_elements'

# Natural modes above the running speed and excitation at twice the speed need the soil too.
HIGHEST_ORDER = 2.0


@dataclass(frozen=True, slots=True)
class GroundProbe:
    """
    Place on the ground whose motion is wanted.

    Attributes
    ----------
    name : str
        First part of its channels.
    x, y : float
        Across the shaft from its plane, and along it [m].

    """

    name: str
    x: float
    y: float


def site_of(foundations: Sequence[Foundation], probes: Sequence[GroundProbe] = ()) -> Site:
    """
    Return blocks and probes as boundary elements know them.

    Raises
    ------
    RotorSoilError
        If a contact is a circle or a probe is not beside the blocks.

    """
    grounded = [block for block in foundations if block.on is None]
    return Site.of(tuple(block.contact for block in grounded),
                   tuple((block.centre_x, block.centre_y) for block in grounded),
                   tuple((probe.x, probe.y) for probe in probes))


def site_reach(site: Site, soil: Soil, speed_range: tuple[float, float]) -> float:
    """
    Return the a0 up to which a site has to be solved for some speeds [rad/s].

    Raises
    ------
    RotorSoilError
        If the speeds or the soil are beyond the method's reach.

    """
    require(soil.poisson_ratio <= HIGHEST_POISSON_RATIO, 'poisson_ratio',
            f'<= {HIGHEST_POISSON_RATIO} for boundary elements', soil.poisson_ratio)
    scaled, scale = site.scaled(), site.length / soil.shear_wave_speed
    running = highest_a0(scaled, scale * speed_range[1])
    with suppress(RotorSoilError):  # at such speeds the running frequency has to do
        return highest_a0(scaled, scale * HIGHEST_ORDER * speed_range[1])
    return running


def layered_site(
    ground: LayeredSoil, site: Site, speed_range: tuple[float, float],
) -> LayeredSite:
    """
    Return the proportions of a site on layers for some speeds [rad/s].

    Raises
    ------
    RotorSoilError
        If speeds, blocks or layers are beyond the method's reach.

    """
    found = LayeredSite.of(ground, site, omega_max=speed_range[1])
    with suppress(RotorSoilError):  # at such speeds the running frequency has to do
        return LayeredSite.of(ground, site, omega_max=HIGHEST_ORDER * speed_range[1])
    return found


@dataclass(frozen=True)
class SiteEntries:
    """Builds the probes on the ground and says at which key a site was refused."""

    faults: Faults

    def probes(self) -> tuple[GroundProbe, ...]:
        """Return the probes, or raise an InputError where the support tells no motion there."""
        entries = self.faults.entries
        if entries.ground.probes and entries.support.model != BOUNDARY_ELEMENTS:
            raise self.faults.error('ground', 'probes', problem=(
                f'need the support model {BOUNDARY_ELEMENTS}, which alone tells the motion of '
                f'the ground beside the blocks, got {entries.support.model}'))
        return tuple(GroundProbe(entry.name, entry.place.x, entry.place.y)
                     for entry in entries.ground.probes)

    def refuse_unreachable(self, case: 'Case') -> None:
        """Raise an InputError before boundary elements are built that nobody could solve."""
        faults, soil = self.faults, case.soil
        if soil is None or case.support.model != BOUNDARY_ELEMENTS:
            return
        for index, block in enumerate(case.foundations):
            with faults.at('foundations', index):
                site_of([replace(block, on=None)])
        for index, probe in enumerate(case.ground_probes):
            with faults.at('ground', 'probes', index):
                site_of(case.foundations, [probe])
        site = site_of(case.foundations, case.ground_probes)
        if case.ground is not None:
            with faults.at('soil', entry=faults.entries.soil):
                layered_site(case.ground, site, case.speed_range)
            return
        at_soil = soil.poisson_ratio > HIGHEST_POISSON_RATIO
        with faults.at('soil' if at_soil else 'speed_range_rpm', entry=faults.entries.soil):
            site_reach(site, soil, case.speed_range)
