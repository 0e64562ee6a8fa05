"""Which ground the entries of a case file describe, and which model of it can stand below."""

from contextlib import suppress
from dataclasses import dataclass
import math
from typing import Any

from rotorsoil_ros.case import schema
from rotorsoil_ros.case.case_errors import Faults
from rotorsoil_ros.case.entries.site import BOUNDARY_ELEMENTS, HIGHEST_ORDER
from rotorsoil_ros.case.entries.support_file import RECEPTANCE
from rotorsoil_ros.errors import require, RotorSoilError
from rotorsoil_ros.ground.embedded_cone import require_whole_wall
from rotorsoil_ros.ground.green import LEAST_LOSS
from rotorsoil_ros.ground.half_space import a0_range
from rotorsoil_ros.ground.layers.model import Proportions
from rotorsoil_ros.ground.layers.profile import (
    Embedment,
    Layer,
    LayeredSoil,
    require_lossy,
    require_room,
    SURFACE,
)
from rotorsoil_ros.ground.soil import Contact, Soil
from rotorsoil_ros.machine.spread import OF_GROUND, OF_LAYER, SOIL_INPUTS, SoilSpread

# The support that knows layers and walls in the ground.
THIN_LAYERS = 'thin_layers'

# What receptances of seats leave no choice of.
_IN_SEATS = {*SOIL_INPUTS, *OF_GROUND, OF_LAYER, 'foundation_mass_factor',
             'foundation_stiffness_factor', 'shaft_height_factor'}

# Why cones are not offered on layers.
_CONES_ON_ROCK = ('cones on rock miss its resonance by a factor of up to 2.3 and radiate where '
                  'nothing can')
_CONES_ON_LAYERS = 'a cone is of one material; thin layers are solved within 0.1 % in seconds'


def infinite_range(
    soil: Soil, contact: Contact, geometry: str, speed_range: tuple[float, float],
) -> tuple[float, float]:
    """Return the frequencies [rad/s] that infinite elements have to cover for some speeds."""
    low, high = speed_range
    # A disc is known down to rest; a strip has no static stiffness.
    lowest = 0.0 if geometry == 'disc' else low
    a0_range(soil, contact, geometry, omega_min=lowest, omega_max=high)
    with suppress(RotorSoilError):  # at such speeds the running frequency has to do
        a0_range(soil, contact, geometry, omega_min=lowest, omega_max=HIGHEST_ORDER * high)
        return lowest, HIGHEST_ORDER * high
    return lowest, high


def proportions(
    ground: LayeredSoil, contact: Contact, embedment: Embedment,
    speed_range: tuple[float, float],
) -> Proportions:
    """Return what a table of layered ground has to cover for some speeds [rad/s]."""
    high = speed_range[1]
    found = Proportions.of(ground, contact, embedment, omega_max=high)
    with suppress(RotorSoilError):  # at such speeds the running frequency has to do
        return Proportions.of(ground, contact, embedment, omega_max=HIGHEST_ORDER * high)
    return found


