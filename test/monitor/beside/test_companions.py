"""Who runs beside a machine: at which speed, how far turned, and how much of it in a vector."""

import numpy as np
import pytest

from rotorsoil_ros.channel import Channel
from rotorsoil_ros.monitor.beside.companions import Companion, Companions
from rotorsoil_ros.monitor.vectors.history import History

SECOND = 10**9
OWN, TURNS = 155.0, 10.0
X = Channel('fan', 'housing', 'x')


class Part:
    """A machine whose part is the same at every speed."""

    channels = (X,)
    table = None

    def answer(self, speed):
        return self

    @property
    def displacement(self):
        return np.ones((1, 1), dtype=complex)


class Table:
    speed_range = (10.0, 200.0)


Part.table = Table


def turning(speed, *, until_s=10.0, silent=(np.inf, np.inf)):
    """Return the history of a rotor at one speed, told 50 times a second, silent for a while."""
    history = History()
    time = np.arange(0.0, until_s, 0.02)
    told = (time < silent[0]) | (time > silent[1])
    history.add(np.rint(time[told] * SECOND).astype(np.int64), np.full(told.sum(), speed),
                np.full(told.sum(), np.nan))
    return history


def companion(history=None, *, rated=OWN, times=1.0):
    return Companion('other', rated, Part, None if history is None else lambda: history, times)


def beside(*others):
    return Companions(turning(OWN), others, turns=TURNS)


def test_speed_and_turn_are_those_that_were_told():
    speed, turn = beside(companion(turning(OWN + 1.0)), companion(turning(300.0), times=0.5)).seen(
        2 * SECOND, 4 * SECOND)
    np.testing.assert_allclose(speed, [OWN + 1.0, 150.0], rtol=1e-12)
    np.testing.assert_allclose(turn, np.exp(2.0j * np.array([1.0, 150.0 - OWN])), rtol=1e-9)


@pytest.mark.parametrize('other, speed', [
    (companion(), OWN), (companion(turning(OWN, silent=(2.0, 7.0))), np.nan),
    (companion(turning(OWN, until_s=3.0)), np.nan), (companion(History()), np.nan)])
def test_nobody_tells_or_it_fell_silent(other, speed):
    """At its rated speed where no topic tells it; unknown where one does, and is silent."""
    group = beside(other)
    found, turn = group.seen(4 * SECOND, 5 * SECOND)
    np.testing.assert_equal(found, [speed])
    assert np.isnan(turn).all()
    assert not group.is_told(found).any()


def test_share_in_a_vector_is_that_of_its_mean_over_the_turns():
    """The mean of exp(i w t) over ten turns of the machine; of other vectors its envelope."""
    apart = np.array([0.0, 3.0, 10.0, 40.0])
    group = beside(*(companion(turning(OWN + one)) for one in apart))
    span = TURNS * 2.0 * np.pi / OWN
    time = np.linspace(-0.5, 0.5, 20_001) * span
    mean = np.trapezoid(np.exp(1j * apart[:, None] * time), time, axis=1).real / span
    own, speed = np.full(2, OWN), np.broadcast_to(OWN + apart, (2, 4))
    samples, vector = group.leaks(own, speed, of_samples=np.array([True, False]))
    np.testing.assert_allclose(samples, mean, atol=1e-6)
    assert np.all(vector >= np.abs(mean) - 1e-12)
    assert vector[0] == 1.0
    [unknown] = beside(companion(rated=OWN * 1.04)).leaks(
        own[:1], np.full((1, 1), np.nan), of_samples=np.array([True]))
    assert unknown == [1.0]  # its slip may be as much


@pytest.mark.parametrize('speed, is_apart', [
    (OWN + 2.0, False), (OWN + 8.0, True), (0.5 * OWN, True), (2.0 * OWN + 1.0, False),
    (0.5, False)])
def test_samples_tell_apart_what_turns_against_all_that_is_fitted(speed, is_apart):
    found = beside(companion(turning(speed))).told_apart(
        X, SECOND, SECOND + 405_000_000, zero_ns=SECOND, own=OWN, orders=(1, 2, 3))
    assert list(found) == [0] * is_apart
