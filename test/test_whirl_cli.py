"""A machine that whirls above some speed, through every verb that answers a run: no silence."""

import csv

import numpy as np
import pytest

import rotorsoil_ros as rs
from rotorsoil_ros.bags.writer import LogFile
from rotorsoil_ros.cli import main
from rotorsoil_ros.wire.definitions import JOINT_STATE
from rotorsoil_ros.wire.messages import JointStateWriter, Records

# A shaft of lossy material whirls forward from 1 + c_e / c_i times its critical speed on.
CASE = """
name: whirler
support: {model: rigid}
rotor:
  shaft_height: 0.5
  material: steel
  internal_damping: {viscous: 2.0e-4}
  shaft: [{length: 1.2, outer_diameter: 0.06, elements: 6}]
  discs:
    - {name: wheel, position: 0.6, mass: 60.0, diametral_inertia: 1.0, polar_inertia: 1.8}
  bearings:
    - {name: b1, position: 0.0, stiffness: {xx: 2.0e7, zz: 2.0e7}, damping: {xx: 9.0e3, zz: 9.0e3}}
    - {name: b2, position: 1.2, stiffness: {xx: 2.0e7, zz: 2.0e7}, damping: {xx: 9.0e3, zz: 9.0e3}}
unbalances: [{disc: wheel, moment: 2.0e-4}]
speed_range_rpm: [300, 6000]
"""
SECOND = 10**9


@pytest.fixture(scope='module')
def run(tmp_path_factory):
    """Return case, bag and threshold [rad/s]; the bag passes the threshold."""
    folder = tmp_path_factory.mktemp('whirl')
    case, bag = folder / 'case.yaml', folder / 'bag.mcap'
    case.write_text(CASE)
    [one] = rs.load(case, cache_directory=folder).stability().instabilities
    speed = np.linspace(0.5, 1.5, 40) * one.low
    stamps = [SECOND * (1 + row) for row in range(len(speed))]

    def records(topic, names, place, values):
        numbers = np.full((len(speed), 3, 1), np.nan)
        numbers[:, place, 0] = values
        return Records(f'/whirler/{topic}', JOINT_STATE, stamps,
                       JointStateWriter(names).write(stamps, numbers))

    with LogFile(bag) as log:
        log.write(records('joint_states', ['rotor'], 1, speed))
        log.write(records('measured/amplitude', ['wheel_x'], 0, 1e-5))
    return folder, case, bag, one


def told(run, *arguments):
    """Run a verb with the cache of this room."""
    folder, *_ = run
    return main([*map(str, arguments), '--cache', str(folder)])


def test_it_whirls_above_its_threshold_as_the_shaft_feeds_it(run):
    *_, one = run
    assert (one.whirl, one.high) == (1, pytest.approx(200.0 * np.pi))
    assert [(feed.name, feed.cause) for feed in one.feeds] == [('the shaft', 'internal damping')]


def test_prediction_says_why_it_answers_only_some_speeds(run, capsys):
    folder, case, bag, _ = run
    assert told(run, 'predict', case, bag, '-o', folder / 'log.mcap') == 1
    said = capsys.readouterr()
    assert '20 answered' in said.out
    assert '20 speeds are not answered: unstable from' in said.err
    assert 'fed by the internal damping of the shaft (100%)' in said.err


def test_statistics_and_exports_tell_which_speeds_have_no_answer(run):
    folder, case, bag, one = run
    assert told(run, 'predict', case, bag, '--statistics', folder / 's.csv') == 1
    with (folder / 's.csv').open() as stream:
        minutes = [row for row in csv.DictReader(stream) if row['channel'] == 'wheel_x']
    assert sum(int(row['unstable']) for row in minutes) == 20
    assert sum(int(row['speeds']) for row in minutes) == 20
    log = folder / 'for_export.mcap'
    told(run, 'predict', case, bag, '-o', log)
    assert main(['export', str(log), '-o', str(folder / 'long.csv')]) == 0
    with (folder / 'long.csv').open() as stream:
        rows = [row for row in csv.DictReader(stream) if row['channel'] == 'wheel_x']
    assert len(rows) == 40
    for row in rows:
        grows = float(row['speed_rad_s']) >= one.low
        assert row['not_predicted'] == ('unstable' if grows else '')
        assert bool(row['predicted_m']) is not grows


def test_comparison_and_pictures_tell_it(run, capsys):
    folder, case, bag, _ = run
    assert told(run, 'compare', bag, case, '-o', folder / 'page') == 1
    assert 'fails: unstable from' in capsys.readouterr().out
    page = (folder / 'page' / 'report.html').read_text()
    assert '<h2>Stability of the model</h2>' in page
    assert '<p>UNSTABLE, ' in page
    assert told(run, 'plot', case, '-o', folder / 'pictures') == 0
    assert 'grows, fed by the internal damping of the shaft' in capsys.readouterr().err