@dataclass(frozen=True)
class GroundEntries:
    """Builds the ground and says at which key it was refused."""

    faults: Faults

    def ground(self) -> LayeredSoil | Soil | None:
        """Return the ground of a case: layers, a half-space, or None where it tells none."""
        entry = self.faults.entries.soil
        if not isinstance(entry, schema.LayersEntry):
            soil = None if entry is None else self._soil('soil', entry=entry)
            if soil is None or self.faults.entries.support.model != THIN_LAYERS:
                return soil
            with self.faults.at('soil', entry=entry):
                require_lossy(soil)
            return LayeredSoil((), soil)
        if not entry.layers:
            raise self.faults.error('soil', 'layers', problem='must be at least one, from the '
                                                              'surface down, got none')
        layers = self.faults.attempt_each(self._layer, entry.layers)
        below = entry.below if isinstance(entry.below, str) else self.faults.attempt(
            lambda: self._soil('soil', 'below', entry=entry.below))
        if layers is None or below is None:
            return None
        return LayeredSoil(layers, None if isinstance(below, str) else below)

    def _layer(self, index: int, entry: schema.LayerEntry) -> Layer:
        place = ('soil', 'layers', index)
        soil = self._soil(*place, entry=entry)
        with self.faults.at(*place, entry=entry):
            return Layer(entry.thickness, soil)

    def _soil(self, *place: int | str, entry: Any) -> Soil:
        """Return a soil by its shear modulus or the velocity of its shear waves."""
        velocity, modulus = entry.shear_wave_velocity, entry.shear_modulus
        if (velocity is None) is (modulus is None):
            raise self.faults.error(
                *place, problem='needs either shear_modulus in Pa or shear_wave_velocity in m/s, '
                                f'got {"neither" if velocity is None else "both"}')
        with self.faults.at(*place, entry=entry):
            if velocity is not None:
                require(0.0 < velocity < math.inf, 'shear_wave_velocity', '> 0 m/s', velocity)
                modulus = entry.density * velocity**2
            soil = Soil(modulus, entry.poisson_ratio, entry.density, entry.loss_factor)
            if place != ('soil',):
                require_lossy(soil)
            return soil

    def embedments(self, ground: LayeredSoil | Soil | None) -> tuple[Embedment, ...] | None:
        """Return how each block stands in the ground, or None where one is at fault."""
        def embedment(index: int, entry: schema.FoundationEntry) -> Embedment:
            model = self.faults.entries.support.model
            for name in ('embedment', 'side_contact'):
                given = getattr(entry, name)
                if given and model not in (THIN_LAYERS, 'cone'):
                    raise self.faults.error('foundations', index, name, problem=(
                        f'belongs to the support model {THIN_LAYERS} or cone, got {given:g} with '
                        f'the model {model}, which takes every block as standing on the surface'))
            if not entry.embedment and entry.side_contact is None:
                return SURFACE
            with self.faults.at('foundations', index, entry=entry):
                found = Embedment(entry.embedment, 1.0 if entry.side_contact is None
                                  else entry.side_contact)
                if isinstance(ground, LayeredSoil):
                    require_room(ground, found)
                if model == 'cone':
                    require_whole_wall(found)
            return found

        return self.faults.attempt_each(embedment, self.faults.entries.foundations)

    def refuse_unfit_support(self) -> None:
        """Raise an InputError where the support cannot stand on this ground."""
        entries, support = self.faults.entries, self.faults.entries.support
        if support.model == 'rigid':
            return
        if support.model == RECEPTANCE:
            self._refuse_beside_seats()
            return
        if entries.soil is None and support.model != 'table':
            raise self.faults.error('soil', problem='is missing; the support model '
                                                    f'{support.model} needs it')
        if isinstance(entries.soil, schema.LayersEntry) and support.model not in (
                THIN_LAYERS, BOUNDARY_ELEMENTS, 'table'):
            raise self.faults.error('support', 'model', problem=(
                f'must be {THIN_LAYERS} or {BOUNDARY_ELEMENTS} on soil.layers, got '
                f'{support.model}, which knows a '
                'homogeneous half-space only' + (
                    ': ' + (_CONES_ON_ROCK if entries.soil.below == 'rock' else _CONES_ON_LAYERS)
                    if support.model == 'cone' else '')))
        if support.model == BOUNDARY_ELEMENTS and support.geometry != 'disc':
            raise self.faults.error('support', 'geometry', problem=(
                'belongs to the support model infinite_elements; boundary elements take the plan '
                f'of the block as it is, got {support.geometry}'))
        if support.model in ('cone', 'table', THIN_LAYERS) and support.geometry != 'disc':
            raise self.faults.error(
                'support', 'geometry', problem=f'must be disc for the model {support.model}, '
                                               f'got {support.geometry}')
        if not entries.foundations:
            raise self.faults.error('foundations', problem='is missing; the support model '
                                                           f'{support.model} needs a block')

    def _refuse_beside_seats(self) -> None:
        """Raise an InputError at what receptances of seats hold already."""
        entries, support = self.faults.entries, self.faults.entries.support
        if entries.foundations:
            names = ', '.join(block.name for block in entries.foundations)
            raise self.faults.error('foundations', problem=(
                f'must be empty with the support model {RECEPTANCE}, whose file holds foundation '
                f'and ground, got {names}'))
        if support.geometry != 'disc':
            raise self.faults.error('support', 'geometry', problem=(
                f'must be disc for the model {RECEPTANCE}, got {support.geometry}'))

    def refuse_unfit_bed(self) -> None:
        """Raise an InputError where the ground cannot stand below what bends."""
        entries, model = self.faults.entries, self.faults.entries.support.model
        for index, block in enumerate(entries.foundations):
            if block.flexible is None:
                continue
            if block.soil_under == 'green' and (
                    model in ('rigid', 'table', THIN_LAYERS)
                    or isinstance(entries.soil, schema.LayersEntry)):
                raise self.faults.error('foundations', index, 'soil_under', problem=(
                    'must be winkler or each where the ground is no homogeneous half-space, got '
                    f'green with the support model {model}'))
            if block.soil_under == 'green' and isinstance(entries.soil, schema.SoilEntry) and (
                    entries.soil.loss_factor < LEAST_LOSS):
                raise self.faults.error('soil', 'loss_factor', problem=(
                    f'must be >= {LEAST_LOSS:g} where patches are coupled through the ground '
                    f'(foundations.{index}), got {entries.soil.loss_factor:g}'))
            if (block.soil_under == 'green' and entries.uncertainty is not None
                    and entries.uncertainty.rock_depth is not None):
                raise self.faults.error('uncertainty', 'rock_depth', problem=(
                    f'must not be given where green couples the patches of {block.name} '
                    f'(foundations.{index}) through a half-space'))
            if model == BOUNDARY_ELEMENTS and sum(
                    one.on is None for one in entries.foundations) > 1:
                raise self.faults.error('support', 'model', problem=(
                    f'must be one that takes each foundation alone where {block.name} bends '
                    f'(foundations.{index}), got {model}, which couples rigid blocks'))
            if entries.ground.probes:
                raise self.faults.error('ground', 'probes', problem=(
                    f'tell the motion beside rigid blocks only, and {block.name} bends '
                    f'(foundations.{index})'))
            if entries.support.geometry != 'disc':
                raise self.faults.error('support', 'geometry', problem=(
                    f'must be disc below what bends (foundations.{index}), got '
                    f'{entries.support.geometry}'))

    def uncertainty(self, ground: Soil | LayeredSoil | None) -> SoilSpread:
        """Return how far the machine may be from what the file says."""
        entry = self.faults.entries.uncertainty
        given = {} if entry is None else entry.model_dump(exclude_none=True)
        layers = len(ground.soils) if isinstance(ground, LayeredSoil) else 0
        with self.faults.at('uncertainty', entry=entry):
            return SoilSpread(**given, layers=layers)

    def refuse_unfit_spread(self) -> None:
        """Raise an InputError where there is no such ground as that which may be there."""
        entries = self.faults.entries
        if entries.uncertainty is None:
            return
        if entries.support.model == RECEPTANCE:
            for name in sorted(entries.uncertainty.model_fields_set & _IN_SEATS):
                given = getattr(entries.uncertainty, name)
                self.faults.found.append(self.faults.error('uncertainty', name, problem=(
                    f'must not be given with the support model {RECEPTANCE}: its file holds '
                    f'foundation and ground as they are, got {given}')))
            return
        if (entries.uncertainty.layer_stiffness_factor is not None
                and not isinstance(entries.soil, schema.LayersEntry)):
            raise self.faults.error('uncertainty', OF_LAYER, problem=(
                'belongs to soil.layers; of one soil it is shear_modulus_factor, got '
                f'{entries.uncertainty.layer_stiffness_factor:g}'))
        if entries.uncertainty.rock_depth is None:
            return
        if entries.support.geometry != 'disc':
            raise self.faults.error('uncertainty', 'rock_depth', problem=(
                f'needs the geometry disc, got {entries.support.geometry}: a strip on rock is '
                'not modelled'))
        shallowest = entries.uncertainty.rock_depth[0]
        for index, block in enumerate(entries.foundations):
            if 0.0 < shallowest <= block.embedment:
                raise self.faults.error('uncertainty', 'rock_depth', problem=(
                    f'must begin below the base of {block.name} (foundations.{index}), '
                    f'{block.embedment:g} m, got {shallowest:g} m'))
