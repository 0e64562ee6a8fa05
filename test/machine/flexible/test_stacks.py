"""Bodies that stand on one another answer as finite elements of all of them, welded, do."""

from dataclasses import replace
import math

from boxes import elements, ON_FOUR, ON_ONE, RAFT, XYZ
from foundations import bearing, FOOTING, off, Springs
import numpy as np
import pytest
import scipy.linalg
import scipy.sparse

from rotorsoil_ros.channel import DOFS
from rotorsoil_ros.errors import RotorSoilError
from rotorsoil_ros.ground.bed import PatchesApart
from rotorsoil_ros.ground.soil import Rectangle, RigidSoil
from rotorsoil_ros.machine.coupled import CoupledModel
from rotorsoil_ros.machine.damping import BEARINGS, DampingSplitter, SOIL, STRUCTURE
from rotorsoil_ros.machine.flexible.body import CONTACT, Dof, FlexibleBody, PROBE, SEAT
from rotorsoil_ros.machine.foundation import Foundation, Stand
from rotorsoil_ros.machine.modes.campbell import campbell
from rotorsoil_ros.machine.modes.critical import critical_speeds
from rotorsoil_ros.machine.support import Support

from machines import paper_rotor
from oracles.dense import eigenvalues_of, rotor_matrices

TURN = 2.0 * np.pi
SOME = TURN * np.array([0.05, 7.0, 19.0, 33.0, 51.0])
LOSSES = {'raft': 0.04, 'frame': 0.01}
EVERY = 1.5e4


def stack(asked, places, *, stiffer=1.0):
    """Return the frame on the raft, the raft on four springs."""
    bodies = [elements(name, own).body(EVERY, loss=LOSSES[name]).stiffer(stiffer)
              for name, own in (('raft', RAFT), ('frame', asked))]
    blocks = [Foundation(name, Rectangle(1.0, 0.7), 0.0, 1.0, 1.0, (1.0, 1.0, 1.0),
                         body=replace(body, bed='' if body.has_one_contact else 'each'))
              for name, body in zip(('raft', 'frame'), bodies, strict=True)]
    upper = replace(blocks[1], on=Stand('raft', places, 0.8))
    return support_of([blocks[0], upper])


def support_of(blocks):
    """Return foundations below the bearings of the upper one, the first on springs."""
    bearings = [bearing('b1', -0.7, 'frame'), bearing('b2', 0.7, 'frame')]
    return Support(bearings, 2.4, blocks, [ground(block) for block in blocks])


def ground(block):
    """Return springs below the first, nothing that gives below what stands on it."""
    model = RigidSoil() if block.on is not None else FOOTING
    if block.body is None or block.body.has_one_contact:
        return model
    own = len(block.body.contacts) // len(block.body.patches)
    kept = tuple(6 * patch + axis for patch in range(len(block.body.patches))
                 for axis in range(own))
    return PatchesApart([model] * len(block.body.patches), kept,
                        block.body.about_centre[block.body.contacts])


def meshes(asked, places):
    """
    Return both meshes side by side, with no mode, no reduction and no rigid motion.

    Stiffness of raft and of frame, mass, and by rows the weld, the patches and the seats.
    """
    parts = [elements('raft', RAFT), elements('frame', asked)]
    first, size = (sum(part.stiffness.shape[0] for part in parts[:count]) for count in (1, 2))
    bends = np.zeros((2, size, size))
    bends[0, :first, :first] = parts[0].stiffness.toarray()
    bends[1, first:, first:] = parts[1].stiffness.toarray()
    mass = scipy.linalg.block_diag(*(part.mass.toarray() for part in parts))

    def rows(index, wanted):
        names = [f'{dof.station}_{dof.axis}' for dof in parts[index].interface]
        found = np.zeros((len(wanted), size))
        found[:, [slice(0, first), slice(first, size)][index]] = (
            parts[index].pick.toarray()[[names.index(name) for name in wanted]])
        return found

    contacts = [f'{dof.station}_{dof.axis}' for dof in parts[1].interface if dof.kind == CONTACT]
    stations = list(dict.fromkeys(name.rpartition('_')[0] for name in contacts))
    below = [f'{places[stations.index(name.rpartition("_")[0])]}_{name.rpartition("_")[2]}'
             for name in contacts]
    patches = rows(0, [f'patch_{one}_{axis}' for one in range(4) for axis in XYZ])
    return (bends, mass, rows(1, contacts) - rows(0, below), patches,
            rows(1, ['b1_x', 'b1_z', 'b2_x', 'b2_z']))


