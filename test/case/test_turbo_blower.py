"""config/turbo_blower.yaml against the story in its comments."""

from pathlib import Path

import numpy as np
import pytest

from rotorsoil_ros.case.machine import Machine
from rotorsoil_ros.machine.modes.stability import stability
from rotorsoil_ros.units import GRAVITY, rpm_to_rad_s

PATH = Path(__file__).parents[2] / 'config' / 'turbo_blower.yaml'


@pytest.fixture(scope='module')
def blower(tmp_path_factory):
    return Machine.load(PATH, cache_directory=tmp_path_factory.mktemp('films'))


def test_rotor_weighs_what_its_bearings_carry(blower):
    rotor = blower.case.rotor
    assert rotor.mass == pytest.approx(400.0, rel=0.03)
    loads = [journal.states.carried for journal in blower.case.journals]
    assert sum(loads) == pytest.approx(rotor.mass * GRAVITY, rel=1e-9)
    assert loads[0] > loads[1], 'the hub hangs over at the drive end'


def test_films_are_thick_and_the_block_is_heavy(blower):
    for journal in blower.case.journals:
        assert journal.states.least.min() > 2.0 * journal.least_film
        assert journal.states.specific_load < 1e6
    [block] = blower.case.foundations
    assert block.mass == pytest.approx(2.4 * 3.2 * 1.4 * 2400.0)


def test_both_impellers_share_g_2_5(blower):
    permissible = 2.5e-3 / rpm_to_rad_s(3900.0) * blower.case.rotor.mass
    np.testing.assert_allclose(np.abs(blower.case.unbalance), [0.0, *[0.5 * permissible] * 2])


def test_lemon_bores_keep_it_from_whirling(blower):
    # On two plain halves the same machine whirls below one and a half times its highest speed.
    low, high = blower.case.speed_range
    assert stability(blower.model, (low, 1.5 * high)).instabilities == ()
    halves = ('{type: axial_groove, diameter: 0.1, length: 0.06, radial_clearance: 90.0e-6, '
              'oil: {grade: VG46, temperature: 55.0}}')
    case = blower.case.changed([f'rotor.bearings.{index}.journal={halves}' for index in (0, 1)])
    [first] = stability(Machine(case, blower.directory).model, (low, 1.5 * high)).instabilities
    assert first.name.startswith('fluid-film whirl')
    assert first.low > 1.25 * high
