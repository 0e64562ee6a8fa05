"""Journals of a case file: what follows from them, what is told of them, and what is refused."""

import csv
from io import StringIO
import math

import numpy as np
import pytest

import rotorsoil_ros as rs
from rotorsoil_ros.case.config import load
from rotorsoil_ros.case.summary import derived_quantities, near_threshold, warnings
from rotorsoil_ros.cli import main
from rotorsoil_ros.errors import InputError
from rotorsoil_ros.rotor.journal import states
from rotorsoil_ros.units import GRAVITY, rad_s_to_rpm, rpm_to_rad_s

WEIGHT = 0.5 * GRAVITY * (114.4 + 0.25 * math.pi * 0.08**2 * 1.2 * 7850.0)  # of each [N]
PLAIN = ('{type: plain, diameter: 0.08, length: 0.04, radial_clearance: 80.0e-6, '
         'viscosity: 0.02}')
TEXT = f"""
name: journals
support: {{model: rigid}}
rotor:
  shaft_height: 1.0
  material: steel
  shaft: [{{length: 1.2, outer_diameter: 0.08, elements: 12}}]
  discs:
    - {{name: wheel, position: 0.6, mass: 114.4, diametral_inertia: 1.5, polar_inertia: 2.5}}
  bearings:
    - {{name: left, position: 0.1, journal: {PLAIN}}}
    - {{name: right, position: 1.1, journal: {PLAIN}}}
unbalances: [{{disc: wheel, moment: 1.0e-3}}]
speed_range_rpm: [500, 5000]
"""
SAYS = 'rotor.bearings.0.journal'


@pytest.fixture
def file(tmp_path):
    path = tmp_path / 'journals.yaml'
    path.write_text(TEXT)
    return path


def test_weight_and_speed_give_two_tables(file):
    case = load(file)
    for journal, bearing in zip(case.journals, case.rotor.bearings, strict=True):
        assert journal.states.carried == pytest.approx(WEIGHT, rel=1e-9)
        low, high = bearing.speed_range
        assert low == case.speed_range[0]
        assert high == 1.5 * case.speed_range[1]
        stiffness, damping, _ = bearing.coefficients(*2 * (journal.states.speed,))
        np.testing.assert_allclose(stiffness, journal.states.stiffness, rtol=1e-12)
        np.testing.assert_allclose(damping, journal.states.damping, rtol=1e-12)


def test_films_come_out_of_the_cache_of_the_case(file, tmp_path, monkeypatch):
    first = load(file, cache_directory=tmp_path / 'films')
    monkeypatch.setattr(states.JournalStates, 'at', None)  # nothing is solved again
    again = load(file, cache_directory=tmp_path / 'films')
    np.testing.assert_array_equal(again.journals[0].states.place, first.journals[0].states.place)
    assert len(list((tmp_path / 'films').glob('journal_*.npz'))) == 2  # loads differ in round-off


def test_given_load_is_the_load(file):
    case = load(file, ['rotor.bearings.0.load=[120.0, -500.0]'])
    assert case.journals[0].states.carried == pytest.approx(math.hypot(120.0, 500.0))
    assert case.journals[1].states.carried == pytest.approx(WEIGHT, rel=1e-9)


def test_alignment_moves_weight_and_unloads(file):
    third = ('rotor.bearings=[{name: left, position: 0.1, journal: %s},'
             '{name: middle, position: 0.6, alignment: %s, journal: %s},'
             '{name: right, position: 1.1, journal: %s}]')
    level = load(file, [third % (PLAIN, '0.0', PLAIN, PLAIN)])
    low = load(file, [third % (PLAIN, '-1.0e-5', PLAIN, PLAIN)])
    own, less = (case.journals[1].states.carried for case in (level, low))
    assert less < 0.9 * own
    for case in (level, low):
        assert sum(one.states.carried for one in case.journals) == pytest.approx(2.0 * WEIGHT)
    with pytest.raises(InputError, match=r'rotor\.bearings\.1: bearing unloaded: middle must '
                                         r'carry more than .* N, got -'):
        load(file, [third % (PLAIN, '-1.0e-3', PLAIN, PLAIN)])


