"""What gravity and a sensor's own orientation say of its axes, against turns that are known."""

import math

import numpy as np
import pytest

from rotorsoil_ros.case.entries.sensors import Pickup
from rotorsoil_ros.channel import Channel
from rotorsoil_ros.events import Samples
from rotorsoil_ros.monitor.vectors.axes import Axes
from rotorsoil_ros.monitor.vectors.demodulation import Demodulator
from rotorsoil_ros.monitor.vectors.history import History
from rotorsoil_ros.monitor.vectors.refusal import Flaw, NOT_SEEN, Refusal, SEEN

G = 9.80665
X = Channel.parse('drive_end_housing_x')
SPEED, SWING, RATE = 150.0, 20e-6, 1000.0


def quaternion(axis, degrees):
    """Return x, y, z, w of a turn about a direction."""
    half = 0.5 * math.radians(degrees)
    return np.array([*(math.sin(half) * np.asarray(axis) / np.linalg.norm(axis)), math.cos(half)])


def turned(felt, axis, degrees):
    """Return vectors (n, 3) turned about a direction: Rodrigues' formula, no quaternion."""
    k, angle = np.asarray(axis) / np.linalg.norm(axis), math.radians(degrees)
    return (felt * math.cos(angle) + np.cross(k, felt) * math.sin(angle)
            + np.outer(felt @ k, k) * (1.0 - math.cos(angle)))


def shaken(seconds, *, gravity=G, noise=0.02):
    """Return times, and what a sensor along the axes of the machine feels (n, 3)."""
    time = np.arange(int(seconds * RATE)) / RATE
    first = SWING * SPEED**2
    felt = np.stack([-first * np.cos(SPEED * time), np.zeros(len(time)),
                     gravity + first * np.sin(SPEED * time)], axis=1)
    return time, felt + np.random.default_rng(3).normal(scale=noise * first, size=felt.shape)


def demodulated(time, felt, *, orientation=None, **pickup):
    """Return all vectors of x, and why others were refused."""
    stamps = np.rint(time * 1e9).astype(np.int64) + 10**9
    history = History()
    history.add(stamps, np.full(len(time), SPEED), np.mod(SPEED * time, 2.0 * np.pi))
    demodulator = Demodulator('fan', X, history, turns=10.0, pickup=Pickup(**pickup))
    demodulator.take(Samples(
        'fan', X, stamps, felt[:, 0], felt=felt,
        orientation=np.zeros((0, 4)) if orientation is None else orientation))
    return list(demodulator.vectors()), demodulator.refusals


def said(felt, turn):
    return np.hstack([felt, np.tile(turn, (len(felt), 1))])


UNTOLD = np.full(4, np.nan)


@pytest.mark.parametrize('gravity, words', [
    (8.85, SEEN), (G, SEEN), (-G, SEEN), (10.75, SEEN), (8.7, NOT_SEEN), (10.9, NOT_SEEN),
    (0.0, NOT_SEEN)])
def test_gravity_is_told_after_ten_seconds(gravity, words):
    found, refusals = demodulated(*shaken(9.0, gravity=gravity))
    assert found
    assert not refusals.gravity
    found, refusals = demodulated(*shaken(11.0, gravity=gravity))
    assert found
    assert refusals.gravity == refusals.values()['gravity'] == words
    assert list(refusals.lines()) == ([NOT_SEEN] if words == NOT_SEEN else [])


def test_sensor_with_one_axis_says_nothing_of_gravity():
    time, felt = shaken(11.0)
    felt[:, 1] = np.nan
    found, refusals = demodulated(time, felt)
    assert found
    assert not refusals.gravity


@pytest.mark.parametrize('size, units, is_kept', [
    (0.95, '', False), (1.05, '', False), (0.88, '', True), (1.12, '', True),
    (1.0, 'm/s^2', True)])
def test_mean_of_one_looks_like_g_unless_the_case_says_otherwise(size, units, is_kept):
    found, refusals = demodulated(*shaken(2.0, gravity=size), units=units)
    assert bool(found) == is_kept
    assert refusals.counts[Flaw.UNITS] == (0 if is_kept else refusals.stretches)
    if not is_kept:
        assert 'looks like g, not m/s^2' in next(refusals.lines())


def test_metres_that_the_case_calls_g_are_refused():
    time, felt = shaken(2.0)
    found, refusals = demodulated(time, G * felt, units='g')
    assert not found
    assert 'looks like m/s^2, not g' in next(refusals.lines())


@pytest.mark.parametrize('axis', [(1.0, 0.0, 0.0), (1.0, 2.0, 0.0)])
@pytest.mark.parametrize('degrees, is_kept', [(8.0, True), (12.0, False), (90.0, False),
                                              (172.0, True)])
def test_axes_off_by_more_than_ten_degrees_are_refused(axis, degrees, is_kept):
    """Upside down is no tilt: z may point down."""
    time, felt = shaken(2.0)
    found, refusals = demodulated(time, turned(felt, axis, degrees))
    assert bool(found) == is_kept
    assert refusals.counts[Flaw.AXES] == (0 if is_kept else refusals.stretches)
    if not is_kept:
        assert f'gravity is {degrees:.0f} deg off z' in next(refusals.lines())


def test_turn_about_the_vertical_is_not_seen_and_that_is_said():
    found, refusals = demodulated(*(lambda time, felt: (time, turned(felt, (0, 0, 1), 60.0)))(
        *shaken(11.0)))
    assert found
    assert 'a turn about z cannot be seen' in refusals.gravity


