"""What the pages show is run, what they cite exists, what they state of cones is computed."""

import contextlib
import importlib.util
import io
from pathlib import Path
import re
import shlex
import shutil

import numpy as np
import pytest

from rotorsoil_ros.cli import main
from rotorsoil_ros.ground.cone import ConeModel
from rotorsoil_ros.ground.soil import Circle, Soil

from oracles.published import half_space

ROOT = Path(__file__).parents[1]
DOCS = ROOT / 'docs'
PAGES = sorted(path for path in DOCS.rglob('*.md') if not {'_build', 'api'} & set(path.parts))
SHOWN = [ROOT / 'README.md', *PAGES]
CONES = DOCS / 'theory' / 'cones.md'


def blocks(path, language):
    return re.findall(rf'^```{language}\n(.*?)^```', path.read_text(), re.DOTALL | re.MULTILINE)


@pytest.fixture
def beside_the_cases(tmp_path, monkeypatch):
    """Work in a directory that holds the cases, as a clone does, and nothing else."""
    shutil.copytree(ROOT / 'config', tmp_path / 'config')
    monkeypatch.chdir(tmp_path)


@pytest.mark.usefixtures('beside_the_cases')
@pytest.mark.parametrize('path', [path for path in SHOWN if blocks(path, 'python')],
                         ids=lambda path: path.stem)
def test_examples_in_python_run(path):
    exec(compile('\n'.join(blocks(path, 'python')), path.name, 'exec'), {})


@pytest.mark.usefixtures('beside_the_cases')
@pytest.mark.parametrize('path', [path for path in SHOWN if blocks(path, 'console')],
                         ids=lambda path: path.stem)
def test_examples_of_commands_run_and_print_what_is_shown(path):
    for block in blocks(path, 'console'):
        for example in re.split(r'^\$ ', block, flags=re.MULTILINE)[1:]:
            command, *expected = example.strip().splitlines()
            program, *arguments = shlex.split(command, comments=True)
            assert program == 'rotorsoil'
            said = io.StringIO()
            with contextlib.redirect_stdout(said):
                assert main(arguments) == 0, command
            for line in expected:
                assert line in said.getvalue()


def test_pages_cite_only_tests_rooms_and_pages_that_exist():
    tests = set(re.findall(r'^def (test_\w+)', '\n'.join(
        path.read_text() for path in (ROOT / 'test').rglob('test_*.py')), re.MULTILINE))
    for path in SHOWN:
        text = path.read_text()
        assert set(re.findall(r'`(test_\w+)`', text)) - tests == set(), path
        for room in re.findall(r'`((?:ground|rotor|machine|case|monitor|wire|bags|figures|screen|'
                               r'node|cli)/[\w/]+\.py)`', text):
            assert (ROOT / 'rotorsoil_ros' / room).is_file(), (path, room)
        for target in re.findall(r'\]\(([^)#:]+)(?:#[^)]*)?\)', text):
            made = target.startswith('api/')
            assert made or (path.parent / target).exists(), (path, target)


def test_every_page_is_in_the_contents():
    named = set()
    for path in PAGES:
        for block in re.findall(r'```\{toctree\}\n(.*?)```', path.read_text(), re.DOTALL):
            named |= {(path.parent / f'{line.strip()}.md').resolve() for line in
                      block.splitlines() if line.strip() and not line.startswith(':')}
    assert {path.resolve() for path in PAGES} - named == {(DOCS / 'index.md').resolve()}


def test_the_drawing_shows_every_wing_and_room():
    spec = importlib.util.spec_from_file_location('dag', DOCS / 'dag.py')
    dag = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(dag)
    drawing, rooms = dag.drawing(), dag.rooms()
    assert set(dag.TOP) == set(dag.PLACES)
    wings = {path.name for path in (ROOT / 'rotorsoil_ros').iterdir()
             if (path / '__init__.py').is_file()}
    assert wings | {'base'} == set(dag.TOP)
    assert all(f'>{wing}</text>' in drawing for wing in dag.TOP)
    assert drawing.count('<line') >= 13
    assert '| `cone` | How soil under a rigid base gives way' in rooms


def cone_errors(a0):
    """Return errors of the complex stiffness and of its damping part, (n, 4) each."""
    soil = Soil(shear_modulus=1.0, poisson_ratio=1.0 / 3.0, density=1.0)
    names = ('Fv', 'Fh', 'Fr', 'Ft')
    known, columns = half_space('disk_relaxed_nu0.3333_eta0.00.csv', names)
    exact = 1.0 / columns[[int(np.abs(known - one).argmin()) for one in a0]]
    cone = 1.0 / ConeModel(soil, Circle(1.0)).compliance(a0)[:, [2, 0, 4, 5], [2, 0, 4, 5]]
    return 100.0 * np.abs(cone / exact - 1.0), 100.0 * (cone.imag / exact.imag - 1.0)


def cone_table():
    rows = ['| $a_0$ | vertical | horizontal | rocking | twist |', '|---|---|---|---|---|']
    a0 = np.array([0.3, 0.5, 1.0, 2.0, 4.0, 6.0])
    for at, whole, damping in zip(a0, *cone_errors(a0), strict=True):
        rows.append(f'| {at:g} | ' + ' | '.join(
            f'{one:.0f} %, {two:+.0f} %' for one, two in zip(whole, damping, strict=True)) + ' |')
    return '\n'.join(rows)


def test_cones_are_off_by_what_the_page_says():
    assert cone_table() in CONES.read_text()
