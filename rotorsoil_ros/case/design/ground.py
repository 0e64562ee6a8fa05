"""What can be said of the ground of a case: its layers, the error of its model, its band."""

from collections.abc import Iterator, Sequence

import numpy as np

from rotorsoil_ros.case.config import Case
from rotorsoil_ros.case.design.inputs import input_of, key_of
from rotorsoil_ros.case.entries.ground import THIN_LAYERS
from rotorsoil_ros.case.entries.site import BOUNDARY_ELEMENTS
from rotorsoil_ros.case.flexible.words import bed_error
from rotorsoil_ros.channel import DOFS
from rotorsoil_ros.ground.accuracy import CONE_ERROR, gap, neglected_coupling, ShapeError
from rotorsoil_ros.ground.boundary.effort import HIGHEST_POISSON_RATIO
from rotorsoil_ros.ground.boundary.model import SiteGround
from rotorsoil_ros.ground.elements.table import LARGEST_POISSON_RATIO
from rotorsoil_ros.ground.plan import Plan
from rotorsoil_ros.ground.soil import Circle, Contact, extents, SoilModel
from rotorsoil_ros.machine.foundation import Foundation
from rotorsoil_ros.units import rad_s_to_hz

# Supports that take a rectangle as discs.
_BY_DISCS = ('cone', 'infinite_elements', THIN_LAYERS)

# Beyond these, length over width and share of a compliance, it is worth a warning that discs stand
# for a contact.
_LARGEST_ASPECT = 2.0
_LARGEST_SHARE = 0.2

# Told together, as G, nu and eta of the soil.
_SOIL = ('shear_modulus_factor', 'poisson_ratio', 'loss_factor')


def layers_told(case: Case) -> Iterator[tuple[str, str]]:
    """Yield what each layer is, from the surface down, and how blocks stand in them."""
    top, layers = 0.0, () if case.ground is None else case.ground.layers
    for number, layer in enumerate(layers, 1):
        bottom = top + layer.thickness
        yield f'layer {number}', (f'{top:.4g} to {bottom:.4g} m, c_s = '
                                  f'{layer.soil.shear_wave_speed:.4g} m/s')
        top = bottom
    if case.ground is not None and layers:
        below = case.ground.below
        yield 'below', f'from {top:.4g} m, ' + (
            'rigid rock, a bound' if below is None else
            f'half-space, c_s = {below.shear_wave_speed:.4g} m/s')
    for foundation, embedment in zip(case.foundations, case.embedments, strict=True):
        if embedment.depth:
            yield f'{foundation.name}: base', (
                f'{embedment.depth:.4g} m below the surface, {embedment.side_contact:.0%} of the '
                'wall welded; its mass is all that counts, not that of the soil it displaces')


def model_error(case: Case, foundation: Foundation, shape: ShapeError | None) -> str:
    """
    Return how far the model of the ground under a block is off; empty if it has no error.

    Parameters
    ----------
    case, foundation
        The machine and one of its blocks.
    shape : ShapeError or None
        How far it is from the shape of the block over the speed range, where that is known.

    """
    support, contact = case.support.model, foundation.contact
    if foundation.on is not None:
        return ''
    if bed := bed_error(foundation):
        return bed
    if support == BOUNDARY_ELEMENTS:
        alone = len(case.foundations) == 1 and not isinstance(contact, Plan)
        where = '' if case.ground is None else ' on these layers'
        return f'boundary elements of this plan{where}: within {0.6 if alone else 1.0:g}%'
    if support not in _BY_DISCS or case.support.geometry != 'disc':
        return ''
    parts = ['thin layers under a disc: within 0.1%'] if support == THIN_LAYERS else []
    if isinstance(contact, Circle) and support == 'infinite_elements':
        parts.append('infinite elements of a disc: within 0.5%')
    elif not isinstance(contact, Circle) or support == 'cone':
        what = f'{"cones under discs" if support == "cone" else "discs"} for {_shape(contact)}'
        if support == 'cone' and is_embedded(case, foundation):
            parts.append(_of_stack(contact, shape))
        elif shape is None:
            known = f'within {CONE_ERROR:.0%}' if isinstance(contact, Circle) else (
                'not known, where boundary elements do not reach')
            parts.append(f'{what}: {known}')
        else:
            where = ' on a half-space of the soil below it' if is_embedded(
                case, foundation) else ''
            parts.append(
                f'{what}{where}: {_off(shape)}, against '
                f'{"infinite" if isinstance(contact, Circle) else "boundary"} elements')
    return '; '.join(parts)


def _off(shape: ShapeError) -> str:
    return (f'compliance off by up to {shape.share:.0%} over the speed range '
            f'({shape.dof} at {rad_s_to_hz(shape.omega):.3g} Hz)')


def _of_stack(contact: Contact, shape: ShapeError | None) -> str:
    """Return how far a stack of cones is from thin layers under the same discs."""
    told = 'not known, where thin layers do not reach' if shape is None else (
        f'{_off(shape)}, against thin layers')
    if not isinstance(contact, Circle):
        told += f'; that discs stand for {_shape(contact)} comes on top'
    return f'stack of cones: {told}'


def is_embedded(case: Case, foundation: Foundation) -> bool:
    """Return whether a block stands in the ground."""
    return any(block.name == foundation.name and embedment.depth > 0.0
               for block, embedment in zip(case.foundations, case.embedments, strict=True))


