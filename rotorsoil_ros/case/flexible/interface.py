"""Which motions of matrices are asked for: single ones, and means over the nodes of a place."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
import math
from pathlib import Path

import numpy as np
import scipy.sparse

from rotorsoil_ros.arrays import FloatArray
from rotorsoil_ros.case.entries.cells import at_once
from rotorsoil_ros.case.flexible.tables import Row
from rotorsoil_ros.channel import DOFS
from rotorsoil_ros.errors import InputError
from rotorsoil_ros.machine.flexible.body import CONTACT, Dof, SEAT
from rotorsoil_ros.machine.flexible.reduction import Sparse

# Places nearer than this are one [m].
_SAME_PLACE = 1e-3

# Nodes whose smallest principal extent is below this share of the largest lie on a line.
_ON_A_LINE = 1e-6


@dataclass(frozen=True)
class Interface:
    """
    What a table of motions asks of matrices.

    Attributes
    ----------
    dofs : tuple of Dof
        The motions.
    pick : (p, d) sparse matrix
        Each of them by the motions of the matrices.
    known : mapping of int to Dof
        Motions of the matrices whose place is known.

    """

    dofs: tuple[Dof, ...]
    pick: Sparse
    known: Mapping[int, Dof]

    @classmethod
    def of(
        cls, path: Path, rows: Sequence[Row], size: int,
        order: Mapping[tuple[int, int], int] | None,
    ) -> 'Interface':
        """
        Find the motions of a table in matrices.

        Parameters
        ----------
        path : Path
            Of the table.
        rows : sequence of Row
            What it says.
        size : int
            Number of motions of the matrices.
        order : mapping of (node, direction) to int, or None
            Which row these are, where a program says it.

        Raises
        ------
        InputError
            With the line that asks for what is not there.

        """
        found = _Found(path, size, order, [], [], {})
        places: dict[str, list[Row]] = {}
        for row in rows:
            if row.is_node:
                places.setdefault(row.dof.station, []).append(row)
        at_once([*(partial(found.single, row) for row in rows if not row.is_node),
                 *(partial(found.place, group) for group in places.values())])
        if not found.dofs:
            raise InputError(f'{path}: names no seat and no contact')
        pick = scipy.sparse.csc_matrix(np.stack(found.picks))
        return cls(tuple(found.dofs), pick, found.known)


@dataclass
class _Found:
    """Motions found so far."""

    path: Path
    size: int
    order: Mapping[tuple[int, int], int] | None
    dofs: list[Dof]
    picks: list[FloatArray]
    known: dict[int, Dof]

    def _indices(self, row: Row) -> list[int]:
        """Return which motions of the matrices a line means: one, or x, y and z of a node."""
        axes = DOFS[:3] if row.is_node else (row.dof.axis,)
        if row.node is not None:
            if self.order is None:
                raise InputError(f'{self.path}: line {row.line}: node needs the order of nodes '
                                 'that CalculiX writes (.dof beside .sti); use index')
            wanted = [self.order.get((row.node, DOFS.index(axis) + 1)) for axis in axes]
            found = [index for index in wanted if index is not None]
            if len(found) < len(axes):
                raise InputError(f'{self.path}: line {row.line}: node {row.node} has no motion '
                                 f'along {"".join(axes)} in the matrices')
        elif row.index is not None:
            found = list(range(row.index, row.index + len(axes)))
        else:
            raise InputError(f'{self.path}: line {row.line}: needs index or node')
        if max(found) >= self.size:
            raise InputError(
                f'{self.path}: line {row.line}: index must be up to {self.size - len(axes) + 1}, '
                f'the matrices have {self.size} motions, got {found[0] + 1}')
        for index, axis in zip(found, axes, strict=True):
            self._know(row, index, replace(row.dof, axis=axis))
        return found

    def _know(self, row: Row, index: int, dof: Dof) -> None:
        """Keep where a motion of the matrices is; whoever asks for it again has to agree."""
        known = self.known.setdefault(index, dof)
        if known.axis != dof.axis or math.dist(known.place, dof.place) > _SAME_PLACE:
            raise InputError(
                f'{self.path}: line {row.line}: index {index + 1} must be one motion of one '
                f'place, got {known.axis} of {known.station} at {known.place} and {dof.axis} of '
                f'{dof.station} at {dof.place}')

    def single(self, row: Row) -> None:
        """Add one motion."""
        [index] = self._indices(row)
        self.dofs.append(row.dof)
        self.picks.append(np.eye(1, self.size, index)[0])

    def place(self, group: Sequence[Row]) -> None:
        """Add what the nodes of a place do together: their mean, by area, and how they turn."""
        head = next((row for row in group if row.index is None and row.node is None), None)
        nodes = [row for row in group if row is not head]
        if not nodes:
            raise InputError(f'{self.path}: line {group[0].line}: {group[0].dof.station} has no '
                             'node')
        indices = []
        for row in nodes:
            own = self._indices(row)
            if own[0] in indices:
                raise InputError(f'{self.path}: line {row.line}: index {own[0] + 1} stands twice '
                                 f'in {row.dof.station}')
            if row.dof.kind != group[0].dof.kind:
                raise InputError(f'{self.path}: line {row.line}: kind of {row.dof.station} must '
                                 f'be the same on every line, got {row.dof.kind} and '
                                 f'{group[0].dof.kind}')
            indices += own
        area = np.array([row.dof.area or 1.0 for row in nodes])
        places = np.array([row.dof.place for row in nodes])
        middle = area @ places / area.sum() if head is None else np.array(head.dof.place)
        follows = _mean(places - middle, area)
        if follows is None and (head is not None or len(nodes) > 1):
            raise InputError(f'{self.path}: line {group[0].line}: the nodes of '
                             f'{group[0].dof.station} lie on a line: they do not tell how it '
                             'turns')
        motions = np.eye(3) if follows is None else follows
        whole = sum(row.dof.area for row in nodes)
        # Bearings ask a seat how it moves; what stands on another place, or is asked for, turns.
        axes = DOFS[:3] if group[0].dof.kind == SEAT else DOFS[:len(motions)]
        for axis, motion in zip(axes, motions, strict=False):
            pick = np.zeros(self.size)
            pick[indices] = motion
            x, y, z = middle.tolist()
            self.dofs.append(Dof(group[0].dof.station, axis, group[0].dof.kind, (x, y, z), whole))
            self.picks.append(pick)


def _mean(places: FloatArray, area: FloatArray) -> FloatArray | None:
    """Return the rigid motion that fits nodes about a place best, (6, 3 n); None on a line."""
    extent = np.linalg.svd(places - places.mean(axis=0), compute_uv=False)
    if len(places) < 3 or extent[1] < _ON_A_LINE * extent[0]:
        return None
    rows = np.concatenate([[Dof('', axis, CONTACT, (x, y, z)).rigid_row for axis in DOFS[:3]]
                           for x, y, z in places.tolist()])
    weight = np.sqrt(np.repeat(area, 3))
    return np.asarray(np.linalg.pinv(weight[:, None] * rows) * weight)
