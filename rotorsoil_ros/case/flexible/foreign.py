"""Whose file is it? What programs write that is not read here, and the way out of each."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
import re

from rotorsoil_ros.case.document import shown
from rotorsoil_ros.errors import InputError

_LARGEST_BYTES = 512 * 1024 * 1024
# How much of a file tells whose it is.
_HEAD = 4096

_OUTSIDE = 'convert it outside to Matrix Market, scipy.io.mmwrite("K.mtx", K, precision=16)'
_DMIG = ('DMIG of Nastran', f'read it with pyNastran (read_bdf, then dmigs["KAAX"]); {_OUTSIDE}')
_OP2 = ('an op2 of Nastran', f'read it with pyNastran (read_op2); {_OUTSIDE}')
_OP4 = ('an op4 of Nastran', f'read it with pyNastran (read_op4); {_OUTSIDE}')
_ANSYS = ('of ANSYS', 'HBMAT is not readable by scipy where it is symmetric: read .full or .sub '
          f'with ansys-mapdl-reader (load_km); {_OUTSIDE}')
_HARWELL = ('Harwell-Boeing, as HBMAT of ANSYS', 'scipy does not read it where it is symmetric: '
            f'read .full or .sub with ansys-mapdl-reader (load_km); {_OUTSIDE}')
_ABAQUS = ('a substructure of Abaqus or CalculiX, no Matrix Market in spite of its suffix',
           'CalculiX writes no mass there: use *FREQUENCY, SOLVER=MATRIXSTORAGE; of Abaqus read '
           f'it with abaqus-mtx-parser; {_OUTSIDE}')
_FMU = ('a functional mock-up unit', 'it runs in time and knows no soil that depends on '
        'frequency: export stiffness and mass, or modes with their residual')
_INPUT = ('an input of a program', 'let it write its matrices: CalculiX by *FREQUENCY, '
          'SOLVER=MATRIXSTORAGE')
_NUMPY = ('of numpy', f'read it with scipy.sparse.load_npz or numpy.load; {_OUTSIDE}')
_MATLAB = ('of MATLAB', f'read it with scipy.io.loadmat, or h5py from version 7.3; {_OUTSIDE}')
_HDF5 = ('HDF5', f'read it with h5py; {_OUTSIDE}')
_EXCEL = ('a workbook', 'save its sheet as CSV')

# By suffix, of what has no mark of its own.
_BY_SUFFIX = {
    **dict.fromkeys(('.pch', '.dmig', '.bdf', '.dat'), _DMIG), '.op2': _OP2, '.op4': _OP4,
    **dict.fromkeys(('.full', '.sub', '.rst', '.hb', '.rb', '.cdb'), _ANSYS),
    '.fmu': _FMU, '.inp': _INPUT, '.mat': _MATLAB, '.npz': _NUMPY, '.npy': _NUMPY,
    **dict.fromkeys(('.h5', '.hdf5'), _HDF5), **dict.fromkeys(('.xlsx', '.xls'), _EXCEL)}
# By how a file begins, whatever it is called; the first that fits.
_BY_CONTENT = tuple((re.compile(pattern), whose) for pattern, whose in (
    (rb'PK\x03\x04(?s:.{0,200})\.npy|\x93NUMPY', _NUMPY),
    (rb'PK\x03\x04(?s:.{0,4000})(\[Content_Types\]|xl/)', _EXCEL),
    (rb'PK\x03\x04', _FMU),
    (rb'MATLAB', _MATLAB),
    (rb'\x89HDF', _HDF5),
    (rb'(?s:.{0,400})NASTRAN FORT TAPE ID CODE|\x04\x00\x00\x00', _OP2),
    (rb'\s*(-?\d+\s+){3,4}\S.*1P,\d+E\d+\.\d+', _OP4),
    (rb'(?s:.{0,4000}?)(\A|\n)DMIG[\s*,]|\$TITLE', _DMIG),
    (rb'[^\n]*\n[^\n]*\n[RCP][SUHZR][AE]\s', _HARWELL),
    # Matrices in an input are between comments; a mesh is told by its nodes.
    (rb'(?i)\s*(\*\*[^\n]*\s+)*\*(HEADING|NODE\b|INCLUDE|PART)', _INPUT),
    (rb'(?i)\s*(\*\*|\*USER ELEMENT|\*MATRIX)', _ABAQUS)))


def content_of(path: Path) -> bytes:
    """
    Return what a file holds.

    Raises
    ------
    InputError
        If it cannot be read, or is what a program writes that is not read here; with the way out.

    """
    with reading(path):
        try:
            if path.stat().st_size > _LARGEST_BYTES:
                raise InputError(f'{path}: must be smaller than {_LARGEST_BYTES} bytes')
            content = path.read_bytes()
        except OSError as error:
            raise InputError(f'{path}: cannot be read: {error.strerror}') from error
    whose = next((whose for mark, whose in _BY_CONTENT if mark.match(content[:_HEAD])), None)
    if whose is not None:
        raise _refusal(path, whose)
    return content


def text_of(path: Path) -> str:
    """Return what a text file says; an InputError tells why it cannot be read."""
    with reading(path):
        content = content_of(path)
        try:
            text = content.decode('utf-8-sig')
        except UnicodeDecodeError as error:
            raise InputError(f'{path}: is not a text file in UTF-8 (byte {error.start})') \
                from error
        if '\0' in text:
            raise InputError(f'{path}: is not a text file (it holds zero bytes)')
        return text


@contextmanager
def reading(path: Path) -> Iterator[None]:
    """Say of a file that is not what it should be whose it is, as far as its suffix tells."""
    try:
        yield
    except InputError as error:
        whose = _BY_SUFFIX.get(path.suffix.lower())
        if whose is None:
            raise
        raise _refusal(path, whose) from error


def begins(content: bytes) -> str:
    """Return how a file begins, to show it."""
    return shown(content.lstrip()[:20].decode(errors='replace'))


def _refusal(path: Path, whose: tuple[str, str]) -> InputError:
    return InputError(f'{path}: is {whose[0]}, which is not read here; {whose[1]}')
