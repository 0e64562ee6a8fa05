"""What a case leads one to expect, and that a band costs no solution of the soil."""

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest

from rotorsoil_ros.case.cache import Cache
from rotorsoil_ros.case.config import load
from rotorsoil_ros.case.design.tables import infinite_element_model
from rotorsoil_ros.case.models import coupled_model, response_band, response_table
from rotorsoil_ros.ground.elements import tabulate as elements_tabulate
from rotorsoil_ros.machine.spread import SoilSpread
from rotorsoil_ros.monitor.criteria import answer, Expectation
from rotorsoil_ros.units import rad_s_to_rpm

CASES = Path(__file__).parents[2] / 'config'
FIELD = Path(__file__).parents[1] / 'cases'


def few(case):
    """Return a case with five soils in its band."""
    return dataclasses.replace(case, uncertainty=SoilSpread(samples=5))


@pytest.fixture(scope='module')
def fan(tmp_path_factory):
    """Return what to expect of the fan."""
    return Expectation.of(few(load(CASES / 'plant_fan.yaml')), tmp_path_factory.mktemp('cache'))


def test_lowest_natural_speeds_are_told_by_direction(fan):
    # With the rotor as a rigid mass; `check` lists criticals at 1253 rpm along x, 1389 along z.
    assert rad_s_to_rpm(fan.lowest_natural_speed('x')) == pytest.approx(1272.3, abs=0.1)
    assert rad_s_to_rpm(fan.lowest_natural_speed('z')) == pytest.approx(1426.7, abs=0.1)


def test_bending_of_the_shaft_makes_no_support_flexible(tmp_path):
    # Both first bending modes, 1980 and 2024 rpm, lie in the range of the rotor kit.
    case = load(CASES / 'rk4_rotor_kit.yaml')
    found = Expectation.of(few(case), tmp_path)
    assert len(found.criticals) == 2
    assert found.lowest_natural_speed('x') == found.lowest_natural_speed('z') == math.inf
    assert found.band is None


def test_a_bearing_table_of_the_speed_range_clips_what_is_looked_for(tmp_path):
    case = load(FIELD / 'fan_table' / 'case.yaml')
    found = Expectation.of(few(case), tmp_path)
    assert found.band is not None
    assert len(found.modes) == 3
    assert 'looked for from 100 to 1800 rpm only: tables of bearings end there' in found.note
    assert math.isfinite(found.lowest_natural_speed('x'))


@pytest.mark.slow
def test_band_of_infinite_elements_solves_no_soil(tmp_path, monkeypatch):
    case = load(CASES / 'plant_fan.yaml', ['support.model=infinite_elements'])
    coupled_model(case, tmp_path)

    def refuse(*arguments, **options):
        raise AssertionError('the soil was solved again')

    monkeypatch.setattr(elements_tabulate, 'tabulate', refuse)
    found = Expectation.of(few(case), tmp_path)
    assert found.band is not None
    assert len(found.band.tables) == 5


def test_comparison_goes_on_where_a_table_does_not_determine_the_modes(tmp_path):
    dofs, stiffness = ('xx', 'yy', 'zz', 'rxrx', 'ryry', 'rzrz'), np.array(
        [1.2e8, 1.2e8, 1.4e8, 3e7, 3e7, 5e7])
    rows = ['omega_rad_s,' + ','.join(f'{dof}_re,{dof}_im' for dof in dofs)]
    for number, omega in enumerate(np.linspace(6.0, 1000.0, 30)):
        jumping = (1.0 + 0.3 * (-1.0) ** number) * stiffness
        rows.append(f'{omega},' + ','.join(f'{each},{0.15 * each}' for each in jumping))
    (tmp_path / 'jumping.csv').write_text('\n'.join(rows) + '\n')
    case = load(CASES / 'paper_rotor.yaml', [
        'support={model: table, file: ' + str(tmp_path / 'jumping.csv') + '}',
        'foundations.0.mass=4200'])
    found = Expectation.of(case, tmp_path)
    assert found.modes == ()
    assert 'critical speeds of the model are not known' in found.note
    prediction = answer(found.table.predictor(case.unbalance), np.array([300.0, 1e6]))
    assert np.isfinite(prediction[0]).any()
    assert np.isnan(prediction[1]).all()  # out of the table


@pytest.mark.slow
def test_truth_on_infinite_elements_leaves_the_band_of_cones_only_without_model_form(tmp_path):
    # Of 60 soils 100 and 2 percent: `python benchmarks/band.py`.
    case = load(CASES / 'plant_fan.yaml')
    model = coupled_model(case, tmp_path)
    table = response_table(case, model, tmp_path)
    speed = np.linspace(*case.speed_range, 300)
    nominal = table.predictor(case.unbalance).answer(speed).displacement
    moving = np.abs(nominal).max(axis=0) > 1e-9 * np.abs(nominal).max()
    worst = {}
    for form in (False, True):
        band = response_band(case, model, table, tmp_path,
                             dataclasses.replace(case.uncertainty, model_form=form))
        found = band.envelope(case.unbalance).at(speed).around(nominal)
        worst[form] = max(
            np.max(np.abs(truth)[:, moving] / found.high[:, moving])
            for truth in truths(case, model, speed, tmp_path))
    assert worst[False] > 1.4
    assert worst[True] < 1.15


def truths(case, model, speed, directory):
    for factor in (0.6, 0.8, 1.2, 1.7):
        soil = dataclasses.replace(case.soil, shear_modulus=factor * case.soil.shear_modulus)
        ground = tuple(infinite_element_model(soil, block.contact, 'disc', cache=Cache(directory),
                                              speed_range=case.speed_range)
                       for block in model.foundations)
        truth = dataclasses.replace(model, soil_models=ground)
        yield truth.unbalance_response(speed, case.unbalance).displacement
