"""How stiffness and mass of finite elements become a body: modes, and what they leave out."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import scipy.linalg
import scipy.sparse
import scipy.sparse.linalg

from rotorsoil_ros.arrays import FloatArray
from rotorsoil_ros.errors import NotSolvedError, require, RotorSoilError
from rotorsoil_ros.machine.flexible.body import CONTACT, Dof, FlexibleBody, GROUNDED

Sparse: TypeAlias = scipy.sparse.csc_matrix

# Matrices are symmetric up to this share of their largest entry, and nothing holds a free body:
# its stiffness against rigid motion is below the second share.
_SYMMETRIC, _FREE = 1e-8, 1e-6

# Up to so many motions all modes are solved for; beyond, those that are wanted.
_DENSE = 700
_FIRST_MODES = 40

# Shares of the stiffness that make it definite, for the search of modes.
_SHIFT = 1e-3

# No part of a foundation swings slower than this [rad/s]: it hangs on nothing.
_LOOSE = 0.1


@dataclass(frozen=True)
class FiniteElements:
    """
    Stiffness and mass of a body, and what its motions are.

    Attributes
    ----------
    stiffness, mass : (d, d) sparse matrices
        Symmetric [N/m], [kg].
    interface : tuple of Dof
        Motions that are asked for.
    pick : (p, d) sparse matrix
        Each of them by the motions of the matrices.
    rigid : (d, 6) float array
        Rigid motion of all motions of the matrices.

    """

    stiffness: Sparse
    mass: Sparse
    interface: tuple[Dof, ...]
    pick: Sparse
    rigid: FloatArray

    @classmethod
    def of(
        cls, stiffness: Sparse, mass: Sparse, interface: Sequence[Dof], pick: Sparse,
        known: Mapping[int, Dof],
    ) -> 'FiniteElements':
        """
        Check matrices and return them with their rigid motion.

        Parameters
        ----------
        stiffness, mass : sparse matrices
            Of the same motions.
        interface, pick
            As the attributes.
        known : mapping of int to Dof
            Those motions of the matrices of which somebody knows the place; the others follow
            them at rest.

        Raises
        ------
        RotorSoilError
            If they are not symmetric, or not those of a free body.

        """
        for name, matrix in (('stiffness', stiffness), ('mass', mass)):
            require_symmetric(name, matrix)
            least = float(matrix.diagonal().min())
            require(least >= 0.0, name, '>= 0 on its diagonal', least)
        require(bool(stiffness.diagonal().max() > 0.0), 'stiffness', '> 0 N/m somewhere', 0.0)
        if stiffness.shape != mass.shape:
            raise RotorSoilError(f'mass must be of the {stiffness.shape[0]} motions of the '
                                 f'stiffness, got {mass.shape[0]}')
        rigid = _rigid(stiffness, list(known), np.array(
            [dof.rigid_row for dof in known.values()]).reshape(-1, 6))
        least = float((rigid.T @ (mass @ rigid)).diagonal().min())
        require(least > 0.0, 'mass', '> 0 kg in every rigid motion', least)
        return cls(stiffness, mass, tuple(interface), pick, rigid)

    @classmethod
    def at(cls, stiffness: Sparse, mass: Sparse, dofs: Mapping[int, Dof]) -> 'FiniteElements':
        """Check matrices as `of` does; the motions that are asked for are rows of them."""
        size = stiffness.shape[0]
        pick = scipy.sparse.csc_matrix(
            (np.ones(len(dofs)), (np.arange(len(dofs)), list(dofs))), shape=(len(dofs), size))
        return cls.of(scipy.sparse.csc_matrix(stiffness), scipy.sparse.csc_matrix(mass),
                      tuple(dofs.values()), pick, dofs)

    @property
    def held(self) -> float:
        """How much holds the body: forces of rigid motion over the largest stiffness [-]."""
        return float(np.abs(self.stiffness @ self.rigid).max() / abs(self.stiffness).max())

    def body(self, highest: float, *, loss: float) -> FlexibleBody:
        """
        Return the free body with its modes up to a frequency, and what these leave out.

        Parameters
        ----------
        highest : float
            [rad/s].
        loss : float
            Loss factor of the material [-].

        Raises
        ------
        RotorSoilError
            If something holds the body.

        """
        if self.held > _FREE:
            raise RotorSoilError(
                f'stiffness must be that of a body that nothing holds, got forces of rigid motion '
                f'of {self.held:.2g} of its largest entry, more than {_FREE:g}: take out springs '
                'to the ground, or say grounded: true of a body that stands on nothing else; or '
                'its file has too few digits (nine are enough), or places other than the matrices')
        mass = self.rigid.T @ (self.mass @ self.rigid)
        squares, shapes = self._modes(highest)
        residual = self._static(mass) - (shapes / squares) @ shapes.T
        return FlexibleBody(
            self.interface, mass, self.pick @ self.rigid, shapes, squares,
            0.5 * (residual + residual.T), np.full(len(squares), loss), loss, reach=highest)

    def grounded(self, highest: float, *, loss: float) -> FlexibleBody:
        """Return the body where its stiffness already holds it: a contact that does not move."""
        if self.held <= _FREE:
            raise RotorSoilError('grounded must be false of a body that nothing holds, got true')
        squares, shapes = self._modes(highest, rigid=0)
        static = self.pick @ scipy.sparse.linalg.splu(self.stiffness).solve(self.pick.T.toarray())
        residual = static - (shapes / squares) @ shapes.T
        nothing = np.zeros((6, len(squares)))
        base = tuple(Dof('base', axis, CONTACT, (0.0, 0.0, 0.0))
                     for axis in ('x', 'y', 'z', 'rx', 'ry', 'rz'))
        return FlexibleBody(
            (*self.interface, *base), np.eye(6),
            np.concatenate([np.zeros((len(shapes), 6)), np.eye(6)]),
            np.concatenate([shapes, nothing]), squares,
            scipy.linalg.block_diag(0.5 * (residual + residual.T), np.zeros((6, 6))),
            np.full(len(squares), loss), loss, GROUNDED, highest)

    def _modes(self, highest: float, rigid: int = 6) -> tuple[FloatArray, FloatArray]:
        """Return squared frequencies up to one and shapes at the interface, of unit mass."""
        size = self.stiffness.shape[0]
        # About a little below zero, where the matrix of a free body is definite.
        shift = _SHIFT * highest**2
        found = self._some_modes(highest, shift) if size > _DENSE else None
        if found is None:
            stiffness, mass = self.stiffness.toarray(), self.mass.toarray()
            # Mass on the left: motions without mass have zero there, not infinity.
            try:
                inverse, shapes = scipy.linalg.eigh(mass, stiffness + shift * mass)
            except scipy.linalg.LinAlgError as error:
                raise _indefinite() from error
            keep = inverse > 1.0 / (highest**2 + shift)
            found = 1.0 / inverse[keep] - shift, shapes[:, keep] / np.sqrt(inverse[keep])
        order = np.argsort(found[0])
        squares = found[0][order]
        if squares.min(initial=0.0) < -shift:
            raise _indefinite()
        if len(squares) > rigid and squares[rigid] < _LOOSE**2:
            raise RotorSoilError(
                f'stiffness must hold the body together, got {rigid + 1} motions or more that '
                'nothing resists')
        return squares[rigid:], self.pick @ found[1][:, order[rigid:]]

    def _some_modes(
        self, highest: float, shift: float,
    ) -> tuple[FloatArray, FloatArray] | None:
        """Return squared frequencies and shapes up to one; None if that is half of all."""
        size, count = self.stiffness.shape[0], _FIRST_MODES
        while 2 * count < size:
            try:
                squares, shapes = scipy.sparse.linalg.eigsh(
                    self.stiffness, k=count, M=self.mass, sigma=-shift)
            except scipy.sparse.linalg.ArpackError as error:
                raise NotSolvedError(f'modes of the foundation were not found: {error}') \
                    from error
            if squares.max() > highest**2:
                keep = squares <= highest**2
                return squares[keep], shapes[:, keep]
            count *= 2
        return None

    def _static(self, mass: FloatArray) -> FloatArray:
        """
        Return the elastic motion of the interface at rest per force on it, inertia balancing it.

        [[K, M R], [R^T M, 0]] [x; l] = [A P^T; 0] with A = 1 - M R (R^T M R)^-1 R^T.
        """
        carried = self.mass @ self.rigid
        loads = self.pick.T.toarray()
        loads -= carried @ np.linalg.solve(mass, (self.pick @ self.rigid).T)
        # The border in the units of the stiffness.
        scale = abs(self.stiffness).max() / np.abs(carried).max(axis=0)
        border = scipy.sparse.csc_matrix(carried * scale)
        system = scipy.sparse.bmat([[self.stiffness, border], [border.T, None]], format='csc')
        try:
            found = scipy.sparse.linalg.splu(system).solve(
                np.concatenate([loads, np.zeros((6, loads.shape[1]))]))
        except RuntimeError as error:
            raise RotorSoilError('stiffness must hold the body together: some of its motions '
                                 'nothing resists') from error
        elastic = found[:len(loads)]
        elastic -= self.rigid @ np.linalg.solve(mass, carried.T @ elastic)
        return np.asarray(self.pick @ elastic)


def _rigid(stiffness: Sparse, known: list[int], rows: FloatArray) -> FloatArray:
    """Return the rigid motion of all motions from those whose place is known."""
    size = stiffness.shape[0]
    rigid = np.zeros((size, 6))
    rigid[known] = rows
    others = np.setdiff1d(np.arange(size), known)
    if len(others):
        own = stiffness[others][:, others].tocsc()
        try:
            rigid[others] = -scipy.sparse.linalg.splu(own).solve(
                np.asarray(stiffness[others][:, known] @ rows))
        except RuntimeError as error:
            raise RotorSoilError('stiffness must hold the motions whose place the dofs do not '
                                 'say: they do not follow the others') from error
    return rigid


def require_symmetric(
    name: str, matrix: Sparse | FloatArray, share: float = _SYMMETRIC,
) -> None:
    """Raise a RotorSoilError if a matrix is not symmetric within a share of its largest entry."""
    skew = float(abs(matrix - matrix.T).max() / (abs(matrix).max() or 1.0))
    require(skew <= share, name, f'symmetric within {share:g} of its largest entry', skew)


def _indefinite() -> RotorSoilError:
    return RotorSoilError('stiffness and mass must not be negative in any direction, as those of '
                          'a body are')
