"""The machine of a case, drawn to scale from the side and from its end."""

from dataclasses import replace
from itertools import pairwise
import math
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle as Round, Polygon, Rectangle as Box
import numpy as np

from rotorsoil_ros.case.config import Case
from rotorsoil_ros.ground.soil import extents
from rotorsoil_ros.machine.foundation import Foundation
from rotorsoil_ros.rotor.bearing import Bearing
from rotorsoil_ros.rotor.disc import Disc

STEEL, DISC, CONCRETE, SOIL = '#7d98b3', '#d9a441', '#c9c9c4', '#c8ad7f'
ROCK = '#8f8f8f'
HOUSING, STAND, SPRING = '#5b6770', '#a9a9a9', '#b03a2e'

# A housing is drawn so many times as high and wide as the shaft in it, but not smaller than this
# share of the shaft's height.
_HOUSING = 1.9
_LEAST_HOUSING = 0.09
# Labels of discs closer than this share of the view would touch.
_CLOSE = 0.16
# Points between a disc and its label, and where another label is in between.
_BESIDE, _ABOVE = 4, 26
# Windings of a pedestal's spring.
_WINDINGS = 4
# A narrower picture has room for names only [inch].
_SMALL = 5.0
_EDGE: dict[str, Any] = {'edgecolor': 'black', 'linewidth': 0.6}
_MEGA = 1e-6
# Layers are told apart by their shade.
_LAYERS = (SOIL, '#b39468', '#d8c39c', '#a88b62')
# Of the height of the machine, that the ground below it may take; of a block, the gap beside it.
_DEEPEST = 1.2
_LEVEL = '#0072b2'
_GAP = 0.06


def machine_drawing(case: Case, *, width: float = 7.5) -> Figure:
    """Draw shaft, discs, bearings, blocks and ground of a case, in a width in inches."""
    beside = ''
    if case.berth is not None:
        beside = ', its neighbours left out' + (
            ', blocks not turned' if case.berth.is_turned else '')
        case = replace(case, foundations=case.berth.seen(case.foundations))
    left, right, reach, top = _extent(case)
    # Room for the labels of discs above, and of bearings to the right.
    depth = _drawn_depth(case, top)
    across, up = right - left + 2.0 * reach, top + depth
    height = min(max(0.25 * width + 0.83 * width * up / across, 0.39 * width), 7.4)
    figure = Figure(figsize=(width, height),
                    layout='constrained')
    # Widths in the ratio of the limits: then both views have one scale.
    side, end = figure.subplots(1, 2, width_ratios=[right - left, 2.0 * reach], sharey=True)
    side.set(xlim=(left, right), ylim=(-depth, top), xlabel='y along the shaft [m]',
             ylabel='z above the contact [m]' if any(
                 one.depth for one in case.embedments) else 'z above the ground [m]')
    end.set(xlim=(-reach, reach), xlabel='x across [m]')
    _draw_side(side, case, in_full=width > _SMALL)
    _draw_end(end, case)
    for axes in (side, end):
        axes.set_aspect('equal')
        axes.locator_params(axis='x', nbins=6 if axes is side else 3)
        axes.spines[['top', 'right']].set_visible(False)
        _draw_ground(axes, case, words=axes is side)
    if width <= _SMALL:
        return figure
    given = all(block.height is not None for block in case.foundations)
    note = '' if given else ', heights of blocks after their centre of gravity'
    figure.suptitle(f'{case.name}: {_support(case)}\nto scale, discs as solid cylinders of their '
                    f'mass and inertia{note}{beside};\nbearings and pedestals schematic',
                    fontsize=9)
    return figure


def _extent(case: Case) -> tuple[float, float, float, float]:
    """Return the left and right end of the side view, half the end view, and the top [m]."""
    rotor = case.rotor
    radius = max([_cylinder(disc)[0] for disc in rotor.discs], default=0.0)
    top = rotor.shaft_height + radius
    ends, reach = [0.0, rotor.length], max(radius, 0.35 * rotor.shaft_height)
    for block in case.foundations:
        ends += _sides(block, across=False)
        reach = max(reach, *(abs(side) for side in _sides(block, across=True)))
    edge = 0.05 * (max(ends) - min(ends))
    return min(ends) - edge, max(ends) + edge, reach + edge, top + 3.0 * edge


def _support(case: Case) -> str:
    if case.support.model == 'table':
        return 'ground as its file says'
    if case.soil is None or case.support.model == 'rigid':
        return 'rigid ground'
    if case.ground is not None and case.ground.layers:
        count = len(case.ground.layers)
        return (f'{count} layer{"s" * (count > 1)} on '
                + ('rigid rock' if case.ground.below is None else 'a half-space'))
    return (f'{case.support.model.replace("_", " ")} on soil of G = '
            f'{1e-6 * case.soil.shear_modulus:g} MPa, c_s = '
            f'{case.soil.shear_wave_speed:.0f} m/s')


