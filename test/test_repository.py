"""A clone proves itself: nothing is skipped for want of data, nothing lies outside of it."""

import ast
from pathlib import Path
import re

import pytest

ROOT = Path(__file__).parents[1]
TESTS = sorted((ROOT / 'test').rglob('*.py'))
CODE = sorted(path for folder in ('rotorsoil_ros', 'test', 'benchmarks', 'docs', 'launch')
              for path in (ROOT / folder).rglob('*.py'))
PAGES = sorted([*ROOT.glob('*.md'), *ROOT.glob('*.rst'), *(ROOT / 'docs').rglob('*.md'),
                *(ROOT / 'test').rglob('*.md')])
REFERENCE = ROOT / 'test' / 'reference'
# What a machine may lack: optional libraries, a browser, a right, a device, the history of the
# repository.
MAY_SKIP = {'rerun', 'amqtt', 'no wheel of cyclonedds for this machine',
            'no browser prints pages here', 'not a git checkout',
            'mounting a file system is not allowed here', 'there is no device that is full'}


def reasons(path):
    """Return what each call that skips a test waits for."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Call):
            name = ast.unparse(node.func)
            if name == 'pytest.mark.skipif':
                yield next(ast.literal_eval(keyword.value) for keyword in node.keywords
                           if keyword.arg == 'reason')
            elif name in ('pytest.skip', 'pytest.importorskip'):
                yield ast.literal_eval(node.args[0])


def test_tests_skip_for_what_a_machine_lacks_only():
    assert {reason for path in TESTS for reason in reasons(path)} <= MAY_SKIP


def test_no_test_imports_another():
    borrowed = [(path.name, name) for path in TESTS for name in re.findall(
        r'^(?:from|import) (test_\w+|conftest)', path.read_text(), re.MULTILINE)]
    assert borrowed == []


@pytest.mark.parametrize('path', [*CODE, *PAGES], ids=lambda path: path.name)
def test_nothing_cites_what_is_not_in_the_repository(path):
    text = path.read_text()
    assert re.findall(r'(?i)design' + ' notes?', text) == []
    for climb in re.findall(r'(?<!\.)(?:\.\./)+', text) if path.suffix in ('.md', '.rst') else ():
        assert climb.count('../') <= len(path.relative_to(ROOT).parts) - 1
    for level in re.findall(r'__file__\)(?:\.resolve\(\))?\.parents\[(\d)\]', text):
        assert int(level) <= len(path.relative_to(ROOT).parts) - 1


def test_every_folder_of_reference_data_has_its_source():
    said = (REFERENCE / 'README.md').read_text()
    for folder in REFERENCE.iterdir():
        assert not folder.is_dir() or f'`{folder.name}/' in said
    assert 'CC BY 4.0' in said