def test_seal_carries_no_weight(file):
    seal = ('rotor.bearings=[{name: left, position: 0.1, journal: %s},'
            '{name: seal, position: 0.5, stiffness: {xx: 0.0, zz: 0.0},'
            ' damping: {xx: 100.0, zz: 100.0}}, {name: right, position: 1.1, journal: %s}]')
    case = load(file, [seal % (PLAIN, PLAIN)])
    assert [one.states.carried for one in case.journals] == pytest.approx([WEIGHT, WEIGHT])


def test_pedestal_that_sinks_carries_less(file):
    pedestal = ('{mass: 10.0, stiffness: {xx: 1.0e7, zz: %s}, damping: {xx: 1.0e3, zz: 1.0e3}}')
    third = ('rotor.bearings=[{name: left, position: 0.1, journal: %s},'
             '{name: middle, position: 0.6, journal: %s, pedestal: %s},'
             '{name: right, position: 1.1, journal: %s}]')
    stiff, soft = (load(file, [third % (PLAIN, PLAIN, pedestal % zz, PLAIN)]).journals[1]
                   for zz in ('1.0e10', '1.0e7'))
    assert soft.states.carried < 0.5 * stiff.states.carried


def test_rigid_rotor_whirls_from_where_the_textbook_says(file):
    # Two independent ways: eigenvalues of the whole machine, and the roots of a mass on a film.
    # The wheel is as stiff as a shaft of 300 mm can be: its bending takes 0.3 % of the threshold.
    stiff = ['rotor.shaft.0.outer_diameter=0.3', 'rotor.material={young_modulus: 2.1e13, '
             'poisson_ratio: 0.3, density: 500.0}', 'rotor.discs.0.mass=119.38',
             'speed_range_rpm=[2000, 9500]']
    machine = rs.load(file)
    case = machine.case.changed(stiff)
    [one] = [found for found in rs.Machine(case, machine.directory).stability().instabilities
             if found.whirl > 0 and 'translation' not in found.name][:1]
    left = case.journals[0]
    textbook = left.states.rigid_threshold(left.states.carried / GRAVITY)
    assert one.low == pytest.approx(textbook, rel=5e-3)
    assert one.name.startswith('fluid-film whirl')
    assert {feed.name for feed in one.feeds} == {'left', 'right'}
    assert one.frequency / one.speed == pytest.approx(0.5, abs=0.03)
    assert list(near_threshold(case.changed(['speed_range_rpm=[2000, 8000]']),
                               rs.Machine(case, machine.directory).stability()))


def test_check_tells_the_film_and_the_threshold(file, capsys):
    assert main(['check', str(file)]) == 0
    told = capsys.readouterr().out
    for words in ('left: load on the journal', 'Sommerfeld number', 'eccentricity', 'attitude',
                  'least film', 'loss at least', 'MPa of its length and diameter',
                  'warning: the speed range ends at 88% of 5'):
        assert words in told
    assert 'fluid-film whirl' in told
    assert main(['check', str(file), '--set', 'speed_range_rpm=[500, 6000]']) == 1
    told = capsys.readouterr().out
    assert 'error: unstable from 5' in told
    assert 'fluid-film whirl, shaft bending, first (forward whirl' in told


def values_of(text):
    return list(csv.DictReader(StringIO(text)))


def test_bearings_are_written_at_every_speed(file, capsys):
    assert main(['bearings', str(file), '--rpm', '1000:4000:4']) == 0
    rows = values_of(capsys.readouterr().out)
    assert list(rows[0]) == [
        'speed_rad_s', 'bearing', 'load', 'sommerfeld', 'eccentricity', 'attitude', 'least_film',
        *(f'{name}_{pair}' for name in ('stiffness', 'damping')
          for pair in ('xx', 'xz', 'zx', 'zz'))]
    assert [row['bearing'] for row in rows] == ['left', 'right'] * 4
    for row in rows[::2]:
        speed = float(row['speed_rad_s'])
        assert float(row['load']) == pytest.approx(WEIGHT)
        assert float(row['sommerfeld']) == pytest.approx(
            0.02 * speed / (2.0 * math.pi) * 0.04 * 0.08 / WEIGHT * 500.0**2)
        # A plain bore: least film c (1 - e), where the mesh has a point within 1.1 degrees.
        assert float(row['least_film']) == pytest.approx(
            80e-6 * (1.0 - float(row['eccentricity'])), rel=2e-3)


