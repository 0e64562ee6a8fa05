"""The verb `seats` writes what `support.model: receptance` reads, and nothing is lost by it."""

import shutil

from flexible_cases import FAN, loaded, STIFF
import numpy as np
import pytest
import yaml

from rotorsoil_ros.case.machine import Machine
from rotorsoil_ros.case.plant.together import Plant
from rotorsoil_ros.case.summary import derived_quantities, warnings
from rotorsoil_ros.cli import main
from rotorsoil_ros.cli.pictures import _ground_figures
from rotorsoil_ros.errors import InputError
from rotorsoil_ros.figures.response import support
from rotorsoil_ros.units import hz_to_rad_s

BLOCK = {
    **FAN, 'name': 'block', 'support': {'model': 'cone'},
    'soil': {'shear_modulus': 6e7, 'poisson_ratio': 0.3, 'density': 1900.0, 'loss_factor': 0.05},
    'foundations': [{'name': 'block', 'half_width': 1.0, 'half_length': 1.5, 'height': 1.2,
                     'density': 2400.0}]}


@pytest.fixture(scope='module')
def tables(folder):
    """Return the folder with the seats of each of its cases, in SI and in plant units."""
    (folder / 'block.yaml').write_text(yaml.safe_dump(BLOCK))
    for name, hertz in (('block', '1:60:119'), ('fan', '2:60:117'), ('frame', '1:40:157')):
        assert main(['seats', str(folder / f'{name}.yaml'), '--hz', hertz, '-o',
                     str(folder / f'{name}_seats.csv')]) == 0
        content = yaml.safe_load((folder / f'{name}.yaml').read_text())
        (folder / f'{name}_table.yaml').write_text(yaml.safe_dump(content | {
            'foundations': [], 'support': {'model': 'receptance', 'file': f'{name}_seats.csv'}}))
    return folder


@pytest.mark.parametrize('name', ['block', 'fan', 'frame'])
def test_a_machine_on_its_seats_is_the_machine_on_its_foundation(tables, name):
    own, other = loaded(tables, name), loaded(tables, f'{name}_table')
    rpm = np.linspace(*other.case.content['speed_range_rpm'], 50)
    answers = own.response(rpm=rpm), other.response(rpm=rpm)
    for channel in other.model.channels:
        one, two = (answer[channel].displacement for answer in answers)
        assert np.abs(two - one).max() < 1e-6 * np.abs(one).max()


def test_a_file_of_the_other_unit_says_the_same(tables):
    assert main(['seats', str(tables / 'block.yaml'), '--hz', '1:60:119', '--units', 'plant', '-o',
                 str(tables / 'plant.csv')]) == 0
    plant = loaded(tables, 'block_table', 'support.file=plant.csv').model.soil_models[0]
    si = loaded(tables, 'block_table').model.soil_models[0]
    np.testing.assert_allclose(plant.omega, si.omega, rtol=1e-12)
    np.testing.assert_allclose(plant.values, si.values, rtol=1e-9)


def test_half_of_a_table_is_enough(tables):
    # Of two entries that mirror each other one is there.
    columns = [line.split(',') for line in (tables / 'fan_seats.csv').read_text().splitlines()]
    seats = [name.removesuffix('_re').split('__') for name in columns[0]]
    order = list(dict.fromkeys(one[0] for one in seats[1:]))
    kept = [place for place, one in enumerate(seats)
            if len(one) == 1 or order.index(one[0]) <= order.index(
                one[1].removesuffix('_im'))]
    (tables / 'half.csv').write_text('\n'.join(
        ','.join(row[place] for place in kept) for row in columns))
    half = loaded(tables, 'fan_table', 'support.file=half.csv').model.soil_models[0]
    whole = loaded(tables, 'fan_table').model.soil_models[0]
    np.testing.assert_allclose(half.values, whole.values, rtol=1e-9)
    assert half.apart == 0


def test_pairs_that_nobody_gives_do_not_move_each_other_and_are_told(tables):
    columns = [line.split(',') for line in (tables / 'block_seats.csv').read_text().splitlines()]
    kept = [place for place, name in enumerate(columns[0])
            if '__' not in name or name.removesuffix('_re').removesuffix('_im').split('__')[0]
            == name.removesuffix('_re').removesuffix('_im').split('__')[1]]
    (tables / 'own.csv').write_text('\n'.join(
        ','.join(row[place] for place in kept) for row in columns))
    machine = loaded(tables, 'block_table', 'support.file=own.csv')
    assert any('6 of the 6 pairs of motions are not there' in line
               for line in warnings(machine.case))
    found = machine.seat_receptance(hz=[10.0])[0]
    np.testing.assert_array_equal(found[~np.eye(4, dtype=bool)], 0.0)


