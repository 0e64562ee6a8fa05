"""Response as curves in the complex plane, and for other masses of the blocks."""

from collections.abc import Sequence
from dataclasses import replace

from matplotlib.axes import Axes
from matplotlib.figure import Figure
import numpy as np

from rotorsoil_ros.case.config import Case
from rotorsoil_ros.case.peaks import Peak, resolved_speeds
from rotorsoil_ros.case.plots import COLOURS, tidy
from rotorsoil_ros.physics.coupled import CoupledModel
from rotorsoil_ros.physics.foundation import Foundation
from rotorsoil_ros.physics.response import Predictor, ResponseTable
from rotorsoil_ros.physics.units import rad_s_to_rpm

_MICRO = 1e6
# Block masses of the study, times that of the case.
_MASS_RATIOS = (0.25, 1.0, 4.0, 16.0)
# Labels closer to one another or to the centre, as a share of the largest amplitude at a peak,
# would lie on one another.
_LEAST_LABELLED = 0.12
_LINES = (':', '-', '--', '-.')


def polar(case: Case, predictor: Predictor, peaks: Sequence[Peak]) -> Figure:
    """Draw amplitude and phase of every disc over the whole range, each in its own circle."""
    discs = [disc.name for disc in case.rotor.discs]
    speed = resolved_speeds(predictor)
    response = predictor.predict(speed).displacement
    columns = min(len(discs), 3)
    rows = -(-len(discs) // columns)
    figure = Figure(figsize=(7.5, 7.5 / columns * rows + 0.8), layout='constrained')
    grid = figure.subplots(rows, columns, squeeze=False, subplot_kw={'projection': 'polar'})
    for axes in grid.flat[len(discs):]:
        axes.remove()
    for name, axes in zip(discs, grid.flat, strict=False):
        for colour, line, axis in zip(COLOURS, ('-', '--'), 'xz', strict=False):
            values = response[:, predictor.channels.index(f'{name}_{axis}')]
            axes.plot(np.angle(values), _MICRO * np.abs(values), color=colour, linestyle=line,
                      linewidth=1.0, label=f'{name}_{axis}')
        _mark_peaks(axes, predictor, name, peaks)
        axes.tick_params(labelsize=7)
        axes.set_rlabel_position(67.5)
        axes.set_xlabel('angle: phase [deg]; radius: amplitude [um]', fontsize=7)
        axes.legend(fontsize=7, loc='lower left', bbox_to_anchor=(-0.1, -0.1))
    figure.suptitle(f'{case.name}: response of the discs, zero-to-peak, dots at the peaks',
                    fontsize=10)
    return figure


def _mark_peaks(
    axes: Axes, predictor: Predictor, disc: str, peaks: Sequence[Peak],
) -> None:
    """Put a dot at every peak on the larger of both curves, and its speed where there is room."""
    columns = [predictor.channels.index(f'{disc}_{axis}') for axis in 'xz']
    speeds = np.array([peak.speed for peak in peaks])
    answers = predictor.predict(speeds).displacement[:, columns]
    near = _LEAST_LABELLED * np.abs(answers).max(initial=0.0)
    taken = [0j]
    # The largest first: it is sure to get its label.
    for index in np.argsort(-np.abs(answers).max(axis=1)):
        axis = int(np.abs(answers[index]).argmax())
        at = complex(answers[index, axis])
        place = (float(np.angle(at)), _MICRO * abs(at))
        if abs(at) < near:
            continue
        axes.plot(*place, 'o', color=COLOURS[axis], markersize=3)
        if all(abs(at - other) >= near for other in taken):
            axes.annotate(f'{rad_s_to_rpm(float(speeds[index])):.0f} rpm', place, fontsize=6,
                          xytext=(0, 4), textcoords='offset points',
                          ha='right' if at.real > 0.0 else 'left')
            taken.append(at)


def mass_ratios(case: Case, model: CoupledModel) -> Figure:
    """Draw the response of the discs for blocks of other masses on the same soil."""
    heaviest = max(case.rotor.discs, key=lambda disc: disc.mass).name
    figure = Figure(figsize=(7.5, 6.0), layout='constrained')
    panels = figure.subplots(2, 1, sharex=True)
    rotating = case.rotor.mass
    for ratio, colour, line in zip(_MASS_RATIOS, COLOURS, _LINES, strict=False):
        blocks = tuple(_scaled(block, ratio) for block in model.foundations)
        other = replace(model, foundations=blocks)
        predictor = ResponseTable.build(other, case.speed_range).predictor(case.unbalance)
        speed = resolved_speeds(predictor)
        response = predictor.predict(speed).displacement
        mass = sum(block.mass for block in blocks)
        for axes, axis in zip(panels, 'xz', strict=True):
            values = np.abs(response[:, predictor.channels.index(f'{heaviest}_{axis}')])
            axes.semilogy(rad_s_to_rpm(speed), _MICRO * values, color=colour, linestyle=line,
                          linewidth=1.2, label=f'{mass:.5g} kg, {mass / rotating:.3g} times the '
                                               'rotor')
    for axes, axis in zip(panels, 'xz', strict=True):
        axes.set_ylabel(f'{heaviest}_{axis}, zero-to-peak [um]')
        tidy(axes)
    panels[0].legend(fontsize=7, title='mass of the blocks', title_fontsize=7)
    panels[1].set_xlabel('speed [rpm]')
    figure.suptitle(f'{case.name}: blocks of other mass, with inertia in proportion, same soil',
                    fontsize=10)
    return figure


def _scaled(block: Foundation, ratio: float) -> Foundation:
    x, y, z = block.inertia
    return replace(block, mass=ratio * block.mass, inertia=(ratio * x, ratio * y, ratio * z))
