"""What a contact looks like from above if it is no single rectangle: L, T, U and the like."""

from dataclasses import dataclass, replace
from itertools import pairwise
import math

import numpy as np

from rotorsoil_ros.arrays import BoolArray
from rotorsoil_ros.errors import require, RotorSoilError

# Edges this near to each other, over the largest half side, are one.
_TOUCH = 1e-9


@dataclass(frozen=True, slots=True)
class Part:
    """Rectangle of half-width b along x and half-length l along y, its centre at (x, y) [m]."""

    half_width: float
    half_length: float
    x: float
    y: float

    def __post_init__(self) -> None:
        require(0.0 < self.half_width < math.inf, 'half_width', '> 0 m and finite',
                self.half_width)
        require(0.0 < self.half_length < math.inf, 'half_length', '> 0 m and finite',
                self.half_length)
        require(math.isfinite(self.x), 'centre', 'finite, in m', self.x)
        require(math.isfinite(self.y), 'centre', 'finite, in m', self.y)

    @property
    def area(self) -> float:
        """Area, 4 b l [m^2]."""
        return 4.0 * self.half_width * self.half_length

    @property
    def ratio(self) -> float:
        """Long side over short side, at least 1."""
        sides = self.half_width, self.half_length
        return max(sides) / min(sides)

    @property
    def edges(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """First and last x, first and last y [m]."""
        return ((self.x - self.half_width, self.x + self.half_width),
                (self.y - self.half_length, self.y + self.half_length))


def clearance(one: Part, other: Part) -> float:
    """Return the distance between two rectangles [m]; negative where they overlap."""
    gaps = [max(second[0] - first[1], first[0] - second[1])
            for first, second in zip(one.edges, other.edges, strict=True)]
    return math.hypot(*gaps) if min(gaps) > 0.0 else max(gaps)


def beside(point: tuple[float, float], part: Part) -> float:
    """Return the distance of a point from a rectangle [m]; negative inside it."""
    return clearance(part, replace(part, half_width=1e-300, half_length=1e-300,
                                   x=point[0], y=point[1]))


def touching(one: Part, other: Part, slack: float) -> bool:
    """Return whether two rectangles share a piece of an edge, not only a corner."""
    gaps = [max(second[0] - first[1], first[0] - second[1])
            for first, second in zip(one.edges, other.edges, strict=True)]
    return min(gaps) < -slack and abs(max(gaps)) <= slack


@dataclass(frozen=True, slots=True)
class Plan:
    """
    Contact that is a union of rectangles, rigidly joined.

    Its centre, about which it turns, is the centroid of its area.

    Attributes
    ----------
    parts : tuple of Part
        Rectangles in one frame, side by side; they hang together and enclose no hole.

    """

    parts: tuple[Part, ...]

    def __post_init__(self) -> None:
        require(len(self.parts) > 0, 'parts', 'at least one rectangle', 0)
        for second, part in enumerate(self.parts):
            for first, other in enumerate(self.parts[:second]):
                depth = -clearance(part, other)
                if depth > self._slack:
                    raise RotorSoilError(f'parts must not overlap, got {depth:.4g} m of overlap '
                                         f'of parts {first} and {second}')
        self._refuse_apart()
        self._refuse_hole()

    @property
    def _slack(self) -> float:
        return _TOUCH * max(max(part.half_width, part.half_length) for part in self.parts)

    def _refuse_apart(self) -> None:
        reached, left = [0], set(range(1, len(self.parts)))
        for number in reached:
            beside_it = {other for other in left if touching(
                self.parts[number], self.parts[other], self._slack)}
            left -= beside_it
            reached += sorted(beside_it)
        if left:
            number = min(left)
            gap = min(clearance(self.parts[number], self.parts[one]) for one in reached)
            what = f'{gap:.4g} m between' if gap > self._slack else 'no more than a corner of'
            raise RotorSoilError(f'parts must touch along an edge, got {what} part {number} and '
                                 'the others; blocks that stand apart are foundations of their '
                                 'own')

    def _refuse_hole(self) -> None:
        lines = [sorted({edge for part in self.parts for edge in part.edges[axis]})
                 for axis in (0, 1)]
        middles = [[0.5 * (low + high) for low, high in pairwise(line)
                    if high - low > self._slack] for line in lines]
        empty: BoolArray = np.ones((len(middles[0]) + 2, len(middles[1]) + 2), dtype=bool)
        for i, x in enumerate(middles[0]):
            for j, y in enumerate(middles[1]):
                empty[i + 1, j + 1] = all(beside((x, y), part) > 0.0 for part in self.parts)
        outside: BoolArray = np.zeros_like(empty)
        outside[0, 0] = True
        while True:
            spread = outside.copy()
            for axis in (0, 1):
                for step in (-1, 1):
                    # The rim is empty: what is rolled around it lands on empty ground.
                    spread |= np.roll(outside, step, axis=axis)
            spread &= empty
            if (spread == outside).all():
                break
            outside = spread
        holes = np.argwhere(empty & ~outside)
        if len(holes):
            x, y = middles[0][holes[0][0] - 1], middles[1][holes[0][1] - 1]
            raise RotorSoilError(f'parts must not enclose a hole, got one about x {x:.4g} m, '
                                 f'y {y:.4g} m; leave out a part or fill the hole')

    @property
    def area(self) -> float:
        """Contact area [m^2]."""
        return sum(part.area for part in self.parts)

    @property
    def centroid(self) -> tuple[float, float]:
        """Centre of the contact in the frame of its parts [m]."""
        return (sum(part.area * part.x for part in self.parts) / self.area,
                sum(part.area * part.y for part in self.parts) / self.area)

    @property
    def centred(self) -> tuple[Part, ...]:
        """The parts about the centre of the contact."""
        x, y = self.centroid
        return tuple(replace(part, x=part.x - x, y=part.y - y) for part in self.parts)

    @property
    def second_moments(self) -> tuple[float, float, float]:
        """Second moments of area about x, y and z through the centre [m^4]."""
        about_x = sum(part.area * (part.half_length**2 / 3.0 + part.y**2) for part in self.centred)
        about_y = sum(part.area * (part.half_width**2 / 3.0 + part.x**2) for part in self.centred)
        return about_x, about_y, about_x + about_y

    @property
    def product_moment(self) -> float:
        """Integral of x y over the area about the centre [m^4]."""
        return sum(part.area * part.x * part.y for part in self.centred)

    @property
    def extents(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """First and last x, first and last y about the centre [m]."""
        edges = [part.edges for part in self.centred]
        (x0, x1), (y0, y1) = ((min(edge[axis][0] for edge in edges),
                               max(edge[axis][1] for edge in edges)) for axis in (0, 1))
        return (x0, x1), (y0, y1)

    @property
    def characteristic_length(self) -> float:
        """Length that makes a0 dimensionless: half of the whole width [m]."""
        (left, right), _ = self.extents
        return 0.5 * (right - left)
