"""
Rotors saved by ROSS: brought over whole, or with what is lost said.

The files in `ross/` were saved by `Rotor.save` of ROSS 2.3.0. `hollow.toml`: solid, hollow and
tapered elements of two materials, two discs, one of them overhung, a cross-coupled bearing with
tables over speed. `extras.toml`: a bearing on a pedestal with a point mass, a seal. The numbers
that they are held against are those of the same ROSS: `run_modal`, `run_unbalance_response` with
1e-4 kg m on the first disc, and criticals as roots of its `run_modal` by brentq.
"""

from pathlib import Path

import numpy as np
import pytest

from rotorsoil_ros.case import models
from rotorsoil_ros.case.config import load
from rotorsoil_ros.case.ross import read
from rotorsoil_ros.cli import main
from rotorsoil_ros.errors import InputError
from rotorsoil_ros.machine.modes.campbell import campbell
from rotorsoil_ros.machine.modes.critical import critical_speeds

from oracles.published import ross_criticals, ross_figures, ROSS_FILES, ross_response

CASES = Path(__file__).parents[1] / 'cases'
NO_CACHE = Path('no cache is needed on a rigid support')


@pytest.fixture(scope='module')
def imported(tmp_path_factory):
    """Return the models of both files, brought over by the command."""
    folder = tmp_path_factory.mktemp('imported')
    for name in ('hollow', 'extras'):
        assert main(['import-ross', str(ROSS_FILES / f'{name}.toml'), '-o',
                     str(folder / f'{name}.yaml')]) == 0
    return {name: models.coupled_model(load(folder / f'{name}.yaml'), NO_CACHE)
            for name in ('hollow', 'extras')}


@pytest.mark.parametrize('name', ['hollow', 'extras'])
def test_modes_are_those_of_ross(imported, name):
    speed, expected, _ = ross_figures(name)
    found = campbell(imported[name], np.array([speed]), 4).eigenvalue[0]
    np.testing.assert_allclose(found.real + 1j * np.abs(found.imag), expected, rtol=1e-9)


def test_criticals_are_those_of_ross(imported):
    found = [one.speed for one in critical_speeds(imported['hollow'], (10.0, 1000.0))]
    np.testing.assert_allclose(found, ross_criticals(), rtol=1e-9)


@pytest.mark.parametrize('name, disc', [
    ('hollow', 'wheel'), ('hollow', 'overhung_fan'), ('extras', 'disk_0')])
def test_response_is_that_of_ross(imported, name, disc):
    _, _, responses = ross_figures(name)
    # only with the right signs of cross terms and axes: they reach the small quadrature parts
    np.testing.assert_allclose(ross_response(imported[name], disc), responses[disc], rtol=1e-8)


def test_equal_elements_become_one_section_and_keep_the_mesh(imported):
    rotor = imported['hollow'].rotor
    assert [section.elements for section in rotor.shaft] == [2, 4, 1, 2]
    assert len(rotor.node_positions) == 10


def test_bearing_below_a_bearing_is_its_pedestal(imported):
    [carried, seal, plain] = imported['extras'].rotor.bearings
    np.testing.assert_array_equal(carried.pedestal.mass, np.diag([4.0, 4.0]))
    np.testing.assert_array_equal(carried.pedestal.stiffness, np.diag([5e7, 6e7]))
    assert (seal.name, plain.pedestal) == ('seal_3', None)


def changed(tmp_path, *changes):
    """Return a copy of extras.toml with some text replaced."""
    text = (ROSS_FILES / 'extras.toml').read_text()
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    (tmp_path / 'changed.toml').write_text(text)
    return tmp_path / 'changed.toml'