def test_first_ten_seconds_hold_whatever_comes_later():
    axes = Axes(Pickup(), 0)
    upright, lying = (said(np.tile(mean, (100, 1)), UNTOLD)
                      for mean in ([0.0, 0.0, G], [0.0, G, 0.0]))
    for _ in range(10):
        assert not isinstance(axes.along(upright[:, 0], upright, seconds=1.0), Refusal)
    for _ in range(100):
        assert not isinstance(axes.along(lying[:, 0], lying, seconds=1.0), Refusal)


@pytest.mark.parametrize('axis, degrees', [((0.0, 0.0, 1.0), 90.0), ((1.0, 0.0, 0.0), 35.0),
                                           ((1.0, -2.0, 3.0), 130.0)])
@pytest.mark.parametrize('sign', [1.0, -1.0])
def test_orientation_that_is_used_gives_the_vector_of_the_machine(axis, degrees, sign):
    """What the sensor feels is the motion turned back; q and -q are one rotation."""
    time, felt = shaken(12.0)
    own = turned(felt, axis, -degrees)
    quaternions = np.tile(quaternion(axis, degrees), (len(time), 1))
    quaternions[::2] *= sign
    found, refusals = demodulated(time, own, orientation=quaternions, has_orientation=True)
    [straight], _ = demodulated(time, felt)
    assert not refusals.counts
    assert refusals.gravity == SEEN
    np.testing.assert_allclose(found[0].amplitude, straight.amplitude, rtol=1e-9, atol=1e-15)
    np.testing.assert_allclose(found[0].amplitude[:, 0], SWING, rtol=0.01)
    refused, refusals = demodulated(time, own, orientation=quaternions)
    assert not refused
    assert refusals.counts[Flaw.TURNED] == refusals.stretches


@pytest.mark.parametrize('degrees', [90.0, -35.0])
def test_sensor_with_a_heading_is_turned_about_the_vertical(degrees):
    time, felt = shaken(12.0)
    own = turned(felt, (0.0, 0.0, 1.0), -degrees)
    found, refusals = demodulated(time, own, heading=math.radians(degrees))
    [straight], _ = demodulated(time, felt)
    assert not refusals.counts
    np.testing.assert_allclose(found[0].amplitude, straight.amplitude, rtol=1e-9, atol=1e-15)


@pytest.mark.parametrize('pickup', [{}, {'heading': math.radians(50.0)}, {'turned': True}])
def test_machine_that_stands_has_its_gravity_along_the_shaft(pickup):
    # Over the ground its x is x, its y is up and its z points against y.
    time, felt = shaken(12.0)
    standing = felt @ np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
    [straight], _ = demodulated(time, felt)
    if 'turned' in pickup:  # its messages tell how it lies over the ground
        own, pickup = turned(felt, (1.0, 2.0, 2.0), -70.0), {'has_orientation': True}
        orientation = np.tile(quaternion((1.0, 2.0, 2.0), 70.0), (len(time), 1))
    else:
        own = turned(standing, (0.0, 1.0, 0.0), -math.degrees(pickup.get('heading', 0.0)))
        orientation = None
    found, refusals = demodulated(time, own, orientation=orientation, is_upright=True, **pickup)
    assert not refusals.counts
    np.testing.assert_allclose(found[0].amplitude, straight.amplitude, rtol=1e-9, atol=1e-15)
    _, refusals = demodulated(time, felt, is_upright=True)
    assert 'gravity is 90 deg off y' in next(refusals.lines())


def test_orientation_that_does_not_fit_gravity_is_refused():
    time, felt = shaken(3.0)
    found, refusals = demodulated(
        time, felt, orientation=np.tile(quaternion((1, 0, 0), 25.0), (len(time), 1)),
        has_orientation=True)
    assert not found
    assert 'gravity is 25 deg off z' in next(refusals.lines())


@pytest.mark.parametrize('degrees, is_kept', [(1.8, True), (2.2, False)])
def test_orientation_that_strays_from_its_first_ten_seconds_is_refused(degrees, is_kept):
    time, felt = shaken(20.0)
    orientation = np.where((time > 15.0)[:, None], quaternion((0, 0, 1), 40.0 + degrees),
                           quaternion((0, 0, 1), 40.0))
    _, refusals = demodulated(time, felt, orientation=orientation, has_orientation=True)
    assert bool(refusals.counts[Flaw.TURNED]) != is_kept
    if not is_kept:
        assert 'strays by 2 deg' in next(refusals.lines())
        late = sum(time > 15.0) / RATE * SPEED / (20.0 * math.pi)
        assert refusals.counts[Flaw.TURNED] == pytest.approx(late, abs=2.0)


@pytest.mark.parametrize('spoil', ['axis', 'orientation'])
def test_orientation_is_used_only_with_all_axes(spoil):
    time, felt = shaken(3.0)
    orientation = np.tile(quaternion((0, 0, 1), 40.0), (len(time), 1))
    if spoil == 'axis':
        felt[5::50, 2] = np.nan
    else:
        orientation[5::50] = np.nan
    found, refusals = demodulated(time, felt, orientation=orientation, has_orientation=True)
    assert not found
    assert 'not every sample has one, and three axes' in next(refusals.lines())


@pytest.mark.parametrize('share, is_kept', [(0.97, True), (0.99, False)])
def test_range_holds_for_every_axis_of_a_sensor_that_is_turned(share, is_kept):
    """The axis that clips may be another one than that of the channel."""
    time, felt = shaken(3.0, noise=0.0)
    orientation = np.tile(quaternion((0, 0, 1), 40.0), (len(time), 1))
    reach = float(np.abs(felt).max())
    found, refusals = demodulated(time, felt, orientation=orientation, has_orientation=True,
                                  range=reach / share)
    assert bool(found) == is_kept
    assert (refusals.counts[Flaw.CLIPPED] > 0) != is_kept
