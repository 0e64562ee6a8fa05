"""Several machines in one case file: each among its neighbours, and what they do together."""

import math
from pathlib import Path

import numpy as np
import pytest
import yaml

import rotorsoil_ros as rs
from rotorsoil_ros.case import document, models
from rotorsoil_ros.case.config import case_of, load
from rotorsoil_ros.case.loading import cases_of
from rotorsoil_ros.case.machine import Machine
from rotorsoil_ros.case.plant.together import Plant, sources_of
from rotorsoil_ros.channel import HOUSING
from rotorsoil_ros.cli import main
from rotorsoil_ros.cli.plant.check import neighbour_warnings
from rotorsoil_ros.errors import InputError, RotorSoilError
from rotorsoil_ros.machine.plant.source import SourceModel

from machines import work_put_in

CONFIG = Path(__file__).parents[3] / 'config'
HOUSE, FAN = CONFIG / 'fan_house.yaml', CONFIG / 'plant_fan.yaml'


@pytest.fixture(scope='module')
def cache(tmp_path_factory):
    return tmp_path_factory.mktemp('cache')


@pytest.fixture(scope='module')
def house(cache):
    return Plant.load(HOUSE, cache_directory=cache)


def written(tmp_path, change=None):
    """Return a copy of the example beside the file of its rotor, changed."""
    content = document.read(HOUSE)
    if change is not None:
        change(content)
    path = tmp_path / 'house.yaml'
    path.write_text(yaml.safe_dump(content))
    (tmp_path / 'plant_fan.yaml').write_text(FAN.read_text())
    return path


def faults(path, *settings):
    """Return the lines with which a case is refused, without the name of its file."""
    with pytest.raises(InputError) as refused:
        load(path, settings)
    return [line.removeprefix(f'{path}: ') for line in str(refused.value).splitlines()]


def test_one_machine_of_a_plant_is_the_machine_of_its_own_file(tmp_path):
    """Placed where the file of one machine has it, it answers bit by bit the same."""
    alone = document.read(FAN)
    content = {key: value for key, value in alone.items() if key not in ('rotor', 'unbalances')}
    content['machines'] = [{
        'name': 'fan', 'place': {'x': 0.0, 'y': 0.0}, 'rotor': alone['rotor'],
        'unbalances': alone['unbalances'], 'rated_rpm': 1480}]
    own = case_of(tmp_path / 'plant.yaml', content)
    plant, single = (models.coupled_model(case, tmp_path) for case in (own, load(FAN)))
    assert isinstance(plant, SourceModel)
    speed = np.linspace(20.0, 180.0, 9)
    for got, expected in zip(
            *(one.synchronous_response(speed, one.plane_forces) for one in (plant, single)),
            strict=True):
        np.testing.assert_allclose(got, expected, rtol=1e-9, atol=1e-18)
    assert own.name == 'fan'
    assert plant.channels[0] == 'fan_drive_end_journal_x'


def test_fans_of_the_example_are_those_of_its_models(house):
    first = house.machines['fan_1']
    model, berth = first.model, first.case.berth
    assert isinstance(model, SourceModel)
    assert berth.names == ('fan_1', 'fan_2')
    assert (model.index, model.place.x, model.neighbours[0].place.x) == (0, -1.25, 1.25)
    assert model.neighbours[0].speed == pytest.approx(1475.0 * math.pi / 30.0)
    assert model.channels == house.machines['fan_2'].model.channels
    assert first.table.planes == ('fan_1_coupling', 'fan_1_wheel')
    looked_up = first.table.predictor(first.case.unbalance).predict(np.array([150.0]))
    exact = model.unbalance_response(np.array([150.0]), first.case.unbalance)
    np.testing.assert_allclose(looked_up.displacement, exact.displacement, rtol=1e-6, atol=1e-15)


def test_tables_of_sources_have_keys_of_their_own(house, cache):
    keys = {machine.table.key for machine in house.machines.values()}
    other = Machine.load(HOUSE, cache_directory=cache, overrides=[
        'source=fan_1', 'machines.1.rated_rpm=900'])
    moved = Machine.load(HOUSE, cache_directory=cache, overrides=[
        'source=fan_1', 'machines.1.place.x=1.3'])
    assert len({*keys, other.table.key, moved.table.key}) == 4
    # What a machine that stands by has of unbalance is its own business.
    same = Machine.load(HOUSE, cache_directory=cache, overrides=[
        'source=fan_1', 'machines.1.unbalances=[]'])
    assert same.table.key in keys


