"""The page of a design report: whole by itself, one sheet of A4, and the numbers of its JSON."""

from html.parser import HTMLParser
import json
from pathlib import Path

import pytest

import rotorsoil_ros as rs
from rotorsoil_ros.cli import main
from rotorsoil_ros.figures.design import response_figure

from house import sheets

ROOT = Path(__file__).parents[2]
FAN = ROOT / 'config' / 'plant_fan.yaml'
UNSTABLE = ROOT / 'test' / 'cases' / 'unstable_without_a_word' / 'case.yaml'

# What the page of numbers has to hold.
KEYS = {'verdict', 'speed_rpm', 'housings', 'modes', 'stable', 'inputs', 'assumptions', 'guesses',
        'not_modelled', 'decides', 'next_step', 'damping'}


class Sources(HTMLParser):
    """Everything that a page would have to load, and its text."""

    def __init__(self):
        super().__init__()
        self.loaded, self.text = [], []

    def handle_starttag(self, tag, attrs):
        self.loaded += [value for key, value in attrs if key in ('src', 'href')]

    def handle_data(self, data):
        self.text.append(data)


def written(tmp_path, *arguments):
    """Run the verb; return status, page and numbers."""
    out = tmp_path / 'report'
    status = main(['report', *map(str, arguments), '-o', str(out), '--cache', str(tmp_path)])
    return status, (out / 'report.html').read_text(), json.loads((out / 'report.json').read_text())


def new_fan(tmp_path, *answers):
    case = tmp_path / 'new.yaml'
    given = [word for answer in ('power_kw=75', 'rpm=990', 'soil=dense_sand', *answers)
             for word in ('--answer', answer)]
    assert main(['new', 'fan', *given, '-o', str(case)]) == 0
    return case


def test_page_is_whole_by_itself_and_says_what_its_numbers_say(tmp_path, capsys):
    status, page, numbers = written(tmp_path, FAN, '--rpm', 990)
    assert status == 0
    assert set(numbers) >= KEYS
    assert numbers['verdict'] == 'acceptable'
    seen = Sources()
    seen.feed(page)
    assert all(one.startswith('data:image/svg+xml;base64,') for one in seen.loaded)
    text = ' '.join(seen.text)
    for said in (numbers['reasons'][0], numbers['next_step'], 'Not modelled',
                 numbers['decides']['input'].capitalize(),
                 *(one['name'] for one in numbers['modes']),
                 *(one['housing'] for one in numbers['housings'])):
        assert said in text
    assert sum(numbers['damping']['shares'].values()) == pytest.approx(1.0)
    assert f"Damped by radiation {numbers['damping']['shares']['radiation']:.1%}" in text
    for one in numbers['housings']:
        assert f'{one["velocity_mm_s_rms"][2]:.3g}' in text
        assert f'{one["displacement_um_pp"][1]:.3g}' in text
    printed = capsys.readouterr().out
    assert printed.startswith('verdict   acceptable')
    assert 'next step Nothing has to be changed' in printed


def test_case_of_new_runs_through_report_and_names_its_guesses(tmp_path):
    case = new_fan(tmp_path, 'block_width=2', 'block_length=3', 'block_height=1')
    status, page, numbers = written(tmp_path, case, '--rpm', 990)
    assert status in (0, 1)
    assert {one['key'] for one in numbers['guesses']} >= {
        'soil.shear_wave_velocity', 'foundations.0.mass', 'rotor.discs.1',
        'rotor.bearings.0.stiffness', 'unbalances.0'}
    assert 'Guessed: 24 numbers' in page
    assert 'block: 2 x 3 x 1 m, ' in page


def test_unstable_machine_is_told_in_red_without_a_number(tmp_path):
    status, page, numbers = written(tmp_path, UNSTABLE, '--rpm', 5000)
    assert status == 1
    assert numbers['stable'] is False
    assert numbers['decides'] is None
    assert 'class="verdict bad"' in page
    assert 'Unstable: a vibration grows' in page
    assert not any(value for one in numbers['housings'] for value in one['velocity_mm_s_rms'])


def test_no_band_is_drawn_about_an_unstable_machine(tmp_path):
    machine = rs.load(FAN, cache_directory=tmp_path, **{
        'rotor.bearings.0.stiffness': {'xx': 2e8, 'zz': 2e8, 'xz': 1e8, 'zx': -1e8}})
    report = machine.report(rpm=990)
    axes = response_figure(machine, report).axes[0]
    assert report.stable is False
    assert 'as the case says' in axes.get_legend_handles_labels()[1]
    # Each of the many machines of a band would be looked through for what grows.
    assert 'envelope' not in vars(machine)


def test_speed_beyond_the_range_is_one_line_and_nothing_is_written(tmp_path, capsys):
    out = tmp_path / 'report'
    assert main(['report', str(FAN), '--rpm', '2500', '-o', str(out), '--cache',
                 str(tmp_path)]) == 2
    assert len(capsys.readouterr().err.splitlines()) == 1
    assert not out.exists()


def test_report_that_exists_is_kept(tmp_path, capsys):
    (tmp_path / 'report').mkdir()
    (tmp_path / 'report' / 'mine.txt').write_text('mine')
    assert main(['report', str(FAN), '--rpm', '990', '-o', str(tmp_path / 'report')]) == 2
    assert 'exists; --force replaces it' in capsys.readouterr().err


def test_python_and_the_verb_say_the_same(tmp_path):
    _, _, numbers = written(tmp_path, FAN, '--rpm', 990)
    found = rs.load(FAN, cache_directory=tmp_path).report(rpm=990).to_json()
    found['case_file'] = numbers['case_file']
    assert json.loads(json.dumps(found)) == numbers


@pytest.mark.parametrize('kind', ['given', 'guessed', 'unstable', 'two_blocks'])
def test_page_prints_on_one_sheet(kind, tmp_path):
    if kind == 'given':
        written(tmp_path, FAN, '--rpm', 1200)  # a mode too near: the longest next step
    elif kind == 'guessed':
        written(tmp_path, new_fan(tmp_path), '--rpm', 990)
    elif kind == 'unstable':
        written(tmp_path, UNSTABLE, '--rpm', 5000)
    else:
        written(tmp_path, two_blocks(tmp_path), '--rpm', 990)
    assert sheets(tmp_path / 'report' / 'report.html', tmp_path) == 1


def two_blocks(tmp_path):
    """Return a case with six bearings on two blocks, and long names."""
    text = FAN.read_text()
    bearing = ('    - name: {name}\n      position: {place}\n      foundation: {block}\n'
               '      stiffness: {{xx: 2.5e8, zz: 5.0e8}}\n'
               '      damping: {{xx: 4.0e3, zz: 4.0e3}}\n')
    more = ''.join(bearing.format(name=f'intermediate_bearing_number_{number}', place=place,
                                  block='second_block_under_the_free_end')
                   for number, place in enumerate((0.5, 0.7, 0.9, 1.1)))
    text = text.replace('unbalances:\n', f'{more}unbalances:\n')
    text = text.replace('rotor:\n', (
        '  - {name: second_block_under_the_free_end, half_width: 1.0, half_length: 1.0, '
        'centre_y: 3.0, height: 1.0, density: 2400.0}\nrotor:\n'), 1)
    case = tmp_path / 'two.yaml'
    case.write_text(text)
    return case
