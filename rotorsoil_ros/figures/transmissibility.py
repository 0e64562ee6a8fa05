"""How much of the motion of the ground reaches the bearing housings, over its frequency."""

from matplotlib.axes import Axes
from matplotlib.figure import Figure
import numpy as np

from rotorsoil_ros.case.config import Case
from rotorsoil_ros.channel import ACROSS, across, HOUSING
from rotorsoil_ros.figures.response import COLOURS, legend_below, tidy
from rotorsoil_ros.machine.coupled import CoupledModel
from rotorsoil_ros.machine.modes.stability import stability
from rotorsoil_ros.machine.transmissibility import ALONG, Transmissibility
from rotorsoil_ros.units import rad_s_to_rpm

_POINTS = 481
# What is smaller is nothing that anybody would feel.
_SMALLEST = 1e-2
# Among so many speeds one is looked for at which the machine is stable.
_SPEEDS = 41
_STYLES = ('-', '--', '-.', ':')


def fastest_steady(model: CoupledModel, speed_range: tuple[float, float]) -> float | None:
    """Return the highest speed of a range that all tables know and no mode grows at, if any."""
    speeds = np.linspace(*model.bearings.within_tables(speed_range), _SPEEDS)
    steady = speeds[stability(model, (speeds[0], speeds[-1])).holds(speeds)]
    return float(steady[-1]) if len(steady) else None


def transmissibility_figure(case: Case, model: CoupledModel, *, speed: float) -> Figure:
    """
    Draw the motion of every housing per motion of the ground, a row for each of its directions.

    The rotor turns at a speed [rad/s] at which it is stable; what it does to the housings hardly
    depends on it.
    """
    low, high = model.support.known(case.speed_range[1])
    omega = np.linspace(max(low, high / _POINTS), high, _POINTS)
    found = Transmissibility.of(model, omega, speed=speed)
    figure = Figure(figsize=(7.5, 6.5), layout='constrained')
    rows = figure.subplots(len(ACROSS), 1, sharex=True)
    for axes, axis in zip(rows, ACROSS, strict=True):
        housings = [across(bearing.name, HOUSING)[ACROSS.index(axis)]
                    for bearing in case.rotor.bearings]
        _draw(axes, found[tuple(housings)])
        axes.set_ylabel(f'housing along {axis} / ground [-]')
    rows[-1].set_xlabel('frequency of the ground [Hz]')
    legend_below(figure, *rows, columns=3)
    figure.suptitle(f'{case.name}: what reaches the housings of ground that moves, rotor at '
                    f'{rad_s_to_rpm(speed):.4g} rpm', fontsize=10)
    return figure


def _draw(axes: Axes, housings: Transmissibility) -> None:
    """Draw what each of some housings does of each motion of the ground that it feels."""
    sizes = housings.amplitude
    for number, channel in enumerate(housings.channels):
        for along, colour in enumerate(COLOURS[:len(ALONG)]):
            values = sizes[:, number, along]
            if values.max() >= _SMALLEST:
                axes.semilogy(
                    housings.frequency_hz, values, linewidth=1.2, color=colour,
                    linestyle=_STYLES[number % len(_STYLES)],
                    label=f'{channel.station}, ground along {ALONG[along]}')
    axes.axhline(1.0, color='grey', linewidth=0.7)
    axes.set_ylim(bottom=_SMALLEST)
    # Ratios are read as numbers, not as powers.
    axes.yaxis.set_major_formatter('{x:g}')
    tidy(axes)
