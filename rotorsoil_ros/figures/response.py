"""What a case answers, as figures for print: every axis has its unit."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
import numpy as np

from rotorsoil_ros.arrays import ComplexArray, FloatArray
from rotorsoil_ros.case.config import Case
from rotorsoil_ros.channel import ACROSS, across, Channel, DOFS, HOUSING, JOURNAL
from rotorsoil_ros.errors import NotSolvedError
from rotorsoil_ros.figures.drawing import machine_drawing
from rotorsoil_ros.figures.site import site_plan
from rotorsoil_ros.ground.soil import Circle, singular_of, Soil, SoilModel
from rotorsoil_ros.machine.coupled import CoupledModel
from rotorsoil_ros.machine.flexible.receptance import SeatReceptance
from rotorsoil_ros.machine.foundation import Foundation
from rotorsoil_ros.machine.modes.critical import critical_speeds, CriticalSpeed
from rotorsoil_ros.machine.peaks import Peak, resolved_speeds, resonances
from rotorsoil_ros.machine.response import Predictor, ResponseTable
from rotorsoil_ros.rotor.shaft import Probe
from rotorsoil_ros.units import rad_s_to_hz, rad_s_to_rpm

# Okabe and Ito: told apart by every eye, and in grey.
COLOURS = ('#0072b2', '#d55e00', '#009e73', '#cc79a7', '#56b4e9', '#e69f00')

# An amplification factor below which a resonance is not felt (API 617).
FELT = 2.5

_MICRO = 1e6
_SMALLEST_DRAWN = 1e-15
_LOWEST_TREND = 1e-4  # [um]; below it no instrument sees anything
_LARGEST_DRAWN = 4
_LARGEST_DRAWN_NODES = 120
# Not the whole turn: the gap before the dot shows the sense of an orbit.
_TURN = np.linspace(0.0, 1.86 * np.pi, 181)


def all_figures(
    case: Case, model: CoupledModel, table: ResponseTable,
) -> Iterator[tuple[str, Figure]]:
    """Yield name and figure of every picture of a case."""
    predictor = table.predictor(case.unbalance)
    yield 'machine', machine_drawing(case)
    if case.support.model == 'boundary_elements' or case.berth or case.sensors.ground:
        yield 'plan', site_plan(case)
    if case.support.model != 'rigid':
        yield 'support', support(case, model)
    for kind, channels in channel_groups(case).items():
        yield f'bode_{kind}', bode(predictor, channels, f'{case.name}: {kind}')
    try:
        criticals = drawn_criticals(critical_speeds(model, case.speed_range), predictor)
    except NotSolvedError:
        return  # the diagram of the modes is told to be missing
    if criticals and np.any(case.unbalance):
        yield 'orbits', orbits(case, predictor, criticals)
        yield 'shapes', shapes(case, model, criticals)


def main_peaks(case: Case, predictor: Predictor) -> list[Peak]:
    """Return the largest peaks of the machine's displacements, slowest first."""
    moved = [channel for channels in channel_groups(case).values() for channel in channels
             if not channel.is_rotation]
    peaks = sorted(resonances(predictor, tuple(moved)), key=lambda peak: -peak.amplitude)
    return sorted(peaks[:_LARGEST_DRAWN], key=lambda peak: peak.speed)


def channel_groups(case: Case) -> dict[str, list[Channel]]:
    """Return the channels that belong in one diagram, by what they are of."""
    rotor = case.rotor
    groups = {
        'journals': [channel for bearing in rotor.bearings
                     for channel in across(bearing.name, JOURNAL)],
        'housings': [channel for bearing in rotor.bearings
                     for channel in across(bearing.name, HOUSING)
                     if case.support.model != 'rigid' or bearing.pedestal is not None],
        'discs': [channel for disc in rotor.discs for channel in across(disc.name)],
        'probes': [channel for probe in rotor.probes for channel in probe.channels],
    }
    if case.support.model != 'rigid':
        of_blocks = [Channel(block.name, '', dof) for block in case.foundations for dof in DOFS]
        groups['foundations'] = [channel for channel in of_blocks if not channel.is_rotation]
        groups['rocking'] = [channel for channel in of_blocks if channel.is_rotation]
    return {kind: channels for kind, channels in groups.items() if channels}


