"""Which input moves the answer most? Each alone, over all that is known of it; and together."""

from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import combinations
import math
from pathlib import Path

import numpy as np

from rotorsoil_ros.arrays import FloatArray
from rotorsoil_ros.case import models
from rotorsoil_ros.case.config import Case
from rotorsoil_ros.case.design.inputs import input_of, UncertainInput
from rotorsoil_ros.case.entries.support_file import FILED
from rotorsoil_ros.errors import RotorSoilError
from rotorsoil_ros.ground.accuracy import gap
from rotorsoil_ros.ground.plan import Part, Plan
from rotorsoil_ros.ground.soil import Circle, Contact, Rectangle
from rotorsoil_ros.machine.band import depends_on_soil
from rotorsoil_ros.machine.coupled import CoupledModel
from rotorsoil_ros.machine.foundation import Foundation
from rotorsoil_ros.machine.modes.stability import stability
from rotorsoil_ros.machine.spread import UNBALANCE

# Places of an input that is looked at alone: a resonance may lie between its ends.
_ALONE = np.linspace(-1.0, 1.0, 9)
# Machines that are looked at closely at one speed: a band over all speeds has fewer.
_CLOSER = 256


@dataclass(frozen=True, slots=True)
class Influence:
    """
    What one input does to the velocity of a housing.

    Attributes
    ----------
    key : str
        Of `uncertainty`.
    velocity : (n,) float array
        From the lowest to the highest value of the input, the given one in the middle [m/s rms];
        NaN where the machine is unstable.

    """

    key: str
    velocity: FloatArray

    @property
    def input(self) -> UncertainInput:
        """What the input is, in words."""
        return input_of(self.key)

    @property
    def ends(self) -> FloatArray:
        """Velocity at the lowest, the given and the highest value of the input, (3,) [m/s rms]."""
        return self.velocity[[0, len(self.velocity) // 2, -1]]

    @property
    def largest(self) -> float:
        """Largest velocity over the range of the input [m/s rms]."""
        return float(self.velocity.max())

    @property
    def swing(self) -> float:
        """Largest over smallest velocity [-]; infinite where the machine becomes unstable."""
        small = float(self.velocity.min())
        return self.largest / small if small > 0.0 and math.isfinite(self.largest) else math.inf


def influences(
    case: Case, model: CoupledModel, *, speed: float, channel: int,
) -> list[Influence]:
    """
    Return what every uncertain input does alone, the strongest first.

    Parameters
    ----------
    case, model : Case, CoupledModel
        The machine, and what it stands for.
    speed : float
        Of the rotor [rad/s].
    channel : int
        Which channel of the model is looked at.

    """
    spread = case.uncertainty
    nominal = velocity(case, model, speed=speed, channel=channel)
    found = []
    for key in spread.inputs(with_soil=case.soil is not None and depends_on_soil(model)):
        if key == UNBALANCE:
            values = nominal * spread.unbalance_factor**_ALONE
        else:
            values = np.array([
                velocity(case, models.machine_at(case, model, spread, {key: place}), speed=speed,
                         channel=channel) for place in _ALONE.tolist()])
        found.append(Influence(key, values))
    return sorted(found, key=lambda one: -one.swing)


def extremes(case: Case, model: CoupledModel, speed: float) -> tuple[FloatArray, FloatArray]:
    """
    Return the smallest and the largest answer of many machines that this one may be.

    Parameters
    ----------
    case, model : Case, CoupledModel
        The machine, and what it stands for.
    speed : float
        Of the rotor [rad/s].

    Returns
    -------
    two (c,) float arrays
        Displacement of every channel, zero-to-peak [m, rad].

    Notes
    -----
    A sharp resonance that another shaft or soil would bring to this speed is found only if one
    of the machines has it: at one speed many more can be looked at than for a band.

    """
    spread = replace(case.uncertainty, samples=max(_CLOSER, case.uncertainty.samples))
    sizes = []
    for place in spread.places(with_soil=case.soil is not None and depends_on_soil(model)):
        other = models.machine_at(case, model, spread, place)
        with suppress(RotorSoilError):  # a resonance without damping has no number
            sizes.append(np.abs(other.unbalance_response(
                np.array([speed]), case.unbalance).displacement[0]))
    factor = spread.unbalance_factor
    return np.min(sizes, axis=0) / factor, np.max(sizes, axis=0) * factor


def velocity(case: Case, model: CoupledModel, *, speed: float, channel: int) -> float:
    """Return the velocity of a channel [m/s rms]; NaN where there is no steady answer."""
    try:
        if not stability(model, (speed, speed)).holds(np.array([speed]))[0]:
            return math.nan
        found = model.unbalance_response(np.array([speed]), case.unbalance).velocity
    except RotorSoilError:
        return math.nan
    return float(abs(found[0, channel])) / math.sqrt(2.0)


def on_larger_blocks(case: Case, directory: Path, factor: float) -> CoupledModel:
    """
    Return a machine whose blocks are longer and wider by a factor, of the same height.

    Its ground is solved anew where it has to be, and stored in the cache.

    Raises
    ------
    RotorSoilError
        If nobody knows such a machine; the reason continues a sentence.

    """
    if case.support.model in ('rigid', *FILED):
        raise RotorSoilError('the support is rigid' if case.support.model == 'rigid' else
                             'the file of the support knows this one only')
    for block in case.foundations:
        if block.on is not None:
            raise RotorSoilError(f'{block.name} stands on {block.on.foundation}')
        if block.body is not None:
            raise RotorSoilError(f'{block.name} bends, and its file tells of this size only')
    blocks = tuple(_larger(block, factor) for block in case.foundations)
    for first, second in combinations(blocks, 2):
        if gap(first.contact, second.contact, apart=(
                second.centre_x - first.centre_x, second.centre_y - first.centre_y)) < 0.0:
            raise RotorSoilError(f'{first.name} and {second.name} would overlap')
    return models.coupled_model(replace(case, foundations=blocks), directory)


def _larger(block: Foundation, factor: float) -> Foundation:
    mass, (x, y, z) = factor**2, block.inertia
    # Of a slab: mass with the area, inertia with the square of the sides too.
    return replace(block, contact=_scaled(block.contact, factor), mass=mass * block.mass,
                   inertia=(mass**2 * x, mass**2 * y, mass**2 * z),
                   inertia_product=mass**2 * block.inertia_product)


def _scaled(contact: Contact, factor: float) -> Contact:
    if isinstance(contact, Circle):
        return Circle(factor * contact.radius)
    if isinstance(contact, Rectangle):
        return Rectangle(factor * contact.half_width, factor * contact.half_length)
    return Plan(tuple(Part(factor * part.half_width, factor * part.half_length, factor * part.x,
                           factor * part.y) for part in contact.parts))
