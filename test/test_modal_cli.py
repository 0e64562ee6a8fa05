"""The verbs `frf`, `campbell` and `response --order` as a user meets them."""

import csv
import io
from pathlib import Path

import numpy as np
import pytest

from rotorsoil_ros.case.config import load
from rotorsoil_ros.case.models import coupled_model
from rotorsoil_ros.cli import main
from rotorsoil_ros.machine.modes.campbell import campbell
from rotorsoil_ros.machine.modes.critical import critical_speeds
from rotorsoil_ros.units import hz_to_rad_s, rpm_to_rad_s

ROOT = Path(__file__).parents[1]
PAPER = str(ROOT / 'config' / 'paper_rotor.yaml')
NO_CACHE = Path('no cache is needed for cones')


@pytest.fixture(scope='module')
def model():
    """Return the paper's machine."""
    return coupled_model(load(Path(PAPER)), NO_CACHE)


def table_of(capsys, *arguments):
    """Return the CSV that a verb prints, as its header and an array."""
    assert main([*arguments]) == 0
    header, *rows = csv.reader(io.StringIO(capsys.readouterr().out))
    if header[-1] == 'name':
        header, rows = header[:-1], [row[:-1] for row in rows]
    return header, np.array(rows, dtype=float)


def displacement_of(header, rows):
    """Return the complex columns of a CSV after its first one, and their names."""
    assert header[1::2] == [f'{name[:-3]}_re' for name in header[2::2]]
    return [name[:-3] for name in header[1::2]], rows[:, 1::2] + 1j * rows[:, 2::2]


def test_frf_is_that_of_the_model_at_fixed_speed(capsys, model):
    header, rows = table_of(capsys, 'frf', PAPER, '--rpm', '3000', '--hz', '5:120:4',
                            '--force', 'disc_1_z')
    omega = hz_to_rad_s(np.linspace(5.0, 120.0, 4))
    expected = model.frequency_response(omega, speed=rpm_to_rad_s(3000.0), channel='disc_1_z')
    names, found = displacement_of(header, rows)
    assert (header[0], tuple(names)) == ('omega_rad_s', model.channels)
    np.testing.assert_array_equal(rows[:, 0], omega)
    np.testing.assert_array_equal(found, expected.displacement)


def test_impact_at_rest_is_reciprocal(capsys):
    # Maxwell and Betti: without rotation, here answers there as there answers here.
    answers = []
    for force, there in (('disc_1_z', 'disc_2_z'), ('disc_2_z', 'disc_1_z')):
        header, rows = table_of(capsys, 'frf', PAPER, '--rpm', '0', '--hz', '5:120:4',
                                '--force', force)
        names, found = displacement_of(header, rows)
        answers.append(found[:, names.index(there)])
    np.testing.assert_allclose(*answers, rtol=1e-9)  # round-off near resonance


def test_response_of_an_order_turns_at_the_speed_and_shakes_at_its_multiple(capsys, model):
    header, rows = table_of(capsys, 'response', PAPER, '--rpm', '600:6000:3', '--order', '2',
                            '--force', 'disc_2_x')
    speed = rpm_to_rad_s(np.linspace(600.0, 6000.0, 3))
    names, found = displacement_of(header, rows)
    assert (header[0], tuple(names)) == ('speed_rad_s', model.channels)
    np.testing.assert_array_equal(rows[:, 0], speed)
    for at, answer in zip(speed, found, strict=True):
        same = model.frequency_response(np.array([2.0 * at]), speed=at, channel='disc_2_x')
        np.testing.assert_allclose(answer, same.displacement[0], rtol=1e-6,
                                   atol=1e-9 * np.abs(answer).max())  # x to z: round-off


def test_campbell_writes_the_lowest_modes_of_every_speed(capsys, model):
    header, rows = table_of(capsys, 'campbell', PAPER, '--rpm', '0:9000:3', '--modes', '5')
    speed = rpm_to_rad_s(np.linspace(0.0, 9000.0, 3))
    found = campbell(model, speed, 5)
    assert header == ['speed_rad_s', 'mode', 'omega_rad_s', 'damping_ratio', 'whirl']
    np.testing.assert_array_equal(rows[:, 0], np.repeat(speed, 5))
    np.testing.assert_array_equal(rows[:, 1], np.tile([1, 2, 3, 4, 5], 3))
    for column, values in ((2, found.omega), (3, found.damping_ratio), (4, found.whirl)):
        np.testing.assert_array_equal(rows[:, column], values.ravel())
    assert np.all(np.diff(found.omega, axis=1) >= 0.0)