def support(case: Case, model: CoupledModel) -> Figure:
    """Draw what the soil under every block opposes to one force or moment, over frequency."""
    if model.support.table is not None:
        return _seats(case, model.support.table)
    omega = np.linspace(*case.speed_range, 400)
    figure = Figure(figsize=(7.5, 7.5), layout='constrained')
    grid = figure.subplots(3, 2, sharex=True)
    for block, soil in zip(model.foundations, model.support.soils, strict=True):
        diagonal = np.diagonal(soil.compliance(omega), axis1=1, axis2=2)
        for dof in np.flatnonzero(np.all(diagonal != 0.0, axis=0)):
            column = grid[:, dof // 3]
            style: dict[str, Any] = {
                'color': COLOURS[dof % 3], 'linestyle': ('-', '--', '-.')[dof % 3],
                'label': f'{block.name} {DOFS[dof]}'}
            felt = 1.0 / diagonal[:, dof]
            for axes, values in zip(
                    column, (felt.real, felt.imag, np.abs(diagonal[:, dof])), strict=True):
                axes.plot(rad_s_to_hz(omega), values, **style)
    for column, stiffness, compliance in zip(
            grid.T, ('N/m', 'N m/rad'), ('m/N', 'rad/(N m)'), strict=True):
        column[0].set_ylabel(f'Re 1/N, spring [{stiffness}]')
        column[1].set_ylabel(f'Im 1/N, damping [{stiffness}]')
        column[2].set(ylabel=f'compliance |N| [{compliance}]', xlabel='frequency [Hz]')
    legend_below(figure, *grid[0], columns=6)
    for axes in grid.flat:
        tidy(axes)
    figure.suptitle(f'{case.name}: soil below the massless contact, one direction at a time',
                    fontsize=10)
    return figure


def _seats(case: Case, table: SeatReceptance) -> Figure:
    """Draw how every seat answers a force on itself: rows of the table, and what leads on."""
    omega = np.linspace(table.omega[0], table.omega[-1], 1000)
    figure = Figure(figsize=(7.5, 5.2), layout='constrained')
    amplitude, phase = figure.subplots(2, 1, sharex=True, height_ratios=[2.0, 1.0])
    for place, seat in enumerate(table.seats):
        colour = COLOURS[place % len(COLOURS)]
        for at, values, style in ((omega, table.compliance(omega), {'linewidth': 1.0}),
                                  (table.omega, table.values, {'linestyle': '', 'marker': '.'})):
            own = values[:, place, place]
            amplitude.plot(rad_s_to_hz(at), np.abs(own), color=colour, **style)
            phase.plot(rad_s_to_hz(at), -np.degrees(np.angle(own)), color=colour, **style)
        amplitude.lines[-1].set_label(seat)
    amplitude.set(ylabel='receptance of the seat itself [m/N]', yscale='log')
    phase.set(ylabel='lag [deg]', xlabel='frequency [Hz]')
    legend_below(figure, amplitude, columns=4)
    for axes in (amplitude, phase):
        tidy(axes)
    figure.suptitle(f'{case.name}: foundation and ground by their receptances, rows as dots',
                    fontsize=10)
    return figure


def bode(predictor: Predictor, channels: Sequence[Channel], title: str) -> Figure:
    """Draw amplitude, zero-to-peak, and phase of channels of one unit over the speed."""
    speed = resolved_speeds(predictor)
    response = predictor.predict(speed).displacement
    figure, amplitude, phase = bode_axes()
    for number, channel in enumerate(channels):
        values = response[:, predictor.channels.index(channel)]
        moving = np.abs(values) > _SMALLEST_DRAWN
        if not np.any(moving):
            continue
        style: dict[str, Any] = {
            'color': COLOURS[number // 2 % len(COLOURS)], 'linewidth': 1.2,
            'linestyle': ('-', '--')[number % 2], 'label': channel}
        x = rad_s_to_rpm(speed[moving])
        amplitude.semilogy(x, _MICRO * np.abs(values[moving]), **style)
        phase.plot(x, without_jumps(np.rad2deg(np.angle(values[moving]))), **style)
    amplitude.set_ylabel(f'amplitude, zero-to-peak [u{channels[0].unit}]')
    legend_below(figure, amplitude)
    figure.suptitle(title, fontsize=10)
    return figure


def bode_axes() -> tuple[Figure, Axes, Axes]:
    """Return a figure with axes for amplitudes, and below for phases, over the speed."""
    figure = Figure(figsize=(7.5, 5.3), layout='constrained')
    amplitude, phase = figure.subplots(2, 1, sharex=True, height_ratios=[2.0, 1.0])
    phase.set(ylabel='phase [deg]', xlabel='speed [rpm]', ylim=(-190, 190),
              yticks=range(-180, 181, 90))
    tidy(amplitude)
    tidy(phase)
    return figure, amplitude, phase


def without_jumps(degrees: FloatArray) -> FloatArray:
    """Break a line where its phase passes from one end of the scale to the other."""
    jump = np.abs(np.diff(degrees, prepend=degrees[:1])) > 300.0
    return np.where(jump, np.nan, degrees)


def title_of(critical: CriticalSpeed) -> str:
    """Return which critical speed this is, where it whirls and how much it is damped."""
    return (f'critical speed {rad_s_to_rpm(critical.speed):.0f} rpm, '
            f'{"forward" if critical.whirl > 0 else "backward"}, damping ratio '
            f'{critical.damping_ratio:.2g}, amplification factor '
            f'{critical.amplification_factor:.3g}')


def drawn_criticals(
    criticals: Sequence[CriticalSpeed], predictor: Predictor,
) -> list[CriticalSpeed]:
    """Return the most amplified critical speeds at which a response is known, slowest first."""
    felt = [one for one in criticals if one.amplification_factor >= FELT
            and predictor.covers(np.array([one.speed]))[0]]
    largest = sorted(felt, key=lambda one: -one.amplification_factor)[:_LARGEST_DRAWN]
    return sorted(largest, key=lambda one: one.speed)


def orbits(case: Case, predictor: Predictor, criticals: Sequence[CriticalSpeed]) -> Figure:
    """Draw the orbit of every station at critical speeds, a row for each."""
    stations = case.rotor.orbits
    figure = Figure(figsize=(max(1.9 * len(stations) + 0.6, 6.5), 2.4 * len(criticals) + 0.6),
                    layout='constrained')
    rows = figure.subfigures(len(criticals), 1, squeeze=False)[:, 0]
    for critical, row in zip(criticals, rows, strict=True):
        motion = predictor.predict(np.array([critical.speed])).displacement[0]
        every = row.subplots(1, len(stations), squeeze=False)[0]
        for station, axes in zip(stations, every, strict=True):
            seen = motion[[predictor.channels.index(channel) for channel in station.channels]]
            x, z = (_over_a_turn(complex(amplitude)) for amplitude in station.turn @ seen)
            axes.plot(x, z, color=COLOURS[0])
            axes.plot(x[0], z[0], 'o', color=COLOURS[1], markersize=4)
            axes.set_aspect('equal', adjustable='datalim')
            axes.tick_params(labelsize=6)
            axes.locator_params(nbins=4)
            axes.grid(alpha=0.3)
            axes.set_title(station.name, fontsize=7)
            axes.set_xlabel('x [um]', fontsize=7)
        every[0].set_ylabel('z [um]', fontsize=7)
        row.suptitle(title_of(critical), fontsize=8)
    figure.suptitle(f'{case.name}: response to its unbalance, orbits from the dot (t = 0) on',
                    fontsize=10)
    return figure


def _over_a_turn(amplitude: complex) -> FloatArray:
    return np.asarray(_MICRO * np.real(amplitude * np.exp(1j * _TURN)))


def shapes(case: Case, model: CoupledModel, criticals: Sequence[CriticalSpeed]) -> Figure:
    """Draw the deflected shaft at critical speeds, solved at the nodes of the mesh."""
    nodes = case.rotor.node_positions
    nodes = nodes[::1 + len(nodes) // _LARGEST_DRAWN_NODES]
    probes = tuple(Probe(f'node_{number}', place) for number, place in enumerate(nodes))
    everywhere = replace(model, rotor=replace(case.rotor, probes=probes))
    first = everywhere.channels.index(across(probes[0].name)[0])
    speed = np.array([critical.speed for critical in criticals])
    solved = everywhere.unbalance_response(speed, case.unbalance).displacement
    motion = solved[:, first:first + 2 * len(nodes)].reshape(len(criticals), -1, 2)
    figure = Figure(figsize=(7.5, 1.8 * len(criticals) + 0.7), layout='constrained')
    rows = figure.subplots(len(criticals), 1, sharex=True, squeeze=False)[:, 0]
    for critical, whole, shape, axes in zip(criticals, solved, motion, rows, strict=True):
        angle = np.angle(shape.flat[np.abs(shape).argmax()])
        housings = [[whole[everywhere.channels.index(channel)]
                     for channel in across(bearing.name, HOUSING)]
                    for bearing in case.rotor.bearings]
        draw_shape(axes, case, nodes, _MICRO * np.real(shape * np.exp(-1j * angle)),
                   _MICRO * np.real(np.array(housings) * np.exp(-1j * angle)))
        axes.set_ylabel('deflection [um]', fontsize=8)
        axes.set_title(title_of(critical), fontsize=8)
    legend_below(figure, rows[0])
    rows[-1].set_xlabel('y along the shaft [m]')
    figure.suptitle(f'{case.name}: response to its unbalance when the shaft is bent most; '
                    'dotted: bearings, broad: discs', fontsize=9)
    return figure


def draw_shape(
    axes: Axes, case: Case, nodes: FloatArray, shaft: FloatArray, housings: FloatArray,
) -> None:
    """Draw x and z of the shaft (k, 2) and of the housings (b, 2), and where they stand."""
    places = [bearing.position for bearing in case.rotor.bearings]
    for column, (axis, line) in enumerate((('x', '-'), ('z', '--'))):
        axes.plot(nodes, shaft[:, column], linestyle=line, color=COLOURS[column],
                  label=f'{axis} of the shaft')
    for column, (axis, mark) in enumerate((('x', 's'), ('z', 'D'))):
        axes.plot(places, housings[:, column], mark, color=COLOURS[column], markersize=5,
                  fillstyle='none', label=f'{axis} of the housings')
    for place in places:
        axes.axvline(place, color='grey', linestyle=':', linewidth=0.8)
    for disc in case.rotor.discs:
        axes.axvline(disc.position, color='#d9a441', linewidth=1.5, alpha=0.6)
    axes.axhline(0.0, color='black', linewidth=0.5)
    tidy(axes)


def trend(
    time_s: FloatArray, speed: FloatArray, amplitude: FloatArray, *, channels: Sequence[Channel],
    title: str,
) -> Figure:
    """Draw speed (n,) [rad/s] and amplitudes (n, c) [m] of all that is not a rotation."""
    figure = Figure(figsize=(7.5, 6.0), layout='constrained')
    top, bottom = figure.subplots(2, 1, sharex=True, height_ratios=[1.0, 2.5])
    top.plot(time_s, rad_s_to_rpm(speed), color='black')
    top.set_ylabel('speed [rpm]')
    moved = [index for index, channel in enumerate(channels)
             if channel.axis in ACROSS and channel.part != JOURNAL]
    for number, index in enumerate(moved):
        bottom.semilogy(time_s, _MICRO * np.maximum(amplitude[:, index], _SMALLEST_DRAWN),
                        color=COLOURS[number // 2 % len(COLOURS)], linewidth=1.0,
                        linestyle=('-', '--')[number % 2], label=channels[index])
    bottom.set(xlabel='time [s]', ylabel='amplitude, zero-to-peak [um]')
    bottom.set_ylim(bottom=_LOWEST_TREND)
    bottom.legend(fontsize=7, ncols=5, loc='upper center', bbox_to_anchor=(0.5, -0.14))
    tidy(top)
    tidy(bottom)
    figure.suptitle(title, fontsize=10)
    return figure


def legend_below(figure: Figure, *sources: Axes, columns: int = 4) -> None:
    """Name what the axes show below them all, where it hides no data; each name once."""
    named: dict[str, Any] = {}
    for axes in sources:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            named.setdefault(label, handle)
    if named:
        figure.legend(list(named.values()), list(named), fontsize=7, ncols=columns,
                      loc='outside lower center')


def tidy(axes: Axes) -> None:
    """Give axes a light grid and small figures."""
    axes.grid(alpha=0.3)
    axes.tick_params(labelsize=8)
    axes.margins(x=0.01)


_PERCENT = 100.0


def compliance_figure(
    name: str, block: Foundation, soil: Soil, models: Mapping[str, SoilModel], omega: FloatArray,
) -> Figure:
    """
    Draw the compliance of several models below a block over a0, a row for each direction.

    Parameters
    ----------
    name : str
        Of the case.
    block, soil
        What stands on what.
    models : mapping of str to SoilModel
        By their names; the last is what the others are compared with.
    omega : (n,) float array
        Frequencies that all of them know [rad/s].

    """
    scale = block.contact.characteristic_length / soil.shear_wave_speed
    values = {label: np.diagonal(model.compliance(omega), axis1=1, axis2=2)
              for label, model in models.items()}
    dofs = np.flatnonzero(np.all([np.any(one != 0.0, axis=0) for one in values.values()], axis=0))
    figure = Figure(figsize=(7.5, 1.75 * len(dofs) + 1.0), layout='constrained')
    grid = figure.subplots(len(dofs), 3, sharex=True, squeeze=False)
    for dof, row in zip(dofs, grid, strict=True):
        _draw_dof(row, omega * scale, {label: one[:, dof] for label, one in values.items()})
        unit = 'nm/N' if len(DOFS[dof]) == 1 else 'nrad/(N m)'
        row[0].set_ylabel(f'{DOFS[dof]} [{unit}]')
        row[2].set_ylabel('[%]', fontsize=8)
    for axes, title in zip(grid[0], ('real part', 'imaginary part',
                                     f'off {list(models)[-1]},\n|difference| / |N|'), strict=True):
        axes.set_title(title, fontsize=8)
    for axes in grid[-1]:
        axes.set_xlabel('a0 [-]')
    _mark_cut_offs(grid, models.values(), scale, omega)
    legend_below(figure, grid[0, 0])
    length = 'r0' if isinstance(block.contact, Circle) else 'b'
    figure.suptitle(f'{name}: compliance of the soil below {block.name} over omega {length} / c_s;'
                    f' nu = {soil.poisson_ratio:g}, eta = {soil.loss_factor:g}', fontsize=9)
    return figure


def _mark_cut_offs(
    grid: np.ndarray, models: Iterable[SoilModel], scale: float, omega: FloatArray,
) -> None:
    """Draw a line wherever a wave of the layers begins to travel."""
    for model in models:
        for place in singular_of(model).tolist():
            if omega[0] < place < omega[-1]:
                for axes in grid.ravel():
                    axes.axvline(place * scale, color='grey', linewidth=0.6, linestyle=':',
                                 zorder=0)


def _draw_dof(row: np.ndarray, a0: FloatArray, values: Mapping[str, ComplexArray]) -> None:
    """Draw real part, imaginary part and difference of one direction in three axes."""
    real, imaginary, difference = row
    *others, reference = values.values()
    for (label, one), colour, line in zip(values.items(), COLOURS, ('-', '-.', '--'),
                                          strict=False):
        for axes, part in ((real, np.real), (imaginary, np.imag)):
            axes.plot(a0, 1e9 * part(one), color=colour, linestyle=line, label=label)
    for one, colour, line in zip(others, COLOURS, ('-', '-.'), strict=False):
        difference.plot(a0, _PERCENT * np.abs(one / reference - 1.0), color=colour,
                        linestyle=line)
    for axes in (real, imaginary, difference):
        axes.axhline(0.0, color='black', linewidth=0.5)
        tidy(axes)
        axes.tick_params(labelsize=7)
