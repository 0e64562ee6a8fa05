"""How what a support gives way by continues to vibrations that decay."""

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
import math

import numpy as np

from rotorsoil_ros.arrays import ComplexArray, FloatArray
from rotorsoil_ros.errors import NotSolvedError
from rotorsoil_ros.ground.continuation import Continuation, Laws, typical_size
from rotorsoil_ros.ground.soil import second_opinion_of, singular_of
from rotorsoil_ros.ground.table import ComplianceTable
from rotorsoil_ros.machine.flexible.receptance import TELLS_MODES
from rotorsoil_ros.machine.support import Support

# Samples from which the compliance is continued, and those of a piece between branch points.
_SAMPLES = 120
_PIECE_SAMPLES = 48

# Rows of a table that a piece is fitted to in place of these, at least; and how far off a branch
# point is that was found in a table, at least, of itself.
_LEAST_ROWS = 8
_BLURRED = 0.003

# A piece is longer than this share of the highest frequency.
_NO_PIECE = 1e-6
# Relative to its end: in a shorter one no vibration is told, only the response.
_NARROW = 0.03


def _other(support: Support) -> Callable[[FloatArray], ComplexArray] | None:
    """Return what a second opinion says of the same, where some soil has one."""
    others = tuple(map(second_opinion_of, support.soil_models))
    if all(other is own for other, own in zip(others, support.soil_models, strict=True)):
        return None
    return replace(support, soil_models=others).motion_compliance


def continued(support: Support, span: tuple[float, float]) -> Continuation:
    """Return the compliance without any mass, continued from frequencies in a span."""
    low, high = span
    omega = np.unique(np.concatenate([
        np.linspace(low, high, _SAMPLES // 2),
        np.geomspace(max(low, 1e-3 * high), high, _SAMPLES // 2)]))
    # What has mass of its own, as a table of receptances, has mirror images of its poles at
    # negative frequencies, which grow where its damping is hysteretic.
    within = (-math.inf, math.inf) if support.table is None else (0.0, math.inf)
    return Continuation.of(omega, support.motion_compliance, other=_other(support),
                           within=within, law=_law(support))


def _law(support: Support) -> Laws | None:
    """
    Return what a table of seats follows; None without a table.

    Raises
    ------
    NotSolvedError
        If it is measured, or of few digits: noise is no function of decaying vibrations.

    """
    table = support.table
    if table is None:
        return None
    if table.poles is None:
        raise NotSolvedError(
            f'receptances of seats must follow one law within {TELLS_MODES:g} of a row to tell '
            f'how free vibrations decay, got {table.missed:.2g}: give computed ones with nine '
            'digits or more, or fit modes to measured ones (foundations, flexible, modes)')
    return table.poles


def _singular(support: Support, span: tuple[float, float]) -> FloatArray:
    """Return the branch points of all soils inside a span, rising [rad/s]."""
    low, high = span
    found = np.unique(np.concatenate([np.zeros(0), *map(singular_of, support.soil_models)]))
    return np.asarray(found[(found > low + _NO_PIECE * high)
                            & (found < (1.0 - _NO_PIECE) * high)])


def continued_by_pieces(
    support: Support, span: tuple[float, float],
) -> tuple[Continuation, ...]:
    """
    Return continuations between the frequencies where the soil has branch points.

    Each is fitted to frequencies of its own piece alone and holds for vibrations whose
    frequency lies in it; all have one size. Between two branch points so close that no
    function could be told from the next, there is none.
    """
    (low, high), singular = span, _singular(support, span)
    if not singular.size:
        return (continued(support, span),)
    edges = np.concatenate([[low], singular, [high]])
    edges = edges[np.diff(edges, prepend=-math.inf) > _NO_PIECE * high]
    edges[-1] = high
    along = 0.5 * (1.0 - np.cos(np.pi * np.arange(_PIECE_SAMPLES) / (_PIECE_SAMPLES - 1)))
    ends = [pair for pair in pairwise(edges.tolist()) if pair[1] - pair[0] > _NARROW * pair[1]]
    rows = _rows(support)
    samples = [_sampled(rows, pair, along) for pair in ends]
    size = typical_size(support.motion_compliance(np.concatenate(samples)))
    return tuple(
        Continuation.of(omega, support.motion_compliance, size, _other(support), within, within,
                        _blur(rows, within))
        for omega, within in zip(samples, ends, strict=True))


def _rows(support: Support) -> FloatArray:
    """Return the frequencies of the tables below the blocks, rising [rad/s]."""
    return np.unique(np.concatenate([np.zeros(0), *(
        soil.omega for soil in support.soil_models if isinstance(soil, ComplianceTable))]))


def _sampled(rows: FloatArray, ends: tuple[float, float], along: FloatArray) -> FloatArray:
    """
    Return where a piece is sampled: at the rows of a table, if it has enough of them there.

    A smooth curve through rows on both sides of a branch point belongs to neither.
    """
    left, right = ends
    inside = rows[(rows >= left) & (rows <= right)]
    return inside if len(inside) >= _LEAST_ROWS else left + (right - left) * along


def _blur(rows: FloatArray, ends: tuple[float, float]) -> float:
    """Return how far the rows of a table leave open where a piece ends; 0 without one."""
    if not rows.size:
        return 0.0
    around = np.clip(np.searchsorted(rows, ends), 1, len(rows) - 1)
    return max(0.5 * float(np.diff(rows)[around - 1].max()), _BLURRED * ends[1])