def test_parts_of_different_frequency_add_up_as_squares(house):
    found = house.shaken(rpm={'fan_1': 1200.0})
    parts = [machine.response(rpm=rpm) for machine, rpm in zip(
        house.machines.values(), (1200.0, 1475.0), strict=True)]
    expected = np.sqrt(sum(part.velocity_mm_s_rms()[0] ** 2 for part in parts))
    np.testing.assert_allclose(found.velocity_mm_s_rms(), expected, rtol=1e-12)
    np.testing.assert_allclose(found.share.sum(axis=0), 1.0)
    np.testing.assert_allclose(found.highest, sum(part.amplitude[0] for part in parts))
    assert not list(found.beats())  # 4.6 Hz apart
    stands = house.shaken(rpm={'fan_2': 0.0})['fan_1_fan_end_housing_x']
    np.testing.assert_array_equal(stands.share[:, 0], [1.0, 0.0])
    with pytest.raises(RotorSoilError, match='rpm must be of one of fan_1, fan_2, got fan_3'):
        house.shaken(rpm={'fan_3': 100.0})


def test_close_speeds_beat_between_sum_and_difference(house):
    [beat] = house.shaken().beats()
    assert beat.period_s == pytest.approx(60.0 / 5.0)
    sizes = [float(machine.response(rpm=house.rated_rpm[name])[beat.channel].amplitude[0, 0])
             for name, machine in house.machines.items()]
    assert (beat.lowest, beat.highest) == pytest.approx((abs(sizes[0] - sizes[1]), sum(sizes)))
    [same] = house.shaken(rpm={'fan_1': 1400.0, 'fan_2': 1400.0}).beats()
    assert same.period_s == math.inf


def test_band_holds_neighbours_at_other_speeds(cache):
    """Near the critical speed of a neighbour what it does depends on its own speed."""
    known = ['uncertainty={shear_modulus_factor: 1, poisson_ratio: 0, loss_factor: 0, '
             'model_form: false}', 'speed_range_rpm=[2500, 3600]', 'machines.0.rated_rpm=3000',
             'machines.1.rated_rpm=2950', 'source=fan_1']
    machine = Machine.load(HOUSE, cache_directory=cache, overrides=known)
    rpm = np.linspace(2600.0, 3500.0, 7)
    bounds, berth = machine.band(rpm=rpm), machine.case.berth
    still, fast = berth.otherwise(machine.model)
    assert ([one.speed for one in still.neighbours], [one.speed for one in fast.neighbours]) == (
        [0.0], [pytest.approx(120.0 * math.pi)])
    for other in (machine.model, still, fast):
        size = np.abs(other.unbalance_response(rpm * math.pi / 30.0, machine.case.unbalance)
                      .displacement)
        assert np.all(bounds.low <= size * 1.03 + 1e-12)
        assert np.all(size <= bounds.high * 1.03 + 1e-12)
    spread = berth.spread(machine.model, rpm * math.pi / 30.0, machine.case.unbalance)
    assert spread.max() > 0.01
    idle = Machine.load(HOUSE, cache_directory=cache, overrides=[
        'machines.1.rated_rpm=null', 'machines.1.idle=true'])
    assert idle.case.berth.otherwise(idle.model) == ()
    assert idle.case.name == 'fan_1'  # the only one that turns


def test_speeds_of_neighbours_hardly_matter_where_nothing_resonates(house):
    for machine in house.machines.values():
        spread = machine.case.berth.spread(machine.model, np.linspace(10.0, 188.0, 40),
                                           machine.case.unbalance)
        assert spread.max() < 2e-3


def test_check_tells_who_shakes_whom_and_the_beat(capsys, cache):
    assert main(['check', str(HOUSE), '--cache', str(cache)]) == 0
    out = capsys.readouterr().out
    assert ('stands in fan_house at x -1.25 m, y -0.2 m, heading 0 deg; beside it fan_2 at '
            '1475 rpm') in out
    assert 'all machines of                          fan_house: fan_1 at 1480 rpm' in out
    assert 'beat of fan_1 and fan_2                  12 s' in out
    [line] = [line for line in out.splitlines() if line.startswith('fan_1_fan_end_housing_x')]
    assert 'mm/s rms, of its square fan_1 49.7%, fan_2 50.3%' in line


