"""Modes, stability and damping of machines among others, against the full assembly."""

from dataclasses import replace
import math

import numpy as np
import pytest

from rotorsoil_ros.ground.soil import Rectangle, RigidSoil
from rotorsoil_ros.machine.coupled import CoupledModel
from rotorsoil_ros.machine.damping import DampingSplitter, EXTERNAL, INTERNAL
from rotorsoil_ros.machine.foundation import Foundation
from rotorsoil_ros.machine.modes.campbell import campbell
from rotorsoil_ros.machine.modes.critical import critical_speeds
from rotorsoil_ros.machine.modes.names import ModeNames
from rotorsoil_ros.machine.modes.natural import lowest_natural_frequency
from rotorsoil_ros.machine.modes.stability import stability
from rotorsoil_ros.machine.placement import Placement
from rotorsoil_ros.machine.plant.neighbour import Neighbour
from rotorsoil_ros.machine.plant.source import SourceModel
from rotorsoil_ros.rotor.coefficients import SpeedTable
from rotorsoil_ros.rotor.disc import Disc
from rotorsoil_ros.rotor.shaft import Material, ShaftDamping

from machines import (
    bearing,
    elastic_machine,
    paper_rotor,
    renamed,
    Restrained,
    Springs,
    springy_soils,
    two_blocks,
    uniform_rotor,
    work_put_in,
)
from oracles.dense import eigenvalues_of
from oracles.plant import plant_matrices

PLACES = Placement(0.4, 0.1, 0.3), Placement(-0.5, 1.8, 2.8), Placement(0.0, 0.2)
OWN = 0.0, 210.0, 150.0
FILM = np.array([[0.0, -1.0], [1.0, 0.0]])


def unlike(source=0, *, lossy=False):
    """Return one of three machines, two of them alike in nothing, on two blocks on springs."""
    first, second = two_blocks(cross=3e7).rotor, elastic_machine().rotor
    if lossy:
        second = replace(second, drag=1.5, shaft=tuple(
            replace(one, damping=ShaftDamping(viscous=8e-6, loss_factor=0.02))
            for one in second.shaft))
    rotors = [renamed(first, 'a'), renamed(second, 'b'), renamed(paper_rotor(), 'c', 'left')]
    others = [number for number in range(3) if number != source]
    return SourceModel(
        rotors[source], two_blocks().foundations, springy_soils(), place=PLACES[source],
        index=source, names='abc',
        neighbours=tuple(Neighbour(rotors[one], PLACES[one], OWN[one]) for one in others))


def assembled(model, speed):
    """Return the full matrices of a plant while its source turns at a speed."""
    machines = [(one.rotor, (one.place.x, one.place.y, one.place.heading), one.speed)
                for one in model.neighbours]
    machines.insert(model.index, (
        model.rotor, (model.place.x, model.place.y, model.place.heading), speed))
    soils = [np.zeros((12, 12)), np.zeros((12, 12))]
    for number, soil in enumerate(model.soil_models):
        own = slice(6 * number, 6 * number + 6)
        soils[0][own, own], soils[1][own, own] = soil.stiffness, soil.damping
    return plant_matrices(machines, model.foundations, stiffness=soils[0], damping=soils[1])


def that_vibrate(values):
    return values[values.imag > 0.2 * np.abs(values)]


@pytest.mark.parametrize('source', [0, 1, 2])
def test_modes_of_a_plant_are_those_of_the_full_assembly(source):
    """Films, pedestals, two blocks, headings, neighbours turning and standing."""
    model = unlike(source)
    speeds = np.array([0.0, 90.0, 300.0])
    found = campbell(model, speeds, 30)
    for speed, got in zip(speeds.tolist(), found.eigenvalue, strict=True):
        exact = that_vibrate(eigenvalues_of(*assembled(model, speed)))[:30]
        np.testing.assert_allclose(got, exact, rtol=1e-8)


def test_modes_on_rigid_ground_are_those_of_each_machine_alone():
    """Nothing joins them; the neighbour's stay where they are, and are told to be its."""
    model = replace(unlike(0, lossy=True), soil_models=(RigidSoil(), RigidSoil()))
    speeds = np.array([60.0, 180.0, 260.0])
    found = campbell(model, speeds, 14)
    alone = [CoupledModel(rotor, model.foundations, model.soil_models) for rotor in model.rotors]
    beside = [campbell(one, np.array([own]), 14).eigenvalue[0]
              for one, own in zip(alone[1:], OWN[1:], strict=True)]
    own = campbell(alone[0], speeds, 14).eigenvalue
    for row in range(len(speeds)):
        everything = np.concatenate([own[row], *beside])
        who = np.repeat([0, 2, 3], 14)
        order = np.argsort(everything.imag)[:14]
        np.testing.assert_allclose(found.eigenvalue[row], everything[order], rtol=1e-8)
        np.testing.assert_array_equal(found.owner[row], who[order])


