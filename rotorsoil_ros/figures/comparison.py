"""A comparison in pictures: Bode, polar, trend, residuals; predicted lines, measured dots."""

from collections.abc import Iterator
import math
from typing import Any

from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
import numpy as np

from rotorsoil_ros.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from rotorsoil_ros.channel import Channel
from rotorsoil_ros.figures.ground import ground_document, ground_figure
from rotorsoil_ros.figures.response import bode_axes, COLOURS, legend_below, tidy, without_jumps
from rotorsoil_ros.machine.peaks import resolved_speeds
from rotorsoil_ros.monitor.comparison import Comparison
from rotorsoil_ros.monitor.criteria import answer, Expectation
from rotorsoil_ros.monitor.inside import is_mixed
from rotorsoil_ros.monitor.passage import Passage, PeakPair
from rotorsoil_ros.monitor.points import ChannelPoints
from rotorsoil_ros.monitor.vectors.history import STEADY
from rotorsoil_ros.units import rad_s_to_rpm

PREDICTED, MEASURED, LEFT_OUT = COLOURS[0], COLOURS[1], '#9a9a9a'
# Apart from those of channels: limits are no measurement.
ZONE_COLOURS = {'A/B': '#6b8e23', 'B/C': '#b8860b', 'C/D': '#8b0000'}
# Measured while the speed rises, falls, and stays: mark, colour and words.
_WAYS = {1: ('^', COLOURS[1], 'run-up'), -1: ('v', COLOURS[3], 'run-down'),
         0: ('o', COLOURS[2], 'constant speed')}
# Share of its colour that a prediction has beside its measurement.
_TINT = 0.55

_MICRO = 2e6  # um, or urad, peak-to-peak
_MILLI = 1e3
_MOST_LINES = 6
_LONGEST_LABEL = 48


def all_figures(comparison: Comparison) -> Iterator[tuple[str, str, Figure]]:
    """Yield file name, caption and figure of every picture."""
    for points in comparison.points:
        yield (f'bode_{points.channel}', f'{points.channel}: amplitude and phase over speed',
               bode(comparison, points))
        if np.isfinite(points.phase).any():
            yield (f'polar_{points.channel}', f'{points.channel}: the vectors',
                   polar(points, comparison))
    if comparison.points:  # everything measured may have been refused
        yield 'trend', 'Trend', trend(comparison)
        yield 'residuals', 'Measured less predicted vectors', residuals(comparison)
    if comparison.ground is not None and comparison.ground.shares:
        yield ('ground', 'What the ground does, and what is left without it',
               ground_figure(comparison, comparison.ground))


def _label(points: ChannelPoints) -> str:
    """Return the name of a channel, cut where a stranger's would fill the picture."""
    name = str(points.channel)
    return name if len(name) <= _LONGEST_LABEL else f'{name[:_LONGEST_LABEL]}...'


def _unit(channel: Channel) -> str:
    return f'u{channel.unit}'


def bode(comparison: Comparison, points: ChannelPoints) -> Figure:
    """Draw amplitude and phase of a channel over speed: line, band, points used and left out."""
    figure, amplitude, phase = bode_axes()
    _draw_prediction(amplitude, phase, comparison, points)
    _draw_band(amplitude, phase, points)
    measured = _MICRO * points.amplitude
    speed = rad_s_to_rpm(points.speed)
    for chosen, style in _kinds(points, comparison):
        amplitude.plot(speed[chosen], measured[chosen], **style)
        phase.plot(speed[chosen], np.rad2deg(_wrapped(points.phase[chosen])),
                   **{**style, 'label': None})
    _draw_criticals(amplitude, comparison.expectation)
    if not np.isfinite(points.phase).any():
        phase.text(0.5, 0.9, 'no phase measured', transform=phase.transAxes, ha='center',
                   va='top', fontsize=8)
    positive = measured[np.isfinite(measured) & (measured > 0.0)]
    if len(positive):
        amplitude.set_ylim(bottom=0.3 * float(np.percentile(positive, 1.0)))
    amplitude.set_yscale('log')
    amplitude.set_ylabel(f'amplitude, peak-to-peak [{_unit(points.channel)}]')
    if len(speed) and np.isfinite(speed).any():
        phase.set_xlim(float(np.nanmin(speed)), float(np.nanmax(speed)) + 1e-6)
    legend_below(figure, amplitude, columns=3)
    figure.suptitle(f'{comparison.run.title}: {_label(points)}, 1X', fontsize=10)
    return figure


