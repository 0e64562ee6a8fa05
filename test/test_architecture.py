"""The house rules of ARCHITECTURE.md, where a machine can see them broken."""

import ast
from pathlib import Path
import subprocess
import sys

import pytest

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / 'rotorsoil_ros'
FLOORS = {floor: sorted((PACKAGE / floor).glob('*.py')) for floor in ('physics', 'case', 'live')}
ROOMS = sorted(PACKAGE.rglob('*.py'))
STREAMS = {'rclpy', 'mcap', 'rerun', 'sensor_msgs', 'std_msgs', 'diagnostic_msgs'}
FILES = {'yaml', 'matplotlib', 'pydantic', 'rich', 'csv', 'json', 'zipfile'}

BLOCKED_IMPORT = """
import importlib, pathlib, sys

class Block:
    def find_spec(self, name, path=None, target=None):
        if name.split('.')[0] in BLOCKED or name.startswith(tuple(BLOCKED_ROOMS)):
            raise ImportError(f'{name} is blocked')

sys.meta_path.insert(0, Block())
for name in NAMES:
    importlib.import_module(name)
"""


def name_of(path):
    return '.'.join(path.relative_to(ROOT).with_suffix('').parts).removesuffix('.__init__')


def imported_by(path):
    """Return every module that a file names in an import."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f'{path}: relative import'
            yield str(node.module)


@pytest.mark.parametrize('names, blocked, rooms', [
    ([name_of(path) for path in FLOORS['physics']], STREAMS | {'yaml', 'matplotlib', 'pydantic'},
     ['rotorsoil_ros.case', 'rotorsoil_ros.live', 'rotorsoil_ros.cli']),
    ([name_of(path) for path in FLOORS['case']], STREAMS,
     ['rotorsoil_ros.live', 'rotorsoil_ros.cli']),
    (['rotorsoil_ros.live.monitor'], STREAMS, ['rotorsoil_ros.cli']),
], ids=['physics', 'case', 'monitor'])
def test_floor_stands_without_what_is_above_it(names, blocked, rooms):
    code = f'NAMES, BLOCKED, BLOCKED_ROOMS = {names}, {blocked}, {rooms}\n{BLOCKED_IMPORT}'
    done = subprocess.run([sys.executable, '-c', code], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize('path', ROOMS, ids=name_of)
def test_room_imports_down_only(path):
    above = {'physics': ('case', 'live', 'cli'), 'case': ('live', 'cli'), 'live': ('cli',)}
    floor = path.relative_to(PACKAGE).parts[0]
    climbs = [name for name in imported_by(path)
              if name.startswith(tuple(f'rotorsoil_ros.{up}' for up in above.get(floor, ())))]
    assert climbs == []


def test_physics_reads_and_writes_no_file_format():
    found = {(path.name, name) for path in FLOORS['physics'] for name in imported_by(path)
             if name.split('.')[0] in FILES}
    assert found == set()


@pytest.mark.parametrize('path', ROOMS, ids=name_of)
def test_room_fits_in_one_sitting(path):
    assert len(path.read_text().splitlines()) <= 400


def test_units_is_the_only_60():
    sixties = [f'{name_of(path)}:{node.lineno}' for path in ROOMS if path.name != 'units.py'
               for node in ast.walk(ast.parse(path.read_text()))
               if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Mult | ast.Div)
               and {60, 30, 3600} & {getattr(side, 'value', None)
                                     for side in (node.left, node.right)
                                     if isinstance(side, ast.Constant)}]
    assert sixties == []


def test_nothing_below_the_node_reads_the_clock():
    readers = {path.name for floor in FLOORS.values() for path in floor
               if {'time', 'datetime'} & set(imported_by(path))}
    # replay waits on purpose; recover writes stamps as dates; the node has a clock of its own
    assert readers <= {'replay.py', 'recover.py'}


def calls(path):
    """Return name and source of the arguments of every call in a file."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
            yield node.func.attr, ', '.join(map(ast.unparse, node.args))


def test_nothing_substitutes_a_number_for_a_failure():
    assert [name_of(path) for path in ROOMS for name, _ in calls(path)
            if name == 'nan_to_num'] == []


def test_no_compliance_is_inverted():
    inverted = [(name_of(path), of) for path in ROOMS for name, of in calls(path)
                if name in ('inv', 'pinv')]
    assert [where for where, of in inverted if 'compliance' in of or 'receptance' in of] == []


def test_package_holds_no_host_and_no_path_of_a_machine():
    files = subprocess.run(
        ['git', 'ls-files', '--cached', '--others', '--exclude-standard'], cwd=ROOT,
        capture_output=True, text=True)
    if files.returncode != 0:
        pytest.skip('not a git checkout')
    spelled = ['/ho' + 'me/', '/ro' + 'ot/', '/wo' + 'rk/', 'pypi' + '.org']
    found = [(name, word) for name in files.stdout.splitlines()
             if (ROOT / name).is_file() for word in spelled
             if word in (ROOT / name).read_bytes().decode(errors='replace')]
    assert found == []