def test_place_in_mm_and_neighbours_that_are_felt_are_warned_of(cache):
    near = ['speed_range_rpm=[2500, 3600]', 'machines.0.rated_rpm=3000',
            'machines.1.rated_rpm=2950', 'source=fan_1']
    felt = neighbour_warnings(Machine.load(HOUSE, cache_directory=cache, overrides=near))
    assert [line[:61] for line in felt] == [
        'the speeds of its neighbours change what fan_1 does by up to ']
    astray = load(HOUSE, ['source=fan_1', 'machines.0.place.x=-1250'])
    assert astray.berth.remarks[0] == (
        'machines.0.place: drive_end of fan_1 stands 1248 m beside block; a place is in m')


def test_report_judges_what_all_machines_do_together(house):
    """At its rated speed the velocity of every housing is the root of the sum of squares."""
    machine = house.machines['fan_1']
    found = machine.report(rpm=1480.0)
    together = house.shaken()
    for one in found.housings:
        assert one.velocity[1] == pytest.approx(
            float(together[one.channel].velocity_rms[0]), rel=1e-4)
    assert {one.channel.station for one in found.housings} == {
        'fan_1_drive_end', 'fan_1_fan_end'}
    assert any('velocities are of all together' in line for line in found.assumptions)
    assert not any('other machines' in line for line in found.not_modelled)


def test_geared_machine_runs_and_is_looked_at_in_proportion(tmp_path):
    def geared(content):
        content['machines'][1]['ratio'] = {'of': 'fan_1', 'times': 0.5}
        del content['machines'][1]['rated_rpm']

    path = written(tmp_path, geared)
    slow, fast = (load(path, [f'source={name}']) for name in ('fan_2', 'fan_1'))
    assert slow.speed_range == pytest.approx((50.0 * math.pi / 30.0, 900.0 * math.pi / 30.0))
    assert slow.berth.rated_speed == pytest.approx(740.0 * math.pi / 30.0)
    assert fast.berth.neighbours[0].speed == slow.berth.rated_speed
    [remark] = slow.berth.remarks
    assert remark.startswith('machines.1.ratio: fan_2 turns with fan_1: what their teeth')


