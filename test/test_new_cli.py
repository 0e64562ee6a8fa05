"""`rotorsoil new`: by options, and as a dialogue on a terminal."""

import os
import pty
import subprocess
import sys

import numpy as np
import pytest

from rotorsoil_ros.bags.profile import write_speed_profile
from rotorsoil_ros.bags.tables.exported import export_log
from rotorsoil_ros.case.config import load
from rotorsoil_ros.cli import main
from rotorsoil_ros.units import rpm_to_rad_s

FAN = ['new', 'fan', '--answer', 'power_kw=75', '--answer', 'rpm=990', '--answer',
       'soil=dense_sand']


def test_case_of_a_fan_runs_through_check_without_an_edit(tmp_path, capsys):
    out = tmp_path / 'fan.yaml'
    assert main([*FAN, '-o', str(out)]) == 0
    told = capsys.readouterr().err
    assert 'numbers are guesses, each marked # guess' in told
    assert f'next: rotorsoil report {out} --rpm 990' in told
    assert main(['check', str(out), '--cache', str(tmp_path)]) == 0
    said = capsys.readouterr().out
    assert 'pedestals (within a factor 2.5)' in said
    assert 'warning' not in said


def test_a_recorded_run_is_answered_by_a_new_case_without_an_edit(tmp_path, capsys):
    case, run = tmp_path / 'fan.yaml', tmp_path / 'run.mcap'
    assert main([*FAN, '-o', str(case)]) == 0
    write_speed_profile(run, 'fan', 1_790_000_000 * 10**9 + 10**8 * np.arange(200),
                        rpm_to_rad_s(np.linspace(300.0, 990.0, 200)))
    assert main(['predict', str(case), str(run), '-o', str(tmp_path / 'log.mcap'), '--cache',
                 str(tmp_path)]) == 0
    assert '200 answered' in capsys.readouterr().out
    log = export_log(tmp_path / 'log.mcap', tmp_path / 'log.csv')
    assert log >= 200


def test_case_goes_to_standard_output_and_nothing_else_does(tmp_path, capsys):
    assert main(FAN) == 0
    out = tmp_path / 'fan.yaml'
    out.write_text(capsys.readouterr().out)
    assert load(out).name == 'fan'


def test_existing_case_is_kept(tmp_path, capsys):
    out = tmp_path / 'fan.yaml'
    out.write_text('mine')
    assert main([*FAN, '-o', str(out)]) == 2
    assert out.read_text() == 'mine'
    assert 'exists; --force replaces it' in capsys.readouterr().err
    assert main([*FAN, '-o', str(out), '--force']) == 0


def test_bad_answers_leave_no_file(tmp_path, capsys):
    out = tmp_path / 'fan.yaml'
    assert main([*FAN, '--answer', 'density=1.95', '--answer', 'blok_width=2', '-o',
                 str(out)]) == 2
    assert len(capsys.readouterr().err.splitlines()) == 2
    assert not out.exists()


def test_questions_name_every_key_with_its_unit(capsys):
    assert main(['new', '--questions']) == 0
    said = capsys.readouterr().out
    assert 'power_kw [kW]                rated power; has to be told' in said
    assert 'loose_sand, dense_sand' in said


def test_dialogue_asks_again_and_takes_an_empty_answer_as_not_known(tmp_path):
    out = tmp_path / 'pump.yaml'
    ours, theirs = pty.openpty()
    typed = ['nonsense', 'pump', '', '-5', '55', '', '2980', '', '140', '60 mm', *[''] * 9,
             'gravel', '', '', 'G6.3']
    os.write(ours, ('\n'.join(typed) + '\n').encode())
    done = subprocess.run(
        [sys.executable, '-m', 'rotorsoil_ros.cli', 'new', '-o', str(out)], stdin=theirs,
        capture_output=True, text=True, timeout=120, check=False)
    os.close(ours)
    os.close(theirs)
    assert done.returncode == 0, done.stderr
    assert "kind: must be 'fan', 'pump', 'motor_driven' or 'turbine', got 'nonsense'" in (
        done.stderr)
    assert 'power_kw: -5 kW is outside 0.1 to 1e+06 kW' in done.stderr
    assert 'rpm: has to be told' in done.stderr
    assert 'shaft_diameter: 140 m is outside 0.005 to 3 m: did you mean 0.14?' in done.stderr
    case = load(out)
    assert case.name == 'pump'
    assert case.rotor.shaft[0].outer_diameter == (0.06, 0.06)
    assert case.uncertainty.unbalance_factor == 1.0


@pytest.mark.parametrize('given, kept', [(None, '1'), ('3', '3')])
def test_verbs_ask_for_one_thread_unless_somebody_asked_for_more(given, kept, monkeypatch, capsys):
    for library in ('OMP', 'OPENBLAS', 'MKL'):
        name = f'{library}_NUM_THREADS'
        monkeypatch.setenv(name, '')
        if given is None:
            monkeypatch.delenv(name)
        else:
            monkeypatch.setenv(name, given)
    assert main(['new', '--questions']) == 0
    assert {os.environ[f'{library}_NUM_THREADS'] for library in ('OMP', 'OPENBLAS', 'MKL')} == {
        kept}


def test_numpy_is_not_loaded_before_the_number_of_threads_is_known():
    code = 'import sys; import rotorsoil_ros.cli; sys.exit("numpy" in sys.modules)'
    assert subprocess.run([sys.executable, '-c', code], timeout=120, check=False).returncode == 0