@pytest.mark.parametrize('old, new, lost', [
    ('gyroscopic = true', 'gyroscopic = false', 'gyroscopic = false; our shaft always has them'),
    ('"cowper"', '"hutchinson"', "shear_method_calc = 'hutchinson'; ours is cowper"),
    ('[parameters]\n', '[parameters]\nmodal_damping_ratio = [ 0.01,]\n',
     'parameters: modal_damping_ratio = [0.01]'),
    ('[parameters]\n', '["ShaftElement_sleeve"]\nL = 0.2\nidl = 0.05\nodl = 0.07\nn = 2\n'
     'torque = 7.0\nmaterial = {rho = 7810.0, E = 2e11, G_s = 8e10}\n',
     'torque of a second layer, 7'),
    ('kzz = [ 0,]', 'kzz = [ 7.0,]', 'kzz = [7.0]'),
    ('mzz = [ 0,]', 'mzz = [ 7.0,]', 'mzz = [7.0]'),
    ('[parameters]\n', '[Strange_thing]\nn = 3\n', 'Strange_thing: is not known here'),
    ('n_link = 7\n', 'n_link = 9\n', 'n_link = 9, where nothing stands'),
    ('[parameters]\n', '["ShaftElement_sleeve"]\nL = 0.2\nidl = 0.05\nodl = 0.07\nn = 2\n'
     'material = {rho = 7810.0, E = 2e11, G_s = 8e10}\n',
     'stiffness and rotary inertia of a second layer'),
    ('BearingElement_Bearing 1', 'TiltingPad_Bearing 1',
     'its geometry; its coefficients are kept'),
    ('["DiskElement_Disk 0"]', '["GearElement_Disk 0"]', 'its mesh; mass and inertia are kept'),
])
def test_what_cannot_be_carried_over_is_said_twice(tmp_path, capsys, old, new, lost):
    case = tmp_path / 'case.yaml'
    assert main(['import-ross', str(changed(tmp_path, (old, new))), '-o', str(case)]) == 0
    said = [line for line in capsys.readouterr().err.splitlines()
            if line.startswith('not carried over: ') and lost in line]
    assert len(said) == 1
    assert said[0].removeprefix('not carried over: ') in case.read_text()
    load(case)


def test_nothing_lost_is_said_too(tmp_path, capsys):
    assert main([
        'import-ross', str(ROSS_FILES / 'hollow.toml'), '-o', str(tmp_path / 'c.yaml')]) == 0
    assert 'not carried over: nothing\n' in capsys.readouterr().err


def test_second_layer_of_a_shaft_is_kept_as_mass(tmp_path):
    path = changed(tmp_path, (
        '[parameters]\n', '["ShaftElement_sleeve"]\nL = 0.2\nidl = 0.05\nodl = 0.07\nn = 2\n'
        'material = {rho = 7810.0, E = 2e11, G_s = 8e10}\n'))
    shaft = read(path).content['rotor']['shaft']
    assert [section['elements'] for section in shaft] == [2, 1, 3]
    assert shaft[1]['added_mass'] == pytest.approx(7810.0 * np.pi / 4.0 * (0.07**2 - 0.05**2))


def test_speed_range_may_be_chosen(tmp_path):
    assert main(['import-ross', str(ROSS_FILES / 'hollow.toml'), '-o', str(tmp_path / 'c.yaml'),
                 '--rpm', '600:9000:2']) == 0
    np.testing.assert_allclose(load(tmp_path / 'c.yaml').speed_range,
                               [20.0 * np.pi, 300.0 * np.pi])


@pytest.mark.parametrize('old, new, problem', [
    ('L = 0.2\n', '', 'ShaftElement_Shaft Element 0.L: is missing'),
    ('L = 0.2\n', 'L = "x"\n',
     "ShaftElement_Shaft Element 0.L: must be a finite number, got 'x'"),
    ('L = 0.2\n', 'L = nan\n', 'ShaftElement_Shaft Element 0.L: must be a finite number, got nan'),
    ('L = 0.2\n', 'L = -0.2\n', 'rotor.shaft.0.length: must be > 0 m and finite, got -0.2'),
    ('n = 1\n', 'n = 0\n', 'holds 2 shafts, over the nodes 0 to 1 and 2 to 6, with no '
                           'ShaftElement between; a case has one'),
    ('n = 3\nm = 20.0', 'n = 33\nm = 20.0',
     'DiskElement_Disk 0.n: must be a node of the shaft, 0 to 6, got 33'),
    ('n = 0\n', 'n = -1\n', 'ShaftElement_Shaft Element 0.n: must be the number of a node'),
    ('kxx = [ 10000000.0,]', 'kxx = [ 1.0, 2.0,]',
     'BearingElement_Bearing 0.frequency: is missing, in rad/s'),
    ('kxx = [ 10000000.0,]', 'kxx = [ true,]',
     'BearingElement_Bearing 0.kxx: must be finite numbers in N/m, got True'),
    ('E = 211000000000.0', 'E = 0.0',
     'ShaftElement_Shaft Element 0.material.E: must be > 0 Pa, got 0'),
    ('[parameters]', '[parameters', 'is not TOML: '),
])
def test_bad_file_is_one_line_and_status_2(tmp_path, capsys, old, new, problem):
    path = changed(tmp_path, (old, new))
    assert main(['import-ross', str(path), '-o', str(tmp_path / 'case.yaml')]) == 2
    said = capsys.readouterr().err
    assert said.startswith(f'{path}: {problem}')
    assert said.count('\n') == 1
    assert not (tmp_path / 'case.yaml').exists()


