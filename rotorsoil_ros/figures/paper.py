"""The seed paper's figures 6, 8 and 9, computed."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace

from matplotlib.axes import Axes
from matplotlib.figure import Figure
import numpy as np

from rotorsoil_ros.arrays import ComplexArray, FloatArray
from rotorsoil_ros.case.config import Case
from rotorsoil_ros.channel import across, DOFS
from rotorsoil_ros.figures.response import legend_below
from rotorsoil_ros.ground.cone import ConeModel
from rotorsoil_ros.ground.soil import RigidSoil, SoilModel
from rotorsoil_ros.machine.coupled import CoupledModel
from rotorsoil_ros.machine.foundation import add_mass
from rotorsoil_ros.machine.modes.campbell import campbell
from rotorsoil_ros.machine.peaks import resolved_speeds
from rotorsoil_ros.machine.response import ResponseTable
from rotorsoil_ros.units import hz_to_rad_s, rad_s_to_hz, rad_s_to_rpm

# Masses that the paper compares foundations with [kg], and their inertia about y [kg m^2]:
# its pedestals (sec. 2.4), and shaft with discs (table 1).
PEDESTALS, PEDESTAL_INERTIA, ROTATING = 32.8, 0.939, 4.2

_STIFFNESS_RATIOS = (1.0, 10.0, 100.0)
_RESPONSE_RATIOS = (1.0, 5.0, 100.0)
# The paper's unbalance: 14 mm of eccentricity on disc 1, kept to compare with its axes [kg m].
_UNBALANCE = 0.01
_HIGHEST_HZ = 150.0
_LOWEST_DRAWN = 1e-5  # [m]
_COLOURS = ('#0072b2', '#d55e00', '#009e73', '#000000')


@dataclass(frozen=True)
class PaperFigure:
    """A figure and its numbers: columns of equal length by name, complex or not."""

    name: str
    figure: Figure
    columns: Mapping[str, FloatArray | ComplexArray]


def paper_figures(case: Case, infinite: SoilModel) -> Iterator[PaperFigure]:
    """
    Yield the figures.

    Parameters
    ----------
    case : Case
        The paper's machine; one block on a soil.
    infinite : SoilModel
        Infinite elements for that soil and block.

    """
    assert case.soil is not None
    supports = {'infinite elements': infinite,
                'cone': ConeModel(case.soil, case.foundations[0].contact)}
    yield _supporting_structure(case, supports)
    yield _modelling_technique(case, {'rigid': RigidSoil(), **supports})
    yield _mass_ratios(case, supports)


def _with_block(case: Case, model: SoilModel, mass: float, inertia_y: float) -> CoupledModel:
    """Return the machine with a block of another mass in the contact plane."""
    block = replace(case.foundations[0], mass=mass, centre_of_gravity_height=0.0,
                    inertia=(inertia_y, inertia_y, 2.0 * inertia_y))
    return CoupledModel(case.rotor, (block,), (model,))


def _plate_inertia(case: Case, mass: float) -> float:
    """Return the inertia about y of a flat plate as wide as the contact, m (2 b)^2 / 12."""
    return mass * (2.0 * case.foundations[0].contact.characteristic_length) ** 2 / 12.0


def _supporting_structure(case: Case, supports: Mapping[str, SoilModel]) -> PaperFigure:
    """Figure 6: stiffness of soil, block and pedestals at the shaft, eqs. (9) and (10)."""
    omega = hz_to_rad_s(np.linspace(1.0, 300.0, 300))
    columns: dict[str, FloatArray | ComplexArray] = {'frequency_hz': rad_s_to_hz(omega)}
    figure = Figure(figsize=(10.0, 7.0), layout='constrained')
    figure.suptitle('Figure 6: stiffness of soil + block + pedestals at the shaft, mf / ms')
    grid = figure.subplots(2, 2, sharex=True)
    for ratio, colour in zip(_STIFFNESS_RATIOS, _COLOURS, strict=False):
        mass = ratio * PEDESTALS
        inertia = _plate_inertia(case, mass) + PEDESTAL_INERTIA
        for name, model in supports.items():
            block = _with_block(case, model, mass + PEDESTALS, inertia).foundations[0]
            rows = block.seat_rows(position=block.centre_y, height=case.rotor.shaft_height)
            seat = rows @ add_mass(model.compliance(omega), block.mass_matrix, omega) @ rows.T
            for row, entry in zip(grid, ('zz', 'xx'), strict=True):
                dof = int(entry == 'zz')
                stiffness = 1.0 / seat[:, dof, dof]
                columns[f'k_{entry} {name} mf/ms {ratio:g} [N/m]'] = stiffness
                for axes, part in zip(row, (stiffness.real, stiffness.imag), strict=True):
                    axes.plot(rad_s_to_hz(omega), 1e-6 * part, color=colour,
                              linestyle='-' if name == 'cone' else '--',
                              label=f'{ratio:g} {name}')
    for row, entry in zip(grid, ('zz', 'xx'), strict=True):
        for axes, name in zip(row, ('real', 'imaginary'), strict=True):
            axes.set_ylabel(f'{name} part of k_{entry} [MN/m]')
            axes.set_xlabel('frequency [Hz]')
            axes.grid(color='0.9')
            axes.set_xlim(0.0, 300.0)
    # The heaviest block leaves the frame, where the others can be told apart.
    for row, top in zip(grid, (400.0, 150.0), strict=True):
        row[0].set_ylim(-2.0 * top, 0.5 * top)
        row[1].set_ylim(0.0, 2.5 * top)
    legend_below(figure, grid[0, 0])
    return PaperFigure('figure_6', figure, columns)


def _modelling_technique(case: Case, supports: Mapping[str, SoilModel]) -> PaperFigure:
    """Figure 8: receptance of disc 1 at rest on three supports, block of 42 kg."""
    mass = case.foundations[0].mass
    models = {name: _with_block(case, model, mass, _plate_inertia(case, mass))
              for name, model in supports.items()}
    omega = _resolving(models.values())
    columns: dict[str, FloatArray | ComplexArray] = {'frequency_hz': rad_s_to_hz(omega)}
    figure = Figure(figsize=(8.0, 5.0), layout='constrained')
    axes = figure.subplots()
    channel, _ = across(case.rotor.discs[0].name)
    for (name, model), colour in zip(models.items(), _COLOURS, strict=False):
        found = model.frequency_response(omega, speed=0.0, channel=channel)
        values = found.displacement[:, model.channels.index(channel)]
        columns[f'{channel} {name} [m/N]'] = values
        axes.plot(rad_s_to_hz(omega), np.abs(values), color=colour, label=name,
                  linestyle='--' if name == 'infinite elements' else '-')
    axes.set_title(f'Figure 8: disc 1 under a horizontal force on it, 0 rpm, block of {mass:g} kg')
    axes.set_ylabel('displacement per force [m/N]')
    _finish(axes, 'frequency [Hz]')
    return PaperFigure('figure_8', figure, columns)


def _resolving(models: Iterable[CoupledModel]) -> FloatArray:
    """Return frequencies [rad/s] that crowd at the natural frequencies at rest."""
    highest = hz_to_rad_s(_HIGHEST_HZ)
    parts = [np.linspace(hz_to_rad_s(0.25), highest, 600)]
    for model in models:
        still = campbell(model, np.zeros(1), 8)
        for natural in still.omega[0][np.isfinite(still.omega[0])]:
            offset = np.logspace(-9.0, -1.5, 150)
            parts += [natural * (1.0 - offset), natural * (1.0 + offset)]
    omega: FloatArray = np.unique(np.concatenate(parts))
    return np.asarray(omega[(omega >= parts[0].min()) & (omega <= highest)])


def _mass_ratios(case: Case, supports: Mapping[str, SoilModel]) -> PaperFigure:
    """Figure 9: unbalance response of disc 1 for several foundation masses."""
    speed_range = (hz_to_rad_s(1.0), hz_to_rad_s(_HIGHEST_HZ))
    unbalance = np.zeros(len(case.rotor.discs), dtype=complex)
    unbalance[0] = _UNBALANCE
    cases = {f'mf/m {ratio:g} {name}': _with_block(
        case, model, ratio * ROTATING, _plate_inertia(case, ratio * ROTATING))
        for name, model in supports.items() for ratio in _RESPONSE_RATIOS}
    mass = case.foundations[0].mass
    cases['rigid'] = _with_block(case, RigidSoil(), mass, _plate_inertia(case, mass))
    predictors = {name: ResponseTable.build(model, speed_range).predictor(unbalance)
                  for name, model in cases.items()}
    speed = np.unique(np.concatenate([resolved_speeds(one) for one in predictors.values()]))
    speed = speed[np.all([one.covers(speed) for one in predictors.values()], axis=0)]
    columns: dict[str, FloatArray | ComplexArray] = {'speed_hz': rad_s_to_hz(speed)}
    figure = Figure(figsize=(8.0, 5.0), layout='constrained')
    axes = figure.subplots()
    channel, _ = across(case.rotor.discs[0].name)
    for name, predictor in predictors.items():
        values = predictor.predict(speed).displacement[:, predictor.channels.index(channel)]
        columns[f'{channel} {name} [m]'] = values
        ratio = next((i for i, r in enumerate(_RESPONSE_RATIOS) if f'mf/m {r:g} ' in name), 3)
        # Rigid ground behind: its endless peaks would hide those on soil.
        axes.plot(rad_s_to_hz(speed), np.abs(values), color=_COLOURS[ratio],
                  linewidth=0.7 if name == 'rigid' else 1.0, zorder=1.5 if name == 'rigid' else 2,
                  linestyle='--' if 'infinite' in name else '-', label=name)
    axes.set_title(f'Figure 9: disc 1 under {_UNBALANCE:g} kg m of unbalance; the peaks on rigid '
                   'ground leave the scale', fontsize=9)
    axes.set_ylabel('amplitude, zero-to-peak [m]')
    _finish(axes, 'speed [turns/s]')
    # The story is what soil makes of the peaks, not 1e4 m without any damping.
    on_soil = [np.abs(values).max() for name, values in columns.items()
               if name.startswith(str(channel)) and ' rigid ' not in name]
    axes.set_ylim(_LOWEST_DRAWN, 3.0 * max(on_soil))
    return PaperFigure('figure_9', figure, columns)


def _finish(axes: Axes, label: str) -> None:
    axes.set_yscale('log')
    axes.set_xlabel(label)
    axes.set_xlim(0.0, _HIGHEST_HZ)
    axes.grid(color='0.9')
    assert isinstance(axes.figure, Figure)
    legend_below(axes.figure, axes)


def claim_numbers(case: Case, infinite: SoilModel) -> list[tuple[str, float, str]]:
    """
    Return what the paper's claims are to be held against: name, value and unit.

    Parameters
    ----------
    case : Case
        The paper's machine.
    infinite : SoilModel
        Infinite elements for its soil and block.

    """
    assert case.soil is not None
    cone = ConeModel(case.soil, case.foundations[0].contact)
    length = case.foundations[0].contact.characteristic_length
    speed = case.soil.shear_wave_speed
    numbers = [('c_s', speed, 'm/s'), ('c_p', case.soil.pressure_wave_speed, 'm/s')]
    numbers += [(f'speed at a0 = {a0:g}', rad_s_to_rpm(a0 * speed / length), 'rpm')
                for a0 in (0.1, 2.5)]
    for a0 in (0.1, 0.5, 1.0, 2.5):
        omega = np.array([a0 * speed / length])
        ours, theirs = (1.0 / np.diagonal(model.compliance(omega)[0])
                        for model in (cone, infinite))
        for dof in (0, 2, 4):
            for part in ('real', 'imag'):
                ratio = float(getattr(ours[dof], part) / getattr(theirs[dof], part))
                numbers.append((f'a0 = {a0:g}: cone over infinite elements, {part} part of the '
                                f'stiffness {DOFS[dof]}', ratio, '-'))
    static = 1.0 / float(infinite.compliance(np.array([0.0]))[0, 2, 2].real)
    still = np.zeros(1)
    bearing = case.rotor.bearings[0].dynamic_stiffness(still, still)[0, 1, 1].real
    numbers.append(('vertical static stiffness of the soil over that of a bearing',
                    static / float(bearing), '-'))
    return numbers


def peak_numbers(figure: PaperFigure) -> list[tuple[str, float, str]]:
    """Return the highest value of each curve of a figure below and above 100 Hz, and where."""
    names = list(figure.columns)
    frequency = np.real(figure.columns[names[0]])
    numbers = []
    for name in names[1:]:
        size = np.abs(figure.columns[name])
        for part, side in ((frequency < 100.0, 'below'), (frequency >= 100.0, 'above')):
            best = int(np.argmax(np.where(part, size, -np.inf)))
            label = f'{figure.name}: peak {side} 100 Hz of {name.split(" [")[0]}'
            numbers += [(label, float(size[best]), name.split('[')[1].rstrip(']')),
                        (f'{label}, where', float(frequency[best]), 'Hz')]
    return numbers
