"""What can be said of the ground of a case: its layers, the error of its model, its band."""

from collections.abc import Iterator
import math

from rotorsoil_ros.case.config import Case
from rotorsoil_ros.case.design.inputs import INPUTS
from rotorsoil_ros.case.entries.ground import THIN_LAYERS
from rotorsoil_ros.ground.accuracy import CONE_ERROR, mapping_error, side_ratio
from rotorsoil_ros.ground.elements.table import LARGEST_POISSON_RATIO
from rotorsoil_ros.ground.soil import Rectangle
from rotorsoil_ros.machine.foundation import Foundation

# Supports that take a rectangle as discs.
_BY_DISCS = ('cone', 'infinite_elements', THIN_LAYERS)

# Told together, as G, nu and eta of the soil.
_SOIL = ('shear_modulus_factor', 'poisson_ratio', 'loss_factor')


def layers_told(case: Case) -> Iterator[tuple[str, str]]:
    """Yield what each layer is, from the surface down, and how blocks stand in them."""
    if case.ground is None:
        return
    top = 0.0
    for number, (layer, bottom) in enumerate(zip(
            case.ground.layers, case.ground.interfaces, strict=True), 1):
        yield f'layer {number}', (f'{top:.4g} to {bottom:.4g} m, c_s = '
                                  f'{layer.soil.shear_wave_speed:.4g} m/s')
        top = bottom
    if case.ground.layers:
        below = case.ground.below
        yield 'below', f'from {top:.4g} m, ' + (
            'rigid rock, a bound' if below is None else
            f'half-space, c_s = {below.shear_wave_speed:.4g} m/s')
    for foundation, embedment in zip(case.foundations, case.embedments, strict=True):
        if embedment.depth:
            yield f'{foundation.name}: base', (
                f'{embedment.depth:.4g} m below the surface, {embedment.side_contact:.0%} of the '
                'wall welded; its mass is all that counts, not that of the soil it displaces')


def model_error(case: Case, foundation: Foundation) -> str:
    """Return how far the model of the ground under a block may be off; empty if it has none."""
    if case.support.model not in _BY_DISCS or case.support.geometry != 'disc':
        return ''
    parts = []
    if case.support.model == 'cone':
        parts.append(f'cones under a disc: stiffness within {CONE_ERROR:.0%}')
    if isinstance(foundation.contact, Rectangle):
        share, ratio = mapping_error(foundation.contact), side_ratio(foundation.contact)
        off = f'up to {share:.0%}' if share < math.inf else 'more than 37%'
        parts.append(f'discs for a rectangle of {ratio:.3g} to 1: stiffness off by {off}')
    if case.support.model == THIN_LAYERS:
        parts.insert(0, 'thin layers under a disc: within 0.1%')
    return '; '.join(parts) or 'infinite elements of a disc: within 0.5%'


def band_contents(case: Case) -> str:
    """Return what the edges of the band of a case hold; empty if it has none."""
    spread, knows_soil = case.uncertainty, (
        case.soil is not None and case.support.model in _BY_DISCS)
    parts = [f'{INPUTS[name].words} ({_extent(getattr(spread, name))})'
             for name in spread.inputs(with_soil=knows_soil) if name not in _SOIL]
    if case.soil is None or not knows_soil:
        return '; '.join(parts)
    parts.insert(0, f'soil (G within a factor {spread.shear_modulus_factor:g}, nu within '
                    f'{spread.poisson_ratio:g}, eta within {spread.loss_factor:g})')
    if not spread.model_form or case.support.geometry != 'disc':
        return '; '.join([*parts, 'not the error of the models'])
    if case.support.model == 'cone':
        known = case.soil.poisson_ratio <= LARGEST_POISSON_RATIO
        parts.append('cones against infinite elements' if known else
                     'not cones against infinite elements, which end at nu = '
                     f'{LARGEST_POISSON_RATIO:g}')
    if any(isinstance(block.contact, Rectangle) for block in case.foundations):
        parts.append('discs against rectangles')
    return '; '.join(parts)


def _extent(spread: object) -> str:
    """Return how far an input may be from what the case says."""
    if isinstance(spread, tuple):
        return f'{spread[0]:g} to {spread[1]:g}'
    return 'none to the surface' if spread is True else f'within a factor {spread:g}'
