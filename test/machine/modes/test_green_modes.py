"""Modes on patches that the ground couples, against the exact continuation of their delays."""

from dataclasses import dataclass, replace
import math
from pathlib import Path

from foundations import raft_body
import numpy as np
import pytest

from rotorsoil_ros.case import config
from rotorsoil_ros.ground.bed import PatchesApart
from rotorsoil_ros.ground.green import _SURFACE, GreenModel
from rotorsoil_ros.ground.soil import Rectangle, Soil
from rotorsoil_ros.machine.continued import continued_by_pieces
from rotorsoil_ros.machine.coupled import CoupledModel
from rotorsoil_ros.machine.foundation import Foundation
from rotorsoil_ros.machine.modes.spectrum import SpectrumSolver

FAN = Path(__file__).parents[3] / 'config' / 'plant_fan.yaml'
SPEED = np.array([155.0])
HIGHEST = 220.0


@dataclass(frozen=True)
class Exact:
    """The compliance of patches at complex frequencies: a polynomial times delays is entire."""

    green: GreenModel
    size: np.ndarray

    def __call__(self, omega):
        """Return it over its size, (..., d, d)."""
        table, soil = self.green.table, self.green.soil
        unit = self.green.radii[0]
        a0 = (omega.ravel() + 1e-9) * unit / soil.shear_wave_speed
        weights = (-1.0) ** np.arange(len(table.nodes))
        weights[[0, -1]] *= 0.5
        cauchy = weights / (a0[:, None] - table.nodes)
        smooth = np.einsum('nm,muk->nuk', cauchy, table.values) / cauchy.sum(axis=1)[:, None, None]
        smooth *= np.exp(-1j * np.multiply.outer(a0, table.pairs[:, 2]) / _SURFACE)[..., None]
        vertical, mean, gap = np.moveaxis(
            smooth[:, self.green._pairs[1]], -1, 0) / (soil.shear_modulus * unit)
        apart = np.array(self.green.places)[:, None] - np.array(self.green.places)
        angle = 2.0 * np.arctan2(apart[..., 1], apart[..., 0])
        count = len(self.green.places)
        total = np.zeros((len(a0), count, 3, count, 3), dtype=complex)
        total[:, :, 0, :, 0] = mean - gap * np.cos(angle)
        total[:, :, 1, :, 1] = mean + gap * np.cos(angle)
        total[:, :, 0, :, 1] = total[:, :, 1, :, 0] = -gap * np.sin(angle)
        total[:, :, 2, :, 2] = vertical
        flat = total.reshape(*omega.shape, 3 * count, 3 * count)
        return flat / (self.size[:, None] * self.size)


@pytest.fixture(scope='module')
def model():
    """Return a fan on the raft of the reference, its patches coupled through the ground."""
    body = raft_body()
    places = tuple((patch.place[0], patch.place[1]) for patch in body.patches)
    radii = (math.sqrt(4.0 / math.pi),) * len(places)
    green = GreenModel.solved(Soil(100e6, 0.3, 1900.0, 0.05), places, radii,
                              omega_max=1.2 * HIGHEST)
    kept = tuple(range(3 * len(places)))
    bed = PatchesApart([green], kept, body.about_centre[body.contacts])
    rotor = config.load(FAN).rotor
    rotor = replace(rotor, bearings=tuple(
        replace(one, foundation='raft', seat=seat)
        for one, seat in zip(rotor.bearings, ('fan_1_b1', 'fan_1_b2'), strict=True)))
    block = Foundation('raft', Rectangle(6.0, 2.0), 0.0, 1.0, 1.0, (1.0, 1.0, 1.0), body=body)
    return CoupledModel(rotor, (block,), (bed,))


def test_modes_that_are_told_are_those_of_the_exact_ground(model):
    solver = SpectrumSolver.up_to(model, HIGHEST)
    [zone] = solver.zones
    found = solver.solve(SPEED, 10**6).frequency[0]
    told = found[np.isfinite(found)]
    assert len(told) > 15
    whirls = solver.shafts.whirls(SPEED, zone.middle, zone.lag)
    vibration = solver._at(SPEED, whirls, zone, 1.5)
    [green] = model.soil_models[0].models
    exact = replace(vibration, compliance=Exact(green, vibration.compliance.size))
    for w in told:
        near, _, sound = exact.nearest(np.array([[w]]))
        assert sound[0]
        damping = w.imag / abs(w)
        # Where it decays faster the delays grow, and with them what a fit may miss.
        assert abs(near[0, 0] - w) < (1e-6 if damping < 0.3 else 1e-3 if damping < 0.5
                                      else 0.03) * abs(w)


def test_what_only_the_fit_says_is_not_told(model):
    [compliance] = continued_by_pieces(model.support, (0.0, HIGHEST))
    [green] = model.soil_models[0].models
    exact = Exact(green, compliance.size)
    real = np.linspace(30.0, 0.95 * HIGHEST, 12)[:, None]
    ratio = np.array([0.1, 0.3, 0.5, 0.7, 0.85])
    w = real * (1.0 + 1j * ratio / np.sqrt(1.0 - ratio**2))
    own, truth = compliance(w), exact(w)
    off = np.abs(own - truth).max(axis=(2, 3)) / np.abs(truth).max(axis=(2, 3))
    told = compliance.persists(w)
    assert np.all(told[:, :2])
    assert off[told].max() < 0.1
    assert off[~told].max() > 0.3
