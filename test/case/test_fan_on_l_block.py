"""Plans, blocks beside the machine and probes on the ground in a case file."""

import math
from pathlib import Path

import numpy as np
import pytest

import rotorsoil_ros as rs
from rotorsoil_ros.case.config import load
from rotorsoil_ros.case.design.ground import model_error, of_neighbours
from rotorsoil_ros.case.design.shapes import shape_errors
from rotorsoil_ros.case.loading import soil_keys
from rotorsoil_ros.case.models import (
    coupled_model,
    response_band,
    response_table,
)
from rotorsoil_ros.cli import main
from rotorsoil_ros.errors import InputError
from rotorsoil_ros.ground.boundary.model import BoundaryElementModel
from rotorsoil_ros.ground.plan import Plan
from rotorsoil_ros.machine.damping import DampingSplitter, MATERIAL, RADIATION

from machines import work_put_in

CONFIG = Path(__file__).parents[2] / 'config'
ELL, FAN = CONFIG / 'fan_on_l_block.yaml', CONFIG / 'plant_fan.yaml'
PARTS = '{half_width: 1.0, half_length: 1.5, centre: [0.0, 0.0]}'


def rectangle(width, length, x, y):
    return f'{{half_width: {width}, half_length: {length}, centre: [{x}, {y}]}}'


@pytest.fixture(scope='module')
def cache(tmp_path_factory):
    return tmp_path_factory.mktemp('cache')


@pytest.fixture(scope='module')
def machine(cache):
    return rs.load(ELL, cache_directory=cache)


def test_an_l_of_concrete_has_the_mass_and_the_centre_of_its_parts():
    block = load(ELL).foundations[0]
    large, small = (2.0 * 3.0, 0.0, 0.2), (0.8 * 1.5, -1.4, 0.2 - 0.75)
    area = large[0] + small[0]
    assert isinstance(block.contact, Plan)
    assert block.mass == pytest.approx(2400.0 * 1.2 * area)
    assert block.centre_x == pytest.approx((large[0] * large[1] + small[0] * small[1]) / area)
    assert block.centre_y == pytest.approx((large[0] * large[2] + small[0] * small[2]) / area)
    assert block.centre_of_gravity_height == 0.6
    expected = 2400.0 * 1.2 * sum(
        part[0] * (part[1] - block.centre_x) * (part[2] - block.centre_y)
        for part in (large, small))
    assert block.inertia_product == pytest.approx(expected)


def test_a_fan_on_an_l_moves_the_next_block_and_the_yard(machine):
    run = machine.response(rpm=[600.0, 1500.0])
    for channel in ('fan_block_x', 'next_block_x', 'yard_x', 'yard_y', 'yard_z'):
        assert np.all(np.abs(run[channel].amplitude) > 0.0)
    # Farther away, less.
    assert np.all(np.abs(run['yard_x'].amplitude) < np.abs(run['next_block_x'].amplitude))


def test_the_table_holds_what_the_solver_says_of_the_yard(machine):
    speed = np.linspace(110.0, 1790.0, 23)
    exact = machine.response(rpm=speed)['yard_z'].amplitude[:, 0]
    column = list(machine.table.channels).index('yard_z')
    found = machine.table.predictor(machine.case.unbalance).answer(
        speed * math.pi / 30.0).displacement[:, column]
    np.testing.assert_allclose(np.abs(found), exact, rtol=1e-3)


def test_tables_of_a_site_come_out_of_the_cache(machine, cache):
    _ = machine.model
    [key] = soil_keys(machine.case)
    assert (cache / f'compliance_{key}.npz').exists()
    again = coupled_model(load(ELL), cache)
    omega = np.array([50.0, 150.0])
    np.testing.assert_array_equal(again.soil_models[0].compliance(omega),
                                  machine.model.soil_models[0].compliance(omega))


