"""What one exact solve costs and returns: the compliance of a contact at one wavenumber."""

import math

import numpy as np
from scipy.sparse import csc_matrix, csr_matrix
from scipy.sparse.linalg import splu

from rotorsoil_ros.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from rotorsoil_ros.errors import NotSolvedError
from rotorsoil_ros.ground.elements.mesh import Discretisation, NearField
from rotorsoil_ros.ground.elements.rays import RayElements, wavenumbers
from rotorsoil_ros.ground.elements.symmetry import disc_classes, plane_classes, SymmetryClass

# The orthonormal waves leave residuals of 1e-12; anything above this is a failed solve.
LARGEST_RESIDUAL = 1e-8


class HalfSpaceSolver:
    """
    Compliance of a rigid massless contact of unit size, welded to a half-space with G = rho = 1.

    Everything that a frequency does not change is made once: mesh, matrices of the near field,
    sparsity patterns. Soil enters through Poisson's ratio alone; its hysteretic damping makes
    the wavenumber complex and nothing else.

    Parameters
    ----------
    poisson_ratio : float
        nu of the soil; for plane stress nu / (1 + nu) [-].
    discretisation : Discretisation
        Near field and number of waves.
    axisymmetric : bool
        A disc; otherwise a strip in plane strain.

    """

    def __init__(
        self, poisson_ratio: float, discretisation: Discretisation, *, axisymmetric: bool,
    ) -> None:
        self._poisson_ratio = poisson_ratio
        near = NearField(discretisation, axisymmetric=axisymmetric)
        self._rays = RayElements(
            near, orders=discretisation.orders, axisymmetric=axisymmetric)
        self._pattern = _Pattern(near, self._rays)
        coordinates = np.concatenate(
            [near.coordinates, near.coordinates[:, self._rays.origin]], axis=1)
        in_contact = (np.abs(coordinates[1]) < 1e-9) & (coordinates[0] < 1.0 + 1e-9)
        classes = disc_classes(poisson_ratio) if axisymmetric else plane_classes(poisson_ratio)
        self._problems = [
            _Problem(symmetry, self._pattern, coordinates[0], in_contact) for symmetry in classes]

    @property
    def dofs(self) -> tuple[int, ...]:
        """Number of unknowns of each symmetry class."""
        return tuple(problem.dofs for problem in self._problems)

    def compliance(self, wavenumber: complex) -> ComplexArray:
        """
        Return the compliance at one complex wavenumber of shear waves.

        Parameters
        ----------
        wavenumber : complex
            k_S times the contact's length: a0 / sqrt(1 + i eta) [-].

        Returns
        -------
        (5,) or (4,) complex array
            Dimensionless xx, zz, ryry, xry and, for the disc, rzrz.

        Raises
        ------
        NotSolvedError
            If the system is singular or its solution leaves a residual.

        """
        if not 0.0 < abs(wavenumber) < math.inf:
            raise NotSolvedError(
                f'a half-space must be solved at a wavenumber that is finite and not 0, '
                f'got {wavenumber:g}')
        gradients, mass = self._pattern.entries(
            *self._rays.matrices(wavenumbers(wavenumber, self._poisson_ratio)))
        sway, heave, *twist = [
            problem.compliance(gradients, -wavenumber**2 * mass) for problem in self._problems]
        return np.array([sway[0, 0], heave[0, 0], sway[1, 1], sway[0, 1],
                         *(part[0, 0] for part in twist)])


class _Pattern:
    """Where near field and rays meet in one sparse scalar matrix."""

    def __init__(self, near: NearField, rays: RayElements) -> None:
        count = rays.dofs.shape[1]
        rows = np.concatenate([near.rows, np.repeat(rays.dofs, count, axis=1).ravel()])
        columns = np.concatenate([near.columns, np.tile(rays.dofs, (1, count)).ravel()])
        self.size = near.size + rays.origin.size
        keys, slot = np.unique(columns * self.size + rows, return_inverse=True)
        self.columns: IntArray = keys // self.size
        self.rows: IntArray = keys % self.size

        def gather(slots: IntArray) -> csr_matrix:
            return csr_matrix(
                (np.ones(slots.size), (slots, np.arange(slots.size))),
                shape=(keys.size, slots.size))

        near_entries = gather(slot[:near.rows.size])
        self._from_rays = gather(slot[near.rows.size:])
        operators = len(near.gradients)
        self._near_gradients: FloatArray = (
            near_entries @ near.gradients.reshape(operators**2, -1).T)
        self._near_mass: FloatArray = near_entries @ near.mass

    def entries(
        self, gradients: ComplexArray, mass: ComplexArray,
    ) -> tuple[ComplexArray, ComplexArray]:
        """Return the entries of int g_i h_j, (nnz, g * g), and of the mass, (nnz,)."""
        operators = len(gradients)
        rays = self._from_rays @ gradients.reshape(operators**2, -1).T
        return self._near_gradients + rays, self._near_mass + self._from_rays @ mass.ravel()


