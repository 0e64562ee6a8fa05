"""Natural frequencies over speed and shapes at the critical speeds, as figures for print."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter, StrMethodFormatter
import numpy as np

from rotorsoil_ros.arrays import ComplexArray, FloatArray, IntArray
from rotorsoil_ros.case.config import Case
from rotorsoil_ros.channel import across
from rotorsoil_ros.figures.response import COLOURS, draw_shape, FELT, legend_below, tidy, title_of
from rotorsoil_ros.machine.coupled import CoupledModel
from rotorsoil_ros.machine.foundation import Foundation
from rotorsoil_ros.machine.modes.campbell import Campbell, campbell
from rotorsoil_ros.machine.modes.critical import critical_speeds, CriticalSpeed
from rotorsoil_ros.machine.peaks import Peak, resolved_speeds
from rotorsoil_ros.machine.response import Predictor, ResponseTable
from rotorsoil_ros.units import rad_s_to_hz, rad_s_to_rpm

_SPEEDS = 121
_MODES = 16
# The diagram ends at this many times the highest speed.
_HIGHEST_ORDER = 2.0
_LARGEST_DRAWN_SHAPES = 6
# Share of the range beyond which a label would leave the diagram.
_NO_ROOM = 0.88
_WHIRLS = {1: ('forward', COLOURS[0], '-'), -1: ('backward', COLOURS[1], '--')}
_NEIGHBOURS = 'of a neighbour', '0.45', ':'


def modal_figures(case: Case, model: CoupledModel) -> Iterator[tuple[str, Figure]]:
    """Yield name and figure of the Campbell diagram and of the shapes at critical speeds."""
    criticals = critical_speeds(model, case.speed_range)
    found = campbell(model, np.linspace(*case.speed_range, _SPEEDS), _MODES)
    yield 'campbell', campbell_diagram(case, found, criticals)
    felt = [critical for critical in criticals if critical.amplification_factor >= FELT]
    if felt:
        yield 'critical_shapes', critical_shapes(case, model, felt[:_LARGEST_DRAWN_SHAPES])


def campbell_diagram(
    case: Case, found: Campbell, criticals: Sequence[CriticalSpeed],
) -> Figure:
    """Draw natural frequencies, with the speeds that excite them, and damping over speed."""
    figure = Figure(figsize=(7.5, 7.0), layout='constrained')
    top, bottom = figure.subplots(2, 1, sharex=True, height_ratios=[1.7, 1.0])
    highest = _HIGHEST_ORDER * case.speed_range[1]
    for number, (row, mode) in enumerate(_branches(found, highest), start=1):
        speed = rad_s_to_rpm(found.speed[row])
        whirl = int(np.sign(found.whirl[row, mode].sum() + 0.5))
        beside = np.count_nonzero(found.owner[row, mode]) > 0.5 * len(row)
        _, colour, line = _NEIGHBOURS if beside else _WHIRLS[whirl]
        style = {'color': colour, 'linestyle': line, 'linewidth': 1.2}
        # What is hardly felt stays pale.
        damping = found.damping_ratio[row, mode]
        pale = 1.0 if np.median(damping) < 0.5 / FELT else 0.4
        for axes, values in ((top, rad_s_to_hz(found.omega[row, mode])),
                             (bottom, 100.0 * damping)):
            axes.plot(speed, values, alpha=pale, **style)
            # The same number says which damping is that of which frequency.
            axes.annotate(str(number), (speed[-1], values[-1]), fontsize=7, color=colour,
                          xytext=(4 + 9 * (number % 2), 0), textcoords='offset points',
                          va='center', annotation_clip=True)
    _draw_criticals(top, criticals)
    turning = np.array([0.0, case.speed_range[1]])
    top.plot(rad_s_to_rpm(turning), rad_s_to_hz(turning), color='black', linewidth=0.8,
             label='once per turn')
    top.set(ylabel='natural frequency [Hz]', ylim=(0.0, rad_s_to_hz(highest)))
    bottom.set(xlabel='speed [rpm]', ylabel='damping [% of critical]')
    _scale_damping(bottom)
    for label, colour, line in (*_WHIRLS.values(), *[_NEIGHBOURS] * bool(found.owner.any())):
        top.plot([], [], color=colour, linestyle=line, label=label)
    legend_below(figure, top)
    tidy(top)
    tidy(bottom)
    bottom.set_xlim(right=1.06 * rad_s_to_rpm(case.speed_range[1]))
    figure.suptitle(f'{case.name}: Campbell diagram; pale: amplification factor below {FELT:g}; '
                    'one number is one mode',
                    fontsize=10)
    return figure


def _scale_damping(axes: Axes) -> None:
    values = np.array([value for line in axes.get_lines()
                       for value in np.asarray(line.get_ydata())])
    if values.min(initial=1.0) > 0.0 and len(values):
        axes.set_yscale('log')
        axes.yaxis.set_major_formatter(StrMethodFormatter('{x:g}'))
        if values.max() < 10.0 * values.min():
            axes.yaxis.set_minor_formatter(StrMethodFormatter('{x:g}'))
        else:
            axes.yaxis.set_minor_formatter(NullFormatter())
        axes.tick_params(which='minor', labelsize=6)
    else:
        # Undamped or unstable: a logarithm could not show it.
        axes.axhline(0.0, color='black', linewidth=0.8)


def _branches(found: Campbell, highest: float) -> Iterator[tuple[IntArray, IntArray]]:
    """Yield rows and modes of every followed curve that lies in the diagram."""
    for name in range(found.branch.max() + 1):
        row, mode = np.nonzero(found.branch == name)
        if len(row) > 1 and found.omega[row, mode].min() < highest:
            yield row, mode


def _draw_criticals(axes: Axes, criticals: Sequence[CriticalSpeed]) -> None:
    for critical in criticals:
        felt = critical.amplification_factor >= FELT
        speed, colour = rad_s_to_rpm(critical.speed), _WHIRLS[critical.whirl][1]
        axes.plot(speed, rad_s_to_hz(critical.speed), 'o', color=colour, markersize=5, zorder=4,
                  fillstyle='full' if felt else 'none')
        if felt:
            # A forward and a backward one often lie side by side; near the end there is no room.
            place, edge = ((-5, 6), 'right') if critical.whirl > 0 else ((6, -9), 'left')
            if critical.whirl < 0 and speed > _NO_ROOM * axes.get_xlim()[1]:
                place, edge = (-5, 6), 'right'
            axes.annotate(f'{speed:.0f} rpm', (speed, rad_s_to_hz(critical.speed)), fontsize=7,
                          color=colour, textcoords='offset points', xytext=place, ha=edge)


def critical_shapes(
    case: Case, model: CoupledModel, criticals: Sequence[CriticalSpeed],
) -> Figure:
    """Draw shaft and housings in the modes at some critical speeds, when they are bent most."""
    figure = Figure(figsize=(7.5, 1.6 * len(criticals) + 0.8), layout='constrained')
    rows = figure.subplots(len(criticals), 1, sharex=True, squeeze=False)[:, 0]
    for critical, axes in zip(criticals, rows, strict=True):
        seats = model.support.motion_rows[model.own_seats]
        housings = (seats @ critical.support).reshape(-1, 2)
        draw_shape(axes, case, case.rotor.node_positions,
                   *_at_their_most(critical.deflection, housings))
        axes.set_ylim(-1.15, 1.15)
        axes.set_title(title_of(critical), fontsize=8)
        axes.set_ylabel('shape [-]', fontsize=8)
    legend_below(figure, rows[0])
    rows[-1].set_xlabel('y along the shaft [m]')
    figure.suptitle(f'{case.name}: modes at critical speeds; dotted: bearings, broad: discs',
                    fontsize=10)
    return figure


def _at_their_most(
    shaft: ComplexArray, housings: ComplexArray,
) -> tuple[FloatArray, FloatArray]:
    """Return x and z of a mode, (k, 2) and (b, 2), each axis at its own largest."""
    # A whirling shaft shows x and z a quarter turn apart.
    largest = np.take_along_axis(shaft, np.abs(shaft).argmax(axis=0)[None], axis=0)[0]
    turn = np.exp(-1j * np.angle(largest))
    return np.real(shaft * turn), np.real(housings * turn)


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
        for colour, line, channel in zip(COLOURS, ('-', '--'), across(name), strict=False):
            values = response[:, predictor.channels.index(channel)]
            axes.plot(np.angle(values), _MICRO * np.abs(values), color=colour, linestyle=line,
                      linewidth=1.0, label=channel)
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
    columns = [predictor.channels.index(channel) for channel in across(disc)]
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
    heaviest = across(max(case.rotor.discs, key=lambda disc: disc.mass).name)
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
        for axes, channel in zip(panels, heaviest, strict=True):
            values = np.abs(response[:, predictor.channels.index(channel)])
            axes.semilogy(rad_s_to_rpm(speed), _MICRO * values, color=colour, linestyle=line,
                          linewidth=1.2, label=f'{mass:.5g} kg, {mass / rotating:.3g} times the '
                                               'rotor')
    for axes, channel in zip(panels, heaviest, strict=True):
        axes.set_ylabel(f'{channel}, zero-to-peak [um]')
        tidy(axes)
    legend_below(figure, panels[0], columns=2)
    panels[1].set_xlabel('speed [rpm]')
    figure.suptitle(f'{case.name}: blocks of other mass, with inertia in proportion, same soil',
                    fontsize=10)
    return figure


def _scaled(block: Foundation, ratio: float) -> Foundation:
    x, y, z = block.inertia
    return replace(block, mass=ratio * block.mass, inertia=(ratio * x, ratio * y, ratio * z))
