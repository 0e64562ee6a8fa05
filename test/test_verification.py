"""The pages of accuracy say what their commands compute, and no command writes without data."""

import importlib.util
from pathlib import Path
import re

import pytest

from oracles.published import cases, REFERENCE

DOCS = Path(__file__).parents[1] / 'docs'
PAGE = (DOCS / 'verification.md').read_text()


def command(name):
    """Return a command that writes a page, as a module."""
    spec = importlib.util.spec_from_file_location(name, DOCS / f'{name}.py')
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope='module')
def study():
    return command('verification')


def test_every_benchmark_of_the_reference_is_on_the_page(study):
    names = set(cases())
    assert names == set(study.RECIPES)
    assert names <= set(re.findall(r'^### (\S+)$', PAGE, flags=re.MULTILINE))


def test_every_response_that_ross_computed_is_on_the_page():
    rows = dict(re.findall(r'^\| (ross_\S+\.csv) \| \d+ \| \S+ \| (.*) \|$', PAGE,
                           flags=re.MULTILINE))
    assert set(rows) == {path.name for path in (REFERENCE / 'rotor').glob('ross_*.csv')}
    assert set(rows.values()) == {'1e-06 | holds'}


def test_page_shows_no_failure():
    assert 'FAILS' not in PAGE


def test_failure_would_be_shown(study):
    one = study.Finding('a', 'b', 'Hz', 'c', study.np.array([1.0]), study.np.array([1.1]), 0.01)
    assert any('**FAILS**' in line for line in study._section(one))


@pytest.mark.parametrize('name, page', [
    ('verification', 'PAGE'), ('convergence_study', 'PAGE_FILE')])
def test_no_page_is_written_without_the_data_it_is_about(name, page, monkeypatch, tmp_path):
    module = command(name)
    owner = module.published if name == 'verification' else module
    monkeypatch.setattr(owner, 'REFERENCE', tmp_path)
    monkeypatch.setattr(module, page, tmp_path / 'page.md')
    with pytest.raises(SystemExit, match=r'not there, so page\.md is not written'):
        module.main()
    assert list(tmp_path.iterdir()) == []


def test_figures_of_the_page_are_those_computed_now(study):
    for finding in [*study.criticals(), *study.imports()]:
        for value in finding.expected:
            assert f'| {value:.10g} | ' in PAGE
        assert finding.deviation.max() <= finding.tolerance
