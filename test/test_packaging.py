"""The package as colcon and pip see it."""

import configparser
from importlib.resources import files
import os
from pathlib import Path
import re
import runpy
import shlex
import shutil
import subprocess
import sys
import tarfile
from types import ModuleType, SimpleNamespace
from xml.etree import ElementTree

import pytest
import setuptools
import yaml

import rotorsoil_ros
from rotorsoil_ros.cli.arguments.parser import parse
from rotorsoil_ros.errors import BAD_INPUT

ROOT = Path(__file__).parents[1]
CASES = sorted((ROOT / 'config').glob('*.yaml'))
UNITS = sorted((ROOT / 'launch').glob('*.service'))
LIBRARY = sorted((ROOT / 'config' / 'library').glob('*.yaml'))

# What pip installs, and what package.xml calls it. The wheels of ROS stand for several packages.
ROS_NAMES = {
    'PyYAML': {'python3-yaml'}, 'mcap': {'python3-mcap-pip'},
    'scikit-fem': {'python3-scikit-fem-pip'},
    'ros-jazzy-rclpy': {'rclpy', 'lifecycle_msgs', 'rcl_interfaces'},
    'ros-jazzy-common-interfaces': {'sensor_msgs', 'std_msgs', 'std_srvs', 'diagnostic_msgs'},
    'ros-rclpy': {'rclpy'}, 'setuptools': set(),
}


@pytest.fixture
def arguments(monkeypatch):
    """Return what setup.py hands to setuptools."""
    caught = {}
    monkeypatch.setattr(setuptools, 'setup', lambda **given: caught.update(given))
    monkeypatch.chdir(ROOT)
    runpy.run_path('setup.py')
    return caught


@pytest.fixture
def package():
    return ElementTree.parse(ROOT / 'package.xml').getroot()


def test_both_worlds_know_the_same_package(arguments, package):
    assert package.findtext('name') == arguments['name'] == 'rotorsoil_ros'
    assert package.findtext('version') == arguments['version'] == rotorsoil_ros.__version__
    assert package.findtext('license') == arguments['license'] == 'Apache-2.0'
    assert package.find('export/build_type').text == 'ament_python'
    maintainer = package.find('maintainer')
    assert maintainer.get('email') == arguments['maintainer_email']
    # an address that catkin_pkg refuses would silently drop the ament hooks
    assert re.fullmatch(r'[-a-zA-Z0-9_%+]+(\.[-a-zA-Z0-9_%+]+)*@[-a-zA-Z0-9%]+(\.[-a-zA-Z0-9%]+)*'
                        r'\.[a-zA-Z]{2,}', maintainer.get('email'))


def test_every_dependency_is_named_in_both_worlds(arguments, package):
    wanted = set()
    for requirement in [*arguments['install_requires'], *arguments['extras_require']['ros']]:
        name = re.match(r'[\w-]+', requirement)[0]
        assert name == 'setuptools' or '>=' in requirement
        wanted |= ROS_NAMES.get(name, {f'python3-{name}'})
    named = {node.text for node in package.findall('exec_depend')}
    assert named - {'launch', 'launch_ros'} == wanted  # these two are not on the package index


def test_entry_points_can_be_called(arguments):
    for entry in arguments['entry_points']['console_scripts']:
        _, target = entry.split(' = ')
        module, function = target.split(':')
        path = ROOT / Path(*module.split('.'))
        source = path.with_suffix('.py') if path.with_suffix('.py').exists() else (
            path / '__init__.py')
        assert f'def {function}(' in source.read_text()


def test_the_plugin_of_pytest_is_there_under_its_own_name(arguments):
    [entry] = arguments['entry_points']['pytest11']
    name, module = entry.split(' = ')
    assert name == module  # so that `-p` of this repository and an installed one are the same
    assert (ROOT / Path(*module.split('.'))).with_suffix('.py').is_file()


