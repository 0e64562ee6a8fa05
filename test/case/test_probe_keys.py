"""Keys of probes: in which direction they look, and on what they stand."""

import math
from pathlib import Path

import pytest

from rotorsoil_ros.case.config import load
from rotorsoil_ros.errors import InputError
from rotorsoil_ros.rotor.shaft import Probe

PAPER = Path(__file__).parents[2] / 'config' / 'paper_rotor.yaml'


def probes(*keys, driver=''):
    """Return the probes of the paper's machine with some keys each."""
    given = ', '.join(f'{{name: p{number}, position: 0.3, {each}}}'
                      for number, each in enumerate(keys))
    return load(PAPER, [f'rotor.probes=[{given}]', *(
        [f'rotor.driver={driver}'] if driver else [])]).rotor.probes


@pytest.mark.parametrize('key, driver, degrees', [
    ('angle_deg: 45', '', 45.0), ('angle_deg: "-30 deg"', '', -30.0),
    ('angle_deg: 45R', 'left', 45.0), ('angle_deg: 45L', 'left', -45.0),
    ('angle_deg: "45 l"', 'right', 45.0), ('angle_deg: 60R', 'right', -60.0)])
def test_direction_is_told_from_z_towards_x_or_as_the_driver_sees_it(key, driver, degrees):
    [found] = probes(key, driver=driver)
    assert found == Probe('p0', 0.3, math.radians(degrees))
    assert found.channels == ('p0',)


def test_probe_may_stand_on_a_housing():
    [found] = probes('relative_to: bearing_2')
    assert found.relative_to == 'bearing_2'
    assert found.channels == ('p0_x', 'p0_z')


@pytest.mark.parametrize('key, driver, said', [
    ('angle_deg: 400', '', 'rotor.probes.0.angle_deg: must be between -180 and 360 deg, from z '
                           'towards x, got 400'),
    ('angle_deg: 190L', 'left', 'rotor.probes.0.angle_deg: must be at most 180 deg to one side, '
                                'got 190L'),
    ('angle_deg: 45X', 'left', 'rotor.probes.0.angle_deg: must be degrees from z towards x, or '
                               "45L or 45R as seen from the driver, got '45X'"),
    ('angle_deg: 45L', '', 'rotor.driver: is missing, left or right: 45L of '
                           'rotor.probes.0.angle_deg is as seen from there'),
    ('relative_to: bearing_9', '', 'rotor.probes.0.relative_to: relative_to of p0 must be one of '
                                   'bearing_1, bearing_2, got bearing_9'),
    ('angel_deg: 45', '', 'rotor.probes.0.angel_deg: is not a known key; did you mean '
                          'angle_deg?')])
def test_bad_probes_are_one_line_each(key, driver, said):
    with pytest.raises(InputError) as caught:
        probes(key, driver=driver)
    assert str(caught.value) == f'{PAPER}: {said}'