def losing(bends):
    """Return the stiffness of both meshes with what each loses."""
    return sum((1.0 + 1j * loss) * own for loss, own in zip(LOSSES.values(), bends, strict=True))


def welded(asked, places, omega, moved=None):
    """
    Return the seats' receptance, or what ground that moves does, of both meshes in one system.

    Dense, with the weld as equations of their own.
    """
    bends, mass, weld, patch, seats = meshes(asked, places)
    found = []
    for one in omega:
        spring = np.diag(np.tile(1.0 / FOOTING.compliance(np.array([one]))[0].diagonal()[:3], 4))
        dynamic = losing(bends) + patch.T @ spring @ patch - one**2 * mass
        scale = np.abs(dynamic).max()
        system = np.block([[dynamic, scale * weld.T], [scale * weld, np.zeros((len(weld),) * 2)]])
        load = seats.T if moved is None else patch.T @ spring @ np.tile(moved, (4, 1))
        answer = np.linalg.solve(system, np.concatenate(
            [load, np.zeros((len(weld), load.shape[1]))]))
        found.append(seats @ answer[:len(mass)])
    return np.array(found)


STACKS = [(ON_ONE, ('pad',)), (ON_FOUR, ('top_0', 'top_1', 'top_2', 'top_3'))]


@pytest.mark.parametrize('asked, places', STACKS)
def test_a_frame_on_a_raft_is_the_mesh_of_both(asked, places):
    exact = welded(asked, places, SOME)
    assert off(stack(asked, places).standing(SOME).receptance, exact).max() < 1e-9


@pytest.mark.parametrize('asked, places', STACKS)
def test_ground_that_moves_reaches_the_frame_as_in_the_mesh(asked, places):
    standing = stack(asked, places).standing(SOME)
    loads = np.zeros((4 + len(standing.support.places), 3), dtype=complex)
    found, _ = standing.pushed(loads, np.eye(3))
    assert off(found, welded(asked, places, SOME, np.eye(3))).max() < 1e-9
    # At rest everything goes with the ground.
    np.testing.assert_allclose(found[0], np.tile([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]], (2, 1)),
                               atol=1e-5)


@pytest.mark.parametrize('asked, places', STACKS)
def test_the_coordinates_of_modes_say_the_same(asked, places):
    support = stack(asked, places)
    spring, mass = support.motion_spring, support.motion_mass
    gives = np.array([scipy.linalg.block_diag(one, np.eye(support.elastic))
                      for one in support.motion_compliance(SOME)])
    moves = np.linalg.solve(np.eye(len(mass)) + gives @ (
        spring - SOME[:, None, None] ** 2 * mass), gives)
    found = support.motion_rows @ moves @ support.motion_rows.T
    assert off(found, support.standing(SOME).receptance).max() < 1e-9
    # What modes are solved for: unit springs of elastic coordinates, none to the contacts.
    own = len(mass) - support.elastic
    np.testing.assert_allclose(spring.real[own:], 0.0, atol=1e-8 * np.abs(spring).max())


@pytest.mark.parametrize('asked, places', STACKS)
def test_it_is_reciprocal_and_gives_no_energy(asked, places):
    found = stack(asked, places).standing(SOME).receptance
    assert np.abs(found - found.swapaxes(1, 2)).max() < 1e-13 * np.abs(found).max()
    assert np.linalg.eigvalsh(-found.imag).min() > 0.0


def rigid(name, body, on=None):
    """Return the rigid block that a body is where it does not bend."""
    mass = body.mass_about_centre
    height = mass[0, 4] / mass[0, 0]
    assert abs(mass[0, 5]) + abs(mass[1, 5]) < 0.2 * mass[0, 0]
    moments = mass.diagonal()[3:] - mass[0, 0] * np.array([height**2, height**2, 0.0])
    return Foundation(name, Rectangle(1.0, 0.7), 0.0, mass[0, 0], height, tuple(moments),
                      height=0.8, on=on)


