"""Foundations that bend in a case file: read, answered, and refused with one line each."""

import csv
from pathlib import Path

from flexible_cases import DOFS, loaded
from foundations import off, published, raft_body, raft_support
import numpy as np
import pytest

from rotorsoil_ros.case.summary import derived_quantities
from rotorsoil_ros.cli import main
from rotorsoil_ros.errors import InputError
from rotorsoil_ros.units import rad_s_to_hz


@pytest.mark.parametrize('name, file, worst', [
    ('frame', 'frame_frf.csv', 0.039), ('fan', 'raft_frf.csv', 2.4e-3)])
def test_seats_of_a_case_are_those_of_the_full_model(folder, name, file, worst):
    machine = loaded(folder, name)
    support = machine.model.support
    # Of the seats of one fan alone, which are less of the norm, the raft is off by 2.3e-3.
    omega, exact = published(file, raft_support(raft_body()) if name == 'fan' else support)
    count = 2 * len(support.bearings)
    found = machine.seat_receptance(hz=rad_s_to_hz(omega))
    assert off(found, exact[:, :count, :count]).max() < worst


def test_seats_verb_writes_what_the_machine_says(folder, capsys):
    main(['seats', str(folder / 'fan.yaml'), '--hz', '5:25:3', '-o', '-', '--cache',
          str(folder / 'cache')])
    rows = list(csv.reader(capsys.readouterr().out.splitlines()))
    assert rows[0][:3] == ['omega_rad_s', 'fan_1_b1_x__fan_1_b1_x_re',
                           'fan_1_b1_x__fan_1_b1_x_im']
    assert rows[0][3] == 'fan_1_b1_x__fan_1_b1_z_re'
    found = np.array(rows[1:], dtype=float)
    exact = loaded(folder).seat_receptance(hz=[5.0, 15.0, 25.0]).reshape(3, -1)
    np.testing.assert_allclose(found[:, 1::2] + 1j * found[:, 2::2], exact, rtol=1e-12)


def test_channels_are_called_after_the_table_of_motions(folder):
    model = loaded(folder).model
    assert {'raft_x', 'raft_ry', 'patch_1_x', 'patch_12_z'} <= set(model.channels)
    assert model.transmits_force[model.channels.index('patch_12_z')]
    run = loaded(folder).response(rpm=[600.0, 1480.0])
    whole = run['raft_z'].force
    parts = run[tuple(f'patch_{number}_z' for number in range(1, 13))].force
    np.testing.assert_allclose(parts.sum(axis=1), whole[:, 0], rtol=1e-9)


def test_check_tells_mass_modes_and_ground(folder):
    machine = loaded(folder, 'frame')
    told = dict(derived_quantities(machine.case, machine.model.soil_models))
    assert told['frame: mass and centre of gravity'].startswith('1023840 kg at x')
    assert 'y 7.5, z 2.962 m' in told['frame: mass and centre of gravity']
    assert told['frame: bends'].startswith('7.928, 9.848, 11.69')


def test_a_body_out_of_a_log_needs_no_file(folder, tmp_path):
    machine = loaded(folder)
    from rotorsoil_ros.case.config import case_of

    again = case_of(tmp_path / 'gone.yaml', dict(machine.case.content),
                    files=machine.case.files, cache_directory=tmp_path / 'cache')
    assert again.foundations[0].body == machine.case.foundations[0].body


def test_foundation_of_machines_with_other_speeds_comes_out_of_a_log(folder, tmp_path):
    """Each asks for modes up to its own speed; the document has them all."""
    from rotorsoil_ros.case.config import case_of

    machine = loaded(folder, 'fans', 'machines.1.speed_range_rpm=[300, 1600]')
    again = case_of(tmp_path / 'gone.yaml', dict(machine.case.content),
                    files=machine.case.files, cache_directory=tmp_path / 'cache')
    assert again.foundations[0].body == machine.case.foundations[0].body