@pytest.mark.parametrize('settings, line', [
    ([], 'source: is missing: which machine shakes the others, one of fan_1, fan_2 '
         '(--set source=fan_1)'),
    (['source=fan_3'], 'source: must be a machine that turns, one of fan_1, fan_2, got fan_3'),
    (['source=fan_2', 'machines.1.idle=true', 'machines.1.rated_rpm=null'],
     'source: must be a machine that turns, one of fan_1, got fan_2, which is idle'),
    (['machines=[]'], 'machines: must name at least one machine that turns, got none'),
    ([f'machines.{index}={{name: fan_{index}, place: {{x: {index}, y: 0, z: 2}}, idle: true, '
      'rotor: {file: plant_fan.yaml}}' for index in (0, 1)],
     'machines: must name at least one machine that turns, got fan_0, fan_1, idle all of them'),
    (['machines.0.idle=1'], 'machines.0.idle: must be true or false, got 1'),
    (['machines.0.place=null'], 'machines.0.place: must hold keys and values, got None'),
    (['machines.1.place={x: 1.0}'], 'machines.1.place.y: is missing'),
    (['machines.1.name=fan_1'],
     'machines.1.name: must differ from that of machines.0, got fan_1 twice'),
    (['machines.1.place.x=-1.25'], 'machines.1.place: must differ from that of fan_1 '
     '(machines.0): two shafts cannot lie in one place'),
    (['machines.0.place.heading=90'], 'machines.0.place.heading: must be within one turn, -6.28 '
     "to 6.28 rad, got 90; degrees are written '90 deg'"),
    (['machines.0.foundation=raft'],
     'machines.0.foundation: must be one of block, got raft'),
    (['machines.0.rated_rpm=null'],
     'machines.0.rated_rpm: is missing, and so are ratio and idle'),
    (['machines.0.rated_rpm=0'], 'machines.0.rated_rpm: must be > 0 rpm (idle: true for a '
     'machine that stands), got 0'),
    (['machines.0.rated_rpm=2000'], 'machines.0.rated_rpm: must lie in the speed range of the '
     'machine, 100 to 1800 rpm, got 2000'),
    (['machines.0.idle=true'], 'machines.0: needs one of rated_rpm, ratio and idle, got '
     'rated_rpm and idle'),
    (['machines.1.rated_rpm=null', 'machines.1.ratio={of: motor, times: 2}'],
     'machines.1.ratio.of: must be one of fan_1, fan_2, got motor'),
    (['machines.1.rated_rpm=null', 'machines.1.ratio={of: fan_2, times: 2}'],
     'machines.1.ratio.of: goes round in a circle: fan_2 of fan_2'),
    (['machines.0.rated_rpm=null', 'machines.0.ratio={of: fan_2, times: 2}',
      'machines.1.rated_rpm=null', 'machines.1.ratio={of: fan_1, times: 2}'],
     'machines.0.ratio.of: goes round in a circle: fan_1 of fan_2 of fan_1'),
    (['machines.1.rated_rpm=null', 'machines.1.ratio={of: fan_1, times: 2}',
      'machines.1.speed_range_rpm=[100, 1800]'],
     'machines.1.ratio: must lie in the speed range of the machine, 100 to 1800 rpm, got 2960'),
    (['machines.1.rated_rpm=null', 'machines.1.ratio={of: fan_1, times: -2}'],
     'machines.1.ratio.times: must be > 0 (a shaft that turns the other way has heading 180 '
     'deg), got -2'),
    (['machines.0.rated_rpm=null', 'machines.0.idle=true', 'machines.1.rated_rpm=null',
      'machines.1.ratio={of: fan_1, times: 2}'],
     'machines.1.ratio.of: must be a machine that turns, got fan_1, which is idle'),
    (['machines.0.unbalances.0.disc=weel', 'source=fan_2'],
     'machines.0.unbalances.0.disc: must be one of coupling, wheel, got weel'),
    (['machines.0.rotor.file=nobody.yaml', 'source=fan_1'], None),
    (['machines.0.rotor={file: plant_fan.yaml, probes: []}'],
     'machines.0.rotor.probes: is not a known key; known here: file'),
    (['rotor={}', 'source=fan_1'], None),
    (['speed_range_rpm=null'],
     'speed_range_rpm: is missing, and fan_1, fan_2 say none of their own'),
    (['machines.0.speed_range_rpm=[-5, 5]'],
     'machines.0.speed_range_rpm: must be two rising speeds >= 0 rpm, got [-5, 5]'),
    (['sensors={channels: {fan_1_drive_end_housing_q: {range: 20}}}', 'source=fan_1'],
     'sensors.channels.fan_1_drive_end_housing_q: is not a channel of this machine; did you mean '
     'fan_1_drive_end_housing_z?'),
])
def test_what_is_wrong_with_a_plant_is_one_clear_line(settings, line):
    found = faults(HOUSE, *settings)
    if line is None:
        assert len(found) == 1
        assert 'nobody.yaml: cannot be read' in found[0] or found[0].startswith('rotor: ')
    else:
        # Which machine is meant is a fault of its own, where nothing says it.
        assert [told for told in found if told == line or not told.startswith('source: is')] == [
            line]


def test_name_of_one_of_several_belongs_to_a_file_of_several():
    assert faults(Path(f'{FAN}#fan_1')) == [
        f'{FAN}: machines: is missing, and source=fan_1 names one of them']


def test_what_all_machines_of_a_file_stand_on_is_at_fault_once(tmp_path):
    def wrong(content):
        content['soil']['density'] = -5.0

    path = written(tmp_path, wrong)
    with pytest.raises(InputError) as refused:
        cases_of([Path(f'{path}#{name}') for name in ('fan_1', 'fan_2')], cache_directory=tmp_path)
    assert str(refused.value) == f'{path}: soil.density: must be > 0 kg/m^3 and finite, got -5'


def test_check_of_all_machines_does_not_ask_for_one(tmp_path, capsys, cache):
    def wrong(content):
        content['machines'][0]['rated_rpm'] = 'fast'

    path = written(tmp_path, wrong)
    assert main(['check', str(path), '--cache', str(cache)]) == 2
    assert capsys.readouterr().err.splitlines() == [
        f"{path}: machines.0.rated_rpm: must be a finite number in rpm, got 'fast'"]


