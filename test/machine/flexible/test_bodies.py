"""A foundation that bends answers as finite elements of all of it do."""

from dataclasses import replace
import math

from foundations import (
    apart,
    bearing,
    FOOTING,
    frame_elements,
    frame_support,
    LOSS,
    off,
    PATCH,
    published,
    raft_body,
    raft_support,
    Springs,
)
import numpy as np
import pytest
import scipy.linalg

from rotorsoil_ros.errors import RotorSoilError
from rotorsoil_ros.ground.bed import UnderRigid, WinklerBed
from rotorsoil_ros.ground.cone import ConeModel
from rotorsoil_ros.ground.soil import Rectangle, RigidSoil, Soil
from rotorsoil_ros.machine.coupled import CoupledModel
from rotorsoil_ros.machine.damping import DampingSplitter, SOIL, STRUCTURE
from rotorsoil_ros.machine.flexible.body import CONTACT, Dof, FlexibleBody, SEAT
from rotorsoil_ros.machine.flexible.part import Mount
from rotorsoil_ros.machine.foundation import Foundation
from rotorsoil_ros.machine.modes.natural import natural_frequencies
from rotorsoil_ros.machine.modes.spectrum import SpectrumSolver
from rotorsoil_ros.machine.placement import Placement
from rotorsoil_ros.machine.support import Support
from rotorsoil_ros.rotor.bearing import Bearing

from machines import paper_rotor, work_put_in

TURN = 2.0 * np.pi
SOME = TURN * np.array([2.0, 8.0, 21.0, 33.0, 50.0])


@pytest.fixture(scope='module')
def elements():
    """Return the matrices of the frame."""
    return frame_elements()


@pytest.fixture(scope='module')
def frame(elements):
    """Return the frame with modes to three times 60 Hz."""
    return replace(elements.body(TURN * 180.0, loss=LOSS), bed='each')


@pytest.fixture(scope='module')
def raft():
    """Return the raft of the reference."""
    return raft_body()


def test_frame_is_within_the_reduction_of_its_matrices(frame):
    # 80 fixed modes of the reference: 0.7 % below 40 Hz and 3.9 % at worst, of 864 motions.
    support = frame_support(frame)
    omega, exact = published('frame_frf.csv', support)
    found = off(support.standing(omega).receptance, exact)
    assert found[omega < TURN * 40.5].max() < 0.007
    assert found.max() < 0.039


def test_raft_of_modes_and_residual_is_the_direct_solution(raft):
    support = raft_support(raft)
    omega, exact = published('raft_frf.csv', support)
    assert off(support.standing(omega).receptance, exact).max() < 1.8e-3


# As far above its modes as 1e6 rad/s their frequencies, and what they leave out, are round-off.
@pytest.mark.parametrize('highest, within', [(1e4, 1e-9), (1e6, 1e-6)])
def test_frame_is_its_matrices_solved_at_once(elements, highest, within):
    """Dense oracle: (K (1 + i eta) - w^2 M + S)^-1 over all 112 motions."""
    body = replace(elements.body(highest, loss=LOSS), bed='each')
    stiffness, mass = elements.stiffness.toarray(), elements.mass.toarray()
    picked = elements.pick.toarray()
    seats, contacts = picked[body.of_kind(SEAT)], picked[body.contacts]
    exact = []
    for omega in SOME:
        soil = np.linalg.inv(FOOTING.compliance(np.array([omega]))[0])
        total = stiffness * (1.0 + 1j * LOSS) - omega**2 * mass + contacts.T @ np.kron(
            np.eye(4), soil) @ contacts
        exact.append(seats @ np.linalg.solve(total, seats.T))
    found = frame_support(body).standing(SOME).receptance
    assert off(found, np.array(exact)).max() < within


def test_held_contacts_are_a_fixed_base(elements):
    """Dense oracle: motions of the contacts left out of the matrices."""
    body = replace(elements.body(1e4, loss=LOSS), bed='each')
    contacts = elements.pick.toarray()[body.contacts].argmax(axis=1)
    kept = np.setdiff1d(np.arange(112), contacts)
    stiffness, mass = (matrix.toarray()[np.ix_(kept, kept)]
                       for matrix in (elements.stiffness, elements.mass))
    seats = elements.pick.toarray()[body.of_kind(SEAT)][:, kept]
    exact = np.array([seats @ np.linalg.solve(
        stiffness * (1.0 + 1j * LOSS) - omega**2 * mass, seats.T) for omega in SOME])
    held = frame_support(body, RigidSoil()).standing(SOME).receptance
    assert off(held, exact).max() < 1e-9


