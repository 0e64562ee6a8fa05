"""What verbs, node and log say of a machine that is unstable."""

import json
import math
from pathlib import Path

import numpy as np
import pytest

from rotorsoil_ros.bags.comparison import compare
from rotorsoil_ros.bags.writer import LogFile
from rotorsoil_ros.case.loading import Machine
from rotorsoil_ros.cli import main
from rotorsoil_ros.events import Diagnostics, Level, Predicted, Remark
from rotorsoil_ros.machine.modes.stability import stability
from rotorsoil_ros.monitor.criteria import Expectation
from rotorsoil_ros.monitor.monitor import Monitor
from rotorsoil_ros.monitor.verdict import Verdict
from rotorsoil_ros.units import rpm_to_rad_s
from rotorsoil_ros.wire.definitions import JOINT_STATE
from rotorsoil_ros.wire.messages import JointStateWriter, Records

CASES = Path(__file__).parent / 'cases'
UNSTABLE = {'unst': (0.0724, 0.1052), 'unstable_without_a_word': (0.0925 / (2.0 * math.pi),)}
SECOND = 10**9


@pytest.fixture(scope='module')
def loaded(tmp_path_factory):
    cache = tmp_path_factory.mktemp('unstable')
    return {name: Machine.load(CASES / name / 'case.yaml', cache_directory=cache)
            for name in UNSTABLE}


# By an independent finite-element model at 4000 rpm, and by ROSS 2.3.0 at its critical speed.
@pytest.mark.parametrize('name, rpm', [('unst', 4000.0), ('unstable_without_a_word', 2642.66)])
def test_growth_is_that_of_other_programs(loaded, name, rpm):
    speed = rpm_to_rad_s(rpm)
    found = stability(loaded[name].model, (speed, np.nextafter(speed, np.inf)))
    ratios = sorted(-one.damping_ratio for one in found.instabilities
                    if one.frequency < rpm_to_rad_s(6000.0))
    np.testing.assert_allclose(ratios, sorted(UNSTABLE[name]), atol=5e-5)  # as printed


@pytest.mark.parametrize('name', UNSTABLE)
def test_check_says_which_mode_grows_where_and_why(name, capsys, tmp_path):
    assert main(['check', str(CASES / name / 'case.yaml'), '--cache', str(tmp_path)]) == 1
    said = capsys.readouterr().out
    assert 'response peak' not in said
    assert 'damping at' not in said
    assert 'UNSTABLE' in said
    error = next(line for line in said.splitlines() if line.startswith('error: unstable'))
    assert 'shaft bending, first (forward whirl' in error
    assert 'fed by the cross-coupled stiffness of' in error
    # A table out of the cache says the same.
    assert main(['check', str(CASES / name / 'case.yaml'), '--cache', str(tmp_path)]) == 1
    assert capsys.readouterr().out == said


def test_no_verb_gives_numbers_for_a_response_that_does_not_exist(capsys):
    case = str(CASES / 'unstable_without_a_word' / 'case.yaml')
    for verb in (['response', case, '--rpm', '5000:5000:1'],
                 ['response', case, '--rpm', '5000:5000:1', '--order', '2', '--force', 'wheel_z'],
                 ['frf', case, '--rpm', '5000', '--hz', '10:20:2', '--force', 'wheel_z']):
        assert main(verb) == 1
        said = capsys.readouterr()
        assert set(said.out.splitlines()[1].split(',')[1:]) == {'nan'}
        assert 'unstable at all speeds looked at' in said.err


def test_campbell_names_what_grows(capsys):
    case = str(CASES / 'unst' / 'case.yaml')
    for arguments in (['--rpm', '4000:4000:1'], ['--criticals']):
        assert main(['campbell', case, *arguments]) == 0
        assert 'shaft bending, first (forward whirl at 15.' in capsys.readouterr().err


def test_node_answers_nothing_and_is_in_error(loaded):
    machine = loaded['unst']
    events = []
    monitor = Monitor('m', machine.table, machine.case.unbalance, sinks=[events.append])
    monitor.begin(0, machine.description('m', machine.case.unbalance))
    monitor.on_speed(np.array([SECOND]), np.array([100.0]))
    monitor.tick(2 * SECOND, stale_after_s=5.0)
    answered = next(event for event in events if isinstance(event, Predicted))
    assert np.isnan(answered.prediction.displacement).all()
    assert monitor.health.counts['unstable'] == 1
    told = [event for event in events if isinstance(event, Remark)]
    assert {event.level for event in told} == {Level.ERROR}
    assert len(told) == len(machine.table.stability.instabilities)
    state = [event for event in events if isinstance(event, Diagnostics)][-1]
    assert state.level is Level.ERROR
    assert state.summary.startswith('unstable at all speeds looked at, 0 to 6000 rpm: shaft')


def test_model_message_says_it(loaded):
    machine = loaded['unst']
    said = json.loads(json.dumps(machine.description('m', machine.case.unbalance),
                                 allow_nan=False))
    assert said['stable'] is False
    assert said['unstable_rad_s'] == [[0.0, rpm_to_rad_s(6000.0)]]
    assert said['gaps_rad_s'] == []
    assert 'grows' in said['unstable'][0]


def test_comparison_is_told_and_no_growing_mode_is_a_resonance(loaded):
    machine = loaded['unst']
    found = Expectation.of(machine.case, machine.directory)
    assert 'unstable at all speeds looked at' in found.note
    assert all(resonance.damping_ratio > 0.0 for resonance in found.resonances)


def test_comparison_of_a_machine_that_is_unstable_never_passes(loaded, tmp_path):
    machine = loaded['unst']
    channel = next(name for name in machine.table.channels if name.is_housing)
    stamps = [SECOND * (1 + row) for row in range(20)]

    def records(topic, names, place, value):
        numbers = np.full((20, 3, 1), np.nan)
        numbers[:, place] = value
        return Records(f'/m/{topic}', JOINT_STATE, stamps,
                       JointStateWriter(names).write(stamps, numbers))

    with LogFile(tmp_path / 'log.mcap') as log:
        log.write(records('joint_states', ['rotor'], 1, 100.0))
        log.write(records('measured/amplitude', [channel], 0, 1e-6))
    found = compare(tmp_path / 'log.mcap', machine)
    assert found.verdict == Verdict.FAILS
    assert found.failures[0].startswith('unstable at all speeds looked at')


@pytest.mark.parametrize('key, value, says', [
    ('rotor.bearings.0.damping.xx', '-5', 'of de is negative in some direction, -5 N s/m'),
    ('rotor.bearings.1.stiffness.zz', '-3e6', 'of nde is negative in some direction, -3e+06 N/m')])
def test_negative_coefficients_are_remarked(key, value, says, capsys, tmp_path):
    case = str(CASES / 'unstable_without_a_word' / 'case.yaml')
    main(['check', case, '--set', f'{key}={value}', '--cache', str(tmp_path)])
    assert says in capsys.readouterr().out