def test_fault_of_a_rotor_is_told_once_and_of_its_own_file(tmp_path):
    path = written(tmp_path)
    rotor = tmp_path / 'plant_fan.yaml'
    rotor.write_text(FAN.read_text().replace('mass: 320.0', 'mass: -3'))
    assert faults(path, 'source=fan_1') == [
        f'{rotor}: rotor.discs.1.mass: must be >= 0 kg and finite, got -3']
    rotor.write_text(FAN.read_text().replace('mass: 320.0', 'mass: heavy').replace(
        'position: 0.25', 'position: 9.0'))
    # The second of its faults shows where the first is mended.
    assert faults(path, 'source=fan_1', 'foundations.0.mass=-1') == [
        f"{rotor}: rotor.discs.1.mass: must be a finite number in kg, got 'heavy'",
        f'{rotor}: rotor.bearings.0.position: position of drive_end must be on the shaft, 0 to '
        '1.7 m, got 9',
        'foundations.0.mass: must be >= 0 kg and finite, got -1']


def test_all_machines_are_told_what_is_wrong_with_them_at_once(tmp_path):
    def wrong(content):
        content['machines'][0]['rotor'] = document.read(FAN)['rotor']
        content['machines'][0]['rotor']['bearings'][0]['position'] = 9.0
        content['machines'][1]['unbalances'][0]['disc'] = 'weel'
        content['foundations'][0]['mass'] = -1.0

    assert faults(written(tmp_path, wrong), 'source=fan_1') == [
        'machines.0.rotor.bearings.0.position: position of drive_end must be on the shaft, 0 to '
        '1.7 m, got 9',
        'foundations.0.mass: must be >= 0 kg and finite, got -1',
        'machines.1.unbalances.0.disc: must be one of coupling, wheel, got weel']


def test_blocks_are_drawn_where_they_lie_from_the_shaft(house, tmp_path):
    """Seen from the other end what was on the left is on the right, and what was ahead behind."""
    first = house.machines['fan_1'].case
    [block] = first.berth.seen(first.foundations)
    assert (block.centre_x, block.centre_y) == pytest.approx((1.25, 0.2))

    def turned(content):
        content['machines'][1]['place'] = {'x': 1.25, 'y': 1.3, 'heading': '180 deg'}

    second = load(written(tmp_path, turned), ['source=fan_2'])
    [block] = second.berth.seen(second.foundations)
    assert (block.centre_x, block.centre_y) == pytest.approx((1.25, 1.3))
    assert not second.berth.is_turned
    # A seat of the shaft is as far from the block in either picture of it.
    seat = second.berth.place.point(0.25)
    assert math.dist(seat, (0.0, 0.0)) == pytest.approx(
        math.dist((0.0, 0.25), (block.centre_x, block.centre_y)))


def test_heading_may_be_given_in_degrees_and_height_by_the_place_or_the_rotor(tmp_path):
    def turned(content):
        content['machines'][1]['place'] = {'x': 1.25, 'y': 1.3, 'heading': '180 deg'}

    case = load(written(tmp_path, turned), ['source=fan_2'])
    assert case.berth.place.heading == pytest.approx(math.pi)
    assert case.rotor.shaft_height == 2.0  # of the file of the rotor


def test_probes_on_housings_and_standing_shafts_keep_their_machine(tmp_path):
    def changed(content):
        rotor = document.read(FAN)['rotor']
        rotor['probes'] = [{'name': 'gap', 'position': 0.3, 'angle_deg': 45,
                            'relative_to': 'drive_end'}]
        content['machines'][0]['rotor'] = rotor
        content['machines'][1]['rotor'] = document.read(FAN)['rotor'] | {'orientation': 'vertical'}
        content['machines'][1]['place']['z'] = 2.0

    path = written(tmp_path, changed)
    first, second = (load(path, [f'source={name}']) for name in ('fan_1', 'fan_2'))
    assert first.rotor.probes[0].relative_to == 'fan_1_drive_end'
    assert second.berth.place.is_upright
    speed = np.array([100.0])
    parts = [models.coupled_model(case, tmp_path).unbalance_response(speed, case.unbalance)
             for case in (first, second)]
    assert all(np.isfinite(part.displacement).all() for part in parts)


