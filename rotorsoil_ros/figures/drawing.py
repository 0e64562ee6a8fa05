"""The machine of a case, drawn to scale from the side and from its end."""

from dataclasses import replace
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle as Round, Polygon, Rectangle as Box
import numpy as np

from rotorsoil_ros.case.config import Case
from rotorsoil_ros.case.entries.support_file import FILED
from rotorsoil_ros.case.plant.berth import mounts
from rotorsoil_ros.figures.site import draw_plan, frame
from rotorsoil_ros.figures.strata import draw_ground, drawn_depth, sides
from rotorsoil_ros.machine.flexible.lattice import Lattice
from rotorsoil_ros.rotor.bearing import Bearing

STEEL, DISC, CONCRETE, _FRAME = '#7d98b3', '#d9a441', '#c9c9c4', '#8a8a85'
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


def machine_drawing(case: Case, *, width: float = 7.5) -> Figure:
    """
    Draw shaft, discs, bearings, blocks and ground of a case, in a width in inches.

    Beside the view from the side is that along the shaft; of a shaft that stands and of machines
    of a plant it is a plan, in a scale of its own.
    """
    site, has_plan = case, case.berth is not None or case.rotor.is_upright
    if case.berth is not None:
        case = replace(case, foundations=case.berth.seen(case.foundations))
    left, right, reach, top = _extent(case)
    depth = drawn_depth(case, top)
    # Room for the labels of discs above, and of bearings to the right.
    room, wide, tall = 0.25 * width, right - left, top + depth
    if has_plan:
        first, last, near, far = frame(site)
        shape = max(tall / wide, (far - near) / (last - first))
        ratios = [1.0, 1.0]
        drawn = 0.42 * width * shape
    else:
        # Widths in the ratio of the limits: then both views have one scale.
        ratios = [wide, 2.0 * reach]
        drawn = 0.83 * width * tall / sum(ratios)
    height = min(max(room + drawn, 0.39 * width), 7.4)
    figure = Figure(figsize=(width, height), layout='constrained')
    side, other = figure.subplots(1, 2, width_ratios=ratios, sharey=not has_plan)
    side.set(xlim=(left, right), ylim=(-depth, top),
             xlabel='x across [m]' if case.rotor.is_upright else 'y along the shaft [m]',
             ylabel='z above the contact [m]' if any(
                 one.depth for one in case.embedments) else 'z above the ground [m]')
    _draw_side(side, case, in_full=width > _SMALL)
    views = [side] if has_plan else [side, other]
    if has_plan:
        draw_plan(other, site)
    else:
        other.set(xlim=(-reach, reach), xlabel='x across [m]')
        _draw_end(other, case)
    for axes in views:
        draw_ground(axes, case, words=axes is side)
    for axes in (side, other):
        axes.set_aspect('equal')
        axes.locator_params(axis='x', nbins=6 if axes is side else 4)
        axes.spines[['top', 'right']].set_visible(False)
    if width > _SMALL:
        figure.suptitle(_title(case), fontsize=9)
    return figure


def _title(case: Case) -> str:
    given = all(block.height is not None for block in case.foundations)
    note = '' if given else ', heights of blocks after their centre of gravity'
    if case.berth is not None and case.berth.is_turned and not case.rotor.is_upright:
        note += ', blocks not turned'
    return (f'{case.name}: {_support(case)}\nto scale, discs as solid cylinders of their '
            f'mass and inertia{note};\nbearings and pedestals schematic')


def _extent(case: Case) -> tuple[float, float, float, float]:
    """Return the left and right end of the side view, half the end view, and the top [m]."""
    rotor, upright = case.rotor, case.rotor.is_upright
    radius = max([disc.radius for disc in rotor.discs], default=0.0)
    top = rotor.shaft_height + (rotor.length if upright else radius)
    ends = [-radius, radius] if upright else [0.0, rotor.length]
    reach = max(radius, 0.35 * rotor.shaft_height)
    for block in case.foundations:
        ends += sides(block, across=upright)
        reach = max(reach, *(abs(side) for side in sides(block, across=True)))
    edge = 0.05 * (max(ends) - min(ends))
    return min(ends) - edge, max(ends) + edge, reach + edge, top + 3.0 * edge


