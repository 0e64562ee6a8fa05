"""What a rigid cylinder in the layers gives way by: the ground around it and the ground below."""

from dataclasses import dataclass
from functools import cached_property, lru_cache
import math

import numpy as np
import scipy.linalg
from scipy.special import hankel2e, jve

from rotorsoil_ros.arrays import ComplexArray, FloatArray
from rotorsoil_ros.ground.elements.symmetry import disc_classes, SymmetryClass
from rotorsoil_ros.ground.layers.line import LineMatrices, VerticalLine
from rotorsoil_ros.ground.layers.waves import WavePencil, Waves

# Places of the classes in `disc_classes`: sway with rocking, heave, twist.
SWAY, HEAVE, TWIST = range(3)


@dataclass(frozen=True, slots=True, eq=False)
class _Face:
    """
    Displacements on a cylindrical face and their radial derivatives.

    Attributes
    ----------
    value, slope : (c, n, m) complex arrays
        Of c components at n nodes in m fields.

    """

    value: ComplexArray
    slope: ComplexArray


@dataclass(frozen=True, eq=False)
class RigidCylinder:
    """
    Massless rigid cylinder welded to the layers, of any radius.

    Attributes
    ----------
    line : VerticalLine
        Where its face is cut into elements.

    Notes
    -----
    Outside the radius the ground moves by its outgoing waves, below the base by standing waves
    under a lid that is held, and by what a motion of the lid does to columns of soil. Both sides
    meet at the nodes of the face below the base; nodes of a wall that is not welded are free.

    References
    ----------
    Waas (1972); Kausel (1974), Forced vibrations of circular foundations on layered media, MIT
    R74-11; Tassoulas & Kausel (1983), Int. J. Numer. Meth. Eng. 19, 1005-1032.

    """

    line: VerticalLine

    @cached_property
    def _outside(self) -> WavePencil:
        return WavePencil(self.line.outside, self.line.above_rock)

    @cached_property
    def _below(self) -> WavePencil:
        return WavePencil(self.line.below.without_first())

    def at(self, omega: float) -> 'CylinderInWaves':
        """Prepare for a frequency: the waves are the same for every radius and motion."""
        return CylinderInWaves(self.line, omega, self._outside.outgoing(omega),
                               self._below.standing(omega))


@dataclass(frozen=True, eq=False)
class CylinderInWaves:
    """
    Rigid cylinder at one frequency.

    Attributes
    ----------
    line : VerticalLine
        Its face.
    omega : float
        Excitation frequency.
    outgoing, standing : Waves
        Of the ground around it, and of the ground below its base.

    """

    line: VerticalLine
    omega: float
    outgoing: Waves
    standing: Waves

    def stiffness(self, motion: int, radius: float) -> ComplexArray:
        """
        Return the dynamic stiffness of the massless cylinder.

        Parameters
        ----------
        motion : int
            SWAY (sliding, then rocking that lowers the edge at +x), HEAVE or TWIST.
        radius : float
            Of the cylinder.

        Returns
        -------
        (r, r) complex array
            About the centre of the base.

        """
        around = self.around(motion, radius)
        below, lid, own = self.beneath(motion, radius)
        nodes, components = len(self.line.depth), own_components(motion)
        base = self.line.wall.stop - 1
        index = np.arange(components * nodes).reshape(components, nodes)
        held = index[:, self.line.wall].ravel()
        free = np.setdiff1d(index, held)
        lower = np.searchsorted(free, index[:, base + 1:].ravel())
        rigid = self._rigid(motion, radius).reshape(len(held), -1)
        among = around[np.ix_(free, free)]
        among[np.ix_(lower, lower)] += below
        towards = around[np.ix_(free, held)] @ rigid
        towards[lower] += lid
        self_stiffness = rigid.T @ around[np.ix_(held, held)] @ rigid + own
        return np.asarray(self_stiffness - towards.T @ scipy.linalg.solve(
            among, towards, assume_a='sym', check_finite=False))

    def around(self, motion: int, radius: float) -> ComplexArray:
        """Return the stiffness of the ground outside, (c n, c n), component by component."""
        face = _face(motion, self.outgoing, radius, outward=True)
        force = _forces(motion, self.line.outside, face, radius)
        size = face.value.shape[2]
        found = -scipy.linalg.solve(face.value.reshape(size, size).T,
                                    force.reshape(size, size).T, check_finite=False)
        return np.asarray(0.5 * (found + found.T))

    def beneath(
        self, motion: int, radius: float,
    ) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
        """
        Return the stiffness of the ground below the base.

        Returns
        -------
        edge : (c n, c n) complex array
            Of the nodes of the edge below the lid.
        lid : (c n, r) complex array
            Forces there per rigid motion of the lid.
        own : (r, r) complex array
            Of the lid.

        """
        line = self.line.below
        face = _face(motion, self.standing, radius, outward=False)
        rim = np.zeros((face.value.shape[0], 1, face.value.shape[2]))
        whole = _Face(np.concatenate([rim, face.value], axis=1),
                      np.concatenate([rim, face.slope], axis=1))
        force = _forces(motion, line, whole, radius)[:, 1:]
        size = face.value.shape[2]
        edge = scipy.linalg.solve(face.value.reshape(size, size).T,
                                  force.reshape(size, size).T, check_finite=False)
        edge = 0.5 * (edge + edge.T)
        columns, area = self._columns(motion, radius)
        pushed = _forces(motion, line, columns, radius)
        motions = columns.value.shape[2]
        moved = columns.value[:, 1:].reshape(size, motions)
        lid = pushed[:, 1:].reshape(size, motions) - edge @ moved
        at_rim = np.einsum('cr,cs->rs', columns.value[:, 0], pushed[:, 0])
        return edge, lid, area + at_rim - lid.T @ moved

    def _columns(self, motion: int, radius: float) -> tuple[_Face, ComplexArray]:
        """Return what rigid motions of the lid do to the soil below, without any wave."""
        line, square = self.line.below, self.omega**2
        shear = line.d_mu - square * line.v_rho
        axial = line.d_lambda + 2.0 * line.d_mu - square * line.v_rho
        if motion == TWIST:
            across = _below_lid(shear)
            return (_Face(radius * across[None, :, None], across[None, :, None]),
                    0.5 * math.pi * radius**4 * (shear[:1] @ across[:, None]))
        down = _below_lid(axial)
        if motion == HEAVE:
            still = np.zeros_like(down)
            return (_Face(np.stack([still, down])[..., None],
                          np.zeros((2, len(down), 1), dtype=complex)),
                    math.pi * radius**2 * (axial[:1] @ down[:, None]))
        across = _below_lid(shear)
        turning = (line.e_mu.T - line.e_lambda) @ down
        aside = np.zeros_like(down)
        aside[1:] = -np.linalg.solve(shear[1:, 1:], turning[1:])
        value = np.zeros((3, len(down), 2), dtype=complex)
        slope = np.zeros_like(value)
        value[0, :, 0], value[0, :, 1], value[1, :, 1] = across, aside, radius * down
        slope[1, :, 1] = down
        area: ComplexArray = np.zeros((2, 2), dtype=complex)
        area[0] = shear[0] @ across, shear[0] @ aside + turning[0]
        area[1, 1] = 0.25 * radius**2 * (axial[0] @ down)
        area *= math.pi * radius**2
        return _Face(value, slope), area

    def _rigid(self, motion: int, radius: float) -> FloatArray:
        """Return the displacements of the wall per rigid motion, (c, wall nodes, r)."""
        height = self.line.base - self.line.depth[self.line.wall].real
        one, none = np.ones_like(height), np.zeros_like(height)
        if motion == TWIST:
            return radius * one[None, :, None]
        if motion == HEAVE:
            return np.stack([none, one])[..., None]
        return np.stack([np.stack([one, height], axis=1),
                         np.stack([none, radius * one], axis=1), np.zeros((len(one), 2))])


