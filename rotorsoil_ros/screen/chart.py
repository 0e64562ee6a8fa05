"""How is a diagram drawn whose axis is not time? Axes, ticks and lines in a plane of its own."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
import math

import numpy as np
import rerun as rr

from rotorsoil_ros.arrays import BoolArray, FloatArray

GRID, TEXT = (55, 55, 55), (185, 185, 185)
LINE = rr.Radius.ui_points(0.5)
STEPS = (1.0, 2.0, 5.0, 10.0)


@dataclass(frozen=True, slots=True)
class Axis:
    """
    Values from `low` to `high`, laid from `begin` to `end` of the plane.

    Attributes
    ----------
    low, high : float
        Ends, in the unit of the axis.
    begin, end : float
        Where they lie.
    is_log : bool
        Whether equal ratios are equally long.

    """

    low: float
    high: float
    begin: float
    end: float
    is_log: bool = False

    def place(self, values: FloatArray) -> FloatArray:
        """Return where values lie; what is beyond an end lies at it."""
        kept = np.clip(values, self.low, self.high)
        low, high = self.low, self.high
        if self.is_log:
            kept, low, high = np.log(kept), math.log(low), math.log(high)
        return np.asarray(self.begin + (kept - low) / (high - low) * (self.end - self.begin))

    def ticks(self, at_most: int) -> list[float]:
        """Return round values along the axis; of a logarithmic one its decades."""
        if self.is_log:
            first, last = math.ceil(math.log10(self.low)), math.floor(math.log10(self.high))
            return [10.0**decade for decade in range(first, last + 1)]
        rough = (self.high - self.low) / at_most
        step = round_up(rough)
        first = math.ceil(self.low / step - 1e-9)
        return [number * step for number in range(first, int(self.high / step + 1e-9) + 1)]


@dataclass(frozen=True, slots=True)
class Label:
    """A word and the place that it stands above."""

    text: str
    x: float
    y: float


def round_up(value: float) -> float:
    """Return the smallest of 1, 2, 5, 10, 20... and 0.5, 0.2, 0.1... that is not below."""
    decade = 10.0 ** math.floor(math.log10(value))
    return float(decade * min(step for step in STEPS if step >= 0.999 * value / decade))


def grid(x: Axis, y: Axis, *, x_ticks: Sequence[float], y_ticks: Sequence[float]) -> list[
        FloatArray]:
    """Return the lines of a frame and of its ticks."""
    lines = [[(at, y.begin), (at, y.end)] for at in
             {x.begin, x.end, *x.place(np.array(x_ticks)).tolist()}]
    lines += [[(x.begin, at), (x.end, at)] for at in
              {y.begin, y.end, *y.place(np.array(y_ticks)).tolist()}]
    return [np.array(line) for line in lines]


def curve(x: FloatArray, y: FloatArray, *, largest_step: float = math.inf) -> list[FloatArray]:
    """Return lines through points (n,), broken where one is NaN or y jumps."""
    known = np.isfinite(x) & np.isfinite(y)
    jumps = np.abs(np.diff(y, prepend=y[:1])) > largest_step
    return [np.column_stack([x[rows], y[rows]]) for rows in _pieces(known, jumps)]


def _pieces(known: BoolArray, breaks: BoolArray) -> Iterable[slice]:
    """Yield stretches of two rows or more that are known and not broken."""
    edges = np.flatnonzero(np.diff(known, prepend=False, append=False) | np.append(
        breaks & known, False))
    for begin, end in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
        if known[begin] and end - begin > 1:
            yield slice(begin, end)


def drawn_grid(lines: Sequence[FloatArray]) -> rr.LineStrips2D:
    """Return lines that stay in the background."""
    return rr.LineStrips2D(lines, colors=GRID, radii=LINE, draw_order=-10.0)


def written(labels: Sequence[Label]) -> rr.Points2D:
    """Return words in a plane."""
    return rr.Points2D(
        [(label.x, label.y) for label in labels], labels=[label.text for label in labels],
        colors=TEXT, radii=0.0, show_labels=True)
