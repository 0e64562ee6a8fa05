"""The verbs as a user meets them."""

import csv
import io
import math
import os
from pathlib import Path
import subprocess
import sys

import numpy as np
import pytest

from rotorsoil_ros.case.config import load
from rotorsoil_ros.case.machine import Machine
from rotorsoil_ros.case.models import coupled_model
from rotorsoil_ros.cli import main
from rotorsoil_ros.ground.cone import ConeModel
from rotorsoil_ros.units import rpm_to_rad_s

ROOT = Path(__file__).parents[1]
PAPER = str(ROOT / 'config' / 'paper_rotor.yaml')
NO_CACHE = Path('no cache is needed for cones')
FAN = str(ROOT / 'config' / 'plant_fan.yaml')
KIT = str(ROOT / 'config' / 'rk4_rotor_kit.yaml')
PROGRAM = [sys.executable, '-m', 'rotorsoil_ros.cli']


def table_of(text):
    """Return a CSV as its header and an array."""
    header, *rows = csv.reader(io.StringIO(text))
    return header, np.array(rows, dtype=float)


def complex_column(header, rows, name):
    return rows[:, header.index(f'{name}_re')] + 1j * rows[:, header.index(f'{name}_im')]


def test_response_is_that_of_the_model_to_the_last_bit(capsys):
    assert main(['response', PAPER, '--rpm', '60:9000:7']) == 0
    header, rows = table_of(capsys.readouterr().out)
    case = load(Path(PAPER))
    model = coupled_model(case, NO_CACHE)
    speed = rpm_to_rad_s(np.linspace(60.0, 9000.0, 7))
    expected = model.unbalance_response(speed, case.unbalance).displacement
    assert header[0] == 'speed_rad_s'
    assert header[1:] == [f'{name}_{part}' for name in model.channels for part in ('re', 'im')]
    np.testing.assert_array_equal(rows[:, 0], speed)
    for column, name in enumerate(model.channels):
        np.testing.assert_array_equal(complex_column(header, rows, name), expected[:, column])


def test_turns_per_second_are_another_word_for_rpm(capsys):
    assert main(['response', PAPER, '--hz', '1:150:4']) == 0
    by_hz = capsys.readouterr().out
    assert main(['response', PAPER, '--rpm', '60:9000:4']) == 0
    np.testing.assert_allclose(table_of(by_hz)[1], table_of(capsys.readouterr().out)[1],
                               rtol=1e-9)  # 60 x is rounded before the solve


def test_long_sweep_is_that_of_its_parts(capsys):
    assert main(['response', KIT, '--rpm', '600:900:5001']) == 0  # longer than one chunk
    _, rows = table_of(capsys.readouterr().out)
    assert len(rows) == 5001
    assert main(['response', KIT, '--rpm', '900:900:1']) == 0
    np.testing.assert_allclose(table_of(capsys.readouterr().out)[1][0], rows[-1], rtol=1e-9)


def test_compliance_is_that_of_the_cones_at_a0(capsys):
    assert main(['compliance', PAPER, '--a0', '0:2:5']) == 0
    header, rows = table_of(capsys.readouterr().out)
    case = load(Path(PAPER))
    a0 = np.linspace(0.0, 2.0, 5)
    omega = a0 * math.sqrt(48e6 / 1900.0) / 0.5
    expected = ConeModel(case.soil, case.foundations[0].contact).compliance(omega)
    assert header == ['omega_rad_s', 'a0', *(f'{ij}_{part}' for ij in (
        'xx', 'yy', 'zz', 'rxrx', 'ryry', 'rzrz') for part in ('re', 'im'))]
    np.testing.assert_allclose(rows[:, 0], omega, rtol=1e-14)
    np.testing.assert_allclose(rows[:, 1], a0, rtol=1e-14)
    for dof, name in enumerate(('xx', 'yy', 'zz', 'rxrx', 'ryry', 'rzrz')):
        np.testing.assert_allclose(complex_column(header, rows, name), expected[:, dof, dof],
                                   rtol=1e-13)  # omega is rounded once more


def test_compliance_over_hz_tells_a0(capsys):
    assert main(['compliance', FAN, '--hz', '0:50:3']) == 0
    _, rows = table_of(capsys.readouterr().out)
    np.testing.assert_allclose(rows[:, 0], 2.0 * math.pi * np.array([0.0, 25.0, 50.0]))
    np.testing.assert_allclose(rows[:, 1], rows[:, 0] * 1.0 / math.sqrt(100e6 / 1900.0))


