"""What ground gives way by under a contact of several patches, as of a raft that bends."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Protocol, runtime_checkable, Self

import numpy as np

from rotorsoil_ros.arrays import ComplexArray, FloatArray, side_by_side
from rotorsoil_ros.channel import DOFS
from rotorsoil_ros.errors import RotorSoilError
from rotorsoil_ros.ground.soil import second_opinion_of, singular_of, SoilModel


@runtime_checkable
class PatchedGround(Protocol):
    """Ground under the patches of one foundation."""

    def compliance(self, omega: FloatArray) -> ComplexArray:
        """Return the compliance over the motions of all patches, (n, c, c)."""
        ...

    def whole(self, omega: FloatArray) -> ComplexArray:
        """Return the compliance of all patches under a rigid body, (n, 6, 6)."""
        ...

    def mapped(self, change: Callable[[SoilModel], SoilModel | None]) -> 'PatchedGround | None':
        """Return the same patches on other models; None where there is none of them."""
        ...


def below_patches(model: SoilModel) -> tuple[SoilModel, ...]:
    """Return the models of the ground that one is made of: those of a bed, or itself."""
    if isinstance(model, WinklerBed):
        return (model.model,)
    return tuple(model.models) if isinstance(model, PatchesApart) else (model,)


def as_one(model: SoilModel) -> SoilModel:
    """Return what a rigid body would find in place of patches."""
    return UnderRigid(model) if isinstance(model, PatchedGround) else model


@dataclass(frozen=True)
class WinklerBed:
    """
    Springs and dashpots of the whole contact, shared out by area.

    Attributes
    ----------
    model : SoilModel
        Of the whole contact as if it were rigid.
    shares : (c,) float array
        Share of the area that each motion stands for [-]; along each axis they are one together.
    axes : tuple of int
        Which of x, y and z each motion is along.
    rows : (c, 6) float array
        Motion of each per motion of the whole.

    Notes
    -----
    Sliding and heave are those of the rigid contact; rocking is softer than its own by what
    springs that do not know of each other lack.

    """

    model: SoilModel
    shares: FloatArray
    axes: tuple[int, ...]
    rows: FloatArray

    def __post_init__(self) -> None:
        for axis in range(3):
            own = [share for share, along in zip(self.shares, self.axes, strict=True)
                   if along == axis]
            if own and not np.isclose(sum(own), 1.0):
                raise RotorSoilError(f'shares along {DOFS[axis]} must make one, got {sum(own):g}')

    @property
    def singular(self) -> FloatArray:
        """Where waves of layers begin to travel, rising [rad/s]."""
        return singular_of(self.model)

    @property
    def second_opinion(self) -> 'WinklerBed':
        """A poorer model of the same ground."""
        return replace(self, model=second_opinion_of(self.model))

    def compliance(self, omega: FloatArray) -> ComplexArray:
        """Return the compliance over the motions of all patches, (n, c, c)."""
        whole = np.diagonal(self.model.compliance(omega), axis1=1, axis2=2)
        own = whole[:, list(self.axes)] / self.shares
        return np.asarray(own[:, :, None] * np.eye(len(self.axes)))

    def whole(self, omega: FloatArray) -> ComplexArray:
        """Return the compliance of all patches under a rigid body, (n, 6, 6)."""
        return _under_rigid(self.compliance(omega), self.rows)

    def mapped(self, change: Callable[[SoilModel], SoilModel | None]) -> Self | None:
        """Return the same patches on another model of the whole."""
        model = change(self.model)
        return None if model is None else replace(self, model=model)


@dataclass(frozen=True)
class PatchesApart:
    """
    Patches each on a model of its own, or all on one that couples them.

    Attributes
    ----------
    models : sequence of SoilModel
        Under each patch; or one that tells six motions of each.
    kept : tuple of int
        Which of the motions, six by six of the patches, the ground resists.
    rows : (c, 6) float array
        Motion of each of these per motion of the whole.

    """

    models: Sequence[SoilModel]
    kept: tuple[int, ...]
    rows: FloatArray

    @property
    def singular(self) -> FloatArray:
        """Where waves of layers begin to travel, rising [rad/s]."""
        return np.unique(np.concatenate([np.zeros(0), *map(singular_of, self.models)]))

    @property
    def second_opinion(self) -> 'PatchesApart':
        """A poorer model of the same ground."""
        return replace(self, models=tuple(map(second_opinion_of, self.models)))

    def compliance(self, omega: FloatArray) -> ComplexArray:
        """Return the compliance over the motions of all patches, (n, c, c)."""
        # Equal patches share a model, which is asked once.
        asked = {id(model): model.compliance(omega) for model in self.models}
        total = side_by_side([asked[id(model)] for model in self.models], len(omega))
        kept = np.array(self.kept, dtype=int)
        return total[:, kept[:, None], kept]

    def whole(self, omega: FloatArray) -> ComplexArray:
        """Return the compliance of all patches under a rigid body, (n, 6, 6)."""
        return _under_rigid(self.compliance(omega), self.rows)

    def mapped(self, change: Callable[[SoilModel], SoilModel | None]) -> Self | None:
        """Return the same patches on other models."""
        found = {id(model): change(model) for model in self.models}
        models = tuple(found[id(model)] for model in self.models)
        return None if None in models else replace(
            self, models=tuple(model for model in models if model is not None))


@dataclass(frozen=True)
class UnderRigid:
    """Patched ground as a rigid body above it would find it."""

    ground: PatchedGround

    @property
    def singular(self) -> FloatArray:
        """Where waves of layers begin to travel, rising [rad/s]."""
        return singular_of(self.ground)

    def compliance(self, omega: FloatArray) -> ComplexArray:
        """Return the compliance of the massless contact, (n, 6, 6) over (x, y, z, rx, ry, rz)."""
        return self.ground.whole(omega)


def _under_rigid(compliance: ComplexArray, rows: FloatArray) -> ComplexArray:
    """Return (R^T N^-1 R)^-1, zero where the ground does not give way."""
    if not np.all(np.any(compliance != 0.0, axis=(0, 1))):
        return np.zeros((len(compliance), 6, 6), dtype=complex)
    stiffness = rows.T @ np.linalg.solve(compliance, np.broadcast_to(
        rows.astype(complex), (len(compliance), *rows.shape)))
    return np.asarray(np.linalg.inv(stiffness), dtype=complex)