def _support(case: Case) -> str:
    if case.support.model in FILED:
        return f'{"ground" if case.foundations else "foundation and ground"} as the file says'
    if case.soil is None or case.support.model == 'rigid':
        return 'rigid ground'
    if case.ground is not None and case.ground.layers:
        count = len(case.ground.layers)
        return (f'{count} layer{"s" * (count > 1)} on '
                + ('rigid rock' if case.ground.below is None else 'a half-space'))
    return (f'{case.support.model.replace("_", " ")} on soil of G = '
            f'{1e-6 * case.soil.shear_modulus:g} MPa, c_s = '
            f'{case.soil.shear_wave_speed:.0f} m/s')


def _box(
    axes: Axes, case: Case, along: tuple[float, float], beside: tuple[float, float],
    **style: Any,
) -> None:
    """Draw what reaches from one place along the shaft to another, and so far beside it."""
    (first, last), (low, high), up = along, beside, case.rotor.shaft_height
    if case.rotor.is_upright:
        axes.add_patch(Box((low, up + first), high - low, last - first, **style, **_EDGE))
    else:
        axes.add_patch(Box((first, up + low), last - first, high - low, **style, **_EDGE))


def _place(case: Case, along: float, beside: float) -> tuple[float, float]:
    """Return where a place along and beside the shaft is in the view from the side."""
    up = case.rotor.shaft_height
    return (beside, up + along) if case.rotor.is_upright else (along, up + beside)


def _name(case: Case, station: str) -> str:
    """Return the name of a station as its machine calls it."""
    return station if case.berth is None else station.removeprefix(f'{case.name}_')


def _draw_blocks(axes: Axes, case: Case, *, across: bool, words: bool) -> None:
    """Draw blocks and rafts as they are, frames by their places and lines between them."""
    for block in case.foundations:
        first, last = sides(block, across=across)
        if block.is_solid:
            axes.add_patch(Box((first, block.elevation), last - first, block.drawn_height,
                               zorder=1, facecolor=CONCRETE, **_EDGE))
        else:
            lattice = Lattice.whole(block, mounts(case))
            for line in lattice.lines(np.zeros_like(lattice.places)):
                axes.plot(*line[:, [0 if across else 1, 2]].T, color=_FRAME, linewidth=3.0,
                          solid_capstyle='round', zorder=1)
        left, right = sides(block, across=True)
        # One beside the shaft is behind the others: the view along it has its name.
        if (left < 0.0 < right) is words:
            mass = f', {block.mass:.0f} kg' if words else ''
            axes.annotate(f'{block.name}{mass}', (0.5 * (first + last),
                          block.elevation + 0.5 * block.drawn_height),
                          ha='center', va='center', fontsize=7, zorder=1.5)


def _draw_side(axes: Axes, case: Case, *, in_full: bool) -> None:
    rotor, upright = case.rotor, case.rotor.is_upright
    left, right = axes.get_xlim()
    close = (_CLOSE if in_full else 1.6 * _CLOSE) * (right - left)
    _draw_blocks(axes, case, across=upright, words=True)
    before, raised = None, False
    for bearing in sorted(rotor.bearings, key=lambda bearing: bearing.position):
        size, foot = _housing_size(case, bearing), _foot(case, bearing)
        words = _words(bearing, _name(case, bearing.name)) if in_full else (
            _name(case, bearing.name))
        if upright:
            _draw_standing(axes, case, bearing, size=size, foot=foot)
            place, shift = _place(case, bearing.position, 1.2 * size), (3, 0)
        else:
            _draw_support(axes, bearing, bearing.position, width=size, foot=foot,
                          shaft=rotor.shaft_height, size=size)
            # At the foot: clear of the discs above and of the block's name.
            raised = before is not None and not raised and bearing.position - before < close
            place, shift = (bearing.position + 0.5 * size, foot), (3, 14 if raised else 4)
            before = bearing.position
        axes.annotate(words, place, xytext=shift, textcoords='offset points', fontsize=6.5,
                      va='center' if upright else 'bottom', zorder=7)
    _draw_shaft(axes, case)
    _draw_discs(axes, case, close=close)
    for probe in rotor.probes:
        place = _place(case, probe.position, 0.0)
        axes.plot(*place, 'v', color='crimson', markersize=5, zorder=5)
        _label(axes, _name(case, probe.name), *place, points=_BESIDE)