def _draw_prediction(
    amplitude: Axes, phase: Axes, comparison: Comparison, points: ChannelPoints,
) -> None:
    """Draw the prediction that points were held against, and the steady one at all speeds."""
    expectation = comparison.expectation
    follows = len(expectation.table.poles) > 0
    given = np.isfinite(points.predicted)
    # What follows the changes of the speed comes in the order of time.
    order = np.flatnonzero(given) if follows else (
        np.flatnonzero(given)[np.argsort(points.speed[given], kind='stable')])
    speed, vector = points.speed[order], points.predicted[order]
    unbalances = comparison.run.unbalances
    if points.channel in expectation.table.channels and len(unbalances) == 1 and len(speed):
        predictor = expectation.table.predictor(unbalances[0][1])
        dense = resolved_speeds(predictor)
        dense = dense[(dense >= speed.min()) & (dense <= speed.max())]
        if len(dense):
            column = expectation.table.channels.index(points.channel)
            steady = answer(predictor, dense)[:, column]
            if not follows:
                speed, vector = dense, steady
            else:
                _draw_vectors(amplitude, phase, dense, steady, color=PREDICTED, linewidth=0.8,
                              linestyle='--', label='predicted at constant speed')
    _draw_vectors(amplitude, phase, speed, vector, color=PREDICTED, linewidth=1.2,
                  label='predicted')


def _draw_vectors(
    amplitude: Axes, phase: Axes, speed: FloatArray, vector: ComplexArray, *, label: str,
    **style: Any,
) -> None:
    """Draw vectors over speed [rad/s]: the phase is not drawn across a whole turn."""
    amplitude.plot(rad_s_to_rpm(speed), _MICRO * np.abs(vector), label=label, **style)
    phase.plot(rad_s_to_rpm(speed), without_jumps(np.rad2deg(np.angle(vector))), **style)


def _draw_band(amplitude: Axes, phase: Axes, points: ChannelPoints) -> None:
    # Where the machine is unstable there is no answer, but a band of those that are not.
    given = np.flatnonzero(np.isfinite(points.low) & np.isfinite(points.predicted))
    if not len(given):
        return
    given = given[np.argsort(points.speed[given], kind='stable')]
    speed = rad_s_to_rpm(points.speed[given])
    style: dict[str, Any] = {'color': PREDICTED, 'alpha': 0.18, 'linewidth': 0.0}
    amplitude.fill_between(speed, _MICRO * points.low[given], _MICRO * points.high[given],
                           label='as far as the soil is known', **style)
    middle = np.unwrap(np.angle(points.predicted[given]))
    low, high = (np.rad2deg(middle + end[given]) for end in (points.behind, points.ahead))
    turns = range(math.floor(low.min() / 360.0) - 1, math.ceil(high.max() / 360.0) + 2)
    for turn in turns:  # what leaves the axes at one end enters at the other
        phase.fill_between(speed, low - 360.0 * turn, high - 360.0 * turn, **style)


def _kinds(
    points: ChannelPoints, comparison: Comparison,
) -> Iterator[tuple[BoolArray, dict[str, Any]]]:
    """Yield the points that are used, by where the speed goes, and those left out, by reason."""
    ways = _ways(points, comparison)
    for way, (marker, colour, words) in _WAYS.items():
        chosen = points.used & (ways == way)
        if chosen.any():
            yield chosen, {'color': colour, 'marker': marker, 'markersize': 3.0,
                           'linestyle': 'none',
                           'label': f'measured, {words} ({int(chosen.sum())})'}
    for marker, (reason, number) in zip('x+1234*', points.excluded.items(), strict=False):
        chosen = np.array([str(own) == reason for own in points.reason])
        yield chosen, {'color': LEFT_OUT, 'marker': marker, 'markersize': 3.5,
                       'linestyle': 'none', 'label': f'measured, {reason} ({number})'}


