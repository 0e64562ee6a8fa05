"""A diagram in a plane: values lie where their axis says, lines break where nothing is known."""

import numpy as np
import pytest

pytest.importorskip('rerun', reason='rerun-sdk is optional')

from rotorsoil_ros.screen.chart import Axis, curve, round_up


def test_a_linear_axis_is_linear_and_keeps_what_is_beyond_at_its_end():
    axis = Axis(100.0, 300.0, 0.0, 50.0)
    assert axis.place(np.array([100.0, 150.0, 300.0, 999.0])).tolist() == [0.0, 12.5, 50.0, 50.0]


def test_a_logarithmic_axis_gives_every_decade_the_same_length_and_a_tick():
    axis = Axis(0.05, 50.0, 60.0, 0.0, is_log=True)
    assert axis.ticks(3) == pytest.approx([0.1, 1.0, 10.0])
    np.testing.assert_allclose(np.diff(axis.place(np.array(axis.ticks(3)))), -20.0)
    assert axis.place(np.array([0.0])) == pytest.approx(60.0)


def test_ticks_are_round_and_inside():
    assert Axis(100.0, 1800.0, 0.0, 1.0).ticks(6) == [500.0, 1000.0, 1500.0]


@pytest.mark.parametrize('value, expected', [(1.0, 1.0), (1.01, 2.0), (49.0, 50.0), (0.3, 0.5)])
def test_rounding_goes_up_to_1_2_5(value, expected):
    assert round_up(value) == pytest.approx(expected)


def test_a_curve_breaks_where_a_value_is_missing_and_where_it_jumps():
    x = np.arange(8.0)
    y = np.array([0.0, 1.0, np.nan, 2.0, 3.0, 90.0, 91.0, np.nan])
    assert [piece[:, 0].tolist() for piece in curve(x, y, largest_step=10.0)] == [
        [0.0, 1.0], [3.0, 4.0], [5.0, 6.0]]
