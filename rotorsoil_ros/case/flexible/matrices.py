"""What the matrices of finite elements say: Matrix Market, or what CalculiX writes."""

from functools import partial
from io import BytesIO
from pathlib import Path

import numpy as np
import scipy.io
import scipy.sparse

from rotorsoil_ros.arrays import FloatArray
from rotorsoil_ros.case.document import shown
from rotorsoil_ros.case.entries.cells import at_once, number, whole
from rotorsoil_ros.case.flexible.foreign import begins, content_of, reading
from rotorsoil_ros.errors import InputError
from rotorsoil_ros.machine.flexible.reduction import Sparse

_MOST_MOTIONS = 200_000
_MARKET = b'%%MatrixMarket'
# Kinds of it that are no stiffness and no mass.
_NOT_REAL = {'complex', 'pattern', 'skew-symmetric', 'hermitian'}
STIFFNESS, MASS, ORDER = '.sti', '.mas', '.dof'
# Fortran's exponents as C reads them.
_EXPONENTS = bytes.maketrans(b'Dd', b'Ee')


def read(path: Path) -> Sparse:
    """
    Read a real square matrix.

    Parameters
    ----------
    path : Path
        Matrix Market, whatever its name; or `.sti`, `.mas` of CalculiX.

    Raises
    ------
    InputError
        If it is another format, of which is said what to do, or damaged, with every line that is.

    """
    content = content_of(path)
    with reading(path):
        if content.lstrip().startswith(_MARKET):
            return _of_market(path, content)
        if path.suffix.lower() in (STIFFNESS, MASS):
            return _of_calculix(path, content)
        raise InputError(f'{path}: must begin with %%MatrixMarket, got {begins(content)}' + (
            f'; call the stiffness and mass of CalculiX {STIFFNESS} and {MASS}'
            if _is_triple(content) else ''))


def _of_market(path: Path, content: bytes) -> Sparse:
    header = content.lstrip().split(b'\n', 1)[0].decode(errors='replace').lower().split()
    for word in _NOT_REAL & {*header[3:]}:
        raise InputError(f'{path}: must be real or integer, and general or symmetric, got {word}'
                         + ('; damping is given by loss_factor' if word == 'complex' else ''))
    comma = None if b',' not in content else next((
        number for number, line in enumerate(content.splitlines(), 1)
        if b',' in line and not line.lstrip().startswith(b'%')), None)
    if comma is not None:
        raise InputError(f'{path}: line {comma}: numbers must be separated by blanks, and '
                         'decimals by points, got a comma')
    try:
        found = scipy.io.mmread(BytesIO(content.lstrip()))
    except (ValueError, OverflowError, MemoryError, EOFError) as error:
        raise InputError(f'{path}: is no whole Matrix Market file: {error}') from error
    return _checked(path, scipy.sparse.csc_matrix(found))


def _checked(path: Path, matrix: Sparse) -> Sparse:
    rows, columns = matrix.shape
    if rows != columns or not 0 < rows <= _MOST_MOTIONS:
        raise InputError(f'{path}: must be square with up to {_MOST_MOTIONS} motions, got {rows} '
                         f'x {columns}')
    if not np.all(np.isfinite(matrix.data)):
        raise InputError(f'{path}: must hold finite numbers only')
    return matrix.astype(float)


def _is_triple(content: bytes) -> bool:
    first = content.split(b'\n', 1)[0].split()
    return len(first) == 3 and all(cell.isdigit() for cell in first[:2])


def _of_calculix(path: Path, content: bytes) -> Sparse:
    """Return a matrix of which every line says row, column and value of one triangle."""
    table = _triples(path, content.translate(_EXPONENTS))
    row, column = table[:, :2].astype(int).T - 1
    size = int(max(row.max(), column.max())) + 1
    if size > _MOST_MOTIONS:
        raise InputError(f'{path}: must have up to {_MOST_MOTIONS} motions, got {size}')
    if np.any(row < column) and np.any(row > column):
        raise InputError(f'{path}: must hold one triangle of a symmetric matrix, got both')
    place, times = np.unique(row * size + column, return_counts=True)
    if times.max() > 1:
        twice = int(place[times.argmax()])
        raise InputError(f'{path}: row {twice // size + 1}, column {twice % size + 1} stands here '
                         f'{times.max()} times')
    half = scipy.sparse.coo_matrix((table[:, 2], (row, column)), shape=(size, size)).tocsc()
    both = half + half.T - scipy.sparse.diags(half.diagonal())
    return _checked(path, both.tocsc())


def _triples(path: Path, content: bytes) -> FloatArray:
    """Return rows, columns and values, (n, 3)."""
    if not content.strip():
        raise InputError(f'{path}: is empty')
    try:
        table = np.loadtxt(BytesIO(content), ndmin=2)
    except ValueError:
        table = np.empty((0, 0))
    indices = table[:, :2]
    if table.shape[1] == 3 and len(table) and np.all(np.isfinite(table)) and np.all(
            indices >= 1.0) and not np.any(indices % 1.0):
        return table
    # Slower, line by line, of a file that is damaged.
    lines = content.decode('utf-8', errors='replace').splitlines()
    return np.array(at_once(partial(_triple, path, line, text.split())
                            for line, text in enumerate(lines, start=1) if text.strip()))


def _triple(path: Path, line: int, cells: list[str]) -> list[float]:
    if len(cells) != 3:
        raise InputError(f'{path}: line {line}: must be row, column and value, got '
                         f'{shown(" ".join(cells))}')
    row, column, value = cells
    return [whole(path, line, 'row', row), whole(path, line, 'column', column),
            number(path, line, 'value', value)]


def order_of_calculix(path: Path, size: int) -> dict[tuple[int, int], int]:
    """Return which row a node's direction, 1 to 3 of x, y, z, has in matrices of a size."""
    lines = content_of(path).decode('utf-8', errors='replace').splitlines()
    found: dict[tuple[int, int], int] = {}

    def add(line: int, entry: str) -> None:
        node, _, direction = entry.partition('.')
        if not (node.isdigit() and direction.isdigit()):
            raise InputError(f'{path}: line {line}: must be node.direction, got {shown(entry)}')
        if (int(node), int(direction)) in found:
            raise InputError(f'{path}: line {line}: {entry} stands here twice')
        found[int(node), int(direction)] = len(found)

    at_once(partial(add, line, text.strip()) for line, text in enumerate(lines, start=1)
            if text.strip())
    if len(found) != size:
        raise InputError(f'{path}: must name the {size} motions of the matrices beside it, '
                         f'got {len(found)}')
    return found
