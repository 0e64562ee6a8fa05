"""Natural frequencies over speed and shapes at the critical speeds, as figures for print."""

from collections.abc import Iterator, Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter, StrMethodFormatter
import numpy as np

from rotorsoil_ros.case.config import Case
from rotorsoil_ros.case.plots import COLOURS, tidy
from rotorsoil_ros.physics.arrays import IntArray
from rotorsoil_ros.physics.coupled import CoupledModel
from rotorsoil_ros.physics.modes import Campbell, campbell, critical_speeds, CriticalSpeed
from rotorsoil_ros.physics.units import rad_s_to_hz, rad_s_to_rpm

_SPEEDS = 121
_MODES = 16
# The diagram ends at this many times the highest speed.
_HIGHEST_ORDER = 2.0
# An amplification factor below which a resonance is not felt (API 617).
_FELT = 2.5
_LARGEST_DRAWN_SHAPES = 6
_WHIRLS = {1: ('forward', COLOURS[0], '-'), -1: ('backward', COLOURS[1], '--')}


def modal_figures(case: Case, model: CoupledModel) -> Iterator[tuple[str, Figure]]:
    """Yield name and figure of the Campbell diagram and of the shapes at critical speeds."""
    criticals = critical_speeds(model, case.speed_range)
    found = campbell(model, np.linspace(*case.speed_range, _SPEEDS), _MODES)
    yield 'campbell', campbell_diagram(case, found, criticals)
    felt = [critical for critical in criticals if critical.amplification_factor >= _FELT]
    if felt:
        yield 'critical_shapes', critical_shapes(case, felt[:_LARGEST_DRAWN_SHAPES])


def campbell_diagram(
    case: Case, found: Campbell, criticals: Sequence[CriticalSpeed],
) -> Figure:
    """Draw natural frequencies, with the speeds that excite them, and damping over speed."""
    figure = Figure(figsize=(7.5, 7.0), layout='constrained')
    top, bottom = figure.subplots(2, 1, sharex=True, height_ratios=[1.7, 1.0])
    highest = _HIGHEST_ORDER * case.speed_range[1]
    for row, mode in _branches(found, highest):
        speed = rad_s_to_rpm(found.speed[row])
        whirl = int(np.sign(found.whirl[row, mode].sum() + 0.5))
        _, colour, line = _WHIRLS[whirl]
        style = {'color': colour, 'linestyle': line, 'linewidth': 1.2}
        # What is hardly felt stays pale.
        damping = found.damping_ratio[row, mode]
        pale = 1.0 if np.median(damping) < 0.5 / _FELT else 0.4
        top.plot(speed, rad_s_to_hz(found.omega[row, mode]), alpha=pale, **style)
        bottom.plot(speed, 100.0 * damping, alpha=pale, **style)
    _draw_criticals(top, criticals)
    turning = np.array([0.0, case.speed_range[1]])
    top.plot(rad_s_to_rpm(turning), rad_s_to_hz(turning), color='black', linewidth=0.8,
             label='once per turn')
    top.set(ylabel='natural frequency [Hz]', ylim=(0.0, rad_s_to_hz(highest)))
    bottom.set(xlabel='speed [rpm]', ylabel='damping [% of critical]')
    _scale_damping(bottom)
    for label, colour, line in _WHIRLS.values():
        top.plot([], [], color=colour, linestyle=line, label=label)
    top.legend(fontsize=7, loc='upper left')
    tidy(top)
    tidy(bottom)
    figure.suptitle(f'{case.name}: Campbell diagram; pale: amplification factor below {_FELT:g}',
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
        felt = critical.amplification_factor >= _FELT
        speed, colour = rad_s_to_rpm(critical.speed), _WHIRLS[critical.whirl][1]
        axes.plot(speed, rad_s_to_hz(critical.speed), 'o', color=colour, markersize=5, zorder=4,
                  fillstyle='full' if felt else 'none')
        if felt:
            # A forward and a backward one often lie side by side.
            place, edge = ((-5, 6), 'right') if critical.whirl > 0 else ((6, -9), 'left')
            axes.annotate(f'{speed:.0f} rpm', (speed, rad_s_to_hz(critical.speed)), fontsize=7,
                          color=colour, textcoords='offset points', xytext=place, ha=edge)


def critical_shapes(case: Case, criticals: Sequence[CriticalSpeed]) -> Figure:
    """Draw the shaft in its modes at some critical speeds, when it is bent most."""
    figure = Figure(figsize=(7.5, 1.6 * len(criticals) + 0.8), layout='constrained')
    rows = figure.subplots(len(criticals), 1, sharex=True, squeeze=False)[:, 0]
    for critical, axes in zip(criticals, rows, strict=True):
        _draw_shape(axes, case, critical)
        felt = f'amplification factor {critical.amplification_factor:.3g}'
        axes.set_title(f'{rad_s_to_rpm(critical.speed):.0f} rpm, {_WHIRLS[critical.whirl][0]}, '
                       f'{felt}', fontsize=8)
        axes.set_ylabel('shape [-]', fontsize=8)
    rows[0].legend(fontsize=7, ncols=2)
    rows[-1].set_xlabel('y along the shaft [m]')
    figure.suptitle(f'{case.name}: modes at critical speeds; dotted: bearings, broad: discs',
                    fontsize=10)
    return figure


def _draw_shape(axes: Axes, case: Case, critical: CriticalSpeed) -> None:
    shape = critical.deflection
    largest = shape.flat[np.abs(shape).argmax()]
    # A whirling shaft shows x and z a quarter turn apart: each is drawn at its own largest.
    for column, (axis, line) in enumerate((('x', '-'), ('z', '--'))):
        own = shape[:, column]
        angle = np.angle(own[np.abs(own).argmax()]) if np.any(own) else np.angle(largest)
        axes.plot(case.rotor.node_positions, np.real(own * np.exp(-1j * angle)), linestyle=line,
                  color=COLOURS[column], label=f'{axis} of the shaft')
    _draw_stations(axes, case)


def _draw_stations(axes: Axes, case: Case) -> None:
    for bearing in case.rotor.bearings:
        axes.axvline(bearing.position, color='grey', linestyle=':', linewidth=0.8)
    for disc in case.rotor.discs:
        axes.axvline(disc.position, color='#d9a441', linewidth=1.5, alpha=0.6)
    axes.axhline(0.0, color='black', linewidth=0.5)
    axes.set_ylim(-1.1, 1.1)
    tidy(axes)
