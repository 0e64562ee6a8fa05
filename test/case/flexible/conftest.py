"""One folder of cases for all tests of this wing."""

from flexible_cases import write_cases
import pytest


@pytest.fixture(scope='session')
def folder(tmp_path_factory):
    """Return a folder with the reference files, ground tables and both cases."""
    return write_cases(tmp_path_factory.mktemp('foundations'))
