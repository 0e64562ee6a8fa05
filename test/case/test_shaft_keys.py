"""Keys of what loads a shaft, what it loses, and of seals with mass or over a frequency."""

from dataclasses import asdict
from pathlib import Path

import numpy as np
import pytest

import rotorsoil_ros as rs
from rotorsoil_ros.case.config import load
from rotorsoil_ros.case.summary import derived_quantities
from rotorsoil_ros.errors import InputError
from rotorsoil_ros.ground.soil import RigidSoil
from rotorsoil_ros.rotor.shaft import ShaftDamping
from rotorsoil_ros.units import hz_to_rad_s, rpm_to_rad_s

PAPER = Path(__file__).parents[2] / 'config' / 'paper_rotor.yaml'
SEAL = ('rotor.bearings.1={name: seal, position: 0.5, inertia: {xx: 2, zz: 3, xz: 0.5}, '
        'stiffness: {speed_rpm: [0, 9000], frequency_hz: [0, 50, 150], '
        'xx: [[1e6, 2e6, 3e6], [2e6, 4e6, 6e6]], zz: [[1, 2, 3], [4, 5, 6]], '
        'zx: [[7, 7, 7], [8, 8, 8]]}, '
        'damping: {frequency_hz: [0, 200], xx: [[10, 30]], zz: [[20, 20]]}}')


def refused(*settings):
    """Return what is said of the paper's machine with some settings, without its name."""
    with pytest.raises(InputError) as caught:
        load(PAPER, settings)
    return [line.removeprefix(f'{PAPER}: ') for line in str(caught.value).splitlines()]


def test_sections_have_what_the_rotor_has_unless_they_say_their_own():
    rotor = load(PAPER, [
        'rotor.axial_force="2 kN"', 'rotor.torque=30', 'rotor.shaft.0.torque=-5',
        'rotor.internal_damping={viscous: "10 us", loss_factor: 0.01}',
        'rotor.external_damping={mass: 2.0, stiffness: 1e-6}',
        'rotor.shaft.0.external_damping={stiffness: 3e-6}']).rotor
    section = rotor.shaft[0]
    assert (section.axial_force, section.torque, rotor.drag) == (2000.0, -5.0, 2.0)
    assert asdict(section.damping) == pytest.approx(asdict(ShaftDamping(1e-5, 0.01, 0.0, 3e-6)))


def test_seal_has_mass_and_follows_speed_and_frequency():
    seal = load(PAPER, [SEAL]).rotor.bearings[1]
    speed, omega = rpm_to_rad_s(np.array([0.0, 9000.0])), hz_to_rad_s(np.array([25.0, 150.0]))
    stiffness, damping, inertia = seal.coefficients(speed, omega)
    np.testing.assert_allclose(stiffness, [[[1.5e6, 0.0], [7.0, 1.5]], [[6e6, 0.0], [8.0, 6.0]]])
    np.testing.assert_allclose(damping[:, 0, 0], [12.5, 25.0])
    np.testing.assert_array_equal(inertia[0], [[2.0, 0.5], [0.0, 3.0]])


@pytest.mark.parametrize('setting, said', [
    ('rotor.internal_damping={viscous: -1}',
     'rotor.internal_damping.viscous: must be >= 0 s, got -1'),
    ('rotor.shaft.0.internal_damping={loss_factor: 1.5}',
     'rotor.shaft.0.internal_damping.loss_factor: must be in [0, 1), got 1.5'),
    ('rotor.shaft.0.external_damping={mass: -2}',
     'rotor.shaft.0.external_damping.mass: must be >= 0 1/s, got -2'),
    ('rotor.external_damping={stiffnes: 1}',
     'rotor.external_damping.stiffnes: is not a known key; did you mean stiffness?'),
    ('rotor.torque="5 N"', "rotor.torque: must be a finite number in N m, got '5 N', which is "
                           'none of that'),
    ('rotor.axial_force=-1e7', 'rotor.axial_force: must stay below the load that buckles the '
                               'shaft, 1 times it, got 423.5')])
def test_bad_loads_and_losses_are_one_line_each(setting, said):
    [line] = refused(setting)
    assert line.startswith(said)