def _ways(points: ChannelPoints, comparison: Comparison) -> IntArray:
    """Return whether the speed rises (1), falls (-1) or stays (0) at each point, (n,)."""
    run = comparison.run
    if not len(run.time):
        return np.zeros(len(points.stamp_ns), dtype=int)
    at = (points.stamp_ns - run.stamp_ns[0]) * 1e-9
    # Over a second, so that neither a jitter nor two speeds of one stamp tells a direction.
    before, after = (np.interp(at + half, run.time, run.speed) for half in (-0.5, 0.5))
    moving = np.abs(after - before) > STEADY * np.abs(before)
    return np.where(moving, np.sign(after - before), 0.0).astype(int)


def _draw_criticals(axes: Axes, expectation: Expectation) -> None:
    for number, mode in enumerate(expectation.criticals):
        axes.axvline(rad_s_to_rpm(mode.speed), color='black', linestyle=':', linewidth=0.7,
                     label='predicted critical speeds' if number == 0 else None)


def _wrapped(phase: FloatArray) -> FloatArray:
    return np.asarray(np.angle(np.exp(1j * phase)))


def polar(points: ChannelPoints, comparison: Comparison) -> Figure:
    """Draw the vectors of a channel, predicted as a line, measured as dots."""
    figure = Figure(figsize=(7.5, 5.4), layout='constrained')
    axes = figure.subplots(subplot_kw={'projection': 'polar'})
    given = np.isfinite(points.predicted)
    order = np.argsort(points.speed[given], kind='stable')
    line = points.predicted[given][order]
    for chosen, style in _kinds(points, comparison):
        axes.plot(points.phase[chosen], _MICRO * points.amplitude[chosen], **style)
    shown = _MICRO * points.amplitude[np.isfinite(points.phase)]
    largest = 1.15 * max(float(np.nanmax(shown, initial=0.0)), 1e-9)
    axes.plot(np.angle(line), np.where(_MICRO * np.abs(line) <= largest, _MICRO * np.abs(line),
                                       np.nan), color=PREDICTED, linewidth=1.2,
              label='predicted' if np.all(_MICRO * np.abs(line) <= largest)
              else 'predicted (its larger vectors are off the scale)')
    axes.set_ylim(0.0, largest)
    axes.tick_params(labelsize=7)
    axes.legend(fontsize=7, loc='upper left', bbox_to_anchor=(1.02, 1.0))
    axes.set_title(f'{comparison.run.title}: {_label(points)}, 1X [{_unit(points.channel)}, '
                   'peak-to-peak]', fontsize=9)
    return figure


def trend(comparison: Comparison) -> Figure:
    """Draw speed, and housing velocity with its zone limits, or displacement, over time."""
    housings = [points for points in comparison.points if points.channel.is_housing]
    shown = (housings or comparison.points)[:_MOST_LINES]
    figure = Figure(figsize=(7.5, 5.8), layout='constrained')
    top, bottom = figure.subplots(2, 1, sharex=True, height_ratios=[1.0, 2.6])
    start = comparison.run.stamp_ns[0]
    top.plot(comparison.run.time, rad_s_to_rpm(comparison.run.speed), color='black',
             linewidth=1.0)
    top.set_ylabel('speed [rpm]')
    for number, points in enumerate(shown):
        time = (points.stamp_ns - start) * 1e-9
        scale = (_MILLI * points.speed / math.sqrt(2.0) if housings
                 else np.full(len(time), _MICRO))
        colour = COLOURS[number % len(COLOURS)]
        bottom.plot(time, scale * points.amplitude, '.', color=colour, markersize=3.5,
                    label=f'{_label(points)} measured')
        order = np.argsort(time, kind='stable')
        bottom.plot(time[order], (scale * np.abs(points.predicted))[order], linewidth=1.4,
                    color=_tinted(colour), label=f'{_label(points)} predicted')
    if housings:
        _draw_zones(bottom, comparison)
    bottom.set_yscale('log')
    bottom.set(xlabel='time [s]', ylabel='housing velocity, 1X, rms [mm/s]' if housings
               else f'amplitude, peak-to-peak [{_unit(shown[0].channel)}]')
    bottom.legend(fontsize=7, ncols=3, loc='upper center', bbox_to_anchor=(0.5, -0.14))
    for axes in (top, bottom):
        tidy(axes)
    figure.suptitle(f'{comparison.run.title}: trend', fontsize=10)
    return figure