def test_data_files_exist_and_hold_every_case(arguments):
    installed = dict(arguments['data_files'])
    assert installed['share/ament_index/resource_index/packages'] == ['resource/rotorsoil_ros']
    assert installed['share/rotorsoil_ros'] == ['package.xml']
    assert [Path(name).name for name in installed['share/rotorsoil_ros/config']] == [
        path.name for path in CASES]
    assert [Path(name).name for name in installed['share/rotorsoil_ros/config/library']] == [
        path.name for path in LIBRARY]
    assert {Path(name).name for name in installed['share/rotorsoil_ros/launch']} == {
        'rotorsoil.launch.py', 'rotorsoil.yaml', *(path.name for path in UNITS)}
    for sources in installed.values():
        assert all((ROOT / source).is_file() for source in sources)


def test_scripts_go_where_ros_looks_for_them():
    text = (ROOT / 'setup.cfg').read_text()
    assert text.count('=$base/lib/rotorsoil_ros') == 2


@pytest.mark.parametrize('path', CASES, ids=lambda path: path.stem)
def test_case_opens_with_its_story_and_has_a_test_of_its_name(path):
    text = path.read_text()
    assert text.startswith('# ')
    assert re.search(rf'^name: {path.stem}$', text, re.MULTILINE)
    assert list((ROOT / 'test' / 'case').rglob(f'test_{path.stem}.py'))


@pytest.mark.parametrize('path', CASES, ids=lambda path: path.stem)
def test_case_is_a_resource_of_the_package(path):
    assert (files('rotorsoil_ros') / 'config' / path.name).read_text() == path.read_text()


def test_build_holds_cases_and_types(tmp_path):
    source = tmp_path / 'source'
    shutil.copytree(ROOT, source, symlinks=True, ignore=shutil.ignore_patterns(
        '.*', 'build', 'install', 'log', '__pycache__', '*.egg-info', 'demo_output'))
    target = tmp_path / 'built'
    subprocess.run([sys.executable, 'setup.py', '--quiet', 'build_py', '--build-lib', str(target)],
                   cwd=source, check=True, capture_output=True)
    package = target / 'rotorsoil_ros'
    assert (package / 'py.typed').is_file()
    assert sorted(path.name for path in (package / 'config').glob('*.yaml')) == [
        path.name for path in CASES]
    assert sorted(path.name for path in (package / 'config' / 'library').iterdir()) == [
        path.name for path in LIBRARY]
    assert {path.relative_to(package) for path in package.rglob('*.py')} == {
        path.relative_to(ROOT / 'rotorsoil_ros')
        for path in (ROOT / 'rotorsoil_ros').rglob('*.py')}


def test_every_version_and_figure_of_the_package_is_said_once_or_alike(package):
    version = rotorsoil_ros.__version__
    citation = yaml.safe_load((ROOT / 'CITATION.cff').read_text())
    assert str(citation['version']) == version == package.findtext('version')
    assert citation['license'] == package.findtext('license')
    assert citation['title'] == package.findtext('name')
    assert {'authors', 'title', 'type'} <= set.intersection(*map(set, citation['references']))