def test_stiff_bodies_are_one_rigid_block_of_both():
    support = stack(ON_ONE, ('pad',), stiffer=1e9)
    below, above = (block.body for block in support.foundations)
    # The frame by its own matrix, 0.8 m above the middle of the raft's contact.
    shift = np.array([replace(dof, place=(0.0, 0.0, 0.8)).rigid_row for dof in (
        Dof('', axis, PROBE, (0.0, 0.0, 0.0)) for axis in DOFS)])
    mass = below.mass_about_centre + shift.T @ above.mass_about_centre @ shift
    rows = support.point_rows[:4, 6:] @ shift
    gives = support.soils[0].compliance(SOME)
    inertia = np.eye(6) - SOME[:, None, None] ** 2 * (gives @ mass)
    exact = rows @ np.linalg.solve(inertia, gives) @ rows.T
    assert off(support.standing(SOME).receptance, exact).max() < 1e-7


def test_a_block_on_a_block_is_one_block():
    lower = Foundation('raft', Rectangle(1.0, 0.7), 0.1, 9e3, 0.4, (2e3, 2.5e3, 3e3), height=0.8)
    upper = Foundation('frame', Rectangle(0.5, 0.5), 0.1, 2e3, 0.7, (300.0, 200.0, 250.0),
                       on=Stand('raft', (), 0.8))
    total, high = 11e3, (9e3 * 0.4 + 2e3 * 1.5) / 11e3
    steiner = 9e3 * (0.4 - high)**2 + 2e3 * (1.5 - high)**2
    whole = Foundation('frame', Rectangle(1.0, 0.7), 0.1, total, high,
                       (2300.0 + steiner, 2700.0 + steiner, 3250.0))
    found = support_of([lower, upper]).standing(SOME).receptance
    assert off(found, support_of([whole]).standing(SOME).receptance).max() < 1e-12
    # Whatever order the file has.
    turned = Support(support_of([lower, upper]).bearings, 2.4, [upper, lower],
                     [RigidSoil(), FOOTING])
    assert off(turned.standing(SOME).receptance, found).max() < 1e-12


@pytest.mark.parametrize('bends', ['raft', 'frame'])
def test_a_block_on_what_bends_and_what_bends_on_a_block(bends):
    support = stack(ON_ONE, ('pad',))
    stiff = stack(ON_ONE, ('pad',), stiffer=1e9)
    chosen = [own if block.name == bends else block for own, block in zip(
        support.foundations, stiff.foundations, strict=True)]
    blocks = [chosen[0], chosen[1]]
    which = 1 if bends == 'raft' else 0
    # A body off its axis has products of inertia that a block has not: they are left out of both.
    body = chosen[which].body
    block = rigid(chosen[which].name, body, chosen[which].on)
    body = replace(body, mass=block.mass_matrix if which else body.mass)
    if bends == 'raft':
        blocks[1] = block
        mixed = support_of(blocks)
        stiffest = support_of([blocks[0], replace(chosen[1], body=body)])
    else:
        moved = replace(block.on or Stand('raft', (), 0.8), places=())
        blocks = [block, replace(chosen[1], on=moved)]
        mixed = Support(support.bearings, 2.4, blocks, [FOOTING, ground(chosen[1])])
        one = Dof('base', 'x', CONTACT, (0.0, 0.0, 0.0))
        pad = [Dof('pad', axis, PROBE, (0.0, 0.0, 0.8)) for axis in DOFS]
        dofs = (*(replace(one, axis=axis) for axis in DOFS), *pad)
        lump = FlexibleBody(dofs, block.mass_matrix, np.array([dof.rigid_row for dof in dofs]),
                            np.zeros((12, 0)), np.zeros(0), np.zeros((12, 12)), np.zeros(0), 0.0)
        stiffest = Support(support.bearings, 2.4, [
            replace(block, body=lump), chosen[1]], [FOOTING, ground(chosen[1])])
    assert off(mixed.standing(SOME).receptance, stiffest.standing(SOME).receptance).max() < 1e-7


