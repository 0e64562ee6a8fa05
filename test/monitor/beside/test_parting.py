"""Vectors of a machine that hold another's part: told apart as far as that can be known."""

from dataclasses import replace

import numpy as np
import pytest

from rotorsoil_ros.monitor.beside.parting import BesideRow, MEMORY_S, Parting

TURNS, SPEED = 10.0, 2.0 * np.pi * 1480.0 / 60.0
SPAN_S = TURNS * 2.0 * np.pi / SPEED  # of one vector
HALF = 0.5  # of the machine's own amplitude is the other's


def beats(apart_rpm, *, total_s=60.0, drift_rpm=0.0, told_wrong_rpm=0.0, own=None, noise=0.0):
    """Return times, what is of the machine itself, and rows of vectors that hold both parts."""
    random = np.random.default_rng(1)
    time = np.arange(0.5 * SPAN_S, total_s, SPAN_S)
    # The integral of the distance of two speeds, one of which drifts with a period of 40 s.
    rate = 2.0 * np.pi / 40.0
    apart = (apart_rpm + drift_rpm * np.cos(rate * time)) * np.pi / 30.0
    angle = (apart_rpm * time + drift_rpm * np.sin(rate * time) / rate) * np.pi / 30.0
    mine = np.ones(len(time), dtype=complex) if own is None else own(time)
    leak = np.sinc(apart * SPAN_S / (2.0 * np.pi))
    vector = mine + HALF * np.exp(1j * (angle + 0.7)) * leak + noise * (
        random.normal(size=(len(time), 2)) @ [1.0, 1.0j])
    told = leak * np.exp(1j * (angle + told_wrong_rpm * np.pi / 30.0 * time))
    return time, mine, vector, [
        BesideRow(at, SPEED, np.array([one]), np.array([noise]), np.array([SPEED + away]),
            np.array([turn]), np.array([[HALF]]), np.ones(1))
        for at, one, away, turn in zip(time, vector, apart, told, strict=True)]


def parted(rows):
    """Return what is left of the vectors, and by how much that may be wrong."""
    parting = Parting()
    found, spread = (np.array(part)[:, 0, 0] for part in zip(*map(parting.part, rows),
                                                             strict=True))
    turn = np.array([row.turn[0] for row in rows])
    return np.array([row.vector[0] for row in rows]) - found * turn, np.abs(turn) * spread


def test_ten_turns_wander_by_half_and_a_beat_tells_both_apart():
    """Five rpm apart, the other of half the amplitude: 0.50 to 1.50, over a beat 0.99 to 1.01."""
    time, _, vector, rows = beats(5.0, noise=0.003)
    assert np.abs(vector).min() == pytest.approx(0.50, abs=0.01)
    assert np.abs(vector).max() == pytest.approx(1.50, abs=0.01)
    left, _ = parted(rows)
    assert np.abs(left[time > 12.0] - 1.0).max() < 0.015


def test_a_single_vector_may_be_off_by_all_of_the_other_part():
    _, _, vector, rows = beats(5.0, total_s=1.0)
    left, spread = parted(rows[:1])
    assert left[0] == pytest.approx(vector[0], rel=1e-3)
    assert spread[0] == pytest.approx(HALF * abs(vector[0]) / np.sqrt(1.0 + HALF**2), rel=1e-2)


def test_equal_speeds_are_never_told_apart():
    _, _, vector, rows = beats(0.0)
    left, spread = parted(rows)
    np.testing.assert_allclose(left, vector, rtol=1e-2)
    assert spread.min() > 0.99 * HALF


@pytest.mark.parametrize('apart, more', [
    (5.0, {}), (5.0, {'drift_rpm': 4.0}), (5.0, {'drift_rpm': 1.0, 'told_wrong_rpm': 0.2}),
    (1.0, {'drift_rpm': 0.3}), (0.3, {}), (60.0, {'drift_rpm': 2.0}), (225.0, {}),
    (5.0, {'own': lambda time: 1.0 + 0.05 * np.sin(time / 5.0)})])
def test_what_is_left_is_wrong_by_no_more_than_it_says(apart, more):
    """Drifting, told wrongly, near each other, changing: the error covers what is wrong."""
    noise = 0.01
    _, mine, _, rows = beats(apart, noise=noise, **more)
    left, spread = parted(rows)
    over = np.abs(left - mine) - 3.0 * noise
    assert np.mean(over <= 2.0 * spread) > 0.97


def test_a_mean_over_a_beat_would_not_do_where_speeds_drift():
    """The other way: a window of one beat, without following the angle."""
    time, _, vector, rows = beats(5.0, drift_rpm=4.0)
    beat = int(12.0 / SPAN_S)
    means = np.abs(np.convolve(vector, np.full(beat, 1.0 / beat), 'valid'))
    assert np.ptp(means) > 0.2
    assert np.ptp(np.abs(parted(rows)[0][time > 12.0])) < 0.02


def test_a_step_of_the_machine_itself_is_its_own_and_not_the_others():
    def doubled(time):
        return np.where(time > 30.0, 2.0, 1.0)

    time, mine, _, rows = beats(5.0, own=doubled, noise=0.003)
    left, spread = parted(rows)
    assert np.all(np.abs(left - mine) <= 2.0 * spread + 0.4)
    assert np.abs(left[time > 30.0 + MEMORY_S] - 2.0).max() < 0.03


def test_another_that_is_far_larger_than_predicted_is_told_apart_all_the_same():
    time, _, _, rows = beats(5.0, noise=0.003)
    rows = [replace(row, size=row.size / 20.0, expected=row.expected / 20.0) for row in rows]
    left, _ = parted(rows)
    assert np.abs(left[time > 6.0] - 1.0).max() < 0.03


def test_vectors_without_a_phase_say_nothing_of_the_other():
    _, _, _, rows = beats(5.0, total_s=15.0)
    parting = Parting()
    for row in rows:
        found, spread = parting.part(replace(row, vector=row.vector * np.nan))
        assert (found[0, 0], spread[0, 0]) == (0.0, HALF)
