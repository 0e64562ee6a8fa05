"""What is known of layered ground over frequency: rational functions between its cut-offs."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from rotorsoil_ros.arrays import ComplexArray, FloatArray, inside
from rotorsoil_ros.ground.rational import RationalMatrix

ENTRIES = ('xx', 'zz', 'rxrx', 'ryry', 'rzrz', 'x_ry', 'y_rx')


@dataclass(frozen=True, slots=True, eq=False)
class LayeredTable:
    """
    What layered ground answers over frequency, in units of one of its soils.

    Attributes
    ----------
    edges : (p + 1,) float array
        Ends of the pieces, rising from 0: all but the ends are singular frequencies [-].
    pieces : tuple of p RationalMatrix
        Functions of a0: of a disc below whose base lies the soil of the units, `ENTRIES`.
    poorer : tuple of p RationalMatrix
        The same through fewer solves: both agree where the solves decide.
    measured_error : float
        Largest error of any piece at frequencies that it had not seen, or, where that is larger,
        its largest change anywhere when they were added to it; relative, of a coupling to the
        mean of its diagonals.
    solves, nodes : int
        Number of exact solves, and of nodes over the depth.

    """

    edges: FloatArray
    pieces: tuple[RationalMatrix, ...]
    poorer: tuple[RationalMatrix, ...]
    measured_error: float
    solves: int
    nodes: int

    def compliance(self, a0: FloatArray) -> ComplexArray:
        """
        Return the dimensionless values, (n, q), of a disc over `ENTRIES`.

        Raises
        ------
        OutOfTableError
            If a frequency lies outside the range that was solved.

        """
        a0 = inside(a0, (0.0, float(self.edges[-1])), name='a0', unit='[-]',
                    where='the range of the table')
        piece = np.clip(np.searchsorted(self.edges, a0, side='right') - 1, 0,
                        len(self.pieces) - 1)
        values = np.zeros((len(a0), self.pieces[0].values.shape[1]), dtype=complex)
        for index in np.unique(piece):
            own = piece == index
            values[own] = self.pieces[index](a0[own].astype(complex))
        return values

    @property
    def second(self) -> 'LayeredTable':
        """The table with its poorer functions in place of its own."""
        return replace(self, pieces=self.poorer)

    def to_arrays(self) -> dict[str, npt.NDArray[Any]]:
        """Return the table as plain arrays, for a file that needs no pickle."""
        functions = (*self.pieces, *self.poorer)
        return {
            'edges': self.edges,
            'sizes': np.array([len(one.nodes) for one in functions]),
            'support': np.concatenate([one.nodes for one in functions]),
            'values': np.concatenate([one.values for one in functions]),
            'weights': np.concatenate([one.weights for one in functions]),
            'measured_error': np.array(self.measured_error),
            'solves': np.array(self.solves), 'nodes': np.array(self.nodes),
        }

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, npt.NDArray[Any]]) -> 'LayeredTable':
        """Return the table that `to_arrays` took apart."""
        ends = np.cumsum(arrays['sizes'])[:-1]
        functions = tuple(map(RationalMatrix, *(
            np.split(arrays[name], ends) for name in ('support', 'values', 'weights'))))
        half = len(arrays['edges']) - 1
        return cls(arrays['edges'], functions[:half], functions[half:],
                   float(arrays['measured_error']), int(arrays['solves']), int(arrays['nodes']))


def entry_scale(values: ComplexArray) -> FloatArray:
    """Return what an error of each entry is measured against, (n, 7)."""
    scale = np.abs(values)
    scale[:, 5] = np.sqrt(scale[:, 0] * scale[:, 3])
    scale[:, 6] = np.sqrt(scale[:, 0] * scale[:, 2])
    return np.asarray(scale)
