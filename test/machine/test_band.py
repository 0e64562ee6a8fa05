"""The soil band against solving the machine on every soil."""

from dataclasses import replace
import math

import numpy as np
import pytest

from rotorsoil_ros.ground.cone import ConeModel
from rotorsoil_ros.ground.soil import Soil
from rotorsoil_ros.machine.band import Envelope, of_other_form, ResponseBand
from rotorsoil_ros.machine.response import ResponseTable
from rotorsoil_ros.machine.spread import SoilSpread

from machines import CONTACT, paper_machine, SOIL

UNBALANCE = np.array([1e-5, 2e-6j])
RANGE = (60.0, 900.0)
SPREAD = SoilSpread(samples=12)


def soils_of(spread, soil=SOIL):
    """Return all soils of a spread."""
    return [spread.soil(soil, place) for place in spread.places(with_soil=True)]


@pytest.fixture(scope='module')
def models():
    """Return the paper's machine on twelve soils, the given one first."""
    return [paper_machine(ConeModel(soil, CONTACT)) for soil in soils_of(SPREAD)]


@pytest.fixture(scope='module')
def envelope(models):
    """Return its band."""
    table = ResponseTable.build(models[0], RANGE)
    return ResponseBand.build(table, models[1:]).envelope(UNBALANCE)


def test_band_is_the_range_over_all_soils(models, envelope):
    speed = np.random.default_rng(0).uniform(*RANGE, size=400)
    exact = np.array([model.unbalance_response(speed, UNBALANCE).displacement
                      for model in models])
    found = envelope.at(speed)
    moving = [i for i, name in enumerate(models[0].channels) if name != 'block_y']
    size = np.abs(exact)[..., moving]
    # Linear between eight speeds per piece: 2 % where twelve sharp peaks stand side by side.
    np.testing.assert_allclose(found.high[:, moving], size.max(axis=0), rtol=0.02)
    np.testing.assert_allclose(found.low[:, moving], size.min(axis=0), rtol=0.02,
                               atol=2e-3 * size.min(axis=0).max())
    turn = np.angle(exact * exact[0].conj())[..., moving]
    known = found.ahead[:, moving] < math.pi
    np.testing.assert_allclose(found.ahead[:, moving][known], turn.max(axis=0)[known], atol=0.05)
    np.testing.assert_allclose(found.behind[:, moving][known], turn.min(axis=0)[known], atol=0.05)


def test_given_soil_lies_in_its_band(models, envelope):
    speed = envelope.speed[::5]
    exact = models[0].unbalance_response(speed, UNBALANCE).displacement
    moving = [i for i, name in enumerate(models[0].channels) if name != 'block_y']
    slack = 1.0 + np.array([-1e-3, 1e-3])
    found = envelope.at(speed)
    assert np.all(np.abs(exact)[:, moving] >= slack[0] * found.low[:, moving])
    assert np.all(np.abs(exact)[:, moving] <= slack[1] * found.high[:, moving])


def test_a_machine_that_grows_is_in_no_band_and_is_told(models):
    table = ResponseTable.build(models[0], RANGE)
    plain = ResponseBand.build(table, models[1:3])
    rotor = models[1].rotor
    skew = np.array([[0.0, 5e7], [-5e7, 0.0]])  # a film that whirls
    growing = replace(models[1], rotor=replace(rotor, bearings=tuple(
        replace(bearing, stiffness=bearing.stiffness + skew) for bearing in rotor.bearings)))
    both = ResponseBand.build(table, [*models[1:3], growing])
    assert plain.unstable == ''
    assert both.unstable.startswith('1 of the 3 other machines')
    speed = np.linspace(*RANGE, 200)
    with_it, without = (band.envelope(UNBALANCE).at(speed) for band in (both, plain))
    grows = ~both.tables[-1].stability.holds(speed)
    assert grows.any()
    for edge in ('low', 'high'):
        np.testing.assert_allclose(getattr(with_it, edge)[grows], getattr(without, edge)[grows],
                                   rtol=0.05)


def sharp_machine(soil=SOIL):
    """Return the paper's machine with bearings that hardly damp: deep antiresonances."""
    return paper_machine(ConeModel(soil, CONTACT), mass=4200.0, damping=5.0)