@pytest.fixture(scope='module')
def unpacked(tmp_path_factory):
    """Return the source distribution, unpacked, and made from a copy of the repository."""
    source = tmp_path_factory.mktemp('source') / 'copy'
    shutil.copytree(ROOT, source, symlinks=True, ignore=shutil.ignore_patterns(
        '.venv', '.git', '.ross', '.lowest', '.*_cache', 'build', 'dist', 'install', 'log',
        '__pycache__', '*.egg-info', 'demo_output', '_build', 'api'))
    done = subprocess.run(
        [sys.executable, 'setup.py', '--quiet', 'sdist', '--dist-dir', str(source.parent)],
        cwd=source, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    [archive] = source.parent.glob('*.tar.gz')
    with tarfile.open(archive) as content:
        safe = {'filter': 'data'} if hasattr(tarfile, 'data_filter') else {}  # not in 3.11.3
        content.extractall(source.parent / 'unpacked', **safe)
    [top] = (source.parent / 'unpacked').iterdir()
    return top


def test_source_distribution_holds_what_the_repository_holds(unpacked):
    listed = subprocess.run(['git', 'ls-files'], cwd=ROOT, capture_output=True, text=True)
    if listed.returncode != 0:
        pytest.skip('not a git checkout')
    kept = {str(path.relative_to(unpacked)) for path in unpacked.rglob('*')}
    forge = {'.gitignore', '.github/workflows/tests.yml', 'rotorsoil_ros/config'}
    assert set(listed.stdout.splitlines()) - kept - forge == set()
    config = unpacked / 'rotorsoil_ros' / 'config'
    assert sorted(path.name for path in config.glob('*.yaml')) == [path.name for path in CASES]
    assert (config / 'library').is_dir()


def test_source_distribution_passes_its_tests(unpacked):
    environment = {**os.environ, 'PYTHONPATH': str(unpacked)}
    done = subprocess.run(
        [sys.executable, '-m', 'pytest', '-q', '-W', 'ignore::DeprecationWarning',
         'test/test_units.py', 'test/test_verification.py',
         'test/test_repository.py', 'test/rotor', 'test/case/test_plant_fan.py'],
        cwd=unpacked, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout
    assert 'skipped' not in done.stdout


def test_forge_and_ci_call_what_make_calls():
    workflow = yaml.safe_load((ROOT / '.github' / 'workflows' / 'tests.yml').read_text())
    matrix = workflow['jobs']['test']['strategy']['matrix']['python']
    assert matrix == ['3.11', '3.12', '3.13']
    steps = [step.get('run', '') for job in workflow['jobs'].values() for step in job['steps']]
    assert {'make test PYTHON=python', 'make docs PYTHON=python', '.ci/lowest'} <= set(steps)
    assert 'make test' in (ROOT / '.ci' / 'run').read_text()
    targets = set(re.findall(r'^(\w+):', (ROOT / 'Makefile').read_text(), re.MULTILINE))
    assert {'demo', 'test', 'docs', 'bench', 'clean'} <= targets


def test_launch_file_is_python():
    for path in (ROOT / 'launch').glob('*.py'):
        compile(path.read_text(), str(path), 'exec')
        assert 'def generate_launch_description(' in path.read_text()


@pytest.fixture
def launched(monkeypatch):
    """Return what the launch file starts, with stand-ins for packages that pip does not have."""
    def given(name):
        return SimpleNamespace(perform=lambda context: context[name])

    stand_ins = {
        'launch': {'LaunchContext': dict, 'LaunchDescription': list},
        'launch.actions': {'DeclareLaunchArgument': lambda name, **said: (name, said),
                           'OpaqueFunction': lambda function: function},
        'launch.substitutions': {'LaunchConfiguration': given},
        'launch_ros': {}, 'launch_ros.actions': {'Node': lambda **said: said}}
    for name, holds in stand_ins.items():
        module = ModuleType(name)
        vars(module).update(holds)
        monkeypatch.setitem(sys.modules, name, module)
    file = runpy.run_path(str(ROOT / 'launch' / 'rotorsoil.launch.py'))
    *arguments, start = file['generate_launch_description']()
    defaults = {name: said['default_value'] for name, said in arguments}

    def run(**asked):
        return start({**defaults, **asked})
    return run


@pytest.mark.parametrize('asked, machine, case', [
    ({}, 'paper_rotor', 'paper_rotor'), ({'case': 'plant_fan'}, 'plant_fan', 'plant_fan'),
    ({'machine': 'plant_fan'}, 'plant_fan', 'plant_fan'),
    ({'case': '{}'}, 'mill_fan_3', '{}'), ({'case': '{}', 'machine': 'fan'}, 'fan', '{}'),
    ({'case': '/nowhere/Fan 2.yaml'}, 'fan_2', '/nowhere/Fan 2.yaml')])
def test_a_launched_machine_is_called_as_its_case_says(launched, tmp_path, asked, machine, case):
    path = tmp_path / 'whatever.yaml'
    path.write_text('name: Mill fan-3\nsoil: {}\n')
    [node] = launched(**{name: value.format(path) for name, value in asked.items()})
    assert node['parameters'] == [{
        'machines': [machine], f'{machine}.case': case.format(path), 'log.directory': ''}]
    assert re.fullmatch('[a-z][a-z0-9_]*', machine)


def test_launched_parameters_replace_all_else(launched):
    [node] = launched(params='plant.yaml', case='fan.yaml', namespace='/hall_2')
    assert (node['parameters'], node['namespace']) == (['plant.yaml'], '/hall_2')


def test_one_launch_file_starts_a_node_for_each_hall(launched):
    """What it starts is `rotorsoil_node` in a namespace, as `test_two_halls_...` of the feeds."""
    nodes = launched(case='plant_fan', machine='fan', namespace='hall_1,hall_2')
    assert [node['namespace'] for node in nodes] == ['hall_1', 'hall_2']
    assert nodes[0]['parameters'] == nodes[1]['parameters'] == [
        {'machines': ['fan'], 'fan.case': 'plant_fan', 'log.directory': ''}]
    assert {(node['executable'], node['name']) for node in nodes} == {
        ('rotorsoil_node', 'rotorsoil')}


def test_containers_start_what_is_installed_from_what_is_there(arguments):
    """Nothing here builds an image: what can be held against the repository is."""
    dockerfile = (ROOT / 'containers' / 'Dockerfile').read_text()
    copied = [name for line in re.findall(r'^COPY (.+) \S+$', dockerfile, re.MULTILINE)
              for name in line.split()]
    assert copied
    assert all((ROOT / name).exists() for name in copied)
    compose = yaml.safe_load((ROOT / 'containers' / 'compose.yaml').read_text())
    extras = re.findall(r'^ARG EXTRAS=(.+)$', dockerfile, re.MULTILINE)
    scripts = [entry.split(' = ')[0] for entry in arguments['entry_points']['console_scripts']]
    known = {'broker': 'mosquitto', 'viewer': 'rerun'}
    for name, service in compose['services'].items():
        program, *given = shlex.split(service['command'])
        assert program == known.get(name) or program in scripts
        if program == 'rotorsoil':
            assert parse(given).run.startswith('live.feed:')
        extras += [service.get('build', {}).get('args', {}).get('EXTRAS', 'ros')]
        for volume in service.get('volumes', ()):
            source = volume.split(':')[0]
            assert source in compose['volumes'] or (ROOT / 'containers' / source).is_file()
        for port in service.get('ports', ()):
            assert port.startswith('127.0.0.1:')
    assert {extra for each in extras for extra in each.split(',')} <= set(
        arguments['extras_require'])


def test_changelog_is_one_for_this_package():
    lines = (ROOT / 'CHANGELOG.rst').read_text().splitlines()
    assert lines[1] == 'Changelog for package rotorsoil_ros'
    assert len(lines[0]) == len(lines[2]) == len(lines[1])


@pytest.mark.parametrize('path', UNITS, ids=lambda path: path.stem)
def test_systemd_unit_starts_what_is_installed_and_knows_its_exit_status(arguments, path):
    unit = configparser.ConfigParser(interpolation=None)
    unit.optionxform = str
    unit.read(path)
    service = unit['Service']
    program, *given = service['ExecStart'].split()
    scripts = [entry.split(' = ')[0] for entry in arguments['entry_points']['console_scripts']]
    assert Path(program).name in scripts
    if Path(program).name == 'rotorsoil':
        assert parse(given).run.startswith('live.feed:')
    assert int(service['RestartPreventExitStatus']) == BAD_INPUT
    assert service['Restart'] == 'on-failure'
