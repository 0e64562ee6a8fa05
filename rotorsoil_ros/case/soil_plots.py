"""What the soil gives way by: cones beside infinite elements, as figures for print."""

from matplotlib.figure import Figure
import numpy as np

from rotorsoil_ros.case.plots import COLOURS, tidy
from rotorsoil_ros.physics.arrays import ComplexArray, FloatArray
from rotorsoil_ros.physics.cone import ConeModel
from rotorsoil_ros.physics.foundation import Foundation
from rotorsoil_ros.physics.infinite import InfiniteElementModel
from rotorsoil_ros.physics.soil import Circle, DOFS

_POINTS = 241
_PERCENT = 100.0


def compliance_figure(name: str, block: Foundation, infinite: InfiniteElementModel) -> Figure:
    """Draw the compliance of both models below a block over a0, a row for each direction."""
    soil = infinite.soil
    cone = ConeModel(soil, block.contact)
    scale = block.contact.characteristic_length / soil.shear_wave_speed
    omega = np.linspace(*infinite.omega_range, _POINTS)
    values = [np.diagonal(model.compliance(omega), axis1=1, axis2=2)
              for model in (cone, infinite)]
    dofs = np.flatnonzero(np.all([np.any(one != 0.0, axis=0) for one in values], axis=0))
    figure = Figure(figsize=(7.5, 1.75 * len(dofs) + 1.0), layout='constrained')
    grid = figure.subplots(len(dofs), 3, sharex=True, squeeze=False)
    for dof, row in zip(dofs, grid, strict=True):
        _draw_dof(row, omega * scale, values[0][:, dof], values[1][:, dof])
        unit = 'nm/N' if len(DOFS[dof]) == 1 else 'nrad/(N m)'
        row[0].set_ylabel(f'{DOFS[dof]} [{unit}]')
        row[2].set_ylabel('[%]', fontsize=8)
    for axes, title in zip(grid[0], ('real part', 'imaginary part',
                                     'cone less elements / |elements|'), strict=True):
        axes.set_title(title, fontsize=8)
    for axes in grid[-1]:
        axes.set_xlabel('a0 [-]')
    grid[0, 0].legend(fontsize=7)
    length = 'r0' if isinstance(block.contact, Circle) else 'b'
    figure.suptitle(f'{name}: compliance of the soil below {block.name} over omega {length} / c_s;'
                    f' nu = {soil.poisson_ratio:g}, eta = {soil.loss_factor:g}', fontsize=9)
    return figure


def _draw_dof(
    row: np.ndarray, a0: FloatArray, cone: ComplexArray, infinite: ComplexArray,
) -> None:
    """Draw real part, imaginary part and difference of one direction in three axes."""
    real, imaginary, difference = row
    for axes, part in ((real, np.real), (imaginary, np.imag)):
        axes.plot(a0, 1e9 * part(cone), color=COLOURS[0], label='cone')
        axes.plot(a0, 1e9 * part(infinite), color=COLOURS[1], linestyle='--',
                  label='infinite elements')
    for part, line, name in ((np.real, '-', 'real'), (np.imag, '--', 'imaginary')):
        share = part(cone - infinite) / np.abs(infinite)
        difference.plot(a0, _PERCENT * share, color='black', linestyle=line, label=name)
    difference.legend(fontsize=6)
    for axes in (real, imaginary, difference):
        axes.axhline(0.0, color='black', linewidth=0.5)
        tidy(axes)
        axes.tick_params(labelsize=7)