def test_verbs_say_beyond_which_frequency_modes_are_too_few(folder, capsys):
    for top, said in ((140, False), (150, True)):
        main(['seats', str(folder / 'fan.yaml'), '--hz', f'5:{top}:2', '-o', '-', '--cache',
              str(folder / 'cache')])
        assert ('known by modes up to 292.9 Hz, which is good to 146.5 Hz'
                in capsys.readouterr().err) is said


@pytest.mark.parametrize('name, settings, said', [
    ('fan', ['foundations.0.flexible.residual=null'],
     'foundations.0.flexible.residual: is missing; without the residual flexibility 60 modes'),
    ('fan', ['foundations.0.flexible.stiffness=frame_K.mtx'],
     'foundations.0.flexible: needs either stiffness, mass and dofs, or modes, residual and '
     'rigid, got both'),
    ('fan', ['foundations.0.flexible.loss_factor=null'],
     'foundations.0.flexible: needs either loss_factor or damping_ratios, got neither'),
    ('fan', ['foundations.0.flexible={loss_factor: 0.04}'],
     'foundations.0.flexible: needs either stiffness, mass and dofs, or modes, residual and '
     'rigid, got neither'),
    ('fan', ['speed_range_rpm=[100, 9000]'],
     'foundations.0.flexible.modes: must reach 2 times the highest 1X frequency, 300 Hz, got '
     '292.9 Hz'),
    ('fan', ['foundations.0.soil_under=null'],
     'foundations.0.soil_under: is missing: winkler, green or each, below 12 contacts'),
    ('fan', ['foundations.0.soil_under=green'],
     'foundations.0.soil_under: must be winkler or each where the ground is no homogeneous'),
    ('fan', ['rotor.bearings.0.seat=nowhere'],
     'rotor.bearings.0.seat: must be one that moves along x, fan_1_b1, fan_1_b2, fan_2_b1, '
     'fan_2_b2, got nowhere'),
    ('fan', ['rotor.shaft_height=2.1'],
     'rotor.bearings.0.seat: must be on the shaft within 0.02 m, got 0 m across, 0 m along and '
     '0.1 m up from fan_1_b1 to the bearing'),
    ('fan', ['rotor.bearings.1.position=1.35'], 'rotor.bearings.0.seat: must be on the shaft'),
    ('fans', ['machines.1.place.x=2.9'], 'machines.1.rotor.bearings.0.seat: must be on the shaft '
     'within 0.02 m, got -0.1 m across, 0 m along and 0 m up from fan_2_b1 to the bearing'),
    ('fans', ['machines.1.rotor.bearings.0.seat=nowhere'],
     'machines.1.rotor.bearings.0.seat: must be one that moves along x, fan_1_b1'),
    ('fan', ['foundations.0.mass=1000'],
     'foundations.0.mass: belongs to a rigid block; flexible brings its own'),
    ('fan', ['foundations.0.young_modulus=30e9'],
     'foundations.0.young_modulus: belongs to a rigid block; flexible brings its own'),
    ('fan', ['foundations.0.half_width=0', 'foundations.0.half_length=2'],
     'foundations.0.half_width: must be > 0 m and finite, got 0'),
    ('fan', ['foundations.0.height=-1'],
     'foundations.0.height: must be > 0 m and finite, got -1'),
    ('fan', ['foundations.0.flexible.modes=raft_rigid.csv'],
     'raft_rigid.csv: must begin with the header dof,mode_1'),
    ('frame', ['foundations.0.flexible.keep_up_to=1.5'],
     'foundations.0.flexible.keep_up_to: must be >= 2 times the highest 1X frequency, got 1.5'),
    ('frame', ['foundations.0.flexible.stiffness=frame.op4'],
     'frame.op4: is an op4 of Nastran, which is not read here; read it with pyNastran'),
    ('frame', ['foundations.0.flexible.mass=frame.full'],
     'frame.full: is of ANSYS, which is not read here; HBMAT is not readable by scipy'),
    ('frame', ['foundations.0.flexible.stiffness=abaqus.mtx'],
     'abaqus.mtx: is a substructure of Abaqus or CalculiX, no Matrix Market'),
    ('frame', ['foundations.0.flexible.stiffness=cut.mtx'],
     'cut.mtx: is no whole Matrix Market file'),
    ('frame', ['foundations.0.flexible.stiffness=grounded.mtx'],
     'foundations.0.flexible.stiffness: must be that of a body that nothing holds'),
    ('frame', ['foundations.0.flexible.stiffness=skew.mtx'],
     'foundations.0.flexible.stiffness: must be symmetric within 1e-08'),
    ('frame', ['foundations.0.flexible.dofs=kinds.csv'],
     'kinds.csv: line 2: kind must be one of seat, contact, probe, internal'),
    ('frame', ['foundations.0.flexible.dofs=missing.csv'], 'missing.csv: cannot be read'),
    ('frame', ['foundations.0.flexible.dofs=one.csv'],
     'foundations.0.flexible: stands on one contact and bends at'),
    ('frame', ['foundations.0.flexible.dofs=three.csv'],
     'foundations.0.flexible.dofs: must have contacts that hold all six rigid motions, got 3'),
])
def test_bad_input_is_told_in_one_line(folder, name, settings, said):
    damaged(folder)
    with pytest.raises(InputError) as error:
        loaded(folder, name, *settings)
    told = str(error.value).splitlines()
    assert any(said in line for line in told), told
    assert len(told) == 1