def test_a_mass_on_a_spring_on_a_mass_is_the_closed_form():
    # A block of 5 t on the ground carries a body of two masses of 1 t and 0.4 t with a spring.
    lower, bottom, top, spring = 5e3, 1e3, 4e2, 6e6
    reduced = bottom * top / (bottom + top)
    # The mode of unit mass of both against each other, and nothing else that gives way.
    shape = np.sqrt(reduced) * np.array([-1.0 / bottom, 1.0 / top])
    dofs = (Dof('b1', 'x', SEAT, (0.0, 0.0, 1.0)), Dof('b1', 'z', SEAT, (0.0, 0.0, 1.0)),
            *(Dof('base', axis, CONTACT, (0.0, 0.0, 0.0)) for axis in DOFS))
    shapes = np.zeros((8, 1))
    shapes[[4, 1], 0] = shape
    body = FlexibleBody(dofs, np.diag([1400.0, 1400.0, 1400.0, 900.0, 900.0, 500.0]),
                        np.array([dof.rigid_row for dof in dofs]), shapes,
                        np.array([spring / reduced]), np.zeros((8, 8)), np.array([0.03]), 0.03)
    blocks = [Foundation('raft', Rectangle(1.0, 1.0), 0.0, lower, 0.5, (2e3, 2e3, 2e3)),
              Foundation('frame', Rectangle(0.3, 0.3), 0.0, 1400.0, 0.5, (900.0, 900.0, 500.0),
                         body=body, on=Stand('raft', (), 0.0))]
    support = Support([bearing('b1', 0.0, 'frame')], 1.0, blocks, [FOOTING, RigidSoil()])
    found = support.standing(SOME).receptance[:, 1, 1]
    soil = 1.0 / FOOTING.compliance(SOME)[:, 2, 2]
    lossy = spring * 1.03j + spring * (1.0 - 1j)
    below = soil - SOME**2 * (lower + bottom) + lossy
    exact = below / (below * (lossy - SOME**2 * top) - lossy**2)
    np.testing.assert_allclose(found, exact, rtol=1e-10)


@pytest.mark.parametrize('asked, places', STACKS)
def test_force_into_the_ground_is_all_that_acts_less_what_moves(asked, places):
    support = stack(asked, places)
    standing = support.standing(SOME)
    through = np.zeros((len(SOME), 4, 1), dtype=complex)
    through[:, 1] = 1.0
    loads = np.zeros((4 + len(support.places), 1), dtype=complex)
    housings = standing.receptance @ through
    motion, force = standing.blocks(through, housings, loads, standing.pushed(
        loads, np.zeros((3, 1)))[1])
    # At rest what the raft puts into the ground, and the frame into the raft, is what acts.
    names = [str(place) for place in support.places]
    for name in ('raft_z', 'frame_z'):
        assert force[0, names.index(name), 0] == pytest.approx(1.0, abs=1e-4)
    # The frame's contact is where the raft below it is.
    if 'pad_z' in names:
        np.testing.assert_allclose(motion[:, names.index('frame_z')],
                                   motion[:, names.index('pad_z')], rtol=1e-9)


def machine(asked, places):
    """Return the rotor of the paper on the stack."""
    support = stack(asked, places)
    rotor = paper_rotor(foundation='frame')
    bearings = tuple(replace(one, seat=seat) for one, seat in zip(
        rotor.bearings, ('b1', 'b2'), strict=True))
    return CoupledModel(replace(rotor, bearings=bearings, shaft_height=2.4), support.foundations,
                        support.soil_models)


def whole(model, asked, places, speed):
    """
    Return what the rotor on both meshes is: all motions that the weld lets be.

    Stiffness, damping, mass; by rows the gaps of the bearings, meshes and patches.
    """
    bends, mass, weld, patch, seats = meshes(asked, places)
    free = scipy.linalg.null_space(weld)
    stiffness, inertia, gyroscopic = rotor_matrices(model.rotor)
    own = len(stiffness)
    mesh = np.concatenate([np.zeros((len(mass), own)), free], axis=1)
    patch = patch @ mesh
    nodes = [4 * model.rotor.node_of(one.position) for one in model.rotor.bearings]
    gap = np.eye(mesh.shape[1])[[node + axis for node in nodes for axis in range(2)]]
    gap -= seats @ mesh
    soft, dashpots = (np.diag(np.tile(part[:3], 4)) for part in (
        FOOTING.stiffness * (1.0 + 1j * FOOTING.loss), FOOTING.damping))
    springs, dampers, _ = (part[0] for part in model.all_bearings.coefficients(
        *2 * (np.array([speed]),)))
    k = mesh.T @ losing(bends) @ mesh + patch.T @ soft @ patch + gap.T @ springs @ gap
    c = patch.T @ dashpots @ patch + gap.T @ dampers @ gap
    m = mesh.T @ mass @ mesh
    k[:own, :own] += stiffness
    c[:own, :own] += speed * gyroscopic
    m[:own, :own] += inertia
    return k, c, m, gap, mesh, patch


