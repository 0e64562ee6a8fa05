"""What a journal is to the rotor over its speeds: scales, thresholds, tables, oil and loads."""

import math

from films import OWN, rows_of
import numpy as np
import pytest

from rotorsoil_ros.errors import NotSolvedError, RotorSoilError
from rotorsoil_ros.rotor.disc import Disc
from rotorsoil_ros.rotor.journal.geometry import JournalBearing
from rotorsoil_ros.rotor.journal.loads import static_loads
from rotorsoil_ros.rotor.journal.oil import Oil, Viscosity
from rotorsoil_ros.rotor.journal.states import JournalStates, tabulated
from rotorsoil_ros.rotor.shaft import Material
from rotorsoil_ros.units import GRAVITY, rpm_to_rad_s

from machines import bearing, uniform_rotor

STEEL = Material(young_modulus=2.1e11, poisson_ratio=0.3, density=7850.0)
PLAIN = JournalBearing('plain', 0.08, 0.04, 80e-6)
OIL = Viscosity.constant(0.02)
LOAD = np.array([0.0, -793.0])


def at_sommerfeld(bearing, numbers):
    """Return a bearing under 1 kN with 20 mPa s, at the speeds of Sommerfeld numbers."""
    ratio = bearing.radius / bearing.radial_clearance
    speed = 2.0 * math.pi * np.array(numbers) * 1000.0 / (
        0.02 * bearing.length * bearing.diameter * ratio**2)
    return JournalStates.at(bearing, OIL, np.array([0.0, -1000.0]), speed)


@pytest.mark.parametrize('name', OWN)
def test_threshold_of_a_rigid_rotor_is_that_of_fine_grids(name):
    # The critical mass is a difference of large terms: 3 % of it, 1 % of the whirl ratio.
    table = rows_of(name)
    states = at_sommerfeld(OWN[name], table[:, 0])
    np.testing.assert_allclose(states.sommerfeld, table[:, 0], rtol=1e-12)
    unit = states.carried / (states.bearing.radial_clearance * states.speed**2)
    for row, ratio, mass in zip(table, states.whirl_ratio, states.critical_mass / unit,
                                strict=True):
        if row[13] > 50.0:  # on the edge of being stable at any mass, or beyond it
            assert math.isinf(row[13]) <= (not mass < 100.0)
            continue
        assert ratio == pytest.approx(row[12], rel=0.02)
        assert mass == pytest.approx(row[13], rel=0.03)


def test_example_of_friswell_with_a_finite_length():
    # 5.5.1: 525 N, 100 x 30 mm, c 0.1 mm, 0.1 Pa s, 1500 rpm. The closed form of short bearings
    # gives e 0.2663; at its finite length it is 0.2752, K 12.54 -15.71 24.22 8.67 MN/m.
    example = JournalBearing('plain', 0.1, 0.03, 1e-4)
    states = JournalStates.at(example, Viscosity.constant(0.1), np.array([0.0, -525.0]),
                              np.array([rpm_to_rad_s(1500.0)]))
    assert states.eccentricity[0] == pytest.approx(0.2752, rel=3e-3)
    np.testing.assert_allclose(1e-6 * states.stiffness[0].ravel(), [12.54, -15.71, 24.22, 8.67],
                               atol=0.01 * 24.22)


def test_speeds_may_come_in_any_order():
    speed = np.array([300.0, 800.0, 150.0])
    states = JournalStates.at(PLAIN, OIL, LOAD, speed)
    for index in range(3):
        alone = JournalStates.at(PLAIN, OIL, LOAD, speed[index:index + 1])
        np.testing.assert_allclose(states.stiffness[index], alone.stiffness[0], rtol=1e-6)


def test_table_is_as_good_between_its_speeds():
    # As good as the edge of a film on its mesh: 1 % of the largest, 1.5 % of damping.
    span = 50.0, 1500.0
    stiffness, damping = tabulated(PLAIN, OIL, LOAD, span).tables
    speed = np.geomspace(*span, 23)
    exact = JournalStates.at(PLAIN, OIL, LOAD, speed)
    for table, values, share in ((stiffness, exact.stiffness, 0.01),
                                 (damping, exact.damping, 0.015)):
        largest = np.abs(values).max(axis=(1, 2))
        assert np.all(np.abs(table(speed) - values).max(axis=(1, 2)) < share * largest)


