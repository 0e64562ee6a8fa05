"""The seed paper's machine, and pieces of it, for the tests."""

from dataclasses import replace
import math

import numpy as np

from rotorsoil_ros.channel import DOFS
from rotorsoil_ros.ground.boundary.model import BoundaryElementModel
from rotorsoil_ros.ground.boundary.site import Site
from rotorsoil_ros.ground.cone import ConeModel
from rotorsoil_ros.ground.soil import Rectangle, Soil
from rotorsoil_ros.machine.coupled import CoupledModel, UNBALANCE_FORCE
from rotorsoil_ros.machine.foundation import Foundation
from rotorsoil_ros.rotor.assembly import Rotor
from rotorsoil_ros.rotor.bearing import Bearing, Pedestal
from rotorsoil_ros.rotor.coefficients import SpeedTable
from rotorsoil_ros.rotor.disc import Disc
from rotorsoil_ros.rotor.shaft import Material, Probe, ShaftSection

STEEL = Material(2.09e11, 0.3, 7920.0)
# From I = 7887 mm^4 and 1.9 kg of shaft: the rounded figures of the paper move peaks by 1 %.
DIAMETER = (64.0 * 7887e-12 / math.pi) ** 0.25
LENGTH = 1.9 / (STEEL.density * math.pi / 4.0 * DIAMETER**2)
SOIL = Soil(48e6, 0.25, 1900.0, 0.10)
CONTACT = Rectangle(0.5, 0.5)
CONE = ConeModel(SOIL, CONTACT)


def bearing(name, position, *, stiffness, damping=0.0, foundation='block'):
    """Return an isotropic bearing, or one of given 2 x 2 matrices."""
    return Bearing(name, position, foundation,
                   stiffness * np.eye(2) if np.ndim(stiffness) == 0 else np.array(stiffness),
                   damping * np.eye(2) if np.ndim(damping) == 0 else np.array(damping))


def uniform_rotor(*, length, diameter, elements, material, discs=(), bearings, height=0.0):
    """Return a rotor of one cylindrical section."""
    section = ShaftSection(length, (diameter, diameter), (0.0, 0.0), elements, material)
    return Rotor(height, (section,), tuple(discs), tuple(bearings))


def paper_rotor(*, stiffness=1e9, damping=5e2, elements=28, foundation='block'):
    """Return the seed paper's rotor in its default geometry."""
    return uniform_rotor(
        length=LENGTH, diameter=DIAMETER, elements=elements, material=STEEL, height=0.6,
        discs=[Disc('disc_1', LENGTH / 4, 0.7, 1e-3, 2e-3),
               Disc('disc_2', LENGTH, 1.6, 3.2e-3, 6.4e-3)],
        bearings=[bearing('bearing_1', 0.0, stiffness=stiffness, damping=damping,
                          foundation=foundation),
                  bearing('bearing_2', 0.75 * LENGTH, stiffness=stiffness, damping=damping,
                          foundation=foundation)])


def renamed(rotor, name, foundation=None):
    """Return a rotor whose stations carry the name of their machine, on a block if one is told."""
    def of(stations):
        return tuple(replace(one, name=f'{name}_{one.name}') for one in stations)

    return replace(rotor, discs=of(rotor.discs), probes=of(rotor.probes), bearings=tuple(
        replace(one, foundation=foundation or one.foundation) for one in of(rotor.bearings)))


def paper_machine(soil_model=CONE, *, mass=42.0, **rotor):
    """Return the seed paper's machine on one block."""
    inertia = mass / 12.0
    block = Foundation('block', CONTACT, 0.375 * LENGTH, mass, 0.0,
                       (inertia, inertia, 2.0 * inertia))
    return CoupledModel(paper_rotor(**rotor), (block,), (soil_model,))


class Restrained:
    """A soil that holds all but the named degrees of freedom."""

    def __init__(self, model, *dofs):
        self.model = model
        self.free = np.array([1.0 if dof in dofs else 0.0 for dof in DOFS])

    def compliance(self, omega):
        """Return the compliance with zero rows for what is held."""
        return self.model.compliance(omega) * self.free[:, None] * self.free


class Springs:
    """A soil of springs and dashpots, whose modes a linear eigenproblem has."""

    def __init__(self, stiffness, damping):
        self.stiffness = np.array(stiffness)
        self.damping = np.array(damping)

    def compliance(self, omega):
        """Return (K + i omega C)^-1."""
        omega = np.asarray(omega)[:, None, None]
        return np.linalg.inv(self.stiffness + 1j * omega * self.damping)


