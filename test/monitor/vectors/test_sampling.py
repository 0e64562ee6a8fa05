"""What stamps tell of when samples were taken: closed forms and counts."""

import numpy as np
import pytest

from rotorsoil_ros.monitor.vectors.refusal import Flaw, Refusal
from rotorsoil_ros.monitor.vectors.sampling import (
    end_of_packet,
    even_grids,
    image,
    sampling,
    unpacked,
)

RATE = 1000.0
EVEN = np.arange(400) / RATE


def ask(time, *, until=None):
    return sampling(time, until=time[-1] if until is None else until, turn_rate=25.0, turns=10.0)


@pytest.mark.parametrize('size', [2, 4, 16, 64])
@pytest.mark.parametrize('apart', [0.0, 2e-6, 20e-6])
def test_packets_are_named_with_their_size(size, apart):
    number = np.arange(384)
    found = ask(EVEN[number // size * size] + apart * (number % size))
    assert found.flaw == Flaw.PACKETS
    assert f'packets of about {size}:' in found.text


def test_random_times_are_no_packets():
    found = ask(np.sort(np.random.default_rng(0).uniform(0.0, 0.4, size=400)))
    assert not isinstance(found, Refusal)
    assert not found.is_ordered  # as if by chance


@pytest.mark.parametrize('turns, is_kept', [(3.9, True), (4.1, False)])
def test_hole_of_more_than_four_turns_is_told(turns, is_kept):
    hole = turns / 25.0
    inside = (EVEN < 0.1) | (hole + 0.099 < EVEN)
    for found in (ask(EVEN[inside]), ask(EVEN[EVEN < 0.2], until=0.2 + hole)):
        assert isinstance(found, Refusal) != is_kept
        if not is_kept:
            assert found.text.startswith('samples missing over 0.16')


@pytest.mark.parametrize('lost', [0.1, 0.3, 0.6])
def test_rate_is_that_of_the_sensor_where_samples_are_lost(lost):
    kept = np.random.default_rng(1).random(400) > lost
    found = ask(EVEN[kept])
    assert found.has_lost
    assert found.rate == pytest.approx(RATE, rel=1e-9)
    [grid] = even_grids(EVEN[kept], found)
    np.testing.assert_allclose(grid, EVEN[kept], atol=1e-12)


# Share of running speeds of 10 to 50 Hz at which a harmonic up to 10X falls on 1X and on 2X.
@pytest.mark.parametrize('rate, first, second', [(200.0, 0.31, 0.32), (400.0, 0.12, 0.14),
                                                 (800.0, 0.0, 0.0)])
def test_images_are_as_frequent_as_the_harmonics_that_fold(rate, first, second):
    speeds = np.linspace(10.0, 50.0, 2001)
    for order, share in ((1, first), (2, second)):
        folded = [image(order, rate=rate, turn_rate=f, turns=10.0, highest=10) is not None
                  for f in speeds]
        assert np.mean(folded) == pytest.approx(share, abs=0.005)
        # Independently: where the harmonic lies after folding into the lower half of the rate.
        beyond = np.outer(speeds, np.arange(1, 11))
        lies = np.abs(beyond - rate * np.rint(beyond / rate))
        is_own = beyond < rate / 2.0
        own = np.abs(order * speeds - rate * np.rint(order * speeds / rate))
        near = (np.abs(lies - own[:, None]) < 0.15 * speeds[:, None]) & ~is_own
        np.testing.assert_array_equal(folded, near.any(axis=1))


def test_image_is_the_harmonic_that_has_the_same_samples():
    """At eight samples a turn exp(9 i theta) and exp(i theta) are the same numbers; so is 7X."""
    turn = 2.0 * np.pi * np.arange(80) / 8.0
    other = image(1, rate=200.0, turn_rate=25.0, turns=10.0, highest=10)
    np.testing.assert_allclose(np.cos(other * turn), np.cos(turn), atol=1e-12)
    assert image(1, rate=300.0, turn_rate=25.0, turns=10.0, highest=10) is None  # 12 a turn


def packed(time, size, *, apart=0.0):
    """Return the stamps of packets whose last sample comes as it is taken."""
    number = np.arange(len(time))
    last = np.minimum(number // size * size + size - 1, len(time) - 1)
    return time[last] + apart * (number % size - size + 1)


@pytest.mark.parametrize('apart', [0.0, 2e-6])
@pytest.mark.parametrize('size', [1, 4, 16])
def test_samples_of_packets_lie_evenly_between_arrivals(size, apart):
    time = np.arange(160) / 800.0
    first, taken = unpacked(packed(time, size, apart=apart))
    assert first == size
    np.testing.assert_allclose(taken, time[size:], atol=1e-12)


def test_packets_that_differ_in_size_are_spread_each_for_itself():
    time = np.arange(60) / 800.0
    stamps = np.repeat(time[[9, 29, 34, 59]], [10, 20, 5, 25])
    first, taken = unpacked(stamps)
    assert first == 10
    np.testing.assert_allclose(taken, time[10:], atol=1e-12)


def test_a_stretch_ends_with_a_packet_that_is_there():
    stamps = packed(np.arange(64) / 800.0, 16, apart=2e-6)
    assert end_of_packet(stamps, 32) == 32
    assert end_of_packet(stamps, 33) == end_of_packet(stamps, 47) == 48
    assert end_of_packet(stamps, 49) == 0  # who knows whether more of it comes
    assert end_of_packet(stamps, 0) == 0