@pytest.mark.parametrize('old, new, said', [
    ('frequency_hz: [0, 50, 150]', 'frequency_hz: [0, 50]',
     'rotor.bearings.1.stiffness.xx.0: must have as many entries as frequency_hz, 2, got 3'),
    ('xx: [[1e6, 2e6, 3e6], [2e6, 4e6, 6e6]]', 'xx: [[1e6, 2e6, 3e6]]',
     'rotor.bearings.1.stiffness.xx: must have as many rows as speed_rpm, 2, got 1'),
    ('xx: [[10, 30]]', 'xx: [[10, 30], [10, 30]]',
     'rotor.bearings.1.damping.xx: must have one row, as there is no speed_rpm, got 2'),
    ('frequency_hz: [0, 50, 150]', 'frequency_hz: [0, 50, 40]',
     'rotor.bearings.1.stiffness.frequency_hz: must be two or more rising frequencies >= 0 Hz, '
     'got [0.0, 50.0, 40.0]'),
    ('frequency_hz: [0, 200]', 'frequency_hz: [0, 100]',
     'rotor.bearings.1.damping.frequency_hz: must cover speed_range_rpm, 1 to 150 Hz, got 0 to '
     '100'),
    ('inertia: {xx: 2, zz: 3, xz: 0.5}', 'inertia: {xx: 2}',
     'rotor.bearings.1.inertia.zz: is missing'),
    ('xx: [[10, 30]]', 'xx: [10, 30]', 'rotor.bearings.1.damping.xx.0: must be a list, got 10')])
def test_bad_coefficients_are_told_where_they_stand(old, new, said):
    assert old in SEAL
    assert said in [line[:len(said)] for line in refused(SEAL.replace(old, new))]


def test_machine_that_stands_rocks_its_block_alike_both_ways():
    # On a square block a round rotor on equal bearings has one response along x and along z.
    case = Path(__file__).parents[2] / 'config' / 'paper_rotor.yaml'
    machine = rs.load(case, **{'rotor.orientation': 'vertical', 'rotor.shaft_height': 0.2,
                               'foundations.0.centre_y': None})
    found = machine.response(rpm=[900.0, 2000.0])
    block = machine.case.foundations[0]
    assert (block.centre_x, block.centre_y) == (0.0, 0.0)
    columns = {str(name): found.displacement[:, index]
               for index, name in enumerate(found.channels)}
    x, z = columns['disc_2_x'], columns['disc_2_z']
    # Forward whirl on a round support: x follows z by a quarter of a turn.
    np.testing.assert_allclose(x, -1j * z, rtol=1e-6)
    np.testing.assert_allclose(columns['block_x'], 1j * columns['block_y'], rtol=1e-6)
    np.testing.assert_allclose(np.abs(columns['block_rx']), np.abs(columns['block_ry']), rtol=1e-6)
    assert np.abs(columns['block_z']).max() < 1e-12 * np.abs(columns['block_x']).max()


def test_shaft_that_stands_lays_no_weight_on_a_journal():
    journal = ('rotor.bearings.0={name: b, position: 0.0, journal: {type: plain, diameter: 0.02, '
               'length: 0.02, radial_clearance: 2e-5, viscosity: 0.02}}')
    assert refused(journal, 'rotor.orientation=vertical') == [
        'rotor.bearings.0.load: is missing, in N: a shaft that stands upright lays no weight on b']
    assert refused('rotor.orientation=upright') == [
        "rotor.orientation: must be 'horizontal' or 'vertical', got 'upright'"]


def test_heading_of_a_pickup_is_told_or_its_messages_tell_it():
    assert load(PAPER, ['sensors={heading_deg: 90}']).sensors.usual.heading == pytest.approx(
        0.5 * np.pi)
    assert refused('sensors={heading_deg: 400}') == [
        'sensors.heading_deg: must be between -360 and 360 deg, got 400']
    assert refused('sensors={heading_deg: 30, orientation: use}') == [
        'sensors.heading_deg: must not stand beside orientation: use, which tells it, got 30']


def test_seal_tells_below_which_frequency_it_feeds_whirl():
    # k_c / c = 2 pi 20 rad/s at the end of the range, and none of it at rest.
    cross = 1e3 * 2.0 * np.pi * 20.0
    case = load(PAPER, [
        'rotor.bearings.1={name: seal, position: 0.5, damping: {xx: 1e3, zz: 1e3}, stiffness: '
        f'{{speed_rpm: [0, 9000], xx: [1e6, 1e6], zz: [1e6, 1e6], xz: [0, {-cross}], '
        f'zx: [0, {cross}]}}}}'])
    told = dict(derived_quantities(case, (RigidSoil(),)))
    assert told['seal: alone it feeds whirl'].startswith(
        'slower than 0.1333 to 20 Hz over the speed range, 0.133 times the speed at its end')
