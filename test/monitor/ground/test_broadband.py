"""What comes with the ground at all other frequencies, and the coherence that guards it."""

from dataclasses import replace

from grounds import felt, RATE_HZ, RUNNING, START, traffic, YARD
import numpy as np
import pytest

import rotorsoil_ros as rs
from rotorsoil_ros.monitor.ground.broadband import Spectra
from rotorsoil_ros.monitor.vectors.history import History

HOUSING = 'fan_end_housing_x'


@pytest.fixture(scope='session')
def fan(cache):
    return rs.load('config/plant_fan.yaml', cache_directory=cache, ground={'sensors': [YARD]})


@pytest.fixture(scope='module')
def busy(fan):
    """Return what is felt for the five minutes of the note's check."""
    return felt(fan, traffic(300.0))


def heard(fan, found, *, sensor=slice(None), moving=None, seconds=300.0, hole=None):
    """Return what spectra say of a housing, the samples coming second by second."""
    history = History()
    spectra = Spectra(moving or fan.ground, ['yard'], history)
    stamps = START + np.rint(1e9 * found.time).astype(np.int64)
    channel = next(one for one in found.housings if one == HOUSING)
    for first in range(0, round(seconds * RATE_HZ), round(RATE_HZ)):
        part = slice(first, first + round(RATE_HZ))
        told = stamps[part][::25]
        history.add(told, np.full(len(told), RUNNING), np.full(len(told), np.nan))
        if hole is None or not hole[0] <= found.time[first] < hole[1]:
            spectra.take_ground('yard', stamps[part][sensor], found.sensors[0][
                :, part][:, sensor].T)
        spectra.take(channel, stamps[part], found.housings[channel][part])
        spectra.follow()
    spectra.follow(is_last=True)
    return list(spectra.rows())


def test_ground_part_is_what_the_ground_makes_of_the_housing(fan, busy):
    """The note: 0.279 by |T|^2 S_gg of 0.279 true, 0.269 mm/s rms coherent, 1X beside it."""
    [found] = heard(fan, busy)
    # What lies in the band, and not where the rotor has its lines.
    frequency = np.fft.rfftfreq(len(busy.time), 1.0 / RATE_HZ)
    spectrum = np.fft.rfft(busy.by_ground[HOUSING])
    line = RUNNING / (2.0 * np.pi)
    chosen = (frequency >= 9.9) & (frequency <= 60.1) & (
        np.abs(frequency - line) > 0.5) & (np.abs(frequency - 2.0 * line) > 0.5)
    true = np.sqrt(2.0 * np.sum(np.abs(spectrum[chosen]) ** 2)) / len(busy.time)
    assert found.ground == pytest.approx(true, rel=0.03)
    assert found.coherent == pytest.approx(true, rel=0.03)
    assert found.measured == pytest.approx(true, rel=0.03)
    assert found.coherence > 0.97
    assert found.said == f'coherence {found.coherence:.2f}'
    assert found.band == pytest.approx((10.0, 60.0))


def test_half_the_samples_of_the_ground_say_the_same(fan, busy):
    """A sensor of another rate, whose samples lie between those of the housing."""
    [every], [second] = heard(fan, busy), heard(fan, busy, sensor=slice(1, None, 2))
    assert second.band == pytest.approx((10.0, 0.25 * 0.5 * RATE_HZ))
    assert second.ground == pytest.approx(every.ground, rel=0.02)


def test_ground_that_has_nothing_to_do_with_the_housing_is_not_it(fan, busy):
    other = replace(busy, sensors=felt(fan, traffic(300.0, seed=99)).sensors)
    [found] = heard(fan, other)
    assert found.ground > 0.8 * found.measured  # by its size it could be
    assert found.coherence < 0.3
    assert found.said.startswith('not the ground')
    assert found.coherent < 0.3 * found.measured


def test_less_than_a_stretch_says_nothing(fan, busy):
    assert heard(fan, busy, seconds=20.0) == []
    [found] = heard(fan, busy, seconds=33.0)
    assert found.averages == 15


def test_stretch_with_a_hole_says_nothing(fan, busy):
    [whole], [holed] = heard(fan, busy), heard(fan, busy, hole=(70.0, 72.0))
    assert holed.averages == whole.averages - 15


def test_memory_does_not_grow_where_one_of_both_falls_silent(fan, busy):
    history = History()
    history.add(np.array([START]), np.array([RUNNING]), np.array([np.nan]))
    spectra = Spectra(fan.ground, ['yard'], history)
    stamps = START + np.rint(1e9 * busy.time).astype(np.int64)
    channel = next(iter(busy.housings))
    spectra.take(channel, stamps[:250], busy.housings[channel][:250])
    for first in range(0, len(stamps), 250):
        part = slice(first, first + 250)
        spectra.take_ground('yard', stamps[part], busy.sensors[0][:, part].T)
        spectra.follow()
    [(_, kept)] = spectra._parts.items()
    assert sum(len(part[0]) for part in kept) <= 33 * RATE_HZ


def test_lines_of_other_machines_are_left_out(fan, busy):
    """A neighbour at 18 Hz takes the middle of the band with it."""
    moving = replace(fan.ground, others=(2.0 * np.pi * 18.0,))
    [all_of_it], [less] = heard(fan, busy), heard(fan, busy, moving=moving)
    assert less.ground < 0.95 * all_of_it.ground
