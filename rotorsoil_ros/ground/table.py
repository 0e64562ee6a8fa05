"""What a contact gives way by when somebody else computed or measured it."""

from dataclasses import dataclass, field
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from rotorsoil_ros.arrays import ComplexArray, FloatArray, inside
from rotorsoil_ros.channel import DOFS
from rotorsoil_ros.errors import RotorSoilError

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline

# Printed tables carry four digits; anything worse is a slip of a row or a sign.
RECIPROCITY = 1e-3
PASSIVITY = 1e-6


@dataclass(frozen=True, slots=True, eq=False)
class ComplianceTable:
    """
    Compliance given at some frequencies, smoothly interpolated between them.

    Attributes
    ----------
    omega : (k,) float array
        Frequencies, increasing, at least two [rad/s].
    values : (k, 6, 6) complex array
        Compliance of the massless contact over (x, y, z, rx, ry, rz) at these frequencies
        [m/N], [1/N], [rad/(N m)].

    cut_offs : tuple of int
        Rows, rising, at which waves of a layer begin to travel: no smooth curve leads over them.
    branch_points : tuple of float
        Other frequencies, rising, at which they do so but softly, as losses make it [rad/s].

    Notes
    -----
    Cubic splines through real and imaginary parts, from one cut-off to the next; magnitude and
    phase are never interpolated.

    """

    omega: FloatArray
    values: ComplexArray
    cut_offs: tuple[int, ...] = ()
    branch_points: tuple[float, ...] = ()
    _splines: 'tuple[CubicSpline, ...]' = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        from scipy.interpolate import CubicSpline  # as slow to import as half of a start

        _require_frequencies(self.omega)
        _require_compliances(self.values, self.omega)
        ends = (0, *self.cut_offs, len(self.omega) - 1)
        object.__setattr__(self, '_splines', tuple(
            CubicSpline(self.omega[left:right + 1], self.values[left:right + 1])
            for left, right in pairwise(ends)))

    @property
    def singular(self) -> FloatArray:
        """Frequencies at which waves of a layer begin to travel, rising [rad/s]."""
        return np.sort(np.append(self._cuts, self.branch_points))

    @property
    def _cuts(self) -> FloatArray:
        return self.omega[list(self.cut_offs)]

    def compliance(self, omega: FloatArray) -> ComplexArray:
        """
        Return the compliance of the massless contact, (n, 6, 6) over (x, y, z, rx, ry, rz).

        Parameters
        ----------
        omega : (n,) float array
            Excitation frequencies [rad/s].

        Returns
        -------
        (n, 6, 6) complex array
            [m/N], [1/N] and [rad/(N m)].

        Raises
        ------
        OutOfTableError
            If a frequency lies outside the table.

        """
        omega = inside(omega, (float(self.omega[0]), float(self.omega[-1])), name='frequency',
                       unit='rad/s', where='the range of the compliance table')
        if not self.cut_offs:
            whole: ComplexArray = self._splines[0](omega)
            return whole
        values = np.empty((*omega.shape, 6, 6), dtype=complex)
        piece = np.searchsorted(self._cuts, omega, side='right')
        for index, spline in enumerate(self._splines):
            values[piece == index] = spline(omega[piece == index])
        return values


def _require_frequencies(omega: FloatArray) -> None:
    if not (omega.ndim == 1 and omega.size >= 2):
        raise RotorSoilError(
            f'frequencies of a compliance table must be a list of at least 2, got {omega.shape}')
    if not (np.isfinite(omega).all() and omega[0] >= 0.0):
        raise RotorSoilError(
            f'frequencies of a compliance table must be >= 0 rad/s and finite, got {omega[0]:g} '
            f'to {omega[-1]:g}')
    late = np.flatnonzero(~(np.diff(omega) > 0.0))
    if late.size:
        raise RotorSoilError(
            f'frequencies of a compliance table must increase, got {omega[late[0]]:g} before '
            f'{omega[late[0] + 1]:g} rad/s')


def _require_compliances(values: ComplexArray, omega: FloatArray) -> None:
    """Refuse what no passive ground can be: not finite, not reciprocal, giving energy."""
    if values.shape != (omega.size, 6, 6):
        raise RotorSoilError(
            f'compliances of a table must have shape ({omega.size}, 6, 6), got {values.shape}')
    if not np.isfinite(values).all():
        raise RotorSoilError('compliances of a table must be finite')
    # Rows have different units: only entries over their own diagonals can be compared.
    size = np.sqrt(np.abs(np.einsum('kii->ki', values)).max(axis=0))
    unit = np.where(size > 0.0, size, 1.0)
    relative = values / (unit[:, None] * unit)
    skew = np.abs(relative - relative.swapaxes(1, 2))
    if not skew.max() <= RECIPROCITY:
        k, i, j = np.unravel_index(skew.argmax(), skew.shape)
        raise RotorSoilError(
            f'compliances of a table must be reciprocal, N_ij = N_ji, got {values[k, i, j]:g} '
            f'for {DOFS[i]},{DOFS[j]} and {values[k, j, i]:g} for {DOFS[j]},{DOFS[i]} at '
            f'{omega[k]:g} rad/s')
    loss = np.linalg.eigvalsh(-(relative + relative.swapaxes(1, 2)).imag / 2.0)[:, 0]
    if not loss.min() >= -PASSIVITY:
        worst = int(loss.argmin())
        raise RotorSoilError(
            'compliances of a table must not give energy (-Im N positive semidefinite), got an '
            f'eigenvalue of {loss[worst]:g} relative to the diagonal at {omega[worst]:g} rad/s')
