"""The design question: against direct solutions, closed forms, and cases edited by hand."""

import math
from pathlib import Path

import numpy as np
import pytest

import rotorsoil_ros as rs
from rotorsoil_ros.case.design.influence import on_larger_blocks
from rotorsoil_ros.case.design.inputs import input_of, INPUTS
from rotorsoil_ros.case.design.report import Acceptance, HousingAnswer
from rotorsoil_ros.channel import Channel
from rotorsoil_ros.errors import InputError, RotorSoilError
from rotorsoil_ros.machine.spread import OF_LAYER, SoilSpread
from rotorsoil_ros.units import rpm_to_rad_s

FAN = Path(__file__).parents[2] / 'config' / 'plant_fan.yaml'
CASES = Path(__file__).parents[1] / 'cases'
RPM = 990.0


def fan(tmp_path, **changes):
    return rs.load(FAN, cache_directory=tmp_path, **changes)


@pytest.fixture(scope='module')
def report(tmp_path_factory):
    """Return the fan at its speed."""
    return fan(tmp_path_factory.mktemp('cache')).report(rpm=RPM)


def test_numbers_are_those_of_a_direct_solution(report, tmp_path):
    solved = fan(tmp_path).response(rpm=RPM)
    said = {one['housing']: one for one in report.to_json()['housings']}
    assert set(said) == {name for name in solved.channels if '_housing_' in name}
    for name, one in said.items():
        velocity = solved[name].velocity_mm_s_rms()[0, 0]
        low, nominal, high = one['velocity_mm_s_rms']
        assert nominal == pytest.approx(velocity, rel=1e-5)
        assert low < nominal < high
        # Once per turn: v_rms = omega x_pp / (2 sqrt 2).
        assert nominal == pytest.approx(
            1e-3 * rpm_to_rad_s(RPM) * one['displacement_um_pp'][1] / (2.0 * math.sqrt(2.0)))


def test_band_of_the_report_is_no_narrower_than_that_of_the_machine(report, tmp_path):
    bounds = fan(tmp_path).band(rpm=RPM)
    for one in report.housings:
        low, _, high = bounds[one.channel].velocity_mm_s_rms()[:, 0, 0]
        assert 1e3 * one.velocity[0] <= low * (1.0 + 1e-12)
        assert 1e3 * one.velocity[2] >= high * (1.0 - 1e-12)


@pytest.mark.parametrize('velocity, zone', [(1.4, 'A'), (1.41, 'B'), (2.8, 'B'), (2.81, 'C'),
                                            (4.51, 'D')])
def test_zone_is_that_of_the_standard(velocity, zone):
    speed = rpm_to_rad_s(RPM)
    amplitude = np.full(3, 1e-3 * velocity * math.sqrt(2.0) / speed)
    housing = HousingAnswer(Channel('b1', 'housing', 'x'), amplitude, speed, 'rigid',
                            (1.4e-3, 2.8e-3, 4.5e-3))
    assert housing.zones == (zone, zone, zone)


def test_modes_beyond_the_speed_range_are_found_by_name_with_what_api_617_asks(tmp_path):
    machine = fan(tmp_path, speed_range_rpm=[100, 1000])
    found = machine.report(rpm=RPM)
    [rocking] = [one for one in found.modes.nearest(3) if one.name == 'block rocking across']
    assert 1200.0 < rocking.critical.speed_rpm < 1300.0
    assert rocking.margin == pytest.approx(rocking.critical.speed_rpm / RPM - 1.0)
    factor = max(0.5 / rocking.critical.damping_ratio,
                 0.0 if math.isnan(rocking.half_power_factor) else rocking.half_power_factor)
    # API 617 as RP 684 explains it: above the running speed.
    assert rocking.required == pytest.approx(
        0.10 + min(0.17 * (1.0 - 1.0 / (factor - 1.5)), 0.16))
    low, high = found.modes.span
    assert low < 0.5 * rpm_to_rad_s(RPM)
    assert high > 1.5 * rpm_to_rad_s(1000.0)


