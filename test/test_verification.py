"""The page docs/verification.md says what its command computes, and all of it holds."""

import importlib.util
from pathlib import Path
import re

import pytest

DOCS = Path(__file__).parents[1] / 'docs'


@pytest.fixture(scope='module')
def study():
    """Return the command that writes the page, as a module."""
    spec = importlib.util.spec_from_file_location('verification', DOCS / 'verification.py')
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_every_benchmark_of_the_shared_file_is_on_the_page(study):
    names = set(study._cases())
    if not names:
        pytest.skip('reference data not beside the checkout: benchmarks.json')
    page = (DOCS / 'verification.md').read_text()
    assert names == set(study.RECIPES)
    assert names <= set(re.findall(r'^### (\S+)$', page, flags=re.MULTILINE))


def test_every_response_that_ross_computed_is_on_the_page(study):
    files = sorted(path.name for path in study.REFERENCE.glob('ross_*.csv'))
    if not files:
        pytest.skip('reference data not beside the checkout: ross_*.csv')
    page = (DOCS / 'verification.md').read_text()
    rows = dict(re.findall(r'^\| (ross_\S+\.csv) \| \d+ \| \S+ \| (.*) \|$', page,
                           flags=re.MULTILINE))
    assert sorted(rows) == files
    assert set(rows.values()) == {'1e-06 | holds'}


def test_page_shows_no_failure_and_nothing_absent():
    page = (DOCS / 'verification.md').read_text()
    assert 'FAILS' not in page
    assert 'not computed' not in page


def test_failure_would_be_shown(study):
    one = study.Finding('a', 'b', 'Hz', 'c', study.np.array([1.0]), study.np.array([1.1]), 0.01)
    assert any('**FAILS**' in line for line in study._section(one))


def test_absent_reference_is_said(study, monkeypatch, tmp_path):
    monkeypatch.setattr(study, 'REFERENCE', tmp_path)
    page = study.page()
    assert 'not computed: `benchmarks.json`' in page
    assert 'ROSS_hollow_criticals' in page


def test_figures_of_the_page_are_those_computed_now(study):
    page = (DOCS / 'verification.md').read_text()
    for finding in [*study.note(), *study.imports()]:
        for value in finding.expected:
            assert f'| {value:.10g} | ' in page
        assert finding.deviation.max() <= finding.tolerance