@pytest.mark.parametrize('asked, places', STACKS)
def test_modes_are_those_of_both_meshes(asked, places):
    """Whose losses differ: what they join of bending is in the modes."""
    model, speed = machine(asked, places), 100.0
    found = campbell(model, np.array([speed]), 14).eigenvalue[0]
    exact = eigenvalues_of(*whole(model, asked, places, speed)[:3])
    exact = exact[exact.imag > 0.2 * np.abs(exact)][:len(found)]
    np.testing.assert_allclose(found, exact, rtol=1e-7)


def taken(model, bends, parts, w, shape, speed):
    """Return the shares of bearings, raft, frame and soil of what takes energy in a motion."""
    gap, mesh, patch = (rows @ shape for rows in parts)
    springs, dampers, _ = (part[0] for part in model.all_bearings.coefficients(
        *2 * (np.array([speed]),)))
    films = np.vdot(gap, (springs + 1j * w * dampers) @ gap).imag
    losses = [loss * np.vdot(mesh, own @ mesh).real
              for loss, own in zip(LOSSES.values(), bends, strict=True)]
    dynamic = FOOTING.stiffness * (1.0 + 1j * FOOTING.loss) + 1j * w * FOOTING.damping
    soil = (np.abs(patch.reshape(4, 3)) ** 2 @ dynamic[:3].imag).sum()
    return np.array([films, *losses, soil]) / (films + sum(losses) + soil)


def shares(split, row):
    return [split.share(*part)[row] for part in (
        (BEARINGS,), (STRUCTURE, 'raft'), (STRUCTURE, 'frame'), (SOIL, 'raft'))]


@pytest.mark.parametrize('asked, places', STACKS)
def test_what_damps_a_mode_is_what_both_meshes_lose_in_it(asked, places):
    model, (bends, *_) = machine(asked, places), meshes(asked, places)
    found = critical_speeds(model, (TURN * 5.0, TURN * 90.0))
    light = [one for one in found if one.damping_ratio < 0.3]
    assert len(light) > 3
    for one, split in zip(light, DampingSplitter(model).of_modes(light), strict=True):
        assert split is not None
        w = one.speed * (1.0 + 1j * one.damping_ratio / math.sqrt(1.0 - one.damping_ratio**2))
        k, c, m, *parts = whole(model, asked, places, one.speed)
        # What the equations send to zero there.
        shape = np.linalg.svd(k + 1j * w * c - w**2 * m)[2][-1].conj()
        np.testing.assert_allclose(
            shares(split, 0), taken(model, bends, parts, w, shape, one.speed), atol=1e-6)


@pytest.mark.parametrize('asked, places', STACKS)
def test_what_an_unbalance_puts_in_is_what_both_meshes_lose(asked, places):
    model, (bends, *_) = machine(asked, places), meshes(asked, places)
    speeds, unbalance = TURN * np.array([11.0, 23.0, 37.0]), np.zeros(len(model.planes)) + 0j
    unbalance[0] = 1e-3
    found = DampingSplitter(model).forced(speeds, unbalance)
    node = 4 * model.rotor.node_of(model.rotor.discs[0].position)
    for row, speed in enumerate(speeds.tolist()):
        k, c, m, *parts = whole(model, asked, places, speed)
        load = np.zeros(len(k), dtype=complex)
        load[node:node + 2] = speed**2 * unbalance[0] * np.array([-1j, 1.0])
        shape = np.linalg.solve(k + 1j * speed * c - speed**2 * m, load)
        assert found.total[row] == pytest.approx(math.pi * np.vdot(shape, load).imag, rel=1e-8)
        np.testing.assert_allclose(
            shares(found, row), taken(model, bends, parts, speed, shape, speed), atol=1e-8)


def test_what_is_not_there_is_refused():
    with pytest.raises(RotorSoilError, match=r'must be one of patch_0, .*, got nowhere'):
        _ = stack(ON_ONE, ('nowhere',)).members
    with pytest.raises(RotorSoilError, match='place must move along rx, top_0 has x, y, z'):
        _ = stack(ON_ONE, ('top_0',)).members


def test_springs_of_the_ground_are_felt_below_the_raft_only():
    assert isinstance(FOOTING, Springs)
    support = stack(*STACKS[0])
    compliance = support.ground(SOME[:1])[0]
    assert np.count_nonzero(np.diagonal(compliance)) == 12
    assert len(compliance) == 18
