"""Layers, rock and embedment in a case: what it stands for, what it tells, and what is refused."""

from dataclasses import replace
import math

import numpy as np
import pytest
import yaml

import rotorsoil_ros as rs
from rotorsoil_ros.bags.synthetic import on_ground
from rotorsoil_ros.case.cache import Cache
from rotorsoil_ros.case.design.depth import depth_remarks
from rotorsoil_ros.case.design.ground import band_contents, model_error
from rotorsoil_ros.case.design.influence import influences, velocity
from rotorsoil_ros.case.design.inputs import input_of
from rotorsoil_ros.case.design.shapes import shape_errors
from rotorsoil_ros.case.models import machine_at
from rotorsoil_ros.case.summary import derived_quantities, warnings
from rotorsoil_ros.channel import DOFS
from rotorsoil_ros.errors import InputError
from rotorsoil_ros.ground.layers.profile import Embedment, Layer, LayeredSoil
from rotorsoil_ros.ground.neighbours import on_soil
from rotorsoil_ros.ground.soil import Soil
from rotorsoil_ros.machine.band import on_soils
from rotorsoil_ros.machine.spread import SoilSpread

FAN = 'rotorsoil_ros/config/plant_fan.yaml'
SAND = {'shear_modulus': 100e6, 'poisson_ratio': 0.3, 'density': 1900.0, 'loss_factor': 0.05}
LAYER = {**SAND, 'thickness': 1.5}
ROCK = {'layers': [LAYER], 'below': 'rock'}
THIN = {'model': 'thin_layers'}
BY_SHAPE = {'model': 'boundary_elements'}


@pytest.fixture
def fan(pytestconfig, tmp_path, cache):
    """Return the plant fan with other keys."""
    content = yaml.safe_load((pytestconfig.rootpath / FAN).read_text())

    def changed(*, block=None, **keys):
        path = tmp_path / 'fan.yaml'
        blocks = [{**content['foundations'][0], **(block or {})}]
        path.write_text(yaml.safe_dump({**content, 'foundations': blocks, **keys}))
        return rs.load(path, cache_directory=cache)
    return changed


def test_rock_under_the_fan_multiplies_its_highest_peak(fan):
    machine = fan(soil=ROCK, support=THIN)
    run = machine.response(rpm=np.arange(1000.0, 1600.0, 2.0))
    # 17.8 um of the half-space without rock, on cones.
    assert np.abs(run['wheel_x'].displacement).max() == pytest.approx(77e-6, rel=0.02)


def test_homogeneous_ground_by_thin_layers_is_that_of_infinite_elements(fan):
    thin, infinite = (fan(support={'model': model}).model.soil_models[0]
                      for model in ('thin_layers', 'infinite_elements'))
    omega = np.linspace(5.0, 370.0, 12)
    one, other = (model.compliance(omega) for model in (thin, infinite))
    size = np.sqrt(np.abs(np.einsum('nii->ni', other)))
    assert (np.abs(one - other) / (size[:, :, None] * size[:, None])).max() < 5e-3


def test_table_of_layers_is_computed_once(fan, cache):
    first = fan(soil=ROCK, support=THIN).model.soil_models[0]
    before = sorted(cache.glob('compliance_*'))
    stiffer = {'layers': [{**LAYER, 'shear_modulus': 101e6}], 'below': 'rock'}
    again = fan(soil=stiffer, support=THIN).model.soil_models[0]
    assert sorted(cache.glob('compliance_*')) == before
    np.testing.assert_array_equal(again.table.edges, first.table.edges)


def test_case_tells_its_layers(fan):
    machine = fan(soil={'layers': [LAYER], 'below': {**SAND, 'shear_modulus': 300e6}},
                  support=THIN, block={'embedment': 0.8, 'side_contact': 0.5})
    told = dict(derived_quantities(machine.case, machine.model.soil_models))
    assert told['layer 1'].startswith('0 to 1.5 m')
    assert told['below'].startswith('from 1.5 m, half-space')
    assert '0.8 m below the surface, 50% of the wall welded' in told['block: base']
    assert 'thin layers under a disc' in told['block: model error']


