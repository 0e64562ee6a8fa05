"""The machine of a case, drawn to scale from the side and from its end."""

import math
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle as Round, Polygon, Rectangle as Box
import numpy as np

from rotorsoil_ros.case.config import Case
from rotorsoil_ros.physics.foundation import Foundation
from rotorsoil_ros.physics.rotor import Bearing, Disc
from rotorsoil_ros.physics.soil import Circle

STEEL, DISC, CONCRETE, SOIL, PEDESTAL = '#7d98b3', '#d9a441', '#c9c9c4', '#c8ad7f', '#8a8a8a'

# The height of a block is in no case file: it takes this share of the shaft's height.
_BLOCK_SHARE = 0.45
_EDGE: dict[str, Any] = {'edgecolor': 'black', 'linewidth': 0.6}


def machine_drawing(case: Case) -> Figure:
    """Draw shaft, discs, bearings, blocks and ground of a case, side and end view."""
    left, right, reach, top = _extent(case)
    depth = 0.1 * top
    across, up = right - left + 2.0 * reach, top + depth
    figure = Figure(figsize=(7.5, min(max(1.5 + 6.2 * up / across, 2.6), 7.0)),
                    layout='constrained')
    # Widths in the ratio of the limits: then both views have one scale.
    side, end = figure.subplots(1, 2, width_ratios=[right - left, 2.0 * reach], sharey=True)
    side.set(xlim=(left, right), ylim=(-depth, top), xlabel='y along the shaft [m]',
             ylabel='z above the ground [m]')
    end.set(xlim=(-reach, reach), xlabel='x across [m]')
    _draw_side(side, case)
    _draw_end(end, case)
    for axes in (side, end):
        axes.set_aspect('equal')
        axes.locator_params(axis='x', nbins=6 if axes is side else 3)
        axes.spines[['top', 'right']].set_visible(False)
        _draw_ground(axes, rigid=case.support.model == 'rigid')
    note = '; block heights are not to scale' if case.foundations else ''
    figure.suptitle(f'{case.name}: {_support(case)}\ndrawn to scale{note}; discs as solid '
                    'cylinders of their mass and inertia', fontsize=9)
    return figure


def _extent(case: Case) -> tuple[float, float, float, float]:
    """Return the left and right end of the side view, half the end view, and the top [m]."""
    rotor = case.rotor
    radius = max([_cylinder(disc)[0] for disc in rotor.discs], default=0.0)
    top = rotor.shaft_height + radius
    ends, reach = [0.0, rotor.length], max(radius, 0.35 * rotor.shaft_height)
    for block in case.foundations:
        ends += [block.centre_y - _half_length(block), block.centre_y + _half_length(block)]
        reach = max(reach, _half_width(block))
    edge = 0.05 * (max(ends) - min(ends))
    return min(ends) - edge, max(ends) + edge, reach + edge, top + 3.0 * edge


def _support(case: Case) -> str:
    if case.support.model == 'table':
        return 'ground as its file says'
    if case.soil is None or case.support.model == 'rigid':
        return 'rigid ground'
    return (f'{case.support.model.replace("_", " ")} on soil of G = '
            f'{1e-6 * case.soil.shear_modulus:g} MPa, c_s = '
            f'{case.soil.shear_wave_speed:.0f} m/s')


