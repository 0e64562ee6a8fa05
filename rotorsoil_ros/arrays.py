"""The array types of the floor."""

from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

FloatArray: TypeAlias = npt.NDArray[np.float64]
ComplexArray: TypeAlias = npt.NDArray[np.complexfloating[Any, Any]]
BoolArray: TypeAlias = npt.NDArray[np.bool_]
IntArray: TypeAlias = npt.NDArray[np.int64]


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
