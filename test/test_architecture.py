"""The house rules, where a machine can see them broken."""

import ast
from collections import Counter, defaultdict
from pathlib import Path
import re
import subprocess
import sys

import pytest

from house import ROS

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / 'rotorsoil_ros'
ROOMS = sorted(PACKAGE.rglob('*.py'))

# From which wings each may take: those named, and what these take from.
BASE = 'base'
DAG = {
    BASE: set(), 'ground': {BASE}, 'rotor': {BASE}, 'machine': {'ground', 'rotor'},
    'case': {'machine'}, 'monitor': {'case'}, 'wire': {'monitor'}, 'bags': {'wire'},
    'figures': {'monitor'}, 'screen': {'monitor'}, 'feeds': {'wire'},
    'node': {'bags', 'feeds', 'figures', 'screen'},
    'cli': {'node'}, 'testing': {'node'},
}
# The package itself: its names are looked up when somebody asks, so that it may name every wing.
FACE = 'rotorsoil_ros'
# What only these wings may import, at the top or lazily.
OWNERS = {
    **{name: {'node', 'testing'} for name in ROS}, 'pytest': {'testing'},
    'rerun': {'screen'}, 'mcap': {'bags'},
    'matplotlib': {'figures'}, 'pandas': {BASE}, 'xarray': {BASE}, 'pydantic': {'case', 'bags'},
    'yaml': {'case', 'bags'}, 'openpyxl': {'bags'}, 'pyuff': {'bags', 'case'}, 'rosbags': {'bags'},
    'pyarrow': {'bags', 'screen'},  # rerun itself needs it
    'asyncua': {'feeds'}, 'cryptography': {'feeds'}, 'google': {'feeds'}, 'paho': {'feeds'},
    'zenoh': {'feeds'},
    'skfem': {'ground'}, 'rich': {'cli'}, 'csv': {'case', 'bags', 'figures', 'cli'},
}
LONGEST_ROOM, SHORTEST_ROOM = 400, 60
MOST_ROOMS = 16



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


def wing_of(module):
    """Return the wing that a module of this package belongs to."""
    parts = module.split('.')
    return parts[1] if len(parts) > 1 and parts[1] in DAG else BASE


def below(wing):
    """Return a wing and everything it may take from."""
    return {wing}.union(*(below(lower) for lower in DAG[wing]))