def own_components(motion: int) -> int:
    """Return how many displacement components a motion has."""
    return (3, 2, 1)[motion]


def _below_lid(stiffness: ComplexArray) -> ComplexArray:
    """Return how columns of soil follow a lid that moves by one."""
    free = -np.linalg.solve(stiffness[1:, 1:], stiffness[1:, 0])
    return np.concatenate([[1.0 + 0.0j], free])


def _face(motion: int, waves: Waves, radius: float, *, outward: bool) -> _Face:
    """Return the displacements of all waves on the face of a cylinder."""
    cylinder = hankel2e if outward else jve
    if motion == TWIST:
        zero, one = (cylinder(order, waves.q * radius) for order in (0, 1))
        return _Face((waves.v * one)[None],
                     (waves.v * (waves.q * zero - one / radius))[None])
    zero, one = (cylinder(order, waves.k * radius) for order in (0, 1))
    k = waves.k
    if motion == HEAVE:
        return _Face(np.stack([-waves.u * one, waves.w * zero]),
                     np.stack([-waves.u * (k * zero - one / radius), -waves.w * (k * one)]))
    two = 2.0 * one / (k * radius) - zero
    across_zero, across_one = (cylinder(order, waves.q * radius) for order in (0, 1))
    across_two = 2.0 * across_one / (waves.q * radius) - across_zero
    still = np.zeros_like(waves.v)
    u, w, v, q = 0.5 * waves.u, waves.w, 0.5 * waves.v, waves.q
    value = np.stack([np.concatenate(parts, axis=1) for parts in (
        (u * zero, v * across_zero), (w * one, still), (-u * two, v * across_two))])
    slope = np.stack([np.concatenate(parts, axis=1) for parts in (
        (-u * (k * one), -v * (q * across_one)), (w * (k * zero - one / radius), still),
        (-u * (k * one - 2.0 * two / radius),
         v * (q * across_one - 2.0 * across_two / radius)))])
    return _Face(value, slope)


def _forces(motion: int, line: LineMatrices, face: _Face, radius: float) -> ComplexArray:
    """Return the nodal forces of the stresses on a face whose normal points outward."""
    share, coefficients = _coefficients(motion)
    total = np.zeros_like(face.value)
    for part, value, mixed in zip(coefficients, (line.v_mu, line.v_lambda),
                                  (line.e_mu, line.e_lambda), strict=True):
        radial, downward, around = part
        total += value @ (np.einsum('cd,dnm->cnm', radial, face.slope)
                          + np.einsum('cd,dnm->cnm', around / radius, face.value))
        total += mixed @ np.einsum('cd,dnm->cnm', downward, face.value)
    return np.asarray(radius * share * total)


@lru_cache
def _coefficients(motion: int) -> tuple[float, tuple[FloatArray, FloatArray]]:
    """Return what stresses on a face do to each component, per shear and per dilatation."""
    # At nu = 0 Hooke's law is all shear; what nu adds to it is lambda on the normal strains.
    shear: SymmetryClass = disc_classes(0.0)[motion]
    both = disc_classes(0.25)[motion]  # where lambda = G
    parts = shear.stiffness[0], both.stiffness[0] - shear.stiffness[0]
    return shear.share, parts
