"""A comparison as numbers: one row per point, one document for the whole."""

from collections.abc import Iterator
import math
from typing import Any

import numpy as np

from rotorsoil_ros.case.comparison import Comparison
from rotorsoil_ros.physics.passages import Passage, PeakPair

HEADER = ('stamp_ns', 'channel', 'speed_rad_s', 'measured_amplitude', 'measured_phase_rad',
          'predicted_amplitude', 'predicted_phase_rad', 'band_low', 'band_high',
          'band_behind_rad', 'band_ahead_rad', 'residual_amplitude', 'used', 'reason')


def rows(comparison: Comparison) -> Iterator[tuple[str, ...]]:
    """Yield one row per measured point, in SI units; empty where there is no number."""
    for points in comparison.points:
        residual = np.abs(points.measured - points.predicted)
        numbers = np.stack([
            points.speed, points.amplitude, points.phase, np.abs(points.predicted),
            np.angle(points.predicted), points.low, points.high, points.behind,
            points.ahead, residual], axis=1)
        for stamp, values, reason in zip(
                points.stamp_ns.tolist(), numbers.tolist(), points.reason, strict=True):
            yield (str(stamp), points.channel,
                   *('' if math.isnan(value) else repr(value) for value in values),
                   '0' if reason else '1', str(reason))


def document(comparison: Comparison) -> dict[str, Any]:
    """Return everything but the points, in SI units, None where there is no number."""
    case = comparison.expectation.case if comparison.expectation else None
    content = {
        'machine': comparison.run.machine,
        'synthetic': comparison.run.is_synthetic,
        'case': case.name if case else None,
        'case_file': str(case.path) if case else None,
        'verdict': str(comparison.verdict),
        'failures': comparison.failures,
        'remarks': comparison.remarks,
        'rules': {
            'tolerance_s': comparison.rules.matching.tolerance,
            'slow_roll_speed_rad_s': comparison.rules.matching.slow_roll_speed,
            'amplitude_margin': comparison.rules.amplitude_margin,
            'inside_share': comparison.rules.inside_share,
            'critical_margin': comparison.rules.critical_margin,
            'shear_modulus_factor': None if comparison.expectation is None else
            comparison.expectation.spread.shear_modulus_factor,
            'zones': comparison.rules.zones.label},
        'channels': {points.channel: {
            'points': len(points.stamp_ns), 'used': int(points.used.sum()),
            'excluded': points.excluded, 'amplitude_only': not points.has_phase,
            'runout': None if math.isnan(points.runout.real) else {
                'amplitude': abs(points.runout), 'phase_rad': float(np.angle(points.runout))},
            'bias': figures.bias, 'scatter': figures.scatter, 'ratio': figures.ratio,
            'phase_bias_rad': figures.phase_bias, 'phase_scatter_rad': figures.phase_scatter,
            'r_squared': figures.r_squared, 'share_inside_band': figures.inside,
            'share_inside_phase_band': figures.phase_inside,
        } for points, figures in zip(comparison.points, comparison.statistics, strict=True)},
        'critical_speeds': [{
            'speed_rad_s': mode.speed, 'damping_ratio': mode.damping_ratio, 'whirl': mode.whirl,
        } for mode in (comparison.expectation.criticals if comparison.expectation else ())],
        'peaks': [_peak(peak) for peak in comparison.peaks],
        'zones': [{
            'channel': entry.channel, 'source': entry.source, 'speed_rad_s': entry.speed,
            'velocity_rms_m_s': entry.velocity, 'zone': entry.zone, 'support': entry.support,
            'limits_m_s': list(entry.limits), 'constant_speed': entry.is_steady,
        } for entry in comparison.zones],
    }
    plain: dict[str, Any] = _without_nan(content)
    return plain


def _peak(peak: PeakPair) -> dict[str, Any]:
    def passage(found: Passage | None) -> dict[str, float] | None:
        return None if found is None else {
            'speed_rad_s': found.speed, 'amplitude': found.amplitude,
            'rate_rad_s2': found.rate, 'passage_number': found.number(peak.damping_ratio)}

    return {'channel': peak.channel, 'predicted': passage(peak.predicted),
            'measured': passage(peak.measured), 'deviation': peak.deviation,
            'largest_allowed_amplitude': peak.limit, 'quasi_static': peak.is_slow}


def _without_nan(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _without_nan(entry) for key, entry in value.items()}
    if isinstance(value, list):
        return [_without_nan(entry) for entry in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