def test_check_and_report_tell_what_the_file_is(tables, capsys):
    machine = loaded(tables, 'block_table')
    told = dict(derived_quantities(machine.case, machine.model.soil_models))
    assert 'receptances of 4 motions of the seats at 119 frequencies from 1 to 60 Hz' in (
        told['foundation and ground'])
    assert main(['check', str(tables / 'block_table.yaml')]) == 0
    said = capsys.readouterr()
    assert 'foundation and ground' in said.out
    assert 'critical speed' in said.out
    # As far as 31 Hz the margins of 1780 rpm are not known.
    lines = (tables / 'block_seats.csv').read_text().splitlines()
    (tables / 'short.csv').write_text('\n'.join(lines[:62]))
    report = loaded(tables, 'block_table', 'support.file=short.csv').report(rpm=1780.0)
    assert any('foundation and ground: receptances' in line for line in report.assumptions)
    assert any('rpm only: the file of the support ends there' in line for line in report.reasons)


def test_the_picture_of_the_support_shows_rows_and_what_leads_on(tables):
    machine = loaded(tables, 'block_table')
    amplitude, _ = support(machine.case, machine.model).axes
    curve, rows = amplitude.lines[:2]
    assert len(rows.get_xdata()) == 119
    np.testing.assert_allclose(np.interp(rows.get_xdata(), *curve.get_data()), rows.get_ydata(),
                               rtol=1e-2)


def test_what_moving_ground_does_is_not_told(tables, tmp_path, capsys):
    machine = loaded(tables, 'block_table')
    assert not list(_ground_figures(machine.case, machine.model))
    assert 'receptances do not tell how seats follow the ground' in capsys.readouterr().err
    assert main(['transmissibility', str(tables / 'block_table.yaml'), '--hz', '5:10:2', '-o',
                 str(tmp_path / 'nothing.csv')]) == 2
    assert not (tmp_path / 'nothing.csv').exists()


def test_a_log_carries_the_table(tables, tmp_path):
    case = loaded(tables, 'block_table').case
    from rotorsoil_ros.case.config import case_of

    shutil.copy(tables / 'block_table.yaml', tmp_path)
    again = case_of(tmp_path / 'block_table.yaml', dict(case.content), files=case.files)
    np.testing.assert_array_equal(again.tables[0].values, case.tables[0].values)


@pytest.mark.parametrize('settings, said', [
    (['support.file=null'], 'support.file: is missing; the support model receptance needs it'),
    (['support.file=nothing.csv'], 'nothing.csv: cannot be read'),
    (['support.cut_offs_hz=[5]'],
     'support.cut_offs_hz: belongs to the support model table, got receptance'),
    (['support.geometry=plane_strain'], 'support.geometry: must be disc for the model receptance'),
    ([f'foundations={BLOCK["foundations"]}'],
     'foundations: must be empty with the support model receptance, whose file holds foundation '
     'and ground, got block'),
    (['speed_range_rpm=[300, 6000]'],
     'block_seats.csv: must cover speed_range_rpm, 5 to 100 Hz, got 1 to 60 Hz'),
    (['uncertainty={foundation_mass_factor: 1.2}'],
     'uncertainty.foundation_mass_factor: must not be given with the support model receptance'),
    (['rotor.bearings.0.name=drive_end'],
     "block_seats.csv: column 'fan_1_b1_x__fan_1_b1_x_re' is not known; needed are omega_rad_s or "
     'hz, and drive_end_x__drive_end_x_re and _im of the seats drive_end, fan_1_b2'),
    (['support.file=no_own.csv'],
     'no_own.csv: fan_1_b2_z__fan_1_b2_z must be given, as zeros where a seat does not move'),
    (['support.file=turned.csv'], 'turned.csv: the foundation must not give energy'),
    (['ground.sensors=[{name: yard, place: {x: 9.0, y: 0.0}}]'],
     'ground.sensors: need a support model that tells how the machine follows the ground, got '
     'receptance'),
])
def test_bad_input_is_one_line(tables, settings, said):
    text = (tables / 'block_seats.csv').read_text()
    header, *rows = text.splitlines()
    (tables / 'no_own.csv').write_text('\n'.join(
        ','.join(line.split(',')[:-2]) for line in (header, *rows)))
    (tables / 'turned.csv').write_text('\n'.join([header, *(','.join(
        cell if place % 2 or not place else str(-float(cell)) for place, cell in enumerate(
            row.split(','))) for row in rows)]))
    with pytest.raises(InputError) as error:
        Machine.load(tables / 'block_table.yaml', cache_directory=tables / 'cache',
                     overrides=settings)
    told = str(error.value).splitlines()
    assert any(said in line for line in told), told
    assert len(told) == 1