def test_all_numbers_that_are_none_are_told_at_once(tmp_path, capsys):
    path = changed(tmp_path, ('L = 0.2\n', 'L = "x"\n'), ('E = 211000000000.0', 'E = 0.0'),
                   ('m = 20.0', 'm = nan'), ('kxx = [ 10000000.0,]', 'kxx = [ true,]'))
    assert main(['import-ross', str(path), '-o', str(tmp_path / 'case.yaml')]) == 2
    told = capsys.readouterr().err.splitlines()
    for line in ("ShaftElement_Shaft Element 0.L: must be a finite number, got 'x'",
                 'ShaftElement_Shaft Element 0.material.E: must be > 0 Pa, got 0',
                 'DiskElement_Disk 0.m: must be a finite number, got nan',
                 'BearingElement_Bearing 0.kxx: must be finite numbers in N/m, got True'):
        assert told.count(f'{path}: {line}') == 1
    assert len(told) == 4


@pytest.mark.parametrize('content, problem', [
    (b'', 'holds no ShaftElement; is it a rotor saved by ROSS?'),
    (b'a = 3\n', 'holds no ShaftElement'), (b'\xff', 'is not a text file in UTF-8 (byte 0)'),
    (b'"ShaftElement_a" = 3\n', 'holds no ShaftElement')])
def test_other_file_is_told_in_one_line(tmp_path, content, problem):
    (tmp_path / 'x.toml').write_bytes(content)
    with pytest.raises(InputError) as caught:
        read(tmp_path / 'x.toml')
    assert str(caught.value).startswith(f'{tmp_path / "x.toml"}: {problem}')


def test_missing_file_is_told_in_one_line():
    with pytest.raises(InputError, match=r'^nothing\.toml: cannot be read: No such file'):
        read(Path('nothing.toml'))


def imported_case(source, tmp_path):
    """Bring a file over by the command and return its model."""
    target = tmp_path / f'{source.stem}.yaml'
    assert main(['import-ross', str(source), '-o', str(target)]) == 0
    return models.coupled_model(load(target), NO_CACHE)


# `run_modal` of ROSS 3.0.0 at 400 rad/s: damped frequencies [rad/s].
SPEED_TABLE = [310.5131, 370.5517, 423.0098, 434.7884, 2356.6385, 2713.5835]


@pytest.mark.parametrize('name', ['rotor', 'control_frequency'])
def test_table_over_the_speed_of_ross_3_gives_its_modes(name, tmp_path):
    model = imported_case(CASES / 'ross3_speed_table' / f'{name}.toml', tmp_path)
    found = np.sort(campbell(model, np.array([400.0]), 6).omega[0])
    np.testing.assert_allclose(found, SPEED_TABLE, rtol=2e-7)  # printed digits


def test_frequency_of_a_vibration_is_not_silently_taken_for_the_speed(tmp_path, capsys):
    folder = CASES / 'ross3_speed_table'
    imported_case(folder / 'rotor.toml', tmp_path)
    assert 'not carried over: nothing' in capsys.readouterr().err
    imported_case(folder / 'control_frequency.toml', tmp_path)
    assert 'BearingElement_DE: its table is over the frequency of the vibration' in (
        capsys.readouterr().err)