def test_campbell_leaves_out_modes_that_the_machine_does_not_have(capsys):
    # A shaft of one element on springs without a block: 8 motions, 8 modes.
    _, rows = table_of(
        capsys, 'campbell', PAPER, '--rpm', '100:200:2', '--modes', '20', '--set',
        'support.model=rigid', '--set', 'rotor.shaft.0.elements=1', '--set', 'rotor.discs=[]',
        '--set', 'unbalances=[]', '--set', 'rotor.bearings.1.position=0.76202')
    assert rows[:, 1].tolist() == 2 * list(range(1, 9))
    assert np.all(np.isfinite(rows))


def test_campbell_leaves_out_modes_beyond_the_file_of_the_ground(capsys, tmp_path):
    # Springs and dashpots known up to 127.5 Hz: gyroscopics lift the fourth mode past that.
    lines = ['hz,xx_re,xx_im,zz_re,zz_im', *(
        f'{hz},1.2e8,{2e6 * hz},1.4e8,{3e6 * hz}' for hz in np.linspace(0.0, 127.5, 60))]
    (tmp_path / 's.csv').write_text('\n'.join(lines))
    _, rows = table_of(
        capsys, 'campbell', PAPER, '--rpm', '0:6000:2', '--modes', '20', '--set',
        f'support={{model: table, file: {tmp_path / "s.csv"}}}', '--set',
        'speed_range_rpm=[60, 6000]')
    assert np.all(np.isfinite(rows))
    assert np.sum(rows[:, 0] > 0.0) == np.sum(rows[:, 0] == 0.0) - 1


def test_criticals_of_the_range_of_the_case_are_those_of_the_model(capsys, model):
    header, rows = table_of(capsys, 'campbell', PAPER, '--criticals')
    expected = critical_speeds(model, load(Path(PAPER)).speed_range)
    assert header == ['speed_rad_s', 'whirl', 'damping_ratio']
    assert [tuple(row) for row in rows] == [
        (one.speed, one.whirl, one.damping_ratio) for one in expected]


def test_criticals_of_the_rigid_machine_are_those_of_the_design_note(capsys):
    # the paper's machine on rigid ground: backward and forward
    _, rows = table_of(capsys, 'campbell', PAPER, '--criticals', '--rpm', '60:9000:2',
                       '--set', 'support.model=rigid')
    np.testing.assert_allclose(rows[:, 0], hz_to_rad_s(np.array([44.01, 48.86, 123.12, 129.48])),
                               atol=hz_to_rad_s(0.005))  # four digits
    assert rows[:, 1].tolist() == [-1, 1, -1, 1]


def test_margins_of_a_running_speed_come_on_request(capsys):
    header, rows = table_of(capsys, 'campbell', PAPER, '--criticals', '--running', '3000',
                            '--rpm', '2000:9000:2')
    assert header[3:] == ['amplification_factor', 'separation_margin', 'required_margin',
                          'half_power_factor']
    np.testing.assert_allclose(rows[:, 3], 0.5 / rows[:, 2])
    np.testing.assert_allclose(rows[:, 4], np.abs(rows[:, 0] / (100.0 * np.pi) - 1.0))
    # min(17 (1 - 1 / (AF - 1.5)), 16) below, min(10 + 17 (1 - 1 / (AF - 1.5)), 26) above
    factor = np.fmax(rows[:, 3], rows[:, 6])
    share = np.minimum(0.17 * (1.0 - 1.0 / (factor - 1.5)), 0.16)
    required = share + 0.1 * (rows[:, 0] > 100.0 * np.pi)
    np.testing.assert_allclose(rows[:, 5], np.where(factor < 2.5, 0.0, required))


def test_a_critical_speed_just_beyond_the_range_is_told_with_its_margin(capsys):
    # The second mode of the rigid machine, 48.86 Hz = 2931.6 rpm, lies 1.6 % above 2885 rpm.
    _, rows = table_of(capsys, 'campbell', PAPER, '--criticals', '--running', '2885', '--set',
                       'support.model=rigid', '--set', 'speed_range_rpm=[600, 2885]')
    forward = rows[rows[:, 1] > 0.0]
    assert len(forward) == 1
    np.testing.assert_allclose(forward[0, 4], 0.0162, atol=2e-4)
    np.testing.assert_allclose(forward[0, 5], 0.26)


