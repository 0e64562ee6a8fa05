"""Ground by a file: what its numbers mean, and what is refused."""

from pathlib import Path
import re

import numpy as np
import pytest

import rotorsoil_ros as rs
from rotorsoil_ros.case.config import load
from rotorsoil_ros.case.models import coupled_model, response_key
from rotorsoil_ros.case.stiffness_file import read
from rotorsoil_ros.channel import DOFS
from rotorsoil_ros.cli import main
from rotorsoil_ros.errors import InputError
from rotorsoil_ros.ground.cone import ConeModel

PAPER = Path(__file__).parents[2] / 'config' / 'paper_rotor.yaml'
ANY = (1.0, 2.0)
NO_CACHE = Path('no cache is needed for tables')
VERTICAL = 'hz,zz_re,zz_im\n0,2e8,1e7\n200,2e8,3e8\n'


def written(path, text):
    """Write a file and return its path."""
    path.write_text(text)
    return path


def csv_of(omega, stiffness, dofs=range(6)):
    """Return the text of a file with the diagonal of a stiffness (n, 6, 6)."""
    names = [f'{DOFS[dof]}{DOFS[dof]}' for dof in dofs]
    lines = [','.join(['omega_rad_s', *(f'{ij}_{part}' for ij in names
                                        for part in ('re', 'im'))])]
    for at, matrix in zip(omega, stiffness, strict=True):
        cells = [value for dof in dofs for value in (matrix[dof, dof].real, matrix[dof, dof].imag)]
        lines.append(','.join(map(repr, map(float, [at, *cells]))))
    return '\n'.join(lines) + '\n'


def test_dof_gives_way_by_the_reciprocal_of_its_stiffness(tmp_path):
    table = read(written(tmp_path / 's.csv', VERTICAL), ANY)
    np.testing.assert_allclose(table.omega, [0.0, 400.0 * np.pi])
    np.testing.assert_allclose(table.values[:, 2, 2], [1.0 / (2e8 + 1e7j), 1.0 / (2e8 + 3e8j)])


def test_dof_without_column_or_with_empty_cells_cannot_move(tmp_path):
    text = 'omega_rad_s,zz_re,zz_im,xx_re,xx_im\n1,2e8,0,,\n2,2e8,0,,\n'
    table = read(written(tmp_path / 's.csv', text), ANY)
    moving = np.argwhere(np.any(table.values != 0.0, axis=0))
    np.testing.assert_array_equal(moving, [[2, 2]])


def test_coupled_dofs_are_inverted_together_and_one_of_two_entries_is_enough(tmp_path):
    matrix = np.array([[1e8 + 1e7j, 3e7 + 1e6j], [3e7 + 1e6j, 5e7 + 1e7j]])
    row = '1e8,1e7,3e7,1e6,5e7,1e7'
    text = f'# SASSI\nomega_rad_s,xx_re,xx_im,xry_re,xry_im,ryry_re,ryry_im\n\n1,{row}\n9,{row}\n'
    values = read(written(tmp_path / 's.csv', text), ANY).values[0][np.ix_([0, 4], [0, 4])]
    np.testing.assert_allclose(values @ matrix, np.eye(2), atol=1e-14)


def test_case_on_its_own_cones_in_a_file_answers_as_on_cones(tmp_path):
    # Oracle: the same compliance by another road; splines are off by their spacing.
    cone_case = load(PAPER)
    omega = np.linspace(0.0, 1000.0, 401)
    compliance = ConeModel(cone_case.soil, cone_case.foundations[0].contact).compliance(omega)
    stiffness = np.zeros_like(compliance)
    for dof in range(6):
        stiffness[:, dof, dof] = 1.0 / compliance[:, dof, dof]
    file = written(tmp_path / 'stiffness.csv', csv_of(omega, stiffness))
    case = load(PAPER, ['soil=', f'support={{model: table, file: {file}}}'])
    assert case.soil is None
    speed = np.linspace(*case.speed_range, 50)
    on_file, on_cones = (
        coupled_model(one, NO_CACHE).unbalance_response(speed, one.unbalance).displacement
        for one in (case, cone_case))
    np.testing.assert_allclose(on_file, on_cones, rtol=1e-5, atol=1e-6 * np.abs(on_cones).max())
    assert response_key(case, coupled_model(case, NO_CACHE)) != response_key(
        cone_case, coupled_model(cone_case, NO_CACHE))


