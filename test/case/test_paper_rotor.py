"""config/paper_rotor.yaml against the seed paper."""

from pathlib import Path

import numpy as np
import pytest

from rotorsoil_ros.case.config import load
from rotorsoil_ros.case.models import coupled_model
from rotorsoil_ros.units import hz_to_rad_s

PATH = Path(__file__).parents[2] / 'config' / 'paper_rotor.yaml'
NO_CACHE = Path('no cache is needed for cones')


def test_rotor_weighs_what_the_paper_prints_and_the_block_ten_times_that():
    case = load(PATH)
    assert case.rotor.mass == pytest.approx(4.2, rel=1e-4)  # digits of length and diameter
    assert case.foundations[0].mass == pytest.approx(10.0 * case.rotor.mass, rel=1e-4)


@pytest.mark.parametrize('expected_hz', [48.86, 129.48])
def test_forward_critical_speed_on_a_rigid_base_is_that_of_the_design_note(expected_hz):
    case = load(PATH, ['support.model=rigid'])
    model = coupled_model(case, NO_CACHE)
    speed = hz_to_rad_s(np.linspace(expected_hz - 0.2, expected_hz + 0.2, 4001))
    response = model.unbalance_response(speed, case.unbalance).displacement
    peak = speed[np.abs(response[:, model.channels.index('disc_2_z')]).argmax()]
    assert peak == pytest.approx(hz_to_rad_s(expected_hz), abs=hz_to_rad_s(0.01))  # its digits