def test_no_critical_speed_is_said_with_how_far_was_looked(capsys):
    arguments = ['campbell', PAPER, '--criticals', '--rpm', '100:1000:2']
    assert main(arguments) == 0
    said = capsys.readouterr()
    assert said.out.splitlines() == ['speed_rad_s,whirl,damping_ratio']
    assert 'no critical speed from 100 up to 1000 rpm' in said.err
    assert main([*arguments, '--running', '900']) == 0
    assert 'no critical speed from 100 up to 1134 rpm' in capsys.readouterr().err


def test_margins_end_where_the_tables_of_bearings_end_and_that_is_said(capsys):
    fan = str(Path(__file__).parent / 'cases' / 'fan_table' / 'case.yaml')
    assert main(['campbell', fan, '--criticals', '--running', '1500']) == 0
    said = capsys.readouterr()
    assert said.out.splitlines()[1].endswith(',block rocking across')
    assert 'from 100 to 1800 rpm only: tables of bearings end there; margins' in said.err


@pytest.mark.parametrize('arguments, problem', [
    (['frf', PAPER, '--rpm', '0', '--hz', '1:2:2', '--force', 'disc_9_z'],
     '--force must be one of bearing_1_journal_x, '),
    (['response', PAPER, '--rpm', '1:2:2', '--order', '2', '--force', 'disc'],
     '--force must be one of bearing_1_journal_x, '),
    (['response', PAPER, '--rpm', '1:2:2', '--order', '2'], '--order and --force belong together'),
    (['response', PAPER, '--rpm', '1:2:2', '--force', 'disc_1_x'],
     '--order and --force belong together'),
    (['campbell', PAPER], '--rpm is missing'),
    (['campbell', PAPER, '--rpm', '1:2:2', '--running', '50'], '--running needs --criticals'),
    (['campbell', PAPER, '--criticals', '--running', '0'], '--running must be > 0 rpm, got 0'),
    (['campbell', PAPER, '--criticals', '--rpm', '5:5:1'],
     '--rpm must rise with --criticals, got 5 to 5 rpm'),
])
def test_bad_input_is_one_line_and_status_2(arguments, problem, capfd, tmp_path):
    output = tmp_path / 'out.csv'
    assert main([*arguments, '-o', str(output)]) == 2
    said = capfd.readouterr().err
    assert said.startswith(problem)
    assert said.count('\n') == 1
    assert not output.exists()


@pytest.mark.parametrize('arguments, problem', [
    (['frf', PAPER, '--rpm', 'x'], "argument --rpm: must be a speed >= 0 rpm, got 'x'"),
    (['frf', PAPER, '--rpm', '-1'], "argument --rpm: must be a speed >= 0 rpm, got '-1'"),
    (['response', PAPER, '--order', '0'],
     "argument --order: must be a multiple > 0 of the speed, got '0'"),
    (['response', PAPER, '--order', 'two'], 'argument --order: must be a multiple > 0'),
    (['campbell', PAPER, '--modes', '0'], "argument --modes: must be 1 to 999 modes, got '0'"),
    (['campbell', PAPER, '--modes', '1e3'], 'argument --modes: must be 1 to 999 modes'),
])
def test_bad_command_line_is_one_line_and_status_2(arguments, problem, capsys):
    with pytest.raises(SystemExit) as left:
        main(arguments)
    assert left.value.code == 2
    said = capsys.readouterr().err
    assert said.startswith(f'rotorsoil {arguments[0]}: {problem}')
    assert said.count('\n') == 1


def test_criticals_tell_where_their_damping_comes_from(capsys):
    path = str(ROOT / 'config' / 'plant_fan.yaml')
    assert main(['campbell', path, '--criticals', '--damping']) == 0
    rows = list(csv.DictReader(io.StringIO(capsys.readouterr().out)))
    assert float(rows[0]['radiation_share']) == pytest.approx(0.834, abs=2e-3)
    assert float(rows[0]['soil_material_share']) == pytest.approx(0.166, abs=2e-3)
    assert rows[0]['pedestals_share'] == rows[0]['soil_share'] == ''
    assert main(['campbell', path, '--rpm', '1:2:2', '--damping']) == 2
    assert '--damping needs --criticals' in capsys.readouterr().err
    assert main(['check', path]) == 0
    told = capsys.readouterr().out
    assert 'damping ratio 0.16 (radiation 83.4%, soil material 16.6%, bearings 0.0%)' in told
    assert 'damping at 1800 rpm' in told