@pytest.mark.parametrize('which', ['frame', 'raft'])
def test_motion_of_the_support_says_the_same_as_its_receptance(which, request):
    """The coordinates that modes are found in, solved with forces."""
    body = request.getfixturevalue(which)
    support = (frame_support if which == 'frame' else raft_support)(body)
    mass, spring = support.motion_mass, support.motion_spring
    gives = np.array([scipy.linalg.block_diag(one, np.eye(support.elastic))
                      for one in support.motion_compliance(SOME)])
    square = SOME[:, None, None] ** 2
    moves = np.linalg.solve(np.eye(len(mass)) + gives @ (spring - square * mass), gives)
    found = support.motion_rows @ moves @ support.motion_rows.T
    assert off(found, support.standing(SOME).receptance).max() < 1e-10


def test_receptance_is_reciprocal(raft):
    found = raft_support(raft).standing(SOME).receptance
    assert np.abs(found - found.transpose(0, 2, 1)).max() < 1e-13 * np.abs(found).max()


def test_stiff_raft_on_patches_is_a_rigid_block_on_their_springs(raft):
    stiff = raft.stiffer(1e12)
    support = raft_support(stiff)
    ground = UnderRigid(apart(raft, PATCH, 3))
    block = Foundation('raft', Rectangle(6.0, 2.0), 0.0, raft.mass[0, 0], 0.5,
                       tuple(raft.mass.diagonal()[3:] - raft.mass[0, 0] * np.array(
                           [0.25, 0.25, 0.0])), centre_x=0.0)
    # The seats of fan 1 stand 3 m to the left of the middle.
    rigid = Support([replace(one, foundation='raft') for one in support.bearings[:2]], 2.0,
                    [replace(block, centre_x=3.0)], [ground])
    found = support.standing(SOME).receptance[:, :4, :4]
    assert off(found, rigid.standing(SOME).receptance).max() < 1e-8


def on_one_contact(*, stiffer=1.0):
    """Return a small body on one contact: two modes and a residual about a rigid block."""
    block = Foundation('block', Rectangle(0.5, 0.5), 0.3, 42.0, 0.2, (3.0, 4.0, 5.0))
    dofs = [Dof(one.name, axis, SEAT, (0.0, one.position - 0.3, 0.6))
            for one in paper_rotor().bearings for axis in ('x', 'z')]
    dofs += [Dof('base', axis, CONTACT, (0.0, 0.0, 0.0))
             for axis in ('x', 'y', 'z', 'rx', 'ry', 'rz')]
    rows = np.array([dof.rigid_row for dof in dofs])
    shapes = 0.05 * np.random.default_rng(0).normal(size=(10, 2))
    spring = np.random.default_rng(1).normal(size=(10, 10))
    return FlexibleBody(tuple(dofs), block.mass_matrix, rows, shapes,
                        stiffer * np.array([600.0, 900.0]) ** 2,
                        1e-9 / stiffer * spring @ spring.T, np.full(2, LOSS), LOSS), block


def paper_on(body, block, soil=None):
    soil = soil or ConeModel(Soil(48e6, 0.25, 1900.0, 0.10), block.contact)
    return CoupledModel(paper_rotor(), (replace(block, body=body),), (soil,))


def test_stiff_body_on_one_contact_is_the_rigid_block():
    body, block = on_one_contact(stiffer=1e12)
    speed = np.linspace(10.0, 900.0, 60)
    found, exact = (model.unbalance_response(speed, np.array([1e-5, 2e-5])) for model in (
        paper_on(body, block), paper_on(None, block)))
    size = np.abs(exact.displacement).max(axis=0)
    assert (np.abs(found.displacement - exact.displacement) / size.max()).max() < 1e-8
    transmitted = np.isfinite(exact.force)
    assert np.abs(found.force - exact.force)[transmitted].max() < 1e-8 * np.abs(
        exact.force[transmitted]).max()


def test_body_on_one_contact_obeys_its_equation():
    """Oracle: a = (I - w^2 N' M)^-1 (N' R^T - H_cs) f with N' = N + H_cc, by itself."""
    body, block = on_one_contact()
    model = paper_on(body, block)
    omega = np.array([100.0, 400.0, 700.0])
    seats, contact = slice(0, 4), slice(4, 10)
    for one, found in zip(omega, model.support.standing(omega).receptance, strict=True):
        gain = 1.0 / (body.stiffness * (1.0 + 1j * LOSS) - one**2)
        flexibility = (body.shapes * gain) @ body.shapes.T + body.residual / (1.0 + 1j * LOSS)
        gives = model.support.ground(np.array([one]))[0] + flexibility[contact, contact]
        rigid = np.linalg.solve(
            np.eye(6) - one**2 * gives @ body.mass,
            gives @ body.rows[seats].T - flexibility[contact, seats])
        force = body.rows[seats].T + one**2 * body.mass @ rigid
        exact = flexibility[seats, seats] - flexibility[seats, contact] @ force + (
            body.rows[seats] @ rigid)
        np.testing.assert_allclose(found, exact, rtol=0, atol=1e-12 * np.abs(exact).max())


