"""How foundations that bend move: at critical speeds, and while the machine runs."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator
import numpy as np

from rotorsoil_ros.arrays import ComplexArray
from rotorsoil_ros.case.config import Case
from rotorsoil_ros.case.plant.berth import mounts
from rotorsoil_ros.channel import across, Channel, HOUSING
from rotorsoil_ros.errors import RotorSoilError
from rotorsoil_ros.figures.response import COLOURS
from rotorsoil_ros.machine.coupled import CoupledModel
from rotorsoil_ros.machine.flexible.lattice import Lattice
from rotorsoil_ros.machine.flexible.part import Mount
from rotorsoil_ros.machine.modes.critical import critical_speeds
from rotorsoil_ros.machine.modes.names import ModeNames
from rotorsoil_ros.units import rad_s_to_rpm

# Modes that are drawn, those of less damping first met; what they move at most, of the extent.
_MOST_MODES = 3
_FELT = 0.2
_SHARE = 0.08


@dataclass(frozen=True)
class _Shape:
    """What is drawn once: a title, and how far which channels of which bearings move."""

    title: str
    mounts: Sequence[Mount]
    channels: Sequence[Channel]
    motion: ComplexArray


def bending_figure(case: Case, model: CoupledModel) -> Figure:
    """Draw the places of every foundation that bends, at rest and where they move."""
    shapes = [*_modes(case, model), _operating(case, model)]
    blocks = [block for block in model.foundations if block.body is not None]
    figure = Figure(figsize=(max(4.4 * len(shapes), 6.0), 4.2 * len(blocks)), layout='constrained')
    for row, block in enumerate(blocks):
        for column, shape in enumerate(shapes):
            axes = figure.add_subplot(len(blocks), len(shapes), row * len(shapes) + column + 1,
                                      projection='3d')
            _draw(axes, Lattice.of(block, shape.mounts, shape.channels), shape)
    figure.suptitle(f'{case.name}: foundations that bend; grey at rest, motion magnified',
                    fontsize=10)
    return figure


def _modes(case: Case, model: CoupledModel) -> Iterator[_Shape]:
    names, support = ModeNames(model), model.support
    try:
        found = critical_speeds(model, case.speed_range)
    except RotorSoilError:  # `check` says why modes are not known
        return
    points = [*(channel for mount in support.mounts
                for channel in across(mount.bearing.name, HOUSING)),
              *(channel for part in support.members for channel in part.contacts),
              *(channel for part in support.members for channel in part.probes)]
    felt = [one for one in found if 0.0 < one.damping_ratio < _FELT]
    for one in felt[:_MOST_MODES]:
        yield _Shape(f'{names.of_critical(one)}\n{one.speed_rpm:.0f} rpm, damping '
                     f'{one.damping_ratio:.2g}', support.mounts, points,
                     support.point_motion[:support.told_points.stop] @ one.support)


def _operating(case: Case, model: CoupledModel) -> _Shape:
    """Return how it moves under its unbalance at the highest speed."""
    speed = case.speed_range[1]
    found = model.unbalance_response(np.array([speed]), case.unbalance)
    return _Shape(f'running\n{rad_s_to_rpm(speed):.0f} rpm', mounts(case), model.channels,
                  found.displacement[0])


def _draw(axes: Any, lattice: Lattice, shape: _Shape) -> None:
    moved = lattice.moved(shape.motion)
    largest = float(np.abs(moved).max(initial=0.0))
    extent = float(np.ptp(lattice.places, axis=0).max())
    scale = _SHARE * extent / largest if largest > 0.0 else 0.0
    # At the moment at which it is bent most.
    turn = np.exp(-0.5j * np.angle((moved**2).sum()))
    for offsets, style in ((np.zeros_like(lattice.places), {'color': '0.75', 'linewidth': 0.8}),
                           (scale * (moved * turn).real,
                            {'color': COLOURS[0], 'linewidth': 1.4})):
        for line in lattice.lines(offsets):
            axes.plot(*line.T, **style)
    axes.set_title(shape.title, fontsize=8)
    axes.set_aspect('equal')
    axes.tick_params(labelsize=6)
    for name in 'xyz':
        getattr(axes, f'set_{name}label')(f'{name} [m]', fontsize=7)
        # The same steps along all: those of short sides would cover each other.
        getattr(axes, f'{name}axis').set_major_locator(MultipleLocator(max(extent // 6.0, 1.0)))