def test_rigid_ground_has_no_compliance_to_write(capsys):
    assert main(['compliance', PAPER, '--hz', '0:50:2', '--set', 'support.model=rigid']) == 0
    assert capsys.readouterr().out.splitlines()[0] == 'omega_rad_s,a0'


def test_file_gets_what_standard_output_gets(tmp_path, capsys):
    assert main(['response', PAPER, '--rpm', '60:900:3', '-o', '-']) == 0
    printed = capsys.readouterr().out
    assert main(['response', PAPER, '--rpm', '60:900:3', '-o', str(tmp_path / 'r.csv')]) == 0
    assert (tmp_path / 'r.csv').read_text() == printed
    assert capsys.readouterr().out == ''


def test_check_prints_what_follows_from_the_case(capsys, tmp_path):
    assert main(['check', PAPER, '--cache', str(tmp_path)]) == 0
    lines = dict(line.split('  ', 1) for line in capsys.readouterr().out.splitlines()
                 if '  ' in line)
    lines = {name: value.strip() for name, value in lines.items()}
    assert lines['shear wave speed c_s'] == '158.94 m/s'  # sqrt(48e6 / 1900)
    assert lines['dilatational wave speed c_p'] == '275.3 m/s'
    assert lines['block: static stiffness z'] == '1.444e+08 N/m'
    assert lines['block: static stiffness x'] == '1.238e+08 N/m'
    assert lines['block: static stiffness ry'] == '3.173e+07 N m/rad'
    assert lines['block: mass over rotor mass'] == '10'
    forward = [name for name, value in lines.items()
               if name.startswith('critical') and value.startswith('forward')
               and float(value.split('ratio ')[1].split()[0].rstrip(',')) < 0.1]
    # unbalance excites forward modes: both descriptions of the machine agree
    assert [float(name.split()[2]) for name in forward] == pytest.approx(
        [float(name.split()[2]) for name in lines if name.startswith('response peak')
         and float(lines[name].split()[0]) > 100.0], rel=1e-4)


@pytest.mark.parametrize('case, setting, warning', [
    (PAPER, 'unbalances=[]', 'unbalances: none, every prediction will be zero'),
    (PAPER, 'rotor.discs.0.polar_inertia=1', 'disc_1: polar inertia 1 kg m^2 is more than twice'),
    (PAPER, 'foundations.0.inertia=[1, 1, 3]', 'block: inertia 3 kg m^2 about one axis'),
    (PAPER, 'soil.shear_modulus=10e6', 'block: a0 reaches 6.5; above 6 cones are off'),
    (PAPER, 'soil.poisson_ratio=0.45', 'block: a0 reaches 2.96; above 2 cones are off'),
    (FAN, 'foundations.0.half_length=3', 'block: contact is 3 times as long as wide'),
])
def test_check_warns(case, setting, warning, capsys):
    assert main(['check', case, '--set', setting]) == 0
    assert f'warning: {warning}' in capsys.readouterr().out


@pytest.mark.parametrize('case, count', [(PAPER, 1), (FAN, 2), (KIT, 0)])
def test_cases_as_they_are_warn_of_nothing_but_slow_cones_and_rock(case, count, capsys):
    assert main(['check', case]) == 0
    warnings = [line for line in capsys.readouterr().out.splitlines() if 'warning' in line]
    assert len(warnings) == count
    assert all('below 1.5 cones damp too much' in line or 'nothing is said of rock' in line
               for line in warnings)


def test_a_peak_that_no_machine_survives_is_remarked(capsys):
    # 0.01 kg m on 0.7 kg is an eccentricity of 14 mm, on rigid ground without damping to speak of.
    main(['check', PAPER, '--set', 'support.model=rigid', '--set', 'unbalances.0.moment=0.01'])
    said = capsys.readouterr().out
    assert said.count("is more than 5% of the shaft's length, 0.762 m") == 2