def test_block_on_layers_by_its_shape_is_stiffer_than_its_discs_by_what_check_says(fan, cache):
    thin, by_shape = (fan(soil=ROCK, support=support) for support in (THIN, BY_SHAPE))
    model = thin.model
    [shape] = shape_errors(thin.case, model.support.soils, cache)
    told = model_error(thin.case, thin.case.foundations[0], shape)
    assert told.endswith('against boundary elements')
    assert 'half-space' not in told
    omega = np.array([shape.omega])
    dof = DOFS.index(shape.dof)
    one, other = (machine.model.support.soils[0].compliance(omega)[0, dof, dof]
                  for machine in (thin, by_shape))
    assert abs(one / other - 1.0) == pytest.approx(shape.share, rel=1e-2)
    assert 0.05 < shape.share < 0.2
    assert 'on these layers: within 0.6%' in dict(
        derived_quantities(by_shape.case, by_shape.model.soil_models))['block: model error']
    # Light modes below the cut-off of the layer, by pieces as on discs.
    speeds = [[one.speed for one in machine.critical_speeds()] for machine in (thin, by_shape)]
    assert len(speeds[0]) == len(speeds[1]) == 2
    assert all(1.0 < shaped / round_ < 1.05 for round_, shaped in zip(*speeds, strict=True))


def test_block_in_the_ground_on_cones_is_near_that_of_thin_layers_as_check_says(fan, cache):
    block = {'embedment': 0.8}
    cones, thin = (fan(block=block, support=support)
                   for support in ({'model': 'cone'}, THIN))
    model = cones.model
    [shape] = shape_errors(cones.case, model.support.soils, cache)
    assert 0.02 < shape.share < 0.2
    told = dict(derived_quantities(cones.case, model.soil_models, [shape]))
    assert f'stack of cones: compliance off by up to {shape.share:.0%}' in told[
        'block: model error']
    assert 'discs stand for a rectangle of 1.5 to 1' in told['block: model error']
    assert told['block: base'].startswith('0.8 m below the surface')
    assert told['edges of the band hold'].endswith('cones against thin layers')
    assert not any('cones damp too much' in one for one in warnings(cones.case))
    one, other = (np.abs(machine.response(rpm=np.arange(300.0, 1800.0, 50.0))[
        'fan_end_housing_x'].displacement) for machine in (cones, thin))
    # The mass of the block hides some of what its ground is off by, nowhere more than that.
    assert 0.005 < np.abs(one / other - 1.0).max() < shape.share


def test_softer_layers_and_other_rock_are_solved_for_the_shape_too(fan, cache):
    machine = fan(soil=ROCK, support=BY_SHAPE)
    spread = SoilSpread(rock_depth=(1.5, 6.0))
    shallow, deep = (machine_at(machine.case, machine.model, spread, {'rock_depth': end},
                                Cache(cache)).soil_models[0] for end in (-1.0, 1.0))
    assert isinstance(deep, rs.LayeredSiteModel)
    omega = np.array([100.0])
    np.testing.assert_allclose(shallow.compliance(omega),
                               machine.model.soil_models[0].compliance(omega), rtol=1e-9)
    assert deep.singular[0] == pytest.approx(shallow.singular[0] / 4.0, rel=1e-3)
    softer = on_soil(deep, replace(machine.case.soil, shear_modulus=25e6),
                     machine.case.foundations[0].contact)
    np.testing.assert_allclose(softer.compliance(0.5 * omega), 4.0 * deep.compliance(omega),
                               rtol=1e-9)


def test_case_tells_where_waves_begin(fan):
    machine = fan(soil=ROCK, support=THIN)
    told = dict(derived_quantities(machine.case, machine.model.soil_models))
    quarter = math.sqrt(100e6 / 1900.0) / 6.0
    assert told['block: waves of the layers begin'].startswith(f'at {quarter:.4g}, ')
    assert told['below'] == 'from 1.5 m, rigid rock, a bound'


