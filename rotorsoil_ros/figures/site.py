"""What stands where on the ground, seen from above and to scale."""

from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle as Round, Rectangle as Box
import numpy as np

from rotorsoil_ros.case.config import Case
from rotorsoil_ros.case.entries.sensors import GroundSensor
from rotorsoil_ros.case.entries.site import GroundProbe
from rotorsoil_ros.case.plant.berth import mounts, placed
from rotorsoil_ros.ground.soil import Circle, extents, parts_of
from rotorsoil_ros.machine.flexible.lattice import Lattice
from rotorsoil_ros.machine.foundation import Foundation
from rotorsoil_ros.machine.placement import Placement
from rotorsoil_ros.rotor.assembly import Rotor

_CONCRETE, _SHAFT, _PROBE, _FRAME = '#c9c9c4', '#0072b2', '#d55e00', '#8a8a85'
_SENSOR = '#009e73'
_MARGIN = 0.06
_WIDTH, _TALLEST = 7.5, 7.0


def site_plan(case: Case) -> Figure:
    """Draw blocks, shafts, bearings, probes and sensors on the ground of a case, from above."""
    left, right, first, last = frame(case)
    height = min(_WIDTH * (last - first) / (right - left) + 1.0, _TALLEST)
    figure = Figure(figsize=(_WIDTH, height), layout='constrained')
    axes = figure.subplots()
    draw_plan(axes, case)
    named = case.name if case.berth is None else case.berth.plant
    beside = [words for words, some in (('probes', case.ground_probes),
                                        ('sensors on the ground', case.sensors.ground)) if some]
    axes.set_title(f'{named}: {" and ".join(["blocks, shafts", *beside])} from above; + centre '
                   'of a contact', fontsize=9)
    return figure


def draw_plan(axes: Axes, case: Case) -> None:
    """Draw the same into axes; bearings of a machine that is alone are named, else machines."""
    for block in case.foundations:
        _draw_block(axes, case, block)
    for name, rotor, place in placed(case):
        _draw_shaft(axes, name if case.berth else '', rotor, place)
    for one in _beside(case):
        marker, colour = ('o', _SENSOR) if isinstance(one, GroundSensor) else ('^', _PROBE)
        axes.plot(one.x, one.y, marker=marker, color=colour, markersize=7)
        axes.annotate(one.name, (one.x, one.y), xytext=(0, 7), textcoords='offset points',
                      fontsize=7, ha='center')
    left, right, first, last = frame(case)
    axes.set(xlim=(left, right), ylim=(first, last), aspect='equal', xlabel='x across [m]',
             ylabel='y along [m]')
    axes.grid(alpha=0.3)


def _beside(case: Case) -> list[GroundProbe | GroundSensor]:
    return [*case.ground_probes, *case.sensors.ground]


def _draw_shaft(axes: Axes, name: str, rotor: Rotor, place: Placement) -> None:
    ends = np.array([place.point(0.0), place.point(rotor.length)])
    axes.plot(*ends.T, color=_SHAFT, linewidth=2.0)
    across = place.axes[0, :2]
    for disc in rotor.discs:
        middle, reach = np.array(place.point(disc.position)), disc.radius * across
        if place.is_upright:
            axes.add_patch(Round(place.point(0.0), disc.radius, fill=False, edgecolor=_SHAFT))
        else:
            axes.plot(*np.array([middle - reach, middle + reach]).T, color=_SHAFT, linewidth=3.0)
    for bearing in rotor.bearings:
        at = place.point(bearing.position)
        axes.plot(*at, marker='s', color=_SHAFT, markersize=5)
        if not name and not place.is_upright:
            axes.annotate(bearing.name, at, xytext=(6, 0), textcoords='offset points',
                          fontsize=7, va='center')
    if name:
        axes.annotate(name, ends.mean(axis=0), xytext=(5, 0), textcoords='offset points',
                      fontsize=7.5, va='center', color=_SHAFT, fontweight='bold',
                      bbox={'facecolor': 'white', 'alpha': 0.7, 'linewidth': 0.0, 'pad': 1.0})


def _draw_block(axes: Axes, case: Case, block: Foundation) -> None:
    x, y = block.centre_x, block.centre_y
    style: dict[str, Any] = {'facecolor': _CONCRETE, 'edgecolor': 'black', 'linewidth': 0.8}
    if not block.is_solid:
        lattice = Lattice.whole(block, mounts(case))
        for line in lattice.lines(np.zeros_like(lattice.places)):
            axes.plot(*line[:, :2].T, color=_FRAME, linewidth=2.0)
    elif isinstance(block.contact, Circle):
        axes.add_patch(Round((x, y), block.contact.radius, **style))
    else:
        for part in parts_of(block.contact):
            (left, right), (first, last) = part.edges
            axes.add_patch(Box((x + left, y + first), right - left, last - first, **style))
    axes.plot(x, y, marker='+', color='black', markersize=8)
    (left, _), (first, _) = extents(block.contact)
    axes.annotate(f'{block.name}, {block.mass:.0f} kg', (x + left, y + first), xytext=(4, 4),
                  textcoords='offset points', fontsize=7, zorder=5)


def frame(case: Case) -> tuple[float, float, float, float]:
    """Return first and last x, first and last y of all that is drawn, and a margin [m]."""
    points = [place.point(end) for _, rotor, place in placed(case) for end in (0.0, rotor.length)]
    x, y = map(list, zip(*points, strict=True))
    for block in case.foundations:
        across, along = extents(block.contact)
        x += [block.centre_x + side for side in across]
        y += [block.centre_y + side for side in along]
    x += [one.x for one in _beside(case)]
    y += [one.y for one in _beside(case)]
    edge = _MARGIN * max(max(x) - min(x), max(y) - min(y))
    return min(x) - edge, max(x) + edge, min(y) - edge, max(y) + edge
