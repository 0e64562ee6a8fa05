"""What the matrices of finite elements say: Matrix Market, CalculiX, and who else is refused."""

from collections.abc import Sequence
from io import BytesIO
from pathlib import Path

import numpy as np
import scipy.io
import scipy.sparse

from rotorsoil_ros.case.document import shown
from rotorsoil_ros.errors import InputError
from rotorsoil_ros.machine.flexible.reduction import Sparse

_LARGEST_BYTES = 512 * 1024 * 1024
_MOST_MOTIONS = 200_000

# By its suffix, whose a file is that is not read here, and how it becomes one that is.
_OUTSIDE = 'convert it outside to Matrix Market, scipy.io.mmwrite("K.mtx", K, precision=16)'
_FOREIGN = {
    **dict.fromkeys(('.pch', '.dmig', '.bdf', '.dat'), (
        'DMIG of Nastran', f'read it with pyNastran (read_bdf, then dmigs["KAAX"]); {_OUTSIDE}')),
    '.op2': ('an op2 of Nastran', f'read it with pyNastran (read_op2); {_OUTSIDE}'),
    '.op4': ('an op4 of Nastran', f'read it with pyNastran (read_op4); {_OUTSIDE}'),
    **dict.fromkeys(('.full', '.sub', '.rst', '.hb', '.rb', '.cdb'), (
        'of ANSYS', 'HBMAT is not readable by scipy where it is symmetric: read .full or .sub '
        f'with ansys-mapdl-reader (load_km); {_OUTSIDE}')),
    '.fmu': ('a functional mock-up unit', 'it runs in time and knows no soil that depends on '
             'frequency: export stiffness and mass, or modes with their residual'),
    '.inp': ('an input of a program', 'let it write its matrices: CalculiX by *FREQUENCY, '
             'SOLVER=MATRIXSTORAGE'),
}
STIFFNESS, MASS, ORDER = '.sti', '.mas', '.dof'


def refuse_foreign(path: Path) -> None:
    """Raise an InputError at a file of a program that is not read, with the way out."""
    found = _FOREIGN.get(path.suffix.lower())
    if found is not None:
        raise InputError(f'{path}: is {found[0]}, which is not read here; {found[1]}')


def read(path: Path) -> Sparse:
    """
    Read a real square matrix.

    Parameters
    ----------
    path : Path
        Matrix Market, or `.sti`, `.mas` of CalculiX.

    Raises
    ------
    InputError
        If it is another format, of which is said what to do, or damaged.

    """
    refuse_foreign(path)
    content = _content(path)
    if path.suffix.lower() in (STIFFNESS, MASS):
        return _of_calculix(path, content)
    start = content.lstrip()[:200]
    if start.startswith((b'**', b'*USER', b'*MATRIX')):
        raise InputError(f'{path}: is a substructure of Abaqus or CalculiX, no Matrix Market in '
                         'spite of its suffix; CalculiX writes no mass there: use *FREQUENCY, '
                         'SOLVER=MATRIXSTORAGE; of Abaqus read it with abaqus-mtx-parser and '
                         f'{_OUTSIDE.removeprefix("convert it outside to Matrix Market, ")}')
    if not start.startswith(b'%%MatrixMarket'):
        raise InputError(f'{path}: must begin with %%MatrixMarket, got '
                         f'{shown(start[:20].decode(errors="replace"))}')
    try:
        found = scipy.io.mmread(BytesIO(content))
    except (ValueError, OverflowError, MemoryError, EOFError) as error:
        raise InputError(f'{path}: is no whole Matrix Market file: {error}') from error
    return _checked(path, scipy.sparse.csc_matrix(found))


def _content(path: Path) -> bytes:
    try:
        if path.stat().st_size > _LARGEST_BYTES:
            raise InputError(f'{path}: must be smaller than {_LARGEST_BYTES} bytes')
        return path.read_bytes()
    except OSError as error:
        raise InputError(f'{path}: cannot be read: {error.strerror}') from error


def _checked(path: Path, matrix: Sparse) -> Sparse:
    rows, columns = matrix.shape
    if rows != columns or not 0 < rows <= _MOST_MOTIONS:
        raise InputError(f'{path}: must be square with up to {_MOST_MOTIONS} motions, got {rows} '
                         f'x {columns}')
    if np.iscomplexobj(matrix.data):
        raise InputError(f'{path}: must be real; damping is given by loss_factor')
    if not np.all(np.isfinite(matrix.data)):
        raise InputError(f'{path}: must hold finite numbers only')
    return matrix.astype(float)


def _of_calculix(path: Path, content: bytes) -> Sparse:
    """Return a matrix of which every line says row, column and value of the upper triangle."""
    try:
        table = np.loadtxt(BytesIO(content), ndmin=2)
    except ValueError as error:
        raise InputError(f'{path}: each line must be row, column and value: {error}') from error
    if table.shape[1] != 3 or not len(table) or table[:, :2].min() < 1:
        raise InputError(f'{path}: each line must be row and column from 1 on and value')
    row, column = table[:, :2].astype(int).T - 1
    size = int(max(row.max(), column.max())) + 1
    if size > _MOST_MOTIONS:
        raise InputError(f'{path}: must have up to {_MOST_MOTIONS} motions, got {size}')
    half = scipy.sparse.coo_matrix((table[:, 2], (row, column)), shape=(size, size)).tocsc()
    both = half + half.T - scipy.sparse.diags(half.diagonal())
    return _checked(path, both.tocsc())


def order_of_calculix(path: Path) -> dict[tuple[int, int], int]:
    """Return which row a node's direction, 1 to 3 of x, y, z, has in the matrices beside it."""
    lines: Sequence[str] = _content(path).decode('utf-8', errors='replace').split()
    found = {}
    for row, entry in enumerate(lines):
        node, _, direction = entry.partition('.')
        if not (node.isdigit() and direction.isdigit()):
            raise InputError(f'{path}: line {row + 1}: must be node.direction, got '
                             f'{shown(entry)}')
        found[int(node), int(direction)] = row
    return found
