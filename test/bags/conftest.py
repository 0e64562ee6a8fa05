"""A log under way."""

import pytest

from rotorsoil_ros.bags.retention import new_directory
from rotorsoil_ros.bags.writer import BagWriter


@pytest.fixture
def bag(tmp_path):
    return BagWriter(new_directory(tmp_path, 'run'))