def test_mode_that_is_too_near_is_not_acceptable(tmp_path):
    found = fan(tmp_path).report(rpm=1200.0)
    assert found.verdict == Acceptance.NOT_ACCEPTABLE
    assert 'block rocking across is critical at 125' in found.reasons[0]
    assert found.next_step.startswith('Move block rocking across from 125')


def test_what_decides_is_the_case_with_that_number_changed_by_hand(report, tmp_path):
    first = report.influences[0]
    assert first.key == 'shear_modulus_factor'
    name = report.housings[0].channel
    for place, factor in ((0, 0.5), (1, 1.0), (2, 2.0)):
        other = fan(tmp_path, soil={'shear_modulus': factor * 100e6}).response(rpm=RPM)
        assert 1e3 * first.ends[place] == pytest.approx(
            other[name].velocity_mm_s_rms()[0, 0], rel=1e-9)
    swings = [one.swing for one in report.influences]
    assert swings == sorted(swings, reverse=True)
    assert {one.key for one in report.influences} == {
        'shear_modulus_factor', 'poisson_ratio', 'loss_factor'}


def test_unbalance_that_is_not_known_scales_the_answer(report, tmp_path):
    wide = fan(tmp_path, uncertainty={'unbalance_factor': 3.0}).report(rpm=RPM)
    [unbalance] = [one for one in wide.influences if one.key == 'unbalance_factor']
    np.testing.assert_allclose(unbalance.ends / unbalance.ends[1], [1.0 / 3.0, 1.0, 3.0])
    high = dict(zip([one.channel for one in wide.housings],
                    [one.velocity[2] for one in wide.housings], strict=True))
    for one in report.housings:
        assert high[one.channel] >= 3.0 * one.velocity[2] * (1.0 - 1e-9)


def test_every_input_has_words():
    spread = set(SoilSpread.__dataclass_fields__) - {'samples', 'model_form', 'layers', OF_LAYER}
    assert set(INPUTS) == spread
    own = SoilSpread(layer_stiffness_factor=2.0, layers=3).inputs(with_soil=True)
    assert 'stiffness of layer 3' in [input_of(name).words for name in own]


@pytest.mark.parametrize('moment, verdict, said', [
    (0.028, Acceptance.ACCEPTABLE, 'no housing vibrates with more than'),
    (0.12, Acceptance.UNDECIDED, 'as far as the machine is known'),
    (0.40, Acceptance.NOT_ACCEPTABLE, 'zone D; up to 2.8 mm/s is acceptable')])
def test_verdict_follows_the_band(moment, verdict, said, tmp_path):
    found = fan(tmp_path, **{'unbalances.0.moment': moment}).report(rpm=RPM)
    assert found.verdict == verdict
    assert said in found.reasons[0]
    assert found.sentence.lower().startswith(str(verdict))


def test_remedy_is_the_machine_with_that_block(tmp_path):
    found = fan(tmp_path, **{'unbalances.0.moment': 0.40}).report(rpm=RPM)
    said = found.next_step
    larger = fan(tmp_path, **{
        'unbalances.0.moment': 0.40, 'foundations.0.half_width': 1.25,
        'foundations.0.half_length': 1.875, 'foundations.0.mass': 19580.0 * 1.5625,
        'foundations.0.inertia': [value * 1.5625**2 for value in (19.3e3, 10.9e3, 20.2e3)]})
    there = larger.response(rpm=RPM)[found.housings[0].channel].velocity_mm_s_rms()[0, 0]
    assert f'on a block 25% longer and wider {there:.3g} mm/s' in said
    now = 1e3 * found.housings[0].velocity[1]
    assert f'{now / 2.5:.3g} instead of {now:.3g} mm/s' in said