def test_error_of_the_solver_is_not_taken_for_that_of_the_model(capsys, tmp_path):
    assert main(['tabulate', FAN, '--cache', str(tmp_path)]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert any(line.startswith('largest error of the solver') for line in lines)
    assert any(line.startswith('block: model error') and 'cones under discs for a rectangle of '
               '1.5 to 1: compliance off by up to 17% over the speed range' in line
               for line in lines)


@pytest.mark.slow
def test_infinite_elements_have_no_such_warning(capsys, tmp_path):
    settings = ['--set', 'support.model=infinite_elements', '--cache', str(tmp_path)]
    assert main(['check', PAPER, *settings]) == 0
    assert 'warning' not in capsys.readouterr().out


def test_tabulate_tells_what_it_computed_and_where_it_lies(capsys, tmp_path):
    assert main(['tabulate', KIT, '--cache', str(tmp_path)]) == 0
    first = capsys.readouterr().out
    assert main(['tabulate', KIT, '--cache', str(tmp_path)]) == 0
    second = capsys.readouterr().out
    [file] = tmp_path.iterdir()
    assert 'response table                           computed in' in first
    assert 'response table                           loaded in' in second
    assert str(file) in first
    assert str(file) in second


def test_table_that_cannot_be_stored_is_used_all_the_same(capsys, tmp_path, caplog):
    obstacle = tmp_path / 'file'
    obstacle.touch()
    assert main(['tabulate', KIT, '--cache', str(obstacle)]) == 0
    assert 'cannot be written' in caplog.text


@pytest.mark.parametrize('arguments, problem', [
    (['check', 'nothing.yaml'], 'nothing.yaml: cannot be read: No such file or directory'),
    (['check', '/'], '/: cannot be read: Is a directory'),
    (['check', PAPER, '--set', 'foundations.0.mass=-1'],
     f'{PAPER}: foundations.0.mass: must be >= 0 kg and finite, got -1'),
    (['check', PAPER, '--set', 'soil.shear_modulus=1e-300'],
     f'{PAPER}: the coupled system has no finite solution'),
    (['check', PAPER, '--set', 'mass'], '--set mass: must be key.path=value'),
    (['response', PAPER, '--rpm', '60:900:3', '-o', '/'], '/: Is a directory'),
    (['response', PAPER, '--rpm', '60:900:3', '-o', '/nothing/x.csv'],
     '/nothing/x.csv: No such file or directory'),
    (['response', PAPER, '--rpm', '60:900:3', '-o', '/dev/full'],
     '/dev/full: No space left on device'),
    (['plot', KIT, '-o', f'{PAPER}/below'], f'{PAPER}/below: Not a directory'),
    (['compliance', KIT, '--hz', '0:1:2'],
     f'{KIT}: foundations: --foundation must be one of none, there is no block, got None'),
    (['compliance', PAPER, '--hz', '0:1:2', '--foundation', 'blok'],
     f'{PAPER}: foundations: --foundation must be one of block, got blok'),
    (['compliance', PAPER, '--a0', '0:1:2', '--set', 'support.model=rigid', '--set', 'soil='],
     f'{PAPER}: soil: is missing; --a0 needs its c_s, --hz does not'),
    (['predict', PAPER, 'nothing.mcap', '-o', 'x.mcap'], 'nothing.mcap: '),
])
def test_bad_input_is_one_line_and_status_2(arguments, problem, capfd):
    assert main(arguments) == 2
    said = capfd.readouterr().err
    assert said.startswith(problem)
    assert said.count('\n') == 1


@pytest.mark.parametrize('arguments, problem', [
    ([], 'rotorsoil: the following arguments are required: VERB'),
    (['nothing'], "rotorsoil: argument VERB: 'nothing' is not known; it must be one of new,"),
    (['chek', PAPER], "rotorsoil: argument VERB: 'chek' is not known; did you mean check?"),
    (['response', PAPER, '--rpm', '1:2:3', '--outptu', 'x'],
     'rotorsoil: unrecognized arguments: --outptu x; did you mean --output?'),
    (['response', PAPER, '--rpm', '1:2:3', '--units', 'plan'],
     "rotorsoil response: argument --units: 'plan' is not known; did you mean plant?"),
    (['response', PAPER], 'rotorsoil response: one of the arguments --rpm --hz is required'),
    (['response', PAPER, '--rpm', '1:2'],
     "rotorsoil response: argument --rpm: must be start:stop:count, ends included, got '1:2'"),
    (['response', PAPER, '--rpm', '2:1:5'],
     "rotorsoil response: argument --rpm: must rise from start >= 0 to a finite stop, "
     "got '2:1:5'"),
    (['response', PAPER, '--rpm', '-2:1:5'], 'rotorsoil response: argument --rpm: '),
    (['study', PAPER, '--rpm', '300', '--vary', 'soil.density=-1:-2:3'],
     "rotorsoil study: argument --vary: must rise from start to a finite stop, got '-1:-2:3'"),
    (['response', PAPER, '--rpm', '0:nan:5'], 'rotorsoil response: argument --rpm: must rise'),
    (['response', PAPER, '--rpm', '0:inf:5'], 'rotorsoil response: argument --rpm: must rise'),
    (['response', PAPER, '--rpm', '0:1:0'],
     "rotorsoil response: argument --rpm: must have 1 to 10000000 values, got '0:1:0'"),
    (['response', PAPER, '--rpm', '0:1:2.5'], 'rotorsoil response: argument --rpm: must be start'),
    (['replay', 'x.mcap', '--rate', '0'],
     "rotorsoil replay: argument --rate: must be a factor > 0, got '0'"),
    (['replay', 'x.mcap', '--rate', 'nan'], 'rotorsoil replay: argument --rate: must be a factor'),
])
def test_bad_command_line_is_one_line_and_status_2(arguments, problem, capsys):
    with pytest.raises(SystemExit) as left:
        main(arguments)
    assert left.value.code == 2
    said = capsys.readouterr().err
    assert said.startswith(problem)
    assert said.count('\n') == 1


def test_plot_writes_every_picture(tmp_path, capsys):
    assert main(['plot', PAPER, '-o', str(tmp_path / 'new' / 'plots'),
                 '--cache', str(tmp_path / 'cache')]) == 0
    names = {Path(line).stem for line in capsys.readouterr().out.splitlines()}
    assert names == {'machine', 'support', 'bode_journals', 'bode_housings', 'bode_discs',
                     'bode_foundations', 'bode_rocking', 'orbits', 'shapes', 'campbell',
                     'critical_shapes', 'polar', 'mass_ratios', 'compliance_block', 'damping',
                     'transmissibility'}
    for path in (tmp_path / 'new' / 'plots').iterdir():
        assert path.read_bytes().startswith(b'\x89PNG')


def test_machine_that_does_not_move_is_drawn_all_the_same(tmp_path, capsys):
    assert main(['plot', PAPER, '--set', 'unbalances=[]', '--set', 'soil.poisson_ratio=0.495',
                 '-o', str(tmp_path), '--cache', str(tmp_path / 'cache')]) == 0
    # infinite elements refuse that soil: what is not drawn is told
    assert capsys.readouterr().err.startswith(
        'infinite elements are not in picture compliance_block: poisson_ratio')
    assert (tmp_path / 'bode_discs.png').exists()


def test_help_needs_no_numpy():
    code = ('import sys; from rotorsoil_ros.cli import main\n'
            'try: main(["--help"])\nexcept SystemExit: pass\n'
            'print({"numpy", "pydantic", "rclpy", "rerun", "matplotlib", "rich"} '
            '& set(sys.modules), file=sys.stderr)')
    done = subprocess.run([sys.executable, '-c', code], cwd=ROOT, capture_output=True, text=True,
                          check=True)
    assert done.stderr == 'set()\n'
    assert 'VERB' in done.stdout


def test_full_disk_behind_standard_output_is_one_line_and_status_2():
    with open('/dev/full', 'w') as full:
        done = subprocess.run([*PROGRAM, 'check', PAPER], cwd=ROOT,
                              env={**os.environ, 'PYTHONUNBUFFERED': ''}, stdout=full,
                              stderr=subprocess.PIPE, text=True)
    assert done.returncode == 2
    assert done.stderr == 'standard output: No space left on device\n'


def test_reader_that_has_seen_enough_hears_no_complaint():
    with subprocess.Popen([*PROGRAM, 'response', PAPER, '--rpm', '60:9000:2000'], cwd=ROOT,
                          stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        assert process.stdout.readline().startswith(b'speed_rad_s,')
        process.stdout.close()
        assert process.stderr.read() == b''
    assert process.returncode == 0


def test_transmissibility_is_that_of_the_machine_in_both_units(capsys):
    asked = ['transmissibility', PAPER, '--set', 'support.model=cone', '--hz', '0:40:5', '--units']
    assert main([*asked, 'si']) == 0
    si, rows = table_of(capsys.readouterr().out)
    assert main([*asked, 'plant']) == 0
    plant, values = table_of(capsys.readouterr().out)
    vector = complex_column(si, rows, 'disc_1_x__ground_x')
    # At rest it moves as the ground does, to the last digits.
    assert vector[0] == pytest.approx(1.0, abs=1e-9)
    np.testing.assert_allclose(rows[:, 0], 2.0 * math.pi * values[:, 0])
    size, lag = (values[:, plant.index(f'disc_1_x__ground_x{kind}')] for kind in ('', '_lag_deg'))
    np.testing.assert_allclose(size * np.exp(-1j * np.radians(lag)), vector, rtol=1e-9)
    machine = Machine.load(Path(PAPER), overrides=['support.model=cone'])
    found = machine.transmissibility(hz=values[:, 0])
    np.testing.assert_allclose(found['disc_1_x'].ratio[:, 0, 0], vector)
    assert len(found) == len(found.frequency_hz) == 5
    assert found.speed_rpm == 0.0


def test_transmissibility_of_an_unstable_machine_is_not_told(capsys):
    machine = ['--set', 'rotor.bearings.0.stiffness.xz=9e8', '--set',
               'rotor.bearings.0.stiffness.zx=-9e8', '--set', 'support.model=cone']
    assert main(['transmissibility', PAPER, *machine, '--hz', '10:20:2', '--rpm', '3000']) == 1
    out, err = capsys.readouterr()
    assert 'nan' in out
    assert 'no steady response, NaN' in err


@pytest.mark.parametrize('verb', [
    ['response', PAPER, '--rpm', '60:900:3', '-o'], ['plot', PAPER, '-o'],
    ['figures', '-o'], ['compliance', PAPER, '--hz', '1:2:2', '-o'],
    ['frf', PAPER, '--rpm', '0', '--hz', '1:2:2', '--force', 'disc_1_x', '-o'],
    ['transmissibility', PAPER, '--hz', '1:2:2', '-o'],
    ['campbell', PAPER, '--rpm', '60:900:3', '-o']])
def test_nothing_that_exists_is_overwritten(verb, tmp_path, capsys):
    kept = tmp_path / 'mine.csv'
    kept.write_text('mine')
    out = tmp_path if verb[0] in ('plot', 'figures') else kept
    assert main([*verb, str(out)]) == 2
    assert capsys.readouterr().err == f'{out}: exists; --force replaces it\n'
    assert kept.read_text() == 'mine'
    assert [path.name for path in tmp_path.iterdir() if path.name != 'cache'] == ['mine.csv']


def test_force_replaces_what_exists_and_still_says_where_a_force_acts(tmp_path, capsys):
    out = tmp_path / 'frf.csv'
    frf = ['frf', PAPER, '--rpm', '0', '--hz', '1:2:2', '--force', 'disc_1_x', '-o', str(out)]
    assert main(frf) == 0
    first = out.read_text()
    out.write_text('old')
    assert main([*frf, '--force']) == 0
    assert out.read_text() == first


def test_plant_units_are_those_of_the_same_response(capsys):
    sweep = ['response', PAPER, '--rpm', '600:9000:3', '--units']
    assert main([*sweep, 'si']) == 0
    si, rows = table_of(capsys.readouterr().out)
    assert main([*sweep, 'plant']) == 0
    plant, values = table_of(capsys.readouterr().out)
    vector = complex_column(si, rows, 'disc_1_x')
    speed = rows[:, 0]

    def column(name):
        return values[:, plant.index(name)]

    np.testing.assert_allclose(column('speed_rpm'), [600.0, 4800.0, 9000.0])
    np.testing.assert_allclose(column('disc_1_x_um_pp'), 2e6 * np.abs(vector))
    np.testing.assert_allclose(column('disc_1_x_mm_s_rms'),
                               1e3 * speed * np.abs(vector) / math.sqrt(2.0))
    lag = np.exp(-1j * np.radians(column('disc_1_x_lag_deg')))
    np.testing.assert_allclose(lag * np.abs(vector), vector, atol=1e-12 * np.abs(vector).max())
    assert 'block_ry_urad_pp' in plant


@pytest.mark.parametrize('words, wanted', [
    ('rotorsoil ch', 'check'), ('rotorsoil response case.yaml --un', '--units'),
    ('rotorsoil response case.yaml --units pl', 'plant'), ('rotorsoil completion z', 'zsh')])
def test_bash_completes_verbs_options_and_choices(words, wanted, capsys, tmp_path):
    assert main(['completion', 'bash']) == 0
    script = tmp_path / 'completion.bash'
    script.write_text(capsys.readouterr().out + f"""
COMP_WORDS=({words})
COMP_CWORD=$(( ${{#COMP_WORDS[@]}} - 1 ))
_rotorsoil
echo "${{COMPREPLY[@]}}"
""")
    done = subprocess.run(['bash', str(script)], capture_output=True, text=True)
    assert done.stdout.split() == [wanted], done.stderr


def test_quiet_leaves_out_warnings_only(capsys):
    assert main(['campbell', PAPER, '--rpm', '60:900:2', '-q']) == 0
    quiet = capsys.readouterr().out
    assert main(['campbell', PAPER, '--rpm', '60:900:2', '-v']) == 0
    assert capsys.readouterr().out == quiet


def test_range_may_be_one_number(capsys):
    assert main(['response', PAPER, '--rpm', '2000']) == 0
    one = capsys.readouterr().out
    assert main(['response', PAPER, '--rpm', '2000:2000:1']) == 0
    assert capsys.readouterr().out == one
    assert len(one.splitlines()) == 2
