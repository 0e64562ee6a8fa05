"""Probes that look at the shaft from one side, and those that move with a housing."""

from dataclasses import replace
import math

import numpy as np
import pytest

from rotorsoil_ros.errors import RotorSoilError
from rotorsoil_ros.rotor.shaft import crossed, Probe

from machines import elastic_machine

LEFT = Probe('p45l', 0.1, -0.25 * math.pi, 'one')
RIGHT = Probe('p45r', 0.1, 0.25 * math.pi, 'one')
UNBALANCE = np.array([1e-3, 2e-3j, 3e-4])
SPEED = np.array([80.0, 210.0, 600.0])


def probed(*probes):
    """Return two blocks, bearings on pedestals and some probes more."""
    machine = elastic_machine()
    return replace(machine, rotor=replace(machine.rotor,
                                          probes=(*machine.rotor.probes, *probes)))


def motion_of(machine, found, place):
    """Return the motion over (x, z) of a place, (n, 2)."""
    columns = [machine.channels.index(f'{place}_{axis}') for axis in 'xz']
    return found.displacement[:, columns]


def test_probe_at_an_angle_sees_the_motion_along_its_direction_less_that_of_its_housing():
    machine = probed(LEFT, RIGHT, Probe('up', 0.1, 0.0), Probe('both', 0.1, None, 'one'))
    found = machine.unbalance_response(SPEED, UNBALANCE)
    x, z = (motion_of(machine, found, 'one_journal') - motion_of(machine, found,
                                                                 'one_housing')).T
    root = math.sqrt(0.5)
    seen = {str(channel): found.displacement[:, index]
            for index, channel in enumerate(machine.channels)}
    np.testing.assert_allclose(seen['p45r'], root * (z + x), rtol=1e-12)
    np.testing.assert_allclose(seen['p45l'], root * (z - x), rtol=1e-12)
    np.testing.assert_allclose(seen['up'], seen['one_journal_z'], rtol=1e-12)
    np.testing.assert_allclose(seen['both_x'], x, rtol=1e-12)
    np.testing.assert_allclose(seen['both_z'], z, rtol=1e-12)


def test_probe_and_force_change_places():
    # Maxwell: what a probe sees of a force elsewhere is what is there of a force along the probe,
    # the reaction of which is on the housing. At rest, and cross terms symmetric, for reciprocity.
    machine = probed(RIGHT)
    bearings = [replace(one, stiffness=1e8 * np.eye(2), damping=1e4 * np.eye(2), pedestal=None)
                for one in machine.rotor.bearings]
    machine = replace(machine, rotor=replace(machine.rotor, bearings=tuple(bearings)))
    omega = np.array([50.0, 300.0])
    names = 'p45r', 'wheel_x'
    there, back = (machine.frequency_response(omega, speed=0.0, channel=force).displacement[
        :, machine.channels.index(seen)] for force, seen in (names, names[::-1]))
    np.testing.assert_allclose(there, back, rtol=1e-10)


def test_other_channels_do_not_feel_a_probe():
    plain, more = probed(), probed(LEFT)
    found = more.unbalance_response(SPEED, UNBALANCE)
    kept = [index for index, channel in enumerate(more.channels) if channel.station != 'p45l']
    expected = plain.unbalance_response(SPEED, UNBALANCE)
    np.testing.assert_allclose(found.displacement[:, kept], expected.displacement, rtol=1e-9)
    np.testing.assert_array_equal(more.transmits_force[kept], plain.transmits_force)


def test_two_crossed_probes_tell_the_orbit():
    [pair] = crossed([LEFT, Probe('apart', 0.5, 0.0), RIGHT, replace(RIGHT, name='parallel')])
    assert (pair.name, pair.channels) == ('p45l_p45r', ('p45l', 'p45r'))
    orbit = np.array([3.0 - 1.0j, 2.0j])
    seen = [probe.directions[0] @ orbit for probe in (LEFT, RIGHT)]
    np.testing.assert_allclose(pair.turn @ seen, orbit, rtol=1e-12)


def test_probe_on_no_housing_is_refused():
    with pytest.raises(RotorSoilError, match='relative_to of p45l must be one of one, two, three,'
                                             ' got four'):
        probed(replace(LEFT, relative_to='four'))