def test_a_log_carries_all_that_its_source_needs(tmp_path):
    """Content and files rebuild the case where its files are gone."""
    case = load(HOUSE, ['source=fan_2'])
    again = case_of(tmp_path / 'log.mcap', dict(case.content), files=case.files)
    keys = {models.response_key(one, models.coupled_model(one, tmp_path)) for one in (case, again)}
    assert len(keys) == 1
    assert (again.name, [*case.files]) == ('fan_2', ['plant_fan.yaml'])


def test_sources_are_those_that_turn_unless_one_is_chosen():
    assert sources_of(HOUSE) == ('fan_1', 'fan_2')
    assert sources_of(HOUSE, ['source=fan_1']) == ()
    assert sources_of(HOUSE, ['machines.0.rated_rpm=null', 'machines.0.idle=true']) == ('fan_2',)
    assert sources_of(FAN) == ()
    with pytest.raises(InputError, match='machines: is missing; a plant has several'):
        Plant.load(FAN)


def test_public_names_answer_a_plant(cache):
    plant = rs.Plant.load(HOUSE, cache_directory=cache)
    assert [*plant.machines] == ['fan_1', 'fan_2']
    found = rs.load(HOUSE, cache_directory=cache, source='fan_2').response(rpm=1475.0)
    own = plant.shaken()['fan_2_fan_end_housing_z']
    np.testing.assert_allclose(
        own.displacement[1], found[f'fan_2_fan_end_{HOUSING}_z'].displacement[0])


def test_damping_of_a_source_is_divided_wherever_it_stands_in_the_file(house):
    """Equal fans on both sides of the block lose the same, all but for their spin."""
    first, second = (machine.damping_split(rpm=900.0) for machine in house.machines.values())
    assert float(first.total[0]) == pytest.approx(float(second.total[0]), rel=1e-3)
    machine = house.machines['fan_2']
    np.testing.assert_allclose(second.total, work_put_in(
        machine.model, second.speed, machine.case.unbalance), rtol=1e-9)


def test_seats_of_a_plant_are_those_of_all_machines_at_once(house, cache, capsys):
    found = house.seat_receptance(hz=[10.0, 24.0])
    assert [str(seat) for seat in house.seats] == [
        f'{fan}_{end}_{axis}' for fan in ('fan_1', 'fan_2') for end in ('drive_end', 'fan_end')
        for axis in 'xz']
    # Where one machine pushes another moves as if it were the other way round.
    np.testing.assert_allclose(found, found.swapaxes(1, 2), rtol=1e-9)
    for number, machine in enumerate(house.machines.values()):
        own = slice(4 * number, 4 * number + 4)
        np.testing.assert_allclose(
            machine.seat_receptance(hz=[10.0, 24.0]), found[:, own, own], rtol=1e-12)
    assert main(['seats', str(HOUSE), '--hz', '10:24:2', '-o', '-', '--cache', str(cache)]) == 0
    header, *rows = capsys.readouterr().out.splitlines()
    assert header.split(',')[:2] == ['omega_rad_s', 'fan_1_drive_end_x__fan_1_drive_end_x_re']
    told = np.array([row.split(',') for row in rows], dtype=float)
    np.testing.assert_allclose(told[:, 1::2] + 1j * told[:, 2::2], found.reshape(2, -1))


def test_seats_of_a_rigid_block_follow_its_receptance(house):
    """The seats of both fans ride on one block: R (N^-1 - w^2 M)^-1 R^T, by hand."""
    [block] = house.machines['fan_1'].case.foundations
    omega = 2.0 * np.pi * 24.0
    model = house.machines['fan_1'].model
    [soil] = model.support.soils
    dynamic = np.linalg.inv(soil.compliance(np.array([omega]))[0]) - omega**2 * block.mass_matrix
    rows = []
    for fan in house.machines.values():
        place = fan.case.berth.place
        for bearing in fan.case.rotor.bearings:
            x, y = place.x, place.y + bearing.position
            rows += [[1.0, 0.0, 0.0, 0.0, 2.0, -y], [0.0, 0.0, 1.0, y, -x, 0.0]]
    rows = np.array(rows)
    np.testing.assert_allclose(house.seat_receptance(hz=24.0)[0],
                               rows @ np.linalg.solve(dynamic, rows.T), rtol=1e-9, atol=1e-18)