def test_path_is_relative_to_the_case_and_a_block_may_have_its_own(tmp_path):
    (tmp_path / 'case.yaml').write_text(PAPER.read_text())
    written(tmp_path / 'common.csv', VERTICAL)
    written(tmp_path / 'own.csv', VERTICAL.replace('2e8', '7e8'))
    on_common = ['soil=', 'support={model: table, file: common.csv}']
    for settings, stiffness in ((on_common, 2e8 + 1e7j),
                                ([*on_common, 'foundations.0.stiffness_file=own.csv'],
                                 7e8 + 1e7j)):
        [table] = load(tmp_path / 'case.yaml', settings).tables
        np.testing.assert_allclose(1.0 / table.values[0, 2, 2], stiffness)


def test_every_verb_answers_on_a_file_that_knows_no_rest(tmp_path, capsys):
    case = load(PAPER)
    omega = np.linspace(2.0 * np.pi, 1000.0, 40)
    compliance = ConeModel(case.soil, case.foundations[0].contact).compliance(omega)
    with np.errstate(divide='ignore', invalid='ignore'):
        file = written(tmp_path / 's.csv', csv_of(omega, 1.0 / compliance, [0, 2]))
    settings = ['--set', f'support={{model: table, file: {file}}}', '--cache', str(tmp_path / 'c')]
    for arguments in (['check'], ['tabulate'], ['campbell', '--rpm', '60:9000:3'],
                      ['campbell', '--criticals'], ['compliance', '--hz', '1:100:3'],
                      ['plot', '-o', str(tmp_path / 'plots')]):
        assert main([arguments[0], str(PAPER), *arguments[1:], *settings]) == 0, arguments
    said = capsys.readouterr().out
    # of the stiffness at the slowest speed, 1 Hz; 4 G r0 / (1 - nu) is 1.444e8 N/m at rest
    assert float(re.search(r'block: slowest stiffness z +(\S+) N/m', said)[1]) == pytest.approx(
        1.444e8, rel=0.01)