def test_a_seat_may_have_a_name_of_its_own(tables):
    settings = [f'rotor.bearings.{index}={{name: {name}, position: {place}, seat: {seat}, '
                f'stiffness: {STIFF["stiffness"]}, damping: {STIFF["damping"]}}}'.replace("'", '')
                for index, (name, place, seat) in enumerate(
                    (('drive_end', 0.25, 'fan_1_b1'), ('fan_end', 1.25, 'fan_1_b2')))]
    machine = loaded(tables, 'block_table', *settings)
    own = loaded(tables, 'block')
    np.testing.assert_allclose(machine.seat_receptance(hz=[12.3]), own.seat_receptance(hz=[12.3]),
                               rtol=1e-9)
    assert machine.model.channels[0] == 'drive_end_journal_x'


@pytest.fixture(scope='module')
def house(tables):
    """Return two fans of another file, turned against each other, on a block and on its seats."""
    (tables / 'rotor.yaml').write_text(yaml.safe_dump(BLOCK | {'rotor': BLOCK['rotor'] | {
        'bearings': [one | {'foundation': 'block'} for one in BLOCK['rotor']['bearings']]}}))
    plant = {key: value for key, value in BLOCK.items() if key not in ('rotor', 'unbalances')}
    plant['machines'] = [{
        'name': name, 'place': {'x': x, 'y': -0.75, 'heading': heading}, 'rated_rpm': rpm,
        'rotor': {'file': 'rotor.yaml'}, 'unbalances': BLOCK['unbalances']}
        for name, x, heading, rpm in (('a', -0.7, 0.0, 1480.0), ('b', 0.7, 0.4, 990.0))]
    (tables / 'house.yaml').write_text(yaml.safe_dump(plant))
    assert main(['seats', str(tables / 'house.yaml'), '--hz', '1:60:119', '-o',
                 str(tables / 'house_seats.csv')]) == 0
    (tables / 'house_table.yaml').write_text(yaml.safe_dump(plant | {
        'foundations': [], 'support': {'model': 'receptance', 'file': 'house_seats.csv'}}))
    return tuple(Plant.load(tables / f'{name}.yaml', cache_directory=tables / 'cache')
                 for name in ('house', 'house_table'))


def test_a_plant_on_its_seats_is_the_plant_on_its_foundation(house):
    own, other = house
    assert other.seats == own.seats
    for name, machine in other.machines.items():
        rpm = np.linspace(300.0, 1800.0, 50)
        answers = own.machines[name].response(rpm=rpm), machine.response(rpm=rpm)
        for channel in machine.model.channels:
            one, two = (answer[channel].displacement for answer in answers)
            assert np.abs(two - one).max() < 1e-6 * np.abs(one).max()
        one, two = (found.campbell(rpm=[300.0]).eigenvalue[0] for found in (
            own.machines[name], machine))
        known = one[one.imag < hz_to_rad_s(60.0)]
        assert len(known) >= 6
        np.testing.assert_allclose(two, known, rtol=1e-5)
    together, apart = own.shaken(), other.shaken()
    names = tuple(map(str, apart.channels))
    np.testing.assert_allclose(apart.own_rms, together[names].own_rms, rtol=1e-6)


def test_a_seat_of_another_machine_that_the_table_lacks_is_told_once(house, tables):
    with pytest.raises(InputError) as error:
        loaded(tables, 'house_table', 'source=a', 'support.file=block_seats.csv')
    [line] = str(error.value).splitlines()
    assert line.endswith("column 'fan_1_b1_x__fan_1_b1_x_re' is not known; needed are omega_rad_s "
                         'or hz, and a_fan_1_b1_x__a_fan_1_b1_x_re and _im of the seats '
                         'a_fan_1_b1, a_fan_1_b2, b_fan_1_b1, b_fan_1_b2')


def test_orders_beyond_the_table_have_no_answer(tables):
    machine = loaded(tables, 'block_table')
    with pytest.raises(ValueError, match='range of the receptances of the seats, got'):
        machine.order_response(order=5.0, force='fan_1_b1_housing_x', rpm=[1800.0])
