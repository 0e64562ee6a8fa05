"""What is not known of a machine, how badly, and the machines that it may be instead."""

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from itertools import count
import math
import re
from typing import TypeAlias

from rotorsoil_ros.errors import require
from rotorsoil_ros.ground.layers.profile import Embedment, LayeredSoil, LEAST_LOSS_FACTOR
from rotorsoil_ros.ground.soil import Soil
from rotorsoil_ros.machine.coupled import CoupledModel
from rotorsoil_ros.machine.foundation import Foundation
from rotorsoil_ros.rotor.assembly import Rotor
from rotorsoil_ros.rotor.bearing import Bearing
from rotorsoil_ros.rotor.shaft import ShaftSection

_MOST_SAMPLES = 4096

# Half-widths, and what is no input; everything else is a factor.
_HALF_WIDTHS = ('poisson_ratio', 'loss_factor')
OF_GROUND = ('rock_depth', 'side_contact', 'ground_water')
_NO_FACTORS = (*_HALF_WIDTHS, *OF_GROUND, 'samples', 'model_form', 'layers')

# Of the soil: what only a support that knows of one depends on.
SOIL_INPUTS = ('shear_modulus_factor', 'poisson_ratio', 'loss_factor', 'soil_density_factor')
# Scales every answer alike, so that no machine has to be solved for it.
UNBALANCE = 'unbalance_factor'

# Steps along the range of what changes the ground, where the answer is far from even in between.
_STEPS = {'rock_depth': 4, 'side_contact': 2, 'ground_water': 1}

# Stiffness of one layer by itself, the uppermost 1; the half-space below them is the last.
OF_LAYER = 'layer_stiffness_factor'
_LAYER = re.compile(rf'{OF_LAYER}_(\d+)')

# Poisson's ratio of soil full of water.
_SATURATED = 0.49

# By the name of an input, its place between the lowest (-1) and the highest (+1) of its range;
# what is not named is as the case says.
Place: TypeAlias = Mapping[str, float]


