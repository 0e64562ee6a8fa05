"""Which rectangles stand where on the ground, and at which other points it is asked."""

from dataclasses import dataclass, replace

import numpy as np

from rotorsoil_ros.arrays import FloatArray
from rotorsoil_ros.errors import RotorSoilError
from rotorsoil_ros.ground.plan import beside, clearance, Part
from rotorsoil_ros.ground.soil import Circle, Contact, parts_of

# Lengths are compared and stored to so many digits of the shortest half side.
_DIGITS = 9

# A point nearer to a block than this share of its shortest half side lies where tractions are
# concentrated: its motion would be off by more than a percent.
_NEAREST = 0.5

# Blocks that touch do not overlap.
_TOUCH = 1e-9


@dataclass(frozen=True, slots=True)
class Site:
    """
    Blocks and points on the ground, seen from above.

    Attributes
    ----------
    blocks : tuple of tuples of Part
        The rectangles of each block, about its own centre.
    centres : tuple of (x, y)
        Centre of each block, about which its rotations are [m].
    points : tuple of (x, y)
        Where on the ground motion is asked for, beside the blocks [m].

    """

    blocks: tuple[tuple[Part, ...], ...]
    centres: tuple[tuple[float, float], ...]
    points: tuple[tuple[float, float], ...] = ()

    def __post_init__(self) -> None:
        if not len(self.blocks) == len(self.centres) > 0:
            raise RotorSoilError(f'blocks must be as many as centres, at least one, got '
                                 f'{len(self.blocks)} and {len(self.centres)}')
        for second, block in enumerate(self.placed):
            for other in self.placed[:second]:
                clear = min(clearance(one, two) for one in block for two in other)
                if clear < -_TOUCH * self.extent:
                    raise RotorSoilError(f'blocks must not overlap, got {-clear:.4g} m')
        for point in self.points:
            near = min(beside(point, part) for block in self.placed for part in block)
            if not near >= _NEAREST * self.length:
                raise RotorSoilError(
                    f'point must be at least {_NEAREST * self.length:.3g} m away from every block '
                    f'(half of the shortest half side), got {max(near, 0.0):.3g} m at '
                    f'x {point[0]:g} m, y {point[1]:g} m')

    @classmethod
    def of(
        cls, contacts: tuple[Contact, ...], centres: tuple[tuple[float, float], ...],
        points: tuple[tuple[float, float], ...] = (),
    ) -> 'Site':
        """
        Place contacts on the ground.

        Raises
        ------
        RotorSoilError
            If a contact is a circle, blocks overlap or a point is not beside them.

        """
        blocks = []
        for contact in contacts:
            if isinstance(contact, Circle):
                raise RotorSoilError(
                    'contact must consist of rectangles for boundary elements, got a circle of '
                    f'radius {contact.radius:g} m; infinite_elements solve a circle')
            blocks.append(parts_of(contact))
        return cls(tuple(blocks), centres, points)

    @property
    def placed(self) -> tuple[tuple[Part, ...], ...]:
        """The rectangles of each block where they are on the ground."""
        return tuple(tuple(replace(part, x=part.x + x, y=part.y + y) for part in parts)
                     for parts, (x, y) in zip(self.blocks, self.centres, strict=True))

    @property
    def length(self) -> float:
        """Shortest half side of all rectangles [m]: what makes a0 dimensionless here."""
        return min(min(part.half_width, part.half_length)
                   for parts in self.blocks for part in parts)

    @property
    def extent(self) -> float:
        """Largest distance between any two places [m]."""
        corners = [(x, y) for parts in self.placed for part in parts
                   for x in part.edges[0] for y in part.edges[1]]
        places = np.array([*corners, *self.points])
        return float(np.hypot(*np.ptp(places, axis=0)))

    def scaled(self) -> 'Site':
        """Return the site over its `length`, the first block at the origin, rounded."""
        unit, (x0, y0) = self.length, self.centres[0]

        def over(value: float) -> float:
            # Never a negative zero: it would be another key.
            return round(value / unit, _DIGITS) + 0.0

        return Site(
            tuple(tuple(Part(over(part.half_width), over(part.half_length), over(part.x),
                             over(part.y)) for part in parts) for parts in self.blocks),
            tuple((over(x - x0), over(y - y0)) for x, y in self.centres),
            tuple((over(x - x0), over(y - y0)) for x, y in self.points))

    @property
    def rectangle(self) -> Part | None:
        """The only rectangle, if there is no other."""
        if len(self.blocks) > 1 or len(self.blocks[0]) > 1:
            return None
        part = self.blocks[0][0]
        return part if part.x == part.y == 0.0 else None

    def delays(self) -> tuple[FloatArray, FloatArray]:
        """Return distances between blocks (k, k), and from points to blocks (p, k)."""
        centres = np.array(self.centres)
        points = np.array(self.points).reshape(-1, 2)
        between, to_points = (np.hypot(*np.moveaxis(one[:, None] - centres, -1, 0))
                              for one in (centres, points))
        return between, to_points
