"""Everything offline runs where neither rclpy nor a message package is installed."""

import os
from pathlib import Path
import subprocess
import sys

import pytest

from house import ROS
from records import import_run_up

ROOT = Path(__file__).parents[1]
ROTOR_KIT = ROOT / 'config' / 'rk4_rotor_kit.yaml'


@pytest.fixture
def without_ros(tmp_path, cache):
    """Return what runs a verb where no package of ROS can be imported, nor by its children."""
    blocked = tmp_path / 'blocked'
    blocked.mkdir()
    (blocked / 'sitecustomize.py').write_text(
        f'import sys\nsys.modules.update(dict.fromkeys({sorted(ROS)}))\n')
    path = os.pathsep.join([str(blocked), *filter(None, [os.environ.get('PYTHONPATH')])])
    environment = {**os.environ, 'PYTHONPATH': path, 'ROTORSOIL_CACHE': str(cache)}

    def run(*arguments):
        return subprocess.run(
            [sys.executable, *map(str, arguments)], cwd=tmp_path, env=environment,
            capture_output=True, text=True)
    assert run('-c', 'import rclpy').returncode != 0
    return run


def test_offline_verbs_need_no_ros(without_ros, tmp_path):
    import_run_up(tmp_path / 'profile.mcap')
    for arguments in (
            ['check', ROTOR_KIT],
            ['response', ROTOR_KIT, '--rpm', '800:1200:5', '-o', 'response.csv'],
            ['predict', ROTOR_KIT, 'profile.mcap', '-o', 'log.mcap'],
            ['compare', 'log.mcap', ROTOR_KIT, '-o', 'compared']):
        done = without_ros('-m', 'rotorsoil_ros.cli', *arguments)
        # The kit is not what its nominal bearings say: the verdict of `compare` is 1.
        assert done.returncode == (arguments[0] == 'compare'), done.stderr
        assert 'Traceback' not in done.stderr
    log = (tmp_path / 'log.mcap').read_bytes()
    (tmp_path / 'cut.mcap').write_bytes(log[:len(log) * 3 // 4])
    done = without_ros('-m', 'rotorsoil_ros.cli', 'recover', 'cut.mcap', '-o', 'saved.mcap')
    assert done.returncode == 0, done.stderr
    assert (tmp_path / 'saved.mcap').exists()


def test_wire_and_bags_are_imported_without_ros(without_ros):
    rooms = ('feeds.halls', 'feeds.mqtt', 'feeds.opcua',
             'wire.messages', 'wire.handlers', 'bags.recorder', 'bags.feed', 'bags.comparison',
             'bags.predict', 'bags.synthetic', 'bags.retention')
    done = without_ros('-c', f'for room in {rooms}: __import__(f"rotorsoil_ros.{{room}}")')
    assert done.returncode == 0, done.stderr


def test_a_feed_of_other_halls_needs_no_ros(without_ros):
    """The address is one that nobody has: how far it gets tells that no part of ROS is missing."""
    done = without_ros('-m', 'rotorsoil_ros.cli', 'feed', 'opcua', '--zenoh', 'tcp/127.0.0.1:1',
                       '--endpoint', 'opc.tcp://192.0.2.1:1', '--insecure')
    assert done.returncode == 2
    assert done.stderr.splitlines()[-1].startswith('--endpoint: opc.tcp://192.0.2.1:1: ')
    done = without_ros('-m', 'rotorsoil_ros.cli', 'feed', 'opcua')
    assert done.returncode == 2
    assert "is not installed: pip install 'rotorsoil_ros[ros]'" in done.stderr