@pytest.mark.parametrize('text, problem', [
    ('', 'is empty'),
    ('hz;xx_re;xx_im\n1;2,0;3,0\n', 'line 1: cells must be separated by commas, and decimals'),
    ('hz,zz\n', "column 'zz' is not known; needed are omega_rad_s or hz, and xx_re"),
    ('hz,zz_re\n', 'column zz_im is missing; zz_re is there'),
    ('hz,hz,zz_re,zz_im\n', 'column hz stands here twice'),
    ('zz_re,zz_im\n1,1\n', 'needs one column omega_rad_s or hz'),
    ('hz,omega_rad_s,zz_re,zz_im\n', 'needs one column omega_rad_s or hz'),
    ('hz\n1\n200\n', 'needs the stiffness of one dof or more'),
    ('hz,zz_re,zz_im\n1,2,0\n', 'hz must be two or more rising frequencies >= 0, got [1.0]'),
    ('hz,zz_re,zz_im\n2,2,0\n1,2,0\n', 'hz must be two or more rising frequencies'),
    ('hz,zz_re,zz_im\n1,2\n', 'line 2: must have 3 cells, got 2'),
    ('hz,zz_re,zz_im\n1,2,x\n', "line 2: zz_im must be a finite number, got 'x'"),
    ('hz,zz_re,zz_im\n1,2,nan\n', "line 2: zz_im must be a finite number, got 'nan'"),
    ('hz,zz_re,zz_im\n,2,1\n', "line 2: hz must be a finite number, got ''"),
    ('hz,zz_re,zz_im\n0,2,1\n200,,\n', 'zz must be given at all frequencies or at none'),
    ('hz,zz_re,zz_im,xry_re,xry_im\n0,2,1,1,0\n200,2,1,1,0\n',
     'xry needs xx, which is missing'),
    ('hz,xx_re,xx_im,zz_re,zz_im,xz_re,xz_im,zx_re,zx_im\n'
     '0,2,1,2,1,.5,0,.6,0\n200,2,1,2,1,.5,0,.5,0\n',
     'must be symmetric, got 0.5+0j for xz and 0.6+0j for zx at 0 rad/s'),
    ('hz,zz_re,zz_im\n0,2,0\n200,2,-1\n',
     'must not give energy (imaginary part positive semidefinite), got an eigenvalue of -0.44'),
    ('hz,zz_re,zz_im\n0,2,0\n200,0,0\n',
     'the stiffness of a dof that has columns must not be zero'),
    ('hz,zz_re,zz_im\n2,2e8,0\n200,2e8,0\n', 'must cover speed_range_rpm, 1 to 150 Hz, got 2'),
    ('hz,zz_re,zz_im\n0,2e8,0\n149,2e8,0\n', 'must cover speed_range_rpm, 1 to 150 Hz, got 0'),
])
def test_fault_is_told_in_one_line_with_file_and_place(tmp_path, text, problem):
    file = written(tmp_path / 's.csv', text)
    with pytest.raises(InputError) as caught:
        load(PAPER, [f'support={{model: table, file: {file}}}'])
    said = str(caught.value)
    assert said.startswith(f'{file}: {problem}')
    assert '\n' not in said


def test_all_damaged_cells_are_told_at_once(tmp_path):
    file = written(tmp_path / 's.csv', 'hz,zz_re,zz_im\n1,x,2\n2,1\n3,1,y\n')
    with pytest.raises(InputError) as caught:
        read(file, ANY)
    assert str(caught.value).splitlines() == [
        f"{file}: line 2: zz_re must be a finite number, got 'x'",
        f'{file}: line 3: must have 3 cells, got 2',
        f"{file}: line 4: zz_im must be a finite number, got 'y'"]


def test_jump_that_would_give_energy_between_rows_is_refused_with_its_place(tmp_path):
    # Each row loses energy; the smooth curve through them does not.
    rows = '\n'.join(f'{hz},2e8,{loss}' for hz, loss in ((0, 2e6), (75, 2e6), (150, 1e8)))
    with pytest.raises(InputError) as caught:
        read(written(tmp_path / 's.csv', f'hz,zz_re,zz_im\n{rows}\n'), ANY)
    assert str(caught.value) == (
        f'{tmp_path / "s.csv"}: changes too abruptly for a smooth curve through its 3 '
        'frequencies: between 0 and 75 Hz the ground would give energy; add frequencies there, '
        'or mend the jump')


def test_modes_that_a_file_leaves_open_are_a_warning_and_name_the_key(tmp_path, capsys):
    rows = '\n'.join(f'{hz},{k},{0.1 * k}' for hz, k in zip(
        np.linspace(1.0, 150.0, 10), 6e7 * (1.0 + 0.5 * (-1.0) ** np.arange(10)), strict=True))
    file = written(tmp_path / 's.csv', f'hz,xx_re,xx_im\n{rows}\n')
    case = ['--set', f'support={{model: table, file: {file}}}', '--cache', str(tmp_path / 'c'),
            '--set', 'foundations.0.mass=900']
    reason = 'support.file: '
    advice = 'give it at more frequencies, or without jumps (the response needs no modes)\n'
    assert main(['check', str(PAPER), *case]) == 0
    said = capsys.readouterr().out
    assert re.search(r'^critical speeds +not known, see the warning$', said, re.MULTILINE)
    assert f'warning: {reason}' in said
    assert advice in said
    assert main(['campbell', str(PAPER), '--criticals', *case]) == 2
    [line] = capsys.readouterr().err.splitlines(keepends=True)
    assert line.startswith(f'{PAPER}: {reason}')
    assert line.endswith(advice)
    assert main(['response', str(PAPER), '--rpm', '60:9000:30', *case]) == 0
    assert 'nan' not in capsys.readouterr().out