@dataclass(frozen=True, slots=True)
class SoilSpread:
    """
    How far a machine and its soil may be from what its case file says.

    Every factor f stands for a range from the value over f to the value times f, evenly in its
    logarithm; 1 is known exactly [-].

    Attributes
    ----------
    shear_modulus_factor : float
        Of G.
    poisson_ratio, loss_factor : float
        Half-widths of the ranges of nu and eta [-], cut where they would leave the possible.
    samples : int
        Number of machines, at least 3: the given one and both extremes of G are among them.
    bearing_stiffness_factor, bearing_damping_factor : float
        Of all bearings alike.
    model_form : bool
        Whether the error of the models of the ground themselves is part of the band.
    soil_density_factor : float
        Of the density of the soil, its G kept.
    pedestal_stiffness_factor : float
        Of all pedestals alike.
    foundation_mass_factor, rotor_mass_factor : float
        Of mass and inertia of all blocks with what stands on them; of all discs.
    shaft_stiffness_factor : float
        Of the bending stiffness of the shaft, its mass kept.
    shaft_height_factor : float
        Of the height of the shaft above the contact.
    foundation_stiffness_factor : float
        Of the modulus of foundations that bend.
    unbalance_factor : float
        Of the unbalance, all planes alike.
    layer_stiffness_factor : float
        Of the G of each of the layers by itself, beside what is said of all of them.
    layers : int
        How many soils the ground is made of, what is below the layers among them.
    rock_depth : tuple of two floats or None
        Between which depths below the surface rigid rock may lie [m]; infinite where there may be
        none, evenly in the inverse of the depth. None where the case says all that is known.
    side_contact : tuple of two floats or None
        Between which shares of the embedment the wall may be welded [-].
    ground_water : bool
        Whether ground water may stand at the surface: nu of all soil up to 0.49, its modulus kept.

    References
    ----------
    ASCE 4, sec. on soil-structure interaction: G (1 + C_v) and G / (1 + C_v), C_v = 0.5 to 1.

    """

    shear_modulus_factor: float = 2.0
    poisson_ratio: float = 0.05
    loss_factor: float = 0.03
    samples: int = 64
    bearing_stiffness_factor: float = 1.0
    model_form: bool = True
    soil_density_factor: float = 1.0
    bearing_damping_factor: float = 1.0
    pedestal_stiffness_factor: float = 1.0
    foundation_mass_factor: float = 1.0
    rotor_mass_factor: float = 1.0
    shaft_stiffness_factor: float = 1.0
    shaft_height_factor: float = 1.0
    foundation_stiffness_factor: float = 1.0
    unbalance_factor: float = 1.0
    layer_stiffness_factor: float = 1.0
    layers: int = 0
    rock_depth: tuple[float, float] | None = None
    side_contact: tuple[float, float] | None = None
    ground_water: bool = False

    def __post_init__(self) -> None:
        for own in fields(self):
            if own.name not in _NO_FACTORS:
                require(1.0 <= getattr(self, own.name) < math.inf, own.name, '>= 1 and finite',
                        getattr(self, own.name))
        require(0.0 <= self.poisson_ratio < 0.5, 'poisson_ratio', 'in [0, 0.5)',
                self.poisson_ratio)
        require(0.0 <= self.loss_factor < 1.0, 'loss_factor', 'in [0, 1)', self.loss_factor)
        if self.rock_depth is not None:
            low, high = self.rock_depth
            require(0.0 < low < high, 'rock_depth', 'two rising depths > 0 m, the second may be '
                    'infinite', low)
        if self.side_contact is not None:
            low, high = self.side_contact
            require(0.0 <= low < high <= 1.0, 'side_contact', 'two rising shares in [0, 1]', low)
        require(3 <= self.samples <= _MOST_SAMPLES, 'samples',
                'at least 3' if self.samples < 3 else f'at most {_MOST_SAMPLES}', self.samples)

    def inputs(self, *, with_soil: bool) -> tuple[str, ...]:
        """Return the names of what is not known exactly, those of the soil first."""
        others = (own.name for own in fields(self)
                  if own.name not in (*SOIL_INPUTS, *OF_GROUND, 'samples', 'model_form', 'layers',
                                      OF_LAYER))
        known = tuple(name for name in (*(SOIL_INPUTS if with_soil else ()), *others)
                      if getattr(self, name) > (0.0 if name in _HALF_WIDTHS else 1.0))
        ground = (*self._of_layers, *(name for name in OF_GROUND if getattr(self, name)))
        # Behind the stiffness of the soil, which comes before all others.
        return (*known[:1], *ground, *known[1:]) if with_soil else known

    @property
    def _of_layers(self) -> tuple[str, ...]:
        uncertain = self.layer_stiffness_factor > 1.0
        return tuple(f'{OF_LAYER}_{number + 1}' for number in range(self.layers * uncertain))

    def places(self, *, with_soil: bool) -> list[dict[str, float]]:
        """
        Return where the machines of a band lie, the same in every process.

        The given machine comes first, then both ends of each input alone, that of the soil's G
        before all others; what is left of the samples varies everything together, of what needs
        the ground to be solved anew one layer at a time, or all that is no layer.
        """
        from scipy.stats import qmc  # takes a quarter of a second to import

        names = [name for name in self.inputs(with_soil=with_soil) if name != UNBALANCE]
        if not names:
            return [{}]
        alone = [{name: end} for name in names for end in (-1.0, 1.0)]
        # At least half of the samples, where there are few, vary everything together.
        alone = alone[:max(2, self.samples // 2)]
        rest = self.samples - 1 - len(alone)
        cube = 2.0 * qmc.LatinHypercube(len(names), seed=0).random(max(rest, 0)) - 1.0
        together = (dict(zip(names, row, strict=True)) for row in cube.tolist())
        return [{}, *alone, *map(self._on_few_grounds, together, count())]

    def _on_few_grounds(self, place: dict[str, float], number: int) -> dict[str, float]:
        """Return a place that keeps one layer, in turns, or all that changes ground but layers."""
        if not (layers := self._of_layers):
            return place
        kept = (*layers, None)[number % (len(layers) + 1)]
        dropped = set(layers) if kept is None else {*layers, *OF_GROUND, *_HALF_WIDTHS} - {kept}
        return {name: value for name, value in place.items() if name not in dropped}

    def scale(self, name: str, place: Place) -> float:
        """Return by what the value of an input is multiplied at a place."""
        return float(getattr(self, name) ** place.get(name, 0.0))

    def soil(self, soil: Soil, place: Place, *, highest_poisson_ratio: float = 0.49) -> Soil:
        """
        Return the soil at a place.

        Parameters
        ----------
        soil : Soil
            Middle of the spread.
        place : mapping
            Of the inputs.
        highest_poisson_ratio : float
            Up to which the support model holds.

        """
        poisson = soil.poisson_ratio + self.poisson_ratio * place.get('poisson_ratio', 0.0)
        loss = soil.loss_factor + self.loss_factor * place.get('loss_factor', 0.0)
        return Soil(
            soil.shear_modulus * self.scale('shear_modulus_factor', place),
            min(max(poisson, 0.0), max(soil.poisson_ratio, highest_poisson_ratio)),
            soil.density * self.scale('soil_density_factor', place), max(loss, 0.0))

    def changes_ground(self, place: Place, *, layered: bool) -> bool:
        """Return whether the ground at a place has to be solved anew, as layers have for nu."""
        return any(name in place and getattr(self, name)
                   for name in (*OF_GROUND, *(_HALF_WIDTHS if layered else ()))) or any(
                       name in place for name in self._of_layers)

    def ground(
        self, ground: LayeredSoil, embedment: Embedment, place: Place,
    ) -> tuple[LayeredSoil, Embedment]:
        """
        Return the ground and how a block stands in it at a place, G and density as given.

        Places are rounded to a few along each range: each is a solve.
        """
        def share(name: str) -> float:
            steps = _STEPS[name]
            return round(0.5 * steps * (place.get(name, -1.0) + 1.0)) / steps

        if self.side_contact is not None and 'side_contact' in place and embedment.depth:
            low, high = self.side_contact
            embedment = replace(embedment, side_contact=low + share('side_contact') * (high - low))
        ratio, loss = (getattr(self, name) * round(place.get(name, 0.0)) for name in _HALF_WIDTHS)
        if ratio or loss:
            ground = ground.changed(lambda soil: replace(
                soil, loss_factor=max(soil.loss_factor + loss, LEAST_LOSS_FACTOR),
                poisson_ratio=min(max(soil.poisson_ratio + ratio, 0.0),
                                  max(soil.poisson_ratio, _SATURATED))))
        if self._of_layers:
            ground = ground.stiffened([
                self.layer_stiffness_factor ** round(place.get(name, 0.0))
                for name in self._of_layers])
        if self.ground_water and 'ground_water' in place:
            water = share('ground_water')
            ground = ground.changed(lambda soil: replace(soil, poisson_ratio=(
                soil.poisson_ratio + water * max(0.0, _SATURATED - soil.poisson_ratio))))
        if self.rock_depth is not None and 'rock_depth' in place:
            shallow, deep = (1.0 / depth for depth in self.rock_depth)
            inverse = shallow + share('rock_depth') * (deep - shallow)
            if inverse > 0.0:
                ground = ground.on_rock(1.0 / inverse)
            elif ground.below is None:
                ground = LayeredSoil(ground.layers[:-1], ground.layers[-1].soil)
        return ground, embedment

    @staticmethod
    def layer_of(name: str) -> int | None:
        """Return which layer an input is of, the uppermost 1; None of any other input."""
        found = _LAYER.fullmatch(name)
        return int(found[1]) if found else None

    def machine(self, model: CoupledModel, place: Place) -> CoupledModel:
        """Return a machine with rotor, bearings and blocks as they are at a place."""
        def scale(name: str) -> float:
            return self.scale(name, place)

        rotor, blocks = model.rotor, tuple(model.foundations)
        if (mass := scale('foundation_mass_factor')) != 1.0:
            blocks = tuple(_heavier(block, mass) for block in blocks)
        if (modulus := scale('foundation_stiffness_factor')) != 1.0:
            blocks = tuple(block if block.body is None else replace(
                block, body=block.body.stiffer(modulus)) for block in blocks)
        bearings = tuple(_other_bearing(
            bearing, stiffness=scale('bearing_stiffness_factor'),
            damping=scale('bearing_damping_factor'), pedestal=scale('pedestal_stiffness_factor'))
            for bearing in rotor.bearings)
        rotor = replace(rotor, bearings=bearings,
                        shaft_height=scale('shaft_height_factor') * rotor.shaft_height)
        rotor = _other_rotor(rotor, mass=scale('rotor_mass_factor'),
                             stiffness=scale('shaft_stiffness_factor'))
        return replace(model, rotor=rotor, foundations=blocks)


def _heavier(block: Foundation, factor: float) -> Foundation:
    x, y, z = block.inertia
    return replace(block, mass=factor * block.mass,
                   inertia=(factor * x, factor * y, factor * z),
                   body=None if block.body is None else block.body.heavier(factor))


def _other_bearing(
    bearing: Bearing, *, stiffness: float, damping: float, pedestal: float,
) -> Bearing:
    if stiffness != 1.0 or damping != 1.0:
        bearing = bearing.scaled(stiffness=stiffness, damping=damping)
    if pedestal == 1.0 or bearing.pedestal is None:
        return bearing
    own = bearing.pedestal
    # Its damping ratio is what is known of it: damping goes with the root of the stiffness.
    return replace(bearing, pedestal=replace(
        own, stiffness=pedestal * own.stiffness, damping=pedestal**0.5 * own.damping))


def _other_rotor(rotor: Rotor, *, mass: float, stiffness: float) -> Rotor:
    if mass != 1.0:
        rotor = replace(rotor, discs=tuple(replace(
            disc, mass=mass * disc.mass, polar_inertia=mass * disc.polar_inertia,
            diametral_inertia=mass * disc.diametral_inertia) for disc in rotor.discs))
    if stiffness != 1.0:
        rotor = replace(rotor, shaft=tuple(_stiffer(section, stiffness)
                                           for section in rotor.shaft))
    return rotor


def _stiffer(section: ShaftSection, factor: float) -> ShaftSection:
    material = section.material
    return replace(section, material=replace(
        material, young_modulus=factor * material.young_modulus))

