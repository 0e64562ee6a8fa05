"""Oil films over the speed: where each journal floats, and how stiffly, as figures for print."""

from collections.abc import Iterator

from matplotlib.axes import Axes
from matplotlib.figure import Figure
import numpy as np

from rotorsoil_ros.case.config import Case
from rotorsoil_ros.case.journal_entries import Journal
from rotorsoil_ros.figures.response import COLOURS, tidy
from rotorsoil_ros.units import rad_s_to_rpm

_PAIRS = (('xx', 0, 0), ('xz', 0, 1), ('zx', 1, 0), ('zz', 1, 1))

# Points between those of a table, at which the curve that the machine is solved with is drawn.
_ALONG = 400


def bearing_figures(case: Case) -> Iterator[tuple[str, Figure]]:
    """Yield name and figure of every journal bearing of a case."""
    for journal in case.journals:
        yield f'bearing_{journal.name}', _bearing(case, journal)


def _bearing(case: Case, journal: Journal) -> Figure:
    figure = Figure(figsize=(8.5, 7.0), layout='constrained')
    place, film, stiffness, damping = figure.subplots(2, 2).ravel()
    _draw_place(place, journal)
    _draw_film(film, journal)
    for axes, table, name, unit in zip(
            (stiffness, damping), journal.states.tables, ('stiffness', 'damping'),
            ('MN/m', 'kN s/m'), strict=True):
        scale = {'MN/m': 1e-6, 'kN s/m': 1e-3}[unit]
        speed = np.geomspace(table.speed[0], table.speed[-1], _ALONG)[1:-1]
        values, points = scale * table(speed), scale * table.values
        for colour, (pair, row, column) in zip(COLOURS, _PAIRS, strict=False):
            axes.plot(rad_s_to_rpm(speed), values[:, row, column], color=colour, label=pair,
                      linestyle='-' if row == column else '--', linewidth=1.2)
            axes.plot(rad_s_to_rpm(table.speed), points[:, row, column], '.', color=colour,
                      markersize=3.0)
        axes.axhline(0.0, color='black', linewidth=0.6)
        axes.set(xlabel='speed [rpm]', ylabel=f'{name} [{unit}]')
        # A film at the lowest speed is so stiff that nothing else would be seen.
        settled = np.abs(points[len(points) // 4:]).max()
        axes.set_ylim(max(-1.3 * settled, 1.1 * points.min()), min(1.3 * settled,
                                                                   1.1 * points.max()))
        axes.legend(fontsize=7, ncols=2)
        tidy(axes)
    bore = journal.states.bearing
    figure.suptitle(
        f'{case.name}: {journal.name}, {bore.kind.replace("_", " ")}, {1e3 * bore.diameter:g} x '
        f'{1e3 * bore.length:g} mm, clearance {1e6 * bore.radial_clearance:g} um, load '
        f'{journal.states.carried:.4g} N', fontsize=10)
    return figure


def _draw_place(axes: Axes, journal: Journal) -> None:
    """Draw where the journal floats in its clearance, the slowest speed lowest."""
    states = journal.states
    turn = np.linspace(0.0, 2.0 * np.pi, 181)
    axes.plot(np.sin(turn), np.cos(turn), color='black', linewidth=0.8)
    axes.plot(states.place[:, 0], states.place[:, 1], '.-', color=COLOURS[0], linewidth=1.2)
    rpm = rad_s_to_rpm(states.speed)
    for index, up in ((0, 'top'), (-1, 'bottom')):
        x, z = states.place[index].tolist()
        axes.annotate(f'{rpm[index]:.4g} rpm', (x, z), fontsize=7, va=up, xytext=(6, 0),
                      textcoords='offset points')
    x, z = (0.35 * states.load / states.carried).tolist()
    axes.annotate('', xy=(x, z), xytext=(0.0, 0.0), arrowprops={'arrowstyle': '->'})
    axes.annotate('load', (x, z), fontsize=7, xytext=(4, 0), textcoords='offset points')
    axes.set(xlabel='x [radial clearances]', ylabel='z [radial clearances]', aspect='equal')
    tidy(axes)


def _draw_film(axes: Axes, journal: Journal) -> None:
    states = journal.states
    rpm = rad_s_to_rpm(states.speed)
    axes.plot(rpm, 1e6 * states.least, '.-', color=COLOURS[0], linewidth=1.2,
              label='least film')
    axes.axhline(1e6 * journal.least_film, color='black', linestyle=':', linewidth=0.8,
                 label='surfaces touch below')
    axes.set(xlabel='speed [rpm]', ylabel='film [um]')
    axes.set_ylim(bottom=0.0)
    axes.legend(fontsize=7, loc='lower right')
    tidy(axes)
