"""Rescaled supports against supports solved anew."""

from dataclasses import replace

import numpy as np
import pytest

from rotorsoil_ros.errors import RotorSoilError
from rotorsoil_ros.ground.cone import ConeModel
from rotorsoil_ros.ground.half_space import InfiniteElementModel
from rotorsoil_ros.ground.neighbours import on_soil
from rotorsoil_ros.ground.soil import Circle, RigidSoil, Soil
from rotorsoil_ros.machine.band import depends_on_soil, on_soils

from machines import CONTACT, paper_machine, SOIL

DISC = Circle(0.6)
OMEGA = np.array([60.0, 200.0, 500.0])


@pytest.fixture(scope='module')
def solved():
    """Return infinite elements for a soil."""
    return InfiniteElementModel.solved(SOIL, DISC, 'disc', omega_min=0.0, omega_max=600.0)


def test_other_modulus_and_loss_are_exact(solved):
    other = replace(SOIL, shear_modulus=0.6 * SOIL.shear_modulus, loss_factor=0.05)
    anew = InfiniteElementModel.solved(other, DISC, 'disc', omega_min=0.0, omega_max=600.0)
    got = on_soil(solved, other, DISC).compliance(OMEGA)
    scale = np.abs(anew.compliance(OMEGA)).max(axis=0)
    moving = scale > 0.0
    error = np.abs(got - anew.compliance(OMEGA))[:, moving] / scale[moving]
    assert error.max() < 2e-3  # the error of two tables


def test_other_poisson_ratio_is_near(solved):
    other = replace(SOIL, poisson_ratio=SOIL.poisson_ratio + 0.05)
    anew = InfiniteElementModel.solved(other, DISC, 'disc', omega_min=0.0, omega_max=600.0)
    got, unscaled = on_soil(solved, other, DISC).compliance(OMEGA), solved.compliance(OMEGA)
    for dof in (0, 2, 4):
        exact = anew.compliance(OMEGA)[:, dof, dof]
        error = np.abs(got[:, dof, dof] / exact - 1.0)
        assert error.max() < 0.03  # what the speed of pressure waves still changes
        assert error[0] < 0.5 * np.abs(unscaled[0, dof, dof] / exact[0] - 1.0)


def test_neighbour_stays_passive(solved):
    other = Soil(0.5 * SOIL.shear_modulus, 0.45, SOIL.density, 0.02)
    loss = -np.imag(on_soil(solved, other, DISC).compliance(OMEGA))
    assert np.linalg.eigvalsh(loss).min() > -1e-12 * loss.max()


def test_cones_are_built_for_the_other_soil():
    other = replace(SOIL, shear_modulus=20e6, poisson_ratio=0.4)
    assert on_soil(ConeModel(SOIL, CONTACT), other, CONTACT) == ConeModel(other, CONTACT)


def test_machine_is_the_same_on_every_soil_but_for_the_soil():
    machine = paper_machine(ConeModel(SOIL, CONTACT))
    assert depends_on_soil(machine)
    other = replace(SOIL, shear_modulus=20e6)
    [moved] = on_soils(machine, [other])
    assert moved.rotor is machine.rotor
    assert moved.soil_models == (ConeModel(other, CONTACT),)


def test_rigid_base_depends_on_no_soil():
    assert not depends_on_soil(paper_machine(RigidSoil()))
    with pytest.raises(RotorSoilError, match='of type RigidSoil does not depend on the soil'):
        on_soil(RigidSoil(), SOIL, CONTACT)
