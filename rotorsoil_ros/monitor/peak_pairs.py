"""Whether each resonance was passed where, and as high as, it was predicted."""

from collections.abc import Sequence

import numpy as np

from rotorsoil_ros.monitor.passage import pair, Passage, passages, PeakPair, without_ringing
from rotorsoil_ros.monitor.points import ChannelPoints, Reference
from rotorsoil_ros.monitor.quasistatic import Resonance
from rotorsoil_ros.units import rad_s_to_rpm


def peaks_of(
    channel: ChannelPoints, reference: Reference, resonances: Sequence[Resonance], *,
    margin: float,
) -> tuple[list[PeakPair], list[Passage]]:
    """
    Pair the peaks of one channel, found alike on both sides; and tell measured lobes.

    Parameters
    ----------
    channel, reference : ChannelPoints, Reference
        A measured channel, and what was predicted over the run.
    resonances : sequence of Resonance
        Critical speeds of the machine.
    margin : float
        Share by which a measured peak may exceed the band beside a predicted one.

    """
    time = (channel.stamp_ns - reference.stamp_ns[0]) * 1e-9
    expected = np.abs(channel.predicted)
    predicted = passages(time, channel.speed, expected)
    high = np.where(np.isfinite(channel.high), channel.high, expected)
    limits = [(1.0 + margin) * float(np.nanmax(np.where(
        np.abs(channel.speed / peak.speed - 1.0) <= margin, high, np.nan)))
        for peak in predicted]
    measured, lobes = without_ringing(
        passages(time, channel.speed, channel.amplitude), resonances)
    return pair(channel.channel, predicted, measured, limits=limits,
                resonances=resonances), lobes


def peak_fault(peak: PeakPair, *, margin: float) -> str:
    """Return what is wrong with a peak; nothing if all is well or nothing can be said."""
    if peak.measured is None:
        assert peak.predicted is not None
        return '' if not peak.is_slow else (
            f'{peak.channel}: the peak predicted at {rad_s_to_rpm(peak.predicted.speed):.0f} rpm '
            'was not measured')
    at = f'{peak.channel}: the peak measured at {rad_s_to_rpm(peak.measured.speed):.0f} rpm'
    if peak.predicted is None:
        return f'{at} is not predicted'
    if abs(peak.deviation) > margin:
        return (f'{at} is {100 * peak.deviation:+.1f} % from the predicted '
                f'{rad_s_to_rpm(peak.predicted.speed):.0f} rpm, allowed {100 * margin:.0f} %')
    if peak.measured.amplitude > peak.limit:
        return (f'{at} is {1e6 * peak.measured.amplitude:.3g} um high, at most '
                f'{1e6 * peak.limit:.3g} um predicted')
    return ''