class _Problem:
    """The linear system of one symmetry class."""

    def __init__(
        self, symmetry: SymmetryClass, pattern: _Pattern, x: FloatArray,
        in_contact: BoolArray,
    ) -> None:
        count = symmetry.components
        self._share = symmetry.share
        self._mass: FloatArray = symmetry.mass.ravel()
        self._stiffness: FloatArray = symmetry.stiffness.reshape(-1, count**2)
        held = np.repeat(in_contact[:, None], count, axis=1)
        on_axis = np.zeros_like(held)
        on_axis[:, list(symmetry.fixed_on_axis)] = (x < 1e-9)[:, None]
        free = np.flatnonzero(~held & ~on_axis)
        held_dofs = np.flatnonzero(held)
        # Entry numbers in place of entries: slicing them once gives the order in which every
        # later solve has to lay its entries down.
        blocks = np.arange(pattern.rows.size * count**2).reshape(-1, count, count)
        component = np.arange(count)
        rows = np.broadcast_to(
            pattern.rows[:, None, None] * count + component[:, None], blocks.shape)
        columns = np.broadcast_to(
            pattern.columns[:, None, None] * count + component, blocks.shape)
        whole = csc_matrix(
            (blocks.ravel() + 1, (rows.ravel(), columns.ravel())),
            shape=(pattern.size * count, pattern.size * count))
        self._free = _Block(whole, free, free)
        self._across = _Block(whole, free, held_dofs)
        self._held = _Block(whole, held_dofs, held_dofs)
        constant, slope = symmetry.motions[:, :, 0], symmetry.motions[:, :, 1]
        motion = constant[:, None, :] + slope[:, None, :] * x[in_contact][:, None]
        self._motion: FloatArray = motion.reshape(len(motion), -1).T

    @property
    def dofs(self) -> int:
        """Number of unknowns."""
        return self._free.shape[0]

    def compliance(self, gradients: ComplexArray, inertia: ComplexArray) -> ComplexArray:
        """Return the compliance of the contact over this class's rigid motions, (m, m)."""
        entries = (gradients @ self._stiffness + np.outer(inertia, self._mass)).ravel()
        load = -(self._across.matrix(entries) @ self._motion)
        response = _solve(self._free.matrix(entries), load)
        reaction = self._motion.T @ (self._held.matrix(entries) @ self._motion)
        dynamic_stiffness = self._share * (reaction - load.T @ response)
        try:
            return np.linalg.inv(dynamic_stiffness)
        except np.linalg.LinAlgError as error:
            raise NotSolvedError('the dynamic stiffness of the contact is singular') from error


class _Block:
    """Rows and columns of a sparse matrix whose entries change."""

    def __init__(self, whole: csc_matrix, rows: IntArray, columns: IntArray) -> None:
        part = whole[rows][:, columns].tocsc()
        part.sort_indices()
        self.shape: tuple[int, int] = part.shape
        self._starts, self._indices, self._order = part.indptr, part.indices, part.data - 1

    def matrix(self, entries: ComplexArray) -> csc_matrix:
        """Return the block with these entries."""
        return csc_matrix((entries[self._order], self._indices, self._starts), shape=self.shape)


def _solve(matrix: csc_matrix, load: ComplexArray) -> ComplexArray:
    if not (np.isfinite(matrix.data).all() and np.isfinite(load).all()):
        raise NotSolvedError('the system of the half-space is not finite')
    try:
        # Symmetric ordering and mode halve the fill; the matrix is complex symmetric.
        factors = splu(matrix, permc_spec='MMD_AT_PLUS_A', diag_pivot_thresh=0.01,
                       options={'SymmetricMode': True})
    except RuntimeError as error:
        raise NotSolvedError(f'the system of the half-space: {error}') from error
    response: ComplexArray = factors.solve(np.ascontiguousarray(load))
    residual = np.abs(matrix @ response - load).max() / np.abs(load).max()
    if not residual < LARGEST_RESIDUAL:
        raise NotSolvedError(
            f'the system of the half-space leaves a residual of {residual:.1e}, '
            f'allowed is {LARGEST_RESIDUAL:g}')
    return response