def test_the_band_of_a_site_holds_the_machine_and_softer_soil(machine, cache):
    case = load(ELL, ['uncertainty={samples: 7, shear_modulus_factor: 1.5}'])
    model = coupled_model(case, cache)
    band = response_band(case, model, response_table(case, model, cache), cache)
    envelope = band.envelope(case.unbalance)
    inside = np.isfinite(envelope.low).all(axis=1)
    assert inside.mean() > 0.99
    moving = envelope.high.max(axis=0) > 1e-12
    assert np.all(envelope.low[inside][:, moving] <= envelope.high[inside][:, moving])


def test_cones_and_discs_are_told_by_how_much_they_miss_this_shape(cache):
    for support, least, most in (('cone', 0.10, 0.30), ('infinite_elements', 0.02, 0.15)):
        case = load(FAN, [f'support.model={support}'])
        model = coupled_model(case, cache)
        [shape] = shape_errors(case, model.support.soils, cache)
        told = model_error(case, case.foundations[0], shape)
        exact = BoundaryElementModel.solved(case.soil, case.foundations[0].contact,
                                            omega_max=case.speed_range[1])
        omega = np.linspace(0.1, 1.0, 30) * case.speed_range[1]
        ours, theirs = (np.diagonal(one.compliance(omega), axis1=1, axis2=2)
                        for one in (model.soil_models[0], exact))
        share = np.abs(ours / theirs - 1.0).max()
        assert least < share < most
        said = int(told.split('off by up to ')[1].split('%')[0])
        assert said == pytest.approx(100.0 * share, abs=1.0)
        assert told.endswith('against boundary elements')


def test_the_band_of_cones_on_a_rectangle_holds_the_boundary_elements(cache):
    case = load(FAN, ['uncertainty.samples=9'])
    model = coupled_model(case, cache)
    band = response_band(case, model, response_table(case, model, cache), cache)
    exact = rs.load(FAN, cache_directory=cache, support={'model': 'boundary_elements'})
    speed = np.linspace(200.0, 1700.0, 60)
    found = exact.response(rpm=speed)['drive_end_housing_x'].amplitude[:, 0]
    column = list(band.tables[0].channels).index('drive_end_housing_x')
    envelope = band.envelope(case.unbalance).at(speed * math.pi / 30.0)
    size = found
    # 2 %: edges are straight between speeds.
    assert np.all(size <= 1.02 * envelope.high[:, column])
    assert np.all(size >= 0.98 * envelope.low[:, column])


def test_blocks_on_one_ground_are_not_called_alone():
    assert list(of_neighbours(load(ELL))) == []
    apart = load(ELL, ['support.model=infinite_elements', 'ground.probes=[]',
                       'rotor.bearings.0.foundation=next_block'])
    [told] = of_neighbours(apart)
    assert 'stands 0.8 m beside fan_block' in told
    assert told.endswith('support.model boundary_elements couples them')