def test_mass_of_the_displaced_soil_is_asked_about(fan):
    # 6 m^2 times 1.2 m of concrete and 0.8 m of soil.
    machine = fan(soil=ROCK, support=THIN, block={
        'embedment': 0.8, 'mass': 17280.0 + 9120.0})
    assert any('kg of soil that it displaces must not be part of it' in one
               for one in warnings(machine.case))
    machine = fan(soil=ROCK, support=THIN, block={'embedment': 0.8, 'mass': 17280.0})
    assert not any('displaces' in one for one in warnings(machine.case))


def test_buried_block_is_asked_about(fan):
    machine = fan(soil={'layers': [LAYER], 'below': SAND}, support=THIN,
                  block={'embedment': 1.4})
    assert any('its top lies below the surface' in one for one in warnings(machine.case))


@pytest.mark.parametrize('keys, faults', [
    ({'soil': {'layers': [LAYER]}}, ['soil.below: is missing']),
    ({'soil': {'layers': [], 'below': 'rock'}}, ['soil.layers: must be at least one']),
    ({'soil': {**SAND, **ROCK}}, [
        f'soil.{key}: is not a known key' for key in sorted(SAND)]),
    ({'soil': {**ROCK, 'below': 'granite'}}, ["soil.below: must be 'rock', got 'granite'"]),
    ({'soil': {'layers': [{**LAYER, 'thickness': -1.0}, {**LAYER, 'loss_factor': 0.0}],
               'below': {**SAND, 'shear_modulus': -1.0}}},
     ['soil.layers.0.thickness: must be > 0 m', 'soil.layers.1.loss_factor: must be >= 0.005',
      'soil.below.shear_modulus: must be > 0 Pa']),
    ({'soil': {**SAND, 'loss_factor': 0.0}}, ['soil.loss_factor: must be >= 0.005']),
    ({'soil': ROCK, 'support': {'model': 'cone'}},
     ['support.model: must be thin_layers or boundary_elements on soil.layers, got cone']),
    ({'soil': ROCK, 'support': {'model': 'infinite_elements'}},
     ['support.model: must be thin_layers or boundary_elements on soil.layers, got '
      'infinite_elements']),
    ({'soil': {**ROCK, 'layers': [{**LAYER, 'thickness': 0.08}]}, 'support': BY_SHAPE},
     ['soil: thickness must be >= 0.1 m, 0.1 of the shortest half side']),
    ({'soil': ROCK, 'support': BY_SHAPE, 'block': {'embedment': 0.5}},
     ['foundations.0.embedment: belongs to the support model thin_layers or cone, got 0.5']),
    ({'support': {**THIN, 'geometry': 'plane_strain'}}, ['support.geometry: must be disc']),
    ({'soil': ROCK, 'block': {'embedment': 1.5}},
     ['foundations.0.embedment: must be < 1.5 m, where the rock begins, got 1.5']),
    ({'block': {'embedment': -0.5}}, ['foundations.0.embedment: must be >= 0 m']),
    ({'block': {'side_contact': 0.5}},
     ['foundations.0.side_contact: must stand beside an embedment > 0 m']),
    ({'block': {'embedment': 0.5, 'side_contact': 1.5}},
     ['foundations.0.side_contact: must be in [0, 1]']),
    ({'support': {'model': 'cone'}, 'block': {'embedment': 0.5, 'side_contact': 0.5}},
     ['foundations.0.side_contact: must be 1 with the model cone']),
    ({'support': {'model': 'infinite_elements'}, 'block': {'embedment': 0.5}},
     ['foundations.0.embedment: belongs to the support model thin_layers or cone, got 0.5']),
    ({'soil': {**ROCK, 'below': {**SAND, 'shear_modulus': 3e8}}, 'support': {'model': 'cone'}},
     ['support.model: must be thin_layers or boundary_elements on soil.layers, got cone, which '
      'knows a homogeneous half-space only: a cone is of one material']),
    ({'soil': {'layers': [{**LAYER, 'thickness': 1e-3}], 'below': SAND}},
     ['foundations.0: thickness must be >= 0.01 of the radius'])])
def test_impossible_ground_is_one_line_each(fan, keys, faults):
    with pytest.raises(InputError) as caught:
        fan(**{'support': THIN, **keys})
    lines = [line.partition('fan.yaml: ')[2] for line in str(caught.value).splitlines()]
    assert len(lines) == len(faults)
    assert [line.startswith(fault) for line, fault in zip(
        sorted(lines), sorted(faults), strict=True)] == [True] * len(faults), lines