def test_only_the_sommerfeld_number_matters():
    # Half the viscosity at twice the speed: the same place.
    one = JournalStates.at(PLAIN, OIL, LOAD, np.array([300.0]))
    other = JournalStates.at(PLAIN, Viscosity.constant(0.01), LOAD, np.array([600.0]))
    np.testing.assert_allclose(other.place, one.place, rtol=1e-9)
    np.testing.assert_allclose(other.damping, 0.5 * one.damping, rtol=1e-7)


def test_film_that_is_too_thin_is_refused_with_the_speed_that_is_not():
    with pytest.raises(RotorSoilError, match=r'film must be at least 1\.6 um thick .* which it '
                                             r'is from \d+ rpm on, got 1 rpm') as caught:
        tabulated(PLAIN, OIL, LOAD, (rpm_to_rad_s(1.0), rpm_to_rad_s(3000.0)))
    known = rpm_to_rad_s(float(str(caught.value).split('from ')[1].split(' rpm')[0]))
    assert tabulated(PLAIN, OIL, LOAD, (known, 2.0 * known)).least[0] >= 1.6e-6
    with pytest.raises(RotorSoilError, match=r'1\.6 um'):
        tabulated(PLAIN, OIL, LOAD, (0.85 * known, 2.0 * known))


def test_journal_at_rest_has_no_film():
    with pytest.raises(NotSolvedError, match='at rest has no film'):
        JournalStates.at(PLAIN, OIL, LOAD, np.array([0.0]))


def test_speed_of_a_film_is_found_between_the_speeds_of_a_table():
    states = tabulated(PLAIN, OIL, LOAD, (50.0, 1500.0))
    thin = states.thinner(30e-6)
    film = JournalStates.at(PLAIN, OIL, LOAD, np.array([thin])).least[0]
    assert film == pytest.approx(30e-6, rel=5e-3)  # straight in the logarithms between points
    assert states.thinner(1e-6) == 0.0
    assert states.thinner(79.99e-6) == states.speed[-1]


@pytest.mark.parametrize('temperature, millipascal_seconds', [
    (40.0, 39.5), (50.0, 25.6), (60.0, 17.5), (80.0, 9.3)])
def test_oil_of_vg_46(temperature, millipascal_seconds):
    # ASTM D341 through 46 and 6.8 mm^2/s, rho = 875 - 0.63 (T - 15): three printed digits.
    assert 1e3 * Oil(46, temperature).viscosity == pytest.approx(millipascal_seconds, rel=5e-3)


@pytest.mark.parametrize('grade, at_100', [(22, 4.3), (32, 5.4), (68, 8.7), (100, 11.4)])
def test_oil_has_its_grade_at_40_degrees(grade, at_100):
    assert 1e6 * Oil(grade, 40.0).kinematic_viscosity == pytest.approx(grade, rel=1e-12)
    assert 1e6 * Oil(grade, 100.0).kinematic_viscosity == pytest.approx(at_100, rel=1e-12)


def test_viscosity_over_speed_is_followed():
    oil = Viscosity(np.array([100.0, 400.0]), np.array([0.04, 0.01]))
    np.testing.assert_allclose(oil.at(np.array([50.0, 100.0, 250.0, 900.0])),
                               [0.04, 0.04, 0.02, 0.01], rtol=1e-12)


def loads_of(places, *, diameter=0.1, discs=(), heights=(0.0, 0.0, 0.0), sinks=(0.0, 0.0, 0.0)):
    rotor = uniform_rotor(length=2.0, diameter=diameter, elements=40, material=STEEL, discs=discs,
                          bearings=[bearing(f'b{index}', place, stiffness=1e8, foundation=None)
                                    for index, place in enumerate(places)])
    found = static_loads(rotor, compliance=np.diag(sinks) if np.ndim(sinks) == 1 else sinks,
                         alignment=np.array(heights))
    return rotor, found


def test_two_supports_are_the_lever_rule():
    rotor, found = loads_of((0.2, 1.6), discs=[Disc('wheel', 1.9, 50.0, 1.0, 2.0)],
                            heights=(0.0, 1e-3), sinks=(0.0, 1e-7))
    shaft = (rotor.mass - 50.0) * GRAVITY
    right = (shaft * 0.8 + 50.0 * GRAVITY * 1.7) / 1.4
    np.testing.assert_allclose(found, [rotor.mass * GRAVITY - right, right], rtol=1e-9)


def test_slender_beam_on_three_supports():
    # 3/16, 10/16, 3/16 of its weight without shear, which is 2e-5 of it here.
    rotor, found = loads_of((0.0, 1.0, 2.0), diameter=0.01)
    np.testing.assert_allclose(16.0 * found / (rotor.mass * GRAVITY), [3.0, 10.0, 3.0],
                               rtol=1e-4)


