"""Which ground stands below the patches of a foundation that bends."""

from collections.abc import Callable
import math

import numpy as np

from rotorsoil_ros.arrays import FloatArray
from rotorsoil_ros.channel import DOFS
from rotorsoil_ros.errors import RotorSoilError
from rotorsoil_ros.ground.bed import PatchesApart, WinklerBed
from rotorsoil_ros.ground.soil import Contact, Rectangle, RigidSoil, SoilModel
from rotorsoil_ros.machine.flexible.body import Dof, FlexibleBody, GREEN, WINKLER
from rotorsoil_ros.machine.foundation import Foundation


def bed_of(
    foundation: Foundation, under: Callable[[Contact], SoilModel],
    through: Callable[[FlexibleBody], SoilModel],
) -> SoilModel:
    """
    Return the ground below a foundation, of one that bends below its patches.

    Parameters
    ----------
    foundation : Foundation
        On one contact or on several.
    under : callable
        From a contact to the model of the ground under it alone.
    through : callable
        From a body to the model that couples its patches through a half-space.

    """
    body = foundation.body
    if body is None:
        return under(foundation.contact)
    rows = body.about_centre[body.contacts]
    axes = [DOFS.index(body.dofs[index].axis) for index in body.contacts]
    if body.bed == WINKLER:
        return WinklerBed(under(foundation.contact), _shares(body), tuple(axes), rows)
    if not body.bed:
        return under(foundation.contact)
    stations = [patch.station for patch in body.patches]
    each = len(DOFS[:3]) if body.bed == GREEN else len(DOFS)
    kept = tuple(each * stations.index(body.dofs[index].station) + axis
                 for index, axis in zip(body.contacts.tolist(), axes, strict=True))
    if body.bed == GREEN:
        return PatchesApart((through(body),), kept, rows)
    contacts = [contact_of(patch, foundation) for patch in body.patches]
    models = {contact: under(contact) for contact in dict.fromkeys(contacts)}
    return PatchesApart(tuple(models[contact] for contact in contacts), kept, rows)


def welded(foundation: Foundation) -> SoilModel:
    """Return what is between a foundation and that on which it stands: nothing that gives."""
    return bed_of(foundation, lambda _: RigidSoil(), lambda _: RigidSoil())


def _shares(body: FlexibleBody) -> FloatArray:
    """Return which share of the whole contact each motion stands for, along its axis."""
    dofs = [body.dofs[index] for index in body.contacts]
    area = np.array([dof.area or 1.0 for dof in dofs])
    axes = np.array([dof.axis for dof in dofs])
    return np.array([one / area[axes == axis].sum()
                     for one, axis in zip(area.tolist(), axes.tolist(), strict=True)])


def contact_of(patch: Dof, foundation: Foundation) -> Contact:
    """Return the contact of one patch: a square of its area, or what the foundation says."""
    if patch.area > 0.0:
        half = 0.5 * math.sqrt(patch.area)
        return Rectangle(half, half)
    return foundation.contact


def discs(body: FlexibleBody) -> tuple[tuple[tuple[float, float], ...], tuple[float, ...]]:
    """
    Return where the patches of a body are, and the radii of discs of their areas.

    Raises
    ------
    RotorSoilError
        If the area of a patch is not known.

    """
    for patch in body.patches:
        if not patch.area > 0.0:
            raise RotorSoilError(f'area of {patch.station} must be > 0 m^2 where patches are '
                                 f'coupled through the ground, got {patch.area:g}')
    return (tuple(patch.place[:2] for patch in body.patches),
            tuple(math.sqrt(patch.area / math.pi) for patch in body.patches))
