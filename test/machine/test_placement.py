"""Where a shaft lies or stands: seats against u + theta x r, and a machine that stands."""

import math

import numpy as np
import pytest

from rotorsoil_ros.machine.placement import Placement


@pytest.mark.parametrize('is_upright', [False, True])
@pytest.mark.parametrize('heading', [0.0, 0.7, math.pi])
def test_seat_moves_as_a_point_of_the_block(is_upright, heading):
    place = Placement(0.3, -0.4, heading, is_upright)
    rows = place.seat_rows(position=0.8, height=1.1, centre=(0.1, 0.2))
    cosine, sine = math.cos(heading), math.sin(heading)
    # The axes of the shaft over those of the ground; z is right-handed to x and the shaft.
    across = np.array([cosine, sine, 0.0])
    along = np.array([0.0, 0.0, 1.0]) if is_upright else np.array([-sine, cosine, 0.0])
    third = np.cross(across, along)
    seat = np.array([0.3 - 0.1, -0.4 - 0.2, 1.1]) + 0.8 * along
    for column, motion in enumerate(np.eye(6)):
        moved = motion[:3] + np.cross(motion[3:], seat)
        np.testing.assert_allclose(rows[:, column], [across @ moved, third @ moved], atol=1e-15)