def _draw_side(axes: Axes, case: Case, *, in_full: bool) -> None:
    rotor, shaft = case.rotor, case.rotor.shaft_height
    for block in case.foundations:
        (first, last), height = _sides(block, across=False), block.drawn_height
        axes.add_patch(Box((first, 0.0), last - first, height, zorder=1,
                           facecolor=CONCRETE, **_EDGE))
        left, right = _sides(block, across=True)
        if not left < 0.0 < right:
            continue  # beside the shaft, behind the others: the view along it has its name
        axes.annotate(f'{block.name}, {block.mass:g} kg', (0.5 * (first + last), 0.5 * height),
                      ha='center', va='center', fontsize=7)
    for bearing in rotor.bearings:
        size = _housing_size(case, bearing)
        foot = _foot(case, bearing)
        _draw_support(axes, bearing, bearing.position, width=size, foot=foot, shaft=shaft,
                      size=size)
        # At the foot: clear of the discs above and of the block's name.
        words = _words(bearing) if in_full else bearing.name
        axes.annotate(words, (bearing.position + 0.5 * size, foot), xytext=(3, 4),
                      textcoords='offset points', fontsize=6.5, va='bottom', zorder=7)
    _draw_shaft(axes, case)
    _draw_discs(axes, case)
    for probe in rotor.probes:
        axes.plot(probe.position, shaft, 'v', color='crimson', markersize=5, zorder=5)
        _label(axes, probe.name, probe.position, shaft, points=_BESIDE)


def _draw_shaft(axes: Axes, case: Case) -> None:
    start, shaft = 0.0, case.rotor.shaft_height
    for section in case.rotor.shaft:
        (left, right), stop = section.outer_diameter, start + section.length
        axes.add_patch(Polygon(
            [(start, shaft - left / 2), (stop, shaft - right / 2), (stop, shaft + right / 2),
             (start, shaft + left / 2)], zorder=3, facecolor=STEEL, **_EDGE))
        start = stop


def _draw_discs(axes: Axes, case: Case) -> None:
    rotor, shaft = case.rotor, case.rotor.shaft_height
    left, right = axes.get_xlim()
    before, raised, close = None, False, _CLOSE * (right - left)
    for disc in sorted(rotor.discs, key=lambda disc: disc.position):
        radius, thickness = _cylinder(disc)
        thickness = max(thickness, 0.008 * rotor.length)
        axes.add_patch(Box((disc.position - thickness / 2, shaft - radius), thickness,
                           2.0 * radius, zorder=4, facecolor=DISC, **_EDGE))
        # Of two close ones the second says it higher up.
        raised = before is not None and not raised and disc.position - before < close
        _label(axes, f'{disc.name}\n{disc.mass:.4g} kg', disc.position, shaft + radius,
               points=_ABOVE if raised else _BESIDE)
        before = disc.position


def _draw_end(axes: Axes, case: Case) -> None:
    shaft = case.rotor.shaft_height
    for block in case.foundations:
        left, right = _sides(block, across=True)
        axes.add_patch(Box((left, 0.0), right - left, block.drawn_height, zorder=1,
                           facecolor=CONCRETE, **_EDGE))
        if not left < 0.0 < right:
            axes.annotate(block.name, (0.5 * (left + right), 0.5 * block.drawn_height),
                          ha='center', va='center', fontsize=7)
    # One behind the other: the one that shows most stands for all.
    flexible = [bearing for bearing in case.rotor.bearings if bearing.pedestal is not None]
    for bearing in (flexible or list(case.rotor.bearings))[:1]:
        size, foot = _housing_size(case, bearing), _foot(case, bearing)
        _draw_support(axes, bearing, 0.0, width=max(size, 0.5 * (shaft - foot)), foot=foot,
                      shaft=shaft, size=size)
    for disc in case.rotor.discs:
        axes.add_patch(Round((0.0, shaft), _cylinder(disc)[0], zorder=3, facecolor=DISC,
                             alpha=0.5, **_EDGE))
    diameter = max(max(section.outer_diameter) for section in case.rotor.shaft)
    axes.add_patch(Round((0.0, shaft), diameter / 2, zorder=4, facecolor=STEEL, **_EDGE))