def _draw_side(axes: Axes, case: Case) -> None:
    rotor, shaft = case.rotor, case.rotor.shaft_height
    for block in case.foundations:
        half = _half_length(block)
        axes.add_patch(Box((block.centre_y - half, 0.0), 2.0 * half, _top(case), zorder=1,
                           facecolor=CONCRETE, **_EDGE))
        axes.annotate(f'{block.name}\n{block.mass:g} kg', (block.centre_y, 0.5 * _top(case)),
                      ha='center', va='center', fontsize=7)
    spread = 0.03 * rotor.length
    for bearing in rotor.bearings:
        foot = _foot(case, bearing)
        axes.add_patch(Polygon(
            [(bearing.position - spread, foot), (bearing.position + spread, foot),
             (bearing.position, shaft)], zorder=2, facecolor=PEDESTAL, **_EDGE))
        axes.annotate(bearing.name, (bearing.position + spread, foot), xytext=(1, 3),
                      textcoords='offset points', fontsize=7)
    start = 0.0
    for section in rotor.shaft:
        (left, right), stop = section.outer_diameter, start + section.length
        axes.add_patch(Polygon(
            [(start, shaft - left / 2), (stop, shaft - right / 2), (stop, shaft + right / 2),
             (start, shaft + left / 2)], zorder=3, facecolor=STEEL, **_EDGE))
        start = stop
    for disc in rotor.discs:
        radius, thickness = _cylinder(disc)
        thickness = max(thickness, 0.008 * rotor.length)
        axes.add_patch(Box((disc.position - thickness / 2, shaft - radius), thickness,
                           2.0 * radius, zorder=4, facecolor=DISC, **_EDGE))
        _label(axes, f'{disc.name}\n{disc.mass:g} kg', disc.position, shaft + radius)
    for probe in rotor.probes:
        axes.plot(probe.position, shaft, 'v', color='crimson', markersize=5, zorder=5)
        _label(axes, probe.name, probe.position, shaft)


def _draw_end(axes: Axes, case: Case) -> None:
    shaft = case.rotor.shaft_height
    foot = min((_foot(case, bearing) for bearing in case.rotor.bearings), default=0.0)
    for block in case.foundations:
        half = _half_width(block)
        axes.add_patch(Box((-half, 0.0), 2.0 * half, _top(case), zorder=1,
                           facecolor=CONCRETE, **_EDGE))
    spread = 0.3 * (shaft - foot)
    axes.add_patch(Polygon([(-spread, foot), (spread, foot), (0.0, shaft)], zorder=2,
                           facecolor=PEDESTAL, **_EDGE))
    for disc in case.rotor.discs:
        axes.add_patch(Round((0.0, shaft), _cylinder(disc)[0], zorder=3, facecolor=DISC,
                             alpha=0.6, **_EDGE))
    diameter = max(max(section.outer_diameter) for section in case.rotor.shaft)
    axes.add_patch(Round((0.0, shaft), diameter / 2, zorder=4, facecolor=STEEL, **_EDGE))


def _draw_ground(axes: Axes, *, rigid: bool) -> None:
    left, right = axes.get_xlim()
    bottom = axes.get_ylim()[0]
    axes.add_patch(Box((left, bottom), right - left, -bottom, zorder=0, linewidth=0.0,
                       facecolor='#999999' if rigid else SOIL, hatch='///' if rigid else '...',
                       edgecolor='white'))
    axes.axhline(0.0, color='black', linewidth=0.8, zorder=1)


def _label(axes: Axes, text: str, along: float, height: float) -> None:
    axes.annotate(text, (along, height), xytext=(0, 4), fontsize=7, zorder=6,
                  textcoords='offset points', ha='center', va='bottom')


def _top(case: Case) -> float:
    return _BLOCK_SHARE * case.rotor.shaft_height


def _foot(case: Case, bearing: Bearing) -> float:
    return _top(case) if bearing.foundation is not None else 0.0


def _half_width(block: Foundation) -> float:
    contact = block.contact
    return contact.radius if isinstance(contact, Circle) else contact.half_width


def _half_length(block: Foundation) -> float:
    contact = block.contact
    return contact.radius if isinstance(contact, Circle) else contact.half_length


def _cylinder(disc: Disc) -> tuple[float, float]:
    """Return radius and thickness of the solid cylinder with the mass and inertia of a disc."""
    if not disc.mass > 0.0:
        return 0.0, 0.0
    square = 2.0 * disc.polar_inertia / disc.mass
    thickness = 12.0 * disc.diametral_inertia / disc.mass - 3.0 * square
    return math.sqrt(square), float(np.sqrt(max(thickness, 0.0)))