def _tinted(colour: str) -> tuple[float, ...]:
    """Return a colour with white in it."""
    return tuple(1.0 - _TINT * (1.0 - part) for part in to_rgb(colour))


def _draw_zones(axes: Axes, comparison: Comparison) -> None:
    """Draw the limits of every class of support that occurs in the run."""
    classes = {entry.support: entry.limits for entry in comparison.zones}
    for support, limits in classes.items():
        for (name, colour), limit in zip(ZONE_COLOURS.items(), limits, strict=True):
            axes.axhline(_MILLI * limit, color=colour, linewidth=1.0,
                         linestyle='--' if support == 'rigid' else '-.')
            axes.annotate(f'{name} {support}', (1.0, _MILLI * limit), fontsize=6, color=colour,
                          xycoords=('axes fraction', 'data'), ha='right', va='bottom')
    if classes:
        axes.set_title(comparison.rules.zones.label, fontsize=8)


def residuals(comparison: Comparison) -> Figure:
    """Draw measured less predicted: its size over speed, and the vectors that are used."""
    figure = Figure(figsize=(7.5, 3.9), layout='constrained')
    size, plane = figure.subplots(1, 2)
    for number, points in enumerate(comparison.points[:_MOST_LINES]):
        colour, used = COLOURS[number % len(COLOURS)], points.used
        vector = _MICRO * (points.measured - points.predicted)
        left = np.abs(vector)
        if not np.isfinite(left[used]).any():
            left = np.abs(_MICRO * (points.amplitude - np.abs(points.predicted)))
        size.plot(rad_s_to_rpm(points.speed[~used]), left[~used], 'x', color=LEFT_OUT,
                  markersize=3)
        size.plot(rad_s_to_rpm(points.speed[used]), left[used], '.', color=colour, markersize=4,
                  label=_label(points))
        plane.plot(vector[used].real, vector[used].imag, '.', color=colour, markersize=4)
    size.set_yscale('log')
    size.set(xlabel='speed [rpm]', ylabel='|measured - predicted|, peak-to-peak [um]')
    plane.set(xlabel='real part, peak-to-peak [um]', ylabel='imaginary part, peak-to-peak [um]')
    plane.axhline(0.0, color='black', linewidth=0.5)
    plane.axvline(0.0, color='black', linewidth=0.5)
    plane.set_aspect('equal', adjustable='datalim')
    legend_below(figure, size, columns=3)
    size.set_title('size; grey: left out', fontsize=8)
    plane.set_title('vectors that are used', fontsize=8)
    figure.suptitle(f'{comparison.run.title}: residuals', fontsize=10)
    for axes in (size, plane):
        tidy(axes)
    return figure


HEADER = ('stamp_ns', 'channel', 'speed_rad_s', 'measured_amplitude', 'measured_phase_rad',
          'predicted_amplitude', 'predicted_phase_rad', 'band_low', 'band_high',
          'band_behind_rad', 'band_ahead_rad', 'residual_amplitude', 'ground_amplitude',
          'ground_phase_rad', 'used', 'reason')