def bounds(machine):
    found = machine.band(rpm=[1400.0])
    column = list(found.channels).index('drive_end_housing_x')
    return found.low[0, column], found.high[0, column]


def test_band_sees_the_rock_that_may_be_there(fan):
    few = {'samples': 8, 'model_form': False}
    _, high = bounds(fan(uncertainty=few))
    low, with_rock = bounds(fan(uncertainty={**few, 'rock_depth': [1.5, math.inf]}))
    shallow = fan(soil=ROCK, support=THIN).response(rpm=[1400.0])
    on_rock = abs(shallow['drive_end_housing_x'].displacement[0])
    # At its end alone the band holds the machine on that rock, which is far above all soils.
    # Edges are straight between some speeds, within 2 %.
    assert low < on_rock <= with_rock * 1.02
    assert on_rock > 2.0 * high


def test_depth_of_rock_is_an_input_like_any_other(fan):
    machine = fan(uncertainty={'rock_depth': [1.5, math.inf]})
    found = influences(machine.case, machine.model, speed=1400.0 * math.pi / 30.0,
                       channel=list(machine.model.channels).index('drive_end_housing_x'))
    assert found[0].key == 'rock_depth'
    # At the deepest end there is none.
    assert found[0].ends[2] == pytest.approx(
        velocity(machine.case, fan(support=THIN).model, speed=1400.0 * math.pi / 30.0,
                 channel=list(machine.model.channels).index('drive_end_housing_x')), rel=1e-6)


def test_damping_of_layers_is_an_input_of_its_own(fan):
    machine = fan(soil=ROCK, support=THIN)
    spread, speed = machine.case.uncertainty, np.array([1400.0 * math.pi / 30.0])
    least, most = (np.abs(machine_at(machine.case, machine.model, spread, {
        'loss_factor': end}).unbalance_response(speed, machine.case.unbalance).displacement).max()
        for end in (-1.0, 1.0))
    # Below the first cut-off nothing but the soil's own loss, 0.02 to 0.08, holds a peak.
    assert least > 2.0 * most


def test_each_layer_may_be_softer_by_itself_and_is_told_by_its_number(fan):
    """Against the case that says so, G of both scaled too; nothing else is another one."""
    omega = np.array([60.0, 150.0])

    def layers(first, second):
        return {'layers': [{**LAYER, 'shear_modulus': first}], 'below': {
            **SAND, 'shear_modulus': second}}

    machine = fan(soil=layers(100e6, 400e6), support=THIN, uncertainty={
        'layer_stiffness_factor': 2.0, 'shear_modulus_factor': 1.5})
    spread = machine.case.uncertainty
    assert spread.inputs(with_soil=True)[:3] == (
        'shear_modulus_factor', 'layer_stiffness_factor_1', 'layer_stiffness_factor_2')
    place = {'shear_modulus_factor': 1.0, 'layer_stiffness_factor_1': -1.0}
    moved = machine_at(machine.case, machine.model, spread, place).soil_models[0]
    meant = fan(soil=layers(75e6, 600e6), support=THIN).model.soil_models[0]
    np.testing.assert_allclose(moved.compliance(omega), meant.compliance(omega), rtol=2e-4,
                               atol=1e-15)
    assert input_of('layer_stiffness_factor_2').low == 'softest layer 2'
    assert 'stiffness of layer 2 (within a factor 2)' in band_contents(machine.case)


def test_layers_of_a_band_need_few_grounds():
    """Three layers alone, and what changes the ground but them: no product of both."""
    spread = SoilSpread(layer_stiffness_factor=2.0, layers=3, samples=256)
    soil = Soil(**SAND)
    ground = LayeredSoil((Layer(1.0, soil), Layer(2.0, soil)), soil)
    places = spread.places(with_soil=True)
    assert len({spread.ground(ground, Embedment(), place)[0] for place in places}) == 9 + 2 * 3
    assert all(any(f'layer_stiffness_factor_{number}' in place for place in places[8:])
               for number in (1, 2, 3))


