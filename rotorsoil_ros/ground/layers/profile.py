"""Which layers the ground has from the surface down, and how deep a block stands in it."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
import math

from rotorsoil_ros.errors import require, RotorSoilError
from rotorsoil_ros.ground.soil import Soil

# Without damping a layer resonates without bound, and no soil has less.
LEAST_LOSS_FACTOR = 0.005

# Above this Poisson's ratio the displacement elements along the depth begin to lock.
LARGEST_LAYER_POISSON_RATIO = 0.499

# A thinner layer would need elements that are lost in the others' round-off [-], of the radius.
_THINNEST = 0.01


@dataclass(frozen=True, slots=True)
class Layer:
    """Layer of the ground: its thickness [m] and what it is made of."""

    thickness: float
    soil: Soil

    def __post_init__(self) -> None:
        require(0.0 < self.thickness < math.inf, 'thickness', '> 0 m and finite', self.thickness)


@dataclass(frozen=True, slots=True)
class LayeredSoil:
    """
    Horizontal layers on a half-space or on rigid rock.

    Attributes
    ----------
    layers : tuple of Layer
        From the surface down; none is a homogeneous half-space.
    below : Soil or None
        Half-space under them; None is rock that does not move, a bound.

    """

    layers: tuple[Layer, ...]
    below: Soil | None

    def __post_init__(self) -> None:
        if not self.layers and self.below is None:
            raise RotorSoilError('layers must be at least one above rigid rock, got none')
        for soil in self.soils:
            require(soil.loss_factor >= LEAST_LOSS_FACTOR, 'loss_factor',
                    f'>= {LEAST_LOSS_FACTOR:g} in layered or embedded ground: without it a layer '
                    'resonates without bound, and no soil has less', soil.loss_factor)
            require(soil.poisson_ratio <= LARGEST_LAYER_POISSON_RATIO, 'poisson_ratio',
                    f'<= {LARGEST_LAYER_POISSON_RATIO:g} in layered or embedded ground',
                    soil.poisson_ratio)

    @property
    def soils(self) -> tuple[Soil, ...]:
        """What the ground is made of, from the surface down."""
        own = tuple(layer.soil for layer in self.layers)
        return own if self.below is None else (*own, self.below)

    @property
    def interfaces(self) -> tuple[float, ...]:
        """Depth of the lower face of each layer [m]."""
        depths, depth = [], 0.0
        for layer in self.layers:
            depth += layer.thickness
            depths.append(depth)
        return tuple(depths)

    @property
    def depth(self) -> float:
        """Depth of rock or half-space [m]."""
        return sum(layer.thickness for layer in self.layers)

    def at(self, depth: float) -> Soil:
        """Return the soil just below a depth [m]; at the rock that above it."""
        for soil, interface in zip(self.soils, (*self.interfaces, math.inf), strict=False):
            if depth < interface:
                return soil
        return self.soils[-1]

    def changed(self, change: Callable[[Soil], Soil]) -> 'LayeredSoil':
        """Return the same layers, each of another soil."""
        return LayeredSoil(
            tuple(replace(layer, soil=change(layer.soil)) for layer in self.layers),
            None if self.below is None else change(self.below))

    def stiffened(self, factors: Sequence[float]) -> 'LayeredSoil':
        """Return the same layers, the modulus of each of `soils` times a factor of its own."""
        factor = iter(factors)
        return self.changed(lambda soil: replace(
            soil, shear_modulus=next(factor) * soil.shear_modulus))

    def on_rock(self, depth: float) -> 'LayeredSoil':
        """
        Return what lies above rigid rock at a depth [m].

        What the ground has below is gone; the last soil reaches down to it if it is deeper.
        """
        kept: list[Layer] = []
        above = 0.0
        for soil, interface in zip(self.soils, (*self.interfaces, math.inf), strict=False):
            end = min(interface, depth)
            if end > above:
                kept.append(Layer(end - above, soil))
            above = end
        if above < depth:
            kept[-1] = Layer(kept[-1].thickness + depth - above, kept[-1].soil)
        return LayeredSoil(tuple(kept), None)


@dataclass(frozen=True, slots=True)
class Embedment:
    """
    How a block stands in the ground.

    Attributes
    ----------
    depth : float
        Of its base below the surface [m].
    side_contact : float
        Share of the wall that is welded to the soil, from the base up; the rest stands free, as
        beside a gap or loose backfill.

    """

    depth: float = 0.0
    side_contact: float = 1.0

    def __post_init__(self) -> None:
        require(0.0 <= self.depth < math.inf, 'embedment', '>= 0 m and finite', self.depth)
        require(0.0 <= self.side_contact <= 1.0, 'side_contact',
                'in [0, 1], the share of the embedment that is welded', self.side_contact)
        if self.depth == 0.0 and self.side_contact != 1.0:
            raise RotorSoilError('side_contact must stand beside an embedment > 0 m: a block on '
                                 'the surface has no wall in the ground, got '
                                 f'{self.side_contact:g}')

    @property
    def free_depth(self) -> float:
        """Depth down to which the wall stands free [m]."""
        return self.depth * (1.0 - self.side_contact)


SURFACE = Embedment()


def require_lossy(soil: Soil) -> None:
    """Raise a RotorSoilError if a layer of this soil would resonate without bound, or lock."""
    require(soil.loss_factor >= LEAST_LOSS_FACTOR, 'loss_factor',
            f'>= {LEAST_LOSS_FACTOR:g} in layered or embedded ground: without it a layer '
            'resonates without bound, and no soil has less', soil.loss_factor)
    require(soil.poisson_ratio <= LARGEST_LAYER_POISSON_RATIO, 'poisson_ratio',
            f'<= {LARGEST_LAYER_POISSON_RATIO:g} in layered or embedded ground',
            soil.poisson_ratio)


def require_room(ground: LayeredSoil, embedment: Embedment) -> None:
    """Raise a RotorSoilError if a block would stand in rigid rock, or on hardly any soil."""
    if ground.below is None:
        require(embedment.depth < ground.depth, 'embedment',
                f'< {ground.depth:g} m, where the rock begins', embedment.depth)


def require_thickness(ground: LayeredSoil, radius: float) -> None:
    """Raise a RotorSoilError if a layer is thinner than can be told from none [m]."""
    for layer in ground.layers:
        require(layer.thickness >= _THINNEST * radius, 'thickness',
                f'>= {_THINNEST:g} of the radius of the contact, {_THINNEST * radius:.3g} m',
                layer.thickness)
