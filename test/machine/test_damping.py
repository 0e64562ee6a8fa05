"""Where the damping comes from: energy that closes, and shares that others computed."""

import csv
from dataclasses import replace
import math
from pathlib import Path

import numpy as np
import pytest

import rotorsoil_ros as rs
from rotorsoil_ros.ground.cone import ConeModel
from rotorsoil_ros.machine.damping import (
    BEARINGS,
    DampingSplitter,
    MATERIAL,
    PEDESTALS,
    RADIATION,
    SOIL,
)
from rotorsoil_ros.units import rpm_to_rad_s

from machines import elastic_machine, work_put_in

ROOT = Path(__file__).parents[1]
CONFIG = ROOT.parent / 'config'


def rows_of(name):
    text = (ROOT / 'reference' / 'damping' / f'{name}.csv').read_text().splitlines()
    return list(csv.DictReader(line for line in text if not line.startswith('#')))


def machine_of(case):
    return rs.load(CONFIG / f'{case}.yaml')


@pytest.mark.parametrize('row', rows_of('damping_split_forced'),
                         ids=lambda row: f'{row["case"]}-{row["rpm"]}')
def test_forced_shares_are_those_of_the_energy_balance(row):
    found = machine_of(row['case']).damping_split(rpm=float(row['rpm']))
    assert found.total[0] == pytest.approx(float(row['input_J_per_cycle']), rel=1e-3)
    for kind, key in ((BEARINGS, 'bearings'), (RADIATION, 'soil_radiation'),
                      (MATERIAL, 'soil_hysteresis')):
        assert found.share(kind)[0] == pytest.approx(float(row[key]), abs=1e-3)


@pytest.mark.parametrize('case', ['plant_fan', 'paper_rotor'])
def test_shares_of_modes_are_those_of_the_complex_mode(case):
    machine = machine_of(case)
    wanted = [row for row in rows_of('damping_split_modes') if row['case'] == case]
    criticals = machine.critical_speeds()
    splits = DampingSplitter(machine.model).of_modes(criticals)
    for row in wanted:
        [(one, split)] = [(one, split) for one, split in zip(criticals, splits, strict=True)
                          if abs(one.speed_rpm - float(row['critical_rpm'])) < 0.1]
        assert one.damping_ratio == pytest.approx(float(row['damping_ratio']), abs=6e-6)
        for kind, key in ((BEARINGS, 'bearings'), (RADIATION, 'soil_radiation'),
                          (MATERIAL, 'soil_hysteresis')):
            assert split.share(kind)[0] == pytest.approx(float(row[key]), abs=2e-3)


@pytest.mark.parametrize('case, rpm', [
    ('plant_fan', (300.0, 900.0, 1253.0, 1800.0)), ('paper_rotor', (1000.0, 2932.0, 7770.0)),
    ('turbo_blower', (700.0, 2500.0, 4200.0))])
def test_all_that_is_put_in_is_taken(case, rpm):
    machine, speed = machine_of(case), rpm_to_rad_s(np.array(rpm))
    found = DampingSplitter(machine.model).forced(speed, machine.case.unbalance)
    np.testing.assert_allclose(
        found.total, work_put_in(machine.model, speed, machine.case.unbalance), rtol=1e-12)


def test_pedestals_take_their_part():
    model = elastic_machine()
    # Two moments, and no couple: its work would need the slope of the disc.
    speed, unbalance = np.array([40.0, 150.0]), np.array([1e-3, 5e-4j, 0.0])
    found = DampingSplitter(model).forced(speed, unbalance)
    assert PEDESTALS in found.kinds
    assert np.all(found.share(PEDESTALS) > 0.0)
    np.testing.assert_allclose(
        found.total, work_put_in(model, speed, unbalance), rtol=1e-10)
    # Springs alone take nothing, unless their cross terms differ.
    undamped = replace(model, rotor=replace(model.rotor, bearings=tuple(
        one if one.pedestal is None else replace(one, pedestal=replace(
            one.pedestal, stiffness=4e8 * np.eye(2), damping=np.zeros((2, 2))))
        for one in model.rotor.bearings)))
    rest = DampingSplitter(undamped).forced(speed, unbalance)
    np.testing.assert_allclose(rest.share(PEDESTALS), 0.0, atol=1e-12)


def test_soil_without_a_loss_factor_only_radiates():
    machine = machine_of('plant_fan')
    case = machine.case.changed(['soil.loss_factor=0'])
    found = rs.Machine(case, machine.directory).damping_split(rpm=[300.0, 1500.0])
    np.testing.assert_allclose(found.share(MATERIAL), 0.0, atol=1e-12)
    assert np.all(found.share(RADIATION) > 0.9)


def test_bearings_take_all_on_firm_ground():
    case = machine_of('plant_fan').case.changed(['support.model=rigid'])
    machine = rs.Machine(case, machine_of('plant_fan').directory)
    found = machine.damping_split(rpm=1500.0)
    assert found.share(BEARINGS)[0] == pytest.approx(1.0, abs=1e-12)
    assert found.share(BEARINGS, 'drive_end')[0] + found.share(BEARINGS, 'fan_end')[0] == (
        pytest.approx(1.0, abs=1e-12))


def test_infinite_elements_have_a_twin_without_loss(tmp_path):
    # Cones radiate too much at low a0: elements leave more to the material, and both close.
    machine = rs.load(CONFIG / 'plant_fan.yaml', cache_directory=tmp_path,
                      support={'model': 'infinite_elements'})
    found = machine.damping_split(rpm=1500.0)
    cones = machine_of('plant_fan').damping_split(rpm=1500.0)
    assert found.kinds == (BEARINGS, RADIATION, MATERIAL)
    assert 0.5 < found.share(RADIATION)[0] < cones.share(RADIATION)[0]


class Measured:
    """Ground of which nobody knows what it would be without loss."""

    def __init__(self, model):
        self._model = model

    def compliance(self, omega):
        """Return that of the model."""
        return self._model.compliance(omega)


def test_ground_without_a_twin_is_one_share():
    machine = machine_of('plant_fan')
    cone = ConeModel(machine.case.soil, machine.case.foundations[0].contact)
    model = replace(machine.model, soil_models=(Measured(cone),))
    speed = rpm_to_rad_s(np.array([1500.0]))
    found = DampingSplitter(model).forced(speed, machine.case.unbalance)
    whole = machine.damping_split(rpm=1500.0)
    assert found.kinds == (BEARINGS, SOIL)
    assert found.share(SOIL)[0] == pytest.approx(
        whole.share(RADIATION)[0] + whole.share(MATERIAL)[0], rel=1e-12)


def test_mode_that_hardly_swings_has_no_split():
    machine = machine_of('paper_rotor')
    criticals = machine.critical_speeds()
    for one, split in zip(criticals, DampingSplitter(machine.model).of_modes(criticals),
                          strict=True):
        assert (split is None) == (one.damping_ratio > 0.7)


def test_words_name_the_largest_first():
    found = machine_of('plant_fan').damping_split(rpm=1500.0)
    assert found.words(0) == 'radiation 87.0%, soil material 12.8%, bearings 0.1%'
    assert list(found.shares(0)) == [BEARINGS, RADIATION, MATERIAL]


def test_machine_without_unbalance_has_no_shares():
    machine = machine_of('plant_fan')
    found = DampingSplitter(machine.model).forced(np.array([100.0]), np.zeros(2, dtype=complex))
    assert math.isnan(found.share(RADIATION)[0])
    assert found.words(0) == 'none'
