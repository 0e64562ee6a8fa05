import numpy as np
import pytest

from rotorsoil_ros.arrays import inside
from rotorsoil_ros.errors import OutOfTableError

WORDS = {'name': 'frequency', 'unit': 'Hz', 'where': 'what was solved'}


def test_rounding_beyond_an_end_of_a_table_is_the_end():
    given = np.array([[1.0 - 1e-15, 2.0], [2.5, 3.0 + 1e-15]])
    np.testing.assert_array_equal(inside(given, (1.0, 3.0), **WORDS), [[1.0, 2.0], [2.5, 3.0]])


@pytest.mark.parametrize('beyond', [0.999, 3.001, -2.0, np.inf, -np.inf, np.nan])
def test_nothing_else_beyond_it_passes(beyond):
    with pytest.raises(OutOfTableError, match=r'frequency must be in \[2, 6\] Hz, what was solved'
                                              rf', got {2.0 * beyond:g}'):
        inside(np.array([2.0, beyond]), (1.0, 3.0), shown=lambda value: 2.0 * value, **WORDS)