def damaged(folder: Path) -> None:
    """Leave files that are not what they should be in a folder."""
    if (folder / 'one.csv').exists():
        return
    stiffness = (folder / 'frame_K.mtx').read_text()
    lines = stiffness.splitlines()
    (folder / 'abaqus.mtx').write_text('** substructure\n*USER ELEMENT, NODES=4\n')
    (folder / 'cut.mtx').write_text('\n'.join(lines[:50]))
    (folder / 'grounded.mtx').write_text(stiffness.replace(
        '1 1 5.12325383882045e+08', '1 1 9.12325383882045e+08'))
    # The lower half alone of a symmetric matrix.
    (folder / 'skew.mtx').write_text(stiffness.replace('real symmetric', 'real general', 1))
    dofs = (folder / 'frame_dofs.csv').read_text()
    (folder / 'kinds.csv').write_text(dofs.replace('x,seat,0', 'x,chair,0', 1))
    for name, kept in (('one.csv', DOFS), ('three.csv', DOFS[:3])):
        (folder / name).write_text('\n'.join(
            line for line in dofs.splitlines() if 'patch_' not in line
            or ('patch_1_' in line and line.split(',')[-1] in kept)))


def test_all_faults_of_a_foundation_and_of_the_rest_come_at_once(folder):
    with pytest.raises(InputError) as error:
        loaded(folder, 'fan', 'foundations.0.flexible.residual=null',
               'unbalances.0.disc=nothing')
    assert len(str(error.value).splitlines()) == 2


def test_stiffness_of_the_foundation_is_one_more_uncertainty(folder):
    settings = ['uncertainty={foundation_stiffness_factor: 1.3, samples: 3}',
                'speed_range_rpm=[1200, 1500]']
    machine = loaded(folder, 'fan', *settings)
    from rotorsoil_ros.case.models import machine_at

    ends = [machine_at(machine.case, machine.model, machine.case.uncertainty,
                       {'foundation_stiffness_factor': end}) for end in (-1.0, 1.0)]
    softer, stiffer = (model.foundations[0].body for model in ends)
    body = machine.model.foundations[0].body
    np.testing.assert_allclose(softer.stiffness, body.stiffness / 1.3)
    np.testing.assert_allclose(stiffer.residual, body.residual / 1.3)
    bounds = machine.band(rpm=[1350.0])
    assert np.all(bounds.low <= bounds.nominal)
    assert bounds['fan_1_b1_housing_z'].low[0, 0] < bounds['fan_1_b1_housing_z'].high[0, 0]
