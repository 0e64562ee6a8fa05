"""Peaks of runs against oscillators whose resonance is known."""

import math

import numpy as np
import pytest

from rotorsoil_ros.monitor.passage import (
    Allowed,
    pair,
    Passage,
    passages,
    peak_fault,
    PeakPair,
    told_once,
    without_ringing,
)
from rotorsoil_ros.monitor.quasistatic import Resonance

TIME = np.linspace(0.0, 100.0, 1001)
UP_AND_DOWN = np.interp(TIME, [0.0, 45.0, 55.0, 100.0], [50.0, 250.0, 250.0, 50.0])


def amplitude(speed, *, natural=150.0, zeta=0.05):
    return speed**2 / np.abs(natural**2 - speed**2 + 2j * zeta * natural * speed)


def rate_of(speed):
    return np.gradient(speed, TIME)


def test_peak_is_found_despite_noise():
    noise = 1.0 + 0.05 * np.random.default_rng(1).normal(size=len(TIME))
    size = amplitude(UP_AND_DOWN) * noise
    for sweep, rows in enumerate((slice(0, 500), slice(500, None))):
        [found] = passages(UP_AND_DOWN[rows], size[rows], rate_of(UP_AND_DOWN)[rows], sweep=sweep)
        assert found.sweep == sweep
        assert found.speed == pytest.approx(150.0, rel=0.03)  # five samples of a round top
        assert found.amplitude == pytest.approx(10.0, rel=0.08)
        assert found.rate == pytest.approx((1 - 2 * sweep) * 200.0 / 45.0, rel=0.01)


def test_missing_samples_do_not_matter():
    size = amplitude(UP_AND_DOWN)
    size[::3] = np.nan
    assert len(passages(UP_AND_DOWN[:500], size[:500], rate_of(UP_AND_DOWN)[:500])) == 1


def test_critical_speed_is_before_a_peak_passed_too_fast():
    # Lewis: 2.16 sqrt(rate) late without damping, in the direction of the sweep.
    assert Passage(160.0, 1.0, 25.0).critical_range(0.001) == pytest.approx((149.2, 160.0))
    assert Passage(160.0, 1.0, -25.0).critical_range(0.001) == pytest.approx((160.0, 170.8))
    assert Passage(160.0, 1.0, 25.0).critical_range(0.1) == (160.0, 160.0)


def test_lobes_after_a_fast_passage_are_its_ringing():
    large, lobe, other = (Passage(160.0, 20.0, 25.0), Passage(175.0, 9.0, 25.0),
                          Passage(165.0, 9.0, -25.0, 1))
    peaks, lobes = without_ringing([large, lobe, other], [Resonance(150.0, 0.001)])
    assert (peaks, lobes) == ([large, other], [lobe])
    peaks, lobes = without_ringing([large, lobe, other], [Resonance(150.0, 0.2)])
    assert lobes == []


def test_peaks_are_paired_with_the_closest_and_told_apart():
    predicted = [Passage(100.0, 5.0, 1.0), Passage(200.0, 8.0, 1.0), Passage(198.0, 8.0, -1.0)]
    measured = [Passage(210.0, 9.0, 1.0), Passage(400.0, 1.0, 1.0)]
    found = pair('a_x', predicted, measured,
                 allowed=[Allowed(most=limit) for limit in (6.0, 9.0, 9.5)],
                 resonances=[Resonance(95.0, 0.1), Resonance(205.0, 0.2)])
    assert [(each.predicted, each.measured) for each in found] == [
        (predicted[1], measured[0]), (predicted[0], None), (predicted[2], None),
        (None, measured[1])]
    assert found[0].deviation == pytest.approx(0.05)
    assert found[0].allowed.most == 9.0
    assert found[0].damping_ratio == 0.2
    assert found[0].is_slow
    assert math.isnan(found[1].deviation)


def test_run_up_is_not_held_against_a_run_down():
    found = pair('a_x', [Passage(100.0, 5.0, -1.0)], [Passage(100.0, 5.0, 1.0)],
                   allowed=[Allowed(most=6.0)], resonances=[])
    assert [(each.predicted is None, each.measured is None) for each in found] == [
        (False, True), (True, False)]


def test_deviation_is_zero_where_the_fast_passage_explains_it():
    [found] = pair('a_x', [Passage(152.0, 5.0, 25.0)], [Passage(160.0, 3.0, 25.0)],
                   allowed=[Allowed(most=5.0)], resonances=[Resonance(152.0, 0.001)])
    assert found.deviation == 0.0
    assert not found.is_slow


def test_peak_that_another_channel_pairs_is_told_once():
    paired = pair('a_x', [Passage(100.0, 5.0, 1.0)], [Passage(90.0, 5.0, 1.0)],
                   allowed=[Allowed(most=6.0)], resonances=[])
    alone = pair('a_z', [], [Passage(91.0, 5.0, 1.0), Passage(300.0, 5.0, 1.0)], allowed=[],
                 resonances=[])
    assert told_once(paired + alone) == [paired[0], alone[1]]


def test_peak_that_does_not_stand_out_is_not_missing():
    lost, hidden = (PeakPair('a_x', Passage(100.0, 5.0, 0.1), None, 0.1, Allowed(4.0, 6.0, shown))
                    for shown in (3.0, 9.0))
    assert 'was not measured' in peak_fault(lost, margin=0.05)
    assert peak_fault(hidden, margin=0.05) == ''