def test_critical_speeds_of_a_plant_are_crossings_of_its_campbell_diagram():
    model = unlike(1)
    criticals = critical_speeds(model, (50.0, 320.0))
    assert {one.owner for one in criticals} == {0, 3}
    for one in criticals:
        exact = that_vibrate(eigenvalues_of(*assembled(model, one.speed)))
        near = exact[np.abs(exact.imag - one.speed).argmin()]
        assert near.imag == pytest.approx(one.speed, rel=1e-8)
        assert -near.real / abs(near) == pytest.approx(one.damping_ratio, rel=1e-6)
    names = {ModeNames(model).of_critical(one) for one in criticals if one.owner}
    assert all(name.startswith('c: ') for name in names)


def heaving(names=('a', 'b'), *, masses=(30.0, 30.0), stiffness=4e6, place=None):
    """Return a mass on springs beside another, both on a block that can only heave."""
    def rotor(name, mass):
        # Light, stiff shaft: the mass swings on both bearings, and cannot move across.
        return uniform_rotor(
            length=1.0, diameter=0.2, elements=2, material=Material(1e16, 0.3, 1e-6),
            discs=[Disc(f'{name}_wheel', 0.5, mass, 1e-9, 0.0)],
            bearings=[bearing(f'{name}_{end}', place, stiffness=np.diag([1e8, 0.5 * stiffness]))
                      for end, place in (('left', 0.0), ('right', 1.0))])

    block = Foundation('block', Rectangle(1.0, 1.0), 0.5, 800.0, 0.0, (1e3, 1e3, 1e3))
    soil = Restrained(Springs(9e8 * np.eye(6), 1e-9 * np.eye(6)), 'z')
    return SourceModel(rotor(names[0], masses[0]), (block,), (soil,), index=0, names=names,
                       neighbours=(Neighbour(rotor(names[1], masses[1]), Placement(0.7, 0.0),
                                             90.0),))


def test_equal_machines_swing_together_with_the_block_or_against_each_other_without():
    model = heaving()
    against = math.sqrt(4e6 / 30.0)
    total = np.array([[9e8 + 8e6, -8e6], [-8e6, 8e6]])  # block, both masses
    together = np.sqrt(np.linalg.eigvals(total / np.array([[800.0], [60.0]])))
    found = critical_speeds(model, (100.0, 1400.0))
    np.testing.assert_allclose([one.speed for one in found], np.sort([*together, against]),
                               rtol=1e-7)
    names = ModeNames(model)
    assert [names.of_critical(one) for one in found] == [
        'a and b together: rotor bouncing on its bearings, up and down',
        'a against b: rotor bouncing on its bearings, up and down', 'block heave']
    assert [one.owner for one in found] == [0, 0, 0]


def test_mode_of_the_neighbour_is_called_after_it():
    """Twice as heavy, it swings below; the source hardly takes part."""
    found = critical_speeds(heaving(masses=(30.0, 90.0)), (100.0, 300.0))
    assert [one.owner for one in found] == [2]
    assert ModeNames(heaving(masses=(30.0, 90.0))).of_critical(found[0]) == (
        'b: rotor bouncing on its bearings, up and down')


def test_a_block_carries_neighbours_as_rigid_bodies_where_only_its_own_frequency_is_asked():
    """What the class of a support goes by: the springs below all that stands on them."""
    found = lowest_natural_frequency(heaving(masses=(30.0, 90.0)), axis='z', highest=2e3)
    assert found == pytest.approx(math.sqrt(9e8 / 920.0), rel=1e-6)


def whirling(speed, *, soils=None, skew=1.2e7):
    """Return the first machine beside the last, whose bearings are films at that speed."""
    model = unlike(0)
    rotor = renamed(paper_rotor(stiffness=3e7, damping=4e3, elements=8), 'c', 'left')
    rotor = replace(rotor, bearings=tuple(
        replace(one, stiffness=SpeedTable(np.array([100.0, 500.0]), np.stack(
            [one.stiffness, one.stiffness + 1.25 * skew * FILM]))) for one in rotor.bearings))
    return replace(model, soil_models=soils or model.soil_models, names=('a', 'c'),
                   neighbours=(Neighbour(rotor, PLACES[2], speed),))