@pytest.mark.parametrize('setting, problem', [
    ('support={model: table}', 'support.file: is missing; the support model table needs it'),
    ('support={model: table, file: 3}', 'support.file: must be the path of a file, got 3'),
    ('support={model: cone, file: a.csv}',
     'support.file: belongs to the support model table or receptance, got cone'),
    ('foundations.0.stiffness_file=a.csv',
     'foundations.0.stiffness_file: belongs to the support model table, got cone'),
    ('support={model: table, file: a.csv, geometry: plane_strain}',
     'support.geometry: must be disc for the model table, got plane_strain'),
])
def test_fault_of_a_key_is_told_in_one_line(setting, problem):
    with pytest.raises(InputError) as caught:
        load(PAPER, [setting])
    assert str(caught.value).splitlines()[0] == f'{PAPER}: {problem}'


def test_file_that_is_not_there_is_told_in_one_line():
    with pytest.raises(InputError) as caught:
        load(PAPER, ['support={model: table, file: nothing.csv}'])
    assert str(caught.value) == (f'{PAPER.parent / "nothing.csv"}: cannot be read: '
                                 'No such file or directory')


def test_file_of_bytes_is_told_in_one_line(tmp_path):
    (tmp_path / 's.csv').write_bytes(b'hz,\xff')
    with pytest.raises(InputError, match=r'is not a text file in UTF-8 \(byte 3\)$'):
        read(tmp_path / 's.csv', ANY)


LOSSLESS = Path(__file__).parents[1] / 'cases' / 'layer_on_rock_lossless' / 'case.yaml'


def test_layer_without_loss_is_cut_where_its_waves_begin():
    [table] = load(LOSSLESS).tables
    np.testing.assert_allclose(table.singular / (2.0 * np.pi), [7.5, 15.0])
    between = np.linspace(0.5, 60.0, 1777) * 2.0 * np.pi
    loss = np.linalg.eigvalsh(-table.compliance(between).imag)
    assert loss.min() >= -1e-3 * np.abs(table.values).max()


def test_modes_of_a_layer_without_loss_are_told(cache):
    found = rs.load(LOSSLESS, cache_directory=cache).critical_speeds()
    # The shaft on its block, far above both cut-offs, and light because little is radiated by it.
    assert [one.speed_rpm for one in found if one.damping_ratio < 0.1] == pytest.approx(
        [1482.0, 1573.0], rel=2e-3)


def test_named_cut_offs_of_a_layer_with_loss_give_its_modes(cache):
    keys = {'support.file': 'control_4_percent.csv', 'support.cut_offs_hz': [7.5, 15.0]}
    machine = rs.load(LOSSLESS, cache_directory=cache, **keys)
    np.testing.assert_allclose(machine.case.tables[0].singular / (2.0 * np.pi), [7.5, 15.0])
    light = [one.speed_rpm for one in machine.critical_speeds() if one.damping_ratio < 0.1]
    assert light == pytest.approx([1482.0, 1573.0], rel=5e-3)


@pytest.mark.parametrize('places', [[0.5], [7.5, 8.0], [400.0]])
def test_cut_offs_without_room_for_a_curve_are_refused(places):
    with pytest.raises(InputError, match=r'layer0\.csv: cut_offs_hz must leave 4 rows'):
        load(LOSSLESS, [f'support.cut_offs_hz={places}'])
