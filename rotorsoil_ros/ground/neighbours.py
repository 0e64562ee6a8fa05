"""The same support on another soil, without solving the soil again."""

from dataclasses import dataclass, replace

import numpy as np

from rotorsoil_ros.arrays import ComplexArray, FloatArray
from rotorsoil_ros.errors import RotorSoilError
from rotorsoil_ros.ground.bed import PatchedGround
from rotorsoil_ros.ground.boundary.layered_model import LayeredSiteModel
from rotorsoil_ros.ground.boundary.model import BoundaryElementModel
from rotorsoil_ros.ground.cone import ConeModel
from rotorsoil_ros.ground.embedded_cone import EmbeddedConeModel
from rotorsoil_ros.ground.green import GreenModel
from rotorsoil_ros.ground.half_space import InfiniteElementModel
from rotorsoil_ros.ground.layers.model import ThinLayerModel
from rotorsoil_ros.ground.soil import Contact, RigidSoil, Soil, SoilModel, static_scale


@dataclass(frozen=True, slots=True)
class NeighbourSoil:
    """
    Infinite elements on a soil that differs a little from the one they were solved for.

    Attributes
    ----------
    solved : InfiniteElementModel
        Its table's Poisson's ratio, everything else of the neighbour.
    poisson_ratio : float
        nu of the neighbour [-].

    Notes
    -----
    G and rho are a rescaling, and eta is another point of the same analytic function: both are
    exact. For nu the compliance is scaled by S N S, where S squared is the ratio of the static
    compliances of a disc, (2 - nu) for sliding, (1 - nu) for heaving and rocking, 1 for torsion:
    exact at rest for a smooth disc, and passive at every frequency. What is left out is the
    change of the speed of pressure waves: for +0.05 heave and rocking are off by 4 percent (from
    nu 0.25) to 26 (from 0.40) at a0 up to 5, by 2 to 7 below a0 = 2
    (`python -m benchmarks.model_errors`).

    Below the frequencies of a table, which a stiffer soil can reach, its lowest one stands.

    """

    solved: InfiniteElementModel
    poisson_ratio: float

    def compliance(self, omega: FloatArray) -> ComplexArray:
        """Return the compliance of the massless contact, (n, 6, 6) over (x, y, z, rx, ry, rz)."""
        scale = static_scale(self.solved.soil.poisson_ratio, self.poisson_ratio)
        omega = np.maximum(omega, self.solved.omega_range[0])
        return np.asarray(self.solved.compliance(omega) * np.outer(scale, scale))


def on_soil(
    model: SoilModel, soil: Soil, contact: Contact, *, of: Soil | None = None,
) -> SoilModel:
    """
    Return a model of the same kind as a given one, below the same contacts, on another soil.

    Layers are all stiffened and made heavier in one ratio, which is exact; their other figures
    stay.

    Parameters
    ----------
    model : SoilModel
        The given one.
    soil : Soil
        The other soil.
    contact : Contact
        Where there is one of its own.
    of : Soil or None
        What the other soil stands in the place of; None is what is below this base. Where bases
        are in different layers it is that of one of them, the same for all.

    Raises
    ------
    RotorSoilError
        If the model does not know of a soil: a rigid base or a table from a file.

    """
    match model:
        case PatchedGround():
            found = model.mapped(lambda one: on_soil(
                one, soil, getattr(one, 'contact', contact), of=of))
            assert found is not None
            return found
        case BoundaryElementModel() | GreenModel():
            return model.on(soil)
        case ConeModel() | EmbeddedConeModel():
            return replace(model, soil=soil, contact=contact)
        case InfiniteElementModel(table=table):
            as_solved = replace(soil, poisson_ratio=table.poisson_ratio)
            table = replace(table, loss_factor=soil.loss_factor)
            return NeighbourSoil(InfiniteElementModel(as_solved, contact, table),
                                 soil.poisson_ratio)
        case LayeredSiteModel() | ThinLayerModel():
            own = of or model.material
            return model.scaled(modulus=soil.shear_modulus / own.shear_modulus,
                                density=soil.density / own.density)
    raise RotorSoilError(f'a support of type {type(model).__name__} does not depend on the soil')


def without_loss(model: SoilModel, contact: Contact) -> SoilModel | None:
    """Return a model on the same soil without material damping; None where it knows of none."""
    if isinstance(model, RigidSoil):
        return model
    if isinstance(model, PatchedGround):
        return model.mapped(lambda one: without_loss(one, getattr(one, 'contact', contact)))
    if isinstance(model, (BoundaryElementModel, ConeModel, EmbeddedConeModel,
                          InfiniteElementModel)):
        return on_soil(model, replace(model.soil, loss_factor=0.0), contact)
    return None
