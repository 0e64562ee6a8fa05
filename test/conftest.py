"""One thread, no user's cache, no other machine's ROS graph; a machine tabulated once."""

import os

os.environ['OMP_NUM_THREADS'] = '1'  # before numpy: small solves are 10 times slower with two
os.environ['MPLBACKEND'] = 'Agg'
os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'

from pathlib import Path

from hypothesis import settings
import numpy as np
import pytest

from rotorsoil_ros.case.machine import Machine
from rotorsoil_ros.rotor import beam

PAPER_ROTOR = Path(__file__).parents[1] / 'config' / 'paper_rotor.yaml'

# The same examples every time, so that a change is judged by what it changes; new ones are
# looked for with --hypothesis-profile=search.
settings.register_profile('busy machine', deadline=None, derandomize=True)
settings.register_profile('search', deadline=None)
settings.load_profile('busy machine')


@pytest.fixture(autouse=True)
def _own_cache(tmp_path, monkeypatch):
    monkeypatch.setenv('ROTORSOIL_CACHE', str(tmp_path / 'cache'))


@pytest.fixture(scope='session')
def case_file():
    return PAPER_ROTOR


@pytest.fixture(scope='session')
def cache(tmp_path_factory):
    return tmp_path_factory.mktemp('tables')


@pytest.fixture(scope='session')
def machine(cache):
    return Machine.load(PAPER_ROTOR, cache_directory=cache)


@pytest.fixture
def no_shear(monkeypatch):
    """Make shafts stiff in shear, as Euler, Bernoulli and Rayleigh have them."""
    monkeypatch.setattr(beam, 'shear_coefficient', lambda nu, ratio: np.full_like(nu, 1e9))
