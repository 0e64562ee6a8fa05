"""What ground that moves by itself did to a machine in a run: in numbers, and over time."""

from typing import Any

from matplotlib.figure import Figure
import numpy as np

from rotorsoil_ros.figures.response import COLOURS, legend_below, tidy
from rotorsoil_ros.monitor.comparison import Comparison
from rotorsoil_ros.monitor.ground.broadband import Broadband
from rotorsoil_ros.monitor.ground.findings import GroundFindings

_MILLI, _MICRO = 1e3, 2e6


def ground_document(findings: GroundFindings) -> dict[str, Any]:
    """Return all that is known of the ground, in SI units."""
    return {
        'once_per_turn': {one.channel: {
            'vectors': one.vectors, 'velocity_rms_m_s': one.part, 'share': one.share,
            'residual_rms': one.residual, 'residual_rms_without_ground': one.residual_less,
            'scatter': one.scatter, 'scatter_without_ground': one.scatter_less,
        } for one in findings.shares},
        'zones_without_ground': [{
            'channel': entry.channel, 'speed_rad_s': entry.speed,
            'velocity_rms_m_s': entry.velocity, 'zone': entry.zone,
            'constant_speed': entry.is_steady} for entry in findings.zones],
        'broadband': [_broadband(one) for one in findings.broadband]}


def _broadband(one: Broadband) -> dict[str, Any]:
    return {'channel': one.channel, 'sensor': one.sensor, 'band_hz': list(one.band),
            'averages': one.averages, 'measured_rms_m_s': one.measured,
            'ground_rms_m_s': one.ground, 'coherent_rms_m_s': one.coherent,
            'coherence': one.coherence, 'says': one.said}


def ground_figure(comparison: Comparison, findings: GroundFindings) -> Figure:
    """Draw measured velocity, the ground's part of it, and residuals with and without, in time."""
    most = {one.channel: one.part for one in findings.shares}
    told = sorted((points for points in comparison.points if points.channel in most),
                  key=lambda points: (points.channel.is_housing, most[points.channel]))
    # Of each direction the housing of which the ground has the largest part.
    shown = list({points.channel.axis: points for points in told}.values())
    figure = Figure(figsize=(7.5, 5.8), layout='constrained')
    top, bottom = figure.subplots(2, 1, sharex=True)
    start = comparison.run.stamp_ns[0]
    for number, points in enumerate(shown):
        part, colour = findings.parts[points.channel], COLOURS[number % len(COLOURS)]
        time = (points.stamp_ns - start) * 1e-9
        velocity = _MILLI * points.speed / np.sqrt(2.0)
        left = points.measured - points.predicted
        known = np.isfinite(part)
        for axes, values, mark, words in (
                (top, velocity * points.amplitude, '.', 'measured'),
                (top, velocity * np.abs(part), '+', 'from the ground'),
                (bottom, _MICRO * np.abs(left), '.', 'with the ground'),
                (bottom, _MICRO * np.abs(left - part), '+', 'without it')):
            axes.plot(time[known], values[known], mark, color=colour, markersize=4.0,
                      label=f'{points.channel} {words}')
    top.set_ylabel('velocity, 1X [mm/s rms]')
    bottom.set(ylabel='residual, p-p [um]', xlabel='time [s]')
    top.set_yscale('log')
    for axes in (top, bottom):
        tidy(axes)
    legend_below(figure, top, bottom, columns=2)
    figure.suptitle(f'{comparison.run.title}: what the ground does, and what is left without it',
                    fontsize=10)
    return figure
