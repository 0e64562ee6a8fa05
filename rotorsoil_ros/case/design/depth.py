"""What rock would do to a machine whose case says nothing of the depth of its soil."""

from collections.abc import Iterator
from dataclasses import replace
import math
from pathlib import Path

import numpy as np

from rotorsoil_ros.case import models
from rotorsoil_ros.case.cache import Cache
from rotorsoil_ros.case.config import Case
from rotorsoil_ros.channel import ACROSS
from rotorsoil_ros.errors import RotorSoilError
from rotorsoil_ros.ground.soil import equivalent_radii
from rotorsoil_ros.machine.band import depends_on_soil
from rotorsoil_ros.machine.coupled import CoupledModel
from rotorsoil_ros.units import Units

# Depth of rock that is tried where nothing is said of it, in radii below the base, and at how
# many speeds.
_ROCK = 1.1
_SPEEDS = 400

# Less than this factor on the highest amplitude is within what any soil does to it.
_MATTERS = 1.1


def depth_remarks(case: Case, model: CoupledModel, directory: Path) -> Iterator[str]:
    """
    Yield what rock would do to a machine whose case says nothing of it.

    Parameters
    ----------
    case, model : Case, CoupledModel
        The machine, and what it stands for.
    directory : Path
        Of the cache, in which the table of a layer on rock lies or will lie.

    """
    told = case.uncertainty.rock_depth is not None or (
        case.ground is not None and case.ground.layers)
    if told or case.soil is None or case.support.geometry != 'disc' or not depends_on_soil(model):
        return
    widest = max(float(equivalent_radii(block.contact)[0]) for block in case.foundations)
    deepest = max(one.depth for one in case.embedments)
    depth = round(deepest + _ROCK * widest, 1)
    if depth <= deepest:
        return
    spread = replace(case.uncertainty, rock_depth=(depth, math.inf))
    housings = [index for index, channel in enumerate(model.channels)
                if channel.is_housing and channel.axis in ACROSS]
    speed = np.linspace(*case.speed_range, _SPEEDS)
    try:
        without, on_rock = (
            np.abs(machine.unbalance_response(speed, case.unbalance).displacement[:, housings])
            for machine in (model, models.machine_at(
                case, model, spread, {'rock_depth': -1.0}, Cache(directory))))
    except RotorSoilError:  # beyond the reach of a model: its own error says so
        return
    first, second = (float(found.max(initial=0.0)) for found in (without, on_rock))
    if second > _MATTERS * first:
        yield (f'soil: nothing is said of rock; at {depth:g} m below the surface it would raise '
               f'the highest displacement of the housings from '
               f'{Units().displacement(first, digits=3)} to '
               f'{Units().displacement(second, digits=3)}: say uncertainty.rock_depth, or '
               'soil.layers and below')
