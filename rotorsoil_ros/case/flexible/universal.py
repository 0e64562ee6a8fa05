"""What a test of modes says that came as a universal file: data sets 55."""

from pathlib import Path
from typing import Any

import numpy as np

from rotorsoil_ros.arrays import ComplexArray, FloatArray
from rotorsoil_ros.channel import Channel, DOFS
from rotorsoil_ros.errors import InputError

# Share of a shape that may be out of phase.
_REAL = 0.05
_MODES = 55


def is_universal(path: Path, text: str) -> bool:
    """Whether a file is a universal one, or ought to be."""
    return text.lstrip().partition('\n')[0].strip() == '-1' or (
        path.suffix.lower() in ('.unv', '.uff') and not text.lstrip().startswith('dof'))


def modes(path: Path) -> tuple[list[str], FloatArray, FloatArray]:
    """
    Read the mode shapes of a universal file.

    Parameters
    ----------
    path : Path
        Data sets 55 of normal modes; node n moves as `node_<n>_x` and so on.

    Returns
    -------
    names, frequency (m,) [Hz], shapes (p, m)
        Of unit mass [1/sqrt(kg)].

    Raises
    ------
    InputError
        If there is no such file, no such data set, or shapes that are not those of modes of a
        known mass.

    """
    try:
        import pyuff
    except ImportError as error:
        raise InputError(f'{path}: needs pyuff: pip install "rotorsoil_ros[tables]"') from error
    try:
        file = pyuff.UFF(str(path))
        sets = [file.read_sets(place) for place, kind in enumerate(file.get_set_types())
                if int(kind) == _MODES]
    except Exception as error:  # pyuff raises nothing narrower
        raise InputError(f'{path}: is not a universal file ({error})') from error
    if not sets:
        raise InputError(f'{path}: holds no data set {_MODES}, mode shapes')
    nodes = [int(node) for node in sets[0]['node_nums']]
    frequency, shapes = [], []
    for place, found in enumerate(sets, 1):
        where = f'{path}: data set {_MODES} number {place}'
        if [int(node) for node in found['node_nums']] != nodes:
            raise InputError(f'{where}: has other nodes than the first')
        frequency.append(float(found.get('freq') or 0.0))
        shapes.append(_shape(where, found))
    names = [Channel(f'node_{node}', '', axis).name for node in nodes for axis in DOFS[:3]]
    return names, np.array(frequency), np.stack(shapes, axis=1)


def _shape(where: str, found: dict[str, Any]) -> FloatArray:
    """Return x, y and z of every node of one mode of unit mass."""
    if not float(found.get('freq') or 0.0) > 0.0:
        raise InputError(f'{where}: must be an elastic mode with a frequency > 0 Hz')
    mass = float(found.get('modal_m') or 0.0)
    if not mass > 0.0:
        raise InputError(f'{where}: must have a modal mass > 0 kg, got {mass:g}: shapes without '
                         'one have no scale')
    moved: ComplexArray = np.stack([np.asarray(found[f'r{axis}'], dtype=complex)
                                    for axis in (1, 2, 3)], axis=1).ravel()
    largest = moved[np.abs(moved).argmax()]
    turned = moved * np.exp(-1j * np.angle(largest)) if largest != 0.0 else moved
    if np.abs(turned.imag).max() > _REAL * np.abs(turned).max():
        raise InputError(f'{where}: is a complex mode; give the real modes of the body')
    return np.asarray(turned.real / np.sqrt(mass))