@pytest.mark.parametrize('name, problem', [
    ('coupling', 'CouplingElement_cpl: is a coupling; a case has one shaft'),
    ('coaxial', 'holds 2 shafts, over the nodes 0 to 10 and 11 to 17')])
def test_what_a_case_cannot_hold_is_refused_by_its_cause(name, problem, tmp_path, capsys):
    source = CASES / 'ross_coupling_coaxial_2d' / f'{name}.toml'
    assert main(['import-ross', str(source), '-o', str(tmp_path / 'case.yaml')]) == 2
    assert capsys.readouterr().err.startswith(f'{source}: {problem}')
    assert not (tmp_path / 'case.yaml').exists()


@pytest.mark.parametrize('name', ['loaded', 'damped', 'grid'])
def test_loads_damping_and_seals_are_those_of_ross_3(name, tmp_path, capsys):
    # Axial force, torque, alpha and beta of elements and of the rotor, seals with mass, tables
    # over speed and frequency, by ROSS 3.1.0.
    model = imported_case(ROSS_FILES / f'{name}.toml', tmp_path)
    assert 'not carried over: nothing' in capsys.readouterr().err
    speed, expected, responses = ross_figures(name)
    if name != 'grid':  # ROSS has all modes at the frequency of the speed
        found = campbell(model, np.array([speed]), 6).eigenvalue[0]
        np.testing.assert_allclose(found.real + 1j * np.abs(found.imag), expected, rtol=1e-9)
    for disc, response in responses.items():
        scale = np.abs(response).max(axis=1, keepdims=True)
        # Between points of the table ours is straight, theirs a curve.
        np.testing.assert_allclose(ross_response(model, disc) / scale, response / scale,
                                   atol=2e-4 if name == 'grid' else 1e-9)


def test_modes_of_a_seal_over_speed_and_frequency_are_matched_to_their_whirl(tmp_path):
    # `run_modal(500, matched_whirl=True)` of ROSS 3.1.0 takes coefficients at Re w, ours go on to
    # w itself: 1e-3 of lightly damped ones. Its own 992 rad/s is torsion.
    model = imported_case(ROSS_FILES / 'grid.toml', tmp_path)
    found = campbell(model, np.array([500.0]), 6).eigenvalue[0]
    expected = [-21.8411433 + 279.33817866j, -7.13233718 + 299.61469906j,
                -17.4916170 + 493.80223895j, -11.2023072 + 520.16347193j,
                -59.6208091 + 1198.88838506j, -51.1495447 + 1322.55585953j]
    np.testing.assert_allclose(found.real + 1j * np.abs(found.imag), expected, rtol=1e-3)


def test_table_over_a_frequency_that_changes_nothing_is_one_over_the_speed(tmp_path):
    seal = imported_case(CASES / 'ross_coupling_coaxial_2d' / 'two_axes.toml',
                         tmp_path).rotor.bearings[1]
    assert (seal.name, len(seal.frequencies)) == ('lab', 0)
    stiffness, damping, _ = seal.coefficients(np.array([200.0]), np.array([7.0]))
    np.testing.assert_allclose(stiffness[0], [[2e5, -2e5], [2e5, 2e5]])
    np.testing.assert_allclose(damping[0], 200.0 * np.eye(2))


def test_damping_of_elements_counts_for_nothing_beside_that_of_the_rotor(tmp_path, capsys):
    text = (ROSS_FILES / 'damped.toml').read_text()
    assert '\nbeta = 0.0\n' in text
    (tmp_path / 'both.toml').write_text(text.replace('\nbeta = 0.0\n', '\nbeta = 1e-5\n', 1))
    model = imported_case(tmp_path / 'both.toml', tmp_path)
    assert {one.damping.fixed_stiffness for one in model.rotor.shaft} == {1.2e-5}
    assert 'alpha and beta of shaft elements' in capsys.readouterr().err


@pytest.mark.parametrize('old, new, problem', [
    ('speed = [ 0.0, 300.0, 600.0, 1200.0,]\ntag = "seal"', 'tag = "seal"',
     'SealElement_seal.speed: is missing, in rad/s; kxx is a table over speed and frequency'),
    ('frequency = [ 0.0, 150.0, 400.0, 800.0, 1500.0,]', 'frequency = [ 0.0, 150.0,]',
     'SealElement_seal.kxx: must have a row for each of 4 speeds with 2 frequencies')])