def _shape(contact: Contact) -> str:
    match contact:
        case Circle():
            return 'a circle'
        case Plan(parts=parts):
            return f'a plan of {len(parts)} parts'
    return f'a rectangle of {_side_ratio(contact):.3g} to 1'


def _side_ratio(contact: Contact) -> float:
    sides = [last - first for first, last in extents(contact)]
    return max(sides) / min(sides)


def of_shapes(case: Case, shapes: Sequence[ShapeError | None]) -> Iterator[str]:
    """Yield which blocks are poorly served by the discs that stand for them, and by how much."""
    for block, shape in zip(case.foundations, shapes, strict=False):
        ratio = _side_ratio(block.contact)
        if shape is not None and (ratio > _LARGEST_ASPECT or shape.share > _LARGEST_SHARE):
            yield (f'{block.name}: contact is {ratio:.3g} times as long as wide; '
                   f'{model_error(case, block, shape)}; ' + (
                       'no model here knows the shape of a block in the ground' if is_embedded(
                           case, block) else
                       f'support.model {BOUNDARY_ELEMENTS} takes it as it is'))


def of_site(case: Case, soil_models: Sequence[SoilModel]) -> Iterator[tuple[str, str]]:
    """Yield how much blocks on one ground move each other, and where probes on it are."""
    if not (len(soil_models) == 1 and isinstance(soil_models[0], SiteGround)):
        return
    found = np.abs(soil_models[0].compliance(np.array([case.speed_range[1]]))[0])
    own = np.sqrt(np.diagonal(found))
    share = found / np.outer(own, own)
    grounded = [block for block in case.foundations if block.on is None]
    for second, other in enumerate(grounded):
        for first, block in enumerate(grounded[:second]):
            between = share[6 * first:6 * first + 6, 6 * second:6 * second + 6]
            row, column = np.unravel_index(between.argmax(), between.shape)
            yield f'{block.name} and {other.name}: coupled through the ground', (
                f'up to {between.max():.0%} of their own motion ({block.name} {DOFS[row]} by '
                f'{other.name} {DOFS[column]}) at full speed')
    for probe in case.ground_probes:
        yield f'{probe.name}: on the ground', f'x {probe.x:g} m, y {probe.y:g} m'


def of_neighbours(case: Case) -> Iterator[str]:
    """Yield which blocks are coupled through a soil that takes each as alone."""
    if case.support.model in ('rigid', BOUNDARY_ELEMENTS):
        return
    for second, block in enumerate(case.foundations):
        for other in case.foundations[:second]:
            if block.on is not None or other.on is not None:
                continue
            apart = other.centre_x - block.centre_x, other.centre_y - block.centre_y
            coupling, change = neglected_coupling(block.contact, other.contact, apart=apart)
            clear = gap(block.contact, other.contact, apart=apart)
            yield (f'{block.name}: stands {max(clear, 0.0):.3g} m beside {other.name}; each is '
                   'taken as alone on the ground: a load on one moves the other by up to '
                   f'{coupling:.0%} of its own motion, and its own changes by up to {change:.0%} '
                   '(two squares on a half-space); ' + (
                       'no model here couples blocks in the ground' if is_embedded(
                           case, block) or is_embedded(case, other) else
                       f'support.model {BOUNDARY_ELEMENTS} couples them'))


def band_contents(case: Case) -> str:
    """Return what the edges of the band of a case hold; empty if it has none."""
    spread, knows_soil = case.uncertainty, (
        case.soil is not None and case.support.model in (*_BY_DISCS, BOUNDARY_ELEMENTS))
    parts = [f'{input_of(name).words} ({_extent(getattr(spread, key_of(name)))})'
             for name in spread.inputs(with_soil=knows_soil) if name not in _SOIL]
    if case.berth is not None and any(case.berth.fastest):
        parts.append('neighbours that stand or run their fastest')
    if case.soil is None or not knows_soil:
        return '; '.join(parts)
    parts.insert(0, f'soil (G within a factor {spread.shear_modulus_factor:g}, nu within '
                    f'{spread.poisson_ratio:g}, eta within {spread.loss_factor:g})')
    if not spread.model_form or case.support.geometry != 'disc':
        return '; '.join([*parts, 'not the error of the models'])
    parts.append(_other_forms_of(case))
    return '; '.join(filter(None, parts))


def _other_forms_of(case: Case) -> str:
    """Return which ground the band holds beside that of the case."""
    if any(block.body is not None for block in case.foundations):
        return 'not the error of the ground below patches'
    if any(block.on is not None for block in case.foundations):
        return 'not the error of the models'
    if case.support.model not in ('cone', 'infinite_elements') or case.soil is None:
        return ''
    if any(embedment.depth for embedment in case.embedments):
        return 'cones against thin layers'
    if not any(isinstance(block.contact, Circle) for block in case.foundations):
        return ('discs against boundary elements, blocks coupled'
                if case.soil.poisson_ratio <= HIGHEST_POISSON_RATIO else
                'not discs against boundary elements, which end at nu = '
                f'{HIGHEST_POISSON_RATIO:g}')
    if case.support.model == 'cone':
        return ('cones against infinite elements'
                if case.soil.poisson_ratio <= LARGEST_POISSON_RATIO else
                'not cones against infinite elements, which end at nu = '
                f'{LARGEST_POISSON_RATIO:g}')
    return ''


def _extent(spread: object) -> str:
    """Return how far an input may be from what the case says."""
    if isinstance(spread, tuple):
        return f'{spread[0]:g} to {spread[1]:g}'
    return 'none to the surface' if spread is True else f'within a factor {spread:g}'