def test_a_neighbour_that_whirls_on_its_own_makes_the_plant_unstable_and_is_named():
    model = whirling(400.0)
    found = stability(model, (0.0, 120.0))
    assert found.unstable.tolist() == [[0.0, 120.0]]
    for one in found.instabilities:
        assert one.name.startswith('c: fluid-film whirl, ')
        assert one.feeds[0].name.startswith('c_bearing')
        assert sum(feed.share for feed in one.feeds if feed.name[0] != 'c') < 0.02
        exact = eigenvalues_of(*assembled(model, one.speed))
        near = exact[np.abs(exact.imag - one.frequency).argmin()]
        assert near.imag == pytest.approx(one.frequency, rel=1e-7)
        assert -near.real / abs(near) == pytest.approx(one.damping_ratio, rel=1e-5)
    grows = eigenvalues_of(*assembled(model, 100.0))
    assert len(found.instabilities) == (grows.real > 1e-9 * np.abs(grows)).sum()


def test_on_firm_ground_a_neighbour_grows_as_it_does_alone():
    firm = (RigidSoil(), RigidSoil())
    model = whirling(400.0, soils=firm)
    own = model.neighbours[0].rotor
    alone = CoupledModel(own, model.foundations, firm)
    expected = stability(alone, (400.0, 400.0 * (1.0 + 1e-9))).instabilities
    found = stability(model, (0.0, 120.0)).instabilities
    assert [one.name for one in found] == [f'c: {one.name}' for one in expected] != []
    for got, one in zip(found, expected, strict=True):
        assert got.frequency == pytest.approx(one.frequency, rel=1e-8)
        assert got.damping_ratio == pytest.approx(one.damping_ratio, rel=1e-6)
        assert [feed.name for feed in got.feeds] == [feed.name for feed in one.feeds]
    # Slower, its bearings hold it: nothing grows.
    assert not stability(whirling(100.0, soils=firm), (0.0, 120.0)).instabilities


def test_all_that_is_put_in_is_taken_by_all_machines():
    model = unlike(0, lossy=True)
    speed, unbalance = np.array([40.0, 133.0, 260.0]), np.array([1e-3, 5e-4j])
    found = DampingSplitter(model).forced(speed, unbalance)
    np.testing.assert_allclose(found.total, work_put_in(model, speed, unbalance), rtol=1e-10)
    # Each has a share of its own: left out, the sum would not close.
    for kind, name in (('bearings', 'b_two'), ('pedestals', 'b_three'), (INTERNAL, 'b'),
                       (EXTERNAL, 'b')):
        assert np.all(np.abs(found.share(kind, name)) > 1e-9)


def test_decay_of_a_mode_is_what_all_machines_take():
    """Im(phi^H (w^2 M - w G) phi) of the full assembly, each gyroscopic couple at its speed."""
    model = unlike(0, lossy=True)
    criticals = [one for one in critical_speeds(model, (50.0, 600.0)) if one.damping_ratio < 0.7]
    splits = DampingSplitter(model).of_modes(criticals)
    assert len(criticals) > 4
    for one, split in zip(criticals, splits, strict=True):
        w = one.speed * (1.0 + 1j * one.damping_ratio / math.sqrt(1.0 - one.damping_ratio**2))
        decay = (w**2 * np.vdot(one.support, model.support.motion_mass @ one.support)).imag
        shapes = model.in_order((one.deflection, one.slope), one.beside)
        for rotor, own, (deflection, slope) in zip(
                model.rotors, model.own_speeds, shapes, strict=True):
            turns = one.speed if own is None else own
            _, mass, polar = rotor.plane_matrices
            plane = np.stack([deflection, slope], axis=1).reshape(-1, 2).T
            decay += sum((w**2 * np.vdot(part, mass @ part)).imag for part in plane)
            # Forward is x = -i z: what the planes do to each other.
            for sign, orbit in ((1.0, np.array([1j, 1.0])), (-1.0, np.array([-1j, 1.0]))):
                whirl = orbit @ plane / math.sqrt(2.0)
                decay -= sign * turns * (w * np.vdot(whirl, polar @ whirl)).imag
        assert split.total[0] == pytest.approx(decay, rel=1e-6)