def test_bad_table_over_two_axes_is_one_line(tmp_path, capsys, old, new, problem):
    text = (ROSS_FILES / 'grid.toml').read_text()
    assert old in text
    (tmp_path / 'bad.toml').write_text(text.replace(old, new))
    assert main(['import-ross', str(tmp_path / 'bad.toml'), '-o', str(tmp_path / 'c.yaml')]) == 2
    said = capsys.readouterr().err
    assert said.startswith(f'{tmp_path / "bad.toml"}: {problem}')
    assert said.count('\n') == 1


def test_two_geared_shafts_are_told_with_their_gears(tmp_path):
    text = (CASES / 'ross_coupling_coaxial_2d' / 'coaxial.toml').read_text()
    (tmp_path / 'geared.toml').write_text(text.replace('DiskElement_Disk 0', 'GearElement_g1'))
    with pytest.raises(InputError, match='with the gears GearElement_g1; a case has one'):
        read(tmp_path / 'geared.toml')


def test_longer_sleeve_has_the_mass_that_ross_gives_it(tmp_path):
    model = imported_case(CASES / 'ross_sleeve_longer' / 'rotor.toml', tmp_path)
    assert model.rotor.mass == pytest.approx(39.1134, abs=5e-5)  # ROSS, Rotor.m


# Damped frequencies of `run_modal` of ROSS 2.3.0 at 400 rad/s [rad/s].
LAYERED = [518.1929510764, 541.4812829547, 2118.8623166628, 2411.6153556476, 4537.2525119490,
           5192.2521536891]
ONE_SECTION = [518.2715669794, 541.5716316471, 2119.0168194467, 2412.0224829673,
               4540.4350149538, 5197.0207965414]


@pytest.mark.parametrize('kind', ['toml', 'json'])
def test_touching_layer_of_one_material_is_a_section(kind, tmp_path, capsys):
    model = imported_case(ROSS_FILES / f'sleeve.{kind}', tmp_path)
    said = capsys.readouterr().err
    assert 'ShaftElement_Shaft Element 8: touches the shaft below it' in said
    assert 'not carried over: nothing' in said
    assert [section.outer_diameter[0] for section in model.rotor.shaft] == [0.05, 0.09, 0.05]
    found = np.sort(campbell(model, np.array([400.0]), 6).omega[0])
    np.testing.assert_allclose(found, ONE_SECTION, rtol=1e-9)
    # ROSS shears both layers apart, each with a coefficient of its own.
    np.testing.assert_allclose(found, LAYERED, rtol=1e-3)


@pytest.mark.parametrize('old, new', [
    ('idl = 0.05\n', 'idl = 0.06\n'), ('odl = 0.09\nidr = 0.05\n', 'odl = 0.09\nidr = 0.06\n')])
def test_layer_that_does_not_touch_stiffens_nothing(old, new, tmp_path, capsys):
    text = (ROSS_FILES / 'sleeve.toml').read_text()
    assert old in text
    (tmp_path / 'loose.toml').write_text(text.replace(old, new, 1))
    imported_case(tmp_path / 'loose.toml', tmp_path)
    assert 'Element 8: stiffness and rotary inertia of a second layer' in capsys.readouterr().err


def test_damping_of_masses_below_the_bearings_is_told(tmp_path, capsys):
    imported_case(changed(tmp_path, ('[parameters]\n', '[parameters]\nalpha = 2.5\n')), tmp_path)
    assert ('not carried over: parameters: alpha = 2.5 of what stands below the bearings; of the '
            'rotor it is kept\n') in capsys.readouterr().err


@pytest.mark.parametrize('content, problem', [
    ('[1]', 'must hold elements by their names, got [1]'), ('{', 'is not JSON: Expecting'),
    ('{"_note": "x"}', 'holds no ShaftElement')])
def test_bad_json_is_told_in_one_line(content, problem, tmp_path):
    (tmp_path / 'x.json').write_text(content)
    with pytest.raises(InputError) as caught:
        read(tmp_path / 'x.json')
    assert str(caught.value).startswith(f'{tmp_path / "x.json"}: {problem}')
