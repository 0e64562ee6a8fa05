"""What is drawn of a foundation that bends is where it is, and moves as its channels say."""

from dataclasses import replace
import math

from foundations import frame_elements, frame_support, raft_body, raft_support
import numpy as np
import pytest

from rotorsoil_ros.channel import across, HOUSING
from rotorsoil_ros.machine.flexible.body import EACH, WINKLER
from rotorsoil_ros.machine.flexible.lattice import Lattice
from rotorsoil_ros.machine.placement import Placement
from rotorsoil_ros.units import hz_to_rad_s


@pytest.fixture(scope='module')
def frame():
    body = replace(frame_elements().body(hz_to_rad_s(30.0), loss=0.04), bed=EACH)
    # Footings of 1.5 x 1.5 m.
    return frame_support(replace(body, dofs=tuple(replace(dof, area=2.25) for dof in body.dofs)))


@pytest.fixture(scope='module')
def raft():
    return raft_support(replace(raft_body(), bed=WINKLER))


def channels(support):
    """Return the channels of housings, contacts and probes of a support."""
    return [*(channel for mount in support.mounts
              for channel in across(mount.bearing.name, HOUSING)),
            *(channel for part in support.members for channel in part.contacts),
            *(channel for part in support.members for channel in part.probes)]


def lattice(support):
    return Lattice.of(support.foundations[0], support.mounts, channels(support))


def test_a_frame_that_moves_as_one_is_drawn_unbent(frame):
    drawn, [part] = lattice(frame), frame.members
    shift, turn = np.array([1.0, -2.0, 3.0]), np.array([0.3, 0.2, -0.1])
    # Its rows say what rigid motion about the middle of the contact does at each point.
    moved = drawn.moved(part.rows @ np.concatenate([shift, turn]))
    middle = np.array([0.0, frame.foundations[0].centre_y, 0.0])
    expected = shift + np.cross(turn, drawn.places - middle)
    # Housings say x and z; everything else all three.
    seats = [name.startswith('bearing') for name in drawn.named]
    expected[:len(seats)][seats, 1] = 0.0
    np.testing.assert_allclose(moved, expected, atol=1e-12)
    assert len(drawn.places) == len(drawn.named) + 16  # four corners each


def test_footings_apart_are_joined_by_the_frame_alone(frame):
    drawn = lattice(frame)
    feet = {drawn.named.index(f'patch_{number}') for number in (1, 2, 3, 4)}
    assert not [edge for edge in drawn.edges.tolist() if set(edge) <= feet]
    assert {foot for edge in drawn.edges.tolist() for foot in edge} >= feet
    beams = [edge for edge in drawn.edges.tolist() if max(edge) < len(drawn.named)
             and not set(edge) & feet]
    assert len(beams) == 3  # between four bearings in a row, which are all that is known above
    together = replace(frame.foundations[0], body=replace(frame.foundations[0].body, bed=WINKLER))
    edges = Lattice.of(together, frame.mounts, channels(frame)).edges.tolist()
    assert [edge for edge in edges if set(edge) <= feet]


def test_patches_of_a_raft_are_joined_to_their_neighbours(raft):
    drawn = lattice(raft)
    places = drawn.places[:len(drawn.named)]
    on_ground = np.flatnonzero(places[:, 2] == 0.0).tolist()
    assert len(on_ground) == 12
    found = [math.dist(places[one], places[other]) for one, other in drawn.edges.tolist()
             if one in on_ground and other in on_ground]
    # Six by two patches of 2 x 2 m: five and five along, six across, none aslant.
    assert found == pytest.approx([2.0] * 16)
    stalks = [edge for edge in drawn.edges.tolist() if not set(edge) <= set(on_ground)]
    # Each of four seats on the patch below it, which reaches half a metre farther out.
    assert [math.dist(places[seat], places[patch]) for seat, patch in stalks] == pytest.approx(
        [math.hypot(0.5, places[0, 2])] * 4)


def test_seats_of_a_turned_machine_move_along_its_own_axes(raft):
    here = Placement(heading=math.radians(90.0))
    mounts = [replace(mount, place=here) for mount in raft.mounts]
    drawn = Lattice.of(raft.foundations[0], mounts, channels(raft))
    motion = np.zeros(len(channels(raft)))
    motion[channels(raft).index('fan_1_b1_housing_x')] = 1.0
    moved = drawn.moved(motion)
    # Its x points along the y of the ground.
    np.testing.assert_allclose(moved[drawn.named.index('fan_1_b1')], [0.0, 1.0, 0.0], atol=1e-12)
    assert np.count_nonzero(np.abs(moved) > 1e-12) == 1


def test_places_of_which_nobody_tells_are_left_out(raft):
    known = [channel for channel in channels(raft) if channel.station != 'fan_2_b1']
    drawn = Lattice.of(raft.foundations[0], raft.mounts, known)
    assert 'fan_2_b1' not in drawn.named
    assert 'fan_2_b2' in drawn.named


@pytest.mark.parametrize('place', [
    Placement(), Placement(1.0, -2.0, 0.7), Placement(heading=2.0, is_upright=True)])
def test_axes_are_those_of_a_seat_and_make_a_right_handed_frame(place):
    axes = place.axes
    rows = replace(place, x=0.0, y=0.0).seat_rows(position=0.0, height=0.0, centre=(0.0, 0.0))
    np.testing.assert_allclose(axes[[0, 2]], rows[:, :3], atol=1e-15)
    np.testing.assert_allclose(np.cross(axes[0], axes[1]), axes[2], atol=1e-15)
    ahead = np.array(place.point(1.0)) - np.array(place.point(0.0))
    np.testing.assert_allclose(axes[1, :2], ahead, atol=1e-15)