def test_bearings_that_are_no_journals_have_no_film(case_file, capsys):
    assert main(['bearings', str(case_file), '--rpm', '1000:1000:1']) == 0
    for row in values_of(capsys.readouterr().out):
        assert [row[key] for key in ('load', 'sommerfeld', 'eccentricity', 'attitude',
                                     'least_film')] == [''] * 5
        assert float(row['stiffness_xx']) > 0.0


def test_bearings_in_units_of_a_plant(file, capsys):
    main(['bearings', str(file), '--rpm', '3000:3000:1', '--units', 'plant'])
    [row, _] = values_of(capsys.readouterr().out)
    [film, _] = rs.load(file).bearings(rpm=3000.0)
    assert float(row['speed_rpm']) == 3000.0
    assert float(row['attitude_deg']) == pytest.approx(math.degrees(film.film.attitude[0]))
    assert float(row['least_film_um']) == pytest.approx(1e6 * film.film.least[0])


def test_speed_without_a_film_is_one_line(file, capsys):
    assert main(['bearings', str(file), '--rpm', '0:3000:2']) == 2
    assert capsys.readouterr().err == f'{file}: a journal at rest has no film\n'
    assert main(['bearings', str(file), '--rpm', '2:3000:2']) == 2
    assert 'film of left must be at least 1.6 um thick' in capsys.readouterr().err


def test_elliptic_and_tilting_pads_of_a_case(file):
    lemon = ('{type: elliptic, diameter: 0.08, length: 0.04, radial_clearance: 80.0e-6, '
             'preload: 0.5, oil: {grade: "ISO VG 32", temperature: "323.15 K"}}')
    pads = ('{type: tilting_pad, diameter: 0.08, length: 0.04, radial_clearance: 80.0e-6, '
            'pads: 5, arc_deg: 60, pivot: 0.55, preload: 0.3, load_on: gap, viscosity: '
            '"20 mPa s"}')
    case = load(file, [f'{SAYS}={lemon}', f'rotor.bearings.1.journal={pads}'])
    left, right = case.journals
    assert left.oil.temperature == pytest.approx(50.0)
    assert left.states.bearing.preload == 0.5
    assert right.states.bearing.pivots[0] == pytest.approx(math.radians(216.0))
    told = dict(derived_quantities(case, []))
    assert 'ISO VG 32 at 50 deg C' in told['left: oil']
    assert 'right: pads' in told


def test_viscosity_may_change_with_the_speed(file):
    table = '{speed_rpm: [500, 5000], viscosity: [0.03, 0.01]}'
    [left, _] = load(file, [f'{SAYS}.viscosity={table}']).journals
    np.testing.assert_allclose(left.states.viscosity[0], 0.03)
    np.testing.assert_allclose(
        left.at(np.array([rpm_to_rad_s(5000.0)])).viscosity, 0.01)


def test_films_are_warned_of(file):
    def told(*settings):
        return ' '.join(warnings(load(file, list(settings))))

    assert 'film is thinner than' not in told()
    thin = told(f'{SAYS}.least_film=30e-6')
    [left, _] = load(file).journals
    limit = rad_s_to_rpm(left.states.thinner(30e-6))
    assert f'left: below {limit:.4g} rpm the film is thinner than 30 um' in thin
    assert 'carries 3.12 MPa' in told('rotor.bearings.0.load=[0, -10000]')
    assert 'is turbulent' in told(f'{SAYS}.viscosity=2e-4', 'rotor.bearings.0.load=[0, -50]')
    assert 'has vortices' in told(f'{SAYS}.viscosity=1.5e-3')
    assert 'the eccentricity is below 0.05' in told('rotor.bearings.0.load=[0, -100]')


