"""Two machines on a raft that bends: modes, damping and films, against all motions together."""

from dataclasses import replace
from pathlib import Path

from foundations import apart, PATCH, raft_body
import numpy as np
import pytest
import scipy.linalg

from rotorsoil_ros.case import config
from rotorsoil_ros.ground.soil import Rectangle
from rotorsoil_ros.machine.damping import DampingSplitter, STRUCTURE
from rotorsoil_ros.machine.foundation import Foundation
from rotorsoil_ros.machine.modes.campbell import campbell
from rotorsoil_ros.machine.modes.stability import stability
from rotorsoil_ros.machine.placement import Placement
from rotorsoil_ros.machine.plant.neighbour import Neighbour
from rotorsoil_ros.machine.plant.source import SourceModel

from machines import renamed, work_put_in
from oracles.dense import eigenvalues_of, rotor_matrices

FAN = Path(__file__).parents[3] / 'config' / 'plant_fan.yaml'
SKEW = np.array([[0.0, -1.0], [1.0, 0.0]])


def raft(cross=0.0):
    """Return one fan of two on the raft of the reference, the other's bearings cross-coupled."""
    body, rotor = raft_body(), config.load(FAN).rotor
    rotors = [replace(renamed(rotor, name, 'raft'), bearings=tuple(
        replace(one, name=f'{name}_{one.name}', foundation='raft', seat=f'{name}_{end}',
                stiffness=one.stiffness + skew * SKEW, damping=2e5 * np.eye(2))
        for one, end in zip(rotor.bearings, ('b1', 'b2'), strict=True)))
        for name, skew in (('fan_1', 0.0), ('fan_2', cross))]
    block = Foundation('raft', Rectangle(6.0, 2.0), 0.0, 1.0, 1.0, (1.0, 1.0, 1.0), body=body)
    return SourceModel(
        rotors[0], (block,), (apart(body, PATCH, 3),), place=Placement(-3.0, -0.75), index=0,
        names=('fan_1', 'fan_2'), neighbours=(Neighbour(rotors[1], Placement(3.0, -0.75), 150.0),))


def assembled(model, speed):
    """Return stiffness, damping and mass of both rotors and of all motions of the raft."""
    support, contacts = model.support, model.support.contacts
    count = len(support.motion_mass)
    below = support.motion_spring + np.diag(np.arange(count) >= contacts)
    spring, dashpot = (np.tile(part[:3], contacts // 3) for part in (
        PATCH.stiffness * (1.0 + 1j * PATCH.loss), PATCH.damping))
    below[range(contacts), range(contacts)] += spring
    parts = [rotor_matrices(rotor) for rotor in model.rotors]
    turns = [speed if own is None else own for own in model.own_speeds]
    k = scipy.linalg.block_diag(*(part[0] for part in parts), below)
    m = scipy.linalg.block_diag(*(part[1] for part in parts), support.motion_mass)
    c = scipy.linalg.block_diag(
        *(turn * part[2] for turn, part in zip(turns, parts, strict=True)),
        np.diag(np.append(dashpot, np.zeros(count - contacts))))
    journals, first = [], 0
    for rotor in model.rotors:
        for bearing in rotor.bearings:
            node = first + 4 * rotor.node_of(bearing.position)
            journals += [node, node + 1]
        first += 4 * len(rotor.node_positions)
    gap = np.eye(len(k))[journals]
    gap[:, first:] -= support.motion_rows
    springs, dampers, _ = (part[0] for part in model.all_bearings.coefficients(
        *2 * (np.array([speed]),)))
    return k + gap.T @ springs @ gap, c + gap.T @ dampers @ gap, m


def test_modes_of_two_machines_on_a_raft_are_those_of_all_motions_together():
    model = raft()
    found = campbell(model, np.array([155.0]), 24).eigenvalue[0]
    exact = eigenvalues_of(*assembled(model, 155.0))
    exact = exact[exact.imag > 0.2 * np.abs(exact)][:len(found)]
    np.testing.assert_allclose(found, exact, rtol=1e-6)


def test_all_that_is_put_in_is_taken_by_raft_and_machines():
    model = raft()
    speed, unbalance = np.array([60.0, 155.0]), np.array([1e-3, 5e-4j])
    found = DampingSplitter(model).forced(speed, unbalance)
    np.testing.assert_allclose(found.total, work_put_in(model, speed, unbalance), rtol=1e-10)
    assert np.all(found.share(STRUCTURE) > 0.0)
    assert np.all(found.share('bearings', 'fan_2_fan_end') > 1e-7)


def test_a_film_beside_feeds_a_mode_on_a_raft_and_is_named():
    found = stability(raft(cross=2e8), (100.0, 120.0))
    assert found.instabilities
    assert all(one.name.startswith('fan_2: ') for one in found.instabilities)
    exact = eigenvalues_of(*assembled(raft(cross=2e8), 110.0))
    grows = exact[(exact.real > 1e-6 * np.abs(exact)) & (exact.imag > 1.0)]
    assert len(grows) == len(found.instabilities)
    assert sorted(one.frequency for one in found.instabilities) == pytest.approx(
        sorted(grows.imag), rel=1e-2)