@pytest.mark.parametrize('settings, said', [
    (['foundations.0.half_width=1.0'],
     'foundations.0.parts: takes the place of half_width, half_length and radius, got half_width '
     'too'),
    ([f'foundations.0.parts=[{PARTS}, {rectangle(0.4, 0.75, -1.2, 0.0)}]'],
     'foundations.0.parts: must not overlap, got 0.2 m of overlap of parts 0 and 1'),
    ([f'foundations.0.parts=[{PARTS}, {rectangle(0.4, 0.75, -1.9, 0.0)}]'],
     'foundations.0.parts: must touch along an edge, got 0.5 m between part 1 and the others; '
     'blocks that stand apart are foundations of their own'),
    (['foundations.0.parts=[' + ', '.join(
        rectangle(0.5, 0.5, x, y) for x in (-1.0, 0.0, 1.0) for y in (-1.0, 0.0, 1.0)
        if (x, y) != (0.0, 0.0)) + ']'],
     'foundations.0.parts: must not enclose a hole, got one about x 0 m, y 0 m; leave out a part '
     'or fill the hole'),
    (['foundations.0.parts=[]'], 'foundations.0.parts: must be at least one rectangle, got 0'),
    (['foundations.0.parts.1.half_width=-0.4'],
     'foundations.0.parts.1.half_width: must be > 0 m and finite, got -0.4'),
    (['foundations.0.parts.1.centre=[1.0]'], 'foundations.0.parts.1.centre.1: is missing'),
    (['foundations.1.centre_x=1.7'],
     'foundations.1: next_block must not overlap fan_block (foundations.0), got 0.3 m of overlap: '
     'centres are 1.933 m across and 0.125 m along apart'),
    (['foundations.1={name: next_block, radius: 1.0, centre_x: 3.0, centre_y: 0.2, density: '
      '2400.0, height: 1.0}'],
     'foundations.1: contact must consist of rectangles for boundary elements, got a circle of '
     'radius 1 m; infinite_elements solve a circle'),
    (['foundations.1.centre_y=null'],
     'foundations.1: no bearing stands on next_block; a block beside the machine needs centre_y '
     'in m'),
    (['support.geometry=plane_strain'],
     'support.geometry: belongs to the support model infinite_elements; boundary elements take '
     'the plan of the block as it is, got plane_strain'),
    (['ground.probes.0.place.x=1.1'],
     'ground.probes.0: point must be at least 0.2 m away from every block (half of the shortest '
     'half side), got 0.1 m at x 1.1 m, y 0.2 m'),
    (['ground.probes.0.name=wheel'],
     'ground.probes.0.name: must differ from that of rotor.discs.1, got wheel twice'),
    (['support.model=cone', 'rotor.bearings.0.foundation=next_block'],
     'ground.probes: need the support model boundary_elements, which alone tells the motion of '
     'the ground beside the blocks, got cone'),
    (['soil.poisson_ratio=0.495'],
     'soil.poisson_ratio: must be <= 0.49 for boundary elements, got 0.495'),
    (['foundations.0.parts.1.half_width=0.02', 'foundations.0.parts.1.centre=[-1.02, -0.75]',
      'speed_range_rpm=[100, 60000]'],
     'speed_range_rpm: boundary elements must be at most 2100 (a minute or two), got'),
])
def test_a_site_that_is_none_is_told_in_one_line(settings, said):
    with pytest.raises(InputError) as caught:
        load(ELL, settings)
    assert '\n' not in str(caught.value)
    assert str(caught.value).startswith(f'{ELL}: {said}')


def test_compliance_of_a_block_shows_who_moves_it(cache, capsys):
    assert main(['compliance', str(ELL), '--foundation', 'fan_block', '--hz', '5:30:6',
                 '-o', '-', '--cache', str(cache)]) == 0
    header, *rows = capsys.readouterr().out.splitlines()
    names = header.split(',')
    values = np.array([[float(value) for value in row.split(',')] for row in rows])
    model = coupled_model(load(ELL), cache).soil_models[0]
    assert isinstance(model, BoundaryElementModel)
    exact = model.compliance(2.0 * math.pi * np.linspace(5.0, 30.0, 6))
    for name, row, column in (('zz', 2, 2), ('xry', 0, 4), ('z__next_block_x', 2, 6)):
        found = (values[:, names.index(f'{name}_re')]
                 + 1j * values[:, names.index(f'{name}_im')])
        np.testing.assert_allclose(found, exact[:, row, column], rtol=1e-9)


@pytest.mark.slow
def test_check_tells_coupling_and_probes(cache, capsys):
    assert main(['check', str(ELL), '--cache', str(cache)]) == 0
    said = capsys.readouterr().out
    assert 'fan_block and next_block: coupled through the ground' in said
    assert 'boundary elements of this plan: within 1%' in said
    assert 'yard: on the ground' in said
    assert 'taken as alone' not in said


def test_energy_closes_where_points_of_the_ground_are_channels_too(machine):
    split = machine.damping_split(rpm=[900.0, 1500.0])
    np.testing.assert_allclose(
        split.total, work_put_in(machine.model, split.speed, machine.case.unbalance), rtol=1e-9)


def test_no_mode_is_divided_into_parts_that_give(machine):
    criticals = machine.critical_speeds()
    splits = DampingSplitter(machine.model).of_modes(criticals)
    told = [split for split in splits if split is not None]
    assert told
    for split in told:
        assert split.share(RADIATION)[0] > -0.01
        assert split.share(MATERIAL)[0] > -0.01