@pytest.mark.parametrize('setting, said', [
    (f'{SAYS}.diameter=0', f'{SAYS}.diameter: must be > 0 m and finite, got 0'),
    (f'{SAYS}.radial_clearance="80 mm"', f'{SAYS}.radial_clearance: must be > 0 m and at most'),
    (f'{SAYS}.preload=0.5', f'{SAYS}.preload: belongs to the type elliptic or tilting_pad, got '
                            'plain'),
    (f'{SAYS}.pads=5', f'{SAYS}.pads: belongs to the type tilting_pad, got plain'),
    (f'{SAYS}.type=elliptic', f'{SAYS}.preload: is missing; the type elliptic needs it'),
    (f'{SAYS}.type=sleeve', f"{SAYS}.type: must be 'plain', 'axial_groove', 'elliptic' or "
                            "'tilting_pad', got 'sleeve'"),
    (f'{SAYS}.viscosity=0', f'{SAYS}.viscosity: must be > 0 Pa s and finite, got 0'),
    (f'{SAYS}.viscosity="20 bar"', f'{SAYS}.viscosity: must be a finite number in Pa s, got '),
    (f'{SAYS}.oil={{grade: 46, temperature: 50}}', f'{SAYS}.viscosity: needs a value in Pa s, or '
                                                   'oil its grade; got both'),
    (f'{SAYS}.viscosity=null', f'{SAYS}.viscosity: needs a value in Pa s, or oil its grade; '
                               'neither is there'),
    (f'{SAYS}.viscosity={{speed_rpm: [0, 9000], viscosity: [0.02]}}',
     f'{SAYS}.viscosity.viscosity: must have as many entries as speed_rpm, 2, got 1'),
    (f'{SAYS}.least_film=0', f'{SAYS}.least_film: must be > 0 m and finite, got 0'),
    (f'{SAYS}.clearance=1e-4', f'{SAYS}.clearance: is not a known key; did you mean '
                               'radial_clearance?'),
    ('rotor.bearings.0.stiffness={xx: 1e8, zz: 1e8}',
     'rotor.bearings.0: needs either journal or stiffness and damping, got journal and stiffness'),
    ('rotor.bearings.0.load=[0, 0]', f'{SAYS}: load must give a Sommerfeld number of 1e-05 to '
                                     '1e+06 at 7500 rpm, got inf with 0 N and 0.02 Pa s'),
    ('rotor.bearings.0.load=[0, -1.0e9]', f'{SAYS}: load must give a Sommerfeld number of'),
    ('rotor.bearings.0.journal=null', 'rotor.bearings.0.stiffness: is missing'),
    ('speed_range_rpm=[0, 5000]', f'{SAYS}: film must be at least 1.6 um thick (0.02 of the '
                                  'radial clearance) at the lowest speed, which it is from '),
])
def test_what_is_wrong_with_a_journal_is_one_line(file, setting, said):
    with pytest.raises(InputError, match=r'journals\.yaml') as caught:
        load(file, [setting])
    lines = str(caught.value).splitlines()
    assert any(line.startswith(f'{file}: {said}') for line in lines), lines
    assert len(lines) <= 2


def test_grade_of_no_oil_is_refused(file):
    for grade, said in (('57', 'grade: must be one of ISO VG 22, 32, 46, 68, 100, got 57'),
                        ('thick', 'grade: must be an ISO viscosity grade, as in 46 or VG46')):
        with pytest.raises(InputError, match=said):
            load(file, [f'{SAYS}.viscosity=null',
                        f'{SAYS}.oil={{grade: {grade}, temperature: 50}}'])
    with pytest.raises(InputError, match=r'oil.temperature: must be -10 to 150 deg C, got 500'):
        load(file, [f'{SAYS}.viscosity=null', f'{SAYS}.oil={{grade: 46, temperature: 500}}'])


def test_load_and_alignment_belong_to_journals(case_file):
    with pytest.raises(InputError, match=r'bearings\.0\.load: belongs to a journal'):
        load(case_file, ['rotor.bearings.0.load=[0, -100]'])
    with pytest.raises(InputError, match=r'bearings\.1\.alignment: belongs to a rotor with a '):
        load(case_file, ['rotor.bearings.1.alignment=1e-4'])