def test_prediction_lies_in_its_own_band_everywhere():
    table = ResponseTable.build(sharp_machine(), RANGE)
    others = [sharp_machine(soil) for soil in soils_of(SoilSpread(samples=5))[1:]]
    found = ResponseBand.build(table, others).envelope(UNBALANCE)
    speed = np.sort(np.random.default_rng(3).uniform(*RANGE, 20_000))
    nominal = table.predictor(UNBALANCE).predict(speed).displacement
    band = found.at(speed).around(nominal)
    assert ((band.low <= np.abs(nominal)) & (np.abs(nominal) <= band.high)).all()
    # What the guard lifts is no more than what straight lines may miss.
    moving = np.abs(nominal).max(axis=0) > 1e-9 * np.abs(nominal).max()
    plain, size = found.at(speed), np.abs(nominal)[:, moving]
    floor = 2e-2 * np.maximum(size, 1e-5 * size.max(axis=0))
    assert np.all(plain.low[:, moving] <= size + 2.0 * floor)
    assert np.all(plain.high[:, moving] >= size - 2.0 * floor)


def test_edges_follow_an_antiresonance_between_the_first_speeds():
    table = ResponseTable.build(sharp_machine(), RANGE)
    others = [sharp_machine(soil) for soil in soils_of(SoilSpread(samples=5))[1:]]
    found = ResponseBand.build(table, others).envelope(UNBALANCE)
    speed = np.sort(np.random.default_rng(5).uniform(*RANGE, 4000))
    exact = np.abs([model.unbalance_response(speed, UNBALANCE).displacement
                    for model in (sharp_machine(), *others)])
    moving = exact.max(axis=(0, 1)) > 1e-9 * exact.max()
    band = found.at(speed)
    low, high = exact.min(axis=0)[:, moving], exact.max(axis=0)[:, moving]
    floor = np.maximum(low, 1e-4 * high.max(axis=0))
    assert np.mean(np.abs(band.low[:, moving] - low) > 0.05 * floor) < 0.01
    assert np.mean(np.abs(band.high[:, moving] - high) > 0.05 * high) < 0.01


def test_other_forms_change_the_ground_only():
    model, soft = paper_machine(), ConeModel(Soil(1e6, 0.2, 1800.0), CONTACT)
    same = of_other_form(model, solved=[soft], stiffer=[0.2], takes_solved=False,
                         takes_stiffer=False)
    assert same == model
    other = of_other_form(model, solved=[soft], stiffer=[0.2], takes_solved=True,
                          takes_stiffer=True)
    omega = np.array([100.0])
    np.testing.assert_allclose(other.soil_models[0].compliance(omega),
                               soft.compliance(omega) / 1.2, rtol=1e-15)
    assert other.rotor == model.rotor


def test_unbalance_that_is_not_known_scales_both_edges(models, envelope):
    table = ResponseTable.build(models[0], RANGE)
    found = ResponseBand.build(table, models[1:], unbalance_factor=2.5).envelope(UNBALANCE)
    np.testing.assert_array_equal(found.low, envelope.low / 2.5)
    np.testing.assert_array_equal(found.high, envelope.high * 2.5)


def test_soil_matters_near_the_resonance_and_not_far_above_it():
    # A mass on a spring: below 1.5 f_n the band matters, above 3 f_n mass decides.
    soft = [paper_machine(ConeModel(soil, CONTACT), mass=2000.0)
            for soil in soils_of(SoilSpread(samples=5))]
    block = soft[0].channels.index('block_z')
    speed = np.array([300.0, 2500.0])
    size = np.array([np.abs(model.unbalance_response(speed, UNBALANCE).displacement[:, block])
                     for model in soft])
    ratio = size.max(axis=0) / size.min(axis=0)
    assert ratio[0] > 1.3
    assert ratio[1] < 1.01


def test_outside_its_speeds_there_is_no_band(envelope):
    found = envelope.at(np.array([1.0, math.nan, 1e4, 100.0]))
    assert np.isnan(found.high[:3]).all()
    assert np.isfinite(found.high[3]).all()
    assert np.isnan(found.low[:3]).all()


def test_envelope_at_one_speed_has_the_bits_of_many():
    random = np.random.default_rng(4)
    edges = np.sort(random.uniform(10.0, 100.0, 30))
    envelope = Envelope(edges, *random.normal(size=(4, 30, 5)))
    speed = np.concatenate([random.uniform(0.0, 110.0, 200), edges, [np.nan]])
    together = envelope.at(speed)
    for name in ('low', 'high', 'behind', 'ahead'):
        apart = [getattr(envelope.at(speed[row:row + 1]), name) for row in range(len(speed))]
        np.testing.assert_array_equal(np.concatenate(apart), getattr(together, name))
    inside = (speed >= edges[0]) & (speed <= edges[-1])
    assert np.isfinite(together.low).all(axis=1).tolist() == inside.tolist()
    np.testing.assert_allclose(together.low[200:230], envelope.low, rtol=1e-9, atol=1e-9)