@pytest.mark.parametrize('model', ['thin_layers', 'boundary_elements'])
def test_ground_below_a_larger_block_is_solved_anew(model, cache):
    own = {'support.model': model, 'speed_range_rpm': [100, 1000]}
    larger = fan(cache, **own, **{
        'foundations.0.half_width': 1.25, 'foundations.0.half_length': 1.875,
        'foundations.0.mass': 19580.0 * 1.5625,
        'foundations.0.inertia': [value * 1.5625**2 for value in (19.3e3, 10.9e3, 20.2e3)]})
    machine = fan(cache, **own)
    found = on_larger_blocks(machine.case, cache, 1.25).unbalance_response(
        rpm_to_rad_s(np.array([900.0])), machine.case.unbalance)
    np.testing.assert_allclose(
        found.displacement, larger.response(rpm=900.0).displacement, rtol=1e-9)


@pytest.mark.parametrize('settings, reason', [
    ({'support.model': 'rigid'}, 'the support is rigid'),
    ({'foundations': [
        {'name': name, 'radius': 0.45, 'mass': 900.0, 'height': 1.0, 'centre_y': along}
        for name, along in (('front', 0.0), ('back', 1.0))],
      'rotor.bearings.0.foundation': 'front', 'rotor.bearings.1.foundation': 'back'},
     'front and back would overlap')])
def test_why_a_larger_block_is_no_remedy_is_said(settings, reason, tmp_path):
    with pytest.raises(RotorSoilError, match=reason):
        on_larger_blocks(fan(tmp_path, **settings).case, tmp_path, 1.25)


@pytest.mark.parametrize('name', ['unst', 'unstable_without_a_word'])
def test_machine_that_is_unstable_gets_no_number(name, tmp_path):
    machine = rs.load(CASES / name / 'case.yaml', cache_directory=tmp_path)
    middle = machine.case.speed_range[1] * 0.9
    found = machine.report(rpm=middle * 60.0 / (2.0 * math.pi))
    assert found.verdict == Acceptance.NOT_ACCEPTABLE
    assert found.stable is False
    assert 'no steady vibration exists, unstable' in found.reasons[0]
    for one in found.to_json()['housings']:
        assert one['velocity_mm_s_rms'] == [None, None, None]
        assert one['zone'] is None
    assert found.influences == ()
    assert 'feeds the vibration' in found.next_step


def test_rigid_ground_is_undecided(tmp_path):
    found = fan(tmp_path, support={'model': 'rigid'}).report(rpm=RPM)
    assert found.verdict == Acceptance.UNDECIDED
    assert 'no housing moves' in found.reasons[0]
    assert found.housings == ()


def test_case_without_unbalance_is_undecided(tmp_path):
    found = fan(tmp_path, unbalances=[]).report(rpm=RPM)
    assert found.verdict == Acceptance.UNDECIDED
    assert 'no unbalance' in found.reasons[0]


def test_speed_outside_the_range_is_refused(tmp_path):
    with pytest.raises(InputError, match=r'speed_range_rpm: must hold the running speed, got '
                                         r'\[100, 1800\] rpm, and 2000 rpm'):
        fan(tmp_path).report(rpm=2000.0)


def test_guesses_of_the_file_are_told_unless_they_were_set_since(tmp_path):
    case = tmp_path / 'fan.yaml'
    case.write_text(FAN.read_text().replace(
        'speed_range_rpm', '# no guess: a comment of its own\nspeed_range_rpm').replace(
        'mass: 19580.0                       # [kg]', 'mass: 19580.0  # guess [kg]: by hand'))
    found = rs.load(case, cache_directory=tmp_path).report(rpm=RPM)
    assert [(one.key, one.why) for one in found.guesses] == [('foundations.0.mass', 'by hand')]
    changed = rs.load(case, cache_directory=tmp_path, **{'foundations.0.mass': 2e4})
    assert changed.report(rpm=RPM).guesses == ()
