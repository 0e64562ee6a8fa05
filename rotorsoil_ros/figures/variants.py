"""How does vibration follow what is not decided yet? The highest velocity of a housing."""

from matplotlib.axes import Axes
from matplotlib.figure import Figure
import numpy as np

from rotorsoil_ros.arrays import FloatArray
from rotorsoil_ros.case.design.variants import Study
from rotorsoil_ros.errors import InputError
from rotorsoil_ros.figures.response import COLOURS

_VELOCITY = 'highest velocity of a housing [mm/s rms]'


def study_figure(study: Study) -> Figure:
    """
    Return a line over one key, or a map over two; what has no steady response stays empty.

    Raises
    ------
    InputError
        If there are more keys than two, or no housing.

    """
    if len(study.values) > 2:
        raise InputError(f'a picture shows one or two keys, got {len(study.values)}')
    if not any(channel.is_housing for channel in study.channels):
        raise InputError('no housing moves: nothing to draw')
    figure = Figure(figsize=(7.0, 4.6), layout='constrained')
    axes = figure.subplots()
    low, high = study.rpm.min(), study.rpm.max()
    axes.set_title(f'{low:g} rpm' if low == high else f'{low:g} to {high:g} rpm', fontsize=10)
    highest = study.highest_mm_s_rms()
    if highest.ndim == 1:
        _line(axes, study, highest)
    else:
        _map(figure, axes, study, highest)
    return figure


def _line(axes: Axes, study: Study, highest: FloatArray) -> None:
    [(key, values)] = study.values.items()
    axes.plot(values, highest, 'o-', color=COLOURS[0], markersize=4)
    for value in values[~study.is_steady]:
        axes.axvline(value, color='0.7', linestyle=':')
    if not study.is_steady.all():
        axes.plot([], [], color='0.7', linestyle=':', label='no steady response')
        axes.legend()
    axes.set(xlabel=key, ylabel=_VELOCITY, ylim=(0.0, None))
    axes.grid(visible=True, color='0.9')


def _map(figure: Figure, axes: Axes, study: Study, highest: FloatArray) -> None:
    (rows, of_rows), (columns, of_columns) = study.values.items()
    axes.set_facecolor('0.85')
    drawn = axes.pcolormesh(of_columns, of_rows, np.ma.masked_invalid(highest),
                            shading='nearest', cmap='cividis')
    figure.colorbar(drawn, ax=axes, label=_VELOCITY)
    axes.set(xlabel=columns, ylabel=rows)
    if not study.is_steady.all():
        axes.text(0.01, 0.01, 'grey: no steady response', transform=axes.transAxes, fontsize=8)