def _draw_shaft(axes: Axes, case: Case) -> None:
    start = 0.0
    for section in case.rotor.shaft:
        (left, right), stop = section.outer_diameter, start + section.length
        axes.add_patch(Polygon(
            [_place(case, *corner) for corner in (
                (start, -left / 2), (stop, -right / 2), (stop, right / 2), (start, left / 2))],
            zorder=3, facecolor=STEEL, **_EDGE))
        start = stop


def _draw_discs(axes: Axes, case: Case, *, close: float) -> None:
    before, raised = None, False
    for disc in sorted(case.rotor.discs, key=lambda disc: disc.position):
        thickness = max(disc.thickness, 0.008 * case.rotor.length)
        _box(axes, case, (disc.position - thickness / 2, disc.position + thickness / 2),
             (-disc.radius, disc.radius), zorder=4, facecolor=DISC)
        words = f'{_name(case, disc.name)}\n{disc.mass:.4g} kg'
        if case.rotor.is_upright:
            # Clear of the columns.
            beside = max(disc.radius, *(_housing_size(case, one) for one in case.rotor.bearings))
            axes.annotate(words, _place(case, disc.position, -beside), xytext=(-3, 0),
                          textcoords='offset points', fontsize=7, ha='right', va='center')
            continue
        # Of two close ones the second says it higher up.
        raised = before is not None and not raised and disc.position - before < close
        _label(axes, words, *_place(case, disc.position, disc.radius),
               points=_ABOVE if raised else _BESIDE)
        before = disc.position


def _draw_standing(
    axes: Axes, case: Case, bearing: Bearing, *, size: float, foot: float,
) -> None:
    """Draw the housing of a shaft that stands, held by a column on either side."""
    top = bearing.position + 0.5 * size
    _box(axes, case, (bearing.position - 0.5 * size, top), (-size, size), zorder=2.5,
         facecolor=HOUSING)
    colour = STAND if bearing.pedestal is None else SPRING
    for low, high in ((-size, -0.8 * size), (0.8 * size, size)):
        _box(axes, case, (foot - case.rotor.shaft_height, top), (low, high), zorder=2,
             facecolor=colour)


def _draw_end(axes: Axes, case: Case) -> None:
    shaft = case.rotor.shaft_height
    _draw_blocks(axes, case, across=True, words=False)
    # One behind the other: the one that shows most stands for all.
    flexible = [bearing for bearing in case.rotor.bearings if bearing.pedestal is not None]
    for bearing in (flexible or list(case.rotor.bearings))[:1]:
        size, foot = _housing_size(case, bearing), _foot(case, bearing)
        _draw_support(axes, bearing, 0.0, width=max(size, 0.5 * (shaft - foot)), foot=foot,
                      shaft=shaft, size=size)
    for disc in case.rotor.discs:
        axes.add_patch(Round((0.0, shaft), disc.radius, zorder=3, facecolor=DISC,
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


def _words(bearing: Bearing, name: str) -> str:
    """Return the name of a bearing and what is known of its pedestal."""
    pedestal = bearing.pedestal
    if pedestal is None:
        return name
    (x, z), (across, up) = np.diag(pedestal.mass), np.diag(pedestal.stiffness)
    mass = f'{x:.3g} kg' if x == z else f'{x:.3g} (x), {z:.3g} kg (z)'
    return (f'{name}\npedestal: {mass}\n{_MEGA * across:.3g} (x), {_MEGA * up:.3g} (z) '
            'N/um')


def _housing_size(case: Case, bearing: Bearing) -> float:
    """Return height and width of a housing [m]."""
    ends = np.cumsum([0.0, *(section.length for section in case.rotor.shaft)])
    index = int(np.clip(np.searchsorted(ends, bearing.position) - 1, 0, len(ends) - 2))
    diameter = max(case.rotor.shaft[index].outer_diameter)
    return max(_HOUSING * diameter, _LEAST_HOUSING * case.rotor.shaft_height)


def _label(axes: Axes, text: str, along: float, height: float, *, points: int) -> None:
    leader = {'arrowstyle': '-', 'linewidth': 0.5} if points > _BESIDE else None
    axes.annotate(text, (along, height), xytext=(0, points), fontsize=7, zorder=6,
                  arrowprops=leader,
                  textcoords='offset points', ha='center', va='bottom')


def _foot(case: Case, bearing: Bearing) -> float:
    """Return the height of what a bearing stands on [m]."""
    return next((block.elevation + block.drawn_height for block in case.foundations
                 if block.name == bearing.foundation), 0.0)
