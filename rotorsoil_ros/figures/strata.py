"""The ground beside and below the blocks of a drawing: layers, rock, water, free walls."""

from itertools import pairwise

from matplotlib.axes import Axes
from matplotlib.patches import Rectangle as Box

from rotorsoil_ros.case.config import Case
from rotorsoil_ros.ground.soil import extents
from rotorsoil_ros.machine.foundation import Foundation

SOIL, ROCK = '#c8ad7f', '#8f8f8f'
# Layers are told apart by their shade.
_LAYERS = (SOIL, '#b39468', '#d8c39c', '#a88b62')
# Of the height of the machine, that the ground below it may take; of a block, the gap beside it.
_DEEPEST = 1.2
_LEVEL = '#0072b2'
_GAP = 0.06


def drawn_depth(case: Case, top: float) -> float:
    """Return how much of what lies below the contact is drawn [m]: layers, rock that may be."""
    layers = 0.0 if case.ground is None else case.ground.depth
    shallowest = (case.uncertainty.rock_depth or (0.0,))[0]
    if not layers and not shallowest:
        return 0.1 * top
    below = max(layers, shallowest) - _surface(case)
    return min(1.15 * below, _DEEPEST * top) if below > 0.0 else 0.3 * top


def _surface(case: Case) -> float:
    """Return the height of the ground above the contact of the first block [m]."""
    return case.embedments[0].depth if case.embedments else 0.0


def draw_ground(axes: Axes, case: Case, *, words: bool) -> None:
    """Draw layers from the surface down, and the hole of each block with what touches its wall."""
    left, right = axes.get_xlim()
    bottom, surface = axes.get_ylim()[0], _surface(case)
    layers = () if case.ground is None else case.ground.layers
    on_rock = case.support.model == 'rigid' or (
        case.ground is not None and case.ground.below is None)
    ends = [surface - depth for depth in (case.ground.interfaces if case.ground else ())]
    for index, (high, low) in enumerate(pairwise([surface, *ends, min(bottom, *ends, 0.0) - 1.0])):
        is_rock = on_rock and index == len(layers)
        axes.add_patch(Box(
            (left, max(low, bottom)), right - left, max(high - max(low, bottom), 0.0), zorder=0,
            linewidth=0.0, facecolor=ROCK if is_rock else _LAYERS[index % len(_LAYERS)],
            hatch='///' if is_rock else '...', edgecolor='white'))
        if layers and words and high > bottom:
            soil = None if is_rock else case.ground.soils[index] if case.ground else None
            axes.annotate(
                'rigid rock' if soil is None else f'c_s = {soil.shear_wave_speed:.0f} m/s',
                (left, 0.5 * (high + max(low, bottom))), xytext=(3, 0), va='center', fontsize=6.5,
                textcoords='offset points', zorder=1.5,
                bbox={'facecolor': 'white', 'alpha': 0.7, 'linewidth': 0.0, 'pad': 1.0})
    axes.axhline(surface, color='black', linewidth=0.8, zorder=0.5)
    for end in ends:
        axes.axhline(end, color='black', linewidth=0.6, linestyle=':', zorder=0.5)
    if surface:
        _draw_gaps(axes, case, across=not words)
    spread = case.uncertainty
    if spread.ground_water:
        _draw_level(axes, surface, 'ground water may stand here', words=words)
    if spread.rock_depth is not None and surface - spread.rock_depth[0] > bottom:
        _draw_level(axes, surface - spread.rock_depth[0], 'from here on there may be rock',
                    words=words)


def _draw_level(axes: Axes, height: float, text: str, *, words: bool) -> None:
    """Draw what is not known to be at a height, at the edge that layers leave free."""
    axes.axhline(height, color=_LEVEL, linewidth=1.2, linestyle='--', zorder=0.6)
    if words:
        axes.annotate(
            text, (axes.get_xlim()[1], height), xytext=(-3, -2), va='top', ha='right',
            fontsize=6.5, color=_LEVEL, textcoords='offset points', zorder=1.5,
            bbox={'facecolor': 'white', 'alpha': 0.7, 'linewidth': 0.0, 'pad': 1.0})


def _draw_gaps(axes: Axes, case: Case, *, across: bool) -> None:
    """Draw where the wall of a block stands free in the ground."""
    for block, embedment in zip(case.foundations, case.embedments, strict=True):
        first, last = sides(block, across=across)
        wide = _GAP * _half(block, across=across)
        for edge in (first - wide, last):
            axes.add_patch(Box((edge, embedment.depth - embedment.free_depth), wide,
                               embedment.free_depth, zorder=0.4, facecolor='white',
                               linewidth=0.0))


def sides(block: Foundation, *, across: bool) -> tuple[float, float]:
    """Return where a block begins and ends, across the shaft or along it [m]."""
    first, last = extents(block.contact)[0 if across else 1]
    centre = block.centre_x if across else block.centre_y
    return centre + first, centre + last


def _half(block: Foundation, *, across: bool) -> float:
    first, last = sides(block, across=across)
    return 0.5 * (last - first)