def _draw_support(
    axes: Axes, bearing: Bearing, centre: float, *, width: float, foot: float, shaft: float,
    size: float,
) -> None:
    """Draw a housing about the shaft on a stand, or on a spring and a dashpot beside it."""
    under = shaft - 0.5 * size
    axes.add_patch(Box((centre - 0.5 * size, under), size, size, zorder=2.5, facecolor=HOUSING,
                       **_EDGE))
    if bearing.pedestal is None:
        axes.add_patch(Polygon(
            [(centre - 0.5 * width, foot), (centre + 0.5 * width, foot),
             (centre + 0.3 * size, under), (centre - 0.3 * size, under)], zorder=2,
            facecolor=STAND, **_EDGE))
        return
    plate = 0.06 * (under - foot)
    axes.add_patch(Box((centre - 0.5 * width, foot), width, plate, zorder=2, facecolor=HOUSING,
                       **_EDGE))
    line: dict[str, Any] = {'color': SPRING, 'linewidth': 1.3, 'zorder': 2.2}
    # A zigzag between two straight ends on the left, a piston in its cylinder on the right.
    height = under - foot - plate
    share = np.concatenate([[0.0], np.linspace(0.15, 0.85, 2 * _WINDINGS + 1), [1.0]])
    swing = np.concatenate([[0.0, 0.0], np.tile([1.0, -1.0], _WINDINGS)[:-1], [0.0, 0.0, 0.0]])
    axes.plot(centre - 0.25 * size + 0.16 * size * swing[:len(share)],
              foot + plate + share * height, **line)
    right, low, high = centre + 0.27 * size, foot + plate + 0.3 * height, foot + plate + (
        0.7 * height)
    axes.plot([right, right], [foot + plate, low], **line)
    axes.plot([right - 0.13 * size] * 2 + [right + 0.13 * size] * 2, [high, low, low, high],
              **line)
    axes.plot([right, right], [0.5 * (low + high), under], **line)
    axes.plot([right - 0.1 * size, right + 0.1 * size], [0.5 * (low + high)] * 2, **line)


def _words(bearing: Bearing) -> str:
    """Return the name of a bearing and what is known of its pedestal."""
    pedestal = bearing.pedestal
    if pedestal is None:
        return bearing.name
    (x, z), (across, up) = np.diag(pedestal.mass), np.diag(pedestal.stiffness)
    mass = f'{x:.3g} kg' if x == z else f'{x:.3g} (x), {z:.3g} kg (z)'
    return (f'{bearing.name}\npedestal: {mass}\n{_MEGA * across:.3g} (x), {_MEGA * up:.3g} (z) '
            'N/um')


def _housing_size(case: Case, bearing: Bearing) -> float:
    """Return height and width of a housing [m]."""
    ends = np.cumsum([0.0, *(section.length for section in case.rotor.shaft)])
    index = int(np.clip(np.searchsorted(ends, bearing.position) - 1, 0, len(ends) - 2))
    diameter = max(case.rotor.shaft[index].outer_diameter)
    return max(_HOUSING * diameter, _LEAST_HOUSING * case.rotor.shaft_height)


def _drawn_depth(case: Case, top: float) -> float:
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


def _draw_ground(axes: Axes, case: Case, *, words: bool) -> None:
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
        first, last = _sides(block, across=across)
        wide = _GAP * _half(block, across=across)
        for edge in (first - wide, last):
            axes.add_patch(Box((edge, embedment.depth - embedment.free_depth), wide,
                               embedment.free_depth, zorder=0.4, facecolor='white',
                               linewidth=0.0))


def _label(axes: Axes, text: str, along: float, height: float, *, points: int) -> None:
    leader = {'arrowstyle': '-', 'linewidth': 0.5} if points > _BESIDE else None
    axes.annotate(text, (along, height), xytext=(0, points), fontsize=7, zorder=6,
                  arrowprops=leader,
                  textcoords='offset points', ha='center', va='bottom')


def _foot(case: Case, bearing: Bearing) -> float:
    """Return the height of what a bearing stands on [m]."""
    return next((block.drawn_height for block in case.foundations
                 if block.name == bearing.foundation), 0.0)


def _sides(block: Foundation, *, across: bool) -> tuple[float, float]:
    """Return where a block begins and ends, across the shaft or along it [m]."""
    first, last = extents(block.contact)[0 if across else 1]
    centre = block.centre_x if across else block.centre_y
    return centre + first, centre + last


def _half(block: Foundation, *, across: bool) -> float:
    first, last = _sides(block, across=across)
    return 0.5 * (last - first)


def _cylinder(disc: Disc) -> tuple[float, float]:
    """Return radius and thickness of the solid cylinder with the mass and inertia of a disc."""
    if not disc.mass > 0.0:
        return 0.0, 0.0
    square = 2.0 * disc.polar_inertia / disc.mass
    thickness = 12.0 * disc.diametral_inertia / disc.mass - 3.0 * square
    return math.sqrt(square), float(np.sqrt(max(thickness, 0.0)))