@pytest.mark.parametrize('broken, least', [
    ('residual', 0.2), ('loss of the residual', 1e-4), ('centre', 0.05), ('sign', 0.05)])
def test_what_is_broken_is_seen(raft, broken, least):
    """Each part of the formula alone: without it the reference is missed."""
    body = {'residual': replace(raft, residual=0.0 * raft.residual + 1e-14 * np.eye(44)),
            'loss of the residual': replace(raft, residual_loss=0.5),
            'centre': replace(raft, rows=raft.rows @ np.block(
                [[np.eye(3), 0.2 * np.ones((3, 3))], [np.zeros((3, 3)), np.eye(3)]])),
            'sign': replace(raft, shapes=raft.shapes * np.where(
                np.arange(44) < 8, -1.0, 1.0)[:, None])}[broken]
    support = raft_support(body)
    omega, exact = published('raft_frf.csv', support)
    assert off(support.standing(omega).receptance, exact).max() > least


def test_winkler_bed_keeps_sliding_and_heave_of_the_whole(raft):
    rows = raft.about_centre[raft.contacts]
    whole = Springs([12 * 1.5e8, 12 * 1.5e8, 12 * 1.86e8, 1.0, 1.0, 1.0], np.zeros(6), 0.05)
    bed = WinklerBed(whole, np.full(36, 1.0 / 12.0), (0, 1, 2) * 12, rows)
    under = bed.whole(np.zeros(1))[0]
    np.testing.assert_allclose(np.diag(under)[:3], np.diag(
        whole.compliance(np.zeros(1))[0])[:3], rtol=1e-12)
    with pytest.raises(RotorSoilError, match='shares along x must make one'):
        replace(bed, shares=np.full(36, 0.1))


def test_ground_that_moves_slowly_takes_the_raft_along(raft):
    support = raft_support(raft)
    standing = support.standing(np.array([1e-3]))
    loads = np.zeros((8 + len(support.places), 3), dtype=complex)
    seats, below = standing.pushed(loads, np.eye(3))
    np.testing.assert_allclose(seats[0], np.tile([[1, 0, 0], [0, 0, 1]], (4, 1)), atol=1e-9)
    motion, force = standing.blocks(np.zeros((1, 8, 3)), seats, loads, below)
    np.testing.assert_allclose(motion[0, :3], np.eye(3), atol=1e-9)
    assert np.abs(force).max() < 1.0


def test_a_mass_on_a_spring_on_a_mass_has_its_two_frequencies():
    """Closed form: w^2 of two masses, one on the other and that one on the ground."""
    lower, upper, between, below = 1000.0, 200.0, 4e7, 9e7
    # Free, the two masses are a rigid body with one mode of the spring between them.
    reduced = lower * upper / (lower + upper)
    shape = np.array([1.0 / upper, -1.0 / lower]) * np.sqrt(reduced)
    dofs = [Dof('seat', 'x', SEAT, (0, 0, 0)), Dof('seat', 'z', SEAT, (0, 0, 0))]
    dofs += [Dof('base', axis, CONTACT, (0, 0, 0)) for axis in ('x', 'y', 'z', 'rx', 'ry', 'rz')]
    shapes = np.zeros((8, 1))
    shapes[1], shapes[4] = shape
    body = FlexibleBody(
        tuple(dofs), np.diag([1200.0] * 3 + [100.0] * 3),
        np.array([dof.rigid_row for dof in dofs]), shapes, np.array([between / reduced]),
        np.zeros((8, 8)), np.zeros(1), 0.0)
    block = Foundation('block', Rectangle(1, 1), 0.0, 1.0, 0.0, (1, 1, 1), body=body)
    held = Springs([np.inf, np.inf, below, np.inf, np.inf, np.inf], np.zeros(6), 0.0)
    support = Support([Bearing('b', 0.0, 'block', np.eye(2), np.eye(2), seat='seat')], 0.0,
                      [block], [held])
    exact = np.sqrt(scipy.linalg.eigh(
        np.array([[between, -between], [-between, between + below]]), np.diag([upper, lower]),
        eigvals_only=True))
    found, _ = natural_frequencies(support, np.zeros((2, 2)), 1000.0)
    np.testing.assert_allclose(found[np.abs(found) > 1.0], exact, rtol=1e-9)


