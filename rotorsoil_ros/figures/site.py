"""What stands where on the ground, seen from above and to scale."""

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle as Round, Rectangle as Box

from rotorsoil_ros.case.config import Case
from rotorsoil_ros.ground.soil import Circle, extents, parts_of
from rotorsoil_ros.machine.foundation import Foundation

_CONCRETE, _SHAFT, _PROBE = '#c9c9c4', '#0072b2', '#d55e00'
_MARGIN = 0.06
_WIDTH, _TALLEST = 7.5, 7.0


def site_plan(case: Case) -> Figure:
    """Draw blocks, shaft, bearings and probes on the ground of a case, from above."""
    left, right, first, last = _frame(case)
    height = min(_WIDTH * (last - first) / (right - left) + 1.0, _TALLEST)
    figure = Figure(figsize=(_WIDTH, height), layout='constrained')
    axes = figure.subplots()
    for block in case.foundations:
        _draw_block(axes, block)
    axes.plot([0.0, 0.0], [0.0, case.rotor.length], color=_SHAFT, linewidth=2.0, label='shaft')
    for bearing in case.rotor.bearings:
        axes.plot(0.0, bearing.position, marker='s', color=_SHAFT, markersize=5)
        axes.annotate(bearing.name, (0.0, bearing.position), xytext=(6, 0),
                      textcoords='offset points', fontsize=7, va='center')
    for probe in case.ground_probes:
        axes.plot(probe.x, probe.y, marker='^', color=_PROBE, markersize=7)
        axes.annotate(probe.name, (probe.x, probe.y), xytext=(0, 7), textcoords='offset points',
                      fontsize=7, ha='center')
    axes.set(xlim=(left, right), ylim=(first, last), aspect='equal',
             xlabel='x across the shaft [m]', ylabel='y along the shaft [m]')
    axes.set_title(f'{case.name}: blocks, shaft and probes from above; + centre of a contact',
                   fontsize=9)
    axes.grid(alpha=0.3)
    return figure


def _draw_block(axes: Axes, block: Foundation) -> None:
    x, y = block.centre_x, block.centre_y
    if isinstance(block.contact, Circle):
        axes.add_patch(Round((x, y), block.contact.radius, facecolor=_CONCRETE,
                             edgecolor='black', linewidth=0.8))
    else:
        for part in parts_of(block.contact):
            (left, right), (first, last) = part.edges
            axes.add_patch(Box((x + left, y + first), right - left, last - first,
                               facecolor=_CONCRETE, edgecolor='black', linewidth=0.8))
    axes.plot(x, y, marker='+', color='black', markersize=8)
    axes.annotate(f'{block.name}\n{block.mass:.4g} kg', (x, y), xytext=(0, -8),
                  textcoords='offset points', fontsize=7, ha='center', va='top')


def _frame(case: Case) -> tuple[float, float, float, float]:
    """Return first and last x, first and last y of all that is drawn, and a margin [m]."""
    x, y = [0.0], [0.0, case.rotor.length]
    for block in case.foundations:
        across, along = extents(block.contact)
        x += [block.centre_x + side for side in across]
        y += [block.centre_y + side for side in along]
    x += [probe.x for probe in case.ground_probes]
    y += [probe.y for probe in case.ground_probes]
    edge = _MARGIN * max(max(x) - min(x), max(y) - min(y))
    return min(x) - edge, max(x) + edge, min(y) - edge, max(y) + edge