def elastic_machine(soils=None):
    """Return two blocks, two of three bearings on pedestals, one of them a table over speed."""
    stiffness = np.array([[2e8, 5e7], [-5e7, 1e8]])
    damping = np.array([[4e4, 1e3], [-1e3, 2e4]])
    growth = np.linspace(0.5, 1.5, 6)[:, None, None]
    speeds = np.linspace(0.0, 1000.0, 6)
    skew = Pedestal(np.array([[40.0, 5.0], [5.0, 60.0]]), np.array([[3e8, 2e7], [1e7, 5e8]]),
                    np.array([[2e4, 0.0], [3e3, 3e4]]))
    plain = Pedestal(30.0 * np.eye(2), 4e8 * np.eye(2), 1e4 * np.eye(2))
    rotor = Rotor(
        0.9, (ShaftSection(2.0, (0.08, 0.10), (0.0, 0.02), 10, STEEL),),
        (Disc('wheel', 0.8, 60.0, 1.5, 2.9), Disc('coupling', 2.0, 12.0, 0.1, 0.2)),
        (Bearing('one', 0.1, 'left', stiffness, damping, skew),
         Bearing('two', 1.4, 'right', SpeedTable(speeds, 0.75 * stiffness * growth),
                 SpeedTable(speeds, damping / growth)),
         Bearing('three', 1.9, 'right', 3e8 * np.eye(2), 1e4 * np.eye(2), plain)),
        (Probe('probe', 0.55),))
    blocks = (Foundation('left', Rectangle(0.5, 0.4), 0.1, 900.0, 0.3, (60.0, 70.0, 80.0)),
              Foundation('right', Rectangle(0.5, 0.6), 1.6, 1500.0, 0.35, (90.0, 95.0, 120.0)))
    if soils is None:
        soils = tuple(ConeModel(SOIL, block.contact) for block in blocks)
    return CoupledModel(rotor, blocks, soils, couples=('coupling',))


def springy_soils():
    """Return two soils of springs and dashpots, sliding and rocking coupled."""
    stiffness = np.diag([2e8, 1.8e8, 2.6e8, 6e7, 7e7, 9e7])
    stiffness[0, 4] = stiffness[4, 0] = 2e7
    damping = np.diag([4e5, 4e5, 9e5, 3e4, 5e4, 4e4])
    return Springs(stiffness, damping), Springs(1.3 * stiffness, 0.7 * damping)


def two_blocks(cross=0.0):
    """Return a machine whose bearings stand on two blocks, one of them by two bearings."""
    stiffness = np.array([[2e8, cross], [-cross, 1e8]])
    damping = np.array([[4e4, 1e3], [-1e3, 2e4]])
    section = ShaftSection(2.0, (0.08, 0.10), (0.0, 0.02), 10, STEEL)
    rotor = Rotor(
        0.9, (section,),
        (Disc('wheel', 0.8, 60.0, 1.5, 2.9), Disc('coupling', 2.0, 12.0, 0.1, 0.2)),
        (bearing('one', 0.1, stiffness=stiffness, damping=damping, foundation='left'),
         bearing('two', 1.4, stiffness=stiffness, damping=damping, foundation='right'),
         bearing('three', 1.9, stiffness=3e8, damping=1e4, foundation='right')),
        (Probe('probe', 0.55),))
    blocks = (Foundation('left', Rectangle(0.5, 0.4), 0.1, 900.0, 0.3, (60.0, 70.0, 80.0)),
              Foundation('right', Rectangle(0.5, 0.6), 1.6, 1500.0, 0.35, (90.0, 95.0, 120.0)))
    soils = tuple(ConeModel(SOIL, block.contact) for block in blocks)
    return CoupledModel(rotor, blocks, soils)


def channel(model, prediction, name):
    """Return the displacement of one channel."""
    return prediction.displacement[:, model.channels.index(name)]


PLACES = ((4.0, 0.5), (-1.5, 1.6))


def shared(points=PLACES, highest=320.0):
    """Return the machine on two blocks with one ground below both."""
    model = two_blocks()
    site = Site.of(tuple(block.contact for block in model.foundations),
                   tuple((0.0, block.centre_y) for block in model.foundations), points)
    ground = BoundaryElementModel.solved_together(SOIL, site, omega_max=highest)
    names = ('yard', 'wall')[:len(points)]
    return replace(model, soil_models=(ground,), points=names)


def work_put_in(model, speed, unbalance):
    """Return pi Im(x^H F) over the discs of the machine, F = m Omega^2 exp(i phase) (-i, 1)."""
    discs = [model.channels.index(f'{disc.name}_{axis}')
             for disc in model.rotor.discs for axis in 'xz']
    motion = model.unbalance_response(speed, unbalance).displacement[:, discs]
    force = speed[:, None]**2 * np.outer(
        unbalance[:len(model.rotor.discs)], UNBALANCE_FORCE).ravel()
    return math.pi * (motion.conj() * force).imag.sum(axis=1)