def test_one_block_below_all_bearings_moves_no_weight():
    # It settles and tilts as a whole: its bearings stay on a straight line.
    wheel, along = [Disc('wheel', 0.5, 20.0, 0.1, 0.2)], np.array([-0.7, 0.3, 1.3])
    _, firm = loads_of((0.0, 1.0, 2.0), discs=wheel)
    _, settled = loads_of((0.0, 1.0, 2.0), discs=wheel,
                          sinks=1e-8 * (np.ones((3, 3)) + np.outer(along, along)))
    np.testing.assert_allclose(settled, firm, rtol=1e-8)


@pytest.mark.parametrize('stiffness, most', [(4e8, 0.023), (1e8, 0.086), (3e7, 0.24)])
def test_blocks_of_their_own_move_weight_by_what_they_settle(stiffness, most):
    # The figures of the theory manual: largest change of a load of 307, 890, 209 N.
    wheel = [Disc('wheel', 0.5, 20.0, 0.1, 0.2)]
    _, firm = loads_of((0.0, 1.0, 2.0), discs=wheel)
    _, settled = loads_of((0.0, 1.0, 2.0), discs=wheel, sinks=(1.0 / stiffness,) * 3)
    assert np.abs(settled / firm - 1.0).max() == pytest.approx(most, rel=0.02)


def test_low_bearing_gives_its_load_to_its_neighbours():
    # 100 mm, 2 m, 20 kg at 0.5 m: 307, 890, 209 N; the middle 0.1 mm low 615, 275, 516 N.
    wheel = [Disc('wheel', 0.5, 20.0, 0.1, 0.2)]
    _, level = loads_of((0.0, 1.0, 2.0), discs=wheel)
    np.testing.assert_allclose(level, [307.0, 890.0, 209.0], rtol=5e-3)
    _, low = loads_of((0.0, 1.0, 2.0), discs=wheel, heights=(0.0, -1e-4, 0.0))
    np.testing.assert_allclose(low, [615.0, 275.0, 516.0], rtol=5e-3)


def test_support_that_sinks_is_a_spring_under_the_beam():
    # On a support of compliance a: r (1 + a / d) = r_rigid, d the compliance of the beam there.
    _, rigid = loads_of((0.0, 1.0, 2.0))
    _, low = loads_of((0.0, 1.0, 2.0), heights=(0.0, -1e-5, 0.0))
    own = 1e-5 / (rigid[1] - low[1])
    _, soft = loads_of((0.0, 1.0, 2.0), sinks=(0.0, 3.0 * own, 0.0))
    assert soft[1] == pytest.approx(rigid[1] / 4.0, rel=1e-6)


def test_damper_carries_nothing():
    rotor, found = loads_of((0.0, 1.0, 2.0), sinks=(0.0, math.inf, 0.0))
    np.testing.assert_allclose(found, rotor.mass * GRAVITY * np.array([0.5, 0.0, 0.5]),
                               rtol=1e-9)


@pytest.mark.parametrize('change, said', [
    ({'diameter': 0.0}, r'diameter must be > 0 m'),
    ({'length': 4.0}, r'length must be 0\.005 to 0\.4 m, .* got 4'),
    ({'radial_clearance': 0.08}, r'radial_clearance must be > 0 m and at most 0\.001 m'),
    ({'preload': 1.0}, r'preload must be in \[0, 1\), got 1'),
    ({'kind': 'elliptic', 'arc': 4.0}, r'arc_deg must be in \(0, 180\] deg, got 229'),
    ({'kind': 'tilting_pad', 'arc': 1.5}, r'arc_deg must be > 0 deg and at most 72 deg'),
    ({'kind': 'tilting_pad', 'arc': 1.0, 'pads': 2}, r'pads must be 3 to 16, got 2'),
    ({'kind': 'tilting_pad', 'arc': 1.0, 'pivot': 0.9}, r'pivot must be in \[0\.3, 0\.8\]'),
    ({'diameter': math.nan}, r'diameter must be > 0 m and finite, got nan'),
])
def test_bore_that_nobody_builds_is_refused(change, said):
    given = {'kind': 'plain', 'diameter': 0.1, 'length': 0.05, 'radial_clearance': 1e-4}
    with pytest.raises(RotorSoilError, match=said):
        JournalBearing(**{**given, **change})