def test_blocks_in_two_layers_stay_as_they_are_where_nothing_is_off(fan):
    machine = fan(soil={'layers': [LAYER], 'below': {**SAND, 'shear_modulus': 400e6}},
                  support=THIN, block={'embedment': 0.0})
    one = machine.model.soil_models[0]
    deep = replace(one, embedment=Embedment(2.0))
    pair = replace(machine.model, soil_models=(one, deep), foundations=(
        *machine.model.foundations, replace(machine.model.foundations[0], name='deep')))
    [same] = on_soils(pair, [deep.material])
    assert [each.ground for each in same.soil_models] == [one.ground, deep.ground]


def test_softer_ground_is_softer_in_every_layer(fan):
    machine = fan(soil=ROCK, support=THIN)
    [ground] = on_ground(machine.model, 0.5).soil_models
    assert ground.material.shear_modulus == pytest.approx(50e6)


def test_silence_about_rock_is_told_with_its_cost(fan, cache):
    machine = fan()
    [told] = depth_remarks(machine.case, machine.model, cache)
    assert 'nothing is said of rock; at 1.5 m below the surface it would raise' in told
    known = fan(uncertainty={'rock_depth': [1.5, math.inf]})
    assert list(depth_remarks(known.case, known.model, cache)) == []
    layered = fan(soil=ROCK, support=THIN)
    assert list(depth_remarks(layered.case, layered.model, cache)) == []


@pytest.mark.parametrize('keys, fault', [
    ({'rock_depth': [3.0, 1.5]}, 'uncertainty.rock_depth: must be two rising depths > 0 m'),
    ({'rock_depth': [0.0, 1.5]}, 'uncertainty.rock_depth: must be two rising depths > 0 m'),
    ({'rock_depth': [math.inf, 1.5]}, 'uncertainty.rock_depth.0: must be a finite number in m'),
    ({'side_contact': [0.5, 1.5]}, 'uncertainty.side_contact: must be two rising shares'),
    ({'layer_stiffness_factor': 2.0}, 'uncertainty.layer_stiffness_factor: belongs to soil.layers;'
                                      ' of one soil it is shear_modulus_factor, got 2')])
def test_impossible_spread_is_one_line(fan, keys, fault):
    with pytest.raises(InputError) as caught:
        fan(uncertainty=keys)
    assert str(caught.value).partition('fan.yaml: ')[2].startswith(fault)


@pytest.mark.parametrize('keys, fault', [
    ({'block': {'embedment': 2.0}, 'support': THIN},
     'uncertainty.rock_depth: must begin below the base of block (foundations.0), 2 m, got 1.5 m'),
    ({'support': {'model': 'infinite_elements', 'geometry': 'plane_strain'}},
     'uncertainty.rock_depth: needs the geometry disc, got plane_strain')])
def test_rock_where_it_cannot_be_is_one_line(fan, keys, fault):
    with pytest.raises(InputError) as caught:
        fan(uncertainty={'rock_depth': [1.5, math.inf]}, **keys)
    assert str(caught.value).partition('fan.yaml: ')[2].startswith(fault)


def test_spread_of_the_ground_changes_what_it_names():
    soil = Soil(**SAND)
    ground, hole = LayeredSoil((), soil), Embedment(1.0)
    spread = SoilSpread(rock_depth=(2.0, math.inf), side_contact=(0.0, 1.0), ground_water=True)
    assert spread.ground(ground, hole, {}) == (ground, hole)
    shallow, _ = spread.ground(ground, hole, {'rock_depth': -1.0})
    assert (shallow.depth, shallow.below) == (2.0, None)
    middle, _ = spread.ground(ground, hole, {'rock_depth': 0.0})
    assert middle.depth == pytest.approx(4.0)
    deep, _ = spread.ground(shallow, hole, {'rock_depth': 1.0})
    assert deep == ground
    wet, _ = spread.ground(ground, hole, {'ground_water': 1.0})
    assert wet.at(0.0).poisson_ratio == pytest.approx(0.49)
    _, loose = spread.ground(ground, hole, {'side_contact': -1.0})
    assert loose.side_contact == 0.0
