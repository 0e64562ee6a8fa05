"""A table of how seats answer forces stands for foundation and ground, or is refused."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from rotorsoil_ros.channel import across
from rotorsoil_ros.errors import NotSolvedError, OutOfTableError, RotorSoilError
from rotorsoil_ros.ground.cone import ConeModel
from rotorsoil_ros.ground.soil import Rectangle, Soil
from rotorsoil_ros.machine.coupled import CoupledModel
from rotorsoil_ros.machine.damping import DampingSplitter
from rotorsoil_ros.machine.flexible.receptance import SeatReceptance
from rotorsoil_ros.machine.foundation import Foundation
from rotorsoil_ros.machine.modes.critical import critical_speeds
from rotorsoil_ros.machine.modes.names import BELOW, ModeNames
from rotorsoil_ros.machine.modes.stability import stability
from rotorsoil_ros.rotor.assembly import Rotor
from rotorsoil_ros.rotor.bearing import Bearing
from rotorsoil_ros.rotor.disc import Disc
from rotorsoil_ros.rotor.shaft import Material, ShaftSection

TURN = 2.0 * np.pi
SPEEDS = TURN * np.linspace(5.0, 40.0, 71)
SEATS = [seat for name in ('b1', 'b2') for seat in across(name)]


def oscillator(omega, *, mass=2e3, stiffness=5e7, loss=0.05, damping=0.0):
    """Return the receptance of a mass on a lossy spring and a dashpot, closed form."""
    return 1.0 / (stiffness * (1.0 + 1j * loss) + 1j * omega * damping - mass * omega**2)


def two_seats(omega, **own):
    """Return seats that move by themselves in x and together with one another in z."""
    found = np.zeros((len(omega), 4, 4), dtype=complex)
    for row, stiffness in ((0, 3e7), (2, 5e7)):
        found[:, row, row] = oscillator(omega, stiffness=stiffness, **own)
    together = oscillator(omega, stiffness=8e7, **own)
    found[np.ix_(range(len(omega)), [1, 3], [1, 3])] = together[:, None, None]
    return found


def noisy(values, share, seed=0):
    """Return values with independent relative noise."""
    rng = np.random.default_rng(seed)
    return values * (1.0 + share / 2.0**0.5 * (
        rng.standard_normal(values.shape) + 1j * rng.standard_normal(values.shape)))


@cache
def fan():
    """Return an overhung fan on a block on cones."""
    steel = Material(density=7850.0, young_modulus=2.1e11, poisson_ratio=0.3)
    bearings = [Bearing(name, place, stiffness=np.diag([2.5e8, 5e8]),
                        damping=np.diag([4e3, 4e3]), foundation='block')
                for name, place in (('b1', 0.25), ('b2', 1.25))]
    rotor = Rotor(2.0, (ShaftSection(1.6, (0.2, 0.2), (0.0, 0.0), 8, steel),),
                  (Disc('wheel', 1.6, 320.0, 28.0, 51.0),), tuple(bearings))
    contact = Rectangle(1.0, 1.5)
    block = Foundation('block', contact, 0.75, 12e3, 0.6, (1e4, 9e3, 1.2e4))
    return CoupledModel(rotor, [block], [ConeModel(Soil(60e6, 0.3, 1900.0, 0.05), contact)])


def tabulated(model, hertz):
    """Return the same machine on a table of what its bearings stand on."""
    omega = TURN * hertz
    table = SeatReceptance.of(SEATS, omega, model.support.standing(omega).receptance)
    rotor = replace(model.rotor, bearings=tuple(
        replace(bearing, foundation=None) for bearing in model.rotor.bearings))
    return CoupledModel(rotor, (), [table])


@pytest.fixture(scope='module')
def twin():
    """Return the fan on its table, of one row for each hertz."""
    return tabulated(fan(), np.linspace(4.0, 45.0, 42))


def test_a_computed_table_is_the_closed_form_between_its_rows():
    rows = TURN * np.arange(5.0, 41.0)
    table = SeatReceptance.of(SEATS, rows, two_seats(rows))
    got, true = table.compliance(SPEEDS), two_seats(SPEEDS)
    # Its resonances are 5 % of themselves wide, about one row.
    spline = CubicSpline(rows, two_seats(rows))(SPEEDS)
    assert np.abs(spline - true).max() > 0.3 * np.abs(true).max()
    assert np.abs(got - true).max() < 1e-9 * np.abs(true).max()
    assert table.law is not None
    assert table.missed < 1e-9


def test_a_fan_on_its_table_is_the_fan_on_its_block(twin):
    own, other = (one.unbalance_response(SPEEDS, np.array([0.02 + 0j])) for one in (fan(), twin))
    columns = [fan().channels.index(channel) for channel in twin.channels]
    np.testing.assert_allclose(other.displacement, own.displacement[:, columns],
                               rtol=0.0, atol=1e-9 * np.abs(own.displacement).max())
    turning = own.force[:, columns]
    carried = np.isfinite(turning)
    np.testing.assert_allclose(other.force[carried], turning[carried],
                               rtol=0.0, atol=1e-9 * np.abs(turning[carried]).max())


def test_modes_of_the_table_are_those_of_the_block(twin):
    span = SPEEDS[0], SPEEDS[-1]
    own, other = critical_speeds(fan(), span), critical_speeds(twin, span)
    felt = [one for one in own if one.damping_ratio < 0.5]
    assert len(felt) >= 2
    for one in felt:
        found = min(other, key=lambda two: abs(two.speed - one.speed))
        assert found.speed == pytest.approx(one.speed, rel=1e-5)
        assert found.damping_ratio == pytest.approx(one.damping_ratio, rel=1e-4)
    assert BELOW in {ModeNames(twin).of_critical(one) for one in other}


def test_what_the_unbalance_puts_in_leaves_by_bearings_and_table(twin):
    speed, unbalance = SPEEDS[::10], np.array([0.02 + 0j])
    own, other = (DampingSplitter(one).forced(speed, unbalance) for one in (fan(), twin))
    np.testing.assert_allclose(other.total, own.total, rtol=1e-8)
    np.testing.assert_allclose(other.share('bearings') + other.share(BELOW), 1.0, rtol=1e-9)
    np.testing.assert_allclose(other.share('bearings'), own.share('bearings'), rtol=1e-6)


def test_below_the_table_stability_is_not_told(twin):
    driven = replace(twin, rotor=replace(twin.rotor, bearings=tuple(
        replace(bearing, stiffness=np.array([[2.5e8, 1e7], [-1e7, 5e8]]))
        for bearing in twin.rotor.bearings)))
    found = stability(driven, (SPEEDS[0], SPEEDS[-1]))
    assert found.untold_below == pytest.approx(TURN * 4.0)
    assert found.why_below == 'the file of the support begins there'


def test_nothing_is_said_outside_the_table(twin):
    with pytest.raises(OutOfTableError, match='range of the receptances of the seats'):
        twin.unbalance_response(np.array([TURN * 46.0]), np.array([1.0 + 0j]))
    with pytest.raises(OutOfTableError):
        twin.support.standing(np.array([0.0]))
    assert twin.support.within((0.0, 1e9)) == pytest.approx((TURN * 4.0, TURN * 45.0))
    with pytest.raises(OutOfTableError, match='must hold some of 100 to 200 Hz, got 4 to 45 Hz'):
        twin.support.within((TURN * 100.0, TURN * 200.0))


def test_a_table_does_not_tell_how_seats_follow_the_ground(twin):
    with pytest.raises(RotorSoilError, match='do not tell how these follow ground that moves'):
        twin.ground_response(SPEEDS, speed=0.0)


@pytest.mark.parametrize('share', [0.01, 0.02])
def test_measured_rows_are_led_through_as_they_are(share):
    rows = TURN * np.arange(5.0, 41.0, 0.2)
    table = SeatReceptance.of(SEATS, rows, noisy(two_seats(rows), share))
    assert table.law is None
    assert 0.3 * share < table.missed < 3.0 * share
    assert 0.0 < table.skew < 0.2
    # What gave energy gives none any more, and what differed from its mirror image does not.
    assert np.linalg.eigvalsh(table.values.imag).max() < 1e-12 * np.abs(table.values).max()
    np.testing.assert_array_equal(table.values, table.values.swapaxes(1, 2))
    got, true = table.compliance(SPEEDS), two_seats(SPEEDS)
    size = np.linalg.norm(true, axis=(1, 2))
    # Noise at its rows, four standard deviations, and no peak besides.
    assert (np.linalg.norm(got - true, axis=(1, 2)) / size).max() < 4.0 * share


def test_measured_rows_tell_no_modes():
    rows = TURN * np.arange(5.0, 41.0, 0.2)
    table = SeatReceptance.of(SEATS, rows, noisy(two_seats(rows), 0.01))
    bearings = tuple(replace(bearing, foundation=None) for bearing in fan().rotor.bearings)
    model = CoupledModel(replace(fan().rotor, bearings=bearings), (), [table])
    with pytest.raises(NotSolvedError, match='within 1e-06 of a row to tell how free vibrations'):
        critical_speeds(model, (SPEEDS[0], SPEEDS[-1]))


def test_measured_peaks_that_rows_do_not_show_are_refused_with_numbers():
    # 5 % of 24.4 Hz are 1.2 Hz: rows 0.5 Hz apart are two in it.
    rows = TURN * np.arange(5.0, 41.0, 0.5)
    with pytest.raises(RotorSoilError) as error:
        SeatReceptance.of(SEATS[:2], rows, noisy(two_seats(rows), 0.01)[:, 2:, 2:])
    assert 'rows at most a quarter of the width of a peak apart' in str(error.value)
    assert 'its rows are 0.5 Hz apart' in str(error.value)
    assert 'fit modes' in str(error.value)


def test_a_resonance_between_two_rows_is_refused():
    rows = TURN * np.arange(5.0, 41.0, 3.0)
    values = noisy(oscillator(rows, stiffness=2e3 * (TURN * 18.5)**2, loss=0.01), 0.01)
    with pytest.raises(RotorSoilError, match='rows at most a quarter of the width'):
        SeatReceptance.of(SEATS[:2], rows, values[:, None, None] * np.eye(2))


@pytest.mark.parametrize('wrong, said', [
    (lambda values: values.conj(), 'must not give energy .* or is it of exp'),
    (lambda values: -values, 'must not give energy'),
    (lambda values: values * np.where(np.arange(16).reshape(4, 4) == 7, -1.0, 1.0),
     'b1_z__b2_z and b2_z__b1_z must be alike'),
    (np.zeros_like, 'some seat must move at every frequency, got zeros at 5 Hz'),
])
def test_what_is_no_receptance_is_refused(wrong, said):
    rows = TURN * np.arange(5.0, 41.0)
    with pytest.raises(RotorSoilError, match=said):
        SeatReceptance.of(SEATS, rows, wrong(two_seats(rows)))


def test_a_table_of_few_digits_answers_but_tells_no_modes():
    rows = TURN * np.arange(5.0, 41.0, 0.5)
    exact = two_seats(rows)
    digits = 10.0 ** (5 - np.floor(np.log10(np.abs(exact) + 1e-30)))
    table = SeatReceptance.of(SEATS, rows, np.round(exact * digits) / digits)
    assert table.law is not None
    assert table.poles is None
    true = two_seats(SPEEDS)
    assert np.abs(table.compliance(SPEEDS) - true).max() < 1e-4 * np.abs(true).max()


def test_a_rise_at_the_end_that_rows_do_not_show_is_refused():
    rows = TURN * np.arange(5.0, 18.5, 3.0)
    values = noisy(oscillator(rows, stiffness=2e3 * (TURN * 17.5)**2, loss=0.01), 0.01)
    with pytest.raises(RotorSoilError, match='must have more rows: from 14 Hz to the next at 17'):
        SeatReceptance.of(SEATS[:2], rows, values[:, None, None] * np.eye(2))


def test_foundations_beside_a_table_are_refused(twin):
    with pytest.raises(RotorSoilError, match='foundations must be none on receptances'):
        CoupledModel(fan().rotor, fan().foundations, twin.soil_models)


def test_a_bearing_that_the_table_does_not_know_is_refused(twin):
    first, second = twin.rotor.bearings
    rotor = replace(twin.rotor, bearings=(first, replace(second, name='b3')))
    with pytest.raises(RotorSoilError, match='must hold b3_x, got b1_x, b1_z, b2_x, b2_z'):
        CoupledModel(rotor, (), twin.soil_models).unbalance_response(SPEEDS, np.ones(1) + 0j)
