"""One thread, no user's cache, no other machine's ROS graph."""

import os

os.environ['OMP_NUM_THREADS'] = '1'  # before numpy: small solves are 10 times slower with two
os.environ['MPLBACKEND'] = 'Agg'
os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'

import pytest


@pytest.fixture(autouse=True)
def _own_cache(tmp_path, monkeypatch):
    monkeypatch.setenv('ROTORSOIL_CACHE', str(tmp_path / 'cache'))