def test_damping_closes_with_what_the_unbalance_puts_in():
    """Work of the unbalance itself, force times motion of the discs, beside all that is taken."""
    body, block = on_one_contact()
    model = paper_on(body, block)
    speed, unbalance = np.array([120.0, 500.0, 700.0]), np.array([1e-5, 2e-5 + 1e-5j])
    split = DampingSplitter(model).forced(speed, unbalance)
    np.testing.assert_allclose(split.total, work_put_in(model, speed, unbalance), rtol=1e-9)
    assert np.all(split.share(STRUCTURE) > 0.0)
    assert SOIL not in split.kinds


def test_contact_that_forces_cannot_tell_apart_is_refused(raft):
    bare = replace(raft, residual=0.0 * raft.residual)
    with pytest.raises(RotorSoilError, match='forces of the 36 contacts apart'):
        _ = raft_support(bare).motion_mass


def test_modes_are_those_of_all_motions_together():
    """Oracle: eigenvalues of rotor, bearings and support at rest, without any loss."""
    body, block = on_one_contact()
    body = replace(body, loss=np.zeros(2), residual_loss=0.0)
    springs = Springs([4e7, 5e7, 6e7, 8e6, 7e6, 9e6], np.zeros(6), 0.0)
    model = paper_on(body, block, springs)
    rotor, support = model.rotor, model.support
    bending, mass, _ = rotor.plane_matrices
    nodes, count = len(bending), len(support.motion_mass)
    own = count - support.elastic
    gap = np.zeros((4, 2 * nodes + count))
    for index, one in enumerate(rotor.bearings):
        place = 2 * rotor.node_of(one.position)
        gap[2 * index, place] = gap[2 * index + 1, nodes + place] = 1.0
    gap[:, 2 * nodes:] = -support.motion_rows
    below = support.motion_spring.real + np.diag(np.ones(count))
    below[:own, :own] += np.diag(springs.stiffness) - np.eye(own)
    stiffness = scipy.linalg.block_diag(bending, bending, below) + 1e9 * gap.T @ gap
    inertia = scipy.linalg.block_diag(mass, mass, support.motion_mass)
    inverse = scipy.linalg.eigh(inertia, stiffness, eigvals_only=True)[::-1]
    exact = 1.0 / np.sqrt(inverse[:10])

    found = np.abs(SpectrumSolver.lowest(model, np.array([1e-3]), 10).frequency[0])
    np.testing.assert_allclose(found, exact, rtol=1e-5)


def test_motions_of_a_contact_may_come_in_any_order():
    body, block = on_one_contact()
    order = np.array([9, 4, 0, 7, 1, 5, 2, 8, 3, 6])
    mixed = replace(
        body, dofs=tuple(body.dofs[row] for row in order), rows=body.rows[order],
        shapes=body.shapes[order], residual=body.residual[np.ix_(order, order)])
    omega = np.array([100.0, 500.0])
    found, exact = (paper_on(one, block).support.standing(omega).receptance
                    for one in (mixed, body))
    np.testing.assert_allclose(found, exact, rtol=1e-9, atol=1e-20)


@pytest.mark.parametrize('heading', [0.0, math.pi, -0.5 * math.pi, 1.78])
def test_seat_of_a_turned_machine_moves_across_its_shaft_and_up(heading):
    """Along e a rigid body moves by e u + (r x e) theta, wherever the shaft points."""
    place = Placement(0.4, -0.3, heading)
    x, y = place.point(1.5)
    dofs = [Dof('b', axis, 'seat', (x, y, 2.0)) for axis in 'xyz']
    dofs += [Dof('base', axis, 'contact', (0.0, 0.0, 0.0)) for axis in
             ('x', 'y', 'z', 'rx', 'ry', 'rz')]
    body = FlexibleBody.from_modes(
        dofs, frequencies=np.zeros(0), shapes=np.zeros((9, 0)), residual=np.zeros((9, 9)),
        mass=np.eye(6), loss_factor=0.0)
    mount = Mount(bearing('b', 1.5, 'raft'), 2.0, place)
    assert mount.point == pytest.approx((x, y, 2.0))
    across, up = np.array([math.cos(heading), math.sin(heading), 0.0]), np.array([0.0, 0.0, 1.0])
    np.testing.assert_allclose(mount.on(body) @ body.rows, [
        [*e, *np.cross([x, y, 2.0], e)] for e in (across, up)], atol=1e-12)
