"""Where the damping comes from: over the speed, and of the mode at every critical speed."""

from collections.abc import Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure
import numpy as np

from rotorsoil_ros.case.config import Case
from rotorsoil_ros.figures.response import COLOURS, tidy
from rotorsoil_ros.machine.coupled import CoupledModel
from rotorsoil_ros.machine.damping import (
    BEARINGS,
    DampingSplit,
    DampingSplitter,
    EXTERNAL,
    INTERNAL,
    MATERIAL,
    PEDESTALS,
    RADIATION,
    SOIL,
    STRUCTURE,
    TORQUE,
)
from rotorsoil_ros.machine.modes.critical import critical_speeds, CriticalSpeed
from rotorsoil_ros.machine.modes.names import BELOW
from rotorsoil_ros.machine.modes.stability import stability
from rotorsoil_ros.units import rad_s_to_rpm

_COLOURS = dict(zip(
    (RADIATION, MATERIAL, BEARINGS, PEDESTALS, SOIL, INTERNAL, EXTERNAL, TORQUE, STRUCTURE,
     BELOW),
    (*COLOURS[:4], 'grey', 'firebrick', 'darkkhaki', 'black', 'slategrey', 'peru'), strict=True))
_SPEEDS = 241
_MOST_MODES = 12


def damping_figure(case: Case, model: CoupledModel) -> Figure:
    """Draw what takes the energy of the unbalance, and what damps the modes."""
    splitter = DampingSplitter(model)
    speed = np.linspace(*case.speed_range, _SPEEDS)[1:]
    forced = splitter.forced(speed, case.unbalance).where(
        stability(model, case.speed_range).holds(speed))
    criticals = critical_speeds(model, model.support.within(
        model.bearings.within_tables(case.speed_range)))
    modes = [(critical, split) for critical, split in zip(
        criticals, splitter.of_modes(criticals), strict=True) if split is not None][:_MOST_MODES]
    share = 0.25 + 0.12 * len(modes) if modes else 0.0
    figure = Figure(figsize=(8.0, 7.0 if modes else 4.5), layout='constrained')
    top, *bottom = figure.subplots(
        1 + bool(modes), 1, squeeze=False, height_ratios=[1.0, share][:1 + bool(modes)])[:, 0]
    _draw_forced(top, forced)
    for axes in bottom:  # of modes that no split is known of there is nothing to draw
        _draw_modes(axes, modes)
    figure.suptitle(f'{case.name}: where the damping comes from', fontsize=10)
    return figure


def _draw_forced(axes: Axes, forced: DampingSplit) -> None:
    rpm = rad_s_to_rpm(forced.speed)
    # A film that feeds the whirl takes less than nothing: it begins below the axis.
    shares = {kind: 100.0 * forced.share(kind) for kind in forced.kinds}
    above, below = np.zeros(len(rpm)), np.zeros(len(rpm))
    for kind, share in shares.items():
        for part, base in ((np.maximum(share, 0.0), above), (np.minimum(share, 0.0), below)):
            axes.fill_between(rpm, base, base + part, color=_COLOURS[kind], alpha=0.75,
                              linewidth=0.0, label=kind if base is above else None)
            base += part
    axes.set(xlabel='speed [rpm]', ylabel='share of the work per turn [%]',
             xlim=(rpm[0], rpm[-1]))
    power = axes.twinx()
    power.semilogy(rpm, forced.power, color='black', linewidth=0.9, label='power, right')
    power.set_ylabel('power [W]')
    axes.plot([], [], color='black', linewidth=0.9, label='power, right')
    axes.legend(fontsize=7, loc='lower right')
    tidy(axes)


def _draw_modes(axes: Axes, modes: Sequence[tuple[CriticalSpeed, DampingSplit]]) -> None:
    names = [f'{critical.speed_rpm:.0f} rpm {"forward" if critical.whirl > 0 else "backward"}'
             for critical, _ in modes]
    for row, (critical, split) in enumerate(modes):
        left = 0.0
        for kind in split.kinds:
            width = 100.0 * float(split.share(kind)[0])
            axes.barh(row, width, left=left, color=_COLOURS[kind], alpha=0.75, height=0.7)
            left += width
        axes.annotate(f'{100.0 * critical.damping_ratio:.2g} % of critical', (2.0, row),
                      fontsize=7, va='center')
    axes.set_yticks(range(len(names)), names, fontsize=7)
    axes.set(xlabel='share of the damping of the mode [%]')
    axes.invert_yaxis()
    tidy(axes)