def named_in(path):
    """Return every module of this package that a room imports or names in a string."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield from (f'{node.module}.{alias.name}' for alias in node.names)
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            yield from re.findall(r'rotorsoil_ros(?:\.\w+)+', node.value)


@pytest.mark.parametrize(
    'path', [path for path in ROOMS if name_of(path) != FACE], ids=name_of)
def test_room_takes_from_below_only(path):
    allowed = below(wing_of(name_of(path)))
    ours = [name for name in named_in(path) if name.split('.')[0] == 'rotorsoil_ros']
    assert [name for name in ours if wing_of(name) not in allowed] == []


@pytest.mark.parametrize('path', ROOMS, ids=name_of)
def test_library_is_imported_in_its_wing_only(path):
    wing = wing_of(name_of(path))
    assert [name for name in imported_by(path)
            if wing not in OWNERS.get(name.split('.')[0], {wing})] == []


@pytest.mark.parametrize('wing', sorted(DAG))
def test_wing_imports_without_what_is_above_it(wing):
    if wing == 'screen':
        pytest.importorskip('rerun', reason='rerun-sdk is optional')
    rooms = [name_of(path) for path in ROOMS if wing_of(name_of(path)) == wing
             and path.name != '__main__.py']
    code = (f'import sys\nsys.modules.update(dict.fromkeys({sorted(blocked_in(wing))}))\n'
            f'for room in {rooms}: __import__(room)')
    done = subprocess.run([sys.executable, '-c', code], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def blocked_in(wing):
    """Return what a wing has to do without: other wings and what belongs to them."""
    wings = {f'rotorsoil_ros.{name}' for name in DAG if name not in below(wing)}
    return wings | {name for name, owners in OWNERS.items() if not owners & below(wing)} - {'csv'}


def test_no_wing_is_crowded_and_none_is_missing():
    crowded = {}
    for folder in {path.parent for path in ROOMS}:
        names = [path.stem for path in folder.glob('*.py') if path.stem != '__init__']
        firsts = Counter(name.split('_')[0] for name in names)
        if len(names) > MOST_ROOMS or max(firsts.values(), default=0) > 2:
            crowded[folder.name] = len(names), firsts.most_common(1)
    assert crowded == {}


def test_no_class_or_constant_is_defined_twice():
    where = defaultdict(list)
    for path in ROOMS:
        for node in ast.parse(path.read_text()).body:
            names = [node.name] if isinstance(node, ast.ClassDef) else [
                target.id for target in getattr(node, 'targets', [])
                if isinstance(target, ast.Name)]
            for name in names:
                if name[0] != '_' and (isinstance(node, ast.ClassDef) or name.isupper()):
                    where[name].append(name_of(path))
    twice = {name: rooms for name, rooms in where.items() if len(rooms) > 1}
    assert twice == {}


@pytest.mark.parametrize('path', [
    path for path in ROOMS if wing_of(name_of(path)) not in (BASE, 'cli')
    and path.name != '__init__.py'], ids=name_of)
def test_room_is_worth_its_door(path):
    assert len(path.read_text().splitlines()) >= SHORTEST_ROOM


@pytest.mark.parametrize('path', ROOMS, ids=name_of)
def test_room_fits_in_one_sitting(path):
    assert len(path.read_text().splitlines()) <= LONGEST_ROOM


def test_units_is_the_only_60():
    sixties = [f'{name_of(path)}:{node.lineno}' for path in ROOMS if path.name != 'units.py'
               for node in ast.walk(ast.parse(path.read_text()))
               if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Mult | ast.Div)
               and {60, 30, 3600} & {getattr(side, 'value', None)
                                     for side in (node.left, node.right)
                                     if isinstance(side, ast.Constant)}]
    assert sixties == []


# What takes a string apart at an underscore, and what tells a part by how a name ends.
AT_UNDERSCORES = {'split', 'rsplit', 'partition', 'rpartition'}
BY_ENDS = {'endswith', 'startswith', 'removesuffix', 'removeprefix'}
ENDS = re.compile(r'_?(journal|housing)?_?(x|y|z|rx|ry|rz)?')
SPELLED = re.compile(r"f'.*_(journal|housing)(_.*)?'|f'.+\}_(\{(axis|dof)\}|x|z|rx|ry|rz)'")


def channels_spelled_in(path):
    """Yield the lines on which a room makes a channel of strings or takes it apart."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.args:
            first = getattr(node.args[0], 'value', None)
            if (node.func.attr in AT_UNDERSCORES and first == '_') or (
                    node.func.attr in BY_ENDS and isinstance(first, str) and first
                    and ENDS.fullmatch(first)):
                yield node.lineno
        elif isinstance(node, ast.Subscript):
            if ast.unparse(node.value).split('.')[-1] == 'channel':
                yield node.lineno
        elif isinstance(node, ast.JoinedStr) and SPELLED.fullmatch(ast.unparse(node)):
            yield node.lineno


@pytest.mark.parametrize('path', [path for path in ROOMS if path.name != 'channel.py'],
                         ids=name_of)
def test_no_room_takes_a_channel_apart(path):
    assert list(channels_spelled_in(path)) == []


@pytest.mark.parametrize('line', [
    "axis = name.rpartition('_')[2]", "turns = name.rsplit('_', 1)[1]", 'axis = channel[-1]',
    "moving = name.endswith('_x')", "kind = motion.startswith('housing')",
    "name = f'{bearing.name}_housing_{axis}'", "name = f'{disc}_{axis}'", "name = f'{disc}_x'",
    "label = name.removesuffix('_journal')"])
def test_channel_that_is_taken_apart_is_seen(line, tmp_path):
    (tmp_path / 'room.py').write_text(line)
    assert list(channels_spelled_in(tmp_path / 'room.py')) == [1]


def test_nothing_below_the_node_reads_the_clock():
    readers = {name_of(path) for path in ROOMS if wing_of(name_of(path))
               not in ('node', 'cli', 'testing')
               and {'time', 'datetime'} & set(imported_by(path))}
    # One writes stamps as dates, the other reads dates as stamps.
    assert readers <= {'rotorsoil_ros.bags.recover', 'rotorsoil_ros.bags.tables.cells'}


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
