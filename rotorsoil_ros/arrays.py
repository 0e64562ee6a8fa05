"""The array types of the floor, and what is taken for one."""

from collections.abc import Callable, Sequence
from itertools import pairwise
import math
from typing import Any, TypeAlias, TypeVar

import numpy as np
import numpy.typing as npt

from rotorsoil_ros.errors import OutOfTableError, RotorSoilError

FloatArray: TypeAlias = npt.NDArray[np.float64]
ComplexArray: TypeAlias = npt.NDArray[np.complexfloating[Any, Any]]
AnyArray: TypeAlias = npt.NDArray[np.inexact[Any]]
BoolArray: TypeAlias = npt.NDArray[np.bool_]
IntArray: TypeAlias = npt.NDArray[np.int64]
_Number = TypeVar('_Number', bound=np.inexact[Any])
Numbers: TypeAlias = float | Sequence[float] | FloatArray

# By which an end of a table may be passed, of itself: units go to and fro.
ROUNDING = 1e-12


def prominent_peaks(level: FloatArray, prominence: float) -> list[int]:
    """
    Return where a curve stands out by a prominence over the higher of the valleys beside it.

    Parameters
    ----------
    level : (n,) float array
        Samples of the curve; its ends are no peaks, a plateau has its peak in the middle.
    prominence : float
        In the unit of the curve.

    Notes
    -----
    The prominence of a peak is measured down to the lowest point between it and the next
    higher sample, or the end, on either side.

    """
    peaks = []
    rises = np.flatnonzero(np.diff(level) != 0.0)
    for left, right in zip(rises[:-1].tolist(), rises[1:].tolist(), strict=True):
        height = level[right]
        if not (level[left] < height > level[right + 1]):
            continue
        valleys = []
        for side in (level[left::-1], level[right + 1:]):
            higher = np.flatnonzero(side > height)
            valleys.append(side[:higher[0] if len(higher) else None].min())
        if height - max(valleys) >= prominence:
            peaks.append((left + 1 + right) // 2)
    return peaks


def numbers(name: str, given: Numbers) -> FloatArray:
    """Return finite numbers >= 0 as a flat array, (n,)."""
    found = np.atleast_1d(np.asarray(given, dtype=float))
    if found.ndim != 1 or not len(found):
        raise RotorSoilError(f'{name} must be one number or some, got shape {found.shape}')
    wrong = found[~((found >= 0.0) & (found < math.inf))]
    if len(wrong):
        raise RotorSoilError(f'{name} must be >= 0 and finite, got {wrong[0]:g}')
    return found


def inside(
    given: FloatArray, span: tuple[float, float], *, name: str, unit: str, where: str,
    shown: Callable[[float], float] = float,
) -> FloatArray:
    """
    Return numbers within the ends of a table; what rounding has put beyond them is on them.

    Raises
    ------
    OutOfTableError
        If one lies outside; the message says what must be where and got which value, all in
        the unit as it is shown.

    """
    low, high = span
    held: FloatArray = np.clip(np.asarray(given, dtype=float), low, high)
    outside = ~(np.abs(given - held) <= ROUNDING * np.abs(held))
    if outside.any():
        raise OutOfTableError(
            f'{name} must be in [{shown(low):g}, {shown(high):g}] {unit}, {where}, got '
            f'{shown(float(np.asarray(given)[outside][0])):g}')
    return held


def side_by_side(found: Sequence[npt.NDArray[_Number]], *count: int) -> npt.NDArray[_Number]:
    """Return matrices (*count, d, e) as the blocks of larger ones that nothing couples."""
    rows, columns = (np.cumsum([0, *(one.shape[axis] for one in found)]).tolist()
                     for axis in (-2, -1))
    total = np.zeros((*count, rows[-1], columns[-1]),
                     dtype=np.result_type(*found) if found else complex)
    for one, high, wide in zip(found, pairwise(rows), pairwise(columns), strict=True):
        total[..., slice(*high), slice(*wide)] = one
    return total