def rows(comparison: Comparison) -> Iterator[tuple[str, ...]]:
    """Yield one row per measured point, in SI units; empty where there is no number."""
    parts = {} if comparison.ground is None else comparison.ground.parts
    for points in comparison.points:
        # Where another machine is in a vector nobody knows what is left of this one.
        residual = np.where(is_mixed(points.reason), np.nan,
                            np.abs(points.measured - points.predicted))
        ground = parts.get(points.channel, np.full(len(residual), complex(math.nan, math.nan)))
        numbers = np.stack([
            points.speed, points.amplitude, points.phase, np.abs(points.predicted),
            np.angle(points.predicted), points.low, points.high, points.behind,
            points.ahead, residual, np.abs(ground), np.angle(ground)], axis=1)
        for stamp, values, reason in zip(
                points.stamp_ns.tolist(), numbers.tolist(), points.reason, strict=True):
            yield (str(stamp), points.channel,
                   *('' if math.isnan(value) else repr(value) for value in values),
                   '0' if reason else '1', str(reason))


def document(comparison: Comparison) -> dict[str, Any]:
    """Return everything but the points, in SI units, None where there is no number."""
    expectation, case = comparison.expectation, comparison.expectation.case
    content = {
        'machine': comparison.run.machine,
        'synthetic': comparison.run.is_synthetic,
        'case': case.name, 'case_file': str(case.path),
        'verdict': str(comparison.verdict),
        'failures': comparison.failures,
        'remarks': comparison.remarks,
        'rules': {
            'tolerance_s': comparison.rules.matching.tolerance,
            'slow_roll_speed_rad_s': comparison.rules.matching.slow_roll_speed,
            'amplitude_margin': comparison.rules.amplitude_margin,
            'inside_share': comparison.rules.inside_share,
            'critical_margin': comparison.rules.critical_margin,
            'shear_modulus_factor': expectation.case.uncertainty.shear_modulus_factor,
            'zones': comparison.rules.zones.label},
        'channels': {points.channel: {
            'points': len(points.stamp_ns), 'used': int(points.used.sum()),
            'excluded': points.excluded, 'amplitude_only': not points.has_phase,
            'runout': _runout(comparison, points),
            'bias': figures.bias, 'scatter': figures.scatter, 'ratio': figures.ratio,
            'phase_bias_rad': figures.phase_bias, 'phase_scatter_rad': figures.phase_scatter,
            'r_squared': figures.r_squared, 'share_inside_band': figures.inside,
            'share_inside_phase_band': figures.phase_inside,
        } for points, figures in zip(comparison.points, comparison.statistics, strict=True)},
        'critical_speeds': [{
            'speed_rad_s': mode.speed, 'damping_ratio': mode.damping_ratio, 'whirl': mode.whirl,
        } for mode in expectation.criticals],
        'peaks': [_peak(peak) for peak in comparison.peaks],
        'zones': [{
            'channel': entry.channel, 'source': entry.source, 'speed_rad_s': entry.speed,
            'velocity_rms_m_s': entry.velocity, 'zone': entry.zone, 'support': entry.support,
            'limits_m_s': list(entry.limits), 'constant_speed': entry.is_steady,
            **({'shares': dict(entry.shares)} if entry.shares else {}),
        } for entry in comparison.zones],
        'ground': None if comparison.ground is None else ground_document(comparison.ground),
    }
    plain: dict[str, Any] = _without_nan(content)
    return plain


def _runout(comparison: Comparison, points: ChannelPoints) -> dict[str, float] | None:
    runout = comparison.runout.of(points.channel)
    return None if math.isnan(runout.real) else {
        'amplitude': abs(runout), 'phase_rad': float(np.angle(runout))}


def _peak(peak: PeakPair) -> dict[str, Any]:
    def passage(found: Passage | None) -> dict[str, float] | None:
        return None if found is None else {
            'speed_rad_s': found.speed, 'amplitude': found.amplitude,
            'rate_rad_s2': found.rate, 'passage_number': found.number(peak.damping_ratio)}

    return {'channel': peak.channel, 'predicted': passage(peak.predicted),
            'measured': passage(peak.measured), 'deviation': peak.deviation,
            'largest_allowed_amplitude': peak.allowed.most, 'quasi_static': peak.is_slow}


def _without_nan(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _without_nan(entry) for key, entry in value.items()}
    if isinstance(value, list):
        return [_without_nan(entry) for entry in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
